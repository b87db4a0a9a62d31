//! Amplitude spectra of measurement, model and error.

use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::figure::{Axis, Figure, Guide, Layer, Panel, Points, Shape};
use crate::palette::Ink;
use sindyscope_core::signal::Spectrum;
use sindyscope_values::format::units::{Scale, format_si};

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "Spectrum",
    tooltip: "Amplitude spectra of measurement, model and error",
    reading: "",
    group: Group::Motion,
    records: RecordUse::One,
    slow: true,
    figure,
};

/// On a linear axis as many times the main frequency is shown at first: its harmonics, which nonlinearity makes.
const HARMONICS: f64 = 10.0;

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let measured = scene.measured();
    let response = scene.channel().map_or(&[][..], |c| &c.response);
    let error: Vec<f64> = measured.iter().zip(response).map(|(m, r)| m - r).collect();
    let of = |values: &[f64]| Spectrum::new(values, scene.interval());
    let too_short = "The record is too short for a spectrum: it takes eight samples";
    let (measured, identified, error) = (of(measured).ok_or(too_short)?, of(response), of(&error));
    let level = noise_level(&scene);
    let peak = measured.peak();
    let highest = measured.frequency(measured.amplitudes.len() - 1);
    let x = if subject.options.log_frequency {
        Axis::logarithmic("f", "Hz", (measured.step.log10(), highest.log10()))
    } else {
        Axis::linear("f", "Hz", (0.0, peak.map_or(highest, |p| (HARMONICS * p.frequency).min(highest))))
    };
    let (name, unit) = scene.shown();
    // A model's response has no noise, and would draw the view out far beneath what was measured.
    let range = value_range(std::iter::once(&measured).chain(&error), level);
    let id = if subject.options.log_frequency { "spectrum log" } else { "spectrum" };
    let mut panel = Panel::new(id, x, Axis::logarithmic("amplitude", unit.as_str(), range));
    let curves = [
        (Ink::Measured, "measured", Some(&measured)),
        (Ink::Identified, "identified", identified.as_ref()),
        (Ink::Error, "error", error.as_ref()),
    ];
    panel.columns.push(("f (Hz)".to_owned(), (0..measured.amplitudes.len()).map(|k| measured.frequency(k)).collect()));
    for (ink, name, spectrum) in curves {
        let Some(spectrum) = spectrum else { continue };
        // The line at zero is the mean, and has no place on a logarithmic axis.
        let lines = spectrum.amplitudes.iter().enumerate().skip(1);
        let points = Points::new(lines.map(|(k, a)| [spectrum.frequency(k), a.max(f64::MIN_POSITIVE)]));
        panel.layers.push(Layer::new(ink, name, Shape::Line(points)));
        let head = Scale::plain(unit.as_str()).axis(&format!("amplitude {name}"));
        panel.columns.push((head, spectrum.amplitudes.clone()));
    }
    let floor = |at| Guide::Level { ink: Ink::NoiseFloor, at, text: "noise floor".into() };
    panel.guides.extend(level.map(floor));
    panel.guides.extend(peak.map(|p| Guide::At {
        ink: Ink::Cursor,
        at: p.frequency,
        text: format!("{}, {}", Scale::plain("Hz").format(p.frequency, 5), format_si(p.amplitude, &unit, 3)),
    }));
    let caption = format!("Amplitude spectrum of {name} and of its error, record {}.", scene.record.record.name);
    Ok(Figure::stacked([(panel, 1.0)], 240.0, caption))
}

/// What the noise leaves in each line of a spectrum with a Hann window: σ √(4 Σw² / (Σw)²) = σ √(6/n).
fn noise_level(scene: &Scene<'_>) -> Option<f64> {
    scene.noise().map(|n| n * (6.0 / scene.measured().len() as f64).sqrt())
}

/// From a little below the quiet half of the lines to the highest, as logarithms to base ten.
pub(crate) fn value_range<'a>(spectra: impl Iterator<Item = &'a Spectrum>, level: Option<f64>) -> (f64, f64) {
    let (mut low, mut high) = (level.unwrap_or(f64::INFINITY), 0.0f64);
    for spectrum in spectra {
        let mut sorted: Vec<f64> = spectrum.amplitudes[1..].to_vec();
        let middle = sorted.len() / 2;
        let (_, median, above) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
        low = low.min(*median);
        high = above.iter().copied().fold(high.max(*median), f64::max);
    }
    if !(high > 0.0 && high.is_finite()) {
        return (-1.0, 0.0);
    }
    (low.max(1e-9 * high).min(1e-2 * high).log10() - 0.7, high.log10() + 0.4)
}
