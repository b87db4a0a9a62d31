//! Inputs between their samples: splines of degree 7, their derivatives, and inputs that act later.

use std::ops::Range;

use super::Delays;
use sindyscope_values::term::LANES;

/// Sampled inputs made continuous: a spline of degree 7 through the samples (its derivatives are those of the same
/// curve), prepared once a record.
///
/// At nine samples a period the spline follows a sine to about 1e-7 of its amplitude, at four to about 1e-4. Beyond the
/// ends the samples are continued by a polynomial of degree five.
///
/// Source of the filter: M. Unser, A. Aldroubi, M. Eden, "B-spline signal processing", IEEE Trans. Signal Processing 41
/// (1993) 821–848.
#[derive(Clone, Debug)]
pub struct InputGrid {
    start: f64,
    interval: f64,
    samples: usize,
    channels: Vec<InputCurve>,
}

#[derive(Clone, Debug)]
struct InputCurve {
    value: Jets,
    /// A curve of its own for the first derivative, where the caller has one.
    rate: Option<Jets>,
}

/// Value and first three derivatives at every sample; derivative `r` times the interval to the power of `r`.
#[derive(Clone, Debug)]
struct Jets {
    orders: [Vec<f64>; 4],
}

/// Weights by which the jets at both ends of an interval give value, first and second derivative at one place inside: for a place
/// that many intervals are asked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// Place in the interval, 0 to 1.
    pub(super) place: f64,
    weights: [[f64; 8]; 3],
}

/// What a right side takes from outside, along one interval: polynomials of degree 7 in the place there, 0 to 1, for an interval that is
/// asked at many places.
#[derive(Clone, Debug, Default)]
pub(super) struct IntervalPolynomials {
    sample: Option<usize>,
    polynomials: Vec<Polynomial>,
}

/// Coefficients, from the constant on.
type Polynomial = [f64; 8];

/// Poles of the recursive filter that turns samples into coefficients of B-splines of degree 7.
const POLES: [f64; 3] = [-0.535_280_430_796_438_2, -0.122_554_615_192_326_69, -0.009_148_694_809_608_277];

/// Degree of the polynomial through the outermost samples that continues a series beyond its ends.
///
/// Measured in the first interval, for degrees 3, 5 and 7: a sine of nine samples a period is missed by 8e-3, 2e-3 and
/// 8e-4 of its amplitude, and noise gains 4, 8 and 21 in the first derivative (1.4 inside).
const END_DEGREE: usize = 5;

/// Samples of that continuation: the largest pole to this power is below 1e-13.
const MARGIN: usize = 48;

/// B-spline of degree 7 and its first three derivatives at the whole numbers −3 … 3.
const BASIS: [[f64; 7]; 4] = [
    [1.0 / 5040.0, 120.0 / 5040.0, 1191.0 / 5040.0, 2416.0 / 5040.0, 1191.0 / 5040.0, 120.0 / 5040.0, 1.0 / 5040.0],
    [-1.0 / 720.0, -56.0 / 720.0, -245.0 / 720.0, 0.0, 245.0 / 720.0, 56.0 / 720.0, 1.0 / 720.0],
    [1.0 / 120.0, 24.0 / 120.0, 15.0 / 120.0, -80.0 / 120.0, 15.0 / 120.0, 24.0 / 120.0, 1.0 / 120.0],
    [-1.0 / 24.0, -8.0 / 24.0, 19.0 / 24.0, 0.0, -19.0 / 24.0, 8.0 / 24.0, 1.0 / 24.0],
];

/// Samples through which another course goes, counted from the one before.
const NEIGHBOURS: [isize; 6] = [-2, -1, 0, 1, 2, 3];

/// Lagrange's weights of the six samples nearest to a place between the third and the fourth, 0 to 1.
fn through_six(place: f64) -> [f64; 6] {
    NEIGHBOURS.map(|j| {
        let others = NEIGHBOURS.iter().filter(|i| **i != j);
        others.map(|i| (place - *i as f64) / (j - i) as f64).product()
    })
}

