//! The room: what was found, what is under way, and what an act changes.

use std::collections::HashMap;
use std::sync::Arc;

use super::act::WalkAct;
use super::keep::Shelf;
use super::known::{Partial, Running, WalkContext, WalkFindings, key};
use super::subject::WalkSubject;
use super::work::{Event, SearchDepth, SearchRequest};
use crate::app::queue::JobProgress;
use crate::app::records::OpenRecords;
use crate::app::state::{Edit, RoundStep, Walk, WalkView};
use sindyscope_search::{Choice, Diagnosis, Found, Restored, Site, Stage};

/// What the room wants done in the background.
#[derive(Debug)]
pub(crate) enum WantedSearch {
    /// This search, in place of any other.
    Search(Box<SearchRequest>),
    /// No search any more.
    Nothing,
}

/// The room: what was found and what is under way.
#[derive(Default)]
pub(crate) struct Missing {
    pub(super) known: WalkFindings,
    pub(super) running: Option<Running>,
    pub(super) shelf: Shelf,
    /// Look once the base is fitted, without being asked.
    pub(super) by_itself: bool,
    /// The candidate that is fitted alone.
    pub(super) tried: Option<Choice>,
    /// The text of a file of effects that was opened, until the window has taken it over.
    pub(crate) effects_file: Option<String>,
    /// Stopped by hand: nothing is asked for by itself until something changes.
    pub(super) stopped: bool,
}

impl Missing {
    /// Notes how far the search has come.
    pub(crate) fn progress(&mut self, progress: JobProgress) {
        if let Some(running) = &mut self.running {
            running.sentence = progress.stage.unwrap_or(running.sentence);
            // What runs in parts never seems to go back.
            let share = [progress.share, running.progress.share].into_iter().flatten().reduce(f64::max);
            running.progress = JobProgress { share, ..progress };
        }
    }

    /// True once a look for missing effects has come to its end.
    pub(crate) fn looked(&self) -> bool {
        !self.known.rounds.is_empty()
    }

    /// Looks as soon as the base is fitted: a demonstration.
    pub(crate) fn look_by_itself(&mut self) {
        self.by_itself = true;
    }

    /// What the walk has come to, once it is known: for a report.
    pub(crate) fn diagnosis(&self, walk: &Walk) -> Option<&Arc<Diagnosis>> {
        self.known.conclusions.get(&walk.accepted)
    }

    /// The model as it stands, if it was fitted.
    pub(crate) fn stage(&self, walk: &Walk) -> Option<&Arc<Stage>> {
        self.known.stages.get(&walk.accepted)
    }

    /// Takes in what the search found.
    pub(crate) fn take(&mut self, event: Event) {
        match event {
            Event::Ready { records, noise_floor, notices, blind } => {
                let known = &mut self.known;
                (known.records, known.noise_floor) = (records, noise_floor);
                (known.notices, known.blind) = (notices, blind);
            }
            Event::Restored(restored, found) => {
                let Restored { stages, rounds, conclusions } = *restored;
                self.known.stages.extend(stages);
                self.known.rounds.extend(rounds);
                self.known.conclusions.extend(conclusions);
                self.shelf.restored(found);
            }
            Event::Stage(choices, stage) => {
                self.known.stages.insert(choices, stage);
                if self.running.is_some_and(|r| r.want == SearchDepth::Try) {
                    self.keep();
                }
            }
            Event::Place(place) => self.partial().place = Some(place),
            Event::Ranking(candidates) => self.partial().candidates = candidates,
            Event::Round(choices, round) => {
                for candidate in &round.candidates {
                    if let Some(stage) = &candidate.stage {
                        let choices = stage.effects.iter().map(|e| e.choice.clone()).collect();
                        self.known.stages.entry(choices).or_insert_with(|| Arc::clone(stage));
                    }
                }
                self.known.partial = None;
                self.known.rounds.insert(choices, round);
                self.keep();
            }
            Event::Concluded(choices, diagnosis) => {
                self.known.conclusions.insert(choices, diagnosis);
                self.keep();
            }
        }
    }

    /// The search has come to its end.
    pub(crate) fn done(&mut self) {
        self.running = None;
        self.shelf.missed();
    }

