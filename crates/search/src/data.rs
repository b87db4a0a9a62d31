use std::f64::consts::{PI, TAU};
use std::sync::{Arc, OnceLock};

use super::GapError;
use super::clocks::unmeasured_tone;
use super::constants::Constants;
use super::effort::Counters;
use super::propose::{MeasuredPath, PresentModel};
use super::search::Ask;
use super::site::Placed;
use super::structure::Composition;
use sindyscope_core::dataset::{Dataset, Prepared, RANGE_FACTOR, output};
use sindyscope_core::refine::{MeasuredMotion, Output, Run};
use sindyscope_core::signal::{
    SignalFacts, Spectrum, dot, main_period, mean_and_variance, motion_period, quantisation_step, rests, rms,
    standard_deviation, standard_deviation_beside_jumps, turning_period,
};
use sindyscope_core::simulate::InputGrid;
use sindyscope_core::study::{Cancel, base_excited, suggest};
use sindyscope_values::format::units::format_si;
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};
use sindyscope_values::term::{Kind, Layout, Term};

/// What holding a motion about a point is: the point lies no further from the motion's middle, in its standard deviations.
const HELD_ABOUT: f64 = 3.0;

/// Share of the square of the motion's frequency below which a spring has no part in it.
const SLOW: f64 = 0.02;

/// A record made ready: thinned where its band allows, its inputs made continuous.
#[derive(Clone, Debug)]
pub(super) struct RecordSeries {
    pub(super) name: Arc<str>,
    pub(super) usage: Usage,
    pub(super) start: f64,
    /// Its first sample's time by the clock of forces that depend on time, s.
    pub(super) clock: f64,
    pub(super) interval: f64,
    /// What each mass's sensor shows, what it showed, and what its residuals count beside the first's.
    pub(super) outputs: Vec<Output>,
    pub(super) measured: Vec<Arc<[f64]>>,
    weights: Vec<f64>,
    /// Standard deviation of the noise of its weighted residuals, without a model.
    noise: f64,
    pub(super) grid: Arc<InputGrid>,
    /// Inputs and their rates at the samples.
    pub(super) inputs: Vec<Vec<f64>>,
    pub(super) input_rates: Vec<Vec<f64>>,
    /// Magnitude of each displacement, then of each velocity, that a simulation may reach.
    pub(super) limits: Vec<f64>,
    /// Displacements, velocities and inputs at every sample, smoothed without a model: where a simulation may start from.
    pub(super) smoothed: Arc<MeasuredMotion>,
    /// Which of the fitted, or of the held-out, records it is.
    pub(super) index: usize,
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
    /// Unit of each input.
    pub(super) input_units: Vec<String>,
    /// What the sensor of each mass shows, and the unit of the first.
    pub(super) outputs: Vec<Output>,
    pub(super) shown_unit: String,
    /// What the residuals of each sensor count: the first's noise over its own, so that all are told in the first's unit.
    pub(super) weights: Vec<f64>,
    /// Fitted records first, then held-out ones.
    pub(super) series: Vec<RecordSeries>,
    /// Number of fitted records.
    pub(super) fitted: usize,
    /// What the search decides and budgets by.
    pub(super) constants: Constants,
    /// Of Gaussian noise, the scale of Student's law over the standard deviation.
    pub(super) gaussian_scale: f64,
    /// What it costs.
    pub(super) counters: Arc<Counters>,
    /// Samples of a held-out record that its initial state is estimated from, and that its score leaves out.
    pub(super) initial: Option<usize>,
    /// Standard deviation of the first sensor's noise, without a model; of all weighted residuals that of their noise.
    pub(super) noise: f64,
    /// The displacement comes in steps that are coarser than its noise.
    pub(super) stepped: bool,
    /// Without any input the motion keeps itself going: something gives it energy.
    pub(super) self_sustained: bool,
    /// Every motion goes on as large as it has been for a while.
    pub(super) settles: bool,
    /// Displacement that the data are counted from, where they were measured about another point than zero; else 0.
    pub(super) datum: f64,
    /// Main frequency of the fitted motion, Hz.
    pub(super) frequency: f64,
    /// Period of the fitted motion by its accelerations, s: what segments of records are measured by.
    pub(super) period: f64,
    /// Frequency of a force that all records have and no input, Hz.
    pub(super) tone: Option<f64>,
    pub(super) notices: Vec<String>,
    /// The motion of each fitted record, once it was asked for.
    pub(super) paths: OnceLock<Arc<[MeasuredPath]>>,
}

