//! What was found for a walk, and how the steps see it.

use std::collections::HashMap;
use std::sync::Arc;

use super::subject::WalkSubject;
use super::work::{SearchDepth, SearchKey};
use crate::app::plot::palette::{Ink, Painted as _};
use crate::app::queue::JobProgress;
use crate::app::records::OpenRecords;
use crate::app::state::{Base, Edit, Walk};
use sindyscope_search::{Blind, Candidate, Choice, Diagnosis, Lead, Place, Round, Site, Stage, Standing, Trace};
use sindyscope_values::term::{Kind, Term};

/// Everything found for one set of records and one base.
#[derive(Debug, Default)]
pub(super) struct WalkFindings {
    pub(super) key: Option<SearchKey>,
    /// What tells the records from others.
    pub(super) records: String,
    pub(super) noise_floor: f64,
    pub(super) notices: Vec<String>,
    pub(super) blind: Vec<Blind>,
    pub(super) stages: HashMap<Vec<Choice>, Arc<Stage>>,
    pub(super) rounds: HashMap<Vec<Choice>, Arc<Round>>,
    pub(super) conclusions: HashMap<Vec<Choice>, Arc<Diagnosis>>,
    /// A look that is not done, or was stopped.
    pub(super) partial: Option<Partial>,
    pub(super) failure: Option<String>,
    /// What a candidate that was to be fitted alone came to, where it could not be.
    pub(super) refused: Option<(Choice, String)>,
    /// The last model of other records or another base: in view until the new one comes.
    pub(super) before: Option<Arc<Stage>>,
}

/// A look under way.
#[derive(Debug, Default)]
pub(super) struct Partial {
    pub(super) choices: Vec<Choice>,
    pub(super) place: Option<Box<Place>>,
    pub(super) candidates: Vec<Candidate>,
}

/// What runs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Running {
    pub(super) want: SearchDepth,
    /// What it does at the moment.
    pub(super) sentence: &'static str,
    /// How far it has come.
    pub(super) progress: JobProgress,
}

/// What the steps see.
pub(super) struct WalkContext<'a> {
    pub(super) walk: &'a Walk,
    pub(super) known: &'a WalkFindings,
    pub(super) running: Option<Running>,
    pub(super) subject: &'a WalkSubject,
    /// The mass whose response is shown.
    pub(super) mass: usize,
    /// The place whose candidates are shown alone.
    pub(super) site: Option<Site>,
    /// The unit of what the first sensor shows, in which errors are told.
    pub(super) unit: &'a str,
    pub(super) dark: bool,
}

impl<'a> WalkContext<'a> {
    /// The model as it stands; while it is being fitted, the last one that is known.
    pub(super) fn stage(&self) -> Option<&'a Arc<Stage>> {
        let accepted = &self.walk.accepted;
        let known = (0..=accepted.len()).rev().find_map(|n| self.known.stages.get(&accepted[..n]));
        known.or(self.known.before.as_ref())
    }

    /// The base and the stage after each effect, as far as they are known.
    pub(super) fn stages(&self) -> Vec<&'a Arc<Stage>> {
        let accepted = &self.walk.accepted;
        (0..=accepted.len()).map_while(|n| self.known.stages.get(&accepted[..n])).collect()
    }

    pub(super) fn round(&self) -> Option<&'a Arc<Round>> {
        self.known.rounds.get(&self.walk.accepted)
    }

    /// How far an effect leads the best set without it, and the effect's title: of this index among those that were added, or the
    /// first candidate for the next. None where a person chose another than the first.
    pub(super) fn lead(&self, index: usize) -> Option<(&'a str, &'a Lead)> {
        let accepted = &self.walk.accepted;
        let round = self.known.rounds.get(accepted.get(..index)?)?;
        let first = round.candidates.first()?;
        let added = accepted.get(index).is_none_or(|choice| first.choice == *choice);
        round.lead.as_ref().filter(|_| added).map(|lead| (&*first.title, lead))
    }

    pub(super) fn conclusion(&self) -> Option<&'a Arc<Diagnosis>> {
        self.known.conclusions.get(&self.walk.accepted)
    }

    /// What was concluded where the data fitted show no gap and something else speaks against the model.
    pub(super) fn doubted(&self) -> Option<&'a Arc<Diagnosis>> {
        self.conclusion().filter(|d| !d.explained && !d.remaining.significant)
    }

    pub(super) fn partial(&self) -> Option<&'a Partial> {
        self.known.partial.as_ref().filter(|p| p.choices == self.walk.accepted)
    }

    pub(super) fn place(&self) -> Option<&'a Place> {
        let partial = || self.partial().and_then(|p| p.place.as_deref());
        self.round().map(|r| &r.place).or_else(partial)
    }

    pub(super) fn candidates(&self) -> &'a [Candidate] {
        let partial = || self.partial().map_or(&[][..], |p| &p.candidates);
        self.round().map_or_else(partial, |r| &r.candidates)
    }

    /// The candidates of the place that was picked; all if none was.
    pub(super) fn offered(&self) -> impl Iterator<Item = &'a Candidate> + use<'a> {
        let site = self.site;
        self.candidates().iter().filter(move |c| site.is_none() || c.place == site)
    }

    /// Standard deviation of the noise of the sensor whose record is shown.
    pub(super) fn noise(&self, trace: &Trace) -> f64 {
        let other = self.mass.checked_sub(1).and_then(|k| trace.others.get(k));
        other.map_or(self.known.noise_floor, |o| o.noise)
    }

    pub(super) fn looking(&self) -> bool {
        self.running.is_some_and(|r| r.want == SearchDepth::Look) && self.round().is_none()
    }

    /// The stage that comes of adding a candidate.
    pub(super) fn with(&self, choice: &Choice) -> Option<&'a Arc<Stage>> {
        let found = self.candidates().iter().find(|c| c.choice == *choice).and_then(|c| c.stage.as_ref());
        found.or_else(|| {
            let mut choices = self.walk.accepted.clone();
            choices.push(choice.clone());
            self.known.stages.get(&choices)
        })
    }
}

/// A candidate that may be added: refitted and not refused.
pub(super) fn stands(candidate: &Candidate) -> bool {
    matches!(candidate.standing, Standing::Refitted)
}

/// What the walk is of; none while the equation that it starts from is not known.
pub(super) fn key(data: &OpenRecords, edit: &Edit) -> Option<SearchKey> {
    let base = match &edit.walk.base {
        Base::Linear => None,
        Base::Typed(terms) => Some(terms.clone()),
        Base::Identified => Some(identified(data)?),
    };
    Some(SearchKey { generation: data.generation, usage: edit.usage.clone(), base, own: edit.walk.own.clone() })
}

/// The terms of the identified acceleration.
pub(super) fn identified(data: &OpenRecords) -> Option<Vec<Term>> {
    let model = &data.outcome.as_ref()?.model;
    if model.layout.kind != Kind::SecondOrder {
        return None;
    }
    Some(model.leading()?.terms.iter().map(|t| t.term.clone()).collect())
}

/// The colour of a stage of the walk: the base's is the model's own, then that of the effect that was added.
pub(super) fn stage_color(index: usize, dark: bool) -> egui::Color32 {
    Ink::of_stage(index).color(dark)
}
