//! Units that a person chose to see: of every length, every angle, every force.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::units::{PREFIXES, Scale, head_of, split_prefix};

/// The chosen units, each by the base unit of its quantity: `{"m": "µm", "rad": "°"}`. Other quantities are shown with the
/// prefix that suits the data.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ShownUnits(BTreeMap<String, String>);

/// Base units of which one may choose; seconds and hertz stay as they are.
const OFFERED: [&str; 10] = ["m", "N", "V", "A", "Pa", "rad", "W", "J", "Nm", "N·m"];

impl ShownUnits {
    /// True if nothing was chosen.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// How values up to `largest`, given in `unit`, are shown: in the chosen unit, else as suits them.
    pub fn scale(&self, largest: f64, unit: &str) -> Scale {
        let unit = unit.trim();
        let (head, rest) = head_of(unit);
        match self.replacement(head) {
            Some((shown, factor)) => Scale { factor, unit: format!("{shown}{rest}") },
            None => Scale::suited(largest, unit),
        }
    }

    /// The chosen unit in the place of another, and how many of it one of that other is.
    pub fn replacement(&self, unit: &str) -> Option<(&str, f64)> {
        let (base, size) = in_base(unit)?;
        let shown = self.0.get(base)?;
        let (_, shown_size) = in_base(shown)?;
        Some((shown, size / shown_size))
    }

    /// The chosen unit of what a unit measures.
    pub fn chosen(&self, unit: &str) -> Option<&str> {
        let (base, _) = in_base(head_of(unit.trim()).0)?;
        self.0.get(base).map(String::as_str)
    }

    /// Shows what a unit measures in another; none: as suits the data.
    pub fn choose(&mut self, unit: &str, shown: Option<&str>) {
        let Some((base, _)) = in_base(head_of(unit.trim()).0) else { return };
        match shown.filter(|s| in_base(s).is_some_and(|(other, _)| other == base)) {
            Some(shown) => drop(self.0.insert(base.to_owned(), shown.to_owned())),
            None => drop(self.0.remove(base)),
        }
    }

    /// The units that one may choose among in the place of this one; none of what has no prefixes.
    pub fn choices(unit: &str) -> Vec<String> {
        let Some((base, _)) = in_base(head_of(unit.trim()).0) else { return Vec::new() };
        let prefixes: &[&str] = match base {
            "m" => &["", "m", "µ", "n"],
            "rad" => &["", "m", "µ"],
            _ => &["k", "", "m", "µ"],
        };
        let mut choices: Vec<String> = prefixes.iter().map(|p| format!("{p}{base}")).collect();
        if base == "rad" {
            choices.push("°".to_owned());
        }
        choices
    }
}

/// The base unit of a unit's quantity, and how many of it one is.
fn in_base(unit: &str) -> Option<(&'static str, f64)> {
    if matches!(unit, "°" | "deg") {
        return Some(("rad", PI / 180.0));
    }
    let (power, base) = split_prefix(unit)?;
    let base = OFFERED.into_iter().find(|b| *b == base)?;
    debug_assert!(power == -2 || power == -1 || PREFIXES.iter().any(|(_, p)| *p == power));
    Some((base, 10f64.powi(power)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chosen_unit_holds_for_every_quantity_made_of_it() {
        let mut units = ShownUnits::default();
        units.choose("mm", Some("µm"));
        units.choose("rad/s", Some("°"));
        for (unit, shown, factor) in [
            ("m", "µm", 1e6),
            ("mm", "µm", 1e3),
            ("mm/s²", "µm/s²", 1e3),
            ("rad", "°", 180.0 / PI),
            ("deg", "°", 1.0),
            ("mrad/s", "°/s", 0.18 / PI),
        ] {
            let scale = units.scale(0.5, unit);
            assert_eq!(scale.unit, shown, "{unit}");
            assert!((scale.factor / factor - 1.0).abs() < 1e-12, "{unit}: {}", scale.factor);
        }
        assert_eq!(units.scale(0.02, "N"), Scale::suited(0.02, "N"), "what was not chosen suits the data");
        assert_eq!(units.scale(0.02, "m²"), Scale::suited(0.02, "m²"), "an area is no length");
        units.choose("m/s", None);
        assert_eq!(units.scale(0.02, "m").unit, "mm");
    }

    #[test]
    fn one_chooses_among_units_of_the_same_quantity() {
        assert_eq!(ShownUnits::choices("mm/s"), ["m", "mm", "µm", "nm"]);
        assert_eq!(ShownUnits::choices("°"), ["rad", "mrad", "µrad", "°"]);
        assert!(ShownUnits::choices("Hz").is_empty() && ShownUnits::choices("").is_empty());
        let mut units = ShownUnits::default();
        units.choose("m", Some("rad"));
        assert!(units.is_empty());
        units.choose("m", Some("mm"));
        let text = serde_json::to_string(&units).unwrap();
        assert_eq!((text.as_str(), serde_json::from_str(&text).ok()), (r#"{"m":"mm"}"#, Some(units)));
    }
}
