//! Units as headers write them: which texts are one, what they measure, and how they convert.

/// Quantities that units are powers of; a volt stands for itself, since here it is what a sensor gives.
#[derive(Clone, Copy)]
enum BaseUnit {
    Length,
    Time,
    Mass,
    Angle,
    Voltage,
    Current,
    Kelvin,
    Celsius,
    Strain,
    Pixel,
    Count,
    Level,
}

/// Number of base quantities.
pub const BASES: usize = BaseUnit::Level as usize + 1;

/// What a unit measures and how large it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Power of each base quantity.
    powers: [i32; BASES],
    /// Size in SI units: metres, seconds, kilograms, radians, volts, …
    pub factor: f64,
}

impl Unit {
    const ONE: Self = Self { powers: [0; BASES], factor: 1.0 };

    const fn simple(base: BaseUnit, factor: f64) -> Self {
        let mut powers = [0; BASES];
        powers[base as usize] = 1;
        Self { powers, factor }
    }

    /// A mechanical unit: powers of length, time and mass.
    const fn mechanical(length: i32, time: i32, mass: i32, factor: f64) -> Self {
        let mut powers = [0; BASES];
        powers[BaseUnit::Length as usize] = length;
        powers[BaseUnit::Time as usize] = time;
        powers[BaseUnit::Mass as usize] = mass;
        Self { powers, factor }
    }

    const fn per_second(mut self) -> Self {
        self.powers[BaseUnit::Time as usize] -= 1;
        self
    }

    fn power(&self, base: BaseUnit) -> i32 {
        self.powers[base as usize]
    }

    /// This unit times another's power.
    fn times(mut self, other: &Self, power: i32) -> Self {
        for (own, other) in self.powers.iter_mut().zip(other.powers) {
            *own += power * other;
        }
        self.factor *= other.factor.powi(power);
        self
    }

    /// The power of every base quantity.
    pub fn powers(&self) -> [i32; BASES] {
        self.powers
    }

    /// True if both measure one quantity.
    pub fn is_like(&self, other: &Self) -> bool {
        self.powers == other.powers
    }

    /// How many times seconds divide this unit to the quantity of another, if from none to twice: 1 for `m` and `mm/s`.
    pub fn rates_to(&self, other: &Self) -> Option<i32> {
        let second = Self::simple(BaseUnit::Time, 1.0);
        (0..=2).find(|n| self.times(&second, -n).is_like(other)).filter(|_| !self.is_like(&Self::ONE))
    }

    /// True for a length: m, mm, inch, …
    pub fn is_length(&self) -> bool {
        self.is_like(&Self::simple(BaseUnit::Length, 1.0))
    }

    /// True for an angle: rad, degrees, …
    pub fn is_angle(&self) -> bool {
        self.is_like(&Self::simple(BaseUnit::Angle, 1.0))
    }

    /// True for a force or a moment: N, lbf, N·m, …
    pub fn is_force(&self) -> bool {
        self.is_like(&Self::mechanical(1, -2, 1, 1.0)) || self.is_like(&Self::mechanical(2, -2, 1, 1.0))
    }

    /// True for a time: s, ms, min, …
    pub fn is_time(&self) -> bool {
        self.is_like(&Self::simple(BaseUnit::Time, 1.0))
    }

    /// True for a change per time: m/s, rad/s, V/s, …
    pub fn is_rate(&self) -> bool {
        self.power(BaseUnit::Time) == -1 && self.power(BaseUnit::Mass) == 0
    }

    /// True for what an accelerometer gives: m/s², rad/s², g.
    pub fn is_acceleration(&self) -> bool {
        self.power(BaseUnit::Time) == -2 && self.power(BaseUnit::Mass) == 0
    }

    /// True for a plain frequency.
    pub fn is_frequency(&self) -> bool {
        self.is_like(&Self::mechanical(0, -1, 0, 1.0))
    }
}

const fn length(factor: f64) -> Unit {
    Unit::simple(BaseUnit::Length, factor)
}

const fn time(factor: f64) -> Unit {
    Unit::simple(BaseUnit::Time, factor)
}

const fn force(factor: f64) -> Unit {
    Unit::mechanical(1, -2, 1, factor)
}

const fn pressure(factor: f64) -> Unit {
    Unit::mechanical(-1, -2, 1, factor)
}

const fn angle(factor: f64) -> Unit {
    Unit::simple(BaseUnit::Angle, factor)
}

