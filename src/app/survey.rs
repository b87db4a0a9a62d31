//! The map of settings, computed beside everything else while a view shows it.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

use super::state::Edit;
use super::worker::{Busy, Worker};
use sindyscope_core::study::{Landscape, Settings, StudyError, landscape};
use sindyscope_values::record::{RecordSet, Usage};

/// Segment lengths and thresholds of a full map.
const SIZE: (usize, usize) = (25, 25);

/// What a map depends on: everything but the two settings that it is spread over.
#[derive(Clone, Debug, PartialEq)]
struct Ground {
    generation: u64,
    usage: Vec<Usage>,
    settings: Settings,
}

impl Ground {
    fn new(generation: u64, edit: &Edit) -> Self {
        let mut settings = edit.settings.clone();
        settings.smoothing = settings.smoothing.with_window(0);
        settings.threshold = 0.0;
        Self { generation, usage: edit.usage.clone(), settings }
    }
}

struct Question {
    ticket: u64,
    records: RecordSet,
    settings: Settings,
}

/// What the search said last, by the number of the question.
type Answer = Option<(u64, Result<Landscape, StudyError>)>;

/// The map that is being made, or was.
pub(crate) struct Survey {
    worker: Worker<Question, Answer>,
    parts: Receiver<(u64, Landscape)>,
    ticket: u64,
    ground: Option<Ground>,
    map: Option<(Ground, Arc<Landscape>)>,
    failure: Option<String>,
}

impl Survey {
    /// Starts the thread; `wake` is called whenever there is more to see.
    pub(crate) fn new(wake: impl Fn() + Clone + Send + Sync + 'static) -> std::io::Result<Self> {
        let (send, parts) = channel();
        let more = wake.clone();
        let worker = Worker::spawn(
            "survey",
            wake,
            move |question: Question, cancel, _| {
                let Question { ticket, records, settings } = question;
                let tell = |map: Landscape| {
                    // The window may be closing.
                    let _ = send.send((ticket, map));
                    more();
                };
                Some(Some((ticket, landscape(&records, &settings, SIZE, cancel, &tell))))
            },
            || None,
        )?;
        Ok(Self { worker, parts, ticket: 0, ground: None, map: None, failure: None })
    }

    /// Asks for the map of these records and settings, unless it is there or on its way.
    pub(crate) fn want(&mut self, generation: u64, edit: &Edit, records: impl FnOnce() -> RecordSet) {
        let ground = Ground::new(generation, edit);
        if self.ground.as_ref() == Some(&ground) {
            return;
        }
        if self.map.as_ref().is_some_and(|(known, _)| known.generation != generation) {
            self.map = None;
        }
        self.ticket += 1;
        self.failure = None;
        self.ground = Some(ground);
        let question = Question { ticket: self.ticket, records: records(), settings: edit.settings.clone() };
        self.worker.ask_instead(question);
    }

    /// Stops the search for records that are no longer wanted.
    pub(crate) fn forget(&mut self) {
        self.worker.cancel();
        (self.ground, self.map, self.failure) = (None, None, None);
    }

    /// Takes in what was found meanwhile.
    pub(crate) fn collect(&mut self) {
        while let Ok((ticket, map)) = self.parts.try_recv() {
            self.take(ticket, map);
        }
        while let Some(answer) = self.worker.answer() {
            match answer {
                Some((ticket, Ok(map))) => self.take(ticket, map),
                Some((_, Err(StudyError::Cancelled))) => {}
                Some((ticket, Err(error))) if ticket == self.ticket => self.failure = Some(error.to_string()),
                Some(_) => {}
                None => self.failure = Some("the map failed by an error of the program itself".into()),
            }
        }
    }

    fn take(&mut self, ticket: u64, map: Landscape) {
        if let Some(ground) = self.ground.as_ref().filter(|_| ticket == self.ticket) {
            self.map = Some((ground.clone(), Arc::new(map)));
        }
    }

    /// The map as far as it is known, and whether it is that of older settings.
    pub(crate) fn map(&self) -> Option<(&Arc<Landscape>, bool)> {
        self.map.as_ref().map(|(ground, map)| (map, self.ground.as_ref() != Some(ground)))
    }

    /// Why there is no map.
    pub(crate) fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// What runs, or waits to.
    pub(crate) fn busy(&self) -> Option<Busy> {
        self.worker.busy()
    }
}
