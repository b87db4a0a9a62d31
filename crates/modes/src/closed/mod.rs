//! A structure with one force that its own motion makes, simulated and fitted.
//!
//! `qᵢ″ + 2ζᵢωᵢ qᵢ′ + ωᵢ² qᵢ = Σⱼ bᵢⱼ uⱼ − σ ρᵢ f(x)`, `x = Σᵢ ρᵢ qᵢ` (or its rate), `ρᵢ = Σₛ eₛ φₛᵢ`: a force between points of the structure drives
//! a mode as much as the mode moves these points (reciprocity), so the force's size is that of the shapes, and only its
//! sign σ is left. Between instants the force counts with its mean along a straight path, which makes switching exact to
//! the second order and differentiable; the force at the step's end follows from one scalar equation.

mod course;
mod driven;
mod fit;
mod normal;
mod segment;
#[cfg(test)]
mod tests;
mod without;

use nalgebra::{Complex, DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::force::Effect;
use super::limits::MAX_CHANGE;
use super::pole::Pole;
use driven::{Driven, Propagation};
use normal::{Change, Local, Normal, NormalBlock};
use sindyscope_core::parallel::prelude::*;

pub(crate) use course::{Course, Joint, Loop, Segment};

/// The parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ClosedModel {
    pub(crate) effect: Effect,
    /// Weights eₛ of the sensors in the displacement across the force's place.
    pub(crate) across: Vec<f64>,
    /// σ: 1 or −1.
    pub(crate) sign: f64,
    /// What the force is divided by.
    pub(crate) unit: f64,
    /// What is inside the force: see [`Effect`].
    pub(crate) inner: [f64; 2],
    /// How often the steps of the integration were halved.
    #[serde(default)]
    pub(crate) halvings: u32,
    pub(crate) poles: Vec<Pole>,
    /// `drive[mode][input]`
    pub(crate) drive: Vec<Vec<f64>>,
    /// `shape[mode][sensor]`
    pub(crate) shape: Vec<Vec<f64>>,
    /// The state at each segment's beginning; empty where the records start at rest. Not kept: it is fitted to the records.
    #[serde(skip)]
    pub(crate) initial: Vec<InitialState>,
}

/// The state of a structure with its force.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct InitialState {
    /// Of each mode.
    pub(crate) modes: Vec<Complex<f64>>,
    /// The inner state of a force that has a memory, in the unit of the displacement; else zero.
    pub(crate) memory: f64,
}

impl InitialState {
    pub(crate) fn rest(modes: usize) -> Self {
        Self { modes: vec![Complex::new(0.0, 0.0); modes], memory: 0.0 }
    }

    /// Real and imaginary part of each mode, then the inner state where there is one.
    fn numbers(&self, with_memory: bool) -> DVector<f64> {
        let modes = self.modes.iter().flat_map(|z| [z.re, z.im]);
        let all: Vec<f64> = modes.chain(with_memory.then_some(self.memory)).collect();
        DVector::from_vec(all)
    }
}

/// Which parameters are free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Free {
    /// All that records share.
    Shared,
    /// These and the segments' initial states.
    All,
    /// The initial states alone.
    Initial,
}

/// A simulation.
pub(crate) struct Simulated {
    pub(crate) squares: f64,
    pub(crate) samples: usize,
    /// `residuals[segment][sensor][sample]`
    pub(crate) residuals: Vec<Vec<Vec<f64>>>,
    /// The force (in its unit) at each instant, `forces[segment][instant]`.
    pub(crate) forces: Vec<Vec<f64>>,
}

/// A segment's simulation, its sums of the normal equations where they are asked for, and its end.
type SegmentRun = (Simulated, Option<(NormalBlock, Local)>, End);

/// The states at a segment's last sample, and what parameters change of them: shared ones, then the initial states.
struct End {
    states: InitialState,
    by: Option<DMatrix<f64>>,
}

/// What stays while poles and drives do.
#[derive(Clone, Copy)]
struct KnownPart<'a> {
    /// `propagation[record]`
    propagation: &'a [Propagation],
    /// `driven[segment]`, where it is kept.
    driven: Option<&'a [Driven]>,
}

impl ClosedModel {
    pub(crate) fn modes(&self) -> usize {
        self.poles.len()
    }

    /// Steps of the integration between two samples.
    pub(crate) fn parts(&self) -> usize {
        self.effect.parts() << self.halvings
    }

    fn inputs(&self) -> usize {
        self.drive.first().map_or(0, Vec::len)
    }

    fn sensors(&self) -> usize {
        self.across.len()
    }

    /// ρ of a mode.
    pub(crate) fn coupling(&self, mode: usize) -> f64 {
        self.across.iter().zip(&self.shape[mode]).map(|(e, s)| e * s).sum()
    }

    /// Parameters that records share: of each mode frequency, damping, drives, shape; what is inside the force last.
    pub(crate) fn shared(&self) -> usize {
        self.modes() * self.of_mode() + self.effect.free_inner()
    }

    /// Numbers of a state.
    fn local(&self) -> usize {
        2 * self.modes() + usize::from(self.effect.has_memory())
    }

    fn of_mode(&self) -> usize {
        2 + self.inputs() + self.sensors()
    }

