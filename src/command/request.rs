//! A study as it is asked for: the options that ask for it, and the value that says it with nothing left open.

use std::path::PathBuf;

use clap::error::Error;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, value_parser};

use super::failure::Failure;
use super::report::DocumentOptions;
use super::source::{KindName, RecordSource};
use super::table;
use sindyscope_core::prepare::Treatment;
use sindyscope_core::setting::{Given, Setting, SettingForm, change};
use sindyscope_core::study::{
    Calibrated, Calibration, Formulation, FreeSettings, Lock, SETTINGS, Settings, asks_for_unit_mass, calibration_list,
    force_over_mass, term_lists,
};
use sindyscope_values::record::RecordSet;
use sindyscope_values::term::{EquationEntries, Symbol, Term};

/// What is to be found of the channels with the equation.
static CALIBRATION: &[Setting<Vec<Calibration>>] = &[Setting {
    name: "estimate",
    group: "Physics",
    help: "Find this with the equation and take it out of the records, fitting the response: how late a channel is, delay(u) \
           or delay(x2); by how much a sensor shows too much, gain(x2)",
    form: SettingForm::Many("LIST"),
    read: |text| {
        let sought = calibration_list(text)?;
        Ok(change(move |all: &mut Vec<Calibration>| all.extend(&sought)))
    },
    write: |all| {
        let texts: Vec<String> = all.iter().map(Calibration::to_string).collect();
        if texts.is_empty() { Vec::new() } else { vec![texts.join(",")] }
    },
    ..Setting::BLANK
}];

/// A study as options ask for it: what they leave open is chosen from the data.
#[derive(Clone, Debug, Default)]
pub(super) struct StudyOptions {
    pub(super) source: RecordSource,
    pub(super) given: Given<Settings>,
    pub(super) calibrations: Vec<Calibration>,
    /// Where the result goes as JSON.
    pub(super) json: Option<PathBuf>,
}

impl StudyOptions {
    /// The settings with what was asked for put over what was suggested.
    pub(super) fn settings(&self, suggested: &Settings) -> Result<Settings, Failure> {
        let mut settings = Settings { kind: self.source.reading.kind.into(), ..suggested.clone() };
        settings.take(&self.given).map_err(Failure::new)?;
        if self.source.reading.kind == KindName::Integral && !self.given.has("form") {
            settings.form = Formulation::Integral;
        }
        Ok(settings)
    }

    /// What is left to be chosen from the data in settings that hold what was asked for. Who gives a smoothing means the
    /// derivatives that it makes; who gives a threshold, the terms that it leaves.
    pub(super) fn free(&self, settings: &Settings) -> FreeSettings {
        let left_out = |name: &str| !self.given.has(name);
        let method = settings.smoothing.method;
        let window = left_out("window") && (method.is_local() || method.is_global());
        let order = left_out("order") && method.is_local();
        let threshold = left_out("threshold");
        let rows = left_out("form") && left_out("half-width") && window && order;
        let form = rows && self.source.reading.kind != KindName::Integral;
        let refine = left_out("refine") && rows && threshold;
        FreeSettings { window, order, threshold, form, refine, terms: left_out("terms") && threshold }
    }

    /// Fixes the force's coefficient where it is asked for that it follows from the mass.
    pub(super) fn fix_force(&self, settings: &mut Settings, records: &RecordSet) -> Result<(), Failure> {
        if !asks_for_unit_mass(&self.given) {
            return Ok(());
        }
        let Some(mass) = settings.mass else {
            return Err(Failure::new("`u=1/m` needs the mass").try_this("say it with --mass KG"));
        };
        let coefficient = records.entries.first().and_then(|(record, _)| force_over_mass(record, mass));
        let Some(coefficient) = coefficient else {
            return Err(Failure::new("`u=1/m` needs one input that is a force in newtons")
                .try_this("give the column a unit, as `u [N]`, or fix the coefficient itself: --fix u=VALUE"));
        };
        let force = Term::parse("u").map_err(|e| Failure::new(e.to_string()))?;
        settings.locks.insert(force, Lock::Fixed(coefficient));
        Ok(())
    }
}

impl Args for StudyOptions {
    fn augment_args(command: Command) -> Command {
        let command = table::with_options(RecordSource::augment_args(command), SETTINGS);
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
        Ok(Self {
            source: RecordSource::from_arg_matches(matches)?,
            given: table::given(matches, SETTINGS),
            calibrations,
            json: matches.get_one("json").cloned(),
        })
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
    pub(super) fn done(options: &StudyOptions, settings: &Settings, calibrated: &[Calibrated]) -> Self {
        let mut source = options.source.clone();
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
        self.source.say(&mut text);
        table::say(&mut text, SETTINGS, &self.settings, suggested);
        table::say(&mut text, CALIBRATION, &self.calibrations, &Vec::new());
        if let Some(document) = &self.document {
            document.say(&mut text);
        }
        text
    }
}

/// A list of terms as an option takes it, for all equations or for each.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Terms(pub(super) Vec<EquationEntries<Term>>);

impl Terms {
    /// The list, where it must be one for all equations.
    ///
    /// # Errors
    /// It has lists for single ones.
    pub(super) fn for_all(&self) -> Result<Vec<Term>, Failure> {
        if self.0.iter().any(|part| part.equation.is_some()) {
            return Err(Failure::new("a list for each equation is not possible here")
                .try_this("give one list for all equations, without `v1:`"));
        }
        Ok(self.0.iter().flat_map(|part| part.entries.iter().cloned()).collect())
    }
}

impl std::str::FromStr for Terms {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        term_lists(text).map(Self)
    }
}

impl std::fmt::Display for Terms {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (k, part) in self.0.iter().enumerate() {
            let list: Vec<&str> = part.entries.iter().map(Term::as_str).collect();
            let equation = match part.equation {
                Some(Symbol::Rate(i)) => format!("v{}: ", i + 1),
                Some(Symbol::State(i)) => format!("x{}: ", i + 1),
                _ => String::new(),
            };
            write!(f, "{}{equation}{}", if k > 0 { "; " } else { "" }, list.join(", "))?;
        }
        Ok(())
    }
}
