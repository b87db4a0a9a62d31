//! The room "What's missing": a walk in rounds of four steps, from where model and measurement part to an effect that was
//! added and checked on data never fitted.
//!
//! [`Walk`] is what a person decided; [`Missing`] is what was found for it. Each step is a function of both and asks for
//! [`Act`]s; none computes anything.

mod add;
mod base;
mod cards;
mod chain;
mod compare;
pub(crate) mod figures;
mod findings;
mod keep;
mod name;
mod places;
pub(in crate::app) mod plots;
mod steps;
mod subject;
mod verify;
mod walk;
mod words;
pub(crate) mod work;

use crate::app::plot::palette::Painted as _;
use std::collections::HashMap;
use std::sync::Arc;

use egui::{Ui, vec2};

use super::bench::Bench;
use super::queue::Progress;
use super::state::Edit;
use figures::Figure;
use keep::Shelf;
use sindyscope_core::study::Settings;
use sindyscope_search::{Blind, Candidate, Choice, Diagnosis, Place, Restored, Round, Site, Stage, Standing, Trace};
use sindyscope_values::term::{Kind, Term};
use subject::Subject;
pub(crate) use walk::RoundStep;
pub use walk::{Base, Walk};
use work::{Event, Key, Request, Want};

/// What a step asks for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Act {
    /// Look at the model as it stands.
    Look,
    /// Tell what the virtual rig hid.
    Reveal,
    /// Stop.
    Cancel,
    /// Go to a step.
    Go(RoundStep),
    /// Choose a candidate.
    Select(Choice),
    /// Fit a candidate that was only screened.
    Try(Choice),
    /// Begin again with the base alone.
    Restart,
    /// Add a candidate to the walk.
    Accept(Choice),
    /// Take the last effect back.
    Undo,
    /// Take the model as it stands over as the equation of Identify.
    Use,
    /// Copy the model as it stands.
    Copy,
    /// Save a figure.
    SaveFigure(Figure),
    /// Save a plot's numbers: what it is called, and the text of the file.
    SaveTable(&'static str, String),
}

/// Everything found for one set of records and one base.
#[derive(Debug, Default)]
struct Known {
    key: Option<Key>,
    /// What tells the records from others.
    records: String,
    noise_floor: f64,
    notices: Vec<String>,
    blind: Vec<Blind>,
    stages: HashMap<Vec<Choice>, Arc<Stage>>,
    rounds: HashMap<Vec<Choice>, Arc<Round>>,
    conclusions: HashMap<Vec<Choice>, Arc<Diagnosis>>,
    /// A look that is not done, or was stopped.
    partial: Option<Partial>,
    failure: Option<String>,
    /// What a candidate that was to be fitted alone came to, where it could not be.
    refused: Option<(Choice, String)>,
    /// The last model of other records or another base: in view until the new one comes.
    before: Option<Arc<Stage>>,
}

/// A look under way.
#[derive(Debug, Default)]
struct Partial {
    choices: Vec<Choice>,
    place: Option<Box<Place>>,
    candidates: Vec<Candidate>,
}

/// What runs.
#[derive(Clone, Copy, Debug)]
struct Running {
    want: Want,
    /// What it does at the moment.
    sentence: &'static str,
    share: f64,
}

/// What the room wants done in the background.
#[derive(Debug)]
pub(crate) enum Wanted {
    /// This search, in place of any other.
    Search(Box<Request>),
    /// No search any more.
    Nothing,
}

/// The room: what was found, what is under way and how it is shown.
#[derive(Default)]
pub(crate) struct Missing {
    known: Known,
    running: Option<Running>,
    shelf: Shelf,
    /// Look once the base is fitted, without being asked.
    by_itself: bool,
    /// Whether what the virtual rig hid is told.
    revealed: bool,
    /// Stopped by hand: nothing is asked for by itself until something changes.
    stopped: bool,
    step: RoundStep,
    /// The candidate that is looked at.
    selected: Option<Choice>,
    /// Candidates that were passed over.
    skipped: Vec<Choice>,
    /// The one under the pointer.
    hovered: Option<Choice>,
    show_all: bool,
    /// The place whose candidates are shown alone.
    site: Option<Site>,
    /// The mass whose response is shown: that of the views of Identify too.
    mass: usize,
    /// The record shown while comparing, and the one shown to verify: the first held-out one until another is chosen.
    record: usize,
    verified: Option<usize>,
    /// The quantity that the missing force is shown over; none: the one that suits what is looked at.
    profile: Option<String>,
    typing: Option<String>,
    figures: plots::Figures,
}

