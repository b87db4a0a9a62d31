//! What an effect is fitted into: the plant without it, the size of its motion, and the numbers drawn for it.
//!
//! Everything here is without units: lengths over the amplitude scale, times over 1/ω₀. So the stiffness over mass is 1
//! and the natural period 2π, and one tolerance of integration is right from micrometres to metres.

use super::quantities::{du, state, u, v, x};
use sindyscope_values::term::{Expression, Term};

/// How far a quantity goes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Magnitude {
    /// Its largest magnitude.
    pub peak: f64,
    /// Its root mean square.
    pub rms: f64,
}

impl Magnitude {
    pub(super) fn over(values: impl Iterator<Item = f64>) -> Self {
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
pub(super) struct MotionSize {
    /// Displacement.
    pub x: Magnitude,
    /// Velocity.
    pub v: Magnitude,
    /// Displacement over the base.
    pub r: Magnitude,
    /// Velocity over the base.
    pub w: Magnitude,
    /// Input.
    pub u: Magnitude,
}

/// How the plant is driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DriveKind {
    /// The base moves.
    Base,
    /// A force acts.
    Force,
    /// Nothing does: free decay.
    None,
}

/// A force that follows a reference by what the displacement sensor shows: proportional to the distance and to its rate, which
/// is the sensor's through a filter of first order. Inputs 0 and 1 of the plant are the reference and the sensor's noise,
/// state 2 is the filter's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Control {
    /// Force over mass and distance.
    pub proportional: f64,
    /// Force over mass and rate of the distance.
    pub derivative: f64,
    /// Time constant of the filter.
    pub filter: f64,
}

impl Control {
    fn seen() -> Expression {
        x() + u(1)
    }

    /// Rate of what the sensor shows.
    pub(super) fn filtered_rate(&self) -> Expression {
        (Self::seen() - state(2)) * (1.0 / self.filter)
    }

    pub(super) fn force(&self) -> Expression {
        (u(0) - Self::seen()) * self.proportional + (du(0) - self.filtered_rate()) * self.derivative
    }
}

/// What an effect is fitted into.
#[derive(Clone, Debug)]
pub(super) struct HostPlant {
    /// False for a mass that no spring holds.
    pub sprung: bool,
    /// Stiffness over mass, and acceleration that a unit of a measured force gives: 1 unless the plant has units.
    pub stiffness: f64,
    pub mobility: f64,
    /// Viscous damping over mass, 2ζ; negative where the motion excites itself.
    pub damping: f64,
    /// True if the damper's other end does not move with the base.
    pub grounded_damper: bool,
    /// Cubic stiffness over mass that is known, not hidden.
    pub cubic: f64,
    /// Where the sensor shows zero, over the spring's rest; none where it is at rest itself.
    pub datum: Option<f64>,
    pub control: Option<Control>,
    pub drive: DriveKind,
    /// The time at which the records begin.
    pub origin: f64,
    /// The duration of a fitted record.
    pub length: f64,
    pub motion: MotionSize,
    /// Where the effect's own states begin.
    pub first_state: usize,
    /// The input that reaches the plant: the measured one, or its delayed copy.
    pub arriving: usize,
}

/// Displacement and velocity that an effect acts on, with their extents.
pub(super) struct Deflection {
    pub q: Expression,
    pub p: Expression,
    pub displacement: Magnitude,
    pub velocity: Magnitude,
    /// Where it acts, in words.
    pub place: &'static str,
}

impl HostPlant {
    /// Across the joint, or from the mass to the ground.
    pub(super) fn coordinate(&self, ground: bool) -> Deflection {
        let MotionSize { x: dx, v: dv, r, w, .. } = self.motion;
        match self.drive {
            DriveKind::Base if ground => {
                Deflection { q: x(), p: v(), displacement: dx, velocity: dv, place: "to the ground" }
            }
            DriveKind::Base => Deflection {
                q: x() - u(self.arriving),
                p: v() - du(self.arriving),
                displacement: r,
                velocity: w,
                place: "across the joint",
            },
            DriveKind::Force | DriveKind::None => {
                Deflection { q: x(), p: v(), displacement: dx, velocity: dv, place: "between mass and ground" }
            }
        }
    }

