//! How certain each term is: the regression repeated on resampled data, and with terms left out of the library.

use crate::parallel::prelude::*;

use super::regression::Resampling;
use super::{Cancel, Settings, Study, StudyError, check};
use sindyscope_values::record::RecordSet;
use sindyscope_values::term::{Symbol, Term};

/// How sure a term of one equation is.
#[derive(Clone, Debug, PartialEq)]
pub struct Inclusion {
    /// The state whose rate the equation gives.
    pub state: Symbol,
    /// The term.
    pub term: Term,
    /// Inclusion probability: share of the resampled data sets on which the term stays, 0 to 1.
    pub probability: f64,
    /// Mean of this probability over libraries from which one other term, each in turn, is left out: a term that only stands in
    /// for others stays by chance. NaN in a library of one term.
    pub without_others: f64,
    /// The 90 % interval of the coefficient where the term stays, in the records' units; none if it never does.
    pub interval: Option<(f64, f64)>,
}

/// What repeating the regression says of every term of the library.
#[derive(Clone, Debug, PartialEq)]
pub struct Ensemble {
    /// The settings that were repeated.
    pub settings: Settings,
    /// Every term of every fitted equation.
    pub terms: Vec<Inclusion>,
    /// Number of resampled data sets.
    pub repeats: usize,
}

impl Ensemble {
    /// What is said of a term in the equation of a state.
    pub fn term(&self, state: Symbol, term: &Term) -> Option<&Inclusion> {
        self.terms.iter().find(|t| t.state == state && t.term == *term)
    }
}

/// Resampled data sets; the standard error of a probability is at most 3.5 %.
const REPEATS: usize = 200;

/// Standard deviations on either side of a 90 % interval of a normal distribution.
const DEVIATIONS_OF_90: f64 = 1.645;

