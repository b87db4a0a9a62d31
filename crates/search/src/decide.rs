//! Which candidate is named, which are refused, and which the data cannot tell apart.

use nalgebra::{DMatrix, DVector};

use super::effects::{Direction, Form};
use super::fit::Fitted;
use super::parameters::Parameters;
use super::site::Site;
use sindyscope_core::refine::{Refined, inflation};

/// How much better a candidate is than the model that it was added to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Score {
    /// Difference of the Bayesian information criterion on the fitted records, independent samples counted; negative is
    /// better.
    pub(super) bic: f64,
    /// Difference of twice the negative log-likelihood of the data left out.
    pub(super) test: f64,
    /// RMSE of the fitted data.
    pub(super) error: f64,
    /// RMSE of the data left out.
    pub(super) rmse: f64,
    /// The larger of that and of the fitted data's.
    pub(super) largest: f64,
    /// Both together; a gain on the fitted data counts only as far as the data left out bear it out.
    pub(super) total: f64,
}

/// Difference of scores (twice a log odds ratio) below which two candidates are not told apart: odds of 150 to 1.
pub(super) const APART: f64 = 10.0;
/// The same where the data fitted speak alone: on which side of a jump samples lie is worth as much.
const ALONE: f64 = 20.0;
/// How many times the gain of the data left out, sample for sample, a gain on the fitted data may count.
const TRUSTED: f64 = 3.0;
/// Gain in score that a candidate needs at least.
pub(super) const WORTH: f64 = 10.0;
/// Gain that the data left out must show by themselves.
const SHOWN: f64 = 4.0;
/// By how much no single record left out may get worse.
const WORSE: f64 = 1.10;
/// Difference below which two candidates are not told apart on one steady tone, where harmonics alone speak.
pub(super) const APART_ON_A_TONE: f64 = 200.0;
/// Where what is left is this many times the noise, the model is wrong in some way still, and likelihoods say too much:
pub(super) const FAR: f64 = 3.0;
/// then a richer form must make the error on data left out this many times smaller than the simpler one does.
pub(super) const CLEARLY: f64 = 1.25;
/// a rival is told from the first where it leaves so many times its error,
const NEARLY: f64 = 1.1;
/// and any form must make that error this many times smaller: of a model that is wrong, nearly every term mends something.
const SHRUNK: f64 = 1.3;
/// How many times smaller an effect makes the error on data never fitted at least where another is in place already.
const NOTABLE: f64 = 1.1;
/// By how much a form with more in it must beat the simpler one that it contains.
const RICHER: f64 = 4.0;
/// The same where the response jumps as an inner quantity moves, and chance has more to choose from.
const JUMPING: f64 = 8.0;

/// Standard errors that a quantity of an effect must lie from zero.
const CERTAIN: f64 = 2.0;

/// What a number costs that the samples do not determine the better the more there are (Akaike's).
const PASSING: f64 = 2.0;

/// What bounds how far errors tell candidates apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resolution {
    /// RMS of what no model explains.
    pub(super) noise: f64,
    /// RMS of what the inputs' course between samples may come to in the response.
    pub(super) course: f64,
}

impl Resolution {
    /// What a true model may leave.
    pub(super) fn noise(self) -> f64 {
        self.noise.hypot(self.course)
    }

    /// True if one fit leaves more than another by no more than the inputs' course may make.
    fn leaves_open(self, more: &Score, less: &Score) -> bool {
        more.error <= less.error.hypot(self.course) && more.rmse <= less.rmse.hypot(self.course)
    }
}

impl Score {
    /// True if what is left is far more than noise, on the data fitted or on those that were not: the model is wrong in some
    /// way still.
    pub(super) fn is_far(&self, noise: f64) -> bool {
        self.largest > FAR * noise
    }

    /// True if data never fitted are explained better than by a simpler form by what a further number costs.
    fn is_borne_out_beside(&self, simpler: &Self) -> bool {
        simpler.test - self.test > PASSING
    }
}

