use sindyscope_core::signal::{Bins, VisitMean};

/// Means over intervals of one quantity.
///
/// Neighbouring samples of a motion repeat each other: a stretch of samples that stays in an interval is one visit, and
/// the standard error comes from the scatter of visits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BinnedMeans {
    /// Middle of each interval that was visited, ascending.
    pub at: Vec<f64>,
    /// Mean there.
    pub mean: Vec<f64>,
    /// Standard error of the mean; infinite if there was one visit.
    pub error: Vec<f64>,
    /// Visits.
    pub visits: Vec<usize>,
}

impl BinnedMeans {
    /// Means of `value` in `count` equal intervals of `at` over ±`most`; the series are stretches of neighbouring samples.
    pub fn new<'a>(series: impl IntoIterator<Item = (&'a [f64], &'a [f64])>, most: f64, count: usize) -> Self {
        let bins = Bins::new(-most, most, count);
        let place = |x: f64| if x.abs() <= most { bins.index(x) } else { None };
        let stretch = |(at, value): (&[f64], &[f64])| -> (Vec<Option<usize>>, Vec<f64>) {
            let pairs = at.iter().zip(value).filter(|(x, y)| x.is_finite() && y.is_finite());
            pairs.map(|(x, y)| (place(*x), *y)).unzip()
        };
        let stretches: Vec<(Vec<Option<usize>>, Vec<f64>)> = series.into_iter().map(stretch).collect();
        let found = VisitMean::along(count, stretches.iter().map(|(places, values)| (&places[..], &values[..])));
        let mut means = Self::default();
        for (middle, found) in bins.middles().zip(&found).filter(|(_, found)| found.visits() > 0) {
            means.at.push(middle);
            means.mean.push(found.mean());
            means.error.push(found.error());
            means.visits.push(found.visits());
        }
        means
    }
}

/// Means over rectangles of two quantities.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellMeans {
    /// Largest magnitude along either axis: cells are equal parts of ± these.
    pub most: [f64; 2],
    /// Cells along either axis.
    pub count: [usize; 2],
    /// Mean of each cell, rows of the second quantity one after the other; NaN where the motion never was.
    pub mean: Vec<f64>,
}

impl CellMeans {
    /// Means of `value` over `count` × `count` cells of (`across`, `up`).
    pub fn new<'a>(
        series: impl IntoIterator<Item = (&'a [f64], &'a [f64], &'a [f64])>,
        most: [f64; 2],
        count: usize,
    ) -> Self {
        let (mut sums, mut numbers) = (vec![0.0; count * count], vec![0_u32; count * count]);
        let bins = most.map(|most| Bins::new(-most, most, count));
        let place = |x: f64, axis: usize| if x.abs() <= most[axis] { bins[axis].index(x) } else { None };
        for (across, up, value) in series {
            for ((x, y), z) in across.iter().zip(up).zip(value).filter(|(_, z)| z.is_finite()) {
                if let Some((column, row)) = place(*x, 0).zip(place(*y, 1)) {
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
