//! Measured and identified displacement, and the error between them.

use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::figure::{Axis, Figure, Fit, Guide, Layer, LayerRole};
use crate::palette::{Ink, Tint};
use sindyscope_core::study::RecordOutcome;
use sindyscope_values::format::number::significant;
use sindyscope_values::format::units::{Scale, format_si};

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "Response",
    tooltip: "Measured and identified displacement laid over each other, and the error E(t) beneath",
    reading: "",
    group: Group::Motion,
    records: RecordUse::One,
    slow: false,
    figure,
};

/// A stretch is worth marking if its error exceeds the noise that stands in every comparison by this factor.
const ABOVE_NOISE: f64 = 1.25;

/// Length of the worst stretch in main periods of the response, and as a share of the record where it has none.
const PERIODS: f64 = 3.0;
const SHARE: f64 = 0.04;

/// From so many samples on the error is a band on the screen, through which its running root mean square is drawn.
const DENSE: usize = 2000;

/// Most stretches that are shaded one by one; more are told of in words alone.
const SHADED: usize = 400;

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let (name, unit) = scene.shown();
    let (response, error) = scene.channel().map_or((&[][..], &[][..]), |c| (&c.response, &c.error));
    let ghost = scene.channel_before();

    let mut upper = scene.over_time("response", Axis::linear(name.as_str(), unit.as_str(), (0.0, 1.0)), true);
    upper.fit = Fit::Curves;
    upper.layers.push(Layer::new(Ink::Measured, "measured", scene.samples(scene.measured())));
    let before = ghost.map_or(&[][..], |g| &g.response);
    upper.layers.push(Layer::new(Ink::Ghost, "before", scene.samples(before)).playing(LayerRole::Ghost));
    upper.layers.push(Layer::new(Ink::Identified, "identified", scene.samples(response)).playing(LayerRole::Follows));
    upper.guides.extend(stops(&scene));

    // An error beyond the measurement's whole range says no more than that the response is lost.
    let measured = scene.measured().iter().copied().filter(|v| v.is_finite());
    let (low, high) = measured.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let most = if high > low { high - low } else { f64::INFINITY };
    let symbol = if scene.layout.freedoms > 1 && scene.freedom > 0 { format!("E of {name}") } else { "E".into() };
    let axis = Axis { logarithmic: subject.options.log_error, ..Axis::linear(symbol, unit.as_str(), (0.0, 1.0)) };
    let mut lower = scene.over_time("error", axis, false);
    lower.fit = Fit::Magnitudes(most);
    let before = ghost.map_or(&[][..], |g| &g.error);
    lower.layers.push(Layer::new(Ink::ErrorGhost, "before", scene.samples(before)).playing(LayerRole::Ghost));
    lower.layers.push(Layer::new(Ink::Error, "error", scene.samples(error)));
    let running = running_rms(&scene, error);
    if !running.is_empty() {
        let shape = scene.samples(&running);
        lower.layers.push(Layer::new(Ink::ErrorRms, "running RMS", shape).playing(LayerRole::Follows));
    }
    lower.guides.extend(scene.noise().map(|at| Guide::Level {
        ink: Ink::NoiseFloor,
        at,
        text: format!("noise floor {}", format_si(at, &unit, 2)),
    }));
    lower.guides.extend(worst_stretch(&scene, error, &unit));
    if error.is_empty() {
        lower.note = match scene.record.diverged_at {
            Some(_) => "The simulated response left the data's range at once".into(),
            None => "There is no simulated response".into(),
        };
    }
    let panels = [(upper.fitted(), 1.6), (lower.fitted(), 1.0)];
    Ok(Figure::stacked(panels, 215.0, caption(&scene, &name)))
}

fn caption(scene: &Scene<'_>, name: &str) -> String {
    let mut caption = format!(
        "Record {} ({}). Above, the measured and the identified response; beneath, the error E(t) = |{name} measured − {name} \
         identified|",
        scene.record.record.name,
        scene.usage()
    );
    if scene.noise().is_some() {
        caption += "; dashed, the standard deviation of the measurement noise";
    }
    caption.push('.');
    if let Some(t) = scene.record.diverged_at {
        caption += &format!(" The response leaves the data's range at t = {} s.", significant(t, 4));
    }
    caption
}

/// The error's root mean square over a main period, or a hundredth of the record, centred on each sample; none of a record
/// short enough to be read sample by sample.
fn running_rms(scene: &Scene<'_>, error: &[f64]) -> Vec<f64> {
    let n = error.len();
    if n < DENSE {
        return Vec::new();
    }
    let period = scene.record.signals.main_period.map_or(0.0, |p| p / scene.interval());
    let half = (0.5 * period.max(0.01 * n as f64)) as usize;
    let mut sums = Vec::with_capacity(n + 1);
    let mut sum = 0.0;
    sums.push(sum);
    for value in error {
        sum += if value.is_finite() { value * value } else { 0.0 };
        sums.push(sum);
    }
    (0..n)
        .map(|i| {
            let (from, to) = (i.saturating_sub(half), (i + half + 1).min(n));
            ((sums[to] - sums[from]).max(0.0) / (to - from) as f64).sqrt()
        })
        .collect()
}

/// Where the measured motion stands still, and how often it and the response do; none where it never does.
fn stops(scene: &Scene<'_>) -> Option<Guide> {
    let RecordOutcome { standing, sticks, .. } = scene.record;
    if standing.is_empty() {
        return None;
    }
    let share = 100.0 * scene.record.standing_share();
    let stops = if standing.len() == 1 { "stop" } else { "stops" };
    let text = format!("{} {stops} measured ({share:.0} % of the time), {} simulated", standing.len(), sticks.len());
    let spacing = scene.spacing();
    let ends = |r: &std::ops::Range<usize>| (spacing.at(r.start), spacing.at(r.end.saturating_sub(1)));
    Some(Guide::Stretches { tint: Tint::Standing, stretches: standing.iter().take(SHADED).map(ends).collect(), text })
}

/// The stretch of a few periods on which the error's root mean square is largest; none if the record is hardly longer, or
/// if the error there is but noise.
fn worst_stretch(scene: &Scene<'_>, error: &[f64], unit: &str) -> Option<Guide> {
    let spacing = scene.spacing();
    let n = error.len();
    let by_period = scene.record.signals.main_period.map(|p| PERIODS * p / spacing.interval);
    let length = by_period.filter(|l| l.is_finite()).unwrap_or(SHARE * n as f64).max(8.0) as usize;
    if 3 * length > n {
        return None;
    }
    let square = |i: usize| if error[i].is_finite() { error[i] * error[i] } else { 0.0 };
    let mut sum: f64 = (0..length).map(square).sum();
    let mut worst = (sum, 0);
    for i in length..n {
        sum += square(i) - square(i - length);
        if sum > worst.0 {
            worst = (sum, i + 1 - length);
        }
    }
    let rms = (worst.0 / length as f64).sqrt();
    if rms <= ABOVE_NOISE * scene.noise().unwrap_or(0.0) {
        return None;
    }
    let (from, to) = (spacing.at(worst.1), spacing.at(worst.1 + length - 1));
    let (start, end) = scene.time_range();
    let at = Scale::suited(end - start, "s").format(from, 3);
    let text = format!("worst {} at {at}", format_si(rms, unit, 2));
    Some(Guide::Stretches { tint: Tint::Worst, stretches: vec![(from, to)], text })
}
