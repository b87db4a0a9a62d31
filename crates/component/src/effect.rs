//! What a component can have beside a spring and a damper: one entry an effect.

use sindyscope_values::model::Equation;
use sindyscope_values::term::{Expression, Function, Symbol, Term};

use super::specimen::Specimen;
use sindyscope_search::{Entry, guide, hysteresis_rate};

/// What an effect adds to the force at given inner values; its internal states count from zero.
#[derive(Clone, Debug)]
pub(crate) struct ForceAddition {
    pub(crate) terms: Vec<Term>,
    /// The rates of its internal states.
    pub(crate) internals: Vec<Equation>,
    /// The symbol that each internal state is measured like.
    pub(crate) like: Vec<Symbol>,
}

impl ForceAddition {
    /// Terms without memory.
    pub(crate) fn plain(terms: Vec<Term>) -> Self {
        Self { terms, internals: Vec::new(), like: Vec::new() }
    }
}

/// A coefficient that an effect adds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ForceCoefficient {
    pub(crate) name: &'static str,
    /// It takes energy out: its sign is that of the velocity.
    pub(crate) dissipates: bool,
}

/// What a number inside a term is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum InnerUnit {
    Length,
    Speed,
    Time,
    Plain,
}

/// A quantity inside a term: a gap, a velocity, a time constant.
#[derive(Clone, Debug)]
pub(crate) struct ForceInner {
    pub(crate) name: &'static str,
    pub(crate) unit: InnerUnit,
    /// Values that are tried first.
    pub(crate) grid: Vec<f64>,
    /// Values beyond these are not this effect.
    pub(crate) bounds: (f64, f64),
}

/// Names for people: those of the search's catalogue, and of what an input does to a component.
pub(crate) struct Titles(Vec<Entry>);

impl Titles {
    pub(crate) fn new() -> Self {
        Self(guide())
    }

    /// An effect's name for people.
    pub(crate) fn of(&self, effect: &'static str) -> &'static str {
        match effect {
            "input_dependent_damping" => "Damping that grows with the input",
            "input_dependent_friction" => "Friction that grows with the input",
            _ => self.0.iter().find(|e| e.effect == effect).map_or(effect, |e| e.title),
        }
    }

    /// The same with the form.
    pub(crate) fn of_form(&self, form: &ForceForm) -> String {
        let title = self.of(form.effect);
        if form.form.is_empty() { title.to_owned() } else { format!("{title} ({})", form.form) }
    }
}

type BuildForce = Box<dyn Fn(&[f64]) -> ForceAddition + Send + Sync>;

/// An effect in one of its forms.
pub(crate) struct ForceForm {
    /// The effect's name in the interface.
    pub(crate) effect: &'static str,
    /// Which form; empty for the plain one.
    pub(crate) form: &'static str,
    pub(crate) coefficients: Vec<ForceCoefficient>,
    pub(crate) inner: Vec<ForceInner>,
    /// Effects that are special cases of it, which it stands for where it is in the model.
    pub(crate) contains: &'static [&'static str],
    build: BuildForce,
}

impl ForceForm {
    pub(crate) fn at(&self, inner: &[f64]) -> ForceAddition {
        (self.build)(inner)
    }

    /// Number of values that are fitted.
    pub(crate) fn unknowns(&self) -> usize {
        self.coefficients.len() + self.inner.len()
    }
}

fn x() -> Expression {
    Symbol::State(0).into()
}

fn v() -> Expression {
    Symbol::Rate(0).into()
}

fn z(index: usize) -> Expression {
    Symbol::Internal(index).into()
}

fn tanh(e: Expression) -> Expression {
    Expression::call(Function::Tanh, e)
}

const fn against(name: &'static str) -> ForceCoefficient {
    ForceCoefficient { name, dissipates: true }
}

const fn either(name: &'static str) -> ForceCoefficient {
    ForceCoefficient { name, dissipates: false }
}

fn logarithmic(low: f64, high: f64, count: usize) -> Vec<f64> {
    let step = |k: usize| low * (high / low).powf(k as f64 / (count.max(2) - 1) as f64);
    (0..count).map(step).collect()
}

/// Scales of the motion that inner quantities are sought within.
#[derive(Clone, Copy)]
struct Scales {
    reach: f64,
    speed: f64,
    /// Displacement from one sample to the next at the greatest speed.
    step: f64,
    interval: f64,
    period: f64,
}

/// What the force of a slider follows: its sign, that rounded, or a state that lags it.
#[derive(Clone, Copy)]
enum SlidingElement {
    Sharp,
    Rounded,
    Elastic,
}

