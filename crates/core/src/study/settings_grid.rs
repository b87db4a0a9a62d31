//! The map behind the sliders: segment length × threshold, each cell judged by simulation.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::parallel::lock;
use crate::parallel::prelude::*;

use super::choose::{self, SettingsTrial, bearable, period_samples};
use super::validation::{Judgement, SmoothedFolds, ValidationPlan};
use super::{Cancel, Settings, Smoothing, StudyError, check};
use crate::signal::{Differentiation, odd};
use crate::simulate::Workspace;
use sindyscope_values::model::Model;
use sindyscope_values::record::{RecordSet, Usage};

/// One setting of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridCell {
    /// RMS error of the simulated response on what was not fitted, as a share of the motion's standard deviation. A
    /// stretch whose response leaves the data's range counts as ten times the motion.
    pub error: f64,
    /// Share of the judging stretches whose response left the data's range, 0 to 1.
    pub failed: f64,
    /// Number of terms in the equations that are fitted.
    pub terms: usize,
    /// What the regression leaves of the rate (the acceleration), as a share of the rate's RMS.
    pub fit_error: f64,
    /// One less the largest autocorrelation of the response's error at lags of 1, 2, 4, … 128 samples: near one where
    /// the error is noise alone, near zero where it is a motion that the model misses; not a number where nothing was
    /// simulated.
    pub whiteness: f64,
}

/// What judges a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judge {
    /// Records held out.
    HeldOut,
    /// Fitted records, each left out in turn, or the last part of a single one.
    CrossValidation,
}

/// A place on the map: indices of a segment length and of a threshold.
pub type SettingsGridPoint = (usize, usize);

/// A map of segment length × threshold, complete or on its way.
#[derive(Clone, Debug, PartialEq)]
pub struct SettingsGrid {
    /// Segment lengths, samples, ascending.
    pub windows: Vec<usize>,
    /// Thresholds, as the settings compare them, ascending.
    pub thresholds: Vec<f64>,
    /// What judges.
    pub judge: Judge,
    /// The cell of the smallest error so far.
    pub best: Option<SettingsGridPoint>,
    /// Of the cells whose error is within one standard error of the best the one with the fewest terms (Breiman et al.
    /// 1984), in the middle of the thresholds that leave them.
    pub parsimonious: Option<SettingsGridPoint>,
    cells: Vec<Option<GridCell>>,
    /// Steps between the segment lengths and between the thresholds known so far.
    stride: usize,
}

impl SettingsGrid {
    /// A cell, if it is known.
    pub fn cell(&self, (window, threshold): SettingsGridPoint) -> Option<&GridCell> {
        self.cells.get(window * self.thresholds.len() + threshold)?.as_ref()
    }

    /// The cell, or while it is not known the nearest that is.
    pub fn nearest(&self, (window, threshold): SettingsGridPoint) -> Option<&GridCell> {
        let near = |at: usize, count: usize| {
            let stride = self.stride.max(1);
            [at, (at + stride / 2) / stride * stride, at / stride * stride].map(|k| k.min(count.saturating_sub(1)))
        };
        let thresholds = near(threshold, self.thresholds.len());
        near(window, self.windows.len())
            .into_iter()
            .flat_map(|w| thresholds.map(|t| (w, t)))
            .find_map(|place| self.cell(place))
    }

    /// Share of the cells that are known, 0 to 1.
    pub fn done(&self) -> f64 {
        self.cells.iter().flatten().count() as f64 / self.cells.len().max(1) as f64
    }

    /// True once every cell that can be known is.
    pub fn complete(&self) -> bool {
        self.stride == 1
    }

    /// Every cell that is known, with its place.
    pub fn known(&self) -> impl Iterator<Item = (SettingsGridPoint, &GridCell)> {
        let width = self.thresholds.len().max(1);
        self.cells.iter().enumerate().filter_map(move |(k, cell)| Some(((k / width, k % width), cell.as_ref()?)))
    }

