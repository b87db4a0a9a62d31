//! Opening: records are read, prepared and given settings to start from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::missing::Walk;
use super::problem::{Problem, file_name};
use super::project::{self, Project};
use super::state::{Edit, Source};
use super::{disk, moved, rig};
use sindyscope_core::prepare::{self, Preparation, PrepareError};
use sindyscope_core::study::{Settings, suggest};
use sindyscope_files::{ReadOptions, read_set};
use sindyscope_rig::hidden::{ExcitationKind, HiddenRequest, draw};
use sindyscope_rig::{Truth, record_rig};
use sindyscope_values::record::{Record, RecordSet, Usage};

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
    /// Which of the source's files are no longer there.
    pub(crate) gone: Vec<PathBuf>,
}

/// Reads what is to be opened.
///
/// # Errors
/// What cannot be opened, and why.
pub(crate) fn open(opening: Opening) -> Result<Opened, Refused> {
    read(&opening).map_err(|problem| {
        let gone = match &opening.source {
            Source::Files(files) => files.iter().filter(|file| !file.exists()).cloned().collect(),
            _ => Vec::new(),
        };
        Refused { opening, problem, gone }
    })
}

fn read(opening: &Opening) -> Result<Opened, Problem> {
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
        if opening.goes_on {
            let what = format!("{} is a project: its records cannot be added to others", file_name(&path));
            return Err(Problem::new(what, "open it by itself"));
        }
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
            let (title, set) = sample.records(&opening.reading).map_err(problem)?;
            Ok(Read { title, set, truth: None })
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
            let hidden = draw(&HiddenRequest::blind(ExcitationKind::Multisine, *seed))
                .map_err(|e| Problem::new(format!("the virtual rig made no records: {e}"), "draw another effect"))?;
            let mut set = RecordSet::new(hidden.fit, Usage::Fit);
            set.add(hidden.held_out, Usage::HeldOut);
            Ok(Read { title: "a hidden effect".into(), set, truth: Some(hidden.truth) })
        }
        Source::Rig(settings) => {
            let run = record_rig(settings)
                .map_err(|e| Problem::new(format!("the virtual rig made no records: {e}"), "change it in its room"))?;
            let set = rig::records(&run);
            Ok(Read { title: "virtual rig".into(), set, truth: Some(run.truth) })
        }
        Source::Round(case) => {
            let hidden = draw(&case.request())
                .map_err(|e| Problem::new(format!("the virtual rig made no records: {e}"), "take another seed"))?;
            Ok(Read { title: "a class's round".into(), set: rig::round(hidden), truth: None })
        }
    }
}
