//! A stream: samples that come one after another, the last seconds of which are identified as they come.
//!
//! A study of a record smooths all of it, makes rows of it, and reduces them to one small triangle. A stream does the same in
//! blocks: as soon as the samples of a block and half a smoothing segment on either side are there, its rows are made and
//! reduced, and are never touched again. Triangles stack, so the last seconds are identified from a few dozen of them: the
//! coefficients are those of a study of the same samples, at a price that does not depend on how long the stream lasts.
//!
//! Nothing here reads a clock or a file: time is counted in samples.

mod alarm;
mod window;

use std::sync::Arc;

use super::candidates::candidate_terms;
use super::regression::{Basis, Regression, RowChoice, fitted_states, shortest_standstills, sliding};
use super::{Formulation, Settings, StudyError, check};
use crate::signal::{SignalFacts, Signals, Smoother};
use alarm::ChangeDetector;
pub use alarm::{Alarm, AlarmCause, AlarmChange, Cleared, Judged};
use sindyscope_values::model::Model;
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};
use sindyscope_values::term::{Layout, Term};
use window::{StreamBlock, Window};

/// How a stream is studied.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamSettings {
    /// Smoothing, library and threshold, with nothing left to be chosen.
    pub study: Settings,
    /// How much of the stream is identified: its last so many seconds.
    pub last: f64,
    /// Alarms that a stream without any change may raise, an hour.
    pub false_alarms: f64,
}

/// A stream under study.
#[derive(Debug)]
pub struct Stream {
    settings: Settings,
    layout: Layout,
    terms: Vec<Term>,
    fitted: Vec<usize>,
    /// What is measured; without samples.
    channels: Vec<Channel>,
    facts: SignalFacts,
    /// Samples of the shortest standstill of each velocity whose sign is taken, as the opening tells them: a block is too short to.
    shortest_standstills: Vec<Option<usize>>,
    /// What one sample of noise does to each fitted rate: `[equation][sample]`.
    kernels: Vec<Vec<f64>>,
    blocking: Blocking,
    stretch: StreamStretch,
    window: Window,
    detector: ChangeDetector,
    samples: usize,
}

/// How samples become rows, and rows blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blocking {
    /// Sampling interval, s.
    pub interval: f64,
    /// Samples between rows.
    stride: usize,
    /// Rows at either end of a stretch whose smoothing would be one-sided.
    margin: usize,
    /// Rows of a whole block.
    rows: usize,
    /// Blocks that the last seconds hold.
    pub kept: usize,
}

impl Blocking {
    /// Length of a block, s.
    pub fn seconds(&self) -> f64 {
        (self.rows * self.stride) as f64 * self.interval
    }

    /// Samples that a block of so many rows is made of.
    fn samples(&self, rows: usize) -> usize {
        (rows + 2 * self.margin) * self.stride
    }
}

/// Samples that follow one another without a gap.
#[derive(Debug, Default)]
struct StreamStretch {
    /// Time of the first sample of all, s.
    start: f64,
    /// Samples since then, those that were dropped among them.
    passed: usize,
    /// The samples from the one on that the next block begins with: `[channel][sample]`.
    held: Vec<Vec<f64>>,
}

/// What is known after a block.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamUpdate {
    /// Time of the newest sample that counts, s.
    pub time: f64,
    /// Samples that came so far.
    pub samples: usize,
    /// Blocks that the last seconds hold so far.
    pub blocks: usize,
    /// How much of the last seconds is covered by rows, s.
    pub covered: f64,
    /// The equations of the last seconds; standard errors from the scatter of blocks.
    pub model: Model,
    /// The newest block held against the model from before it; none while too few blocks are known.
    pub judged: Option<Judged>,
    /// The alarm that stands.
    pub alarm: Option<Alarm>,
    /// Whether it began or ended with this block.
    pub change: Option<AlarmChange>,
}

/// Fewest blocks from which the spread between blocks is known well enough to judge another one.
pub(crate) const MIN_BLOCKS: usize = 8;
/// Most blocks that the last seconds are parted into: more would cost time and tell no more of their spread.
const MAX_BLOCKS: usize = 32;

