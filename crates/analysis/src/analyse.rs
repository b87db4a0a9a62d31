//! The study of an [`AnalysisRequest`]: what was left open is chosen from the data, then it is run.

use crate::error::AnalysisError;
use crate::request::AnalysisRequest;
use crate::source::KindName;
use sindyscope_core::prepare::{Preparation, prepare};
use sindyscope_core::study::{Calibrated, Cancel, Horizon, Outcome, Settings, Study, calibrate, choose, suggest};
use sindyscope_values::record::{RecordSet, Usage};

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AnalysisProgress {
    /// This, of which it is not known how far it is.
    Stage(&'static str),
    /// This, and the share of the whole that is done, 0 to 1.
    Share(&'static str, f64),
}

/// Whoever is told of progress, on any thread.
pub type AnalysisListener<'a> = &'a (dyn Fn(AnalysisProgress) + Sync);

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

/// Settings with nothing left open.
#[derive(Clone, Debug)]
pub(crate) struct ResolvedSettings {
    pub(crate) settings: Settings,
    /// How those that were not given were chosen.
    pub(crate) choice: Option<String>,
    /// The settings that would be used if nothing were said of them.
    pub(crate) suggested: Settings,
}

/// Chooses what was left open; for a stream, which has no response to fit and no other form, with those as they are given.
pub(crate) fn chosen(
    request: &AnalysisRequest,
    records: &RecordSet,
    streamed: bool,
    cancel: &Cancel,
    tell: AnalysisListener<'_>,
) -> Result<ResolvedSettings, AnalysisError> {
    if request.source.reading.kind == KindName::Component {
        return Err(AnalysisError::NoMass);
    }
    let suggested = suggest(records, request.source.reading.kind.into())?;
    let mut settings = request.settings(&suggested)?;
    request.fix_force(&mut settings, records)?;
    let mut free = request.free(&settings);
    if streamed {
        (free.form, free.refine) = (false, false);
    }
    let mut choice = None;
    if free.window || free.order || free.threshold {
        let told = |stage, share| tell(AnalysisProgress::Share(stage, share));
        let found = choose(records, &settings, free, cancel, &told)?;
        settings = found.settings;
        choice = Some(found.reason);
    }
    Ok(ResolvedSettings { settings, choice, suggested })
}

/// Chooses what was left open, and runs the study of prepared records.
///
/// # Errors
/// Settings that do not fit the records, or nothing to fit; cancelled.
pub fn analyse(
    request: &AnalysisRequest,
    mut records: RecordSet,
    cancel: &Cancel,
    tell: AnalysisListener<'_>,
) -> Result<Analysis, AnalysisError> {
    let ResolvedSettings { mut settings, choice, suggested } = chosen(request, &records, false, cancel, tell)?;
    let mut calibrated = Vec::new();
    if !request.calibrations.is_empty() {
        tell(AnalysisProgress::Stage("finding what is asked of the channels"));
        calibrated = calibrate(&records, &settings, &request.calibrations, cancel)?;
        let steps: Vec<Preparation> = calibrated.iter().map(|c| c.treatment().into()).collect();
        records = prepare(&records, &steps).map_err(AnalysisError::Calibrate)?;
        settings.refine = true;
    }
    tell(AnalysisProgress::Stage(if settings.refine { "fitting the response" } else { "fitting and simulating" }));
    let mut study = Study::default();
    let outcome = study.run(&records, &settings, cancel)?;
    tell(AnalysisProgress::Stage("asking how long the equation predicts"));
    let horizon = |usage: Usage| study.horizon(&outcome, usage, cancel);
    let horizons = [horizon(Usage::Fit)?, horizon(Usage::HeldOut)?];
    Ok(Analysis { records, outcome, horizons, choice, calibrated, suggested })
}