/// What thinning is: samples a period of the fastest motion that thinning leaves.
const PER_PERIOD: f64 = 24.0;
/// Share of the displacement's energy that lies below its "fastest motion".
const BAND: f64 = 0.999;
/// What a coarse sensor is: steps of the displacement, in deviations of its noise, that noise no longer blurs: uniform between two steps, an error has
/// a deviation of 0.29 of one.
const COARSE: f64 = 2.0;
/// Samples that a record has at least: of fewer there is no held-out error worth its name.
pub(super) const FEWEST_SAMPLES: usize = 100;
/// Below this share of the motion a residual is the simulation's own arithmetic.
pub(super) const LEAST_NOISE: f64 = 1e-6;

impl Data {
    pub(super) fn new(records: &RecordSet, ask: &Ask, cancel: &Cancel) -> Result<Self, GapError> {
        let check = || if cancel.is_cancelled() { Err(GapError::Cancelled) } else { Ok(()) };
        let (initial, constants) = (ask.initial, &ask.constants);
        let kind = Kind::SecondOrder;
        let layout = records.layout(kind).map_err(GapError::Records)?;
        let fit = usable(records, initial)?;
        let first = fit.first().ok_or(GapError::NothingToFit)?;
        let mut notices = Vec::new();
        let moving = without_rest(records, initial.unwrap_or(0), &mut notices);
        let (set, stride) = thinned(&moving, constants.thinned_above, check)?;
        for (record, _) in &set.entries {
            check()?;
            SignalFacts::cached(record, &layout);
        }
        if stride > 1 {
            let samples: usize = fit.iter().map(|r| r.len()).sum();
            notices.push(format!(
                "One sample in {stride} is used, behind a low-pass filter at {:.3} Hz: the motion is slower by far, and {samples} samples would say no more.",
                0.4 / (first.interval * stride as f64)
            ));
        }
        let smoothing = suggest(&set, kind).map_err(|e| GapError::Records(e.to_string()))?.smoothing;
        let sensors: Vec<Role> =
            (0..layout.freedoms).map(|i| first.sensor(i).map_or(Role::Displacement(i), |c| c.role)).collect();
        for (record, role) in set.entries.iter().flat_map(|(r, _)| sensors.iter().map(move |role| (r, *role))) {
            if record.channel(role).is_none() {
                let (noun, name, other) = (role.noun(), &record.name, &first.name);
                return Err(GapError::Records(format!("record `{name}` has no {noun}, record `{other}` has")));
            }
        }
        let outputs: Vec<Output> = sensors.iter().copied().map(output).collect();
        let mut dataset = Dataset::default();
        dataset.update(&set, &layout, &smoothing, check)?;
        let prepared = dataset.records.iter().zip(&set.entries);
        let series = prepared.map(|(record, (_, usage))| {
            check()?;
            Ok(RecordSeries::new(record, &sensors, *usage))
        });
        let mut series: Vec<RecordSeries> = series.collect::<Result<_, GapError>>()?;
        let fitted = fit.len();
        let noises: Vec<f64> = (0..sensors.len()).map(|i| pooled_noise(&series[..fitted], i)).collect();
        let weights = weights(&series[..fitted], &noises);
        for s in &mut series {
            check()?;
            s.weights.clone_from(&weights);
            s.noise = s.residual_noise();
        }
        share_limits(&mut series);
        let of_displacement = |i: usize| if outputs[i] == Output::Displacement(i) { noises[i] } else { 0.0 };
        // A velocity or an acceleration makes more of what is fast than the displacement does.
        let moved = |s: &RecordSeries, i: usize| -> Arc<[f64]> {
            if outputs[i] == Output::Displacement(i) {
                Arc::clone(&s.measured[i])
            } else {
                s.smoothed.states[i].as_slice().into()
            }
        };
        check()?;
        let loudest = series[..fitted].iter().max_by(|a, b| rms(&moved(a, 0)).total_cmp(&rms(&moved(b, 0))));
        let unit = |role: Role| first.channel(role).map_or_else(String::new, |c| c.unit.clone());
        // Of an unknown unit a stroke that runs one way would be taken for an angle that turns over.
        let turning = |i: usize, motions: &[&[f64]], interval: f64| {
            let angle = unit(Role::Displacement(i)) == "rad";
            if angle { turning_period(motions, interval, of_displacement(i)) } else { None }
        };
        let main = |s: &RecordSeries| {
            let motion = moved(s, 0);
            turning(0, &[&motion], s.interval).or_else(|| main_period(&motion, s.interval, of_displacement(0)))
        };
        let frequency = loudest.and_then(main).map_or_else(|| 4.0 / first.duration(), f64::recip);
        let noise = noises.first().copied().unwrap_or(0.0);
        let still = series[..fitted].iter().all(RecordSeries::is_undriven);
        let fitted_series: Vec<(f64, Arc<[f64]>)> =
            series[..fitted].iter().map(|s| (s.interval, Arc::clone(&s.measured[0]))).collect();
        let period_of = |i: usize| {
            let motions: Vec<Arc<[f64]>> = series[..fitted].iter().map(|s| moved(s, i)).collect();
            let all: Vec<&[f64]> = motions.iter().map(|m| &**m).collect();
            let interval = series[0].interval;
            turning(i, &all, interval).or_else(|| motion_period(&all, interval, of_displacement(i)))
        };
        check()?;
        let period = (0..sensors.len()).filter_map(period_of).reduce(f64::min).unwrap_or_else(|| frequency.recip());
        let (fit_part, held_part) = series.split_at_mut(fitted);
        for part in [fit_part, held_part] {
            part.iter_mut().enumerate().for_each(|(k, s)| s.index = k);
        }
        let shown_unit = unit(sensors[0]);
        check()?;
        let tone = unmeasured_tone(&series, fitted, frequency);
        if let Some(tone) = tone.as_ref().filter(|tone| !tone.later.is_empty()) {
            notices.push(tone.notice(&series));
            series.iter_mut().zip(&tone.later).for_each(|(s, later)| s.begin_at(s.start + later));
        }
        check()?;
        let coarse = coarse_steps(&series[..fitted], &noises);
        if let Some((i, step)) = coarse {
            let step = format_si(step, &unit(sensors[i]), 3);
            let shown = sensors[i].noun();
            notices.push(format!(
                "The {shown} comes in steps of {step}, coarser than its noise. Such steps repeat with the motion as a missing force does: a gap must be far clearer than usual to count."
            ));
        }
        Ok(Self {
            layout,
            base_excited: base_excited(first, kind),
            input_open: first.channel(Role::Input(0)).is_some_and(says_nothing) && !base_excited(first, kind),
            unit: unit(Role::Displacement(0)),
            input_units: (0..layout.inputs).map(|j| unit(Role::Input(j))).collect(),
            outputs,
            shown_unit,
            weights,
            series,
            fitted,
            gaussian_scale: constants.gaussian_scale(),
            constants: constants.clone(),
            counters: Arc::default(),
            initial: initial.map(|n| n.div_ceil(stride)),
            noise,
            stepped: coarse.is_some(),
            self_sustained: still && sustained(&fitted_series),
            settles: fitted_series.iter().all(|(_, values)| settles(values, noise)),
            datum: 0.0,
            frequency,
            period,
            tone: tone.filter(|tone| !tone.pulsates).map(|tone| tone.frequency),
            notices,
            paths: OnceLock::new(),
        })
    }

