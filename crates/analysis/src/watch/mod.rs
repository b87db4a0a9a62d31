//! A stream as it is asked for: text in as it arrives, equations, alarms and notices out.
//!
//! A [`Watch`] reads rows, tells new ones from repeated and late ones, chooses the settings from the first seconds, and hands
//! the samples to a [`Stream`]. It reads no clock: what it tells depends on what has arrived alone. Where bytes come from is
//! `source`'s.

mod arrivals;
mod figure;
mod json;
pub mod source;
mod words;

use std::collections::VecDeque;

use crate::AnalysisProgress;
use crate::analyse::{AnalysisListener, chosen};
use crate::error::AnalysisError;
use crate::request::AnalysisRequest;
use crate::source::KindName;
pub use arrivals::ArrivalCounts;
use arrivals::{Arrivals, Follows, Grid, NewRow};
pub use figure::stream_figure;
pub use json::{summary_json, update_json};
use sindyscope_core::sampling::{self, LEAST_SAMPLES, Sampling};
use sindyscope_core::setting::{Setting, SettingForm, change, positive};
use sindyscope_core::study::{Blocking, Cancel, Settings, Stream, StreamSettings, StreamUpdate, StudyError};
use sindyscope_files::{ArrivedRow, ArrivingRows};
use sindyscope_values::record::{Channel, Record, RecordSet, Usage};
use sindyscope_values::term::Term;
pub use words::{alarm_words, cleared_words, settled_words, summary_words};

/// How a stream is watched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Watching {
    /// How much of the stream is identified, and from how much of it the settings are chosen at first: so many seconds. None:
    /// [`USUAL_LAST`], or more where the motion is so slow that they hold too few of its periods.
    pub last: Option<f64>,
    /// Seconds of the stream between two lines.
    pub every: f64,
    /// False alarms an hour that are allowed.
    pub false_alarms: f64,
}

impl Default for Watching {
    fn default() -> Self {
        Self { last: None, every: 1.0, false_alarms: 0.1 }
    }
}

/// How much of a stream is identified where nothing is said of it, s.
pub const USUAL_LAST: f64 = 20.0;
/// Factor on what is needed of a slow motion.
const MORE_THAN_NEEDED: f64 = 1.5;
/// Blocks that are told of at first: fewer say nothing of their errors, and may be wild.
const FIRST_BLOCKS: usize = 4;

const HEADING: &str = "Stream";

/// The settings of [`Watching`].
pub static WATCHING: &[Setting<Watching>] = &[
    Setting {
        name: "last",
        label: "Last",
        group: HEADING,
        help: "Identify this much of the stream, s: its last seconds. The settings that are left open are chosen from its first ones",
        default: "20, or twelve periods of a slow motion",
        unit: "s",
        form: SettingForm::One("SECONDS"),
        read: |text| positive(text).map(|v| change(move |w: &mut Watching| w.last = Some(v))),
        write: |w| w.last.iter().map(f64::to_string).collect(),
        ..Setting::BLANK
    },
    Setting {
        name: "every",
        label: "Every",
        group: HEADING,
        help: "Tell what is identified this often, in seconds of the stream; alarms are told at once",
        default: "1",
        unit: "s",
        form: SettingForm::One("SECONDS"),
        read: |text| positive(text).map(|v| change(move |w: &mut Watching| w.every = v)),
        write: |w| vec![w.every.to_string()],
        ..Setting::BLANK
    },
    Setting {
        name: "false-alarms",
        label: "False alarms",
        group: HEADING,
        help: "Alarms that a stream in which nothing changes may raise, an hour: fewer are slower to tell a change",
        default: "0.1",
        unit: "per hour",
        form: SettingForm::One("RATE"),
        read: |text| positive(text).map(|v| change(move |w: &mut Watching| w.false_alarms = v)),
        write: |w| vec![w.false_alarms.to_string()],
        ..Setting::BLANK
    },
];

/// What a stream tells.
#[derive(Clone, Debug)]
pub enum WatchEvent {
    /// The settings are chosen; what follows is identified with them.
    Settled(Box<Settled>),
    /// A block was identified.
    Update(Box<StreamUpdate>),
    /// Something that a person should know.
    Notice(String),
}

