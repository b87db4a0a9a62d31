//! What each constant of the search moves: hidden effects searched with every one of them halved and doubled.
//!
//! `cargo test --profile study -p sindyscope-search --test constants -- --ignored --nocapture`; `SINDYSCOPE_DRAWS=24` takes the
//! first twenty-four draws alone, `SINDYSCOPE_DRAWS=24..36` those behind them, `SINDYSCOPE_CONSTANTS=lead,block` these constants.

use super::drawn::{Drawn, Searched, hidden, in_regime, searched, two_masses};
use rayon::prelude::*;
use sindyscope_rig::NoiseKind;
use sindyscope_rig::hidden::{ExcitationKind, Instruments, Regime};
use sindyscope_search::{CONSTANTS, Constant, Constants};

/// Share of the effort from which a constant moves it.
const EFFORT_MOVED: f64 = 0.02;
/// Standard deviations of fair coins by which a halved or doubled constant may do better than the default: of so many draws
/// that come out otherwise, better and worse ones differ by chance alone.
const BY_CHANCE: f64 = 2.0;

/// Samples of the fitted records where a regime does not say: fewer than are usual, for the sake of time.
const SAMPLES: usize = 900;

/// One draw in the order of the study; any first part of it is well mixed.
type Draw = fn() -> Drawn;

const MULTISINE: ExcitationKind = ExcitationKind::Multisine;
const SWEEP: ExcitationKind = ExcitationKind::SweepPair;
const DECAY: ExcitationKind = ExcitationKind::Decay;

fn quiet(effects: &str, excitation: ExcitationKind, seed: u64) -> Drawn {
    hidden(effects, excitation, Instruments::white(0.01), SAMPLES, seed)
}

fn noisy(effects: &str, excitation: ExcitationKind, seed: u64) -> Drawn {
    hidden(effects, excitation, Instruments::white(0.05), SAMPLES, seed)
}

fn nothing(excitation: ExcitationKind, kind: NoiseKind, seed: u64) -> Drawn {
    hidden("", excitation, Instruments { kind, ..Instruments::white(0.05) }, SAMPLES, seed)
}

/// Those that are searched within a second or two, then those that take longer.
const DRAWS: &[Draw] = &[
    || quiet("coulomb_friction", DECAY, 50),
    || quiet("bilinear_stiffness", SWEEP, 61),
    || quiet("viscous_damping+cubic_stiffness", MULTISINE, 78),
    || nothing(MULTISINE, NoiseKind::White, 5),
    || quiet("static_friction", SWEEP, 29),
    || in_regime(Regime::SeveralRecords, 2),
    || quiet("stiffness_drift", MULTISINE, 72),
    || two_masses(0.3, 1),
    || quiet("clearance", DECAY, 54),
    || in_regime(Regime::SelfExcited, 4),
    || quiet("unmeasured_harmonic_force", SWEEP, 67),
    || quiet("unmeasured_harmonic_force+coulomb_friction", MULTISINE, 82),
    || quiet("second_mode", MULTISINE, 64),
    || nothing(SWEEP, NoiseKind::Coloured, 11),
    || quiet("viscoelastic_relaxation", SWEEP, 63),
    || in_regime(Regime::Datum, 0),
    || quiet("one_sided_stop", MULTISINE, 60),
    || in_regime(Regime::Sensors, 3),
    || quiet("quadratic_damping", DECAY, 51),
    || noisy("coulomb_friction", MULTISINE, 50),
    || nothing(MULTISINE, NoiseKind::Quantised, 16),
    || quiet("input_saturation", MULTISINE, 66),
    || two_masses(0.0, 2),
    || hidden("second_mode", MULTISINE, Instruments::white(0.01), 9_000, 12),
    || quiet("constant_force+cubic_stiffness", SWEEP, 81),
    || noisy("input_delay", SWEEP, 65),
    || hidden("quadratic_stiffness", ExcitationKind::SingleTone, Instruments::white(0.05), SAMPLES, 27),
    || noisy("inertia_nonlinearity", SWEEP, 77),
    || in_regime(Regime::ClosedLoop, 4),
    || quiet("bilinear_stiffness+cubic_damping", MULTISINE, 84),
    || in_regime(Regime::NoSpring, 5),
    || noisy("quintic_stiffness", MULTISINE, 30),
    || in_regime(Regime::Sticking, 9),
    || noisy("quadratic_stiffness", MULTISINE, 56),
    || quiet("cubic_stiffness", DECAY, 53),
    || in_regime(Regime::Sensors, 0),
    || quiet("parametric_stiffness", MULTISINE, 25),
    || nothing(DECAY, NoiseKind::White, 23),
    || noisy("clearance", SWEEP, 59),
    || quiet("one_sided_stop+coulomb_friction", MULTISINE, 31),
    || in_regime(Regime::LightDamping, 3),
    || quiet("constant_force", MULTISINE, 70),
    || quiet("input_delay+coulomb_friction", MULTISINE, 9),
    || in_regime(Regime::SelfExcited, 0),
    || nothing(SWEEP, NoiseKind::Quantised, 32),
    || in_regime(Regime::Datum, 5),
    || noisy("displacement_dependent_damping", DECAY, 28),
    || quiet("clearance+quadratic_damping", MULTISINE, 14),
    || two_masses(0.6, 3),
    || in_regime(Regime::SeveralRecords, 4),
    || quiet("sensor_offset", MULTISINE, 71),
    || quiet("cubic_stiffness+coulomb_friction", MULTISINE, 3),
    || in_regime(Regime::Wide, 6),
    || quiet("stribeck_friction", SWEEP, 51),
    || quiet("magnet", MULTISINE, 21),
    || in_regime(Regime::Sticking, 6),
    || quiet("bouc_wen_hysteresis", MULTISINE, 7),
    || in_regime(Regime::LightDamping, 2),
    || noisy("static_friction", MULTISINE, 39),
    || in_regime(Regime::ClosedLoop, 6),
];

