//! What a residual still tells: its distribution, and what it goes with.

use sindyscope_fourier::{Complex, Forward, Inverse};

use super::element::equation_residual;
use sindyscope_core::signal::{Bins, mean_and_variance};
use sindyscope_core::study::{Outcome, RecordOutcome};
use sindyscope_values::format::number::superscript;
use sindyscope_values::term::{Kind, Layout, Symbol, sign};

/// Two-sided 95 % quantile of the normal distribution.
const NORMAL_95: f64 = 1.959_964;

/// Fewest samples of a residual.
const FEWEST: usize = 32;

/// Main periods that correlations reach over, where the record is long enough.
const PERIODS: f64 = 2.0;

/// Fewest and most lags.
const LAGS: std::ops::RangeInclusive<usize> = 20..=1000;

/// Which residual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ResidualSource {
    /// Measured minus simulated response.
    #[default]
    Response,
    /// Measured rate minus the equation's: of the acceleration, or of the state's derivative.
    Equation,
}

/// How often a value occurs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    /// Edges of the bins.
    pub edges: Vec<f64>,
    /// Probability density of each bin: their areas sum to one.
    pub density: Vec<f64>,
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// Skewness: 0 for a normal distribution.
    pub skewness: f64,
    /// Excess kurtosis: 0 for a normal distribution.
    pub kurtosis: f64,
}

impl Histogram {
    /// The density of a normal distribution of the same mean and deviation.
    pub fn normal(&self, value: f64) -> f64 {
        let z = (value - self.mean) / self.deviation;
        (-0.5 * z * z).exp() / (self.deviation * (2.0 * std::f64::consts::PI).sqrt())
    }
}

/// What a residual is correlated with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Partner {
    /// Itself.
    Itself,
    /// A measured or derived quantity.
    Symbol(Symbol),
    /// A power of the state.
    Power(Symbol, i32),
    /// The product of a state and its rate.
    Product(Symbol, Symbol),
    /// The sign of a rate.
    Sign(Symbol),
}

impl Partner {
    /// As a person writes it: `x²`, `sgn v`.
    pub fn name(self, layout: &Layout) -> String {
        let of = |s| layout.name(s);
        match self {
            Self::Itself => "itself".into(),
            Self::Symbol(s) => of(s),
            Self::Power(s, power) => format!("{}{}", of(s), superscript(power)),
            Self::Product(a, b) => format!("{}·{}", of(a), of(b)),
            Self::Sign(s) => format!("sgn {}", of(s)),
        }
    }
}

/// A correlation over lags.
#[derive(Clone, Debug, PartialEq)]
pub struct Correlation {
    /// With what.
    pub partner: Partner,
    /// Lags, samples: positive where the residual comes after.
    pub lags: std::ops::RangeInclusive<isize>,
    /// Correlation coefficient at each lag.
    pub value: Vec<f64>,
    /// Within ± this 95 of 100 lags lie if the two have nothing to do with each other.
    pub band: f64,
    /// Share of lags (other than zero of an autocorrelation) outside the band; 0.05 by chance.
    pub outside: f64,
}

/// The residual of one record.
#[derive(Clone, Debug, PartialEq)]
pub struct Residual {
    /// Samples.
    pub samples: usize,
    /// Sampling interval, s.
    pub interval: f64,
    /// Its distribution.
    pub histogram: Histogram,
    /// Correlation with itself.
    pub itself: Correlation,
    /// Correlations with inputs, states and their powers.
    pub with: Vec<Correlation>,
}

impl Residual {
    /// The residual of a displacement (or state) of a record; none if there is too little of it, or if it is exactly zero.
    pub fn new(outcome: &Outcome, record: &RecordOutcome, freedom: usize, source: ResidualSource) -> Option<Self> {
        let layout = outcome.model.layout;
        let (start, residual) = match source {
            ResidualSource::Response => {
                let shown = record.channels.get(freedom)?;
                let (measured, response) = (record.record.channel(shown.role)?, &shown.response);
                (0, measured.values.iter().zip(response).map(|(m, r)| m - r).collect::<Vec<f64>>())
            }
            ResidualSource::Equation => {
                let state = if layout.kind == Kind::SecondOrder { layout.freedoms + freedom } else { freedom };
                let (inside, residual) = equation_residual(outcome, record, state)?;
                (inside.start, residual)
            }
        };
        let signals = &record.signals;
        let span = start..start + residual.len();
        let part = |series: &'_ [Vec<f64>], index: usize| series.get(index)?.get(span.clone()).map(<[f64]>::to_vec);
        let x = Symbol::State(freedom);
        let mut partners: Vec<(Partner, Vec<f64>)> = Vec::new();
        for j in 0..layout.inputs {
            partners.extend(part(&signals.inputs, j).map(|u| (Partner::Symbol(Symbol::Input(j)), u)));
        }
        if let Some(values) = part(&signals.states, freedom) {
            let map = |f: &dyn Fn(f64) -> f64| values.iter().map(|x| f(*x)).collect::<Vec<f64>>();
            partners.push((Partner::Symbol(x), values.clone()));
            let second = layout.kind == Kind::SecondOrder;
            let rates = part(&signals.states, layout.freedoms + freedom).filter(|_| second);
            let v = Symbol::Rate(freedom);
            partners.extend(rates.iter().map(|r| (Partner::Symbol(v), r.clone())));
            partners.push((Partner::Power(x, 2), map(&|x| x * x)));
            partners.push((Partner::Power(x, 3), map(&|x| x * x * x)));
            if let Some(rates) = rates {
                let product = values.iter().zip(&rates).map(|(x, v)| x * v).collect();
                partners.push((Partner::Product(x, v), product));
                partners.push((Partner::Sign(v), rates.iter().map(|v| sign(*v)).collect()));
            }
        }
        let interval = record.record.interval;
        let period = signals.main_period.map(|p| p / interval);
        Self::of(&residual, interval, period, partners)
    }

