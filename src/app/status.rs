//! The line at the bottom: how long it took, what is under way, the last message.

use egui::{Align, Layout, Margin, Panel, Rect, RichText, Ui, pos2, vec2};

use super::notices::{Level, Notices, Toasted};
use super::queue::JobProgress;
use super::records::OpenRecords;
use super::theme;

/// Work shorter than this shows no progress line: it would only flicker, s.
const SOON: f32 = 0.15;

/// What the line shows.
pub(crate) struct Status<'a> {
    pub(crate) data: &'a OpenRecords,
    /// What is said in place of how long the study took.
    pub(crate) said: Option<String>,
    pub(crate) fitting: Option<JobProgress>,
    pub(crate) other: Option<JobProgress>,
    pub(crate) opening: bool,
    pub(crate) notices: &'a Notices,
    pub(crate) seen: &'a mut Toasted,
    pub(crate) log_open: &'a mut bool,
}

/// What a person asked for in the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StatusAct {
    /// Stop the work that takes long.
    Cancel,
}

pub(crate) fn show(ui: &mut Ui, status: &mut Status<'_>) -> Option<StatusAct> {
    let mut asked = None;
    let frame = egui::Frame::new().fill(ui.visuals().panel_fill).inner_margin(Margin::symmetric(12, 3));
    let panel = Panel::bottom("status").resizable(false).exact_size(26.0).frame(frame).show(ui, |ui| {
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            let colors = theme::accents(ui.visuals().dark_mode);
            let long = status.other.filter(|b| b.elapsed.as_secs_f32() > 0.3);
            match (&status.data.failure, &status.data.outcome) {
                _ if status.opening => {
                    ui.label("reading…");
                }
                _ if let Some(job) = long.filter(|job| job.stage.is_some()) => {
                    let (stage, far) = (job.stage.unwrap_or_default(), job.words());
                    ui.label(if far.is_empty() { stage.to_owned() } else { format!("{stage}: {far}") });
                }
                _ if let Some(said) = &status.said => {
                    ui.label(RichText::new(said).weak());
                }
                (Some(failure), _) => {
                    ui.add(egui::Label::new(RichText::new(failure).color(colors.wrong)).truncate());
                }
                (None, Some(outcome)) => {
                    let elapsed = outcome.elapsed;
                    let text = format!("fitted in {} ms · simulated in {} ms", ms(elapsed.fit), ms(elapsed.simulate));
                    ui.label(RichText::new(text).weak());
                }
                (None, None) => {
                    ui.weak("ready");
                }
            }
            if status.opening && long.is_some() && ui.small_button("Cancel").clicked() {
                asked = Some(StatusAct::Cancel);
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let unread = status.notices.unread(status.seen);
                let text = if unread > 0 { format!("messages ({unread})") } else { "messages".to_owned() };
                let button = ui.add(egui::Button::new(RichText::new(text).weak()).frame_when_inactive(false));
                let button = button.on_hover_text("What the program said, to be read again");
                egui::Popup::from_toggle_button_response(&button)
                    .open_bool(status.log_open)
                    .close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside)
                    .show(|ui| status.notices.show_log(ui, status.seen));
                if let Some(message) = status.notices.latest().filter(|_| unread > 0) {
                    let color =
                        if message.level == Level::Error { colors.caution } else { ui.visuals().weak_text_color() };
                    ui.add(egui::Label::new(RichText::new(&message.text).color(color)).truncate());
                }
            });
        });
    });
    progress(ui, panel.response.rect, status);
    asked
}

/// A thin line on the bar's upper edge while something is computed.
fn progress(ui: &Ui, bar: Rect, status: &Status<'_>) {
    let Some(busy) = status.other.or(status.fitting) else { return };
    let elapsed = busy.elapsed.as_secs_f32();
    if elapsed < SOON {
        ui.ctx().request_repaint_after_secs(SOON - elapsed);
        return;
    }
    let color = theme::accents(ui.visuals().dark_mode).accent;
    let (from, to) = match busy.share {
        Some(share) => (0.0, share as f32),
        None => {
            // A stretch that wanders: how much is left is not known.
            let at = (0.6 * elapsed).fract() * 1.3 - 0.3;
            (at.max(0.0), (at + 0.3).min(1.0))
        }
    };
    ui.ctx().request_repaint_after_secs(0.05);
    let line = Rect::from_min_size(
        pos2(bar.left() + from * bar.width(), bar.top()),
        vec2((to - from).max(0.0) * bar.width(), 2.0),
    );
    ui.painter().rect_filled(line, 0.0, color);
}

fn ms(value: f64) -> String {
    if value < 10.0 { format!("{value:.1}") } else { format!("{value:.0}") }
}
