//! The pages of the report, as they will be saved.

use std::sync::Arc;

use egui::{
    Align, Color32, ColorImage, Layout, Rect, RichText, ScrollArea, Sense, Stroke, StrokeKind, TextureHandle,
    TextureOptions, Ui, WidgetInfo, pos2, vec2,
};

use crate::app::purpose::ReportForm;
use crate::app::theme::{self, ROW};
use crate::app::widgets::{line, switch};
use sindyscope_report::document::{Arrangement, Paper};

/// Pixels that a page is wide at first.
pub(super) const USUAL: u32 = 768;

/// Widths in pixels are multiples of this: a window that is drawn wider does not have every width drawn.
const STEP: u32 = 64;

/// Widest a page is drawn, pixels.
const WIDEST: u32 = 2048;

/// Room around a page, points.
const MARGIN: f32 = 14.0;

/// Width from which on the line above the pages is one, points.
const ONE_ROW: f32 = 520.0;

/// Widest a page is shown, points.
const FULL: f32 = 860.0;

/// What the room asks the window to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReportAct {
    /// Save the report; the file's ending says as what.
    Save(ReportForm),
    /// Draw the pages so many pixels wide.
    Width(u32),
}

/// How the pages are shown.
#[derive(Default)]
pub(super) struct Pages {
    /// Whether a whole page is seen at once.
    whole: bool,
    /// The pages on the graphics card, once they were seen.
    textures: Vec<(Arc<ColorImage>, TextureHandle)>,
}

impl Pages {
    /// Draws the pages; gives what is asked for, and the width that they are to be drawn in.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        (pages, failure): (&[Arc<ColorImage>], Option<&str>),
        report: &mut Arrangement,
    ) -> (Option<ReportAct>, Option<u32>) {
        let act = self.header(ui, report, pages.len());
        if let Some(failure) = failure {
            let color = theme::accents(ui.visuals().dark_mode).wrong;
            ui.colored_label(color, format!("The pages cannot be shown: {failure}. Save the report as HTML instead."));
        }
        let Some(first) = pages.first() else {
            ui.centered_and_justified(|ui| ui.weak("drawing the pages…"));
            return (act, None);
        };
        self.textures.retain(|(drawn, _)| pages.iter().any(|page| Arc::ptr_eq(page, drawn)));
        let room = ui.available_size();
        let wide = (room.x - 2.0 * MARGIN - 8.0).clamp(120.0, FULL);
        let width = if self.whole { wide.min((room.y - 2.0 * MARGIN) / ratio(first)).max(120.0) } else { wide };
        let pixels = (width * ui.ctx().pixels_per_point()).max(1.0) as u32;
        let ground = ui.visuals().faint_bg_color;
        ui.painter().rect_filled(ui.available_rect_before_wrap(), 4.0, ground);
        ScrollArea::vertical().auto_shrink([false, false]).show_viewport(ui, |ui, seen| {
            let left = ui.max_rect().left() + 0.5 * (ui.available_width() - width).max(0.0);
            let pitch = width * ratio(first) + MARGIN;
            ui.set_height(pitch * pages.len() as f32 + MARGIN);
            let top = ui.max_rect().top();
            for (k, page) in pages.iter().enumerate() {
                let y = MARGIN + k as f32 * pitch;
                if y <= seen.bottom() && y + pitch >= seen.top() {
                    let rect = Rect::from_min_size(pos2(left, top + y), vec2(width, width * ratio(page)));
                    self.page(ui, rect, page, format!("Page {} of {}", k + 1, pages.len()));
                }
            }
        });
        (act, Some(pixels.div_ceil(STEP).saturating_mul(STEP).min(WIDEST)))
    }

    fn page(&mut self, ui: &mut Ui, rect: Rect, page: &Arc<ColorImage>, name: String) {
        let response = ui.allocate_rect(rect, Sense::hover());
        response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, &name));
        let known = self.textures.iter().position(|(drawn, _)| Arc::ptr_eq(drawn, page));
        let known = known.unwrap_or_else(|| {
            let texture = ui.ctx().load_texture(name, Arc::clone(page), TextureOptions::LINEAR);
            self.textures.push((Arc::clone(page), texture));
            self.textures.len() - 1
        });
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        ui.painter().rect_filled(rect, 0.0, Color32::WHITE);
        ui.painter().image(self.textures[known].1.id(), rect, whole, Color32::WHITE);
        let line = theme::accents(ui.visuals().dark_mode).line;
        ui.painter().rect_stroke(rect, 0.0, Stroke::new(1.0, line), StrokeKind::Outside);
    }

    /// The line above the pages: how many there are, the paper, what to save.
    fn header(&mut self, ui: &mut Ui, report: &mut Arrangement, count: usize) -> Option<ReportAct> {
        let mut act = None;
        let in_one_row = ui.available_width() >= ONE_ROW;
        line(ui, ROW + 6.0, |ui| {
            self.looks(ui, report, count);
            if in_one_row {
                act = saves(ui);
            }
        });
        if !in_one_row {
            line(ui, ROW + 6.0, |ui| act = saves(ui));
        }
        act
    }

    /// The paper, how large the pages are shown, and how many there are.
    fn looks(&mut self, ui: &mut Ui, report: &mut Arrangement, count: usize) {
        let papers = [(Paper::A4, "A4", "210 mm × 297 mm"), (Paper::Letter, "Letter", "8.5 in × 11 in")];
        switch(ui, &mut report.paper, &papers);
        ui.add_space(4.0);
        let sizes = [
            (false, "Page width", "The page as wide as there is room for"),
            (true, "Whole page", "The page as high as there is room for"),
        ];
        switch(ui, &mut self.whole, &sizes);
        ui.add_space(4.0);
        let count = match count {
            0 => String::new(),
            1 => "1 page".to_owned(),
            n => format!("{n} pages"),
        };
        ui.label(RichText::new(count).weak());
    }
}

/// A page's height over its width.
fn ratio(page: &ColorImage) -> f32 {
    let [width, height] = page.size;
    height as f32 / width.max(1) as f32
}

/// The buttons that save the report.
fn saves(ui: &mut Ui) -> Option<ReportAct> {
    let mut act = None;
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        for (saved, label, hint) in [
            (ReportForm::Html, "Save HTML…", "One web page that needs nothing beside itself"),
            (ReportForm::Pdf, "Save PDF…", "These pages, with vector figures and text that can be copied"),
        ] {
            if ui.button(label).on_hover_text(hint).clicked() {
                act = Some(ReportAct::Save(saved));
            }
        }
    });
    act
}
