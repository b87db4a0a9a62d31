//! One candidate from its first start to its end.

use super::super::closed::{ClosedModel, Free};
use super::super::identify::main_period;
use super::super::judge::{Residuals, beats, rms};
use super::super::limits::{
    BEHIND, BEHIND_NOISES, CLOSE_NOISES, ENOUGH, EXPLAINS, LAST_GAIN, LEFT_OUT, LEFT_OUT_STEPS, MODE_GAIN,
    MODES_MISSING, MOST_HALVINGS, MOST_MODES, NEAR_NOISES, POOL_DAMPING, RIVAL_STEPS, ROUGH, ROUND_GAIN, ROUNDS,
    SCREENED_MODES, STEP_MATTERS, WHOLE_STEPS, WRONG_COUPLING,
};
use super::super::linear::{LinearTask, ModalFit};
use super::super::motion::PARTS;
use super::super::pole::Pole;
use super::super::screen::{Along, ForceCandidate, Screen};
use super::beginning::{BegunError, BegunFit, States};
use super::candidates::ForceStanding;
use super::following::{FollowedForce, Unseen};
use super::{FittedStructure, ForceSearch};
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::study::Cancel;
use std::collections::VecDeque;

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

/// What is asked of a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    /// How near it comes to the data, unless short stretches leave more than noise with any number of modes.
    First,
    /// The same with more modes than at first.
    MoreModes,
    /// The same however much short stretches leave.
    PutOff,
}

/// A start of a closed loop over short stretches.
struct BegunStart {
    fit: BegunFit,
    states: States,
    kind: StartKind,
}

/// The starts of a candidate, each made when it is asked for.
struct StartQueue<'a> {
    open: OpenFit<'a>,
    kinds: VecDeque<StartKind>,
    /// Whether the force acts the other way, once that was asked.
    turned: Option<bool>,
    /// Those that were made already.
    begun: VecDeque<BegunStart>,
}

impl<'a> StartQueue<'a> {
    fn new(open: OpenFit<'a>, kinds: &[StartKind]) -> Self {
        Self { open, kinds: kinds.iter().copied().collect(), turned: None, begun: VecDeque::new() }
    }
}

/// Where a candidate has come to.
pub(super) enum Landing {
    Fitted(Box<FittedStructure>),
    /// Short stretches leave more than noise already: so many noises.
    PutOff(Box<ForceCandidate>, f64),
    /// It was no better than what stands; with more modes than at first, or not.
    Nowhere {
        richer: bool,
    },
}

/// What short stretches have told of a candidate.
#[derive(Default)]
struct ShortStretches {
    /// The poles with which they leave least and so many noises, where it is put off.
    put_off: Option<(Vec<Pole>, f64)>,
    /// True if they asked for more modes and left no more than noise with them.
    richer: bool,
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
    /// one start. One that is far from the data over short stretches already is put off.
    pub(super) fn closed(
        &self,
        screen: &Screen<'_>,
        candidate: ForceCandidate,
        standing: &ForceStanding,
        asked: Asked,
        cancel: &Cancel,
    ) -> Landing {
        let mut screened = candidate.clone();
        let mut short = ShortStretches::default();
        match (self.landed(screen, candidate, standing, (asked, &mut short), cancel), short.put_off) {
            (Some(fitted), _) => Landing::Fitted(Box::new(fitted)),
            (None, Some((poles, noises))) => {
                screened.start = Some(poles);
                Landing::PutOff(Box::new(screened), noises)
            }
            (None, None) => Landing::Nowhere { richer: short.richer },
        }
    }

