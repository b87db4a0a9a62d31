//! The catalogue of effects that a vibration test can hide: one entry an effect, one file a family.
//!
//! An entry says in terms what the effect adds to the acceleration, which inner quantities it has and where to search
//! for them, and which signs are physical. Nothing else in the program knows one effect from another by name.

mod damping;
mod description;
#[cfg(test)]
pub(crate) mod example;
mod forcing;
mod friction;
mod memory;
mod own;
mod sensing;
mod stiffness;

use std::fmt::Write as _;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

pub use description::DESCRIPTION;
pub(crate) use description::described;
pub use memory::hysteresis_rate;
pub(crate) use own::own;
pub use own::{OwnEffect, OwnError, OwnPart, OwnQuantity, OwnSign, OwnState, OwnTerm};

use super::site::{Placed, Site};
use sindyscope_core::simulate::Delays;
use sindyscope_values::model::Equation;
use sindyscope_values::term::{Expression, Function, Symbol, Term};

/// What the catalogue needs to know of the data and of the base model.
#[derive(Clone, Debug)]
pub(crate) struct EffectSetting {
    /// The first input moves the base (a displacement), and the spring acts on `x − u`.
    pub(crate) base_excited: bool,
    /// The base model's dampers cannot push.
    pub(crate) passive: bool,
    /// The input may be a motion of the base or a force.
    pub(crate) input_open: bool,
    /// Largest magnitude of each input; nothing of one that does not drive the motion.
    pub(crate) inputs: Vec<f64>,
    /// Where forces may act.
    pub(crate) frames: Vec<Frame>,
    /// The present model's terms.
    pub(crate) terms: Vec<Placed>,
    /// Unit of displacement; empty if unknown.
    pub(crate) unit: String,
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
pub(crate) enum Direction {
    /// Against the motion or the displacement: it dissipates or restores.
    Against,
    /// Along: a mass, which pulls with what it carries.
    Along,
    /// Either.
    Any,
}

impl Direction {
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
    /// Its usual symbol.
    pub(crate) name: String,
    /// Powers of length and of time in its unit.
    pub(crate) dimension: (i32, i32),
    /// Its unit, where it is said in words.
    pub(crate) unit: Option<&'static str>,
    /// Its physical sign.
    pub(crate) sign: Direction,
    /// Of either sign, it counts as a spring counts: positive where it restores.
    pub(crate) restoring: bool,
    /// It acts on the second mass of a joint, the other way round than on the first.
    pub(crate) mirrored: bool,
}

impl Coefficient {
    /// The named quantity that a value of the term's coefficient means, by the textbook's signs.
    ///
    /// The equation of motion is written `x″ = …`, in which whatever resists stands with a minus: `x″ = −c v − k₃ x³ + b`. A
    /// spring, damper or friction is therefore minus its term's coefficient, whether it can have one sign or both (a hardening
    /// spring is positive), and a force, a mass or the gain of an input is the coefficient itself. On the second mass of a
    /// joint the signs of the terms are the other way round.
    pub(crate) fn shown(&self, value: f64) -> f64 {
        let resists = match self.sign {
            Direction::Against => true,
            Direction::Along => false,
            Direction::Any => self.restoring != self.mirrored,
        };
        if resists { -value } else { value }
    }

