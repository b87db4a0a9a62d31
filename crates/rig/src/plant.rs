use sindyscope_values::model::{Equation, Model, WeightedTerm};
use sindyscope_values::term::{Expression, Function, Layout, Program, Slots, Symbol, Term, derivative};

use super::wave::Derivatives;

/// A place where two surfaces rub: dry friction with stick and slip.
///
/// While it slips it pushes with its sliding strength against its velocity; while it sticks it pushes with whatever
/// keeps the velocity at zero, up to its holding strength.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// The relative velocity of the two surfaces: `v` (friction to the ground), `v-du` (in the joint), `v1-v2`.
    pub velocity: Term,
    /// The states whose rates it acts on, each with its share of the strength (1 for a contact of one mass; the mass
    /// ratio, negative, for the other partner's).
    pub acts_on: Vec<(usize, f64)>,
    /// Sliding strength (friction force over mass) as a weighted sum of terms; a plain number is a multiple of `1`.
    pub sliding: Vec<(Term, f64)>,
    /// Holding strength over sliding strength at zero velocity: 1 or more.
    pub holding_ratio: f64,
}

impl Contact {
    /// Coulomb friction: `−strength × sgn(velocity)` in the rate of one state.
    pub fn coulomb(velocity: Term, state: usize, strength: f64) -> Self {
        let one = Term::new(Expression::Number(1.0));
        Self { velocity, acts_on: vec![(state, 1.0)], sliding: vec![(one, strength)], holding_ratio: 1.0 }
    }
}

/// A thing to be tested: equations of motion without its dry friction, and the contacts that have it.
///
/// An effect that needs more than terms is written with more states (`second_mode`, relaxation, hysteresis: as a
/// first-order model whose sensors see only some states) or more inputs than are measured (a delayed copy of an input,
/// a force that nobody recorded).
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// The rate of every state but for what the contacts add.
    pub smooth: Model,
    /// Its contacts, at most [`Plant::MOST_CONTACTS`].
    pub contacts: Vec<Contact>,
}

impl Plant {
    /// The most contacts that a plant may have.
    pub const MOST_CONTACTS: usize = 4;

    /// A plant without dry friction.
    pub fn smooth(model: Model) -> Self {
        Self { smooth: model, contacts: Vec::new() }
    }

    /// The equations of motion with the contacts' sliding friction as terms: what an identification should find.
    pub fn truth(&self) -> Model {
        let mut model = self.smooth.clone();
        for contact in &self.contacts {
            let sign = Expression::call(Function::Sgn, contact.velocity.expression().clone());
            for (state, share) in &contact.acts_on {
                model.equations[*state].terms.extend(contact.sliding.iter().map(|(term, weight)| WeightedTerm {
                    term: Term::new(Expression::Product(vec![term.expression().clone(), sign.clone()])),
                    coefficient: -share * weight,
                    std_error: None,
                    share: 0.0,
                }));
            }
        }
        model
    }
}

/// What a contact is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ContactState {
    /// It slips, its velocity having this sign.
    Slip(f64),
    /// Its velocity is zero and stays zero.
    Stick,
}

/// Which smooth phase of a piecewise smooth plant is being integrated.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SwitchingState {
    /// The sign held by each kink or jump of the smooth terms (`|·|`, `dz`, `clip`, `sgn`).
    pub signs: Vec<f64>,
    /// What each contact is doing.
    pub grips: Vec<ContactState>,
}

/// A plant compiled for integration along given inputs. [`Dynamics::evaluate`] comes first; everything else reads what
/// it computed.
pub(super) struct Dynamics<'a> {
    plant: &'a Plant,
    layout: Layout,
    program: Program,
    slots: Slots,
    surfaces: usize,
}

/// Where the program's outputs begin: rates of the states, then surfaces, then [`Self::of_contact`] for each contact.
struct ProgramOutputs;

