//! What has come of a stream.

use std::collections::VecDeque;
use std::sync::Arc;

use super::work::StreamPart;
use sindyscope_analysis::watch::{
    ArrivalCounts, Settled, WatchEvent, alarm_words, cleared_words, settled_words, stream_figure,
};
use sindyscope_core::study::{AlarmChange, StreamUpdate};
use sindyscope_report::figure::Figure;
use sindyscope_values::format::number::significant;
use sindyscope_values::record::Record;

/// Updates that are kept for the figures: an hour of blocks of a second, and more.
const MOST_UPDATES: usize = 4000;
/// Alarms and notices that are kept.
const MOST_LINES: usize = 100;

/// What has come of a stream.
#[derive(Debug, Default)]
pub(crate) struct StreamRoom {
    /// Whether the figures stand still while the stream goes on, and what came meanwhile.
    pub(crate) paused: bool,
    held: Vec<StreamPart>,
    pub(crate) settled: Option<Box<Settled>>,
    pub(crate) updates: VecDeque<StreamUpdate>,
    pub(crate) counts: ArrivalCounts,
    pub(crate) filled: Option<f64>,
    pub(crate) waiting: Option<String>,
    /// The last seconds.
    pub(crate) record: Option<Arc<Record>>,
    /// Alarms with their ends, and notices, the newest first.
    pub(crate) lines: VecDeque<String>,
    pub(crate) alarms: usize,
    /// Why the stream is followed no longer, if it was not a person who ended it.
    pub(crate) failure: Option<String>,
    pub(crate) ended: bool,
    /// Changes whenever the figures do.
    pub(crate) generation: u64,
}

impl StreamRoom {
    /// Nothing is known yet of a stream that is followed from now on.
    pub(crate) fn begin(&mut self) {
        *self = Self { filled: Some(0.0), generation: self.generation + 1, ..Self::default() };
    }

    /// Takes in what came; while the figures stand still it is held, and nothing is lost.
    pub(crate) fn take(&mut self, part: StreamPart) {
        if self.paused {
            self.held.push(part);
            return;
        }
        self.generation += 1;
        let StreamPart { events, counts, filled, record, waiting } = part;
        (self.counts, self.filled, self.waiting) = (counts, filled, waiting);
        if let Some(record) = record {
            self.record = Some(Arc::new(record));
        }
        for event in events {
            match event {
                WatchEvent::Notice(text) => self.note(text),
                WatchEvent::Settled(settled) => {
                    self.note(settled_words(&settled));
                    self.settled = Some(settled);
                }
                WatchEvent::Update(update) => self.update(*update),
            }
        }
    }

    /// Lets the figures stand, or takes in what came meanwhile.
    pub(crate) fn pause(&mut self, paused: bool) {
        self.paused = paused;
        if !paused {
            std::mem::take(&mut self.held).into_iter().for_each(|part| self.take(part));
        }
    }

    /// The stream has ended, or cannot be followed.
    pub(crate) fn end(&mut self, failure: Option<String>) {
        self.pause(false);
        (self.ended, self.failure) = (true, failure);
        self.waiting = None;
    }

    /// What the line at the bottom says.
    pub(crate) fn said(&self) -> String {
        let text = match (&self.failure, &self.settled) {
            (Some(failure), _) => return failure.clone(),
            (None, Some(settled)) => {
                format!("the last {} s identified · alarms: {}", significant(settled.last, 3), self.alarms)
            }
            (None, None) if self.filled.is_some() && !self.ended => return "waiting for the first seconds…".to_owned(),
            (None, None) => String::new(),
        };
        match (self.ended, text.is_empty()) {
            (true, true) => "ended".to_owned(),
            (true, false) => format!("{text} · ended"),
            (false, _) => text,
        }
    }

    /// The newest of what was identified.
    pub(crate) fn last(&self) -> Option<&StreamUpdate> {
        self.updates.back()
    }

    /// The alarm that stands, in words.
    pub(crate) fn alarm(&self) -> Option<String> {
        let update = self.last()?;
        let alarm = update.alarm.as_ref()?;
        let since = significant(alarm.since, 5);
        let what = alarm_words(alarm, &update.model.layout);
        Some(format!("Since {since} s the model no longer explains what arrives: {what}."))
    }

    /// The figure of all this.
    pub(crate) fn figure(&self) -> Option<Figure> {
        let settled = self.settled.as_deref();
        stream_figure(self.record.as_deref(), settled, self.updates.iter())
    }

    fn update(&mut self, update: StreamUpdate) {
        let time = significant(update.time, 5);
        match (update.change, &update.alarm) {
            (Some(AlarmChange::Raised), Some(alarm)) => {
                self.alarms += 1;
                self.note(format!("{time} s: alarm, {}", alarm_words(alarm, &update.model.layout)));
            }
            (Some(AlarmChange::Cleared(why)), _) => {
                let last = self.settled.as_ref().map_or(0.0, |s| s.last);
                self.note(format!("{time} s: the alarm ended, {}", cleared_words(why, last)));
            }
            _ => {}
        }
        self.updates.push_back(update);
        if self.updates.len() > MOST_UPDATES {
            self.updates.pop_front();
        }
    }

    fn note(&mut self, text: String) {
        self.lines.push_front(text);
        self.lines.truncate(MOST_LINES);
    }
}
