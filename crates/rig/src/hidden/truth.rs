//! What a rig hid, in the units of its records.

use std::f64::consts::TAU;

use super::contribution::{Contribution, Dimension, EffectConstant, LENGTH, PLAIN, RATE, STIFFNESS};
use super::host_plant::{DriveKind, HostPlant};
use super::instruments::SensedMotion;
use crate::truth::{TrueParameter, Truth};
use crate::words::short;

/// What was measured of the motions and written to the records.
pub(super) struct MeasuredSizes {
    pub ratios: Vec<f64>,
    pub ratio: f64,
    pub noise: f64,
    pub beyond_simpler: Option<f64>,
    pub beyond_base: Option<f64>,
    pub offsets: Vec<(String, f64)>,
}

/// What turns numbers without units into those of the records.
#[derive(Clone, Debug)]
pub(super) struct UnitScales {
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

impl UnitScales {
    /// Factor of what a sensor shows of the motion.
    pub(super) fn shown(&self, by: SensedMotion) -> f64 {
        self.length * self.rate.powi(i32::from(by.derivatives()))
    }

    /// Units of an amplitude and a natural circular frequency, which gives a little so that the sampling interval is
    /// short in decimal.
    pub(super) fn new(length: f64, rate: f64, interval: f64, mass: f64, turns: bool, drive: DriveKind) -> Self {
        let exact = interval / rate;
        let rounded: f64 = format!("{exact:.3e}").parse().unwrap_or(exact);
        let rate = interval / rounded;
        let (unit, force_unit) = if turns { ("rad", "N m") } else { ("m", "N") };
        let (input, input_unit) =
            if drive == DriveKind::Base { (length, unit) } else { (length * rate * rate * mass, force_unit) };
        Self { length, rate, interval: rounded, input, mobility: 1.0 / mass, unit, input_unit }
    }

    /// A number of the plant as its records tell it.
    fn parameter(&self, constant: &EffectConstant) -> TrueParameter {
        let EffectConstant { name, value, dimension } = *constant;
        TrueParameter {
            effect: None,
            name: name.to_owned(),
            value: self.value(value, dimension),
            unit: self.unit(dimension),
        }
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

/// What is told of a plan that was carried out: of each effect its name, its title and what it added to the plant.
pub(super) fn told(
    effects: &[(&'static str, &'static str, &Contribution)],
    host_plant: &HostPlant,
    scales: &UnitScales,
    measured: &MeasuredSizes,
) -> Truth {
    let mut parameters = of_the_plant(host_plant, scales);
    let mut sentences = Vec::new();
    for (name, title, part) in effects {
        let first = parameters.len();
        parameters.extend(part.constants.iter().map(|c| TrueParameter { effect: Some(name), ..scales.parameter(c) }));
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
    Truth {
        effects: effects.iter().map(|(name, ..)| (*name).to_owned()).collect(),
        parameters,
        ratio: measured.ratio,
        ratios: measured.ratios.clone(),
        natural_frequency: scales.rate / TAU,
        damping_ratio: 0.5 * host_plant.damping,
        noise: measured.noise,
        beyond_simpler: measured.beyond_simpler,
        beyond_base: measured.beyond_base,
        description: description(&sentences, measured.ratio, host_plant, scales),
        ..Truth::unknown()
    }
}

/// The numbers of the plant that the effects are hidden in.
fn of_the_plant(host_plant: &HostPlant, scales: &UnitScales) -> Vec<TrueParameter> {
    let own = |name, value, dimension| scales.parameter(&EffectConstant { name, value, dimension });
    let mut parameters = Vec::new();
    if host_plant.sprung {
        parameters.push(own("k", 1.0, STIFFNESS));
    }
    parameters.push(own("c", host_plant.damping, RATE));
    if host_plant.drive == DriveKind::Force {
        let unit = if scales.unit == "rad" { "1/(kg m^2)" } else { "1/kg" };
        let mobility = own("b", 0.0, PLAIN);
        parameters.push(TrueParameter { value: scales.mobility, unit: unit.to_owned(), ..mobility });
    }
    if host_plant.cubic > 0.0 {
        parameters.push(own("k_3", host_plant.cubic, Dimension::Of { length: -2, time: -2 }));
    }
    if let Some(datum) = host_plant.datum {
        parameters.push(own("y_0", datum, LENGTH));
    }
    parameters
}

/// What is hidden, one sentence an effect, how large it is, and in what.
fn description(sentences: &[String], ratio: f64, host_plant: &HostPlant, scales: &UnitScales) -> String {
    let driven = match (host_plant.drive, host_plant.control) {
        (DriveKind::Base, _) => "its base moved",
        (DriveKind::Force, None) => "driven by a force",
        (DriveKind::Force, Some(_)) => "driven by a force that follows a reference",
        (DriveKind::None, _) => "left to itself",
    };
    let hidden = if sentences.is_empty() {
        "Nothing is hidden".to_owned()
    } else {
        let percent = short(percent(ratio));
        let of = if host_plant.sprung { "the spring's" } else { "the input" };
        format!("Hidden: {}; the missing force is {percent} % of {of}", sentences.join(" and "))
    };
    let kind = match (host_plant.sprung, host_plant.cubic > 0.0) {
        (false, _) => "a mass without a spring, counted with",
        (true, false) => "a linear oscillator of",
        (true, true) => "an oscillator with a known cubic spring of",
    };
    format!(
        "{hidden}. The rest is {kind} {} Hz and {} % of critical damping, {driven}.",
        short(significant(scales.rate / TAU)),
        short(percent(0.5 * host_plant.damping)),
    )
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
