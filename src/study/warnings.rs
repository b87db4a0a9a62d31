//! What is wrong or doubtful about an outcome, in words, with what would help.

use super::{Differentiation, Lock, Outcome, Remedy, Severity, Warning};
use crate::model::Equation;
use crate::record::{RecordSet, Usage};
use crate::term::{Expression, Function, Kind, Symbol, Term};

/// Every warning that applies, worst first.
pub(super) fn warnings(outcome: &Outcome, records: &RecordSet) -> Vec<Warning> {
    let mut found = Vec::new();
    found.extend(nothing_kept(outcome));
    found.extend(diverged(outcome));
    found.extend(overfit(outcome));
    found.extend(conditioning(outcome));
    found.extend(undamped(outcome));
    found.extend(damping_sign(outcome));
    found.extend(segment(outcome));
    found.extend(unmodelled(outcome));
    found.extend(never_tested(outcome, records));
    found.sort_by_key(|w| std::cmp::Reverse(w.severity));
    found
}

fn warning(severity: Severity, text: String) -> Warning {
    Warning { severity, text, remedy: None }
}

fn nothing_kept(outcome: &Outcome) -> Option<Warning> {
    let empty = outcome.model.equations.iter().any(|e: &Equation| e.terms.is_empty());
    empty.then(|| {
        let lowest =
            outcome.fits.iter().flat_map(|f| f.drop_marks.last()).map(|(at, _)| *at).fold(f64::INFINITY, f64::min);
        let remedy = (lowest.is_finite() && lowest > 0.0).then(|| {
            let mut settings = outcome.settings.clone();
            settings.threshold = 0.5 * lowest;
            Remedy { label: "Lower the threshold".into(), settings: Some(settings), usage: None }
        });
        Warning { severity: Severity::Wrong, text: "The threshold dropped every term of an equation".into(), remedy }
    })
}

fn diverged(outcome: &Outcome) -> Option<Warning> {
    let first = outcome.records.iter().find(|r| r.diverged_at.is_some())?;
    let at = first.diverged_at?;
    Some(warning(
        Severity::Wrong,
        format!(
            "The response to {} leaves the data's range: diverged at t = {at:.3} s. A term is missing, or one is wrong",
            first.record.name
        ),
    ))
}

/// A wrong library fits the training data and fails the held-out ones.
fn overfit(outcome: &Outcome) -> Option<Warning> {
    let (train, test) = (outcome.train?, outcome.test?);
    let floor = outcome.noise_floor.unwrap_or(0.0);
    let fails = test.nrmse > 3.0 * train.nrmse && test.rmse > 2.0 * floor && test.nrmse > 0.01;
    fails.then(|| {
        warning(
            Severity::Caution,
            format!(
                "The model fits what it was fitted on (error {:.1} % of the motion) and fails what it was not ({:.1} %): \
                 the library holds wrong terms or lacks right ones",
                100.0 * train.nrmse,
                100.0 * test.nrmse
            ),
        )
    })
}

fn conditioning(outcome: &Outcome) -> Option<Warning> {
    let worst = outcome.fits.iter().map(|f| f.condition).fold(1.0, f64::max);
    (worst > 100.0).then(|| {
        let (severity, word) =
            if worst > 1e4 { (Severity::Caution, "cannot tell some terms apart") } else { (Severity::Note, "hardly tell some terms apart") };
        warning(
            severity,
            format!(
                "These data {word} (condition number {worst:.0}): add a record with another frequency, amplitude or a transient"
            ),
        )
    })
}

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
    settings.locks.insert(term, Lock::In);
    Some(Warning {
        severity: Severity::Caution,
        text: format!(
            "No term with {name} is left, so nothing takes energy out: light damping is a small share of the force"
        ),
        remedy: Some(Remedy { label: format!("Lock {name} in"), settings: Some(settings), usage: None }),
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
    if smoothing.method == Differentiation::Difference {
        return None;
    }
    let shares = outcome
        .records
        .iter()
        .filter_map(|r| Some(smoothing.window as f64 * r.signals.interval / r.signals.main_period?));
    let share = shares.fold(0.0, f64::max);
    let most = 0.2 * (smoothing.order as f64 + 1.0) / 2.0;
    (share > most).then(|| {
        let mut settings = outcome.settings.clone();
        let window = (smoothing.window as f64 * 0.5 * most / share) as usize;
        settings.smoothing.window = super::suggest::odd(window.max(smoothing.order + 2));
        Warning {
            severity: Severity::Caution,
            text: format!(
                "The segment is {share:.2} of the main period: smoothing bends the motion and biases the coefficients"
            ),
            remedy: Some(Remedy { label: "Shorten the segment".into(), settings: Some(settings), usage: None }),
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
        let text =
            format!("The error is {above} ({:.1} % of the motion): the equation lacks something", 100.0 * score.nrmse);
        warning(Severity::Caution, text)
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
        remedy: last.filter(|_| several).map(|index| Remedy {
            label: "Hold the last record out".into(),
            settings: None,
            usage: Some((index, Usage::HeldOut)),
        }),
    })
}
