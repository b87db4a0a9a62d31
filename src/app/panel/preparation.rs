//! PREPARE: what is done to the records before they are studied, step by step.

use egui::{DragValue, Id, Label, RichText, Ui, WidgetInfo};

use super::context::{PanelAct, PanelContext};
use crate::app::theme::{self, ROW};
use crate::app::widgets::{chip, section};
use sindyscope_core::prepare::{MOST_DECIMATED, MOST_PARTS, Preparation, SPIKE, Treatment};
use sindyscope_core::signal::Spectrum;
use sindyscope_core::study::Calibration;
use sindyscope_values::record::{Channel, Record, Role, Usage};

/// The share that the button holds out.
const SHARE: f64 = 0.3;

/// Samples that the menu's bridge spans at first, and that one may span at most.
const BRIDGE: usize = 10;
const MOST_BRIDGED: usize = 10_000;

/// Samples from which the menu takes a record's main frequency: so few are transformed within a frame.
const GLANCE: usize = 8192;

pub(super) fn show(ui: &mut Ui, context: &mut PanelContext<'_>) {
    let mut asks = Vec::new();
    let steps = &context.edit.steps;
    let with = |treatment: Treatment| PanelAct::Prepare(steps.iter().cloned().chain([treatment.into()]).collect());
    section(
        ui,
        "PREPARE",
        |ui| {
            let menu = ui.menu_button("Add step ⏷", |ui| {
                ui.set_min_width(200.0);
                for (label, tooltip, treatment) in offered(context) {
                    if ui.button(label).on_hover_text(tooltip).clicked() {
                        asks.push(with(treatment));
                    }
                }
            });
            menu.response.on_hover_text("What is done to the records before they are studied, in order");
            let tooltip =
                "Show the whole record above the plots: drag its ends to crop it, the divider to hold a part out";
            if chip(ui, "✂ on the plot", context.cutting, false, tooltip).clicked() {
                asks.push(PanelAct::Cut);
            }
        },
        |_| {},
    );
    for (index, step) in steps.iter().enumerate() {
        asks.extend(row(ui, context, index, step));
        if let Some(Some(reason)) = context.data.undone.get(index) {
            let color = theme::accents(ui.visuals().dark_mode).caution;
            ui.add(Label::new(RichText::new(format!("not done: {reason}")).color(color).small()).wrap());
        }
    }
    // Where something is held out already, more of it is in the menu.
    if !context.edit.usage.contains(&Usage::HeldOut) {
        let button = ui.button("Hold out the last 30 %");
        let tooltip = "The last part of each record that is fitted is never fitted, only simulated and scored";
        if button.on_hover_text(tooltip).clicked() {
            asks.push(with(Treatment::HoldOut { share: SHARE }));
        }
    }
    context.asks.append(&mut asks);
}

