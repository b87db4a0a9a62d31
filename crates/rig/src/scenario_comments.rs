//! What stands above a scenario's records in a file.

use std::fmt::Write as _;

use super::scenario_setup::CheckedScenario;
use super::scenarios::Scenario;
use super::sensor::{Noise, Sensor};
use sindyscope_values::model::{Equation, Mode, Model, modes};
use sindyscope_values::record::Role;
use sindyscope_values::term::{Expression, Layout, Symbol};

/// Masses from which on a plant's modes are told beside its equations.
const FEWEST_OF_STRUCTURE: usize = 4;

/// What made a scenario's records, one line each: the equations, what drives the plant, the sensors.
pub(super) fn comments(test: &CheckedScenario, scenario: &Scenario, seed: u64, truth: &Model) -> Vec<String> {
    let mut lines = vec![format!("Sindyscope's virtual rig, scenario {}: {}", scenario.name, scenario.summary)];
    lines.extend(truth.iter().map(|(state, equation)| in_words(state, equation, &truth.layout)));
    lines.extend(modes_in_words(truth));
    let changed = scenario.plant.parameters.iter().zip(&test.parameters);
    let holding = changed.into_iter().find(|(p, value)| p.name == "static" && **value > 1.0);
    if let Some((_, ratio)) = holding {
        lines.push(format!("static friction: holds up to {ratio:?} times the sliding friction"));
    }
    lines.push(format!("excitation: {}", test.shaken));
    lines.push(format!("initial state: {:?}", test.initial));
    if test.sampling.start > 0.0 {
        lines.push(format!("the first {:?} s of the motion are left out", test.sampling.start));
    }
    let places = test.places();
    if places.iter().enumerate().any(|(number, place)| number != *place) {
        let each = places.iter().enumerate().map(|(number, place)| format!("{} of mass {}", number + 1, place + 1));
        lines.push(format!("sensors: {}", each.collect::<Vec<_>>().join(", ")));
    }
    let motion = match test.measured.first() {
        Some(Role::Velocity(_)) => "velocity",
        Some(Role::Acceleration(_)) => "acceleration",
        _ => "displacement",
    };
    let watched = [(motion, &test.sensor), ("input", &test.input_sensor)];
    for (what, sensor) in watched {
        lines.extend(of_sensor(what, sensor, seed));
    }
    lines
}

/// Natural frequencies and damping ratios of a structure of more masses than an equation tells at a glance.
fn modes_in_words(truth: &Model) -> Option<String> {
    if truth.layout.freedoms < FEWEST_OF_STRUCTURE {
        return None;
    }
    let of = |mode: &Mode| format!("{:.6} Hz ({:.4})", mode.frequency, mode.damping);
    // A joint's inner state oscillates in no mode of the linear structure.
    let mut linear = truth.clone();
    linear.layout.internals = 0;
    linear.equations.truncate(linear.layout.states());
    for equation in &mut linear.equations {
        equation.terms.retain(|t| !t.term.symbols().iter().any(|s| matches!(s, Symbol::Internal(_))));
    }
    let each: Vec<String> = modes(&linear, &[]).iter().map(of).collect();
    Some(format!("truth: modes of the linear structure at rest, with damping ratios: {}", each.join(", ")))
}

/// An equation of motion, as in `truth: dv/dt = - 600.0*(x2-x1)`.
fn in_words(state: Symbol, equation: &Equation, layout: &Layout) -> String {
    let mut line = format!("truth: d{}/dt =", layout.name(state));
    for (k, part) in equation.terms.iter().enumerate() {
        let sign = if part.coefficient < 0.0 { "-" } else { "+" };
        let term = match part.term.expression() {
            Expression::Sum(_) => format!("({})", part.term.text(layout)),
            _ => part.term.text(layout),
        };
        let sign = if k == 0 && sign == "+" { String::new() } else { format!(" {sign}") };
        let size = part.coefficient.abs();
        let factor = if size == 1.0 { String::new() } else { format!("{size:?}*") };
        let _ = write!(line, "{sign} {factor}{term}");
    }
    line
}

/// What a sensor adds to the quantity that it measures; nothing of a perfect one.
fn of_sensor(what: &str, sensor: &Sensor, seed: u64) -> Vec<String> {
    let Sensor { noise, resolution, offset, drift, high_pass, .. } = *sensor;
    let mut lines = Vec::new();
    if noise != Noise::NONE {
        let size = match noise {
            Noise::Deviation(deviation) => format!("{deviation:?}"),
            Noise::ShareOfPeak(share) => format!("{:?} % of the largest magnitude", 100.0 * share),
            Noise::ShareOfRms(share) => format!("{:?} % of the RMS", 100.0 * share),
        };
        lines.push(format!("noise of the {what}: white, Gaussian, standard deviation {size}, seed {seed}"));
    }
    if resolution > 0.0 {
        lines.push(format!("resolution of the {what}: {resolution:?}"));
    }
    if offset != 0.0 || drift != 0.0 {
        lines.push(format!("zero of the {what}: off by {offset:?}, growing by {drift:?} a second"));
    }
    if high_pass > 0.0 {
        lines.push(format!("high-pass of the {what}: first order, corner at {high_pass:?} Hz"));
    }
    lines
}