/// Scores a model against another, for residuals that vary `colour` times more than white ones where the motion is. Both are
/// fitted over the same segments.
pub(super) fn score(before: &Fitted, after: &Fitted, colour: f64, floor: f64) -> Score {
    let n = after.refined.samples as f64 / colour;
    // Below the floor a residual is as good as none: clean data must not make every digit a proof.
    let level = |error: f64| (error * error + floor * floor).max(f64::MIN_POSITIVE).ln();
    let fitted = level(after.refined.rmse()) - level(before.refined.rmse());
    // An internal state's beginning is felt for a moment only: more samples do not determine it better, and it costs what
    // any number fitted does.
    let states = 2 * after.composition.layout.freedoms;
    let passing =
        |f: &Fitted| f.refined.point.own.iter().map(|own| own.len().saturating_sub(states)).sum::<usize>() as f64;
    let more_passing = passing(after) - passing(before);
    let more = after.refined.unknowns() as f64 - before.refined.unknowns() as f64 - more_passing;
    let penalty = more * n.max(2.0).ln() + PASSING * more_passing;
    let samples: usize = after.folds.iter().map(|f| f.samples).sum();
    let m = samples as f64 / colour;
    let held = if samples > 0 { level(after.held_out_error()) - level(before.held_out_error()) } else { fitted };
    Score {
        bic: n * fitted + penalty,
        test: m * held,
        error: after.error(),
        rmse: after.held_out_error(),
        largest: after.held_out_error().max(after.error()),
        total: n * fitted.max(TRUSTED * held) + m * held + penalty,
    }
}

/// Variance inflation: how many times as uncertain as under white residuals a fit is, its residuals being correlated where the
/// motion is.
pub(super) fn variance_inflation(fitted: &Fitted, frequency: f64, interval: f64) -> f64 {
    // The series of each sensor in each run by itself.
    let runs = fitted.refined.residuals.iter().zip(fitted.runs.iter());
    let series: Vec<&[f64]> = runs.flat_map(|(e, run)| e.chunks(run.range.len().max(1))).collect();
    inflation(&series, frequency * interval)
}

/// Why a candidate is refused, in words.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Refusal {
    /// It is not what its name says.
    Itself(String),
    /// The data do not determine its parts. Where it explains as much as another they cannot tell the two apart.
    Undetermined(String),
    /// Data never fitted do not bear it out. With another effect in place they might.
    LeftOut(String),
}

impl Refusal {
    pub(super) fn reason(&self) -> &str {
        match self {
            Self::Itself(reason) | Self::Undetermined(reason) | Self::LeftOut(reason) => reason,
        }
    }
}

/// Why a set of forms is refused, the last ones of a fit; none if it stands.
pub(super) fn refusal(
    forms: &[&Form],
    before: &Fitted,
    after: (&Fitted, &Score),
    colour: f64,
    (noise, unit): (f64, &str),
) -> Option<Refusal> {
    forms
        .iter()
        .find_map(|form| unsound(form, after.0, colour))
        .or_else(|| unsupported(before, after, noise, unit).map(Refusal::LeftOut))
}

/// True if a fit does not tell a form's size from zero.
pub(super) fn is_undetermined(form: &Form, fitted: &Fitted, colour: f64) -> bool {
    matches!(unsound(form, fitted, colour), Some(Refusal::Undetermined(_)))
}

