//! Units of terms and coefficients, from those of the channels; and which terms no units allow.

use crate::record::{Record, Role, parse_unit, unit_factors};
use crate::term::{Expression, Function, Kind, Layout, Symbol, Term};

/// The units of what a model's terms are made of; an empty text where a file gives none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Units {
    kind: Kind,
    displacements: Vec<String>,
    velocities: Vec<String>,
    inputs: Vec<String>,
    /// Unit of the force that terms add up to, where it is no acceleration.
    force: Option<String>,
}

/// A product of units with their powers, as they are written: `mm` once, `s` to the −2.
#[derive(Clone, Debug, Default, PartialEq)]
struct Measure(Vec<(String, f64)>);

impl Measure {
    fn one(unit: &str, power: f64) -> Self {
        Self(vec![(unit.to_owned(), power)])
    }

    /// What a header writes; a text that is no known unit stands for itself, and nothing is nothing known.
    fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        if text.is_empty() {
            return None;
        }
        let known = unit_factors(text).map(|factors| {
            let second = |name: &str| matches!(name, "sec" | "second" | "seconds");
            let named = |name: String| if second(&name) { "s".to_owned() } else { name };
            factors.into_iter().fold(Self::default(), |product, (name, power)| {
                if matches!(name.as_str(), "1" | "-") {
                    product
                } else {
                    product.times(&Self::one(&named(name), f64::from(power)), 1.0)
                }
            })
        });
        known.or_else(|| Some(Self::one(text, 1.0)))
    }

    /// This times another's power.
    fn times(mut self, other: &Self, power: f64) -> Self {
        for (name, exponent) in &other.0 {
            match self.0.iter_mut().find(|(known, _)| known == name) {
                Some((_, own)) => *own += power * exponent,
                None => self.0.push((name.clone(), power * exponent)),
            }
        }
        self.0.retain(|(_, power)| power.abs() > 1e-9);
        self
    }

    fn per_second(self, times: i32) -> Self {
        self.times(&Self::one("s", -1.0), f64::from(times))
    }

    /// Newtons as kg m/s² where that is shorter: what a metre per second squared and newton is, is one per kilogram.
    fn shortened(self) -> Self {
        let Some(power) = self.0.iter().find(|(name, _)| name == "N").map(|(_, power)| *power) else { return self };
        let newton = [("kg", 1.0), ("m", 1.0), ("s", -2.0), ("N", -1.0)];
        let parts = Self(newton.map(|(name, power)| (name.to_owned(), power)).to_vec());
        let other = self.clone().times(&parts, power);
        if other.0.len() < self.0.len() { other } else { self }
    }

    /// Powers of the base quantities and size in SI units; none if a part is no known unit.
    fn quantity(&self) -> Option<(Vec<f64>, f64)> {
        let mut powers: Vec<f64> = Vec::new();
        let mut size = 1.0;
        for (name, power) in &self.0 {
            let unit = parse_unit(name)?;
            powers.resize(unit.powers().len(), 0.0);
            for (sum, own) in powers.iter_mut().zip(unit.powers()) {
                *sum += power * f64::from(own);
            }
            size *= unit.factor.powf(*power);
        }
        powers.resize(crate::record::UNIT_BASES, 0.0);
        Some((powers, size))
    }

    /// Whether values in both may be added; none if that is not known.
    fn adds_to(&self, other: &Self) -> Option<bool> {
        if self == other {
            return Some(true);
        }
        let ((a, size), (b, other_size)) = (self.quantity()?, other.quantity()?);
        let alike = a.iter().zip(&b).all(|(p, q)| (p - q).abs() < 1e-9);
        Some(alike && (size / other_size - 1.0).abs() < 1e-9)
    }

    /// `m/s^2`, `1/(m^2 s^2)`; `1` for a plain number.
    fn text(&self) -> String {
        let mut factors = self.0.clone();
        // Kilograms first, seconds last, as one writes them.
        factors.sort_by_key(|(name, _)| match name.as_str() {
            "kg" => 0,
            "s" => 2,
            _ => 1,
        });
        let side = |sign: f64| -> Vec<String> {
            let part = |(name, power): &(String, f64)| match power * sign {
                p if p <= 0.0 => None,
                1.0 => Some(name.clone()),
                p => Some(format!("{name}^{p}")),
            };
            factors.iter().filter_map(part).collect()
        };
        let (above, below) = (side(1.0), side(-1.0));
        let above = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
        match below.len() {
            0 => above,
            1 => format!("{above}/{}", below[0]),
            _ => format!("{above}/({})", below.join(" ")),
        }
    }
}