    /// The point that the motion is about, where that lies so far from zero that a shifted origin, not a force, is the reason:
    /// further than the motion's own RMS. None where the base model has no spring. A constant force beside a linear spring is
    /// such a point.
    pub(super) fn equilibrium(&self, base: &Composition, cancel: &Cancel) -> Option<f64> {
        let constant = Placed { mass: 0, term: Term::parse("1").ok()? };
        // Velocity and acceleration are the same about any point; of several masses each would have its own.
        if self.outputs != [Output::Displacement(0)] {
            return None;
        }
        let others = base.base.iter().filter(|t| **t != constant).cloned();
        let free = Composition::new(self.layout, others.chain([constant.clone()]).collect());
        let spring = free.spring()?;
        let found = PresentModel::new(self, &free, &free.middle(), cancel).exactly(&[])?;
        let coefficients = free.named(&found.shared).coefficients;
        let point = -coefficients.last()? / coefficients[spring];
        let (mut mean, mut variance) = (0.0, 0.0);
        for s in self.fit() {
            let (m, v) = mean_and_variance(&s.measured[0]);
            mean += m / self.fitted as f64;
            variance += v / self.fitted as f64;
        }
        // The regression's point where it is sound, else the middle of the motion.
        let point = if (point - mean).abs() < 2.0 * variance.sqrt() { point } else { mean };
        // A motion that does not come back to it is about no point.
        let above = |s: &RecordSeries| s.measured[0].iter().map(|x| *x > point).collect::<Vec<bool>>();
        let passes: usize = self.fit().iter().map(|s| above(s).windows(2).filter(|w| w[0] != w[1]).count()).sum();
        if passes < 2 * self.fitted {
            return None;
        }
        (point.abs() > variance.sqrt() && point.is_finite()).then_some(point)
    }

