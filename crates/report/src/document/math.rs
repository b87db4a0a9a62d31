//! Equations typeset: as `MathML` for a browser, and laid out for a picture.

use super::font::{Face, Fonts};
use crate::canvas::{Svg, digit_of_superscript, escape};
use sindyscope_values::format::equations::{by_share, digits, is_kinematic};
use sindyscope_values::format::number::{significant, significant_trimmed};
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::term::{Function, Kind, Layout, Notation, Symbol, Term, written, written_factor};

/// A formula's tree.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Math {
    /// A number or a function's name: upright.
    Upright(String),
    /// A variable: slanted.
    Variable(&'static str),
    /// `+`, `=`, brackets.
    Operator(&'static str),
    /// Side by side.
    Row(Vec<Self>),
    /// Raised.
    Superscript(Box<Self>, Box<Self>),
    /// Lowered.
    Subscript(Box<Self>, String),
    /// One or two dots above: time derivatives.
    Dotted(Box<Self>, usize),
    /// One above the other.
    Fraction(Box<Self>, Box<Self>),
    /// Square root.
    Root(Box<Self>),
}

/// The rows of an equation of motion, broken so that each fits a line: left side, and terms with signs.
pub(super) struct EquationRows {
    /// The state's rate and the equals sign.
    pub(super) left: Math,
    /// Right sides, one a line.
    pub(super) right: Vec<Math>,
}

/// Terms on a line of an equation.
const TERMS_A_LINE: usize = 5;

/// The identified equations of a model, known kinematics left out; coefficients as long as their error allows.
pub(super) fn equations(model: &Model) -> Vec<EquationRows> {
    model
        .iter()
        .filter(|(state, equation)| !is_kinematic(model, *state, equation))
        .map(|(state, equation)| sum(rate(&model.layout, state), equation, &model.layout))
        .collect()
}

/// A sum of terms beside what it is equal to.
pub(super) fn sum(left: Math, equation: &Equation, layout: &Layout) -> EquationRows {
    let terms = by_share(equation);
    let mut right: Vec<Math> = terms
        .chunks(TERMS_A_LINE)
        .enumerate()
        .map(|(line, terms)| {
            let mut parts = Vec::new();
            for (k, term) in terms.iter().enumerate() {
                match (term.coefficient < 0.0, line + k) {
                    (true, 0) => parts.push(Math::Operator("−")),
                    (true, _) => parts.push(Math::Operator(" − ")),
                    (false, 0) => {}
                    (false, _) => parts.push(Math::Operator(" + ")),
                }
                let size = term.coefficient.abs();
                let number = number(&match term.std_error {
                    Some(_) => significant(size, digits(size, term.std_error)),
                    None => significant_trimmed(size, digits(size, None)),
                });
                match written_factor(term.term.expression(), &Formula(layout)) {
                    Math::Upright(one) if one == "1" => parts.push(number),
                    factor => parts.extend([number, Math::Operator("\u{2009}"), factor]),
                }
            }
            Math::Row(parts)
        })
        .collect();
    if right.is_empty() {
        right.push(Math::Upright("0".into()));
    }
    EquationRows { left: Math::Row(vec![left, Math::Operator(" = ")]), right }
}

/// The time derivative of a state.
pub(super) fn rate(layout: &Layout, state: Symbol) -> Math {
    match (layout.kind, state) {
        (Kind::SecondOrder, Symbol::Rate(i)) => {
            indexed(Math::Dotted(Math::Variable("x").into(), 2), i, layout.freedoms)
        }
        // Velocities are written as dotted displacements, so a fitted dx/dt needs another left side.
        (Kind::SecondOrder, Symbol::State(_)) => Math::Row(vec![
            Math::Fraction(
                Math::Upright("d".into()).into(),
                Math::Row(vec![Math::Upright("d".into()), Math::Variable("t")]).into(),
            ),
            symbol(layout, state),
        ]),
        (_, Symbol::State(i)) => indexed(Math::Dotted(Math::Variable("x").into(), 1), i, layout.freedoms),
        (_, Symbol::Internal(i)) => indexed(Math::Dotted(Math::Variable("z").into(), 1), i, layout.internals),
        (_, other) => symbol(layout, other),
    }
}

/// A term.
pub(super) fn term(term: &Term, layout: &Layout) -> Math {
    written(term.expression(), &Formula(layout))
}

/// A number in the notation of [`significant_trimmed`], powers of ten raised.
pub(super) fn number(text: &str) -> Math {
    match text.split_once("×10") {
        None => Math::Upright(text.into()),
        Some((digits, power)) => {
            let power = power.chars().filter_map(digit_of_superscript).collect();
            let ten = Math::Superscript(Math::Upright("10".into()).into(), Math::Upright(power).into());
            Math::Row(vec![Math::Upright(digits.into()), Math::Operator("×"), ten])
        }
    }
}

fn indexed(base: Math, index: usize, of: usize) -> Math {
    if of > 1 || index > 0 { Math::Subscript(base.into(), (index + 1).to_string()) } else { base }
}

fn symbol(layout: &Layout, symbol: Symbol) -> Math {
    let (letter, dots, index, of) = match symbol {
        Symbol::Time => return Math::Variable("t"),
        Symbol::State(i) => ("x", 0, i, layout.freedoms),
        Symbol::Rate(i) => ("x", 1, i, layout.freedoms),
        Symbol::Acceleration(i) => ("x", 2, i, layout.freedoms),
        Symbol::Internal(i) => ("z", 0, i, layout.internals),
        Symbol::Input(j) => ("u", 0, j, layout.inputs),
        Symbol::InputRate(j) => ("u", 1, j, layout.inputs),
        Symbol::InputAcceleration(j) => ("u", 2, j, layout.inputs),
    };
    let letter = Math::Variable(letter);
    indexed(if dots > 0 { Math::Dotted(letter.into(), dots) } else { letter }, index, of)
}

fn brackets(open: &'static str, inner: Math, close: &'static str) -> Math {
    Math::Row(vec![Math::Operator(open), inner, Math::Operator(close)])
}

/// Formulas with a layout's names, numbers to six digits.
struct Formula<'a>(&'a Layout);

