//! The room's background work: one thread, the newest question only, telling as it goes.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use crate::app::worker::{Busy, Worker};
use sindyscope_core::study::Cancel;
use sindyscope_search::{
    Ask, Blind, Candidate, Choice, Diagnosis, Finding, Found, GapError, Place, Progress, Restored, Round, Search, Stage,
};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::Term;

/// The records and the base model that everything found belongs to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Key {
    pub(crate) generation: u64,
    pub(crate) usage: Vec<Usage>,
    /// Terms of the base; none for a linear spring and damper.
    pub(crate) base: Option<Vec<Term>>,
}

/// How far to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Want {
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
pub(crate) struct Question {
    /// Its number, given when it is asked.
    pub(crate) ticket: u64,
    pub(crate) key: Key,
    pub(crate) records: RecordSet,
    pub(crate) choices: Vec<Choice>,
    /// The rounds that led to them, as far as they are known.
    pub(crate) rounds: Vec<Arc<Round>>,
    /// Walks that were kept: the first that is of these records and this base comes back.
    pub(crate) kept: Vec<Arc<Found>>,
    pub(crate) want: Want,
}

/// What is told on the way.
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
    Step(&'static str, f64),
    Place(Box<Place>),
    Ranking(Vec<Candidate>),
    Round(Vec<Choice>, Arc<Round>),
    Concluded(Vec<Choice>, Arc<Diagnosis>),
    Failed(String),
    /// Nothing more comes.
    Done,
}

/// The thread and what it tells.
pub(crate) struct Work {
    worker: Worker<Question, u64>,
    events: Receiver<(u64, Event)>,
    /// The number of the last question, and of the one whose events are wanted.
    ticket: u64,
    wanted: Option<u64>,
}

impl Work {
    pub(crate) fn new(wake: impl Fn() + Clone + Send + Sync + 'static) -> std::io::Result<Self> {
        let (send, events) = channel();
        let mut desk: Option<Desk> = None;
        let woken = wake.clone();
        let worker = Worker::spawn(
            "missing",
            wake,
            move |question: Question, cancel, _| {
                let ticket = question.ticket;
                let teller = Teller { send: &send, wake: &woken, ticket };
                answer(&mut desk, question, &teller, cancel);
                Some(ticket)
            },
            || 0,
        )?;
        Ok(Self { worker, events, ticket: 0, wanted: None })
    }

    /// Asks; whatever else runs is stopped, and told of no more.
    pub(crate) fn ask(&mut self, question: Question) {
        self.ticket += 1;
        self.wanted = Some(self.ticket);
        self.worker.ask_instead(Question { ticket: self.ticket, ..question });
    }

    /// Stops; nothing of it is told any more.
    pub(crate) fn cancel(&mut self) {
        self.wanted = None;
        self.worker.cancel();
    }

    /// The next event of the last question.
    pub(crate) fn event(&mut self) -> Option<Event> {
        // The events of a run lie in the channel before its answer does.
        while let Ok((ticket, event)) = self.events.try_recv() {
            if Some(ticket) == self.wanted {
                if matches!(event, Event::Done | Event::Failed(_)) {
                    self.wanted = None;
                }
                return Some(event);
            }
        }
        while let Some(ticket) = self.worker.answer() {
            // A run that told no end has crashed.
            if ticket == 0 && self.wanted.take().is_some() {
                let text = "the search failed by an error of the program itself; please report what you did";
                return Some(Event::Failed(text.to_owned()));
            }
        }
        None
    }

    /// What runs or waits, also if it was cancelled and has not noticed yet.
    pub(crate) fn busy(&self) -> Option<Busy> {
        self.worker.busy()
    }

    /// Whether an answer is expected.
    pub(crate) fn expected(&self) -> bool {
        self.wanted.is_some()
    }
}

struct Teller<'a> {
    send: &'a Sender<(u64, Event)>,
    wake: &'a (dyn Fn() + Sync),
    ticket: u64,
}