    /// The Pareto front: for each number of terms the cell of the smallest error, as long as more terms better it;
    /// fewest terms first.
    pub fn front(&self) -> Vec<SettingsGridPoint> {
        let mut best: Vec<(usize, f64, SettingsGridPoint)> = Vec::new();
        for (place, cell) in self.known() {
            match best.iter_mut().find(|(terms, ..)| *terms == cell.terms) {
                Some(entry) if cell.error < entry.1 => *entry = (cell.terms, cell.error, place),
                Some(_) => {}
                None => best.push((cell.terms, cell.error, place)),
            }
        }
        best.sort_by_key(|(terms, ..)| *terms);
        let mut least = f64::INFINITY;
        best.retain(|(_, error, _)| {
            let betters = *error < least;
            least = least.min(*error);
            betters
        });
        best.into_iter().map(|(.., place)| place).collect()
    }

    /// The place nearest to settings, by the logarithms of both.
    pub fn place_of(&self, settings: &Settings) -> Option<SettingsGridPoint> {
        let nearest = |values: &mut dyn Iterator<Item = f64>, wanted: f64| {
            let distance = |v: f64| (v.max(f64::MIN_POSITIVE) / wanted.max(f64::MIN_POSITIVE)).ln().abs();
            let by_distance = |a: &(usize, f64), b: &(usize, f64)| distance(a.1).total_cmp(&distance(b.1));
            values.enumerate().min_by(by_distance).map(|(k, _)| k)
        };
        let window = nearest(&mut self.windows.iter().map(|w| *w as f64), settings.smoothing.window as f64)?;
        Some((window, nearest(&mut self.thresholds.iter().copied(), settings.threshold)?))
    }

    /// Settings with the segment length and the threshold of a place.
    pub fn settings_at(&self, (window, threshold): SettingsGridPoint, settings: &Settings) -> Settings {
        let mut settings = settings.clone();
        if let Some(window) = self.windows.get(window) {
            settings.smoothing = settings.smoothing.with_window(*window);
        }
        settings.threshold = self.thresholds.get(threshold).copied().unwrap_or(settings.threshold);
        settings
    }
}

/// Strides between the cells computed in each pass: a coarse map first, the rest between.
const STRIDES: [usize; 3] = [6, 3, 1];

/// A segment length with what has been found for it.
#[derive(Default)]
struct WindowColumn {
    smoothed: Option<SmoothedFolds>,
    /// Models simulated, one for each fold, with what came of them.
    judged: Vec<(Vec<Model>, Judgement)>,
    found: Vec<Option<ThresholdResult>>,
}

/// What a threshold leaves.
#[derive(Clone, Copy)]
struct ThresholdResult {
    /// Which of the models judged.
    judged: usize,
    terms: usize,
    fit_error: f64,
}