impl Notation for Formula<'_> {
    type Written = Math;

    fn symbol(&self, symbol: Symbol) -> Math {
        self::symbol(self.0, symbol)
    }

    fn number(&self, value: f64) -> Math {
        number(&significant_trimmed(value, 6))
    }

    fn one(&self) -> Math {
        Math::Upright("1".into())
    }

    fn negated(&self, inner: Math) -> Math {
        Math::Row(vec![Math::Operator("−"), inner])
    }

    fn sum(&self, addends: Vec<(bool, Math)>) -> Math {
        let mut row = Vec::new();
        for (negative, addend) in addends {
            match (negative, row.is_empty()) {
                (true, true) => row.push(Math::Operator("−")),
                (true, false) => row.push(Math::Operator(" − ")),
                (false, true) => {}
                (false, false) => row.push(Math::Operator(" + ")),
            }
            row.push(addend);
        }
        Math::Row(row)
    }

    fn product(&self, factors: Vec<Math>) -> Math {
        joined(factors, "\u{2009}")
    }

    fn fraction(&self, above: Math, below: Math, _: bool) -> Math {
        Math::Fraction(above.into(), below.into())
    }

    fn bar_groups(&self) -> bool {
        true
    }

    fn power(&self, base: Math, exponent: f64) -> Math {
        Math::Superscript(base.into(), self.number(exponent).into())
    }

    fn call(&self, function: Function, arguments: Vec<Math>, simple: bool) -> Math {
        let inner = joined(arguments, ", ");
        match function {
            Function::Abs => brackets("|", inner, "|"),
            Function::Sqrt => Math::Root(inner.into()),
            f => {
                let name = Math::Upright(f.name().into());
                if simple {
                    Math::Row(vec![name, Math::Operator("\u{2009}"), inner])
                } else {
                    Math::Row(vec![name, brackets("(", inner, ")")])
                }
            }
        }
    }

    fn brackets(&self, inner: Math) -> Math {
        brackets("(", inner, ")")
    }
}

