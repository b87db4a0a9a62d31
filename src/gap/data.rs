use std::f64::consts::PI;
use std::sync::Arc;

use super::GapError;
use super::structure::Composition;
use super::weak::Weak;
use crate::format::units::format_si;
use crate::record::{Channel, Record, RecordSet, Role, Usage};
use crate::refine::{MeasuredMotion, Output, Run};
use crate::signal::{Facts, Signals, Spectrum, mean_and_variance, motion_period, rms, standard_deviation};
use crate::simulate::InputGrid;
use crate::study::{base_excited, suggest};
use crate::term::{Kind, Layout, Term};

/// A record made ready: thinned where its band allows, its inputs made continuous.
#[derive(Clone, Debug)]
pub(super) struct Series {
    pub(super) name: Arc<str>,
    pub(super) usage: Usage,
    pub(super) start: f64,
    pub(super) interval: f64,
    /// What the sensor shows, and what it showed.
    pub(super) output: Output,
    pub(super) measured: Arc<[f64]>,
    pub(super) grid: Arc<InputGrid>,
    /// Inputs and their rates at the samples.
    pub(super) inputs: Vec<Vec<f64>>,
    pub(super) input_rates: Vec<Vec<f64>>,
    pub(super) limits: [f64; 2],
    /// Displacement, velocity and inputs at every sample, smoothed without a model: where a simulation may start from.
    pub(super) smoothed: Arc<MeasuredMotion>,
    /// Which of the fitted, or of the held-out, records it is.
    index: usize,
}

/// All records of a search.
#[derive(Clone, Debug)]
pub(super) struct Data {
    pub(super) layout: Layout,
    pub(super) base_excited: bool,
    /// Neither name nor unit of the input says whether it is a force or the motion of the base.
    pub(super) input_open: bool,
    /// Unit of displacement.
    pub(super) unit: String,
    pub(super) input_unit: String,
    /// What the sensor shows, and its unit.
    pub(super) output: Output,
    pub(super) shown_unit: String,
    /// Fitted records first, then held-out ones.
    pub(super) series: Vec<Series>,
    /// Number of fitted records.
    pub(super) fitted: usize,
    /// Standard deviation of the sensor's noise, without a model.
    pub(super) noise: f64,
    /// The displacement comes in steps that are coarser than its noise.
    pub(super) stepped: bool,
    /// Without any input the motion keeps itself going: something gives it energy.
    pub(super) self_sustained: bool,
    /// Displacement that the data are counted from, where they were measured about another point than zero; else 0.
    pub(super) datum: f64,
    /// Main frequency of the fitted motion, Hz.
    pub(super) frequency: f64,
    /// Period of the fitted motion by its accelerations, s: what segments of records are measured by.
    pub(super) period: f64,
    pub(super) notices: Vec<String>,
}

/// Fitted samples up to which nothing is thinned.
const AMPLE: usize = 8_000;
/// Samples a period of the fastest motion that thinning leaves.
const PER_PERIOD: f64 = 24.0;
/// Share of the displacement's energy that lies below its "fastest motion".
const BAND: f64 = 0.999;
/// Steps of the displacement, in deviations of its noise, that noise no longer blurs: uniform between two steps, an error has
/// a deviation of 0.29 of one.
const COARSE: f64 = 2.0;
/// Largest motion that a simulation may reach, in those measured.
const ROOM: f64 = 10.0;

