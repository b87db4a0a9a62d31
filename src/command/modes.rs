//! Structures by their modes: the base that `identify` and `diagnose` take with `--base modes`.

use std::path::{Path, PathBuf};

use super::failure::Failure;
use super::progress::ProgressLine;

use super::{CommandResult, json, table};
use clap::{ArgMatches, Args, Command, FromArgMatches};
use sindyscope_analysis::RecordSource;
use sindyscope_analysis::json::structure::{diagnosed, identified};
use sindyscope_core::clock::Stopwatch;
use sindyscope_core::study::Cancel;
use sindyscope_files::positions_in;
use sindyscope_modes::{BASE, Base, BaseModel};
use sindyscope_report::document::{ModesReport, Paper};
use sindyscope_report::export::{ExportFormat, StateSpace};
use sindyscope_report::modal::{diagnosis_text, modes_text};
use sindyscope_values::record::RecordSet;

/// Which base model is asked for.
#[derive(Clone, Debug, Default)]
pub(super) struct BaseOptions(pub(super) Base);

impl BaseOptions {
    /// True if the base are modes.
    pub(super) fn is_modes(&self) -> bool {
        self.0.model == BaseModel::Modes
    }
}

impl Args for BaseOptions {
    fn augment_args(command: Command) -> Command {
        table::with_options(command, BASE)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for BaseOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut base = Base::default();
        table::given(matches, BASE).apply(&mut base).map_err(table::unfit)?;
        for (given, option) in [
            (base.modes.is_some(), "--modes"),
            (!base.poles.is_empty(), "--poles"),
            (!base.positions.is_empty(), "--positions"),
        ] {
            if given && base.model != BaseModel::Modes {
                return Err(table::unfit(format!("{option} needs --base modes")));
            }
        }
        if base.modes.is_some() && !base.poles.is_empty() {
            return Err(table::unfit("--poles says the number of modes too: leave --modes out".into()));
        }
        Ok(Self(base))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}

/// What a command writes beside the text that it prints.
pub(super) struct WrittenFiles<'a> {
    pub(super) json: Option<&'a Path>,
    /// The model, each in the form of its ending.
    pub(super) export: &'a [PathBuf],
}

impl WrittenFiles<'_> {
    /// Refuses endings that stand for no form, before the work is done.
    fn endings(&self) -> Result<(), Failure> {
        self.export.iter().try_for_each(|path| ExportFormat::of(path).map(|_| ()).map_err(Failure::from))
    }

    /// Exports a structure and writes the JSON; the JSON where it goes to standard output. A form that cannot hold the model takes
    /// nothing from the others.
    fn write(
        &self,
        space: &StateSpace<'_>,
        records: &RecordSet,
        result: &serde_json::Value,
    ) -> Result<Option<Vec<u8>>, Failure> {
        let refused: Vec<_> = self.export.iter().filter_map(|path| space.write(records, path).err()).collect();
        let json = json::write(self.json, result)?;
        refused.into_iter().next().map_or(Ok(json), |first| Err(Failure::from(first)))
    }
}

/// The base with the positions that the first record's file tells.
fn placed(base: &Base, records: &RecordSet) -> Base {
    let file = records.entries.first().and_then(|(record, _)| record.source.as_deref());
    base.clone().placed(file.and_then(positions_in).as_deref())
}

/// What a document about modes is, beside what it tells.
pub(super) struct ReportShape<'a> {
    pub(super) title: &'a str,
    /// The command that makes it again.
    pub(super) command: &'a str,
    pub(super) paper: Paper,
    pub(super) out: &'a Path,
}

/// Writes a document about a structure's modes, with what they lack if that is asked for.
pub(super) fn report(
    source: &RecordSource,
    base: &Base,
    diagnose: bool,
    shape: &ReportShape<'_>,
    json: Option<&Path>,
    progress: &ProgressLine,
) -> CommandResult {
    progress.stage("reading");
    let records = source.read()?;
    let tell = |what: &'static str, share: f64| progress.share(what, share);
    let watch = Stopwatch::start();
    let base = &placed(base, &records);
    let analysis = sindyscope_modes::analyse(&records, base, &tell, &Cancel::default()).map_err(Failure::from)?;
    let fit = watch.milliseconds();
    let search = || sindyscope_modes::diagnose(&records, base, &tell, &Cancel::default()).map_err(Failure::from);
    let diagnosis = diagnose.then(search).transpose()?;
    progress.stage("drawing");
    let &ReportShape { title, command, paper, out } = shape;
    let (analysis, diagnosis) = (&analysis, diagnosis.as_ref());
    let report = ModesReport { title, analysis, diagnosis, command: Some(command), paper };
    report.write(out).map_err(Failure::from)?;
    let mut result = identified(&analysis.structure, &records, fit);
    if let Some(diagnosis) = diagnosis {
        result["diagnosis"] = diagnosed(diagnosis, &records, watch.milliseconds());
    }
    let json = json::write(json, &result)?;
    Ok(json.unwrap_or_else(|| format!("wrote {}\n", out.display()).into_bytes()))
}

/// Identifies a structure and prints it.
pub(super) fn identify(
    source: &RecordSource,
    base: &BaseOptions,
    written: &WrittenFiles<'_>,
    progress: &ProgressLine,
) -> CommandResult {
    written.endings()?;
    progress.stage("reading");
    let records = source.read()?;
    progress.stage("looking for modes");
    let watch = Stopwatch::start();
    let found = sindyscope_modes::identify(&records, &base.0, &Cancel::default()).map_err(Failure::from)?;
    let fit = watch.milliseconds();
    let json = written.write(&StateSpace::new(&found, None), &records, &identified(&found, &records, fit))?;
    Ok(json.unwrap_or_else(|| modes_text(&found).into_bytes()))
}

/// Searches for the force that a structure lacks and prints what was found.
pub(super) fn diagnose(
    source: &RecordSource,
    base: &BaseOptions,
    written: &WrittenFiles<'_>,
    progress: &ProgressLine,
) -> CommandResult {
    written.endings()?;
    progress.stage("reading");
    let records = source.read()?;
    let watch = Stopwatch::start();
    let tell = |what: &'static str, share: f64| progress.share(what, share);
    let found = sindyscope_modes::diagnose(&records, &base.0, &tell, &Cancel::default()).map_err(Failure::from)?;
    let elapsed = watch.milliseconds();
    let space = StateSpace::new(&found.last, found.found.as_ref());
    let json = written.write(&space, &records, &diagnosed(&found, &records, elapsed))?;
    Ok(json.unwrap_or_else(|| diagnosis_text(&found).into_bytes()))
}
