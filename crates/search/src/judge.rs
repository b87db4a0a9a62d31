//! The one comparison that decides what is named.
//!
//! Each set of effects predicts blocks of data that its fit did not see, each from a state estimated over what lies before it.
//! A block's error is scored by Student's log density (no block may own the sum) with a scale that the set learnt on its own
//! fitted blocks: a model that is wrong knows it by its scale. Of two sets the differences of the blocks are paired; one beats
//! the other where their sum is more than [`Constants::lead`] and stays positive over resampled blocks.
//!
//! Sources: A. Vehtari, A. Gelman, J. Gabry, Statistics and Computing 27 (2017) 1413; P.-C. Bürkner, J. Gabry, A. Vehtari, J. Stat.
//! Comput. Simul. 90 (2020) 2499 (leaving out the future).

use std::cmp::Ordering;
use std::sync::Arc;

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use statrs::distribution::{ContinuousCDF as _, Normal};

use super::columns::MotionPath;
use super::constants::{Constants, QUANTILE};
use super::data::{Data, RecordSeries};
use super::effects::Form;
use super::fit::{Fitted, Followed, WHOLE};
use super::outcome::Lead;
use super::structure::Composition;
use sindyscope_core::refine::{FitOptions, Point, Run, refine, residuals_beside_jumps};
use sindyscope_core::signal::{dot, rms};
use sindyscope_core::study::Cancel;

/// A model's motion along a record, and the offsets of its sensors.
type Begun = (MotionPath, Vec<f64>);

/// Resampled sums that a quantile is taken from, a matter of digits.
const RESAMPLED: usize = 400;
/// Rounds of the scale's fixed point, a matter of digits: it gains one in five.
const SCALE_ROUNDS: usize = 40;
/// Quantiles that Gaussian noise is stood in for by, a matter of digits.
const GAUSSIAN_QUANTILES: u32 = 200;
/// An error that is not finite counts as so many times the motion; any large number will do.
const LOST: f64 = 1e3;

/// A set of effects, fitted to its end and held against blocks that it did not see.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    /// The forms beside the present model, by index; none of the present model itself.
    pub(super) forms: Vec<usize>,
    pub(super) fitted: Arc<Fitted>,
    /// Log density of each block never fitted, the same blocks for all.
    pub(super) blocks: Vec<f64>,
    /// Why the fitted data do not bear one of its parts, in words.
    pub(super) unborne: Option<String>,
}

impl Hypothesis {
    pub(super) fn sum(&self) -> f64 {
        self.blocks.iter().sum()
    }
}

/// What the comparison came to.
#[derive(Clone, Debug, Default)]
pub(super) struct Ruling {
    /// The set that stands, by index; none where nothing beats the present model.
    pub(super) winner: Option<usize>,
    /// Sets no larger that it does not beat, and richer kinds that do not beat it though they predict better.
    pub(super) rivals: Vec<usize>,
    /// The sum beyond which the data fitted may settle a lead; none where no set explains them.
    pub(super) settles: Option<f64>,
}

