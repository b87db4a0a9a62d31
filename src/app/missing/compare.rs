//! Compare: where the simulated response and the measurement part.

use crate::format::units::raised;
use std::sync::Arc;

use egui::{RichText, Ui, vec2};

use super::plots::{self, Frame, Panel, Trace};
use super::{Missing, Sight, cards, map, stage_color, words};
use crate::app::plot::palette::{self, Ink};
use crate::app::theme;
use crate::format::number::significant;
use crate::gap::{Place, Stage, Trace as Response};
use crate::record::Usage;

/// Least height of the row of maps, points.
const MAPS: f32 = 190.0;

pub(super) fn show(ui: &mut Ui, room: &mut Missing, sight: &Sight<'_>, stage: &Arc<Stage>) {
    sentence(ui, sight);
    let Some(trace) = record(ui, &stage.traces, &mut room.record, "") else { return };
    let maps = (0.34 * ui.available_height()).max(MAPS);
    let height = ui.available_height() - maps - 6.0;
    time(ui, room, sight, trace, height);
    below(ui, room, sight, maps);
}

/// Where it is, in a sentence of its own height.
fn sentence(ui: &mut Ui, sight: &Sight<'_>) {
    let size = vec2(ui.available_width(), 36.0);
    ui.allocate_ui_with_layout(size, egui::Layout::top_down(egui::Align::Min), |ui| {
        ui.set_min_size(size);
        let text = match (sight.place(), sight.round()) {
            (_, Some(round)) if !round.evidence.significant => {
                format!("No gap beyond noise ({}): what is left is noise.", words::no_gap(round.evidence.p_value))
            }
            (Some(place), round) => {
                let verdict = round.map(|r| format!("A gap beyond noise ({}). ", words::p_value(r.evidence.p_value)));
                verdict.unwrap_or_default() + &raised(&place.sentence)
            }
            (None, _) if sight.looking() => "Looking…".to_owned(),
            (None, _) => "The model's simulated response over the measurement, and the gap between them. \
                          Is it more than noise, where is it, and what would close it?"
                .to_owned(),
        };
        ui.add(egui::Label::new(RichText::new(text).size(13.5)).wrap());
    });
}

/// Measured and simulated, their difference, and the force that is missing, on one time axis.
fn time(ui: &mut Ui, room: &mut Missing, sight: &Sight<'_>, trace: &Response, height: f32) {
    let dark = sight.dark;
    let model = stage_color(sight.walk.accepted.len(), dark);
    let gap = room.plots.made(0, &trace.measured, &trace.simulated, |m, s| m - s);
    let missing = sight.place().and_then(|p| p.force.iter().find(|f| f.record == trace.record));
    let measured = || Arc::clone(&trace.measured);
    let line = |name, color, width, values, leads| Trace { name, color, width, values, leads };
    let response = Panel {
        symbol: "x",
        unit: sight.unit.to_owned(),
        traces: vec![
            line("measured", Ink::Measured.color(dark), Ink::Measured.width(), measured(), true),
            line("simulated", model, Ink::Identified.width(), Arc::clone(&trace.simulated), false),
        ],
        band: None,
        level: None,
        aside: String::new(),
        empty: "",
        share: 1.4,
    };
    let rms = (gap.iter().map(|g| g * g).sum::<f64>() / gap.len().max(1) as f64).sqrt();
    let noise = sight.known.noise_floor;
    let gap = Panel {
        symbol: "gap",
        unit: sight.unit.to_owned(),
        traces: vec![line("measured − simulated", Ink::Error.color(dark), 1.0, gap, true)],
        band: None,
        level: (noise > 0.0)
            .then(|| (format!("± noise {}", crate::format::units::format_si(noise, sight.unit, 2)), noise)),
        aside: format!("RMS {}", crate::format::units::format_si(rms, sight.unit, 3)),
        empty: "",
        share: 1.0,
    };
    let force = Panel {
        symbol: "force",
        unit: words::acceleration(sight.unit),
        traces: missing
            .map(|m| line("missing force per mass", Ink::Input.color(dark), 1.2, Arc::clone(&m.force), true))
            .into_iter()
            .collect(),
        band: missing.map(|m| ("± 1 σ", Arc::clone(&m.deviation))),
        level: None,
        aside: String::new(),
        empty: match trace.usage {
            Usage::HeldOut => "known for fitted records only",
            _ => "the missing force comes with the search",
        },
        share: 1.0,
    };
    // Of noise there is no worst stretch.
    let worst = missing.filter(|_| !only_noise(sight)).map_or(&[][..], |m| &m.worst);
    let frame = Frame {
        id: "compare",
        start: trace.start,
        interval: trace.interval,
        samples: trace.measured.len(),
        held_out: trace.usage == Usage::HeldOut,
        worst,
        dark,
        height,
    };
    plots::stack(ui, &mut room.plots, &frame, &[response, gap, force]);
}