/// Computes the map of at most `size` segment lengths and thresholds around no setting in particular: its extent is that
/// of the records and of the thresholds at which terms drop out, so that moving either slider leaves the map as it is.
///
/// Coarse to fine, on the cores there are; `tell` gets the map as far as it is known, after each column of a pass. Held-out
/// records judge if there are any, else cross-validation does, as in [`choose`](super::choose()). Along one segment
/// length each distinct set of terms is fitted and simulated once, whatever the number of thresholds that leave it.
///
/// # Errors
/// As [`Study::run`](super::Study::run).
pub fn settings_grid(
    records: &RecordSet,
    settings: &Settings,
    size: (usize, usize),
    cancel: &Cancel,
    tell: &(dyn Fn(SettingsGrid) + Sync),
) -> Result<SettingsGrid, StudyError> {
    let layout = check(records, settings)?;
    let held_out = records.with(Usage::HeldOut).next().is_some();
    let (judge, plan) = if held_out {
        (Judge::HeldOut, ValidationPlan::held_out(records, layout))
    } else {
        (Judge::CrossValidation, ValidationPlan::new(records, layout))
    };
    let windows = windows(&plan, settings, size.0);
    let columns: Vec<Mutex<WindowColumn>> = windows.iter().map(|_| Mutex::default()).collect();
    let coarse = |k: &usize| k.is_multiple_of(STRIDES[0]);
    let marks: Result<Vec<Vec<f64>>, StudyError> = (0..windows.len())
        .into_par_iter()
        .filter(coarse)
        .map(|k| {
            let smoothing = settings.smoothing.with_window(windows[k]);
            let smoothed = plan.smoothed(settings, &smoothing, cancel)?;
            let marks = smoothed.as_ref().map_or_else(Vec::new, |s| s.all.marks(settings));
            lock(&columns[k]).smoothed = smoothed;
            Ok(marks)
        })
        .collect();
    let thresholds = thresholds(&marks?.concat(), settings, size.1);
    let map = Mutex::new(SettingsGrid {
        cells: vec![None; windows.len() * thresholds.len()],
        windows,
        thresholds: thresholds.clone(),
        judge,
        best: None,
        parsimonious: None,
        stride: STRIDES[0],
    });
    let windows = lock(&map).windows.clone();
    for (pass, stride) in STRIDES.into_iter().enumerate() {
        let last = pass + 1 == STRIDES.len();
        let left = AtomicUsize::new(windows.len().div_ceil(stride));
        (0..windows.len()).into_par_iter().filter(|k| k % stride == 0).try_for_each(|k| {
            let mut column = lock(&columns[k]);
            let smoothing = settings.smoothing.with_window(windows[k]);
            if column.smoothed.is_none() {
                column.smoothed = plan.smoothed(settings, &smoothing, cancel)?;
            }
            fill(&mut column, &plan, settings, &smoothing, &thresholds, stride, cancel)?;
            if last {
                column.smoothed = None;
            }
            let mut map = lock(&map);
            map.take(k, &column);
            drop(column);
            let finished = left.fetch_sub(1, Ordering::Relaxed) == 1;
            if finished {
                map.stride = stride;
            }
            if finished || pass > 0 {
                map.judge_cells(settings, &columns);
                let snapshot = map.clone();
                drop(map);
                tell(snapshot);
            }
            Ok::<(), StudyError>(())
        })?;
    }
    Ok(map.into_inner().unwrap_or_else(PoisonError::into_inner))
}

/// Finds the cells of every `stride`-th threshold.
fn fill(
    column: &mut WindowColumn,
    plan: &ValidationPlan,
    settings: &Settings,
    smoothing: &Smoothing,
    thresholds: &[f64],
    stride: usize,
    cancel: &Cancel,
) -> Result<(), StudyError> {
    let WindowColumn { smoothed: Some(smoothed), judged, found } = column else { return Ok(()) };
    found.resize(thresholds.len(), None);
    let mut workspace = Workspace::default();
    for (slot, threshold) in found.iter_mut().zip(thresholds).step_by(stride).filter(|(slot, _)| slot.is_none()) {
        let settings = Settings { smoothing: *smoothing, threshold: *threshold, ..settings.clone() };
        let models = smoothed.models(&settings);
        let (all, fit_error) = smoothed.all.sparse(&settings);
        let terms = smoothed.all.fitted().map(|state| all.equations[state].terms.len()).sum();
        // A set of terms has one fit.
        let index = match judged.iter().position(|(known, _)| *known == models) {
            Some(index) => index,
            None => {
                let judgement = smoothed.judge(plan, &models, &mut workspace, cancel)?;
                judged.push((models, judgement));
                judged.len() - 1
            }
        };
        *slot = Some(ThresholdResult { judged: index, terms, fit_error });
    }
    Ok(())
}

impl SettingsGrid {
    /// Takes over what is known of a column.
    fn take(&mut self, window: usize, column: &WindowColumn) {
        let width = self.thresholds.len();
        for (cell, found) in self.cells[window * width..][..width].iter_mut().zip(&column.found) {
            let Some(ThresholdResult { judged, terms, fit_error }) = found else { continue };
            let (_, judgement) = &column.judged[*judged];
            let count = judgement.errors.len().max(1) as f64;
            *cell = Some(GridCell {
                error: (judgement.errors.iter().sum::<f64>() / count).sqrt(),
                failed: judgement.failed as f64 / count,
                terms: *terms,
                fit_error: *fit_error,
                whiteness: judgement.whiteness,
            });
        }
    }

