//! One printer for every notation: it decides signs, brackets and fractions; a [`Notation`] says what each becomes.

use std::borrow::Cow;

use super::Layout;
use super::expression::{Expression, Function, Symbol};

/// A way of writing mathematics, as a text or as the tree of a formula that is typeset.
pub trait Notation {
    /// What an expression is written as.
    type Written;

    /// What stands for an expression that is computed elsewhere; it must bind like a name.
    fn substitute(&self, _: &Expression) -> Option<Self::Written> {
        None
    }
    /// A quantity.
    fn symbol(&self, symbol: Symbol) -> Self::Written;
    /// A number that is not negative.
    fn number(&self, value: f64) -> Self::Written;
    /// What stands above a fraction's bar where nothing else does.
    fn one(&self) -> Self::Written;
    /// Something with a minus in front.
    fn negated(&self, inner: Self::Written) -> Self::Written;
    /// A sum of addends, each true if it is subtracted.
    fn sum(&self, addends: Vec<(bool, Self::Written)>) -> Self::Written;
    /// A product of one factor or more.
    fn product(&self, factors: Vec<Self::Written>) -> Self::Written;
    /// Products above and below a fraction's bar; `single` if below stands one factor.
    fn fraction(&self, above: Self::Written, below: Self::Written, single: bool) -> Self::Written;
    /// True if the bar of a fraction is as good as brackets.
    fn bar_groups(&self) -> bool {
        false
    }
    /// A base raised to a positive power.
    fn power(&self, base: Self::Written, exponent: f64) -> Self::Written;
    /// A function of its arguments; `simple` if its only argument is one symbol.
    fn call(&self, function: Function, arguments: Vec<Self::Written>, simple: bool) -> Self::Written;
    /// Something in brackets.
    fn brackets(&self, inner: Self::Written) -> Self::Written;
}

/// A [`Notation`] in one line of text.
pub trait Style {
    /// A quantity's name.
    fn symbol(&self, symbol: Symbol) -> String;
    /// What stands for a part that is computed elsewhere; it must bind like a name.
    fn substitute(&self, _: &Expression) -> Option<String> {
        None
    }
    /// A number that is not negative; by default as short as it reads back as itself.
    fn number(&self, value: f64) -> String {
        number(value)
    }
    /// What stands between factors.
    fn times(&self) -> &'static str;
    /// A base raised to a power.
    fn power(&self, base: &str, exponent: &str) -> String;
    /// A fraction; `single` if one factor stands below.
    fn fraction(&self, above: &str, below: &str, single: bool) -> String {
        if single { format!("{above}/{below}") } else { format!("{above}/({below})") }
    }
    /// A function of its arguments; `simple` if its only argument is one symbol.
    fn call(&self, function: Function, arguments: &[String], simple: bool) -> String;
    /// Something in brackets.
    fn brackets(&self, inner: &str) -> String {
        format!("({inner})")
    }
}

impl<S: Style> Notation for S {
    type Written = String;

    fn substitute(&self, e: &Expression) -> Option<String> {
        Style::substitute(self, e)
    }

    fn symbol(&self, symbol: Symbol) -> String {
        Style::symbol(self, symbol)
    }

    fn number(&self, value: f64) -> String {
        Style::number(self, value)
    }

    fn one(&self) -> String {
        "1".into()
    }

    fn negated(&self, inner: String) -> String {
        format!("-{inner}")
    }

    fn sum(&self, addends: Vec<(bool, String)>) -> String {
        let mut out = String::new();
        for (negative, text) in addends {
            match (negative, out.is_empty()) {
                (true, _) => out.push('-'),
                (false, true) => {}
                (false, false) => out.push('+'),
            }
            out.push_str(&text);
        }
        out
    }

    fn product(&self, factors: Vec<String>) -> String {
        factors.join(self.times())
    }