    /// True if a spring at a point, counted from where displacements are, may hold the motion.
    pub(super) fn is_held_about(&self, point: f64) -> bool {
        let motion = self.fit().iter().map(|s| mean_and_variance(&s.measured[0]).1).fold(0.0, f64::max).sqrt();
        point.abs() < HELD_ABOUT * motion
    }

    /// True if some displacement goes through more than a turn, were it an angle.
    pub(super) fn turns_over(&self) -> bool {
        let span = |measured: &MeasuredPath| {
            let range = |(low, high): (f64, f64), x: &f64| (low.min(*x), high.max(*x));
            let (low, high) = measured.path.x[0].iter().fold((f64::INFINITY, f64::NEG_INFINITY), range);
            high - low
        };
        self.measured_paths().iter().any(|measured| span(measured) >= TAU)
    }

    /// True if a linear spring's coefficient has next to no part in the frequency of the motion.
    pub(super) fn is_slow(&self, coefficient: f64) -> bool {
        coefficient.abs() < SLOW * (TAU * self.frequency).powi(2)
    }

    /// Counts displacements from a point.
    pub(super) fn count_from(&mut self, point: f64) {
        self.datum = point;
        self.paths = OnceLock::new();
        for s in &mut self.series {
            s.measured[0] = s.measured[0].iter().map(|x| x - point).collect();
            let mut smoothed = MeasuredMotion::clone(&s.smoothed);
            smoothed.states[0].iter_mut().for_each(|x| *x -= point);
            s.limits[0] = RANGE_FACTOR * smoothed.states[0].iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            s.smoothed = Arc::new(smoothed);
        }
        share_limits(&mut self.series);
        let point = format_si(point, &self.unit, 4);
        self.notices
            .push(format!("The motion is about {point}, not about zero: displacements are counted from there."));
    }

    /// The motion of each fitted record, smoothed without a model.
    pub(super) fn measured_paths(&self) -> &[MeasuredPath] {
        self.paths.get_or_init(|| self.fit().iter().map(|s| MeasuredPath::new(self, s)).collect())
    }

    /// Number of masses.
    pub(super) fn masses(&self) -> usize {
        self.layout.freedoms
    }

    /// True if some sensor shows an acceleration, whose zero is free.
    pub(super) fn shows_rates(&self) -> bool {
        self.outputs.iter().any(|o| o.is_rate())
    }

    pub(super) fn fit(&self) -> &[RecordSeries] {
        &self.series[..self.fitted]
    }

    pub(super) fn held_out(&self) -> &[RecordSeries] {
        &self.series[self.fitted..]
    }

