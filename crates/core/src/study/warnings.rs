//! What is wrong or doubtful about an outcome, in words, with what would help.

use std::fmt::Write as _;

use super::{Lock, Outcome, RecordOutcome, Refinement, Settings, Severity, Warning};
use crate::remedy::Remedy;
use crate::signal::odd;
use crate::sparse::{Constraint, Reduced, SparseOptions, stlsq};
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::model::Equation;
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::{Expression, Function, Kind, Program, SampleBlock, Symbol, Term};

/// Every warning that applies, worst first.
///
/// `refused` says why nothing was refined though it was asked for.
pub(super) fn warnings(outcome: &Outcome, records: &RecordSet, refused: Option<&str>) -> Vec<Warning> {
    let mut found = Vec::new();
    found.extend(refused.map(|reason| warning(Severity::Caution, reason.to_owned())));
    found.extend(nothing_kept(outcome));
    found.extend(diverged(outcome));
    found.extend(overfit(outcome));
    found.extend(conditioning(outcome));
    found.extend(undamped(outcome));
    found.extend(damping_sign(outcome));
    found.extend(segment(outcome));
    found.extend(unmodelled(outcome));
    found.extend(standing(outcome));
    found.extend(never_tested(outcome, records));
    found.sort_by_key(|w| std::cmp::Reverse(w.severity));
    found
}

fn warning(severity: Severity, text: String) -> Warning {
    Warning { severity, text, remedy: None }
}

/// Sensors from which on records are likelier those of a structure than of masses that a spring ties each to the next.
const SEVERAL_SENSORS: usize = 3;

/// What may help where the equations of several masses explain too little.
fn by_modes(outcome: &Outcome) -> Option<Remedy> {
    let layout = &outcome.model.layout;
    (layout.kind == Kind::SecondOrder && layout.freedoms >= SEVERAL_SENSORS).then_some(Remedy::Modes)
}

fn nothing_kept(outcome: &Outcome) -> Option<Warning> {
    let empty = outcome.model.equations.iter().any(|e: &Equation| e.terms.is_empty());
    empty.then(|| {
        let lowest =
            outcome.fits.iter().flat_map(|f| f.drop_marks.last()).map(|(at, _)| *at).fold(f64::INFINITY, f64::min);
        let remedy = (lowest.is_finite() && lowest > 0.0).then(|| {
            let mut settings = outcome.settings.clone();
            settings.threshold = 0.5 * lowest;
            Remedy::Settings { label: "Lower the threshold".into(), settings: Box::new(settings) }
        });
        Warning { severity: Severity::Wrong, text: "The threshold dropped every term of an equation".into(), remedy }
    })
}

fn diverged(outcome: &Outcome) -> Option<Warning> {
    let first = outcome.records.iter().find(|r| r.diverged_at.is_some())?;
    let at = first.diverged_at?;
    let text = format!(
        "On record {} the simulated response diverges at {at:.3} s: a term is missing, or one is wrong",
        first.record.name
    );
    Some(Warning { severity: Severity::Wrong, text, remedy: by_modes(outcome) })
}

/// A wrong library fits the training data and fails the held-out ones.
fn overfit(outcome: &Outcome) -> Option<Warning> {
    let (train, test) = (outcome.train?, outcome.test?);
    let floor = outcome.noise_floor.unwrap_or(0.0);
    let fails = test.nrmse > 3.0 * train.nrmse && test.rmse > 2.0 * floor && test.nrmse > 0.01;
    fails.then(|| {
        let mut text = format!(
            "The model fits what it was fitted on (error {:.1} % of the motion) and fails what it was not ({:.1} %): \
             the library holds wrong terms or lacks right ones",
            100.0 * train.nrmse,
            100.0 * test.nrmse
        );
        let mut remedy = None;
        if let Some((term, times)) = carrier(outcome) {
            let name = term.pretty(&outcome.model.layout);
            let _ = write!(
                text,
                ". {name} carries it: its force is {times:.1} times as large a share there as where it was fitted"
            );
            let mut settings = outcome.settings.clone();
            settings.locks.insert(term, Lock::Out);
            remedy = Some(Remedy::Settings { label: format!("Try without {name}"), settings: Box::new(settings) });
        }
        Warning { severity: Severity::Caution, text, remedy }
    })
}