impl Constants {
    /// The comparison of two sets by the log densities of the same blocks; `against` names the second.
    pub fn compared(&self, first: &[f64], second: &[f64], against: &str) -> Lead {
        let differences: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
        let n = differences.len();
        let sum: f64 = differences.iter().sum();
        let mean = sum / n.max(1) as f64;
        let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n.max(2) - 1) as f64;
        let mut draws = Pcg64::seed_from_u64(0);
        let mut sums: Vec<f64> =
            (0..RESAMPLED).map(|_| (0..n).map(|_| differences[draws.random_range(0..n)]).sum()).collect();
        sums.sort_by(f64::total_cmp);
        Lead {
            blocks: n,
            won: differences.iter().filter(|d| **d > 0.0).count(),
            difference: sum,
            std_error: (n as f64 * variance).sqrt(),
            quantile: sums.get((QUANTILE * RESAMPLED as f64) as usize).copied().unwrap_or(0.0),
            against: against.to_owned(),
            titles: Vec::new(),
            each: differences,
            fitted: None,
        }
    }

    /// True if one set beats another; `least` is the sum that it must lead by.
    pub(super) fn beats(&self, first: &Hypothesis, second: &Hypothesis, least: f64) -> bool {
        self.compared(&first.blocks, &second.blocks, "").is_more_than(least)
    }

    /// True if the data fitted, along records as long, speak for a set so much that it stands beside another which predicts better.
    /// Where some set explains the data (`explained`), a set of no more parameters is asked whether its log likelihood is higher there
    /// by more than the other's lead, or higher at all where these are all data, those left out in turn among them: parameters that are
    /// a little off are so in every block, and blocks drawn anew do not tell. Where none explains the data likelihoods say too much,
    /// and it must err so much less that the two are not alike.
    fn makes_up(&self, set: &Hypothesis, other: &Hypothesis, explained: bool) -> bool {
        let (own, others) = (&set.fitted, &other.fitted);
        let speaks = if explained {
            let lead = if own.refitted.is_empty() { other.sum() - set.sum() } else { 0.0 };
            own.composition.parameters() <= others.composition.parameters() && own.likelier(others) > lead
        } else {
            self.unseen_ratio * own.error() < others.error()
        };
        own.level >= others.level && speaks
    }

    /// How much likelier the data fitted along records as long are under a set that leads another, as a logarithm, where they settle a
    /// lead that blocks leave open: by more than a lead, a parameter more counted as half the logarithm of their number (G. Schwarz,
    /// Annals of Statistics 6 (1978) 461). As in [`makes_up`](Self::makes_up), blocks alone do not tell.
    pub(super) fn settled(&self, set: &Hypothesis, other: &Hypothesis, least: f64) -> Option<f64> {
        let (own, others) = (&set.fitted, &other.fitted);
        let more = own.composition.parameters() as f64 - others.composition.parameters() as f64;
        let likelier = own.likelier(others) - 0.5 * more * (own.refined.samples as f64).ln();
        let leads = set.sum() - other.sum() > least && own.refitted.is_empty() && own.level >= others.level;
        (leads && likelier > self.lead).then_some(likelier)
    }

    /// True if the data fitted tell a richer kind of an effect from the simpler one that it contains: by as much as that its further
    /// quantity is so many standard errors from where it is the simpler one. The standard error alone, a slope's, says too little
    /// where the motion is chaotic (W. Meeker, L. Escobar, The American Statistician 49 (1995) 48). A fit of the richer kind that
    /// follows the data less far has not landed, unless the simpler one leaves so much more that it matters.
    fn tells_apart(&self, richer: &Hypothesis, simpler: &Hypothesis) -> bool {
        let (richer, simpler) = (&richer.fitted, &simpler.fitted);
        match richer.level.cmp(&simpler.level) {
            Ordering::Less => simpler.error() > self.mattering() * richer.error(),
            Ordering::Equal => richer.likelier(simpler) > 0.5 * self.amplitude_errors.powi(2),
            Ordering::Greater => true,
        }
    }

    /// The sum that a set must lead another by that it is more than.
    pub(super) fn least_lead(&self, single_tone: bool) -> f64 {
        if single_tone { self.lead_on_one_tone * self.lead } else { self.lead }
    }

    /// The scale of Student's law that errors are most likely under; `taken` values were fitted to them.
    pub fn student_scale(&self, errors: &[f64], taken: usize) -> f64 {
        let n = errors.len().max(1) as f64;
        let mut square = dot(errors, errors) / n;
        for _ in 0..SCALE_ROUNDS {
            let weighed = |e: &f64| (self.student + 1.0) * e * e / (self.student + e * e / square);
            square = errors.iter().map(weighed).sum::<f64>() / n;
        }
        (square * n / (n - taken as f64).max(1.0)).sqrt().max(f64::MIN_POSITIVE)
    }

    /// The scale of Student's law that Gaussian noise of unit deviation is most likely under.
    pub(super) fn gaussian_scale(&self) -> f64 {
        let quantile = |k: u32| Normal::standard().inverse_cdf((f64::from(k) + 0.5) / f64::from(GAUSSIAN_QUANTILES));
        self.student_scale(&(0..GAUSSIAN_QUANTILES).map(quantile).collect::<Vec<_>>(), 0)
    }

    /// Log density of a block's errors under Student's law of a scale, without its constant. A block that is far worse than the
    /// fitted ones is scored by its own errors' size: a set that errs less must not lose for having been surer.
    pub fn density(&self, errors: &[f64], scale: f64) -> f64 {
        let half = 0.5 * (self.student + 1.0);
        let scale = scale.max(rms(errors) / self.unseen_ratio);
        let of = |e: &f64| -half * (e / scale).powi(2).min(1e12).mul_add(self.student.recip(), 1.0).ln() - scale.ln();
        errors.iter().map(of).sum()
    }
}

impl Lead {
    /// True if the first set beats the second: by this sum at least, and whichever blocks are drawn again.
    pub fn is_more_than(&self, least: f64) -> bool {
        self.difference > least && self.quantile > 0.0
    }
}

