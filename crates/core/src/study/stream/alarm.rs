//! Whether what arrives is still explained by what is known.
//!
//! Each block is held against the model from before it: by the size of what is left of the rates, and by its part along each
//! term of the model, which tells a coefficient that has changed long before the size does. Both are compared with what the
//! blocks of the last seconds left, each under the model of all the others: blocks of a stream in which nothing changes are
//! exchangeable, so the newest one is one more draw of the same distribution, and Student's t gives the chance that it lies so
//! far out. That chance is held against the false alarms an hour that are allowed, shared by all the comparisons of a block.
//!
//! A change lasts and has a direction, and what a stream does seldom (friction that sticks, a blow) has neither: it takes three blocks in
//! a row that lie out in the same comparison to the same side, each as far as chance would have it for all together. A block alone
//! alarms by its size, or where it lies out further in a term's direction than what is seldom does: by a law with heavy tails. Each way
//! has half of the allowed false alarms.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::MIN_BLOCKS;
use super::window::{BlockLeft, StreamBlock, StreamFit, Window};
use crate::signal::mean_and_variance;
use crate::study::Settings;
use sindyscope_values::term::{Symbol, Term};

/// Blocks in a row that lie far out the same way and so raise an alarm. With two, whatever way each lay, streams whose friction sticks
/// raised five false alarms in 3.6 h; with two that lie the same way three; with three none (draws from 2000 on).
const BLOCKS_IN_A_ROW: usize = 3;

/// Blocks in a row that a model must explain again before an alarm ends.
const CALM_BLOCKS: usize = 3;

/// Degrees of freedom of a score's spread, as a share of those of as many draws of one normal distribution: the scores of blocks
/// that were excited differently have different variances, and their tails are heavier. With all of them 0.2 % of 48,000
/// scores of streams without a change lay beyond where 0.1 % should, with half of them 0.06 %.
const SCORE_FREEDOM: f64 = 0.5;

/// Degrees of freedom, at most, of the law by which the scores of a block alone are judged. On forty streams of two minutes of each of
/// three rigs whose friction sticks, the farthest of 14,000 blocks in which nothing changed lay 20 deviations out in one term's
/// direction; with five degrees the usual rate allows 17.
const ALONE_FREEDOM: f64 = 5.0;

/// A block under the model from before it.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// RMS of what the model leaves of the rates over what it leaves of a usual block: the largest of all equations.
    pub ratio: f64,
    /// Chance that a block of a stream in which nothing changes lies so far out, over all comparisons.
    pub p_value: f64,
}

/// What the model no longer explains.
#[derive(Clone, Debug, PartialEq)]
pub struct Alarm {
    /// Time of the block with which it began, s.
    pub since: f64,
    /// What lay farthest out of all that was compared.
    pub cause: AlarmCause,
}

/// What lies farther out than chance would have it.
#[derive(Clone, Debug, PartialEq)]
pub enum AlarmCause {
    /// As if this coefficient had become another one.
    Coefficient {
        /// The state whose equation the term stands in.
        state: Symbol,
        /// The term.
        term: Term,
        /// Its coefficient in the model from before.
        before: f64,
        /// The coefficient with which that model explains the block, the others as they were.
        after: f64,
    },
    /// More is left than usual, in no term's direction.
    Residual {
        /// The state whose rate it is left of.
        state: Symbol,
        /// RMS over the usual one.
        ratio: f64,
    },
}

/// A beginning or an end of an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlarmChange {
    /// It began.
    Raised,
    /// It ended.
    Cleared(Cleared),
}

/// Why an alarm ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cleared {
    /// The model from before explains what arrives again.
    Returned,
    /// The last seconds all came since it began: what is identified from them is the new measure.
    Relearned,
}

/// What a stream is held against, and the alarm that stands.
#[derive(Debug)]
pub(super) struct ChangeDetector {
    /// Chance of a false alarm in a block.
    chance: f64,
    reference: Option<Reference>,
    alarm: Option<Alarm>,
    /// Blocks in a row that lie far out in the same comparison, to the same side.
    runs: Vec<Run>,
    /// Blocks in a row that were explained while an alarm stood, and blocks since it began.
    calm: usize,
    since: usize,
}

/// Blocks in a row that lie far out in one comparison to one side.
#[derive(Clone, Copy, Debug, Default)]
struct Run {
    blocks: usize,
    upwards: bool,
    /// Time of the first of them, s.
    since: f64,
}

/// A model, and what blocks usually leave under a model of others.
#[derive(Debug)]
struct Reference {
    /// `[fitted equation][term of the library]`.
    coefficients: Vec<Vec<f64>>,
    /// What each comparison is about, and how it usually comes out.
    comparisons: Vec<Comparison>,
    /// Blocks that this is known from.
    blocks: f64,
}

#[derive(Debug)]
struct Comparison {
    equation: usize,
    /// The library's term along which the residual is taken; none: its size.
    term: Option<usize>,
    mean: f64,
    deviation: f64,
}