impl Data {
    pub(super) fn new(records: &RecordSet) -> Result<Self, GapError> {
        let kind = Kind::SecondOrder;
        let layout = records.layout(kind).map_err(GapError::Records)?;
        if layout.freedoms != 1 {
            return Err(GapError::Freedoms(layout.freedoms));
        }
        if layout.inputs > 1 {
            return Err(GapError::Inputs(layout.inputs));
        }
        let fit: Vec<&Arc<Record>> = records.with(Usage::Fit).collect();
        let first = fit.first().ok_or(GapError::NothingToFit)?;
        if let Some(short) = fit.iter().chain(&records.with(Usage::HeldOut).collect::<Vec<_>>()).find(|r| r.len() < 100)
        {
            return Err(GapError::TooShort { record: short.name.clone(), samples: short.len() });
        }
        let samples: usize = fit.iter().map(|r| r.len()).sum();
        let mut notices = Vec::new();
        let stride = if samples > AMPLE { thinning(&fit).min(samples / (AMPLE / 2)) } else { 1 };
        let thinned: Vec<(Record, Usage)> = records
            .with(Usage::Fit)
            .map(|r| (r, Usage::Fit))
            .chain(records.with(Usage::HeldOut).map(|r| (r, Usage::HeldOut)))
            .map(|(r, usage)| (if stride > 1 { thin(r, stride) } else { Record::clone(r) }, usage))
            .collect();
        if stride > 1 {
            notices.push(format!(
                "Every {stride}th sample is used, behind a low-pass filter at {:.3} Hz: the motion is slower by far, and {samples} samples would say no more.",
                0.4 / (first.interval * stride as f64)
            ));
        }
        let mut set = RecordSet::default();
        for (record, usage) in &thinned {
            set.entries.push((Arc::new(record.clone()), *usage));
        }
        let smoothing = suggest(&set, kind).map_err(|e| GapError::Records(e.to_string()))?.smoothing;
        let sensor = first.sensor(0).map_or(Role::Displacement(0), |c| c.role);
        let output = shown(sensor);
        let facts: Vec<Facts> = thinned.iter().map(|(r, _)| Facts::new(r, &layout)).collect();
        let mut series: Vec<Series> = thinned
            .iter()
            .zip(&facts)
            .map(|((record, usage), facts)| {
                let signals = Signals::new(record, &layout, &smoothing, facts);
                Series::new((record, sensor), *usage, &layout, facts, signals)
            })
            .collect();
        let fitted = fit.len();
        let (mut squares, mut count) = (0.0, 0.0);
        for s in &series[..fitted] {
            let n = s.measured.len() as f64;
            squares += n * standard_deviation(&s.measured).unwrap_or(0.0).powi(2);
            count += n;
        }
        // A velocity or an acceleration makes more of what is fast than the displacement does.
        let moved = |s: &Series| -> Arc<[f64]> {
            if output == Output::Displacement(0) {
                Arc::clone(&s.measured)
            } else {
                s.smoothed.states[0].as_slice().into()
            }
        };
        let loudest = series[..fitted].iter().max_by(|a, b| rms(&moved(a)).total_cmp(&rms(&moved(b))));
        let frequency = loudest
            .and_then(|s| Spectrum::new(&moved(s), s.interval))
            .and_then(|s| s.peak())
            .map_or_else(|| 4.0 / first.duration(), |p| p.frequency);
        let noise = f64::sqrt(squares / count);
        let still = layout.inputs == 0 || series[..fitted].iter().all(|s| rms(&s.inputs[0]) == 0.0);
        let fitted_series: Vec<(f64, Arc<[f64]>)> =
            series[..fitted].iter().map(|s| (s.interval, Arc::clone(&s.measured))).collect();
        let motions: Vec<Arc<[f64]>> = series[..fitted].iter().map(moved).collect();
        let all: Vec<&[f64]> = motions.iter().map(|m| &**m).collect();
        let of_displacement = if output == Output::Displacement(0) { noise } else { 0.0 };
        let period = motion_period(&all, series[0].interval, of_displacement).unwrap_or_else(|| frequency.recip());
        let (fit_part, held_part) = series.split_at_mut(fitted);
        for part in [fit_part, held_part] {
            part.iter_mut().enumerate().for_each(|(k, s)| s.index = k);
        }
        let step = step(series[..fitted].iter().flat_map(|s| s.measured.iter().copied()).collect());
        let stepped = step.is_some_and(|step| step > COARSE * noise);
        let unit = |role: Role| first.channel(role).map_or_else(String::new, |c| c.unit.clone());
        let shown_unit = unit(sensor);
        if let Some(step) = step.filter(|_| stepped) {
            let step = format_si(step, &shown_unit, 3);
            let shown = sensor.noun();
            notices.push(format!(
                "The {shown} comes in steps of {step}, coarser than its noise. Such steps repeat with the motion as a missing force does: a gap must be far clearer than usual to count."
            ));
        }
        Ok(Self {
            layout,
            base_excited: base_excited(first, kind),
            input_open: first.channel(Role::Input(0)).is_some_and(says_nothing) && !base_excited(first, kind),
            unit: unit(Role::Displacement(0)),
            input_unit: unit(Role::Input(0)),
            output,
            shown_unit,
            series,
            fitted,
            noise,
            stepped,
            self_sustained: still && sustained(&fitted_series),
            datum: 0.0,
            frequency,
            period,
            notices,
        })
    }