/// True if every effect of one set is in another, as it is or in a richer kind, and the other has more.
pub(super) fn contains(larger: &[usize], smaller: &[usize], forms: &[Form]) -> bool {
    let mut left: Vec<usize> = larger.to_vec();
    let mut richer = larger.len() > smaller.len();
    for s in smaller {
        let same = left.iter().position(|l| l == s);
        let kind = || left.iter().position(|l| forms[*l].includes(&forms[*s]));
        match same.or_else(kind) {
            Some(place) => {
                richer |= left[place] != *s;
                left.remove(place);
            }
            None => return false,
        }
    }
    richer
}

/// Number of parts of a set: an effect that contains a simpler one counts for two, unless the model has all of those already.
pub(super) fn parts(set: &[usize], forms: &[Form]) -> usize {
    let richer = |form: &Form| forms.iter().any(|simpler| form.includes(simpler));
    set.iter().map(|k| 1 + usize::from(richer(&forms[*k]))).sum()
}

/// Decides between sets. `present` is a set that each must contain. `least` is the sum that a set must lead those by that it
/// is more than, `far` that by which it must lead those of another kind: more where nothing explains the data. What is left where
/// a part of a set `suffices` is given no name, however well the set predicts it; nor does a richer kind speak against a simpler one
/// that leaves no more than what is `unknown`.
pub(super) fn judge(
    constants: &Constants,
    sets: &[Hypothesis],
    forms: &[Form],
    present: &[usize],
    (least, far): (f64, f64),
    suffices: &dyn Fn(&Hypothesis, &Hypothesis) -> bool,
    unknown: &dyn Fn(&Hypothesis, &Hypothesis) -> bool,
) -> Ruling {
    let explained = far <= least;
    let is_more = |set: &[usize]| set.len() > present.len() && present.iter().all(|k| set.contains(k));
    // That a sensor's zero is free in each record is no part of it that data bear or not.
    let frees_a_zero = |richer: &Hypothesis, simpler: &Hypothesis| {
        richer.forms.iter().any(|k| !simpler.forms.contains(k) && forms[*k].is_offset())
    };
    let borne = |set: &Hypothesis| {
        let simpler = |other: &&Hypothesis| {
            let as_many = other.forms.len() == set.forms.len() && contains(&set.forms, &other.forms, forms);
            as_many && other.unborne.is_none() && !frees_a_zero(set, other)
        };
        set.unborne.is_none() && sets.iter().filter(simpler).all(|other| constants.tells_apart(set, other))
    };
    let settles = explained.then_some(far);
    let settled = |set: &Hypothesis, other: &Hypothesis| {
        settles.is_some_and(|least| constants.settled(set, other, least).is_some())
    };
    let stands = |k: usize| {
        let set = &sets[k];
        let part = |other: &&Hypothesis| contains(&set.forms, &other.forms, forms);
        let fewer = |other: &&Hypothesis| other.forms.len() < set.forms.len();
        let enough = |other: &Hypothesis| is_more(&other.forms) && other.unborne.is_none() && suffices(other, set);
        is_more(&set.forms)
            && borne(set)
            && sets.iter().filter(part).all(|other| {
                let asked = if fewer(&other) { least } else { far };
                constants.beats(set, other, asked) || other.forms.len() == present.len() && settled(set, other)
            })
            && !sets.iter().filter(part).filter(fewer).any(enough)
    };
    let standing: Vec<usize> = (0..sets.len()).filter(|k| stands(*k)).collect();
    let best = |list: &[usize]| list.iter().copied().max_by(|a, b| sets[*a].sum().total_cmp(&sets[*b].sum()));
    let Some(first) = best(&standing) else { return Ruling::default() };
    let size = parts(&sets[first].forms, forms);
    let wins = |rival: &Hypothesis| constants.beats(&sets[first], rival, far) || settled(&sets[first], rival);
    let rivals = (0..sets.len()).filter(|k| {
        let rival = &sets[*k];
        *k != first
            && borne(rival)
            && is_more(&rival.forms)
            && parts(&rival.forms, forms) <= size
            && !contains(&rival.forms, &sets[first].forms, forms)
            && !contains(&sets[first].forms, &rival.forms, forms)
            && (!wins(rival) || constants.makes_up(rival, &sets[first], explained))
    });
    // A richer kind that predicts better without beating it, of which the data bear every part, is not told from it.
    let richer = (0..sets.len()).filter(|k| {
        let kind = &sets[*k];
        explained
            && borne(kind)
            && kind.forms.len() == sets[first].forms.len()
            && contains(&kind.forms, &sets[first].forms, forms)
            && !frees_a_zero(kind, &sets[first])
            && kind.sum() > sets[first].sum()
            && !unknown(&sets[first], kind)
    });
    let mut near: Vec<usize> = rivals.chain(richer).collect();
    // Of those that cannot be told apart the one with the fewest parameters that stands is shown, of these the commonest. Where all
    // are wrong in some way still, fewer parameters say little, and what is met most often comes first.
    let mut all: Vec<usize> = near.iter().copied().filter(|k| standing.contains(k)).chain([first]).collect();
    all.sort_by(|a, b| {
        let plain = |k: usize| {
            let uncommon = sets[k].forms.iter().filter(|f| !forms[**f].is_common()).count();
            let parameters = sets[k].fitted.composition.parameters();
            if explained { (parameters, uncommon) } else { (uncommon, parameters) }
        };
        plain(*a).cmp(&plain(*b)).then_with(|| sets[*b].sum().total_cmp(&sets[*a].sum()))
    });
    let winner = all[0];
    near.push(first);
    near.retain(|k| *k != winner);
    near.sort_by(|a, b| sets[*b].sum().total_cmp(&sets[*a].sum()));
    near.dedup();
    Ruling { winner: Some(winner), rivals: near, settles }
}