    fn landed(
        &self,
        screen: &Screen<'_>,
        mut candidate: ForceCandidate,
        standing: &ForceStanding,
        (asked, short): (Asked, &mut ShortStretches),
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
        let mut way: Option<(usize, Vec<f64>)> = None;
        let mut starts = if rival { vec![StartKind::Plain] } else { StartKind::ALL.to_vec() };
        for round in 0..if rival { 1 } else { ROUNDS } {
            let task = LinearTask::new(&self.split.fitted, &self.measurement.sensors, Some(&candidate.fitted), 1);
            let mut further = None;
            let fit = if round == 0 && near {
                // Beside one that explains the data it must have what that one has, and no more.
                task.refine(&standing.poles, RIVAL_STEPS, cancel)?
            } else if let Some(poles) = candidate.start.take() {
                task.fit(&poles)?
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
                    self.start_modes(&candidate, &path, asked == Asked::MoreModes && round == 0, cancel)?
                };
                // Along a force that explains the data, only a mode that it had hidden is worth another fit: one with which less is left.
                let (modes, left) = (path[at].0.poles.len(), path[at].1);
                if done && got.as_ref().is_some_and(|g| modes <= g.0.model.modes() || left >= g.1.error) {
                    break;
                }
                let mut path = path;
                let after = path.split_off(at + 1);
                further = Some(after);
                let fit = path.pop()?.0;
                if explains || !self.chosen.0.is_empty() {
                    fit
                } else {
                    of_light_modes(&task, &fit.poles)?.unwrap_or(fit)
                }
            };
            // In a further round the second kind may be the first one again, which is all there is then.
            let richer;
            let mut open = OpenFit { task: &task, fit: &fit, candidate: &candidate, again: round > 0 };
            let mut queue = StartQueue::new(open, &starts);
            if (asked == Asked::First || round > 0) && !explains && self.fixed.is_none() {
                // What short stretches leave, a mode is missed for or another force: nothing else has the time to show.
                let Some(left) = self.least_begun(&mut queue, cancel) else { break };
                let most = if near && round == 0 { NEAR_NOISES } else { MODES_MISSING };
                if left.noises() >= most {
                    let path = if round == 0 { further? } else { further.unwrap_or_default() };
                    let more = match self.modes_for_stretches(&candidate, &path, 0, cancel) {
                        Some((at, reached)) => {
                            let more = path.into_iter().nth(at)?.0;
                            Some((of_light_modes(&task, &more.poles)?.unwrap_or(more), reached))
                        }
                        None => None,
                    };
                    match more {
                        Some((more, reached)) if reached.noises() < MODES_MISSING => {
                            short.richer = true;
                            richer = more;
                            open.fit = &richer;
                            queue = StartQueue::new(open, &starts);
                        }
                        Some((more, reached)) if round == 0 && reached.error < left.error => {
                            short.put_off = Some((more.poles, reached.noises()));
                            return None;
                        }
                        _ if round == 0 => {
                            short.put_off = Some((fit.poles, left.noises()));
                            return None;
                        }
                        _ => {}
                    }
                }
            }
            // As many modes that go the way of the round before come to where that came; near the noise its own force is worth the way.
            let modes = queue.open.fit.poles.len();
            let mut errors = way.take().filter(|(k, _)| *k == modes && !explains).map(|w| w.1).unwrap_or_default();
            let best_start = self.best_start(queue, (bound, near), &mut errors, cancel);
            way = Some((modes, errors));
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
        if with_more_modes {
            self.modes_for_stretches(candidate, path, from + 1, cancel).map(|m| m.0)
        } else {
            Some(from)
        }
    }

    /// The next start over short stretches; none where no further one can be made.
    fn next_start(&self, queue: &mut StartQueue<'_>, cancel: &Cancel) -> Option<BegunStart> {
        if let Some(begun) = queue.begun.pop_front() {
            return Some(begun);
        }
        let OpenFit { task, fit, candidate, again } = queue.open;
        let across = Screen::across(self.measurement, candidate.site)?;
        let offsets = self.offsets(task, fit);
        let begin = |kind: StartKind, turned: bool| {
            let tried = [Some(kind), again.then_some(StartKind::Plain)];
            let start = |k| self.start(task, fit, candidate, &across, (k, turned));
            let (start, states) = tried.into_iter().flatten().find_map(start)?;
            let fit = self.begun(start, &states, &offsets, candidate.parts(), cancel)?;
            Some(BegunStart { fit, states, kind })
        };
        while let Some(kind) = queue.kinds.pop_front() {
            let mut begun = begin(kind, queue.turned.unwrap_or(false));
            // Which way a force acts is told by short stretches sooner than by responses along a rough force.
            let sure = |b: &BegunStart| b.fit.error < EXPLAINS * b.fit.noise;
            if queue.turned.is_none() && candidate.effect.has_either_sign() && !begun.as_ref().is_some_and(sure) {
                let other = begin(kind, true);
                let better = |o: &BegunStart| begun.as_ref().is_none_or(|b| o.fit.error < b.fit.error);
                queue.turned = Some(other.as_ref().is_some_and(better));
                if queue.turned == Some(true) {
                    begun = other;
                }
            }
            if begun.is_some() {
                return begun;
            }
        }
        None
    }

    /// The least error over short stretches: of the first start that leaves no more than noise, else of all.
    fn least_begun(&self, queue: &mut StartQueue<'_>, cancel: &Cancel) -> Option<BegunError> {
        let mut begun = VecDeque::new();
        while let Some(start) = self.next_start(queue, cancel) {
            let enough = start.fit.left().noises() < MODES_MISSING;
            begun.push_back(start);
            if enough {
                break;
            }
        }
        queue.begun = begun;
        queue.begun.iter().map(|b| b.fit.left()).min_by(|a, b| a.error.total_cmp(&b.error))
    }

    /// Of several starts the one that leaves least in closed loop; where one is near the data already or this one explains them, the
    /// first that can be followed.
    fn best_start(
        &self,
        mut queue: StartQueue<'_>,
        (bound, near): (f64, bool),
        known: &mut Vec<f64>,
        cancel: &Cancel,
    ) -> Option<(FollowedForce, StartKind)> {
        let candidate = queue.open.candidate;
        let mut best: Option<(FollowedForce, StartKind)> = None;
        while let Some(BegunStart { fit, states, kind }) = self.next_start(&mut queue, cancel) {
            let limits = (candidate.parts(), bound, candidate.bounds.1);
            let Some(found) = self.follow(fit, &states, limits, known, cancel) else { continue };
            let good = found.error < EXPLAINS * self.noise_in(&found.residuals);
            if best.as_ref().is_none_or(|(b, _)| found.error < b.error) {
                best = Some((found, kind));
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
