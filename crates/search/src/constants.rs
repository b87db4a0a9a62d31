//! Every number that the search decides or budgets by: its value, its unit, and what sets it.
//!
//! A study that halves and doubles each of them tells what it moves (`tests/constants`; the figures are in the book).
//! What is not here is no matter of choice for the search: numerical tolerances, the grids of the catalogue's entries, what a
//! description is made of, sizes of drawings. Those stand where they are used.

use std::f64::consts::TAU;

use super::outcome::Lead;

/// Effects of the largest set that is proposed at once, and that a model may lack besides.
pub(super) const LARGEST_SET: usize = 3;

/// Quantile of the resampled lead that must be positive, as the results tell it: two standard deviations of a normal law.
pub(super) const QUANTILE: f64 = 0.023;
/// Blocks that unseen data are cut into at least: the fewest n of which none alone, drawn n times with the probability n⁻ⁿ,
/// reaches that quantile.
const FEWEST_BLOCKS: f64 = 4.0;

/// What a share may be, what a factor that is no less than one may be, and what has no other bound than zero.
const SHARE: (f64, f64) = (0.0, 1.0);
const FACTOR: (f64, f64) = (1.0, f64::INFINITY);
const POSITIVE: (f64, f64) = (0.0, f64::INFINITY);

/// One of the constants, as a study sees it.
#[derive(Clone, Copy, Debug)]
pub struct Constant {
    /// The field's name.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Its unit; empty for a number.
    pub unit: &'static str,
    /// What sets it.
    pub set_by: &'static str,
    /// All constants, this one multiplied: rounded where it is a count, and kept within what is physical.
    pub times: fn(f64) -> Constants,
    /// Its value, as it is read.
    pub value: fn(&Constants) -> String,
}

/// A kind of constant.
trait Scaled {
    /// Multiplied, within bounds.
    fn scaled(self, by: f64, bounds: (f64, f64)) -> Self;

    /// As it is read.
    fn text(self) -> String;
}

impl Scaled for f64 {
    fn scaled(self, by: f64, (low, high): (f64, f64)) -> Self {
        (self * by).clamp(low, high)
    }

    fn text(self) -> String {
        if self < 1e-3 { format!("{self:e}") } else { self.to_string() }
    }
}

impl Scaled for [f64; 2] {
    fn scaled(self, by: f64, bounds: (f64, f64)) -> Self {
        self.map(|value| value.scaled(by, bounds))
    }

    fn text(self) -> String {
        self.map(Scaled::text).join(", ")
    }
}

impl Scaled for usize {
    fn scaled(self, by: f64, bounds: (f64, f64)) -> Self {
        (self as f64).scaled(by, bounds).round() as Self
    }

    fn text(self) -> String {
        self.to_string()
    }
}

