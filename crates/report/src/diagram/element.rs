//! What acts across one element of the structure: the equation's terms that are forces of one deflection and its velocity.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use sindyscope_core::signal::Smoother;
use sindyscope_core::study::{Outcome, RecordOutcome};
use sindyscope_values::model::Model;
use sindyscope_values::term::{Expression, Kind, Layout, Program, Symbol};

/// What a deflection is measured against.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ElementEnds {
    /// The ground: x and v.
    #[default]
    Ground,
    /// A moving base: x − u and v − du.
    Input(usize),
    /// Another degree of freedom: x₁ − x₂ and v₁ − v₂.
    Freedom(usize),
}

/// Which motion a force follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ForceFollows {
    Deflection,
    Velocity,
    Both,
}

/// Forces per unit mass of one deflection and its velocity, as an identified equation has them: positive against the motion.
#[derive(Clone, Debug)]
pub struct Element {
    freedom: usize,
    across: ElementEnds,
    layout: Layout,
    terms: Vec<(Expression, f64, ForceFollows)>,
}

/// An element's motion along a record, and what the equation leaves of the acceleration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ElementSamples {
    /// Deflection.
    pub deflection: Vec<f64>,
    /// Its velocity.
    pub velocity: Vec<f64>,
    /// Measured acceleration minus the equation's.
    pub residual: Vec<f64>,
}

impl Element {
    /// The element of a degree of freedom in an identified model; none of equations of first order.
    ///
    /// A term belongs to it if it depends on the deflection and its velocity alone. Where the base moves (`base`), a
    /// spring written as −k x + k u is one across x − u.
    pub fn new(model: &Model, freedom: usize, across: ElementEnds, base: bool) -> Option<Self> {
        let layout = model.layout;
        if layout.kind != Kind::SecondOrder || freedom >= layout.freedoms {
            return None;
        }
        let equation = model.equations.get(layout.freedoms + freedom)?;
        let own = [Symbol::State(freedom), Symbol::Rate(freedom)];
        let partners = partners(across);
        let terms = equation
            .terms
            .iter()
            .filter_map(|weighted| {
                let symbols = weighted.term.symbols();
                let e = weighted.term.expression();
                let belongs = if symbols.iter().all(|s| own.contains(s)) {
                    let linear = own.iter().position(|s| *e == Expression::Symbol(*s));
                    match (partners, linear) {
                        (None, _) => true,
                        (Some(partners), Some(which)) => {
                            // A spring to the ground beside a force is none across a base.
                            let other = equation
                                .terms
                                .iter()
                                .find(|t| *t.term.expression() == Expression::Symbol(partners[which]));
                            base && matches!(across, ElementEnds::Input(_))
                                && other.is_some_and(|o| (-1.5..-0.5).contains(&(o.coefficient / weighted.coefficient)))
                        }
                        (Some(_), None) => symbols.is_empty(),
                    }
                } else {
                    partners.is_some_and(|partners| relative(e, own, partners))
                };
                let deflects = symbols.iter().any(|s| *s == own[0] || partners.is_some_and(|p| *s == p[0]));
                let moves = symbols.iter().any(|s| *s == own[1] || partners.is_some_and(|p| *s == p[1]));
                let follows = match (deflects, moves) {
                    (true, true) => ForceFollows::Both,
                    (false, true) => ForceFollows::Velocity,
                    (_, false) => ForceFollows::Deflection,
                };
                belongs.then(|| (e.clone(), weighted.coefficient, follows))
            })
            .collect();
        Some(Self { freedom, across, layout, terms })
    }

    /// What the deflection of a degree of freedom may be measured against, the ground first: others where the
    /// equation has terms of relative motion.
    pub fn choices(model: &Model, freedom: usize, base: bool) -> Vec<ElementEnds> {
        let inputs = (0..model.layout.inputs).map(ElementEnds::Input);
        let others = (0..model.layout.freedoms).filter(|k| *k != freedom).map(ElementEnds::Freedom);
        let has = |across: &ElementEnds| {
            let element = Self::new(model, freedom, *across, base);
            element.is_some_and(|e| e.terms.iter().any(|(e, ..)| !matches!(e, Expression::Number(_))))
        };
        std::iter::once(ElementEnds::Ground).chain(inputs.chain(others).filter(has)).collect()
    }

    /// The choice that suits a model: relative motion where a term is written in it, else the ground.
    pub fn suited(model: &Model, freedom: usize, base: bool) -> ElementEnds {
        let written = |across: &ElementEnds| {
            let own = [Symbol::State(freedom), Symbol::Rate(freedom)];
            let terms = model.equations.get(model.layout.freedoms + freedom).map_or(&[][..], |e| &e.terms);
            partners(*across).is_some_and(|partners| terms.iter().any(|t| relative(t.term.expression(), own, partners)))
        };
        Self::choices(model, freedom, base).into_iter().find(written).unwrap_or_default()
    }

    /// What the deflection is measured against.
    pub fn across(&self) -> ElementEnds {
        self.across
    }

    /// Names of the deflection and its velocity.
    pub fn names(&self) -> [String; 2] {
        let own = [Symbol::State(self.freedom), Symbol::Rate(self.freedom)].map(|s| self.layout.name(s));
        match partners(self.across) {
            None => own,
            Some(partners) => {
                let [x, v] = own;
                let [y, w] = partners.map(|s| self.layout.name(s));
                [format!("{x} − {y}"), format!("{v} − {w}")]
            }
        }
    }

