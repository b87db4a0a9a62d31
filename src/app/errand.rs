//! Work that takes its time and is not a study: reading files, choosing settings.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::missing::Walk;
use super::project::{self, Project};
use super::state::{Edit, Sample, Source};
use super::{disk, moved, rig};
use sindyscope_core::prepare::{self, Preparation, PrepareError};
use sindyscope_core::study::{
    Calibrated, Calibration, Cancel, Chosen, Free, Settings, StudyError, calibrate, choose, suggest,
};
use sindyscope_files::{ReadOptions, read_set, read_text};
use sindyscope_rig::hidden::{Request, Shaking, Truth, draw};
use sindyscope_rig::record_rig;
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::{Kind, list};

/// What to do.
#[derive(Debug)]
pub(crate) enum Errand {
    /// Read records and find settings to start from.
    Open(Box<Opening>),
    /// Choose settings by simulation error.
    Choose { generation: u64, records: RecordSet, settings: Settings },
    /// Find what a step of the preparation takes out of a channel, with the equation.
    Calibrate { generation: u64, records: RecordSet, settings: Settings, step: usize, sought: Calibration },
}

/// What to open, and what is known about it already.
#[derive(Clone, Debug, Default)]
pub(crate) struct Opening {
    pub(crate) source: Source,
    pub(crate) reading: ReadOptions,
    /// How files of the same folder were read before, where `reading` says nothing.
    pub(crate) folder: Option<ReadOptions>,
    /// Settings and usages that belong to it, from the last time.
    pub(crate) edit: Option<Edit>,
    /// The usages to keep where `edit` has none or other records, by the records' names.
    pub(crate) usage: BTreeMap<String, Usage>,
    /// What is done to the records, where `edit` does not say.
    pub(crate) steps: Vec<Preparation>,
    /// What its files held the last time, in their order.
    pub(crate) checksums: Vec<String>,
    /// Files that are no longer where they were, each with where a person found it.
    pub(crate) moved: Vec<(PathBuf, PathBuf)>,
    /// True if the study that is open goes on, with more or other records.
    pub(crate) goes_on: bool,
    /// The records as they were read, if they need not be read again.
    pub(crate) read: Option<Read>,
    /// True if the settings are the program's own choice and follow it.
    pub(crate) follows: bool,
    /// Sampling interval that lengths in the settings count in, s, if they are to last as long at another.
    pub(crate) interval: Option<f64>,
}

impl Opening {
    /// A source of which nothing else is known.
    pub(crate) fn of(source: Source) -> Self {
        Self { source, ..Self::default() }
    }
}

/// What was brought back.
#[derive(Debug)]
pub(crate) enum Delivery {
    /// Records to put on the bench.
    Opened(Box<Opened>),
    /// They cannot be opened.
    NotOpened(Box<Refused>),
    /// Settings were chosen.
    Chosen { generation: u64, choice: Result<Box<Chosen>, StudyError> },
    /// What is still to be taken out of a channel by a step of the preparation.
    Calibrated { generation: u64, step: usize, found: Result<Calibrated, StudyError> },
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
    /// The records as they were measured, before any step.
    pub(crate) raw: RecordSet,
    /// Why a step was not done, for each of them.
    pub(crate) undone: Vec<Option<PrepareError>>,
    pub(crate) edit: Edit,
    pub(crate) suggestion: Settings,
    pub(crate) project: Option<(PathBuf, Project)>,
    /// What the files hold, in the order of the source.
    pub(crate) checksums: Vec<String>,
    /// What is good to know: files that were found elsewhere, or that changed.
    pub(crate) notes: Vec<String>,
    pub(crate) goes_on: bool,
    /// The source as it was asked for: its files may have been found elsewhere.
    pub(crate) asked: Source,
    /// True if the settings are those of an earlier time.
    pub(crate) remembered: bool,
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
    /// Whether saying which column is which may help.
    pub(crate) about_columns: bool,
    /// The file that is not where it was.
    pub(crate) missing: Option<PathBuf>,
}

