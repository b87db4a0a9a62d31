//! A model as its programs compute it: rates in which every `sgn` and `|·|` reads a held sign, and the surfaces at whose
//! zeros those signs change.

use sindyscope_values::model::Model;
use sindyscope_values::term::{
    Expression, Function, Layout, Program, Style, Symbol, derivative, drift, in_signs, written,
};

/// Rates and switching surfaces, ready to be written in a language.
pub(super) struct Switched {
    pub(super) layout: Layout,
    /// The state vector.
    pub(super) states: Vec<Symbol>,
    /// The rate of each state: terms with their coefficients.
    pub(super) rates: Vec<Vec<(f64, Expression)>>,
    pub(super) surfaces: Vec<Surface>,
    /// Largest magnitude of a sticking sign, at least 1.
    pub(super) hold: f64,
}

/// A function at whose zero the equations switch.
pub(super) struct Surface {
    pub(super) expression: Expression,
    /// The motion may stay on the surface: its sign acts on the states that move it.
    pub(super) slides: bool,
    /// Derivative by each state that it depends on.
    gradient: Vec<(usize, Expression)>,
    /// Time derivative at fixed states.
    drift: Expression,
}

impl Switched {
    pub(super) fn new(model: &Model) -> Self {
        let layout = model.layout;
        let states: Vec<Symbol> = layout.state_symbols().collect();
        let rates: Vec<Vec<(f64, Expression)>> = model
            .equations
            .iter()
            .map(|equation| {
                let used = equation.terms.iter().filter(|t| t.coefficient != 0.0);
                used.map(|t| (t.coefficient, in_signs(t.term.expression()))).collect()
            })
            .collect();
        let all: Vec<Expression> = rates.iter().flatten().map(|(_, e)| e.clone()).collect();
        let surfaces = Program::surfaces(&all)
            .into_iter()
            .map(|expression| {
                let by_state = states.iter().map(|s| derivative(&expression, *s)).enumerate();
                let gradient: Vec<(usize, Expression)> =
                    by_state.filter(|(_, d)| *d != Expression::Number(0.0)).collect();
                // The motion can be held at zero only by a sign that acts on it.
                let held =
                    |(state, _): &(usize, Expression)| rates[*state].iter().any(|(_, e)| has_sign_of(e, &expression));
                Surface {
                    slides: gradient.iter().any(held),
                    gradient,
                    drift: in_signs(&drift(&expression, &layout)),
                    expression,
                }
            })
            .collect();
        Self { layout, states, rates, surfaces, hold: model.static_ratio.max(1.0) }
    }

    /// The surface whose sign an expression reads, and whether as `sgn` or as `|·|`.
    pub(super) fn held<'a>(&self, e: &'a Expression) -> Option<(usize, Function, &'a Expression)> {
        let Expression::Call(function @ (Function::Sgn | Function::Abs), arguments) = e else { return None };
        let [argument] = arguments.as_slice() else { return None };
        let index = self.surfaces.iter().position(|s| s.expression == *argument)?;
        Some((index, *function, argument))
    }

    /// The rate of a state in a language.
    pub(super) fn rate(&self, state: usize, style: &impl Style) -> String {
        sum(&self.rates[state], style)
    }

    /// The rate of a surface's value along the motion in a language; `rate` names that of each state.
    pub(super) fn surface_rate(&self, surface: usize, style: &impl Style, rate: impl Fn(usize) -> String) -> String {
        let Surface { gradient, drift, .. } = &self.surfaces[surface];
        let mut parts: Vec<String> = gradient
            .iter()
            .map(|(state, slope)| match slope {
                Expression::Number(1.0) => rate(*state),
                slope => format!("({})*{}", written(slope, style), rate(*state)),
            })
            .collect();
        if *drift != Expression::Number(0.0) {
            parts.push(format!("({})", written(drift, style)));
        }
        if parts.is_empty() { "0.0".into() } else { parts.join(" + ") }
    }
}