/// What is known of an expression's unit.
enum UnitFound {
    /// A number, which has the unit that is asked of it.
    Any,
    Known(Measure),
    Unknown,
}

impl Units {
    /// The units of a record's channels; a velocity that is not measured has the displacement's per second.
    pub fn from_record(record: &Record, layout: &Layout) -> Self {
        let unit = |role: Role| record.channel(role).map(|c| c.unit.trim().to_owned()).unwrap_or_default();
        let displacements: Vec<String> = (0..layout.freedoms).map(|i| unit(Role::Displacement(i))).collect();
        let velocity = |i: usize| {
            let derived = || match displacements[i].as_str() {
                "" => String::new(),
                x => Measure::parse(x).unwrap_or_default().per_second(1).text(),
            };
            Some(unit(Role::Velocity(i))).filter(|u| !u.is_empty()).unwrap_or_else(derived)
        };
        Self {
            kind: layout.kind,
            velocities: (0..layout.freedoms).map(velocity).collect(),
            inputs: (0..layout.inputs).map(|j| unit(Role::Input(j))).collect(),
            displacements,
            force: None,
        }
    }

    /// The same where the terms of the velocities' equations add up to a force in this unit, as those of a component do.
    #[must_use]
    pub fn with_force(self, unit: &str) -> Self {
        Self { force: Some(unit.to_owned()), ..self }
    }

    /// The unit of a term's coefficient in the equation of a state's rate: `1/s^2`, `1` for a plain number; none if a
    /// file does not say.
    pub fn coefficient(&self, state: Symbol, term: &Term) -> Option<String> {
        self.measure(state, term).map(|measure| measure.text())
    }

    fn measure(&self, state: Symbol, term: &Term) -> Option<Measure> {
        let rate = match (&self.force, state) {
            (Some(force), Symbol::Rate(_)) => Measure::parse(force)?,
            _ => self.symbol(state)?.per_second(1),
        };
        let term = match self.expression(term.expression(), &mut |_| {}) {
            UnitFound::Any => Measure::default(),
            UnitFound::Known(measure) => measure,
            UnitFound::Unknown => return None,
        };
        Some(rate.times(&term, -1.0).shortened())
    }

    /// The unit of a term's coefficient where some units are replaced by others, and how many of it one of the file's is;
    /// `replaced` gives the other unit, and how many of it one is.
    pub fn coefficient_in<'a>(
        &self,
        state: Symbol,
        term: &Term,
        replaced: impl Fn(&str) -> Option<(&'a str, f64)>,
    ) -> Option<(String, f64)> {
        let measure = self.measure(state, term)?;
        let mut factor = 1.0;
        let mut shown = Measure::default();
        for (name, power) in &measure.0 {
            let (name, size) = replaced(name).unwrap_or((name, 1.0));
            factor *= size.powf(*power);
            shown = shown.times(&Measure::one(name, *power), 1.0);
        }
        Some((shown.text(), factor))
    }

    /// The unit of a symbol: `m/s`; none if a file does not say.
    pub fn of_symbol(&self, symbol: Symbol) -> Option<String> {
        self.symbol(symbol).map(|measure| measure.text())
    }

    /// Refuses a term that adds what cannot be added: `x-u` of a length and an acceleration.
    ///
    /// # Errors
    /// A sentence that says which parts are in which units. A part whose unit is not known fits any other, and so does one
    /// with a number in front, which may have a unit.
    pub fn check(&self, term: &Term, layout: &Layout) -> Result<(), String> {
        let mut clash = None;
        self.expression(term.expression(), &mut |parts| {
            if clash.is_none() {
                clash = Some(parts);
            }
        });
        let Some([(first, one), (second, two)]) = clash else { return Ok(()) };
        let (first, second) = (Term::new(first).text(layout), Term::new(second).text(layout));
        let what = term.text(layout);
        Err(format!(
            "{what} adds {first} in {} and {second} in {}: quantities in different units cannot be added or subtracted",
            one.text(),
            two.text()
        ))
    }

