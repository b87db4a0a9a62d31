//! The options that ask for a study, and the value that says it with nothing left open.

use std::path::PathBuf;

use clap::error::Error;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, value_parser};

use super::report::DocumentOptions;
use super::source::{self, SourceOptions};
use super::table;
use sindyscope_analysis::request::CALIBRATION;
use sindyscope_analysis::{AnalysisRequest, RecordSource};
use sindyscope_core::prepare::Treatment;
use sindyscope_core::study::{Calibrated, Calibration, SETTINGS, Settings};

/// A study as options ask for it.
#[derive(Clone, Debug, Default)]
pub(super) struct StudyOptions {
    pub(super) request: AnalysisRequest,
    /// Where the result goes as JSON.
    pub(super) json: Option<PathBuf>,
}

impl Args for StudyOptions {
    fn augment_args(command: Command) -> Command {
        let command = table::with_options(SourceOptions::augment_args(command), SETTINGS);
        let json = Arg::new("json").long("json").value_name("FILE").value_parser(value_parser!(PathBuf));
        let json = json.help("Write the result as JSON (`-`: to standard output, and nothing else there)");
        table::with_options(command, CALIBRATION).arg(json.help_heading("Output"))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for StudyOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut calibrations = Vec::new();
        table::given(matches, CALIBRATION).apply(&mut calibrations).map_err(table::unfit)?;
        let SourceOptions(source) = SourceOptions::from_arg_matches(matches)?;
        let request = AnalysisRequest { source, given: table::given(matches, SETTINGS), calibrations };
        Ok(Self { request, json: matches.get_one("json").cloned() })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}

/// A study with nothing left to choose.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StudyRequest {
    pub(super) source: RecordSource,
    pub(super) calibrations: Vec<Calibration>,
    pub(super) settings: Settings,
    /// The document that tells it, if one is asked for.
    pub(super) document: Option<DocumentOptions>,
}

impl StudyRequest {
    /// The study that was done: what was found of the channels is a step of the preparation.
    pub(super) fn done(request: &AnalysisRequest, settings: &Settings, calibrated: &[Calibrated]) -> Self {
        let mut source = request.source.clone();
        source.reading.kind = settings.kind.into();
        let preparing = &mut source.preparing;
        if !source.test.is_empty() {
            preparing.steps.retain(|step| !matches!(step, Treatment::HoldOut { .. }));
        }
        preparing.steps.extend(calibrated.iter().map(Calibrated::treatment));
        Self { source, calibrations: Vec::new(), settings: settings.clone(), document: None }
    }

    /// The words of a shell's command that asks for it, of settings that would be others if nothing were said.
    pub(super) fn command(&self, name: &str, suggested: &Settings) -> String {
        let mut text = format!("sindyscope {name}");
        source::say(&self.source, &mut text);
        table::say(&mut text, SETTINGS, &self.settings, suggested);
        table::say(&mut text, CALIBRATION, &self.calibrations, &Vec::new());
        if let Some(document) = &self.document {
            document.say(&mut text);
        }
        text
    }
}