impl Data {
    /// Log densities of the blocks that a fit did not see.
    pub(super) fn densities(&self, fitted: &Fitted, cancel: &Cancel) -> Vec<f64> {
        let composition = &fitted.composition;
        let shared = &fitted.refined.point.shared;
        let begun = self.begun(fitted);
        let throughout = self.is_followed_throughout(fitted);
        let of = |shared: &[f64], run: &Run| {
            let along = self.series.iter().zip(&begun).find(|(s, _)| Arc::ptr_eq(&s.grid, &run.grid));
            let begun = along.and_then(|(_, begun)| begun.as_ref());
            self.predicted(composition, shared, (run, begun, throughout), cancel)
        };
        let own: Vec<f64> = self.whole().iter().flat_map(|run| of(shared, run)).flatten().collect();
        let scale = self.scale(&own, fitted.refined.unknowns() - fitted.refined.passing());
        // A sensor set to another range has other noise: a set must neither lose there for having been surer, nor win for it.
        let density = |run: &Run, errors: &[f64]| {
            let (noise, noise_there) = (self.noise.max(f64::MIN_POSITIVE), self.noise_in(run));
            let beside = (scale * scale - noise * noise).max(0.0).sqrt();
            // Kinks of the fitted motion, which pass for noise where no model is known, make no other sensor of one that has none.
            let there = (scale.min(noise) / noise * noise_there).max(scale.min(self.gaussian_scale * noise_there));
            self.constants.density(errors, beside.hypot(there))
        };
        let blocks = |shared: &[f64], run: &Run| -> Vec<f64> {
            of(shared, run).iter().map(|errors| density(run, errors)).collect()
        };
        if self.held_out().is_empty() {
            let folds = self.folds().into_iter().zip(&fitted.refitted);
            folds
                .flat_map(|((_, test), shared)| test.iter().flat_map(|run| blocks(shared, run)).collect::<Vec<_>>())
                .collect()
        } else {
            let records = self.held_out().iter().map(|s| Run { record: 0, ..s.run() });
            records.flat_map(|run| blocks(shared, &run)).collect()
        }
    }

    /// Where accelerations are measured, a fitted model's motion along each record with its sensors' offsets: what is smoothed from
    /// them alone is too far off to begin a state's estimate with, as stops lie between that no slope leads across.
    fn begun(&self, fitted: &Fitted) -> Vec<Option<Begun>> {
        if !self.shows_rates() {
            return Vec::new();
        }
        let followed = fitted.followed().into_iter().chain(fitted.held_out.iter().cloned());
        let of_record = |(s, Followed { beginnings, .. }): (&RecordSeries, Followed)| {
            let path = self.path_along(&fitted.composition, &fitted.refined.point.shared, s, &beginnings)?;
            (path.x[0].len() == s.len()).then_some((path, beginnings.offsets))
        };
        self.series.iter().zip(followed).map(of_record).collect()
    }

    /// Samples that no fit sees.
    pub(super) fn unseen(&self) -> usize {
        let of_folds = self.folds().iter().flat_map(|(_, test)| test).map(Run::rows).sum::<usize>();
        of_folds + self.held_out().iter().map(|s| s.run().rows()).sum::<usize>()
    }

    /// Length of a block, s: where few periods are unseen, such that some blocks can be told from one.
    fn block(&self) -> f64 {
        let seconds = |runs: &[Run]| runs.iter().map(|r| r.range.len() as f64 * r.grid.interval()).sum::<f64>();
        let held_out: Vec<Run> = self.held_out().iter().map(RecordSeries::run).collect();
        let unseen = seconds(&held_out) + self.folds().iter().map(|(_, test)| seconds(test)).sum::<f64>();
        self.constants.block_length(self.period, unseen)
    }

