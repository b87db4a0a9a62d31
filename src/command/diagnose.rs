use std::path::PathBuf;

use clap::{ArgMatches, Args, Command, FromArgMatches};

use super::failure::Failure;
use super::modes::BaseOptions;
use super::progress::ProgressLine;
use super::request::Terms;
use super::source::{KindName, RecordSource};
use super::{CommandResult, diagnosed, json, modes, table};
use sindyscope_core::setting::Given;
use sindyscope_core::study::{Cancel, Settings, setting};
use sindyscope_report::document;
use sindyscope_search::{Ask, Diagnosis, Search};
use sindyscope_values::model::Units;
use sindyscope_values::record::RecordSet;
use sindyscope_values::term::{Kind, Term};

/// Most effects that are added unless told otherwise.
pub(super) const MAX_EFFECTS: u8 = 3;

/// Options of `diagnose`.
#[derive(Debug, Args)]
pub(super) struct DiagnoseOptions {
    #[command(flatten)]
    source: RecordSource,

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

    #[command(flatten)]
    unused: Unused,

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

/// Options of `identify` that change nothing here.
#[derive(Clone, Debug, Default)]
struct Unused(Given<Settings>);

impl Args for Unused {
    fn augment_args(command: Command) -> Command {
        UNUSED.iter().fold(command, |command, (name, instead)| {
            let option = table::option(setting(name)).help(format!("Changes nothing here: {instead}"));
            command.arg(option.help_heading("Options of identify that are taken without effect"))
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Unused {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self(table::given(matches, UNUSED.iter().map(|(name, _)| setting(name)))))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}

/// Searches for missing effects and prints the walk.
pub(super) fn run(options: &DiagnoseOptions, progress: &ProgressLine) -> CommandResult {
    if options.source.reading.kind == KindName::FirstOrder {
        return Err(first_order().into());
    }
    if options.base.is_modes() {
        return modes::diagnose(&options.source, options.base, options.json.as_deref(), progress);
    }
    progress.stage("reading");
    let records = options.source.read()?;
    let base = options.terms.as_ref();
    let diagnosis = search(&records, base, &options.lock, options.max_effects, progress)?;
    if let Some(json) = json::write(options.json.as_deref(), &diagnosed::result(&diagnosis, &records))? {
        return Ok(json);
    }
    let mut text = document::walk(&diagnosis, &records);
    let unused: Vec<String> =
        UNUSED.iter().filter(|(name, _)| options.unused.0.has(name)).map(|(name, _)| format!("--{name}")).collect();
    if !unused.is_empty() {
        text.push_str(&format!("{} changed nothing: diagnose neither smooths nor thresholds.\n", unused.join(", ")));
    }
    Ok(text.into_bytes())
}

/// Said where missing effects are to be searched in first-order data.
pub(super) fn first_order() -> Failure {
    Failure::new(
        "missing effects are searched in equations of second order: of a displacement, whose velocity is derived",
    )
    .try_this("leave out --kind first-order and give the displacement alone, with --columns x=NAME")
}

/// Walks through the records on its own.
pub(super) fn search(
    records: &RecordSet,
    base: Option<&Terms>,
    known: &[Terms],
    max_effects: u8,
    progress: &ProgressLine,
) -> Result<Diagnosis, Failure> {
    let lists: Vec<Vec<Term>> = known.iter().map(Terms::for_all).collect::<Result<_, _>>()?;
    let mut ask = Ask { known: lists.concat(), max_effects: usize::from(max_effects), ..Ask::default() };
    for part in base.iter().flat_map(|terms| &terms.0) {
        let list = match part.freedom(Kind::SecondOrder).map_err(Failure::new)? {
            None => ask.base.get_or_insert_default(),
            Some(mass) => ask.own.entry(mass).or_default(),
        };
        list.extend(part.entries.iter().cloned());
    }
    progress.stage("looking at the records");
    let search = Search::new(records, &ask)?;
    if let Some((record, _)) = records.entries.first() {
        let layout = record.layout(Kind::SecondOrder);
        let units = Units::from_record(record, &layout);
        search.base_terms().try_for_each(|t| units.check(t, &layout)).map_err(Failure::new)?;
    }
    let tell = |progressed: sindyscope_search::Progress| {
        if let sindyscope_search::Progress::Step(what, share) = progressed {
            progress.share(what, share);
        }
    };
    Ok(search.diagnose(&tell, &Cancel::default())?)
}
