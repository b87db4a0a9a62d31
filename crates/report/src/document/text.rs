//! The content as plain text for a terminal.

use std::fmt::Write;

use super::content::{Block, Cell, DocumentTable};
use super::html::flag;

/// The blocks that words can say.
pub(super) fn document(blocks: &[Block]) -> String {
    let mut out = String::new();
    for block in blocks {
        match block {
            Block::Heading(text) | Block::Subheading(text) => {
                let _ = writeln!(out, "\n{text}");
            }
            Block::Paragraph(text) | Block::Command(text) => {
                let _ = writeln!(out, "{text}");
            }
            Block::Warnings(warnings) => {
                for (severity, text) in warnings {
                    let _ = writeln!(out, "{} {text}", flag(*severity).1);
                }
            }
            Block::Table(table) => write_table(&mut out, table),
            Block::Title { title, subtitle } => {
                let _ = writeln!(out, "{title}\n{subtitle}");
            }
            Block::Tiles(tiles) => {
                for tile in tiles {
                    let _ = writeln!(out, "{}: {} ({})", tile.label, tile.value, tile.note);
                }
            }
            // A terminal has its own form of equations, and no figures.
            Block::Equations(_) | Block::Figure(_) => {}
        }
    }
    out
}

fn write_table(out: &mut String, table: &DocumentTable) {
    let text = |cell: &Cell| match cell {
        Cell::Text(text) | Cell::Number(text) => text.clone(),
        Cell::Share(share) => format!("{:5.1} %", 100.0 * share),
        Cell::Formula(_) => String::new(),
    };
    let head = table.head.iter().map(|h| (*h).to_owned()).collect::<Vec<_>>();
    let rows = table.rows.iter().map(|row| row.iter().map(text).collect::<Vec<_>>());
    let rows: Vec<_> = Some(head).filter(|h| !h.is_empty()).into_iter().chain(rows).collect();
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns)
        .map(|c| rows.iter().filter_map(|r| r.get(c)).map(|t| t.chars().count()).max().unwrap_or(0))
        .collect();
    for row in &rows {
        let cells: Vec<String> = row.iter().zip(&widths).map(|(t, w)| format!("{t:<w$}")).collect();
        let _ = writeln!(out, "{}", cells.join("  ").trim_end());
    }
}