    /// True if a model follows whole records, through no rest. Estimated over a period alone, a block's state is as uncertain as the
    /// noise, which hides what an effect of the noise's size does; such a model's is estimated over as long as is predicted. Where
    /// masses rest their state has jumps, and what is long past says nothing of it.
    fn is_followed_throughout(&self, fitted: &Fitted) -> bool {
        fitted.level == WHOLE && !self.rests()
    }

    /// Errors of each block of a record that parameters predict, weighted; a block's state is estimated over a period before it, or
    /// over as long as it lasts where the model follows records `throughout`, or what there is, from where the model is along the
    /// record if that is known.
    fn predicted(
        &self,
        composition: &Composition,
        shared: &[f64],
        (record, begun, throughout): (&Run, Option<&Begun>, bool),
        cancel: &Cancel,
    ) -> Vec<Vec<f64>> {
        let n = record.range.len();
        let period = ((self.period / record.grid.interval()) as usize).clamp(4, (n / 3).max(4));
        let first = record.range.start + if record.range.start >= period { 0 } else { period };
        let block = (self.block() / record.grid.interval()) as usize;
        let length = block.min(record.range.end - first).max(1);
        let count = ((record.range.end - first) as f64 / length as f64).round().max(1.0) as usize;
        let borders: Vec<usize> = (0..=count).map(|k| (first + k * length).min(record.range.end)).collect();
        let lead_in = if throughout { length.max(period) } else { period };
        let spans: Vec<(usize, usize)> = borders.windows(2).map(|b| (b[0], b[1])).filter(|(a, b)| b > a).collect();
        let cancelled = || cancel.is_cancelled();
        let steps = self.constants.few_steps();
        let frozen = FitOptions { frozen: true, driven: true, ..self.options(&cancelled, steps, None) };
        let part = |range: std::ops::Range<usize>| Run { record: 0, ..record.part(range) };
        let attempt = |spans: &[(usize, usize)]| -> Option<Vec<Vec<f64>>> {
            let before: Vec<Run> = spans.iter().map(|(a, _)| part(a.saturating_sub(lead_in)..*a)).collect();
            let mut start = Point::new(composition, &before, shared.to_vec(), true);
            if let Some((path, offsets)) = begun {
                for (own, run) in start.own.iter_mut().zip(&before) {
                    let there = path.x.iter().chain(&path.v).map(|state| state[run.range.start]);
                    own.iter_mut().zip(there).for_each(|(own, there)| *own = there);
                }
                start.offsets.iter_mut().zip(offsets).for_each(|(start, there)| *start = *there);
            }
            let found = refine(composition, &before, &start, frozen)?;
            let whole: Vec<Run> = spans.iter().map(|(a, b)| part(a.saturating_sub(lead_in)..*b)).collect();
            let errors = residuals_beside_jumps(composition, &whole, &found.point, frozen)?;
            let of_block = |((run, before), errors): ((&Run, &Run), Vec<f64>)| {
                let seen = before.range.len();
                errors.chunks(run.range.len()).flat_map(|sensor| sensor[seen..].iter().copied()).collect()
            };
            Some(whole.iter().zip(&before).zip(errors).map(of_block).collect())
        };
        // Where one block runs away, the others are predicted without it.
        attempt(&spans).unwrap_or_else(|| {
            let lost = LOST * self.loudest();
            let each = spans.iter().map(|span| {
                let rows = (span.1 - span.0) * record.measured.len();
                attempt(&[*span]).and_then(|mut only| only.pop()).unwrap_or_else(|| vec![lost; rows])
            });
            each.collect()
        })
    }

    /// The scale of Student's law that errors are most likely under; `taken` values were fitted to them.
    fn scale(&self, errors: &[f64], taken: usize) -> f64 {
        self.constants.student_scale(errors, taken).max(1e-6 * self.loudest())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_block_does_not_make_a_lead() {
        let [calm, one] = [vec![0.0; 6], vec![60.0, -1.0, -1.0, -1.0, -1.0, -1.0]];
        let lead = Constants::DEFAULT.compared(&one, &calm, "");
        assert_eq!((lead.blocks, lead.won), (6, 1));
        assert!(lead.difference > Constants::DEFAULT.lead && !Constants::DEFAULT.is_enough(&lead));
        let back = Constants::DEFAULT.compared(&calm, &one, "");
        assert_eq!((lead.signed(), back.signed()), ("+55".to_owned(), "−55".to_owned()));
    }
}
