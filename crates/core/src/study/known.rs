//! Physics known beforehand, which every fit keeps to.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use sindyscope_values::term::{Term, pieces};

pub use crate::sparse::Sign;

/// Two masses between which forces are equal and opposite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// The one, counted from zero.
    pub first: usize,
    /// The other.
    pub second: usize,
    /// Its mass over the first one's; none: sought with the coefficients.
    pub ratio: Option<f64>,
}

/// Something known of the equation of motion before any fit; written as it is printed.
#[derive(Clone, Debug, PartialEq)]
pub enum Known {
    /// `x=-u`: the first term's coefficient is `times` the second's. Both become one term, `x-u`.
    Tied {
        /// The first term.
        term: Term,
        /// The second.
        to: Term,
        /// Ratio of the coefficients.
        times: f64,
    },
    /// `v<=0`: a coefficient has one sign, in every acceleration's equation.
    Signed(Term, Sign),
    /// `passive`: no damping term feeds energy in, whatever the motion.
    Passive,
    /// `odd`: the restoring force is as large one way as the other, so even powers of displacements are no candidates.
    OddStiffness,
    /// `m2/m1`, `m2/m1=0.5`: forces between two masses are equal and opposite.
    Opposite(Pair),
    /// `even`: beside the linear one only terms of the displacement that are alike both ways are candidates.
    EvenStiffness,
}

impl fmt::Display for Known {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tied { term, to, times } if *times == 1.0 => write!(f, "{term}={to}"),
            Self::Tied { term, to, times } if *times == -1.0 => write!(f, "{term}=-{to}"),
            Self::Tied { term, to, times } => write!(f, "{term}={times}*{to}"),
            Self::Signed(term, Sign::NotPositive) => write!(f, "{term}<=0"),
            Self::Signed(term, Sign::NotNegative) => write!(f, "{term}>=0"),
            Self::Opposite(Pair { first, second, ratio }) => {
                write!(f, "m{}/m{}", second + 1, first + 1)?;
                ratio.map_or(Ok(()), |ratio| write!(f, "={ratio}"))
            }
            Self::Passive => f.write_str("passive"),
            Self::OddStiffness => f.write_str("odd"),
            Self::EvenStiffness => f.write_str("even"),
        }
    }
}

impl FromStr for Known {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        match text {
            "passive" => return Ok(Self::Passive),
            "odd" => return Ok(Self::OddStiffness),
            "even" => return Ok(Self::EvenStiffness),
            _ => {}
        }
        if let Some(pair) = pair(text) {
            return pair.map(Self::Opposite);
        }
        let term = |text: &str| Term::parse(text.trim()).map_err(|e| e.to_string());
        for (sign, kind) in
            [("<=", Sign::NotPositive), ("≤", Sign::NotPositive), (">=", Sign::NotNegative), ("≥", Sign::NotNegative)]
        {
            if let Some((left, right)) = text.split_once(sign) {
                if right.trim() != "0" {
                    return Err(format!("`{text}`: a coefficient is bounded by zero: `{}{sign}0`", left.trim()));
                }
                return Ok(Self::Signed(term(left)?, kind));
            }
        }
        let Some((left, right)) = text.split_once('=') else {
            return Err(format!("`{text}` is none of `x=-u`, `v<=0`, `v>=0`, `passive`, `odd`, `even`, `m2/m1`"));
        };
        let (times, to) = term(right)?.expression().apart();
        let to = Term::new(to);
        let term = term(left)?;
        if to == term || times == 0.0 {
            return Err(format!("`{text}` ties a term to itself or to nothing: write `x=-u`"));
        }
        if to.symbols().is_empty() && to.as_str() == "1" && right.trim().parse::<f64>().is_ok() {
            return Err(format!(
                "`{text}` fixes a coefficient: fix the term {} itself at {}",
                left.trim(),
                right.trim()
            ));
        }
        Ok(Self::Tied { term, to, times })
    }
}

/// Reads `m2/m1` and `m2/m1=0.5`; none if a text does not begin like that.
fn pair(text: &str) -> Option<Result<Pair, String>> {
    let (masses, ratio) = text.split_once('=').map_or((text, None), |(masses, ratio)| (masses, Some(ratio.trim())));
    let (second, first) = masses.split_once('/')?;
    let number = |text: &str| text.trim().strip_prefix('m')?.parse::<usize>().ok();
    let (second, first) = (number(second)?, number(first)?);
    if first == 0 || second == 0 || first == second {
        return Some(Err(format!("`{text}` is no ratio of two masses: write `m2/m1` or `m2/m1=0.5`")));
    }
    let value = ratio.map(|text| text.parse::<f64>().ok().filter(|r| *r > 0.0 && r.is_finite()));
    Some(match value {
        Some(None) => Err(format!("`{text}`: a ratio of masses is a number above zero: `m2/m1=0.5`")),
        value => Ok(Pair { first: first - 1, second: second - 1, ratio: value.flatten() }),
    })
}

impl Serialize for Known {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Known {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// Reads a list: `x=-u, v<=0, odd`.
///
/// # Errors
/// The first that is none.
pub fn known_list(text: &str) -> Result<Vec<Known>, String> {
    pieces(text).into_iter().map(|(_, piece)| piece.parse()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::Settings;

    #[test]
    fn what_is_known_reads_as_it_prints() {
        for text in [
            "x=-u",
            "v=-du",
            "x=u",
            "x=2.5*u",
            "v<=0",
            "x^3>=0",
            "passive",
            "odd",
            "even",
            "sgn(v)=0.5*sgn(v-du)",
            "m2/m1",
            "m1/m3=0.5",
        ] {
            assert_eq!(text.parse::<Known>().unwrap().to_string(), text);
        }
        assert_eq!(known_list("x = -u; clip(x,0.1)<=0, odd").unwrap().len(), 3);
        for (wrong, said) in [
            ("x", "none of"),
            ("x=", "empty"),
            ("v<=1", "bounded by zero"),
            ("x=x", "itself"),
            ("x=0*u", "nothing"),
            ("u=2", "the term u itself"),
            ("foo<=0", "foo"),
            ("m1/m1", "two masses"),
            ("m2/m1=-1", "above zero"),
        ] {
            let error = wrong.parse::<Known>().unwrap_err();
            assert!(error.contains(said), "{wrong}: {error}");
        }
        let settings = Settings { known: known_list("x=-u, odd").unwrap(), ..Settings::default() };
        let json = serde_json::to_string(&settings).unwrap();
        assert!(json.contains(r#""known":["x=-u","odd"]"#), "{json}");
        assert_eq!(serde_json::from_str::<Settings>(&json).unwrap(), settings);
        assert_eq!(serde_json::from_str::<Settings>("{}").unwrap().known, []);
    }
}
