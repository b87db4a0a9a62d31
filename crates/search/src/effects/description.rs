use super::{Addition, Coefficient, Direction, EffectSetting, ForceAxis, Form, Frame, coefficient, shared, with_words};
use sindyscope_values::term::{Expression, Layout, Symbol, Term};

/// What a term of a description is called where effects have names.
pub const DESCRIPTION: &str = "description";
/// Degree of the products.
const DEGREE: usize = 3;
/// Degree of the powers of one quantity alone.
const DEGREE_ALONE: usize = 5;
/// Inputs, at most, that are multiplied: of more, only the motion is.
const MOST_INPUTS: usize = 2;
/// Displacement from which on the sine of it can be told from a line and a cube, rad.
const LEAST_ANGLE: f64 = 0.5;

/// A quantity that formulas are made of.
struct DescriptionQuantity {
    value: Expression,
    /// Powers of length and of time in its unit; a force counts per unit of mass.
    dimension: (i32, i32),
    axis: ForceAxis,
    /// Its sine says more than a line and a cube.
    is_angle: bool,
}

/// Every term that a description may have: products of displacement, velocity and input to the third degree, their magnitudes, signs
/// and sines times products to the second, and powers of each alone to the fifth. They are no physics: what is found of them follows
/// the data.
pub(crate) fn described(setting: &EffectSetting) -> Vec<Form> {
    let mut forms: Vec<Form> = Vec::new();
    let mut known: Vec<(Vec<usize>, Term)> = Vec::new();
    let layout = Layout { freedoms: setting.masses(), inputs: setting.inputs.len(), ..Layout::default() };
    for frame in setting.frames() {
        let (first, second) = frame.site.masses();
        let masses: Vec<usize> = std::iter::once(first).chain(second).collect();
        for (term, coefficient, axis) in terms(&quantities(setting, frame)) {
            let place = (masses.clone(), term);
            if known.contains(&place) || setting.has(&place.1, frame.site) {
                continue;
            }
            let text = place.1.text(&layout);
            let text = if layout.freedoms > 1 { with_words(&text, &frame.form) } else { text };
            forms.push(form(&place.1, frame, coefficient, axis, text));
            known.push(place);
        }
    }
    super::joined(&mut forms);
    forms
}

/// What acts at a place; the input drives each mass by itself.
fn quantities(setting: &EffectSetting, frame: &Frame) -> Vec<DescriptionQuantity> {
    let own = |value, dimension, axis, is_angle| DescriptionQuantity { value, dimension, axis, is_angle };
    let mut all = vec![
        own(frame.r(), (1, 0), ForceAxis::Displacement, frame.reach > LEAST_ANGLE),
        own(frame.w(), (1, -1), ForceAxis::Velocity, false),
    ];
    let alone = matches!(frame.site, super::super::site::Site::Ground(_));
    if alone && setting.inputs.len() <= MOST_INPUTS {
        let driven = setting.inputs.iter().enumerate().filter(|(_, largest)| **largest > 0.0);
        all.extend(driven.map(|(j, _)| own(Symbol::Input(j).into(), (1, -2), ForceAxis::Input(j), false)));
    }
    all
}

/// The terms of some quantities, the plainest first.
fn terms(quantities: &[DescriptionQuantity]) -> Vec<(Term, Coefficient, ForceAxis)> {
    let mut out: Vec<(Term, Coefficient, ForceAxis)> = Vec::new();
    let mut offer = |powers: &[usize], factor: Option<(Expression, (i32, i32), usize)>| {
        let mut value = Expression::Number(1.0);
        let (mut length, mut time) = (1, -2);
        let mut over: Option<usize> = None;
        for (k, power) in powers.iter().enumerate().filter(|(_, power)| **power > 0) {
            let n = *power as i32;
            value = value * quantities[k].value.clone().power(f64::from(n));
            length -= n * quantities[k].dimension.0;
            time -= n * quantities[k].dimension.1;
            over = Some(k);
        }
        if let Some((factor, dimension, k)) = factor {
            value = value * factor;
            length -= dimension.0;
            time -= dimension.1;
            over = over.max(Some(k));
        }
        let axis = over.map_or(ForceAxis::Time, |k| quantities[k].axis);
        out.push((Term::new(value), coefficient("c", length, time, Direction::Any), axis));
    };
    for degree in 0..=DEGREE {
        for powers in products(quantities.len(), degree) {
            offer(&powers, None);
        }
    }
    for k in 0..quantities.len() {
        let alone =
            |power: usize| -> Vec<usize> { (0..quantities.len()).map(|i| if i == k { power } else { 0 }).collect() };
        (DEGREE + 1..=DEGREE_ALONE).for_each(|power| offer(&alone(power), None));
        for power in DEGREE..DEGREE_ALONE {
            offer(&alone(power), Some((quantities[k].value.clone().abs(), quantities[k].dimension, k)));
        }
    }
    for degree in 0..DEGREE {
        for powers in products(quantities.len(), degree) {
            for (k, quantity) in quantities.iter().enumerate() {
                offer(&powers, Some((quantity.value.clone().abs(), quantity.dimension, k)));
                // A sign times its own quantity is the magnitude.
                if powers[k] == 0 {
                    offer(&powers, Some((quantity.value.clone().sgn(), (0, 0), k)));
                }
                if quantity.is_angle {
                    offer(&powers, Some((quantity.value.clone().sin(), (0, 0), k)));
                }
            }
        }
    }
    out
}

/// The exponents of every product of so many quantities of a degree.
fn products(quantities: usize, degree: usize) -> Vec<Vec<usize>> {
    if quantities == 0 {
        return if degree == 0 { vec![Vec::new()] } else { Vec::new() };
    }
    let first = |power: usize| {
        let rest = products(quantities - 1, degree - power).into_iter();
        rest.map(move |rest| std::iter::once(power).chain(rest).collect())
    };
    (0..=degree).rev().flat_map(first).collect()
}

fn form(term: &Term, frame: &Frame, coefficient: Coefficient, axis: ForceAxis, text: String) -> Form {
    let term = term.clone();
    Form {
        effect: DESCRIPTION,
        title: "Description",
        explanation: "A formula that follows the missing force; it is no law of physics.",
        separates: "",
        formula: "",
        form: text,
        site: Some(frame.site),
        coefficients: vec![coefficient],
        inner: Vec::new(),
        contains: &[],
        axis,
        build: shared(move |_| Addition { terms: vec![term.clone()], ..Addition::default() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_are_products_and_functions_to_the_third_degree_each_once() {
        let quantity = |symbol: Symbol, axis| DescriptionQuantity {
            value: symbol.into(),
            dimension: (1, 0),
            axis,
            is_angle: symbol == Symbol::State(0),
        };
        let all = [
            quantity(Symbol::State(0), ForceAxis::Displacement),
            quantity(Symbol::Rate(0), ForceAxis::Velocity),
            quantity(Symbol::Input(0), ForceAxis::Input(0)),
        ];
        let found: Vec<Term> = terms(&all).into_iter().map(|(term, ..)| term).collect();
        for text in [
            "1",
            "x",
            "x*v*u",
            "x^2*u",
            "v^2",
            "x*|v|",
            "x*|x|",
            "v^2*sgn(x)",
            "sin(x)*v",
            "u*|v|",
            "|x|*v",
            "v^5",
            "v^4",
            "v^3*|v|",
        ] {
            let wanted = Term::parse(text).expect("a term");
            assert_eq!(found.iter().filter(|t| **t == wanted).count(), 1, "{text}");
        }
        assert!(!found.contains(&Term::parse("x^2*v^2").expect("a term")));
    }
}