/// Whether it was asked, and there is no gap beyond noise.
fn only_noise(sight: &Sight<'_>) -> bool {
    sight.round().is_some_and(|r| !r.evidence.significant)
}

/// The map, and one profile.
fn below(ui: &mut Ui, room: &mut Missing, sight: &Sight<'_>, height: f32) {
    let empty = Place::default();
    let place = sight.place().filter(|_| !only_noise(sight)).unwrap_or(&empty);
    let why = if only_noise(sight) {
        "no gap beyond noise: there is nothing to map"
    } else {
        "the map comes with the search"
    };
    ui.horizontal_top(|ui| {
        let half = 0.5 * (ui.available_width() - 8.0);
        map::show(ui, &place.map, sight.unit, vec2(half, height), why);
        ui.vertical(|ui| {
            ui.set_width(half);
            if place.profiles.is_empty() {
                return;
            }
            chips(ui, room, place);
            let left = height - 24.0;
            let shown = &place.profiles[room.profile.min(place.profiles.len() - 1)];
            map::profile(ui, shown, sight.unit, vec2(half, left), "");
        });
    });
}

/// Which quantity the profile is over, the one that explains most first.
fn chips(ui: &mut Ui, room: &mut Missing, place: &Place) {
    cards::line(ui, 20.0, |ui| {
        ui.weak("over");
        let shown = room.profile.min(place.profiles.len() - 1);
        let text = |k: usize| {
            let p = &place.profiles[k];
            format!("{}  ({} %)", p.axis.0, significant(100.0 * p.share, 2))
        };
        let combo = egui::ComboBox::from_id_salt("profile").width(130.0).selected_text(text(shown));
        let response = combo.show_ui(ui, |ui| {
            for k in 0..place.profiles.len() {
                ui.selectable_value(&mut room.profile, k, text(k));
            }
        });
        response
            .response
            .on_hover_text("The quantity, and the share of the missing force's energy that it alone explains");
    });
}

/// A line that names a record and leads to the next; the record shown, if there is one.
pub(super) fn record<'a>(ui: &mut Ui, traces: &'a [Response], shown: &mut usize, aside: &str) -> Option<&'a Response> {
    *shown = (*shown).min(traces.len().checked_sub(1)?);
    cards::line(ui, 22.0, |ui| {
        if traces.len() > 1 {
            let step = |ui: &mut Ui, sign: &str, name: &str, to: Option<usize>| {
                let response = ui.add_enabled(to.is_some(), egui::Button::new(sign).small().frame(false));
                response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, to.is_some(), name));
                response.on_hover_text(name).clicked().then_some(to).flatten()
            };
            let back = step(ui, "⏴", "Previous record", shown.checked_sub(1));
            let on = step(ui, "⏵", "Next record", Some(*shown + 1).filter(|k| *k < traces.len()));
            *shown = back.or(on).unwrap_or(*shown);
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
            ui.painter().rect_filled(rect, 1.0, palette::held_out(ui.visuals().dark_mode));
        }
        if !aside.is_empty() {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.add(egui::Label::new(RichText::new(aside).weak()).truncate());
            });
        }
    });
    traces.get(*shown)
}