/// What the steps see.
struct Sight<'a> {
    walk: &'a Walk,
    known: &'a Known,
    running: Option<Running>,
    subject: &'a Subject,
    /// The mass whose response is shown.
    mass: usize,
    /// The place whose candidates are shown alone.
    site: Option<Site>,
    /// The unit of what the first sensor shows, in which errors are told.
    unit: &'a str,
    dark: bool,
}

impl<'a> Sight<'a> {
    /// The model as it stands; while it is being fitted, the last one that is known.
    fn stage(&self) -> Option<&'a Arc<Stage>> {
        let accepted = &self.walk.accepted;
        let known = (0..=accepted.len()).rev().find_map(|n| self.known.stages.get(&accepted[..n]));
        known.or(self.known.before.as_ref())
    }

    /// The base and the stage after each effect, as far as they are known.
    fn stages(&self) -> Vec<&'a Arc<Stage>> {
        let accepted = &self.walk.accepted;
        (0..=accepted.len()).map_while(|n| self.known.stages.get(&accepted[..n])).collect()
    }

    fn round(&self) -> Option<&'a Arc<Round>> {
        self.known.rounds.get(&self.walk.accepted)
    }

    fn conclusion(&self) -> Option<&'a Arc<Diagnosis>> {
        self.known.conclusions.get(&self.walk.accepted)
    }

    fn partial(&self) -> Option<&'a Partial> {
        self.known.partial.as_ref().filter(|p| p.choices == self.walk.accepted)
    }

    fn place(&self) -> Option<&'a Place> {
        let partial = || self.partial().and_then(|p| p.place.as_deref());
        self.round().map(|r| &r.place).or_else(partial)
    }

    fn candidates(&self) -> &'a [Candidate] {
        let partial = || self.partial().map_or(&[][..], |p| &p.candidates);
        self.round().map_or_else(partial, |r| &r.candidates)
    }

    /// The candidates of the place that was picked; all if none was.
    fn offered(&self) -> impl Iterator<Item = &'a Candidate> + use<'a> {
        let site = self.site;
        self.candidates().iter().filter(move |c| site.is_none() || c.place == site)
    }

    /// Standard deviation of the noise of the sensor whose record is shown.
    fn noise(&self, trace: &Trace) -> f64 {
        let other = self.mass.checked_sub(1).and_then(|k| trace.others.get(k));
        other.map_or(self.known.noise_floor, |o| o.noise)
    }

    fn looking(&self) -> bool {
        self.running.is_some_and(|r| r.want == Want::Look) && self.round().is_none()
    }

    /// The stage that comes of adding a candidate.
    fn with(&self, choice: &Choice) -> Option<&'a Arc<Stage>> {
        let found = self.candidates().iter().find(|c| c.choice == *choice).and_then(|c| c.stage.as_ref());
        found.or_else(|| {
            let mut choices = self.walk.accepted.clone();
            choices.push(choice.clone());
            self.known.stages.get(&choices)
        })
    }
}

/// A candidate that may be added: refitted and not refused.
fn stands(candidate: &Candidate) -> bool {
    matches!(candidate.standing, Standing::Refitted)
}

impl Missing {
    /// Notes how far the search has come.
    pub(crate) fn progress(&mut self, progress: Progress) {
        if let Some(running) = &mut self.running {
            running.sentence = progress.stage.unwrap_or(running.sentence);
            running.share = progress.share.unwrap_or(0.0).max(running.share);
        }
    }

    /// True once a look for missing effects has come to its end.
    pub(crate) fn looked(&self) -> bool {
        !self.known.rounds.is_empty()
    }

    /// The step that is in view.
    pub(crate) fn step(&self) -> RoundStep {
        self.step
    }

