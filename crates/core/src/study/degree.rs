//! The degree of a first-order library: as high as data that were not fitted bear out.

use std::sync::Arc;

use super::regression::{Regression, basis, fitted_states};
use super::validation::{EQUAL_ERRORS, FITTED_SHARE};
use super::{Formulation, Kinematics, Smoothing};
use crate::signal::{SignalFacts, Signals};
use sindyscope_values::record::Record;
use sindyscope_values::term::{Layout, Symbol, Term, TermFamily, polynomials};

/// Degree that is offered in any case: products of two states are what first-order systems are known by.
const MIN_DEGREE: usize = 2;
/// Highest degree that is tried.
const MAX_DEGREE: usize = 5;
/// Terms of one equation, at most: more are slow to sift, and no table shows them.
const MAX_TERMS: usize = 120;
/// A higher degree is taken if it lowers the held-out error to this share, or below.
const MAX_ERROR_RATIO: f64 = 0.5;
/// Degrees without gain before the search ends: an odd law gains nothing from the even degree before it.
const DEGREES_WITHOUT_GAIN: usize = 2;
/// Samples of a record that are used, at most.
const MAX_SAMPLES: usize = 20_000;

/// Constant and products of the states up to the lowest degree beyond which the rates of data that were not fitted are
/// explained no better: the last record, or the last part of a single one.
pub(super) fn library(layout: &Layout, records: &[Arc<Record>], smoothing: &Smoothing) -> Vec<Term> {
    let states: Vec<Symbol> = layout.state_symbols().collect();
    let of_degree = |degree: usize| {
        let mut terms = TermFamily::Constant.terms(layout);
        terms.extend(polynomials(&states, degree, true));
        terms
    };
    let mut best = of_degree(MIN_DEGREE);
    let (fitted, judged) = split(layout, records, smoothing);
    let with_inputs = |terms: &[Term]| [terms, &TermFamily::Inputs.terms(layout)].concat();
    let Some(mut least) = error(layout, &with_inputs(&best), &fitted, &judged, smoothing) else { return best };
    let mut idle = 0;
    for degree in MIN_DEGREE + 1..=MAX_DEGREE {
        let terms = of_degree(degree);
        if idle == DEGREES_WITHOUT_GAIN || terms.len() > MAX_TERMS {
            break;
        }
        match error(layout, &with_inputs(&terms), &fitted, &judged, smoothing) {
            Some(error) if error + EQUAL_ERRORS < MAX_ERROR_RATIO * (least + EQUAL_ERRORS) => {
                (best, least, idle) = (terms, error, 0);
            }
            Some(_) => idle += 1,
            None => break,
        }
    }
    best
}

/// Smoothed records to fit and to judge by.
fn split(layout: &Layout, records: &[Arc<Record>], smoothing: &Smoothing) -> (Vec<Arc<Signals>>, Vec<Arc<Signals>>) {
    let signals =
        |record: &Record| Arc::new(Signals::new(record, layout, smoothing, &SignalFacts::new(record, layout)));
    let short = |record: &Record| record.slice(0..record.len().min(MAX_SAMPLES));
    match records {
        [] => (Vec::new(), Vec::new()),
        [only] => {
            let record = short(only);
            let cut = (FITTED_SHARE * record.len() as f64) as usize;
            (vec![signals(&record.slice(0..cut))], vec![signals(&record.slice(cut..record.len()))])
        }
        [several @ .., last] => (several.iter().map(|r| signals(&short(r))).collect(), vec![signals(&short(last))]),
    }
}

/// What terms fitted on some records leave of the rates of others; none where there are too few samples.
fn error(
    layout: &Layout,
    terms: &[Term],
    fitted: &[Arc<Signals>],
    judged: &[Arc<Signals>],
    smoothing: &Smoothing,
) -> Option<f64> {
    let states = fitted_states(layout, Kinematics::Known);
    // Averages have no bias of smoothed rates, which high degrees would seem to explain.
    let basis = basis(layout, terms, fitted, Formulation::Weak { half_width: None }, &states).ok()?;
    let fit = Regression::new(layout, terms, fitted, smoothing, &basis, &states).ok()?;
    Some(fit.leaves_of(&fit.on_records(terms, judged).ok()?)).filter(|e| e.is_finite())
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use crate::study::suggest;
    use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};
    use sindyscope_values::term::Kind;

    /// Two states with noise of 1 % of each, integrated by the classical Runge–Kutta method in tenths of a sample.
    fn two_states(rate: impl Fn([f64; 2]) -> [f64; 2], start: [f64; 2], interval: f64) -> RecordSet {
        const PARTS: usize = 10;
        let step = interval / PARTS as f64;
        let ahead = |x: [f64; 2], k: [f64; 2], h: f64| [x[0] + h * k[0], x[1] + h * k[1]];
        let mut x = start;
        let mut series = [Vec::new(), Vec::new()];
        for k in 0..4000 * PARTS {
            if k % PARTS == 0 {
                series.iter_mut().zip(x).for_each(|(s, x)| s.push(x));
            }
            let a = rate(x);
            let b = rate(ahead(x, a, 0.5 * step));
            let c = rate(ahead(x, b, 0.5 * step));
            let d = rate(ahead(x, c, step));
            x = [0, 1].map(|i| x[i] + step / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
        let mut random = Pcg64::seed_from_u64(1);
        let channels = series.into_iter().enumerate().map(|(i, values)| {
            let noise = 0.01 * crate::signal::mean_and_variance(&values).1.sqrt();
            let mut deviate = || -> f64 { StandardNormal.sample(&mut random) };
            Channel {
                name: format!("x{}", i + 1),
                role: Role::Displacement(i),
                unit: String::new(),
                values: values.iter().map(|x| x + noise * deviate()).collect(),
                estimated: false,
            }
        });
        let record = Record {
            name: "two states".into(),
            source: None,
            start: 0.0,
            interval,
            channels: channels.collect(),
            notices: Vec::new(),
        };
        RecordSet::new(vec![record], Usage::Fit)
    }

    fn offered(records: &RecordSet) -> Vec<String> {
        suggest(records, Kind::FirstOrder).unwrap().terms.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn the_degree_is_the_lowest_that_the_data_bear_out() {
        let relaxation = two_states(|[x, y]| [y, 2.0 * (1.0 - x * x) * y - x], [0.1, 0.0], 0.01);
        let terms = offered(&relaxation);
        assert!(terms.contains(&"x^2*x2".to_owned()) && !terms.contains(&"x^4".to_owned()), "{terms:?}");
        let quintic = two_states(|[x, y]| [y, -0.05 * y - x - 2.0 * x.powi(5)], [1.5, 0.0], 0.01);
        let terms = offered(&quintic);
        assert!(terms.contains(&"x^5".to_owned()), "{terms:?}");
        let prey = two_states(|[x, y]| [x - 0.4 * x * y, 0.25 * x * y - 0.8 * y], [2.0, 1.0], 0.02);
        let terms = offered(&prey);
        assert!(terms.contains(&"x*x2".to_owned()) && !terms.contains(&"x^3".to_owned()), "{terms:?}");
    }
}
