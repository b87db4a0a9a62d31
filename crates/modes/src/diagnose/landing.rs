//! One candidate from its first start to its end.

use super::super::closed::{ClosedModel, Free};
use super::super::identify::main_period;
use super::super::judge::{Residuals, beats, rms};
use super::super::limits::{
    BEHIND, BEHIND_NOISES, CLOSE_NOISES, ENOUGH, EXPLAINS, LAST_GAIN, LEFT_OUT, LEFT_OUT_STEPS, MODE_GAIN,
    MOST_HALVINGS, MOST_MODES, NEAR_NOISES, POOL_DAMPING, RIVAL_STEPS, ROUGH, ROUND_GAIN, ROUNDS, SCREENED_MODES,
    STEP_MATTERS, WHOLE_STEPS, WRONG_COUPLING,
};
use super::super::linear::{LinearTask, ModalFit};
use super::super::motion::PARTS;
use super::super::pole::Pole;
use super::super::screen::{Along, ForceCandidate, Screen};
use super::beginning::BegunFit;
use super::candidates::ForceStanding;
use super::following::{FollowedForce, Unseen};
use super::{FittedStructure, ForceSearch};
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::study::Cancel;

/// How a closed loop starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StartKind {
    /// As the open-loop fit has it.
    Plain,
    /// With the force as large as the motion of its own states asks for.
    Matched,
}

impl StartKind {
    const ALL: [Self; 2] = [Self::Plain, Self::Matched];

    /// What is left of a coupling by which the force would push a mode the wrong way.
    pub(super) fn wrong_coupling(self) -> f64 {
        WRONG_COUPLING[self as usize]
    }
}

/// An open-loop fit along a candidate force.
#[derive(Clone, Copy)]
struct OpenFit<'a> {
    task: &'a LinearTask<'a>,
    fit: &'a ModalFit,
    candidate: &'a ForceCandidate,
    /// True if the force is that of a model that was fitted before.
    again: bool,
}