/// Why a fitted form is not what its name says, or no part that the data need.
fn unsound(form: &Form, after: &Fitted, colour: f64) -> Option<Refusal> {
    let refined = &after.refined;
    let index = after.composition.index_of(form)?;
    let Parameters { coefficients: values, inner } = &after.parameters;
    let positions = after.composition.positions();
    let own = after.composition.places(inner).swap_remove(index);
    let coefficients = || own.clone().map(|k| (values[k], positions.coefficients[k]));
    let quantities = inner.forms[index].iter().zip(&positions.inner.forms[index]);
    let doubt = |k: usize| refined.std_error(k).map(|e| e * colour.sqrt());
    let mut open: Vec<usize> = Vec::new();
    for (coefficient, (value, k)) in form.coefficients.iter().zip(coefficients()) {
        if refined.at_bound[k] {
            return Some(Refusal::Itself(format!(
                "its {} comes out zero: to help it would have to act the wrong way round",
                coefficient.name
            )));
        }
        if coefficient.sign == Direction::Any {
            open.push(k);
        } else if value.abs() < CERTAIN * doubt(k).unwrap_or(0.0) {
            // A form with more in it needs every part of it.
            return Some(Refusal::Undetermined(format!("its {} cannot be told from zero", coefficient.name)));
        }
    }
    if let Some(Site::Joint(..)) = form.site {
        // A joint pulls its two masses opposite ways: both parts have one sign as shown, and neither is nothing.
        let parts: Vec<(f64, f64)> = form
            .coefficients
            .iter()
            .zip(coefficients())
            .map(|(c, (value, k))| (c.shown(value), CERTAIN * doubt(k).unwrap_or(0.0)))
            .collect();
        for pair in parts.chunks_exact(2) {
            if pair.iter().any(|(value, doubt)| value.abs() < *doubt) {
                let reason = "its force on one of the two masses cannot be told from zero";
                return Some(Refusal::Undetermined(reason.to_owned()));
            }
            if pair[0].0 * pair[1].0 < 0.0 {
                return Some(Refusal::Itself("it would have to push both masses the same way".to_owned()));
            }
        }
    }
    if !open.is_empty() && wald(refined, &open) < CERTAIN * CERTAIN * colour * open.len() as f64 {
        return Some(Refusal::Undetermined("its size cannot be told from zero".to_owned()));
    }
    for (quantity, (&value, &k)) in form.inner.iter().zip(quantities) {
        let (low, high) = quantity.bounds;
        if low < 0.0 && high > 0.0 && value.abs() < CERTAIN * doubt(k).unwrap_or(0.0) {
            return Some(Refusal::Undetermined(format!("its {} cannot be told from zero", quantity.name)));
        }
        if quantity.jumps && value - low < CERTAIN * doubt(k).unwrap_or(0.0) {
            return Some(Refusal::Undetermined(format!("its {} cannot be told from {low}", quantity.name)));
        }
        if (value - low).abs() < 0.01 * (high - low).abs().min(value.abs()) || (high - value).abs() < 0.01 * high.abs()
        {
            return Some(Refusal::Itself(format!(
                "{} runs to the end of what is sensible: these data do not exercise it",
                quantity.name
            )));
        }
    }
    None
}

/// Wald's statistic of parameters that are zero without an effect: their squares over their variance, correlations allowed
/// for. Infinite where the fit gives no covariance.
fn wald(refined: &Refined, places: &[usize]) -> f64 {
    let n = places.len();
    if places.iter().any(|k| *k >= refined.covariance.nrows()) {
        return f64::INFINITY;
    }
    let covariance = DMatrix::from_fn(n, n, |i, j| refined.covariance[(places[i], places[j])]);
    let values = DVector::from_iterator(n, places.iter().map(|k| refined.point.shared[*k]));
    covariance.cholesky().map_or(f64::INFINITY, |c| values.dot(&c.solve(&values)))
}

/// What data never fitted say against a fit.
pub(super) fn unsupported(
    before: &Fitted,
    (after, score): (&Fitted, &Score),
    noise: f64,
    unit: &str,
) -> Option<String> {
    let number = |v: f64| sindyscope_values::format::units::format_si(v, unit, 3);
    let rms = Fitted::held_out_error;
    let worse = before.folds.iter().zip(&after.folds).find(|(b, a)| a.rmse() > WORSE * b.rmse());
    if let Some((b, a)) = worse {
        return Some(format!(
            "the fit gets better, but data never fitted get worse: {} → {}",
            number(b.rmse()),
            number(a.rmse())
        ));
    }
    if score.test > -SHOWN {
        return Some(format!("data never fitted get no better: {} → {}", number(rms(before)), number(rms(after))));
    }
    // With an effect in place what is left is small, and smoothing, sampling and inputs leave their share of it.
    if !before.composition.forms.is_empty() && rms(before) < NOTABLE * rms(after) {
        return Some(format!(
            "beside what was added, data never fitted get hardly better: {} → {}",
            number(rms(before)),
            number(rms(after))
        ));
    }
    if score.is_far(noise) && rms(before) < SHRUNK * rms(after) {
        return Some(format!(
            "far more than noise is left, and data never fitted get hardly better: {} → {}",
            number(rms(before)),
            number(rms(after))
        ));
    }
    (score.total > -WORTH).then(|| "what it explains is no more than chance might".to_owned())
}

/// True if a single effect does as well as a pair, as far as data tell.
pub(super) fn fewer_do(single: &Score, pair: &Score, noise: f64) -> bool {
    if single.is_far(noise) || pair.is_far(noise) {
        return single.rmse < SHRUNK * pair.rmse;
    }
    single.total < pair.total + WORTH
}