    /// Standard deviation of the noise of a run's weighted residuals, without a model; that of all fitted records where its own is not
    /// known.
    pub(super) fn noise_in(&self, run: &Run) -> f64 {
        let own = self.series.iter().find(|s| Arc::ptr_eq(&s.grid, &run.grid)).map_or(0.0, |s| s.noise);
        if own > 0.0 { own } else { self.noise }
    }

    /// Standard deviation of the noise of all that is never fitted, weighted; not less than that of the fitted records.
    pub(super) fn unseen_noise(&self) -> f64 {
        let samples = self.held_out().iter().map(RecordSeries::len).sum::<usize>().max(1) as f64;
        let squares = self.held_out().iter().map(|s| s.len() as f64 * s.noise.powi(2)).sum::<f64>();
        (squares / samples).sqrt().max(self.noise)
    }
}

/// The records that are fitted, if all that is asked for can be done with them.
fn usable(records: &RecordSet, initial: Option<usize>) -> Result<Vec<&Arc<Record>>, GapError> {
    let fit: Vec<&Arc<Record>> = records.with(Usage::Fit).collect();
    if fit.is_empty() {
        return Err(GapError::NothingToFit);
    }
    let held_out = || records.with(Usage::HeldOut);
    if let Some(short) = fit.iter().copied().chain(held_out()).find(|r| r.len() < FEWEST_SAMPLES) {
        return Err(GapError::TooShort { record: short.name.clone(), samples: short.len() });
    }
    if let Some((initial, record)) = initial.and_then(|n| Some((n, held_out().find(|r| r.len() <= n)?))) {
        return Err(GapError::NothingToScore { record: record.name.clone(), samples: record.len(), initial });
    }
    Ok(fit)
}

/// The records, fitted ones first, and one sample in how many of them is used: of more than `ample` samples fewer say as much
/// where the motion is slower by far.
fn thinned(
    records: &RecordSet,
    ample: usize,
    check: impl Fn() -> Result<(), GapError>,
) -> Result<(RecordSet, usize), GapError> {
    let fit: Vec<&Arc<Record>> = records.with(Usage::Fit).collect();
    let samples: usize = fit.iter().map(|r| r.len()).sum();
    let stride = if samples > ample { thinning(&fit, &check)?.min(samples / (ample / 2).max(1)) } else { 1 };
    let mut set = RecordSet::default();
    for usage in [Usage::Fit, Usage::HeldOut] {
        for record in records.with(usage) {
            check()?;
            let used = if stride > 1 { Arc::new(thin(record, stride)) } else { Arc::clone(record) };
            set.entries.push((used, usage));
        }
    }
    Ok((set, stride))
}

/// What it is to have come to rest: to stay so for this many periods, of which the first is kept.
const AT_REST: f64 = 3.0;

/// The records as long as something moves: where a free motion has come to rest all that follows says one thing, where it
/// stopped. As so many samples of their own those would count for more than all of the motion. What the initial state of a
/// held-out record is estimated from, `initial` samples, stays.
fn without_rest(records: &RecordSet, initial: usize, notices: &mut Vec<String>) -> RecordSet {
    let mut set = RecordSet::default();
    for (record, usage) in &records.entries {
        let asked = if *usage == Usage::HeldOut { initial } else { 0 };
        let kept = moving(record).map(|kept| kept.max(asked + FEWEST_SAMPLES)).filter(|kept| *kept < record.len());
        let shorter = kept.map_or_else(|| Arc::clone(record), |kept| Arc::new(record.slice(0..kept)));
        if shorter.len() < record.len() {
            let end = format_si(shorter.time(shorter.len()), "s", 3);
            notices.push(format!("`{}` has come to rest: what follows after {end} is left out.", record.name));
        }
        set.entries.push((shorter, *usage));
    }
    set
}