    fn symbol(&self, symbol: Symbol) -> Option<Measure> {
        let parsed = |units: &[String], i: usize| units.get(i).and_then(|u| Measure::parse(u));
        match symbol {
            Symbol::Time => Some(Measure::one("s", 1.0)),
            Symbol::State(i) => parsed(&self.displacements, i),
            Symbol::Rate(i) => parsed(&self.velocities, i),
            Symbol::Acceleration(i) => Some(parsed(&self.velocities, i)?.per_second(1)),
            Symbol::Internal(_) => None,
            Symbol::Input(j) => parsed(&self.inputs, j),
            Symbol::InputRate(j) => Some(parsed(&self.inputs, j)?.per_second(1)),
            Symbol::InputAcceleration(j) => Some(parsed(&self.inputs, j)?.per_second(2)),
        }
    }

    /// An expression's unit; `clash` is told two parts that are added and cannot be.
    fn expression(&self, expression: &Expression, clash: &mut impl FnMut([(Expression, Measure); 2])) -> UnitFound {
        match expression {
            Expression::Number(_) => UnitFound::Any,
            Expression::Symbol(s) => self.symbol(*s).map_or(UnitFound::Unknown, UnitFound::Known),
            Expression::Sum(parts) | Expression::Call(Function::Max | Function::Min, parts) => {
                self.joined(parts, clash)
            }
            Expression::Product(parts) => {
                let mut product = Measure::default();
                for part in parts {
                    match self.expression(part, clash) {
                        UnitFound::Any => {}
                        UnitFound::Known(measure) => product = product.times(&measure, 1.0),
                        UnitFound::Unknown => return UnitFound::Unknown,
                    }
                }
                UnitFound::Known(product)
            }
            Expression::Power(base, power) => match self.expression(base, clash) {
                UnitFound::Known(measure) => UnitFound::Known(Measure::default().times(&measure, *power)),
                other => other,
            },
            Expression::Call(function, parts) => {
                let mut found = parts.iter().map(|p| self.expression(p, clash)).collect::<Vec<_>>().into_iter();
                match (function, found.next()) {
                    (Function::Sqrt, Some(UnitFound::Known(measure))) => {
                        UnitFound::Known(Measure::default().times(&measure, 0.5))
                    }
                    (Function::Abs | Function::Clip | Function::DeadZone | Function::Sqrt, Some(first)) => first,
                    // What else a function makes of its argument is a plain number.
                    _ => UnitFound::Known(Measure::default()),
                }
            }
        }
    }

    /// The unit of parts that are added or chosen from.
    fn joined(&self, parts: &[Expression], clash: &mut impl FnMut([(Expression, Measure); 2])) -> UnitFound {
        let mut first: Option<(Expression, Measure)> = None;
        let mut unknown = false;
        for part in parts {
            match self.expression(part, clash) {
                UnitFound::Any => {}
                UnitFound::Unknown => unknown = true,
                UnitFound::Known(_) if scaled(part) => {}
                UnitFound::Known(measure) => match &first {
                    None => first = Some((bare(part), measure)),
                    Some((other, one)) if one.adds_to(&measure) == Some(false) => {
                        clash([(other.clone(), one.clone()), (bare(part), measure)]);
                    }
                    Some(_) => {}
                },
            }
        }
        match first {
            Some((_, measure)) => UnitFound::Known(measure),
            None if unknown || parts.iter().any(scaled) => UnitFound::Unknown,
            None => UnitFound::Any,
        }
    }
}

/// The number in front of a product, other than a sign.
fn scaled(part: &Expression) -> bool {
    matches!(part, Expression::Product(parts) if matches!(parts.first(), Some(Expression::Number(n)) if n.abs() != 1.0))
}