/// An entry of the menu: label, tooltip, and the step that it adds.
type StepOffer = (String, &'static str, Treatment);

/// What the menu offers for the record shown.
fn offered(context: &PanelContext<'_>) -> Vec<StepOffer> {
    let mut offers: Vec<StepOffer> = Vec::new();
    let mut offer = |label: &str, tooltip, treatment| offers.push((label.to_owned(), tooltip, treatment));
    offer("Crop", "Use a record from one time to another only", Treatment::Crop { from: None, to: None });
    offer(
        "Hold out the last part",
        "The last part of each record that is fitted is never fitted, only simulated and scored",
        Treatment::HoldOut { share: SHARE },
    );
    offer("Cut into several", "Each record becomes two or more of the same length", Treatment::Split { parts: 2 });
    let record = context.data.origin(context.shown);
    if let Some(record) = record {
        let middle = significant(record.start + 0.5 * record.duration(), 3);
        offer("Cut at a time", "Each record becomes two", Treatment::SplitAt { time: middle });
    }
    offer("Remove offset", "Take each channel's mean away", Treatment::RemoveOffset);
    offer("Remove linear trend", "Take each channel's straight line of least squares away", Treatment::RemoveTrend);
    offer(
        "Mend spikes",
        "Fill in single samples that stand out from those around them (Hampel's test)",
        Treatment::MendSpikes { threshold: SPIKE },
    );
    if let Some(record) = record {
        let rate = record.interval.recip();
        let (low, high) = (significant(2.0 / record.duration().max(record.interval), 2), significant(0.1 * rate, 2));
        offer(
            "Low-pass filter",
            "Take away what is faster, in every channel alike and without a phase; decimate after it, or the noise floor reads too low",
            Treatment::Filter { from: None, to: Some(high) },
        );
        if low < high {
            offer(
                "Band-pass filter",
                "Take away what is slower and what is faster, in every channel alike and without a phase",
                Treatment::Filter { from: Some(low), to: Some(high) },
            );
        }
        if let Some((from, to)) = around_main_frequency(record) {
            offer(
                "Isolate a mode",
                "Keep one mode of a structure, over all its sensors with the weights of its shape, as the record of one mass",
                Treatment::IsolateMode { from, to },
            );
        }
    }
    offer("Decimate", "Keep one sample in two, behind a low-pass", Treatment::Decimate { factor: 2 });
    offer(
        "Bridge gaps",
        "Fill in samples that are missing where they are few; longer gaps split the record",
        Treatment::Bridge { longest: BRIDGE },
    );
    // One channel of each mass stays where it is, and the others are held against it; one mass is on time.
    for channel in record.iter().flat_map(|r| r.measured()) {
        let same = |c: &&Channel| !matches!(c.role, Role::Input(_)) && c.role.index() == channel.role.index();
        let first = record.and_then(|r| r.measured().find(same));
        let delay = match channel.role {
            // Its lag before the motion is the system's own: no other sensor tells it.
            Role::Input(_) => Some(0.0),
            _ if first.is_none_or(|f| f.role != channel.role) => None,
            role if role.index() > 0 => Some(0.0),
            _ => continue,
        };
        let tooltip = if delay.is_none() {
            "Move the channel by the delay that its cross-correlation with the mass's other sensor shows"
        } else {
            "Move the channel by a delay that you know, as of another amplifier, or that is found with the equation"
        };
        offer(&format!("Align {}", channel.name), tooltip, Treatment::Align { role: channel.role, delay });
        if !matches!(channel.role, Role::Input(_)) {
            let tooltip = "Divide the channel by a gain that you know, as of an amplifier set wrong, or that is found with the equation";
            offer(&format!("Scale {}", channel.name), tooltip, Treatment::Gain { role: channel.role, gain: 1.0 });
        }
    }
    offers
}

/// A band of a fifth around the frequency that a record's first sensor shows most of, Hz.
fn around_main_frequency(record: &Record) -> Option<(f64, f64)> {
    let values = &record.sensor(0)?.values;
    let spectrum = Spectrum::new(&values[..values.len().min(GLANCE)], record.interval)?;
    let largest =
        (1..spectrum.amplitudes.len()).max_by(|a, b| spectrum.amplitudes[*a].total_cmp(&spectrum.amplitudes[*b]))?;
    let main = spectrum.frequency(largest);
    let to = (1.2 * main).min(0.49 / record.interval);
    (0.8 * main < to).then(|| (significant(0.8 * main, 3), significant(to, 3)))
}

/// One step; all steps are asked for anew if it was changed or taken out.
fn row(ui: &mut Ui, context: &PanelContext<'_>, index: usize, step: &Preparation) -> Option<PanelAct> {
    let steps = &context.edit.steps;
    let mut asked = None;
    ui.horizontal(|ui| {
        ui.set_min_height(ROW);
        ui.spacing_mut().item_spacing.x = 4.0;
        let changed = treatment(ui, context, Id::unique(("step", index)), step).map(|treatment| {
            let mut new = steps.clone();
            new[index].treatment = treatment;
            PanelAct::Prepare(new)
        });
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let out = ui.add(egui::Button::new("×").frame_when_inactive(false)).on_hover_text("Take this step out");
            out.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, format!("Take step {} out", index + 1)));
            let without = || steps.iter().enumerate().filter(|(k, _)| *k != index).map(|(_, s)| s.clone()).collect();
            let taken_out = out.clicked().then(|| PanelAct::Prepare(without()));
            asked = find(ui, context, index, step).or(taken_out).or(changed);
            if context.data.raw.entries.len() > 1 && !matches!(step.treatment, Treatment::Bridge { .. }) {
                let text = step.record.as_deref().unwrap_or("every record");
                ui.add(Label::new(RichText::new(text).weak()).truncate()).on_hover_text(text);
            }
        });
    });
    asked
}