impl Comparison {
    fn value(&self, left: &[BlockLeft]) -> f64 {
        let left = &left[self.equation];
        match self.term {
            Some(k) => left.along(k),
            None => left.unexplained.rms.max(f64::MIN_POSITIVE).ln(),
        }
    }
}

/// How far out a block lies: the chance, the comparison that decides, and the size of the residual over the usual one.
struct Distance {
    p_value: f64,
    /// The same by the law for a block alone.
    alone: f64,
    farthest: usize,
    ratio: f64,
    /// Of each comparison: the chance, and whether it comes out above its mean.
    each: Vec<(f64, bool)>,
}

impl ChangeDetector {
    pub(super) fn new(chance: f64) -> Self {
        Self { chance, reference: None, alarm: None, runs: Vec::new(), calm: 0, since: 0 }
    }

    pub(super) fn alarm(&self) -> Option<&Alarm> {
        self.alarm.as_ref()
    }

    /// True while a block is no example of what is usual: an alarm stands, or would with the next block.
    pub(super) fn doubts(&self) -> bool {
        self.alarm.is_some() || self.runs.iter().any(|run| run.blocks > 0)
    }

    /// Holds a block that is not yet in the window against the reference.
    pub(super) fn judge(
        &mut self,
        block: &StreamBlock,
        window: &mut Window,
        kept: usize,
    ) -> (Option<Judged>, Option<AlarmChange>) {
        let Some(reference) = self.reference.as_ref().filter(|_| block.judged) else { return (None, None) };
        let left = block.left_by(&reference.coefficients);
        let distance = reference.distance(&left);
        let judged = Judged { ratio: distance.ratio, p_value: distance.p_value };
        let level = (0.5 * self.chance).powf(1.0 / BLOCKS_IN_A_ROW as f64);
        let far = distance.p_value < level;
        let change = match (&mut self.alarm, far) {
            (None, true) => {
                let (comparison, longest) = follow(&mut self.runs, &distance.each, level, block.time);
                let found = if longest.blocks >= BLOCKS_IN_A_ROW {
                    Some((comparison, longest))
                } else {
                    let alone = Run { blocks: 1, since: block.time, ..longest };
                    (distance.alone < 0.5 * self.chance).then_some((distance.farthest, alone))
                };
                found.map(|(comparison, Run { since, blocks, .. })| {
                    self.alarm = Some(Alarm { since, cause: reference.cause(comparison, &left, block) });
                    self.runs.clear();
                    (self.calm, self.since) = (0, blocks);
                    AlarmChange::Raised
                })
            }
            (None, false) => {
                if !self.runs.is_empty() {
                    // What comes now and then is usual.
                    self.runs.clear();
                    window.mark_usual();
                }
                None
            }
            (Some(_), far) => {
                self.since += 1;
                self.calm = if far { 0 } else { self.calm + 1 };
                let cleared = if self.calm >= CALM_BLOCKS {
                    Some(Cleared::Returned)
                } else {
                    (self.since > kept).then_some(Cleared::Relearned)
                };
                cleared.map(|why| {
                    self.alarm = None;
                    // What comes now and then, as the beats of a drive do, is usual once it is known.
                    window.mark_usual();
                    AlarmChange::Cleared(why)
                })
            }
        };
        (Some(judged), change)
    }

    /// Takes what the window holds for usual, unless an alarm stands or too little of it came without one.
    pub(super) fn learn(&mut self, window: &Window, identified: &StreamFit, settings: &Settings) {
        if self.doubts() {
            return;
        }
        let usual: Vec<&StreamBlock> = window.blocks().filter(|b| b.judged && !b.alarmed).collect();
        if usual.len() < MIN_BLOCKS {
            return;
        }
        let own;
        let identified = if usual.len() == window.blocks().count() {
            identified
        } else {
            own = StreamFit::new(&usual, settings);
            &own
        };
        self.reference = Some(Reference::new(usual[0], identified));
    }
}

/// Takes a block's chances and sides into the runs of its comparisons, and gives the longest with its comparison: of as long ones that
/// which lies farthest out.
fn follow(runs: &mut Vec<Run>, each: &[(f64, bool)], level: f64, time: f64) -> (usize, Run) {
    runs.resize(each.len(), Run::default());
    for (run, (p_value, upwards)) in runs.iter_mut().zip(each) {
        *run = match (*p_value < level, run.blocks > 0 && run.upwards == *upwards) {
            (false, _) => Run::default(),
            (true, true) => Run { blocks: run.blocks + 1, ..*run },
            (true, false) => Run { blocks: 1, upwards: *upwards, since: time },
        };
    }
    let longest = (0..runs.len()).max_by(|a, b| {
        let (p, q) = (each[*a].0, each[*b].0);
        runs[*a].blocks.cmp(&runs[*b].blocks).then(q.total_cmp(&p))
    });
    longest.map_or((0, Run::default()), |k| (k, runs[k]))
}

