//! From time stamps to an even grid: the interval, gaps, rounding, jitter.

use std::ops::Range;

use crate::signal::ranked;

/// Fewer samples than this are no record.
pub const LEAST_SAMPLES: usize = 20;

/// Jitter, as a share of the interval, up to which samples stay on the straight line through the stamps; beyond, each stamp
/// is taken at its word and values are interpolated.
const MAX_JITTER: f64 = 0.01;

/// Factor on the largest jitter: the grid is fitted to the jittered stamps, so jitter at the limit may seem this much
/// larger.
const JITTER_MARGIN: f64 = 1.05;

/// Jitter below this share of the interval is arithmetic, not measurement: nothing is resampled.
const NO_JITTER: f64 = 1e-6;

/// A step longer than this many usual ones is a gap.
const GAP: f64 = 1.5;

/// Longest step, in usual ones, that is interpolated over in a record that jitters: a sample or two was lost.
const BRIDGED: f64 = 3.5;

/// The interval of an uneven record is rounded to a plain number within this share of it: any grid will do.
const PLAIN: f64 = 1e-3;

/// Share of the steps that may be gaps; with more, the sampling has no usual step.
const MAX_GAP_SHARE: f64 = 0.1;

/// Rounding of the stamps, as a share of the interval, beyond which they say too little about the sampling.
const MAX_ROUNDING: f64 = 0.25;

/// A stretch of stamps without a gap, on its even grid; times in the stamps' unit.
#[derive(Clone, Debug, PartialEq)]
pub struct EvenStretch {
    /// The rows that it covers.
    pub rows: Range<usize>,
    /// Time of the grid's first point.
    pub start: f64,
    /// Grid points, if the values must be resampled onto them; otherwise the rows are the grid's points.
    pub resample: Option<usize>,
}

/// What the stamps of one trajectory say.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampling {
    /// The sampling interval.
    pub interval: f64,
    /// The stretches between gaps, in order.
    pub stretches: Vec<EvenStretch>,
    /// The largest distance of a stamp from the even grid, as a share of the interval.
    pub jitter: f64,
    /// Steps longer than a gap that were interpolated over all the same.
    pub bridged: usize,
    /// The step to which the stamps are rounded, where that is the whole of a large distance from the grid.
    pub rounded_to: Option<f64>,
    /// The first stamp as given, if it did not fit the others and was replaced.
    pub odd_first: Option<f64>,
}

impl Sampling {
    /// Samples known to be even, from time zero.
    pub fn even(samples: usize, interval: f64) -> Self {
        let all = EvenStretch { rows: 0..samples, start: 0.0, resample: None };
        Self { interval, stretches: vec![all], jitter: 0.0, bridged: 0, rounded_to: None, odd_first: None }
    }
}

impl Sampling {
    /// Samples known to be even, some of which are missing: `places` are the numbers of those that are there.
    pub fn with_missing(places: &[f64]) -> Self {
        let mut stretches: Vec<EvenStretch> = Vec::new();
        for (row, place) in places.iter().enumerate() {
            match stretches.last_mut() {
                Some(last) if place - places[row - 1] == 1.0 => last.rows.end = row + 1,
                _ => stretches.push(EvenStretch { rows: row..row + 1, start: *place, resample: None }),
            }
        }
        Self { stretches, ..Self::even(places.len(), 1.0) }
    }

    /// Samples that are missing in a step from one sample to the next.
    pub fn missing(&self, step: f64) -> usize {
        ((step / self.interval).round() - 1.0).max(0.0) as usize
    }
}

/// Why stamps give no even grid; rows are those of the later stamp.
#[derive(Clone, Debug, PartialEq)]
pub enum Irregular {
    /// Two stamps are the same.
    Repeated {
        /// The later one's row.
        row: usize,
    },
    /// Time runs backwards.
    Falling {
        /// The row of the stamp that is earlier than the one before it.
        row: usize,
    },
    /// Steps differ by more than jitter and missing samples explain.
    Uneven {
        /// The later one's row.
        row: usize,
        /// The step to it, in the stamps' unit.
        step: f64,
        /// The usual step.
        usual: f64,
        /// How far the step is off the usual one, as a share of it.
        jitter: f64,
    },
}

impl Irregular {
    fn row(&self) -> usize {
        match self {
            Self::Repeated { row } | Self::Falling { row } | Self::Uneven { row, .. } => *row,
        }
    }
}