impl SlidingElement {
    fn inner(self, scales: Scales) -> Vec<ForceInner> {
        let Scales { reach, speed, step, .. } = scales;
        let least = (0.02 * reach).max(2.0 * step).min(0.3 * reach);
        match self {
            Self::Sharp => Vec::new(),
            Self::Rounded => vec![ForceInner {
                name: "v_s",
                unit: InnerUnit::Speed,
                grid: logarithmic(0.005 * speed, 0.3 * speed, 5),
                bounds: (0.001 * speed, speed),
            }],
            Self::Elastic => vec![
                ForceInner {
                    name: "x_b",
                    unit: InnerUnit::Length,
                    grid: logarithmic(least, 2.0 * reach, 6),
                    bounds: (0.5 * least, 10.0 * reach),
                },
                ForceInner { name: "gamma/beta", unit: InnerUnit::Plain, grid: vec![0.1, 1.0], bounds: (-4.0, 10.0) },
            ],
        }
    }

    /// The function of the motion, and the equation of the state `z` of this index where there is one.
    fn made(self, inner: &[f64], state: usize) -> (Expression, Option<Equation>) {
        match self {
            Self::Sharp => (v().sgn(), None),
            Self::Rounded => (tanh(v() * inner[0].recip()), None),
            Self::Elastic => (z(state), Some(bouc_wen(inner[0], inner[1], 1, state))),
        }
    }
}

/// The inner state of a hysteresis, as the catalogue of masses has it.
fn bouc_wen(length: f64, ratio: f64, power: i32, state: usize) -> Equation {
    Equation::known(hysteresis_rate(&v(), &z(state), [length, ratio], power))
}

/// Every effect that a component's records can show.
pub(crate) fn catalogue(specimen: &Specimen) -> Vec<ForceForm> {
    let speed = specimen.reach(|p| &p.motion[1]);
    let interval = specimen.paths.iter().map(|p| p.interval).fold(0.0, f64::max);
    let scales = Scales {
        reach: specimen.reach(|p| &p.motion[0]),
        speed,
        step: speed * interval,
        interval,
        period: specimen.period,
    };
    let mut forms = Vec::new();
    springs(scales, &mut forms);
    dampers(scales, &mut forms);
    memory(scales, &mut forms);
    for j in 0..specimen.layout.inputs {
        inputs(scales, j, &mut forms);
    }
    forms
}

/// An effect of one term without inner quantities.
fn plain(effect: &'static str, coefficient: ForceCoefficient, force: Expression) -> ForceForm {
    ForceForm {
        effect,
        form: "",
        coefficients: vec![coefficient],
        inner: Vec::new(),
        contains: &[],
        build: Box::new(move |_| ForceAddition::plain(vec![Term::new(force.clone())])),
    }
}

fn springs(scales: Scales, forms: &mut Vec<ForceForm>) {
    let reach = scales.reach;
    forms.push(plain("quadratic_stiffness", either("k_2"), x().power(2.0)));
    forms.push(plain("cubic_stiffness", either("k_3"), x().power(3.0)));
    forms.push(plain("quintic_stiffness", either("k_5"), x().power(5.0)));
    forms.push(plain("bilinear_stiffness", either("k_+"), x().max(0.0)));
    let gap = |low: f64| ForceInner {
        name: "d",
        unit: InnerUnit::Length,
        grid: (1..9).map(|k| reach * (low + (0.95 - low) * f64::from(k) / 9.0)).collect(),
        bounds: (reach * low, 0.98 * reach),
    };
    forms.push(ForceForm {
        effect: "clearance",
        form: "",
        coefficients: vec![either("k_c")],
        inner: vec![gap(0.02)],
        contains: &[],
        build: Box::new(|d| ForceAddition::plain(vec![Term::new(x().dead_zone(d[0]))])),
    });
    forms.push(ForceForm {
        effect: "one_sided_stop",
        form: "",
        coefficients: vec![either("k_s")],
        inner: vec![gap(-0.9)],
        contains: &["bilinear_stiffness"],
        build: Box::new(|d| ForceAddition::plain(vec![Term::new((x() - d[0]).max(0.0))])),
    });
}

