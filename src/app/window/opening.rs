//! Opening, adding and closing records, and reading them in another way.

use std::collections::BTreeMap;
use std::path::PathBuf;

use egui::Context;

use super::App;
use crate::app::commands::Command;
use crate::app::history::History;
use crate::app::jobs::{Job, Key};
use crate::app::open::{Opened, Opening, Read};
use crate::app::panel::Typing;
use crate::app::state::{Edit, Pin, Room, Sample, Source, absolute};
use sindyscope_core::prepare::{Preparation, Treatment, bridged};
use sindyscope_core::study::Calibrated;
use sindyscope_files::ReadOptions;
use sindyscope_values::format::number::format_measured;
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::Kind;

/// Jobs on the records that are open: with others they are in vain.
const OF_THE_RECORDS: [Key; 6] = [Key::Choose, Key::Calibrate, Key::Fit, Key::Resample, Key::Pins, Key::Answers];

impl App {
    /// Opens files: measurements, or a project. What was left with the same files the last time comes back.
    pub fn open(&mut self, paths: Vec<PathBuf>) {
        let paths: Vec<PathBuf> = paths.into_iter().map(absolute).collect();
        let source = Source::Files(paths);
        // Otherwise, whatever was open before says nothing of these files.
        let kept = self.state.kept(&source).filter(|_| source != self.state.source).cloned().unwrap_or_default();
        let folder = self.folder_of(&source, &kept.reading);
        self.begin(Opening { reading: kept.reading, edit: kept.edit, folder, ..Opening::of(source) });
    }

    /// How files of a source's folder were read last, if a person said so and `reading` does not say.
    pub(super) fn folder_of(&self, source: &Source, reading: &ReadOptions) -> Option<ReadOptions> {
        match source {
            Source::Files(files) if reading.columns.is_empty() => {
                files.first().and_then(|file| self.state.folder(file)).cloned()
            }
            _ => None,
        }
    }

    /// Shows the columns of the files that were refused, or else of those that are open.
    pub(super) fn show_columns(&mut self) {
        let refused = self.refused.as_ref().map(|r| (&r.opening.source, &r.opening.reading));
        let (source, reading) = refused.unwrap_or((&self.state.source, &self.state.reading));
        if let Source::Files(files) = source {
            let wanted = self.columns.open(files.clone(), reading);
            self.read_columns(wanted);
        }
    }

    /// Reads the files with the columns that a person chose.
    pub(super) fn read_with(&mut self, reading: ReadOptions) {
        if let Some(refused) = self.refused.take() {
            return self.begin(Opening { reading, folder: None, ..refused.opening });
        }
        let (usage, steps) = (self.usage_by_name(), self.edit.steps.clone());
        self.begin(Opening { reading, usage, steps, ..Opening::of(self.state.source.clone()) });
    }

    /// Adds the records of files to those that are open.
    pub(super) fn add_records(&mut self, paths: Vec<PathBuf>) {
        let Source::Files(open) = &self.state.source else {
            self.notices.note("Records are added to files; a sample stands alone, so the files were opened instead");
            return self.open(paths);
        };
        let new = paths.into_iter().map(absolute).filter(|p| !open.contains(p));
        let source = Source::Files(open.iter().cloned().chain(new).collect());
        let (reading, edit, usage) = (self.state.reading.clone(), Some(self.edit.clone()), self.usage_by_name());
        self.begin(Opening { reading, edit, usage, goes_on: true, ..Opening::of(source) });
    }

    /// Opens what was refused with the file that was missing, where a person found it.
    pub(super) fn located(&mut self, path: PathBuf) {
        let Some(refused) = self.refused.take() else { return };
        let mut opening = refused.opening;
        opening.moved.extend(refused.problem.missing.map(|missing| (missing, absolute(path))));
        self.begin(opening);
    }

    pub(super) fn begin(&mut self, opening: Opening) {
        self.refused = None;
        self.jobs.want_instead(Key::Open, Job::Open(Box::new(opening)));
    }

    pub(super) fn open_sample(&mut self, sample: Sample) {
        let source = Source::Sample(sample);
        let reading = ReadOptions { kind: sample.kind(), ..ReadOptions::default() };
        self.begin(Opening { reading, ..Opening::of(source) });
    }