    /// The same of one mass of a joint, counted from zero.
    fn of(&self, mass: usize, mirrored: bool) -> Self {
        let sign = match (self.sign, mirrored) {
            (Direction::Against, true) => Direction::Along,
            (Direction::Along, true) => Direction::Against,
            (sign, _) => sign,
        };
        Self { name: format!("{},{}", self.name, mass + 1), sign, mirrored, ..*self }
    }
}

/// A quantity inside a term: a gap, a velocity, a time constant.
#[derive(Clone, Debug)]
pub(crate) struct Inner {
    /// Its usual symbol.
    pub(crate) name: &'static str,
    /// Powers of length and of time in its unit.
    pub(crate) dimension: (i32, i32),
    /// Its unit, where it is said in words.
    pub(crate) unit: Option<&'static str>,
    /// The input in whose unit it counts instead.
    pub(crate) of_input: Option<usize>,
    /// Values that the screen tries.
    pub(crate) grid: Vec<f64>,
    /// Values beyond these are not this effect.
    pub(crate) bounds: (f64, f64),
    /// The response jumps where it passes certain values: each at which a stop begins or ends.
    pub(crate) jumps: bool,
    /// The values at which the effect is a simpler one that it contains.
    pub(crate) simple: &'static [f64],
}

impl Inner {
    fn new(name: &'static str, dimension: (i32, i32), grid: Vec<f64>, bounds: (f64, f64)) -> Self {
        Self { name, dimension, unit: None, of_input: None, grid, bounds, jumps: false, simple: &[] }
    }
}

/// What an effect adds to a model at given inner values.
#[derive(Clone, Debug)]
pub(crate) struct Addition<T = Placed> {
    /// Terms of accelerations, each with a coefficient to be fitted.
    pub(crate) terms: Vec<T>,
    /// Equations of its own internal states, called `z` or `z1, z2` in its terms.
    pub(crate) internals: Vec<Equation>,
    /// Terms of the model that it replaces.
    pub(crate) replaces: Vec<T>,
    /// How much later inputs act than they were measured.
    pub(crate) delays: Delays,
    /// An input that acts only within ± a limit.
    pub(crate) input_limit: Option<(usize, f64)>,
    /// Static over sliding friction.
    pub(crate) static_ratio: Option<f64>,
    /// The sensor shows only ± this.
    pub(crate) ceiling: Option<f64>,
    /// Each record's sensor has an offset.
    pub(crate) offset: bool,
}

impl<T> Default for Addition<T> {
    fn default() -> Self {
        Self {
            terms: Vec::new(),
            internals: Vec::new(),
            replaces: Vec::new(),
            delays: Delays::default(),
            input_limit: None,
            static_ratio: None,
            ceiling: None,
            offset: false,
        }
    }
}

/// An effect that is one term without inner quantities, as the catalogue says it; fields as those of [`Form`].
struct OneTerm {
    effect: &'static str,
    title: &'static str,
    explanation: &'static str,
    separates: &'static str,
    formula: &'static str,
    force: Expression,
    coefficient: Coefficient,
    axis: ForceAxis,
}

/// What an effect adds to the equation of the mass that it acts on.
type Build = Arc<dyn Fn(&[f64]) -> Addition<Term> + Send + Sync>;

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
    /// What it adds to the acceleration, in LaTeX: `r` and `w` are displacement and velocity across its place.
    pub(crate) formula: &'static str,
    /// Which form: `to ground`, `between masses 1 and 2`; empty if there is one.
    pub(crate) form: String,
    /// Where it acts; none of the input and of the sensor.
    pub(crate) site: Option<Site>,
    /// Coefficients of the terms, in their order; a joint has two for each, one a mass.
    pub(crate) coefficients: Vec<Coefficient>,
    /// Inner quantities.
    pub(crate) inner: Vec<Inner>,
    /// The effects that it contains as special or limiting cases: where they do as well, they are preferred.
    pub(crate) contains: &'static [&'static str],
    /// What its force is drawn over.
    pub(crate) axis: ForceAxis,
    build: Build,
}

/// The quantity that a force is drawn over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum ForceAxis {
    /// The displacement across its site.
    Displacement,
    /// The velocity across its site.
    Velocity,
    /// One of the inputs.
    Input(usize),
    /// Time.
    Time,
}

/// As a project holds it: `displacement`, `input`, `input2`.
impl From<ForceAxis> for String {
    fn from(axis: ForceAxis) -> Self {
        match axis {
            ForceAxis::Displacement => "displacement".into(),
            ForceAxis::Velocity => "velocity".into(),
            ForceAxis::Input(0) => "input".into(),
            ForceAxis::Input(j) => format!("input{}", j + 1),
            ForceAxis::Time => "time".into(),
        }
    }
}

