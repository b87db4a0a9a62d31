//! Finds what a linear model of records lacks: `cargo run --release --example diagnose -- FIT.csv [HELD_OUT.csv …]`.

use std::error::Error;

use sindyscope_core::study::Cancel;
use sindyscope_files::{ReadOptions, read_files};
use sindyscope_search::{Ask, Search};
use sindyscope_values::record::{RecordSet, Usage};

fn main() -> Result<(), Box<dyn Error>> {
    let mut files = std::env::args_os().skip(1).map(std::path::PathBuf::from);
    let fit: Vec<_> = files.by_ref().take(1).collect();
    let held_out: Vec<_> = files.collect();
    let mut records = RecordSet::new(read_files(&fit, &ReadOptions::default())?, Usage::Fit);
    if !held_out.is_empty() {
        records.add(read_files(&held_out, &ReadOptions::default())?, Usage::HeldOut);
    }
    let search = Search::new(&records, &Ask::default())?;
    let diagnosis = search.diagnose(&|_| {}, &Cancel::default())?;
    println!("{}", diagnosis.sentence);
    for round in &diagnosis.rounds {
        println!("\n{} (p = {:.1e})", round.place.sentence, round.evidence.p_value);
        for candidate in &round.candidates {
            println!("  {:<45} {:>5.1} %  {}", candidate.title, 100.0 * candidate.explained, candidate.why);
        }
    }
    println!("\n{}\n{:.0} ms", diagnosis.remaining.note, diagnosis.elapsed_ms);
    Ok(())
}
