//! Which candidate is named, which are refused, and which the data cannot tell apart.

use super::effects::{Form, Sign};
use super::fit::Fitted;
use crate::format::number::significant;
use crate::refine::{Structure, inflation};

/// How much better a candidate is than the model that it was added to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Score {
    /// Difference of the Bayesian information criterion on the fitted records, independent samples counted; negative is
    /// better.
    pub(super) bic: f64,
    /// Difference of twice the negative log-likelihood of the data left out.
    pub(super) test: f64,
    /// RMSE of the data left out.
    pub(super) rmse: f64,
    /// Both together; a gain on the fitted data counts only as far as the data left out bear it out.
    pub(super) total: f64,
}

/// Difference of scores (twice a log odds ratio) below which two candidates are not told apart: odds of 150 to 1.
pub(super) const APART: f64 = 10.0;
/// How many times the gain of the data left out, sample for sample, a gain on the fitted data may count.
const TRUSTED: f64 = 3.0;
/// Gain in score that a candidate needs at least.
const WORTH: f64 = 10.0;
/// Gain that the data left out must show by themselves.
const SHOWN: f64 = 4.0;
/// By how much no single record left out may get worse.
const WORSE: f64 = 1.10;
/// Difference below which two candidates are not told apart on one steady tone, where harmonics alone speak.
pub(super) const APART_ON_A_TONE: f64 = 200.0;
/// Where what is left is this many times the noise, the model is wrong in some way still, and likelihoods say too much:
pub(super) const FAR: f64 = 3.0;
/// then a richer form must make the error on data left out this many times smaller than the simpler one does.
const CLEARLY: f64 = 1.25;
/// and any form must make that error this many times smaller: of a model that is wrong, nearly every term mends something.
const SHRUNK: f64 = 1.3;
/// By how much a form with more in it must beat the simpler one that it contains.
const RICHER: f64 = 4.0;
/// The same where the response jumps as an inner quantity moves, and chance has more to choose from.
const JUMPING: f64 = 8.0;

/// What a number costs that the samples do not determine the better the more there are (Akaike's).
const PASSING: f64 = 2.0;

/// Scores a model against another, for residuals that vary `colour` times more than white ones where the motion is.
pub(super) fn score(before: &Fitted, after: &Fitted, colour: f64, floor: f64) -> Score {
    let n = after.refined.samples as f64 / colour;
    // Below the floor a residual is as good as none: clean data must not make every digit a proof.
    let level = |rss: f64, n: usize| (rss / n.max(1) as f64 + floor * floor).max(f64::MIN_POSITIVE).ln();
    let train = |f: &Fitted| level(f.refined.rss, f.refined.samples);
    let left_out = |f: &Fitted| f.folds.iter().fold((0.0, 0), |(r, n), f| (r + f.rss, n + f.samples));
    let fitted = train(after) - train(before);
    // An internal state's beginning is felt for a moment only: more samples do not determine it better, and it costs what
    // any number fitted does.
    let passing = |f: &Fitted| f.refined.point.own.iter().map(|own| own.len().saturating_sub(2)).sum::<usize>() as f64;
    let more_passing = passing(after) - passing(before);
    let more = after.refined.unknowns() as f64 - before.refined.unknowns() as f64 - more_passing;
    let penalty = more * n.max(2.0).ln() + PASSING * more_passing;
    let ((rss, samples), (rss_before, _)) = (left_out(after), left_out(before));
    let m = samples as f64 / colour;
    let held = if samples > 0 { level(rss, samples) - level(rss_before, samples) } else { fitted };
    let rmse = after.gap.test_rmse.unwrap_or(after.gap.train_rmse);
    Score {
        bic: n * fitted + penalty,
        test: m * held,
        rmse,
        total: n * fitted.max(TRUSTED * held) + m * held + penalty,
    }
}

