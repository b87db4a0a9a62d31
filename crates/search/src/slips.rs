//! Motion between rests.
//!
//! What rests while the force on it changes is held by dry friction. While it rests nothing tells of the equation, and along a
//! whole record a stop that is missed leads a fit astray. Along one slip from its beginning to its end friction keeps its side:
//! there the response is smooth in every parameter, and a fit that starts there lands. What holds, the slips do not tell; it is
//! looked for from rest to rest, where it decides when the slip begins.

use std::collections::HashMap;
use std::ops::Range;

use super::data::Data;
use super::effects::{Form, logarithmic};
use super::search::Search;
use super::structure::Composition;
use sindyscope_core::refine::{FitOptions, Output, Point, Refined, Run, cut, misfit, refine};
use sindyscope_core::signal::mean_and_variance;
use sindyscope_core::study::Cancel;

/// Samples of a slip at least: of fewer its own initial state explains too much.
const FEWEST: usize = 8;
/// Deviations of the noise that a mass at rest may show about its mean, at most.
const STILL: f64 = 1.5;
/// Levels of what holds that are looked at.
const LEVELS: usize = 16;
/// Rounds of a finer look at what holds.
const ROUNDS: usize = 3;

/// The fitted records, cut where a mass rests.
struct Slips {
    /// From the beginning of each slip to its end.
    moving: Vec<Run>,
    /// From the middle of each rest to that of the next.
    between: Vec<Run>,
    /// Displacements and velocities at the beginning of each of those.
    begins: Vec<Vec<f64>>,
}

impl Data {
    /// True if masses rest for a share of the fitted records that no smooth motion is as slow for.
    pub(super) fn rests(&self) -> bool {
        let samples = || self.measured_paths().iter().flat_map(|path| path.stuck.iter().flatten());
        samples().filter(|stuck| **stuck).count() as f64 >= self.constants.resting * samples().count() as f64
    }

    fn slips(&self) -> Slips {
        let (mut moving, mut between) = (Vec::new(), Vec::new());
        let mut resting: HashMap<(usize, usize), Vec<f64>> = HashMap::new();
        for (whole, path) in self.whole().into_iter().zip(self.measured_paths()) {
            let still: Vec<bool> = whole.range.clone().map(|k| path.stuck.iter().any(|mass| mass[k])).collect();
            let (mut at, mut from) = (whole.range.start, whole.range.start);
            for spell in still.chunk_by(|a, b| a == b) {
                let range = at..at + spell.len();
                at = range.end;
                if spell[0] {
                    if range.start > whole.range.start && range.end < whole.range.end {
                        let middle = range.start.midpoint(range.end);
                        between.push(whole.part(from..middle));
                        from = middle;
                    }
                    resting.insert((whole.record, from), self.resting(&whole, range));
                } else if spell.len() >= FEWEST {
                    moving.push(whole.part(range));
                }
            }
            between.push(whole.part(from..whole.range.end));
        }
        // Where no rest is seen for long, a start is followed no further than elsewhere.
        let [moving, between] = [moving, between].map(|runs| cut(&runs, self.period, 0));
        let begin = |run: &Run| resting.remove(&(run.record, run.range.start)).unwrap_or_else(|| run.initial());
        let begins = between.iter().map(begin).collect();
        Slips { moving, between, begins }
    }

    /// The state in the middle of a spell in which a mass rests: where its displacement is no more than noise about its mean, the
    /// mean of all of it, of which noise is a small part. A hundredth of the force that holds decides whether a slip begins.
    fn resting(&self, whole: &Run, spell: Range<usize>) -> Vec<f64> {
        let mut state = whole.part(spell.start.midpoint(spell.end)..spell.end).initial();
        let inner = spell.start + spell.len() / 4..spell.end - spell.len() / 4;
        for (mass, _) in whole.outputs.iter().enumerate().filter(|(mass, o)| **o == Output::Displacement(*mass)) {
            let (mean, variance) = mean_and_variance(&whole.measured[mass][inner.clone()]);
            if variance.sqrt() * whole.weights[mass] < STILL * self.noise {
                state[mass] = mean;
            }
        }
        state
    }
}

/// A model that is fitted between rests.
struct SlipFit<'a> {
    composition: &'a Composition,
    slips: Slips,
    options: FitOptions<'a>,
    /// Places and bounds of what holds a mass.
    holds: Vec<(usize, (f64, f64))>,
}