fn thinned(series: &[f64], stride: usize) -> Vec<f64> {
    series.iter().step_by(stride).copied().collect()
}

/// The term whose share of the forces grows most from the fitted records to those held out, and how many times: what was
/// learnt of it there does not hold here.
fn carrier(outcome: &Outcome) -> Option<(Term, f64)> {
    let layout = outcome.model.layout;
    let equation = outcome.model.leading().filter(|e| e.terms.len() > 1)?;
    let expressions: Vec<Expression> = equation.terms.iter().map(|t| t.term.expression().clone()).collect();
    let program = Program::new(&expressions, &layout);
    // The mean square of each term's force over the records of one usage.
    let forces = |usage: Usage| -> Vec<f64> {
        let mut squares = vec![0.0; expressions.len()];
        for record in outcome.records.iter().filter(|r| r.usage == usage) {
            let signals = &record.signals;
            let stride = (signals.states.first().map_or(0, Vec::len) / SAMPLED).max(1);
            let whole = |series: &[Vec<f64>]| -> Vec<Vec<f64>> { series.iter().map(|s| thinned(s, stride)).collect() };
            let thinned = [
                whole(&signals.states),
                whole(&signals.inputs),
                signals.input_rates().map(|s| thinned(s, stride)).collect(),
                signals.accelerations().map(|s| thinned(s, stride)).collect(),
            ];
            let [states, inputs, rates, accelerations] =
                thinned.each_ref().map(|series| series.iter().map(Vec::as_slice).collect::<Vec<&[f64]>>());
            let block = SampleBlock {
                start: signals.start,
                interval: signals.interval,
                states: &states,
                inputs: &inputs,
                input_rates: &rates,
                accelerations: &accelerations,
            };
            let mut columns = vec![Vec::new(); expressions.len()];
            program.columns(&block, &mut columns);
            for (square, column) in squares.iter_mut().zip(&columns) {
                *square += column.iter().map(|v| v * v).sum::<f64>() / column.len().max(1) as f64;
            }
        }
        squares.iter().zip(&equation.terms).map(|(s, t)| s.sqrt() * t.coefficient.abs()).collect()
    };
    let shares = |forces: Vec<f64>| -> Vec<f64> {
        let total: f64 = forces.iter().sum();
        forces.into_iter().map(|f| f / total).collect()
    };
    let (fitted, held_out) = (shares(forces(Usage::Fit)), shares(forces(Usage::HeldOut)));
    let growth = fitted.iter().zip(&held_out).map(|(a, b)| b / a.max(1e-12));
    // A term that is known well may be large there and right.
    let doubtful = |k: usize| {
        let term = &equation.terms[k];
        term.std_error.is_none_or(|e| e > DOUBT * term.coefficient.abs())
    };
    let carries = |(k, (times, share)): &(usize, (f64, &f64))| doubtful(*k) && *times > GROWTH && **share > LEAST_SHARE;
    let (index, (times, _)) =
        growth.zip(&held_out).enumerate().filter(carries).max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    Some((equation.terms[index].term.clone(), times))
}

/// Share of a record that a refined fit must follow in one run for terms to be compared by it.
pub(super) const MIN_FOLLOWED_SHARE: f64 = 0.9;
/// Samples of a record that shares of forces are estimated from.
const SAMPLED: usize = 5000;

/// A share of the forces that grows by so many times is named.
const GROWTH: f64 = 1.5;

/// A smaller share of the forces carries nothing.
const LEAST_SHARE: f64 = 0.005;