impl TryFrom<String> for ForceAxis {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        match text.as_str() {
            "displacement" => Ok(Self::Displacement),
            "velocity" => Ok(Self::Velocity),
            "time" => Ok(Self::Time),
            other => match other.strip_prefix("input").map(|number| (number.is_empty(), number.parse::<usize>())) {
                Some((true, _)) => Ok(Self::Input(0)),
                Some((false, Ok(number @ 1..))) => Ok(Self::Input(number - 1)),
                _ => Err(format!("`{other}` is nothing that a force is drawn over")),
            },
        }
    }
}

impl std::fmt::Debug for Form {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.effect, self.form)
    }
}

impl Form {
    /// Something without a name that adds what is given: what effects that were fitted have beside their terms.
    pub(super) fn given(addition: Addition<Term>) -> Self {
        Self {
            effect: "",
            title: "",
            explanation: "",
            separates: "",
            formula: "",
            form: String::new(),
            site: None,
            coefficients: Vec::new(),
            inner: Vec::new(),
            contains: &[],
            axis: ForceAxis::Time,
            build: shared(move |_| addition.clone()),
        }
    }

    /// What it adds at these inner values.
    pub(crate) fn addition(&self, inner: &[f64]) -> Addition {
        let Addition { terms, internals, replaces, delays, input_limit, static_ratio, ceiling, offset } =
            (self.build)(inner);
        let (first, second) = self.site.map_or((0, None), Site::masses);
        let placed = |terms: Vec<Term>| -> Vec<Placed> {
            let both = |term: Term| {
                let mirrored = second.map(|mass| Placed { mass, term: term.clone() });
                std::iter::once(Placed { mass: first, term }).chain(mirrored)
            };
            terms.into_iter().flat_map(both).collect()
        };
        let (terms, replaces) = (placed(terms), placed(replaces));
        Addition { terms, internals, replaces, delays, input_limit, static_ratio, ceiling, offset }
    }

    /// True if both act on masses, and not on the same ones.
    pub(crate) fn is_elsewhere(&self, other: &Self) -> bool {
        self.site.zip(other.site).is_some_and(|(a, b)| a.masses() != b.masses())
    }

    /// True if the other is a special or limiting case of it on the same masses.
    pub(crate) fn includes(&self, other: &Self) -> bool {
        let another = self.effect != other.effect || self.form != other.form;
        another && self.contains.contains(&other.effect) && !self.is_elsewhere(other)
    }

    /// Every combination of the inner grids.
    pub(crate) fn grid(&self) -> Vec<Vec<f64>> {
        self.inner.iter().fold(vec![Vec::new()], |points, inner| {
            points.iter().flat_map(|p| inner.grid.iter().map(|v| p.iter().copied().chain([*v]).collect())).collect()
        })
    }

    /// Inner values in the middle of their grids.
    pub(crate) fn middle(&self) -> Vec<f64> {
        self.inner.iter().map(|i| i.grid[i.grid.len() / 2]).collect()
    }

    /// True if it neither has a force of its own that could be regressed on nor changes what the input does.
    pub(crate) fn is_outside(&self) -> bool {
        self.coefficients.is_empty() && !self.rewrites_input() && !self.sample().offset
    }

    /// True if it acts through the terms of the input that are there.
    pub(crate) fn rewrites_input(&self) -> bool {
        let addition = self.sample();
        addition.input_limit.is_some() || !addition.delays.is_none()
    }

    /// True if it does to a linear spring what a shifted zero does; `constant` alone is asked where the sensor's is free already.
    pub(crate) fn moves_the_zero(&self, constant: bool) -> bool {
        let addition = self.sample();
        let steady = matches!(addition.terms.as_slice(), [placed] if placed.term.as_str() == "1");
        steady || (addition.offset && !constant)
    }

    /// True if it is a force over the velocity that a steady one is a special case of: it moves the point that the motion is about.
    pub(crate) fn has_a_mean(&self) -> bool {
        self.axis == ForceAxis::Velocity && self.contains.contains(&"constant_force")
    }

