//! What an effect is fitted into: the motion's size, the coordinates that there are, and the dice of one draw.
//!
//! Everything here is without units: lengths over the amplitude scale, times over 1/ω₀. So the stiffness over mass is 1
//! and the natural period 2π, and one tolerance of integration is right from micrometres to metres.

use super::algebra::{E, du, u, v, x};

/// How far a quantity goes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent {
    /// Its largest magnitude.
    pub peak: f64,
    /// Its root mean square.
    pub rms: f64,
}

impl Extent {
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let (mut peak, mut sum, mut count) = (0.0_f64, 0.0, 0.0_f64);
        for value in values {
            peak = peak.max(value.abs());
            sum += value * value;
            count += 1.0;
        }
        Self { peak, rms: (sum / count.max(1.0)).sqrt() }
    }
}

/// The size of a motion over all fitted records.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motion {
    /// Displacement.
    pub x: Extent,
    /// Velocity.
    pub v: Extent,
    /// Displacement over the base.
    pub r: Extent,
    /// Velocity over the base.
    pub w: Extent,
    /// Input.
    pub u: Extent,
}

/// How the plant is driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Drive {
    /// The base moves.
    Base,
    /// A force acts.
    Force,
    /// Nothing does: free decay.
    None,
}

/// What an effect is fitted into.
#[derive(Clone, Debug)]
pub(super) struct Scene {
    /// Viscous damping over mass, 2ζ.
    pub damping: f64,
    pub drive: Drive,
    /// The time at which the records begin.
    pub origin: f64,
    /// The duration of a fitted record.
    pub length: f64,
    pub motion: Motion,
    /// Where the effect's own states begin.
    pub first_state: usize,
    /// The input that reaches the plant: the measured one, or its delayed copy.
    pub arriving: usize,
}

/// Displacement and velocity that an effect acts on, with their extents.
pub(super) struct Coordinate {
    pub q: E,
    pub p: E,
    pub displacement: Extent,
    pub velocity: Extent,
    /// Where it acts, in words.
    pub place: &'static str,
}

impl Scene {
    /// Across the joint, or from the mass to the ground.
    pub(super) fn coordinate(&self, ground: bool) -> Coordinate {
        let Motion { x: dx, v: dv, r, w, .. } = self.motion;
        match self.drive {
            Drive::Base if ground => {
                Coordinate { q: x(), p: v(), displacement: dx, velocity: dv, place: "to the ground" }
            }
            Drive::Base => Coordinate {
                q: x() - u(self.arriving),
                p: v() - du(self.arriving),
                displacement: r,
                velocity: w,
                place: "across the joint",
            },
            Drive::Force | Drive::None => {
                Coordinate { q: x(), p: v(), displacement: dx, velocity: dv, place: "between mass and ground" }
            }
        }
    }

    /// Acceleration of the linear plant that nothing is hidden in.
    pub(super) fn base(&self) -> E {
        let Coordinate { q, p, .. } = self.coordinate(false);
        let restoring = -q - p * self.damping;
        match self.drive {
            Drive::Force => restoring + u(0),
            Drive::Base | Drive::None => restoring,
        }
    }
}

/// Numbers from 0 to 1 that an effect's parameters are made of: the same in every round of its calibration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dice(pub [f64; 6]);

impl Dice {
    /// Evenly between two bounds.
    pub(super) fn between(&self, die: usize, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0[die]
    }

    /// Evenly in the logarithm.
    pub(super) fn ratio(&self, die: usize, low: f64, high: f64) -> f64 {
        (low.ln() + (high / low).ln() * self.0[die]).exp()
    }

    /// −1 or 1.
    pub(super) fn sign(&self, die: usize) -> f64 {
        if self.0[die] < 0.5 { -1.0 } else { 1.0 }
    }

    pub(super) fn heads(&self, die: usize) -> bool {
        self.0[die] < 0.5
    }
}