/// How much the residuals of a fit are coloured where the motion is.
pub(super) fn colour(fitted: &Fitted, frequency: f64, interval: f64) -> f64 {
    let series: Vec<&[f64]> = fitted.refined.residuals.iter().map(Vec::as_slice).collect();
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

/// Why a candidate is refused; none if it stands.
pub(super) fn refusal(
    form: &Form,
    before: &Fitted,
    after: (&Fitted, &Score),
    colour: f64,
    (noise, unit): (f64, &str),
) -> Option<Refusal> {
    unsound(form, after.0, colour).or_else(|| unborne(before, after, noise, unit).map(Refusal::LeftOut))
}

/// Why a fitted form is not what its name says.
fn unsound(form: &Form, after: &Fitted, colour: f64) -> Option<Refusal> {
    let shared = &after.refined.point.shared;
    let composition = &after.composition;
    if let Some(objection) = composition.objection(shared) {
        return Some(Refusal::Itself(objection));
    }
    let doubt = |k: usize| after.refined.std_error(k).map_or(0.0, |e| e * colour.sqrt());
    let places = composition.places(&shared[shared.len() - composition.inner_count()..]);
    let own = places.last().cloned().unwrap_or(0..0);
    for (coefficient, k) in form.coefficients.iter().zip(own) {
        // A form with more in it needs every part of it.
        if coefficient.sign == Sign::Against && shared[k].abs() < 2.0 * doubt(k) {
            return Some(Refusal::Undetermined(format!("its {} cannot be told from zero", coefficient.name)));
        }
    }
    let damper = composition.dampers(&shared[shared.len() - composition.inner_count()..]);
    if let Some((k, term)) = damper.into_iter().find(|(k, _)| shared[*k] > 3.0 * doubt(*k)) {
        return Some(Refusal::Itself(format!(
            "the model's own damper, {}, would have to push: {term} comes out positive",
            significant(shared[k], 3)
        )));
    }
    let first = shared.len() - form.inner.len();
    for (quantity, k) in form.inner.iter().zip(first..) {
        let (value, (low, high)) = (shared[k], quantity.bounds);
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

/// What data never fitted say against a fit.
pub(super) fn unborne(before: &Fitted, (after, score): (&Fitted, &Score), noise: f64, unit: &str) -> Option<String> {
    let number = |v: f64| crate::format::units::format_si(v, unit, 3);
    let rms = |f: &Fitted| f.gap.test_rmse.unwrap_or(f.gap.train_rmse);
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
    if score.rmse > FAR * noise && rms(before) < SHRUNK * rms(after) {
        return Some(format!(
            "far more than noise is left, and data never fitted get hardly better: {} → {}",
            number(rms(before)),
            number(rms(after))
        ));
    }
    (score.total > -WORTH).then(|| "what it explains is no more than chance might".to_owned())
}

/// True if a fit explains data never fitted clearly better than another.
pub(super) fn clearly_better(fit: &Fitted, other: &Fitted) -> bool {
    fit.gap.test_rmse.zip(other.gap.test_rmse).is_some_and(|(a, b)| SHRUNK * a < b)
}

/// The order of candidates that stand, best first: by score, but a form that contains a simpler one must beat it clearly.
pub(super) fn order(candidates: &[(usize, &Form, Score)], noise: f64) -> Vec<usize> {
    let mut left: Vec<&(usize, &Form, Score)> = candidates.iter().collect();
    let mut out = Vec::new();
    while !left.is_empty() {
        let lowest = |list: &[&(usize, &Form, Score)]| {
            (0..list.len()).min_by(|a, b| list[*a].2.total.total_cmp(&list[*b].2.total)).unwrap_or(0)
        };
        let mut best = lowest(&left);
        while let Some(simpler) = left
            .iter()
            .enumerate()
            .filter(|(_, c)| left[best].1.contains.contains(&c.1.effect))
            .filter(|(_, c)| {
                let rich = left[best].2;
                let margin = if left[best].1.inner.iter().any(|i| i.jumps) { JUMPING } else { RICHER };
                c.2.total - rich.total < margin || (rich.rmse > FAR * noise && c.2.rmse < CLEARLY * rich.rmse)
            })
            .min_by(|a, b| a.1.2.total.total_cmp(&b.1.2.total))
            .map(|(k, _)| k)
        {
            best = simpler;
        }
        out.push(left.remove(best).0);
    }
    out
}

/// The candidates that cannot be told from the first.
pub(super) fn confused(first: (&Form, Score), others: &[(usize, &Form, Score)], apart: f64, noise: f64) -> Vec<usize> {
    others
        .iter()
        .filter(|(_, form, score)| {
            form.effect != first.0.effect
                && score.total - first.1.total < apart
                // A richer form fits as well by nature: it is a rival only where it does better than its price.
                && !(form.contains.contains(&first.0.effect)
                    && (score.total > first.1.total || first.1.rmse > FAR * noise))
        })
        .map(|(k, _, _)| *k)
        .collect()
}
