use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use clap::{ArgMatches, Args, Command, FromArgMatches, ValueEnum};

use super::failure::Failure;
use super::identify;
use super::progress::ProgressLine;
use super::request::{StudyOptions, StudyRequest};
use super::source::{self, typed};
use super::{CommandResult, component, json, modes, series, table};
use sindyscope_analysis::json::{diagnosed, identified};
use sindyscope_analysis::missing::MAX_EFFECTS;
use sindyscope_analysis::series::is_series_table;
use sindyscope_analysis::{AnalysisError, KindName, MissingRequest, Terms, effects, search};
use sindyscope_core::setting::Setting;
use sindyscope_core::study::{Cancel, SETTINGS};
use sindyscope_modes::{BASE, Base, BaseModel};
use sindyscope_report::document::{Arrangement, DocumentFormat, Paper, Report, Sections};

/// Bytes of a file that are looked at to know a table that a batch wrote: more than the heads of all its columns take.
const HEAD: u64 = 1 << 20;

/// Options of `report`.
#[derive(Debug, Args)]
pub(super) struct ReportOptions {
    #[command(flatten)]
    pub(super) study: StudyOptions,
    #[command(flatten)]
    pub(super) document: DocumentOptions,
}

/// What a report is asked for beside the study that it tells.
#[derive(Clone, Debug, PartialEq, Args)]
pub(super) struct DocumentOptions {
    // First: it looks at others, which are taken out as they are read.
    #[command(flatten)]
    pub(super) poles: PoleOptions,
    /// The document to write: .html (self-contained), .pdf (pages, fonts embedded) or .png, by the ending
    #[arg(long, value_name = "FILE")]
    pub(super) out: PathBuf,
    /// Search for missing effects too, as `diagnose` does, and write the walk into the document
    #[arg(long, help_heading = "Missing effects")]
    pub(super) diagnose: bool,
    /// `modes`: the report is of a structure's modes; else the terms of the base model of that search [default: a linear spring
    /// and damper]
    #[arg(long, value_name = "LIST", help_heading = "Missing effects")]
    pub(super) base: Option<ReportBase>,
    /// Most effects that it adds
    #[arg(long, value_name = "N", default_value_t = MAX_EFFECTS, value_parser = clap::value_parser!(u8).range(..=20), requires = "diagnose", help_heading = "Missing effects")]
    pub(super) max_effects: u8,
    /// Effects of one's own that it looks for besides: a TOML file with a table for each
    #[arg(long, value_name = "FILE", requires = "diagnose", help_heading = "Missing effects")]
    pub(super) effects: Option<PathBuf>,
    /// The data are a table that `batch` wrote, and the report is of it as a series over this column: amplitude, temperature, time [default:
    /// the order of such a table]
    #[arg(long, value_name = "COLUMN", help_heading = "Output")]
    pub(super) over: Option<String>,
    /// Its title [default: the names of the files]
    #[arg(long, value_name = "TEXT", help_heading = "Output")]
    pub(super) title: Option<String>,
    /// Its sections, in this order: "equation, parameters, response, spectrum"; a wrong name lists them all [default: all]
    #[arg(long, value_name = "LIST", help_heading = "Output")]
    pub(super) sections: Option<Sections>,
    /// The paper of a PDF
    #[arg(long, value_enum, value_name = "SIZE", default_value_t, help_heading = "Output")]
    pub(super) paper: PaperName,
}

/// How many modes, or from which poles: for a command whose option `--base` says more than the base model.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct PoleOptions(pub(super) Base);

/// The settings of the base model without the one that says which it is.
fn pole_settings() -> &'static [Setting<Base>] {
    BASE.get(1..).unwrap_or_default()
}

impl Args for PoleOptions {
    fn augment_args(command: Command) -> Command {
        table::with_options(command, pole_settings())
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for PoleOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut base = Base::default();
        table::given(matches, pole_settings()).apply(&mut base).map_err(table::unfit)?;
        match matches.get_one("base") {
            Some(ReportBase::Terms(_)) if !matches.get_flag("diagnose") => Err(table::unfit(
                "--base with terms is the base of the search for missing effects: give --diagnose too".into(),
            )),
            Some(ReportBase::Terms(_)) | None if base != Base::default() => {
                Err(table::unfit("--modes and --poles need --base modes".into()))
            }
            _ => Ok(Self(base)),
        }
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}

/// What a report's equations are made of.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ReportBase {
    /// Modes.
    Modes,
    /// The terms from which the search for missing effects starts.
    Terms(Terms),
}

impl std::str::FromStr for ReportBase {
    type Err = <Terms as std::str::FromStr>::Err;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text.trim() == "modes" { Ok(Self::Modes) } else { text.parse().map(Self::Terms) }
    }
}

/// A sheet of paper, by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum PaperName {
    /// 210 mm × 297 mm
    #[default]
    A4,
    /// 8.5 in × 11 in
    Letter,
}

impl From<PaperName> for Paper {
    fn from(name: PaperName) -> Self {
        match name {
            PaperName::A4 => Self::A4,
            PaperName::Letter => Self::Letter,
        }
    }
}

