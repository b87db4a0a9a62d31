//! What a rig hid, in the units of its records.

use std::f64::consts::TAU;

use super::parts::{Dimension, LENGTH, PLAIN, Parts, RATE, STIFFNESS};
use super::scene::{Drive, Scene};
use super::watching::Shown;
use crate::scenario::short;

/// A number of the plant or of an effect in it.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueParameter {
    /// The effect it belongs to; none for the linear plant's own.
    pub effect: Option<&'static str>,
    /// Its name, as in the effect's equation.
    pub name: String,
    /// Its value, in `unit`; forces and stiffnesses are over mass.
    pub value: f64,
    /// Its unit.
    pub unit: String,
}

/// What a rig hid.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Names of the hidden effects.
    pub effects: Vec<String>,
    /// Numbers of the linear plant (`k`, `c`, with a force `b`), then of each effect.
    pub parameters: Vec<TrueParameter>,
    /// RMS of all missing force over RMS of the spring's force, over the fitted records. What is wrong with a sensor counts
    /// as the spring's force of its error.
    pub ratio: f64,
    /// The same for each effect by itself.
    pub ratios: Vec<f64>,
    /// Natural frequency of the linear plant, Hz.
    pub natural_frequency: f64,
    /// Its damping as a share of the critical.
    pub damping_ratio: f64,
    /// Standard deviation of the noise of the motion's sensor, in the unit of what it shows.
    pub noise: f64,
    /// RMS over the fitted records of what an effect changes of what is shown beyond the simpler one that it contains
    /// (friction with a static level: Coulomb's), in its unit; none where there is no simpler one.
    pub beyond_simpler: Option<f64>,
    /// RMS over the fitted records of the displacement that the base model cannot follow, to first order, in the displacement's
    /// unit; none where nothing is hidden or the base model excites itself.
    pub beyond_base: Option<f64>,
    /// All of it in words.
    pub description: String,
}

impl Truth {
    /// The value of a parameter of an effect, or of the linear plant (`None`).
    pub fn parameter(&self, effect: Option<&str>, name: &str) -> Option<f64> {
        self.parameters.iter().find(|p| p.effect == effect && p.name == name).map(|p| p.value)
    }
}

/// What was measured of the motions and written to the records.
pub(super) struct Measured {
    pub ratios: Vec<f64>,
    pub ratio: f64,
    pub noise: f64,
    pub beyond_simpler: Option<f64>,
    pub beyond_base: Option<f64>,
    pub offsets: Vec<(String, f64)>,
}

/// What turns numbers without units into those of the records.
#[derive(Clone, Debug)]
pub(super) struct Scales {
    /// Displacement scale, m or rad.
    pub length: f64,
    /// Natural circular frequency, rad/s.
    pub rate: f64,
    /// Sampling interval, s.
    pub interval: f64,
    /// Input scale.
    pub input: f64,
    /// Factor of a measured force in the acceleration, 1/kg or 1/(kg m²).
    pub mobility: f64,
    pub unit: &'static str,
    pub input_unit: &'static str,
}

impl Scales {
    /// Factor of what a sensor shows of the motion.
    pub(super) fn shown(&self, by: Shown) -> f64 {
        self.length * self.rate.powi(i32::from(by.derivatives()))
    }

    /// Scales of an amplitude and a natural circular frequency, which gives a little so that the sampling interval is
    /// short in decimal.
    pub(super) fn new(length: f64, rate: f64, interval: f64, mass: f64, turns: bool, drive: Drive) -> Self {
        let exact = interval / rate;
        let rounded: f64 = format!("{exact:.3e}").parse().unwrap_or(exact);
        let rate = interval / rounded;
        let (unit, force_unit) = if turns { ("rad", "N m") } else { ("m", "N") };
        let (input, input_unit) =
            if drive == Drive::Base { (length, unit) } else { (length * rate * rate * mass, force_unit) };
        Self { length, rate, interval: rounded, input, mobility: 1.0 / mass, unit, input_unit }
    }

    pub(super) fn value(&self, value: f64, dimension: Dimension) -> f64 {
        match dimension {
            Dimension::Of { length, time } => value * self.length.powi(length) * self.rate.powi(-time),
            Dimension::Input => value * self.input,
        }
    }