impl Study {
    /// Repeats the regression on data whose residuals are drawn anew, correlated over blocks as they do (Shao 2010),
    /// with the whole library and with each term in turn left out of it (after Fasel et al. 2022). Intervals allow for
    /// what smoothing and noise shift the coefficients by. The same records and settings give the same answer.
    ///
    /// # Errors
    /// As [`Study::run`].
    pub fn ensemble(
        &mut self,
        records: &RecordSet,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Ensemble, StudyError> {
        let layout = check(records, settings)?;
        self.prepare(records, &layout, &settings.smoothing, cancel)?;
        let regression = self.regression(records, settings)?;
        cancel.check()?;
        let model = regression.identify(settings).model;
        let (outcomes, ..) = self.simulate(records, &model, settings.initial, cancel)?;
        let shifts = self.shifts(&regression, settings, &model, &outcomes).unwrap_or_default();
        let mut terms = repeat(&regression.resampling(settings), cancel)?;
        for (index, shifts) in regression.fitted().zip(shifts) {
            let Some(state) = regression.symbol(index) else { continue };
            for (kept, shift) in model.equations[index].terms.iter().zip(shifts) {
                let said = terms.iter_mut().find(|t| t.state == state && t.term == kept.term);
                if let Some(interval) = said.and_then(|t| t.interval.as_mut()) {
                    let further = |end: f64| (kept.coefficient - end).hypot(DEVIATIONS_OF_90 * shift);
                    *interval = (kept.coefficient - further(interval.0), kept.coefficient + further(interval.1));
                }
            }
        }
        Ok(Ensemble { settings: settings.clone(), terms, repeats: REPEATS })
    }
}

/// One data set's coefficients, equation by equation: with the whole library, and without one term of each.
struct Repeat {
    whole: Vec<Vec<f64>>,
    left_out: Vec<Option<usize>>,
    without: Vec<Vec<f64>>,
}

fn repeat(resampling: &Resampling<'_>, cancel: &Cancel) -> Result<Vec<Inclusion>, StudyError> {
    let optional = resampling.optional();
    let repeats: Result<Vec<Repeat>, StudyError> = (0..REPEATS)
        .into_par_iter()
        .map(|k| {
            cancel.check()?;
            let drawn = resampling.draw(k as u64);
            let none = vec![None; optional.len()];
            let left_out: Vec<Option<usize>> =
                optional.iter().map(|free| free.get(k % free.len().max(1)).copied()).collect();
            Ok(Repeat {
                whole: resampling.coefficients(&drawn, &none),
                without: resampling.coefficients(&drawn, &left_out),
                left_out,
            })
        })
        .collect();
    let repeats = repeats?;
    let share = |kept: usize, of: usize| kept as f64 / of as f64;
    let equations = resampling.states().enumerate();
    let inclusion = |(e, state, k, term): (usize, Symbol, usize, &Term)| {
        let mut kept: Vec<f64> = repeats.iter().map(|r| r.whole[e][k]).filter(|c| *c != 0.0).collect();
        kept.sort_by(f64::total_cmp);
        let offered = repeats.iter().filter(|r| r.left_out[e].is_some_and(|left_out| left_out != k));
        let at = |share: f64| kept[((kept.len() - 1) as f64 * share).round() as usize];
        Inclusion {
            state,
            term: term.clone(),
            probability: share(kept.len(), repeats.len()),
            without_others: share(offered.clone().filter(|r| r.without[e][k] != 0.0).count(), offered.count()),
            interval: (!kept.is_empty()).then(|| (at(0.05), at(0.95))),
        }
    };
    Ok(equations
        .flat_map(|(e, state)| resampling.terms().iter().enumerate().map(move |(k, term)| (e, state, k, term)))
        .map(inclusion)
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::{Formulation, suggest};
    use sindyscope_rig::{Noise, ScenarioOptions, generate};
    use sindyscope_values::record::Usage;
    use sindyscope_values::term::{Kind, list};

    fn duffing(seed: u64) -> (RecordSet, Settings) {
        let options = ScenarioOptions { seed, duration: Some(60.0), rate: Some(50.0), ..ScenarioOptions::default() };
        let records = RecordSet::new(generate("duffing-noisy", &options).unwrap().records, Usage::Fit);
        let settings = suggest(&records, Kind::SecondOrder).unwrap();
        (records, settings)
    }

    #[test]
    fn true_terms_stay_and_others_go() {
        let (records, settings) = duffing(3);
        let ensemble = Study::default().ensemble(&records, &settings, &Cancel::default()).unwrap();
        assert_eq!(ensemble, Study::default().ensemble(&records, &settings, &Cancel::default()).unwrap());
        for term in list("x, x^3, v, u").unwrap() {
            let said = ensemble.term(Symbol::Rate(0), &term).unwrap();
            assert!(said.probability > 0.98, "{said:?}");
        }
        let said = ensemble.term(Symbol::Rate(0), &Term::parse("x^2").unwrap()).unwrap();
        assert!(said.probability < 0.5, "{said:?}");
    }

    #[test]
    fn forces_between_two_masses_stay_opposite_in_every_data_set() {
        let options = ScenarioOptions { seed: 2, duration: Some(20.0), ..ScenarioOptions::default() };
        let records = RecordSet::new(generate("two-masses", &options).unwrap().records, Usage::Fit);
        let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
        settings.terms = list("x1, x2-x1, v1, v2-v1, u").unwrap();
        settings.threshold = 0.0;
        let interval = |settings: &Settings, mass: usize| {
            let ensemble = Study::default().ensemble(&records, settings, &Cancel::default()).unwrap();
            ensemble.term(Symbol::Rate(mass), &Term::parse("x2-x1").unwrap()).unwrap().interval.unwrap()
        };
        settings.known = crate::study::known_list("m2/m1=0.5").unwrap();
        let (first, second) = (interval(&settings, 0), interval(&settings, 1));
        // The rig's masses: 2 kg and 1 kg.
        let apart = |second: (f64, f64)| (first.0 + 0.5 * second.1).abs() + (first.1 + 0.5 * second.0).abs();
        settings.known.clear();
        let free = interval(&settings, 1);
        // The shift that noise adds to either end is each equation's own.
        assert!(apart(second) < 0.02 * first.0 && apart(second) < 0.5 * apart(free), "{first:?} {second:?} {free:?}");
    }

    /// A system with noise, its library and the truth of each term.
    struct KnownSystem {
        scenario: &'static str,
        options: ScenarioOptions,
        form: Formulation,
        truth: &'static [(&'static str, f64)],
    }

    const DUFFING: &[(&str, f64)] = &[("x", -1.0), ("x^3", -0.6), ("v", -0.2), ("u", 1.0)];
    const FRICTION: &[(&str, f64)] = &[("x-u", -358.706), ("v-du", -0.0658), ("sgn(v)", -0.0856)];

    fn duffing_with(noise: f64, form: Formulation) -> KnownSystem {
        let options = ScenarioOptions {
            duration: Some(60.0),
            rate: Some(50.0),
            noise: Some(Noise::Deviation(noise)),
            ..ScenarioOptions::default()
        };
        KnownSystem { scenario: "duffing-noisy", options, form, truth: DUFFING }
    }