/// Formulas in a row with an operator between them.
fn joined(parts: Vec<Math>, operator: &'static str) -> Math {
    let mut row = Vec::new();
    for part in parts {
        if !row.is_empty() {
            row.push(Math::Operator(operator));
        }
        row.push(part);
    }
    Math::Row(row)
}

impl Math {
    /// Presentation `MathML`, without the `math` element around it.
    pub(super) fn mathml(&self) -> String {
        match self {
            Self::Upright(text) if text.starts_with(|c: char| c.is_alphabetic()) => {
                format!("<mi mathvariant=\"normal\">{}</mi>", escape(text))
            }
            Self::Upright(text) => format!("<mn>{}</mn>", escape(text)),
            Self::Variable(name) => format!("<mi>{name}</mi>"),
            Self::Operator("\u{2009}") => "<mspace width=\"0.17em\"/>".into(),
            // A minus at the start of a row is a sign, with no room around it; the others are told apart by their blanks.
            Self::Operator("−") => "<mo form=\"prefix\">−</mo>".into(),
            Self::Operator("|") => "<mo stretchy=\"false\" lspace=\"0\" rspace=\"0\">|</mo>".into(),
            Self::Operator(o) if o.starts_with(' ') => format!("<mo form=\"infix\">{}</mo>", o.trim()),
            Self::Operator(o) => format!("<mo stretchy=\"false\">{}</mo>", o.trim()),
            Self::Row(parts) => format!("<mrow>{}</mrow>", parts.iter().map(Self::mathml).collect::<String>()),
            Self::Superscript(base, raised) => format!("<msup>{}{}</msup>", base.mathml(), raised.mathml()),
            Self::Subscript(base, index) => format!("<msub>{}<mn>{index}</mn></msub>", base.mathml()),
            Self::Dotted(base, dots) => {
                let accent = if *dots == 1 { "˙" } else { "¨" };
                format!("<mover accent=\"true\">{}<mo stretchy=\"false\">{accent}</mo></mover>", base.mathml())
            }
            Self::Fraction(above, below) => format!("<mfrac>{}{}</mfrac>", above.mathml(), below.mathml()),
            Self::Root(inner) => format!("<msqrt>{}</msqrt>", inner.mathml()),
        }
    }

    /// Lays the formula out for a picture, its base line at zero.
    pub(super) fn layout(&self, fonts: &Fonts, size: f64) -> Laid {
        match self {
            Self::Upright(text) => Laid::text(fonts, text, size, false),
            Self::Variable(text) => Laid::text(fonts, text, size, true),
            Self::Operator("\u{2009}") => Laid { width: 0.17 * size, ..Laid::default() },
            Self::Operator(text) => Laid::text(fonts, text, size, false),
            Self::Row(parts) => {
                let mut row = Laid::default();
                for part in parts {
                    row.append(part.layout(fonts, size), 0.0);
                }
                row
            }
            Self::Superscript(base, raised) => {
                let mut row = base.layout(fonts, size);
                let lift = (row.ascent - 0.32 * size).max(0.36 * size);
                row.width += 0.05 * size;
                row.append(raised.layout(fonts, 0.7 * size), -lift);
                row
            }
            Self::Subscript(base, index) => {
                let mut row = base.layout(fonts, size);
                row.append(Laid::text(fonts, index, 0.7 * size, false), 0.2 * size);
                row
            }
            Self::Dotted(base, dots) => {
                let mut row = base.layout(fonts, size);
                let (height, middle) = (0.68 * size, 0.5 * row.width + 0.09 * size);
                for k in 0..*dots {
                    let x = middle + 0.22 * size * (k as f64 - 0.5 * (*dots as f64 - 1.0));
                    row.marks.push(MathMark::Dot { at: (x, -height), radius: 0.058 * size });
                }
                row.ascent = row.ascent.max(height + 0.08 * size);
                row
            }
            Self::Fraction(above, below) => {
                let (above, below) = (above.layout(fonts, 0.9 * size), below.layout(fonts, 0.9 * size));
                let width = above.width.max(below.width) + 0.2 * size;
                let axis = 0.26 * size;
                let mut out = Laid { width: width + 0.1 * size, ..Laid::default() };
                let (up, down) = (axis + 0.12 * size + above.descent, 0.12 * size - axis + below.ascent);
                let (left, right) = (0.5 * (width - above.width), 0.5 * (width - below.width));
                out.overlay(above, (left, -up));
                out.overlay(below, (right, down));
                out.marks.push(MathMark::Line { points: vec![(0.0, -axis), (width, -axis)] });
                out
            }
            Self::Root(inner) => {
                let inner = inner.layout(fonts, size);
                let (head, foot) = (inner.ascent + 0.1 * size, inner.descent);
                let (start, width) = (0.55 * size, inner.width);
                let mut out = Laid { width: start + width + 0.1 * size, ..Laid::default() };
                out.overlay(inner, (start, 0.0));
                let points = vec![
                    (0.08 * size, -0.3 * size),
                    (0.2 * size, -0.38 * size),
                    (0.36 * size, foot),
                    (0.5 * size, -head),
                    (start + width, -head),
                ];
                out.marks.push(MathMark::Line { points });
                out.ascent = out.ascent.max(head);
                out
            }
        }
    }
}

