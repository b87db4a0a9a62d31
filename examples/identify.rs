//! Identifies a file's equation of motion with suggested settings and prints it.
//!
//! `cargo run --release --example identify -- sample_data/duffing.csv`

use std::error::Error;

use sindyscope::format::equations;
use sindyscope::record::{ReadOptions, RecordSet, Usage, read_files};
use sindyscope::study::{Cancel, Study, suggest};
use sindyscope::term::Kind;

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let records = RecordSet::new(read_files(&files, &ReadOptions::default())?, Usage::Fit);
    let settings = suggest(&records, Kind::SecondOrder)?;
    let outcome = Study::default().run(&records, &settings, &Cancel::default())?;
    println!("{}", equations::text(&outcome.model, Some(&outcome.units())));
    Ok(())
}
