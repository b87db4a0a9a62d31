//! What would be read with the columns chosen: each channel over the time.

use crate::app::plot::palette::Painted as _;
use egui::{Label, RichText, ScrollArea, Ui, vec2};
use egui_plot::{AxisHints, Line, Plot, PlotPoint, PlotPoints};

use crate::app::plot::axis;
use crate::app::plot::decimate::{Envelope, Samples};
use crate::app::plot::palette::Ink;
use crate::app::plot::units::Scale;
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::record::{RecordSet, Role};

/// Columns of pixels that a channel is decimated to.
const COLUMNS: usize = 700;

/// Channels that are drawn.
const DRAWN: usize = 6;

/// Least height of a channel's plot, points.
const LEAST: f32 = 58.0;

/// Height of the time's axis, and of a name above a plot, points.
const TIME: f32 = 32.0;
const NAME: f32 = 18.0;

/// Width of the values' axis, points.
const AXIS: f32 = 58.0;

/// One channel, ready to be drawn: over the time in s, in its own unit.
#[derive(Debug)]
struct Trace {
    name: String,
    unit: String,
    role: Role,
    points: Vec<PlotPoint>,
    largest: f64,
}

/// What would be read.
#[derive(Debug)]
pub(crate) struct Preview {
    /// What it is, in one line.
    summary: String,
    traces: Vec<Trace>,
    notices: Vec<String>,
}

impl Preview {
    pub(super) fn of(set: &RecordSet) -> Self {
        let count = set.entries.len();
        let Some((record, _)) = set.entries.first() else {
            return Self { summary: "no record".into(), traces: Vec::new(), notices: Vec::new() };
        };
        let samples = Samples { values: &[], start: record.start, interval: record.interval };
        let trace = |channel: &sindyscope_values::record::Channel| {
            let samples = Samples { values: &channel.values, ..samples };
            let (start, end) = (record.start, record.start + record.duration());
            let mut points = Vec::new();
            Envelope::new(&channel.values).points(&samples, start..=end, COLUMNS, &mut points);
            let largest = channel.values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            Trace { name: channel.name.clone(), unit: channel.unit.clone(), role: channel.role, points, largest }
        };
        let rate = significant_trimmed(record.interval.recip(), 5);
        let records = if count > 1 { format!("{count} records; the first: ") } else { String::new() };
        let summary =
            format!("{records}{} samples at {rate} Hz, {} s", record.len(), significant_trimmed(record.duration(), 4));
        Self { summary, traces: record.measured().take(DRAWN).map(trace).collect(), notices: record.notices.clone() }
    }

    pub(super) fn show(&self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.label(RichText::new(&self.summary).strong());
            if !self.notices.is_empty() {
                let text = self.notices.join("\n");
                ui.add(Label::new(RichText::new(self.notices.join(" · ")).weak().small()).truncate())
                    .on_hover_text(text);
            }
        });
        let count = self.traces.len().max(1) as f32;
        let height = ((ui.available_height() - TIME - 4.0) / count - NAME - 4.0).max(LEAST);
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            for (index, trace) in self.traces.iter().enumerate() {
                trace.show(ui, index, height, index + 1 == self.traces.len());
            }
        });
    }
}

impl Trace {
    fn show(&self, ui: &mut Ui, index: usize, height: f32, last: bool) {
        let dark = ui.visuals().dark_mode;
        let scale = Scale::suited(self.largest, &self.unit);
        let points: Vec<PlotPoint> = self.points.iter().map(|p| PlotPoint::new(p.x, p.y * scale.factor)).collect();
        let name = format!("{}{} {}", self.role.symbol(), self.role.index() + 1, self.name);
        let formatter =
            |mark: egui_plot::GridMark, _: &std::ops::RangeInclusive<f64>| axis::linear_label(mark, &Scale::plain(""));
        let time = AxisHints::new_x().formatter(formatter).label("t (s)");
        let values = AxisHints::new_y().formatter(formatter).min_thickness(AXIS);
        // Above the plot: on its side there is no room for a name.
        ui.label(RichText::new(scale.axis(&name)).small());
        Plot::new(("column preview", index))
            .height(if last { height + TIME } else { height })
            .show_axes([last, true])
            .show_grid(false)
            .width(ui.available_width() - 8.0)
            .set_margin_fraction(vec2(0.0, 0.08))
            .custom_x_axes(vec![time])
            .custom_y_axes(vec![values])
            .show_x(false)
            .show_y(false)
            .allow_scroll(false)
            .allow_zoom(false)
            .allow_drag(false)
            .allow_boxed_zoom(false)
            .show(ui, |plot| {
                let line = Line::new(&self.name, PlotPoints::Owned(points)).color(Ink::Measured.color(dark)).width(1.0);
                plot.line(line);
            });
    }
}
