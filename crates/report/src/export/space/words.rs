//! What stands at the top of an exported structure: its modes, the matrices' meaning, units, and the force beside them.

use super::super::switched::Switched;
use super::{SpaceForce, StateSpace};
use crate::modal::{force_rate, force_term};
use sindyscope_modes::{Effect, Quantity, Sensor};
use sindyscope_values::format::number::{format_measured, significant};

impl StateSpace<'_> {
    /// The lines that say what the matrices are and of which modes.
    pub(in super::super) fn description(&self, switched: &Switched) -> Vec<String> {
        let [first, second] = self.meaning();
        let mut lines = vec![String::new(), first, second, String::new()];
        lines.push(format!("States X: {}.", self.state_words()));
        lines.push(format!("Inputs U: {}.", self.input_words()));
        lines.push(format!("Outputs Y: {}.", self.sensor_words()));
        lines.push(String::new());
        lines.push("mode  frequency [Hz]       damping ratio [%]    unit of q".into());
        for (i, mode) in self.structure.modes.iter().enumerate() {
            let frequency = format_measured(mode.frequency, mode.frequency_error);
            let damping = format_measured(100.0 * mode.damping, mode.damping_error.map(|e| 100.0 * e));
            let beyond = if self.structure.in_band[i] { "" } else { "  (outside the band that the inputs drive)" };
            lines.push(format!("{:>4}  {frequency:<20} {damping:<20} {}{beyond}", i + 1, self.unit_of_mode(i)));
        }
        if let Some(force) = &self.force {
            lines.push(String::new());
            lines.extend(self.force_words(force));
        }
        if let Some(sticking) = switched.surfaces.iter().any(|s| s.slides).then_some(STICKING) {
            lines.push(sticking.into());
        }
        lines
    }

    /// The two equations, without what is not there.
    fn meaning(&self) -> [String; 2] {
        let inputs = |text: &'static str| if self.structure.inputs.is_empty() { "" } else { text };
        let force = |text: &'static str| if self.force.is_none() { "" } else { text };
        let inner = if self.inner_state().is_some() { " + E g" } else { "" };
        [
            format!("State space in modal coordinates: dX/dt = A X{}{}{inner},", inputs(" + B U"), force(" + G f")),
            format!("outputs Y = C X{}{} + offset.", inputs(" + D U"), force(" + H f")),
        ]
    }

    fn state_words(&self) -> String {
        let several = |letter: &str| match self.structure.modes.len() {
            1 => format!("{letter}1"),
            m => format!("{letter}1 to {letter}{m}"),
        };
        format!(
            "modal displacements {} (each the displacement of the sensor that its mode moves most), and their rates {}{}; \
             C turns them into what the sensors show",
            several("q"),
            several("p"),
            if self.inner_state().is_some() { ", then the force's inner state z1" } else { "" }
        )
    }

    fn input_words(&self) -> String {
        let each: Vec<String> = self.structure.inputs.iter().map(|u| quantity(&u.name, &u.unit)).collect();
        if each.is_empty() { "none, a free decay".to_owned() } else { each.join(", ") }
    }

    fn sensor_words(&self) -> String {
        let of = |s: &Sensor| {
            let what = match s.quantity {
                Quantity::Displacement => "displacement",
                Quantity::Velocity => "velocity",
                Quantity::Acceleration => "acceleration",
            };
            format!("{what} {}", quantity(&s.name, &s.unit))
        };
        self.structure.sensors.iter().map(of).collect::<Vec<_>>().join(", ")
    }

    /// The unit of a modal coordinate: that of the displacement of the sensor at which the shape is one.
    pub(super) fn unit_of_mode(&self, mode: usize) -> String {
        let shape = &self.structure.modes[mode].shape;
        let largest = (0..shape.len()).max_by(|a, b| shape[*a].abs().total_cmp(&shape[*b].abs()));
        largest.map_or_else(String::new, |s| displacement_unit(&self.structure.sensors[s]))
    }

    /// The unit of the force's inner state.
    pub(super) fn unit_of_inner(&self) -> String {
        let yields = self.force.iter().flat_map(|f| &f.parameters).find(|p| p.name == "x_b");
        yields.map_or_else(String::new, |p| p.unit.clone())
    }

    /// The force, where it acts and its parameters, a line each.
    pub(super) fn force_words(&self, force: &SpaceForce) -> Vec<String> {
        let term = force_term(force.effect, force.site, &self.structure.sensors);
        let mut lines = vec![format!("Force f = {term}: {} at {}.", force.effect.title().to_lowercase(), force.site)];
        lines.push(format!(
            "{} is that of the modes together: {}.",
            motion_name(force.effect),
            self.across_words(force)
        ));
        if let Some(rate) = force_rate(force.effect, force.site, &self.structure.sensors) {
            lines.push(format!("The rate of its inner state z1 is g = {rate}, at the velocity of the same motion."));
        }
        for p in &force.parameters {
            lines.push(format!("  {} = {} {}", p.name, format_measured(p.value, p.std_error), p.unit));
        }
        lines.push("  (a force is told as the acceleration that it makes at its place; G and H hold its size)".into());
        lines
    }

    /// The motion across the force's place as a sum over the modes.
    fn across_words(&self, force: &SpaceForce) -> String {
        let names = self.state_names();
        let used = force.across.iter().zip(&names).filter(|(w, _)| **w != 0.0);
        let parts: Vec<String> = used.map(|(w, name)| format!("{} {name}", significant(*w, 4))).collect();
        parts.join(" + ").replace("+ -", "- ").replace("+ \u{2212}", "- ")
    }
}

/// What holds of dry friction where its place stands still.
const STICKING: &str =
    "Sticking: where the velocity across its place stays at zero, the friction takes the value that keeps it there.";

fn motion_name(effect: Effect) -> &'static str {
    if effect.is_of_velocity() { "Its velocity" } else { "Its displacement" }
}

fn quantity(name: &str, unit: &str) -> String {
    if unit.is_empty() { format!("{name} (unit not known)") } else { format!("{name} in {unit}") }
}

/// The unit of the displacement that a sensor's place has.
fn displacement_unit(sensor: &Sensor) -> String {
    let unit = sensor.unit.as_str();
    let (per, times) = match sensor.quantity {
        Quantity::Displacement => return unit.to_owned(),
        Quantity::Velocity => ("/s", "s"),
        Quantity::Acceleration => ("/s^2", "s^2"),
    };
    unit.strip_suffix(per).map_or_else(|| format!("{unit} {times}").trim().to_owned(), str::to_owned)
}