    /// What each record is used for, by its name.
    fn usage_by_name(&self) -> BTreeMap<String, Usage> {
        self.bench.records.iter().zip(&self.edit.usage).map(|(r, u)| (r.name.clone(), *u)).collect()
    }

    pub(super) fn opened(&mut self, opened: Opened) {
        let Opened { source, reading, title, records, raw, undone, edit, suggestion, project, .. } = opened;
        let Opened { checksums, notes, goes_on, asked, remembered, truth, .. } = opened;
        self.typing = Typing::default();
        if let Source::Files(paths) = &source {
            let remembered = project.as_ref().map(|(path, _)| std::slice::from_ref(path)).unwrap_or(paths);
            for path in remembered.iter().rev() {
                self.state.remember(path);
            }
            if let Some(file) = paths.first() {
                self.state.keep_folder(file, &reading);
            }
        }
        let was_open = !self.bench.records.is_empty();
        let unchanged = [&source, &asked].contains(&&self.state.source);
        let same = unchanged || goes_on;
        if !same {
            self.leave();
            self.notices.settle();
            if remembered {
                let reset = Command::Reset.spec().label;
                self.notices.note(format!("The settings of the last time are back; {reset} takes the program's own"));
            }
        }
        for note in notes {
            self.notices.note(note);
        }
        let of_the_rig = matches!(source, Source::Rig(_) | Source::Round(_));
        if !same && self.state.room == Room::Rig && !of_the_rig {
            self.state.room = Room::Identify;
        }
        let count = records.len();
        let mut going_on: Vec<Pin> = if goes_on { self.pins() } else { Vec::new() };
        for pin in &mut going_on {
            // A record that was not there had no part in it.
            pin.usage.resize(pin.usage.len().max(count), Usage::Off);
        }
        let channels = |r: &ReadOptions| (r.kind, r.columns.clone(), r.only_named, r.rate);
        let stay = unchanged && was_open && channels(&reading) == channels(&self.state.reading) && project.is_none();
        for key in OF_THE_RECORDS {
            self.jobs.cancel(&key);
        }
        let old = std::mem::take(&mut self.bench);
        self.bench.generation = old.generation;
        self.bench.open(title, records, raw, truth);
        self.bench.undone = undone;
        if matches!(source, Source::Hidden(_)) && !same {
            self.state.room = Room::Missing;
            self.missing.look_by_itself();
        }
        self.suggestion =
            self.state.suggestion.take().filter(|s| unchanged && s.kind == suggestion.kind).unwrap_or(suggestion);
        if unchanged && was_open {
            // Another order of the same records is a step that can be taken back.
            self.history.note(&edit);
        } else {
            self.history = History::new(edit.clone());
        }
        self.edit = edit;
        let pins = match &project {
            Some((_, project)) => project.pins.clone(),
            None if goes_on => going_on,
            None => self.state.kept(&source).map(|k| k.pins.clone()).unwrap_or_default(),
        };
        match &project {
            Some((_, project)) => self.bring_back_walk(project.found.clone()),
            None if same => {}
            None => self.bring_back_walk(self.state.kept(&source).and_then(|k| k.found.clone())),
        }
        self.state.record = if same { self.state.record.min(count.saturating_sub(1)) } else { 0 };
        if let Some(shown) = project.as_ref().and_then(|(_, project)| project.shown.clone()) {
            (self.state.room, self.state.view, self.state.views) = (shown.room, shown.view, shown.views);
            let wanted = self.missing.begin_at(shown.step);
            self.search(wanted);
            let named = self.bench.records.iter().position(|r| r.name == shown.record);
            self.state.record = named.unwrap_or(self.state.record);
        }
        if let Some(rig) = project.as_ref().and_then(|(_, project)| project.rig.clone()) {
            self.state.rig = rig;
        }
        self.state.project = project.map(|(path, _)| path).or(self.state.project.take().filter(|_| same));
        (self.state.source, self.state.reading, self.state.checksums) = (source, reading, checksums);
        if stay {
            // Outcomes of the records as they were prepared before can be compared all the same, and the last one stays in
            // view until the new one comes.
            (self.bench.pins, self.bench.pinned, self.bench.outcome) = (old.pins, old.pinned, old.outcome);
        } else {
            self.bring_back(pins);
        }
        self.state.views.fit();
        self.asked = None;
    }

