//! Which candidate forces are fitted, in what order, and which of them stands.

use super::super::error::ModesError;
use super::super::force::{Effect, Site};
use super::super::judge::{beats, compared};
use super::super::limits::{
    EXPLAINS, FORCE_GAIN, MOST_AGAIN, MOST_CANDIDATES, MOST_JOINTS, MOST_OTHERS, MOST_PUT_OFF, NEAR, NEAR_NOISES,
    NEAR_OTHER_EFFECT, SCREENED_MODES, SIDE_BY_SIDE,
};
use super::super::screen::{ForceCandidate, Screen, SiteKind};
use super::landing::{Asked, ForceStanding, Landing, Request};
use super::{FittedStructure, ForceSearch};
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::signal::standard_deviation;
use sindyscope_core::study::Cancel;
use sindyscope_search::Lead;
use std::collections::VecDeque;

/// The least errors of screened candidates: a joint that slips stands in for much of what others do, so these are held against
/// each other alone.
#[derive(Clone, Copy)]
struct Nearest {
    /// Of those without a memory.
    plain: f64,
    any: f64,
}

impl Nearest {
    fn see(&mut self, candidates: &[ForceCandidate]) {
        for c in candidates {
            self.any = self.any.min(c.error);
            if !c.effect.has_memory() {
                self.plain = self.plain.min(c.error);
            }
        }
    }

    /// What a candidate is held against.
    fn to(self, effect: Effect) -> f64 {
        if effect.has_memory() { self.any } else { self.plain }
    }
}

type ChosenForce = (FittedStructure, Lead, Vec<(Effect, Site)>, Vec<(Effect, Site, f64)>);