impl Problem {
    /// What is wrong, and what to try.
    pub(crate) fn new(what: impl Into<String>, advice: impl Into<String>) -> Self {
        Self { what: what.into(), advice: advice.into(), about_columns: false, missing: None }
    }

    /// Why a file cannot be read.
    pub(crate) fn reading(error: &sindyscope_files::ReadError) -> Self {
        let about_columns = error.is_about_columns();
        let advice = error.advice();
        // Options of the command line help nobody in a window.
        let advice = match advice.contains("`--") {
            true => "say which column is which, or give the sampling rate, under “Choose the columns…”".to_owned(),
            false => advice,
        };
        Self { about_columns, ..Self::new(error.to_string(), advice) }
    }
}

/// Does an errand; nothing comes back if it was cancelled.
pub(crate) fn run(errand: Errand, cancel: &Cancel, progress: &(dyn Fn(f64) + Sync)) -> Option<Delivery> {
    let delivery = match errand {
        Errand::Open(opening) => match open(&opening) {
            Ok(opened) => Delivery::Opened(Box::new(opened)),
            Err(problem) => Delivery::NotOpened(Box::new(Refused { opening: *opening, problem })),
        },
        Errand::Choose { generation, records, settings } => {
            let free = Free { window: true, order: true, threshold: true, form: true, refine: true };
            let choice = choose(&records, &settings, free, cancel, progress);
            Delivery::Chosen { generation, choice: choice.map(Box::new) }
        }
        Errand::Calibrate { generation, records, settings, step, sought } => {
            let found = calibrate(&records, &settings, &[sought], cancel).map(|found| found[0]);
            Delivery::Calibrated { generation, step, found }
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
    let (mut opening, asked) = (opening.clone(), opening.source.clone());
    let remembered = opening.edit.is_some();
    let mut read = None;
    let project = match &opening.source {
        Source::Files(paths) => paths.iter().find(|p| project::is_project(p)).cloned(),
        _ => None,
    };
    let mut known = moved::Known::default();
    if let Source::Files(files) = &opening.source {
        known.checksums = files.iter().cloned().zip(opening.checksums.iter().cloned()).collect();
    }
    if let Some(path) = project {
        let project = Project::load(&path)?;
        opening.source = project.source.clone();
        opening.reading = project.reading.clone();
        opening.usage = project.usage.clone();
        opening.edit = None;
        known.checksums = project.checksums.clone();
        known.folder = path.parent().map(Path::to_owned);
        read = Some((path, project));
    }
    let (mut checksums, mut notes) = (Vec::new(), Vec::new());
    if let Source::Files(files) = &mut opening.source {
        known.moved.clone_from(&opening.moved);
        moved::find(files, &known, &mut notes)?;
        // A file that vanishes now is told by the reader.
        checksums = files.iter().map(|file| disk::checksum(file).unwrap_or_default()).collect();
    }
    let steps = match (&read, &opening.edit) {
        (Some((_, project)), _) => project.steps.clone(),
        (None, Some(edit)) => edit.steps.clone(),
        (None, None) => opening.steps.clone(),
    };
    opening.reading.bridge = prepare::bridged(&steps);
    let Read { title, set: raw, truth } = match opening.read.take() {
        Some(read) => read,
        None => match as_the_folder(&opening) {
            Some((reading, read)) => {
                notes.push(format!("Read as the last files of this folder: {}; Columns… changes it", reading.columns));
                opening.reading = reading;
                read
            }
            None => records(&opening)?,
        },
    };
    let steps = prepare::settled(&raw, &steps);
    let (set, undone) = prepare::prepare_leniently(&raw, &steps);
    let records: Vec<Arc<Record>> = set.entries.iter().map(|(record, _)| Arc::clone(record)).collect();
    let edit = opening.edit.as_ref();
    let usage: Vec<Usage> = match edit.filter(|e| e.usage.len() == records.len()) {
        Some(edit) => edit.usage.clone(),
        None => {
            let named = |(record, own): &(Arc<Record>, Usage)| opening.usage.get(&record.name).copied().unwrap_or(*own);
            set.entries.iter().map(named).collect()
        }
    };
    // Settings are suggested from everything that may be fitted, also where nothing is.
    let all = RecordSet { entries: records.iter().map(|r| (Arc::clone(r), Usage::Fit)).collect() };
    let wanted = RecordSet { entries: records.iter().cloned().zip(usage.iter().copied()).collect() };
    let suggestion = suggest(&wanted, opening.reading.kind)
        .or_else(|_| suggest(&all, opening.reading.kind))
        .map_err(|e| Problem::new(e.to_string(), ""))?;
    let settings = match (&read, edit) {
        (Some((_, project)), _) => project.settings.clone(),
        (None, Some(_)) if opening.follows => suggestion.clone(),
        (None, Some(edit)) => lasting(&edit.settings, opening.interval, records.first()),
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
    let report = match (&read, edit) {
        (Some((_, project)), _) => project.report.clone(),
        (None, edit) => edit.map(|e| e.report.clone()).unwrap_or_default(),
    };
    let edit = Edit { settings, usage, steps, walk, report };
    let Opening { source, reading, goes_on, .. } = opening;
    let title = read.as_ref().map_or(title, |(path, _)| file_name(path));
    Ok(Opened {
        source,
        reading,
        title,
        records,
        raw,
        undone,
        remembered: read.is_none() && edit.settings != suggestion && remembered,
        edit,
        suggestion,
        project: read,
        checksums,
        notes,
        goes_on,
        asked,
        truth,
    })
}

/// Settings whose segment lasts as long as it did at another sampling interval.
fn lasting(settings: &Settings, interval: Option<f64>, record: Option<&Arc<Record>>) -> Settings {
    let mut settings = settings.clone();
    if let (Some(old), Some(new)) = (interval, record.map(|r| r.interval))
        && (old / new - 1.0).abs() > 1e-9
    {
        let least = settings.smoothing.order + 2;
        let window = ((settings.smoothing.window as f64 * old / new).round() as usize).max(least);
        settings.smoothing = settings.smoothing.with_window(window | 1);
    }
    settings
}

/// What a source holds.
#[derive(Clone, Debug)]
pub(crate) struct Read {
    pub(crate) title: String,
    pub(crate) set: RecordSet,
    pub(crate) truth: Option<Truth>,
}

/// Reads files as others of their folder were read before, if that is known and fits.
fn as_the_folder(opening: &Opening) -> Option<(ReadOptions, Read)> {
    let folder = opening.folder.as_ref()?;
    let reading = ReadOptions { kind: opening.reading.kind, bridge: opening.reading.bridge, ..folder.clone() };
    // Numbers of columns fit every file: a header that speaks for itself goes before them.
    if !folder.columns.names_all() && records(opening).is_ok() {
        return None;
    }
    let read = records(&Opening { reading: reading.clone(), ..opening.clone() }).ok()?;
    Some((reading, read))
}

/// Reads what a source names.
fn records(opening: &Opening) -> Result<Read, Problem> {
    let problem = |e: sindyscope_files::ReadError| Problem::reading(&e);
    match &opening.source {
        Source::Nothing => Err(Problem::new("there is nothing to open", "")),
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
            let hidden = draw(&Request::blind(Shaking::Multisine, *seed))
                .map_err(|e| Problem::new(format!("the virtual rig made no records: {e}"), "draw another effect"))?;
            let mut set = RecordSet::new(hidden.fit, Usage::Fit);
            set.add(hidden.held_out, Usage::HeldOut);
            Ok(Read { title: "a hidden effect".into(), set, truth: Some(hidden.truth) })
        }
        Source::Rig(settings) => {
            let run = record_rig(settings)
                .map_err(|e| Problem::new(format!("the virtual rig made no records: {e}"), "change it in its room"))?;
            let set = rig::records(&run);
            Ok(Read { title: "virtual rig".into(), set, truth: Some(run.truth.told) })
        }
        Source::Round(case) => {
            let hidden = draw(&case.request())
                .map_err(|e| Problem::new(format!("the virtual rig made no records: {e}"), "take another seed"))?;
            Ok(Read { title: "a class's round".into(), set: rig::round(hidden), truth: None })
        }
    }
}

/// A path's last part.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
