//! What fitted data bear of a model: whether each of its effects has a size there that is none of chance.

use super::effects::Direction;
use super::fit::{Fitted, WHOLE};
use super::search::Search;
use nalgebra::{DMatrix, DVector};
use sindyscope_core::refine::{FitOptions, Point, Refined, Structure as _, misfit_beside_jumps};
use sindyscope_values::term::Symbol;

impl Search {
    /// Why the fitted data do not bear every part of a model's effects: an amplitude less than three standard errors from zero,
    /// or an inner quantity at a bound.
    pub(super) fn unborne(&self, fitted: &Fitted) -> Option<String> {
        let refined = &*fitted.refined;
        let least = self.data.constants.amplitude_errors;
        let inflation = self.inflation(fitted);
        let inner = &fitted.parameters.inner;
        let positions = fitted.composition.positions();
        let places = fitted.composition.places(inner);
        let mut unshifted = refined.point.clone();
        unshifted.offsets.iter_mut().for_each(|offset| *offset = 0.0);
        // Where no force depends on a displacement, the sensor's zero is part of the initial state. An accelerometer's is free always.
        let zero_matters = || {
            let terms = fitted.composition.compose(inner).terms;
            terms.iter().any(|placed| placed.term.symbols().iter().any(|s| matches!(s, Symbol::State(_))))
        };
        if fitted.composition.offset()
            && !fitted.composition.zero
            && !(zero_matters() && self.feels(fitted, &unshifted, inflation))
        {
            return Some("its size cannot be told from zero".to_owned());
        }
        for (index, form) in fitted.composition.forms.iter().enumerate() {
            let own = places[index].clone().map(|k| positions.coefficients[k]);
            let given = &positions.inner.forms[index];
            let mut open = Vec::new();
            for (coefficient, position) in form.coefficients.iter().zip(own) {
                if coefficient.sign == Direction::Any {
                    open.push(position);
                } else if refined.at_bound[position] {
                    return Some(format!(
                        "its {} comes out zero: to help it would have to act the wrong way round",
                        coefficient.name
                    ));
                } else if size(refined, &[position], given) < least * least * inflation {
                    return Some(format!("its {} cannot be told from zero", coefficient.name));
                }
            }
            if !open.is_empty() && size(refined, &open, given) < least * least * inflation * open.len() as f64 {
                return Some("its size cannot be told from zero".to_owned());
            }
            for ((quantity, value), position) in
                form.inner.iter().zip(&inner.forms[index]).zip(&positions.inner.forms[index])
            {
                let (low, high) = quantity.bounds;
                let near = 0.01 * (high - low).abs();
                let error = refined.std_error(*position).map_or(0.0, |e| e * inflation.sqrt());
                // Without a force of its own it is nothing at zero.
                let nothing: &[f64] =
                    if low < 0.0 && high > 0.0 && form.coefficients.is_empty() { &[0.0] } else { &[] };
                for &simple in if quantity.simple.is_empty() { nothing } else { quantity.simple } {
                    let mut there = refined.point.clone();
                    there.shared[*position] = simple;
                    let told = match quantity.jumps {
                        true => self.feels(fitted, &there, inflation),
                        false => (value - simple).abs() >= least * error,
                    };
                    if !told {
                        return Some(format!("its {} cannot be told from {simple}", quantity.name));
                    }
                }
                if value - low < near.min(0.01 * value.abs()) || high - value < near.min(0.01 * high.abs()) {
                    return Some(format!(
                        "{} runs to the end of what is sensible: these data do not exercise it",
                        quantity.name
                    ));
                }
            }
        }
        None
    }

    /// True if the fitted data tell a model's parameters from others, all at once: where the response jumps between them no slope
    /// gives an error, and for sensors' offsets none is kept.
    fn feels(&self, fitted: &Fitted, others: &Point, inflation: f64) -> bool {
        let refined = &*fitted.refined;
        let never = || false;
        let driven = fitted.level != WHOLE;
        let options = FitOptions { driven, ..self.data.options(&never, 0, None) };
        let there = misfit_beside_jumps(&fitted.composition, &fitted.runs, others, options);
        let here = refined.rss_beside_jumps();
        let variance = here / refined.samples.max(1) as f64;
        let least = self.data.constants.amplitude_errors;
        there.is_none_or(|there| there - here > least * least * inflation * variance)
    }
}

/// Covariance of amplitudes where the inner quantities of their effect are as they were found: without the effect they are
/// nothing, and how far they are in doubt says nothing against its being there (R. Davies, Biometrika 74 (1987) 33). None where
/// the fit gives no covariance.
fn covariance_given(refined: &Refined, places: &[usize], given: &[usize]) -> Option<DMatrix<f64>> {
    let all = &refined.covariance;
    if places.iter().any(|k| *k >= all.nrows()) {
        return None;
    }
    let part = |rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| all[(rows[i], columns[j])])
    };
    let given: Vec<usize> = given.iter().copied().filter(|k| refined.std_error(*k).is_some_and(|e| e > 0.0)).collect();
    let covariance = part(places, places);
    let across = part(&given, places);
    let known = part(&given, &given).cholesky().map(|c| across.transpose() * c.solve(&across));
    Some(match known {
        Some(known) => covariance - known,
        None => covariance,
    })
}

/// Wald's statistic of amplitudes that are zero without an effect of these inner quantities; infinite where the fit gives no
/// covariance.
fn size(refined: &Refined, places: &[usize], given: &[usize]) -> f64 {
    let values = DVector::from_iterator(places.len(), places.iter().map(|k| refined.point.shared[*k]));
    let factor = covariance_given(refined, places, given).and_then(DMatrix::cholesky);
    factor.map_or(f64::INFINITY, |c| values.dot(&c.solve(&values)))
}
