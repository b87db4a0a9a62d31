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
    pub(super) surfaces: Vec<Surface>,
    /// The curved parts of surfaces and of their gradients.
    pub(super) curved: Program,
    /// Some surface is curved.
    pub(super) has_curved: bool,
    /// Symbols from outside that are used, with their slots.
    pub(super) externals: Vec<(usize, External)>,
    /// The highest derivative of an input among them.
    pub(super) derivatives: usize,
    /// Of these, the slots that `rest` or `curved` reads.
    pub(super) copied: Vec<usize>,
    /// Largest magnitude of a sticking sign, at least 1.
    pub(super) hold: f64,
}

/// A function of the states, time and inputs at whose zero the equations switch.
#[derive(Clone, Debug)]
pub(super) struct Surface {
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

impl Surface {
    /// True if no state can keep the surface at zero.
    pub(super) fn is_external(&self) -> bool {
        self.support.is_empty() && self.curved.as_ref().is_none_or(|c| c.gradient.is_empty())
    }
}

/// Expressions collected for one program, and who wants each result.
#[derive(Default)]
struct Outputs(Vec<Expression>);

impl Outputs {
    fn push(&mut self, e: Expression) -> usize {
        self.0.push(e);
        self.0.len() - 1
    }
}

impl Equations {
    pub(super) fn new(model: &Model) -> Result<Self, SimulateError> {
        let layout = model.layout;
        let states = layout.states();
        if model.equations.len() != states {
            return Err(SimulateError::Equations { states, equations: model.equations.len() });
        }
        let symbols: Vec<Symbol> = layout.state_symbols().collect();
        let index = |s: Symbol| symbols.iter().position(|k| *k == s);
        let mut weighted: Vec<Vec<(f64, Expression)>> = vec![Vec::new(); states];
        let model = model.explicit()?;
        for (row, equation) in weighted.iter_mut().zip(&model.equations) {
            for t in equation.terms.iter().filter(|t| t.coefficient != 0.0) {
                if let Some(symbol) = t.term.foreign_symbol(&layout) {
                    return Err(SimulateError::Symbol { term: t.term.to_string(), symbol: layout.name(symbol) });
                }
                addends(t.coefficient, t.term.expression(), row);
            }
        }
        let all: Vec<Expression> = weighted.iter().flatten().map(|(_, e)| e.clone()).collect();
        let places = Program::surfaces(&all);
        let mut surfaces: Vec<Surface> = places
            .iter()
            .map(|e| Surface {
                expression: e.clone(),
                jumps: all.iter().any(|part| jumps_at(part, e)),
                gain: vec![0.0; states],
                mixed: false,
                gradient: vec![0.0; states],
                support: Vec::new(),
                offset: None,
                curved: None,
            })
            .collect();

        let (mut forcing, mut rest, mut curved) = (Outputs::default(), Outputs::default(), Outputs::default());
        let (mut forcing_rows, mut rest_rows) = (Vec::new(), Vec::new());
        let mut matrix = vec![0.0; states * states];
        for (row, parts) in weighted.into_iter().enumerate() {
            let (mut outside, mut inside) = (Vec::new(), Vec::new());
            for (c, e) in parts {
                match class(&e, &places) {
                    Class::State(s) => matrix[row * states + index(s).unwrap_or_default()] += c,
                    Class::Sign(k) => surfaces[k].gain[row] += c,
                    Class::Forcing => outside.push(times(c, e)),
                    Class::Other => {
                        for used in Program::surfaces(std::slice::from_ref(&e)) {
                            surfaces.iter_mut().filter(|s| s.expression == used).for_each(|s| s.mixed = true);
                        }
                        inside.push(times(c, e));
                    }
                }
            }
            if !outside.is_empty() {
                forcing_rows.push((row, forcing.push(Expression::Sum(outside))));
            }
            if !inside.is_empty() {
                rest_rows.push((row, rest.push(Expression::Sum(inside))));
            }
        }
        for surface in &mut surfaces {
            let mut parts = Vec::new();
            addends(1.0, &surface.expression, &mut parts);
            let (mut outside, mut bent) = (Vec::new(), Vec::new());
            for (c, e) in parts {
                match class(&e, &places) {
                    Class::State(s) => surface.gradient[index(s).unwrap_or_default()] += c,
                    Class::Forcing => outside.push(times(c, e)),
                    Class::Sign(_) | Class::Other => bent.push(times(c, e)),
                }
            }
            surface.support = (0..states).filter(|i| surface.gradient[*i] != 0.0).collect();
            if !outside.is_empty() {
                let e = Expression::Sum(outside).normal();
                let drift = drift(&e, &layout);
                surface.offset = Some((forcing.push(e), forcing.push(drift)));
            }
            if !bent.is_empty() {
                let e = Expression::Sum(bent).normal();
                let gradient = symbols
                    .iter()
                    .enumerate()
                    .map(|(i, s)| (i, derivative(&e, *s)))
                    .filter(|(_, d)| *d != Expression::Number(0.0))
                    .map(|(i, d)| (i, curved.push(d)))
                    .collect();
                surface.curved =
                    Some(Curved { value: curved.push(e.clone()), drift: curved.push(drift(&e, &layout)), gradient });
            }
        }

        let inner: Vec<(usize, External)> = externals(rest.0.iter().chain(&curved.0), &layout);
        let all = externals(rest.0.iter().chain(&curved.0).chain(&forcing.0), &layout);
        let compile = |outputs: &Outputs| Program::with_held_signs(&outputs.0, &layout, &places);
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
        Ok(Self {
            layout,
            states,
            matrix,
            forcing_rows: settle(forcing_rows, &forcing),
            rest_rows: settle(rest_rows, &rest),
            forcing,
            rest,
            has_curved: surfaces.iter().any(|s| s.curved.is_some()),
            surfaces,
            curved,
            derivatives: all.iter().map(|(_, e)| e.derivative()).max().unwrap_or_default(),
            externals: all,
            copied: inner.into_iter().map(|(address, _)| address).collect(),
            hold: model.static_ratio.max(1.0),
        })
    }
}

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
