//! A model taken apart into a matrix, a forcing and the rest, ready for fast steps.

use super::SimulateError;
use super::grid::External;
use sindyscope_values::model::Model;
use sindyscope_values::term::{Expression, Function, Layout, Program, Symbol, derivative, drift};

/// A model taken apart for speed: what depends on time and inputs alone is computed over whole blocks of samples; what
/// is linear in the states or in a held sign is a matrix; only the rest is a program run at every stage.
#[derive(Clone, Debug)]
pub(super) struct Equations {
    pub(super) layout: Layout,
    /// Number of states.
    pub(super) states: usize,
    /// Linear part, row by row.
    pub(super) matrix: Vec<f64>,
    /// What depends on time and inputs alone: parts of the rates and of the surfaces.
    pub(super) forcing: Program,
    /// (state, slot of `forcing`).
    pub(super) forcing_rows: Vec<(usize, usize)>,
    /// What is neither linear nor forcing.
    pub(super) rest: Program,
    /// (state, slot of `rest`).
    pub(super) rest_rows: Vec<(usize, usize)>,
    /// Where the equations switch.
    pub(super) surfaces: Vec<SwitchingSurface>,
    /// The curved parts of surfaces and of their gradients.
    pub(super) curved: Program,
    /// Some surface is curved.
    pub(super) has_curved: bool,
    /// Symbols from outside that are used, with their slots.
    pub(super) externals: Vec<(usize, External)>,
    /// Of these, the slots that `rest` or `curved` reads.
    pub(super) copied: Vec<usize>,
    /// Largest magnitude of a sticking sign, at least 1.
    pub(super) hold: f64,
}

/// A function of the states, time and inputs at whose zero the equations switch.
#[derive(Clone, Debug)]
pub(super) struct SwitchingSurface {
    pub(super) expression: Expression,
    /// The rates may jump there (`sgn`, `step`); otherwise they only kink (`|·|`).
    pub(super) jumps: bool,
    /// Coefficient of the surface's sign in each rate, where the sign stands alone.
    pub(super) gain: Vec<f64>,
    /// The sign also stands in products.
    pub(super) mixed: bool,
    /// Gradient of the linear part.
    pub(super) gradient: Vec<f64>,
    /// The states that `gradient` is not zero for.
    pub(super) support: Vec<usize>,
    /// Slots of `forcing`: the part from time and inputs, and its time derivative.
    pub(super) offset: Option<(usize, usize)>,
    /// Slots of `curved`: the curved part, its time derivative at fixed states, its gradient (state, slot).
    pub(super) curved: Option<Curved>,
}

/// Where a surface's curved part stands among the outputs of its program.
#[derive(Clone, Debug)]
pub(super) struct Curved {
    pub(super) value: usize,
    pub(super) drift: usize,
    pub(super) gradient: Vec<(usize, usize)>,
}

impl SwitchingSurface {
    /// True if no state can keep the surface at zero.
    pub(super) fn is_external(&self) -> bool {
        self.support.is_empty() && self.curved.as_ref().is_none_or(|c| c.gradient.is_empty())
    }
}

/// Expressions collected for one program; each is known by its index until the program is compiled.
#[derive(Default)]
struct CollectedExpressions(Vec<Expression>);

impl CollectedExpressions {
    fn push(&mut self, e: Expression) -> usize {
        self.0.push(e);
        self.0.len() - 1
    }
}

impl Equations {
    pub(super) fn new(model: &Model) -> Result<Self, SimulateError> {
        let states = model.layout.states();
        if model.equations.len() != states {
            return Err(SimulateError::Equations { states, equations: model.equations.len() });
        }
        let model = model.explicit()?;
        let rates = rates(&model)?;
        let all: Vec<Expression> = rates.iter().flatten().map(|(_, e)| e.clone()).collect();
        let places = Program::surfaces(&all);
        let mut split = EquationSplit::new(model.layout, &places, &all);
        for (row, parts) in rates.into_iter().enumerate() {
            split.rate(row, parts);
        }
        for index in 0..places.len() {
            split.surface(index);
        }
        Ok(split.compiled(model.static_ratio.max(1.0)))
    }
}

/// The rate of each state as addends with the number in front of each.
fn rates(model: &Model) -> Result<Vec<Vec<(f64, Expression)>>, SimulateError> {
    let layout = &model.layout;
    let mut rates: Vec<Vec<(f64, Expression)>> = vec![Vec::new(); layout.states()];
    for (row, equation) in rates.iter_mut().zip(&model.equations) {
        for t in equation.terms.iter().filter(|t| t.coefficient != 0.0) {
            if let Some(symbol) = t.term.foreign_symbol(layout) {
                return Err(SimulateError::Symbol { term: t.term.to_string(), symbol: layout.name(symbol) });
            }
            addends(t.coefficient, t.term.expression(), row);
        }
    }
    Ok(rates)
}