    /// The point that the motion is about, where that lies so far from zero that a shifted origin, not a force, is the reason:
    /// further than the motion's own RMS. None where the base model has no spring. A constant force beside a linear spring is
    /// such a point.
    pub(super) fn equilibrium(&self, base: &Composition) -> Option<f64> {
        let spring = base.base.iter().position(|t| t.as_str() == "x")?;
        let constant = Term::parse("1").ok()?;
        // Velocity and acceleration are the same about any point.
        if self.output != Output::Displacement(0) {
            return None;
        }
        let others = base.base.iter().filter(|t| **t != constant).cloned();
        let free = Composition::new(self.layout, others.chain([constant.clone()]).collect());
        let spring = if base.base[..spring].contains(&constant) { spring - 1 } else { spring };
        let found = Weak::new(self).estimate(&free, &[])?;
        let point = -found.coefficients.last()? / found.coefficients[spring];
        let (mut mean, mut variance) = (0.0, 0.0);
        for s in self.fit() {
            let (m, v) = mean_and_variance(&s.measured);
            mean += m / self.fitted as f64;
            variance += v / self.fitted as f64;
        }
        // The regression's point where it is sound, else the middle of the motion.
        let point = if (point - mean).abs() < 2.0 * variance.sqrt() { point } else { mean };
        (point.abs() > variance.sqrt() && point.is_finite()).then_some(point)
    }

    /// Counts displacements from a point.
    pub(super) fn count_from(&mut self, point: f64) {
        self.datum = point;
        for s in &mut self.series {
            s.measured = s.measured.iter().map(|x| x - point).collect();
            let mut smoothed = MeasuredMotion::clone(&s.smoothed);
            smoothed.states[0].iter_mut().for_each(|x| *x -= point);
            s.limits[0] = ROOM * smoothed.states[0].iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            s.smoothed = Arc::new(smoothed);
        }
        let point = format_si(point, &self.unit, 4);
        self.notices
            .push(format!("The motion is about {point}, not about zero: displacements are counted from there."));
    }

    pub(super) fn fit(&self) -> &[Series] {
        &self.series[..self.fitted]
    }

    pub(super) fn held_out(&self) -> &[Series] {
        &self.series[self.fitted..]
    }
}

/// True if a channel's header tells only that it is an input.
fn says_nothing(input: &Channel) -> bool {
    input.unit.is_empty() && matches!(input.name.trim().to_lowercase().as_str(), "u" | "input" | "")
}

/// Share of its first third's RMS that a motion without input keeps to its last third, if something keeps it going.
const KEPT: f64 = 0.8;

/// True if some motion does not die away in the course of its record.
fn sustained(records: &[(f64, Arc<[f64]>)]) -> bool {
    records.iter().any(|(interval, values)| {
        let third = values.len() / 3;
        let spread = |part: &[f64]| mean_and_variance(part).1.sqrt();
        let lasts = spread(&values[values.len() - third..]) > KEPT * spread(&values[..third]);
        // Of a few periods the record's end says nothing.
        let periods = Spectrum::new(values, *interval)
            .and_then(|s| s.peak())
            .map_or(0.0, |p| p.frequency * interval * values.len() as f64);
        lasts && periods > PERIODS
    })
}

/// Periods that a motion must last for its decay to be judged.
const PERIODS: f64 = 5.0;

/// What a channel of the first degree of freedom shows.
fn shown(role: Role) -> Output {
    match role {
        Role::Velocity(i) => Output::Velocity(i),
        Role::Acceleration(i) => Output::Acceleration(i),
        Role::Displacement(i) | Role::Input(i) => Output::Displacement(i),
    }
}

