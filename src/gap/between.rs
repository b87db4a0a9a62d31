//! What an input does between its samples, and how much of the response hangs on it.
//!
//! The simulation follows the band-limited curve through an input's samples. A control that hears the sensor's noise gives an
//! input that is rough from one sample to the next, and then no sample tells what lies between: where dry friction turns with
//! the motion's direction, another course of the same samples is another response.

use std::sync::Arc;

use super::data::Data;
use super::fit::{Fitted, Pace, WHOLE};
use crate::refine::{Options, Run, Structure as _, respond};
use crate::study::Cancel;

/// An input whose samples are guessed from their neighbours to this share of it or better tells its course between them: most
/// of it has five samples a period or more.
const ROUGH: f64 = 0.3;
/// The true course may differ from the one that was simulated by so many times as much as the straight one does.
const COURSES: f64 = 2.0;
/// Points of the straight course for each sample.
const FINER: usize = 4;

impl Data {
    /// RMS that the unknown course of a rough input between its samples may come to in the response of a model along the fitted
    /// records, weighted: by how much it changes if the input goes straight from sample to sample. Zero of inputs that tell
    /// their course.
    pub(super) fn between_samples(&self, fitted: &Fitted, cancel: &Cancel) -> f64 {
        let driven = fitted.level != WHOLE;
        // Internal states of segments begin as the measured motion drives them, sample by sample.
        if driven && fitted.composition.internals() > 0 || !fitted.runs.iter().any(|run| run.grid.roughness() > ROUGH) {
            return 0.0;
        }
        let finer = |run: &Run| -> Option<Run> {
            let spread = |values: &Arc<[f64]>| values.iter().flat_map(|v| [*v; FINER]).collect();
            Some(Run {
                grid: Arc::new(run.grid.straight(FINER)?),
                measured: run.measured.iter().map(spread).collect(),
                range: run.range.start * FINER..(run.range.end - 1) * FINER + 1,
                ..run.clone()
            })
        };
        let Some(runs) = fitted.runs.iter().map(finer).collect::<Option<Vec<Run>>>() else { return 0.0 };
        let cancelled = || cancel.is_cancelled();
        let options = Options { driven, ..Self::options(&cancelled, 0, Pace::Thorough) };
        let Some(straight) = respond(&fitted.composition, &runs, &fitted.refined.point, options) else { return 0.0 };
        let (mut square, mut count) = (0.0, 0);
        for ((run, straight), curved) in fitted.runs.iter().zip(&straight).zip(&fitted.refined.simulated) {
            let fine = straight.len() / run.measured.len().max(1);
            for (series, curved) in straight.chunks(fine.max(1)).zip(curved.chunks(run.range.len())) {
                square += series.iter().step_by(FINER).zip(curved).map(|(s, c)| (s - c).powi(2)).sum::<f64>();
                count += curved.len();
            }
        }
        COURSES * (square / count.max(1) as f64).sqrt()
    }
}