impl Stream {
    /// A stream of the channels of `opening`, whose noise and main period tell how long a block is: a period at least, so that
    /// blocks are alike, and a thirty-second part of what is kept. None of its samples counts yet: they are pushed as all others.
    ///
    /// # Errors
    /// Settings that do not fit the record, that only a record as a whole can be studied with, or that keep too little for a
    /// judgement of what arrives.
    pub fn new(opening: Record, settings: StreamSettings) -> Result<Self, StudyError> {
        let StreamSettings { study, last, false_alarms } = settings;
        let set = RecordSet::new([opening], Usage::Fit);
        let layout = check(&set, &study)?;
        let opening = &set.entries[0].0;
        streamable(&study, opening)?;
        let facts = SignalFacts::new(opening, &layout);
        let terms = candidate_terms(&study, &layout);
        let fitted = fitted_states(&layout, study.kinematics);
        let blocking = blocking(opening, &study, &facts, last, terms.len())?;
        let signals = Signals::new(opening, &layout, &study.smoothing, &facts);
        let shortest_standstills = shortest_standstills(&sliding(&terms), &layout, &signals);
        let kernels = kernels(opening, &layout, &study, &facts, &fitted);
        let channels: Vec<Channel> =
            opening.channels.iter().map(|c| Channel { values: Arc::default(), ..c.clone() }).collect();
        let stretch =
            StreamStretch { start: opening.start, held: vec![Vec::new(); channels.len()], ..StreamStretch::default() };
        let detector = ChangeDetector::new(false_alarms * blocking.seconds() / 3600.0);
        let window = Window::new(blocking.kept, blocking.seconds());
        Ok(Self {
            settings: study,
            layout,
            terms,
            fitted,
            channels,
            facts,
            shortest_standstills,
            kernels,
            blocking,
            stretch,
            window,
            detector,
            samples: 0,
        })
    }

    /// What each value of a sample is, in its order.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// How the stream is parted.
    pub fn blocking(&self) -> Blocking {
        self.blocking
    }

    /// What it is studied with.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The library.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Begins anew at a time, s: what comes next does not follow what came before. What the stretch that ends has left
    /// becomes a block, however short.
    pub fn begin(&mut self, start: f64) -> Option<StreamUpdate> {
        let update = self.end();
        self.stretch.start = start;
        self.stretch.passed = 0;
        update
    }

    /// The next sample: a value of each channel. One that is not finite is a gap.
    pub fn push(&mut self, sample: &[f64]) -> Option<StreamUpdate> {
        debug_assert_eq!(sample.len(), self.channels.len(), "one value a channel");
        self.samples += 1;
        if !sample.iter().all(|v| v.is_finite()) {
            let update = self.end();
            self.stretch.passed += 1;
            return update;
        }
        self.stretch.passed += 1;
        self.stretch.held.iter_mut().zip(sample).for_each(|(held, value)| held.push(*value));
        let rows = self.blocking.rows;
        if self.held() < self.blocking.samples(rows) {
            return None;
        }
        let update = self.block(rows);
        let used = rows * self.blocking.stride;
        self.stretch.held.iter_mut().for_each(|held| drop(held.drain(..used)));
        update
    }

    /// Ends the stretch: its last rows become a block.
    pub fn end(&mut self) -> Option<StreamUpdate> {
        let Blocking { stride, margin, .. } = self.blocking;
        let rows = (self.held().div_ceil(stride)).saturating_sub(2 * margin);
        let update = if rows == 0 { None } else { self.block(rows) };
        self.stretch.held.iter_mut().for_each(Vec::clear);
        update
    }

    /// Samples since the beginning of the block that is being filled.
    fn held(&self) -> usize {
        self.stretch.held.first().map_or(0, Vec::len)
    }

    /// Time of the first sample that is held, s.
    fn held_since(&self) -> f64 {
        self.stretch.start + self.blocking.interval * (self.stretch.passed - self.held()) as f64
    }

    /// Makes a block of the first rows of what is held.
    fn block(&mut self, rows: usize) -> Option<StreamUpdate> {
        let Blocking { interval, stride, margin, rows: whole, .. } = self.blocking;
        let samples = self.held().min(self.blocking.samples(rows));
        let channel =
            |(channel, held): (&Channel, &Vec<f64>)| Channel { values: held[..samples].into(), ..channel.clone() };
        let record = Record {
            name: String::new(),
            source: None,
            start: self.held_since(),
            interval,
            channels: self.channels.iter().zip(&self.stretch.held).map(channel).collect(),
            notices: Vec::new(),
        };
        let time = record.start + interval * ((margin + rows - 1) * stride) as f64;
        let signals = Arc::new(Signals::new(&record, &self.layout, &self.settings.smoothing, &self.facts));
        let smoothing = &self.settings.smoothing;
        let inside = |_: &Signals| margin..margin + rows;
        let choice = RowChoice { stride, inside: &inside, shortest_standstills: Some(&self.shortest_standstills) };
        let regression = Regression::of_rows(
            &self.layout,
            &self.terms,
            &[signals],
            smoothing,
            &Basis::Samples,
            &self.fitted,
            &choice,
        );
        // Rows fewer than terms tell nothing by themselves, but something with others; where friction holds still all of them there
        // are none.
        let regression = regression.ok().filter(|r| r.rows() > 0)?;
        let tapered = regression.tapered();
        let spreads = regression.spread_of_noise(&self.kernels, stride);
        let regression = Regression::joined(&[&regression]).bounded(&self.settings);
        let block = StreamBlock {
            time,
            seconds: (rows * stride) as f64 * interval,
            // What friction holds still for most of the time has few rows, whose spread is another.
            judged: rows == whole && 2 * regression.rows() >= whole,
            alarmed: false,
            regression,
            tapered,
            spreads,
        };
        Some(self.identify(block))
    }