    fn fraction(&self, above: String, below: String, single: bool) -> String {
        Style::fraction(self, &above, &below, single)
    }

    fn power(&self, base: String, exponent: f64) -> String {
        Style::power(self, &base, &number(exponent))
    }

    fn call(&self, function: Function, arguments: Vec<String>, simple: bool) -> String {
        Style::call(self, function, &arguments, simple)
    }

    fn brackets(&self, inner: String) -> String {
        Style::brackets(self, &inner)
    }
}

/// An expression in a notation.
pub fn written<N: Notation>(e: &Expression, notation: &N) -> N::Written {
    Printer(notation).any(e).0
}

/// An expression as a factor, in brackets where it is a sum or has a sign.
pub fn written_factor<N: Notation>(e: &Expression, notation: &N) -> N::Written {
    Printer(notation).bound(e, Binding::Product)
}

/// How tightly a form binds: a part that binds less than its surroundings needs brackets.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Binding {
    Sum,
    Product,
    Power,
    Atom,
}

struct Printer<'a, N>(&'a N);

impl<N: Notation> Printer<'_, N> {
    fn any(&self, e: &Expression) -> (N::Written, Binding) {
        let notation = self.0;
        if let Some(written) = notation.substitute(e) {
            return (written, Binding::Atom);
        }
        if let (true, rest) = without_sign(e) {
            return (notation.negated(self.product(factors(&rest))), Binding::Sum);
        }
        match e {
            Expression::Number(n) => (notation.number(*n), Binding::Atom),
            Expression::Symbol(s) => (notation.symbol(*s), Binding::Atom),
            Expression::Sum(parts) => {
                let addend = |part: &Expression| {
                    let (negative, rest) = without_sign(part);
                    (negative, self.bound(&rest, Binding::Product))
                };
                (notation.sum(parts.iter().map(addend).collect()), Binding::Sum)
            }
            Expression::Product(parts) => (self.product(parts), Binding::Product),
            Expression::Power(_, exponent) if *exponent < 0.0 => (self.product(factors(e)), Binding::Product),
            Expression::Power(base, exponent) => (self.raised(base, *exponent, Binding::Power), Binding::Power),
            Expression::Call(function, parts) => {
                let simple = matches!(parts.as_slice(), [Expression::Symbol(_)]);
                let arguments = parts.iter().map(|p| self.any(p).0).collect();
                (notation.call(*function, arguments, simple), Binding::Atom)
            }
        }
    }

    /// An expression in brackets if it binds less than `least`.
    fn bound(&self, e: &Expression, least: Binding) -> N::Written {
        let (written, binding) = self.any(e);
        if binding < least { self.0.brackets(written) } else { written }
    }

    /// A base to a positive power; to the first, it binds like `least`.
    fn raised(&self, base: &Expression, exponent: f64, least: Binding) -> N::Written {
        if exponent == 1.0 {
            return self.bound(base, least);
        }
        self.0.power(self.bound(base, Binding::Atom), exponent)
    }

    fn product(&self, parts: &[Expression]) -> N::Written {
        let is_divisor = |e: &&Expression| matches!(e, Expression::Power(_, exponent) if *exponent < 0.0);
        let divisors = parts.iter().filter(is_divisor).count();
        // A lone sum needs no brackets beneath a bar.
        let beneath = if divisors == 1 && self.0.bar_groups() { Binding::Sum } else { Binding::Power };
        let (mut above, mut below) = (Vec::new(), Vec::new());
        for part in parts {
            match part {
                Expression::Power(base, exponent) if *exponent < 0.0 => {
                    below.push(self.raised(base, -exponent, beneath));
                }
                other => above.push(self.bound(other, Binding::Power)),
            }
        }
        let above = if above.is_empty() { self.0.one() } else { self.0.product(above) };
        if below.is_empty() { above } else { self.0.fraction(above, self.0.product(below), divisors == 1) }
    }
}