/// Finds the even grid behind stamps; a first stamp that alone does not fit is replaced in `stamps`.
pub fn analyse(stamps: &mut [f64]) -> Result<Sampling, Irregular> {
    let first = analyse_as_given(stamps);
    let Err(error) = &first else { return first };
    // Recorders write a stale first stamp now and then; two equal ones are a double row instead.
    if error.row() > 1 || matches!(error, Irregular::Repeated { .. }) || stamps.len() < LEAST_SAMPLES {
        return first;
    }
    let rest = analyse_as_given(&stamps[1..]);
    match rest {
        Ok(sampling) if sampling.stretches[0].rows.len() + 1 >= LEAST_SAMPLES => {
            let given = stamps[0];
            stamps[0] = stamps[1] - sampling.interval;
            Ok(Sampling { odd_first: Some(given), ..analyse_as_given(stamps)? })
        }
        _ => first,
    }
}

fn analyse_as_given(stamps: &[f64]) -> Result<Sampling, Irregular> {
    let steps: Vec<f64> = stamps.windows(2).map(|w| w[1] - w[0]).collect();
    if let Some(i) = steps.iter().position(|s| *s <= 0.0) {
        return Err(if steps[i] == 0.0 {
            Irregular::Repeated { row: i + 1 }
        } else {
            Irregular::Falling { row: i + 1 }
        });
    }
    if steps.is_empty() {
        return Ok(Sampling::even(stamps.len(), 1.0));
    }
    let usual = median(&steps);
    if !usual.is_normal() {
        return Err(Irregular::Uneven { row: 1, step: steps[0], usual, jitter: 1.0 });
    }
    let gaps: Vec<usize> = (0..steps.len()).filter(|&i| steps[i] > GAP * usual).collect();
    if gaps.len() as f64 > (MAX_GAP_SHARE * steps.len() as f64).max(1.0) {
        let worst = gaps.iter().copied().max_by(|a, b| steps[*a].total_cmp(&steps[*b])).unwrap_or(0);
        let jitter = steps[worst] / usual - 1.0;
        return Err(Irregular::Uneven { row: worst + 1, step: steps[worst], usual, jitter });
    }
    let mut rows: Vec<Range<usize>> = Vec::with_capacity(gaps.len() + 1);
    let mut begin = 0;
    for end in gaps.iter().map(|g| g + 1).chain([stamps.len()]) {
        rows.push(begin..end);
        begin = end;
    }

    let fit = EvenFit::through(stamps, &rows);
    let ulp = f64::EPSILON * stamps[0].abs().max(stamps[stamps.len() - 1].abs());
    let interval = exact(fit.interval, fit.doubt(0.5 * ulp), stamps, &rows);
    // Within this, a stamp's distance from the grid is the rounding of its own arithmetic.
    let jitter = ((fit.largest - 8.0 * ulp).max(0.0)) / interval;
    let even = |rounded_to| Sampling {
        interval,
        stretches: rows
            .iter()
            .map(|r| EvenStretch { rows: r.clone(), start: stamps[r.start], resample: None })
            .collect(),
        jitter,
        bridged: 0,
        rounded_to,
        odd_first: None,
    };
    if jitter <= NO_JITTER {
        return Ok(even(None));
    }
    let rounded = Rounding::new(stamps);
    if rounded.coarsest(stamps) <= MAX_ROUNDING * interval && fit.is_rounded(stamps, &rows, &rounded) {
        return Ok(even(Some(rounded.coarsest(stamps)).filter(|_| jitter > MAX_JITTER)));
    }
    // A clock that wanders slowly strays far from any line while each step is good: that too can be evened out.
    let off = |row: usize| (steps[row - 1] - usual).abs();
    // Of two steps that one displaced stamp makes equally bad, the first is the one to name.
    let worse = |worst: usize, row: usize| if off(row) > off(worst) * (1.0 + 1e-6) { row } else { worst };
    let worst = rows.iter().flat_map(|r| r.start + 1..r.end).reduce(worse).unwrap_or(1);
    let by_step = off(worst) / usual;
    if (fit.half_range / interval).min(by_step) > MAX_JITTER * JITTER_MARGIN {
        let even_without =
            rows.iter().flat_map(|r| r.start.max(1) + 1..r.end).all(|row| off(row) <= MAX_JITTER * usual);
        if worst == 1 && even_without {
            return Err(Irregular::Uneven { row: worst, step: steps[worst - 1], usual, jitter: by_step });
        }
        return Ok(evened(stamps, &steps, usual, (fit.half_range / interval).min(by_step)));
    }
    let jitter = jitter.min(by_step);
    let stretches = rows
        .into_iter()
        .map(|rows| {
            let (start, end) = (stamps[rows.start], stamps[rows.end - 1]);
            // The last grid point may lie as far beyond the last stamp as stamps lie off the grid.
            let points = ((end - start) / interval + 2.0 * MAX_JITTER).floor() as usize + 1;
            EvenStretch { start, resample: Some(points), rows }
        })
        .collect();
    Ok(Sampling { interval, stretches, jitter, bridged: 0, rounded_to: None, odd_first: None })
}