/// Writes a series that is later by `by` samples (earlier if negative) to `out`: between samples by the polynomial through the
/// six nearest ones, beyond the ends by that of the outermost six.
pub(crate) fn later(series: &[f64], by: f64, out: &mut Vec<f64>) {
    out.clear();
    let count = series.len() as isize;
    if count < NEIGHBOURS.len() as isize {
        out.extend_from_slice(series);
        return;
    }
    let whole = (-by).floor();
    let between = through_six(-by - whole);
    let shift = whole as isize;
    out.extend((0..count).map(|k| {
        let place = k + shift;
        // Near an end the last six samples there.
        let middle = place.clamp(2, count - 4);
        let weights = if middle == place { between } else { through_six(k as f64 - by - middle as f64) };
        NEIGHBOURS.iter().zip(weights).map(|(j, w)| w * series[(middle + j) as usize]).sum::<f64>()
    }));
}

impl InputGrid {
    /// Prepares sampled inputs.
    ///
    /// `start` and `interval` are the time of the first sample and the sampling interval, s; `samples` the length of the
    /// record (a shorter input series shortens it). With `rates` (one series an input) the first derivatives are taken
    /// from there and the second from the spline through them; without, both belong to the spline through the inputs.
    pub fn new(start: f64, interval: f64, samples: usize, inputs: &[&[f64]], rates: Option<&[&[f64]]>) -> Self {
        let series = inputs.iter().chain(rates.unwrap_or_default());
        let samples = series.map(|s| s.len()).fold(samples, usize::min);
        let channels = inputs
            .iter()
            .enumerate()
            .map(|(k, input)| InputCurve {
                value: Jets::new(&input[..samples]),
                rate: rates.and_then(|r| r.get(k)).map(|r| Jets::new(&r[..samples])),
            })
            .collect();
        Self { start, interval, samples, channels }
    }

    /// Every input, or its derivative of an order, at the samples: `[input][sample]`.
    pub fn sampled(&self, order: usize) -> Vec<Vec<f64>> {
        let values = |input: usize| (0..self.samples).map(|k| self.at(input, self.time(k))[order]).collect();
        (0..self.channels.len()).map(values).collect()
    }

    /// These inputs later by their delays; beyond the ends they keep their end values.
    #[must_use]
    pub fn delayed(&self, delays: &Delays) -> Self {
        let shifted = |input: usize, order: usize| -> Vec<f64> {
            let at = |k: usize| {
                let (sample, place) = self.place(self.time(k) - delays.delay(input));
                value_at(&self.polynomial(input, order, sample), place)
            };
            (0..self.samples).map(at).collect()
        };
        let channels = self
            .channels
            .iter()
            .enumerate()
            .map(|(k, channel)| match delays.delay(k) {
                0.0 => channel.clone(),
                _ => InputCurve {
                    value: Jets::new(&shifted(k, 0)),
                    rate: channel.rate.as_ref().map(|_| Jets::new(&shifted(k, 1))),
                },
            })
            .collect();
        Self { channels, ..*self }
    }

    /// These inputs from another time on, s.
    pub fn starting(&self, start: f64) -> Self {
        Self { start, ..self.clone() }
    }

    /// These inputs between their samples by another interpolation, the polynomial through the six samples nearest to each
    /// interval, on a grid that is `finer` times as fine. None if an input's derivative came with it.
    pub fn other_course(&self, finer: usize) -> Option<Self> {
        let samples = self.samples.checked_sub(1)? * finer + 1;
        let weights: Vec<[f64; 6]> = (0..finer).map(|k| through_six(k as f64 / finer as f64)).collect();
        let course = |channel: &InputCurve| -> Option<Vec<f64>> {
            let [values, ..] = &channel.value.orders;
            let at = |k: isize| values[k.clamp(0, self.samples as isize - 1) as usize];
            let between = |k: usize| {
                let before = (k / finer) as isize;
                NEIGHBOURS.iter().zip(&weights[k % finer]).map(|(j, w)| w * at(before + j)).sum()
            };
            channel.rate.is_none().then(|| (0..samples).map(between).collect())
        };
        let courses: Vec<Vec<f64>> = self.channels.iter().map(course).collect::<Option<_>>()?;
        let courses: Vec<&[f64]> = courses.iter().map(Vec::as_slice).collect();
        Some(Self::new(self.start, self.interval / finer as f64, samples, &courses, None))
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.samples
    }

