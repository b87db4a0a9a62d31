//! The pages of the report, as they will be saved.

use egui::{
    Align, ColorImage, Layout, RichText, ScrollArea, Sense, Stroke, StrokeKind, TextureHandle, TextureOptions, Ui,
    WidgetInfo, vec2,
};

use super::{ReportAct, ReportRoom};
use crate::app::purpose::ReportForm;
use crate::app::theme::{self, ROW};
use crate::app::widgets::switch;
use sindyscope_report::document::{Arrangement, Paper, Pixels};

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

/// A page as it was drawn; it goes to the graphics card once it is seen.
pub(super) struct Page {
    image: Option<ColorImage>,
    texture: Option<TextureHandle>,
    /// Height over width.
    ratio: f32,
}

impl Page {
    pub(super) fn new(pixels: Pixels) -> Self {
        let Pixels { width, height, bytes } = pixels;
        let size = [width, height].map(|n| n as usize);
        let image = ColorImage::from_rgba_premultiplied(size, &bytes);
        Self { image: Some(image), texture: None, ratio: height as f32 / width.max(1) as f32 }
    }
}

impl ReportRoom {
    /// Draws the centre.
    pub(crate) fn show(&mut self, ui: &mut Ui, report: &mut Arrangement) -> Option<ReportAct> {
        let act = self.header(ui, report);
        if let Some(failure) = &self.failure {
            let color = theme::accents(ui.visuals().dark_mode).wrong;
            ui.colored_label(color, format!("The pages cannot be shown: {failure}. Save the report as HTML instead."));
        }
        if self.pages.is_empty() {
            ui.centered_and_justified(|ui| ui.weak("drawing the pages…"));
            return act;
        }
        let room = ui.available_size();
        let ratio = self.pages[0].ratio;
        let wide = (room.x - 2.0 * MARGIN - 8.0).clamp(120.0, FULL);
        let width = if self.whole { wide.min((room.y - 2.0 * MARGIN) / ratio).max(120.0) } else { wide };
        let pixels = (width * ui.ctx().pixels_per_point()).max(1.0) as u32;
        self.width = pixels.div_ceil(STEP).saturating_mul(STEP).min(WIDEST);
        let ground = ui.visuals().faint_bg_color;
        ui.painter().rect_filled(ui.available_rect_before_wrap(), 4.0, ground);
        let count = self.pages.len();
        ScrollArea::vertical().auto_shrink([false, false]).show_viewport(ui, |ui, seen| {
            let left = ui.max_rect().left() + 0.5 * (ui.available_width() - width).max(0.0);
            let pitch = width * ratio + MARGIN;
            ui.set_height(pitch * count as f32 + MARGIN);
            let top = ui.max_rect().top();
            for (k, page) in self.pages.iter_mut().enumerate() {
                let y = MARGIN + k as f32 * pitch;
                if y > seen.bottom() || y + pitch < seen.top() {
                    continue;
                }
                let rect = egui::Rect::from_min_size(egui::pos2(left, top + y), vec2(width, width * page.ratio));
                let response = ui.allocate_rect(rect, Sense::hover());
                let name = format!("Page {} of {count}", k + 1);
                response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, &name));
                if let Some(image) = page.image.take() {
                    page.texture = Some(ui.ctx().load_texture(name, image, TextureOptions::LINEAR));
                }
                let colors = theme::accents(ui.visuals().dark_mode);
                ui.painter().rect_filled(rect, 0.0, egui::Color32::WHITE);
                if let Some(texture) = &page.texture {
                    let whole = egui::Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
                    ui.painter().image(texture.id(), rect, whole, egui::Color32::WHITE);
                }
                ui.painter().rect_stroke(rect, 0.0, Stroke::new(1.0, colors.line), StrokeKind::Outside);
            }
        });
        act
    }

    /// The line above the pages: how many there are, the paper, what to save.
    fn header(&mut self, ui: &mut Ui, report: &mut Arrangement) -> Option<ReportAct> {
        let mut act = None;
        let size = vec2(ui.available_width(), ROW + 6.0);
        let in_one_row = size.x >= ONE_ROW;
        ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_size(size);
            self.looks(ui, report);
            if in_one_row {
                act = saves(ui);
            }
        });
        if !in_one_row {
            ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| act = saves(ui));
        }
        act
    }

    /// The paper, how large the pages are shown, and how many there are.
    fn looks(&mut self, ui: &mut Ui, report: &mut Arrangement) {
        let papers = [(Paper::A4, "A4", "210 mm × 297 mm"), (Paper::Letter, "Letter", "8.5 in × 11 in")];
        switch(ui, &mut report.paper, &papers);
        ui.add_space(4.0);
        let sizes = [
            (false, "Page width", "The page as wide as there is room for"),
            (true, "Whole page", "The page as high as there is room for"),
        ];
        switch(ui, &mut self.whole, &sizes);
        ui.add_space(4.0);
        let count = match self.pages.len() {
            0 => String::new(),
            1 => "1 page".to_owned(),
            n => format!("{n} pages"),
        };
        ui.label(RichText::new(count).weak());
    }
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