/// The button that finds a step's value with the equation, where that can be: what is found is that of all records together.
fn find(ui: &mut Ui, context: &PanelContext<'_>, index: usize, step: &Preparation) -> Option<PanelAct> {
    let sought = match step.treatment {
        Treatment::Align { role, .. } => Calibration::Delay(role),
        Treatment::Gain { role, .. } => Calibration::Gain(role),
        _ => return None,
    };
    if step.record.is_some() {
        return None;
    }
    let finding = context.calibrating == Some(index);
    let (label, tooltip, act) = if finding {
        ("Stop", "Stop finding it", PanelAct::StopChoosing)
    } else {
        let tooltip = "Find it with the equation: what makes the response fit the measurement best";
        ("Find", tooltip, PanelAct::Calibrate { step: index, sought })
    };
    ui.small_button(label).on_hover_text(tooltip).clicked().then_some(act)
}

/// What a step does, with its numbers; the treatment that it was changed to, if it was.
fn treatment(ui: &mut Ui, context: &PanelContext<'_>, id: Id, step: &Preparation) -> Option<Treatment> {
    let channel = |role: Role| context.data.records.first().and_then(|r| r.channel(role));
    let name = |role: Role| channel(role).map_or_else(|| role.noun().to_owned(), |c| c.name.clone());
    Some(match step.treatment {
        Treatment::Crop { from, to } => {
            let whole = whole(context, step);
            let (mut from, mut to) = (from.unwrap_or(whole.0), to.unwrap_or(whole.1));
            let speed = along(whole);
            ui.label("Crop to");
            let one = value(ui, id.with("from"), "Crop from", &mut from, |d| d.speed(speed).suffix(" s"));
            ui.label("…");
            let two = value(ui, id.with("to"), "Crop to", &mut to, |d| d.speed(speed).suffix(" s"));
            return (one || two).then_some(Treatment::Crop { from: Some(from), to: Some(to) });
        }
        Treatment::HoldOut { share } => {
            let percent = number(ui, id, ("Hold out the last", "Share held out"), 100.0 * share, |d| {
                d.range(0.1..=99.9).speed(0.2).max_decimals(1).suffix(" %")
            })?;
            Treatment::HoldOut { share: percent / 100.0 }
        }
        Treatment::RemoveOffset => {
            ui.label("Remove offset");
            return None;
        }
        Treatment::RemoveTrend => {
            ui.label("Remove linear trend");
            return None;
        }
        Treatment::Decimate { factor } => {
            let factor = count(ui, id, ("Decimate by", "Factor"), factor, (2, MOST_DECIMATED, ""))?;
            Treatment::Decimate { factor }
        }
        Treatment::Filter { from, to } => {
            let label = match (from, to) {
                (Some(_), Some(_)) => "Band-pass",
                (Some(_), None) => "High-pass",
                _ => "Low-pass",
            };
            let [from, to] = band(ui, id, label, [from, to])?;
            Treatment::Filter { from, to }
        }
        Treatment::IsolateMode { from, to } => {
            let [Some(from), Some(to)] = band(ui, id, "Isolate a mode", [Some(from), Some(to)])? else { return None };
            Treatment::IsolateMode { from, to }
        }
        Treatment::MendSpikes { threshold } => {
            let threshold = number(ui, id, ("Mend spikes beyond", "Spike threshold"), threshold, |d| {
                d.range(1.0..=1000.0).speed(0.05).max_decimals(1).suffix(" σ")
            })?;
            Treatment::MendSpikes { threshold }
        }
        Treatment::Split { parts } => {
            Treatment::Split { parts: count(ui, id, ("Cut into", "Parts"), parts, (2, MOST_PARTS, ""))? }
        }
        Treatment::SplitAt { time } => {
            let speed = along(whole(context, step));
            let time = number(ui, id, ("Cut at", "Cut at"), time, |d| d.speed(speed).suffix(" s"))?;
            Treatment::SplitAt { time }
        }
        Treatment::Align { role, delay } => {
            let text = format!("Align {}, late by", name(role));
            let speed = 50.0 * context.data.records.first().map_or(1e-3, |r| r.interval);
            let found = number(ui, id, (&text, "Delay"), 1e3 * delay.unwrap_or(0.0), |d| {
                d.speed(speed).max_decimals(4).suffix(" ms")
            })?;
            Treatment::Align { role, delay: Some(1e-3 * found) }
        }
        Treatment::Gain { role, gain } => {
            let gain = number(ui, id, (&format!("Divide {} by", name(role)), "Gain"), gain, |d| {
                d.speed(1e-3).range(1e-6..=1e6).max_decimals(6)
            })?;
            Treatment::Gain { role, gain }
        }
        Treatment::Bridge { longest } => {
            let names = ("Bridge gaps up to", "Longest gap bridged");
            Treatment::Bridge { longest: count(ui, id, names, longest, (1, MOST_BRIDGED, " samples"))? }
        }
    })
}