/// The factors of a product; of anything else itself.
fn factors(e: &Expression) -> &[Expression] {
    match e {
        Expression::Product(parts) => parts,
        other => std::slice::from_ref(other),
    }
}

/// True and the rest if an expression begins with a minus.
fn without_sign(e: &Expression) -> (bool, Cow<'_, Expression>) {
    match e {
        Expression::Number(n) if *n < 0.0 => (true, Cow::Owned(Expression::Number(-n))),
        Expression::Product(parts) => match parts.as_slice() {
            [Expression::Number(-1.0), rest] => (true, Cow::Borrowed(rest)),
            [Expression::Number(n), rest @ ..] if *n < 0.0 => {
                let size = (*n != -1.0 || rest.is_empty()).then_some(Expression::Number(-n));
                (true, Cow::Owned(Expression::Product(size.into_iter().chain(rest.iter().cloned()).collect())))
            }
            _ => (false, Cow::Borrowed(e)),
        },
        _ => (false, Cow::Borrowed(e)),
    }
}

/// A number that reads back as itself, short where it can be.
pub(super) fn number(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-4..1e7).contains(&magnitude) { format!("{value:e}") } else { format!("{value}") }
}

/// The form that people type.
struct Text<'a> {
    /// Gives the names; without one the first of several keeps its plain name.
    layout: Option<&'a Layout>,
    /// True for numbers to five digits.
    brief: bool,
}

impl Style for Text<'_> {
    fn symbol(&self, symbol: Symbol) -> String {
        self.layout.unwrap_or(&Layout::default()).name(symbol)
    }

    fn number(&self, value: f64) -> String {
        number(if self.brief { brief(value) } else { value })
    }

    fn times(&self) -> &'static str {
        "*"
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        format!("{base}^{exponent}")
    }

    fn call(&self, function: Function, arguments: &[String], _: bool) -> String {
        match function {
            Function::Abs => format!("|{}|", arguments.join(",")),
            f => format!("{}({})", f.name(), arguments.join(",")),
        }
    }
}

/// The form that scripts read and people type; with no layout, first of several keep their plain names.
pub(super) fn text(e: &Expression, layout: Option<&Layout>) -> String {
    written(e, &Text { layout, brief: false })
}

/// A number inside a term for people: five significant digits, whole numbers as they are.
fn brief(value: f64) -> f64 {
    if value.fract() == 0.0 { value } else { format!("{value:.4e}").parse().unwrap_or(value) }
}

/// The form that people type, its numbers to five digits.
pub(super) fn summary(e: &Expression, layout: &Layout) -> String {
    written(e, &Text { layout: Some(layout), brief: true })
}

struct Pretty<'a>(&'a Layout);

impl Style for Pretty<'_> {
    fn symbol(&self, symbol: Symbol) -> String {
        self.0.name(symbol).chars().map(|c| c.to_digit(10).map_or(c, subscript)).collect()
    }

    fn number(&self, value: f64) -> String {
        number(brief(value))
    }

    fn times(&self) -> &'static str {
        "·"
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        match exponent.parse::<u32>() {
            Ok(n) if n < 10 => format!("{base}{}", ["⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"][n as usize]),
            _ => format!("{base}^{exponent}"),
        }
    }

    fn call(&self, function: Function, arguments: &[String], simple: bool) -> String {
        match function {
            Function::Abs => format!("|{}|", arguments.join(", ")),
            f if simple => format!("{} {}", f.name(), arguments.join(", ")),
            f => format!("{}({})", f.name(), arguments.join(", ")),
        }
    }
}

fn subscript(digit: u32) -> char {
    char::from_u32('₀' as u32 + digit).unwrap_or('₀')
}

/// One line for a person: `x³`, `v·|v|`, `sgn v`.
pub(super) fn pretty(e: &Expression, layout: &Layout) -> String {
    written(e, &Pretty(layout)).replace('-', "−")
}

struct Latex<'a>(&'a Layout);

