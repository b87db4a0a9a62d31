//! The panel beside the plots that asks how a figure is to be saved: not modal, so the plot can be changed meanwhile.

use egui::{Align2, Context, DragValue, Key, Ui, Window, vec2};
use serde::{Deserialize, Serialize};

use super::widgets::{row, switch};
use sindyscope_report::document::{FigureFormat, FigureSize};

/// How figures are saved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct FigureLook {
    /// Size on paper.
    pub(crate) size: FigureSize,
    /// As the plot is on the screen, zoomed and with the curves that are shown; else whole, as in the report.
    pub(crate) as_shown: bool,
    /// What the name that is offered ends in.
    #[serde(skip)]
    pub(crate) format: Format,
}

/// The kind of file that is offered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Format {
    /// Pixels.
    #[default]
    Png,
    /// Lines and texts.
    Svg,
    /// A page.
    Pdf,
}

impl Format {
    /// The kind as the report writes it.
    pub(crate) fn figure(self) -> FigureFormat {
        match self {
            Self::Png => FigureFormat::Png,
            Self::Svg => FigureFormat::Svg,
            Self::Pdf => FigureFormat::Pdf,
        }
    }
}

/// What came of the panel in this frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FigurePanelOutcome {
    Open,
    Closed,
    /// Ask for a file.
    Save,
}

/// Draws the panel.
pub(crate) fn show(ctx: &Context, title: &str, look: &mut FigureLook) -> FigurePanelOutcome {
    if !ctx.text_edit_focused() && ctx.input_mut(|i| i.consume_key(egui::Modifiers::NONE, Key::Escape)) {
        return FigurePanelOutcome::Closed;
    }
    let (mut open, mut outcome) = (true, FigurePanelOutcome::Open);
    Window::new(format!("Save figure: {title}"))
        .id(egui::Id::unique("save figure"))
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .pivot(Align2::RIGHT_TOP)
        .default_pos(ctx.content_rect().right_top() + vec2(-360.0, 84.0))
        .show(ctx, |ui| {
            ui.set_width(300.0);
            let size = &mut look.size;
            number(
                ui,
                "width",
                "Width on paper: 85 mm is a column, 160 mm the text of an A4 page",
                &mut size.width,
                (30.0, 500.0),
                " mm",
            );
            number(ui, "height", "Height on paper", &mut size.height, (20.0, 500.0), " mm");
            number(ui, "letters", "Size of the axes' labels on paper", &mut size.font, (4.0, 40.0), " pt");
            row(ui, "drawn", "What the figure shows", |ui| {
                let choices = [
                    (false, "whole", "All data, as in the report"),
                    (true, "as shown", "Zoomed as it is, with the curves that are shown"),
                ];
                switch(ui, &mut look.as_shown, &choices);
            });
            row(ui, "file", "The kind of file; the ending of its name decides", |ui| {
                let choices = [
                    (Format::Png, "PNG", "Pixels, 300 to the inch"),
                    (Format::Svg, "SVG", "Vectors, for drawing programs and the web"),
                    (Format::Pdf, "PDF", "Vectors on a page of the figure's size, for LaTeX"),
                ];
                switch(ui, &mut look.format, &choices);
            });
            ui.add_space(4.0);
            if ui.button("Save to…").on_hover_text("Choose the file").clicked() {
                outcome = FigurePanelOutcome::Save;
            }
        });
    if open { outcome } else { FigurePanelOutcome::Closed }
}

fn number(ui: &mut Ui, label: &str, tooltip: &str, value: &mut f64, (low, high): (f64, f64), unit: &str) {
    row(ui, label, tooltip, |ui| {
        let field = DragValue::new(value).range(low..=high).speed(0.5).max_decimals(1).suffix(unit);
        ui.add_sized(vec2(90.0, super::theme::ROW - 2.0), field).accessible_name(format!("Figure's {label}"));
    });
}
