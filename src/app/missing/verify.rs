//! Verify: did the gap shrink on data never fitted, and what is left.

use sindyscope_search::{Finding, Stage, Verdict, within};
use sindyscope_values::format::units::raised;
use std::sync::Arc;

use egui::{RichText, ScrollArea, Ui, vec2};

use super::figures::{self, Figure};
use super::plots::{self, Frame, Panel, Trace};
use super::{Act, Missing, RoundStep, Sight, compare, map, stage_color, waterfall, words};
use crate::app::theme;
use crate::app::widgets::card;
use sindyscope_values::record::Usage;

pub(super) fn show(ui: &mut Ui, room: &mut Missing, sight: &Sight<'_>, acts: &mut Vec<Act>) {
    let stages = sight.stages();
    let (Some(first), Some(last)) = (stages.first(), stages.last()) else {
        ui.centered_and_justified(|ui| ui.weak("fitting…"));
        return;
    };
    verdict(ui, sight, first, last);
    let mut shown = record_shown(room, last);
    let was = shown;
    let below = (0.40 * ui.available_height()).max(210.0);
    if let Some(trace) = compare::record(ui, sight, (&last.traces, &mut shown, &mut room.mass), "").cloned() {
        let height = ui.available_height() - below - 6.0;
        before_and_after(ui, room, sight, (&stages, &trace), height, acts);
    }
    if shown != was {
        room.verified = Some(shown);
    }
    let height = ui.available_height() - 4.0;
    ui.horizontal_top(|ui| {
        let half = 0.54 * (ui.available_width() - 8.0);
        let (noise, unit) = (sight.known.noise_floor, sight.unit);
        if let Some(response) = waterfall::show(ui, &stages, noise, unit, vec2(half, height)) {
            let table = || figures::waterfall_table(&stages, noise, unit);
            figures::menu(&response, &Figure::Waterfall, table, acts);
        }
        ui.vertical(|ui| {
            let width = ui.available_width();
            ui.set_width(width);
            ScrollArea::vertical().id_salt("what is left").max_height(height).auto_shrink([false, false]).show(
                ui,
                |ui| {
                    ui.set_max_width(width - 10.0);
                    left(ui, sight, height, acts);
                },
            );
        });
    });
}

/// Which record is shown: the one that was chosen, else the first that was never fitted.
pub(super) fn record_shown(room: &Missing, stage: &Stage) -> usize {
    let held_out = || stage.traces.iter().position(|t| t.usage == Usage::HeldOut);
    room.verified.or_else(held_out).unwrap_or(0)
}

/// The verdict in one sentence, in room of a fixed height.
fn verdict(ui: &mut Ui, sight: &Sight<'_>, first: &Stage, last: &Stage) {
    let size = vec2(ui.available_width(), 40.0);
    ui.allocate_ui_with_layout(size, egui::Layout::top_down(egui::Align::Min), |ui| {
        ui.set_min_size(size);
        let colors = theme::accents(sight.dark);
        let (text, color) = match sight.conclusion() {
            Some(d) => {
                let color = match d.verdict {
                    Verdict::Named | Verdict::NothingMissing => colors.good,
                    Verdict::Ambiguous | Verdict::Unexplained => colors.caution,
                };
                (raised(&d.sentence), color)
            }
            None if last.effects.is_empty() => {
                ("Nothing was added yet: this is the base model.".to_owned(), ui.visuals().text_color())
            }
            None => {
                let names: Vec<String> = last.effects.iter().map(|e| within(&e.title)).collect();
                let text = format!(
                    "With {} the error on data never fitted goes {}.",
                    names.join(" and "),
                    words::shrinks(&first.gap, &last.gap, sight.unit)
                );
                (text, ui.visuals().text_color())
            }
        };
        ui.add(egui::Label::new(RichText::new(text).size(14.0).strong().color(color)).wrap());
    });
}