impl Style for Latex<'_> {
    fn symbol(&self, symbol: Symbol) -> String {
        let (accent, letter, index, several) = match symbol {
            Symbol::Time => return "t".into(),
            Symbol::State(i) => ("", "x", i, self.0.freedoms > 1),
            Symbol::Rate(i) => ("\\dot", "x", i, self.0.freedoms > 1),
            Symbol::Acceleration(i) => ("\\ddot", "x", i, self.0.freedoms > 1),
            Symbol::Internal(i) => ("", "z", i, self.0.internals > 1),
            Symbol::Input(j) => ("", "u", j, self.0.inputs > 1),
            Symbol::InputRate(j) => ("\\dot", "u", j, self.0.inputs > 1),
            Symbol::InputAcceleration(j) => ("\\ddot", "u", j, self.0.inputs > 1),
        };
        let letter = if accent.is_empty() { letter.to_owned() } else { format!("{accent}{{{letter}}}") };
        if several || index > 0 { format!("{letter}_{{{}}}", index + 1) } else { letter }
    }

    fn number(&self, value: f64) -> String {
        latex_number(&number(brief(value)))
    }

    fn times(&self) -> &'static str {
        " \\, "
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        format!("{base}^{{{}}}", latex_number(exponent))
    }

    fn fraction(&self, above: &str, below: &str, _: bool) -> String {
        format!("\\frac{{{above}}}{{{below}}}")
    }

    fn call(&self, function: Function, arguments: &[String], _: bool) -> String {
        let inner = arguments.join(", ");
        match function {
            Function::Abs => format!("\\left|{inner}\\right|"),
            Function::Sqrt => format!("\\sqrt{{{inner}}}"),
            Function::Sin
            | Function::Cos
            | Function::Tan
            | Function::Exp
            | Function::Log
            | Function::Tanh
            | Function::Max
            | Function::Min => {
                format!("\\{}\\left({inner}\\right)", function.name())
            }
            Function::Atan => format!("\\arctan\\left({inner}\\right)"),
            f => format!("\\operatorname{{{}}}\\left({inner}\\right)", f.name()),
        }
    }

    fn brackets(&self, inner: &str) -> String {
        format!("\\left({inner}\\right)")
    }
}

/// A number's text with its power of ten written out.
pub fn latex_number(text: &str) -> String {
    match text.split_once('e') {
        Some((digits, exponent)) => format!("{digits} \\times 10^{{{exponent}}}"),
        None => text.to_owned(),
    }
}

/// LaTeX mathematics.
pub(super) fn latex(e: &Expression, layout: &Layout) -> String {
    written(e, &Latex(layout))
}

struct NumpyStyle<'a>(&'a Layout);

impl Style for NumpyStyle<'_> {
    fn symbol(&self, symbol: Symbol) -> String {
        self.0.name(symbol)
    }

    fn times(&self) -> &'static str {
        "*"
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        format!("{base}**{exponent}")
    }

    fn call(&self, function: Function, arguments: &[String], _: bool) -> String {
        let list = arguments.join(", ");
        match function {
            Function::Sgn => format!("np.sign({list})"),
            Function::Atan => format!("np.arctan({list})"),
            Function::Step => format!("np.heaviside({list}, 0.5)"),
            Function::Max => format!("np.maximum({list})"),
            Function::Min => format!("np.minimum({list})"),
            Function::Clip => format!("np.clip({}, -abs({}), abs({}))", arguments[0], arguments[1], arguments[1]),
            Function::DeadZone => {
                format!("(({0}) - np.clip({0}, -abs({1}), abs({1})))", arguments[0], arguments[1])
            }
            f => format!("np.{}({list})", f.name()),
        }
    }
}

/// A Python expression over `numpy` as `np`.
pub(super) fn python(e: &Expression, layout: &Layout) -> String {
    written(e, &NumpyStyle(layout))
}