/// Standard error from which on a coefficient is doubtful, as a share of it.
const DOUBT: f64 = 0.05;

fn conditioning(outcome: &Outcome) -> Option<Warning> {
    let worst = outcome.fits.iter().max_by(|a, b| a.condition.total_cmp(&b.condition))?;
    let layout = outcome.model.layout;
    let pair = worst.confused.first();
    let one_tone = one_tone(outcome);
    if worst.condition <= 100.0 && !(one_tone && pair.is_some()) {
        return None;
    }
    let mut text = match (one_tone, pair) {
        (true, Some((a, b, _))) => {
            format!("One tone in steady state: {} and {} cannot be told apart", a.pretty(&layout), b.pretty(&layout))
        }
        (_, Some((a, b, _))) => format!("These data hardly tell {} and {} apart", a.pretty(&layout), b.pretty(&layout)),
        _ => "These data hardly tell some terms apart".to_owned(),
    };
    let _ = write!(
        text,
        " (condition number {:.0}): add a record with another frequency, amplitude or a transient",
        worst.condition
    );
    let severe = worst.condition > 1e4 || one_tone;
    Some(warning(if severe { Severity::Caution } else { Severity::Note }, text))
}

/// True if every fitted record is the same sine wave: its displacement is explained by one frequency.
fn one_tone(outcome: &Outcome) -> bool {
    let mut periods = Vec::new();
    for record in outcome.records.iter().filter(|r| r.usage == Usage::Fit) {
        let (Some(period), Some(x)) = (record.signals.main_period, record.signals.states.first()) else { return false };
        let step = std::f64::consts::TAU * record.signals.interval / period;
        let stride = (x.len() / SAMPLED).max(1);
        let wave = |phase: f64| -> Vec<f64> {
            (0..x.len()).step_by(stride).map(|k| (step * k as f64 + phase).sin()).collect()
        };
        let y: Vec<f64> = x.iter().step_by(stride).copied().collect();
        let columns = [wave(0.0), wave(0.5 * std::f64::consts::PI), vec![1.0; y.len()]];
        let reduced = Reduced::new(&columns, &y);
        let free = [Constraint::Free; 3];
        let solution = stlsq(&reduced, &free, &SparseOptions { threshold: 0.0, ridge: 0.0, scaled: true });
        if solution.residual_rms > TONE * reduced.target_scale() {
            return false;
        }
        periods.push(period);
    }
    let (shortest, longest) = periods.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), p| (a.min(*p), b.max(*p)));
    !periods.is_empty() && longest < 1.02 * shortest
}

/// Largest share of a motion's RMS that is not its main tone where it is called one tone.
const TONE: f64 = 0.1;

/// No term takes energy out: a threshold on shares easily drops light damping.
fn undamped(outcome: &Outcome) -> Option<Warning> {
    let layout = outcome.model.layout;
    if layout.kind != Kind::SecondOrder {
        return None;
    }
    let freedom = (0..layout.freedoms).find(|i| {
        let equation = &outcome.model.equations[layout.freedoms + i];
        !equation.terms.is_empty() && !equation.terms.iter().any(|t| t.term.symbols().contains(&Symbol::Rate(*i)))
    })?;
    let term = Term::new(Expression::Symbol(Symbol::Rate(freedom)));
    let name = term.pretty(&layout);
    let mut settings = outcome.settings.clone();
    settings.decide(freedom, layout.freedoms, term, Lock::In);
    Some(Warning {
        severity: Severity::Caution,
        text: format!(
            "No term with {name} is left, so nothing takes energy out: light damping is a small share of the force"
        ),
        remedy: Some(Remedy::Settings { label: format!("Lock {name} in"), settings: Box::new(settings) }),
    })
}

