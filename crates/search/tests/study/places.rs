//! Chains of the virtual rig with an effect hidden at one of their places, their masses and springs drawn.

use rand::seq::IndexedRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use sindyscope_core::study::Cancel;
use sindyscope_rig::hidden::SensedMotion;
use sindyscope_rig::{Noise, ScenarioOptions, generate};
use sindyscope_search::{Ask, Search, Verdict};
use sindyscope_values::record::{RecordSet, Usage};

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

/// A chain whose places hide something.
pub(crate) struct Chain {
    pub(crate) records: RecordSet,
    /// What is hidden in it and where, if anything is.
    pub(crate) effect: &'static str,
    pub(crate) site: String,
    parameters: Vec<(String, f64)>,
}

/// Hides friction, a cubic spring or nothing (in turn, by the seed) in a chain of two or three masses.
///
/// None if the chain that was drawn does not stay within bounds.
pub(crate) fn chain(masses: usize, shown: SensedMotion, nothing: bool, seed: u64) -> Option<Chain> {
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
            measure: Some(vec![shown.name().to_owned()]),
            parameters: parameters.clone(),
            ..ScenarioOptions::default()
        };
        Some(generate(scenario, &options).ok()?.records)
    };
    let mut records = RecordSet::new(record(2 * seed + 1, 10.0)?, Usage::Fit);
    records.add(record(2 * seed + 2, 5.0)?, Usage::HeldOut);
    let site = match place {
        "12" => "1-2".to_owned(),
        "23" => "2-3".to_owned(),
        mass => format!("ground-{mass}"),
    };
    Some(Chain { records, effect, site, parameters })
}

/// Searches for what a chain hides.
pub(crate) fn draw(masses: usize, shown: SensedMotion, nothing: bool, seed: u64) -> Option<Found> {
    let Chain { records, effect, site, parameters } = chain(masses, shown, nothing, seed)?;
    let found = Search::new(&records, &Ask::default()).ok()?.diagnose(&|_| {}, &Cancel::default()).ok()?;
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

/// Dry friction at the first mass and between both, under a rich force or in a free decay: what became of it, and the largest
/// error of a force as a share of it.
pub(crate) fn two_contacts(driven: bool, seed: u64) -> Option<(Found, f64)> {
    let mut random = Pcg64::seed_from_u64(2000 + seed);
    let strengths = [random.random_range(0.2..0.7), random.random_range(0.2..0.7)];
    let (masses, parameters) = ([2.0, 1.0], vec![("F1".to_owned(), strengths[0]), ("F12".to_owned(), strengths[1])]);
    let mut record = |seed: u64| {
        let mut released = || random.random_range(0.01..0.03) * if random.random::<bool>() { 1.0 } else { -1.0 };
        let options = ScenarioOptions {
            seed,
            duration: Some(10.0),
            noise: Some(Noise::ShareOfPeak(0.01)),
            amplitude: (!driven).then_some(0.0),
            initial: (!driven).then(|| vec![released(), released(), 0.0, 0.0]),
            parameters: parameters.clone(),
            ..ScenarioOptions::default()
        };
        Some(generate("two-masses", &options).ok()?.records)
    };
    let mut records = RecordSet::new(record(2 * seed + 1)?, Usage::Fit);
    records.add(record(2 * seed + 2)?, Usage::HeldOut);
    let found = Search::new(&records, &Ask::default()).ok()?.diagnose(&|_| {}, &Cancel::default()).ok()?;
    let last = found.stages.last()?;
    let of = |site: &str| {
        last.effects
            .iter()
            .find(|e| e.choice.effect == "coulomb_friction" && e.place.is_some_and(|p| p.to_string() == site))
    };
    let truth = [
        ("ground-1", vec![strengths[0] / masses[0]]),
        ("1-2", vec![strengths[1] / masses[0], strengths[1] / masses[1]]),
    ];
    let mut largest = 0.0_f64;
    for (site, forces) in truth {
        let parameters = of(site).map(|e| e.parameters.as_slice()).unwrap_or_default();
        for (k, force) in forces.iter().enumerate() {
            largest = largest.max(parameters.get(k).map_or(f64::INFINITY, |p| (p.value / force - 1.0).abs()));
        }
    }
    let result = match found.verdict {
        Verdict::Named if last.effects.len() == 2 && largest.is_finite() => Found::Right,
        Verdict::Named | Verdict::NothingMissing => Found::Wrong,
        Verdict::Ambiguous | Verdict::Unexplained => Found::Open,
    };
    let effects: Vec<&str> = last.effects.iter().map(|e| e.title.as_str()).collect();
    println!(
        "two contacts, driven {driven}, {seed}: {:?} {effects:?}, forces within {:.1} %, {:.1} s",
        found.verdict,
        1e2 * largest,
        1e-3 * found.elapsed_ms
    );
    Some((result, largest))
}