/// Identifies and writes the document.
pub(super) fn run(options: &ReportOptions, progress: &ProgressLine) -> CommandResult {
    let ReportOptions { study: StudyOptions { request, json }, document } = options;
    // Said before the work is done, not after.
    DocumentFormat::of(&document.out).map_err(Failure::from)?;
    #[cfg(feature = "desktop")]
    if let [project] = request.source.data.as_slice()
        && project.is_file()
        && crate::app::is_project(project)
    {
        return of_project(options, project, progress);
    }
    if document.over.is_some() || is_table(&request.source.data) {
        return of_series(options);
    }
    if document.base == Some(ReportBase::Modes) {
        return of_modes(options, progress);
    }
    if request.source.reading.kind == KindName::Component {
        if document.sections.is_some() || document.effects.is_some() {
            return Err(Failure::new(
                "the report about a component has sections of its own, and knows no effects of one's own",
            )
            .try_this("leave out --sections and --effects")
            .into());
        }
        let missing =
            MissingRequest { base: document.terms(), max_effects: document.max_effects, ..MissingRequest::default() };
        let title = document.title.clone().unwrap_or_else(|| title(&request.source.data));
        let shape = (title.as_str(), document.paper.into(), document.out.as_path());
        let missing = document.diagnose.then_some(&missing);
        return component::report(request, missing, shape, json.as_deref(), progress);
    }
    if document.diagnose && request.source.reading.kind == KindName::FirstOrder {
        return Err(AnalysisError::FirstOrder.into());
    }
    let own = document.effects.as_deref().map(effects::of_file).transpose()?.unwrap_or_default();
    let analysis = identify::study(request, progress)?;
    let diagnosis = match document.diagnose {
        true => {
            let (base, max_effects) = (document.terms(), document.max_effects);
            let initial = analysis.outcome.settings.initial;
            let missing = MissingRequest { base, known: Vec::new(), max_effects, initial, effects: own };
            Some(search(&missing, &analysis.records, &Cancel::default(), &|told| progress.show(told))?)
        }
        false => None,
    };
    let done = StudyRequest::done(request, &analysis.outcome.settings, &analysis.calibrated);
    let command = StudyRequest { document: Some(document.clone()), ..done };
    let command = command.command("report", &analysis.suggested);
    let title = document.title.clone().unwrap_or_else(|| title(&request.source.data));
    let arrangement = document.arrangement();
    let report = Report {
        title: &title,
        records: &analysis.records,
        outcome: &analysis.outcome,
        choice: analysis.choice.as_deref(),
        command: Some(&command),
        diagnosis: diagnosis.as_ref(),
        arrangement: &arrangement,
    };
    progress.stage("drawing");
    report.write(&document.out).map_err(Failure::from)?;
    let mut result = identified(&analysis);
    if let Some(diagnosis) = &diagnosis {
        result["diagnosis"] = diagnosed(diagnosis, &analysis.records);
    }
    let json = json::write(json.as_deref(), &result)?;
    Ok(json.unwrap_or_else(|| format!("wrote {}\n", document.out.display()).into_bytes()))
}

impl DocumentOptions {
    /// The terms from which the search for missing effects starts, if they are given.
    fn terms(&self) -> Option<Terms> {
        match &self.base {
            Some(ReportBase::Terms(terms)) => Some(terms.clone()),
            Some(ReportBase::Modes) | None => None,
        }
    }

    /// The base as the window and the other commands have it.
    fn modes(&self) -> Base {
        let model = if self.base == Some(ReportBase::Modes) { BaseModel::Modes } else { BaseModel::Chain };
        Base { model, ..self.poles.0.clone() }
    }

    /// What the document holds.
    fn arrangement(&self) -> Arrangement {
        let arrangement = self.sections.as_ref().map_or_else(Arrangement::default, |s| Arrangement::of(&s.0));
        Arrangement { paper: self.paper.into(), ..arrangement }
    }

    /// Says all of it, as words of a shell's command.
    pub(super) fn say(&self, text: &mut String) {
        let here = std::env::current_dir().unwrap_or_default();
        text.push_str(&format!(" --out {}", typed(&here, &self.out)));
        let base = self.modes();
        if base.model == BaseModel::Modes {
            table::say(text, BASE, &base, &Base::default());
        }
        if self.diagnose {
            text.push_str(" --diagnose");
            if let Some(terms) = self.terms() {
                text.push_str(&table::valued("base", &terms.to_string()));
            }
            if self.max_effects != MAX_EFFECTS {
                text.push_str(&format!(" --max-effects {}", self.max_effects));
            }
            if let Some(effects) = &self.effects {
                text.push_str(&format!(" --effects {}", typed(&here, effects)));
            }
        }
        if let Some(over) = &self.over {
            text.push_str(&table::valued("over", over));
        }
        if let Some(title) = &self.title {
            text.push_str(&table::valued("title", title));
        }
        if let Some(sections) = &self.sections {
            text.push_str(&table::valued("sections", &sections.to_string()));
        }
        if self.paper != PaperName::default() {
            text.push_str(" --paper letter");
        }
    }
}

