//! The study of hidden effects: the virtual rig hides one, the search is given the records alone.

pub(crate) mod classics;
pub(crate) mod experiments;
pub(crate) mod places;
pub(crate) mod proposals;
pub(crate) mod two_masses;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Instant;

use rayon::prelude::*;
use sindyscope_core::study::Cancel;
use sindyscope_rig::hidden::{ExcitationKind, HiddenRequest, Instruments, Regime, draw, draw_in, exercised};
use sindyscope_rig::{NoiseKind, Truth};

use sindyscope_search::{Ask, Finding, Search, Verdict};
use sindyscope_values::record::{RecordSet, Usage};

/// Effects that no data of one kind can tell apart: an algebraic identity or a symmetry, not a lack of skill.
const TIES: &[&[&str]] = &[
    // -(k+g) x + k u = -(k+g)(x-u) - g u, and the same of the dampers.
    &["linear_stiffness", "input_gain"],
    &["viscous_damping", "base_velocity"],
];
/// The same where there is one record: -k (x - x0) = -k x + k x0, and the rest is linear.
const TIES_OF_ONE_RECORD: &[&[&str]] = &[&["constant_force", "sensor_offset"]];

/// Samples of the fitted records, and of a natural period in the usual regime.
const SAMPLES: f64 = 3000.0;
const SAMPLES_A_PERIOD: usize = 40;
/// Twice the log odds ratio from which two effects are told apart: odds of 150 to 1.
const TOLD: f64 = 10.0;

/// One run of the study.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    /// The regime that all but the seed is drawn in; none if the rest of this says what is asked for.
    pub(crate) regime: Option<Regime>,
    pub(crate) effects: Vec<String>,
    pub(crate) excitation: ExcitationKind,
    pub(crate) instruments: Instruments,
    pub(crate) seed: u64,
    pub(crate) ratio: Option<f64>,
    /// Natural periods that the search is given of the first record and nothing else; none if all that was recorded.
    pub(crate) periods: Option<usize>,
}

/// What the search made of it.
#[derive(Clone, Debug)]
pub(crate) struct Result {
    pub(crate) case: Case,
    /// Missing over spring force, of the weakest effect.
    pub(crate) ratio: f64,
    pub(crate) verdict: Verdict,
    /// Effects that were added, in order.
    pub(crate) steps: Vec<String>,
    /// Of the last step that is ambiguous, the others.
    pub(crate) others: Vec<String>,
    /// The first round's ranking.
    pub(crate) ranking: Vec<String>,
    /// Held-out RMSE over the sensor's noise: base and final.
    pub(crate) base: f64,
    pub(crate) last: f64,
    pub(crate) milliseconds: f64,
    pub(crate) p_value: f64,
    /// What an effect changes beyond the simpler one that it contains, RMS over the sensor's noise; none where it contains none.
    pub(crate) trait_size: Option<f64>,
    /// Why the truth was not named, if it was a candidate.
    pub(crate) why: String,
    /// What is left is noise, or too little to matter.
    pub(crate) explained: bool,
    /// Log density by which the effects that were added lead the best set without one of them: the least of all; none where
    /// nothing was added.
    pub(crate) lead: Option<f64>,
}

pub(crate) fn tied(a: &str, b: &str) -> bool {
    a == b || TIES.iter().any(|t| t.contains(&a) && t.contains(&b))
}

impl Case {
    /// The data can tell: rich excitation, an effect of a hundredth of the spring force at least, and where a simpler one
    /// is in it, a response that differs from that one's by more than noise may.
    fn can_tell(&self, ratio: f64, trait_size: Option<f64>) -> bool {
        let samples = self.periods.map_or(SAMPLES, |periods| (periods * SAMPLES_A_PERIOD) as f64);
        self.regime.is_some()
            || matches!(self.excitation, ExcitationKind::Multisine | ExcitationKind::SweepPair)
                && ratio >= 0.01
                && self.effects.iter().all(|e| exercised(e, self.excitation))
                && trait_size.is_none_or(|size| samples * size * size >= TOLD)
    }

    /// True if its data cannot tell two effects apart, or they are one.
    fn tied(&self, a: &str, b: &str) -> bool {
        let one_record = self.periods.is_some();
        tied(a, b) || one_record && TIES_OF_ONE_RECORD.iter().any(|t| t.contains(&a) && t.contains(&b))
    }
}

impl Result {
    pub(crate) fn tellable(&self) -> bool {
        self.case.can_tell(self.ratio, self.trait_size)
    }