    fn friction_with(noise: f64, form: Formulation) -> KnownSystem {
        let options = ScenarioOptions {
            duration: Some(6.0),
            rate: Some(250.0),
            frequencies: Some(vec![2.013, 4.611]),
            noise: Some(Noise::Deviation(noise)),
            ..ScenarioOptions::default()
        };
        KnownSystem { scenario: "friction-noisy", options, form, truth: FRICTION }
    }

    /// Share of the 90 % intervals of each term that hold the truth: by standard errors, and by resampling.
    fn coverage(known: &KnownSystem, seeds: u64) -> Vec<[f64; 2]> {
        let mut held = vec![[0.0; 2]; known.truth.len()];
        for seed in 0..seeds {
            let options = ScenarioOptions { seed, ..known.options.clone() };
            let records = RecordSet::new(generate(known.scenario, &options).unwrap().records, Usage::Fit);
            let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
            settings.form = known.form;
            settings.terms = known.truth.iter().map(|(term, _)| Term::parse(term).unwrap()).collect();
            settings.threshold = 0.0;
            let mut study = Study::default();
            let outcome = study.run(&records, &settings, &Cancel::default()).unwrap();
            let ensemble = study.ensemble(&records, &settings, &Cancel::default()).unwrap();
            for ((term, value), held) in known.truth.iter().zip(&mut held) {
                let term = Term::parse(term).unwrap();
                let fitted = outcome.model.leading().unwrap().terms.iter().find(|t| t.term == term).unwrap();
                let error = (fitted.coefficient - value).abs();
                held[0] += f64::from(u8::from(error < DEVIATIONS_OF_90 * fitted.std_error.unwrap()));
                let (low, high) = ensemble.term(Symbol::Rate(0), &term).unwrap().interval.unwrap();
                held[1] += f64::from(u8::from((low..=high).contains(value)));
            }
        }
        held.into_iter().map(|h| h.map(|h| h / seeds as f64)).collect()
    }

    /// Both systems at two noises each, in both forms.
    fn cases() -> [(&'static str, KnownSystem); 8] {
        let weak = Formulation::Weak { half_width: None };
        [
            ("Duffing, 0.003 m", duffing_with(0.003, Formulation::Derivative)),
            ("Duffing, 0.01 m", duffing_with(0.01, Formulation::Derivative)),
            ("Duffing, 0.03 m", duffing_with(0.03, Formulation::Derivative)),
            ("Duffing, 0.01 m, weak form", duffing_with(0.01, weak)),
            ("friction, 1e-5 m", friction_with(1e-5, Formulation::Derivative)),
            ("friction, 5e-5 m", friction_with(5e-5, Formulation::Derivative)),
            ("friction, 1e-5 m, weak form", friction_with(1e-5, weak)),
            ("friction, 5e-5 m, weak form", friction_with(5e-5, weak)),
        ]
    }

    /// Coverage in every case: of all its terms together within `range`, and of no term below `least`; and in words.
    fn calibration(seeds: u64, range: std::ops::RangeInclusive<f64>, least: f64) -> (bool, String) {
        let mut good = true;
        let mut said = String::new();
        for (name, known) in cases() {
            let held = coverage(&known, seeds);
            for (way, title) in ["by errors", "by resampling"].into_iter().enumerate() {
                let each: Vec<f64> = held.iter().map(|h| h[way]).collect();
                let mean = each.iter().sum::<f64>() / each.len() as f64;
                good &= range.contains(&mean) && each.iter().all(|h| *h >= least);
                let each: Vec<String> =
                    (known.truth.iter().zip(&each)).map(|((t, _), h)| format!("{t} {h:.2}")).collect();
                said += &format!("{name}, {title}: {mean:.3} ({})\n", each.join(", "));
            }
        }
        (good, said)
    }

    #[test]
    #[ignore = "half a minute where tests are not optimised; run with --profile study"]
    fn ninety_percent_intervals_hold_the_truth_about_as_often() {
        // 24 to 32 intervals each: the standard error of a share of 90 % is 5 to 6 %, of one term's 11 %; two of them are
        // allowed, and three for the worst of the terms.
        let (good, said) = calibration(8, 0.78..=1.0, 0.57);
        assert!(good, "{said}");
    }

    #[test]
    #[ignore = "a minute"]
    fn ninety_percent_intervals_hold_the_truth_85_to_95_times_in_100() {
        // 600 to 800 intervals each: the standard error is 1.1 to 1.2 %, of one term's 2 %; sixteen shares are looked at.
        let (good, said) = calibration(200, 0.85..=0.95, 0.75);
        println!("{said}");
        assert!(good, "{said}");
    }
}