/// What a stream is identified with.
#[derive(Clone, Debug)]
pub struct Settled {
    /// The settings.
    pub settings: Settings,
    /// How those that were not given were chosen.
    pub choice: Option<String>,
    /// The terms that each equation is made of, those that were dropped among them.
    pub library: Vec<Term>,
    /// The stretch that they were chosen from.
    pub opening: Record,
    /// How the stream is parted into blocks.
    pub blocking: Blocking,
    /// How much of it is identified, s.
    pub last: f64,
}

/// A stream that is watched.
#[derive(Debug)]
pub struct Watch {
    request: AnalysisRequest,
    watching: Watching,
    /// How much of the stream is identified, s.
    last: f64,
    reader: ArrivingRows,
    arrivals: Arrivals,
    rows: Vec<ArrivedRow>,
    state: WatchState,
    /// The newest rows that counted.
    kept: VecDeque<NewRow>,
    told_header: bool,
}

#[derive(Debug)]
enum WatchState {
    /// Rows are collected until they are enough to choose the settings from.
    Opening {
        rows: Vec<NewRow>,
        /// The first row since the source began anew.
        since: usize,
        /// Length of the rows at the last look, s.
        looked: f64,
    },
    Running {
        stream: Box<Stream>,
        grid: Grid,
    },
}

/// Growth of what has come, as a share of what is needed, between two looks at whether it is enough.
const LOOK_AGAIN: f64 = 0.05;
/// Share of the seconds that are identified which a stretch without a gap must have for settings to be chosen from it.
const OPENING_SHARE: f64 = 0.8;

impl Watch {
    /// A stream that messages call by `name`.
    ///
    /// # Errors
    /// A component without a mass is asked for, or calibrations, which need whole records.
    pub fn new(name: &str, request: AnalysisRequest, watching: Watching) -> Result<Self, AnalysisError> {
        if request.source.reading.kind == KindName::Component {
            return Err(AnalysisError::NoMass);
        }
        if !request.calibrations.is_empty() || !request.source.preparing.steps.is_empty() {
            let what = "a stream is identified as it comes: records can be prepared and calibrated, it cannot";
            return Err(AnalysisError::Settings(what.into()));
        }
        let reader = ArrivingRows::new(name, request.source.read_options());
        let last = watching.last.unwrap_or(USUAL_LAST);
        let arrivals = Arrivals::new(request.source.reading.rate.map(f64::recip), 2.0 * last);
        let (rows, kept) = (Vec::new(), VecDeque::new());
        let state = WatchState::Opening { rows: Vec::new(), since: 0, looked: 0.0 };
        Ok(Self { request, watching, last, reader, arrivals, rows, state, kept, told_header: false })
    }

    /// What has become of the rows so far.
    pub fn counts(&self) -> ArrivalCounts {
        self.arrivals.counts
    }

    /// What is measured, once the header has come.
    pub fn channels(&self) -> Option<&[Channel]> {
        self.reader.channels()
    }

    /// Share of what is needed before settings are chosen that has come, 0 to 1; none once they are.
    pub fn filled(&self) -> Option<f64> {
        match &self.state {
            WatchState::Opening { rows, .. } => Some((length(rows) / self.last).min(1.0)),
            WatchState::Running { .. } => None,
        }
    }

    /// The source begins anew, as a file that was cut or replaced.
    pub fn begin_anew(&mut self) {
        self.reader.begin_anew();
        self.arrivals.begin_anew();
    }

    /// Takes what has arrived; `told` gets what comes of it.
    ///
    /// # Errors
    /// A header that cannot be used, settings that do not fit the stream; cancelled.
    pub fn take(
        &mut self,
        bytes: &[u8],
        cancel: &Cancel,
        progress: AnalysisListener<'_>,
        told: &mut Vec<WatchEvent>,
    ) -> Result<(), AnalysisError> {
        let mut arrived = std::mem::take(&mut self.rows);
        self.reader.take(bytes, &mut arrived)?;
        if !self.told_header && self.reader.channels().is_some() {
            self.told_header = true;
            told.extend(self.reader.notices().iter().cloned().map(WatchEvent::Notice));
        }
        let mut new = Vec::with_capacity(arrived.len());
        for row in arrived.drain(..) {
            match row {
                // Whoever gives the rate says that rows are even, whatever their stamps say.
                ArrivedRow::Sample { time, values } => {
                    let time = time.filter(|_| self.request.source.reading.rate.is_none());
                    self.arrivals.take(time, values, &mut new);
                }
                ArrivedRow::Anew => self.arrivals.begin_anew(),
                ArrivedRow::Unreadable(text) => {
                    self.arrivals.counts.unreadable += 1;
                    if self.arrivals.counts.unreadable == 1 {
                        let start: String = text.chars().take(60).collect();
                        told.push(WatchEvent::Notice(format!("a line is no row and was left out: `{start}`")));
                    }
                    self.missing(&mut new);
                }
            }
        }
        self.rows = arrived;
        self.keep(&new);
        self.advance(new, cancel, progress, told)
    }

