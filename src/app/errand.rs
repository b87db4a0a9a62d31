//! Work that takes its time and is not a study: reading files, choosing settings.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::missing::Walk;
use super::project::{self, Project};
use super::state::{Edit, Sample, Source};
use crate::record::{ReadOptions, Record, RecordSet, Usage, read_set, read_text};
use crate::rig::hidden::{Request, Shaking, Truth, draw};
use crate::study::{Cancel, Choice, Free, Settings, StudyError, choose, suggest};
use crate::term::{Kind, list};

/// What to do.
#[derive(Debug)]
pub(crate) enum Errand {
    /// Read records and find settings to start from.
    Open(Opening),
    /// Choose settings by simulation error.
    Choose { generation: u64, records: RecordSet, settings: Settings },
}

/// What to open, and what is known about it already.
#[derive(Clone, Debug)]
pub(crate) struct Opening {
    pub(crate) source: Source,
    pub(crate) reading: ReadOptions,
    /// Settings and usages that belong to it, from the last time.
    pub(crate) edit: Option<Edit>,
    /// The usages to keep, if there are as many records as usages.
    pub(crate) usage: Vec<Usage>,
}

/// What was brought back.
#[derive(Debug)]
pub(crate) enum Delivery {
    /// Records to put on the bench.
    Opened(Box<Opened>),
    /// They cannot be opened.
    NotOpened(Box<Refused>),
    /// Settings were chosen.
    Chosen { generation: u64, choice: Result<Box<Choice>, StudyError> },
    /// The work itself failed.
    Crashed,
}

/// What was opened.
#[derive(Debug)]
pub(crate) struct Opened {
    pub(crate) source: Source,
    pub(crate) reading: ReadOptions,
    pub(crate) title: String,
    pub(crate) records: Vec<Arc<Record>>,
    pub(crate) edit: Edit,
    pub(crate) suggestion: Settings,
    pub(crate) project: Option<(PathBuf, Project)>,
    /// What the records hide, if the virtual rig made them blind.
    pub(crate) truth: Option<Truth>,
}

/// What cannot be opened, and why.
#[derive(Clone, Debug)]
pub(crate) struct Refused {
    pub(crate) opening: Opening,
    pub(crate) problem: Problem,
}

/// Why something cannot be opened, and what to try.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Problem {
    pub(crate) what: String,
    pub(crate) advice: String,
    /// The file's columns, where saying which is which would help.
    pub(crate) columns: Vec<String>,
}

/// Does an errand; nothing comes back if it was cancelled.
pub(crate) fn run(errand: Errand, cancel: &Cancel, progress: &(dyn Fn(f64) + Sync)) -> Option<Delivery> {
    let delivery = match errand {
        Errand::Open(opening) => match open(&opening) {
            Ok(opened) => Delivery::Opened(Box::new(opened)),
            Err(problem) => Delivery::NotOpened(Box::new(Refused { opening, problem })),
        },
        Errand::Choose { generation, records, settings } => {
            let free = Free { window: true, order: true, threshold: true, form: true, refine: true };
            let choice = choose(&records, &settings, free, cancel, progress);
            Delivery::Chosen { generation, choice: choice.map(Box::new) }
        }
    };
    (!cancel.is_cancelled()).then_some(delivery)
}

/// A file of `sample_data/`, by its name.
type Bundled = (&'static str, &'static [u8]);

/// What of a sample is held out.
enum HeldOut {
    /// Another file.
    File(Bundled),
    /// The record from this time on, s.
    From(f64),
}

/// The library and threshold of the lesson in `sample_data/README.md`.
const OVERFIT_LIBRARY: &str = "x, v, u, x^2, x^3, x^5, x^7, 1";
const OVERFIT_THRESHOLD: f64 = 0.01;

macro_rules! bundled {
    ($name:literal) => {
        ($name, include_bytes!(concat!("../../sample_data/", $name)).as_slice())
    };
}

impl Sample {
    /// Every sample, the one shown first in front.
    pub(crate) const ALL: [Self; 4] = [Self::Duffing, Self::Friction, Self::Lorenz, Self::Overfit];

    /// What it is, in two or three words.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Duffing => "Duffing oscillator",
            Self::Friction => "Dry friction",
            Self::Lorenz => "Lorenz system",
            Self::Overfit => "An overfit",
        }
    }

    /// What it is, in one sentence.
    pub(crate) fn tooltip(self) -> &'static str {
        match self {
            Self::Duffing => {
                "A mass on a hardening spring under a harmonic force, measured with noise; the last part is held out"
            }
            Self::Friction => {
                "A mass with dry friction on a shaken base, at four frequencies, and at a fifth that is held out"
            }
            Self::Lorenz => "Three states of a chaotic system, every one measured: equations of first order",
            Self::Overfit => {
                "A lesson: with powers in the library that the motion is too small for, the fit is good and fails at four times the force"
            }
        }
    }

    /// The file to fit, and what is held out.
    fn files(self) -> (Bundled, HeldOut) {
        match self {
            Self::Duffing => (bundled!("duffing_noisy.csv"), HeldOut::From(50.0)),
            Self::Friction => (bundled!("friction_noisy.csv"), HeldOut::File(bundled!("friction_noisy_test.csv"))),
            Self::Lorenz => (bundled!("lorenz.csv"), HeldOut::From(7.0)),
            Self::Overfit => (bundled!("overfit.csv"), HeldOut::File(bundled!("overfit_test.csv"))),
        }
    }

    /// Order of its equations.
    pub(crate) fn kind(self) -> Kind {
        match self {
            Self::Duffing | Self::Friction | Self::Overfit => Kind::SecondOrder,
            Self::Lorenz => Kind::FirstOrder,
        }
    }

    /// The settings that it opens with, where they are other than what the program suggests.
    fn settings(self, suggestion: &Settings) -> Settings {
        let mut settings = suggestion.clone();
        if self == Self::Overfit
            && let Ok(terms) = list(OVERFIT_LIBRARY)
        {
            (settings.terms, settings.threshold) = (terms, OVERFIT_THRESHOLD);
        }
        settings
    }
}