    /// True if there is no sample.
    pub fn is_empty(&self) -> bool {
        self.samples == 0
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.channels.len()
    }

    /// Sampling interval, s.
    pub fn interval(&self) -> f64 {
        self.interval
    }

    /// Time of sample `index`, s.
    pub fn time(&self, index: usize) -> f64 {
        self.start + self.interval * index as f64
    }

    /// An input's value, first and second derivative at a time, s; times outside the record are moved to its ends.
    pub fn at(&self, input: usize, time: f64) -> [f64; 3] {
        let (sample, place) = self.place(time);
        [0, 1, 2].map(|order| value_at(&self.polynomial(input, order, sample), place))
    }

    /// The interval that a time lies in and the place there, 0 to 1; times outside the record are moved to its ends.
    fn place(&self, time: f64) -> (usize, f64) {
        let last = self.samples.saturating_sub(1);
        let position = ((time - self.start) / self.interval).clamp(0.0, last as f64);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the record")]
        let sample = (position as usize).min(last);
        (sample, position - sample as f64)
    }

    /// The jets that derivative `order` (0 to 2) of an input is taken from, the derivative of theirs that it is, and its
    /// scale.
    fn source(&self, input: usize, order: usize) -> Option<(&Jets, usize, f64)> {
        let channel = self.channels.get(input)?;
        let (jets, derivative) = match (&channel.rate, order) {
            (Some(rate), 1..) => (rate, order - 1),
            _ => (&channel.value, order),
        };
        Some((jets, derivative, [1.0, self.interval.recip(), self.interval.powi(-2)][derivative.min(2)]))
    }

    /// Derivative `order` (0 to 2) of an input along the interval after `sample`.
    fn polynomial(&self, input: usize, order: usize, sample: usize) -> Polynomial {
        let Some((jets, derivative, scale)) = self.source(input, order) else { return [0.0; 8] };
        let [a0, a1, a2, a3] = jets.orders.each_ref().map(|series| series[sample]);
        // Beyond the last sample there is nothing: its interval is asked for at its beginning alone.
        let [b0, b1, b2, b3] = jets.orders.each_ref().map(|series| series.get(sample + 1).copied().unwrap_or(0.0));
        // What Taylor's polynomial of the left end misses at the right end, in value and derivatives: small, so that nothing is lost by rounding.
        let r0 = b0 - (a0 + a1 + a2 / 2.0 + a3 / 6.0);
        let r1 = b1 - (a1 + a2 + a3 / 2.0);
        let r2 = b2 - (a2 + a3);
        let r3 = b3 - a3;
        let mut polynomial = [
            a0,
            a1,
            a2 / 2.0,
            a3 / 6.0,
            35.0 * r0 - 15.0 * r1 + 2.5 * r2 - r3 / 6.0,
            -84.0 * r0 + 39.0 * r1 - 7.0 * r2 + r3 / 2.0,
            70.0 * r0 - 34.0 * r1 + 6.5 * r2 - r3 / 2.0,
            -20.0 * r0 + 10.0 * r1 - 2.0 * r2 + r3 / 6.0,
        ];
        for _ in 0..derivative {
            for power in 0..7 {
                polynomial[power] = (power + 1) as f64 * polynomial[power + 1];
            }
            polynomial[7] = 0.0;
        }
        polynomial.map(|c| c * scale)
    }

    /// Writes derivative `order` (0 to 2) of an input at one node of some intervals to every `stride`-th of `out`.
    fn series(&self, input: usize, order: usize, intervals: Range<usize>, node: &Node, out: &mut [f64], stride: usize) {
        let Range { start, end } = intervals;
        let out = out.iter_mut().step_by(stride).take(end - start);
        let Some((jets, derivative, scale)) = self.source(input, order) else {
            out.for_each(|o| *o = 0.0);
            return;
        };
        if node.place == 0.0 {
            for (o, v) in out.zip(&jets.orders[derivative][start..]) {
                *o = v * scale;
            }
            return;
        }
        let w = node.weights[derivative].map(|w| w * scale);
        let [p, q, r, s] = jets.orders.each_ref().map(|o| &o[start..self.samples.min(end + 1)]);
        let ends =
            p.array_windows::<2>().zip(q.array_windows::<2>()).zip(r.array_windows::<2>()).zip(s.array_windows());
        for (o, (((p, q), r), s)) in out.zip(ends) {
            let [s0, s1]: [f64; 2] = *s;
            *o = (w[0] * p[0] + w[1] * p[1])
                + (w[2] * q[0] + w[3] * q[1])
                + (w[4] * r[0] + w[5] * r[1])
                + (w[6] * s0 + w[7] * s1);
        }
    }

