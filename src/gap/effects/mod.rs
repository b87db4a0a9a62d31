//! The catalogue of effects that a vibration test can hide: one entry an effect, one file a family.
//!
//! An entry says in terms what the effect adds to the acceleration, which inner quantities it has and where to search
//! for them, and which signs are physical. Nothing else in the program knows one effect from another by name.

mod damping;
mod forcing;
mod friction;
mod memory;
mod sensing;
mod stiffness;

use std::fmt::Write as _;
use std::sync::Arc;

use crate::model::Equation;
use crate::term::Term;

/// What the catalogue needs to know of the data and of the base model.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    /// The input moves the base (a displacement), and the spring acts on `x − u`.
    pub(crate) base_excited: bool,
    /// The input may be a motion of the base or a force.
    pub(crate) input_open: bool,
    /// There is an input.
    pub(crate) has_input: bool,
    /// The present model's terms.
    pub(crate) terms: Vec<Term>,
    /// Unit of displacement; empty if unknown.
    pub(crate) unit: String,
    /// Largest magnitude of `x`, and of `x − u` where the base moves.
    pub(crate) reach: [f64; 2],
    /// Largest magnitude of `v`, and of `v − du`.
    pub(crate) speed: [f64; 2],
    /// Largest magnitude of the input.
    pub(crate) input: f64,
    /// Standard deviation of the noise of the velocity along the estimated motion.
    pub(crate) speed_noise: f64,
    /// Main frequency of the motion, Hz.
    pub(crate) frequency: f64,
    /// Frequencies that stand out in the missing force, Hz.
    pub(crate) lines: Vec<f64>,
    /// Those in its product with the displacement: at what a pulsating spring would pulsate.
    pub(crate) pulsations: Vec<f64>,
    /// Sampling interval, s: what is faster cannot be seen.
    pub(crate) interval: f64,
    /// Largest magnitude of what the sensor shows, and how often that is the displacement's derivative.
    pub(crate) measured: f64,
    pub(crate) derivatives: usize,
}

/// Which sign of a coefficient is physical.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sign {
    /// Against the motion or the displacement: it dissipates or restores.
    Against,
    /// Along: a mass, which pulls with what it carries.
    Along,
    /// Either.
    Any,
}

impl Sign {
    /// The values that a coefficient may have.
    pub(crate) fn range(self) -> (f64, f64) {
        match self {
            Self::Against => (f64::NEG_INFINITY, 0.0),
            Self::Along => (0.0, f64::INFINITY),
            Self::Any => (f64::NEG_INFINITY, f64::INFINITY),
        }
    }

    /// True if a coefficient acts the wrong way round.
    pub(crate) fn forbids(self, value: f64) -> bool {
        let (low, high) = self.range();
        !(low..=high).contains(&value)
    }
}

/// A coefficient that the effect adds.
#[derive(Clone, Debug)]
pub(crate) struct Coefficient {
    /// Its usual symbol; the quantity shown is the coefficient times −1 where the sign is `Against`.
    pub(crate) name: &'static str,
    /// Powers of length and of time in its unit.
    pub(crate) dimension: (i32, i32),
    /// Its physical sign.
    pub(crate) sign: Sign,
}

/// A quantity inside a term: a gap, a velocity, a time constant.
#[derive(Clone, Debug)]
pub(crate) struct Inner {
    /// Its usual symbol.
    pub(crate) name: &'static str,
    /// Powers of length and of time in its unit.
    pub(crate) dimension: (i32, i32),
    /// Values that the screen tries.
    pub(crate) grid: Vec<f64>,
    /// Values beyond these are not this effect.
    pub(crate) bounds: (f64, f64),
    /// The response jumps where it passes certain values: each at which a stop begins or ends.
    pub(crate) jumps: bool,
}