impl Reference {
    /// What is usual of blocks, one of which is given.
    fn new(block: &StreamBlock, StreamFit { model, left }: &StreamFit) -> Self {
        let coefficients = block.regression.coefficients_of(model);
        let of_equation = |(equation, coefficients): (usize, &Vec<f64>)| {
            let kept = (0..coefficients.len()).filter(|k| coefficients[*k] != 0.0).map(Some);
            let plain = move |term| Comparison { equation, term, mean: 0.0, deviation: 0.0 };
            std::iter::once(None).chain(kept).map(plain).collect::<Vec<_>>()
        };
        let mut comparisons: Vec<Comparison> = coefficients.iter().enumerate().flat_map(of_equation).collect();
        for comparison in &mut comparisons {
            let values: Vec<f64> = left.iter().map(|left| comparison.value(left)).collect();
            let (mean, variance) = mean_and_variance(&values);
            let count = values.len() as f64;
            (comparison.mean, comparison.deviation) = (mean, (variance * count / (count - 1.0)).sqrt());
        }
        Self { coefficients, comparisons, blocks: left.len() as f64 }
    }

    fn distance(&self, left: &[BlockLeft]) -> Distance {
        let freedom = |share: f64| share * (self.blocks - 1.0);
        let student = |freedom: f64| StudentsT::new(0.0, 1.0, freedom).ok();
        let (of_size, of_score) = (student(freedom(1.0)), student(freedom(SCORE_FREEDOM)));
        let alone = student(freedom(SCORE_FREEDOM).min(ALONE_FREEDOM));
        let widened = (1.0 + self.blocks.recip()).sqrt();
        let mut found = Distance { p_value: 1.0, alone: 1.0, farthest: 0, ratio: 0.0, each: Vec::new() };
        for (k, comparison) in self.comparisons.iter().enumerate() {
            let away = comparison.value(left) - comparison.mean;
            // A size that is smaller than usual alarms nobody.
            let sides = if comparison.term.is_some() { 2.0 } else { 1.0 };
            let t = if comparison.term.is_some() { away.abs() } else { away };
            let t = t / (comparison.deviation * widened);
            let student = if comparison.term.is_some() { &of_score } else { &of_size };
            let chance = |law: &Option<StudentsT>| {
                let beyond = law.as_ref().map_or(1.0, |law| law.sf(t));
                (sides * beyond * self.comparisons.len() as f64).min(1.0)
            };
            let p_value = chance(student);
            // What comes seldom lies far out in a term's direction; in size it lies no further than other blocks.
            found.alone = found.alone.min(if comparison.term.is_some() { chance(&alone) } else { p_value });
            found.each.push((p_value, away > 0.0));
            if p_value < found.p_value {
                (found.p_value, found.farthest) = (p_value, k);
            }
            if comparison.term.is_none() {
                found.ratio = found.ratio.max(away.exp());
            }
        }
        found
    }

    fn cause(&self, farthest: usize, left: &[BlockLeft], block: &StreamBlock) -> AlarmCause {
        let comparison = &self.comparisons[farthest];
        let state = block.regression.fitted().nth(comparison.equation).and_then(|index| block.regression.symbol(index));
        let state = state.unwrap_or(Symbol::State(0));
        match comparison.term {
            Some(k) => {
                let before = self.coefficients[comparison.equation][k];
                let after = before + left[comparison.equation].unexplained.shift(k);
                AlarmCause::Coefficient { state, term: block.regression.term(k).clone(), before, after }
            }
            None => {
                let ratio = (comparison.value(left) - comparison.mean).exp();
                AlarmCause::Residual { state, ratio }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_blocks_that_lie_out_the_same_way_make_a_run() {
        let mut runs = Vec::new();
        let mut take = |time: f64, each: [(f64, bool); 2]| {
            let (comparison, run) = follow(&mut runs, &each, 0.02, time);
            (comparison, run.blocks, run.since)
        };
        assert_eq!(take(1.0, [(0.3, true), (0.001, true)]), (1, 1, 1.0));
        // To the other side: another run begins.
        assert_eq!(take(2.0, [(0.3, true), (0.001, false)]), (1, 1, 2.0));
        assert_eq!(take(3.0, [(0.001, true), (0.01, false)]), (1, 2, 2.0));
        assert_eq!(take(4.0, [(0.01, true), (0.01, false)]), (1, 3, 2.0));
        // One that is explained ends it; of two as long the one that lies farther out is told.
        assert_eq!(take(5.0, [(0.01, true), (0.03, false)]), (0, 3, 3.0));
        assert_eq!(take(6.0, [(0.03, true), (0.03, false)]).1, 0);
        assert_eq!(take(7.0, [(0.01, true), (0.001, true)]), (1, 1, 7.0));
    }
}
