//! The document about a component without a mass: its force along the given motion.

use std::path::Path;

use super::content::{Block, Cell, DocumentTable, Tile};
use super::drawings::drawn;
use super::font::Fonts;
use super::math::{self, EquationRows, Math};
use super::{Paper, ReportError, page, write_blocks};
use crate::component::ComponentView;
use crate::figure::svg::Extent;
use sindyscope_component::{ComponentModel, ForceFit, Specimen};
use sindyscope_core::study::Score;
use sindyscope_values::format::equations::by_share;
use sindyscope_values::format::number::{format_measured, significant};
use sindyscope_values::format::units::format_si;
use sindyscope_values::record::Usage;
use sindyscope_values::term::Symbol;

/// Records whose loops are drawn, at most.
const RECORDS_DRAWN: usize = 4;

/// What a report about a component is made of.
#[derive(Clone, Copy, Debug)]
pub struct ComponentReport<'a> {
    /// The document's title.
    pub title: &'a str,
    /// The component as it was measured.
    pub specimen: &'a Specimen,
    /// The force that was found.
    pub model: &'a ComponentModel,
    /// What the force was found to lack, a sentence each; empty where that was not asked for.
    pub lacking: &'a [String],
    /// The paper of a PDF.
    pub paper: Paper,
}

impl ComponentReport<'_> {
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
        let fitted = self.model.records.iter().filter(|r| r.usage == Usage::Fit).count();
        let held_out = self.model.records.len() - fitted;
        let subtitle = format!(
            "The force of a component along a given motion, from {fitted} fitted and {held_out} held-out records"
        );
        let mut blocks = vec![Block::Title { title: self.title.to_owned(), subtitle }, Block::Tiles(self.tiles())];
        if !self.lacking.is_empty() {
            blocks.push(Block::Heading("What was missing".into()));
            blocks.extend(self.lacking.iter().cloned().map(Block::Paragraph));
        }
        blocks.push(Block::Heading("Force".into()));
        blocks.push(Block::Equations(self.equations()));
        blocks.push(Block::Table(self.coefficients()));
        blocks.push(Block::Heading("Force over displacement and velocity".into()));
        blocks.extend(
            (0..self.model.records.len().min(RECORDS_DRAWN))
                .filter_map(|record| ComponentView::Loops.figure(self.specimen, self.model, record))
                .map(|figure| Block::Figure(drawn(&figure, &Extent::PAGE))),
        );
        blocks.push(Block::Heading("Errors and energy".into()));
        blocks.push(Block::Table(self.errors()));
        blocks
    }

    fn tiles(&self) -> Vec<Tile> {
        let (_, unit) = self.specimen.force();
        let tile = |label: &'static str, score: Score| Tile {
            label,
            value: format_si(score.rmse, unit, 3),
            note: format!("RMSE; {} % of the force", significant(100.0 * score.nrmse, 3)),
        };
        let of = |(label, usage)| self.model.score(usage).map(|score| tile(label, score));
        [("Held-out error", Usage::HeldOut), ("Error on the fitted data", Usage::Fit)]
            .into_iter()
            .filter_map(of)
            .collect()
    }

    fn equations(&self) -> Vec<EquationRows> {
        let layout = &self.model.layout;
        let force = math::sum(Math::Variable("F"), &self.model.force, layout);
        let internals = self.model.internals.iter().enumerate();
        let rate = |(k, equation)| math::sum(math::rate(layout, Symbol::Internal(k)), equation, layout);
        std::iter::once(force).chain(internals.map(rate)).collect()
    }

    fn coefficients(&self) -> DocumentTable {
        let row = |term: &sindyscope_values::model::WeightedTerm| {
            vec![
                Cell::Text(term.term.pretty(&self.model.layout)),
                Cell::Number(format_measured(term.coefficient, term.std_error)),
                Cell::Text(self.model.unit(&term.term).unwrap_or_default()),
                Cell::Share(term.share),
            ]
        };
        DocumentTable {
            head: vec!["term", "coefficient ± std. error", "unit", "share of the force"],
            rows: by_share(&self.model.force).into_iter().map(row).collect(),
        }
    }

    fn errors(&self) -> DocumentTable {
        let (_, unit) = self.specimen.force();
        let row = |fit: &ForceFit| {
            let [measured, identified] = fit.energy;
            vec![
                Cell::Text(fit.name.clone()),
                Cell::Text(if fit.usage == Usage::Fit { "fitted" } else { "held out" }.into()),
                Cell::Number(format_si(fit.score.rmse, unit, 3)),
                Cell::Number(format!("{} %", significant(100.0 * fit.score.nrmse, 3))),
                Cell::Number(format!("{} %", significant(100.0 * identified / measured, 4))),
            ]
        };
        DocumentTable {
            head: vec!["record", "", "RMSE", "of the force", "energy taken, of the measured"],
            rows: self.model.records.iter().map(row).collect(),
        }
    }
}