fn open(opening: &Opening) -> Result<Opened, Problem> {
    let mut opening = opening.clone();
    let mut read = None;
    let project = match &opening.source {
        Source::Files(paths) => paths.iter().find(|p| project::is_project(p)).cloned(),
        _ => None,
    };
    if let Some(path) = project {
        let project = Project::load(&path)?;
        opening.source = project.source.clone();
        opening.reading = project.reading.clone();
        opening.edit = None;
        read = Some((path, project));
    }
    let Read { title, set, truth } = records(&opening)?;
    let records: Vec<Arc<Record>> = set.entries.iter().map(|(record, _)| Arc::clone(record)).collect();
    let edit = opening.edit.as_ref().filter(|e| e.usage.len() == records.len());
    let mut usage: Vec<Usage> = match (edit, opening.usage.len() == records.len()) {
        (Some(edit), _) => edit.usage.clone(),
        (None, true) => opening.usage.clone(),
        (None, false) => set.entries.iter().map(|(_, usage)| *usage).collect(),
    };
    if let Some((_, project)) = &read {
        for (record, usage) in records.iter().zip(&mut usage) {
            *usage = project.usage.get(&record.name).copied().unwrap_or(*usage);
        }
    }
    // Settings are suggested from everything that may be fitted, also where nothing is.
    let all = RecordSet { entries: records.iter().map(|r| (Arc::clone(r), Usage::Fit)).collect() };
    let wanted = RecordSet { entries: records.iter().cloned().zip(usage.iter().copied()).collect() };
    let suggestion = suggest(&wanted, opening.reading.kind)
        .or_else(|_| suggest(&all, opening.reading.kind))
        .map_err(|e| Problem { what: e.to_string(), advice: String::new(), columns: Vec::new() })?;
    let settings = match (&read, edit) {
        (Some((_, project)), _) => project.settings.clone(),
        (None, Some(edit)) => edit.settings.clone(),
        (None, None) => match opening.source {
            Source::Sample(sample) => sample.settings(&suggestion),
            _ => suggestion.clone(),
        },
    };
    let walk = match (&read, edit) {
        (Some((_, project)), _) => project.walk.clone(),
        (None, Some(edit)) => edit.walk.clone(),
        (None, None) => Walk::default(),
    };
    let edit = Edit { settings, usage, walk };
    let Opening { source, reading, .. } = opening;
    let title = read.as_ref().map_or(title, |(path, _)| file_name(path));
    Ok(Opened { source, reading, title, records, edit, suggestion, project: read, truth })
}

/// What a source holds.
struct Read {
    title: String,
    set: RecordSet,
    truth: Option<Truth>,
}

/// Reads what a source names.
fn records(opening: &Opening) -> Result<Read, Problem> {
    let problem = |e: crate::record::ReadError| Problem {
        what: e.to_string(),
        advice: e.advice(),
        columns: e.columns().unwrap_or_default().to_vec(),
    };
    match &opening.source {
        Source::Nothing => {
            Err(Problem { what: "there is nothing to open".into(), advice: String::new(), columns: Vec::new() })
        }
        Source::Sample(sample) => {
            let (fitted, held_out) = sample.files();
            let mut set = RecordSet::default();
            let read = |(name, bytes): Bundled| read_text(name, bytes, &opening.reading).map_err(problem);
            let records = read(fitted)?;
            match held_out {
                HeldOut::File(file) => {
                    set.add(records, Usage::Fit);
                    set.add(read(file)?, Usage::HeldOut);
                }
                HeldOut::From(time) => {
                    for record in records {
                        let (mut first, mut last) = record.split_at(time);
                        first.name = format!("up to {time} s");
                        last.name = format!("from {time} s");
                        set.add([first], Usage::Fit);
                        set.add([last], Usage::HeldOut);
                    }
                }
            }
            Ok(Read { title: fitted.0.to_owned(), set, truth: None })
        }
        Source::Files(paths) => {
            let set = read_set(paths, &[], &opening.reading).map_err(problem)?;
            let title = match paths.as_slice() {
                [one] => file_name(one),
                [one, rest @ ..] => format!("{} and {} more", file_name(one), rest.len()),
                [] => String::new(),
            };
            Ok(Read { title, set, truth: None })
        }
        Source::Hidden(seed) => {
            let hidden = draw(&Request::blind(Shaking::Multisine, *seed)).map_err(|e| Problem {
                what: format!("the virtual rig made no records: {e}"),
                advice: "draw another effect".into(),
                columns: Vec::new(),
            })?;
            let mut set = RecordSet::new(hidden.fit, Usage::Fit);
            set.add(hidden.held_out, Usage::HeldOut);
            Ok(Read { title: "a hidden effect".into(), set, truth: Some(hidden.truth) })
        }
    }
}

/// A path's last part.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
