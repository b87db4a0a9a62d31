//! Errors as the report defines them: E(t) is the distance of measured and simulated value, RMSE that over the record.

use serde::{Deserialize, Serialize};

/// A simulated response held against a measurement, in the record's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Root mean square of the error E(t).
    pub rmse: f64,
    /// `rmse` over the record's standard deviation.
    pub nrmse: f64,
    /// Largest error.
    pub max_error: f64,
    /// Best fit, %: 100 (1 − ‖y−ŷ‖/‖y−ȳ‖).
    pub best_fit: f64,
    /// Samples compared.
    pub samples: usize,
}

impl Score {
    /// The score of what a model leaves of a measurement; none of nothing.
    pub fn of_residual(measured: &[f64], residual: &[f64]) -> Option<Self> {
        let response: Vec<f64> = measured.iter().zip(residual).map(|(y, e)| y - e).collect();
        ErrorSums::compare(measured, &response, 0, &mut Vec::new()).score()
    }

    /// The score of several records of one sensor together; none of nothing.
    pub fn pooled<'a>(scores: impl IntoIterator<Item = &'a Self>) -> Option<Self> {
        let sums = |s: &Self| {
            let n = s.samples as f64;
            let spread = if s.nrmse > 0.0 { n * (s.rmse / s.nrmse).powi(2) } else { 0.0 };
            ErrorSums { squares: n * s.rmse.powi(2), spread, largest: s.max_error, samples: s.samples }
        };
        scores.into_iter().map(sums).fold(ErrorSums::default(), ErrorSums::plus).score()
    }

    /// The same of a sensor whose series were divided by `scale`.
    #[must_use]
    pub fn scaled(self, scale: f64) -> Self {
        Self { rmse: scale * self.rmse, max_error: scale * self.max_error, ..self }
    }
}

/// Sums that scores are made of; sums of several records add up.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ErrorSums {
    squares: f64,
    spread: f64,
    largest: f64,
    samples: usize,
}

impl ErrorSums {
    /// Compares a measurement with a response that may be shorter, from a sample on, appending E(t) of all samples to
    /// `error`.
    pub(super) fn compare(measured: &[f64], response: &[f64], from: usize, error: &mut Vec<f64>) -> Self {
        let count = measured.len().min(response.len());
        let scored = measured.get(from..).unwrap_or_default();
        let mean = scored.iter().sum::<f64>() / scored.len().max(1) as f64;
        let mut tally = Self { samples: count.saturating_sub(from), ..Self::default() };
        for (k, (y, x)) in measured.iter().zip(response).enumerate() {
            let e = (y - x).abs();
            error.push(e);
            if k < from {
                continue;
            }
            tally.squares += e * e;
            tally.spread += (y - mean) * (y - mean);
            tally.largest = tally.largest.max(e);
        }
        tally
    }

    /// Both together.
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            squares: self.squares + other.squares,
            spread: self.spread + other.spread,
            largest: self.largest.max(other.largest),
            samples: self.samples + other.samples,
        }
    }

    /// The figures; none of nothing.
    pub(super) fn score(&self) -> Option<Score> {
        (self.samples > 0).then(|| {
            let n = self.samples as f64;
            let rmse = (self.squares / n).sqrt();
            let nrmse = rmse / (self.spread / n).sqrt();
            Score { rmse, nrmse, max_error: self.largest, best_fit: 100.0 * (1.0 - nrmse), samples: self.samples }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_follow_their_definitions() {
        let mut error = Vec::new();
        let tally = ErrorSums::compare(&[1.0, -1.0, 1.0, -1.0], &[1.0, -1.0, 0.0], 0, &mut error);
        assert_eq!(error, [0.0, 0.0, 1.0]);
        let score = tally.score().unwrap();
        assert!((score.rmse - (1.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!((score.best_fit - 100.0 * (1.0 - score.nrmse)).abs() < 1e-12);
        assert_eq!((score.max_error, score.samples), (1.0, 3));
        assert!(ErrorSums::default().score().is_none());
        let measured = [3.0, 1.0, 2.0, 8.0];
        let whole = Score::of_residual(&measured, &[0.5, -1.0, 0.25, 2.0]).unwrap();
        let pooled = Score::pooled([&whole, &whole]).unwrap();
        assert!((pooled.rmse - whole.rmse).abs() < 1e-12 && (pooled.nrmse - whole.nrmse).abs() < 1e-12);
        assert_eq!((pooled.samples, pooled.max_error, whole.scaled(3.0).max_error), (8, 2.0, 6.0));
        assert!(Score::pooled([]).is_none());
        let later = ErrorSums::compare(&[5.0, -1.0, 1.0, -1.0], &[9.0, -1.0, 0.0], 1, &mut error).score().unwrap();
        assert_eq!((later.max_error, later.samples, error[3]), (1.0, 2, 4.0), "the first sample is not scored");
    }
}