    /// The source has ended: what is held becomes a last block.
    ///
    /// # Errors
    /// As [`Self::take`].
    pub fn end(
        &mut self,
        cancel: &Cancel,
        progress: AnalysisListener<'_>,
        told: &mut Vec<WatchEvent>,
    ) -> Result<(), AnalysisError> {
        // A last line without its end is a line all the same.
        self.take(b"\n", cancel, progress, told)?;
        if let WatchState::Opening { rows, .. } = &mut self.state {
            let rows = std::mem::take(rows);
            if !rows.is_empty() {
                self.settle(rows, 0.0, cancel, progress, told)?;
            }
        }
        if let WatchState::Running { stream, .. } = &mut self.state {
            told.extend(stream.end().map(|update| WatchEvent::Update(Box::new(update))));
        }
        Ok(())
    }

    /// The newest stretch without a gap of the last seconds; none as long as there is none.
    pub fn record(&self) -> Option<Record> {
        let rows: Vec<NewRow> = self.kept.iter().cloned().collect();
        stretch(&rows, self.channels()?, self.request.source.reading.rate, WhichStretch::Newest).ok().flatten()
    }

    /// Without a column of time a line that is no row is a sample that is missing.
    fn missing(&mut self, new: &mut Vec<NewRow>) {
        if let (true, Some(channels)) = (self.request.source.reading.rate.is_some(), self.reader.channels()) {
            self.arrivals.take(None, vec![f64::NAN; channels.len()], new);
        }
    }

    fn keep(&mut self, new: &[NewRow]) {
        for row in new {
            if row.anew {
                self.kept.clear();
            }
            self.kept.push_back(row.clone());
            while self.kept.front().is_some_and(|first| row.time - first.time > self.last) {
                self.kept.pop_front();
            }
        }
    }

    fn advance(
        &mut self,
        new: Vec<NewRow>,
        cancel: &Cancel,
        progress: AnalysisListener<'_>,
        told: &mut Vec<WatchEvent>,
    ) -> Result<(), AnalysisError> {
        let mut new = new.into_iter();
        // Row by row: whatever pieces text arrives in, the same rows are enough to choose the settings from.
        while let WatchState::Opening { rows, since, looked } = &mut self.state {
            let Some(row) = new.next() else { return Ok(()) };
            if row.anew {
                (*since, *looked) = (rows.len(), 0.0);
            }
            let length = row.time - rows.get(*since).map_or(row.time, |first: &NewRow| first.time);
            rows.push(row);
            if length >= self.last && length >= *looked + LOOK_AGAIN * self.last {
                *looked = length;
                let rows = std::mem::take(rows);
                self.settle(rows, OPENING_SHARE * self.last, cancel, progress, told)?;
            }
        }
        if let WatchState::Running { stream, grid } = &mut self.state {
            run(stream, grid, &mut self.arrivals.counts, new, told);
        }
        Ok(())
    }

    /// Chooses the settings from what has come, if it holds a stretch of at least so many seconds, and runs all of it.
    fn settle(
        &mut self,
        rows: Vec<NewRow>,
        least: f64,
        cancel: &Cancel,
        progress: AnalysisListener<'_>,
        told: &mut Vec<WatchEvent>,
    ) -> Result<(), AnalysisError> {
        let channels = self.reader.channels().unwrap_or_default();
        let found = stretch(&rows, channels, self.request.source.reading.rate, WhichStretch::Longest)?;
        let Some(record) = found.filter(|r| r.duration() >= least) else {
            if let WatchState::Opening { rows: waiting, .. } = &mut self.state {
                *waiting = rows;
            }
            return Ok(());
        };
        let set = RecordSet::new([record.clone()], Usage::Fit);
        let chosen = chosen(&self.request, &set, true, cancel, progress)?;
        progress(AnalysisProgress::Stage("identifying"));
        let mut grid = Grid::new(record.interval);
        let false_alarms = self.watching.false_alarms;
        let settings = StreamSettings { study: chosen.settings.clone(), last: self.last, false_alarms };
        let mut stream = match Stream::new(record.clone(), settings) {
            Err(StudyError::StreamTooShort { needed, .. }) if self.watching.last.is_none() && least > 0.0 => {
                self.last = (MORE_THAN_NEEDED * needed).ceil();
                let last = self.last;
                told.push(WatchEvent::Notice(format!(
                    "the motion is slow: the last {last} s are identified, not {USUAL_LAST}"
                )));
                let since = rows.iter().rposition(|r| r.anew).unwrap_or(0);
                self.state = WatchState::Opening { rows, since, looked: 0.0 };
                return Ok(());
            }
            made => Box::new(made?),
        };
        told.push(WatchEvent::Settled(Box::new(Settled {
            settings: chosen.settings,
            choice: chosen.choice,
            library: stream.terms().to_vec(),
            opening: record,
            blocking: stream.blocking(),
            last: self.last,
        })));
        run(&mut stream, &mut grid, &mut self.arrivals.counts, rows, told);
        self.state = WatchState::Running { stream, grid };
        Ok(())
    }
}

