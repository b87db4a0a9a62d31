//! Units with the SI prefix that suits the data.

use super::number;
use super::number::superscript;

/// Units that take prefixes; a unit that begins with another one is shown unchanged.
const PREFIXED: [&str; 13] = ["m", "N", "V", "A", "s", "Hz", "Pa", "rad", "W", "J", "Nm", "N·m", "T"];

pub(super) const PREFIXES: [(&str, i32); 8] =
    [("p", -12), ("n", -9), ("µ", -6), ("m", -3), ("", 0), ("k", 3), ("M", 6), ("G", 9)];

/// How values of one quantity are shown: shown value = value × `factor`, in `unit`.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Shown value per value.
    pub factor: f64,
    /// The unit of the shown value; empty for plain numbers.
    pub unit: String,
}

impl Scale {
    /// Values shown as they stand.
    pub fn plain(unit: impl Into<String>) -> Self {
        Self { factor: 1.0, unit: unit.into() }
    }

    /// The scale under which the largest magnitude `largest`, given in `unit`, is between 1 and 1000, or between 0.1 and
    /// 1000 without a prefix. Units without prefixes, and plain numbers that need no power of ten, stay as they are.
    pub fn suited(largest: f64, unit: &str) -> Self {
        let unit = unit.trim();
        if !(largest > 0.0 && largest.is_finite()) {
            return Self::plain(unit);
        }
        if unit.is_empty() {
            return plain_number(largest);
        }
        let (head, rest) = head_of(unit);
        let Some((power, base)) = split_prefix(head) else { return Self::plain(unit) };
        let in_base = largest * 10f64.powi(power);
        let (prefix, chosen) = if (0.1..1e3).contains(&in_base) {
            ("", 0)
        } else {
            let most = if base == "s" { 0 } else { 9 };
            let fits = |p: &&(&str, i32)| p.1 <= most && in_base >= 10f64.powi(p.1) * (1.0 - 1e-9);
            PREFIXES.iter().rev().find(fits).copied().unwrap_or(PREFIXES[0])
        };
        Self { factor: 10f64.powi(power - chosen), unit: format!("{prefix}{base}{rest}") }
    }

    /// `symbol (unit)`, the label of an axis.
    pub fn axis(&self, symbol: &str) -> String {
        if self.unit.is_empty() { symbol.to_owned() } else { format!("{symbol} ({})", self.unit) }
    }

    /// A value with `digits` significant digits and its unit.
    pub fn format(&self, value: f64, digits: usize) -> String {
        let text = number::significant(value * self.factor, digits);
        match self.unit.as_str() {
            "" => text,
            power if power.starts_with('×') => text + power,
            unit => format!("{text} {unit}"),
        }
    }
}

/// A value in the prefix that suits it alone: `format_si(2.5e-6, "m", 3)` is `2.50 µm`.
pub fn format_si(value: f64, unit: &str, digits: usize) -> String {
    Scale::suited(value.abs(), unit).format(value, digits)
}

/// Powers in the units of a text as one reads them: `m/s²`.
pub fn raised(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('^') {
        out.push_str(&rest[..at]);
        rest = &rest[at + 1..];
        let end = rest
            .char_indices()
            .find(|(k, c)| !(c.is_ascii_digit() || *k == 0 && *c == '-'))
            .map_or(rest.len(), |(k, _)| k);
        match rest[..end].parse() {
            Ok(power) => out.push_str(&superscript(power)),
            Err(_) => out.push('^'),
        }
        rest = if rest[..end].parse::<i32>().is_ok() { &rest[end..] } else { rest };
    }
    out + rest
}

/// A product of powers as the tables of coefficients write it: `m^-2 s^-1` becomes `1/(m² s)`.
pub fn as_fraction(unit: &str) -> String {
    if unit.contains(['/', '(']) {
        return raised(unit);
    }
    let (mut above, mut below) = (Vec::new(), Vec::new());
    for factor in unit.split_whitespace() {
        match factor.split_once("^-") {
            Some((name, "1")) => below.push(name.to_owned()),
            Some((name, power)) => below.push(format!("{name}^{power}")),
            None => above.push(factor.to_owned()),
        }
    }
    let above = if above.is_empty() && !below.is_empty() { "1".to_owned() } else { above.join(" ") };
    raised(&match below.len() {
        0 => above,
        1 => format!("{above}/{}", below[0]),
        _ => format!("{above}/({})", below.join(" ")),
    })
}

/// The unit of a rate: `mm` becomes `mm/s`, `m/s^2` becomes `m/s³`.
pub fn per_second(unit: &str) -> String {
    let unit = raised(unit.trim());
    let (head, power) = match unit.rsplit_once("/s") {
        Some((head, "")) => (head, 1),
        Some((head, "²")) => (head, 2),
        Some((head, "³")) => (head, 3),
        _ => (unit.as_str(), 0),
    };
    match (head, power) {
        ("", _) => String::new(),
        (head, 0) => format!("{head}/s"),
        (head, power) => format!("{head}/s{}", superscript(power + 1)),
    }
}

