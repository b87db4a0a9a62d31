//! Where a closed loop begins: states, modes and the size of the force as an open-loop fit has them.

use super::super::closed::{ClosedModel, Course, Free, InitialState, Segment};
use super::super::force::Effect;
use super::super::limits::{
    AT_REST, FIRST_SHARE, HELD_GAIN, HELD_SAMPLES, HELD_STEPS, HELD_VALUES, HOLDS, LAST_GAIN, MODES_MISSING,
    MORE_MODES, NEAR_NOISES, OTHER_START, POOL_DAMPING, SHARPER, STATE_STEPS, WRONG_COUPLING,
};
use super::super::linear::{ForceSeries, LinearTask, ModalFit};
use super::super::measurement::SensorSeries;
use super::super::pole::{self, Pole};
use super::super::screen::{ForceCandidate, Screen, deviation};
use super::ForceSearch;
use nalgebra::{Complex, DMatrix, DVector};
use sindyscope_core::study::Cancel;

/// How a closed loop starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StartKind {
    /// As the open-loop fit has it.
    Plain,
    /// With the force as large as the motion of its own states asks for.
    Matched,
}

impl StartKind {
    pub(super) const ALL: [Self; 2] = [Self::Plain, Self::Matched];

    /// What is left of a coupling by which the force would push a mode the wrong way.
    fn wrong_coupling(self) -> f64 {
        WRONG_COUPLING[self as usize]
    }
}

/// The states along the fitted records as an open-loop fit has them.
pub(super) struct States {
    /// `modes[record][mode][sample]`
    pub(super) modes: Vec<Vec<Vec<Complex<f64>>>>,
    /// The force's inner state, `memory[record][sample]`; empty where it has none.
    pub(super) memory: Vec<Vec<f64>>,
}

impl States {
    pub(super) fn at(&self, record: usize, sample: usize) -> InitialState {
        let memory = self.memory.get(record).map_or(0.0, |m| m[sample]);
        InitialState { modes: self.modes[record].iter().map(|m| m[sample]).collect(), memory }
    }
}

/// A fit over short stretches.
pub(super) struct BegunFit {
    pub(super) model: ClosedModel,
    pub(super) course: Course,
    /// The states at the records' beginnings; none where these are at rest.
    pub(super) whole_initial: Vec<InitialState>,
    /// RMS that is left, jumps counted, and the noise in it.
    pub(super) error: f64,
    pub(super) noise: f64,
}

impl BegunFit {
    pub(super) fn left(&self) -> BegunError {
        BegunError { error: self.error, noise: self.noise }
    }
}

/// RMS that a fit over short stretches leaves, jumps counted, and the noise in it.
#[derive(Clone, Copy)]
pub(super) struct BegunError {
    pub(super) error: f64,
    noise: f64,
}

impl BegunError {
    pub(super) fn noises(self) -> f64 {
        self.error / self.noise
    }
}