    /// Force per unit mass at a deflection and velocity.
    pub fn force(&self, deflection: f64, velocity: f64) -> f64 {
        self.sum(deflection, velocity, |_| true)
    }

    /// The part of the force that follows the velocity alone: damping and friction.
    pub fn friction(&self, velocity: f64) -> f64 {
        self.sum(0.0, velocity, |f| f == ForceFollows::Velocity)
    }

    fn sum(&self, deflection: f64, velocity: f64, counts: impl Fn(ForceFollows) -> bool) -> f64 {
        let value = |s: Symbol| match s {
            Symbol::State(i) if i == self.freedom => deflection,
            Symbol::Rate(i) if i == self.freedom => velocity,
            _ => 0.0,
        };
        -self.terms.iter().filter(|t| counts(t.2)).map(|(e, c, _)| c * e.value(&value)).sum::<f64>()
    }

    /// The element's motion along a record; without the ends, where derivatives are poor.
    pub fn samples(&self, outcome: &Outcome, record: &RecordOutcome) -> Option<ElementSamples> {
        let signals = &record.signals;
        let (inside, residual) = equation_residual(outcome, record, self.layout.freedoms + self.freedom)?;
        let (x, v) = (&signals.states[self.freedom], &signals.states[self.layout.freedoms + self.freedom]);
        let minus = |own: &[f64], other: Option<&[f64]>| -> Vec<f64> {
            match other {
                None => own[inside.clone()].to_vec(),
                Some(other) => own[inside.clone()].iter().zip(&other[inside.clone()]).map(|(a, b)| a - b).collect(),
            }
        };
        let (y, w) = match self.across {
            ElementEnds::Ground => (None, None),
            ElementEnds::Input(j) => (Some(signals.inputs.get(j)?.as_slice()), Some(signals.input_rate(j)?)),
            ElementEnds::Freedom(k) => (
                Some(signals.states.get(k)?.as_slice()),
                Some(signals.states.get(self.layout.freedoms + k)?.as_slice()),
            ),
        };
        Some(ElementSamples { deflection: minus(x, y), velocity: minus(v, w), residual })
    }
}

fn partners(across: ElementEnds) -> Option<[Symbol; 2]> {
    match across {
        ElementEnds::Ground => None,
        ElementEnds::Input(j) => Some([Symbol::Input(j), Symbol::InputRate(j)]),
        ElementEnds::Freedom(k) => Some([Symbol::State(k), Symbol::Rate(k)]),
    }
}

/// True if an expression depends on both motions and only on their difference.
fn relative(e: &Expression, own: [Symbol; 2], partners: [Symbol; 2]) -> bool {
    let mut foreign = false;
    let (mut mine, mut theirs) = (false, false);
    e.visit(&mut |part| {
        if let Expression::Symbol(s) = part {
            mine |= own.contains(s);
            theirs |= partners.contains(s);
            foreign |= !own.contains(s) && !partners.contains(s);
        }
    });
    if foreign || !mine || !theirs {
        return false;
    }
    // The same deflections at other places must give the same: an identity of a few functions is seen at a few points.
    const PLACES: [[f64; 4]; 4] =
        [[0.31, -0.17, 0.83, 0.59], [-0.72, 0.44, 0.13, -0.91], [1.37, 0.92, -0.61, 0.27], [-0.19, -1.23, -0.47, 1.61]];
    PLACES.iter().all(|[x, v, y, w]| {
        let value = |shift: f64| {
            e.value(&|s| match s {
                s if s == own[0] => x + shift,
                s if s == own[1] => v + shift,
                s if s == partners[0] => y + shift,
                _ => w + shift,
            })
        };
        let (here, there) = (value(0.0), value(0.37));
        (here - there).abs() <= 1e-9 * (1.0 + here.abs())
    })
}

/// What the equation of a state's rate leaves of it along a record, without the ends: measured minus identified.
///
/// None if the record lacks a series, or is too short to have an inside.
pub(super) fn equation_residual(
    outcome: &Outcome,
    record: &RecordOutcome,
    state: usize,
) -> Option<(Range<usize>, Vec<f64>)> {
    let signals = &record.signals;
    let layout = outcome.model.layout;
    let rate = signals.rate(state)?;
    let n = rate.len();
    let series = signals.states.iter().chain(&signals.inputs).map(Vec::as_slice).chain(signals.input_rates());
    let complete = signals.states.len() == layout.states()
        && signals.inputs.len() == layout.inputs
        && signals.input_rates().count() == layout.inputs
        && series.clone().all(|s| s.len() == n);
    if !complete || n == 0 {
        return None;
    }
    let equation = outcome.model.equations.get(state)?;
    let expressions: Vec<Expression> = equation.terms.iter().map(|t| t.term.expression().clone()).collect();
    let program = Program::new(&expressions, &layout);
    let mut columns = vec![Vec::new(); expressions.len()];
    program.columns(&signals.slices(&program).block(), &mut columns);
    let mut identified = vec![0.0; n];
    for (column, term) in columns.iter().zip(&equation.terms) {
        for (sum, value) in identified.iter_mut().zip(column) {
            *sum += term.coefficient * value;
        }
    }
    let smoothing = &outcome.settings.smoothing;
    // The rate went through the filter once more than the states did.
    if smoothing.filter_library {
        identified = Smoother::new(smoothing, signals.length, n).smooth(&identified, signals.interval);
    }
    let margin = smoothing.margin(signals.length).min(n / 8);
    let inside = margin..n - margin;
    let residual = rate[inside.clone()].iter().zip(&identified[inside.clone()]).map(|(a, b)| a - b).collect();
    Some((inside, residual))
}
