//! The file formats of laboratories, one file each and one entry in [`FORMATS`]; what they share is in `bytes`.

mod bytes;
pub(crate) mod foreign;
mod hdf5;
mod lvm;
mod mat;
mod mdf;
mod npy;
pub(crate) mod spreadsheet;
mod tdms;
pub(crate) mod text;
mod uff;
mod wav;

use super::format::FileFormat;

/// The formats that measurements are read from; the first reads whatever no other recognises.
pub const FORMATS: &[FileFormat] = &[
    text::FORMAT,
    hdf5::FORMAT,
    mat::FORMAT,
    npy::FORMAT,
    npy::ARCHIVE,
    spreadsheet::FORMAT,
    lvm::FORMAT,
    tdms::FORMAT,
    uff::FORMAT,
    wav::FORMAT,
    mdf::FORMAT,
];

/// The format of a file: by its content, or else by its ending.
pub(crate) fn recognise(ending: &str, bytes: &[u8]) -> &'static FileFormat {
    let content = FORMATS.iter().find(|f| (f.recognises)(bytes));
    // A LabVIEW measurement without its header, or a universal file without a dataset, may still be a table of text.
    let by_ending = || FORMATS.iter().find(|f| f.extensions.contains(&ending));
    content.or_else(by_ending).unwrap_or(&FORMATS[0])
}
