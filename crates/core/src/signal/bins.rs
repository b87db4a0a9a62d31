//! Bins of one width, and the means over a motion's visits to them.

/// Bins of one width between two numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Bins {
    edges: Vec<f64>,
}

impl Bins {
    /// `count` bins from `low` to `high`.
    pub fn new(low: f64, high: f64, count: usize) -> Self {
        Self { edges: (0..=count).map(|k| low + (high - low) * k as f64 / count as f64).collect() }
    }

    /// `count` bins over the range of some values.
    pub fn over<'a>(values: impl IntoIterator<Item = &'a f64>, count: usize) -> Self {
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = values.into_iter().fold(ends, |(low, high), v| (low.min(*v), high.max(*v)));
        Self::new(low, high, count)
    }

    /// Number of bins.
    pub fn count(&self) -> usize {
        self.edges.len() - 1
    }

    /// The edges, ascending: one more than bins.
    pub fn edges(&self) -> &[f64] {
        &self.edges
    }

    /// The middle of each bin.
    pub fn middles(&self) -> impl Iterator<Item = f64> {
        self.edges.windows(2).map(|e| 0.5 * (e[0] + e[1]))
    }

    /// The bin of a value; the outermost ones take what lies beyond them. None of a NaN, or if the bins have no width.
    pub fn index(&self, value: f64) -> Option<usize> {
        let count = self.count();
        let width = self.edges[count] - self.edges[0];
        let place = (value - self.edges[0]) / width * count as f64;
        (width > 0.0 && place.is_finite()).then(|| (place.max(0.0) as usize).min(count - 1))
    }
}

/// The mean over the visits of a motion to a bin.
///
/// Neighbouring samples of a motion repeat each other: a stretch of samples that stays in a bin is one visit with one mean,
/// and the standard error comes from the scatter of visits.
#[derive(Clone, Copy, Debug, Default)]
pub struct VisitMean {
    sum: f64,
    squares: f64,
    visits: usize,
}

impl VisitMean {
    /// For each of `bins` bins, along stretches of neighbouring samples: the bin of each sample (none where it is in no bin),
    /// and its value.
    pub fn along<'a>(bins: usize, stretches: impl Iterator<Item = (&'a [Option<usize>], &'a [f64])>) -> Vec<Self> {
        let mut means = vec![Self::default(); bins];
        for (places, values) in stretches {
            let mut samples = places.iter().zip(values);
            for visit in places.chunk_by(|a, b| a == b) {
                let sum: f64 = samples.by_ref().take(visit.len()).map(|(_, value)| value).sum();
                if let Some(bin) = visit[0] {
                    means[bin].add(sum / visit.len() as f64);
                }
            }
        }
        means
    }

    fn add(&mut self, mean: f64) {
        self.sum += mean;
        self.squares += mean * mean;
        self.visits += 1;
    }

    /// Number of visits.
    pub fn visits(&self) -> usize {
        self.visits
    }

    /// The mean; NaN without a visit.
    pub fn mean(&self) -> f64 {
        self.sum / self.visits as f64
    }

    /// Standard error of the mean; infinite for fewer than two visits.
    pub fn error(&self) -> f64 {
        let n = self.visits as f64;
        if self.visits < 2 {
            return f64::INFINITY;
        }
        let variance = (self.squares - self.sum * self.sum / n) / (n - 1.0);
        (variance.max(0.0) / n).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_fall_into_bins_and_those_beyond_into_the_outermost() {
        let bins = Bins::over(&[-1.0, 0.2, 3.0], 4);
        assert_eq!(bins.edges(), [-1.0, 0.0, 1.0, 2.0, 3.0]);
        assert_eq!(bins.middles().collect::<Vec<_>>(), [-0.5, 0.5, 1.5, 2.5]);
        let places = [-9.0, -1.0, 0.5, 3.0, 7.0].map(|v| bins.index(v));
        assert_eq!(places, [Some(0), Some(0), Some(1), Some(3), Some(3)]);
        assert_eq!(bins.index(f64::NAN), None);
        assert_eq!(Bins::new(1.0, 1.0, 3).index(1.0), None);
        assert_eq!(Bins::over(&[], 3).index(0.0), None);
    }

    #[test]
    fn a_stay_in_a_bin_is_one_visit() {
        let places = [Some(0), Some(0), Some(1), None, Some(0), Some(1), Some(1)];
        let values = [1.0, 3.0, 10.0, 99.0, 4.0, 6.0, 8.0];
        let [first, second, third] = VisitMean::along(3, [(&places[..], &values[..])].into_iter())[..] else {
            panic!("three bins")
        };
        assert_eq!((first.visits(), first.mean()), (2, 3.0));
        assert_eq!((second.visits(), second.mean()), (2, 8.5));
        // Means 2 and 4: a standard deviation of √2, over √2.
        assert!((first.error() - 1.0).abs() < 1e-12);
        assert!(third.mean().is_nan() && third.error().is_infinite());
    }
}