/// Equations taken apart; rows and surfaces hold indices of [`CollectedExpressions`] where [`Equations`] holds slots of programs.
struct EquationSplit<'a> {
    layout: Layout,
    symbols: Vec<Symbol>,
    /// The functions at whose zeros the equations switch.
    places: &'a [Expression],
    surfaces: Vec<SwitchingSurface>,
    matrix: Vec<f64>,
    forcing: CollectedExpressions,
    forcing_rows: Vec<(usize, usize)>,
    rest: CollectedExpressions,
    rest_rows: Vec<(usize, usize)>,
    curved: CollectedExpressions,
}

impl<'a> EquationSplit<'a> {
    /// Nothing but the surfaces of all addends.
    fn new(layout: Layout, places: &'a [Expression], all: &[Expression]) -> Self {
        let states = layout.states();
        let surface = |e: &Expression| SwitchingSurface {
            expression: e.clone(),
            jumps: all.iter().any(|part| jumps_at(part, e)),
            gain: vec![0.0; states],
            mixed: false,
            gradient: vec![0.0; states],
            support: Vec::new(),
            offset: None,
            curved: None,
        };
        Self {
            layout,
            symbols: layout.state_symbols().collect(),
            places,
            surfaces: places.iter().map(surface).collect(),
            matrix: vec![0.0; states * states],
            forcing: CollectedExpressions::default(),
            forcing_rows: Vec::new(),
            rest: CollectedExpressions::default(),
            rest_rows: Vec::new(),
            curved: CollectedExpressions::default(),
        }
    }

    fn index(&self, state: Symbol) -> usize {
        self.symbols.iter().position(|s| *s == state).unwrap_or_default()
    }

    /// Takes the rate of one state apart.
    fn rate(&mut self, row: usize, parts: Vec<(f64, Expression)>) {
        let (mut outside, mut inside) = (Vec::new(), Vec::new());
        for (c, e) in parts {
            match class(&e, self.places) {
                Class::State(s) => {
                    let entry = row * self.symbols.len() + self.index(s);
                    self.matrix[entry] += c;
                }
                Class::Sign(k) => self.surfaces[k].gain[row] += c,
                Class::Forcing => outside.push(times(c, e)),
                Class::Other => {
                    for used in Program::surfaces(std::slice::from_ref(&e)) {
                        self.surfaces.iter_mut().filter(|s| s.expression == used).for_each(|s| s.mixed = true);
                    }
                    inside.push(times(c, e));
                }
            }
        }
        if !outside.is_empty() {
            self.forcing_rows.push((row, self.forcing.push(Expression::Sum(outside))));
        }
        if !inside.is_empty() {
            self.rest_rows.push((row, self.rest.push(Expression::Sum(inside))));
        }
    }

    /// Takes a surface apart: what is linear in the states, what depends on time and inputs alone, what is curved.
    fn surface(&mut self, index: usize) {
        let mut parts = Vec::new();
        addends(1.0, &self.places[index], &mut parts);
        let (mut outside, mut bent) = (Vec::new(), Vec::new());
        for (c, e) in parts {
            match class(&e, self.places) {
                Class::State(s) => {
                    let state = self.index(s);
                    self.surfaces[index].gradient[state] += c;
                }
                Class::Forcing => outside.push(times(c, e)),
                Class::Sign(_) | Class::Other => bent.push(times(c, e)),
            }
        }
        let surface = &mut self.surfaces[index];
        surface.support = (0..self.symbols.len()).filter(|i| surface.gradient[*i] != 0.0).collect();
        if !outside.is_empty() {
            let e = Expression::Sum(outside).normal();
            let drift = drift(&e, &self.layout);
            surface.offset = Some((self.forcing.push(e), self.forcing.push(drift)));
        }
        if !bent.is_empty() {
            let e = Expression::Sum(bent).normal();
            let slopes = self.symbols.iter().map(|s| derivative(&e, *s)).enumerate();
            let gradient = slopes
                .filter(|(_, slope)| *slope != Expression::Number(0.0))
                .map(|(state, slope)| (state, self.curved.push(slope)))
                .collect();
            let drift = drift(&e, &self.layout);
            surface.curved = Some(Curved { value: self.curved.push(e), drift: self.curved.push(drift), gradient });
        }
    }