/// What an effect adds to a model at given inner values.
#[derive(Clone, Debug, Default)]
pub(crate) struct Addition {
    /// Terms of the acceleration, each with a coefficient to be fitted.
    pub(crate) terms: Vec<Term>,
    /// Equations of its own internal states, called `z` or `z1, z2` in its terms.
    pub(crate) internals: Vec<Equation>,
    /// Terms of the model that it replaces.
    pub(crate) replaces: Vec<Term>,
    /// The input acts later by this, s.
    pub(crate) delay: f64,
    /// The input acts only within ± this.
    pub(crate) input_limit: Option<f64>,
    /// Static over sliding friction.
    pub(crate) static_ratio: Option<f64>,
    /// The sensor shows only ± this.
    pub(crate) ceiling: Option<f64>,
    /// Each record's sensor has an offset.
    pub(crate) offset: bool,
}

type Build = Arc<dyn Fn(&[f64]) -> Addition + Send + Sync>;

/// An effect in one of its forms.
#[derive(Clone)]
pub(crate) struct Form {
    /// The effect's name in the interface.
    pub(crate) effect: &'static str,
    /// Its name for people.
    pub(crate) title: &'static str,
    /// What it is, in plain words.
    pub(crate) explanation: &'static str,
    /// What an experiment needs to show it apart from others.
    pub(crate) separates: &'static str,
    /// Which form: `to ground`, `in the joint`; empty if there is one.
    pub(crate) form: &'static str,
    /// Coefficients of the terms, in their order.
    pub(crate) coefficients: Vec<Coefficient>,
    /// Inner quantities.
    pub(crate) inner: Vec<Inner>,
    /// The effects that it contains as special or limiting cases: where they do as well, they are preferred.
    pub(crate) contains: &'static [&'static str],
    /// What its force is drawn over.
    pub(crate) axis: Axis,
    build: Build,
}

/// The quantity that a force is drawn over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    /// Displacement, or that across the joint.
    Displacement { joint: bool },
    /// Velocity, or that across the joint.
    Velocity { joint: bool },
    /// The input.
    Input,
    /// Time.
    Time,
}

impl std::fmt::Debug for Form {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.effect, self.form)
    }
}

impl Form {
    /// What it adds at these inner values.
    pub(crate) fn addition(&self, inner: &[f64]) -> Addition {
        (self.build)(inner)
    }

    /// Every combination of the inner grids.
    pub(crate) fn grid(&self) -> Vec<Vec<f64>> {
        self.inner.iter().fold(vec![Vec::new()], |points, inner| {
            points.iter().flat_map(|p| inner.grid.iter().map(|v| p.iter().copied().chain([*v]).collect())).collect()
        })
    }

    /// True if it neither has a force of its own that could be regressed on nor changes what the input does.
    pub(crate) fn is_outside(&self) -> bool {
        self.coefficients.is_empty() && !self.rewrites_input() && !self.sample().offset
    }

    /// True if it acts through the terms of the input that are there.
    pub(crate) fn rewrites_input(&self) -> bool {
        let addition = self.sample();
        addition.input_limit.is_some() || addition.delay != 0.0
    }

    /// True if it does to a linear spring what a shifted zero does; `constant` alone is asked where the sensor's is free already.
    pub(crate) fn moves_the_zero(&self, constant: bool) -> bool {
        let addition = self.sample();
        let steady = matches!(addition.terms.as_slice(), [term] if term.as_str() == "1");
        steady || (addition.offset && !constant)
    }

    /// True if it is the sensor's zero.
    pub(crate) fn is_offset(&self) -> bool {
        self.sample().offset
    }

    /// What it adds at the first point of its grid.
    fn sample(&self) -> Addition {
        self.addition(&self.inner.iter().filter_map(|i| i.grid.first().copied()).collect::<Vec<f64>>())
    }

    /// True if one of two forms is a kind of the other, or both are kinds of one effect.
    pub(crate) fn is_kin(&self, other: &Self) -> bool {
        self.effect == other.effect || self.contains.contains(&other.effect) || other.contains.contains(&self.effect)
    }

    /// True if the other is a special case of it at the same place. A sensor's zero, free in each record, is more than a force.
    pub(crate) fn is_richer_kind_of(&self, other: &Self) -> bool {
        self.contains.contains(&other.effect) && self.form == other.form && !self.sample().offset
    }