    /// True if its force repeats with every turn of the displacement.
    pub(crate) fn is_periodic(&self) -> bool {
        let sine = |t: &Placed| matches!(t.term.expression(), Expression::Call(Function::Sin, _));
        self.inner.is_empty() && matches!(self.sample().terms.as_slice(), [term] if sine(term))
    }

    /// True if it is one of the effects that are met most often: they are asked for wherever nothing explains the data.
    pub(crate) fn is_common(&self) -> bool {
        COMMON.contains(&self.effect)
    }

    /// True if its force goes by the clock at a frequency of its own.
    pub(crate) fn pulsates(&self) -> bool {
        self.axis == ForceAxis::Time && !self.inner.is_empty()
    }

    /// True if it dissipates more than a damper does as the motion grows: beside it a damper of the base may push.
    pub(crate) fn bounds_a_push(&self) -> bool {
        BOUNDING.contains(&self.effect)
    }

    /// True if it is dry friction, which can hold a mass.
    pub(crate) fn is_dry_friction(&self) -> bool {
        let switches = || self.addition(&self.middle()).terms.iter().any(|t| t.term.switches());
        self.axis == ForceAxis::Velocity && switches()
    }

    /// True if it is the sensor's zero.
    pub(crate) fn is_offset(&self) -> bool {
        self.sample().offset
    }

    /// True if it takes the place of a term of the model.
    pub(crate) fn replaces_a_term(&self) -> bool {
        !self.sample().replaces.is_empty()
    }

    /// What it adds at the first point of its grid.
    fn sample(&self) -> Addition {
        self.addition(&self.inner.iter().filter_map(|i| i.grid.first().copied()).collect::<Vec<f64>>())
    }

    /// True if one of two forms is a kind of the other, or both are kinds of one effect.
    pub(crate) fn is_kin(&self, other: &Self) -> bool {
        !self.is_elsewhere(other) && (self.effect == other.effect || self.includes(other) || other.includes(self))
    }

    /// True if the other's force goes with the same quantity at the same place.
    pub(crate) fn acts_like(&self, other: &Self) -> bool {
        self.site.is_some() && self.site == other.site && self.axis == other.axis
    }

    /// True if its force is a curve over the motion of which quantities of its own set the shape.
    pub(crate) fn is_curve_of_free_shape(&self) -> bool {
        let over_motion = matches!(self.axis, ForceAxis::Displacement | ForceAxis::Velocity);
        over_motion && !self.inner.is_empty() && self.addition(&self.middle()).internals.is_empty()
    }

    /// True if its force has a kink over the motion, as that of a contact.
    pub(crate) fn has_a_kink(&self) -> bool {
        let mut found = false;
        let mut see = |e: &Expression| found |= matches!(e, Expression::Call(Function::Max | Function::DeadZone, _));
        self.addition(&self.middle()).terms.iter().for_each(|t| t.term.expression().visit(&mut see));
        found
    }

    /// True if the other is a special case of it at the same place. A sensor's zero, free in each record, is more than a force.
    pub(crate) fn is_richer_kind_of(&self, other: &Self) -> bool {
        let alike = self.form == other.form || self.effect == other.effect;
        alike && self.includes(other) && !self.sample().offset
    }

    /// The name with the form behind it.
    pub(crate) fn full_title(&self) -> String {
        if self.form.is_empty() { self.title.to_owned() } else { format!("{}, {}", self.title, self.form) }
    }
}

/// True if two of these are curves of free shape over the same quantity at the same place: together they follow any curve.
pub(crate) fn follow_any_curve<'f>(forms: impl IntoIterator<Item = &'f Form>) -> bool {
    let curves: Vec<&Form> = forms.into_iter().filter(|f| f.is_curve_of_free_shape()).collect();
    curves.iter().enumerate().any(|(k, form)| curves[..k].iter().any(|other| form.acts_like(other)))
}

/// Effects that are met most often, none with a quantity inside it.
const COMMON: [&str; 7] = [
    "coulomb_friction",
    "quadratic_damping",
    "cubic_damping",
    "cubic_stiffness",
    "quadratic_stiffness",
    "constant_force",
    "sensor_offset",
];

