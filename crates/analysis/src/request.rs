//! A study as it is asked for, by the names of its settings.

use crate::error::AnalysisError;
use crate::source::{KindName, PREPARATION, READING, RecordSource};
use sindyscope_core::setting::{Given, Said, Setting, SettingForm, change};
use sindyscope_core::study::{
    Calibration, Formulation, FreeSettings, Lock, SETTINGS, Settings, asks_for_unit_mass, calibration_list,
    force_over_mass, term_lists,
};
use sindyscope_values::record::RecordSet;
use sindyscope_values::term::{EquationEntries, Symbol, Term};

/// What is to be found of the channels with the equation.
pub static CALIBRATION: &[Setting<Vec<Calibration>>] = &[Setting {
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

/// A study as it is asked for: what is left open is chosen from the data.
#[derive(Clone, Debug, Default)]
pub struct AnalysisRequest {
    /// Where the records come from, how they are read and prepared.
    pub source: RecordSource,
    /// The settings that were given.
    pub given: Given<Settings>,
    /// What is to be found of the channels with the equation.
    pub calibrations: Vec<Calibration>,
}

impl AnalysisRequest {
    /// Samples of every held-out record that its initial state is estimated from, if they were given.
    ///
    /// # Errors
    /// Settings that do not go together.
    pub fn initial(&self) -> Result<Option<usize>, AnalysisError> {
        let mut settings = Settings::default();
        self.given.apply(&mut settings).map_err(AnalysisError::Settings)?;
        Ok(settings.initial)
    }
}

/// Reads a text for the setting of that name, if a table has it.
fn said<T>(table: &'static [Setting<T>], name: &str, text: &str) -> Option<Result<Said<T>, AnalysisError>> {
    let setting = table.iter().find(|s| s.name == name || (!s.alias.is_empty() && s.alias == name))?;
    let problem = |problem| AnalysisError::Value { name: setting.name.to_owned(), problem };
    Some(Said::new(setting, text).map_err(problem))
}

/// What was said of the settings of a table, in the table's order: later rows may build on earlier ones.
fn in_order<T>(table: &'static [Setting<T>], mut said: Vec<Said<T>>) -> Given<T> {
    said.sort_by_key(|s| table.iter().position(|row| row.name == s.name()));
    Given::new(said)
}

impl AnalysisRequest {
    /// The names of all settings that [`Self::named`] takes, each with what it does and whether it is a plain flag.
    pub fn names() -> Vec<(&'static str, &'static str, SettingForm)> {
        fn of<T>(table: &'static [Setting<T>]) -> impl Iterator<Item = (&'static str, &'static str, SettingForm)> {
            table.iter().map(|s| (s.name, s.help, s.form))
        }
        of(READING).chain(of(PREPARATION)).chain(of(SETTINGS)).chain(of(CALIBRATION)).collect()
    }

    /// A study that is asked for by names of settings with their texts, as a person writes them: `("window", "31")`. What may be
    /// given several times may stand here several times.
    ///
    /// # Errors
    /// A name that no setting has, or a text that its setting cannot be.
    pub fn named<'a>(pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Self, AnalysisError> {
        let (mut reading, mut preparing, mut given, mut calibrating) = (vec![], vec![], vec![], vec![]);
        for (name, text) in pairs {
            if let Some(found) = said(SETTINGS, name, text) {
                given.push(found?);
            } else if let Some(found) = said(READING, name, text) {
                reading.push(found?);
            } else if let Some(found) = said(PREPARATION, name, text) {
                preparing.push(found?);
            } else if let Some(found) = said(CALIBRATION, name, text) {
                calibrating.push(found?);
            } else {
                let known = Self::names().into_iter().map(|(name, ..)| name).collect::<Vec<_>>().join(", ");
                return Err(AnalysisError::UnknownSetting { name: name.to_owned(), known });
            }
        }
        let mut request = Self { given: in_order(SETTINGS, given), ..Self::default() };
        let source = &mut request.source;
        in_order(READING, reading).apply(&mut source.reading).map_err(AnalysisError::Settings)?;
        in_order(PREPARATION, preparing).apply(&mut source.preparing).map_err(AnalysisError::Settings)?;
        Given::new(calibrating).apply(&mut request.calibrations).map_err(AnalysisError::Settings)?;
        Ok(request)
    }

    /// The settings with what was asked for put over what was suggested.
    ///
    /// # Errors
    /// Settings that do not go together.
    pub fn settings(&self, suggested: &Settings) -> Result<Settings, AnalysisError> {
        let mut settings = Settings { kind: self.source.reading.kind.into(), ..suggested.clone() };
        settings.take(&self.given).map_err(AnalysisError::Settings)?;
        if self.source.reading.kind == KindName::Integral && !self.given.has("form") {
            settings.form = Formulation::Integral;
        }
        Ok(settings)
    }

    /// What is left to be chosen from the data in settings that hold what was asked for. Who gives a smoothing means the
    /// derivatives that it makes; who gives a threshold, the terms that it leaves.
    pub fn free(&self, settings: &Settings) -> FreeSettings {
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
    ///
    /// # Errors
    /// The mass is not known, or the input is no force.
    pub fn fix_force(&self, settings: &mut Settings, records: &RecordSet) -> Result<(), AnalysisError> {
        if !asks_for_unit_mass(&self.given) {
            return Ok(());
        }
        let Some(mass) = settings.mass else {
            return Err(AnalysisError::MassNeeded);
        };
        let coefficient = records.entries.first().and_then(|(record, _)| force_over_mass(record, mass));
        let Some(coefficient) = coefficient else {
            return Err(AnalysisError::ForceNeeded);
        };
        let force = Term::parse("u").map_err(|e| AnalysisError::Settings(e.to_string()))?;
        settings.locks.insert(force, Lock::Fixed(coefficient));
        Ok(())
    }
}

/// A list of terms as an option takes it, for all equations or for each.
#[derive(Clone, Debug, PartialEq)]
pub struct Terms(
    /// Each equation's, or those of all.
    pub Vec<EquationEntries<Term>>,
);

impl Terms {
    /// The list, where it must be one for all equations.
    ///
    /// # Errors
    /// It has lists for single ones.
    pub fn for_all(&self) -> Result<Vec<Term>, AnalysisError> {
        if self.0.iter().any(|part| part.equation.is_some()) {
            return Err(AnalysisError::ListForEach);
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
