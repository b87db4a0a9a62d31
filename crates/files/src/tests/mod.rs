//! What the room promises, through its public functions.

mod dialects;
mod foreign;
mod gaps;
mod laboratory;
mod measured;
mod messages;
mod round_trip;
mod sets;
mod unread;

use super::*;
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage, notices};
use sindyscope_values::term::Kind;

/// A file of 30 rows: `header`, then `row(i)`.
fn file(header: &str, row: impl Fn(usize) -> String) -> String {
    let mut text = format!("{header}\n");
    for i in 0..30 {
        text += &row(i);
        text.push('\n');
    }
    text
}

/// Values that are no straight line.
fn x(i: usize) -> f64 {
    ((i * i) % 7) as f64 / 8.0
}

/// The values of a record's channel.
fn values(record: &Record, role: Role) -> Vec<f64> {
    record.channel(role).map(|c| c.values.to_vec()).unwrap_or_default()
}

/// The one record of a text, or the test fails.
fn only(name: &str, text: &str, options: &ReadOptions) -> Record {
    let mut records = read_text(name, text, options).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(records.len(), 1, "{name}");
    records.remove(0)
}
