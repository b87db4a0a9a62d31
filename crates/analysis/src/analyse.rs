//! The study of an [`AnalysisRequest`]: what was left open is chosen from the data, then it is run.

use crate::error::AnalysisError;
use crate::request::AnalysisRequest;
use crate::source::KindName;
use sindyscope_core::prepare::{Preparation, prepare};
use sindyscope_core::study::{Calibrated, Cancel, Horizon, Outcome, Settings, Study, calibrate, choose, suggest};
use sindyscope_values::record::{RecordSet, Usage};

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// This, of which it is not known how far it is.
    Stage(&'static str),
    /// This, and the share of the whole that is done, 0 to 1.
    Share(&'static str, f64),
}

/// Whoever is told of progress, on any thread.
pub type Listener<'a> = &'a (dyn Fn(Progress) + Sync);

/// A study with how its settings came about.
#[derive(Debug)]
pub struct Analysis {
    /// The records as they were used.
    pub records: RecordSet,
    /// What the study found.
    pub outcome: Outcome,
    /// How far free runs predict what was fitted, and what was held out.
    pub horizons: [Option<Horizon>; 2],
    /// How the settings that were not given were chosen.
    pub choice: Option<String>,
    /// What was found of the channels, and taken out of the records.
    pub calibrated: Vec<Calibrated>,
    /// The settings that would be used if nothing were said of them.
    pub suggested: Settings,
}

/// Chooses what was left open, and runs the study of prepared records.
///
/// # Errors
/// Settings that do not fit the records, or nothing to fit; cancelled.
pub fn analyse(
    request: &AnalysisRequest,
    mut records: RecordSet,
    cancel: &Cancel,
    tell: Listener<'_>,
) -> Result<Analysis, AnalysisError> {
    if request.source.reading.kind == KindName::Component {
        return Err(AnalysisError::NoMass);
    }
    let suggested = suggest(&records, request.source.reading.kind.into())?;
    let mut settings = request.settings(&suggested)?;
    request.fix_force(&mut settings, &records)?;
    let free = request.free(&settings);
    let mut choice = None;
    if free.window || free.order || free.threshold {
        let told = |stage, share| tell(Progress::Share(stage, share));
        let chosen = choose(&records, &settings, free, cancel, &told)?;
        settings = chosen.settings;
        choice = Some(chosen.reason);
    }
    let mut calibrated = Vec::new();
    if !request.calibrations.is_empty() {
        tell(Progress::Stage("finding what is asked of the channels"));
        calibrated = calibrate(&records, &settings, &request.calibrations, cancel)?;
        let steps: Vec<Preparation> = calibrated.iter().map(|c| c.treatment().into()).collect();
        records = prepare(&records, &steps).map_err(AnalysisError::Calibrate)?;
        settings.refine = true;
    }
    tell(Progress::Stage(if settings.refine { "fitting the response" } else { "fitting and simulating" }));
    let mut study = Study::default();
    let outcome = study.run(&records, &settings, cancel)?;
    tell(Progress::Stage("asking how long the equation predicts"));
    let horizon = |usage: Usage| study.horizon(&outcome, usage, cancel);
    let horizons = [horizon(Usage::Fit)?, horizon(Usage::HeldOut)?];
    Ok(Analysis { records, outcome, horizons, choice, calibrated, suggested })
}
