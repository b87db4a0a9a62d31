//! A column's name in the header: what it measures, which of several, in which unit.

use super::words::{article, printable};
use sindyscope_values::record::units;

/// Characters kept of a name: a longer one is a line of something else.
const LONGEST: usize = 200;

/// What a column can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum ColumnQuantity {
    Time,
    Displacement,
    Velocity,
    Acceleration,
    Input,
    Trajectory,
}

impl ColumnQuantity {
    /// The word's quantity, by the header names that the program knows.
    pub(super) fn of_word(word: &str) -> Option<Self> {
        Some(match word {
            "t" | "time" => Self::Time,
            "x" | "displacement" | "disp" => Self::Displacement,
            "v" | "velocity" => Self::Velocity,
            "a" | "acceleration" => Self::Acceleration,
            "u" | "input" | "base" | "force" | "f" => Self::Input,
            "record" | "run" | "trial" | "id" => Self::Trajectory,
            _ => return None,
        })
    }

    /// The short name: `t`, `x`, …
    pub(super) fn symbol(self) -> &'static str {
        match self {
            Self::Time => "t",
            Self::Displacement => "x",
            Self::Velocity => "v",
            Self::Acceleration => "a",
            Self::Input => "u",
            Self::Trajectory => "record",
        }
    }

    /// The word for it in a sentence.
    pub(super) fn noun(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
            Self::Input => "input",
            Self::Trajectory => "record",
        }
    }

    /// True for what a sensor of the motion shows.
    pub(super) fn is_motion(self) -> bool {
        matches!(self, Self::Displacement | Self::Velocity | Self::Acceleration)
    }

    /// True if there may be several, told apart by a number.
    pub(super) fn is_numbered(self) -> bool {
        !matches!(self, Self::Time | Self::Trajectory)
    }
}

/// A name's quantity and number, if it has one: `x2` is displacement 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct ColumnKey {
    pub(super) quantity: ColumnQuantity,
    pub(super) number: Option<usize>,
}

impl ColumnKey {
    /// Reads a single word: `x`, `U2`, `time`.
    pub(super) fn of_word(word: &str) -> Option<Self> {
        let stem = word.trim_end_matches(|c: char| c.is_ascii_digit());
        let digits = &word[stem.len()..];
        let quantity = ColumnQuantity::of_word(&stem.to_lowercase())?;
        let number = if digits.is_empty() { None } else { Some(digits.parse().ok()?) };
        (number.is_none() || quantity.is_numbered()).then_some(Self { quantity, number })
    }
}

impl std::fmt::Display for ColumnKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.quantity.symbol())?;
        self.number.map_or(Ok(()), |n| write!(f, "{n}"))
    }
}

/// What a header's name says that its column is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Meaning {
    /// One of the known names.
    Known(ColumnKey),
    /// A known name that something else in it contradicts, with that something as a clause.
    Doubtful(ColumnKey, String),
    /// `y` or `z`: states 2 and 3 of a first-order system written `x, y, z`.
    Coordinate,
    /// Nothing known.
    Unknown,
}

/// One column's name, taken apart.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Heading {
    /// As it stands in the file, without blanks and quotes around it; empty if the column has no name.
    pub(super) name: String,
    /// The name without its unit.
    pub(super) stem: String,
    /// The unit; empty if none is given.
    pub(super) unit: String,
    /// What the name says.
    pub(super) meaning: Meaning,
}

