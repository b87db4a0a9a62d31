//! One segment simulated, and what parameters change of it.

mod tangent;

use nalgebra::Complex;

use super::super::force::Pass;
use super::super::limits::{FORCE_ITERATIONS, FORCE_TOLERANCE, RUNAWAY};
use super::super::measurement::{Quantity, SensorSeries};
use super::driven::{DriveStep, Driven, Propagation, imaginary};
use super::{ClosedModel, End, Free, InitialState, Loop, Segment, SegmentRun, Simulated};
use tangent::Tangent;

/// Most modes of a model; more than the data may choose.
const MODES: usize = 64;

/// A segment with all that stays the same along it.
struct Course<'a> {
    model: &'a ClosedModel,
    of: Loop<'a>,
    series: &'a SensorSeries,
    segment: Segment,
    steps: &'a [DriveStep],
    /// ρ of each mode.
    couplings: Vec<f64>,
    /// σ ρ of each mode, over the force's unit.
    pushes: Vec<f64>,
    /// Derivatives by time from the displacement of what the force depends on.
    order: usize,
    /// What a unit of the mean force takes off the motion at the step's end.
    kappa: f64,
    driven: &'a Driven,
    first: &'a InitialState,
}

/// The simulation at one instant.
struct SegmentMotion {
    /// The force's part of the states, now and before the last step.
    forced: Vec<Complex<f64>>,
    before: Vec<Complex<f64>>,
    states: Vec<Complex<f64>>,
    /// Free oscillations of unit size.
    swings: Vec<Complex<f64>>,
    /// What the force depends on.
    motion: f64,
    /// Its mean over the last step.
    force: f64,
    /// The joint's inner state, where the force has one.
    memory: f64,
    pass: Pass,
}

impl ClosedModel {
    /// Simulates one segment; with `free`, sums of the normal equations too. None where the response runs away.
    ///
    /// `along` belongs to the segment's record; `driven` is what inputs make of the modes, where that is known already.
    pub(super) fn run_segment(
        &self,
        of: Loop<'_>,
        which: usize,
        free: Option<Free>,
        along: &Propagation,
        driven: Option<&Driven>,
    ) -> Option<SegmentRun> {
        let segment = of.segments[which];
        let shared_free = free.is_some_and(|f| f != Free::Initial);
        let own;
        let driven = match driven {
            Some(driven) => driven,
            None => {
                own = Driven::new(self, along, segment, shared_free);
                &own
            }
        };
        let rest = InitialState::rest(self.modes());
        let first = self.initial.get(which).unwrap_or(&rest);
        let course = Course::new(self, of, segment, (along, driven), first);
        let mut motion = SegmentMotion::new(self.modes(), first.memory);
        let mut tangent = free.map(|free| Tangent::new(&course, free));
        let samples = (driven.instants - 1) / of.parts + 1;
        let mut out = Simulated {
            squares: 0.0,
            samples: samples * self.sensors(),
            residuals: vec![vec![Vec::with_capacity(samples); self.sensors()]],
            forces: vec![Vec::with_capacity(driven.instants)],
        };
        let joined = of.is_joined(which);
        for t in 0..driven.instants {
            motion.step(&course, t)?;
            if let Some(tangent) = &mut tangent {
                tangent.step(&course, &motion, t);
            }
            out.forces[0].push(motion.pass.end / self.unit);
            if t % of.parts != 0 || (joined && t + 1 == driven.instants) {
                continue;
            }
            course.read(&motion, t, tangent.as_mut(), &mut out)?;
        }
        let by = tangent.as_ref().filter(|_| joined).map(|t| t.end(&course, &motion));
        let states = InitialState { modes: motion.states, memory: motion.memory };
        Some((out, tangent.map(Tangent::sums), End { states, by }))
    }

    /// The mean force of a step: the root of `f − mean(f)`, from a guess; `mean` gives the mean along the motion that the
    /// force leaves, and its slope by the motion's end, of which a unit of the force takes off `rate`.
    fn solved(&self, guess: f64, mean: impl Fn(f64) -> (f64, f64), rate: f64) -> Option<f64> {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut force = guess;
        for _ in 0..FORCE_ITERATIONS {
            let (value, slope) = mean(force);
            let error = force - value;
            if !error.is_finite() {
                return None;
            }
            if error.abs() <= FORCE_TOLERANCE * (self.unit + force.abs()) {
                return Some(force);
            }
            if error > 0.0 {
                high = high.min(force);
            } else {
                low = low.max(force);
            }
            let whole = 1.0 + slope * rate;
            let next = force - error / whole;
            force = if whole > 0.0 && next > low && next < high {
                next
            } else if low.is_finite() && high.is_finite() {
                0.5 * (low + high)
            } else {
                value
            };
        }
        Some(force)
    }
}