    /// The search failed, for this reason.
    pub(crate) fn fail(&mut self, reason: String) {
        match self.running.take() {
            Some(Running { want: SearchDepth::Try, .. }) => {
                let choice = self.tried.take();
                self.known.refused = choice.map(|choice| (choice, reason));
            }
            _ => {
                self.known.failure = Some(reason);
                self.shelf.missed();
            }
        }
    }

    fn partial(&mut self) -> &mut Partial {
        self.known.partial.get_or_insert_default()
    }

    /// Asks for what the room needs and does not have; nothing while it is not looked at.
    pub(crate) fn attend(&mut self, data: &OpenRecords, edit: &Edit, view: &mut WalkView) -> Option<WantedSearch> {
        if data.records.is_empty() {
            return self.forget();
        }
        let key = key(data, edit)?;
        if self.known.key.as_ref() != Some(&key) {
            // A window that starts again shows what it showed.
            if let Some(before) = self.known.key.as_ref().map(|before| before.generation) {
                if before == key.generation {
                    view.pass_over();
                } else {
                    *view = WalkView::default();
                    self.forget();
                }
            }
            self.shelf.put_aside();
            let mut stages = std::mem::take(&mut self.known.stages);
            let accepted = &edit.walk.accepted;
            let shown = (0..=accepted.len()).rev().find_map(|n| stages.remove(&accepted[..n]));
            let before = shown.or(self.known.before.take());
            self.known = WalkFindings { key: Some(key), before, ..WalkFindings::default() };
            return self.ask(data, edit, SearchDepth::Stages);
        }
        if self.running.is_some() || self.stopped || self.known.failure.is_some() {
            return None;
        }
        if !self.known.stages.contains_key(&edit.walk.accepted) {
            self.ask(data, edit, SearchDepth::Stages)
        } else if std::mem::take(&mut self.by_itself) && self.known.rounds.is_empty() {
            self.ask(data, edit, SearchDepth::Look)
        } else if !edit.walk.accepted.is_empty() && !self.known.conclusions.contains_key(&edit.walk.accepted) {
            self.ask(data, edit, SearchDepth::Conclusion)
        } else {
            None
        }
    }

    fn forget(&mut self) -> Option<WantedSearch> {
        self.known.key.as_ref()?;
        self.running = None;
        self.shelf.put_aside();
        self.known = WalkFindings::default();
        Some(WantedSearch::Nothing)
    }

    fn ask(&mut self, data: &OpenRecords, edit: &Edit, want: SearchDepth) -> Option<WantedSearch> {
        let key = self.known.key.clone()?;
        let accepted = &edit.walk.accepted;
        let rounds = (0..=accepted.len()).map_while(|n| self.known.rounds.get(&accepted[..n]).cloned()).collect();
        let stages = self.stages_of(accepted);
        self.known.failure = None;
        self.known.refused = None;
        self.stopped = false;
        self.running = Some(Running { want, sentence: "Preparing the records", progress: JobProgress::default() });
        if want == SearchDepth::Look {
            self.known.partial = Some(Partial { choices: accepted.clone(), ..Partial::default() });
        }
        let kept = if want == SearchDepth::Stages { self.shelf.candidates() } else { Vec::new() };
        let (records, choices) = (data.set(&edit.usage), accepted.clone());
        Some(WantedSearch::Search(Box::new(SearchRequest { key, records, choices, rounds, stages, kept, want })))
    }

    /// The stages on the way to these effects that are known: they need not be fitted again.
    fn stages_of(&self, choices: &[Choice]) -> HashMap<Vec<Choice>, Arc<Stage>> {
        let known = |n: usize| Some((choices[..n].to_vec(), Arc::clone(self.known.stages.get(&choices[..n])?)));
        (0..=choices.len()).filter_map(known).collect()
    }