    /// The name with the form behind it.
    pub(crate) fn full_title(&self) -> String {
        if self.form.is_empty() { self.title.to_owned() } else { format!("{}, {}", self.title, self.form) }
    }
}

/// Every effect in every form that makes sense for the data and the present model.
pub(crate) fn catalogue(setting: &Setting) -> Vec<Form> {
    let mut forms = Vec::new();
    friction::add(setting, &mut forms);
    damping::add(setting, &mut forms);
    stiffness::add(setting, &mut forms);
    memory::add(setting, &mut forms);
    forcing::add(setting, &mut forms);
    sensing::add(setting, &mut forms);
    forms
}

/// The unit of a quantity of these powers of length and time.
pub(crate) fn unit(length: &str, (l, t): (i32, i32)) -> String {
    let mut out = String::new();
    let mut part = |name: &str, power: i32| {
        if power != 0 && !name.is_empty() {
            if !out.is_empty() {
                out.push(' ');
            }
            out.push_str(name);
            if power != 1 {
                let _ = write!(out, "^{power}");
            }
        }
    };
    part(length, l);
    part("s", t);
    // The interface writes accelerations as a fraction.
    match (l, t) {
        (1, _) if t < 0 && !length.is_empty() => {
            format!("{length}/s{}", if t < -1 { format!("^{}", -t) } else { String::new() })
        }
        _ => out,
    }
}

/// Where a term of position or velocity acts.
#[derive(Clone, Copy)]
struct Frame {
    form: &'static str,
    joint: bool,
    /// Displacement and velocity as text.
    r: &'static str,
    w: &'static str,
}

const GROUND: Frame = Frame { form: "to ground", joint: false, r: "x", w: "v" };
const JOINT: Frame = Frame { form: "in the joint", joint: true, r: "(x-u)", w: "(v-du)" };
const ALONE: Frame = Frame { form: "", joint: false, r: "x", w: "v" };

impl Setting {
    /// To ground and in the joint where the base moves, else the one there is.
    fn frames(&self) -> &'static [Frame] {
        if self.base_excited { &[GROUND, JOINT] } else { &[ALONE] }
    }

    /// The frame in which the spring acts.
    fn spring(&self) -> Frame {
        if self.base_excited { Frame { form: "", ..JOINT } } else { ALONE }
    }

    fn reach(&self, frame: Frame) -> f64 {
        self.reach[usize::from(frame.joint)]
    }

    fn speed(&self, frame: Frame) -> f64 {
        self.speed[usize::from(frame.joint)]
    }

    fn has(&self, term: &Term) -> bool {
        self.terms.contains(term)
    }
}

/// A term written with the frame's displacement for `R` and velocity for `W`.
fn term(text: &str, frame: Frame) -> Term {
    known(&text.replace('R', frame.r).replace('W', frame.w))
}

/// A term of the catalogue itself.
fn known(text: &str) -> Term {
    Term::parse(text).unwrap_or_else(|error| unreachable!("the catalogue's own terms are well formed: {error}"))
}

fn shared(f: impl Fn(&[f64]) -> Addition + Send + Sync + 'static) -> Build {
    Arc::new(f)
}

/// The build of terms without inner quantities.
fn fixed(terms: Vec<Term>) -> Build {
    shared(move |_| Addition { terms: terms.clone(), ..Addition::default() })
}

/// `count` values from one to another, evenly spaced in their logarithm.
pub(super) fn logarithmic(from: f64, to: f64, count: usize) -> Vec<f64> {
    let step = (to / from).ln() / (count.max(2) - 1) as f64;
    (0..count).map(|k| from * (step * k as f64).exp()).collect()
}

/// `count` values from one to another, evenly spaced.
fn even(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| from + (to - from) * k as f64 / (count.max(2) - 1) as f64).collect()
}

const fn coefficient(name: &'static str, length: i32, time: i32, sign: Sign) -> Coefficient {
    Coefficient { name, dimension: (length, time), sign }
}