    /// One of the hidden effects is among the first so many of the ranking; nothing is found where nothing is hidden.
    pub(crate) fn top(&self, n: usize) -> bool {
        if self.case.effects.is_empty() {
            return self.verdict == Verdict::NothingMissing;
        }
        let mut seen: Vec<&String> = Vec::new();
        for name in &self.ranking {
            if !seen.contains(&name) {
                seen.push(name);
            }
        }
        let hidden = |name: &String| self.case.effects.iter().any(|truth| self.case.tied(name, truth));
        self.verdict != Verdict::NothingMissing && seen.iter().take(n).any(|name| hidden(name))
    }

    /// Every hidden effect is among the steps.
    pub(crate) fn all_found(&self) -> bool {
        self.case.effects.iter().all(|truth| self.steps.iter().any(|s| self.case.tied(s, truth)))
    }

    /// A name given with confidence that is not the truth's.
    pub(crate) fn named_wrong(&self) -> bool {
        self.verdict == Verdict::Named
            && self.steps.iter().any(|s| !self.case.effects.iter().any(|truth| self.case.tied(s, truth)))
    }
}

/// A case as the search is given it, and the truth.
pub(crate) struct Drawn {
    /// With the effects that were drawn.
    pub(crate) case: Case,
    pub(crate) truth: Truth,
    pub(crate) records: RecordSet,
    pub(crate) ask: Ask,
}

pub(crate) fn drawn(case: &Case) -> Option<Drawn> {
    let request = HiddenRequest {
        ratio: case.ratio,
        instruments: case.instruments,
        ..HiddenRequest::new(case.effects.clone(), case.excitation, case.seed)
    };
    let drawn = case.regime.map_or_else(|| draw(&request), |regime| draw_in(regime, case.seed));
    let hidden = match drawn {
        Ok(hidden) => hidden,
        Err(error) => {
            eprintln!("not drawn: {case:?}: {error}");
            return None;
        }
    };
    let case = Case { effects: hidden.truth.effects.clone(), ..case.clone() };
    let ask = Ask { base: hidden.base, ..Ask::default() };
    let (fit, held_out) = match case.periods {
        Some(periods) => (vec![hidden.fit.first()?.slice(0..periods * SAMPLES_A_PERIOD)], Vec::new()),
        None => (hidden.fit, hidden.held_out),
    };
    let mut records = RecordSet::new(fit, Usage::Fit);
    records.add(held_out, Usage::HeldOut);
    Some(Drawn { case, truth: hidden.truth, records, ask })
}

/// Missing over spring force, of the weakest effect.
fn weakest(truth: &Truth) -> f64 {
    truth.ratios.iter().copied().fold(truth.ratio, f64::min)
}

/// What an effect changes beyond the simpler one that it contains, RMS over the sensor's noise; none where it contains none.
fn trait_size(truth: &Truth) -> Option<f64> {
    truth.beyond_simpler.map(|size| size / truth.noise.max(1e-12))
}

pub(crate) fn run(case: &Case) -> Option<Result> {
    let Drawn { case, truth, records, ask } = drawn(case)?;
    let started = Instant::now();
    let diagnosis = Search::new(&records, &ask).and_then(|s| s.diagnose(&|_| {}, &Cancel::default()));
    let milliseconds = 1e3 * started.elapsed().as_secs_f64();
    let diagnosis = match diagnosis {
        Ok(diagnosis) => diagnosis,
        Err(error) => {
            eprintln!("not diagnosed: {case:?}: {error}");
            return None;
        }
    };
    assert!(!diagnosis.sentence.contains("just as well :"), "rivals have names: {case:?}: {}", diagnosis.sentence);
    let (first, last) = (diagnosis.stages.first()?, diagnosis.stages.last()?);
    let rounds = &diagnosis.rounds;
    let others = rounds
        .iter()
        .find_map(|r| match &r.finding {
            Finding::Ambiguous(places) => {
                Some(places.iter().map(|k| r.candidates[*k].choice.effect.clone()).collect::<Vec<_>>())
            }
            _ => None,
        })
        .unwrap_or_default();
    let leads = diagnosis.steps().into_iter().filter_map(|s| Some(s.round.lead.as_ref()?.difference)).reduce(f64::min);
    let noise = truth.noise.max(1e-12);
    let first_hidden = case.effects.first();
    let why = rounds
        .first()
        .and_then(|r| r.candidates.iter().find(|c| first_hidden.is_some_and(|t| case.tied(&c.choice.effect, t))))
        .map_or_else(String::new, |c| format!("{} [{:.0} {:.2}]", c.why, c.delta_bic, c.explained));
    Some(Result {
        ratio: weakest(&truth),
        verdict: diagnosis.verdict,
        steps: last.effects.iter().map(|e| e.choice.effect.clone()).collect(),
        others,
        ranking: rounds.first()?.candidates.iter().map(|c| c.choice.effect.clone()).collect(),
        base: first.gap.test_rmse? / noise,
        last: last.gap.test_rmse? / noise,
        milliseconds,
        p_value: rounds.first()?.evidence.p_value,
        trait_size: trait_size(&truth),
        why,
        explained: diagnosis.explained,
        lead: leads,
        case,
    })
}

