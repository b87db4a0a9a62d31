use std::sync::Arc;

use super::{Settings, Smoothing, StudyError, base_excited, degree};
use crate::signal::{SignalFacts, mean_and_variance, odd};
use sindyscope_values::record::{RecordSet, Role, Usage};
use sindyscope_values::term::{Expression, Function, Kind, Layout, Symbol, Term, TermFamily, polynomials};

/// Settings to start from: a library by the kind of data, smoothing from the signals' noise and period; nothing is simulated.
///
/// # Errors
/// No record is marked fit.
pub fn suggest(records: &RecordSet, kind: Kind) -> Result<Settings, StudyError> {
    let record = records.with(Usage::Fit).next().ok_or(StudyError::NothingToFit)?;
    let layout = record.layout(kind);
    let facts: Vec<_> = records.with(Usage::Fit).map(|r| (r, SignalFacts::cached(r, &layout))).collect();
    let window = facts
        .iter()
        .filter_map(|(record, facts)| {
            let x = &record.channel(Role::Displacement(0))?.values;
            let spread = mean_and_variance(x).1.sqrt();
            let noise = facts.noise.first().copied().unwrap_or(0.0) / spread;
            Some(segment(facts.main_period? / record.interval, noise))
        })
        .fold(0.0, f64::max);
    let shortest = facts.iter().map(|(r, _)| r.len()).min().unwrap_or(0);
    let smoothing = Smoothing::default();
    let window = odd(window.max(1.0) as usize).clamp(smoothing.order + 2, odd(shortest / 8).max(smoothing.order + 2));
    Ok(Settings {
        kind,
        smoothing: Smoothing { window, ..smoothing },
        terms: library(&layout, base_excited(record, kind), || {
            let records: Vec<_> = facts.iter().map(|(record, _)| Arc::clone(record)).collect();
            degree::library(&layout, &records, &Smoothing { window, ..smoothing })
        }),
        threshold: 0.02,
        // What regression is told of a motion that no sensor showed is an estimate.
        refine: record.channels.iter().any(|c| c.estimated),
        ..Settings::default()
    })
}

/// A segment length in samples for a period of so many samples and noise as a share of the motion: a thirtieth of a
/// period for clean data, a quarter at 1 % noise (where the bias of a fifth-order filter and the noise balance on the
/// report's systems).
fn segment(period: f64, noise: f64) -> f64 {
    let noise = noise.clamp(1e-7, 0.1);
    period * 0.03 * (1.0 + (noise / 1e-6).powf(0.2)).min(10.0)
}

/// The library offered first: what vibrating things are usually made of; of a first-order system the polynomials that the
/// data bear out.
fn library(layout: &Layout, base: bool, grown: impl FnOnce() -> Vec<Term>) -> Vec<Term> {
    let mut terms = match layout.kind {
        Kind::FirstOrder => grown(),
        Kind::SecondOrder if layout.freedoms > 1 => chain(layout.freedoms),
        Kind::SecondOrder => {
            let mut terms = TermFamily::States.terms(layout);
            let displacements: Vec<Symbol> = (0..layout.freedoms).map(Symbol::State).collect();
            terms.extend(polynomials(&displacements, 3, false).into_iter().skip(displacements.len()));
            terms.extend(TermFamily::QuadraticDamping.terms(layout));
            terms.extend((0..layout.freedoms).map(|i| {
                let v = Expression::Symbol(Symbol::Rate(i));
                Term::new(Expression::call(Function::Sgn, v))
            }));
            terms
        }
    };
    terms.extend(TermFamily::Inputs.terms(layout));
    if base {
        terms.extend(TermFamily::InputRates.terms(layout));
    }
    if layout.kind == Kind::SecondOrder {
        // Sensors have offsets.
        terms.extend(TermFamily::Constant.terms(layout));
    }
    terms
}

/// What masses in a row are usually made of: springs (linear and cubic), dampers and dry friction between each and the
/// ground, and between neighbours. Every displacement and velocity is there by itself, so that masses coupled in another
/// order find their linear forces too.
fn chain(masses: usize) -> Vec<Term> {
    let across = |symbol: fn(usize) -> Symbol| -> Vec<Expression> {
        let of = |i: usize| Expression::Symbol(symbol(i));
        let neighbours = (1..masses).map(|i| Expression::Sum(vec![of(i), of(i - 1).negated()]));
        (0..masses).map(of).chain(neighbours).collect()
    };
    let (stretches, speeds) = (across(Symbol::State), across(Symbol::Rate));
    let cubes = stretches.iter().map(|x| Expression::Power(Box::new(x.clone()), 3.0));
    let friction = speeds.iter().map(|v| Expression::call(Function::Sgn, v.clone()));
    stretches.iter().chain(&speeds).cloned().chain(cubes).chain(friction).map(Term::new).collect()
}
