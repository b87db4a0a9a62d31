//! Asking for background work, and taking in what came of it.

use std::sync::Arc;

use egui::Context;

use super::App;
use crate::app::columns;
use crate::app::dialogs::Purpose;
use crate::app::jobs::{Done, Job, Key, Part, Update};
use crate::app::missing::{Missing, Wanted};
use crate::app::notices::Level;
use crate::app::open::Refused;
use crate::app::questions::replies;
use crate::app::rig::{Act, ClassRound};
use crate::app::saving::{SaveResult, SavedContent, Saving};
use crate::app::state::{Room, Source};
use sindyscope_search::Found;

impl App {
    /// Takes in what the background work brought.
    pub(super) fn collect(&mut self, ctx: &Context) {
        for (key, update) in self.jobs.poll() {
            match update {
                Update::Part(Part::Map(map)) => self.map.take(map),
                Update::Part(Part::Search(event)) => self.missing.take(event),
                Update::Done(done) => self.done(ctx, done),
                Update::Failed(reason) => self.failed(&key, reason),
            }
        }
        if let Some(progress) = self.jobs.progress(&Key::Search) {
            self.missing.progress(progress);
        }
        self.rig.class.progress = self.jobs.progress(&Key::SearchRound).and_then(|p| p.share);
        if let Some(note) = self.missing.note() {
            self.notices.note(note);
        }
        while let Ok((path, replaces, image)) = self.shots.1.try_recv() {
            let content = SavedContent::Window(image);
            self.save(Saving { path, purpose: Purpose::Window, replaces, content });
        }
    }

    fn done(&mut self, ctx: &Context, done: Done) {
        match done {
            Done::Opened(Ok(opened)) => self.opened(*opened),
            Done::Opened(Err(refused)) => self.not_opened(*refused),
            Done::Chosen(choice) => {
                // What was changed meanwhile stays; only what was chosen is taken over.
                for settings in [&mut self.edit.settings, &mut self.suggestion] {
                    settings.smoothing = choice.settings.smoothing;
                    settings.threshold = choice.settings.threshold;
                    settings.scaling = choice.settings.scaling;
                }
                self.notices.done(format!("Chosen: {}", choice.reason));
            }
            Done::Calibrated { step, found } => self.take_out(step, &found),
            Done::Fitted(outcome) => {
                let (now, held) = ctx.input(|i| (i.time, i.pointer.any_down()));
                self.bench.take(outcome, held, now);
            }
            Done::Resampled(ensemble) => self.bench.ensemble = Some(Arc::new(ensemble)),
            Done::Pinned(made) => self.brought_back(made),
            Done::Bought(bought) => self.questions.take(bought),
            Done::Map(map) => self.map.take(map),
            Done::Searched => self.missing.done(),
            Done::Pages(pages, empty) => self.report.take(pages, empty),
            Done::Recorded(recorded) => self.rig.take(*recorded, &mut self.state.rig),
            Done::RoundDrawn { case, hidden, description } => {
                let round = ClassRound::new(case, hidden, description);
                self.rig.class.drawn(&mut self.state.rig.class, Ok(round));
            }
            Done::RoundSearched { index, answered } => {
                self.rig.class.searched(&mut self.state.rig.class, Ok((index, answered)));
            }
            Done::Columns(overview) => self.columns.looked(overview),
            Done::Preview(preview) => self.columns.previewed(preview),
            Done::Kept => {}
            Done::Saved(SaveResult::Taken { purpose, path }) => self.dialogs.ask_to_replace(purpose, path),
            Done::Saved(SaveResult::Written { purpose, paths }) => {
                if let (Purpose::Project, Some(path)) = (purpose, paths.first()) {
                    self.state.remember(path);
                    self.state.project = Some(path.clone());
                }
                let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
                self.notices.done(format!("Saved {}", names.join(" and ")));
            }
        }
    }