    fn moved(&self, change: &Change) -> Self {
        let mut new = self.clone();
        let (inputs, width) = (self.inputs(), self.of_mode());
        let shared = &change.shared;
        if !shared.is_empty() {
            for i in 0..self.modes() {
                let at = i * width;
                let limited = |k: usize| shared[at + k].clamp(-MAX_CHANGE[k], MAX_CHANGE[k]).exp();
                new.poles[i] = self.poles[i].scaled(limited(0), limited(1));
                for j in 0..inputs {
                    new.drive[i][j] += shared[at + 2 + j];
                }
                for s in 0..self.sensors() {
                    new.shape[i][s] += shared[at + 2 + inputs + s];
                }
            }
            let inner = &shared.as_slice()[self.modes() * width..];
            new.inner = self.effect.moved_inner(self.inner, inner);
        }
        for (state, local) in new.initial.iter_mut().zip(&change.local) {
            for (i, mode) in state.modes.iter_mut().enumerate() {
                *mode += Complex::new(local[2 * i], local[2 * i + 1]);
            }
            if self.effect.has_memory() {
                state.memory += local[2 * self.modes()];
            }
        }
        new
    }

    /// What the segments of each record share.
    fn propagation(&self, of: Loop<'_>, with_derivatives: bool) -> Vec<Propagation> {
        of.series.iter().map(|s| Propagation::new(&self.poles, s, of.parts, with_derivatives)).collect()
    }

    /// Simulates all segments; with `free`, sums of the normal equations too. None where a response runs away.
    ///
    /// `known` is what stays while poles and drives do; computed where it is not given.
    fn run(
        &self,
        of: Loop<'_>,
        free: Option<Free>,
        known: Option<KnownPart<'_>>,
    ) -> Option<(Simulated, Option<Normal>)> {
        let segments: Vec<usize> = (0..of.segments.len()).collect();
        let own;
        let KnownPart { propagation, driven } = match known {
            Some(known) => known,
            None => {
                own = self.propagation(of, free.is_some_and(|f| f != Free::Initial));
                KnownPart { propagation: &own, driven: None }
            }
        };
        let one = |k: &usize| {
            self.run_segment(of, *k, free, &propagation[of.segments[*k].record], driven.map(|driven| &driven[*k]))
        };
        let each: Vec<Option<SegmentRun>> = segments.par_iter().map(one).collect();
        let size = if free == Some(Free::Initial) { 0 } else { self.shared() };
        let mut all = Simulated { squares: 0.0, samples: 0, residuals: Vec::new(), forces: Vec::new() };
        let mut normal = free.map(|_| Normal { shared: NormalBlock::zeros(size), locals: Vec::new() });
        let mut ends = Vec::new();
        for one in each {
            let (simulated, own, end) = one?;
            ends.push(end);
            all.squares += simulated.squares;
            all.samples += simulated.samples;
            all.residuals.extend(simulated.residuals);
            all.forces.extend(simulated.forces);
            if let (Some(sum), Some((shared, local))) = (&mut normal, own) {
                sum.shared.matrix += shared.matrix;
                sum.shared.gradient += shared.gradient;
                if !self.initial.is_empty() {
                    sum.locals.push(local);
                }
            }
        }
        if let Some(joint) = of.joint {
            self.join(of, joint, &ends, &mut all, normal.as_mut());
        }
        all.squares.is_finite().then_some((all, normal))
    }

    /// Adds what jumps between segments count.
    fn join(&self, of: Loop<'_>, joint: Joint<'_>, ends: &[End], all: &mut Simulated, mut normal: Option<&mut Normal>) {
        let memory = self.effect.has_memory();
        let both = |state: &InitialState| state.numbers(memory);
        let of_modes = joint.weights[..self.modes()].iter().flat_map(|w| [*w, *w]);
        let weights: Vec<f64> = of_modes.chain(joint.weights[self.modes()..].iter().copied()).collect();
        let weights = DVector::from_vec(weights);
        let square = DMatrix::from_diagonal(&weights.component_mul(&weights));
        for (k, end) in ends.iter().enumerate() {
            if of.segments[k].start == 0 && joint.rest {
                let jump = both(&self.initial[k]).component_mul(&weights);
                all.squares += jump.norm_squared();
                if let Some(normal) = &mut normal {
                    normal.locals[k].own.matrix += &square;
                    normal.locals[k].own.gradient -= jump.component_mul(&weights);
                }
            }
            if !of.is_joined(k) {
                continue;
            }
            let jump = (both(&self.initial[k + 1]) - both(&end.states)).component_mul(&weights);
            all.squares += jump.norm_squared();
            let (Some(normal), Some(by)) = (&mut normal, &end.by) else { continue };
            let mut rows = -by.clone();
            for (mut row, weight) in rows.row_iter_mut().zip(weights.iter()) {
                row *= *weight;
            }
            let shared = normal.shared.gradient.len();
            let (first, own) =
                (rows.columns(0, shared).into_owned(), rows.columns(shared, rows.ncols() - shared).into_owned());
            normal.shared.matrix += first.transpose() * &first;
            normal.shared.gradient -= first.tr_mul(&jump);
            let mut weighed = first.transpose();
            let mut held = own.transpose();
            for (i, weight) in weights.iter().enumerate() {
                weighed.column_mut(i).scale_mut(*weight);
                held.column_mut(i).scale_mut(*weight);
            }
            let local = &mut normal.locals[k];
            local.cross += first.transpose() * &own;
            local.own.matrix += own.transpose() * &own;
            local.own.gradient -= own.tr_mul(&jump);
            local.next = Some(held);
            let after = &mut normal.locals[k + 1];
            after.own.matrix += &square;
            after.own.gradient -= jump.component_mul(&weights);
            after.cross += weighed;
        }
    }

    pub(crate) fn simulate(&self, of: Loop<'_>) -> Option<Simulated> {
        self.run(of, None, None).map(|(s, _)| s)
    }

    /// Where a mode's frequency stands among the shared parameters; damping, drives and shape follow.
    pub(crate) fn place_of(&self, mode: usize) -> usize {
        mode * self.of_mode()
    }
}
