//! Reads measured records from the files of laboratories, and writes them.
//!
//! A [`MeasuredFile`] is a file's bytes, read once. [`MeasuredFile::look`] says which tables and columns it holds and what
//! each is taken for; [`MeasuredFile::read`] makes records of it: even samples, each channel with its unit and role. What was
//! found and done on the way stands in each record's notices. What cannot be used is refused by a [`ReadError`], which says
//! what is wrong, where, and what to try. [`FORMATS`] lists the formats, one file each under `formats/`; [`ReadOptions`]
//! says what a header does not.
//!
//! ```
//! use sindyscope_files::{MeasuredFile, ReadOptions};
//!
//! let rows: String = (0..20).map(|i| format!("{},{}\n", 10 * i, i * i % 7)).collect();
//! let file = MeasuredFile::from_bytes("run.csv", format!("time [ms],x [mm]\n{rows}"));
//! assert_eq!(file.look(&ReadOptions::default())?.tables[0].columns[1].unit, "mm");
//! let records = file.read(&ReadOptions::default())?;
//! assert_eq!((records[0].len(), records[0].interval), (20, 0.01));
//! # Ok::<(), sindyscope_files::ReadError>(())
//! ```
//!
//! A file passes through four hands. Its format's reader finds the columns and turns the wanted ones into numbers;
//! `heading` and `selection` decide which these are; [`sindyscope_core::sampling`] finds the even grid behind the time
//! stamps; `assemble` makes records of it all.
#![deny(missing_docs)]

mod arriving;
mod assemble;
mod column;
mod column_map;
mod error;
mod file;
mod format;
mod formats;
mod guess;
mod heading;
mod options;
mod overview;
#[cfg(not(target_arch = "wasm32"))]
mod parquet_table;
mod positions;
mod selection;
mod set;
mod shared_units;
mod sheets;
mod table;
mod words;
mod write;

pub use arriving::{ArrivedRow, ArrivingRows};
pub use column::{FileColumn, FileContents, Flaw};
pub use column_map::{ColumnMap, ColumnMapError};
pub use error::{ReadError, ReadProblem, RowPlace};
pub use file::{MeasuredFile, NamedColumn, is_project};
pub use format::{FileFormat, ReadColumns};
pub use formats::FORMATS;
pub use options::ReadOptions;
pub use overview::{ColumnOverview, ColumnUse, Overview, TableOverview};
#[cfg(not(target_arch = "wasm32"))]
pub use parquet_table::{TableColumn, parquet_heads, read_parquet, write_parquet};
pub use positions::{position_comments, positions_in};
pub use set::{join, read_files, read_opened, read_set, read_text};
pub use write::write_csv;

#[cfg(test)]
mod tests;