    fn failed(&mut self, key: &Key, reason: String) {
        match key {
            Key::Open => self.notices.error(reason),
            Key::Choose => self.notices.error(format!("Nothing was chosen: {reason}")),
            Key::Calibrate => self.notices.error(format!("Nothing was found: {reason}")),
            Key::Fit => self.bench.failure = Some(reason),
            Key::Map => self.map.fail(reason),
            Key::Search => self.missing.fail(reason),
            Key::Pages => self.report.fail(reason),
            Key::Rig => self.rig.fail(reason),
            Key::DrawRound => self.rig.class.drawn(&mut self.state.rig.class, Err(reason)),
            Key::SearchRound => self.rig.class.searched(&mut self.state.rig.class, Err(reason)),
            Key::Session => {
                self.notices.error(format!("The session was not saved: {reason}; save a project instead"));
            }
            Key::Save(_) => self.notices.error(reason),
            // What they would add to is there without them.
            Key::Resample | Key::Pins | Key::Answers | Key::Columns | Key::Preview => {}
        }
    }

    fn not_opened(&mut self, refused: Refused) {
        // The card in the left column says it for all to see.
        self.notices.log(Level::Error, refused.problem.what.clone());
        self.state.recent.retain(|path| !refused.gone.contains(path));
        if refused.problem.about_columns
            && let Source::Files(paths) = &refused.opening.source
        {
            let wanted = self.columns.open(paths.clone(), &refused.opening.reading);
            self.read_columns(wanted);
        }
        // A source that cannot be read just now stays the one to come back to, with all that belongs to it.
        self.refused = Some(refused);
    }

    /// True while records are being read.
    pub(super) fn opening(&self) -> bool {
        self.jobs.progress(&Key::Open).is_some()
    }

    /// Asks for the search that the room "What's missing" wants.
    pub(super) fn search(&mut self, wanted: Option<Wanted>) {
        match wanted {
            Some(Wanted::Search(request)) => self.jobs.want_instead(Key::Search, Job::Search(request)),
            Some(Wanted::Nothing) => self.jobs.cancel(&Key::Search),
            None => {}
        }
    }

    /// Brings a walk that was kept back into "What's missing".
    pub(super) fn bring_back_walk(&mut self, found: Option<Arc<Found>>) {
        let wanted = self.missing.bring_back(found);
        self.search(wanted);
    }

    /// Asks for what the window of columns wants to read.
    pub(super) fn read_columns(&mut self, wanted: Option<columns::Wanted>) {
        match wanted {
            Some(columns::Wanted::Overview { path, reading }) => {
                self.jobs.cancel(&Key::Preview);
                self.jobs.want_instead(Key::Columns, Job::Columns { path, reading });
            }
            Some(columns::Wanted::Preview { path, reading }) => {
                self.jobs.want_instead(Key::Preview, Job::Preview { path, reading });
            }
            None => {}
        }
    }

    /// Asks for what the virtual rig's room wants.
    pub(super) fn class_act(&mut self, act: &Act) {
        match act {
            Act::DrawRound => {
                self.rig.class.draws();
                self.jobs.want_instead(Key::DrawRound, Job::DrawRound(self.state.rig.class.case.clone()));
            }
            Act::SearchRound(index) => {
                let Some(round) = self.state.rig.class.rounds.get(*index) else { return };
                self.rig.class.searches(*index);
                let job = Job::SearchRound { index: *index, case: round.case.clone() };
                self.jobs.want_instead(Key::SearchRound, job);
            }
            Act::StopSearch => {
                self.rig.class.searching = None;
                self.jobs.cancel(&Key::SearchRound);
            }
            Act::Study | Act::StudyRound | Act::Save(_) | Act::Begin(_) => {}
        }
    }