    /// Compiles the programs and puts their slots where indices stood.
    fn compiled(self, hold: f64) -> Equations {
        let Self { layout, symbols, places, mut surfaces, matrix, forcing, forcing_rows, rest, rest_rows, curved } =
            self;
        let inner = externals(rest.0.iter().chain(&curved.0), &layout);
        let all = externals(rest.0.iter().chain(&curved.0).chain(&forcing.0), &layout);
        let compile = |outputs: &CollectedExpressions| Program::with_held_signs(&outputs.0, &layout, places);
        let (forcing, rest, curved) = (compile(&forcing), compile(&rest), compile(&curved));
        let settle = |rows: Vec<(usize, usize)>, program: &Program| {
            rows.into_iter().map(|(row, output)| (row, program.output(output))).collect()
        };
        for surface in &mut surfaces {
            if let Some((value, drift)) = &mut surface.offset {
                *value = forcing.output(*value);
                *drift = forcing.output(*drift);
            }
            if let Some(c) = &mut surface.curved {
                c.value = curved.output(c.value);
                c.drift = curved.output(c.drift);
                c.gradient.iter_mut().for_each(|(_, slot)| *slot = curved.output(*slot));
            }
        }
        Equations {
            layout,
            states: symbols.len(),
            matrix,
            forcing_rows: settle(forcing_rows, &forcing),
            rest_rows: settle(rest_rows, &rest),
            forcing,
            rest,
            has_curved: surfaces.iter().any(|s| s.curved.is_some()),
            surfaces,
            curved,
            externals: all,
            copied: inner.into_iter().map(|(address, _)| address).collect(),
            hold,
        }
    }
}

/// What an addend is to the simulation.
enum Class {
    State(Symbol),
    Sign(usize),
    Forcing,
    Other,
}

fn class(e: &Expression, surfaces: &[Expression]) -> Class {
    match e {
        Expression::Symbol(s) if !is_external(*s) => return Class::State(*s),
        Expression::Call(Function::Sgn, a) => {
            if let Some(k) = surfaces.iter().position(|s| *s == a[0]) {
                return Class::Sign(k);
            }
        }
        _ => {}
    }
    let mut outside = Program::surfaces(std::slice::from_ref(e)).is_empty();
    e.visit(&mut |e| {
        if let Expression::Symbol(s) = e {
            outside &= is_external(*s);
        }
    });
    if outside { Class::Forcing } else { Class::Other }
}

fn is_external(symbol: Symbol) -> bool {
    !matches!(symbol, Symbol::State(_) | Symbol::Rate(_) | Symbol::Internal(_))
}

/// The parts of a sum, each with the number in front of it.
fn addends(factor: f64, e: &Expression, found: &mut Vec<(f64, Expression)>) {
    match e {
        Expression::Sum(parts) => parts.iter().for_each(|p| addends(factor, p, found)),
        Expression::Product(parts) => match parts.as_slice() {
            [Expression::Number(n), rest] => addends(factor * n, rest, found),
            [Expression::Number(n), rest @ ..] => found.push((factor * n, Expression::Product(rest.to_vec()))),
            _ => found.push((factor, e.clone())),
        },
        _ => found.push((factor, e.clone())),
    }
}

fn times(factor: f64, e: Expression) -> Expression {
    Expression::Product(vec![Expression::Number(factor), e])
}

/// True if `e` contains the sign or the step of `surface`.
fn jumps_at(e: &Expression, surface: &Expression) -> bool {
    let mut found = false;
    e.visit(&mut |e| {
        if let Expression::Call(Function::Sgn | Function::Step, a) = e {
            found |= a[0] == *surface;
        }
    });
    found
}

fn externals<'a>(expressions: impl Iterator<Item = &'a Expression>, layout: &Layout) -> Vec<(usize, External)> {
    let mut found = Vec::new();
    for e in expressions {
        e.visit(&mut |e| {
            let Expression::Symbol(s) = e else { return };
            let external = match s {
                Symbol::Time => External::Time,
                Symbol::Input(j) => External::Input(*j, 0),
                Symbol::InputRate(j) => External::Input(*j, 1),
                Symbol::InputAcceleration(j) => External::Input(*j, 2),
                Symbol::State(_) | Symbol::Rate(_) | Symbol::Acceleration(_) | Symbol::Internal(_) => return,
            };
            let entry = (Program::address(layout, *s), external);
            if !found.contains(&entry) {
                found.push(entry);
            }
        });
    }
    found
}