/// Something drawn.
#[derive(Clone, Debug)]
enum MathMark {
    Text { at: (f64, f64), size: f64, slanted: bool, text: String },
    Dot { at: (f64, f64), radius: f64 },
    Line { points: Vec<(f64, f64)> },
}

/// A formula with every piece in its place; the base line is at height zero, downwards is positive.
#[derive(Clone, Debug, Default)]
pub(super) struct Laid {
    pub(super) width: f64,
    pub(super) ascent: f64,
    pub(super) descent: f64,
    marks: Vec<MathMark>,
}

impl Laid {
    fn text(fonts: &Fonts, text: &str, size: f64, slanted: bool) -> Self {
        let mark = MathMark::Text { at: (0.0, 0.0), size, slanted, text: text.to_owned() };
        let width = fonts.width(text, size, Face::Text) + if slanted { 0.05 * size } else { 0.0 };
        Self { width, ascent: 0.72 * size, descent: 0.2 * size, marks: vec![mark] }
    }

    fn append(&mut self, other: Self, down: f64) {
        let width = other.width;
        self.overlay(other, (self.width, down));
        self.width += width;
    }

    fn overlay(&mut self, other: Self, by: (f64, f64)) {
        self.ascent = self.ascent.max(other.ascent - by.1);
        self.descent = self.descent.max(other.descent + by.1);
        let moved = |(x, y): (f64, f64)| (x + by.0, y + by.1);
        self.marks.extend(other.marks.into_iter().map(|mark| match mark {
            MathMark::Text { at, size, slanted, text } => MathMark::Text { at: moved(at), size, slanted, text },
            MathMark::Dot { at, radius } => MathMark::Dot { at: moved(at), radius },
            MathMark::Line { points } => MathMark::Line { points: points.into_iter().map(moved).collect() },
        }));
    }

    /// Draws the formula with its base line's start at `at`.
    pub(super) fn draw(&self, svg: &mut Svg, at: (f64, f64)) {
        use std::fmt::Write;
        let moved = |(x, y): (f64, f64)| (x + at.0, y + at.1);
        for mark in &self.marks {
            match mark {
                // The fonts have no italic.
                MathMark::Text { at, size, slanted: true, text } => {
                    let (x, y) = moved(*at);
                    let _ = writeln!(
                        svg.0,
                        "<text class=\"math\" font-size=\"{size:.1}\" transform=\"translate({x:.2} {y:.2}) skewX(-12)\">{}</text>",
                        escape(text)
                    );
                }
                MathMark::Text { at, size, slanted: false, text } => {
                    let (x, y) = moved(*at);
                    let _ = writeln!(
                        svg.0,
                        "<text class=\"math\" xml:space=\"preserve\" font-size=\"{size:.1}\" x=\"{x:.2}\" y=\"{y:.2}\">{}</text>",
                        escape(text)
                    );
                }
                MathMark::Dot { at, radius } => {
                    let (x, y) = moved(*at);
                    let _ = writeln!(svg.0, "<circle class=\"ink\" cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\"/>");
                }
                MathMark::Line { points } => svg.path("rule", points.iter().copied().map(moved)),
            }
        }
    }
}
