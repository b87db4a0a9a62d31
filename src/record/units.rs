//! Units as headers write them: which texts are one, and how lengths and times convert.

/// What a unit's text says as far as lengths and times go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unit {
    /// Power of length.
    pub(super) length: i32,
    /// Power of time.
    pub(super) time: i32,
    /// True if another quantity is in it too (force, voltage, angle, …).
    pub(super) other: bool,
    /// Size in SI units, of the part that is length and time.
    pub(super) factor: f64,
}

impl Unit {
    /// True for a length: m, mm, inch, …
    pub(super) fn is_length(&self) -> bool {
        self.length == 1 && self.time == 0 && !self.other
    }

    /// True for a time: s, ms, min, …
    pub(super) fn is_time(&self) -> bool {
        self.length == 0 && self.time == 1 && !self.other
    }

    /// True for a change per time: m/s, rad/s, V/s, …
    pub(super) fn is_rate(&self) -> bool {
        self.time == -1
    }

    /// True for what an accelerometer gives: m/s², rad/s².
    pub(super) fn is_acceleration(&self) -> bool {
        self.time == -2
    }
}

const ONE: Unit = Unit { length: 0, time: 0, other: true, factor: 1.0 };

const fn length(factor: f64) -> Unit {
    Unit { length: 1, time: 0, other: false, factor }
}

const fn time(factor: f64) -> Unit {
    Unit { length: 0, time: 1, other: false, factor }
}

/// Units that take the prefixes of the SI.
const SI: &[(&str, Unit)] = &[
    ("m", length(1.0)),
    ("meter", length(1.0)),
    ("meters", length(1.0)),
    ("metre", length(1.0)),
    ("metres", length(1.0)),
    ("s", time(1.0)),
    ("sec", time(1.0)),
    ("second", time(1.0)),
    ("seconds", time(1.0)),
    ("Hz", Unit { length: 0, time: -1, other: true, factor: 1.0 }),
    ("N", ONE),
    ("newton", ONE),
    ("newtons", ONE),
    ("V", ONE),
    ("volt", ONE),
    ("volts", ONE),
    ("A", ONE),
    ("Pa", ONE),
    ("g", ONE),
    ("rad", ONE),
    ("strain", ONE),
    ("ε", ONE),
    ("J", ONE),
    ("W", ONE),
    ("K", ONE),
];

/// Units that stand alone.
const OTHERS: &[(&str, Unit)] = &[
    ("micron", length(1e-6)),
    ("microns", length(1e-6)),
    ("in", length(0.0254)),
    ("inch", length(0.0254)),
    ("inches", length(0.0254)),
    ("mil", length(2.54e-5)),
    ("ft", length(0.3048)),
    ("min", time(60.0)),
    ("minute", time(60.0)),
    ("minutes", time(60.0)),
    ("h", time(3600.0)),
    ("hour", time(3600.0)),
    ("hours", time(3600.0)),
    ("rpm", Unit { length: 0, time: -1, other: true, factor: 1.0 / 60.0 }),
    ("deg", ONE),
    ("degree", ONE),
    ("degrees", ONE),
    ("°", ONE),
    ("°C", ONE),
    ("degC", ONE),
    ("%", ONE),
    ("‰", ONE),
    ("bar", ONE),
    ("psi", ONE),
    ("lb", ONE),
    ("lbf", ONE),
    ("kip", ONE),
    ("dB", ONE),
    ("px", ONE),
    ("pixel", ONE),
    ("pixels", ONE),
    ("counts", ONE),
    ("LSB", ONE),
    ("1", ONE),
    ("-", ONE),
];

const PREFIXES: &[(&str, f64)] = &[
    ("p", 1e-12),
    ("n", 1e-9),
    ("u", 1e-6),
    ("µ", 1e-6),
    ("μ", 1e-6),
    ("m", 1e-3),
    ("c", 1e-2),
    ("d", 1e-1),
    ("k", 1e3),
    ("M", 1e6),
    ("G", 1e9),
    ("nano", 1e-9),
    ("micro", 1e-6),
    ("milli", 1e-3),
    ("centi", 1e-2),
    ("kilo", 1e3),
    ("mega", 1e6),
];

/// A unit without powers, products or quotients.
fn simple(text: &str) -> Option<Unit> {
    let find = |table: &[(&str, Unit)], text: &str| table.iter().find(|(name, _)| *name == text).map(|(_, unit)| *unit);
    find(SI, text).or_else(|| find(OTHERS, text)).or_else(|| {
        PREFIXES.iter().find_map(|(prefix, size)| {
            let unit = find(SI, text.strip_prefix(prefix)?)?;
            // Nobody vibrates over megametres or gigaseconds: there `Mm` is a way of writing `mm`.
            let odd = *size > 1e3 && !unit.other;
            (!odd).then_some(Unit { factor: size * unit.factor, ..unit })
        })
    })
}

/// A unit with its power: `s^2`, `s²`, `s**2`, `s2`, `s^-1`.
fn powered(text: &str) -> Option<Unit> {
    let plain: String = text
        .chars()
        .map(|c| match c {
            '⁻' => '-',
            '¹' => '1',
            '²' => '2',
            '³' => '3',
            '⁴' => '4',
            other => other,
        })
        .collect();
    let digits = plain.trim_start_matches(|c: char| !c.is_ascii_digit() && c != '-');
    let (name, power) = match digits.parse::<i32>() {
        Ok(power) if (-4..=4).contains(&power) && digits.len() < plain.len() => {
            (plain[..plain.len() - digits.len()].trim_end_matches(['^', '*']), power)
        }
        _ => (plain.as_str(), 1),
    };
    let unit = simple(name)?;
    Some(Unit {
        length: unit.length * power,
        time: unit.time * power,
        other: unit.other,
        factor: unit.factor.powi(power),
    })
}

