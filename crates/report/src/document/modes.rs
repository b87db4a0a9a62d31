//! The document about a structure: its modes, where they come from, what they make of the records, and the force that they lack.

use std::path::Path;

use super::content::{Block, Cell, DocumentTable, Tile};
use super::drawings::drawn;
use super::font::Fonts;
use super::{Paper, ReportError, page, write_blocks};
use crate::figure::svg::Extent;
use crate::modal::{
    ModalOptions, ModalSubject, ModalView, before_and_after, diagnosis_lines, modes_in_band, remaining, verdict,
};
use sindyscope_core::study::Score;
use sindyscope_modes::{ModalAnalysis, PoleCluster, RecordFit, StructureDiagnosis};
use sindyscope_values::format::number::{format_measured, plain, significant};
use sindyscope_values::format::units::{format_si, raised};
use sindyscope_values::model::Mode;
use sindyscope_values::record::Usage;

/// Sensors whose responses are drawn, at most.
const SENSORS_DRAWN: usize = 4;

/// What a report about a structure is made of.
#[derive(Clone, Copy, Debug)]
pub struct ModesReport<'a> {
    /// The document's title.
    pub title: &'a str,
    /// The modes with all that figures show of them.
    pub analysis: &'a ModalAnalysis,
    /// What was found missing, if that was asked for.
    pub diagnosis: Option<&'a StructureDiagnosis>,
    /// The command that makes this report again.
    pub command: Option<&'a str>,
    /// The paper of a PDF.
    pub paper: Paper,
}