    /// A residual's figures; `period` in samples decides how far correlations reach.
    pub fn of(
        residual: &[f64],
        interval: f64,
        period: Option<f64>,
        partners: Vec<(Partner, Vec<f64>)>,
    ) -> Option<Self> {
        let n = residual.len();
        let (_, variance) = mean_and_variance(residual);
        if n < FEWEST || variance <= 0.0 || !variance.is_finite() {
            return None;
        }
        let wanted = period.map_or(n / 20, |p| (PERIODS * p) as usize);
        let most = wanted.clamp(*LAGS.start(), *LAGS.end()).min(n / 4);
        let mut transform = Transform::new(n)?;
        let own = transform.lines(residual)?;
        let correlation = transform.correlation(&own, &own, most)?;
        // From lag zero on: the other side mirrors it.
        let itself = correlation[most..].to_vec();
        let band = NORMAL_95 / (n as f64).sqrt();
        let beyond = |values: &[f64], band: f64| {
            values.iter().filter(|v| v.abs() > band).count() as f64 / values.len().max(1) as f64
        };
        let outside = beyond(&itself[1..], band);
        let mut with = Vec::new();
        for (partner, values) in partners {
            let (_, variance) = mean_and_variance(&values);
            if values.len() != n || variance <= 0.0 || !variance.is_finite() {
                continue;
            }
            let lines = transform.lines(&values)?;
            let theirs = transform.correlation(&lines, &lines, most)?;
            let value = transform.correlation(&lines, &own, most)?;
            // Bartlett 1955: two series that have nothing to do with each other correlate by chance the more the longer
            // both remember.
            let together: f64 =
                itself[1..].iter().zip(&theirs[most + 1..]).map(|(a, b)| 2.0 * a * b).sum::<f64>() + 1.0;
            let band = band * together.max(1.0).sqrt();
            let outside = beyond(&value, band);
            let reach = isize::try_from(most).ok()?;
            with.push(Correlation { partner, lags: -reach..=reach, value, band, outside });
        }
        let reach = isize::try_from(most).ok()?;
        Some(Self {
            samples: n,
            interval,
            histogram: histogram(residual),
            itself: Correlation { partner: Partner::Itself, lags: 0..=reach, value: itself, band, outside },
            with,
        })
    }
}

fn histogram(values: &[f64]) -> Histogram {
    let n = values.len() as f64;
    let (mean, variance) = mean_and_variance(values);
    let deviation = variance.sqrt();
    let moment = |power: i32| values.iter().map(|v| ((v - mean) / deviation).powi(power)).sum::<f64>() / n;
    // Scott's rule, over what a normal distribution reaches or the values do, whichever is wider, to six deviations.
    let reach = values.iter().map(|v| (v - mean).abs()).fold(3.0 * deviation, f64::max).min(6.0 * deviation);
    let width = 3.49 * deviation / n.cbrt();
    let count = ((2.0 * reach / width).ceil() as usize).clamp(11, 81);
    let bins = Bins::new(mean - reach, mean + reach, count);
    let mut counts = vec![0_usize; count];
    for bin in values.iter().filter_map(|value| bins.index(*value)) {
        counts[bin] += 1;
    }
    let area = n * 2.0 * reach / count as f64;
    Histogram {
        edges: bins.edges().to_vec(),
        density: counts.iter().map(|c| *c as f64 / area).collect(),
        mean,
        deviation,
        skewness: moment(3),
        kurtosis: moment(4) - 3.0,
    }
}

/// Correlations of series of one length by the fast Fourier transform, padded so that ends do not meet.
struct Transform {
    samples: usize,
    length: usize,
    forward: Forward,
    inverse: Inverse,
}

type Lines = Vec<Complex<f64>>;

impl Transform {
    fn new(samples: usize) -> Option<Self> {
        let length = (2 * samples).checked_next_power_of_two()?;
        let (forward, inverse) = (sindyscope_fourier::forward(length), sindyscope_fourier::inverse(length));
        Some(Self { samples, length, forward, inverse })
    }

    /// The transform of a series without its mean, scaled to variance one.
    fn lines(&mut self, series: &[f64]) -> Option<Lines> {
        let (mean, variance) = mean_and_variance(series);
        let scale = 1.0 / (variance * self.samples as f64).sqrt();
        let mut padded = self.forward.make_input_vec();
        for (slot, value) in padded.iter_mut().zip(series) {
            *slot = scale * (value - mean);
        }
        let mut lines = self.forward.make_output_vec();
        self.forward.process(&mut padded, &mut lines).ok()?;
        Some(lines)
    }

    /// Correlation of `first` with what comes `lag` samples later in `second`, for lags of −`most` to `most`.
    fn correlation(&mut self, first: &Lines, second: &Lines, most: usize) -> Option<Vec<f64>> {
        let mut product: Lines = first.iter().zip(second).map(|(a, b)| a.conj() * b / self.length as f64).collect();
        // Rounding leaves traces where a real signal's lines are real.
        for end in [0, product.len() - 1] {
            product[end].im = 0.0;
        }
        let mut out = self.inverse.make_output_vec();
        self.inverse.process(&mut product, &mut out).ok()?;
        let negative = out[self.length - most..].iter();
        Some(negative.chain(&out[..=most]).copied().collect())
    }
}
