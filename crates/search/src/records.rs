//! How a model does on each record: run freely, and over stretches begun anew where it does not last.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::data::RecordSeries;
use super::fit::{Fitted, WHOLE, Wanted};
use super::search::Search;
use sindyscope_core::refine::{Run, Structure as _, shoot};
use sindyscope_core::signal::{dot, mean_and_variance};
use sindyscope_core::study::Cancel;
use sindyscope_values::record::Usage;

/// The error of a model along one record, of its first sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordScore {
    /// Name of the record.
    pub name: Arc<str>,
    /// True if the model was fitted to it.
    pub fitted: bool,
    /// Samples that were compared.
    pub samples: usize,
    /// RMSE of the free run from the initial state that fits best; none where it leaves the data's range.
    pub rmse: Option<f64>,
    /// The same over the record's standard deviation.
    pub nrmse: Option<f64>,
    /// The errors over stretches begun anew; none where the whole record was followed at once.
    pub stretches: Option<StretchScore>,
}

/// Errors over stretches of a record, each begun anew.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StretchScore {
    /// The longest stretch, s.
    pub seconds: f64,
    /// RMSE over all of them.
    pub rmse: f64,
}

/// The error of free runs over several records together; nothing where one of them leaves the data's range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FreeRun {
    /// RMSE of the first sensor.
    pub rmse: Option<f64>,
    /// The same over the standard deviation of the records.
    pub nrmse: Option<f64>,
}

impl FreeRun {
    /// Of the fitted records, or of those held out. None where whole records were followed at once: then a [`Gap`] has these
    /// figures.
    ///
    /// [`Gap`]: super::Gap
    pub fn over(scores: &[RecordScore], fitted: bool) -> Option<Self> {
        let own: Vec<&RecordScore> = scores.iter().filter(|s| s.fitted == fitted).collect();
        if own.iter().all(|s| s.stretches.is_none()) {
            return None;
        }
        let sum = |of: &dyn Fn(&RecordScore) -> Option<f64>| -> Option<f64> {
            own.iter().map(|s| Some(of(s)?.powi(2) * s.samples as f64)).sum()
        };
        let samples = own.iter().map(|s| s.samples as f64).sum::<f64>();
        let squares = sum(&|s| s.rmse);
        let spread = sum(&|s| Some(s.rmse? / s.nrmse?));
        let nrmse = squares.zip(spread).map(|(s, d)| (s / d).sqrt());
        Some(Self { rmse: squares.map(|s| (s / samples).sqrt()), nrmse })
    }
}

impl Search {
    /// What a model leaves on each record, fitted ones first.
    pub(super) fn record_scores(&self, fitted: &Fitted, cancel: &Cancel) -> Vec<RecordScore> {
        let data = &self.data;
        let followed = fitted.followed();
        let fit = data.fit().iter().zip(&followed);
        let held = data.held_out().iter().zip(&fitted.held_out);
        fit.chain(held)
            .map(|(s, along)| {
                let initial = data.initial.filter(|_| s.usage == Usage::HeldOut);
                let from = initial.unwrap_or(0);
                let deviation = mean_and_variance(&s.measured[0][from..]).1.sqrt();
                let error = |shown: &[f64]| -> Option<f64> {
                    let errors: Vec<f64> = s.measured[0].iter().zip(shown).skip(from).map(|(y, m)| y - m).collect();
                    (shown.len() == s.len()).then(|| (dot(&errors, &errors) / errors.len() as f64).sqrt())
                };
                let own = error(along.simulated.get(..s.len()).unwrap_or_default());
                let stretches = &along.beginnings.stretches;
                let whole = initial.is_some() || fitted.level == WHOLE && stretches.len() <= 1;
                let free = if whole { own } else { self.free_run(fitted, s, cancel).as_deref().and_then(error) };
                let longest = stretches.iter().map(|(range, _)| range.len()).max().unwrap_or(0);
                let of_stretches =
                    own.filter(|_| !whole).map(|rmse| StretchScore { seconds: longest as f64 * s.interval, rmse });
                RecordScore {
                    name: Arc::clone(&s.name),
                    fitted: s.usage == Usage::Fit,
                    samples: s.len() - from,
                    rmse: free,
                    nrmse: free.map(|e| e / deviation),
                    stretches: of_stretches,
                }
            })
            .collect()
    }

    /// What the first sensor would show of a whole record, its initial state fitted; none where the run does not last.
    fn free_run(&self, fitted: &Fitted, s: &RecordSeries, cancel: &Cancel) -> Option<Vec<f64>> {
        let runs = [Run { record: 0, ..s.run() }];
        let composition = &fitted.composition;
        let shared = &fitted.refined.point.shared;
        composition.instance(shared)?;
        let cancelled = || cancel.is_cancelled();
        let wanted = Wanted { level: WHOLE, period: self.data.period, error: self.data.noise };
        let goal = self.data.followed_to(wanted, &cancelled);
        let found = shoot(composition, &runs, (shared, None), WHOLE, goal, self.data.constants.few_steps())?;
        let whole = found.refined.simulated.first()?;
        Some(whole.get(..s.len())?.to_vec())
    }
}