    /// Writes the time at one node of some intervals to every `stride`-th of `out`.
    fn times(&self, intervals: Range<usize>, node: &Node, out: &mut [f64], stride: usize) {
        for (o, interval) in out.iter_mut().step_by(stride).zip(intervals) {
            *o = self.start + self.interval * (interval as f64 + node.place);
        }
    }
}

impl Node {
    /// The node at a place in the interval, 0 to 1, for the value and its first two derivatives.
    pub(super) fn new(place: f64) -> Self {
        let (left, right) = (powers(place), powers(1.0 - place));
        let mut weights = [[0.0; 8]; 3];
        for (derivative, row) in weights.iter_mut().enumerate() {
            for (order, polynomial) in HERMITE[derivative].iter().enumerate() {
                let mirrored = if (order + derivative) % 2 == 0 { 1.0 } else { -1.0 };
                let (mut at_left, mut at_right) = (0.0, 0.0);
                for power in 0..8 {
                    at_left += polynomial[power] * left[power];
                    at_right += polynomial[power] * right[power];
                }
                row[2 * order] = at_left;
                row[2 * order + 1] = mirrored * at_right;
            }
        }
        Self { place, weights }
    }
}

/// The polynomials of degree 7 in `s` whose derivative `order` is 1 at 0 and whose other first four derivatives vanish at 0
/// and 1, and their first and second derivatives: one table a derivative, one row an order, one coefficient a power.
const HERMITE: [[[f64; 8]; 4]; 3] = {
    // s^j/j! (1−s)^4 Σ_{i ≤ 3−j} C(3+i,i) s^i, multiplied out.
    let polynomials = [
        [1.0, 0.0, 0.0, 0.0, -35.0, 84.0, -70.0, 20.0],
        [0.0, 1.0, 0.0, 0.0, -20.0, 45.0, -36.0, 10.0],
        [0.0, 0.0, 0.5, 0.0, -5.0, 10.0, -7.5, 2.0],
        [0.0, 0.0, 0.0, 1.0 / 6.0, -4.0 / 6.0, 1.0, -4.0 / 6.0, 1.0 / 6.0],
    ];
    let once = differentiated(polynomials);
    [polynomials, once, differentiated(once)]
};

const fn differentiated(polynomials: [[f64; 8]; 4]) -> [[f64; 8]; 4] {
    let mut out = [[0.0; 8]; 4];
    let mut k = 0;
    while k < 28 {
        let (order, power) = (k / 7, k % 7);
        out[order][power] = (power + 1) as f64 * polynomials[order][power + 1];
        k += 1;
    }
    out
}

/// The powers of a number, from 0 to 7.
fn powers(s: f64) -> [f64; 8] {
    let (s2, s3) = (s * s, s * s * s);
    let s4 = s2 * s2;
    [1.0, s, s2, s3, s4, s4 * s, s4 * s2, s4 * s3]
}

impl Jets {
    fn new(series: &[f64]) -> Self {
        let n = series.len();
        if n == 0 {
            return Self { orders: Default::default() };
        }
        let mut c = extended(series);
        let gain: f64 = POLES.iter().map(|z| (1.0 - z) * (1.0 - z.recip())).product();
        c.iter_mut().for_each(|c| *c *= gain);
        for z in POLES {
            let mut before = c[0] / (1.0 - z);
            for c in &mut c {
                before = *c + z * before;
                *c = before;
            }
            let last = c.len() - 1;
            let mut after = z / (z * z - 1.0) * (c[last] + z * c[last - 1]);
            c[last] = after;
            for c in c[..last].iter_mut().rev() {
                after = z * (after - *c);
                *c = after;
            }
        }
        let derivative = |order: usize| {
            let b = &BASIS[order];
            c[MARGIN - 3..MARGIN + n + 3].windows(7).map(|c| c.iter().zip(b).map(|(c, b)| c * b).sum()).collect()
        };
        // The samples themselves, so that an input which is zero is exactly zero.
        Self { orders: [series.to_vec(), derivative(1), derivative(2), derivative(3)] }
    }
}

