use super::failure::Failure;
use super::progress::ProgressLine;
use super::request::{StudyOptions, StudyRequest};
use sindyscope_core::prepare::{Preparation, prepare};
use sindyscope_core::study::{Calibrated, Cancel, Horizon, Outcome, Settings, Study, calibrate, choose, suggest};
use sindyscope_values::record::{RecordSet, Usage};

/// A study with how its settings came about.
pub(super) struct Analysis {
    pub(super) records: RecordSet,
    pub(super) outcome: Outcome,
    /// How far free runs predict what was fitted, and what was held out.
    pub(super) horizons: [Option<Horizon>; 2],
    /// How the settings that were not given were chosen.
    pub(super) choice: Option<String>,
    /// What was found of the channels, and taken out of the records.
    pub(super) calibrated: Vec<Calibrated>,
    /// The study that was done, with nothing left to choose or to find.
    pub(super) done: StudyRequest,
    /// The settings that would be used if nothing were said of them.
    pub(super) suggested: Settings,
}

/// Reads the records, chooses what was left open, and runs the study.
pub(super) fn analyse(options: &StudyOptions, progress: &ProgressLine) -> Result<Analysis, Failure> {
    progress.stage("reading");
    let mut records = options.source.read()?;
    let cancel = Cancel::default();
    let suggested = suggest(&records, options.source.reading.kind.into())?;
    let mut settings = options.settings(&suggested)?;
    options.fix_force(&mut settings, &records)?;
    let free = options.free(&settings);
    let mut choice = None;
    if free.window || free.order || free.threshold {
        let chosen = choose(&records, &settings, free, &cancel, &|stage, share| progress.share(stage, share))?;
        settings = chosen.settings;
        choice = Some(chosen.reason);
    }
    let mut calibrated = Vec::new();
    if !options.calibrations.is_empty() {
        progress.stage("finding what is asked of the channels");
        calibrated = calibrate(&records, &settings, &options.calibrations, &cancel)?;
        let steps: Vec<Preparation> = calibrated.iter().map(|c| c.treatment().into()).collect();
        records = prepare(&records, &steps).map_err(|e| Failure::new(e.to_string()))?;
        settings.refine = true;
    }
    progress.stage(if settings.refine { "fitting the response" } else { "fitting and simulating" });
    let mut study = Study::default();
    let outcome = study.run(&records, &settings, &cancel)?;
    progress.stage("asking how long the equation predicts");
    let horizon = |usage: Usage| study.horizon(&outcome, usage, &cancel);
    let horizons = [horizon(Usage::Fit)?, horizon(Usage::HeldOut)?];
    let done = StudyRequest::done(options, &outcome.settings, &calibrated);
    Ok(Analysis { records, outcome, horizons, choice, calibrated, done, suggested })
}