/// An even grid of about the usual step for stamps that each say their own time.
fn evened(stamps: &[f64], steps: &[f64], usual: f64, jitter: f64) -> Sampling {
    let single = || steps.iter().filter(|s| **s <= GAP * usual);
    let mean = single().sum::<f64>() / single().count() as f64;
    let ends = (0..steps.len()).filter(|&i| steps[i] > BRIDGED * usual).map(|i| i + 1).chain([stamps.len()]);
    let mut begin = 0;
    let rows: Vec<Range<usize>> = ends.map(|end| std::mem::replace(&mut begin, end)..end).collect();
    // The ends' own jitter is in the mean.
    let interval = exact(mean, (PLAIN + 2.0 * jitter / steps.len() as f64) * mean, stamps, &rows);
    let stretches = rows.into_iter().map(|rows| {
        let (start, end) = (stamps[rows.start], stamps[rows.end - 1]);
        let points = ((end - start) / interval + 2.0 * MAX_JITTER).floor() as usize + 1;
        EvenStretch { start, resample: Some(points), rows }
    });
    let bridged = steps.iter().filter(|s| (GAP * usual..=BRIDGED * usual).contains(*s)).count();
    Sampling { interval, stretches: stretches.collect(), jitter, bridged, rounded_to: None, odd_first: None }
}

/// The lower median: a step that occurs, and of two usual ones the shorter.
fn median(values: &[f64]) -> f64 {
    ranked(values.to_vec(), (values.len() - 1) / 2).unwrap_or(f64::NAN)
}

/// Least squares over all stamps: one interval, each stretch with its own start.
struct EvenFit {
    interval: f64,
    /// Each stretch's grid time of its first row.
    starts: Vec<f64>,
    /// Largest distance of a stamp from its grid.
    largest: f64,
    /// Largest distance of a stamp from its grid once each grid is moved to the middle of its stamps.
    half_range: f64,
    /// Sum of the squared distances.
    squares: f64,
    /// Σ (i − ī)² over the stretches.
    spread: f64,
    count: usize,
}

impl EvenFit {
    fn through(stamps: &[f64], rows: &[Range<usize>]) -> Self {
        let longest = rows.iter().max_by_key(|r| r.len()).cloned().unwrap_or(0..stamps.len());
        // Fitting what is left of a first guess keeps the sums small, so a million stamps lose no digit.
        let guess = (stamps[longest.end - 1] - stamps[longest.start]) / (longest.len().max(2) - 1) as f64;
        let mut line = Self {
            interval: guess,
            starts: Vec::new(),
            largest: 0.0,
            half_range: 0.0,
            squares: 0.0,
            spread: 0.0,
            count: stamps.len(),
        };
        let left = |row: &Range<usize>, i: usize| stamps[row.start + i] - stamps[row.start] - guess * i as f64;
        let middle = |row: &Range<usize>| 0.5 * (row.len() - 1) as f64;
        let mut slope = 0.0;
        for row in rows {
            let m = middle(row);
            for i in 0..row.len() {
                slope += (i as f64 - m) * left(row, i);
                line.spread += (i as f64 - m) * (i as f64 - m);
            }
        }
        slope = if line.spread > 0.0 { slope / line.spread } else { 0.0 };
        line.interval += slope;
        for row in rows {
            let m = middle(row);
            let mean = (0..row.len()).map(|i| left(row, i)).sum::<f64>() / row.len() as f64;
            line.starts.push(stamps[row.start] + mean - slope * m);
            let (mut least, mut most) = (0.0f64, 0.0f64);
            for i in 0..row.len() {
                let distance = left(row, i) - mean - slope * (i as f64 - m);
                (least, most) = (least.min(distance), most.max(distance));
                line.squares += distance * distance;
            }
            line.largest = line.largest.max(most.max(-least));
            line.half_range = line.half_range.max(0.5 * (most - least));
        }
        line
    }