/// Measured, before and after over each other, the gaps beneath.
pub(super) fn before_and_after(
    ui: &mut Ui,
    room: &mut Missing,
    sight: &Sight<'_>,
    (stages, trace): (&[&Arc<Stage>], &sindyscope_search::Trace),
    height: f32,
    acts: &mut Vec<Act>,
) {
    let dark = sight.dark;
    let mut traces = vec![Trace::measured(trace.of_mass(sight.mass).0, dark)];
    let mut gaps = Vec::new();
    let last = stages.len() - 1;
    let ends: Vec<usize> = if last > 0 { vec![0, last] } else { vec![0] };
    for k in ends {
        let Some(response) = stages[k].traces.iter().find(|t| t.record == trace.record) else { continue };
        let (name, width) = match k {
            0 if last == 0 => ("base", 1.3),
            0 => ("before", 1.1),
            _ => ("after", 1.6),
        };
        let color = stage_color(k, dark);
        let (measured, simulated) = response.of_mass(sight.mass);
        traces.push(Trace { name, color, width, values: Arc::clone(simulated), leads: false });
        let gap = room.plots.made(0, measured, simulated, |m, s| m - s);
        gaps.push(Trace { name, color, width: 1.0, values: gap, leads: true });
    }
    let noise = sight.noise(trace);
    let sensor = sight.subject.sensor(sight.mass);
    let plain = |symbol, traces, share| Panel {
        symbol,
        unit: sensor.unit.clone(),
        traces,
        band: None,
        level: None,
        aside: String::new(),
        empty: "",
        share,
    };
    let mut gap = plain("gap", gaps, 1.0);
    gap.level = (noise > 0.0).then(|| ("± noise".to_owned(), noise));
    let frame = Frame {
        id: "verify",
        start: trace.start,
        interval: trace.interval,
        samples: trace.measured.len(),
        held_out: trace.usage == Usage::HeldOut,
        worst: &[],
        dark,
        height,
    };
    let panels = [plain(&sensor.symbol, traces, 1.2), gap];
    for plot in plots::stack(ui, &mut room.plots, &frame, &panels) {
        figures::menu(&plot.response, &Figure::Time(RoundStep::Verify), || plots::table(&frame, &panels), acts);
    }
}

/// What remains, and what would tell more.
fn left(ui: &mut Ui, sight: &Sight<'_>, height: f32, acts: &mut Vec<Act>) {
    let colors = theme::accents(sight.dark);
    let round = sight.round();
    let asked = round.or_else(|| {
        let accepted = &sight.walk.accepted;
        accepted.len().checked_sub(1).and_then(|n| sight.known.rounds.get(&accepted[..n]))
    });
    if let Some(round) = asked
        && let Finding::Ambiguous(_) = round.finding
    {
        card(ui, colors.caution, |ui| {
            ui.add(egui::Label::new(words::finding(round)).wrap());
            if let Some(next) = &round.next_experiment {
                ui.add(egui::Label::new(RichText::new(raised(next)).weak()).wrap());
            }
        });
    }
    if let Some(round) = round.filter(|r| r.finding == Finding::Unexplained)
        && let Some(profile) = round.place.profiles.first()
    {
        ui.label(RichText::new("What is left, over the quantity that orders it best").strong());
        let size = vec2(ui.available_width(), (height - 90.0).clamp(130.0, 260.0));
        map::profile(ui, profile, &sight.subject.acceleration, size, "not a law");
    }
    if let Some(d) = sight.conclusion() {
        let (edge, head) = if d.remaining.significant {
            (colors.caution, format!("What is left is more than noise ({}).", words::p_value(d.remaining.p_value)))
        } else {
            (colors.good, format!("What is left is noise ({}).", words::no_gap(d.remaining.p_value)))
        };
        card(ui, edge, |ui| {
            ui.add(egui::Label::new(RichText::new(head).strong()).wrap());
            let note = d.remaining.note.replace("What is left is more than noise. ", "");
            could_hide(ui, &note);
        });
    } else if sight.running.is_some() {
        ui.weak("asking what is left…");
    }
    if !sight.walk.accepted.is_empty() && ui.button("Undo last effect").clicked() {
        acts.push(Act::Undo);
    }
}

/// What these data could still hide, the first few at once.
fn could_hide(ui: &mut Ui, note: &str) {
    const SHOWN: usize = 5;
    let small = |text: String| egui::Label::new(RichText::new(text).size(12.0)).wrap();
    // Names of effects have commas of their own.
    let parts: Vec<&str> = note.split_inclusive("%, ").map(|part| part.trim_end_matches(", ")).collect();
    if note.is_empty() {
        return;
    }
    let (first, rest) = parts.split_at(parts.len().min(SHOWN));
    let end = if rest.is_empty() { "" } else { ", …" };
    ui.add(small(first.join(", ") + end));
    if !rest.is_empty() {
        let head = RichText::new(format!("{} more effects", rest.len())).weak().size(12.0);
        egui::CollapsingHeader::new(head).id_salt("could hide").show(ui, |ui| ui.add(small(rest.join(", "))));
    }
}