fn damping_sign(outcome: &Outcome) -> Vec<Warning> {
    let layout = outcome.model.layout;
    if layout.kind != Kind::SecondOrder {
        return Vec::new();
    }
    (0..layout.freedoms)
        .filter_map(|i| {
            let velocity = Expression::Symbol(Symbol::Rate(i));
            let friction = Expression::call(Function::Sgn, velocity.clone());
            let equation = outcome.model.equations.get(layout.freedoms + i)?;
            [velocity, friction].into_iter().map(Term::new).find_map(|term| {
                let weighted = equation.terms.iter().find(|t| t.term == term)?;
                let sure = weighted.std_error.is_some_and(|e| weighted.coefficient > 3.0 * e);
                sure.then(|| {
                    warning(
                        Severity::Caution,
                        format!("{} feeds energy in: its coefficient should be negative", term.pretty(&layout)),
                    )
                })
            })
        })
        .collect()
}

/// Smoothing too long for the motion.
fn segment(outcome: &Outcome) -> Option<Warning> {
    let smoothing = outcome.settings.smoothing;
    if !smoothing.method.is_local() {
        return None;
    }
    let share = |r: &RecordOutcome| Some(smoothing.window as f64 * r.signals.interval / r.signals.main_period?);
    let shares = outcome.records.iter().filter_map(|r| Some((share(r)?, &r.record.name)));
    let (share, record) = shares.max_by(|a, b| a.0.total_cmp(&b.0))?;
    // Beside the slider stands the share of the record that is shown, which may be another one.
    let record = if outcome.records.len() > 1 { format!("On record {record} the") } else { "The".to_owned() };
    let most = 0.2 * (smoothing.order as f64 + 1.0) / 2.0;
    (share > most).then(|| {
        let mut settings = outcome.settings.clone();
        let window = (smoothing.window as f64 * 0.5 * most / share) as usize;
        settings.smoothing.window = odd(window.max(smoothing.order + 2));
        Warning {
            severity: Severity::Caution,
            text: format!(
                "{record} segment is {share:.2} of the main period: smoothing bends the motion and biases the coefficients"
            ),
            remedy: Some(Remedy::Settings { label: "Shorten the segment".into(), settings: Box::new(settings) }),
        }
    })
}

/// The simulated error is well above the noise.
fn unmodelled(outcome: &Outcome) -> Option<Warning> {
    let score = outcome.test.or(outcome.train)?;
    let floor = outcome.noise_floor?;
    (score.nrmse > 0.05 && score.rmse > 5.0 * floor).then(|| {
        let times = score.rmse / floor.max(f64::MIN_POSITIVE);
        let above = if times < 1e4 {
            format!("{times:.0} times the measurement noise")
        } else {
            "far above the measurement noise".into()
        };
        let parts = format!("The error is {above} ({:.1} % of the motion)", 100.0 * score.nrmse);
        // Only where a free run does not last is its error no evidence; a whole record that is followed while held-out ones
        // are not is.
        let fitted = outcome.records.iter().filter(|r| r.usage == Usage::Fit);
        let longest = fitted.map(|r| r.record.duration()).fold(0.0, f64::max);
        let parted = |r: &&Refinement| {
            r.horizon < MIN_FOLLOWED_SHARE * longest && r.rmse.first().is_some_and(|e| crate::refine::holds(*e, floor))
        };
        match outcome.refinement.as_ref().filter(parted) {
            Some(refinement) => {
                let seconds = significant_trimmed(refinement.horizon, 2);
                let text = format!(
                    "{parts} because a free run of this motion is sensitive to its start. Along fitted runs of {seconds} s the \
                     error is no more than the noise"
                );
                warning(Severity::Note, text)
            }
            // Many sensors point to modes; elsewhere a refined fit tells a motion that is sensitive from a term that is missing.
            None if by_modes(outcome).is_none() && outcome.refinement.is_none() => Warning {
                severity: Severity::Caution,
                text: format!(
                    "{parts}: the equation lacks something, or a free run of this motion is sensitive to its start"
                ),
                remedy: Some(Remedy::Settings {
                    label: "Refine the coefficients, which tells".into(),
                    settings: Box::new(Settings { refine: true, ..outcome.settings.clone() }),
                }),
            },
            None => Warning {
                severity: Severity::Caution,
                text: format!("{parts}: the equation lacks something"),
                remedy: by_modes(outcome),
            },
        }
    })
}

