//! The strengths of effects, found so that their missing forces are of the size asked for.

use super::assembly::{Assembly, extents, reference, stuck_share};
use super::catalogue::Effect;
use super::excitation_kind::PlannedRecord;
use super::host_plant::{Draws, HostPlant, Magnitude, MotionSize};
use crate::RigError;
use crate::interpolant::Accuracy;
use crate::motion::PlantMotion;

/// Rounds of simulation after which a draw is given up.
const MOST_ROUNDS: usize = 14;
/// Rounds in which parameters that follow the motion's size still do.
const FOLLOWING_ROUNDS: usize = 4;
/// How near to the ratio asked for is near enough.
const NEAR: f64 = 0.03;
/// What will do if nothing nearer was found: half to twice as much.
const NEAR_ENOUGH: f64 = std::f64::consts::LN_2;
/// The least share in which a static level above the sliding one must.
const LEAST_STUCK: f64 = 0.02;
/// Samples left out between two that are measured while calibrating.
const COARSER: usize = 3;

/// Finds strengths with which each effect's missing force has its ratio to the spring's force; an effect that cannot reach it
/// within what is sensible stays at its bound.
///
/// Friction holds the mass for `most_stuck` of the time at most.
pub(super) fn calibrate(
    effects: &[(&Effect, Draws)],
    targets: &[f64],
    most_stuck: f64,
    host_plant: &mut HostPlant,
    runs: &[PlannedRecord],
) -> Result<Assembly, RigError> {
    // What a control hears changes the size of nothing.
    let quiet = |run: &PlannedRecord| PlannedRecord { noise: None, ..run.coarse(COARSER) };
    let runs: Vec<PlannedRecord> = runs.iter().filter(|r| !r.held_out).map(quiet).collect();
    let mut targets = targets.to_vec();
    let mut most: Vec<f64> = effects.iter().map(|(e, _)| e.most).collect();
    let mut strengths: Vec<f64> =
        effects.iter().zip(&targets).zip(&most).map(|(((e, _), t), most)| (e.first * t).min(*most)).collect();
    // How a ratio grows with its strength, as a power.
    let mut powers = vec![1.0; effects.len()];
    let mut last: Option<(Vec<f64>, Vec<f64>)> = None;
    let mut best: Option<(f64, Assembly)> = None;
    for round in 0..MOST_ROUNDS {
        let assembly = Assembly::new(effects, &strengths, host_plant);
        let motions: Vec<PlantMotion> = match runs.iter().map(|run| assembly.follow(run, Accuracy::DRAFT)).collect() {
            Ok(motions) => motions,
            Err(RigError::Unbounded { .. }) => {
                for (strength, most) in strengths.iter_mut().zip(&mut most) {
                    *strength *= 0.6;
                    *most = *strength;
                }
                last = None;
                continue;
            }
            Err(error) => return Err(error),
        };
        let (ratios, _) = measure(&assembly, &motions);
        let stuck = stuck_share(&motions);
        let must_stick = effects.iter().any(|(e, _)| e.name == "static_friction");
        if stuck > most_stuck {
            for (j, (effect, _)) in effects.iter().enumerate() {
                if assembly.parts[j].contact.is_some() {
                    strengths[j] *= 0.7;
                    most[j] = strengths[j].min(effect.most);
                }
            }
            last = None;
            continue;
        }
        let reached = |j: usize| (ratios[j] / targets[j] - 1.0).abs() < NEAR;
        let bound = |j: usize| strengths[j] >= most[j] * 0.999 && ratios[j] < targets[j];
        if round > 0 && (0..effects.len()).all(|j| reached(j) || bound(j)) || effects.is_empty() {
            let bound_all = (0..effects.len()).all(bound);
            if !must_stick || stuck >= LEAST_STUCK || bound_all {
                return Ok(assembly);
            }
            targets.iter_mut().for_each(|t| *t *= 1.4);
        }
        let distance = (0..effects.len()).map(|j| (ratios[j] / targets[j]).ln().abs()).fold(0.0, f64::max);
        if distance < best.as_ref().map_or(NEAR_ENOUGH, |(least, _)| *least) && !must_stick {
            best = Some((distance, assembly.clone()));
        }
        if let Some((before, were)) = &last {
            for j in 0..effects.len() {
                let (step, change) = ((strengths[j] / before[j]).ln(), (ratios[j] / were[j]).ln());
                if step.abs() > 0.01 && change.is_finite() {
                    powers[j] = (change / step).clamp(0.5, 4.0);
                }
            }
        }
        last = Some((strengths.clone(), ratios.clone()));
        for j in 0..effects.len() {
            let factor = (targets[j] / ratios[j].max(1e-6)).powf(1.0 / powers[j]).clamp(0.3, 3.0);
            strengths[j] = (strengths[j] * factor).min(most[j]);
        }
        if round < FOLLOWING_ROUNDS {
            host_plant.motion = extents(&assembly, &motions);
        }
    }
    // A motion that jumps from one branch to another has no strength for some ratios.
    best.map(|(_, assembly)| assembly).ok_or_else(|| RigError::BadOption {
        option: "ratio",
        problem: "the missing force does not settle at the size asked for; ask for a smaller one".to_owned(),
    })
}