    pub(super) fn unit(&self, dimension: Dimension) -> String {
        let Dimension::Of { length, time } = dimension else { return self.input_unit.to_owned() };
        let power = |unit: &str, n: i32| match n.abs() {
            0 => None,
            1 => Some(unit.to_owned()),
            n => Some(format!("{unit}^{n}")),
        };
        let parts = [(self.unit, length), ("s", time)];
        let side = |above: bool| {
            let list: Vec<String> =
                parts.iter().filter(|(_, n)| (*n > 0) == above).filter_map(|(unit, n)| power(unit, *n)).collect();
            list
        };
        match (side(true), side(false)) {
            (above, below) if below.is_empty() => above.join(" "),
            (above, below) => {
                let above = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
                let below = if below.len() > 1 { format!("({})", below.join(" ")) } else { below.join(" ") };
                format!("{above}/{below}")
            }
        }
    }
}

impl Truth {
    pub(super) fn new(
        names: &[&'static str],
        titles: &[&'static str],
        parts: &[Parts],
        scene: &Scene,
        scales: &Scales,
        measured: &Measured,
    ) -> Self {
        let of = |effect: Option<&'static str>, name: &str, value: f64, dimension: Dimension| TrueParameter {
            effect,
            name: name.to_owned(),
            value: scales.value(value, dimension),
            unit: scales.unit(dimension),
        };
        let mut parameters = Vec::new();
        if scene.sprung {
            parameters.push(of(None, "k", 1.0, STIFFNESS));
        }
        parameters.push(of(None, "c", scene.damping, RATE));
        if scene.drive == Drive::Force {
            let unit = if scales.unit == "rad" { "1/(kg m^2)" } else { "1/kg" };
            let mobility = TrueParameter { value: scales.mobility, unit: unit.to_owned(), ..of(None, "b", 0.0, PLAIN) };
            parameters.push(mobility);
        }
        if scene.cubic > 0.0 {
            parameters.push(of(None, "k_3", scene.cubic, Dimension::Of { length: -2, time: -2 }));
        }
        if let Some(datum) = scene.datum {
            parameters.push(of(None, "y_0", datum, LENGTH));
        }
        let mut sentences = Vec::new();
        for ((name, title), part) in names.iter().zip(titles).zip(parts) {
            let first = parameters.len();
            parameters.extend(part.constants.iter().map(|c| of(Some(name), c.name, c.value, c.dimension)));
            if *name == "sensor_offset" {
                parameters.extend(measured.offsets.iter().map(|(record, offset)| TrueParameter {
                    effect: Some(name),
                    name: format!("y_0 of {record}"),
                    value: *offset,
                    unit: scales.unit.to_owned(),
                }));
            }
            let values: Vec<String> = parameters[first..].iter().map(|p| rounded(&p.name, p.value, &p.unit)).collect();
            let place = if part.place.is_empty() { String::new() } else { format!(" {}", part.place) };
            sentences.push(format!("{title}{place} ({})", values.join(", ")));
        }
        let natural_frequency = scales.rate / TAU;
        let damping_ratio = 0.5 * scene.damping;
        let driven = match (scene.drive, scene.control) {
            (Drive::Base, _) => "its base moved",
            (Drive::Force, None) => "driven by a force",
            (Drive::Force, Some(_)) => "driven by a force that follows a reference",
            (Drive::None, _) => "left to itself",
        };
        let hidden = if sentences.is_empty() {
            "Nothing is hidden".to_owned()
        } else {
            let percent = short(percent(measured.ratio));
            let of = if scene.sprung { "the spring's" } else { "the input" };
            format!("Hidden: {}; the missing force is {percent} % of {of}", sentences.join(" and "))
        };
        let kind = match (scene.sprung, scene.cubic > 0.0) {
            (false, _) => "a mass without a spring, counted with",
            (true, false) => "a linear oscillator of",
            (true, true) => "an oscillator with a known cubic spring of",
        };
        let description = format!(
            "{hidden}. The rest is {kind} {} Hz and {} % of critical damping, {driven}.",
            short(significant(natural_frequency)),
            short(percent(damping_ratio)),
        );
        Self {
            effects: names.iter().map(|n| (*n).to_owned()).collect(),
            parameters,
            ratio: measured.ratio,
            ratios: measured.ratios.clone(),
            natural_frequency,
            damping_ratio,
            noise: measured.noise,
            beyond_simpler: measured.beyond_simpler,
            beyond_base: measured.beyond_base,
            description,
        }
    }
}

fn rounded(name: &str, value: f64, unit: &str) -> String {
    let number = short(significant(value));
    if unit.is_empty() { format!("{name} = {number}") } else { format!("{name} = {number} {unit}") }
}

/// To four digits.
fn significant(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

fn percent(share: f64) -> f64 {
    format!("{:.2e}", 100.0 * share).parse().unwrap_or(share)
}