fn dampers(scales: Scales, forms: &mut Vec<ForceForm>) {
    let speed = scales.speed;
    forms.push(plain("coulomb_friction", against("F_c"), v().sgn()));
    forms.push(ForceForm {
        effect: "coulomb_friction",
        form: "rounded",
        coefficients: vec![against("F_c")],
        inner: SlidingElement::Rounded.inner(scales),
        contains: &[],
        build: Box::new(|inner| {
            let (force, _) = SlidingElement::Rounded.made(inner, 0);
            ForceAddition::plain(vec![Term::new(force)])
        }),
    });
    forms.push(plain("quadratic_damping", against("c_2"), v() * v().abs()));
    forms.push(plain("cubic_damping", against("c_3"), v().power(3.0)));
    forms.push(plain("bilinear_damping", either("c_+"), v().max(0.0)));
    let depends = x().power(2.0) * v();
    forms.push(plain("displacement_dependent_damping", either("c_x"), depends));
    let grows = x().abs() * v().sgn();
    forms.push(plain("position_dependent_friction", either("h"), grows));
    forms.push(ForceForm {
        effect: "power_law_damping",
        form: "",
        coefficients: vec![against("c_p")],
        inner: vec![ForceInner {
            name: "p",
            unit: InnerUnit::Plain,
            grid: vec![0.2, 0.4, 0.6, 0.8, 1.3, 1.7, 2.5],
            bounds: (0.05, 5.0),
        }],
        contains: &["coulomb_friction", "quadratic_damping", "cubic_damping"],
        build: Box::new(|p| {
            let force = v().abs().power(p[0]) * v().sgn();
            ForceAddition::plain(vec![Term::new(force)])
        }),
    });
    forms.push(ForceForm {
        effect: "stribeck_friction",
        form: "",
        coefficients: vec![against("F_c"), either("F_s - F_c")],
        inner: vec![ForceInner {
            name: "v_s",
            unit: InnerUnit::Speed,
            grid: logarithmic(0.02 * speed, 0.5 * speed, 6),
            bounds: (0.01 * speed, 0.9 * speed),
        }],
        contains: &["coulomb_friction"],
        build: Box::new(|inner| {
            let falling = (-(v() * inner[0].recip()).power(2.0)).exp();
            ForceAddition::plain(vec![Term::new(v().sgn()), Term::new(v().sgn() * falling)])
        }),
    });
}

fn memory(scales: Scales, forms: &mut Vec<ForceForm>) {
    for (form, power) in [("", 1), ("rounder", 2)] {
        forms.push(ForceForm {
            effect: "bouc_wen_hysteresis",
            form,
            coefficients: vec![against("k_h")],
            inner: SlidingElement::Elastic.inner(scales),
            contains: &["coulomb_friction"],
            build: Box::new(move |inner| ForceAddition {
                terms: vec![Term::new(z(0))],
                internals: vec![bouc_wen(inner[0], inner[1], power, 0)],
                like: vec![Symbol::State(0)],
            }),
        });
    }
    let slowest = 3.0 * scales.period;
    forms.push(ForceForm {
        effect: "viscoelastic_relaxation",
        form: "",
        coefficients: vec![against("k_v")],
        inner: vec![ForceInner {
            name: "tau",
            unit: InnerUnit::Time,
            grid: logarithmic((slowest / 200.0).max(2.0 * scales.interval), slowest, 8),
            bounds: (scales.interval, 4.0 * slowest),
        }],
        contains: &[],
        build: Box::new(|inner| ForceAddition {
            terms: vec![Term::new(z(0))],
            internals: vec![Equation::known([(Term::new(v()), 1.0), (Term::new(z(0)), -inner[0].recip())])],
            like: vec![Symbol::State(0)],
        }),
    });
}

/// Effects of an input beside the motion, such as the voltage of a controlled damper.
fn inputs(scales: Scales, j: usize, forms: &mut Vec<ForceForm>) {
    let u = || Expression::from(Symbol::Input(j));
    forms.push(plain("input_squared", either("b_2"), u().power(2.0)));
    forms.push(plain("state_dependent_input", either("k_u"), x() * u()));
    forms.push(plain("input_dependent_damping", either("c_u"), v() * u()));
    let slowest = scales.period;
    let lag = || ForceInner {
        name: "tau",
        unit: InnerUnit::Time,
        grid: logarithmic((slowest / 50.0).max(2.0 * scales.interval), slowest, 3),
        bounds: (scales.interval, 10.0 * slowest),
    };
    for (form, slider, lagging) in [
        ("", SlidingElement::Sharp, false),
        ("rounded", SlidingElement::Rounded, false),
        ("rounded, the input with a lag", SlidingElement::Rounded, true),
        ("elastic", SlidingElement::Elastic, false),
        ("elastic, the input with a lag", SlidingElement::Elastic, true),
    ] {
        let mut inner = slider.inner(scales);
        if lagging {
            inner.push(lag());
        }
        forms.push(ForceForm {
            effect: "input_dependent_friction",
            form,
            coefficients: vec![either("F_0"), against("F_u")],
            inner,
            contains: match slider {
                SlidingElement::Elastic => &["coulomb_friction", "bouc_wen_hysteresis", "input_dependent_damping"],
                _ => &["coulomb_friction", "input_dependent_damping"],
            },
            build: Box::new(move |inner| {
                let (force, state) = slider.made(inner, 0);
                let mut internals: Vec<Equation> = state.into_iter().collect();
                let mut like = vec![Symbol::State(0); internals.len()];
                let drive = if lagging {
                    let w = internals.len();
                    let rate = inner.last().map_or(0.0, |tau| tau.recip());
                    internals.push(Equation::known([(Term::new(u_of(j)), rate), (Term::new(z(w)), -rate)]));
                    like.push(Symbol::Input(j));
                    z(w)
                } else {
                    u_of(j)
                };
                ForceAddition { terms: vec![Term::new(force.clone()), Term::new(drive * force)], internals, like }
            }),
        });
    }
}

fn u_of(j: usize) -> Expression {
    Symbol::Input(j).into()
}