    /// Holds a block against what is known, takes it in, and identifies the last seconds.
    fn identify(&mut self, mut block: StreamBlock) -> StreamUpdate {
        let time = block.time;
        let (judged, change) = self.detector.judge(&block, &mut self.window, self.blocking.kept);
        block.alarmed = self.detector.doubts();
        self.window.push(block);
        let identified = self.window.identify(&self.settings);
        self.detector.learn(&self.window, &identified, &self.settings);
        let model = identified.model;
        StreamUpdate {
            time,
            samples: self.samples,
            blocks: self.window.blocks().count(),
            covered: self.window.seconds(),
            model,
            judged,
            alarm: self.detector.alarm().cloned(),
            change,
        }
    }
}

/// Refuses what needs a record as a whole.
fn streamable(study: &Settings, opening: &Record) -> Result<(), StudyError> {
    let refuse = |what: &str| Err(StudyError::Setting(what.to_owned()));
    if study.smoothing.method.is_global() {
        return refuse("this way of differentiating smooths a record as a whole: a stream is smoothed in segments");
    }
    if study.form != Formulation::Derivative {
        return refuse("a stream's equation is held against its samples, not in the weak or the integrated form");
    }
    if study.refine {
        return refuse("the response of a stream is not fitted: leave the refinement out");
    }
    match opening.channels.iter().find(|c| c.estimated && matches!(c.role, Role::Displacement(_))) {
        Some(_) => refuse(
            "a stream needs its displacements measured: one estimated from an acceleration needs the whole record",
        ),
        None => Ok(()),
    }
}

/// What one sample of noise does to each fitted rate: the rate of a motion that is one at a single sample and zero elsewhere, smoothed
/// as the stream is.
fn kernels(
    opening: &Record,
    layout: &Layout,
    study: &Settings,
    facts: &SignalFacts,
    fitted: &[usize],
) -> Vec<Vec<f64>> {
    let leading = opening.channel(Role::Displacement(0)).map_or(&[][..], |c| &c.values);
    let length = Smoother::length(&study.smoothing, leading).ceil() as usize;
    // Rates are smoothed twice; beyond that nothing is left of a sample.
    let reach = 2 * length + 1;
    let count = (4 * reach + 1).min(opening.len());
    let at = count / 2;
    let impulse: Arc<[f64]> = (0..count).map(|k| if k == at { 1.0 } else { 0.0 }).collect();
    let motion = |c: &Channel| {
        let values = if matches!(c.role, Role::Input(_)) { opening_part(c, count) } else { Arc::clone(&impulse) };
        Channel { values, ..c.clone() }
    };
    let record = Record { channels: opening.channels.iter().map(motion).collect(), ..opening.slice(0..count) };
    let signals = Signals::new(&record, layout, &study.smoothing, facts);
    let near = at.saturating_sub(reach)..(at + reach + 1).min(count);
    fitted
        .iter()
        .map(|state| {
            signals.rate(*state).and_then(|rate| rate.get(near.clone())).map_or_else(Vec::new, <[f64]>::to_vec)
        })
        .collect()
}

/// The first samples of a channel.
fn opening_part(channel: &Channel, count: usize) -> Arc<[f64]> {
    channel.values[..count].into()
}

/// How a stream is parted whose opening this is.
fn blocking(
    opening: &Record,
    study: &Settings,
    facts: &SignalFacts,
    last: f64,
    terms: usize,
) -> Result<Blocking, StudyError> {
    let interval = opening.interval;
    let leading = opening.channel(Role::Displacement(0)).map_or(&[][..], |c| &c.values);
    let length = Smoother::length(&study.smoothing, leading);
    let stride = study.smoothing.stride(length);
    let margin = study.smoothing.margin(length).div_ceil(stride);
    let period = facts.main_period.unwrap_or(0.0);
    let seconds = period.max(last / MAX_BLOCKS as f64);
    let rows = ((seconds / interval).ceil() as usize).div_ceil(stride).max(2 * (terms + 2));
    let blocking = Blocking { interval, stride, margin, rows, kept: 0 };
    // A block that is longer than what is kept by rounding alone is kept all the same.
    let kept = (last / blocking.seconds() + 1e-9) as usize;
    if kept < MIN_BLOCKS {
        let (blocks, seconds) = (MIN_BLOCKS, blocking.seconds());
        return Err(StudyError::StreamTooShort { last, kept, seconds, blocks, needed: blocks as f64 * seconds });
    }
    Ok(Blocking { kept, ..blocking })
}

#[cfg(test)]
mod sticking;
#[cfg(test)]
mod tests;
