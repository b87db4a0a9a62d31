//! What an input does between its samples, and how much of the response hangs on it.
//!
//! The simulation follows a smooth curve through an input's samples. A control that hears the sensor's noise gives an input
//! that is rough from one sample to the next, and then no sample tells what lies between: where dry friction turns with the
//! motion's direction, another course of the same samples is another response.

use std::sync::Arc;

use super::data::Data;
use super::fit::{Fitted, WHOLE};
use sindyscope_core::refine::{FitOptions, Run, Structure as _, respond};
use sindyscope_core::signal::rms;
use sindyscope_core::simulate::InputGrid;
use sindyscope_core::sparse::OrthonormalBasis;
use sindyscope_core::study::Cancel;

/// Points of the other course for each sample, by which it is drawn smoothly enough.
const FINER: usize = 4;

impl Data {
    /// RMS that the unknown course of the inputs between their samples may come to in the response of a model along the fitted
    /// records, weighted: what a course through fewer neighbours changes and no parameter, offset or initial state makes up
    /// for. Zero where that cannot be told, and if cancelled.
    fn between_samples(&self, fitted: &Fitted, cancel: &Cancel) -> f64 {
        if let Some(known) = fitted.between_samples.get() {
            return *known;
        }
        let found = self.simulated_between_samples(fitted, cancel);
        if !cancel.is_cancelled() {
            // Another thread may have been sooner, with the same.
            let _ = fitted.between_samples.set(found);
        }
        found
    }

    /// The same, simulated anew.
    fn simulated_between_samples(&self, fitted: &Fitted, cancel: &Cancel) -> f64 {
        let driven = fitted.level != WHOLE;
        // Internal states of segments begin as the measured motion drives them, sample by sample.
        if driven && fitted.composition.internals() > 0 || self.layout.inputs == 0 {
            return 0.0;
        }
        let cancelled = || cancel.is_cancelled();
        let spread = |values: &Arc<[f64]>| values.iter().flat_map(|v| [*v; FINER]).collect();
        let mut last: Option<(Arc<InputGrid>, Run)> = None;
        let finer = |run: &Run| -> Option<Run> {
            // Runs of one record share its inputs, of which a course takes tens of milliseconds where the record is long.
            let known = last.take().filter(|(grid, _)| Arc::ptr_eq(grid, &run.grid));
            let (grid, finer) = match known {
                Some(known) => known,
                None if cancelled() => return None,
                None => {
                    let grid = Arc::new(run.grid.other_course(FINER)?);
                    let measured = run.measured.iter().map(spread).collect();
                    (Arc::clone(&run.grid), Run { grid, measured, ..run.clone() })
                }
            };
            let part = finer.part(run.range.start * FINER..(run.range.end - 1) * FINER + 1);
            last = Some((grid, finer));
            Some(part)
        };
        let Some(runs) = fitted.runs.iter().map(finer).collect::<Option<Vec<Run>>>() else { return 0.0 };
        let options = FitOptions { driven, ..self.options(&cancelled, 0, None) };
        let refined = &fitted.refined;
        let Some(other) = respond(&fitted.composition, &runs, &refined.point, options) else { return 0.0 };
        let change = |((run, other), here): ((&Run, &Vec<f64>), &Vec<f64>)| -> Vec<f64> {
            let fine = other.len() / run.measured.len().max(1);
            let of_samples = other.chunks(fine.max(1)).flat_map(|series| series.iter().step_by(FINER));
            of_samples.zip(here).map(|(o, h)| o - h).collect()
        };
        let changes: Vec<Vec<f64>> = fitted.runs.iter().zip(&other).zip(&refined.simulated).map(change).collect();
        let mut left = fitted.rows(&changes);
        let mut basis = OrthonormalBasis::default();
        for column in self.tangent(fitted) {
            basis.push(column);
        }
        basis.remove(&mut left);
        // A force that a control gives has corners where dry friction turns: the true course may differ by more than this one.
        self.constants.between_samples * rms(&left)
    }

    /// RMS that noise and the inputs' unknown course leave in the response of a model that lacks nothing.
    pub(super) fn noise_of(&self, fitted: &Fitted, cancel: &Cancel) -> f64 {
        self.noise.hypot(self.between_samples(fitted, cancel))
    }

    /// True if the inputs' unknown course leaves more in a model's response than the noise explains, and more than what is asked about:
    /// an RMS.
    pub(super) fn hides_between_samples(&self, fitted: &Fitted, rms: f64, cancel: &Cancel) -> bool {
        let between = self.between_samples(fitted, cancel);
        between > rms && self.noise.hypot(between) > self.constants.explaining().0 * self.noise
    }

    /// True if a fit leaves less than so many times the noise and what the inputs may do between their samples, on the data
    /// fitted and on those never fitted.
    pub(super) fn is_within(&self, fitted: &Fitted, times: (f64, f64), cancel: &Cancel) -> bool {
        let unseen = self.unseen_noise();
        let within = |between: f64| {
            fitted.error() < times.0 * self.noise.hypot(between)
                && fitted.held_out_error() < times.1 * unseen.hypot(between)
        };
        within(0.0) || within(self.between_samples(fitted, cancel))
    }
}