impl SlipFit<'_> {
    /// Shared parameters fitted along the slips.
    fn along_slips(&self, shared: &[f64]) -> Option<Vec<f64>> {
        let runs = &self.slips.moving;
        // Where a slip ends it is caught for good, and where it begins nothing holds it: which of the two runs show most of is
        // open.
        let held = |most: bool| -> Option<Refined> {
            let mut shared = shared.to_vec();
            self.holds.iter().for_each(|(place, (low, high))| shared[*place] = if most { *high } else { *low });
            refine(self.composition, runs, &Point::new(self.composition, runs, shared, true), self.options)
        };
        let either = [true, false].into_iter().take(1 + usize::from(!self.holds.is_empty()));
        let nearest = either.filter_map(held).min_by(|a, b| a.rss.total_cmp(&b.rss))?;
        Some(nearest.point.shared)
    }

    /// Shared parameters, each run beginning where its mass rests.
    fn begun_at_rest(&self, shared: Vec<f64>) -> Point {
        Point { own: self.slips.begins.clone(), ..Point::new(self.composition, &self.slips.between, shared, true) }
    }

    /// Shared parameters with that level of what holds by which the runs from rest to rest are met best.
    fn held(&self, mut shared: Vec<f64>) -> Vec<f64> {
        for (place, (lowest, highest)) in self.holds.iter().copied() {
            let (mut low, mut high) = (lowest, highest);
            for _ in 0..ROUNDS {
                let left = |level: &f64| {
                    let mut shared = shared.clone();
                    shared[place] = *level;
                    misfit(self.composition, &self.slips.between, &self.begun_at_rest(shared), self.options)
                };
                let levels = logarithmic(low, high, LEVELS).into_iter();
                let nearest =
                    levels.filter_map(|level| Some((left(&level)?, level))).min_by(|a, b| a.0.total_cmp(&b.0));
                let Some((_, level)) = nearest else { break };
                shared[place] = level;
                let step = (high / low).powf(1.0 / (LEVELS - 1) as f64);
                (low, high) = ((level / step).max(lowest), (level * step).min(highest));
            }
        }
        shared
    }

    /// Where whole records start: what a fit from rest to rest leads to, with the states that it begins them with.
    fn of_whole(&self, whole: &[Run], shared: Vec<f64>) -> Point {
        let begun = |shared: Vec<f64>| Point::new(self.composition, whole, shared, false);
        let between = &self.slips.between;
        let Some(refined) = refine(self.composition, between, &self.begun_at_rest(shared.clone()), self.options) else {
            return begun(shared);
        };
        let Point { shared, offsets, own } = refined.point;
        let mut point = Point { offsets, ..begun(shared) };
        for (state, record) in point.own.iter_mut().zip(whole) {
            let first = between.iter().position(|run| run.record == record.record);
            first.into_iter().for_each(|k| state.iter_mut().zip(&own[k]).for_each(|(state, own)| *state = *own));
        }
        point
    }
}

impl Search {
    /// Where a fit of whole records may start: where a fit along slips leads, then one from rest to rest. None without rests or
    /// dry friction, or where whole records say that the shared parameters were better as they are.
    pub(super) fn between_rests(&self, composition: &Composition, shared: &[f64], cancel: &Cancel) -> Option<Point> {
        if !composition.forms.iter().any(Form::is_dry_friction) || !self.data.rests() {
            return None;
        }
        let cancelled = || cancel.is_cancelled();
        let options = FitOptions { driven: true, ..self.data.options(&cancelled, self.data.constants.steps, None) };
        let places = composition.positions().inner.forms;
        let each = composition.forms.iter().zip(&places).flat_map(|(form, places)| form.inner.iter().zip(places));
        let holds =
            each.filter(|(quantity, _)| quantity.jumps).map(|(quantity, place)| (*place, quantity.bounds)).collect();
        let fit = SlipFit { composition, slips: self.data.slips(), options, holds };
        if fit.slips.moving.is_empty() {
            return None;
        }
        let whole = self.data.whole();
        let point = fit.of_whole(&whole, fit.held(fit.along_slips(shared)?));
        let left = |point: &Point| misfit(composition, &whole, point, FitOptions { driven: false, ..options });
        let as_it_was = left(&Point::new(composition, &whole, shared.to_vec(), false));
        left(&point).is_some_and(|new| as_it_was.is_none_or(|old| new < old)).then_some(point)
    }
}