/// Every combination of effects, excitations, noise and seeds.
pub(crate) fn cases(
    effects: &[Vec<String>],
    excitations: &[ExcitationKind],
    noises: &[Instruments],
    seeds: std::ops::Range<u64>,
) -> Vec<Case> {
    let mut cases = Vec::new();
    for effects in effects {
        for &excitation in excitations {
            if !effects.iter().all(|e| sindyscope_rig::hidden::possible(e, excitation)) {
                continue;
            }
            for &instruments in noises {
                for seed in seeds.clone() {
                    cases.push(Case {
                        regime: None,
                        effects: effects.clone(),
                        excitation,
                        instruments,
                        seed,
                        ratio: None,
                        periods: None,
                    });
                }
            }
        }
    }
    cases
}

/// Draws of a regime.
pub(crate) fn in_regime(regime: Regime, draws: u64) -> Vec<Case> {
    let case = |seed| Case {
        regime: Some(regime),
        effects: Vec::new(),
        excitation: ExcitationKind::Multisine,
        instruments: Instruments::white(0.0),
        seed,
        ratio: None,
        periods: None,
    };
    (0..draws).map(case).collect()
}

/// How many draws of each kind a long study makes: what `SINDYSCOPE_DRAWS` says, or this.
pub(crate) fn draws(usual: u64) -> u64 {
    std::env::var("SINDYSCOPE_DRAWS").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// Runs cases side by side, in their order.
pub(crate) fn run_all(cases: &[Case]) -> Vec<Result> {
    cases.par_iter().filter_map(run).collect()
}

pub(crate) fn share(of: usize, all: usize) -> f64 {
    if all == 0 { f64::NAN } else { 100.0 * of as f64 / all as f64 }
}

/// For each hidden effect: how often it was drawn, named first, among the first three, missed, and what was named instead.
pub(crate) fn confusion(results: &[Result]) -> String {
    let mut rows: BTreeMap<String, Vec<&Result>> = BTreeMap::new();
    for r in results {
        rows.entry(r.case.effects.join(" + ")).or_default().push(r);
    }
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{:<34} {:>4} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6}  instead",
        "hidden", "n", "first", "in 3", "named", "ambig", "unexpl", "none"
    );
    for (name, list) in rows {
        let count = |f: &dyn Fn(&Result) -> bool| list.iter().filter(|r| f(r)).count();
        let mut instead: BTreeMap<&str, usize> = BTreeMap::new();
        for r in &list {
            if let Some(first) = r.ranking.first().filter(|_| !r.top(1) && r.verdict != Verdict::NothingMissing) {
                *instead.entry(first.as_str()).or_default() += 1;
            }
        }
        let instead: Vec<String> = instead.into_iter().map(|(n, k)| format!("{n} {k}")).collect();
        let _ = writeln!(
            out,
            "{:<34} {:>4} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6}  {}",
            if name.is_empty() { "nothing" } else { &name },
            list.len(),
            count(&|r| r.top(1)),
            count(&|r| r.top(3)),
            count(&|r| r.verdict == Verdict::Named),
            count(&|r| r.verdict == Verdict::Ambiguous),
            count(&|r| r.verdict == Verdict::Unexplained),
            count(&|r| r.verdict == Verdict::NothingMissing),
            instead.join(", ")
        );
    }
    out
}

/// Lower ends of the classes of leads in [`odds`], log density.
const LEADS: [f64; 5] = [5.0, 10.0, 30.0, 100.0, 1000.0];