/// A band's corners behind a label; the new ones once one is changed.
fn band(ui: &mut Ui, id: Id, label: &str, mut ends: [Option<f64>; 2]) -> Option<[Option<f64>; 2]> {
    ui.label(label);
    let mut moved = false;
    for (end, name) in ends.iter_mut().zip(["Filter from", "Filter to"]) {
        if let Some(corner) = end {
            let speed = 0.01 * *corner;
            moved |= value(ui, id.with(name), name, corner, |d| d.range(1e-9..=1e12).speed(speed).suffix(" Hz"));
        }
    }
    moved.then_some(ends)
}

/// A step's one number behind its label; the new one once it is left changed.
fn number(
    ui: &mut Ui,
    id: Id,
    (label, name): (&str, &str),
    old: f64,
    limits: impl for<'a> FnOnce(DragValue<'a>) -> DragValue<'a>,
) -> Option<f64> {
    ui.add(Label::new(label).truncate());
    let mut new = old;
    value(ui, id, name, &mut new, limits).then_some(new)
}

/// The same of a whole number within limits.
fn count(
    ui: &mut Ui,
    id: Id,
    names: (&str, &str),
    old: usize,
    (least, most, suffix): (usize, usize, &'static str),
) -> Option<usize> {
    let speed = if most > MOST_DECIMATED.max(MOST_PARTS) { 0.1 } else { 0.05 };
    number(ui, id, names, old as f64, |d| {
        d.range(least as f64..=most as f64).speed(speed).max_decimals(0).suffix(suffix)
    })
    .map(|new| new as usize)
}

/// How fast a time along the record is dragged.
fn along((start, end): (f64, f64)) -> f64 {
    0.002 * (end - start).max(1e-6)
}

/// A value that reads well: so many digits.
fn significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// A number to drag or to type; true once it is left changed.
fn value(
    ui: &mut Ui,
    id: Id,
    name: &str,
    number: &mut f64,
    limits: impl for<'a> FnOnce(DragValue<'a>) -> DragValue<'a>,
) -> bool {
    let mut held = ui.data(|d| d.get_temp::<f64>(id)).unwrap_or(*number);
    let response = ui.add(limits(DragValue::new(&mut held))).accessible_name(name);
    let done = response.drag_stopped() || response.lost_focus();
    if !done && (response.dragged() || response.has_focus()) {
        ui.data_mut(|d| d.insert_temp(id, held));
        return false;
    }
    ui.data_mut(|d| d.remove::<f64>(id));
    let changed = done && held != *number;
    *number = held;
    changed
}

/// From when to when the record lasts that a step is for, s.
fn whole(context: &PanelContext<'_>, step: &Preparation) -> (f64, f64) {
    let named = |name: &String| context.data.raw.entries.iter().map(|(r, _)| r).find(|r| r.name == *name);
    let record = step.record.as_ref().and_then(named).or_else(|| context.data.origin(context.shown));
    record.map_or((0.0, 1.0), |r| (r.start, r.start + r.duration()))
}