    /// Three standard errors of the interval, if distances from the grid are independent; `rounding` is that of a stamp.
    fn doubt(&self, rounding: f64) -> f64 {
        let variance = (self.squares / self.count as f64).max(rounding * rounding);
        if self.spread > 0.0 { 3.0 * (variance / self.spread).sqrt() } else { 0.0 }
    }

    /// True if every stamp is no farther from the grid than rounding puts it.
    fn is_rounded(&self, stamps: &[f64], rows: &[Range<usize>], rounding: &Rounding) -> bool {
        // The grid is fitted to rounded stamps itself: at its ends its standard error is twice that of a mean.
        let doubt = 6.0 * (self.squares / self.count as f64 / self.count as f64).sqrt();
        rows.iter().zip(&self.starts).all(|(row, start)| {
            stamps[row.clone()].iter().enumerate().all(|(i, stamp)| {
                let distance = (stamp - start - self.interval * i as f64).abs();
                distance <= 0.51 * rounding.step_at(*stamp) + doubt + 4.0 * f64::EPSILON * stamp.abs()
            })
        })
    }
}

/// The interval without the noise of its last digits.
///
/// The shortest decimal interval or sampling rate within `doubt`; else one that reproduces every stamp to the bit.
fn exact(interval: f64, doubt: f64, stamps: &[f64], rows: &[Range<usize>]) -> f64 {
    let near = |candidate: f64| (candidate - interval).abs() <= doubt + 2.0 * f64::EPSILON * interval;
    for digits in 1..=12 {
        let decimal = significant(interval, digits);
        if near(decimal) {
            return decimal;
        }
        let by_rate = 1.0 / significant(1.0 / interval, digits);
        if near(by_rate) {
            return by_rate;
        }
    }
    let reproduces = |candidate: f64| {
        rows.iter().all(|row| {
            let start = stamps[row.start];
            stamps[row.clone()].iter().enumerate().all(|(i, stamp)| start + candidate * i as f64 == *stamp)
        })
    };
    [0i64, 1, -1, 2, -2, 3, -3]
        .iter()
        .map(|ulps| f64::from_bits(interval.to_bits().wrapping_add_signed(*ulps)))
        .find(|c| reproduces(*c))
        .unwrap_or(interval)
}

/// A number rounded to `digits` significant digits.
pub fn significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}

/// How stamps were rounded when they were written: to decimals, or to significant digits.
struct Rounding {
    decimals: Option<i32>,
    digits: Option<i32>,
}

impl Rounding {
    fn new(stamps: &[f64]) -> Self {
        let whole = |scaled: f64| (scaled - scaled.round()).abs() <= 4.0 * f64::EPSILON * scaled.abs();
        let mut decimals = -3;
        let mut digits = 1;
        for stamp in stamps {
            // A stamp that is whole at some decimals stays whole at more, so neither count ever has to fall.
            while decimals <= 12 && !whole(stamp * 10f64.powi(decimals)) {
                decimals += 1;
            }
            while digits <= 12 && *stamp != 0.0 && !whole(stamp * 10f64.powi(digits - 1 - decade(*stamp))) {
                digits += 1;
            }
        }
        Self { decimals: Some(decimals).filter(|d| *d <= 12), digits: Some(digits).filter(|d| *d <= 12) }
    }

    /// The step to which a stamp was rounded.
    fn step_at(&self, stamp: f64) -> f64 {
        let decimal = self.decimals.map_or(0.0, |d| 10f64.powi(-d));
        let significant = self.digits.filter(|_| stamp != 0.0).map_or(0.0, |d| 10f64.powi(decade(stamp) + 1 - d));
        decimal.max(significant)
    }

    fn coarsest(&self, stamps: &[f64]) -> f64 {
        let ends = [stamps.first(), stamps.last()];
        ends.into_iter().flatten().map(|s| self.step_at(*s)).fold(0.0, f64::max)
    }
}

/// The power of ten of a number's first digit.
fn decade(value: f64) -> i32 {
    value.abs().log10().floor() as i32
}