impl Heading {
    /// Takes a name apart; `unit_below` is what a row of units under the header says, which counts where the name has none.
    pub(super) fn new(name: &str, unit_below: Option<&str>) -> Self {
        // A line end within a name stands for a blank.
        let name = name.replace(char::is_whitespace, " ");
        let name: String = printable(name.trim().trim_matches('"').trim()).chars().take(LONGEST).collect();
        let bracket = bracketed(&name);
        let (outside, inside) = bracket.as_ref().map_or((name.as_str(), None), |(o, i)| (o.as_str(), Some(i.as_str())));
        let words: Vec<&str> = outside.split(parts_words).filter(|w| !w.is_empty()).collect();

        let mut number = inside.and_then(|i| i.parse::<usize>().ok());
        let mut unit = inside.filter(|_| number.is_none()).map(str::to_owned);
        let mut stem = outside.trim().to_owned();
        if unit.is_none()
            && let Some((text, taken)) = words.get(1..).and_then(units::of_words)
        {
            for word in words.iter().rev().take(taken) {
                let end = stem.rfind(word).unwrap_or(stem.len());
                stem.truncate(end);
            }
            stem.truncate(stem.trim_end_matches(parts_words).len());
            unit = Some(text);
        }
        let unit = unit.or_else(|| unit_below.map(|u| u.trim().trim_matches(['[', ']', '(', ')']).trim().to_owned()));
        let unit = unit.filter(|u| u != "-").unwrap_or_default();

        if number.is_none() {
            number = words.get(1).and_then(|w| w.parse().ok());
        }
        let meaning = match words.first() {
            None => Meaning::Unknown,
            Some(word) => match of_torque(word, &unit).or_else(|| ColumnKey::of_word(word)) {
                Some(key) => {
                    let key = match (key.number, key.quantity.is_numbered()) {
                        (None, true) => ColumnKey { number, ..key },
                        _ => key,
                    };
                    match doubt(key.quantity, word, &words[1..], &unit) {
                        Some(why) => Meaning::Doubtful(key, why),
                        None => Meaning::Known(key),
                    }
                }
                None if words.len() == 1 && matches!(*word, "y" | "z" | "Y" | "Z") => Meaning::Coordinate,
                None => Meaning::Unknown,
            },
        };
        Self { name, stem, unit, meaning }
    }

    /// A column without a name.
    pub(super) fn unnamed() -> Self {
        Self { name: String::new(), stem: String::new(), unit: String::new(), meaning: Meaning::Unknown }
    }
}

/// `T [N m]`: the time's letter is the torque's too, and a unit of force says which is meant.
fn of_torque(word: &str, unit: &str) -> Option<ColumnKey> {
    let number = word.strip_prefix(['t', 'T'])?;
    let number = if number.is_empty() { None } else { Some(number.parse().ok()?) };
    units::parse(unit)?.is_force().then_some(ColumnKey { quantity: ColumnQuantity::Input, number })
}

/// What a message calls a column: its name, or its number from 1 if it has none.
pub(super) fn label(headings: &[Heading], column: usize) -> String {
    match headings.get(column) {
        Some(heading) if !heading.name.is_empty() => heading.name.clone(),
        _ => (column + 1).to_string(),
    }
}

/// True for what stands between the words of a name.
fn parts_words(c: char) -> bool {
    c.is_whitespace() || "_-./:,;".contains(c)
}

/// Splits a bracketed unit or number off the end of a name; round brackets count only around a unit or a number.
fn bracketed(name: &str) -> Option<(String, String)> {
    let (open, close) = match name.chars().last()? {
        ']' => ('[', ']'),
        ')' => ('(', ')'),
        _ => return None,
    };
    let mut depth = 0;
    let start = name
        .char_indices()
        .rev()
        .find(|&(_, c)| {
            depth += i32::from(c == close) - i32::from(c == open);
            depth == 0
        })?
        .0;
    let inside = name[start + 1..name.len() - 1].trim();
    let counts = close == ']' || units::parse(inside).is_some() || inside.parse::<usize>().is_ok();
    counts.then(|| (name[..start].trim_end_matches(['_', ' ', '/']).to_owned(), inside.to_owned()))
}

