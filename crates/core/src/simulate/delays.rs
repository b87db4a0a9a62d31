//! How much later than they were measured inputs act.

use serde::{Deserialize, Serialize};

/// How much later each input acts than it was measured, s; earlier if negative.
///
/// Written as one number where only the first input is late, else as a list, one an input.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "WrittenDelays", into = "WrittenDelays")]
pub struct Delays(Vec<f64>);

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum WrittenDelays {
    First(f64),
    Each(Vec<f64>),
}

impl From<WrittenDelays> for Delays {
    fn from(written: WrittenDelays) -> Self {
        let each = match written {
            WrittenDelays::First(delay) => vec![delay],
            WrittenDelays::Each(each) => each,
        };
        each.into_iter().enumerate().collect()
    }
}

impl From<Delays> for WrittenDelays {
    fn from(Delays(each): Delays) -> Self {
        match each.as_slice() {
            [] => Self::First(0.0),
            [first] => Self::First(*first),
            _ => Self::Each(each),
        }
    }
}

/// Delays of inputs, by their index; those of one input add up.
impl FromIterator<(usize, f64)> for Delays {
    fn from_iter<I: IntoIterator<Item = (usize, f64)>>(delays: I) -> Self {
        let mut each: Vec<f64> = Vec::new();
        for (input, delay) in delays {
            if each.len() <= input {
                each.resize(input + 1, 0.0);
            }
            each[input] += delay;
        }
        while each.last() == Some(&0.0) {
            each.pop();
        }
        Self(each)
    }
}

impl Delays {
    /// How late an input is, s.
    pub fn delay(&self, input: usize) -> f64 {
        self.0.get(input).copied().unwrap_or(0.0)
    }

    /// Each input's delay, by its index.
    pub fn each(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.0.iter().copied().enumerate()
    }

    /// True if every input acts when it was measured.
    pub fn is_none(&self) -> bool {
        self.0.is_empty()
    }

    /// The delays' bits: a key by which equal ones are found again.
    pub fn bits(&self) -> Vec<u64> {
        self.0.iter().map(|d| d.to_bits()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_come_back_from_text() {
        for (delays, text) in [
            (Delays::default(), "0.0"),
            (Delays::from_iter([(0, 0.002)]), "0.002"),
            (Delays::from_iter([(1, -0.5), (1, 0.25)]), "[0.0,-0.25]"),
        ] {
            assert_eq!(serde_json::to_string(&delays).unwrap(), text);
            assert_eq!(serde_json::from_str::<Delays>(text).unwrap(), delays);
        }
        assert!(Delays::from_iter([(2, 0.0)]).is_none());
    }
}