    /// Repeats the regression on resampled data once the outcome is there and nothing is being dragged.
    pub(super) fn resample(&mut self, ctx: &Context) {
        let held = ctx.input(|i| i.pointer.any_down());
        let Some(outcome) = self.bench.outcome.as_ref().filter(|_| self.bench.failure.is_none()) else { return };
        if held || self.jobs.progress(&Key::Fit).is_some() || self.resampled.as_ptr() == Arc::as_ptr(outcome) {
            return;
        }
        self.resampled = Arc::downgrade(outcome);
        let (records, settings) = (self.records(), self.edit.settings.clone());
        self.jobs.want_instead(Key::Resample, Job::Resample { records, settings });
    }

    /// Asks what the answers to the open questions would buy, once the outcome is there and nothing is being dragged.
    pub(super) fn question(&mut self, ctx: &Context) {
        let kind = self.edit.settings.kind;
        let open = self.state.room == Room::Identify && self.edit.settings.known.is_empty();
        let replies = if open { replies(&self.bench.layout(kind), &self.bench.units(kind)) } else { Vec::new() };
        if replies.is_empty() {
            if self.questions.forget() {
                self.jobs.cancel(&Key::Answers);
            }
            return;
        }
        let held = ctx.input(|i| i.pointer.any_down());
        if self.jobs.progress(&Key::Fit).is_some() {
            // The fit comes first, and makes the answers out of date.
            if self.jobs.progress(&Key::Answers).is_some() {
                self.jobs.cancel(&Key::Answers);
                self.questions.give_way();
            }
        } else if !held && self.bench.outcome.is_some() && self.questions.wants(self.bench.generation, &self.edit) {
            let (records, settings) = (self.records(), self.edit.settings.clone());
            self.jobs.want_instead(Key::Answers, Job::Answers { records, settings, replies });
        }
    }

    /// Asks for the map of settings while a view shows it.
    pub(super) fn look_around(&mut self) {
        if self.bench.records.is_empty() {
            self.map = Default::default();
            self.jobs.cancel(&Key::Map);
        } else if self.state.view.needs_map()
            && self.bench.outcome.is_some()
            && self.map.wants(self.bench.generation, &self.edit)
        {
            let (records, settings) = (self.records(), self.edit.settings.clone());
            self.jobs.want_instead(Key::Map, Job::Map { records, settings });
        }
    }

    /// Asks for what the room in view needs, and for a study if what was asked last is no longer what is wanted.
    pub(super) fn ask(&mut self) {
        match self.state.room {
            Room::Identify => {}
            Room::Missing => self.attend_to_search(),
            Room::Rig => {
                if self.rig.wants(&self.state.rig) {
                    let settings = Box::new(self.state.rig.settings.clone());
                    self.jobs.want(Key::Rig, Job::Rig { settings, usual_library: self.state.rig.usual_library });
                }
            }
            Room::Report => {
                // A walk that came back with its project is told in the report too.
                if !self.edit.walk.accepted.is_empty() || self.missing.found().is_some() {
                    self.attend_to_search();
                }
                let sight = super::report::Sight {
                    bench: &self.bench,
                    edit: &self.edit,
                    diagnosis: self.missing.diagnosis(&self.edit.walk),
                    project: self.state.project.as_deref(),
                };
                if let Some((content, width)) = self.report.wanted(&sight) {
                    self.jobs.want(Key::Pages, Job::Pages { content: Box::new(content), width });
                }
            }
        }
        // A walk decides nothing of the study.
        let same = |(generation, edit): &(u64, crate::app::state::Edit)| {
            *generation == self.bench.generation
                && (&edit.settings, &edit.usage) == (&self.edit.settings, &self.edit.usage)
        };
        if self.bench.records.is_empty() || self.asked.as_ref().is_some_and(same) {
            return;
        }
        self.asked = Some((self.bench.generation, self.edit.clone()));
        // What is known of the terms of other settings.
        self.jobs.cancel(&Key::Resample);
        self.jobs.want(Key::Fit, Job::Fit { records: self.records(), settings: self.edit.settings.clone() });
    }

    fn attend_to_search(&mut self) {
        let wanted = Missing::attend(&mut self.missing, &self.bench, &self.edit);
        self.search(wanted);
    }
}
