//! Plays the motion: pause, slow motion, and any instant by hand.

use egui::{Slider, Ui};
use serde::{Deserialize, Serialize};

use crate::app::widgets::icon;
use sindyscope_values::format::number::significant_trimmed;

/// How long a period of the motion takes on the screen at the pace offered, s.
const COMFORTABLE: f64 = 1.4;
/// Seconds between two pictures.
const FRAME: f64 = 1.0 / 30.0;

/// Where the motion is, and how fast it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Player {
    pub(crate) paused: bool,
    /// Seconds of the motion for a second on the screen; none: a pace that is comfortable to look at.
    pub(crate) pace: Option<f64>,
    /// The instant shown, s from the record's start.
    #[serde(skip)]
    pub(crate) at: f64,
    /// When it was shown, s of the window's clock.
    #[serde(skip)]
    seen: Option<f64>,
}

impl Default for Player {
    fn default() -> Self {
        Self { paused: false, pace: None, at: 0.0, seen: None }
    }
}

impl Player {
    /// Moves on, around at the end; asks for the next picture while it plays.
    pub(super) fn advance(&mut self, ui: &Ui, duration: f64, natural_frequency: f64) {
        let now = ui.input(|i| i.time);
        let passed = self.seen.map_or(0.0, |seen| (now - seen).clamp(0.0, 0.2));
        self.seen = Some(now);
        if !self.at.is_finite() || duration <= 0.0 {
            self.at = 0.0;
            return;
        }
        if !self.paused {
            self.at += passed * self.pace(natural_frequency);
            ui.ctx().request_repaint_after_secs(FRAME as f32);
        }
        if self.at >= duration || self.at < 0.0 {
            self.at = self.at.rem_euclid(duration);
        }
    }

    fn pace(&self, natural_frequency: f64) -> f64 {
        self.pace.unwrap_or(1.0 / (COMFORTABLE * natural_frequency).max(1e-9))
    }

    /// The row of controls.
    pub(super) fn show(&mut self, ui: &mut Ui, duration: f64, natural_frequency: f64) {
        let (sign, name) = if self.paused { ("▶", "Play") } else { ("⏸", "Pause") };
        if icon(ui, sign, name, "Move the drawing, or hold it", true).clicked() {
            self.paused = !self.paused;
        }
        ui.spacing_mut().slider_width = (ui.available_width() - 300.0).clamp(60.0, 420.0);
        let scrub = Slider::new(&mut self.at, 0.0..=duration).show_value(false);
        let scrub = ui.add(scrub).on_hover_text("The instant that is drawn; drag it").accessible_name("Instant");
        if scrub.dragged() || scrub.has_focus() && scrub.changed() {
            self.paused = true;
        }
        ui.add_sized(
            [70.0, 18.0],
            egui::Label::new(egui::RichText::new(format!("{} s", significant_trimmed(self.at, 3))).monospace()),
        );
        let mut pace = self.pace(natural_frequency);
        ui.spacing_mut().slider_width = 70.0;
        let slow = Slider::new(&mut pace, 1e-3..=10.0).logarithmic(true).custom_formatter(|v, _| {
            if v == 1.0 { "real time".into() } else { format!("× {}", significant_trimmed(v, 2)) }
        });
        if ui
            .add(slow)
            .on_hover_text("Slow motion: seconds of the motion for a second on the screen")
            .accessible_name("Pace")
            .changed()
        {
            self.pace = Some(pace);
        }
    }
}