    /// Finds the best cell and the parsimonious one among those known.
    fn judge_cells(&mut self, settings: &Settings, columns: &[Mutex<WindowColumn>]) {
        let mut candidates: Vec<SettingsTrial> = Vec::new();
        let mut places: Vec<Vec<SettingsGridPoint>> = Vec::new();
        for (window, column) in columns.iter().enumerate() {
            // A column that is being worked on has its turn when it is done.
            let Ok(column) = column.try_lock() else { continue };
            let first = candidates.len();
            let terms =
                |judged: usize| column.found.iter().flatten().find(|f| f.judged == judged).map_or(0, |f| f.terms);
            candidates.extend(column.judged.iter().enumerate().map(|(k, (_, judgement))| SettingsTrial {
                form: settings.form,
                smoothing: settings.smoothing,
                threshold: 0.0,
                terms: terms(k),
                errors: judgement.errors.clone(),
            }));
            places.resize(candidates.len(), Vec::new());
            for (threshold, found) in column.found.iter().enumerate() {
                if let Some(found) = found {
                    places[first + found.judged].push((window, threshold));
                }
            }
        }
        let place = |chosen: Option<&SettingsTrial>| {
            let chosen = chosen?;
            let index = candidates.iter().position(|c| std::ptr::eq(c, chosen))?;
            places[index].get(places[index].len() / 2).copied()
        };
        self.best = place(choose::best(&candidates)).or(self.best);
        self.parsimonious = place(choose::parsimonious(&candidates)).or(self.parsimonious);
    }
}

/// Segment lengths from the shortest that the order allows to two main periods, evenly by their logarithm.
fn windows(plan: &ValidationPlan, settings: &Settings, most: usize) -> Vec<usize> {
    let Smoothing { method, window, order, .. } = settings.smoothing;
    if method == Differentiation::Difference {
        return vec![window];
    }
    let bearable = bearable(plan, order);
    let shortest = odd(order + 2);
    let longest = odd((1.5 * period_samples(plan)) as usize).max(51).min(odd(bearable.end)).max(shortest + 2);
    let mut windows = spaced(shortest as f64, longest as f64, most).map(|w| odd(w as usize)).collect::<Vec<_>>();
    windows.dedup();
    windows
}

/// Smallest share of the largest threshold that the map reaches down to.
const THRESHOLD_SPAN: f64 = 1e-5;

/// Thresholds around those at which a term drops out, evenly by their logarithm, each of two digits.
fn thresholds(marks: &[f64], settings: &Settings, most: usize) -> Vec<f64> {
    let (low, high) = marks.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), m| (a.min(*m), b.max(*m)));
    let (low, high) = if high > 0.0 {
        (low.max(THRESHOLD_SPAN * high), high)
    } else {
        let around = if settings.threshold > 0.0 { settings.threshold } else { 0.1 };
        (0.1 * around, around)
    };
    let rounded = |v: f64| format!("{v:.2e}").parse().unwrap_or(v);
    let mut thresholds: Vec<f64> = spaced(0.7 * low, 1.3 * high, most).map(rounded).collect();
    thresholds.dedup();
    thresholds
}

