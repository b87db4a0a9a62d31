//! What smoothing and noise shift the coefficients by.

use std::sync::Arc;

use rand::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal};

use super::regression::Regression;
use super::{Outcome, Settings};
use crate::dataset::Prepared;
use crate::signal::{Signals, Smoothing, central, rms};
use sindyscope_values::model::Model;
use sindyscope_values::record::{Channel, Record, Role};
use sindyscope_values::term::{Layout, Term};

/// Samples, of all records together, that the shift is found on.
const MAX_SAMPLES: usize = 1 << 12;
/// Main periods of a record that are used, at least.
const MIN_PERIODS: f64 = 12.0;
/// Length of what is used over the length that one row is made from, at least.
const MIN_SPANS: f64 = 16.0;
/// The shift is found on a response whose size is that of the measured motion within this factor.
const MAX_SIZE_RATIO: f64 = 2.0;

/// A fitted record with the states of the model's response to it.
pub(super) type Responded<'a> = (&'a Prepared, &'a [Vec<f64>]);

/// The shift of each coefficient of each fitted equation, in the order of its terms: what the regression makes of the
/// model's own response, with noise as the sensors', less the coefficients that it was simulated with (indirect inference,
/// Gouriéroux, Monfort & Renault 1993). The noise is added once and taken away once, so that only the shift it brings
/// is left. None where the response is not like the motion, or too short.
pub(super) fn shifts(
    regression: &Regression,
    settings: &Settings,
    model: &Model,
    records: &[Responded],
) -> Option<Vec<Vec<f64>>> {
    let mut terms: Vec<Term> = model.equations.iter().flat_map(|e| &e.terms).map(|t| t.term.clone()).collect();
    terms.sort_by(|a, b| a.as_str().cmp(b.as_str()));
    terms.dedup();
    if !records.iter().all(|(prepared, states)| alike(&prepared.record, states)) {
        return None;
    }
    let echo = |sign: f64| {
        let echoes: Vec<Arc<Signals>> = records
            .iter()
            .enumerate()
            .map(|(k, (prepared, states))| {
                let samples =
                    (MAX_SAMPLES / records.len()).max((MIN_SPANS * regression.span(&prepared.signals)) as usize);
                let record = echo(prepared, &model.layout, states, samples, sign, k as u64);
                let smoothing =
                    Smoothing { window: prepared.signals.length as usize, from_data: false, ..settings.smoothing };
                let smoothing = if settings.smoothing.method.is_global() { smoothing } else { settings.smoothing };
                Arc::new(Signals::new(&record, &model.layout, &smoothing, &prepared.facts))
            })
            .collect();
        let again = regression.on_records(&terms, &echoes).ok()?.bounded(settings);
        Some(again.refitted(model, settings))
    };
    let (plus, minus) = crate::parallel::join(|| echo(1.0), || echo(-1.0));
    let known = regression.fitted().map(|index| model.equations[index].terms.iter().map(|t| t.coefficient));
    let shifts: Vec<Vec<f64>> = known
        .zip(plus?.into_iter().zip(minus?))
        .map(|(known, (plus, minus))| {
            known.zip(plus.into_iter().zip(minus)).map(|(c, (p, m))| 0.5 * (p + m) - c).collect()
        })
        .collect();
    shifts.iter().flatten().all(|s| s.is_finite()).then_some(shifts)
}

/// True if a response lasted and is as large as the motion.
fn alike(record: &Record, states: &[Vec<f64>]) -> bool {
    states.iter().enumerate().all(|(i, state)| {
        record.channel(Role::Displacement(i)).is_none_or(|c| {
            let ratio = rms(state) / rms(&c.values);
            state.len() == c.values.len() && (MAX_SIZE_RATIO.recip()..MAX_SIZE_RATIO).contains(&ratio)
        })
    })
}

/// The middle of a record as it would have been measured if the model were true.
fn echo(prepared: &Prepared, layout: &Layout, states: &[Vec<f64>], samples: usize, sign: f64, seed: u64) -> Record {
    let Prepared { record, facts, signals, .. } = prepared;
    let count = record.len();
    let periods = signals.main_period.map_or(0, |p| (MIN_PERIODS * p / record.interval) as usize);
    let from = (count - count.min(samples.max(periods))) / 2;
    let part = from..count - from;
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let channel = |(channel, noise): (&Channel, &f64)| {
        let truth = match channel.role {
            Role::Displacement(i) => states[i][part.clone()].to_vec(),
            Role::Velocity(i) => states[layout.freedoms + i][part.clone()].to_vec(),
            Role::Acceleration(i) => central(&states[layout.freedoms + i][part.clone()], record.interval),
            Role::Input(j) if !prepared.drive().as_measured => signals.inputs[j][part.clone()].to_vec(),
            _ => channel.values[part.clone()].to_vec(),
        };
        let mut noisy = |value: &f64| -> f64 {
            let deviate: f64 = StandardNormal.sample(&mut random);
            value + sign * noise * deviate
        };
        Channel { values: truth.iter().map(&mut noisy).collect(), ..channel.clone() }
    };
    let channels = record.channels.iter().zip(&facts.channel_noise).map(channel).collect();
    Record { start: record.time(from), channels, ..(**record).clone() }
}

impl Outcome {
    /// Lets the standard errors of unrefined coefficients allow for their shifts.
    pub(super) fn allow_for(&mut self, shifts: Vec<Vec<f64>>, fitted: impl Iterator<Item = usize>) {
        self.covariance.add_product(&shifts.concat());
        self.covariance.tell(&mut self.model, fitted);
        for (fit, shift) in self.fits.iter_mut().zip(shifts) {
            fit.shift = shift;
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::study::{Cancel, Formulation, Study, suggest};
    use sindyscope_rig::{Noise, ScenarioOptions, generate};
    use sindyscope_values::record::{RecordSet, Usage};
    use sindyscope_values::term::{Kind, Symbol, Term};

    #[test]
    fn the_models_own_response_tells_what_too_much_smoothing_shifts() {
        let options = ScenarioOptions {
            duration: Some(60.0),
            rate: Some(50.0),
            noise: Some(Noise::Deviation(1e-4)),
            ..ScenarioOptions::default()
        };
        let records = RecordSet::new(generate("duffing-noisy", &options).unwrap().records, Usage::Fit);
        let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
        settings.terms = sindyscope_values::term::list("x, x^3, v, u").unwrap();
        settings.threshold = 0.0;
        settings.smoothing.window = 151;
        let mut study = Study::default();
        let outcome = study.run(&records, &settings, &Cancel::default()).unwrap();
        let mut largest = 0.0_f64;
        for (term, truth) in [("x", -1.0), ("x^3", -0.6), ("v", -0.2), ("u", 1.0)] {
            let term = Term::parse(term).unwrap();
            let fitted = outcome.model.leading().unwrap().terms.iter().find(|t| t.term == term).unwrap();
            let (error, shift) = (fitted.coefficient - truth, outcome.shift(Symbol::Rate(0), &term).unwrap());
            // The model that responds is the shifted one, so its own shift is a little another.
            assert!((error - shift).abs() < 0.3 * error.abs() + 1e-3, "{term}: {error} {shift}");
            assert!(fitted.std_error.unwrap() >= shift.abs());
            largest = largest.max(error.abs());
        }
        assert!(largest > 0.01, "a segment this long shifts nothing: {largest}");
        settings.form = Formulation::Weak { half_width: Some(350) };
        let outcome = study.run(&records, &settings, &Cancel::default()).unwrap();
        assert!(outcome.fits.iter().all(|f| f.shift.iter().all(|s| s.is_finite())));
    }
}
