//! The room's background work: the search for the records and base model at hand, telling as it goes.

use std::collections::HashMap;
use std::sync::Arc;

use crate::app::disk::checksum;
use crate::app::remedy;
use crate::app::state::OwnEffects;
use sindyscope_core::remedy::Remedy;
use sindyscope_core::study::Cancel;
use sindyscope_search::{
    Ask, Blind, Candidate, Choice, Diagnosis, Finding, Found, GapError, Place, Progress, Restored, Round, Search, Stage,
};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::Term;

/// The records and the base model that everything found belongs to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SearchKey {
    pub(crate) generation: u64,
    pub(crate) usage: Vec<Usage>,
    /// Terms of the base; none for a linear spring and damper.
    pub(crate) base: Option<Vec<Term>>,
    /// Effects of the person's own, searched beside the catalogue's.
    pub(crate) own: OwnEffects,
}

/// What tells records, searched with these effects of a person's own, from others: a walk that is kept belongs to both.
pub(crate) fn subject_of(records: &RecordSet, own: &OwnEffects) -> String {
    let records = Found::records_of(records);
    if own.effects().is_empty() {
        records
    } else {
        format!("{records}; own effects {}", checksum(own.text().as_bytes()))
    }
}

/// How far to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SearchDepth {
    /// The stages alone.
    Stages,
    /// The stages, the last of which is tried and not added.
    Try,
    /// What the walk has come to.
    Conclusion,
    /// A look at the last stage, and what that comes to.
    Look,
}

/// What to do.
#[derive(Debug)]
pub(crate) struct SearchRequest {
    pub(crate) key: SearchKey,
    pub(crate) records: RecordSet,
    pub(crate) choices: Vec<Choice>,
    /// The rounds that led to them, as far as they are known.
    pub(crate) rounds: Vec<Arc<Round>>,
    /// The stages on the way that are known, by their effects.
    pub(crate) stages: HashMap<Vec<Choice>, Arc<Stage>>,
    /// Walks that were kept: the first that is of these records and this base comes back.
    pub(crate) kept: Vec<Arc<Found>>,
    pub(crate) want: SearchDepth,
}

/// What is found on the way.
#[derive(Debug)]
pub(crate) enum Event {
    /// The records are ready.
    Ready {
        /// What tells them from others.
        records: String,
        noise_floor: f64,
        notices: Vec<String>,
        blind: Vec<Blind>,
    },
    /// A walk that was kept is as it was.
    Restored(Box<Restored>, Arc<Found>),
    Stage(Vec<Choice>, Arc<Stage>),
    Place(Box<Place>),
    Ranking(Vec<Candidate>),
    Round(Vec<Choice>, Arc<Round>),
    Concluded(Vec<Choice>, Arc<Diagnosis>),
}

/// Who is told on the way.
pub(crate) struct Teller<'a> {
    /// What was found.
    pub(crate) tell: &'a (dyn Fn(Event) + Sync),
    /// What is done at the moment, and the share of the whole that is done.
    pub(crate) stage: &'a (dyn Fn(&'static str, f64) + Sync),
}

/// The search that was made last, and what tells its records from others.
pub(crate) struct CachedSearch {
    key: SearchKey,
    search: Arc<Search>,
    records: String,
}

