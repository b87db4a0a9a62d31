//! Records of a scenario, and what made them.

use super::RigError;
use super::motion::PlantMotion;
use super::response::SampleTimes;
use super::scenario_comments::comments;
use super::scenario_options::ScenarioOptions;
use super::scenario_setup::CheckedScenario;
use super::scenarios::{ScenarioExcitation, scenarios};
use super::setup::{Setup, SetupRun};
use super::truth::{Truth, is_input};
use sindyscope_values::model::Model;
use sindyscope_values::record::Record;

/// Records of the rig, and what made them.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenarioRun {
    /// The records.
    pub records: Vec<Record>,
    /// The equations of motion that made them; dry friction as a sign term, true as long as nothing sticks.
    pub truth: Truth,
    /// What made them, one line each, for the head of a file.
    pub comments: Vec<String>,
}

/// Makes the records of a scenario.
///
/// # Errors
/// An unknown scenario; an option that is out of bounds or that the scenario has no use for; a motion that grows without
/// bound.
pub fn generate(name: &str, options: &ScenarioOptions) -> Result<ScenarioRun, RigError> {
    let scenario = scenarios().iter().find(|s| s.name == name).ok_or_else(|| RigError::UnknownScenario {
        name: name.to_owned(),
        known: scenarios().iter().map(|s| s.name).collect::<Vec<_>>().join(", "),
    })?;
    let test = CheckedScenario::new(scenario, options)?;
    let setup = test.setup(scenario, options.seed);
    let SetupRun { records, motions, truth } = setup.run()?;
    let Setup { plant, .. } = &setup;
    let shaken = matches!(
        scenario.excitation_kind,
        ScenarioExcitation::Tones | ScenarioExcitation::Sweep | ScenarioExcitation::Multisine
    );
    let equations = if shaken { plant.truth() } else { unforced(plant.truth()) };
    let mut comments = comments(&test, scenario, options.seed, &equations);
    let stops: Vec<f64> = motions.iter().flat_map(|motion| stopped(motion, &test.sampling)).collect();
    if !plant.contacts.is_empty() {
        comments.push(match stops.len() {
            0 => "the mass never sticks".to_owned(),
            1 => format!("the mass sticks once, {:.4} s long", stops[0]),
            n => format!("the mass sticks {n} times, {:.4} s in all", stops.iter().sum::<f64>()),
        });
    }
    comments.push(format!("made by: {}", options.command(name)));
    Ok(ScenarioRun { records, truth, comments })
}

/// How long contacts stuck while a motion was sampled, each time.
fn stopped(motion: &PlantMotion, sampling: &SampleTimes) -> impl Iterator<Item = f64> {
    let (first, last) = (sampling.start, sampling.time(sampling.count - 1));
    motion.stops.iter().map(move |s| s.to.min(last) - s.from.max(first)).filter(|length| *length > 0.0)
}

/// The model of a plant that is left without its input.
fn unforced(mut model: Model) -> Model {
    for equation in &mut model.equations {
        equation.terms.retain(|t| !t.term.symbols().iter().any(is_input));
    }
    model.layout.inputs = 0;
    model
}

#[cfg(test)]
#[path = "scenario_tests.rs"]
mod tests;