    /// Does what was asked for.
    pub(crate) fn act(
        &mut self,
        act: WalkAct,
        data: &OpenRecords,
        edit: &mut Edit,
        view: &mut WalkView,
    ) -> Option<WantedSearch> {
        match act {
            WalkAct::Look => {
                view.pass_over();
                view.step = RoundStep::Compare;
                self.known.rounds.remove(&edit.walk.accepted);
                self.known.conclusions.remove(&edit.walk.accepted);
                return self.ask(data, edit, SearchDepth::Look);
            }
            WalkAct::Cancel => {
                self.running = None;
                self.stopped = true;
                return Some(WantedSearch::Nothing);
            }
            WalkAct::Restart => {
                edit.walk = edit.walk.afresh();
                self.known.failure = None;
                view.pass_over();
                view.step = RoundStep::Compare;
            }
            WalkAct::Reveal => view.revealed = true,
            WalkAct::Go(step) => view.step = step,
            WalkAct::Select(choice) => view.selected = Some(choice),
            WalkAct::Try(choice) => {
                let key = self.known.key.clone()?;
                let mut choices = edit.walk.accepted.clone();
                choices.push(choice.clone());
                view.selected = Some(choice.clone());
                self.tried = Some(choice);
                self.known.refused = None;
                let sentence = "Fitting the effect to the measured response";
                self.running = Some(Running { want: SearchDepth::Try, sentence, progress: JobProgress::default() });
                let (records, rounds, kept) = (data.set(&edit.usage), Vec::new(), Vec::new());
                let stages = self.stages_of(&choices);
                let request = SearchRequest { key, records, choices, rounds, stages, kept, want: SearchDepth::Try };
                return Some(WantedSearch::Search(Box::new(request)));
            }
            WalkAct::Accept(choice) => {
                let subject = WalkSubject::of(data);
                let context = self.context(&edit.walk, &subject, (0, None), false);
                // An effect may replace a simpler one that it contains.
                let accepted = match context.with(&choice) {
                    Some(stage) => stage.effects.iter().map(|e| e.choice.clone()).collect(),
                    None => edit.walk.accepted.iter().cloned().chain([choice]).collect(),
                };
                edit.walk.accepted = accepted;
                view.pass_over();
                view.step = RoundStep::Verify;
                return self.ask(data, edit, SearchDepth::Conclusion);
            }
            // The window does these: they concern more than the room.
            WalkAct::Use
            | WalkAct::Copy
            | WalkAct::OpenEffects
            | WalkAct::SaveEffects(_)
            | WalkAct::SaveFigure(_)
            | WalkAct::SaveTable(..) => {}
            WalkAct::Undo => {
                edit.walk.accepted.pop();
                view.pass_over();
                view.step = if self.known.rounds.contains_key(&edit.walk.accepted) {
                    RoundStep::Add
                } else {
                    RoundStep::Compare
                };
            }
        }
        None
    }

    /// What the steps see, of the mass that is shown and the place that was picked.
    pub(super) fn context<'a>(
        &'a self,
        walk: &'a Walk,
        subject: &'a WalkSubject,
        (mass, site): (usize, Option<Site>),
        dark: bool,
    ) -> WalkContext<'a> {
        let unit = subject.sensors.first().map_or("", |s| s.unit.as_str());
        WalkContext { walk, known: &self.known, running: self.running, subject, mass, site, unit, dark }
    }

    /// Brings back what was kept with the records that are opened, as soon as the room is looked at.
    pub(crate) fn bring_back(&mut self, found: Option<Arc<Found>>) -> Option<WantedSearch> {
        let wanted = self.forget();
        self.shelf = Shelf::awaiting(found);
        wanted
    }

    /// What is to be kept.
    pub(crate) fn found(&self) -> Option<&Arc<Found>> {
        self.shelf.found.as_ref().or(self.shelf.coming.as_ref())
    }

    /// What is to be told of it, once.
    pub(crate) fn note(&mut self) -> Option<&'static str> {
        self.shelf.note.take()
    }

    /// Keeps what is known now. Without a look there is nothing that fitting anew would not give.
    pub(super) fn keep(&mut self) {
        let known = &self.known;
        let base = known.key.as_ref().and_then(|key| key.base.clone());
        if !known.rounds.is_empty() {
            let of = (known.records.clone(), base);
            let found = Found::new(of, &known.stages, &known.rounds, &known.conclusions);
            self.shelf.found = Some(Arc::new(found));
        }
    }
}
