//! The model to take along: a document, data, or a program that computes its response by itself.
//!
//! One list of formats ([`ExportFormat`]), one file a language. The programs share one reading of the model (`switched`) and one
//! method: between the instants at which a sign changes the equations are smooth and are integrated as such; the instants
//! are located, and a surface that the motion cannot leave is held by the sign between −1 and 1 that keeps it at zero.
//! Inputs between their samples are the spline of degree 7 that [`simulate`](sindyscope_core::simulate) uses, so the responses agree.

mod c;
mod head;
mod json;
mod latex;
mod matlab;
mod modelica;
mod python;
mod space;
mod switched;
mod text;

use std::ffi::OsStr;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use sindyscope_core::simulate::{SimulateError, Simulator};
use sindyscope_core::study::{Outcome, RecordOutcome};
use sindyscope_values::model::{Model, Units};
use sindyscope_values::record::Role;
use sindyscope_values::term::Symbol;
pub use space::StateSpace;
use switched::Switched;

/// What makes a format.
struct FormatEntry {
    /// The ending of its files.
    ending: &'static str,
    /// Its name.
    name: &'static str,
    /// Whether the file computes a response, and so needs times and inputs.
    runs: bool,
    /// Whether it can hold a model that sticks or switches.
    switches: bool,
    /// The text of a file, whose name without its ending comes last.
    write: fn(&Export<'_>, &Switched, &str) -> String,
}

/// Declares [`ExportFormat`] from the list of formats.
macro_rules! formats {
    ($($(#[$meta:meta])* $name:ident => $entry:path,)*) => {
        /// The forms in which a model is taken along.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum ExportFormat {
            $($(#[$meta])* $name,)*
        }

        impl ExportFormat {
            /// Every format.
            pub const ALL: [Self; [$(stringify!($name)),*].len()] = [$(Self::$name,)*];

            fn entry(self) -> &'static FormatEntry {
                match self {
                    $(Self::$name => &$entry,)*
                }
            }
        }
    };
}

formats! {
    /// A small LaTeX document.
    Latex => latex::FORMAT,
    /// Plain text.
    Text => text::FORMAT,
    /// Data for scripts.
    Json => json::FORMAT,
    /// A Python program (NumPy, SciPy).
    Python => python::FORMAT,
    /// A MATLAB function.
    Matlab => matlab::FORMAT,
    /// A Modelica model.
    Modelica => modelica::FORMAT,
    /// A C program.
    C => c::FORMAT,
}

impl ExportFormat {
    /// The ending of its files.
    pub fn ending(self) -> &'static str {
        self.entry().ending
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// The format that a file's ending asks for.
    ///
    /// # Errors
    /// An ending that stands for none, or no ending.
    pub fn of(path: &Path) -> Result<Self, ExportError> {
        let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
        let found = Self::ALL.into_iter().find(|f| f.ending() == ending);
        found.ok_or_else(|| ExportError::Ending(path.display().to_string()))
    }

    /// The endings of all formats, for a sentence.
    pub fn endings() -> String {
        Self::ALL.map(|f| format!(".{}", f.ending())).join(" ")
    }

    /// Whether the file computes a response, and so needs times and inputs.
    pub fn runs(self) -> bool {
        self.entry().runs
    }
}

/// Why a model was not exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A file's ending that stands for no format.
    #[error("{0} does not say in which form the model is to be exported: its name must end in one of {endings}", endings = ExportFormat::endings())]
    Ending(String),
    /// The model cannot be simulated, so no program can.
    #[error("the model cannot be exported: {0}")]
    Model(#[from] SimulateError),
    /// A coefficient is not a number.
    #[error("the model cannot be exported: the coefficient of {0} is not a finite number")]
    Coefficient(String),
    /// The form cannot hold a model that sticks or switches.
    #[error("a model with dry friction, stops or other switches cannot be exported to {0}, but to .py and .c it can")]
    Switches(&'static str),
    /// The file could not be written.
    #[error("cannot write {path}: {source}")]
    Write {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
}

/// The state that a response begins with.
#[derive(Clone, Debug, PartialEq)]
pub struct StartState {
    /// The record that it was fitted to.
    pub record: String,
    /// The state at the record's first sample.
    pub state: Vec<f64>,
    /// Largest magnitude of each state in the response.
    pub reach: Vec<f64>,
}

/// A model with what a reader of its export needs to know.
#[derive(Clone, Debug)]
pub struct Export<'a> {
    model: &'a Model,
    units: Units,
    starts: Vec<StartState>,
    /// The inputs' names in the records.
    inputs: Vec<String>,
    /// The matrices of a structure, where the model is one of modes.
    space: Option<&'a StateSpace<'a>>,
}

impl<'a> Export<'a> {
    /// An export of a model that starts from rest unless [`Self::starting`] says otherwise.
    pub fn new(model: &'a Model, units: Units) -> Self {
        Self { model, units, starts: Vec::new(), inputs: Vec::new(), space: None }
    }

    /// With initial states; the first is that of the exported programs.
    #[must_use]
    pub fn starting(mut self, starts: Vec<StartState>) -> Self {
        self.starts = starts;
        self
    }

    /// The export of what a study found.
    pub fn of(outcome: &'a Outcome) -> Self {
        let starts = outcome.records.iter().filter_map(|record| {
            let state: Option<Vec<f64>> = record.states.iter().map(|s| s.first().copied()).collect();
            let reach = record.states.iter().map(|s| s.iter().fold(0.0_f64, |m, x| m.max(x.abs()))).collect();
            Some(StartState { record: record.record.name.clone(), state: state?, reach })
        });
        let mut export = Self::new(&outcome.model, outcome.units()).starting(starts.collect());
        if let Some(first) = outcome.records.first() {
            let name = |j: usize| first.record.channel(Role::Input(j)).map_or(String::new(), |c| c.name.clone());
            export.inputs = (0..outcome.model.layout.inputs).map(name).collect();
        }
        export
    }

    /// The text of a file; `stem` is the file's name without its ending.
    ///
    /// # Errors
    /// A model that cannot be simulated, or that switches where the form has no events for it; a coefficient that is not a
    /// number.
    pub fn text(&self, format: ExportFormat, stem: &str) -> Result<String, ExportError> {
        Simulator::new(self.model)?;
        let weighted = self.model.equations.iter().flat_map(|e| &e.terms);
        if let Some(term) = weighted.into_iter().find(|t| !t.coefficient.is_finite()) {
            return Err(ExportError::Coefficient(term.term.text(&self.model.layout)));
        }
        let switched = Switched::new(&*self.model.explicit().map_err(SimulateError::from)?);
        if !format.entry().switches && !switched.surfaces.is_empty() {
            return Err(ExportError::Switches(format.name()));
        }
        Ok((format.entry().write)(self, &switched, stem))
    }

    /// The names of the states.
    fn state_names(&self) -> Vec<String> {
        let layout = &self.model.layout;
        let plain = || layout.state_symbols().map(|s| layout.name(s)).collect();
        self.space.map_or_else(plain, StateSpace::state_names)
    }

    /// The names of what sensors show, which programs write after the states; none where the states are what is measured.
    fn output_names(&self) -> Vec<String> {
        self.space.map_or_else(Vec::new, StateSpace::output_names)
    }

    /// The state that the programs start from.
    fn initial(&self) -> Vec<f64> {
        let states = self.model.layout.states();
        let mut state = self.starts.first().map_or_else(Vec::new, |s| s.state.clone());
        state.resize(states, 0.0);
        // A response that diverged at once has no number to start from.
        state.iter_mut().filter(|x| !x.is_finite()).for_each(|x| *x = 0.0);
        state
    }

    /// What each state's error is held against.
    fn scale(&self) -> Vec<f64> {
        let reach = self.starts.first().map_or(&[][..], |s| &s.reach);
        let usable = |r: f64| r.is_finite() && r > 0.0;
        (0..self.model.layout.states()).map(|i| reach.get(i).copied().filter(|r| usable(*r)).unwrap_or(1.0)).collect()
    }

    /// The header names that a program takes for an input, or for its derivative, best first.
    fn header_names(&self, symbol: Symbol) -> Vec<String> {
        let index = match symbol {
            Symbol::Input(j) | Symbol::InputRate(j) => j,
            _ => 0,
        };
        let stem = if matches!(symbol, Symbol::InputRate(_)) { "du" } else { "u" };
        let mut names = vec![format!("{stem}{}", index + 1)];
        if index == 0 {
            names.push(stem.into());
        }
        if let (Symbol::Input(j), 1) = (symbol, self.model.layout.inputs) {
            names.extend(["input", "base", "force", "f"].map(String::from));
            // The programs compare first words, as the reading of records does.
            let own = self.inputs.get(j).map(|n| n.to_lowercase()).unwrap_or_default();
            let own: String = own.trim().chars().take_while(char::is_ascii_alphanumeric).collect();
            if !own.is_empty() && !names.contains(&own) {
                names.push(own);
            }
        }
        names
    }
}

/// Time and inputs of a record as they drove its simulation, as CSV that the exported programs read.
pub fn drive(record: &RecordOutcome) -> String {
    let inputs = record.signals.inputs.len();
    let several = |stem: &str, j: usize| if inputs > 1 { format!("{stem}{}", j + 1) } else { stem.to_owned() };
    let mut names = vec!["t".to_owned()];
    names.extend((0..inputs).map(|j| several("u", j)));
    let measured: Vec<&[f64]> =
        (0..inputs).filter_map(|j| record.record.channel(Role::Input(j))).map(|c| &*c.values).collect();
    let columns: Vec<&[f64]> = if record.driven_as_measured && measured.len() == inputs {
        measured
    } else {
        names.extend((0..inputs).map(|j| several("du", j)));
        record.signals.inputs.iter().map(Vec::as_slice).chain(record.signals.input_rates()).collect()
    };
    let mut out = names.join(",");
    out.push('\n');
    for k in 0..record.record.len() {
        let _ = write!(out, "{:?}", record.record.time(k));
        for column in &columns {
            let _ = write!(out, ",{:?}", column[k]);
        }
        out.push('\n');
    }
    out
}

/// Writes a model in the form that the file's ending asks for; beside a program also the first record's time and inputs,
/// `…_input.csv`. Hands back the files written.
///
/// # Errors
/// An ending that stands for no format, a model that cannot be simulated, a file that cannot be written.
pub fn write(outcome: &Outcome, path: &Path) -> Result<Vec<PathBuf>, ExportError> {
    let format = ExportFormat::of(path)?;
    let stem = stem(path);
    let save = |path: &Path, text: String| {
        sindyscope_system::fs::write(path, text)
            .map_err(|source| ExportError::Write { path: path.display().to_string(), source })
    };
    save(path, Export::of(outcome).text(format, &stem)?)?;
    let mut written = vec![path.to_owned()];
    if let (true, Some(record)) = (format.runs(), outcome.records.first()) {
        let input = path.with_file_name(input_file(&stem));
        save(&input, drive(record))?;
        written.push(input);
    }
    Ok(written)
}

/// The name of the file of times and inputs that lies beside a program.
fn input_file(stem: &str) -> String {
    format!("{stem}_input.csv")
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "model".to_owned(), |s| s.to_string_lossy().into_owned())
}

/// A name that every language takes for a function or a model: letters, digits and underscores, a letter in front.
fn identifier(stem: &str) -> String {
    let name: String = stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("model_{name}") }
}