impl ModesReport<'_> {
    /// Writes the document that the file's ending asks for.
    ///
    /// # Errors
    /// An ending that stands for none; a file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        write_blocks(path, self.title, self.paper, &self.blocks())
    }

    /// The pages of paper, each as an SVG document that uses the window's fonts.
    pub fn pages(&self) -> Vec<String> {
        page::pages(&self.blocks(), &Fonts::new(), self.paper, self.title)
    }

    fn blocks(&self) -> Vec<Block> {
        let structure = &self.analysis.structure;
        let fitted = structure.records.iter().filter(|r| r.usage == Usage::Fit).count();
        let held_out = structure.records.len() - fitted;
        let several = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        let subtitle = format!(
            "Modes of a structure from {} and {}, {fitted} fitted and {held_out} held-out records",
            several(structure.sensors.len(), "sensor"),
            several(structure.inputs.len(), "input")
        );
        let mut blocks = vec![Block::Title { title: self.title.to_owned(), subtitle }, Block::Tiles(self.tiles())];
        blocks.push(Block::Heading("Modes".into()));
        blocks.push(Block::Table(self.modes()));
        blocks.extend(self.outside().map(Block::Paragraph));
        if let Some(diagnosis) = self.diagnosis {
            blocks.extend(missing(diagnosis));
        }
        blocks.push(Block::Heading("Where the modes come from".into()));
        blocks.extend(self.figure(ModalView::Stabilization, ModalOptions::default()));
        blocks.extend(self.clusters().map(Block::Table));
        blocks.push(Block::Heading("Responses, measured and of the modes".into()));
        for sensor in 0..structure.sensors.len().min(SENSORS_DRAWN) {
            blocks.extend(self.figure(ModalView::Responses, ModalOptions { sensor, ..ModalOptions::default() }));
        }
        if structure.sensors.len() > 1 {
            blocks.push(Block::Heading("Shapes".into()));
            blocks.extend(self.figure(ModalView::Shapes, ModalOptions::default()));
        }
        blocks.push(Block::Heading("Errors".into()));
        blocks.push(Block::Table(self.errors()));
        if let Some(command) = self.command {
            blocks.push(Block::Heading("Command".into()));
            blocks.push(Block::Command(command.to_owned()));
        }
        blocks
    }

    /// A figure of the first record, or why there is none.
    fn figure(&self, view: ModalView, options: ModalOptions) -> Option<Block> {
        let subject = ModalSubject { analysis: self.analysis, record: 0, options: &options };
        Some(match view.figure(&subject) {
            Ok(figure) => Block::Figure(drawn(&figure, &Extent::PAGE)),
            Err(why) => Block::Paragraph(format!("{why}.")),
        })
    }

    fn tiles(&self) -> Vec<Tile> {
        let structure = &self.analysis.structure;
        let Some(sensor) = structure.sensors.first() else { return Vec::new() };
        let tile = |label: &'static str, score: Score| Tile {
            label,
            value: raised(&format_si(score.rmse, &sensor.unit, 3)),
            note: format!("RMSE of {}; {} % of it", sensor.name, significant(100.0 * score.nrmse, 3)),
        };
        let of = |(label, usage)| structure.score(0, usage).map(|score| tile(label, score));
        let errors = [("Held-out error", Usage::HeldOut), ("Error on the fitted data", Usage::Fit)];
        let count = modes_in_band(self.analysis).count();
        let modes = Tile { label: "Modes", value: count.to_string(), note: format!("{} states", structure.order()) };
        errors.into_iter().filter_map(of).chain([modes]).collect()
    }

    fn modes(&self) -> DocumentTable {
        let row = |(k, mode): (usize, &Mode)| {
            let collinearity = self.analysis.quality[k].collinearity;
            vec![
                Cell::Text(self.analysis.structure.mode_number(k).to_string()),
                Cell::Number(format_measured(mode.frequency, mode.frequency_error)),
                Cell::Number(format_measured(100.0 * mode.damping, mode.damping_error.map(|e| 100.0 * e))),
                Cell::Text(mode.shape.iter().map(|s| significant(*s, 3)).collect::<Vec<_>>().join(", ")),
                Cell::Number(collinearity.map_or_else(|| "–".into(), |c| plain(c, 2))),
            ]
        };
        DocumentTable {
            head: vec!["mode", "frequency (Hz)", "damping ratio (%)", "shape", "MPC"],
            rows: modes_in_band(self.analysis).map(row).collect(),
        }
    }

    /// The clusters of stable poles, with mean and spread; none where there is no cluster.
    fn clusters(&self) -> Option<DocumentTable> {
        let clusters = &self.analysis.stabilization.clusters;
        let row = |c: &PoleCluster| {
            vec![
                Cell::Number(format_measured(c.frequency.0, Some(c.frequency.1))),
                Cell::Number(format_measured(100.0 * c.damping.0, Some(100.0 * c.damping.1))),
                Cell::Number(c.members.len().to_string()),
                Cell::Text(format!("{} to {}", c.orders.0, c.orders.1)),
                Cell::Number(c.collinearity.map_or_else(|| "–".into(), |m| plain(m, 2))),
            ]
        };
        (!clusters.is_empty()).then(|| DocumentTable {
            head: vec!["cluster, mean and spread (Hz)", "damping ratio (%)", "stable poles", "orders", "MPC"],
            rows: clusters.iter().map(row).collect(),
        })
    }

    /// What is said of modes outside the band that is driven.
    fn outside(&self) -> Option<String> {
        let structure = &self.analysis.structure;
        let outside = structure.modes.iter().zip(&structure.in_band).filter(|(_, inside)| !**inside);
        let outside: Vec<String> = outside.map(|(m, _)| significant(m.frequency, 3)).collect();
        (!outside.is_empty()).then(|| {
            format!(
                "Outside the band that is driven the model has poles at {} Hz: they stand for what lies beyond it and for drifts.",
                outside.join(", ")
            )
        })
    }

    /// A row for each record and sensor.
    fn errors(&self) -> DocumentTable {
        let structure = &self.analysis.structure;
        let row = |record: &RecordFit, s: usize| {
            let (sensor, score) = (&structure.sensors[s], record.scores.get(s)?);
            Some(vec![
                Cell::Text(record.name.clone()),
                Cell::Text(if record.usage == Usage::Fit { "fitted" } else { "held out" }.into()),
                Cell::Text(sensor.name.clone()),
                Cell::Number(raised(&format_si(score.rmse, &sensor.unit, 3))),
                Cell::Number(format!("{} %", significant(100.0 * score.nrmse, 3))),
            ])
        };
        let sensors = structure.sensors.len();
        let rows = structure.records.iter().flat_map(|r| (0..sensors).filter_map(move |s| row(r, s))).collect();
        DocumentTable { head: vec!["record", "", "sensor", "RMSE", "of its deviation"], rows }
    }
}

/// What a search for a missing force came to.
fn missing(found: &StructureDiagnosis) -> Vec<Block> {
    let mut blocks = vec![Block::Heading("What was missing".into()), Block::Paragraph(verdict(found).to_owned())];
    blocks.extend(diagnosis_lines(found).into_iter().map(Block::Paragraph));
    blocks.push(Block::Paragraph(format!("Remaining: {}.", remaining(found))));
    if let (Some(record), Some(sensor)) = (found.unseen.first(), found.last.sensors.first()) {
        blocks.push(Block::Figure(drawn(&before_and_after(record, 0, sensor), &Extent::PAGE)));
    }
    blocks
}
