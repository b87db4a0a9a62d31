//! Pinned settings beside each other: responses and errors.

use std::sync::Arc;

use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::figure::{Axis, Figure, Fit, Layer, LayerRole};
use crate::palette::Ink;
use sindyscope_core::study::{Outcome, SensorResponse};

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "Compare",
    tooltip: "Settings pinned as A, B, C, …: their responses, errors, terms and figures beside each other",
    reading: "Pin a setting, change it, and see what the change does: the lower the line of an error, the better the setting; \
              the table says which terms made the difference.",
    group: Group::Settings,
    records: RecordUse::One,
    slow: false,
    figure,
};

/// Most outcomes that are kept: letters and colours to tell them apart.
pub const MOST_PINS: usize = 6;

/// The name of a pinned outcome.
pub fn pin_letter(index: usize) -> String {
    char::from(b'A' + (index % 26) as u8).to_string()
}

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let channel = |outcome: &'_ Outcome| -> Option<SensorResponse> {
        let same = outcome.records.iter().find(|r| Arc::ptr_eq(&r.record, &scene.record.record))?;
        same.channels.get(scene.freedom).cloned()
    };
    let pinned = subject.pins.iter().enumerate().take(MOST_PINS);
    let mut shown: Vec<(Ink, String, SensorResponse)> =
        pinned.filter_map(|(k, pin)| Some((Ink::Pin(k as u8), pin_letter(k), channel(pin)?))).collect();
    shown.extend(scene.channel().map(|c| (Ink::Identified, "now".to_owned(), c.clone())));
    let (name, unit) = scene.shown();
    let mut upper = scene.over_time("response", Axis::linear(name.as_str(), unit.as_str(), (0.0, 1.0)), true);
    upper.fit = Fit::Curves;
    upper.layers.push(Layer::new(Ink::Measured, "measured", scene.samples(scene.measured())));
    // An error as large as the measurement says no more than that the response is lost.
    let most = scene.measured().iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let mut lower = scene.over_time("error", Axis::linear("E", unit.as_str(), (0.0, 1.0)), false);
    lower.fit = Fit::Magnitudes(if most > 0.0 { most } else { f64::INFINITY });
    for (ink, name, channel) in shown {
        let curve = |values: &[f64]| Layer::new(ink, name.as_str(), scene.samples(values));
        upper.layers.push(curve(&channel.response).playing(LayerRole::Follows));
        lower.layers.push(curve(&channel.error));
    }
    let caption = format!("Responses and errors of pinned settings on record {}.", scene.record.record.name);
    Ok(Figure::stacked([(upper.fitted(), 1.0), (lower.fitted(), 1.0)], 260.0, caption))
}