/// Samples until a free motion has come to rest, and a period of that; none where it does not.
fn moving(record: &Record) -> Option<usize> {
    let n = record.len();
    let mut inputs = record.channels.iter().filter(|c| matches!(c.role, Role::Input(_)));
    if inputs.any(|c| mean_and_variance(&c.values).1 > 0.0) {
        return None;
    }
    let (mut last, mut longest) = (0, 0.0);
    for sensor in record.sensors() {
        let Role::Displacement(_) = sensor.role else { return None };
        let noise = standard_deviation(&sensor.values)?;
        let period = main_period(&sensor.values, record.interval, noise)? / record.interval;
        let rest = rests(&sensor.values, noise, period).pop().filter(|rest| rest.end == n)?;
        (last, longest) = (last.max(rest.start), f64::max(longest, period));
    }
    (last as f64 + AT_REST * longest < n as f64).then_some(last + longest as usize)
}

/// The first sensor whose readings come in steps coarser than its noise, with the step.
fn coarse_steps(fitted: &[RecordSeries], noises: &[f64]) -> Option<(usize, f64)> {
    let of = |(i, noise): (usize, &f64)| {
        let shown: Vec<f64> = fitted.iter().flat_map(|s| s.measured[i].iter().copied()).collect();
        let step = quantisation_step(&shown, 2, 2)?;
        (step > COARSE * noise).then_some((i, step))
    };
    noises.iter().enumerate().find_map(of)
}

/// True if a channel's header tells only that it is an input.
fn says_nothing(input: &Channel) -> bool {
    input.unit.is_empty() && matches!(input.name.trim().to_lowercase().as_str(), "u" | "input" | "")
}

/// What a motion is that something keeps going: without input it keeps this share of its first third's RMS to its last third.
const KEPT: f64 = 0.8;

/// True if some motion does not die away in the course of its record.
fn sustained(records: &[(f64, Arc<[f64]>)]) -> bool {
    records.iter().any(|(interval, values)| {
        let third = values.len() / 3;
        let spread = |part: &[f64]| mean_and_variance(part).1.sqrt();
        let lasts = spread(&values[values.len() - third..]) > KEPT * spread(&values[..third]);
        // Of a few periods the record's end says nothing.
        let periods = Spectrum::of_motion(values, *interval)
            .and_then(|s| s.peak())
            .map_or(0.0, |p| p.frequency * interval * values.len() as f64);
        lasts && periods > PERIODS
    })
}

/// Periods that a motion must last for that to be told.
const PERIODS: f64 = 5.0;

/// What a motion is that has settled: it keeps this share of its middle third's RMS to its last third, well above the noise.
const SETTLED: f64 = 0.95;
const ABOVE_NOISE: f64 = 10.0;

fn settles(values: &[f64], noise: f64) -> bool {
    let third = values.len() / 3;
    let spread = |part: &[f64]| mean_and_variance(part).1.sqrt();
    let last = spread(&values[values.len() - third..]);
    last > SETTLED * spread(&values[third..2 * third]) && last > ABOVE_NOISE * noise
}

/// Noise of the sensor of a mass over several records.
fn pooled_noise(series: &[RecordSeries], mass: usize) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for s in series {
        let n = s.len() as f64;
        squares += n * s.noise_of_sensor(mass).powi(2);
        count += n;
    }
    f64::sqrt(squares / count)
}

/// The first sensor's noise over each one's; noise is never less than the arithmetic's own share of the motion.
fn weights(series: &[RecordSeries], noises: &[f64]) -> Vec<f64> {
    let floored = |(i, noise): (usize, &f64)| {
        let largest = series.iter().map(|s| rms(&s.measured[i])).fold(0.0, f64::max);
        noise.max(LEAST_NOISE * largest).max(f64::MIN_POSITIVE)
    };
    let floored: Vec<f64> = noises.iter().enumerate().map(floored).collect();
    floored.iter().map(|noise| floored[0] / noise).collect()
}