impl ForceSearch<'_> {
    /// A closed-loop model from an open-loop fit, and the states that the fit has. The responses of each mode to inputs and
    /// force are made one shape, as reciprocity asks. `turned` lets a force that may act either way act the other way than most of these responses
    /// have it. None where a start would be the first one again.
    pub(super) fn start(
        &self,
        task: &LinearTask<'_>,
        fit: &ModalFit,
        candidate: &ForceCandidate,
        across: &[f64],
        (which, turned): (StartKind, bool),
    ) -> Option<(ClosedModel, States)> {
        let (sensors, inputs) = (self.measurement.sensors.len(), self.measurement.inputs.len());
        let residue = |mode: usize| {
            let omega: f64 = fit.poles[mode].omega;
            DMatrix::from_fn(sensors, inputs + 1, |s, j| {
                let power = 2 - self.measurement.sensors[s].quantity.derivatives();
                task.amplitude(fit, s, mode, j) * omega.powi(power)
            })
        };
        let split = |mode: usize| -> Option<(DVector<f64>, DVector<f64>)> {
            let svd = residue(mode).svd(true, true);
            let (u, v) = (svd.u?, svd.v_t?);
            Some((u.column(0).into_owned(), v.row(0).transpose() * svd.singular_values[0]))
        };
        let parts: Vec<(DVector<f64>, DVector<f64>)> = (0..fit.poles.len())
            .map(|i| split(i).unwrap_or_else(|| (DVector::zeros(sensors), DVector::zeros(inputs + 1))))
            .collect();
        let moved = |u: &DVector<f64>| across.iter().zip(u.iter()).map(|(e, u)| e * u).sum::<f64>();
        // By the static compliance at the force's place: what lies far beyond the band moves it little, however large it looks to an
        // accelerometer.
        let compliance =
            |i: usize, (u, v): &(DVector<f64>, DVector<f64>)| -v[inputs] * moved(u) / fit.poles[i].omega.powi(2);
        let weight: f64 = parts.iter().enumerate().map(|(i, part)| compliance(i, part)).sum();
        let negative = candidate.effect.has_either_sign() && ((weight < 0.0) != turned);
        let sign = if negative { -1.0 } else { 1.0 };
        let mut drive = Vec::new();
        let (mut shape, mut forced) = (Vec::new(), Vec::new());
        let mut restoring = true;
        for (u, v) in &parts {
            let reach = moved(u);
            let square = -v[inputs] * sign / reach;
            let share = if square > 0.0 { 1.0 } else { which.wrong_coupling() };
            let size = share * square.abs().sqrt();
            restoring &= square > 0.0;
            let size = if size.is_finite() && size > 0.0 { size } else { 1.0 };
            shape.push(u.iter().map(|u| u * size).collect());
            drive.push((0..inputs).map(|j| v[j] / size).collect());
            forced.push(v[inputs] / size);
        }
        let mut inner = candidate.inner;
        if candidate.effect == Effect::CoulombFriction {
            inner[0] *= SHARPER;
        }
        let mut model = ClosedModel {
            effect: candidate.effect,
            across: across.to_vec(),
            sign,
            unit: candidate.unit,
            inner,
            halvings: candidate.halvings,
            poles: fit.poles.clone(),
            drive,
            shape,
            initial: Vec::new(),
        };
        let free = self.initial(task, fit, &model);
        let states = (0..self.split.fitted.len()).map(|r| {
            let series = &self.split.fitted[r];
            let along = |i: usize| {
                let lambda = fit.poles[i].eigenvalue();
                let mut sum = vec![Complex::new(0.0, 0.0); series.len()];
                let mut one = sum.clone();
                let mut add = |one: &[Complex<f64>], size: f64| {
                    sum.iter_mut().zip(one).for_each(|(s, z)| *s += z * size);
                };
                for (j, input) in series.inputs.iter().enumerate() {
                    pole::response(lambda, series.interval, &pole::padded(input), &mut one);
                    add(&one, model.drive[i][j]);
                }
                let force = &candidate.fitted;
                pole::response_fine(lambda, series.interval, &force.values[r], force.parts, &mut one);
                add(&one, forced[i]);
                let mut own = free[r].modes[i];
                let decay = (lambda * series.interval).exp();
                for z in &mut sum {
                    *z += own;
                    own *= decay;
                }
                sum
            };
            (0..fit.poles.len()).map(along).collect::<Vec<_>>()
        });
        let memory = |values: &Vec<f64>| -> Vec<f64> {
            values.iter().step_by(candidate.fitted.parts).map(|f| f * candidate.unit).collect()
        };
        let memory = candidate.effect.has_memory().then(|| candidate.fitted.values.iter().map(memory).collect());
        let mut states = States { modes: states.collect(), memory: memory.unwrap_or_default() };
        if which == StartKind::Matched && !matched(&mut model, &mut states, &candidate.fitted) && restoring {
            return None;
        }
        if !self.at_rest(task, fit) {
            model.initial = (0..free.len()).map(|r| states.at(r, 0)).collect();
        }
        Some((model, states))
    }

    /// The initial states that the free oscillations of an open-loop fit tell.
    fn initial(&self, task: &LinearTask<'_>, fit: &ModalFit, model: &ClosedModel) -> Vec<InitialState> {
        let sensors = &self.measurement.sensors;
        let of = |record: usize, mode: usize| {
            let lambda = fit.poles[mode].eigenvalue();
            let (mut sum, mut power) = (Complex::new(0.0, 0.0), 0.0);
            for (s, sensor) in sensors.iter().enumerate() {
                let [re, im] = task.free(fit, s, mode, record);
                let own = lambda.powi(sensor.quantity.derivatives()) * (model.shape[mode][s] / lambda.im);
                sum += Complex::new(re, -im) * Complex::new(0.0, 1.0) * own.conj();
                power += own.norm_sqr();
            }
            sum / power.max(1e-300)
        };
        let modes = |r: usize| (0..fit.poles.len()).map(|i| of(r, i)).collect();
        (0..self.split.fitted.len()).map(|r| InitialState { modes: modes(r), memory: 0.0 }).collect()
    }

    /// True if all records start at rest: none has free oscillations worth the name.
    fn at_rest(&self, task: &LinearTask<'_>, fit: &ModalFit) -> bool {
        if self.measurement.inputs.is_empty() {
            return false;
        }
        let mut largest = 0.0_f64;
        for (r, series) in self.split.fitted.iter().enumerate() {
            for (s, output) in series.outputs.iter().enumerate() {
                let size = deviation(output);
                for i in 0..fit.poles.len() {
                    let [re, im] = task.free(fit, s, i, r);
                    // The RMS of the decay over the record.
                    let lasts =
                        (0.5 / (fit.poles[i].damping * fit.poles[i].omega)).min(series.len() as f64 * series.interval);
                    let share = (lasts / (series.len() as f64 * series.interval)).sqrt();
                    largest = largest.max(re.hypot(im) / size * share);
                }
            }
        }
        largest <= AT_REST
    }

    /// Share of the fitted records that is fitted in stretches.
    pub(super) fn held_share(&self) -> f64 {
        let total: usize = self.split.fitted.iter().map(SensorSeries::len).sum();
        HELD_SAMPLES.min(HELD_VALUES / self.measurement.sensors.len() as f64) / total as f64
    }

    /// A fit over short stretches that are hardly held together.
    pub(super) fn begun(
        &self,
        start: ClosedModel,
        states: &States,
        offsets: &[Vec<f64>],
        parts: usize,
        cancel: &Cancel,
    ) -> Option<BegunFit> {
        let (sensors, series) = (&self.measurement.sensors, &self.split.fitted);
        let whole_initial = start.initial.clone();
        let segments = stretches(series, self.stretch(&start), FIRST_SHARE * self.held_share());
        let mut model = start;
        model.initial = segments.iter().map(|s| states.at(s.record, s.start)).collect();
        let rest = whole_initial.is_empty();
        let mut course = Course { segments, weights: Vec::new(), rest, offsets: offsets.to_vec() };
        model = model.eased(course.along(sensors, series, parts), STATE_STEPS, 1e-2, cancel);
        course.weights = held(&model, HOLDS[0]);
        let of = course.along(sensors, series, parts);
        let (model, left) = model.fitted(of, Free::All, HELD_STEPS, HELD_GAIN, cancel)?;
        let error = (left.squares / left.samples as f64).sqrt();
        let residuals = course.residuals(of, &left);
        let noise = self.noise_in(&residuals);
        Some(BegunFit { model, course, whole_initial, error, noise })
    }

    /// The number of modes (less one), from a number on, with which stretches that are hardly held together leave no more than noise, else
    /// the one with which they leave least, where that is near the noise; with what they leave.
    /// Whatever a force lacks, it lacks over a longer time: what such short stretches leave is what modes are missing for.
    pub(super) fn modes_for_stretches(
        &self,
        candidate: &ForceCandidate,
        steps: &[(ModalFit, f64)],
        from: usize,
        cancel: &Cancel,
    ) -> Option<(usize, BegunError)> {
        let mut best: Option<(usize, BegunError)> = None;
        for (k, (fit, _)) in steps.iter().enumerate().skip(from).take(MORE_MODES) {
            let Some(begun) = self.first_start(candidate, fit, StartKind::Plain, cancel) else { continue };
            if begun.left().noises() < MODES_MISSING {
                return Some((k, begun.left()));
            }
            if begun.left().noises() < NEAR_NOISES && best.as_ref().is_none_or(|b| begun.error < LAST_GAIN * b.1.error)
            {
                best = Some((k, begun.left()));
            }
        }
        best
    }

    fn first_start(
        &self,
        candidate: &ForceCandidate,
        fit: &ModalFit,
        kind: StartKind,
        cancel: &Cancel,
    ) -> Option<BegunFit> {
        let task = LinearTask::new(&self.split.fitted, &self.measurement.sensors, Some(&candidate.fitted), 1);
        let across = Screen::across(self.measurement, candidate.site)?;
        let light = of_light_modes(&task, &fit.poles)?;
        let fit = light.as_ref().unwrap_or(fit);
        let (start, states) = self.start(&task, fit, candidate, &across, (kind, false))?;
        self.begun(start, &states, &self.offsets(&task, fit), candidate.parts(), cancel)
    }

    pub(super) fn offsets(&self, task: &LinearTask<'_>, fit: &ModalFit) -> Vec<Vec<f64>> {
        let sensors = 0..self.measurement.sensors.len();
        (0..self.split.fitted.len()).map(|r| sensors.clone().map(|s| task.offset(fit, s, r)).collect()).collect()
    }
}

