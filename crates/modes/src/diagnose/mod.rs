//! What a linear structure lacks: candidates screened linearly, fitted in closed loop, judged on data never fitted.

mod beginning;
mod candidates;
mod following;
mod landing;
mod telling;

use super::chosen::ChosenPoles;
use super::closed::{ClosedModel, Course};
use super::error::ModesError;
use super::force::{Effect, Site};
use super::identify::{Path, PathRequest, Split, chosen_path, linear, main_period, path};
use super::judge::Residuals;
use super::limits::{EXPLAINS, LAST_POLE_STEPS, LEAST_ERROR};
use super::measurement::{Measurement, SensorSeries};
use super::outcome::Structure;
use super::pole::Pole;
use super::screen::ForceCandidate;
use super::settings::Base;
use super::study::structure;
use serde::{Deserialize, Serialize};
use sindyscope_core::signal::standard_deviation;
use sindyscope_core::study::Cancel;
use sindyscope_search::{CONSTANTS, Found, Lead};
use sindyscope_values::record::RecordSet;
use std::borrow::Cow;

/// The outcome of a search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StructureDiagnosis {
    /// What it was found of: what tells the records from others, and the base that was asked for.
    of: (String, Base),
    /// The poles of the linear model, fitted to what is not held back to judge.
    poles: Vec<Pole>,
    /// The model with the force.
    model: Option<ClosedModel>,
    /// The linear model.
    pub base: Structure,
    /// The model at the end; its modes are those of the linear part.
    pub last: Structure,
    /// The force that was found.
    pub found: Option<FoundForce>,
    /// True if what is left on data never fitted is noise.
    pub explained: bool,
    /// RMS of what the model leaves on data never fitted over that of the noise, or over half a per cent of the motion where the noise
    /// is less.
    pub noises: f64,
    /// What the linear model and the one at the end leave of the data that neither was fitted to; empty where the rest was kept in a
    /// file: see [`Self::redrawn`].
    #[serde(skip)]
    pub unseen: Vec<UnseenRecord>,
}

/// A record, or the end of the only one, that judged and was never fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct UnseenRecord {
    /// The record's name.
    pub name: String,
    /// Sampling interval, s.
    pub interval: f64,
    /// `measured[sensor][sample]`, in the sensors' units.
    pub measured: Vec<Vec<f64>>,
    /// The same of what the linear model leaves.
    pub before: Vec<Vec<f64>>,
    /// The same of what the model with the force leaves; none where no force was found.
    pub after: Option<Vec<Vec<f64>>>,
}

impl StructureDiagnosis {
    /// The verdict's word: as the search for missing effects has it. A force that leaves much is the best of those tried, and
    /// no name.
    pub fn verdict(&self) -> &'static str {
        match &self.found {
            Some(_) if self.noises >= CONSTANTS.mattering() => "unexplained",
            Some(force) if force.rivals.is_empty() => "named",
            Some(_) => "ambiguous",
            None if self.noises < CONSTANTS.mattering() => "nothing_missing",
            None => "unexplained",
        }
    }

    /// True if it was found of these records, used in this way, and from this base.
    pub fn is_of(&self, records: &RecordSet, base: &Base) -> bool {
        let (of, asked) = &self.of;
        asked == base && *of == Found::records_of(records)
    }

    /// The same with what its models leave of the data that they were not fitted to, after it was kept in a file: nothing is
    /// searched for.
    ///
    /// # Errors
    /// The records are others, or cancelled.
    pub fn redrawn(&self, records: &RecordSet, cancel: &Cancel) -> Result<Self, ModesError> {
        let measurement = Measurement::new(records, cancel)?;
        let split = Split::new(&measurement);
        let path = chosen_path(&measurement, &split, &self.poles, 0, cancel)?;
        let noise = noise(&split);
        let chosen = ChosenPoles(&[]);
        let search = ForceSearch { measurement: &measurement, split: &split, path: &path, chosen, fixed: None, noise };
        let after = self.model.as_ref().and_then(|model| search.unseen(model, model.parts(), cancel));
        if cancel.is_cancelled() {
            return Err(ModesError::Cancelled);
        }
        let before = &path.steps[path.chosen].residuals.unseen;
        let unseen = unseen_records(&measurement, &split, before, after.as_ref().map(|a| a.residuals.as_slice()));
        Ok(Self { unseen, ..self.clone() })
    }
}

/// A force beside the linear structure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundForce {
    /// Its kind.
    pub effect: Effect,
    /// Where it acts.
    pub site: Site,
    /// Its parameters.
    pub parameters: Vec<ForceParameter>,
    /// What it drives each mode with, for a unit of the force's shape.
    pub drives: Vec<f64>,
    /// How far it leads its nearest rival.
    pub lead: Lead,
    /// Others that these data do not tell from it.
    pub rivals: Vec<(Effect, Site)>,
    /// What was tried beside it, with the RMS that each leaves on data never fitted, as a share of the sensors' RMS.
    pub tried: Vec<(Effect, Site, f64)>,
}

/// A parameter of a force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForceParameter {
    /// Its symbol.
    pub name: Cow<'static, str>,
    /// Its value; a force is told as the acceleration that it makes at its place.
    pub value: f64,
    /// Its standard error; none where it is not known.
    pub std_error: Option<f64>,
    /// Its unit.
    pub unit: String,
}

