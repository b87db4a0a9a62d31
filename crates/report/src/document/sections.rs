//! The sections of a report, in the order that was arranged.

use super::arrangement::{Arrangement, Item, Section};
use super::content::{self, Block, sentence};
use super::drawings::{self, FigureLimits};
use super::report::Report;
use super::{math, walk};
use crate::figure::svg::Extent;
use crate::view::View;

/// A document, ready to be written.
pub(super) struct ComposedDocument {
    pub(super) blocks: Vec<Block>,
    /// Sections that were asked for and that this study has nothing for.
    pub(super) empty: Vec<Section>,
}

/// The whole document.
pub(super) fn compose(report: &Report<'_>, arrangement: &Arrangement, room: &FigureLimits) -> ComposedDocument {
    let mut blocks = vec![content::title(report.heading(), report.outcome)];
    let mut empty = Vec::new();
    // The heading that what follows stands under.
    let mut above = None;
    for item in &arrangement.items {
        match item {
            Item::Text { text } => {
                let own = own_text(text);
                if own.iter().any(|block| matches!(block, Block::Heading(_))) {
                    above = None;
                }
                blocks.extend(own);
            }
            Item::Section { shown: false, .. } => {}
            Item::Section { section, shown: true } => {
                let own = section_blocks(*section, report, room);
                if own.is_empty() {
                    empty.push(*section);
                    continue;
                }
                if let Some(heading) = section.heading().filter(|h| above != Some(*h)) {
                    blocks.push(Block::Heading(heading.to_owned()));
                    above = Some(heading);
                }
                blocks.extend(own);
            }
        }
    }
    ComposedDocument { blocks, empty }
}

/// A text of one's own: paragraphs parted by blank lines, and headings, which begin with `# `.
fn own_text(text: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut paragraph: Vec<&str> = Vec::new();
    let mut end = |paragraph: &mut Vec<&str>, heading: Option<&str>| {
        if !paragraph.is_empty() {
            blocks.push(Block::Paragraph(std::mem::take(paragraph).join(" ")));
        }
        blocks.extend(heading.map(|h| Block::Heading(h.to_owned())));
    };
    for line in text.lines().map(str::trim) {
        match line.strip_prefix("# ").map(str::trim) {
            Some(heading) if !heading.is_empty() => end(&mut paragraph, Some(heading)),
            _ if line.is_empty() => end(&mut paragraph, None),
            _ => paragraph.push(line),
        }
    }
    end(&mut paragraph, None);
    blocks
}

/// What a section holds; nothing if the study has nothing for it.
fn section_blocks(section: Section, report: &Report<'_>, room: &FigureLimits) -> Vec<Block> {
    let outcome = report.outcome;
    let one = |view: View, extent: &Extent| {
        drawings::telling(outcome, view, extent).map(Block::Figure).into_iter().collect::<Vec<_>>()
    };
    let walk =
        |part: walk::WalkPart| report.diagnosis.map_or_else(Vec::new, |d| walk::blocks(part, d, report.records, room));
    match section {
        Section::Summary => content::summary_blocks(outcome),
        Section::Equation => vec![Block::Equations(math::equations(&outcome.model))],
        Section::Coefficients => content::identified(outcome),
        Section::Parameters => content::parameters(outcome),
        Section::Errors => vec![Block::Table(content::errors(outcome, content::displacement_unit(outcome)))],
        Section::Response => {
            let mut blocks: Vec<Block> = drawings::responses(outcome, room).into_iter().map(Block::Figure).collect();
            let drawn = outcome.records.len().min(room.records);
            if drawn < outcome.records.len() {
                blocks.push(Block::Paragraph(format!("{drawn} of {} records are drawn.", outcome.records.len())));
            }
            blocks
        }
        Section::Phase => one(View::Phase, &Extent::HALF),
        Section::Spectrum => one(View::Spectrum, &Extent::HALF),
        Section::Forces => {
            [View::Restoring, View::Friction].into_iter().flat_map(|view| one(view, &Extent::PAGE)).collect()
        }
        Section::Residual => one(View::Residual, &Extent::PAGE),
        Section::Missing => walk(walk::WalkPart::Verdict),
        Section::Waterfall => walk(walk::WalkPart::Waterfall),
        Section::Rounds => walk(walk::WalkPart::Rounds),
        Section::Overlay => walk(walk::WalkPart::Overlay),
        Section::Remaining => walk(walk::WalkPart::Remaining),
        Section::Records => {
            let mut blocks = vec![Block::Table(content::data(report))];
            blocks.extend(content::notices(report).into_iter().map(Block::Paragraph));
            blocks
        }
        Section::Settings => {
            let mut blocks = vec![Block::Table(content::settings(outcome))];
            blocks.extend(report.choice.map(|reason| Block::Paragraph(sentence(reason))));
            blocks
        }
        Section::Command => report.command.map(|command| Block::Command(command.to_owned())).into_iter().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_of_ones_own_is_paragraphs_and_headings() {
        let blocks = own_text("one\n line\n\n\n# A heading\ntwo\n#no heading\n# \n");
        let words: Vec<String> = blocks
            .iter()
            .map(|block| match block {
                Block::Paragraph(text) => text.clone(),
                Block::Heading(text) => format!("<{text}>"),
                _ => String::new(),
            })
            .collect();
        assert_eq!(words, ["one line", "<A heading>", "two #no heading #"]);
        assert!(own_text(" \n\t\n").is_empty());
    }
}
