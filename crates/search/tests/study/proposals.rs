//! Where the true set of effects stands among those that are proposed.

use rayon::prelude::*;
use sindyscope_core::study::Cancel;
use sindyscope_rig::hidden::SensedMotion;
use sindyscope_search::{Ask, Choice, ProposedSet, Search, Site};
use sindyscope_values::record::RecordSet;

use super::classics::{Classic, asked};
use super::places::{Chain, chain};
use super::{Case, Drawn, drawn, share, trait_size, weakest};

/// What was drawn, in words, and how many sets stand before the true one; none if it is not among them.
pub(crate) type Standing = (String, Option<usize>);

/// How many sets stand before the truth, as [`ProposedSet::before`] counts.
fn before(records: &RecordSet, ask: &Ask, is_true: impl Fn(&[(Choice, Option<Site>)]) -> bool) -> Option<usize> {
    let cancel = Cancel::default();
    let search = Search::new(records, ask).ok()?;
    let base = search.base(&cancel).ok()?;
    let sets = search.proposed(&base, &cancel).ok()?;
    ProposedSet::before(&sets, |set| is_true(&set.effects))
}

/// Of the cases in which something is hidden that the data can tell.
pub(crate) fn of_cases(cases: &[Case]) -> Vec<Standing> {
    let of_case = |case: &Case| -> Option<Standing> {
        let Drawn { case, truth, records, ask } = drawn(case)?;
        let hidden = &case.effects;
        if hidden.is_empty() || !case.can_tell(weakest(&truth), trait_size(&truth)) {
            return None;
        }
        let is_true = |set: &[(Choice, Option<Site>)]| {
            let has = |name: &String| set.iter().any(|(choice, _)| case.tied(&choice.effect, name));
            set.len() == hidden.len() && hidden.iter().all(has)
        };
        let what = match case.regime {
            Some(regime) => format!("{regime}, {}: {}", case.seed, hidden.join(" + ")),
            None => format!("{}, {}: {}", case.excitation, case.seed, hidden.join(" + ")),
        };
        Some((what, before(&records, &ask, is_true)))
    };
    cases.par_iter().filter_map(of_case).collect()
}

pub(crate) fn of_classics(classics: &[Classic], seed: u64) -> Vec<Standing> {
    let of_classic = |classic: &Classic| {
        let (records, ask) = asked(classic, seed);
        let is_true = |set: &[(Choice, Option<Site>)]| {
            set.len() == classic.3.len() && classic.3.iter().all(|name| set.iter().any(|(c, _)| c.effect == *name))
        };
        (format!("{}, {seed}: {}", classic.0, classic.3.join(" + ")), before(&records, &ask, is_true))
    };
    classics.par_iter().map(of_classic).collect()
}

/// Effect and place in chains of masses.
pub(crate) fn of_chains(masses: usize, shown: SensedMotion, seeds: std::ops::Range<u64>) -> Vec<Standing> {
    let of_chain = |seed: u64| -> Option<Standing> {
        let Chain { records, effect, site, .. } = chain(masses, shown, false, seed)?;
        let is_true = |set: &[(Choice, Option<Site>)]| match set {
            [(choice, Some(place))] => choice.effect == effect && place.to_string() == site,
            _ => false,
        };
        let what = format!("{masses} masses, {}, {seed}: {effect} at {site}", shown.name());
        Some((what, before(&records, &Ask::default(), is_true)))
    };
    seeds.into_par_iter().filter_map(of_chain).collect()
}

/// Percent of the draws in which the truth is among the first so many.
pub(crate) fn among(standings: &[Standing], first: usize) -> f64 {
    share(standings.iter().filter(|(_, before)| before.is_some_and(|k| k < first)).count(), standings.len())
}