fn spaced(low: f64, high: f64, count: usize) -> impl Iterator<Item = f64> {
    let steps = count.max(2) - 1;
    (0..=steps).map(move |k| low * (high / low).powf(k as f64 / steps as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::{FreeSettings, Study, choose, suggest};
    use sindyscope_rig::{ScenarioOptions, generate};
    use sindyscope_values::record::Usage;
    use sindyscope_values::term::Kind;

    /// Three tones of the friction rig, the last held out if asked for.
    fn friction(held_out: bool) -> (RecordSet, Settings) {
        let options = ScenarioOptions {
            duration: Some(4.0),
            rate: Some(250.0),
            frequencies: Some(vec![2.013, 2.583, 4.611]),
            ..ScenarioOptions::default()
        };
        let mut records = RecordSet::new(generate("friction-noisy", &options).unwrap().records, Usage::Fit);
        if held_out {
            records.entries[2].1 = Usage::HeldOut;
        }
        let settings = suggest(&records, Kind::SecondOrder).unwrap();
        (records, settings)
    }

    fn full(records: &RecordSet, settings: &Settings, size: (usize, usize)) -> SettingsGrid {
        settings_grid(records, settings, size, &Cancel::default(), &|_| {}).unwrap()
    }

    #[test]
    fn a_cell_is_what_a_study_with_its_settings_says() {
        let (records, settings) = friction(true);
        let map = full(&records, &settings, (7, 9));
        assert!(map.complete() && map.done() == 1.0 && map.judge == Judge::HeldOut);
        let mut compared = 0;
        for place in [(0, 0), (2, 3), (3, 5), (4, 8), (6, 1)] {
            let settings = map.settings_at(place, &settings);
            let outcome = Study::default().run(&records, &settings, &Cancel::default()).unwrap();
            let cell = map.cell(place).unwrap();
            assert_eq!(cell.terms, outcome.model.leading().unwrap().terms.len(), "{place:?}");
            let fit = &outcome.fits[0];
            // The columns of several records were reduced together there and one by one here.
            assert!((cell.fit_error - fit.residual_rms / fit.rate_rms).abs() < 1e-9, "{place:?}");
            if let Some(score) = outcome.test.filter(|_| !outcome.diverged() && cell.failed == 0.0) {
                // Parts of a record that do not fill a stretch weigh more than its rest.
                assert!((cell.error / score.nrmse - 1.0).abs() < 0.05, "{place:?}: {} {}", cell.error, score.nrmse);
                compared += 1;
            }
        }
        assert!(compared >= 3, "{compared} cells did not diverge");
    }

    #[test]
    fn it_comes_coarse_to_fine_and_no_cell_changes() {
        let (records, settings) = friction(false);
        let seen = Mutex::new(Vec::new());
        let map = settings_grid(&records, &settings, (13, 13), &Cancel::default(), &|m| lock(&seen).push(m)).unwrap();
        let seen = lock(&seen);
        assert_eq!(map.judge, Judge::CrossValidation);
        assert!(seen[0].done() < 0.1, "{}", seen[0].done());
        assert!(seen.windows(2).all(|w| w[0].done() <= w[1].done()));
        assert_eq!(seen.last().unwrap(), &map);
        for (place, cell) in seen[0].known() {
            assert_eq!(map.cell(place).unwrap(), cell);
        }
        assert!((0..13).all(|w| (0..13).all(|t| seen[0].nearest((w, t)).is_some())), "the first map has no holes");
    }

    #[test]
    #[ignore = "most of a minute; `tests/choice.rs` asks the same"]
    fn the_choice_is_not_much_worse_than_the_best_point_of_the_map() {
        let (records, settings) = friction(false);
        let map = full(&records, &settings, (13, 13));
        let error = |place: SettingsGridPoint| map.cell(place).unwrap().error;
        let (best, parsimonious) = (map.best.unwrap(), map.parsimonious.unwrap());
        assert!(map.known().all(|(_, cell)| cell.error >= error(best)));
        assert!(error(parsimonious) <= 2.0 * error(best));
        assert!(map.cell(parsimonious).unwrap().terms <= map.cell(best).unwrap().terms);
        let free = FreeSettings { window: true, order: true, threshold: true, form: true, refine: true, terms: false };
        let chosen = choose(&records, &settings, free, &Cancel::default(), &|_, _| {}).unwrap().settings;
        let test = |settings: &Settings| {
            let outcome = Study::default().run(&records, settings, &Cancel::default()).unwrap();
            outcome.test.or(outcome.train).unwrap().nrmse
        };
        let best = test(&map.settings_at(best, &settings));
        assert!(test(&chosen) <= 2.0 * best, "{} {best}", test(&chosen));
    }

    #[test]
    fn the_front_falls_and_settings_find_their_place() {
        let (records, settings) = friction(true);
        let map = full(&records, &settings, (9, 9));
        let front = map.front();
        let cells: Vec<&GridCell> = front.iter().map(|place| map.cell(*place).unwrap()).collect();
        assert!(cells.len() > 1);
        assert!(cells.windows(2).all(|w| w[0].terms < w[1].terms && w[0].error > w[1].error), "{cells:?}");
        for place in front {
            assert_eq!(map.place_of(&map.settings_at(place, &settings)), Some(place));
        }
    }

    #[test]
    fn it_stops_when_it_is_cancelled() {
        let (records, settings) = friction(false);
        let cancel = Cancel::default();
        let stop = cancel.clone();
        let result = settings_grid(&records, &settings, (25, 25), &cancel, &move |_| stop.cancel());
        assert_eq!(result, Err(StudyError::Cancelled));
    }
}