/// One degree, rad.
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Standard gravity, m/s².
const GRAVITY: f64 = 9.80665;
/// One pound-force, N.
const POUND: f64 = 4.448_221_615_260_5;

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
    ("Hz", Unit::mechanical(0, -1, 0, 1.0)),
    ("N", force(1.0)),
    ("newton", force(1.0)),
    ("newtons", force(1.0)),
    ("V", Unit::simple(BaseUnit::Voltage, 1.0)),
    ("volt", Unit::simple(BaseUnit::Voltage, 1.0)),
    ("volts", Unit::simple(BaseUnit::Voltage, 1.0)),
    ("A", Unit::simple(BaseUnit::Current, 1.0)),
    ("Pa", pressure(1.0)),
    ("g", Unit::mechanical(1, -2, 0, GRAVITY)),
    ("rad", angle(1.0)),
    ("strain", Unit::simple(BaseUnit::Strain, 1.0)),
    ("ε", Unit::simple(BaseUnit::Strain, 1.0)),
    ("J", Unit::mechanical(2, -2, 1, 1.0)),
    ("Nm", Unit::mechanical(2, -2, 1, 1.0)),
    ("W", Unit::mechanical(2, -3, 1, 1.0)),
    ("K", Unit::simple(BaseUnit::Kelvin, 1.0)),
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
    ("kg", Unit::simple(BaseUnit::Mass, 1.0)),
    ("rpm", Unit { factor: 6.0 * DEGREE, ..Unit::simple(BaseUnit::Angle, 1.0).per_second() }),
    ("deg", angle(DEGREE)),
    ("degree", angle(DEGREE)),
    ("degrees", angle(DEGREE)),
    ("°", angle(DEGREE)),
    ("°C", Unit::simple(BaseUnit::Celsius, 1.0)),
    ("degC", Unit::simple(BaseUnit::Celsius, 1.0)),
    ("%", Unit { factor: 1e-2, ..Unit::ONE }),
    ("‰", Unit { factor: 1e-3, ..Unit::ONE }),
    ("bar", pressure(1e5)),
    ("psi", pressure(POUND / (0.0254 * 0.0254))),
    ("lb", force(POUND)),
    ("lbf", force(POUND)),
    ("pound", force(POUND)),
    ("pounds", force(POUND)),
    ("kip", force(1e3 * POUND)),
    ("dB", Unit::simple(BaseUnit::Level, 1.0)),
    ("px", Unit::simple(BaseUnit::Pixel, 1.0)),
    ("pixel", Unit::simple(BaseUnit::Pixel, 1.0)),
    ("pixels", Unit::simple(BaseUnit::Pixel, 1.0)),
    ("counts", Unit::simple(BaseUnit::Count, 1.0)),
    ("LSB", Unit::simple(BaseUnit::Count, 1.0)),
    ("1", Unit::ONE),
    ("-", Unit::ONE),
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
            let odd = *size > 1e3 && (unit.is_length() || unit.is_time());
            (!odd).then_some(Unit { factor: size * unit.factor, ..unit })
        })
    })
}

/// A unit's name and its power: `s^2`, `s²`, `s**2`, `s2`, `s^-1`.
fn powered(text: &str) -> Option<(String, i32)> {
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
    simple(name).map(|_| (name.to_owned(), power))
}

/// The length of a unit in metres; none if it is no length. Without a unit lengths are in metres.
pub fn metres(unit: &str) -> Option<f64> {
    if unit.trim().is_empty() {
        return Some(1.0);
    }
    parse(unit).filter(Unit::is_length).map(|u| u.factor)
}

/// Reads a unit's text (`mm`, `m/s^2`, `N·m`); none if it is no unit that is known.
pub fn parse(text: &str) -> Option<Unit> {
    let factors = factors(text)?;
    let product = |unit: Unit, (name, power): &(String, i32)| Some(unit.times(&simple(name)?, *power));
    factors.iter().try_fold(Unit::ONE, product)
}

/// A unit's factors, each with its power: `m` once and `s` to the −2 for `m/s^2`; none if it is no unit that is known.
pub fn factors(text: &str) -> Option<Vec<(String, i32)>> {
    let text = text.trim();
    if let Some(unit) = powered(text) {
        return Some(vec![unit]);
    }
    let mut factors = Vec::new();
    let mut below = false;
    for piece in text.split_inclusive(['/', '*', '·', '⋅', '.', ' ', '(', ')']) {
        let name = piece.trim_end_matches(['/', '*', '·', '⋅', '.', ' ', '(', ')']);
        if name == "per" {
            below = true;
        } else if !name.is_empty() {
            let (name, power) = powered(name)?;
            factors.push((name, if below { -power } else { power }));
        }
        below |= piece.ends_with('/');
    }
    (factors.len() > 1).then_some(factors)
}

/// The unit that the trailing words of an underscored name give, with the number of words that it takes: `mm`, `m s2`.
///
/// `in` counts as a preposition (`u_in`), and a single letter only in its own case, unless the name shouts (`X_M`).
pub fn of_words(words: &[&str]) -> Option<(String, usize)> {
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
        if let Some(top) = single(words[top]).filter(|t| parse(t).is_some_and(|u| !u.is_time() && !u.is_frequency())) {
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
            assert!(unit.is_like(&Unit::mechanical(length, time, 0, 1.0)), "{text}");
            // One rounding of the factor's product.
            assert!((unit.factor / factor - 1.0).abs() < 1e-15, "{text}");
        }
    }

    #[test]
    fn other_units_are_known_and_words_are_not() {
        for text in ["V", "mV/g", "N·m", "N m", "µε", "microstrain", "deg", "%", "kN", "rad/s", "°C"] {
            assert!(parse(text).is_some_and(|u| !u.is_length() && !u.is_time()), "{text}");
        }
        for text in ["", "out", "mass", "rel", "filtered", "x", "left/right", "é", "-1", "^2", "²"] {
            assert_eq!(parse(text), None, "{text}");
        }
    }

    #[test]
    fn units_of_one_quantity_are_alike_and_others_are_not() {
        for (one, two, factor) in [
            ("deg", "rad", DEGREE),
            ("rpm", "rad/s", std::f64::consts::TAU / 60.0),
            ("g", "m/s^2", 9.80665),
            ("kip", "kN", 4.4482216152605),
            ("N", "kg m/s^2", 1.0),
            ("N m", "J", 1.0),
            ("mNm", "N m", 1e-3),
            ("psi", "Pa", 6894.757293168),
            ("mV", "V", 1e-3),
        ] {
            let (a, b) = (parse(one).unwrap(), parse(two).unwrap());
            assert!(a.is_like(&b), "{one} {two}");
            assert!((a.factor / b.factor / factor - 1.0).abs() < 1e-12, "{one} {two}: {}", a.factor / b.factor);
        }
        for (one, two) in [("m", "rad"), ("N", "m/s^2"), ("V", "A"), ("K", "°C"), ("strain", "%"), ("Hz", "rad/s")] {
            assert!(!parse(one).unwrap().is_like(&parse(two).unwrap()), "{one} {two}");
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