/// Seconds from the first to the last row.
fn length(rows: &[NewRow]) -> f64 {
    // Where the clock was set back only what came since then lies on one time.
    let since = rows.iter().rposition(|r| r.anew).unwrap_or(0);
    rows.get(since).zip(rows.last()).map_or(0.0, |(first, last)| last.time - first.time)
}

/// Hands rows to a stream.
fn run(
    stream: &mut Stream,
    grid: &mut Grid,
    counts: &mut ArrivalCounts,
    rows: impl IntoIterator<Item = NewRow>,
    told: &mut Vec<WatchEvent>,
) {
    let mut tell = |update: Option<StreamUpdate>| {
        let update = update.filter(|u| u.blocks >= FIRST_BLOCKS);
        told.extend(update.map(|u| WatchEvent::Update(Box::new(u))));
    };
    for row in rows {
        let first = grid.is_empty();
        match grid.place(&row) {
            Follows::TooSoon => {
                counts.taken -= 1;
                counts.late += 1;
                continue;
            }
            Follows::Anew => {
                counts.gaps += usize::from(!first && !row.anew);
                tell(stream.begin(row.time));
            }
            Follows::Next => {}
        }
        tell(stream.push(&row.values));
    }
}

/// Which of the stretches between gaps is wanted.
#[derive(Clone, Copy, PartialEq)]
enum WhichStretch {
    Longest,
    /// The newest that is long enough for a record.
    Newest,
}

/// A stretch of rows without a gap since the source began anew last, as a record; none if it is too short for one.
fn stretch(
    rows: &[NewRow],
    channels: &[Channel],
    rate: Option<f64>,
    which: WhichStretch,
) -> Result<Option<Record>, AnalysisError> {
    let since = rows.iter().rposition(|r| r.anew).unwrap_or(0);
    let whole: Vec<&NewRow> = rows[since..].iter().filter(|r| r.values.iter().all(|v| v.is_finite())).collect();
    if whole.len() < LEAST_SAMPLES {
        return Ok(None);
    }
    let mut stamps: Vec<f64> = whole.iter().map(|r| r.time).collect();
    let sampling = match rate {
        Some(rate) => {
            let places: Vec<f64> = stamps.iter().map(|t| (t * rate).round()).collect();
            Sampling { interval: rate.recip(), ..Sampling::with_missing(&places) }
        }
        None => sampling::analyse(&mut stamps).map_err(|irregular| AnalysisError::UnevenStream { irregular })?,
    };
    let mut long = sampling.stretches.iter().filter(|s| s.rows.len() >= LEAST_SAMPLES);
    let found = if which == WhichStretch::Newest { long.next_back() } else { long.max_by_key(|s| s.rows.len()) };
    let Some(stretch) = found else { return Ok(None) };
    if stretch.resample.is_some() {
        return Err(AnalysisError::JitteringStream { percent: sampling::significant(100.0 * sampling.jitter, 2) });
    }
    let rows = &whole[stretch.rows.clone()];
    let filled = |(k, channel): (usize, &Channel)| Channel {
        values: rows.iter().map(|row| row.values[k]).collect(),
        ..channel.clone()
    };
    Ok(Some(Record {
        name: "stream".into(),
        source: None,
        start: rows[0].time,
        interval: sampling.interval,
        channels: channels.iter().enumerate().map(filled).collect(),
        notices: Vec::new(),
    }))
}

#[cfg(test)]
mod tests;
