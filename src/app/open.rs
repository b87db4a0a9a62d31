//! Opening: records are read, prepared and given settings to start from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::disk::{Files, checksum};
use super::problem::{OpeningProblem, file_name};
use super::project::{Project, is_project};
use super::records::Read;
use super::rig::sets;
use super::state::{Document, RigState, Shown, Source};
use super::{moved, moved::KnownFiles};
use sindyscope_analysis::series::is_series_table;
use sindyscope_core::prepare::{self, PrepareError};
use sindyscope_core::study::{Cancel, Settings, suggest};
use sindyscope_files::{MeasuredFile, ReadOptions, read_opened};
use sindyscope_rig::hidden::{ExcitationKind, HiddenRequest, draw};
use sindyscope_rig::record_rig;
use sindyscope_values::record::{Record, RecordSet, Usage};

/// What to open, and what is known about it already.
#[derive(Clone, Debug, Default)]
pub(crate) struct Opening {
    /// Its source, and what was decided about it. Settings that say nothing are suggested.
    pub(crate) document: Document,
    /// How files of the same folder were read before, where the document does not say.
    pub(crate) folder: Option<ReadOptions>,
    /// The usages to keep where the document has none or other records, by the records' names.
    pub(crate) usage: BTreeMap<String, Usage>,
    /// Files that are no longer where they were, each with where a person found it.
    pub(crate) moved: Vec<(PathBuf, PathBuf)>,
    /// True if the study that is open goes on, with more or other records.
    pub(crate) goes_on: bool,
    /// The records as they were read, if they need not be read again.
    pub(crate) read: Option<Read>,
    /// Sampling interval that lengths in the settings count in, s, if they are to last as long at another.
    pub(crate) interval: Option<f64>,
}

impl Opening {
    /// A source of which nothing else is known.
    pub(crate) fn of(source: Source) -> Self {
        Self { document: Document::of(source), ..Self::default() }
    }
}

/// What was opened.
#[derive(Debug)]
pub(crate) struct Opened {
    /// The document, with a usage for each record and with settings.
    pub(crate) document: Document,
    /// The records, prepared.
    pub(crate) records: Vec<Arc<Record>>,
    /// The records as they were measured, before any step.
    pub(crate) read: Read,
    /// Why a step was not done, for each of them.
    pub(crate) undone: Vec<Option<PrepareError>>,
    pub(crate) project: Option<OpenedProject>,
    /// What is good to know: files that were found elsewhere, or that changed.
    pub(crate) notes: Vec<String>,
    pub(crate) goes_on: bool,
    /// The source as it was asked for: its files may have been found elsewhere.
    pub(crate) asked: Source,
    /// True if the settings are those of an earlier time.
    pub(crate) remembered: bool,
}

/// What a project's file tells beside the document.
#[derive(Debug)]
pub(crate) struct OpenedProject {
    pub(crate) path: PathBuf,
    /// What was in view, and the name of the record that was.
    pub(crate) shown: Option<Shown>,
    pub(crate) record: String,
    pub(crate) rig: Option<RigState>,
}

/// What cannot be opened, and why.
#[derive(Clone, Debug)]
pub(crate) struct Refused {
    pub(crate) opening: Opening,
    pub(crate) problem: OpeningProblem,
    /// Which of the source's files are no longer there.
    pub(crate) gone: Vec<PathBuf>,
}

/// Reads what is to be opened, each file once.
///
/// # Errors
/// What cannot be opened, and why.
pub(crate) fn open(opening: Opening, cancel: &Cancel) -> Result<Opened, Box<Refused>> {
    try_open(opening.clone(), cancel).map_err(|problem| {
        let gone = match &opening.document.source {
            Source::Files(files) => files.iter().filter(|file| !sindyscope_system::fs::exists(file)).cloned().collect(),
            _ => Vec::new(),
        };
        Box::new(Refused { opening, problem, gone })
    })
}