/// A candidate fitted to its end.
struct FittedStructure {
    candidate: ForceCandidate,
    model: ClosedModel,
    course: Course,
    residuals: Residuals,
    densities: Vec<f64>,
    error: f64,
}

/// Searches for the force that a linear structure lacks.
///
/// `base` says how many modes the structure has, or from which poles they are fitted: then each stands for one mode, which the force
/// may move, and none is added. `report` hears what is done and its share.
///
/// # Errors
/// As [`super::identify`].
pub fn diagnose(
    records: &RecordSet,
    base: &Base,
    report: &(dyn Fn(&'static str, f64) + Sync),
    cancel: &Cancel,
) -> Result<StructureDiagnosis, ModesError> {
    let measurement = Measurement::new(records, cancel)?;
    let split = Split::new(&measurement);
    report("looking for modes", 0.0);
    let (path, fixed) = if base.poles.is_empty() {
        let request = PathRequest { modes: base.modes, ..PathRequest::default() };
        (path(&measurement, &split, &request, cancel)?, base.modes)
    } else {
        (chosen_path(&measurement, &split, &base.poles, LAST_POLE_STEPS, cancel)?, Some(base.poles.len()))
    };
    let chosen = ChosenPoles(&base.poles);
    let start = if base.poles.is_empty() { &path.steps[path.chosen].poles } else { &base.poles };
    let linear = linear(&measurement, start, cancel)?;
    let linear_error = path.steps[path.chosen].residuals.unseen_rms();
    let noise = noise(&split);
    let of = (Found::records_of(records), base.clone());
    let poles = path.steps[path.chosen].poles.clone();
    let before = &path.steps[path.chosen].residuals.unseen;
    let plain = |explained: bool| StructureDiagnosis {
        of: of.clone(),
        poles: poles.clone(),
        model: None,
        base: structure(&measurement, &linear),
        last: structure(&measurement, &linear),
        found: None,
        explained,
        noises: linear_error / noise,
        unseen: unseen_records(&measurement, &split, before, None),
    };
    if linear_error < CONSTANTS.explaining().0 * noise {
        return Ok(plain(true));
    }
    let search = ForceSearch { measurement: &measurement, split: &split, path: &path, chosen, fixed, noise };
    report("asking which force is missing", 0.05);
    let fitted = search.fitted(report, cancel)?;
    let period = main_period(&split.fitted);
    let chosen = search.chosen(fitted, period);
    let Some((best, lead, rivals, tried)) = chosen else { return Ok(plain(false)) };
    let (error, noise) = (best.error, search.noise_in(&best.residuals.unseen));
    let unseen = unseen_records(&measurement, &split, before, Some(&best.residuals.unseen));
    let model = Some(best.model.clone());
    let (last, found) = search.told(best, lead, rivals, tried);
    Ok(StructureDiagnosis {
        base: structure(&measurement, &linear),
        of,
        poles,
        model,
        last,
        found: Some(found),
        explained: error < EXPLAINS * noise,
        noises: error / noise,
        unseen,
    })
}

/// What two models leave of the data that neither was fitted to, in the sensors' units.
fn unseen_records(
    measurement: &Measurement,
    split: &Split,
    before: &[Vec<Vec<f64>>],
    after: Option<&[Vec<Vec<f64>>]>,
) -> Vec<UnseenRecord> {
    let scaled = |all: &[Vec<f64>]| -> Vec<Vec<f64>> {
        all.iter().zip(&measurement.sensors).map(|(s, sensor)| s.iter().map(|v| v * sensor.scale).collect()).collect()
    };
    let of = |(k, series): (usize, &SensorSeries)| UnseenRecord {
        name: series.name.clone(),
        interval: series.interval,
        measured: scaled(&series.outputs),
        before: scaled(&before[k]),
        after: after.map(|a| scaled(&a[k])),
    };
    split.unseen.iter().enumerate().map(of).collect()
}

/// RMS of the noise over all sensors of the records never fitted, in units of the sensors' RMS.
fn noise(split: &Split) -> f64 {
    noise_of(split.unseen.iter().flat_map(|s| &s.outputs))
}

/// RMS of the noise over several series.
fn noise_of<'a>(series: impl Iterator<Item = &'a Vec<f64>>) -> f64 {
    let all: Vec<f64> = series.filter_map(|y| standard_deviation(y)).collect();
    (all.iter().map(|n| n * n).sum::<f64>() / all.len().max(1) as f64).sqrt().max(LEAST_ERROR)
}

struct ForceSearch<'a> {
    measurement: &'a Measurement,
    split: &'a Split,
    path: &'a Path,
    /// The poles that were chosen by hand.
    chosen: ChosenPoles<'a>,
    fixed: Option<usize>,
    noise: f64,
}

impl ForceSearch<'_> {
    fn linear_error(&self) -> f64 {
        self.path.steps[self.path.chosen].residuals.unseen_rms()
    }

    /// The noise that a residual shows, where it is less than that of the raw series: a force that switches looks like noise there.
    fn noise_in(&self, residuals: &[Vec<Vec<f64>>]) -> f64 {
        noise_of(residuals.iter().flatten()).min(self.noise)
    }
}