/// Stamps on either side that a value between them is interpolated from.
const INTERPOLATION_STAMPS: usize = 4;

/// Fewer stamps than these are not resampled.
pub const FEWEST_STAMPS: usize = 4;

/// Stamps closer than this share of the interval are merged: their difference is noise.
const MIN_STAMP_DISTANCE: f64 = 0.3;

/// Values at `points` even times from `start`, by the polynomial through the nearest stamps, as many on either side: of
/// degree seven, at the ends down to three. Of a motion sampled twelve times a period it misses some 1e-5.
///
/// `stamps` rise and are at least four.
pub fn resample(stamps: &[f64], columns: &mut [Vec<f64>], start: f64, interval: f64, points: usize) {
    let mut even: Vec<Vec<f64>> = columns.iter().map(|_| Vec::with_capacity(points)).collect();
    let mut right = 1;
    let mut nodes: Vec<usize> = Vec::with_capacity(2 * INTERPOLATION_STAMPS);
    let mut weights = Vec::with_capacity(2 * INTERPOLATION_STAMPS);
    for k in 0..points {
        let time = start + interval * k as f64;
        while right < stamps.len() - 1 && stamps[right] <= time {
            right += 1;
        }
        nearest(stamps, time, right, MIN_STAMP_DISTANCE * interval, &mut nodes);
        weights.clear();
        weights.extend(nodes.iter().map(|i| {
            let others = nodes.iter().filter(|j| *j != i);
            others.map(|j| (time - stamps[*j]) / (stamps[*i] - stamps[*j])).product::<f64>()
        }));
        for (column, out) in columns.iter().zip(&mut even) {
            out.push(weights.iter().zip(&nodes).map(|(w, i)| w * column[*i]).sum());
        }
    }
    for (column, out) in columns.iter_mut().zip(even) {
        *column = out;
    }
}