impl ForceSearch<'_> {
    /// A candidate fitted in open loop, then in closed loop from several starts; a rival of one that explains the data gets
    /// one start.
    pub(super) fn closed(
        &self,
        screen: &Screen<'_>,
        mut candidate: ForceCandidate,
        standing: &ForceStanding,
        with_more_modes: bool,
        cancel: &Cancel,
    ) -> Option<FittedStructure> {
        // Beside one that is near the noise, one start is enough; further rounds are for what comes before it.
        let (rival, near) = (standing.explained, !standing.poles.is_empty());
        let most = self.fixed.map_or((SCREENED_MODES.1, MOST_MODES), |n| (n, n));
        let mut known = self.path.steps[self.path.chosen].poles.clone();
        known.splice(0..0, candidate.poles.iter().copied());
        let bound = (BEHIND_NOISES * standing.noise).max(BEHIND * standing.error.min(self.linear_error()));
        let (mut done, mut explains) = (false, false);
        let mut got: Option<(FollowedForce, Unseen)> = None;
        let mut starts = if rival { vec![StartKind::Plain] } else { StartKind::ALL.to_vec() };
        for round in 0..if rival { 1 } else { ROUNDS } {
            let task = LinearTask::new(&self.split.fitted, &self.measurement.sensors, Some(&candidate.fitted), 1);
            let fit = if round == 0 && near {
                // Beside one that explains the data it must have what that one has, and no more.
                task.refine(&standing.poles, RIVAL_STEPS, cancel)?
            } else {
                let path = if round == 0 {
                    screen.start_path(&candidate, &known, most, cancel)?
                } else {
                    let along = if explains { Along::Force } else { Along::Rough };
                    screen.open_path(&candidate, &known, most, along, cancel)?
                };
                let at = if explains && self.fixed.is_none() {
                    self.worth(screen, &candidate, &path)?
                } else {
                    self.start_modes(&candidate, &path, with_more_modes && round == 0, cancel)?
                };
                // Along a force that explains the data, only a mode that it had hidden is worth another fit: one with which less is left.
                let (modes, left) = (path[at].0.poles.len(), path[at].1);
                if done && got.as_ref().is_some_and(|g| modes <= g.0.model.modes() || left >= g.1.error) {
                    break;
                }
                let fit = path.into_iter().nth(at)?.0;
                if explains || !self.chosen.0.is_empty() {
                    fit
                } else {
                    of_light_modes(&task, &fit.poles)?.unwrap_or(fit)
                }
            };
            // In a further round the second kind may be the first one again, which is all there is then.
            let open = OpenFit { task: &task, fit: &fit, candidate: &candidate, again: round > 0 };
            let best_start = self.best_start(&open, &starts, (bound, near), cancel);
            let Some((found, kind)) = best_start else { break };
            // Where the starts part, they do so at first.
            starts = vec![kind];
            let Some(unseen) = self.unseen(&found.model, candidate.parts(), cancel) else { break };
            let (found, unseen) = self.in_finer_steps(found, unseen, cancel);
            candidate.halvings = found.model.halvings;
            let noise = self.noise_in(&unseen.residuals);
            let before = got.as_ref().map(|g| g.1.error);
            done = unseen.error < ENOUGH * noise;
            explains = unseen.error < CLOSE_NOISES * noise;
            let enough = (done && rival)
                || (near && unseen.error > standing.error)
                || unseen.error > self.linear_error().max(NEAR_NOISES * noise)
                || before.is_some_and(|b| unseen.error > if explains { LAST_GAIN } else { ROUND_GAIN } * b);
            let of = found.course.along(&self.measurement.sensors, &self.split.fitted, PARTS);
            let forces =
                if enough { None } else { found.model.simulate(of).map(|s| found.course.records(of, s.forces, 1)) };
            let model = found.model.clone();
            let unseen_forces = unseen.forces.clone();
            if before.is_none_or(|b| unseen.error < b) {
                got = Some((found, unseen));
            }
            // The model's own force lets further modes be seen.
            let Some(forces) = forces else { break };
            if !candidate.goes_along(&model, forces, unseen_forces) {
                break;
            }
            known = model.poles.clone();
        }
        let period = main_period(&self.split.fitted);
        // What stays in range only along the measured motion is no model.
        let (found, unseen) = got?;
        if found.model.inner[0] < candidate.bounds.0 {
            return None;
        }
        let parts = found.model.parts();
        let (found, unseen) = if rival { (found, unseen) } else { self.without_needless(found, unseen, parts, cancel) };
        let unknowns = found.model.shared();
        let residuals = Residuals { fitted: found.residuals, unseen: unseen.residuals, unknowns };
        let densities = residuals.densities(&self.split.intervals(), period);
        let FollowedForce { model, course, .. } = found;
        Some(FittedStructure { candidate, model, course, residuals, densities, error: unseen.error })
    }

    /// The same with steps of the integration halved as long as that matters, where a force is near the data and leaves more than noise: the
    /// path over a step is taken as straight, which few samples a period of the fastest mode make too rough.
    fn in_finer_steps(&self, mut found: FollowedForce, mut unseen: Unseen, cancel: &Cancel) -> (FollowedForce, Unseen) {
        let (sensors, series) = (&self.measurement.sensors, &self.split.fitted);
        while found.model.halvings < MOST_HALVINGS {
            let noise = self.noise_in(&unseen.residuals);
            if !(EXPLAINS * noise..NEAR_NOISES * noise).contains(&unseen.error) {
                break;
            }
            let model = ClosedModel { halvings: found.model.halvings + 1, ..found.model.clone() };
            let of = found.course.along(sensors, series, model.parts());
            let changed = model.simulate(of).map(|run| changed(&found.course.residuals(of, &run), &found.residuals));
            if changed.is_none_or(|change| change < STEP_MATTERS * noise) {
                break;
            }
            let free = if model.initial.is_empty() { Free::Shared } else { Free::All };
            let Some((model, left)) = model.fitted(of, free, WHOLE_STEPS, 1e-3, cancel) else { break };
            let Some(finer) = self.unseen(&model, model.parts(), cancel).filter(|u| u.error < LAST_GAIN * unseen.error)
            else {
                break;
            };
            let residuals = found.course.residuals(of, &left);
            let error = (left.squares / left.samples as f64).sqrt();
            (found, unseen) = (FollowedForce { model, residuals, error, ..found }, finer);
        }
        (found, unseen)
    }

    /// The number of modes (less one) that a closed loop starts with: until the force is right, further modes stand for what it lacks.
    fn start_modes(
        &self,
        candidate: &ForceCandidate,
        path: &[(ModalFit, f64)],
        with_more_modes: bool,
        cancel: &Cancel,
    ) -> Option<usize> {
        if self.fixed.is_some() {
            return Some(path.len() - 1);
        }
        let best = path.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
        let from = path.iter().position(|s| s.1 < ROUGH * best)?;
        if with_more_modes { self.modes_for_stretches(candidate, path, from + 1, cancel) } else { Some(from) }
    }

    /// Of the kinds of start the one that leaves least in closed loop; where one is near the data already or this one explains them, the
    /// first that can be followed.
    fn best_start(
        &self,
        open: &OpenFit<'_>,
        kinds: &[StartKind],
        (bound, near): (f64, bool),
        cancel: &Cancel,
    ) -> Option<(FollowedForce, StartKind)> {
        let OpenFit { task, fit, candidate, again } = *open;
        let across = Screen::across(self.measurement, candidate.site)?;
        let offsets = self.offsets(task, fit);
        let parts = candidate.parts();
        let mut best: Option<(FollowedForce, StartKind)> = None;
        let mut errors = Vec::new();
        let begin = |which: StartKind, turned: bool| {
            let tried = [Some(which), again.then_some(StartKind::Plain)];
            let start = |k| self.start(task, fit, candidate, &across, (k, turned));
            let (start, states) = tried.into_iter().flatten().find_map(start)?;
            Some((self.begun(start, &states, &offsets, parts, cancel)?, states))
        };
        let mut turned = None;
        for which in kinds {
            let mut begun = begin(*which, turned.unwrap_or(false));
            // Which way a force acts is told by short stretches sooner than by responses along a rough force.
            let sure = |b: &BegunFit| b.error < EXPLAINS * b.noise;
            if turned.is_none() && candidate.effect.has_either_sign() && !begun.as_ref().is_some_and(|b| sure(&b.0)) {
                let other = begin(*which, true);
                let better = |o: &BegunFit| begun.as_ref().is_none_or(|b| o.error < b.0.error);
                turned = Some(other.as_ref().is_some_and(|o| better(&o.0)));
                if turned == Some(true) {
                    begun = other;
                }
            }
            let Some((begun, states)) = begun else { continue };
            let found = self.follow(begun, &states, (parts, bound, candidate.bounds.1), &mut errors, cancel);
            let Some(found) = found else { continue };
            let good = found.error < EXPLAINS * self.noise_in(&found.residuals);
            if best.as_ref().is_none_or(|(b, _)| found.error < b.error) {
                best = Some((found, *which));
            }
            if good || near {
                break;
            }
        }
        best
    }

    /// The number of modes (less one) that data never fitted ask for.
    fn worth(&self, screen: &Screen<'_>, candidate: &ForceCandidate, steps: &[(ModalFit, f64)]) -> Option<usize> {
        let (intervals, period) = (self.split.intervals(), main_period(&self.split.fitted));
        let mut best: Option<(usize, f64, Vec<f64>)> = None;
        for (k, (fit, error)) in steps.iter().enumerate() {
            if best.as_ref().is_some_and(|b| *error >= (1.0 - MODE_GAIN) * b.1) {
                continue;
            }
            let densities = screen.left(&candidate.fitted, &candidate.unseen, fit)?.densities(&intervals, period);
            if best.as_ref().is_none_or(|b| beats(&densities, &b.2)) {
                best = Some((k, *error, densities));
            }
        }
        best.map(|b| b.0)
    }

    /// A model that explains the data, without the modes that data never fitted do not ask for: what stood for an error of the force
    /// while that was sought. Those without which the fit leaves least are tried first.
    fn without_needless(
        &self,
        found: FollowedForce,
        unseen: Unseen,
        parts: usize,
        cancel: &Cancel,
    ) -> (FollowedForce, Unseen) {
        let (sensors, series) = (&self.measurement.sensors, &self.split.fitted);
        let (intervals, period) = (self.split.intervals(), main_period(series));
        let densities = |found: &FollowedForce, unseen: &Unseen| {
            let unknowns = found.model.shared();
            Residuals { fitted: found.residuals.clone(), unseen: unseen.residuals.clone(), unknowns }
                .densities(&intervals, period)
        };
        let (most, whole) = ((1.0 + MODE_GAIN) * unseen.error, densities(&found, &unseen));
        let mut best = (found, unseen);
        if self.fixed.is_some() || best.1.error > EXPLAINS * self.noise_in(&best.1.residuals) {
            return best;
        }
        let fitted = |best: &FollowedForce, mode: usize, steps: usize| {
            let mut course = best.course.clone();
            if !course.weights.is_empty() {
                course.weights.remove(mode);
            }
            let model = best.model.without(mode);
            let free = if model.initial.is_empty() { Free::Shared } else { Free::All };
            let (model, left) = model.fitted(course.along(sensors, series, parts), free, steps, 1e-3, cancel)?;
            Some((model, left, course))
        };
        let modes: Vec<usize> = (0..best.0.model.modes()).collect();
        let squares = |mode: usize| Some((mode, fitted(&best.0, mode, LEFT_OUT_STEPS)?.1.squares));
        let mut order: Vec<(usize, f64)> = modes.into_par_iter().filter_map(squares).collect();
        order.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (mut gone, mut kept): (Vec<usize>, usize) = (Vec::new(), 0);
        for (mode, _) in order {
            if kept == LEFT_OUT || best.0.model.modes() == 1 || cancel.is_cancelled() {
                break;
            }
            let at = mode - gone.iter().filter(|g| **g < mode).count();
            let next = fitted(&best.0, at, WHOLE_STEPS).and_then(|(model, left, course)| {
                let unseen = self.unseen(&model, parts, cancel)?;
                let residuals = course.residuals(course.along(sensors, series, parts), &left);
                let error = (left.squares / left.samples as f64).sqrt();
                let found = FollowedForce { residuals, error, model, course };
                let missed = unseen.error > most && beats(&whole, &densities(&found, &unseen));
                (!missed).then_some((found, unseen))
            });
            match next {
                Some(next) => {
                    best = next;
                    gone.push(mode);
                }
                None => kept += 1,
            }
        }
        best
    }
}

/// RMS of the difference of two models' residuals.
fn changed(finer: &[Vec<Vec<f64>>], coarser: &[Vec<Vec<f64>>]) -> f64 {
    let each = finer.iter().flatten().zip(coarser.iter().flatten());
    let differences: Vec<Vec<f64>> = each.map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect()).collect();
    rms(differences.iter())
}

/// An open-loop fit without the poles that are damped as no mode of a structure is: along a rough force they stand for its error, and in
/// closed loop they would move the force. All of them stay where there is no other.
pub(super) fn of_light_modes(task: &LinearTask<'_>, poles: &[Pole]) -> Option<Option<ModalFit>> {
    let light: Vec<Pole> = poles.iter().copied().filter(|p| p.damping < POOL_DAMPING.1).collect();
    if light.is_empty() || light.len() == poles.len() { Some(None) } else { task.fit(&light).map(Some) }
}