impl ForceSearch<'_> {
    pub(super) fn fitted(
        &self,
        report: &(dyn Fn(&'static str, f64) + Sync),
        cancel: &Cancel,
    ) -> Result<Vec<FittedStructure>, ModesError> {
        let poles = &self.path.steps[self.path.chosen].poles;
        let modes = self.fixed.unwrap_or_else(|| (poles.len() + 1).clamp(SCREENED_MODES.0, SCREENED_MODES.1));
        let noises = (0..self.measurement.sensors.len())
            .map(|s| {
                self.split.fitted.iter().filter_map(|r| standard_deviation(&r.outputs[s])).fold(f64::INFINITY, f64::min)
            })
            .map(|n| if n.is_finite() { n } else { 0.0 })
            .collect();
        let Self { measurement, split, chosen, .. } = *self;
        let screen = Screen { measurement, split, poles, chosen, modes, pool: &self.path.pool, noises };
        let explains = |f: &FittedStructure| self.explains(f);
        let mut all: Vec<FittedStructure> = Vec::new();
        let mut put_off: Vec<(ForceCandidate, f64)> = Vec::new();
        let mut nearest = Nearest { plain: f64::INFINITY, any: f64::INFINITY };
        // Where a force to the ground explains the data, none between sensors is asked for.
        for (reach, from, to) in [(SiteKind::Ground, 0.05, 0.6), (SiteKind::Pairs, 0.6, 1.0)] {
            if all.iter().any(explains) {
                break;
            }
            let screened = |share| report("asking which force is missing", from + 0.4 * (to - from) * share);
            let candidates = screen.candidates(reach, &screened, cancel);
            nearest.see(&candidates);
            let told = |share: f64| report("fitting the force", from + (to - from) * (0.4 + 0.6 * share));
            self.within_reach(&screen, (&candidates, nearest), (&mut all, &mut put_off), &told, cancel)?;
            if cancel.is_cancelled() {
                return Err(ModesError::Cancelled);
            }
        }
        // Where nothing comes near, the best of what is far is told.
        put_off.sort_by(|a, b| a.1.total_cmp(&b.1));
        let far: Vec<ForceCandidate> = put_off.into_iter().take(SIDE_BY_SIDE).map(|f| f.0).collect();
        if self.standing(&all).poles.is_empty() {
            self.put_off(&screen, &far, &mut all, cancel)?;
        }
        // What was fitted before a mode was found that its force had hidden gets that mode too.
        let standing = self.standing(&all);
        if standing.explained {
            let poorer = |f: &&FittedStructure| f.model.modes() < standing.poles.len() && !self.explains(f);
            let again: Vec<ForceCandidate> = all.iter().filter(poorer).map(|f| f.candidate.clone()).collect();
            for landing in self.side_by_side(&screen, again, (&standing, Asked::First), cancel)? {
                keep_better(&mut all, landing);
            }
        }
        Ok(all)
    }

    /// The candidates of a reach: the promising ones, others behind them, those that were put off near the noise, and where none explains
    /// the data some with more modes. `told` takes the share that is done.
    fn within_reach(
        &self,
        screen: &Screen<'_>,
        (candidates, nearest): (&[ForceCandidate], Nearest),
        (all, put_off): (&mut Vec<FittedStructure>, &mut Vec<(ForceCandidate, f64)>),
        told: &dyn Fn(f64),
        cancel: &Cancel,
    ) -> Result<(), ModesError> {
        let explains = |f: &FittedStructure| self.explains(f);
        let mut chosen = VecDeque::from(self.promising(candidates, all, nearest));
        let mut others = self.others(candidates, chosen.make_contiguous());
        let (near, mut count) = (chosen.len(), 0_usize);
        let again: Vec<ForceCandidate> =
            chosen.iter().chain(&others).filter(|c| !c.effect.has_memory()).take(MOST_AGAIN).cloned().collect();
        // Those that were asked with more modes.
        let mut richer: Vec<(Effect, Site)> = Vec::new();
        // The first one mostly explains the data: it is fitted alone, and what follows side by side.
        let mut width = 1;
        while count < near + MOST_OTHERS && !(chosen.is_empty() && all.iter().any(explains)) {
            let explained = all.iter().any(explains);
            let other = |others: &mut _| if explained { None } else { self.next_other(others, all) };
            let next = || chosen.pop_front().or_else(|| other(&mut others));
            let mut batch: Vec<ForceCandidate> = std::iter::from_fn(next).take(width).collect();
            if batch.is_empty() {
                break;
            }
            told(count as f64 / (near + MOST_OTHERS) as f64);
            count += batch.len();
            width = SIDE_BY_SIDE;
            // Where one explains the data, those that are far from it need no fit.
            if explained {
                batch.retain(|c| c.error <= NEAR * nearest.to(c.effect));
            }
            let kinds: Vec<(Effect, Site)> = batch.iter().map(|c| (c.effect, c.site)).collect();
            let landed = self.side_by_side(screen, batch, (&self.standing(all), Asked::First), cancel)?;
            for (kind, landing) in kinds.into_iter().zip(landed) {
                match landing {
                    Landing::Fitted(fitted) => all.push(*fitted),
                    Landing::PutOff(candidate, noises) => {
                        richer.push(kind);
                        put_off.push((*candidate, noises));
                    }
                    Landing::Nowhere { richer: true } => richer.push(kind),
                    Landing::Nowhere { richer: false } => {}
                }
            }
        }
        // Where none did, the true one may lack a mode that is seen only along its own force.
        let near = put_off.extract_if(.., |p| p.1 < NEAR_NOISES);
        let second: Vec<ForceCandidate> =
            near.collect::<Vec<_>>().into_iter().take(MOST_PUT_OFF).map(|p| p.0).collect();
        self.put_off(screen, &second, all, cancel)?;
        // Else modes may be hidden that the first ones were fitted without.
        let again: Vec<ForceCandidate> = again.into_iter().filter(|c| !richer.contains(&(c.effect, c.site))).collect();
        for batch in again.chunks(SIDE_BY_SIDE) {
            let standing = self.standing(all);
            if standing.explained || !standing.poles.is_empty() {
                break;
            }
            for landing in self.side_by_side(screen, batch.to_vec(), (&standing, Asked::MoreModes), cancel)? {
                keep_better(all, landing);
            }
        }
        Ok(())
    }

    /// Candidates that were put off, until one explains the data.
    fn put_off(
        &self,
        screen: &Screen<'_>,
        candidates: &[ForceCandidate],
        all: &mut Vec<FittedStructure>,
        cancel: &Cancel,
    ) -> Result<(), ModesError> {
        for batch in candidates.chunks(SIDE_BY_SIDE) {
            let standing = self.standing(all);
            if standing.explained {
                break;
            }
            for landing in self.side_by_side(screen, batch.to_vec(), (&standing, Asked::PutOff), cancel)? {
                keep_better(all, landing);
            }
        }
        Ok(())
    }

    /// Candidates fitted beside what the ones before have come to, on as many cores as there are.
    fn side_by_side(
        &self,
        screen: &Screen<'_>,
        candidates: Vec<ForceCandidate>,
        (standing, asked): (&ForceStanding, Asked),
        cancel: &Cancel,
    ) -> Result<Vec<Landing>, ModesError> {
        let request = Request { standing, asked };
        let closed = |c: ForceCandidate| self.closed(screen, c, request, cancel);
        let landed = candidates.into_par_iter().map(closed).collect();
        if cancel.is_cancelled() { Err(ModesError::Cancelled) } else { Ok(landed) }
    }

    fn explains(&self, fitted: &FittedStructure) -> bool {
        fitted.error < EXPLAINS * self.noise_in(&fitted.residuals.unseen)
    }

    /// What the candidates that were fitted have come to.
    fn standing(&self, fitted: &[FittedStructure]) -> ForceStanding {
        let noise = fitted.iter().map(|f| self.noise_in(&f.residuals.unseen)).fold(self.noise, f64::min);
        let best = fitted.iter().min_by(|a, b| a.error.total_cmp(&b.error));
        let near = best.filter(|f| f.error < NEAR_NOISES * noise);
        ForceStanding {
            explained: fitted.iter().any(|f| self.explains(f)),
            error: best.map_or(f64::INFINITY, |f| f.error),
            noise,
            poles: near.map_or_else(Vec::new, |f| f.model.poles.clone()),
        }
    }

    /// Candidates without a memory behind those that are chosen, the best first: of each effect and place one.
    fn others(&self, candidates: &[ForceCandidate], chosen: &[ForceCandidate]) -> Vec<ForceCandidate> {
        let mut others: Vec<ForceCandidate> = Vec::new();
        for c in candidates.iter().filter(|c| !c.effect.has_memory()) {
            if chosen.iter().chain(&others).all(|k| (k.effect, k.site) != (c.effect, c.site)) {
                others.push(c.clone());
            }
        }
        others
    }

    /// The next one: at the place of the best that was fitted where that is near the noise, since a place is told sooner than an
    /// effect, else the first.
    fn next_other(&self, others: &mut Vec<ForceCandidate>, fitted: &[FittedStructure]) -> Option<ForceCandidate> {
        let near = !self.standing(fitted).poles.is_empty();
        let best = fitted.iter().filter(|_| near).min_by(|a, b| a.error.total_cmp(&b.error)).map(|f| f.candidate.site);
        let better = |c: &ForceCandidate| c.error < FORCE_GAIN * self.linear_error();
        let at = others.iter().position(|c| Some(c.site) == best).or_else(|| others.iter().position(better))?;
        Some(others.remove(at))
    }

    /// Of each effect that was not fitted yet the best place, of the near ones every place.
    fn promising(
        &self,
        candidates: &[ForceCandidate],
        fitted: &[FittedStructure],
        nearest: Nearest,
    ) -> Vec<ForceCandidate> {
        let mut chosen: Vec<&ForceCandidate> = Vec::new();
        for c in candidates {
            let memory = c.effect.has_memory();
            let new = chosen.iter().all(|k| (k.effect, k.site) != (c.effect, c.site));
            let mut known = chosen.iter().copied().chain(fitted.iter().map(|f| &f.candidate));
            let first = !memory && known.all(|k| k.effect != c.effect);
            let near = c.error < if first { NEAR_OTHER_EFFECT } else { NEAR } * nearest.to(c.effect);
            let count = chosen.iter().filter(|k| k.effect.has_memory() == memory).count();
            let most = if memory { MOST_JOINTS } else { MOST_CANDIDATES };
            if new && near && c.error < FORCE_GAIN * self.linear_error() && count < most {
                chosen.push(c);
            }
        }
        // A joint that slips takes longest, and stands in for much of what others do: it comes first where nothing else is near it. Before
        // one that contains another stands that other, which it must beat.
        chosen.sort_by_key(|c| c.effect.has_memory() && nearest.plain < NEAR_OTHER_EFFECT * nearest.any);
        let mut ordered: Vec<&ForceCandidate> = Vec::new();
        for c in chosen {
            let simpler = candidates.iter().find(|s| s.site == c.site && c.effect.contains(s.effect));
            let near = simpler.filter(|s| s.error < NEAR_OTHER_EFFECT * nearest.any);
            for c in near.into_iter().chain([c]) {
                if ordered.iter().all(|k| (k.effect, k.site) != (c.effect, c.site)) {
                    ordered.push(c);
                }
            }
        }
        ordered.into_iter().cloned().collect()
    }

    /// The effect that stands, with its lead over the nearest rival, those that it does not beat, and all that were tried.
    pub(super) fn chosen(&self, mut fitted: Vec<FittedStructure>, period: f64) -> Option<ChosenForce> {
        let step = &self.path.steps[self.path.chosen];
        let plain = step.residuals.densities(&self.split.intervals(), period);
        let is_contained = |larger: &FittedStructure, smaller: &FittedStructure| {
            larger.candidate.site == smaller.candidate.site
                && larger.candidate.effect.contains(smaller.candidate.effect)
        };
        // One that contains another must beat it.
        let needless: Vec<bool> = (fitted.iter())
            .map(|f| fitted.iter().any(|g| is_contained(f, g) && !beats(&f.densities, &g.densities)))
            .collect();
        let mut needless = needless.into_iter();
        fitted.retain(|_| !needless.next().unwrap_or(false));
        fitted.sort_by(|a, b| {
            let sum = |f: &FittedStructure| f.densities.iter().sum::<f64>();
            sum(b).total_cmp(&sum(a))
        });
        let tried: Vec<(Effect, Site, f64)> =
            fitted.iter().map(|f| (f.candidate.effect, f.candidate.site, f.error)).collect();
        let stands =
            fitted.iter().position(|f| f.error < FORCE_GAIN * self.linear_error() && beats(&f.densities, &plain))?;
        let best = fitted.remove(stands);
        let mut rivals = Vec::new();
        let mut lead = compared(&best.densities, &plain, "none");
        for rival in &fitted {
            let over = compared(&best.densities, &rival.densities, rival.candidate.effect.name());
            if !beats(&best.densities, &rival.densities) {
                rivals.push((rival.candidate.effect, rival.candidate.site));
            }
            if over.difference < lead.difference {
                lead = over;
            }
        }
        Some((best, lead, rivals, tried))
    }
}

/// Adds a candidate, or puts it in the place of the same force that leaves more.
fn keep_better(all: &mut Vec<FittedStructure>, landing: Landing) {
    let Landing::Fitted(fitted) = landing else { return };
    let same = |f: &FittedStructure| {
        (f.candidate.effect, f.candidate.site) == (fitted.candidate.effect, fitted.candidate.site)
    };
    match all.iter().position(same) {
        Some(k) if all[k].error <= fitted.error => {}
        Some(k) => all[k] = *fitted,
        None => all.push(*fitted),
    }
}