/// The struct of all constants, their defaults, and the list of them that a study goes through.
macro_rules! constants {
    ($($(#[doc = $meaning:literal])+ $name:ident: $kind:ty = $value:expr, $bounds:expr, $unit:literal, $set_by:literal;)+) => {
        /// What a search decides and budgets by. The default is what was measured to do best; other values are for studies.
        #[derive(Clone, Debug, PartialEq)]
        pub struct Constants {
            $(
                $(#[doc = $meaning])+
                #[doc = ""]
                #[doc = concat!("Unit: ", $unit, ". Set by: ", $set_by, ".")]
                pub $name: $kind,
            )+
        }

        impl Constants {
            pub(super) const DEFAULT: Self = Self { $($name: $value,)+ };

            /// Every one of them, in the order of the fields.
            pub const EACH: &'static [Constant] = &[$(
                Constant {
                    name: stringify!($name),
                    meaning: concat!($($meaning),+),
                    unit: $unit,
                    set_by: $set_by,
                    times: |by| Self { $name: Self::DEFAULT.$name.scaled(by, $bounds), ..Self::DEFAULT },
                    value: |constants| constants.$name.text(),
                },
            )+];
        }
    };
}

constants! {
    // --- what is told from what

    /// Distance of each amplitude of a set from zero, at least; the error is inflated by the residual's correlation, and taken with the
    /// effect's inner quantities as they were found. A joint's two forces contradict its springs if they are as far from what
    /// these say.
    amplitude_errors: f64 = 3.0, POSITIVE, "standard errors", "one amplitude in four hundred that is none passes";
    /// Sum of differences of log densities by which a set beats another, at least.
    lead: f64 = 5.0, POSITIVE, "nats", "a study in which values from 0 to 8 differ by two verdicts of 174";
    /// Times that lead that is asked for where the data are one steady tone: harmonics alone speak there, and they follow
    /// every form a little.
    lead_on_one_tone: f64 = 20.0, FACTOR, "times", "wrong names on single tones in the study of hidden effects";
    /// Degrees of freedom of Student's density: no single block may own the sum.
    student: f64 = 5.0, POSITIVE, "degrees of freedom", "the usual choice of robust regression";
    /// Ratio from which errors on unseen data are no longer alike. A block is scored by its own errors where they are that much
    /// larger than on fitted data, a record may have been begun wrongly, and where nothing explains the data, a set must err
    /// that much less than another to beat it.
    unseen_ratio: f64 = 1.5, FACTOR, "times", "a ratio that right names reach in 3 of 164 draws";
    /// Length of a block that a set predicts.
    block: f64 = 4.0, POSITIVE, "main periods", "blocks long enough for errors to grow, and short enough to be many";
    /// Share above the noise (RMS of the fitted records' residual) from which what is left matters; half of it as a share of what
    /// was found does too.
    matters_noises: f64 = 0.2, POSITIVE, "noises", "effects outside the catalogue that stay below are nobody's concern";
    /// Share above the noise that a set which explains the data leaves at most on the data fitted; on those never fitted, twice
    /// that. An input's own noise and rounding, and what the noise's estimate is off by, come to as much.
    explains: f64 = 0.06, POSITIVE, "noises", "scatter of the residual of 1500 samples, and of the noise's own estimate";
    /// Probability of calling a gap where there is none.
    level: f64 = 1e-4, SHARE, "probability", "false alarms of the study of hidden effects";
    /// Residual from which there is a gap, whatever the tests say: correlated residuals may hide one from them. As far below the
    /// noise there is none: the sensor could not have shown it.
    loud: f64 = 2.0, POSITIVE, "noises", "correlated residuals of friction that sticks";
    /// Times the difference between two courses of an input through its samples by which the true course may differ.
    between_samples: f64 = 6.0, POSITIVE, "times", "half of the virtual rig's closed loops leave no more";
    /// Standard deviation of the ratio of a joint's two forces about that of its springs; springs of twice this share of those
    /// that hold each mass tell little of it.
    reciprocity: f64 = 0.05, POSITIVE, "share", "coupling by inertia";

    // --- proposing

    /// Half width of a test function.
    half_width: f64 = 0.35, POSITIVE, "main periods", "noise passes narrower ones, the motion is lost in wider ones";
    /// Half widths beside sticks, between which what moves is shorter than a wide test function.
    narrow_widths: [f64; 2] = [0.11, 0.2], POSITIVE, "main periods", "static friction in sticking motion, the study of hidden effects";
    /// Rows of all records together at most.
    rows: usize = 4000, POSITIVE, "rows", "time: products of all columns";
    /// Blocks of rows that are left out in turn, about.
    blocks_left_out: usize = 10, FACTOR, "blocks", "ten-fold cross-validation";
    /// Least length of what is left out to judge the rest: such a block of rows, and a part of a record.
    left_out_periods: f64 = 3.0, POSITIVE, "main periods", "its own initial state explains the first ones";
    /// Least length of a spell of rest. Gaps of less than half that are noise of the velocity, and three eighths are left out on
    /// either side of a spell, where the mass is just caught or let go.
    rest: f64 = 0.08, POSITIVE, "main periods", "a smooth motion is as slow for a quarter of it";
    /// Share of all samples in such spells from which dry friction is tried first, and fits begin between rests.
    resting: f64 = 0.1, SHARE, "share", "smooth motions that turn are slow for less";
    /// Least length of a spell on a surface that moves.
    carried: f64 = 0.2, POSITIVE, "main periods", "near its greatest speed a smooth motion stays longer";
    /// Speed below which a mass may stand still.
    still: f64 = 0.1, POSITIVE, "RMS velocities", "noise of the velocity";
    /// Grid points of a form that enter pairs; a third as many of those that are best beside a constant force, which moves the
    /// place of a contact.
    grid_points: usize = 6, FACTOR, "points", "time: pairs grow with its square";
    /// Pairs that are tried with a third effect. As many effects and pairs have the grid made finer about them where few blocks can be
    /// left out in turn.
    pairs_extended: usize = 20, POSITIVE, "pairs", "time";
    /// Sets of each size about which the grid is made finer.
    zoomed: usize = 8, POSITIVE, "sets", "time";
    /// Share of the gain of the best set that it contains which a set must bring besides, to be proposed before it.
    crumb: f64 = 0.2, POSITIVE, "share", "time: fits of sets with an effect too many";
    /// A damper may push by this much beside a force that remembers.
    pushing: f64 = 0.02, POSITIVE, "natural frequencies", "noise of the acceleration that such a force holds";
    /// Sets of one effect that are proposed at most; of two, two thirds as many, of three a third. Of effects that are met most
    /// often a third of each size are proposed besides: the best, and what the regression cannot tell from it. Twice as many single
    /// effects are asked for by name where it is asked whether there is a gap.
    proposals: usize = 6, FACTOR, "sets", "time: each is fitted";
    /// Share of a frequency within which another is the same in a motion whose frequency changes with its amplitude.
    locked: f64 = 0.2, SHARE, "share", "decays of nonlinear springs";

    // --- fitting

    /// Steps of a fit at most; of one that only initial states are fitted in, or that starts from near by, a third.
    steps: usize = 24, FACTOR, "steps", "time: fits that still fall by then are lost";
    /// Integration steps after which a fit of one of several candidates takes no further step.
    effort: usize = 800_000, FACTOR, "integration steps", "time: about half a second";
    /// Share of a gain that is little. Where a set explains the data, others are fitted if their gain in the regression falls short of
    /// its own by no more; until then, if they explain more of what is left along the measured motion.
    little_gain: f64 = 0.05, SHARE, "share", "rivals that the regression cannot tell; no right set of 262 draws and systems explained less";
    /// Single effects that are fitted in any case, to be shown beside the one that explains the data.
    shown: usize = 2, POSITIVE, "effects", "what a person sees beside the name";
    /// Best sets of which every part is fitted too.
    sets_with_parts: usize = 2, FACTOR, "sets", "the winner, and what may become it";
    /// Rivals that are fitted once more from where the best set landed.
    fitted_again: usize = 3, POSITIVE, "sets", "time";
    /// Times the least sum of squares from which a fit has lost: its damper's sign is not asked for, and it is not fitted again.
    far_behind: f64 = 9.0, FACTOR, "times", "three times the error";
    /// Fitted samples up to which nothing is thinned.
    thinned_above: usize = 8000, FACTOR, "samples", "time";
}

/// The values that the program uses. No constant: those who use them are not built anew with one that has changed.
pub static CONSTANTS: Constants = Constants::DEFAULT;

impl Default for Constants {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Constants {
    /// Steps of a fit of initial states alone, or from near by, at most.
    pub(super) fn few_steps(&self) -> usize {
        self.steps.div_ceil(3)
    }

    /// Integration steps after which a walk looks no further: what every set may take that as many looks propose as a set may have
    /// effects, in two fits each. Walks that named rightly in the studies took less before their last look.
    pub(super) fn effort_of_looks(&self) -> usize {
        let proposed: usize = (1..=LARGEST_SET).map(|effects| self.proposals_of(effects)).sum();
        2 * LARGEST_SET * proposed * self.effort
    }

    /// Sets of so many effects that are proposed at most.
    pub(super) fn proposals_of(&self, effects: usize) -> usize {
        (self.proposals * (LARGEST_SET + 1 - effects.clamp(1, LARGEST_SET))).div_ceil(LARGEST_SET)
    }

    /// Error, in noises, from which what is left matters, so that no name explains the data.
    pub fn mattering(&self) -> f64 {
        1.0 + self.matters_noises
    }

    /// Times the noise that a set which explains the data leaves at most, on the data fitted and on those never fitted.
    pub fn explaining(&self) -> (f64, f64) {
        (1.0 + self.explains, 1.0 + 2.0 * self.explains)
    }

    /// Probability of calling a gap where there is none. Where the sensor's steps are what is left, they are no chance: they
    /// repeat with the motion, and each of three times would have to be as unlikely.
    pub(super) fn level_of(&self, stepped: bool) -> f64 {
        if stepped { self.level.powi(3) } else { self.level }
    }

    /// Rate at which a damper may push beside a force that remembers, 1/s, in a motion of a period, s.
    pub(super) fn pushing_rate(&self, period: f64) -> f64 {
        self.pushing * TAU / period
    }

    /// Length of a block, s, of unseen data of a length, s: where few periods are unseen, such that some blocks can be told
    /// from one.
    pub fn block_length(&self, period: f64, unseen: f64) -> f64 {
        (self.block * period).min(unseen / FEWEST_BLOCKS)
    }

    /// True if a lead is enough to name what has it.
    pub fn is_enough(&self, lead: &Lead) -> bool {
        lead.is_more_than(self.lead)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_study_changes_one_constant_alone_and_keeps_it_physical() {
        for constant in Constants::EACH {
            let (half, double) = ((constant.times)(0.5), (constant.times)(2.0));
            assert_eq!((constant.times)(1.0), Constants::DEFAULT, "{}", constant.name);
            assert_ne!(half, double, "{}", constant.name);
            let others = |changed: &Constants| {
                let same = |other: &&Constant| (other.value)(changed) == (other.value)(&Constants::DEFAULT);
                Constants::EACH.iter().filter(same).count()
            };
            assert!(others(&half) + 1 >= Constants::EACH.len() && others(&double) + 1 >= Constants::EACH.len());
        }
        assert_eq!((1..=LARGEST_SET).map(|n| Constants::DEFAULT.proposals_of(n)).collect::<Vec<_>>(), [6, 4, 2]);
    }
}
