//! What would be read with the columns chosen: each channel over the time.

use std::sync::Arc;

use egui::{Id, Label, RichText, ScrollArea, Sense, Ui, vec2};

use crate::app::plot::painter::{self, Look, Plots};
use sindyscope_report::figure::thin::Spacing;
use sindyscope_report::figure::{Axis, Figure, Fit, Layer, Panel, Samples, Shape};
use sindyscope_report::palette::Ink;
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::record::{Channel, Record, RecordSet};

/// Channels that are drawn.
const DRAWN: usize = 6;

/// Least height of a channel's plot with its name, points.
const LEAST: f32 = 76.0;

/// Height of the time's axis, points.
const TIME: f32 = 34.0;

/// What would be read.
#[derive(Debug)]
pub(crate) struct Preview {
    /// What it is, in one line.
    summary: String,
    figure: Figure,
    notices: Vec<String>,
}

impl Preview {
    pub(super) fn of(set: &RecordSet) -> Self {
        let count = set.entries.len();
        let Some((record, _)) = set.entries.first() else {
            return Self { summary: "no record".into(), figure: Figure::default(), notices: Vec::new() };
        };
        let rate = significant_trimmed(record.interval.recip(), 5);
        let records = if count > 1 { format!("{count} records; the first: ") } else { String::new() };
        let summary =
            format!("{records}{} samples at {rate} Hz, {} s", record.len(), significant_trimmed(record.duration(), 4));
        Self { summary, figure: figure(record), notices: record.notices.clone() }
    }

    pub(super) fn show(&self, ui: &mut Ui, plots: &mut Plots) {
        ui.horizontal(|ui| {
            ui.label(RichText::new(&self.summary).strong());
            if !self.notices.is_empty() {
                let text = self.notices.join("\n");
                ui.add(Label::new(RichText::new(self.notices.join(" · ")).weak().small()).truncate())
                    .on_hover_text(text);
            }
        });
        let height = (LEAST * self.figure.rows.len() as f32 + TIME).max(ui.available_height() - 4.0);
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            let place = |panel: &'static str| Id::unique(("column preview", panel));
            let mut look = Look::new(&place, &self.summary, "Preview of the columns");
            (look.compact, look.sense) = (true, Sense::hover());
            let size = vec2(ui.available_width() - 8.0, height);
            ui.allocate_ui(size, |ui| painter::show(ui, plots, &self.figure, &mut look));
        });
    }
}

/// Each channel over the time.
fn figure(record: &Record) -> Figure {
    const NAMES: [&str; DRAWN] = ["1", "2", "3", "4", "5", "6"];
    let spacing = Spacing { start: record.start, interval: record.interval.max(f64::MIN_POSITIVE) };
    let time = Axis::linear("t", "s", (record.start, record.start + record.duration())).linked("preview time");
    let panel = |(id, channel): (&'static str, &Channel)| {
        let name = format!("{}{} {}", channel.role.symbol(), channel.role.index() + 1, channel.name);
        let y = Axis::linear(name, channel.unit.as_str(), (0.0, 1.0));
        let samples = Samples::new(Arc::clone(&channel.values), spacing);
        let layers = vec![Layer::new(Ink::Measured, "", Shape::Samples(samples)).wide(1.0)];
        let panel = Panel { fit: Fit::Curves, layers, fixed: true, ..Panel::new(id, time.clone(), y) };
        (panel.fitted(), 1.0)
    };
    Figure::stacked(NAMES.into_iter().zip(record.measured()).map(panel), 240.0, "The channels that would be read.")
}