impl Series {
    fn new((record, sensor): (&Record, Role), usage: Usage, layout: &Layout, facts: &Facts, signals: Signals) -> Self {
        let channel = |role: Role| record.channel(role).map_or_else(|| Arc::from([]), |c| Arc::clone(&c.values));
        let raw: Vec<Arc<[f64]>> = (0..layout.inputs).map(|j| channel(Role::Input(j))).collect();
        let quiet =
            (0..raw.len()).all(|j| facts.input_noise[j] <= 1e-3 * rms(&signals.input_rates[j]) * record.interval);
        let n = record.len();
        let grid = if quiet {
            let inputs: Vec<&[f64]> = raw.iter().map(|u| &**u).collect();
            InputGrid::new(record.start, record.interval, n, &inputs, None)
        } else {
            let inputs: Vec<&[f64]> = signals.inputs.iter().map(|u| &**u).collect();
            let rates: Vec<&[f64]> = signals.input_rates.iter().map(|u| &**u).collect();
            InputGrid::new(record.start, record.interval, n, &inputs, Some(&rates))
        };
        let sampled = |order: usize| -> Vec<Vec<f64>> {
            (0..layout.inputs).map(|j| (0..n).map(|k| grid.at(j, grid.time(k))[order]).collect()).collect()
        };
        let (inputs, input_rates) = (sampled(0), sampled(1));
        let largest = |s: &[f64]| s.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let mut states = signals.states.into_iter();
        let states: Vec<Vec<f64>> = (0..2).map(|_| states.next().unwrap_or_default()).collect();
        let limits = [ROOM * largest(&states[0]), ROOM * largest(&states[1])];
        let smoothed = Arc::new(MeasuredMotion { states, inputs: inputs.clone(), input_rates: input_rates.clone() });
        Self {
            name: record.name.as_str().into(),
            usage,
            start: record.start,
            interval: record.interval,
            measured: channel(sensor),
            output: shown(sensor),
            grid: Arc::new(grid),
            inputs,
            input_rates,
            limits,
            smoothed,
            index: 0,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.measured.len()
    }

    /// The whole record as one run.
    pub(super) fn run(&self) -> Run {
        self.stretch(0..self.len())
    }

    /// A stretch of the record with an initial state of its own.
    pub(super) fn stretch(&self, range: std::ops::Range<usize>) -> Run {
        Run {
            record: self.index,
            grid: Arc::clone(&self.grid),
            outputs: vec![self.output],
            measured: vec![Arc::clone(&self.measured)],
            weights: vec![1.0],
            motion: Arc::clone(&self.smoothed),
            limits: self.limits.to_vec(),
            range,
        }
    }
}

/// By how much the records can be thinned: so many samples at least are left in a period of their fastest motion.
fn thinning(records: &[&Arc<Record>]) -> usize {
    let fastest = records
        .iter()
        .filter_map(|r| {
            let x = &r.sensor(0)?.values;
            let spectrum = Spectrum::new(x, r.interval)?;
            let total: f64 = spectrum.amplitudes.iter().skip(1).map(|a| a * a).sum();
            let mut sum = 0.0;
            let line = spectrum.amplitudes.iter().enumerate().skip(1).find(|(_, a)| {
                sum += **a * **a;
                sum >= BAND * total
            })?;
            Some(spectrum.frequency(line.0) * r.interval)
        })
        .fold(0.0, f64::max);
    if fastest > 0.0 { ((PER_PERIOD * fastest).recip() as usize).max(1) } else { 1 }
}

/// Every `stride`-th sample of every channel behind a low-pass filter: a sinc of eight zero crossings a side under a
/// Blackman window, half its height at 0.4 of the new sampling rate, the ends continued by reflection about their value.
fn thin(record: &Record, stride: usize) -> Record {
    let half = 8 * stride;
    let cutoff = 0.8 / stride as f64;
    let mut kernel: Vec<f64> = (0..=2 * half)
        .map(|k| {
            let s = k as f64 - half as f64;
            let window = 0.42 + 0.5 * (PI * s / half as f64).cos() + 0.08 * (2.0 * PI * s / half as f64).cos();
            let sinc = if s == 0.0 { 1.0 } else { (PI * cutoff * s).sin() / (PI * cutoff * s) };
            window * sinc
        })
        .collect();
    let sum: f64 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= sum);
    let mut thinned = record.clone();
    let count = record.len().div_ceil(stride);
    for channel in &mut thinned.channels {
        let v = &channel.values;
        let last = v.len() - 1;
        let at = |k: isize| -> f64 {
            if k < 0 {
                2.0 * v[0] - v[k.unsigned_abs().min(last)]
            } else if k.unsigned_abs() > last {
                2.0 * v[last] - v[(2 * last).saturating_sub(k.unsigned_abs())]
            } else {
                v[k.unsigned_abs()]
            }
        };
        channel.values = (0..count)
            .map(|c| {
                let centre = c * stride;
                if centre >= half && centre + half <= last {
                    return crate::signal::dot(&kernel, &v[centre - half..=centre + half]);
                }
                kernel.iter().enumerate().map(|(k, w)| w * at((centre + k) as isize - half as isize)).sum()
            })
            .collect();
    }
    thinned.interval = record.interval * stride as f64;
    thinned
}

/// The step that values are whole multiples of, if there are few enough of them to tell.
pub(super) fn step(values: Vec<f64>) -> Option<f64> {
    let count = values.len();
    let mut levels = values;
    levels.sort_unstable_by(f64::total_cmp);
    let reach = levels.last()? - levels.first()?;
    levels.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * reach);
    if levels.len() < 2 || 2 * levels.len() > count {
        return None;
    }
    let step = levels.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    let whole = |v: &f64| {
        let steps = (v - levels[0]) / step;
        (steps - steps.round()).abs() < 1e-3 * steps.max(1.0)
    };
    levels.iter().all(whole).then_some(step)
}
