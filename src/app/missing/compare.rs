//! Compare: where the simulated response and the measurement part.

use sindyscope_values::format::units::raised;
use std::sync::Arc;

use egui::{RichText, Ui, vec2};

use super::act::WalkAct;
use super::act::WalkFigure;
use super::canvas::WalkCanvas;
use super::choice;
use super::figures::{self, Manner};
use super::known::{WalkContext, stands};
use super::words;
use crate::app::plot::palette::{self, Tint};
use crate::app::state::RoundStep;
use crate::app::theme;
use crate::app::widgets::{line, record_steps};
use sindyscope_search::{Finding, Place, Stage, Trace as Response};
use sindyscope_values::format::number::significant;
use sindyscope_values::record::Usage;

/// Least height of the row of maps, points.
const MAPS: f32 = 160.0;

pub(super) fn show(
    ui: &mut Ui,
    canvas: &mut WalkCanvas,
    context: &WalkContext<'_>,
    stage: &Arc<Stage>,
    acts: &mut Vec<WalkAct>,
) {
    sentence(ui, context);
    if record(ui, context, (&stage.traces, &mut canvas.view.record, &mut canvas.mass), "").is_none() {
        return;
    }
    let maps = (0.34 * ui.available_height()).max(MAPS);
    let height = ui.available_height() - maps - 6.0;
    let figure = WalkFigure::Time(RoundStep::Compare);
    figures::show(ui, canvas, context, (&figure, None), Manner::new(vec2(ui.available_width(), height)), acts);
    below(ui, canvas, context, maps, acts);
}

/// Where it is, in a sentence of its own height.
fn sentence(ui: &mut Ui, context: &WalkContext<'_>) {
    let size = vec2(ui.available_width(), 36.0);
    ui.allocate_ui_with_layout(size, egui::Layout::top_down(egui::Align::Min), |ui| {
        ui.set_min_size(size);
        let first = context.round().and_then(|r| r.candidates.first()).filter(|c| stands(c));
        let text = match (context.place(), context.round()) {
            (_, Some(round)) if !round.evidence.significant => match context.doubted() {
                Some(doubted) => raised(&doubted.sentence),
                None => {
                    format!("No gap beyond noise ({}): what is left is noise.", words::no_gap(round.evidence.p_value))
                }
            },
            // The base's own spring and damper have taken up part of the force: what orders the rest need not be the
            // quantity that the effect depends on.
            (Some(_), Some(round)) if let Some(first) = first => format!(
                "A gap beyond noise ({}). {}: below, the missing force is drawn over {}, on which {} depends.",
                words::p_value(round.evidence.p_value),
                words::closes(round),
                raised(&first.curve.axis),
                if matches!(round.finding, Finding::Ambiguous(_)) { "the first" } else { "that" }
            ),
            (Some(place), round) => {
                let verdict = round.map(|r| format!("A gap beyond noise ({}). ", words::p_value(r.evidence.p_value)));
                verdict.unwrap_or_default() + &raised(&place.sentence)
            }
            (None, _) if context.looking() => "Looking…".to_owned(),
            (None, _) => "The model's simulated response over the measurement, and the gap between them. \
                          Is it more than noise, where is it, and what would close it?"
                .to_owned(),
        };
        let color = ui.visuals().text_color();
        let place = context.place().map_or(String::new(), |p| raised(&p.sentence));
        let whole = if place.is_empty() || text.contains(&place) { text.clone() } else { format!("{text}\n\n{place}") };
        let mut job = egui::text::LayoutJob::simple(text, egui::FontId::proportional(13.5), color, size.x);
        // Plots beneath must not move when a sentence is longer.
        job.wrap.max_rows = 2;
        ui.add(egui::Label::new(job)).on_hover_text(whole);
    });
}

/// The map, and one profile.
fn below(ui: &mut Ui, canvas: &mut WalkCanvas, context: &WalkContext<'_>, height: f32, acts: &mut Vec<WalkAct>) {
    ui.horizontal_top(|ui| {
        let half = 0.5 * (ui.available_width() - 8.0);
        if !figures::show(
            ui,
            canvas,
            context,
            (&WalkFigure::Map, None),
            Manner::new(vec2(half, height)).compact(),
            acts,
        ) {
            let why = if choice::only_noise(context) {
                "no gap beyond noise: there is nothing to map"
            } else {
                "the map comes with the search"
            };
            ui.add_sized(vec2(half, height), egui::Label::new(RichText::new(why).weak()));
        }
        ui.vertical(|ui| {
            ui.set_width(half);
            let Some(place) = context.place().filter(|p| !choice::only_noise(context) && !p.profiles.is_empty()) else {
                return;
            };
            chips(ui, canvas, place, choice::profile(canvas, context, place));
            let manner = Manner::new(vec2(half, height - 24.0)).compact();
            figures::show(ui, canvas, context, (&WalkFigure::Profile, None), manner, acts);
        });
    });
}

/// Which quantity the profile is over, the one that explains most first.
fn chips(ui: &mut Ui, canvas: &mut WalkCanvas, place: &Place, shown: usize) {
    line(ui, 20.0, |ui| {
        ui.weak("over");
        let text = |k: usize| {
            let p = &place.profiles[k];
            format!("{}  ({} %)", p.axis.0, significant(100.0 * p.share, 2))
        };
        let combo = egui::ComboBox::from_id_salt("profile").width(130.0).selected_text(text(shown));
        let response = combo.show_ui(ui, |ui| {
            for k in 0..place.profiles.len() {
                if ui.selectable_label(k == shown, text(k)).clicked() {
                    canvas.view.profile = Some(place.profiles[k].axis.0.clone());
                }
            }
        });
        response
            .response
            .on_hover_text("The quantity, and the share of the missing force's energy that it alone explains");
    });
}

/// A line that names a record and leads to the next, and at its right asks for the mass; the record shown, if there is
/// one.
pub(super) fn record<'a>(
    ui: &mut Ui,
    context: &WalkContext<'_>,
    (traces, shown, mass): (&'a [Response], &mut usize, &mut usize),
    aside: &str,
) -> Option<&'a Response> {
    *shown = (*shown).min(traces.len().checked_sub(1)?);
    line(ui, 22.0, |ui| {
        if traces.len() > 1 {
            *shown = record_steps(ui, *shown, traces.len()).unwrap_or(*shown);
        }
        let trace = &traces[*shown];
        ui.strong(&*trace.record);
        if traces.len() > 1 {
            ui.weak(format!("{} of {}", *shown + 1, traces.len()));
        }
        ui.weak("·");
        let (text, color) = match trace.usage {
            Usage::HeldOut => ("held out: never fitted", theme::accents(ui.visuals().dark_mode).good),
            _ => ("fitted", ui.visuals().text_color()),
        };
        ui.colored_label(color, text);
        if trace.usage == Usage::HeldOut {
            let (rect, _) = ui.allocate_exact_size(vec2(14.0, 10.0), egui::Sense::hover());
            ui.painter().rect_filled(rect, 1.0, palette::tint(Tint::HeldOut, ui.visuals().dark_mode));
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let sensors = &context.subject.sensors;
            if sensors.len() > 1 {
                // From right to left, so that the first stands on the left.
                for (k, sensor) in sensors.iter().enumerate().rev() {
                    if ui.selectable_label(*mass == k, &sensor.symbol).clicked() {
                        *mass = k;
                    }
                }
            }
            if !aside.is_empty() {
                ui.add(egui::Label::new(RichText::new(aside).weak()).truncate());
            }
        });
    });
    traces.get(*shown)
}