/// Writes the report of a structure's modes.
fn of_modes(options: &ReportOptions, progress: &ProgressLine) -> CommandResult {
    let ReportOptions { study: StudyOptions { request, json }, document } = options;
    if let Some(name) = SETTINGS.iter().map(|s| s.name).find(|name| request.given.has(name)) {
        return Err(Failure::new(format!("--{name} says how a chain of masses is identified, not modes"))
            .try_this("leave it out, or leave out --base modes")
            .into());
    }
    if document.sections.is_some() || document.effects.is_some() {
        return Err(Failure::new("the report about modes has sections of its own, and knows no effects of one's own")
            .try_this("leave out --sections and --effects")
            .into());
    }
    let mut command = "sindyscope report".to_owned();
    source::say(&request.source, &mut command);
    document.say(&mut command);
    let title = document.title.clone().unwrap_or_else(|| title(&request.source.data));
    let shape =
        modes::ReportShape { title: &title, command: &command, paper: document.paper.into(), out: &document.out };
    modes::report(&request.source, &document.modes(), document.diagnose, &shape, json.as_deref(), progress)
}

/// True if the data are a table that a batch wrote.
fn is_table(data: &[PathBuf]) -> bool {
    let [table] = data else { return false };
    // The head is enough; measurements may be large.
    let mut head = Vec::new();
    let read = File::open(table).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.is_ok() && is_series_table(table, &head)
}

/// Writes the report of a table as a series.
fn of_series(options: &ReportOptions) -> CommandResult {
    let ReportOptions { study: StudyOptions { request, json }, document } = options;
    let [table] = request.source.data.as_slice() else {
        return Err(Failure::new("a series is one table")
            .try_this("give the table that `sindyscope batch` wrote, and no other file")
            .into());
    };
    let DocumentOptions { out, over, title: own, paper, .. } = document;
    let mut heard = vec!["sindyscope".into(), "report".into(), table.as_os_str().to_owned()];
    let said = [("--out", Some(out.as_os_str())), ("--over", over.as_deref().map(OsStr::new))];
    let also = [("--title", own.as_deref().map(OsStr::new)), ("--json", json.as_deref().map(Path::as_os_str))];
    for (name, value) in said.into_iter().chain(also) {
        // Joined, so that a value that begins with a minus is no option.
        heard.extend(value.map(|value| [OsStr::new(name), OsStr::new("="), value].into_iter().collect::<OsString>()));
    }
    if *paper == PaperName::Letter {
        heard.extend(["--paper".into(), "letter".into()]);
    }
    if !is_all(options, heard) {
        return Err(Failure::new("the report of a series takes --out, --over, --title, --paper and --json alone")
            .try_this("give other options to `sindyscope batch`, which identifies the records")
            .into());
    }
    let mut command = "sindyscope report".to_owned();
    source::say(&request.source, &mut command);
    document.say(&mut command);
    let title = own.clone().unwrap_or_else(|| title(&request.source.data));
    series::report((table, over.as_deref()), (&title, &command), ((*paper).into(), out), json.as_deref())
}

/// True if these words of a command line say all that was asked for.
fn is_all(options: &ReportOptions, words: Vec<OsString>) -> bool {
    use clap::Parser as _;

    let plain = super::Cli::try_parse_from(words).map(|cli| cli.command);
    matches!(plain, Ok(Some(super::Command::Report(plain))) if format!("{plain:?}") == format!("{options:?}"))
}

/// Writes the report of a saved project: its records, settings, walk and contents.
#[cfg(feature = "desktop")]
fn of_project(options: &ReportOptions, project: &Path, progress: &ProgressLine) -> CommandResult {
    // A project brings its own settings; what else was given would go unheard.
    let file = |path: &Path| path.as_os_str().to_owned();
    let alone = vec!["sindyscope".into(), "report".into(), file(project), "--out".into(), file(&options.document.out)];
    if !is_all(options, alone) {
        return Err(Failure::new("a project brings its own settings and contents; no further option goes with it")
            .try_this("change them in the window, or give the measurements themselves")
            .into());
    }
    let here = std::env::current_dir().unwrap_or_default();
    let command = format!("sindyscope report {} --out {}", typed(&here, project), typed(&here, &options.document.out));
    progress.stage("reading and fitting");
    let content = crate::app::report_of_project(project, &command)
        .map_err(|problem| Failure::new(problem.what).try_this(problem.advice))?;
    progress.stage("drawing");
    content.write(&options.document.out).map_err(Failure::from)?;
    Ok(format!("wrote {}\n", options.document.out.display()).into_bytes())
}

/// The names of the files, without folders and endings.
fn title(files: &[PathBuf]) -> String {
    const NAMED: usize = 3;
    let names: Vec<_> = files.iter().filter_map(|f| f.file_stem()).map(|s| s.to_string_lossy()).collect();
    match names.len() {
        0..=NAMED => names.join(", "),
        n => format!("{} and {} more", names[..NAMED - 1].join(", "), n + 1 - NAMED),
    }
}