/// Why a known first word does not settle what the column is.
fn doubt(quantity: ColumnQuantity, word: &str, rest: &[&str], unit: &str) -> Option<String> {
    let known = units::parse(unit);
    let fits = match quantity {
        ColumnQuantity::Time => known.is_some_and(|u| u.is_time()),
        ColumnQuantity::Velocity => known.is_some_and(|u| u.is_rate()),
        ColumnQuantity::Acceleration => known.is_some_and(|u| u.is_acceleration()),
        // A frequency is no force, whatever the letter.
        ColumnQuantity::Input => !(word.eq_ignore_ascii_case("f") && known.is_some_and(|u| u.is_frequency())),
        ColumnQuantity::Displacement | ColumnQuantity::Trajectory => true,
    };
    if !unit.is_empty() && !fits {
        return Some(format!("its unit `{unit}` is not that of {}", article(quantity.noun())));
    }
    if quantity == ColumnQuantity::Displacement {
        const RATES: &[&str] = &["dot", "ddot", "dt", "velocity", "vel", "acceleration", "acc", "accel", "rate"];
        let rate = rest.iter().find(|w| RATES.contains(&w.to_lowercase().as_str()))?;
        return Some(format!("`{rate}` in it speaks of a derivative"));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(name: &str) -> (String, String, String) {
        let heading = Heading::new(name, None);
        let key = match heading.meaning {
            Meaning::Known(key) => key.to_string(),
            Meaning::Doubtful(key, _) => format!("{key}?"),
            Meaning::Coordinate => "coordinate".into(),
            Meaning::Unknown => "-".into(),
        };
        (key, heading.stem, heading.unit)
    }

    #[test]
    fn names_are_read_as_the_interface_says() {
        for (name, key, stem, unit) in [
            ("t", "t", "t", ""),
            ("Time", "t", "Time", ""),
            ("TIME [ms]", "t", "TIME", "ms"),
            ("t / s", "t", "t", "s"),
            ("time_us", "t", "time", "us"),
            ("x", "x", "x", ""),
            ("x [mm]", "x", "x", "mm"),
            ("x_mm", "x", "x", "mm"),
            ("X_M", "x", "X", "m"),
            ("Disp (mm)", "x", "Disp", "mm"),
            ("displacement_left", "x", "displacement_left", ""),
            ("x2", "x2", "x2", ""),
            ("x_2 [mm]", "x2", "x_2", "mm"),
            ("x(2)", "x2", "x", ""),
            ("force (N)", "u", "force", "N"),
            ("F [kN]", "u", "F", "kN"),
            ("u_base_m", "u", "u_base", "m"),
            ("u_in", "u", "u_in", ""),
            ("base [in]", "u", "base", "in"),
            ("input2", "u2", "input2", ""),
            ("x_microstrain", "x", "x", "microstrain"),
            ("velocity_m_s", "v", "velocity", "m/s"),
            ("v1 [rad/s]", "v1", "v1", "rad/s"),
            ("a_m_s2", "a", "a", "m/s^2"),
            ("Acceleration (g)", "a", "Acceleration", "g"),
            ("run", "record", "run", ""),
            ("Trial id", "record", "Trial id", ""),
            ("\"x\"", "x", "x", ""),
            ("y", "coordinate", "y", ""),
            ("temperature", "-", "temperature", ""),
            ("V2_out_V", "v2?", "V2_out", "V"),
            ("V1_in_V", "v1?", "V1_in", "V"),
            ("T [°C]", "t?", "T", "°C"),
            ("T [N m]", "u", "T", "N m"),
            ("T2 (Nm)", "u2", "T2", "Nm"),
            ("M_Nm", "-", "M", "Nm"),
            ("A1 [A]", "a1?", "A1", "A"),
            ("f [Hz]", "u?", "f", "Hz"),
            ("x_dot", "x?", "x_dot", ""),
            ("time2", "-", "time2", ""),
            ("x99999999999999999999999", "-", "x99999999999999999999999", ""),
            ("", "-", "", ""),
            ("___", "-", "___", ""),
            ("]", "-", "]", ""),
        ] {
            assert_eq!(known(name), (key.into(), stem.into(), unit.into()), "{name}");
        }
    }

    #[test]
    fn a_row_of_units_counts_where_the_name_has_none() {
        assert_eq!(Heading::new("x", Some("[mm]")).unit, "mm");
        assert_eq!(Heading::new("x [m]", Some("mm")).unit, "m");
        assert_eq!(Heading::new("x", Some("-")).unit, "");
    }
}