/// Makes a model's force as large as an open-loop fit has it along the motion that its own states make: accelerations that
/// were integrated show the motion too small or too large. False where it is as large already, or none would serve.
fn matched(model: &mut ClosedModel, states: &mut States, force: &ForceSeries) -> bool {
    let derivative = i32::from(model.effect.is_of_velocity());
    let mut pairs: Vec<(f64, f64)> = Vec::new();
    for (own, values) in states.modes.iter().zip(&force.values) {
        let samples = own.first().map_or(0, Vec::len);
        let at = |t: usize| {
            let shown = |i: usize| {
                let lambda = model.poles[i].eigenvalue();
                model.coupling(i) * (lambda.powi(derivative) * own[i][t]).im / lambda.im
            };
            (0..own.len()).map(shown).sum::<f64>()
        };
        pairs.extend((0..samples).map(|t| (at(t), values[t * force.parts])));
    }
    if model.effect == Effect::Clearance {
        // The gap is left as often.
        let beyond = pairs.iter().filter(|(_, f)| *f != 0.0).count();
        let mut sizes: Vec<f64> = pairs.iter().map(|(x, _)| x.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        if let Some(gap) = sizes.get(sizes.len() - beyond.clamp(1, sizes.len().max(1))).filter(|g| **g > 0.0) {
            model.inner[0] = *gap;
        }
    }
    let (mut product, mut square) = (0.0, 0.0);
    let motion: Vec<f64> = pairs.iter().map(|(x, _)| *x).collect();
    for (own, (_, measured)) in model.effect.along(&motion, model.inner).into_iter().zip(pairs) {
        let own = own / model.unit;
        product += own * measured;
        square += own * own;
    }
    let size = (product / square).sqrt();
    if !(size.is_finite() && size > 0.0 && size.ln().abs() > OTHER_START) {
        return false;
    }
    model.shape.iter_mut().flatten().for_each(|s| *s *= size);
    model.drive.iter_mut().flatten().for_each(|d| *d /= size);
    states.modes.iter_mut().flatten().flatten().for_each(|z| *z /= size);
    true
}

/// The beginnings of all records, a share of each, in stretches of about so many samples; each one's last sample is the next one's first.
pub(super) fn stretches(series: &[SensorSeries], samples: f64, share: f64) -> Vec<Segment> {
    let mut all = Vec::new();
    for Segment { record, length, .. } in Segment::whole(series, share.min(1.0)) {
        let count = ((length as f64 / samples).round() as usize).max(1);
        let bound = |k: usize| k * (length - 1) / count;
        all.extend((0..count).map(|k| Segment { record, start: bound(k), length: bound(k + 1) - bound(k) + 1 }));
    }
    all
}

/// An open-loop fit without the poles that are damped as no mode of a structure is: along a rough force they stand for its error, and in
/// closed loop they would move the force. All of them stay where there is no other.
pub(super) fn of_light_modes(task: &LinearTask<'_>, poles: &[Pole]) -> Option<Option<ModalFit>> {
    let light: Vec<Pole> = poles.iter().copied().filter(|p| p.damping < POOL_DAMPING.1).collect();
    if light.is_empty() || light.len() == poles.len() { Some(None) } else { task.fit(&light).map(Some) }
}

/// What jumps of the states count for, each beside the size of its state.
pub(super) fn held(model: &ClosedModel, hold: f64) -> Vec<f64> {
    let size = |i: usize| {
        let sum: f64 = model.initial.iter().map(|s| s.modes[i].norm_sqr()).sum();
        (sum / model.initial.len() as f64).sqrt().max(1e-300)
    };
    // That of an inner state is at most about the displacement at which it yields.
    let memory = model.effect.has_memory().then(|| hold / model.inner[0]);
    (0..model.modes()).map(|i| hold / size(i)).chain(memory).collect()
}