/// What a set of constants came to over all draws.
struct Total {
    right: usize,
    wrong: usize,
    explained: usize,
    steps: f64,
}

impl Total {
    fn of(searched: &[Searched]) -> Self {
        let count = |of: &dyn Fn(&Searched) -> bool| searched.iter().filter(|s| of(s)).count();
        Self {
            right: count(&|s| s.right),
            wrong: count(&|s| s.is_wrong()),
            explained: count(&|s| s.explained),
            steps: searched.iter().map(|s| s.effort.steps as f64).sum(),
        }
    }

    /// Names right, wrong, gaps explained, and the effort beside another.
    fn cells(&self, default: &Self) -> String {
        let Self { right, wrong, explained, steps } = self;
        format!("{right} / {wrong} / {explained} | {:+.1} %", 100.0 * (steps / default.steps - 1.0))
    }
}

/// A right name counts one, a wrong one as much against.
fn worth(searched: &Searched) -> i32 {
    i32::from(searched.right) - i32::from(searched.is_wrong())
}

/// The draws that come out otherwise: their numbers, and how much better and worse they are.
fn moved(default: &[Searched], changed: &[Searched]) -> (Vec<usize>, i32, i32) {
    let said = |s: &Searched| (s.verdict, s.explained, s.names.clone());
    let all = (0..default.len()).filter(|k| said(&default[*k]) != said(&changed[*k])).collect();
    let gains = || default.iter().zip(changed).map(|(before, after)| worth(after) - worth(before));
    (all, gains().map(|g| g.max(0)).sum(), gains().map(|g| (-g).max(0)).sum())
}

/// The draws that `SINDYSCOPE_DRAWS` asks for, as a number or from one to another; all of them otherwise.
fn draws_asked_for() -> (usize, usize) {
    let text = std::env::var("SINDYSCOPE_DRAWS").unwrap_or_default();
    let (from, to) = text.split_once("..").unwrap_or(("0", &text));
    let to = to.parse().unwrap_or(DRAWS.len()).min(DRAWS.len());
    (from.parse().unwrap_or(0).min(to), to)
}

/// What `SINDYSCOPE_CONSTANTS` asks for; all of them otherwise.
fn asked_for() -> Vec<&'static Constant> {
    let wanted = std::env::var("SINDYSCOPE_CONSTANTS").ok();
    let is_wanted = |c: &&Constant| wanted.as_ref().is_none_or(|list| list.split(',').any(|name| name == c.name));
    Constants::EACH.iter().filter(is_wanted).collect()
}

#[test]
#[ignore = "half an hour on one core, in the profile `study`"]
fn no_constant_does_better_halved_or_doubled() {
    let (from, to) = draws_asked_for();
    let draws: Vec<Drawn> = DRAWS[from..to].par_iter().map(|draw| draw()).collect();
    let all = |constants: &Constants| draws.par_iter().map(|d| searched(d, constants)).collect::<Vec<Searched>>();
    let default = all(&CONSTANTS);
    for (k, (drawn, found)) in draws.iter().zip(&default).enumerate() {
        let Searched { verdict, names, effort, right, .. } = found;
        let mark = if *right { "" } else { "!" };
        println!(
            "{:2}{mark:1} {}: {} {} ({} steps)",
            from + k,
            drawn.name,
            verdict.word(),
            names.join(" + "),
            effort.steps
        );
    }
    let reference = Total::of(&default);
    println!("\ndefault: {}\n", reference.cells(&reference));
    println!(
        "| constant | value | unit | halved: right / wrong / explained | effort | doubled | effort | draws that move |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let (mut beaten, mut idle) = (Vec::new(), Vec::new());
    for constant in asked_for() {
        let mut cells = Vec::new();
        let mut numbers: Vec<usize> = Vec::new();
        let mut most: f64 = 0.0;
        for by in [0.5, 2.0] {
            let changed = all(&(constant.times)(by));
            let (which, better, worse) = moved(&default, &changed);
            let total = Total::of(&changed);
            cells.push(total.cells(&reference));
            most = most.max((total.steps / reference.steps - 1.0).abs());
            numbers.extend(which);
            if f64::from(better - worse) > BY_CHANCE * f64::from(better + worse).sqrt() {
                beaten.push(format!("{} times {by}: {better} better, {worse} worse", constant.name));
            }
        }
        numbers.sort_unstable();
        numbers.dedup();
        if numbers.is_empty() && most <= EFFORT_MOVED {
            idle.push(constant.name);
        }
        let numbers: Vec<String> = numbers.iter().map(|k| (from + k).to_string()).collect();
        let (name, value, unit) = (constant.name, (constant.value)(&CONSTANTS), constant.unit);
        println!("| `{name}` | {value} | {unit} | {} | {} |", cells.join(" | "), numbers.join(" "));
    }
    println!("\nmove nothing: {}", idle.join(", "));
    assert!(beaten.is_empty(), "better than the default by more than chance:\n{}", beaten.join("\n"));
}
