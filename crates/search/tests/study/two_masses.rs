//! Two masses in a chain on the virtual rig, the force on the first, with an effect hidden at one of three places.

use std::sync::Arc;

use sindyscope_core::study::Cancel;
use sindyscope_rig::{Contact, Excitation, Plant, SampleTimes, Sensor, respond};
use sindyscope_search::{Ask, Diagnosis, Search};
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};
use sindyscope_values::term::Term;

/// Stiffness over mass of the springs to ground and between the masses, as felt by the first and by the second.
const GROUND: f64 = 600.0;
const JOINT: [f64; 2] = [500.0, 800.0];

fn term(text: &str) -> Term {
    Term::parse(text).unwrap()
}

/// Dry friction between the masses, by the force on the first per unit of its mass; none where it is zero.
pub(crate) fn rubbing(strength: f64) -> Plant {
    let first = [("x1", -GROUND), ("v1", -0.6), ("x1-x2", -JOINT[0]), ("v1-v2", -0.4), ("u", 1.0)];
    let second = [("x1-x2", JOINT[1]), ("v1-v2", 0.4 * JOINT[1] / JOINT[0])];
    let equation = |terms: &[(&str, f64)]| Equation::known(terms.iter().map(|(text, c)| (term(text), *c)));
    let smooth = Model::second_order(1, vec![equation(&first), equation(&second)]);
    let sliding = vec![(term("1"), strength)];
    let acts_on = vec![(2, 1.0), (3, -JOINT[1] / JOINT[0])];
    let contact = Contact { velocity: term("v1-v2"), acts_on, sliding, holding_ratio: 1.0 };
    Plant { smooth, contacts: if strength > 0.0 { vec![contact] } else { Vec::new() } }
}

/// Displacements of both masses with 1 % of noise, and the force.
fn record(plant: &Plant, count: usize, seed: u64) -> Record {
    let sampling = SampleTimes { start: 0.0, interval: 0.012, count };
    let excitation = Excitation::multisine(2.0, (1.2, 8.5), 30, seed);
    let response = respond(plant, std::slice::from_ref(&excitation), &[0.0; 4], &sampling).unwrap();
    let channel = |name: &str, role: Role, unit: &str, values: Vec<f64>| Channel {
        name: name.to_owned(),
        role,
        unit: unit.to_owned(),
        values: Arc::from(values),
        estimated: false,
    };
    let mut channels: Vec<Channel> = (0..2)
        .map(|i| {
            let clean = &response.states[i];
            let size = (clean.iter().map(|x| x * x).sum::<f64>() / clean.len() as f64).sqrt();
            let sensor = Sensor::noisy(0.01 * size);
            channel(["x1", "x2"][i], Role::Displacement(i), "m", sensor.measure(clean, seed, i as u64))
        })
        .collect();
    let force = (0..count).map(|k| excitation.at(sampling.time(k)).0[0]).collect();
    channels.push(channel("u", Role::Input(0), "m/s^2", force));
    Record { name: format!("record {seed}"), source: None, start: 0.0, interval: 0.012, channels, notices: Vec::new() }
}

/// What the search makes of a plant.
pub(crate) fn diagnosed(plant: &Plant) -> Diagnosis {
    let mut records = RecordSet::new([record(plant, 1500, 1)], Usage::Fit);
    records.add([record(plant, 750, 2)], Usage::HeldOut);
    Search::new(&records, &Ask::default()).unwrap().diagnose(&|_| {}, &Cancel::default()).unwrap()
}