    /// Takes the records off the bench.
    pub(super) fn close(&mut self) {
        self.jobs.cancel(&Key::Open);
        for key in OF_THE_RECORDS {
            self.jobs.cancel(&key);
        }
        self.columns.close();
        self.leave();
        self.bring_back_walk(None);
        self.bench.open(String::new(), Vec::new(), RecordSet::default(), None);
        self.waiting_pins = Vec::new();
        self.edit = Edit::default();
        self.history = History::new(Edit::default());
        self.state.source = Source::Nothing;
        self.state.project = None;
        self.state.edit = None;
        self.refused = None;
    }

    pub(super) fn dropped(&mut self, ctx: &Context) {
        let files: Vec<PathBuf> = ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect());
        if !files.is_empty() {
            self.open(files);
        }
    }

    /// Takes over a step of the history; one of another order or preparation needs the records made for it.
    pub(super) fn take_back(&mut self, edit: Edit) {
        let kind = edit.settings.kind;
        if kind == self.state.reading.kind && edit.steps == self.edit.steps {
            self.edit = edit;
            return;
        }
        let reading = ReadOptions { kind, ..self.state.reading.clone() };
        let read = self.read_already(&reading, &edit.steps);
        let usage = self.usage_by_name();
        self.begin(Opening { reading, read, usage, edit: Some(edit), ..Opening::of(self.state.source.clone()) });
    }

    /// Prepares the records in another way: a step that can be taken back.
    pub(super) fn prepare(&mut self, steps: Vec<Preparation>) {
        if self.opening() || steps == self.edit.steps {
            return;
        }
        self.history.note(&self.edit);
        let reading = self.state.reading.clone();
        self.begin(Opening {
            read: self.read_already(&reading, &steps),
            reading,
            usage: self.usage_by_name(),
            follows: self.edit.settings == self.suggestion,
            interval: self.bench.records.first().map(|r| r.interval),
            // What each record is used for goes by its name: there may be others now.
            edit: Some(Edit { steps, usage: Vec::new(), ..self.edit.clone() }),
            ..Opening::of(self.state.source.clone())
        });
    }

    /// Puts what was found of a channel, beyond what a step takes out already, into the step.
    pub(super) fn take_out(&mut self, step: usize, found: &Calibrated) {
        let mut steps = self.edit.steps.clone();
        let Some(preparation) = steps.get_mut(step) else { return };
        let text = match &mut preparation.treatment {
            Treatment::Align { delay, .. } => {
                let whole = delay.unwrap_or(0.0) + found.value;
                *delay = Some(whole);
                format!("late by {} ms", format_measured(1e3 * whole, found.std_error.map(|e| 1e3 * e)))
            }
            Treatment::Gain { gain, .. } => {
                let before = *gain;
                *gain *= found.value;
                format!("gain {}", format_measured(*gain, found.std_error.map(|e| e * before)))
            }
            _ => return,
        };
        self.notices.done(format!("Found with the equation: {text}"));
        self.prepare(steps);
    }

    /// The records as they were read, if they would be read alike again.
    fn read_already(&self, reading: &ReadOptions, steps: &[Preparation]) -> Option<Read> {
        let alike = reading.kind == self.state.reading.kind && bridged(steps) == self.state.reading.bridge;
        let bench = &self.bench;
        alike.then(|| Read { title: bench.title.clone(), set: bench.raw.clone(), truth: bench.truth.clone() })
    }

    /// Reads the same source for equations of another order: which columns are states depends on it.
    pub(super) fn read_as(&mut self, kind: Kind) {
        let reading = ReadOptions { kind, ..self.state.reading.clone() };
        self.history.note(&self.edit);
        let (usage, steps) = (self.usage_by_name(), self.edit.steps.clone());
        self.begin(Opening { reading, usage, steps, ..Opening::of(self.state.source.clone()) });
    }
}