/// Effects that bound a motion which a damper that pushes keeps going.
const BOUNDING: [&str; 4] =
    ["displacement_dependent_damping", "quadratic_damping", "cubic_damping", "power_law_damping"];

/// A family of effects: its name, and what appends those that make sense for a setting.
type Family = (&'static str, fn(&EffectSetting, &mut Vec<Form>));

/// The families in the catalogue's order.
pub(super) const FAMILIES: [Family; 6] = [
    ("Friction", friction::add),
    ("Damping", damping::add),
    ("Stiffness", stiffness::add),
    ("Forces that remember", memory::add),
    ("Forcing", forcing::add),
    ("Sensors", sensing::add),
];

/// Every effect in every form that makes sense for the data and the present model.
pub(crate) fn catalogue(setting: &EffectSetting) -> Vec<Form> {
    let mut forms = Vec::new();
    for (_, add) in FAMILIES {
        add(setting, &mut forms);
    }
    joined(&mut forms);
    forms
}

/// What acts between two masses acts on both, on each by its own mass.
fn joined(forms: &mut [Form]) {
    for form in forms {
        if let Some(Site::Joint(i, j)) = form.site {
            form.coefficients = form.coefficients.iter().flat_map(|c| [c.of(i, false), c.of(j, true)]).collect();
        }
    }
}

impl Coefficient {
    /// Its unit where displacements are in this one.
    pub(crate) fn unit(&self, length: &str) -> String {
        self.unit.map_or_else(|| unit(length, self.dimension), str::to_owned)
    }
}

impl Inner {
    /// Its unit where displacements are in this one; that of an input is the input's.
    pub(crate) fn unit(&self, length: &str) -> String {
        self.unit.map_or_else(|| unit(length, self.dimension), str::to_owned)
    }
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

/// Where a term of position or velocity acts, and how far and how fast the motion goes there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Frame {
    pub(crate) site: Site,
    /// The place in words; empty where there is no other.
    pub(crate) form: String,
    /// Displacement and velocity.
    r: Expression,
    w: Expression,
    /// Largest magnitudes of both.
    pub(crate) reach: f64,
    pub(crate) speed: f64,
    /// Standard deviation of the noise of that velocity along the estimated motion.
    pub(crate) speed_noise: f64,
    /// The velocity other than zero that is seen most often: that of a surface which carries the mass along.
    pub(crate) usual_speed: Option<f64>,
}

impl Frame {
    /// Every place of a chain of masses, reach and speed left open.
    pub(crate) fn all(masses: usize, base_moves: bool) -> Vec<Self> {
        let across = |of: fn(usize) -> Symbol, base: Symbol, site: Site| match site {
            Site::Ground(i) => Expression::from(of(i)),
            Site::Joint(i, j) => Expression::from(of(i)) - of(j),
            Site::Base(i) => Expression::from(of(i)) - base,
        };
        let words = |site: Site| match site {
            Site::Ground(_) if masses == 1 && !base_moves => String::new(),
            Site::Ground(_) if masses == 1 => "to ground".to_owned(),
            Site::Base(_) if masses == 1 => "in the joint".to_owned(),
            Site::Ground(i) => format!("to ground at mass {}", i + 1),
            Site::Joint(i, j) => format!("between masses {} and {}", i + 1, j + 1),
            Site::Base(i) => format!("to the base at mass {}", i + 1),
        };
        let frame = |site| Self {
            site,
            form: words(site),
            r: across(Symbol::State, Symbol::Input(0), site),
            w: across(Symbol::Rate, Symbol::InputRate(0), site),
            reach: 0.0,
            speed: 0.0,
            speed_noise: 0.0,
            usual_speed: None,
        };
        Site::all(masses, base_moves).into_iter().map(frame).collect()
    }

    /// The displacement across the place.
    fn r(&self) -> Expression {
        self.r.clone()
    }

    /// The velocity across the place.
    fn w(&self) -> Expression {
        self.w.clone()
    }
}

impl EffectSetting {
    /// Every place that a force may act at.
    fn frames(&self) -> &[Frame] {
        &self.frames
    }

    fn masses(&self) -> usize {
        self.frames.iter().filter(|f| matches!(f.site, Site::Ground(_))).count()
    }

    /// The places of springs: of one mass the joint where the base moves, of several every one.
    fn springs(&self) -> Vec<Frame> {
        if self.masses() > 1 {
            return self.frames.clone();
        }
        self.frames.last().map(|f| Frame { form: String::new(), ..f.clone() }).into_iter().collect()
    }

    /// True if the motion of a frame may be that of a pendulum: an angle that reaches so far that its sine differs from it, by 4 %
    /// at half a radian, by 0.04 % at a twentieth.
    fn swings(&self, frame: &Frame, least: f64) -> bool {
        matches!(self.unit.as_str(), "rad" | "") && frame.reach >= least
    }

    /// Each mass by itself.
    fn each_mass(&self) -> Vec<Frame> {
        let alone = self.masses() == 1;
        let grounds = self.frames.iter().filter(|f| matches!(f.site, Site::Ground(_)));
        let named = |(k, f): (usize, &Frame)| {
            let form = if alone { String::new() } else { format!("on mass {}", k + 1) };
            Frame { form, ..f.clone() }
        };
        grounds.enumerate().map(named).collect()
    }

    /// Appends an effect of one term at a place, unless the present model has the term there.
    fn offer(&self, frame: &Frame, one: OneTerm, forms: &mut Vec<Form>) {
        let OneTerm { effect, title, explanation, separates, formula, force, coefficient, axis } = one;
        let term = Term::new(force);
        if self.has(&term, frame.site) {
            return;
        }
        forms.push(Form {
            effect,
            title,
            explanation,
            separates,
            formula,
            form: frame.form.clone(),
            site: Some(frame.site),
            coefficients: vec![coefficient],
            inner: Vec::new(),
            contains: &[],
            axis,
            build: shared(move |_| Addition { terms: vec![term.clone()], ..Addition::default() }),
        });
    }

    /// True if the present model has the term at a place already, by itself or as the sum of its parts.
    fn has(&self, term: &Term, site: Site) -> bool {
        let (first, second) = site.masses();
        let there = |mass: usize, e: &Expression| self.terms.iter().any(|t| t.mass == mass && t.term.expression() == e);
        let part = |mass: usize, e: &Expression| match e {
            Expression::Symbol(_) => there(mass, e),
            Expression::Product(parts) => match parts.as_slice() {
                [Expression::Number(_), symbol @ Expression::Symbol(_)] => there(mass, symbol),
                _ => false,
            },
            _ => false,
        };
        let has = |mass: usize| match term.expression() {
            e if there(mass, e) => true,
            Expression::Sum(parts) => parts.iter().all(|e| part(mass, e)),
            _ => false,
        };
        has(first) && second.is_none_or(has)
    }
}

/// A form's words behind those of its place.
fn with_words(place: &str, words: &str) -> String {
    match (place, words) {
        (place, "") => place.to_owned(),
        ("", words) => words.to_owned(),
        (place, words) => format!("{place}, {words}"),
    }
}

fn shared(f: impl Fn(&[f64]) -> Addition<Term> + Send + Sync + 'static) -> Build {
    Arc::new(f)
}

/// `|q|^p sgn q` of a quantity that reaches one. Below a thousandth of that it is straight: an exponent below one has no slope
/// at zero, and no quantity is measured so finely.
fn odd_power(quantity: Expression, exponent: f64) -> Expression {
    let squares = quantity.clone().power(2.0) + 1e-6;
    quantity * squares.power(0.5 * (exponent - 1.0))
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

fn coefficient(name: &str, length: i32, time: i32, sign: Direction) -> Coefficient {
    Coefficient {
        name: name.to_owned(),
        dimension: (length, time),
        unit: None,
        sign,
        restoring: false,
        mirrored: false,
    }
}

/// A spring's coefficient, which may harden or soften.
fn spring(name: &str, length: i32) -> Coefficient {
    Coefficient { restoring: true, ..coefficient(name, length, -2, Direction::Any) }
}