/// A series with [`MARGIN`] more values on each side, on the polynomial through the outermost samples.
fn extended(series: &[f64]) -> Vec<f64> {
    let n = series.len();
    let degree = END_DEGREE.min(n - 1);
    let mut c = vec![0.0; n + 2 * MARGIN];
    c[MARGIN..MARGIN + n].copy_from_slice(series);
    // Backward differences of the last samples, advanced one sample at a time.
    let mut grow = |place: &dyn Fn(usize) -> usize| {
        let mut differences = [0.0; END_DEGREE + 1];
        for (k, d) in differences[..=degree].iter_mut().enumerate() {
            *d = c[place(degree - k)];
        }
        for order in 1..=degree {
            for k in (order..=degree).rev() {
                differences[k] = differences[k - 1] - differences[k];
            }
        }
        for k in 1..=MARGIN {
            for order in (0..degree).rev() {
                differences[order] += differences[order + 1];
            }
            c[place(degree + k)] = differences[0];
        }
    };
    grow(&|k| MARGIN + n - 1 - degree + k);
    grow(&|k| MARGIN + degree - k);
    c
}

/// Fills the lanes of `symbols` in `memory` with `nodes.len()` instants of each interval, and the instant that ends the last
/// one.
pub(super) fn fill_lanes(
    grid: &InputGrid,
    symbols: &[(usize, External)],
    memory: &mut [f64],
    intervals: Range<usize>,
    nodes: &[Node],
) {
    for (address, symbol) in symbols {
        for (k, node) in nodes.iter().enumerate() {
            let lanes = &mut memory[address * LANES..][k..LANES];
            let end = if k == 0 { intervals.end + 1 } else { intervals.end };
            fill(grid, *symbol, intervals.start..end, node, lanes, nodes.len());
        }
    }
}

impl IntervalPolynomials {
    /// Forgets the interval: other symbols or another grid follow.
    pub(super) fn clear(&mut self) {
        self.sample = None;
    }

    /// Fills one lane a place, from `lane` on, with instants of the interval after `sample`.
    pub(super) fn fill(
        &mut self,
        grid: &InputGrid,
        symbols: &[(usize, External)],
        memory: &mut [f64],
        lane: usize,
        sample: usize,
        places: &[f64],
    ) {
        if self.sample != Some(sample) {
            self.sample = Some(sample);
            self.polynomials.clear();
            self.polynomials.extend(symbols.iter().map(|(_, symbol)| match *symbol {
                External::Time => [grid.time(sample), grid.interval, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                External::Input(input, order) => grid.polynomial(input, order, sample),
            }));
        }
        for ((address, _), polynomial) in symbols.iter().zip(&self.polynomials) {
            let lanes = &mut memory[address * LANES..][lane..LANES];
            for (place, lane) in places.iter().zip(lanes) {
                *lane = value_at(polynomial, *place);
            }
        }
    }
}

/// The value of a polynomial, in pairs, so that one product need not wait for the other (G. Estrin 1960).
#[inline]
fn value_at(c: &Polynomial, s: f64) -> f64 {
    let s2 = s * s;
    let (low, high) = ((c[0] + c[1] * s) + (c[2] + c[3] * s) * s2, (c[4] + c[5] * s) + (c[6] + c[7] * s) * s2);
    low + high * (s2 * s2)
}

fn fill(grid: &InputGrid, symbol: External, intervals: Range<usize>, node: &Node, lanes: &mut [f64], stride: usize) {
    match symbol {
        External::Time => grid.times(intervals, node, lanes, stride),
        External::Input(input, order) => grid.series(input, order, intervals, node, lanes, stride),
    }
}

/// What a right side takes from outside the state: time, or a derivative (0 to 2) of an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum External {
    /// Time.
    Time,
    /// Input, order of its derivative.
    Input(usize, usize),
}