    /// Begins with a step in view: that of a walk that comes back.
    pub(crate) fn begin_at(&mut self, step: RoundStep) -> Option<Wanted> {
        let wanted = self.forget();
        self.step = step;
        wanted
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
                if self.running.is_some_and(|r| r.want == Want::Try) {
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
            Some(Running { want: Want::Try, .. }) => {
                let choice = self.selected.clone();
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
    pub(crate) fn attend(&mut self, bench: &Bench, edit: &Edit) -> Option<Wanted> {
        if bench.records.is_empty() {
            return self.forget();
        }
        let key = key(bench, edit)?;
        if self.known.key.as_ref() != Some(&key) {
            let other_records = self.known.key.as_ref().is_none_or(|k| k.generation != key.generation);
            if other_records {
                self.forget();
            }
            self.shelf.put_aside();
            let mut stages = std::mem::take(&mut self.known.stages);
            let accepted = &edit.walk.accepted;
            let shown = (0..=accepted.len()).rev().find_map(|n| stages.remove(&accepted[..n]));
            let before = shown.or(self.known.before.take());
            self.known = Known { key: Some(key), before, ..Known::default() };
            self.pass_over();
            return self.ask(bench, edit, Want::Stages);
        }
        if self.running.is_some() || self.stopped || self.known.failure.is_some() {
            return None;
        }
        if !self.known.stages.contains_key(&edit.walk.accepted) {
            self.ask(bench, edit, Want::Stages)
        } else if std::mem::take(&mut self.by_itself) && self.known.rounds.is_empty() {
            self.ask(bench, edit, Want::Look)
        } else if !edit.walk.accepted.is_empty() && !self.known.conclusions.contains_key(&edit.walk.accepted) {
            self.ask(bench, edit, Want::Conclusion)
        } else {
            None
        }
    }

    /// Forgets what was chosen among candidates that are no more.
    fn pass_over(&mut self) {
        self.selected = None;
        self.skipped.clear();
    }

    fn forget(&mut self) -> Option<Wanted> {
        self.known.key.as_ref()?;
        self.running = None;
        self.shelf.put_aside();
        self.known = Known::default();
        self.pass_over();
        (self.step, self.record, self.verified, self.revealed) = (RoundStep::Compare, 0, None, false);
        (self.site, self.profile) = (None, None);
        Some(Wanted::Nothing)
    }

    fn ask(&mut self, bench: &Bench, edit: &Edit, want: Want) -> Option<Wanted> {
        let key = self.known.key.clone()?;
        let accepted = &edit.walk.accepted;
        let rounds = (0..=accepted.len()).map_while(|n| self.known.rounds.get(&accepted[..n]).cloned()).collect();
        self.known.failure = None;
        self.known.refused = None;
        self.stopped = false;
        self.running = Some(Running { want, sentence: "Preparing the records", share: 0.0 });
        if want == Want::Look {
            self.known.partial = Some(Partial { choices: accepted.clone(), ..Partial::default() });
        }
        let kept = if want == Want::Stages { self.shelf.candidates() } else { Vec::new() };
        let (records, choices) = (bench.set(&edit.usage), accepted.clone());
        Some(Wanted::Search(Box::new(Request { key, records, choices, rounds, kept, want })))
    }

    /// Does what was asked for.
    pub(crate) fn act(&mut self, act: Act, bench: &Bench, edit: &mut Edit) -> Option<Wanted> {
        match act {
            Act::Look => {
                self.pass_over();
                self.step = RoundStep::Compare;
                self.known.rounds.remove(&edit.walk.accepted);
                self.known.conclusions.remove(&edit.walk.accepted);
                return self.ask(bench, edit, Want::Look);
            }
            Act::Cancel => {
                self.running = None;
                self.stopped = true;
                return Some(Wanted::Nothing);
            }
            Act::Restart => {
                edit.walk = Walk::default();
                self.known.failure = None;
                self.pass_over();
                self.step = RoundStep::Compare;
            }
            Act::Reveal => self.revealed = true,
            Act::Go(step) => self.step = step,
            Act::Select(choice) => self.selected = Some(choice),
            Act::Try(choice) => {
                let key = self.known.key.clone()?;
                let mut choices = edit.walk.accepted.clone();
                choices.push(choice.clone());
                self.selected = Some(choice);
                self.known.refused = None;
                let sentence = "Fitting the effect to the measured response";
                self.running = Some(Running { want: Want::Try, sentence, share: 0.0 });
                let (records, rounds, kept) = (bench.set(&edit.usage), Vec::new(), Vec::new());
                let request = Request { key, records, choices, rounds, kept, want: Want::Try };
                return Some(Wanted::Search(Box::new(request)));
            }
            Act::Accept(choice) => {
                let subject = Subject::of(bench);
                let sight = self.sight(&self.known, &edit.walk, &subject, false);
                // An effect may replace a simpler one that it contains.
                let accepted = match sight.with(&choice) {
                    Some(stage) => stage.effects.iter().map(|e| e.choice.clone()).collect(),
                    None => edit.walk.accepted.iter().cloned().chain([choice]).collect(),
                };
                edit.walk.accepted = accepted;
                self.pass_over();
                self.step = RoundStep::Verify;
                return self.ask(bench, edit, Want::Conclusion);
            }
            // The window does these: they concern more than the room.
            Act::Use | Act::Copy | Act::SaveFigure(_) | Act::SaveTable(..) => {}
            Act::Undo => {
                edit.walk.accepted.pop();
                self.pass_over();
                self.step = if self.known.rounds.contains_key(&edit.walk.accepted) {
                    RoundStep::Add
                } else {
                    RoundStep::Compare
                };
            }
        }
        None
    }

    /// What the steps see.
    fn sight<'a>(&self, known: &'a Known, walk: &'a Walk, subject: &'a Subject, dark: bool) -> Sight<'a> {
        let unit = subject.sensors.first().map_or("", |s| s.unit.as_str());
        Sight { walk, known, running: self.running, subject, mass: self.mass, site: self.site, unit, dark }
    }

    /// Shows the candidates of a place alone; those of every place if it was picked before.
    fn pick(&mut self, site: Site) {
        self.site = if self.site == Some(site) { None } else { Some(site) };
        self.selected = None;
        self.profile = None;
    }

    /// Draws the centre; `mass` is the one whose response is shown.
    pub(crate) fn show(&mut self, ui: &mut Ui, bench: &Bench, edit: &Edit, mass: &mut usize) -> Vec<Act> {
        let mut acts = Vec::new();
        self.hovered = None;
        let subject = Subject::of(bench);
        self.mass = (*mass).min(subject.masses().saturating_sub(1));
        ui.spacing_mut().item_spacing = vec2(6.0, 3.0);
        let known = std::mem::take(&mut self.known);
        let walk = edit.walk.clone();
        let sight = self.sight(&known, &walk, &subject, ui.visuals().dark_mode);
        steps::show(ui, self, &sight, bench.truth.is_some(), &mut acts);
        let shown = self.mass;
        ui.scope(|ui| {
            ui.visuals_mut().extreme_bg_color = crate::app::plot::palette::ground(sight.dark);
            match (&known.failure, sight.stage()) {
                (Some(failure), _) => {
                    if words::failure(ui, failure, walk != Walk::default()) {
                        acts.push(Act::Restart);
                    }
                }
                (None, None) => {
                    ui.centered_and_justified(|ui| ui.weak("fitting the base model…"));
                }
                (None, Some(stage)) => match self.step {
                    RoundStep::Compare => compare::show(ui, self, &sight, stage, &mut acts),
                    RoundStep::Name => name::show(ui, self, &sight, &mut acts),
                    RoundStep::Add => add::show(ui, self, &sight, stage, &mut acts),
                    RoundStep::Verify => verify::show(ui, self, &sight, &mut acts),
                },
            }
        });
        self.known = known;
        self.figures.tidy();
        if self.mass != shown {
            *mass = self.mass;
        }
        acts
    }

    /// Draws the room's part of the left column.
    pub(crate) fn controls(&mut self, ui: &mut Ui, bench: &Bench, edit: &mut Edit) -> Vec<Act> {
        base::column(ui, self, bench, edit)
    }

    /// The settings of Identify that take the model as it stands over; none while it is being fitted.
    pub(crate) fn taken_over(&self, edit: &Edit) -> Option<Result<Settings, String>> {
        self.stage(&edit.walk).map(|stage| base::settings(stage, &edit.settings))
    }

    /// Draws the right column.
    pub(crate) fn findings(&mut self, ui: &mut Ui, bench: &Bench, edit: &Edit) {
        let subject = Subject::of(bench);
        let sight = self.sight(&self.known, &edit.walk, &subject, ui.visuals().dark_mode);
        if let Some(truth) = bench.truth.as_ref().filter(|_| self.revealed) {
            findings::truth(ui, &sight, truth);
        }
        findings::show(
            ui,
            &sight,
            self.hovered.as_ref().or(self.selected.as_ref()).filter(|_| self.step == RoundStep::Add),
        );
    }
}

/// What the walk is of; none while the equation that it starts from is not known.
fn key(bench: &Bench, edit: &Edit) -> Option<Key> {
    let base = match &edit.walk.base {
        Base::Linear => None,
        Base::Typed(terms) => Some(terms.clone()),
        Base::Identified => Some(identified(bench)?),
    };
    Some(Key { generation: bench.generation, usage: edit.usage.clone(), base })
}

/// The terms of the identified acceleration.
fn identified(bench: &Bench) -> Option<Vec<Term>> {
    let model = &bench.outcome.as_ref()?.model;
    if model.layout.kind != Kind::SecondOrder {
        return None;
    }
    Some(model.leading()?.terms.iter().map(|t| t.term.clone()).collect())
}

/// The colour of a stage of the walk: the base's is the model's own, then that of the effect that was added.
fn stage_color(index: usize, dark: bool) -> egui::Color32 {
    super::plot::palette::Ink::of_stage(index).color(dark)
}