/// Does what is asked; what is found is told as soon as it is known.
///
/// # Errors
/// The search cannot be made of these records and this base, or it was cancelled.
pub(crate) fn run(
    cached: &mut Option<CachedSearch>,
    request: SearchRequest,
    teller: &Teller<'_>,
    cancel: &Cancel,
) -> Result<(), String> {
    let SearchRequest { key, records, choices, rounds, stages: mut known, kept, want } = request;
    let told = |e: GapError| for_the_window(&e);
    let (search, records) = search_of(cached, &key, &records, teller, cancel).map_err(told)?;
    (teller.tell)(Event::Ready {
        records: records.clone(),
        noise_floor: search.noise_floor(),
        notices: search.notices().map(str::to_owned).collect(),
        blind: search.blind().to_vec(),
    });
    if let Some(found) = kept.into_iter().find(|found| found.is_of(&records, key.base.as_deref())) {
        (teller.stage)("Bringing back what was found", 0.0);
        if let Some(restored) = search.restore(&found, cancel).map_err(told)? {
            known.extend(restored.stages.clone());
            (teller.tell)(Event::Restored(Box::new(restored), found));
        }
    }
    let mut stages = Vec::new();
    for count in 0..=choices.len() {
        if let Some(stage) = known.remove(&choices[..count]) {
            stages.push(stage);
            continue;
        }
        (teller.stage)("Fitting the model to the measured response", count as f64 / (1 + choices.len()) as f64);
        let stage = search.stage(&choices[..count], cancel).map_err(told)?;
        (teller.tell)(Event::Stage(choices[..count].to_vec(), Arc::clone(&stage)));
        stages.push(stage);
    }
    match want {
        SearchDepth::Stages | SearchDepth::Try => Ok(()),
        SearchDepth::Look | SearchDepth::Conclusion => {
            conclude(&search, (choices, rounds, stages), want == SearchDepth::Look, teller, cancel).map_err(told)
        }
    }
}

/// The search of these records, made anew unless it is the last one, and what tells the records from others.
fn search_of(
    cached: &mut Option<CachedSearch>,
    key: &SearchKey,
    records: &RecordSet,
    teller: &Teller<'_>,
    cancel: &Cancel,
) -> Result<(Arc<Search>, String), GapError> {
    if let Some(cached) = cached.as_ref().filter(|cached| cached.key == *key) {
        return Ok((Arc::clone(&cached.search), cached.records.clone()));
    }
    (teller.stage)("Preparing the records", 0.0);
    let ask = Ask { base: key.base.clone(), effects: key.own.effects().to_vec(), ..Ask::default() };
    let search = Arc::new(Search::prepare(records, &ask, cancel)?);
    let records = subject_of(records, &key.own);
    *cached = Some(CachedSearch { key: key.clone(), search: Arc::clone(&search), records: records.clone() });
    Ok((search, records))
}

/// Looks for what the last stage lacks, if that is asked, and says what the walk has come to.
fn conclude(
    search: &Search,
    (choices, mut rounds, stages): (Vec<Choice>, Vec<Arc<Round>>, Vec<Arc<Stage>>),
    looks: bool,
    teller: &Teller<'_>,
    cancel: &Cancel,
) -> Result<(), GapError> {
    let Some(last) = stages.last() else { return Ok(()) };
    if looks {
        let hear = |progress: Progress| match progress {
            Progress::Step(sentence, share) => (teller.stage)(sentence, share),
            Progress::Place(place) => (teller.tell)(Event::Place(place)),
            Progress::Ranking(candidates) => (teller.tell)(Event::Ranking(candidates)),
        };
        let round = Arc::new(search.look(last, &hear, cancel)?);
        (teller.tell)(Event::Round(choices.clone(), Arc::clone(&round)));
        rounds.truncate(choices.len());
        rounds.push(round);
    }
    (teller.stage)("Asking what these data could still hide", 1.0);
    let rounds: Vec<Round> = rounds.iter().map(|r| Round::clone(r)).collect();
    let conclusion = search.conclude(rounds, stages, cancel)?;
    (teller.tell)(Event::Concluded(choices, Arc::new(conclusion)));
    Ok(())
}

/// An error's sentence with the remedy that the window has.
fn for_the_window(error: &GapError) -> String {
    match error {
        GapError::Base => format!("{error}: {}", remedy::worded(&[Remedy::OtherBase])),
        GapError::NothingToFit => "there is nothing to fit: mark at least one record as fit".to_owned(),
        _ => error.to_string(),
    }
}

/// True if the round ends the walk: there is nothing to add.
pub(crate) fn ends(round: &Round) -> bool {
    matches!(round.finding, Finding::Nothing | Finding::Unexplained)
}