/// Stated odds against found ones, of the draws that were named: for each class of leads (the odds stated are those of its lower
/// end), how many were named and how many of them wrongly, where the gap is explained and where more than noise is left.
pub(crate) fn odds(results: &[Result]) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{:<26} {:>9} {:>7} {:>14} {:>7}",
        "lead, log density", "explained", "wrong", "not explained", "wrong"
    );
    for (k, low) in LEADS.iter().enumerate() {
        let high = LEADS.get(k + 1).copied().unwrap_or(f64::INFINITY);
        let within = |r: &&Result| r.verdict == Verdict::Named && r.lead.is_some_and(|l| (*low..high).contains(&l));
        let count = |explained: bool| {
            let of: Vec<&Result> = results.iter().filter(within).filter(|r| r.explained == explained).collect();
            (of.len(), of.iter().filter(|r| r.named_wrong()).count())
        };
        let ((all, wrong), (open, open_wrong)) = (count(true), count(false));
        let range = if high.is_finite() { format!("{low} to {high}") } else { format!("above {low}") };
        let odds = format!("{range} (wrong: {:.1e})", (-low).exp());
        let _ = writeln!(out, "{odds:<26} {all:>9} {wrong:>7} {open:>14} {open_wrong:>7}");
    }
    out
}

/// What a study found against what it was to find: printed as it goes, told all at once at the end.
#[derive(Debug, Default)]
pub(crate) struct Targets {
    missed: Vec<String>,
}

impl Targets {
    pub(crate) fn at_least(&mut self, what: &str, value: f64, bound: f64) {
        self.judge(what, value, value >= bound, &format!("{bound} at least"));
    }

    pub(crate) fn at_most(&mut self, what: &str, value: f64, bound: f64) {
        self.judge(what, value, value <= bound, &format!("{bound} at most"));
    }

    fn judge(&mut self, what: &str, value: f64, reached: bool, bound: &str) {
        let line = format!("{what:<58} {value:7.2}  (target: {bound})");
        println!("{line}");
        // What was not drawn at all has missed nothing.
        if !reached && !value.is_nan() {
            self.missed.push(line);
        }
    }

    /// Fails if a target was missed.
    pub(crate) fn assert_reached(self) {
        assert!(self.missed.is_empty(), "missed:\n{}", self.missed.join("\n"));
    }
}

/// Of one regime, a line: shares named first, in the first three and wrongly, held-out error over the noise, times.
pub(crate) fn regime_line(regime: Regime, asked: u64, results: &[Result]) -> String {
    let part = |f: &dyn Fn(&Result) -> bool| share(results.iter().filter(|r| f(r)).count(), results.len());
    let seconds: Vec<f64> = results.iter().map(|r| r.milliseconds / 1e3).collect();
    format!(
        "{:<16} {:>3} of {asked:<3} {:>7.1} {:>7.1} {:>7.1} {:>9.2} {:>8.2} {:>8.2}",
        regime.name(),
        results.len(),
        part(&|r| r.top(1)),
        part(&|r| r.top(3)),
        part(&Result::named_wrong),
        median(results.iter().map(|r| r.last).collect()),
        median(seconds.clone()),
        seconds.iter().copied().fold(f64::NAN, f64::max),
    )
}

/// What stands above those lines.
pub(crate) const REGIME_HEADING: &str =
    "regime           run of drawn  first %  in 3 %  wrong %  held out  median s  longest s";

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

pub(crate) fn white(share: f64) -> Instruments {
    Instruments::white(share)
}

pub(crate) fn of_kind(kind: NoiseKind, share: f64) -> Instruments {
    Instruments { kind, ..Instruments::white(share) }
}

/// A run in which the truth was not named first, or another was named with confidence, in two lines.
pub(crate) fn miss(r: &Result) -> Option<String> {
    (!r.top(1) || r.named_wrong()).then(|| {
        let drawn = match r.case.regime {
            None => format!("{} {} %", r.case.excitation, 100.0 * r.case.instruments.share),
            Some(regime) => regime.to_string(),
        };
        format!(
            "{} {drawn} seed {}, {:.3} of the spring force: {:?} {:?} or {:?}, p {:.0e}; held out {:.1} → {:.2} noises{}\n    {}",
            r.case.effects.join("+"),
            r.case.seed,
            r.ratio,
            r.verdict,
            r.steps,
            r.others,
            r.p_value,
            r.base,
            r.last,
            r.trait_size.map_or_else(String::new, |s| format!("; its own trait {s:.2} noises")),
            r.why
        )
    })
}
