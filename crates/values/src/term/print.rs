use super::Layout;
use super::expression::{Expression, Function, Symbol};

/// How tightly a form binds: a part that binds less than its surroundings needs brackets.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Binding {
    Sum,
    Product,
    Power,
    Atom,
}

/// A way of writing mathematics in one line.
pub trait Style {
    fn symbol(&self, symbol: Symbol) -> String;
    /// What stands for a part that is computed elsewhere; it must bind like a name.
    fn substitute(&self, _: &Expression) -> Option<String> {
        None
    }
    fn number(&self, value: f64) -> String {
        number(value)
    }
    fn times(&self) -> &'static str;
    fn power(&self, base: &str, exponent: &str) -> String;
    fn fraction(&self, above: &str, below: &str, single: bool) -> String {
        if single { format!("{above}/{below}") } else { format!("{above}/({below})") }
    }
    fn call(&self, function: Function, arguments: &[String], simple: bool) -> String;
    fn brackets(&self, inner: &str) -> String {
        format!("({inner})")
    }
}

/// An expression in a style.
pub fn written(e: &Expression, style: &impl Style) -> String {
    write(e, style).0
}

fn write(e: &Expression, style: &impl Style) -> (String, Binding) {
    if let Some(text) = style.substitute(e) {
        return (text, Binding::Atom);
    }
    match e {
        Expression::Number(n) if *n < 0.0 => (style.number(*n), Binding::Sum),
        Expression::Number(n) => (style.number(*n), Binding::Atom),
        Expression::Symbol(s) => (style.symbol(*s), Binding::Atom),
        Expression::Sum(parts) => {
            let mut out = String::new();
            for part in parts {
                let (text, binding) = write(part, style);
                let text = if binding == Binding::Sum && matches!(part, Expression::Sum(_)) {
                    style.brackets(&text)
                } else {
                    text
                };
                if !out.is_empty() && !text.starts_with('-') {
                    out.push('+');
                }
                out.push_str(&text);
            }
            (out, Binding::Sum)
        }
        Expression::Product(parts) => product(parts, style),
        Expression::Power(base, exponent) if *exponent < 0.0 => {
            product(&[Expression::Power(base.clone(), *exponent)], style)
        }
        Expression::Power(base, exponent) => (raised(base, *exponent, style), Binding::Power),
        Expression::Call(function, parts) => {
            let simple = matches!(parts.as_slice(), [Expression::Symbol(_)]);
            let arguments: Vec<String> = parts.iter().map(|p| write(p, style).0).collect();
            (style.call(*function, &arguments, simple), Binding::Atom)
        }
    }
}

fn raised(base: &Expression, exponent: f64, style: &impl Style) -> String {
    if exponent == 1.0 {
        return bracketed(base, Binding::Power, style);
    }
    style.power(&bracketed(base, Binding::Atom, style), &number(exponent))
}

fn bracketed(e: &Expression, least: Binding, style: &impl Style) -> String {
    let (text, binding) = write(e, style);
    if binding < least { style.brackets(&text) } else { text }
}

fn product(parts: &[Expression], style: &impl Style) -> (String, Binding) {
    let mut sign = "";
    let (mut above, mut below) = (Vec::new(), Vec::new());
    for (k, part) in parts.iter().enumerate() {
        match part {
            Expression::Number(n) if k == 0 && *n < 0.0 => {
                sign = "-";
                if *n != -1.0 || parts.len() == 1 {
                    above.push(style.number(-*n));
                }
            }
            Expression::Power(base, exponent) if *exponent < 0.0 => below.push(raised(base, -*exponent, style)),
            other => above.push(bracketed(other, Binding::Power, style)),
        }
    }
    let above = if above.is_empty() { "1".to_owned() } else { above.join(style.times()) };
    let text = match below.len() {
        0 => above,
        n => style.fraction(&above, &below.join(style.times()), n == 1),
    };
    (format!("{sign}{text}"), if sign.is_empty() { Binding::Product } else { Binding::Sum })
}

/// A number that reads back as itself, short where it can be.
pub(super) fn number(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-4..1e7).contains(&magnitude) { format!("{value:e}") } else { format!("{value}") }
}

struct Text<'a>(Option<&'a Layout>);

impl Style for Text<'_> {
    fn symbol(&self, symbol: Symbol) -> String {
        self.0.unwrap_or(&Layout::default()).name(symbol)
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
    write(e, &Text(layout)).0
}

/// A number inside a term for people: five significant digits, whole numbers as they are.
fn brief(value: f64) -> f64 {
    if value.fract() == 0.0 { value } else { format!("{value:.4e}").parse().unwrap_or(value) }
}

struct Brief<'a>(Text<'a>);

impl Style for Brief<'_> {
    fn symbol(&self, symbol: Symbol) -> String {
        self.0.symbol(symbol)
    }

    fn number(&self, value: f64) -> String {
        number(brief(value))
    }

    fn times(&self) -> &'static str {
        self.0.times()
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        self.0.power(base, exponent)
    }

    fn call(&self, function: Function, arguments: &[String], simple: bool) -> String {
        self.0.call(function, arguments, simple)
    }
}

/// The form that people type, its numbers to five digits.
pub(super) fn summary(e: &Expression, layout: &Layout) -> String {
    write(e, &Brief(Text(Some(layout)))).0
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
    write(e, &Pretty(layout)).0.replace('-', "−")
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
    write(e, &Latex(layout)).0
}

struct Python<'a>(&'a Layout);

impl Style for Python<'_> {
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
    write(e, &Python(layout)).0
}