/// Simulations after which no other strength of friction is sought, in each of two rounds.
const MOST_HALVINGS: usize = 9;
/// How near to the share of time asked for is near enough.
const NEAR_STILL: f64 = 0.1;

/// Finds the strength of friction with which it holds the mass still about a share of the time, and in each record for a share within
/// bounds.
pub(super) fn hold(
    effects: &[(&Effect, Draws)],
    share: f64,
    bounds: (f64, f64),
    host_plant: &mut HostPlant,
    runs: &[PlannedRecord],
) -> Result<Assembly, RigError> {
    let runs: Vec<PlannedRecord> = runs.iter().map(|r| r.coarse(COARSER)).collect();
    let (mut least, mut most) = (0.01, 3.0);
    for round in 0..2 {
        let scale = host_plant.motion.x.rms;
        let mut nearest: Option<(f64, Assembly, Vec<PlantMotion>)> = None;
        for _ in 0..MOST_HALVINGS {
            let middle = f64::sqrt(least * most);
            let assembly = Assembly::new(effects, &vec![middle; effects.len()], host_plant);
            let motions: Vec<PlantMotion> =
                runs.iter().map(|run| assembly.follow(run, Accuracy::DRAFT)).collect::<Result<_, _>>()?;
            let still = stuck_share(&motions);
            let each: Vec<f64> = motions.iter().map(|m| stuck_share(std::slice::from_ref(m))).collect();
            let within = each.iter().all(|still| (bounds.0..bounds.1).contains(still));
            let distance = (still - share).abs() + if within { 0.0 } else { 1.0 };
            if nearest.as_ref().is_none_or(|(least, ..)| distance < *least) {
                nearest = Some((distance, assembly, motions));
            }
            if distance < NEAR_STILL {
                break;
            }
            if still < share { least = middle } else { most = middle }
        }
        let Some((distance, assembly, motions)) = nearest else { break };
        if round == 1 && distance < 1.0 {
            return Ok(assembly);
        }
        // Widths in velocity follow the motion, which is known now; strengths are counted in its displacement.
        host_plant.motion = extents(&assembly, &motions);
        let change = scale / host_plant.motion.x.rms;
        (least, most) = (0.2 * least * change, 5.0 * most * change);
    }
    Err(RigError::BadOption {
        option: "regime",
        problem: "no strength of the friction holds the mass still for the share of time asked for".to_owned(),
    })
}

/// RMS missing force over RMS spring force: of each effect, and of all together.
pub(super) fn measure(assembly: &Assembly, motions: &[PlantMotion]) -> (Vec<f64>, f64) {
    let mut apart = vec![Vec::new(); assembly.parts.len()];
    let mut together = Vec::new();
    let mut spring = Vec::new();
    for (index, motion) in motions.iter().enumerate() {
        let missing = assembly.missing(motion, shift(index));
        together.extend((0..motion.times.len()).map(|k| missing.iter().map(|m| m[k]).sum::<f64>()));
        for (all, own) in apart.iter_mut().zip(missing) {
            all.extend(own);
        }
        spring.extend(reference(assembly, motion));
    }
    let rms = |values: &[f64]| Magnitude::over(values.iter().copied()).rms;
    let spring = rms(&spring).max(f64::MIN_POSITIVE);
    (apart.iter().map(|m| rms(m) / spring).collect(), rms(&together) / spring)
}

/// A record's own share of a shifted zero: of both signs, RMS about one.
pub(super) fn shift(record: usize) -> f64 {
    [1.1, -0.7, 0.5, -1.3, 1.4][record % 5]
}

/// The size of the linear plant's motion.
pub(super) fn linear_motion(host_plant: &HostPlant, runs: &[PlannedRecord]) -> Result<MotionSize, RigError> {
    let assembly = Assembly::new(&[], &[], host_plant);
    let fitted = runs.iter().filter(|r| !r.held_out);
    let motions: Vec<PlantMotion> =
        fitted.map(|run| assembly.follow(&run.coarse(COARSER), Accuracy::DRAFT)).collect::<Result<_, _>>()?;
    Ok(extents(&assembly, &motions))
}