/// A part of a sum without its sign.
fn bare(part: &Expression) -> Expression {
    match part {
        Expression::Product(parts) if matches!(parts.first(), Some(Expression::Number(_))) => {
            Expression::Product(parts[1..].to_vec())
        }
        other => other.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::record::Channel;

    const LAYOUT: Layout = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: 1, internals: 0 };

    /// Units of a record whose channels are given as `x [m],u [N]`.
    fn units(channels: &str) -> Units {
        let channel = |text: &str| {
            let (name, unit) = text.split_once(" [").unwrap_or((text, ""));
            let role = if name == "x" { Role::Displacement(0) } else { Role::Input(0) };
            let unit = unit.trim_end_matches(']').to_owned();
            Channel { role, name: name.to_owned(), unit, values: Arc::new([0.0; 30]), estimated: false }
        };
        let record = Record {
            name: "a".into(),
            source: None,
            start: 0.0,
            interval: 1.0,
            channels: channels.split(',').map(channel).collect(),
            notices: Vec::new(),
        };
        Units::from_record(&record, &LAYOUT)
    }

    #[test]
    fn coefficients_have_the_unit_that_makes_the_term_an_acceleration() {
        for (header, pairs) in [
            (
                "x [m],u [m]",
                &[
                    ("x", "1/s^2"),
                    ("v", "1/s"),
                    ("x^3", "1/(m^2 s^2)"),
                    ("sgn(v)", "m/s^2"),
                    ("v*|v|", "1/m"),
                    ("x^2*v", "1/(m^2 s)"),
                    ("u", "1/s^2"),
                    ("sgn(v-du)", "m/s^2"),
                    ("1", "m/s^2"),
                    ("t", "m/s^3"),
                    ("clip(x,0.1)", "1/s^2"),
                    ("sqrt(|x|)", "m^0.5/s^2"),
                ][..],
            ),
            ("x [m],u [N]", &[("u", "1/kg"), ("du", "s/kg")]),
            ("x [mm],u [N]", &[("u", "mm/(N s^2)")]),
            ("x [m],u [m/s^2]", &[("u", "1"), ("du", "s")]),
            ("x [rad],u [N m]", &[("sin(x)", "rad/s^2"), ("u", "rad/(kg m^2)")]),
            ("x [V],u [V]", &[("x^3", "1/(V^2 s^2)")]),
        ] {
            let units = units(header);
            for (term, unit) in pairs {
                let found = units.coefficient(Symbol::Rate(0), &Term::parse(term).unwrap());
                assert_eq!(found.as_deref(), Some(*unit), "{header} {term}");
            }
        }
    }

    #[test]
    fn coefficients_are_told_in_other_units() {
        let units = units("x [m],u [N]");
        let millimetres = |name: &str| (name == "m").then_some(("mm", 1e3));
        for (term, unit, factor) in
            [("x", "1/s^2", 1.0), ("x^3", "1/(mm^2 s^2)", 1e-6), ("sgn(v)", "mm/s^2", 1e3), ("u", "1/kg", 1.0)]
        {
            let (found, times) =
                units.coefficient_in(Symbol::Rate(0), &Term::parse(term).unwrap(), millimetres).unwrap();
            assert_eq!(found, unit, "{term}");
            assert!((times / factor - 1.0).abs() < 1e-12, "{term}: {times}");
        }
    }

    #[test]
    fn nothing_is_said_where_a_file_says_nothing() {
        let units = units("x,u [N]");
        assert_eq!(units.coefficient(Symbol::Rate(0), &Term::parse("x").unwrap()), None);
        assert_eq!(units.check(&Term::parse("x-u").unwrap(), &LAYOUT), Ok(()));
    }

    #[test]
    fn lengths_and_accelerations_are_not_added() {
        let check = |header: &str, term: &str| units(header).check(&Term::parse(term).unwrap(), &LAYOUT);
        assert_eq!(
            check("x [m],u [m/s^2]", "x-u").unwrap_err(),
            "x-u adds x in m and u in m/s^2: quantities in different units cannot be added or subtracted"
        );
        for (header, term) in [
            ("x [m],u [N]", "x-u"),
            ("x [m],u [N]", "sgn(v-du)"),
            ("x [m],u [m]", "max(x,v)"),
            ("x [m],u [m]", "(x+v)^2"),
        ] {
            assert!(check(header, term).is_err(), "{header} {term}");
        }
        for (header, term) in [
            ("x [m],u [m]", "v-du"),
            ("x [m],u [m]", "x-0.002"),
            ("x [m],u [N]", "x-0.5*u"),
            ("x [m],u [m]", "clip(x-u,0.1)"),
            ("x [m],u [m]", "tanh(100*v)"),
        ] {
            assert_eq!(check(header, term), Ok(()), "{header} {term}");
        }
    }
}