    /// A linear spring and damper without anything else yet.
    pub(super) fn linear(damping: f64, drive: DriveKind, origin: f64, length: f64) -> Self {
        Self {
            sprung: true,
            stiffness: 1.0,
            mobility: 1.0,
            damping,
            grounded_damper: false,
            cubic: 0.0,
            datum: None,
            control: None,
            drive,
            origin,
            length,
            motion: MotionSize::default(),
            first_state: 0,
            arriving: 0,
        }
    }

    /// Acceleration of the plant that nothing is hidden in.
    pub(super) fn base(&self) -> Expression {
        let Deflection { q, p, .. } = self.coordinate(false);
        let damper = if self.grounded_damper { v() } else { p };
        let linear = -q.clone() * self.stiffness;
        let stiff = if self.cubic > 0.0 { linear - q.power(3.0) * self.cubic } else { linear };
        let restoring = if self.sprung { stiff - damper * self.damping } else { -(damper * self.damping) };
        match (self.drive, self.control) {
            (DriveKind::Force, Some(control)) => restoring + control.force(),
            (DriveKind::Force, None) => restoring + u(0) * self.mobility,
            (DriveKind::Base | DriveKind::None, _) => restoring,
        }
    }

    /// Terms of that plant, in the coordinates of the records; none where it is the spring, damper and input that everyone
    /// would begin with.
    pub(super) fn base_terms(&self) -> Option<Vec<Term>> {
        let usual = self.sprung && !self.grounded_damper && self.cubic <= 0.0 && self.datum.is_none();
        if usual {
            return None;
        }
        let (q, p) = if self.drive == DriveKind::Base { ("x-u", "v-du") } else { ("x", "v") };
        let list = [
            (self.datum.is_some(), "1".to_owned()),
            (self.sprung, q.to_owned()),
            (true, if self.grounded_damper { "v" } else { p }.to_owned()),
            (self.cubic > 0.0, format!("({q})^3")),
            (self.drive == DriveKind::Force, "u".to_owned()),
        ];
        Some(list.iter().filter(|(there, _)| *there).filter_map(|(_, text)| Term::parse(text).ok()).collect())
    }

    /// States before those of effects: displacement, velocity, and the control's.
    pub(super) fn own_states(&self) -> usize {
        if self.control.is_some() { 3 } else { 2 }
    }
}

/// Numbers from 0 to 1 that an effect's parameters are made of, the same in every round of its calibration, and parameters
/// that are given instead.
#[derive(Clone, Debug)]
pub(super) struct Draws {
    pub uniforms: [f64; 6],
    given: Vec<(String, f64)>,
}

impl Draws {
    pub(super) fn new(uniforms: [f64; 6]) -> Self {
        Self { uniforms, given: Vec::new() }
    }

    /// The same with parameters given by name, in the plant's units.
    pub(super) fn giving(self, given: Vec<(String, f64)>) -> Self {
        Self { given, ..self }
    }

    /// A parameter that is given.
    pub(super) fn given(&self, name: &str) -> Option<f64> {
        self.given.iter().find(|(given, _)| given == name).map(|(_, value)| *value)
    }

    /// A parameter: the value given, or else the one drawn.
    pub(super) fn value(&self, name: &str, drawn: f64) -> f64 {
        self.given(name).unwrap_or(drawn)
    }

    /// Evenly between two bounds.
    pub(super) fn between(&self, die: usize, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniforms[die]
    }

    /// Evenly in the logarithm.
    pub(super) fn ratio(&self, die: usize, low: f64, high: f64) -> f64 {
        (low.ln() + (high / low).ln() * self.uniforms[die]).exp()
    }

    /// −1 or 1.
    pub(super) fn sign(&self, die: usize) -> f64 {
        if self.uniforms[die] < 0.5 { -1.0 } else { 1.0 }
    }

    pub(super) fn coin(&self, die: usize) -> bool {
        self.uniforms[die] < 0.5
    }
}