/// A candidate of a round that the data do not refuse.
#[derive(Clone, Copy)]
pub(super) struct Contender<'a> {
    /// Its place among the forms.
    pub(super) index: usize,
    pub(super) form: &'a Form,
    pub(super) score: Score,
    /// Whether the data tell each of its parts from zero.
    pub(super) determined: bool,
    /// Number of values that were fitted with it, to records held out too.
    pub(super) unknowns: usize,
}

impl Contender<'_> {
    /// True if the other is a special or limiting case of it with fewer values to fit. An offset for each of several records
    /// is more than a constant force, the offset of one is not.
    fn is_richer_than(&self, other: &Self) -> bool {
        self.form.includes(other.form) && self.unknowns > other.unknowns
    }
}

/// The order of candidates that stand, best first: by score, but where all are far from the noise by the error on data never
/// fitted. A form that contains a simpler one must beat it clearly.
pub(super) fn order(candidates: &[Contender<'_>], resolution: Resolution) -> Vec<usize> {
    let noise = resolution.noise();
    let far = candidates.iter().all(|c| c.score.is_far(noise));
    let rank = |c: &Contender<'_>| if far { c.score.rmse } else { c.score.total };
    let mut left: Vec<&Contender<'_>> = candidates.iter().collect();
    let mut out = Vec::new();
    while !left.is_empty() {
        let lowest = |list: &[&Contender<'_>]| {
            (0..list.len()).min_by(|a, b| rank(list[*a]).total_cmp(&rank(list[*b]))).unwrap_or(0)
        };
        let mut best = lowest(&left);
        while let Some(simpler) = left
            .iter()
            .enumerate()
            .filter(|(_, c)| left[best].form.includes(c.form))
            .filter(|(_, c)| {
                let (rich, simple) = (left[best].score, c.score);
                if rich.is_far(noise) {
                    return simple.rmse < CLEARLY * rich.rmse;
                }
                // What data never fitted do not bear out is no more than a better fit.
                if !rich.is_borne_out_beside(&simple) || resolution.leaves_open(&simple, &rich) {
                    return true;
                }
                let margin = if left[best].form.inner.iter().any(|i| i.jumps) { JUMPING } else { RICHER };
                simple.total - rich.total < margin
            })
            .min_by(|a, b| rank(a.1).total_cmp(&rank(b.1)))
            .map(|(k, _)| k)
        {
            best = simpler;
        }
        out.push(left.remove(best).index);
    }
    out
}

/// The candidates that cannot be told from the first. Far from the noise likelihoods say too much, and rivals are those with
/// which data never fitted are explained nearly as well.
pub(super) fn confused(
    first: &Contender<'_>,
    others: &[Contender<'_>],
    apart: f64,
    resolution: Resolution,
) -> Vec<usize> {
    let noise = resolution.noise();
    let best = &first.score;
    let far = best.is_far(noise);
    let as_good = |score: &Score| {
        let near = if far { score.rmse < NEARLY * best.rmse } else { score.total - best.total < apart };
        near || resolution.leaves_open(score, best)
    };
    let better = |score: &Score| {
        if far { score.rmse < best.rmse } else { score.total <= best.total }
    };
    // The data fitted speak for the other, and those never fitted do not tell the two apart, or refuse the first too.
    let disputed = |other: &Contender<'_>| {
        let score = &other.score;
        let undecided = other.determined && score.rmse < NEARLY * best.rmse && score.bic < best.bic - ALONE;
        let refused = best.rmse > NEARLY * noise && score.rmse < CLEARLY * best.rmse && score.bic < best.bic - apart;
        (undecided || refused) && score.error < NEARLY * noise
    };
    others
        .iter()
        .filter(|other| {
            let Contender { form, score, .. } = other;
            (form.effect != first.form.effect || form.is_elsewhere(first.form))
                // A richer form fits as well by nature: it is a rival only where it does better than its price, on the data
                // fitted as on all, and data never fitted bear it out; or where the two are disputed.
                && if other.is_richer_than(first) {
                    let borne_out = score.is_borne_out_beside(best) && !resolution.leaves_open(best, score);
                    let paid = score.bic < best.bic;
                    as_good(score) && better(score) && paid && borne_out || disputed(other)
                } else {
                    as_good(score)
                }
        })
        .map(|other| other.index)
        .collect()
}
