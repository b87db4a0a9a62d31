//! The worked example of `docs/contributing/reader.md`: a format of its own, read like every other.

use std::path::Path;

use sindyscope_files::{FileColumn, FileContents, FileFormat, Flaw, MeasuredFile, ReadError, ReadOptions};
use sindyscope_values::record::Role;

// [example]
/// A logger's file, little-endian: `TINY`, samples a second (u32), then one pair of f32 a sample: displacement in mm, force in N.
static TINY: FileFormat = FileFormat::of_columns("Tiny logger", &["tiny"], |bytes| bytes.starts_with(b"TINY"), read);

fn read(bytes: &[u8]) -> Result<FileContents<'_>, Flaw> {
    let rate = bytes.get(4..8).and_then(|b| b.first_chunk()).map(|b| u32::from_le_bytes(*b));
    let rate = rate.filter(|rate| *rate > 0).ok_or_else(|| Flaw::at("its header gives no sampling rate", 4))?;
    let pairs = bytes[8..].chunks_exact(8);
    let mut contents = FileContents::default();
    if !pairs.remainder().is_empty() {
        contents.notices.push("the last sample is cut short and was left out".to_owned());
    }
    for (name, unit, from) in [("x", "mm", 0), ("force", "N", 4)] {
        let samples = pairs.clone();
        let decode = move || {
            let value = |pair: &[u8]| pair[from..].first_chunk().map_or(f64::NAN, |b| f32::from_le_bytes(*b).into());
            Ok(samples.clone().map(value).collect())
        };
        let column = FileColumn::new(name, unit, pairs.len(), decode);
        contents.columns.push(column.sampled_evenly(0.0, f64::from(rate).recip()));
    }
    Ok(contents)
}
// [/example]

fn file(pairs: usize) -> Vec<u8> {
    let mut bytes = b"TINY".to_vec();
    bytes.extend(500_u32.to_le_bytes());
    for k in 0..pairs {
        bytes.extend(((k * k % 7) as f32).to_le_bytes());
        bytes.extend((k as f32).to_le_bytes());
    }
    bytes
}

#[test]
fn the_example_reads_its_format() -> Result<(), ReadError> {
    let mut bytes = file(40);
    bytes.push(0);
    let tiny = MeasuredFile::from_bytes("run.tiny", bytes).in_format(&TINY);
    assert_eq!(tiny.look(&ReadOptions::default())?.format, "Tiny logger");
    let records = tiny.read(&ReadOptions::default())?;
    assert_eq!((records[0].len(), records[0].interval), (40, 0.002));
    let shown = |role| records[0].channel(role).map(|c| (c.unit.clone(), c.values[3]));
    assert_eq!(shown(Role::Displacement(0)), Some(("mm".to_owned(), 2.0)));
    assert_eq!(shown(Role::Input(0)), Some(("N".to_owned(), 3.0)));
    assert_eq!(records[0].notices, ["run.tiny: the last sample is cut short and was left out"]);
    Ok(())
}

#[test]
fn what_is_wrong_with_the_file_is_told_with_the_place() {
    let empty = MeasuredFile::from_bytes("run.tiny", b"TINY".to_vec()).in_format(&TINY);
    let told = empty.read(&ReadOptions::default()).map_err(|error| error.to_string());
    let expected = "run.tiny: this Tiny logger file cannot be read: its header gives no sampling rate (at byte 4)";
    assert_eq!(told, Err(expected.to_owned()));
}

#[test]
fn the_page_shows_this_example() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("../../docs/contributing/reader.md"))?;
    let source = std::fs::read_to_string(root.join("tests/contributing_reader.rs"))?;
    let example = source.split("// [example]\n").nth(1).and_then(|rest| rest.split("// [/example]").next());
    assert!(example.is_some_and(|example| page.contains(example)), "docs/contributing/reader.md shows another example");
    Ok(())
}