impl ProgramOutputs {
    const VELOCITY: usize = 0;
    const STRENGTH: usize = 1;
    const DRIFT: usize = 2;
    const GRADIENT: usize = 3;
}

impl<'a> Dynamics<'a> {
    pub(super) fn new(plant: &'a Plant) -> Self {
        let layout = plant.smooth.layout;
        let mut expressions: Vec<Expression> = plant.smooth.equations.iter().map(rate).collect();
        let strengths: Vec<Expression> = plant.contacts.iter().map(|c| weighted_sum(&c.sliding)).collect();
        let kinked: Vec<Expression> = expressions.iter().chain(&strengths).cloned().collect();
        let surfaces = Program::surfaces(&kinked);
        expressions.extend(surfaces.iter().cloned());
        for (contact, strength) in plant.contacts.iter().zip(strengths) {
            let velocity = contact.velocity.expression();
            expressions.extend([velocity.clone(), strength, drift(velocity, &layout)]);
            expressions.extend(layout.state_symbols().map(|s| derivative(velocity, s)));
        }
        let program = Program::with_held_signs(&expressions, &layout, &surfaces);
        let slots = program.slots();
        Self { plant, layout, program, slots, surfaces: surfaces.len() }
    }

    pub(super) fn states(&self) -> usize {
        self.layout.states()
    }

    pub(super) fn surfaces(&self) -> usize {
        self.surfaces
    }

    pub(super) fn contacts(&self) -> usize {
        self.plant.contacts.len()
    }

    /// Computes everything at an instant, the signs of kinks held.
    pub(super) fn evaluate(&mut self, t: f64, state: &[f64], inputs: impl Iterator<Item = Derivatives>, signs: &[f64]) {
        self.slots[0] = t;
        self.slots[1..1 + state.len()].copy_from_slice(state);
        let first = Program::address(&self.layout, Symbol::Input(0));
        for (j, Derivatives(jet)) in inputs.enumerate() {
            for (order, value) in jet.into_iter().enumerate() {
                self.slots[first + order * self.layout.inputs + j] = value;
            }
        }
        let first = self.program.first_sign();
        self.slots[first..first + signs.len()].copy_from_slice(signs);
        self.program.run(&mut self.slots);
    }

    fn output(&self, index: usize) -> f64 {
        self.slots[self.program.output(index)]
    }

    pub(super) fn surface(&self, k: usize) -> f64 {
        self.output(self.states() + k)
    }

    fn of_contact(&self, j: usize, what: usize) -> f64 {
        self.output(self.states() + self.surfaces + j * (ProgramOutputs::GRADIENT + self.states()) + what)
    }

    pub(super) fn velocity(&self, j: usize) -> f64 {
        self.of_contact(j, ProgramOutputs::VELOCITY)
    }

    pub(super) fn sliding_strength(&self, j: usize) -> f64 {
        self.of_contact(j, ProgramOutputs::STRENGTH)
    }

    pub(super) fn holding_strength(&self, j: usize) -> f64 {
        self.plant.contacts[j].holding_ratio * self.sliding_strength(j)
    }

    /// How much the velocity of contact `j` falls for a unit of the strength of contact `i`.
    fn response(&self, j: usize, i: usize) -> f64 {
        let shares = &self.plant.contacts[i].acts_on;
        shares.iter().map(|(state, share)| self.of_contact(j, ProgramOutputs::GRADIENT + state) * share).sum()
    }

