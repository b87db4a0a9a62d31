//! HDF5, and with it MATLAB's `.mat` of version 7.3: numeric datasets of one or two dimensions, those of groups
//! (structures) named `group.dataset`.

use hdf5_pure::{AttrValue, DType, Dataset, File, Group};

use crate::column::{FileColumn, FileContents, Flaw};
use crate::format::FileFormat;

pub(crate) const FORMAT: FileFormat = FileFormat::of_columns(
    "HDF5 and MATLAB 7.3",
    &["h5", "hdf5"],
    |bytes| {
        // MATLAB writes a header of its own in front, whatever version it names.
        bytes.starts_with(MAGIC) || bytes.get(512..520) == Some(MAGIC) || bytes.starts_with(b"MATLAB 7.3")
    },
    read,
);

const MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Groups within groups are followed so deep.
const DEEPEST: usize = 6;

/// Datasets that are looked at: more are no measurement.
const MOST_DATASETS: usize = 10_000;

/// A matrix with more channels than this is no set of time series.
const MOST_COLUMNS: u64 = 10_000;

/// Deflate makes data at most this many times smaller.
const MOST_DEFLATED: u64 = 1032;

fn read(bytes: &[u8]) -> Result<FileContents<'_>, Flaw> {
    let damaged =
        |error: hdf5_pure::Error| Flaw::new(format!("it is damaged or cut short ({error})")).try_this(VERSION_7);
    let file = File::from_bytes(bytes.to_vec()).map_err(damaged)?;
    let mut walk = Hdf5Columns {
        room: (bytes.len() as u64).saturating_mul(MOST_DEFLATED),
        seen: 0,
        contents: FileContents::default(),
    };
    walk.group(&file.root(), "", 0).map_err(damaged)?;
    if let ([], [first, ..]) = (&walk.contents.columns[..], &walk.contents.notices[..]) {
        return Err(Flaw::new(format!("nothing in it can be used: {first}")).try_this(VERSION_7));
    }
    Ok(walk.contents)
}

const VERSION_7: &str = "if MATLAB opens it, save it there as version 7: `save('file.mat', 't', 'x', 'u', '-v7')`";

struct Hdf5Columns<'a> {
    /// Bytes that the file's data can have at most.
    room: u64,
    seen: usize,
    contents: FileContents<'a>,
}

impl Hdf5Columns<'_> {
    fn group(&mut self, group: &Group, prefix: &str, depth: usize) -> Result<(), hdf5_pure::Error> {
        for name in group.datasets()? {
            self.seen += 1;
            if self.seen > MOST_DATASETS {
                return Ok(());
            }
            let label = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
            let added = group.dataset(&name).and_then(|dataset| self.dataset(&label, &dataset));
            if let Err(error) = added {
                self.contents.notices.push(format!("`{label}` was left out: {error}"));
            }
        }
        if depth < DEEPEST {
            for name in group.groups()? {
                // MATLAB keeps what cells and objects refer to in groups of its own.
                if name.starts_with('#') {
                    continue;
                }
                let label = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
                if let Err(error) = group.group(&name).and_then(|inner| self.group(&inner, &label, depth + 1)) {
                    self.contents.notices.push(format!("`{label}` was left out: {error}"));
                }
            }
        }
        Ok(())
    }

    fn dataset(&mut self, name: &str, dataset: &Dataset) -> Result<(), hdf5_pure::Error> {
        let number = matches!(
            dataset.dtype()?,
            DType::F32
                | DType::F64
                | DType::I8
                | DType::I16
                | DType::I32
                | DType::I64
                | DType::U8
                | DType::U16
                | DType::U32
                | DType::U64
        );
        let attributes = dataset.attrs()?;
        let is_text = attributes.get("MATLAB_class").and_then(text).is_some_and(|class| class == "char");
        let is_empty = attributes.contains_key("MATLAB_empty");
        if !number || is_text || is_empty {
            return Ok(());
        }
        // Files of before 2008 keep their data in ways that are not read.
        dataset.layout()?;
        let (rows, columns) = match dataset.shape()?[..] {
            [] => (1, 1),
            [n] => (n, 1),
            [rows, columns] => (rows, columns),
            _ => {
                self.contents.notices.push(format!("`{name}` has more than two dimensions and was left out"));
                return Ok(());
            }
        };
        let bytes = rows.checked_mul(columns).and_then(|n| n.checked_mul(dataset.element_size().ok()?));
        // A matrix that is wider than high holds its channels in rows.
        let (len, count) = if columns > rows { (columns, rows) } else { (rows, columns) };
        if bytes.is_none_or(|size| size > self.room) || count > MOST_COLUMNS {
            self.contents.notices.push(format!("`{name}` is said to be {rows} by {columns} and was left out"));
            return Ok(());
        }
        let unit = ["units", "unit"].iter().find_map(|key| attributes.get(*key)).and_then(text).unwrap_or_default();
        for channel in 0..count {
            let label = if count > 1 { format!("{name}({})", channel + 1) } else { name.to_owned() };
            let dataset = dataset.clone();
            let decode = move || {
                let values = if columns > rows {
                    dataset.read_f64_rows(channel, 1)
                } else {
                    let all = dataset.read_f64();
                    all.map(|all| all.into_iter().skip(channel as usize).step_by(columns.max(1) as usize).collect())
                };
                values.map_err(|error| Flaw::new(format!("its data are damaged ({error})")))
            };
            let len = usize::try_from(len).unwrap_or(usize::MAX);
            self.contents.columns.push(FileColumn::new(&label, &unit, len, decode));
        }
        Ok(())
    }
}

fn text(value: &AttrValue) -> Option<String> {
    match value {
        AttrValue::String(text)
        | AttrValue::AsciiString(text)
        | AttrValue::VarLenString(text)
        | AttrValue::VarLenAsciiString(text) => Some(text.trim_end_matches('\0').to_owned()),
        _ => None,
    }
}
