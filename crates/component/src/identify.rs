//! The force as a sparse sum of candidate terms.

use sindyscope_core::sparse::{Constraint, Reduced, Regressor, Solution, SparseOptions, between};
use sindyscope_core::study::Cancel;
use sindyscope_values::model::{Equation, WeightedTerm};
use sindyscope_values::term::{Expression, Symbol, Term, TermFamily, polynomials};

use super::columns::{ComponentRows, plain_columns};
use super::error::ComponentError;
use super::fit::ComponentFitter;
use super::outcome::{ComponentModel, fits};
use super::specimen::{Specimen, UNSEEN_SHARE};

/// Error of what is chosen over the least on data not fitted, at most: fewer terms are worth so much.
const MAX_ERROR_RATIO: f64 = 1.02;
/// Degree of the products of displacement and velocity that are offered.
const DEGREE: usize = 3;

/// What of a regression is given; what is not is chosen.
#[derive(Clone, Debug, Default)]
pub struct ForceSettings {
    /// Candidate terms; those that suit any component where none are given.
    pub terms: Option<Vec<Term>>,
    /// Terms that are kept whatever the threshold.
    pub locks: Vec<Term>,
    /// Threshold of coefficients of columns and force divided by their RMS.
    pub threshold: Option<f64>,
    /// Ridge weight.
    pub ridge: f64,
}

/// What a regression found.
#[derive(Clone, Debug)]
pub struct IdentifiedForce {
    /// The candidate terms.
    pub terms: Vec<Term>,
    /// The threshold.
    pub threshold: f64,
    /// The ridge weight.
    pub ridge: f64,
    /// The model.
    pub model: ComponentModel,
    /// Standard deviation of the force's noise, estimated.
    pub noise_floor: f64,
}

/// The terms that suit any component: an offset, products of displacement and velocity, dry friction, quadratic damping, and
/// for each input itself and its products with displacement, velocity and the sign of the velocity.
pub fn candidate_terms(specimen: &Specimen) -> Vec<Term> {
    let layout = &specimen.layout;
    let v = || Expression::from(Symbol::Rate(0));
    let x = || Expression::from(Symbol::State(0));
    let mut terms = TermFamily::Constant.terms(layout);
    terms.extend(polynomials(&layout.state_symbols().collect::<Vec<_>>(), DEGREE, true));
    terms.extend([v().sgn(), v() * v().abs(), x().abs() * v().sgn()].map(Term::new));
    for j in 0..layout.inputs {
        let u = || Expression::from(Symbol::Input(j));
        terms.extend([u(), u() * x(), u() * v(), u() * v().sgn()].map(Term::new));
    }
    let mut known: Vec<Term> = Vec::new();
    for term in terms {
        if !known.contains(&term) {
            known.push(term);
        }
    }
    known
}

/// Identifies the force of a component. Where no threshold is given, that is taken which leaves the fewest terms whose error
/// on the end of the fitted records, not fitted for that, is within 2 % of the least.
///
/// # Errors
/// No terms, terms of quantities that the records do not give, or cancelled.
pub fn identify(
    specimen: &Specimen,
    settings: &ForceSettings,
    cancel: &Cancel,
) -> Result<IdentifiedForce, ComponentError> {
    let mut terms = settings.terms.clone().unwrap_or_else(|| candidate_terms(specimen));
    terms.extend(settings.locks.iter().filter(|t| !terms.contains(t)).cloned().collect::<Vec<_>>());
    check(specimen, &terms)?;
    let columns = plain_columns(specimen, &terms);
    let force: Vec<f64> = specimen.paths.iter().flat_map(|p| p.force.iter().copied()).collect();
    let locked = |t: &Term| if settings.locks.contains(t) { Constraint::In } else { Constraint::Free };
    let constraints: Vec<Constraint> = terms.iter().map(locked).collect();
    let options = |threshold: f64| SparseOptions { threshold, ridge: settings.ridge, scaled: true };
    let reduced = |rows: &ComponentRows| {
        let kept =
            |series: &[f64]| -> Vec<f64> { rows.seen.iter().flat_map(|r| series[r.clone()].iter().copied()).collect() };
        Reduced::new(&columns.iter().map(|c| kept(c)).collect::<Vec<_>>(), &kept(&force))
    };
    let whole = ComponentRows::new(specimen);
    let threshold = match settings.threshold {
        Some(threshold) => threshold,
        None => {
            let rows = ComponentRows::split(specimen, |p| ((1.0 - UNSEEN_SHARE) * p.unseen_from as f64) as usize);
            // What is held out does not choose.
            let judging: Vec<_> = rows
                .unseen
                .iter()
                .zip(&whole.seen)
                .map(|(r, seen)| r.start..r.end.min(seen.end).max(r.start))
                .collect();
            let error = |solution: &Solution| -> f64 {
                let left = |row: usize| {
                    force[row] - solution.coefficients.iter().zip(&columns).map(|(c, k)| c * k[row]).sum::<f64>()
                };
                judging.iter().flat_map(Clone::clone).map(|row| left(row).powi(2)).sum::<f64>().sqrt()
            };
            let path = Regressor::Stlsq.path(&reduced(&rows), &constraints, &options(0.0));
            let judged: Vec<(f64, usize, f64)> = path.iter().map(|(t, s)| (*t, s.support.len(), error(s))).collect();
            let least = judged.iter().map(|j| j.2).fold(f64::INFINITY, f64::min);
            let close = judged.iter().filter(|j| j.2 <= MAX_ERROR_RATIO * least).min_by_key(|j| j.1);
            let above = |t: f64| judged.iter().map(|j| j.0).filter(|mark| *mark > t).fold(f64::INFINITY, f64::min);
            close.map_or(0.0, |j| between(j.0, above(j.0)))
        }
    };
    if cancel.is_cancelled() {
        return Err(ComponentError::Cancelled);
    }
    let solution = Regressor::Stlsq.solve(&reduced(&whole), &constraints, &options(threshold));
    let kept: Vec<Term> = solution.support.iter().map(|k| terms[*k].clone()).collect();
    let fitter = ComponentFitter::new(specimen, &kept, &[], whole, cancel);
    let fitted = fitter.fit(&[], None).ok_or(ComponentError::Cancelled)?;
    let total: f64 = fitted.parts.iter().sum();
    let weighted = kept.iter().enumerate().map(|(i, term)| WeightedTerm {
        term: term.clone(),
        coefficient: fitted.coefficients[i],
        std_error: Some(fitted.errors[i]).filter(|e| e.is_finite()),
        share: fitted.parts[i] / total,
    });
    let force = Equation { terms: weighted.collect() };
    let (layout, units) = (specimen.layout, specimen.units.clone());
    let records = fits(specimen, &fitted.residual);
    let model = ComponentModel { layout, force, internals: Vec::new(), units, like: Vec::new(), records };
    Ok(IdentifiedForce { terms, threshold, ridge: settings.ridge, model, noise_floor: specimen.noise })
}

/// Refuses terms of quantities that the records do not give.
pub(crate) fn check(specimen: &Specimen, terms: &[Term]) -> Result<(), ComponentError> {
    if terms.is_empty() {
        return Err(ComponentError::NoTerms);
    }
    for term in terms {
        let acceleration =
            term.symbols().into_iter().find(|s| matches!(s, Symbol::Acceleration(_) | Symbol::Internal(_)));
        if let Some(symbol) = term.foreign_symbol(&specimen.layout).or(acceleration) {
            return Err(ComponentError::Symbol { term: term.to_string(), symbol: specimen.layout.name(symbol) });
        }
    }
    Ok(())
}