impl Teller<'_> {
    fn tell(&self, event: Event) {
        // The window may be closing.
        let _ = self.send.send((self.ticket, event));
        (self.wake)();
    }
}

/// The search that was made last, and what tells its records from others.
struct Desk {
    key: Key,
    search: Arc<Search>,
    records: String,
}

fn answer(desk: &mut Option<Desk>, question: Question, teller: &Teller<'_>, cancel: &Cancel) {
    match run(desk, question, teller, cancel) {
        Ok(()) | Err(GapError::Cancelled) => teller.tell(Event::Done),
        Err(error) => teller.tell(Event::Failed(for_the_window(&error))),
    }
}

fn run(desk: &mut Option<Desk>, question: Question, teller: &Teller<'_>, cancel: &Cancel) -> Result<(), GapError> {
    let Question { key, records, choices, mut rounds, kept, want, .. } = question;
    let base = key.base.clone();
    let (search, records) = match desk.as_ref().filter(|desk| desk.key == key) {
        Some(desk) => (Arc::clone(&desk.search), desk.records.clone()),
        None => {
            teller.tell(Event::Step("Preparing the records", 0.0));
            let ask = Ask { base: key.base.clone(), ..Ask::default() };
            let search = Arc::new(Search::new(&records, &ask)?);
            let records = Found::records_of(&records);
            *desk = Some(Desk { key, search: Arc::clone(&search), records: records.clone() });
            (search, records)
        }
    };
    let ready = Event::Ready {
        records: records.clone(),
        noise_floor: search.noise_floor(),
        notices: search.notices().map(str::to_owned).collect(),
        blind: search.blind().to_vec(),
    };
    teller.tell(ready);
    let mut known = HashMap::new();
    if let Some(found) = kept.into_iter().find(|found| found.is_of(&records, base.as_deref())) {
        teller.tell(Event::Step("Bringing back what was found", 0.0));
        if let Some(restored) = search.restore(&found, cancel)? {
            known.clone_from(&restored.stages);
            teller.tell(Event::Restored(Box::new(restored), found));
        }
    }
    let mut stages = Vec::new();
    for count in 0..=choices.len() {
        if let Some(stage) = known.remove(&choices[..count]) {
            stages.push(stage);
            continue;
        }
        teller
            .tell(Event::Step("Fitting the model to the measured response", count as f64 / (1 + choices.len()) as f64));
        let stage = search.stage(&choices[..count], cancel)?;
        teller.tell(Event::Stage(choices[..count].to_vec(), Arc::clone(&stage)));
        stages.push(stage);
    }
    if matches!(want, Want::Stages | Want::Try) {
        return Ok(());
    }
    let Some(last) = stages.last() else { return Ok(()) };
    if want == Want::Look {
        let hear = |progress: Progress| {
            teller.tell(match progress {
                Progress::Step(sentence, share) => Event::Step(sentence, share),
                Progress::Place(place) => Event::Place(place),
                Progress::Ranking(candidates) => Event::Ranking(candidates),
            });
        };
        let round = Arc::new(search.look(last, &hear, cancel)?);
        teller.tell(Event::Round(choices.clone(), Arc::clone(&round)));
        rounds.truncate(choices.len());
        rounds.push(round);
    }
    teller.tell(Event::Step("Asking what these data could still hide", 1.0));
    let rounds: Vec<Round> = rounds.iter().map(|r| Round::clone(r)).collect();
    let conclusion = search.conclude(rounds, stages, cancel)?;
    teller.tell(Event::Concluded(choices, Arc::new(conclusion)));
    Ok(())
}

/// An error's sentence with the remedy that the window has.
fn for_the_window(error: &GapError) -> String {
    let text = error.to_string();
    match error {
        GapError::Base => text.replace("give other --terms", "choose another base model above"),
        GapError::NothingToFit => "there is nothing to fit: mark at least one record as fit".to_owned(),
        _ => text,
    }
}

/// True if the round ends the walk: there is nothing to add.
pub(crate) fn ends(round: &Round) -> bool {
    matches!(round.finding, Finding::Nothing | Finding::Unexplained)
}
