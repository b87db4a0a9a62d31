use std::path::PathBuf;

use clap::{ArgMatches, Args, Command, FromArgMatches};

use super::failure::Failure;
use super::modes::BaseOptions;
use super::progress::ProgressLine;
use super::source::SourceOptions;
use super::{CommandResult, component, json, modes, table};
use sindyscope_analysis::json::diagnosed;
use sindyscope_analysis::missing::MAX_EFFECTS;
use sindyscope_analysis::{AnalysisError, KindName, MissingRequest, Terms, effects, search};
use sindyscope_core::setting::Given;
use sindyscope_core::study::{Cancel, Settings, setting};
use sindyscope_report::document;

/// Options of `diagnose`.
#[derive(Debug, Args)]
pub(super) struct DiagnoseOptions {
    #[command(flatten)]
    source: SourceOptions,

    /// Terms of every acceleration of the base model, to which effects are added: "x, v, u" [default: linear springs and dampers]
    #[arg(long, value_name = "LIST", help_heading = "Base model")]
    terms: Option<Terms>,
    #[command(flatten)]
    base: BaseOptions,
    /// Known physics: these terms are in the base model besides
    #[arg(long, value_name = "LIST", help_heading = "Base model")]
    lock: Vec<Terms>,
    /// Most effects that are added, one at a time
    #[arg(long, value_name = "N", default_value_t = MAX_EFFECTS, value_parser = clap::value_parser!(u8).range(..=20))]
    max_effects: u8,
    /// Effects of one's own, looked for beside those of the catalogue: a TOML file with a table for each
    #[arg(long, value_name = "FILE")]
    effects: Option<PathBuf>,

    #[command(flatten)]
    settings: StudySettings,

    /// With --base modes: write the structure and the force that was found to take along, in the form that the name's ending
    /// says: .tex .txt .json .py .m .mo .c; beside a program also the first record's time and inputs (…_input.csv). May be
    /// given several times
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    export: Vec<PathBuf>,

    /// Write the result as JSON (`-`: to standard output, and nothing else there)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    json: Option<PathBuf>,
}

/// Settings of a study that are taken without effect: each with what stands in their place here.
const UNUSED: [(&str, &str); 4] = [
    ("window", "simulated and measured motion are compared without smoothing"),
    ("order", "as --window"),
    ("threshold", "effects are judged by their error on data that were not fitted, not by a threshold"),
    ("ridge", "no coefficient is shrunk"),
];

/// The setting of a study that counts here too.
const INITIAL: &str = "initial";

/// Settings of a study: one that counts, and those that change nothing here.
#[derive(Clone, Debug, Default)]
struct StudySettings {
    given: Given<Settings>,
    initial: Option<usize>,
}

impl Args for StudySettings {
    fn augment_args(command: Command) -> Command {
        let command = command.arg(table::option(setting(INITIAL)));
        UNUSED.iter().fold(command, |command, (name, instead)| {
            let option = table::option(setting(name)).help(format!("Changes nothing here: {instead}"));
            command.arg(option.help_heading("Options of identify that are taken without effect"))
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for StudySettings {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut settings = Settings::default();
        table::given(matches, [setting(INITIAL)]).apply(&mut settings).map_err(table::unfit)?;
        let given = table::given(matches, UNUSED.iter().map(|(name, _)| setting(name)));
        Ok(Self { given, initial: settings.initial })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}

/// Searches for missing effects and prints the walk.
pub(super) fn run(options: &DiagnoseOptions, progress: &ProgressLine) -> CommandResult {
    let source = &options.source.0;
    if source.reading.kind == KindName::FirstOrder {
        return Err(AnalysisError::FirstOrder.into());
    }
    if options.base.is_modes() {
        if options.terms.is_some() || !options.lock.is_empty() {
            return Err(Failure::new("--terms and --lock list terms of a chain of masses: modes have none")
                .try_this("leave them out, or leave out --base modes")
                .into());
        }
        if options.effects.is_some() {
            return Err(Failure::new("--effects lists effects of a chain of masses: modes have none of one's own")
                .try_this("leave it out, or leave out --base modes")
                .into());
        }
        let written = modes::WrittenFiles { json: options.json.as_deref(), export: &options.export };
        return modes::diagnose(source, &options.base, &written, progress);
    }
    if !options.export.is_empty() {
        return Err(Failure::new("diagnose exports structures alone (--base modes)")
            .try_this("add the effect's terms to --terms of identify, which exports equations")
            .into());
    }
    let effects = options.effects.as_deref().map(effects::of_file).transpose()?.unwrap_or_default();
    let DiagnoseOptions { terms, lock, max_effects, settings, .. } = options;
    let request = MissingRequest {
        base: terms.clone(),
        known: lock.clone(),
        max_effects: *max_effects,
        initial: settings.initial,
        effects,
    };
    if source.reading.kind == KindName::Component {
        if !request.effects.is_empty() {
            return Err(Failure::new("--effects lists effects of a mass: components have none of one's own")
                .try_this("leave it out, or leave out --kind component")
                .into());
        }
        return component::diagnose(source, &request, options.json.as_deref(), progress);
    }
    progress.stage("reading");
    let records = source.read()?;
    let diagnosis = search(&request, &records, &Cancel::default(), &|told| progress.show(told))?;
    if let Some(json) = json::write(options.json.as_deref(), &diagnosed(&diagnosis, &records))? {
        return Ok(json);
    }
    let mut text = document::walk(&diagnosis, &records);
    let unused: Vec<String> = UNUSED
        .iter()
        .filter(|(name, _)| options.settings.given.has(name))
        .map(|(name, _)| format!("--{name}"))
        .collect();
    if !unused.is_empty() {
        text.push_str(&format!("{} changed nothing: diagnose neither smooths nor thresholds.\n", unused.join(", ")));
    }
    Ok(text.into_bytes())
}
