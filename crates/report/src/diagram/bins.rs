/// Means over intervals of one quantity.
///
/// Neighbouring samples of a motion repeat each other: a stretch of samples that stays in an interval is one visit, and
/// the standard error comes from the scatter of visits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bins {
    /// Middle of each interval that was visited, ascending.
    pub at: Vec<f64>,
    /// Mean there.
    pub mean: Vec<f64>,
    /// Standard error of the mean; infinite if there was one visit.
    pub error: Vec<f64>,
    /// Visits.
    pub visits: Vec<usize>,
}

#[derive(Clone, Copy, Default)]
struct Tally {
    sum: f64,
    squares: f64,
    visits: usize,
}

impl Bins {
    /// Means of `value` in `count` equal intervals of `at` over ±`most`; the series are stretches of neighbouring samples.
    pub fn new<'a>(series: impl IntoIterator<Item = (&'a [f64], &'a [f64])>, most: f64, count: usize) -> Self {
        let mut tallies = vec![Tally::default(); count];
        let place = |x: f64| {
            let k = ((x / most + 1.0) * 0.5 * count as f64).floor();
            (k >= 0.0 && k <= count as f64).then(|| (k as usize).min(count - 1))
        };
        for (at, value) in series {
            let (mut here, mut sum, mut samples) = (None, 0.0, 0.0);
            let mut leave = |bin: Option<usize>, sum: f64, samples: f64| {
                if let Some(bin) = bin.filter(|_| samples > 0.0) {
                    let (mean, tally): (f64, &mut Tally) = (sum / samples, &mut tallies[bin]);
                    tally.sum += mean;
                    tally.squares += mean * mean;
                    tally.visits += 1;
                }
            };
            for (x, y) in at.iter().zip(value).filter(|(x, y)| x.is_finite() && y.is_finite()) {
                let bin = place(*x);
                if bin != here {
                    leave(here, sum, samples);
                    (here, sum, samples) = (bin, 0.0, 0.0);
                }
                sum += y;
                samples += 1.0;
            }
            leave(here, sum, samples);
        }
        let mut bins = Self::default();
        for (k, Tally { sum, squares, visits }) in tallies.into_iter().enumerate().filter(|(_, t)| t.visits > 0) {
            let n = visits as f64;
            let mean = sum / n;
            let variance = if visits > 1 { (squares / n - mean * mean).max(0.0) / (n - 1.0) } else { f64::INFINITY };
            bins.at.push(most * (2.0 * (k as f64 + 0.5) / count as f64 - 1.0));
            bins.mean.push(mean);
            bins.error.push(variance.sqrt());
            bins.visits.push(visits);
        }
        bins
    }
}

/// Means over rectangles of two quantities.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells {
    /// Largest magnitude along either axis: cells are equal parts of ± these.
    pub most: [f64; 2],
    /// Cells along either axis.
    pub count: [usize; 2],
    /// Mean of each cell, rows of the second quantity one after the other; NaN where the motion never was.
    pub mean: Vec<f64>,
}

impl Cells {
    /// Means of `value` over `count` × `count` cells of (`across`, `up`).
    pub fn new<'a>(
        series: impl IntoIterator<Item = (&'a [f64], &'a [f64], &'a [f64])>,
        most: [f64; 2],
        count: usize,
    ) -> Self {
        let (mut sums, mut numbers) = (vec![0.0; count * count], vec![0_u32; count * count]);
        let place = |x: f64, most: f64| {
            let k = ((x / most + 1.0) * 0.5 * count as f64).floor();
            (k >= 0.0 && k <= count as f64).then(|| (k as usize).min(count - 1))
        };
        for (across, up, value) in series {
            for ((x, y), z) in across.iter().zip(up).zip(value).filter(|(_, z)| z.is_finite()) {
                if let Some((column, row)) = place(*x, most[0]).zip(place(*y, most[1])) {
                    sums[row * count + column] += z;
                    numbers[row * count + column] += 1;
                }
            }
        }
        let mean = sums.iter().zip(&numbers).map(|(s, n)| if *n > 0 { s / f64::from(*n) } else { f64::NAN }).collect();
        Self { most, count: [count; 2], mean }
    }

    /// Lower and upper edge of a cell along axis 0 or 1.
    pub fn edges(&self, axis: usize, index: usize) -> (f64, f64) {
        let at = |k: usize| self.most[axis] * (2.0 * k as f64 / self.count[axis] as f64 - 1.0);
        (at(index), at(index + 1))
    }

    /// Each visited cell: column, row and mean.
    pub fn visited(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let columns = self.count[0].max(1);
        self.mean.iter().enumerate().filter(|(_, m)| m.is_finite()).map(move |(k, m)| (k % columns, k / columns, *m))
    }
}
