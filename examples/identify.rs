//! Identifies a file's equation of motion with suggested settings and prints it.
//!
//! `cargo run --release --example identify -- sample_data/duffing.csv`

use std::error::Error;

use sindyscope_core::study::{Cancel, Study, suggest};
use sindyscope_files::{ReadOptions, read_files};
use sindyscope_values::format::equations;
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::Kind;

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let records = RecordSet::new(read_files(&files, &ReadOptions::default())?, Usage::Fit);
    let settings = suggest(&records, Kind::SecondOrder)?;
    let outcome = Study::default().run(&records, &settings, &Cancel::default())?;
    println!("{}", equations::text(&outcome.model, Some(&outcome.units())));
    Ok(())
}