fn try_open(mut opening: Opening, cancel: &Cancel) -> Result<Opened, OpeningProblem> {
    let asked = opening.document.source.clone();
    let (mut files, mut notes) = (Files::stopped_by(cancel), Vec::new());
    refuse_series(&opening, &mut files)?;
    let project = take_project(&mut opening, &mut files)?;
    let remembered = project.is_none() && opening.document.edit.settings != Settings::default();
    let bridge = prepare::bridged(&opening.document.edit.steps);
    opening.document.reading.bridge = bridge;
    let mut read = match opening.read.take() {
        Some(read) => read,
        None => {
            let folder = project.as_ref().and_then(|project| project.path.parent());
            let loaded = load(&mut opening, folder, &mut files, &mut notes)?;
            read_source(&mut opening, &loaded, &mut notes)?
        }
    };
    if let Some(project) = &project {
        read.title = file_name(&project.path);
    }
    let Opening { mut document, usage, goes_on, interval, .. } = opening;
    let steps = prepare::settled(&read.set, &document.edit.steps);
    let (set, undone) = prepare::prepare_leniently(&read.set, &steps);
    let records: Vec<Arc<Record>> = set.entries.iter().map(|(record, _)| Arc::clone(record)).collect();
    if document.edit.usage.len() != records.len() {
        let named = |(record, own): &(Arc<Record>, Usage)| usage.get(&record.name).copied().unwrap_or(*own);
        document.edit.usage = set.entries.iter().map(named).collect();
    }
    document.edit.steps = steps;
    let suggestion = suggestion(&document, &records)?;
    let decided = std::mem::take(&mut document.edit.settings);
    document.edit.settings = match &document.source {
        _ if decided != Settings::default() => lasting(&decided, interval, records.first()),
        Source::Sample(sample) if document.edit.steps.is_empty() => sample.settings(&suggestion),
        _ => suggestion.clone(),
    };
    let remembered = remembered && document.edit.settings != suggestion;
    document.suggestion = Some(suggestion);
    Ok(Opened { document, records, read, undone, project, notes, goes_on, asked, remembered })
}

/// Refuses the table of a batch as a measurement: it is shown as a series.
fn refuse_series(opening: &Opening, files: &mut Files) -> Result<(), OpeningProblem> {
    let Source::Files(paths) = &opening.document.source else { return Ok(()) };
    if opening.read.is_some() {
        return Ok(());
    }
    let table = paths.iter().find(|path| files.get(path).is_ok_and(|file| is_series_table(path, file.bytes())));
    let Some(table) = table else { return Ok(()) };
    let what = format!("{} is a table of many records, no measurement", file_name(table));
    let advice = "open it alone: it is shown as a series";
    let series = Some(table.clone()).filter(|_| paths.len() == 1);
    Err(OpeningProblem { series, ..OpeningProblem::new(what, advice) })
}

/// Puts a project's document in place of the source that names it, if one of its files is a project.
fn take_project(opening: &mut Opening, files: &mut Files) -> Result<Option<OpenedProject>, OpeningProblem> {
    let Source::Files(paths) = &opening.document.source else { return Ok(None) };
    if opening.read.is_some() {
        return Ok(None);
    }
    let found = paths.iter().find(|path| is_project(path, files.get(path).ok().map(MeasuredFile::bytes))).cloned();
    let Some(path) = found else { return Ok(None) };
    let name = file_name(&path);
    if opening.goes_on {
        let what = format!("{name} is a project: its records cannot be added to others");
        return Err(OpeningProblem::new(what, "open it by itself"));
    }
    let file = files.take(&path).map_err(|e| OpeningProblem::reading(&e))?;
    let Project { document, usage, shown, record, rig, .. } = Project::read(&path, file.bytes())?;
    (opening.document, opening.usage) = (document, usage);
    Ok(Some(OpenedProject { path, shown, record, rig }))
}