/// A language whose programs hold a model's quantities in arrays: states `X`, inputs `U` with two derivatives each, signs `s`.
pub(super) struct Language {
    /// The held sign of a surface.
    pub(super) sign: fn(usize) -> String,
    /// A state.
    pub(super) state: fn(usize) -> String,
    /// A derivative of an input.
    pub(super) input: fn(usize, usize) -> String,
    /// A line that gives a name to a value.
    pub(super) define: fn(&str, &str) -> String,
    /// A power.
    pub(super) power: fn(&str, &str) -> String,
    /// What a function is called.
    pub(super) function: fn(Function) -> String,
}

/// A model in such a language.
pub(super) struct InLanguage<'a> {
    pub(super) language: &'a Language,
    pub(super) switched: &'a Switched,
    /// Quantities are written as entries of the arrays, not by their names.
    pub(super) by_place: bool,
}

impl InLanguage<'_> {
    /// Lines that name the quantities that a body of code reads.
    pub(super) fn definitions(&self, body: &str) -> String {
        let Self { language, switched, .. } = self;
        let states = switched.states.iter().enumerate().map(|(i, state)| (*state, (language.state)(i)));
        let inputs = (0..switched.layout.inputs).flat_map(|j| {
            let symbols = [Symbol::Input(j), Symbol::InputRate(j), Symbol::InputAcceleration(j)];
            symbols.into_iter().enumerate().map(move |(order, symbol)| (symbol, (language.input)(j, order)))
        });
        let named = states.chain(inputs).map(|(symbol, value)| (switched.layout.name(symbol), value));
        named.filter(|(name, _)| mentions(body, name)).map(|(name, value)| (language.define)(&name, &value)).collect()
    }
}

impl Style for InLanguage<'_> {
    fn symbol(&self, symbol: Symbol) -> String {
        let place = self.switched.states.iter().position(|s| *s == symbol);
        match place.filter(|_| self.by_place) {
            Some(state) => (self.language.state)(state),
            None => self.switched.layout.name(symbol),
        }
    }

    fn substitute(&self, e: &Expression) -> Option<String> {
        let (surface, function, argument) = self.switched.held(e)?;
        let sign = (self.language.sign)(surface);
        Some(if function == Function::Abs { format!("({sign}*({}))", written(argument, self)) } else { sign })
    }

    fn number(&self, value: f64) -> String {
        literal(value)
    }

    fn times(&self) -> &'static str {
        "*"
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        (self.language.power)(base, exponent)
    }

    fn call(&self, function: Function, arguments: &[String], _: bool) -> String {
        format!("{}({})", (self.language.function)(function), arguments.join(", "))
    }
}

/// A sum of weighted terms in a language.
pub(super) fn sum(terms: &[(f64, Expression)], style: &impl Style) -> String {
    let mut out = String::new();
    for (coefficient, term) in terms {
        let weighted = Expression::Product(vec![Expression::Number(coefficient.abs()), term.clone()]).normal();
        let sign = match (*coefficient < 0.0, out.is_empty()) {
            (true, true) => "-",
            (true, false) => " - ",
            (false, true) => "",
            (false, false) => " + ",
        };
        let text = written(&weighted, style);
        // What begins with a minus of its own, or is a sum, must not run into the sign before it.
        let bare = text.starts_with('-') || matches!(weighted, Expression::Sum(_));
        out.push_str(&if bare { format!("{sign}({text})") } else { format!("{sign}{text}") });
    }
    if out.is_empty() { "0.0".into() } else { out }
}

/// True if `e` reads the sign of `surface`.
fn has_sign_of(e: &Expression, surface: &Expression) -> bool {
    let mut found = false;
    e.visit(&mut |e| found |= matches!(e, Expression::Call(Function::Sgn, a) if a[0] == *surface));
    found
}

/// True if a text of code uses a name.
pub(super) fn mentions(code: &str, name: &str) -> bool {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices(name).any(|(at, _)| {
        !code[..at].chars().next_back().is_some_and(word) && !code[at + name.len()..].chars().next().is_some_and(word)
    })
}

/// A number that every language reads back as itself.
pub(super) fn literal(value: f64) -> String {
    format!("{value:?}")
}