impl RecordSeries {
    fn new(prepared: &Prepared, sensors: &[Role], usage: Usage) -> Self {
        let Prepared { record, signals, .. } = prepared;
        let drive = prepared.drive();
        let channel = |role: Role| record.channel(role).map_or_else(|| Arc::from([]), |c| Arc::clone(&c.values));
        let (inputs, input_rates) = if prepared.is_quiet() {
            (drive.grid.sampled(0), drive.grid.sampled(1))
        } else {
            (signals.inputs.clone(), signals.input_rates().map(<[f64]>::to_vec).collect())
        };
        let states = signals.states.clone();
        let smoothed = Arc::new(MeasuredMotion { states, inputs: inputs.clone(), input_rates: input_rates.clone() });
        Self {
            name: record.name.as_str().into(),
            usage,
            start: record.start,
            clock: record.start,
            interval: record.interval,
            measured: sensors.iter().map(|role| channel(*role)).collect(),
            outputs: sensors.iter().copied().map(output).collect(),
            weights: vec![1.0; sensors.len()],
            noise: 0.0,
            grid: Arc::clone(&drive.grid),
            inputs,
            input_rates,
            limits: drive.limits.clone(),
            smoothed,
            index: 0,
        }
    }

    /// Sets the clock that forces which depend on time go by.
    fn begin_at(&mut self, clock: f64) {
        self.clock = clock;
        self.grid = Arc::new(self.grid.starting(clock));
    }

    /// True if no input drives it.
    pub(super) fn is_undriven(&self) -> bool {
        self.inputs.iter().all(|u| rms(u) == 0.0)
    }

    pub(super) fn len(&self) -> usize {
        self.measured.first().map_or(0, |m| m.len())
    }

    fn residual_noise(&self) -> f64 {
        let of = |(sensor, weight): (usize, &f64)| weight * self.noise_of_sensor(sensor);
        let noises: Vec<f64> = self.weights.iter().enumerate().map(of).collect();
        rms(&noises)
    }

    /// Standard deviation of a sensor's noise, without a model; a displacement has neither jumps nor corners.
    fn noise_of_sensor(&self, sensor: usize) -> f64 {
        let smooth = self.outputs[sensor].derivatives() == 0;
        let deviation = if smooth { standard_deviation } else { standard_deviation_beside_jumps };
        deviation(&self.measured[sensor]).unwrap_or(0.0)
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
            outputs: self.outputs.clone(),
            measured: self.measured.clone(),
            weights: self.weights.clone(),
            motion: Arc::clone(&self.smoothed),
            limits: self.limits.clone(),
            range,
        }
    }
}

/// Gives all records the range of the largest motion: what friction held still in one may move far in a model without it.
pub(super) fn share_limits(series: &mut [RecordSeries]) {
    let largest = |k: usize| series.iter().filter_map(|s| s.limits.get(k)).copied().fold(0.0, f64::max);
    let limits: Vec<f64> = (0..series.first().map_or(0, |s| s.limits.len())).map(largest).collect();
    series.iter_mut().for_each(|s| s.limits.clone_from(&limits));
}

/// By how much the records can be thinned: so many samples at least are left in a period of their fastest motion.
fn thinning(records: &[&Arc<Record>], check: impl Fn() -> Result<(), GapError>) -> Result<usize, GapError> {
    let of_sensor = |r: &Record, i: usize| {
        let x = &r.sensor(i)?.values;
        let spectrum = Spectrum::of_motion(x, r.interval)?;
        let total: f64 = spectrum.amplitudes.iter().skip(1).map(|a| a * a).sum();
        let mut sum = 0.0;
        let line = spectrum.amplitudes.iter().enumerate().skip(1).find(|(_, a)| {
            sum += **a * **a;
            sum >= BAND * total
        })?;
        Some(spectrum.frequency(line.0) * r.interval)
    };
    let mut fastest: f64 = 0.0;
    for record in records {
        for sensor in 0..record.layout(Kind::SecondOrder).freedoms {
            check()?;
            fastest = fastest.max(of_sensor(record, sensor).unwrap_or(0.0));
        }
    }
    Ok(if fastest > 0.0 { ((PER_PERIOD * fastest).recip() as usize).max(1) } else { 1 })
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
                    return dot(&kernel, &v[centre - half..=centre + half]);
                }
                kernel.iter().enumerate().map(|(k, w)| w * at((centre + k) as isize - half as isize)).sum()
            })
            .collect();
    }
    thinned.interval = record.interval * stride as f64;
    thinned
}