    /// The rates of the states, and the strength with which each sticking contact holds.
    pub(super) fn rates(&self, grips: &[ContactState], rates: &mut [f64]) -> [f64; Plant::MOST_CONTACTS] {
        for (k, rate) in rates.iter_mut().enumerate() {
            *rate = self.output(k);
        }
        let mut strengths = [0.0; Plant::MOST_CONTACTS];
        for (j, grip) in grips.iter().enumerate() {
            if let ContactState::Slip(sign) = grip {
                self.push(j, self.sliding_strength(j) * sign, rates);
            }
        }
        let mut stuck = [0; Plant::MOST_CONTACTS];
        let mut count = 0;
        for (j, grip) in grips.iter().enumerate() {
            if *grip == ContactState::Stick {
                stuck[count] = j;
                count += 1;
            }
        }
        let stuck = &stuck[..count];
        let mut matrix = [[0.0; Plant::MOST_CONTACTS]; Plant::MOST_CONTACTS];
        let mut right = [0.0; Plant::MOST_CONTACTS];
        for (row, j) in stuck.iter().enumerate() {
            for (column, i) in stuck.iter().enumerate() {
                matrix[row][column] = self.response(*j, *i);
            }
            let slopes =
                rates.iter().enumerate().map(|(k, rate)| self.of_contact(*j, ProgramOutputs::GRADIENT + k) * rate);
            right[row] = self.of_contact(*j, ProgramOutputs::DRIFT) + slopes.sum::<f64>();
        }
        eliminate(&mut matrix, &mut right, count);
        for (row, j) in stuck.iter().enumerate() {
            strengths[*j] = right[row];
            self.push(*j, right[row], rates);
        }
        strengths
    }

    fn push(&self, j: usize, strength: f64, rates: &mut [f64]) {
        for (state, share) in &self.plant.contacts[j].acts_on {
            rates[*state] -= share * strength;
        }
    }

    /// Moves the state by the least that brings the velocity of contact `j` to zero.
    pub(super) fn bring_to_rest(&self, j: usize, state: &mut [f64]) {
        let response = self.response(j, j);
        if response != 0.0 {
            self.push(j, self.velocity(j) / response, state);
        }
    }
}

fn rate(equation: &Equation) -> Expression {
    let parts: Vec<(Term, f64)> = equation.terms.iter().map(|t| (t.term.clone(), t.coefficient)).collect();
    weighted_sum(&parts)
}

fn weighted_sum(parts: &[(Term, f64)]) -> Expression {
    let product = |(term, weight): &(Term, f64)| {
        Expression::Product(vec![Expression::Number(*weight), term.expression().clone()])
    };
    Expression::Sum(parts.iter().map(product).collect())
}

/// The part of a velocity's rate that the states have no hand in: what time and inputs do to it.
fn drift(velocity: &Expression, layout: &Layout) -> Expression {
    let mut parts = vec![derivative(velocity, Symbol::Time)];
    for j in 0..layout.inputs {
        for (of, rate) in
            [(Symbol::Input(j), Symbol::InputRate(j)), (Symbol::InputRate(j), Symbol::InputAcceleration(j))]
        {
            parts.push(Expression::Product(vec![derivative(velocity, of), Expression::Symbol(rate)]));
        }
    }
    Expression::Sum(parts).normal()
}

/// Solves the leading `count` equations in place by Gaussian elimination with row pivots. A row left without a pivot
/// belongs to a contact that another one holds already; it gets zero.
fn eliminate<const N: usize>(matrix: &mut [[f64; N]; N], right: &mut [f64; N], count: usize) {
    const NEGLIGIBLE: f64 = 1e-12;
    for column in 0..count {
        let pivot = (column..count)
            .max_by(|a, b| matrix[*a][column].abs().total_cmp(&matrix[*b][column].abs()))
            .unwrap_or(column);
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        if matrix[column][column].abs() <= NEGLIGIBLE {
            continue;
        }
        for row in column + 1..count {
            let pivot = matrix[column];
            let factor = matrix[row][column] / pivot[column];
            for (entry, above) in matrix[row].iter_mut().zip(&pivot) {
                *entry -= factor * above;
            }
            right[row] -= factor * right[column];
        }
    }
    for row in (0..count).rev() {
        let known: f64 = (row + 1..count).map(|k| matrix[row][k] * right[k]).sum();
        let pivot = matrix[row][row];
        right[row] = if pivot.abs() <= NEGLIGIBLE { 0.0 } else { (right[row] - known) / pivot };
    }
}