impl<'a> Course<'a> {
    fn new(
        model: &'a ClosedModel,
        of: Loop<'a>,
        segment: Segment,
        (along, driven): (&'a Propagation, &'a Driven),
        first: &'a InitialState,
    ) -> Self {
        let (series, steps) = (&of.series[segment.record], along.steps.as_slice());
        let couplings: Vec<f64> = (0..model.modes()).map(|i| model.coupling(i)).collect();
        let pushes: Vec<f64> = couplings.iter().map(|rho| model.sign * rho / model.unit).collect();
        let order = usize::from(model.effect.is_of_velocity());
        let each = steps.iter().zip(&couplings).zip(&pushes);
        let kappa = each.map(|((s, rho), push)| rho * push * imaginary(s.shows[order], s.weight)).sum::<f64>();
        Self { model, of, series, segment, steps, couplings, pushes, order, kappa, driven, first }
    }

    /// What each sensor shows at a sample beside what it measured; with a tangent, its row of the normal equations.
    fn read(
        &self,
        motion: &SegmentMotion,
        t: usize,
        mut tangent: Option<&mut Tangent>,
        out: &mut Simulated,
    ) -> Option<()> {
        let (model, n) = (self.model, self.segment.start + t / self.of.parts);
        let m = self.steps.len().min(MODES);
        for quantity in [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration] {
            if self.of.sensors.iter().all(|s| s.quantity != quantity) {
                continue;
            }
            let order = quantity.derivatives() as usize;
            let mut shown = [0.0; MODES];
            for (i, shown) in shown.iter_mut().enumerate().take(m) {
                *shown = imaginary(self.steps[i].shows[order], motion.states[i]);
                if order == 2 {
                    let driven = model.drive[i].iter().zip(&self.series.inputs).map(|(b, u)| b * u[n]).sum::<f64>();
                    *shown += driven - self.pushes[i] * motion.pass.end;
                }
            }
            if let Some(tangent) = &mut tangent {
                tangent.show(self, motion, (t, n), order);
            }
            for (k, _) in self.of.sensors.iter().enumerate().filter(|(_, s)| s.quantity == quantity) {
                let value: f64 = (0..m).map(|i| model.shape[i][k] * shown[i]).sum();
                let offset = self.of.offsets.get(self.segment.record).map_or(0.0, |o| o[k]);
                let error = self.series.outputs[k][n] - offset - value;
                if error.is_nan() || error.abs() >= RUNAWAY {
                    return None;
                }
                out.squares += error * error;
                out.residuals[0][k].push(error);
                if let Some(tangent) = &mut tangent {
                    tangent.row(self, k, error, &shown);
                }
            }
        }
        Some(())
    }
}

impl SegmentMotion {
    fn new(modes: usize, memory: f64) -> Self {
        let zero = Complex::new(0.0, 0.0);
        Self {
            forced: vec![zero; modes],
            before: vec![zero; modes],
            states: vec![zero; modes],
            swings: vec![Complex::new(1.0, 0.0); modes],
            motion: 0.0,
            force: 0.0,
            memory,
            pass: Pass::default(),
        }
    }

    /// Goes on to an instant. None where the motion is no number.
    fn step(&mut self, course: &Course<'_>, t: usize) -> Option<()> {
        let (model, m) = (course.model, course.steps.len());
        let linear = &course.driven.linear[t * m..(t + 1) * m];
        let mut free = 0.0;
        for (i, step) in course.steps.iter().enumerate() {
            if t > 0 {
                self.before[i] = self.forced[i];
                self.forced[i] *= step.decay;
                self.swings[i] *= step.decay;
            }
            self.states[i] = linear[i] + course.first.modes[i] * self.swings[i] - self.forced[i];
            free += course.couplings[i] * imaginary(step.shows[course.order], self.states[i]);
        }
        if t == 0 {
            self.motion = free;
            self.pass = model.effect.still(free, model.inner, self.memory);
            return free.is_finite().then_some(());
        }
        let (before, memory) = (self.motion, self.memory);
        let mean = |force: f64| model.effect.mean_and_slope(before, free - course.kappa * force, model.inner, memory);
        self.force = model.solved(self.force, mean, course.kappa)?;
        self.motion = free - course.kappa * self.force;
        self.pass = model.effect.pass(before, self.motion, model.inner, memory);
        for (i, step) in course.steps.iter().enumerate() {
            let pushed = step.weight * (course.pushes[i] * self.force);
            self.forced[i] += pushed;
            self.states[i] -= pushed;
        }
        if model.effect.has_memory() {
            self.memory = self.pass.end;
        }
        self.motion.is_finite().then_some(())
    }
}

impl Course<'_> {
    /// What the logarithm of a mode's frequency or damping changes of its state without the force.
    fn by_pole(&self, motion: &SegmentMotion, t: usize, mode: usize, which: usize) -> Complex<f64> {
        let step = self.series.interval / self.of.parts as f64;
        let swung = self.first.modes[mode] * motion.swings[mode];
        let driven = self.driven.by_pole[t * self.steps.len() + mode][which];
        driven + swung * self.steps[mode].lambda_by[which] * (t as f64 * step)
    }

    /// What a unit of an input makes of a mode's state.
    fn by_drive(&self, t: usize, mode: usize, input: usize) -> Complex<f64> {
        self.driven.by_drive[(t * self.steps.len() + mode) * self.model.inputs() + input]
    }
}
