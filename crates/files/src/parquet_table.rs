//! Tables of results as Parquet: columns of numbers and of texts, each of which may lack cells.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::record::Field;
use parquet::schema::types::Type;

/// A column of a table, with its name and a cell for each row; none: an empty cell.
#[derive(Clone, Debug, PartialEq)]
pub enum TableColumn {
    /// Double precision.
    Numbers(String, Vec<Option<f64>>),
    /// UTF-8.
    Texts(String, Vec<Option<String>>),
}

impl TableColumn {
    /// What it is called.
    pub fn name(&self) -> &str {
        match self {
            Self::Numbers(name, _) | Self::Texts(name, _) => name,
        }
    }

    /// Number of its cells.
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(_, cells) => cells.len(),
            Self::Texts(_, cells) => cells.len(),
        }
    }

    /// True without a cell.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn description(&self) -> Result<Type, ParquetError> {
        let of = |physical| Type::primitive_type_builder(self.name(), physical).with_repetition(Repetition::OPTIONAL);
        match self {
            Self::Numbers(..) => of(Physical::DOUBLE).build(),
            Self::Texts(..) => of(Physical::BYTE_ARRAY).with_logical_type(Some(LogicalType::String)).build(),
        }
    }
}

/// Writes a table as Parquet, uncompressed and in one group of rows: the same bytes for the same table.
///
/// # Errors
/// What the writer says; columns of different lengths or of the same name.
pub fn write_parquet(columns: &[TableColumn], out: &mut (impl Write + Send)) -> io::Result<()> {
    let refuse = |problem: String| Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    for (k, column) in columns.iter().enumerate() {
        if column.len() != columns[0].len() {
            return refuse(format!("the column `{}` has another length than the first", column.name()));
        }
        if columns[..k].iter().any(|before| before.name() == column.name()) {
            return refuse(format!("two columns are called `{}`", column.name()));
        }
    }
    written(columns, out).map_err(io::Error::other)
}

fn written(columns: &[TableColumn], out: &mut (impl Write + Send)) -> Result<(), ParquetError> {
    let fields = columns.iter().map(|column| column.description().map(Arc::new)).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("table").with_fields(fields).build()?;
    let program = format!("sindyscope {}", env!("CARGO_PKG_VERSION"));
    let properties = WriterProperties::builder().set_created_by(program).build();
    let mut file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
    let mut rows = file.next_row_group()?;
    for column in columns {
        let Some(mut writer) = rows.next_column()? else { break };
        match column {
            TableColumn::Numbers(_, cells) => put::<DoubleType>(&mut writer, cells.iter().copied())?,
            TableColumn::Texts(_, cells) => {
                put::<ByteArrayType>(&mut writer, cells.iter().map(|cell| cell.as_deref().map(ByteArray::from)))?;
            }
        }
        writer.close()?;
    }
    rows.close()?;
    file.close()?;
    Ok(())
}

/// Writes a column's cells: the values that there are, and a level for every row that says whether there is one.
fn put<T: DataType>(
    writer: &mut SerializedColumnWriter<'_>,
    cells: impl Iterator<Item = Option<T::T>>,
) -> Result<(), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for cell in cells {
        levels.push(i16::from(cell.is_some()));
        values.extend(cell);
    }
    writer.typed::<T>().write_batch(&values, Some(&levels), None)?;
    Ok(())
}

/// Reads a table of plain columns, as [`write_parquet`] and the usual programs write them: a column of numbers comes as numbers (whole
/// ones too), any other as texts, what is null as an empty cell.
///
/// # Errors
/// It cannot be read, is no Parquet, or is packed by a codec that is not known here.
pub fn read_parquet(path: &Path) -> io::Result<Vec<TableColumn>> {
    read(path).map_err(io::Error::other)
}

/// The names of a table's columns, without reading its cells.
///
/// # Errors
/// It cannot be read, or is no Parquet.
pub fn parquet_heads(path: &Path) -> io::Result<Vec<String>> {
    let file = SerializedFileReader::new(File::open(path)?).map_err(io::Error::other)?;
    Ok(file.metadata().file_metadata().schema().get_fields().iter().map(|field| field.name().to_owned()).collect())
}

fn read(path: &Path) -> Result<Vec<TableColumn>, ParquetError> {
    let file = SerializedFileReader::new(File::open(path)?)?;
    let fields = file.metadata().file_metadata().schema().get_fields().to_vec();
    let mut columns: Vec<Vec<Field>> = vec![Vec::new(); fields.len()];
    for row in file.get_row_iter(None)? {
        for (column, (_, field)) in columns.iter_mut().zip(row?.get_column_iter()) {
            column.push(field.clone());
        }
    }
    let column = |(name, cells): (String, Vec<Field>)| {
        let numbers: Option<Vec<Option<f64>>> = cells.iter().map(number).collect();
        match numbers {
            Some(numbers) => TableColumn::Numbers(name, numbers),
            None => TableColumn::Texts(name, cells.iter().map(text).collect()),
        }
    };
    Ok(fields.iter().map(|field| field.name().to_owned()).zip(columns).map(column).collect())
}

/// A cell as a number, empty where there is none; none if it is no number.
fn number(cell: &Field) -> Option<Option<f64>> {
    Some(match cell {
        Field::Null => None,
        Field::Double(v) => Some(*v),
        Field::Float(v) => Some(f64::from(*v)),
        Field::Int(v) => Some(f64::from(*v)),
        Field::UInt(v) => Some(f64::from(*v)),
        Field::Long(v) => Some(*v as f64),
        Field::ULong(v) => Some(*v as f64),
        _ => return None,
    })
}

fn text(cell: &Field) -> Option<String> {
    match cell {
        Field::Null => None,
        Field::Str(text) => Some(text.clone()),
        other => Some(other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may end by a panic")]

    use super::*;

    #[test]
    fn numbers_come_back_to_the_bit_texts_as_they_are_and_empty_cells_empty() {
        let numbers = vec![Some(0.1), None, Some(-1e-300), Some(f64::MAX)];
        let texts = vec![Some("run 1, süß".to_owned()), Some(String::new()), None, Some("line\nbreak".to_owned())];
        let columns = [
            TableColumn::Numbers("v: x^3".into(), numbers.clone()),
            TableColumn::Texts("record".into(), texts.clone()),
        ];
        let mut bytes = Vec::new();
        write_parquet(&columns, &mut bytes).unwrap();
        let mut again = Vec::new();
        write_parquet(&columns, &mut again).unwrap();
        assert_eq!(bytes, again, "the same table is the same file");

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.parquet");
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(read_parquet(&path).unwrap(), columns);
        std::fs::write(&path, b"PAR1 and nothing else").unwrap();
        assert!(read_parquet(&path).is_err());
    }

    #[test]
    fn columns_that_make_no_table_are_refused() {
        let column = |name: &str, count: usize| TableColumn::Numbers(name.into(), vec![None; count]);
        let refused = |columns: &[TableColumn]| write_parquet(columns, &mut Vec::new()).unwrap_err().to_string();
        assert!(refused(&[column("a", 1), column("b", 2)]).contains("`b` has another length"));
        assert!(refused(&[column("a", 1), column("a", 1)]).contains("two columns are called `a`"));
    }
}
