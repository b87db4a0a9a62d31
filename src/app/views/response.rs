//! Measured and identified displacement, and the error between them.

use std::sync::Arc;

use egui::Ui;

use super::cache::Stretch;
use super::panel::{self, Curve, Mark, Panel, Part};
use super::scene::Scene;
use super::{Request, View, ViewState};
use crate::app::plot::palette::Ink;
use crate::app::plot::units;
use sindyscope_core::study::RecordOutcome;

/// A stretch is worth marking if its error exceeds the noise that stands in every comparison by this factor.
const ABOVE_NOISE: f64 = 1.25;

/// Length of the worst stretch in main periods of the response, and as a share of the record where it has none.
const PERIODS: f64 = 3.0;
const SHARE: f64 = 0.04;

/// From so many samples on the error is a band on the screen, through which its running root mean square is drawn.
const DENSE: usize = 2000;

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState) -> Option<Request> {
    let (name, unit) = scene.shown();
    let (response, error) = scene.channel().map_or((&[][..], &[][..]), |c| (&c.response, &c.error));
    let ghost = scene.channel_before();
    let curve = |ink, name, values, part| Curve { ink, name, samples: scene.samples(values), part };

    let mut upper = Panel::new("response", name, unit.clone());
    upper.share = 1.6;
    upper.curves.push(curve(Ink::Measured, "measured", scene.measured(), Part::Leads));
    if let Some(ghost) = ghost {
        upper.curves.push(curve(Ink::Ghost, "before", &ghost.response, Part::Ghost));
    }
    upper.curves.push(curve(Ink::Identified, "identified", response, Part::Follows));

    upper.shaded = stops(scene);

    let mut lower = Panel::new("error", "E".into(), unit.clone());
    lower.log = state.log_error;
    // An error beyond the measurement's whole range says no more than that the response is lost.
    let measured = scene.samples(scene.measured());
    let range = state.cache.curve(("response", Ink::Measured), &measured).range();
    lower.magnitude_up_to = Some(range.map(|(low, high)| high - low).filter(|r| *r > 0.0).unwrap_or(f64::INFINITY));
    if let Some(ghost) = ghost {
        lower.curves.push(curve(Ink::ErrorGhost, "before", &ghost.error, Part::Ghost));
    }
    lower.curves.push(curve(Ink::Error, "error", error, Part::Leads));
    let running = Arc::clone(state.cache.running.get_or_insert_with(|| running_rms(scene, error)));
    if !running.is_empty() {
        lower.curves.push(curve(Ink::ErrorRms, "running RMS", &running, Part::Follows));
    }
    lower.level = scene.noise().map(|n| (format!("noise floor {}", units::format_si(n, &unit, 2)), n));
    let worst = *state.cache.worst.get_or_insert_with(|| worst_stretch(scene, error));
    lower.mark = worst.map(|Stretch { from, to, rms }| Mark {
        from,
        to,
        text: format!("worst {} at {}", units::format_si(rms, &unit, 2), scene.time_scale().format(from, 3)),
    });
    if error.is_empty() {
        lower.empty = Some(match scene.record.diverged_at {
            Some(_) => "The simulated response left the data's range at once".into(),
            None => "There is no simulated response".into(),
        });
    }
    panel::stack(ui, View::Response, scene, state, &[upper, lower])
}

/// The error's root mean square over a main period, or a hundredth of the record, centred on each sample; none of a record
/// short enough to be read sample by sample.
fn running_rms(scene: &Scene<'_>, error: &[f64]) -> Arc<[f64]> {
    let n = error.len();
    if n < DENSE {
        return Arc::new([]);
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

/// Most stretches that are shaded one by one; more are told of in words alone.
const SHADED: usize = 400;

/// Where the measured motion stands still, and how often it and the response do; none where it never does.
fn stops(scene: &Scene<'_>) -> Option<(String, Vec<(f64, f64)>)> {
    let RecordOutcome { record, standing, sticks, .. } = scene.record;
    if standing.is_empty() {
        return None;
    }
    let share = 100.0 * scene.record.standing_share();
    let text = format!("{} stops measured ({share:.0} % of the time), {} simulated", standing.len(), sticks.len());
    let at = |k: usize| record.start + k as f64 * record.interval;
    let stretches = standing.iter().take(SHADED).map(|r| (at(r.start), at(r.end.saturating_sub(1)))).collect();
    Some((text, stretches))
}

/// The stretch of a few periods on which the error's root mean square is largest; none if the record is hardly longer, or
/// if the error there is but noise.
fn worst_stretch(scene: &Scene<'_>, error: &[f64]) -> Option<Stretch> {
    let interval = scene.interval();
    let n = error.len();
    let by_period = scene.record.signals.main_period.map(|p| PERIODS * p / interval);
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
    let samples = scene.samples(error);
    let rms = (worst.0 / length as f64).sqrt();
    (rms > ABOVE_NOISE * scene.noise().unwrap_or(0.0)).then(|| Stretch {
        from: samples.at(worst.1),
        to: samples.at(worst.1 + length - 1),
        rms,
    })
}