/// The files of the source, found where they are now; their paths and checksums are noted in the document.
fn load(
    opening: &mut Opening,
    folder: Option<&Path>,
    files: &mut Files,
    notes: &mut Vec<String>,
) -> Result<Vec<MeasuredFile>, OpeningProblem> {
    let Source::Files(paths) = &mut opening.document.source else { return Ok(Vec::new()) };
    let checksums = paths.iter().cloned().zip(opening.document.checksums.iter().cloned()).collect();
    let known = KnownFiles { checksums, moved: opening.moved.clone(), folder: folder.map(Path::to_owned) };
    let loaded = moved::load(paths, &known, files, notes)?;
    opening.document.checksums = loaded.iter().map(|(_, file)| checksum(file.bytes())).collect();
    let files;
    (*paths, files) = loaded.into_iter().unzip();
    Ok(files)
}

/// Settings suggested from everything that may be fitted, also where nothing is; those that were suggested before, if any were.
fn suggestion(document: &Document, records: &[Arc<Record>]) -> Result<Settings, OpeningProblem> {
    let kind = document.reading.kind;
    if let Some(known) = document.suggestion.as_ref().filter(|known| known.kind == kind) {
        return Ok(known.clone());
    }
    let all = RecordSet { entries: records.iter().map(|r| (Arc::clone(r), Usage::Fit)).collect() };
    let wanted = RecordSet { entries: records.iter().cloned().zip(document.edit.usage.iter().copied()).collect() };
    suggest(&wanted, kind).or_else(|_| suggest(&all, kind)).map_err(|e| OpeningProblem::new(e.to_string(), ""))
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

/// Reads the source: as others of their folder were read before, if that is known and fits; a header that speaks for itself
/// goes before numbers of columns, which fit every file.
fn read_source(opening: &mut Opening, files: &[MeasuredFile], notes: &mut Vec<String>) -> Result<Read, OpeningProblem> {
    let own = opening.document.reading.clone();
    let source = &opening.document.source;
    let Some(folder) = opening.folder.take() else { return records(source, files, &own) };
    let reading = ReadOptions { kind: own.kind, bridge: own.bridge, ..folder };
    if !reading.columns.names_all()
        && let Ok(read) = records(source, files, &own)
    {
        return Ok(read);
    }
    match records(source, files, &reading) {
        Ok(read) => {
            notes.push(format!("Read as the last files of this folder: {}; Columns… changes it", reading.columns));
            opening.document.reading = reading;
            Ok(read)
        }
        Err(_) => records(source, files, &own),
    }
}

/// Reads what a source names; its files are loaded.
fn records(source: &Source, files: &[MeasuredFile], reading: &ReadOptions) -> Result<Read, OpeningProblem> {
    match source {
        Source::Nothing => Err(OpeningProblem::new("there is nothing to open", "")),
        Source::Sample(sample) => {
            let (title, set) = sample.records(reading)?;
            Ok(Read { title, set, truth: None })
        }
        Source::Files(_) => {
            let set = read_opened(files, &[], reading).map_err(|e| OpeningProblem::reading(&e))?;
            let title = match files {
                [one] => one.name().to_owned(),
                [one, rest @ ..] => format!("{} and {} more", one.name(), rest.len()),
                [] => String::new(),
            };
            Ok(Read { title, set, truth: None })
        }
        Source::Hidden(seed) => {
            let hidden = draw(&HiddenRequest::blind(ExcitationKind::Multisine, *seed)).map_err(|e| {
                OpeningProblem::new(format!("the virtual rig made no records: {e}"), "draw another effect")
            })?;
            let mut set = RecordSet::new(hidden.fit, Usage::Fit);
            set.add(hidden.held_out, Usage::HeldOut);
            Ok(Read { title: "a hidden effect".into(), set, truth: Some(hidden.truth) })
        }
        Source::Rig(settings) => {
            let run = record_rig(settings).map_err(|e| {
                OpeningProblem::new(format!("the virtual rig made no records: {e}"), "change it in its room")
            })?;
            let set = sets::of_run(&run);
            Ok(Read { title: "virtual rig".into(), set, truth: Some(run.truth) })
        }
        Source::Round(case) => {
            let hidden = draw(&case.request()).map_err(|e| {
                OpeningProblem::new(format!("the virtual rig made no records: {e}"), "take another seed")
            })?;
            Ok(Read { title: "a class's round".into(), set: sets::of_round(hidden), truth: None })
        }
    }
}