/// The length of a unit in metres; none if it is no length. Without a unit lengths are in metres.
pub fn metres(unit: &str) -> Option<f64> {
    if unit.trim().is_empty() {
        return Some(1.0);
    }
    parse(unit).filter(Unit::is_length).map(|u| u.factor)
}

/// Reads a unit's text (`mm`, `m/s^2`, `N·m`); none if it is no unit that is known.
pub(super) fn parse(text: &str) -> Option<Unit> {
    let text = text.trim();
    if let Some(unit) = powered(text) {
        return Some(unit);
    }
    let mut product = Unit { length: 0, time: 0, other: false, factor: 1.0 };
    let mut below = false;
    let mut factors = 0;
    for piece in text.split_inclusive(['/', '*', '·', '⋅', '.', ' ', '(', ')']) {
        let name = piece.trim_end_matches(['/', '*', '·', '⋅', '.', ' ', '(', ')']);
        if name == "per" {
            below = true;
        } else if !name.is_empty() {
            let unit = powered(name)?;
            let sign = if below { -1 } else { 1 };
            product.length += sign * unit.length;
            product.time += sign * unit.time;
            product.other |= unit.other;
            product.factor *= unit.factor.powi(sign);
            factors += 1;
        }
        below |= piece.ends_with('/');
    }
    (factors > 1).then_some(product)
}

/// The unit that the trailing words of an underscored name give, with the number of words that it takes: `mm`, `m s2`.
///
/// `in` counts as a preposition (`u_in`), and a single letter only in its own case, unless the name shouts (`X_M`).
pub(super) fn of_words(words: &[&str]) -> Option<(String, usize)> {
    let shouts = words.iter().all(|w| !w.contains(char::is_lowercase));
    let single = |word: &str| -> Option<String> {
        if word == "in" || word == "1" || word == "-" {
            return None;
        }
        let lower = word.to_lowercase();
        if shouts && matches!(word, "S" | "M" | "MS" | "US" | "MM" | "UM" | "NM" | "CM" | "KM") {
            return Some(lower);
        }
        if parse(word).is_some() {
            return Some(word.to_owned());
        }
        (lower.len() > 1 && parse(&lower).is_some()).then_some(lower)
    };
    let last = words.len().checked_sub(1)?;
    if last >= 1
        && let Some(bottom) = single(words[last]).filter(|b| matches!(b.as_str(), "s" | "s2" | "s^2" | "s²"))
    {
        let (top, taken) =
            if words[last - 1].eq_ignore_ascii_case("per") && last >= 2 { (last - 2, 3) } else { (last - 1, 2) };
        if let Some(top) = single(words[top]).filter(|t| parse(t).is_some_and(|u| u.time == 0)) {
            let power = if bottom == "s" { "s" } else { "s^2" };
            return Some((format!("{top}/{power}"), taken));
        }
    }
    single(words[last]).map(|unit| (unit, 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_and_times_have_their_size() {
        for (text, length, time, factor) in [
            ("m", 1, 0, 1.0),
            ("mm", 1, 0, 1e-3),
            ("µm", 1, 0, 1e-6),
            ("micrometers", 1, 0, 1e-6),
            ("in", 1, 0, 0.0254),
            ("ms", 0, 1, 1e-3),
            ("min", 0, 1, 60.0),
            ("m/s", 1, -1, 1.0),
            ("mm/s^2", 1, -2, 1e-3),
            ("m s^-2", 1, -2, 1.0),
            ("m/s²", 1, -2, 1.0),
            ("m per s", 1, -1, 1.0),
        ] {
            let unit = parse(text).unwrap();
            assert_eq!((unit.length, unit.time, unit.other), (length, time, false), "{text}");
            // One rounding of the factor's product.
            assert!((unit.factor / factor - 1.0).abs() < 1e-15, "{text}");
        }
    }

    #[test]
    fn other_units_are_known_and_words_are_not() {
        for text in ["V", "mV/g", "N·m", "N m", "µε", "microstrain", "deg", "%", "kN", "rad/s", "°C"] {
            assert!(parse(text).is_some_and(|u| u.other), "{text}");
        }
        for text in ["", "out", "mass", "rel", "filtered", "x", "left/right", "é", "-1", "^2", "²"] {
            assert_eq!(parse(text), None, "{text}");
        }
    }

    #[test]
    fn trailing_words_give_the_unit() {
        for (words, unit) in [
            (&["base", "m"][..], Some(("m", 1))),
            (&["m", "s"], Some(("m/s", 2))),
            (&["mm", "s2"], Some(("mm/s^2", 2))),
            (&["m", "per", "s"], Some(("m/s", 3))),
            (&["in", "V"], Some(("V", 1))),
            (&["BASE", "MM"], Some(("mm", 1))),
            (&["in"], None),
            (&["a"], None),
            (&["mass"], None),
            (&[], None),
        ] {
            assert_eq!(of_words(words), unit.map(|(u, n)| (u.to_owned(), n)), "{words:?}");
        }
    }
}