/// The part of a unit that bears the prefix, and the rest: `mm` and `/s²`.
pub(super) fn head_of(unit: &str) -> (&str, &str) {
    let end = unit.find(['/', '*', '·', ' ', '(']).filter(|_| !unit.starts_with("N·m"));
    unit.split_at(end.unwrap_or(unit.len()))
}

/// Power of ten of a unit's prefix, and the unit without it.
pub(super) fn split_prefix(head: &str) -> Option<(i32, &str)> {
    if PREFIXED.contains(&head) {
        return Some((0, head));
    }
    let first = head.chars().next()?;
    let base = &head[first.len_utf8()..];
    let letter = match first {
        'u' | 'μ' => "µ",
        _ => &head[..first.len_utf8()],
    };
    let power = PREFIXES.iter().find(|(p, _)| *p == letter).map(|(_, power)| *power);
    match head {
        "cm" => Some((-2, "m")),
        "dm" => Some((-1, "m")),
        _ => power.filter(|_| PREFIXED.contains(&base)).map(|p| (p, base)),
    }
}

fn plain_number(largest: f64) -> Scale {
    if (1e-2..1e5).contains(&largest) {
        return Scale::plain("");
    }
    let power = 3 * (largest.log10() / 3.0 + 1e-9).floor() as i32;
    Scale { factor: 10f64.powi(-power), unit: format!("×10{}", superscript(power)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_raised() {
        assert_eq!(raised("0.08 m/s^2 or m^-2 s^-12, x^y"), "0.08 m/s² or m⁻² s⁻¹², x^y");
    }

    #[test]
    fn products_of_powers_are_written_as_fractions() {
        for (unit, shown) in [
            ("m^-2 s^-1", "1/(m² s)"),
            ("s^-2", "1/s²"),
            ("m/s^2", "m/s²"),
            ("m^2 s^-1", "m²/s"),
            ("", ""),
            ("rad", "rad"),
        ] {
            assert_eq!(as_fraction(unit), shown, "{unit}");
        }
    }

    #[test]
    fn prefixes_suit_the_data() {
        for (largest, unit, shown, factor) in [
            (2.5e-3, "m", "mm", 1e3),
            (2.5e-3, "mm", "µm", 1e3),
            (9.0e-7, "m", "nm", 1e9),
            (0.9, "m", "m", 1.0),
            (0.09, "m", "mm", 1e3),
            (999.0, "mm", "m", 1e-3),
            (50.0, "mm", "mm", 1.0),
            (12.0, "mm/s", "mm/s", 1.0),
            (0.012, "m/s²", "mm/s²", 1e3),
            (2500.0, "N", "kN", 1e-3),
            (1e-6, "m", "µm", 1e6),
            (1e-15, "m", "pm", 1e12),
            (5e4, "s", "s", 1.0),
            (0.02, "s", "ms", 1e3),
            (3e-5, "in", "in", 1.0),
            (1e-5, "°", "°", 1.0),
            (3.0, "um", "µm", 1.0),
            (0.3, "cm", "mm", 10.0),
            (0.0, "m", "m", 1.0),
            (f64::NAN, "m", "m", 1.0),
            (3.0, "", "", 1.0),
            (3e-6, "", "×10⁻⁶", 1e6),
            (4e7, "", "×10⁶", 1e-6),
            (2e-5, "m^2", "m^2", 1.0),
        ] {
            let scale = Scale::suited(largest, unit);
            assert_eq!(scale.unit, shown, "{largest} {unit}");
            assert!((scale.factor / factor - 1.0).abs() < 1e-12, "{largest} {unit}: {}", scale.factor);
        }
    }

    #[test]
    fn labels_and_values_carry_their_unit() {
        let scale = Scale::suited(2.5e-3, "m");
        assert_eq!(scale.axis("x"), "x (mm)");
        assert_eq!(scale.format(-1.23456e-3, 4), "−1.235 mm");
        assert_eq!(Scale::plain("").axis("u"), "u");
        assert_eq!(format_si(2.5e-6, "m", 3), "2.50 µm");
        assert_eq!(format_si(0.0, "m", 3), "0 m");
        assert_eq!(format_si(2.34e-8, "", 2), "23×10⁻⁹");
        assert_eq!(per_second("mm"), "mm/s");
        assert_eq!(per_second("mm/s"), "mm/s²");
        assert_eq!(per_second("m/s^2"), "m/s³");
        assert_eq!(per_second("mm/s²"), "mm/s³");
        assert_eq!(per_second("N"), "N/s");
        assert_eq!(per_second(""), "");
    }
}
