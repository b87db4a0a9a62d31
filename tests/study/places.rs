//! Chains of the virtual rig with an effect hidden at one of their places, their masses and springs drawn.

use rand::seq::IndexedRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use sindyscope::gap::{Ask, Search, Verdict};
use sindyscope::record::{RecordSet, Usage};
use sindyscope::rig::{Noise, ScenarioOptions, generate};
use sindyscope::study::Cancel;

/// What the sensors of a chain show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    Displacement,
    Acceleration,
}

/// What became of a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    /// The effect at its place, or that nothing is missing.
    Right,
    /// Another effect or place by name, or an alarm.
    Wrong,
    /// No name that stands alone.
    Open,
}

/// A spring, damper, mass or effect of the rig's chain is so large, within these factors.
const SPREAD: (f64, f64) = (0.6, 1.6);

/// Hides friction, a cubic spring or nothing (in turn, by the seed) in a chain of two or three masses and searches for it.
///
/// None if the chain that was drawn does not stay within bounds.
pub(crate) fn draw(masses: usize, shown: Shown, nothing: bool, seed: u64) -> Option<Found> {
    let mut random = Pcg64::seed_from_u64(1000 * masses as u64 + seed);
    let (scenario, places, usual): (_, &[&str], &[(&str, f64)]) = match masses {
        2 => (
            "two-masses",
            &["1", "12", "2"],
            &[("m1", 2.0), ("m2", 1.0), ("k1", 800.0), ("k12", 600.0), ("c1", 2.0), ("c12", 1.2)],
        ),
        _ => (
            "three-masses",
            &["1", "12", "23", "3"],
            &[("m1", 2.0), ("k1", 1000.0), ("k12", 900.0), ("k23", 700.0), ("c1", 2.0), ("c12", 1.2)],
        ),
    };
    let mut parameters: Vec<(String, f64)> = usual
        .iter()
        .map(|(name, value)| ((*name).to_owned(), value * random.random_range(SPREAD.0..SPREAD.1)))
        .collect();
    let place = *places.choose(&mut random)?;
    let effect = if seed.is_multiple_of(2) { "coulomb_friction" } else { "cubic_stiffness" };
    if !nothing {
        // Far springs move most.
        let soft = if place == "2" || place == "3" { 0.3 } else { 1.0 };
        let hardens = if random.random() { 1.0 } else { -0.3 };
        parameters.push(match effect {
            "coulomb_friction" => (format!("F{place}"), random.random_range(0.15..0.6)),
            _ => (format!("h{place}"), hardens * soft * 2e6 * random.random_range(0.5..2.0)),
        });
    }
    let record = |seed: u64, duration: f64| {
        let options = ScenarioOptions {
            seed,
            duration: Some(duration),
            noise: Some(Noise::ShareOfPeak(0.01)),
            measure: (shown == Shown::Acceleration).then(|| vec!["a".to_owned()]),
            parameters: parameters.clone(),
            ..ScenarioOptions::default()
        };
        Some(generate(scenario, &options).ok()?.records)
    };
    let mut records = RecordSet::new(record(2 * seed + 1, 10.0)?, Usage::Fit);
    records.add(record(2 * seed + 2, 5.0)?, Usage::HeldOut);
    let found = Search::new(&records, &Ask::default()).ok()?.diagnose(&|_| {}, &Cancel::default()).ok()?;
    let site = match place {
        "12" => "1-2".to_owned(),
        "23" => "2-3".to_owned(),
        mass => format!("ground-{mass}"),
    };
    let steps: Vec<(&str, String)> = found
        .stages
        .last()?
        .effects
        .iter()
        .map(|e| (e.choice.effect.as_str(), e.place.map(|p| p.to_string()).unwrap_or_default()))
        .collect();
    let hidden = if nothing { "nothing".to_owned() } else { format!("{effect} at {site}") };
    let result = match (nothing, found.verdict) {
        (true, Verdict::NothingMissing) => Found::Right,
        (false, Verdict::Named) if steps == [(effect, site)] => Found::Right,
        (true, _) | (false, Verdict::Named) => Found::Wrong,
        (false, _) => Found::Open,
    };
    println!("{masses} masses, {shown:?}, {seed}: {hidden}: {:?} {steps:?}", found.verdict);
    if result != Found::Right {
        let set: Vec<String> = parameters.iter().map(|(name, value)| format!("--set {name}={value}")).collect();
        let (fitted, held_out) = (2 * seed + 1, 2 * seed + 2);
        println!("    seeds {fitted} (10 s) and {held_out} (5 s), --noise 1% {}", set.join(" "));
    }
    Some(result)
}
