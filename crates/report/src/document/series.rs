//! The document about a series of records: how the identified parameters go along, and which records do not fit.

use std::path::Path;

use super::content::{Block, Cell, DocumentTable, Tile};
use super::drawings::drawn;
use super::{Paper, ReportError, write_blocks};
use crate::figure::Figure;
use crate::figure::svg::Extent;

/// What a report about a series is made of.
#[derive(Clone, Debug)]
pub struct SeriesReport {
    /// The document's title.
    pub title: String,
    /// The column that the series goes over; none: the order of the table.
    pub over: Option<String>,
    /// Number of records in the table.
    pub records: usize,
    /// The parameters over the series.
    pub figures: Vec<Figure>,
    /// How each parameter goes along.
    pub trends: Vec<TrendRow>,
    /// The records that do not fit.
    pub odd: Vec<OddRow>,
    /// The command that makes this report again.
    pub command: Option<String>,
    /// The paper of a PDF.
    pub paper: Paper,
}

/// A parameter along the series, in figures as they are read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TrendRow {
    /// The parameter's name.
    pub name: String,
    /// Number of records that have it.
    pub records: usize,
    /// Its value at the centre, ± standard error.
    pub level: String,
    /// Where that is.
    pub centre: String,
    /// Whether the slope is more than chance.
    pub trend: bool,
    /// Change for 1 of the abscissa, ± standard error, or why there is none.
    pub slope: String,
    /// Standard deviation between records beyond the standard errors.
    pub scatter: String,
    /// Chance of a slope as steep where there is none.
    pub chance: String,
}

/// A record that does not fit its siblings.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OddRow {
    /// Its name.
    pub record: String,
    /// Why, a sentence each.
    pub reasons: Vec<String>,
}

impl SeriesReport {
    /// Writes the document that the file's ending asks for.
    ///
    /// # Errors
    /// An ending that stands for none; a file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        write_blocks(path, &self.title, self.paper, &self.blocks())
    }

    fn blocks(&self) -> Vec<Block> {
        let over = self.over.as_deref().unwrap_or("the order of the table");
        let subtitle = format!("Identified parameters of {} records over {over}", self.records);
        let mut blocks = vec![Block::Title { title: self.title.clone(), subtitle }, Block::Tiles(self.tiles())];
        blocks.push(Block::Heading("Parameters over the series".into()));
        blocks.extend(self.figures.iter().map(|figure| Block::Figure(drawn(figure, &Extent::PAGE))));
        blocks.push(Block::Heading("Trends".into()));
        blocks.push(Block::Table(self.trends()));
        blocks.push(Block::Paragraph(
            "Each line is weighted by the standard errors and a scatter common to the records, and few records that do not belong \
             cannot bend it. A slope counts where chance alone would make one as steep in fewer than one series of a hundred."
                .into(),
        ));
        blocks.push(Block::Heading("Records that do not fit".into()));
        if self.odd.is_empty() {
            blocks.push(Block::Paragraph("Every record fits its siblings.".into()));
        } else {
            blocks.push(Block::Table(self.odd()));
        }
        if let Some(command) = &self.command {
            blocks.push(Block::Heading("Command".into()));
            blocks.push(Block::Command(command.clone()));
        }
        blocks
    }

    fn tiles(&self) -> Vec<Tile> {
        let told = self.trends.iter().filter(|row| row.trend).count();
        vec![
            Tile { label: "Records", value: self.records.to_string(), note: "in the table".to_owned() },
            Tile {
                label: "Parameters with a trend",
                value: told.to_string(),
                note: format!("of {}", self.trends.len()),
            },
            Tile {
                label: "Records that do not fit",
                value: self.odd.len().to_string(),
                note: "named below with the reason".to_owned(),
            },
        ]
    }

    fn trends(&self) -> DocumentTable {
        let row = |row: &TrendRow| {
            vec![
                Cell::Text(row.name.clone()),
                Cell::Number(row.records.to_string()),
                Cell::Number(row.level.clone()),
                Cell::Number(row.centre.clone()),
                Cell::Number(row.slope.clone()),
                Cell::Number(row.scatter.clone()),
                Cell::Number(row.chance.clone()),
            ]
        };
        DocumentTable {
            head: vec!["parameter", "records", "value", "at", "slope", "scatter", "p"],
            rows: self.trends.iter().map(row).collect(),
        }
    }

    fn odd(&self) -> DocumentTable {
        let row = |row: &OddRow| vec![Cell::Text(row.record.clone()), Cell::Text(row.reasons.join("; "))];
        DocumentTable { head: vec!["record", "why it does not fit"], rows: self.odd.iter().map(row).collect() }
    }
}
