//! Records of the virtual rig with what they hide, and what a search makes of them at which cost.

use sindyscope_core::study::Cancel;
use sindyscope_rig::hidden::{
    ExcitationKind, Hidden, HiddenRequest, Instruments, Regime, draw, draw_in, outside_names,
};
use sindyscope_rig::{Noise, NoiseKind, ScenarioOptions, generate};
use sindyscope_search::{Ask, Constants, Search, SearchEffort, Verdict};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::Term;

/// Records to search, and what is to be found.
#[derive(Clone, Debug)]
pub(crate) struct Drawn {
    /// What was drawn, in words.
    pub(crate) name: String,
    records: RecordSet,
    base: Option<Vec<Term>>,
    /// The effects that are hidden, sorted.
    hidden: Vec<String>,
}

/// What a search came to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Searched {
    pub(crate) verdict: Verdict,
    /// The gap is closed.
    pub(crate) explained: bool,
    /// The effects that were added, sorted.
    pub(crate) names: Vec<String>,
    pub(crate) effort: SearchEffort,
    /// The names are what is hidden.
    pub(crate) right: bool,
}

impl Searched {
    /// Names that are not what is hidden were given with confidence.
    pub(crate) fn is_wrong(&self) -> bool {
        self.verdict == Verdict::Named && !self.right
    }
}

fn of_rig(name: String, hidden: Hidden) -> Drawn {
    let mut records = RecordSet::new(hidden.fit, Usage::Fit);
    records.add(hidden.held_out, Usage::HeldOut);
    let mut effects = hidden.truth.effects;
    effects.sort_unstable();
    Drawn { name, records, base: hidden.base, hidden: effects }
}

/// Effects of the catalogue, joined by `+`, hidden in so many fitted samples with a share of noise.
pub(crate) fn hidden(
    effects: &str,
    excitation: ExcitationKind,
    noise: Instruments,
    samples: usize,
    seed: u64,
) -> Drawn {
    let list = effects.split('+').filter(|e| !e.is_empty());
    let request = HiddenRequest { instruments: noise, samples, ..HiddenRequest::new(list, excitation, seed) };
    let kind = match noise.kind {
        NoiseKind::White => "",
        NoiseKind::Coloured => ", coloured",
        NoiseKind::Quantised => ", in steps",
    };
    let what = if effects.is_empty() { "nothing" } else { effects };
    let name = format!("{what}, {excitation}, noise {} %{kind}, seed {seed}", 100.0 * noise.share);
    of_rig(name, draw(&request).unwrap())
}

/// A draw of a regime.
pub(crate) fn in_regime(regime: Regime, seed: u64) -> Drawn {
    let hidden = draw_in(regime, seed).unwrap();
    of_rig(format!("{}, {regime}, seed {seed}", hidden.truth.effects.join("+")), hidden)
}

/// Two masses, dry friction of a force between them; none where it is zero.
pub(crate) fn two_masses(friction: f64, seed: u64) -> Drawn {
    let record = |seed| {
        let options = ScenarioOptions {
            seed,
            noise: Some(Noise::ShareOfPeak(0.005)),
            rate: Some(100.0),
            duration: Some(12.0),
            parameters: vec![("F12".to_owned(), friction)],
            ..ScenarioOptions::default()
        };
        generate("two-masses", &options).unwrap().records
    };
    let mut records = RecordSet::new(record(seed), Usage::Fit);
    records.add(record(seed + 100), Usage::HeldOut);
    let hidden: &[&str] = if friction > 0.0 { &["coulomb_friction"] } else { &[] };
    let name = format!("two masses, friction {friction} between them, seed {seed}");
    Drawn { name, records, base: None, hidden: hidden.iter().map(|&e| e.to_owned()).collect() }
}

/// What is found with other constants.
pub(crate) fn searched(drawn: &Drawn, constants: &Constants) -> Searched {
    let ask = Ask { base: drawn.base.clone(), constants: constants.clone(), ..Ask::default() };
    let search = Search::new(&drawn.records, &ask).unwrap();
    let diagnosis = search.diagnose(&|_| {}, &Cancel::default()).unwrap();
    let mut names: Vec<String> = diagnosis.steps().iter().map(|s| s.added.choice.effect.clone()).collect();
    names.sort_unstable();
    let nothing_found = diagnosis.verdict == Verdict::NothingMissing;
    // What the catalogue does not have is to be left without a name.
    let is_nameless = drawn.hidden.iter().any(|e| outside_names().any(|outside| outside == e));
    let right = match is_nameless {
        true => diagnosis.verdict == Verdict::Unexplained,
        false => names == drawn.hidden && nothing_found == names.is_empty(),
    };
    let (verdict, explained) = (diagnosis.verdict, diagnosis.explained);
    Searched { verdict, explained, names, effort: search.effort(), right }
}