/// The stamps to interpolate a time from: `right` is the first after it, and no two are closer together than `apart`.
fn nearest(stamps: &[f64], time: f64, right: usize, apart: f64, nodes: &mut Vec<usize>) {
    // Near an end a side is short: more than so many beyond it on the other would only pass noise on.
    let most = INTERPOLATION_STAMPS.min(right + 1).min(stamps.len() - right + 1).max(2);
    nodes.clear();
    let (mut before, mut after) = ((0..right).rev(), right..stamps.len());
    let (mut left_count, mut right_count) = (0, 0);
    let mut add = |candidate: Option<usize>, count: &mut usize| {
        let Some(index) = candidate else { return false };
        if nodes.iter().all(|n| (stamps[*n] - stamps[index]).abs() >= apart) {
            nodes.push(index);
            *count += 1;
        }
        true
    };
    // The nearer of the two neighbours first: it is the one that stays if they are close.
    let near = (stamps[right] - time).abs() < (time - stamps[right - 1]).abs();
    if near {
        add(after.next(), &mut right_count);
    }
    while left_count < most && add(before.next(), &mut left_count) {}
    while right_count < most && add(after.next(), &mut right_count) {}
    // Whatever one side lacks at an end, the other gives, so that a cubic is left.
    while left_count + right_count < 4 && (add(before.next(), &mut left_count) || add(after.next(), &mut right_count)) {
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: usize, start: f64, interval: f64) -> Vec<f64> {
        (0..n).map(|i| start + interval * i as f64).collect()
    }

    /// Numbers in −1…1 that look random, the same on every run.
    fn noise(n: usize) -> impl Iterator<Item = f64> {
        (0..n).map(|i| ((i as f64 * 12.9898).sin() * 43758.5453).fract())
    }

    fn round_to(values: &[f64], decimals: usize) -> Vec<f64> {
        values.iter().map(|t| format!("{t:.decimals$}").parse().unwrap()).collect()
    }

    #[test]
    fn even_stamps_give_their_interval_to_the_bit() {
        for (start, interval) in
            [(0.0, 0.0005), (0.0, 0.0016384), (3.5, 0.01), (0.0, 1.0 / 3000.0), (1e3, 1.0 / 48000.0), (-2.0, 0.3)]
        {
            for n in [20, 1000, 100_000] {
                let sampling = analyse(&mut grid(n, start, interval)).unwrap();
                assert_eq!(sampling.interval, interval, "{start} {interval} {n}");
                assert_eq!(sampling.stretches, [EvenStretch { rows: 0..n, start, resample: None }]);
                assert_eq!(sampling.rounded_to, None);
            }
        }
    }

    #[test]
    fn an_odd_interval_comes_back_to_the_bit() {
        let interval = 0.123_456_789_012_345_68;
        assert_eq!(analyse(&mut grid(5000, 0.0, interval)).unwrap().interval, interval);
    }

    #[test]
    fn rounded_stamps_are_even_and_the_interval_is_that_of_all_of_them() {
        let truth = 0.0016384;
        for decimals in [4, 5, 6] {
            let mut stamps = round_to(&grid(8692, 0.0, truth), decimals);
            let sampling = analyse(&mut stamps).unwrap();
            // Rounding errors average out: far closer than one step in the last decimal.
            assert!((sampling.interval / truth - 1.0).abs() < 1e-7, "{decimals}: {}", sampling.interval);
            assert_eq!(sampling.stretches[0].resample, None);
            assert_eq!(sampling.rounded_to.is_some(), decimals == 4, "{decimals}");
        }
    }

    #[test]
    fn stamps_rounded_to_significant_digits_are_even() {
        let mut stamps: Vec<f64> = grid(20_000, 0.0, 1.0 / 512.0).iter().map(|t| significant(*t, 6)).collect();
        let sampling = analyse(&mut stamps).unwrap();
        assert_eq!(sampling.stretches[0].resample, None);
        assert!((sampling.interval * 512.0 - 1.0).abs() < 1e-7);
    }

    #[test]
    fn single_precision_stamps_are_even_or_evened_out() {
        let mut stamps: Vec<f64> = grid(20_000, 0.0, 0.001).iter().map(|t| f64::from(*t as f32)).collect();
        let sampling = analyse(&mut stamps).unwrap();
        assert_eq!(sampling.interval, 0.001);
    }

    #[test]
    fn jitter_is_resampled_and_its_size_told() {
        for size in [0.001, 0.0099, 0.03, 0.12, 0.3] {
            let mut stamps: Vec<f64> =
                grid(500, 0.0, 0.01).iter().zip(noise(500)).map(|(t, e)| t + size * 0.01 * e).collect();
            let sampling = analyse(&mut stamps).unwrap();
            assert!(sampling.jitter <= 1.1 * size && sampling.jitter > 0.5 * size, "{}", sampling.jitter);
            assert_eq!(sampling.stretches.len(), 1);
            let points = sampling.stretches[0].resample.unwrap();
            assert!((499..=500).contains(&points) && (sampling.interval - 0.01).abs() < 1e-5, "{size} {points}");
        }
    }

    #[test]
    fn a_band_limited_motion_at_uneven_stamps_comes_back_even() {
        // Twelve samples a period and a harmonic at six; allowed is what a sensor with a thousandth of noise would not show.
        let motion =
            |t: f64| (t * 2.0 * std::f64::consts::PI / 12.0).sin() + 0.1 * (t * std::f64::consts::PI / 3.0 + 0.7).cos();
        for (size, allowed) in [(0.02, 2e-4), (0.12, 2e-4), (0.25, 3e-4), (0.45, 1e-3)] {
            let mut stamps: Vec<f64> =
                grid(3000, 0.0, 1.0).iter().zip(noise(3000)).map(|(t, e)| t + size * e).collect();
            let mut columns = vec![stamps.iter().map(|t| motion(*t)).collect::<Vec<f64>>()];
            let sampling = analyse(&mut stamps).unwrap();
            let stretch = &sampling.stretches[0];
            resample(&stamps, &mut columns, stretch.start, sampling.interval, stretch.resample.unwrap());
            let miss = |(k, y): (usize, &f64)| (y - motion(stretch.start + sampling.interval * k as f64)).abs();
            let inner = columns[0].iter().enumerate().skip(5).take(columns[0].len() - 10).map(miss).fold(0.0, f64::max);
            let whole = columns[0].iter().enumerate().map(miss).fold(0.0, f64::max);
            assert!(inner < allowed && whole < 0.03, "{size}: {inner} {whole}");
        }
    }

    #[test]
    fn interpolation_does_not_raise_the_noise() {
        for size in [0.05, 0.25, 0.45] {
            let stamps: Vec<f64> = grid(5000, 0.0, 1.0).iter().zip(noise(5000)).map(|(t, e)| t + size * e).collect();
            let values: Vec<f64> = (0..5000).map(|i| ((i as f64 * 78.233).sin() * 12543.123).fract()).collect();
            let mut columns = vec![values.clone()];
            resample(&stamps, &mut columns, stamps[0], 1.0, 4990);
            let ratio = crate::signal::rms(&columns[0]) / crate::signal::rms(&values);
            assert!((0.7..1.2).contains(&ratio), "{size}: {ratio}");
        }
    }

    #[test]
    fn lost_samples_of_a_jittery_record_are_bridged_and_longer_gaps_split_it() {
        let mut stamps: Vec<f64> = grid(1000, 0.0, 1.0).iter().zip(noise(1000)).map(|(t, e)| t + 0.05 * e).collect();
        stamps.drain(700..710);
        stamps.drain(300..302);
        let sampling = analyse(&mut stamps).unwrap();
        assert_eq!((sampling.stretches.len(), sampling.bridged), (2, 1));
        assert_eq!(sampling.stretches[0].rows, 0..698);
    }

    #[test]
    fn a_wandering_clock_is_evened_out() {
        let mut time = 0.0;
        let mut stamps: Vec<f64> = noise(20_000)
            .map(|e| {
                time += 0.001 * (1.0 + 0.005 * e);
                time
            })
            .collect();
        let sampling = analyse(&mut stamps).unwrap();
        assert!(sampling.jitter <= 0.0051);
        assert!(sampling.stretches[0].resample.is_some());
    }

    #[test]
    fn gaps_split_and_both_sides_share_the_interval() {
        let mut stamps = grid(100, 0.0, 0.01);
        stamps.extend(grid(50, 1.5037, 0.01));
        let sampling = analyse(&mut stamps).unwrap();
        assert_eq!(sampling.interval, 0.01);
        let rows: Vec<_> = sampling.stretches.iter().map(|s| (s.rows.clone(), s.start)).collect();
        assert_eq!(rows, [(0..100, 0.0), (100..150, 1.5037)]);
    }

    #[test]
    fn a_stale_first_stamp_is_replaced() {
        for first in [0.999_999, -0.004, 0.0007] {
            let mut stamps = grid(100, 0.0, 0.001);
            stamps[0] = first;
            let sampling = analyse(&mut stamps).unwrap();
            if first == -0.004 {
                // A long first step is a gap like any other.
                assert_eq!(sampling.stretches.len(), 2);
            } else {
                assert_eq!((sampling.odd_first, sampling.interval), (Some(first), 0.001));
                assert!(stamps[0].abs() < 1e-15);
            }
        }
    }

    #[test]
    fn repeated_falling_and_variable_steps_are_told() {
        let mut stamps = grid(100, 0.0, 0.01);
        stamps[40] = stamps[39];
        assert_eq!(analyse(&mut stamps), Err(Irregular::Repeated { row: 40 }));
        stamps[40] = 0.1;
        assert_eq!(analyse(&mut stamps), Err(Irregular::Falling { row: 40 }));
        let mut stamps: Vec<f64> = (0..100).map(|i| (f64::from(i) * 0.1).powi(3)).collect();
        assert!(matches!(analyse(&mut stamps), Err(Irregular::Uneven { .. })));
    }

    #[test]
    fn few_stamps_do_no_harm() {
        for n in 0..4 {
            assert_eq!(analyse(&mut grid(n, 1.0, 0.5)).unwrap().stretches[0].rows, 0..n);
        }
    }

    #[test]
    fn cubic_interpolation_is_exact_for_cubics() {
        let stamps: Vec<f64> = grid(50, 0.0, 0.1).iter().zip(noise(50)).map(|(t, e)| t + 0.001 * e).collect();
        let cubic = |t: f64| 1.0 - 2.0 * t + 0.5 * t * t - 0.1 * t * t * t;
        let mut columns = vec![stamps.iter().map(|t| cubic(*t)).collect::<Vec<f64>>()];
        resample(&stamps, &mut columns, stamps[0], 0.1, 50);
        for (k, y) in columns[0].iter().enumerate() {
            let want = cubic(stamps[0] + 0.1 * k as f64);
            // Values reach 6; a few roundings of that.
            assert!((y - want).abs() < 1e-13, "{k}: {y} {want}");
        }
    }
}