/// Share of the samples from which on standing still is told of.
const STANDING: f64 = 0.02;

/// A motion that stands is fitted by the regression only where it slides.
fn standing(outcome: &Outcome) -> Option<Warning> {
    let fitted = || outcome.records.iter().filter(|r| r.usage == Usage::Fit);
    let all: usize = fitted().map(|r| r.record.len()).sum();
    let standing: usize = fitted().flat_map(|r| r.standing.iter()).map(std::ops::Range::len).sum();
    let share = standing as f64 / all.max(1) as f64;
    (share > STANDING).then(|| {
        let stops: usize = fitted().map(|r| r.standing.len()).sum();
        let simulated: usize = fitted().map(|r| r.sticks.len()).sum();
        let text = format!(
            "The motion stands still for {:.0} % of the samples ({stops} stops measured, {simulated} simulated): dry friction \
             holds it there with whatever force it takes. The regression fits only the samples at which it slides; the \
             simulation sticks and slides by itself",
            100.0 * share
        );
        warning(Severity::Note, text)
    })
}

fn never_tested(outcome: &Outcome, records: &RecordSet) -> Option<Warning> {
    if outcome.test.is_some() || records.with(Usage::HeldOut).next().is_some() {
        return None;
    }
    let several = records.with(Usage::Fit).count() > 1;
    let last = records.entries.iter().rposition(|(_, usage)| *usage == Usage::Fit);
    Some(Warning {
        severity: Severity::Note,
        text: "Nothing is held out: a good fit of the fitted data alone proves little".into(),
        remedy: last.filter(|_| several).map(|index| Remedy::Use {
            label: "Hold the last record out".into(),
            record: index,
            usage: Usage::HeldOut,
        }),
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::study::{Cancel, Settings, Study, suggest};
    use sindyscope_files::{ReadOptions, read_set};
    use sindyscope_rig::{ScenarioOptions, generate};
    use sindyscope_values::term::list;

    fn said(records: &RecordSet, settings: &Settings) -> String {
        let outcome = Study::default().run(records, settings, &Cancel::default()).unwrap();
        outcome.warnings.iter().map(|w| format!("{}\n", w.text)).collect()
    }

    #[test]
    fn an_overfit_is_said_and_the_term_that_carries_it_named() {
        let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../sample_data");
        let records =
            read_set(&[samples.join("overfit.csv")], &[samples.join("overfit_test.csv")], &ReadOptions::default());
        let records = records.unwrap();
        let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
        settings.threshold = 0.01;
        settings.terms = list("x, v, u, x^2, x^3, x^5, x^7, 1").unwrap();
        let text = said(&records, &settings);
        assert!(text.contains("fails what it was not") && text.contains("x⁷ carries it"), "{text}");
        settings.terms = list("x, v, u, x^2, x^3, 1").unwrap();
        let text = said(&records, &settings);
        assert!(!text.contains("fails what it was not"), "{text}");
    }

    #[test]
    fn one_tone_in_steady_state_is_told_from_several() {
        let steady = |frequencies: Vec<f64>| {
            let options = ScenarioOptions { frequencies: Some(frequencies), duration: Some(6.0), ..Default::default() };
            let records = RecordSet::new(generate("friction-experiment", &options).unwrap().records, Usage::Fit);
            let settings = suggest(&records, Kind::SecondOrder).unwrap();
            said(&records, &settings)
        };
        let text = steady(vec![4.611]);
        assert!(text.contains("One tone in steady state"), "{text}");
        assert!(!steady(vec![2.013, 2.583, 4.611]).contains("One tone"));
    }
}
