//! One candidate from its first start to its end.

use super::super::closed::{ClosedModel, Free};
use super::super::identify::main_period;
use super::super::judge::{Residuals, beats, rms};
use super::super::limits::{
    BEHIND, BEHIND_NOISES, CLOSE_NOISES, ENOUGH, EXPLAINS, LAST_GAIN, LEFT_OUT, LEFT_OUT_STEPS, MODE_GAIN,
    MODES_MISSING, MOST_HALVINGS, MOST_MODES, NEAR_NOISES, RIVAL_STEPS, ROUGH, ROUND_GAIN, ROUNDS, SCREENED_MODES,
    STEP_MATTERS, WHOLE_STEPS,
};
use super::super::linear::{LinearTask, ModalFit};
use super::super::motion::PARTS;
use super::super::pole::Pole;
use super::super::screen::{Along, ForceCandidate, Screen};
use super::beginning::{BegunError, BegunFit, StartKind, States, of_light_modes};
use super::following::{FollowedForce, Unseen};
use super::{FittedStructure, ForceSearch};
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::study::Cancel;
use std::collections::VecDeque;
use std::ops::ControlFlow;

/// What the candidates that were fitted before have come to.
#[derive(Clone)]
pub(super) struct ForceStanding {
    /// True if one explains the data.
    pub(super) explained: bool,
    /// Their least error.
    pub(super) error: f64,
    /// The least noise that their residuals show.
    pub(super) noise: f64,
    /// Poles of the one with the least error, where that is near the noise: they are nearer to the structure's than those of a fit
    /// along a force that is rough.
    pub(super) poles: Vec<Pole>,
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

/// What is asked of a candidate beside what others have come to.
#[derive(Clone, Copy)]
pub(super) struct Request<'a> {
    pub(super) standing: &'a ForceStanding,
    pub(super) asked: Asked,
}

impl Request<'_> {
    /// True if a force that was fitted before is near the noise.
    fn is_near(self) -> bool {
        !self.standing.poles.is_empty()
    }
}

/// How far a candidate has come in the rounds before.
struct Way {
    round: usize,
    /// The poles that the next path is sought from.
    known: Vec<Pole>,
    starts: Vec<StartKind>,
    /// The best fit, and what it leaves of the records never fitted.
    got: Option<(FollowedForce, Unseen)>,
    /// The errors with each hold of the round before, and its number of modes.
    errors: Option<(usize, Vec<f64>)>,
    /// True if nothing but noise is left.
    done: bool,
    /// True if little more than noise is left.
    explains: bool,
}

/// What a round starts with.
struct OpenStart {
    fit: ModalFit,
    /// Fits with more modes, where they were made.
    further: Option<Vec<(ModalFit, f64)>>,
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
        request: Request<'_>,
        cancel: &Cancel,
    ) -> Landing {
        let mut screened = candidate.clone();
        let mut short = ShortStretches::default();
        match (self.landed(screen, candidate, request, &mut short, cancel), short.put_off) {
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
        request: Request<'_>,
        short: &mut ShortStretches,
        cancel: &Cancel,
    ) -> Option<FittedStructure> {
        // Beside one that is near the noise, one start is enough; further rounds are for what comes before it.
        let rival = request.standing.explained;
        let mut known = self.path.steps[self.path.chosen].poles.clone();
        known.splice(0..0, candidate.poles.iter().copied());
        let starts = if rival { vec![StartKind::Plain] } else { StartKind::ALL.to_vec() };
        let mut way = Way { round: 0, known, starts, got: None, errors: None, done: false, explains: false };
        for round in 0..if rival { 1 } else { ROUNDS } {
            way.round = round;
            if self.goes_on(screen, &mut candidate, &mut way, request, short, cancel)?.is_break() {
                break;
            }
        }
        // What stays in range only along the measured motion is no model.
        let (found, unseen) = way.got?;
        if found.model.inner[0] < candidate.bounds.0 {
            return None;
        }
        let parts = found.model.parts();
        let (found, unseen) = if rival { (found, unseen) } else { self.without_needless(found, unseen, parts, cancel) };
        let unknowns = found.model.shared();
        let residuals = Residuals { fitted: found.residuals, unseen: unseen.residuals, unknowns };
        let densities = residuals.densities(&self.split.intervals(), main_period(&self.split.fitted));
        let FollowedForce { model, course, .. } = found;
        Some(FittedStructure { candidate, model, course, residuals, densities, error: unseen.error })
    }

    /// A round: fitted in open loop along the force as it is known, then in closed loop. Ends the rounds where a further one is not worth
    /// the time; none where the candidate is given up.
    fn goes_on(
        &self,
        screen: &Screen<'_>,
        candidate: &mut ForceCandidate,
        way: &mut Way,
        request: Request<'_>,
        short: &mut ShortStretches,
        cancel: &Cancel,
    ) -> Option<ControlFlow<()>> {
        let (standing, near) = (request.standing, request.is_near());
        let task = LinearTask::new(&self.split.fitted, &self.measurement.sensors, Some(&candidate.fitted), 1);
        let opened = if way.round == 0 && near {
            // Beside one that explains the data it must have what that one has, and no more.
            Some(OpenStart { fit: task.refine(&standing.poles, RIVAL_STEPS, cancel)?, further: None })
        } else if let Some(poles) = candidate.start.take() {
            Some(OpenStart { fit: task.fit(&poles)?, further: None })
        } else {
            self.opened(screen, &task, candidate, way, request.asked, cancel)?
        };
        let Some(OpenStart { fit, further }) = opened else { return Some(ControlFlow::Break(())) };
        let open = OpenFit { task: &task, fit: &fit, candidate, again: way.round > 0 };
        let mut queue = StartQueue::new(open, &way.starts);
        let mut richer = None;
        if (request.asked == Asked::First || way.round > 0) && !way.explains && self.fixed.is_none() {
            // What short stretches leave, a mode is missed for or another force: nothing else has the time to show.
            let Some(left) = self.least_begun(&mut queue, cancel) else { return Some(ControlFlow::Break(())) };
            let most = if near && way.round == 0 { NEAR_NOISES } else { MODES_MISSING };
            if left.noises() >= most {
                richer = self.richer(open, further, left, short, cancel)?;
            }
        }
        if let Some(richer) = &richer {
            queue = StartQueue::new(OpenFit { fit: richer, ..open }, &way.starts);
        }
        // As many modes that go the way of the round before come to where that came; near the noise its own force is worth the way.
        let modes = queue.open.fit.poles.len();
        let before = way.errors.take().filter(|(k, _)| *k == modes && !way.explains);
        let mut errors = before.map(|way| way.1).unwrap_or_default();
        let bound = (BEHIND_NOISES * standing.noise).max(BEHIND * standing.error.min(self.linear_error()));
        let best_start = self.best_start(queue, (bound, near), &mut errors, cancel);
        way.errors = Some((modes, errors));
        let Some((found, kind)) = best_start else { return Some(ControlFlow::Break(())) };
        // Where the starts part, they do so at first.
        way.starts = vec![kind];
        let unseen = self.unseen(&found.model, candidate.parts(), cancel);
        let Some(unseen) = unseen else { return Some(ControlFlow::Break(())) };
        let (found, unseen) = self.in_finer_steps(found, unseen, cancel);
        candidate.halvings = found.model.halvings;
        let noise = self.noise_in(&unseen.residuals);
        let before = way.got.as_ref().map(|g| g.1.error);
        way.done = unseen.error < ENOUGH * noise;
        way.explains = unseen.error < CLOSE_NOISES * noise;
        let enough = (way.done && standing.explained)
            || (near && unseen.error > standing.error)
            || unseen.error > self.linear_error().max(NEAR_NOISES * noise)
            || before.is_some_and(|b| unseen.error > if way.explains { LAST_GAIN } else { ROUND_GAIN } * b);
        let of = found.course.along(&self.measurement.sensors, &self.split.fitted, PARTS);
        let forces =
            if enough { None } else { found.model.simulate(of).map(|s| found.course.records(of, s.forces, 1)) };
        let model = found.model.clone();
        let unseen_forces = unseen.forces.clone();
        if before.is_none_or(|b| unseen.error < b) {
            way.got = Some((found, unseen));
        }
        // The model's own force lets further modes be seen.
        let further = forces.is_some_and(|forces| candidate.goes_along(&model, forces, unseen_forces));
        way.known = model.poles;
        Some(if further { ControlFlow::Continue(()) } else { ControlFlow::Break(()) })
    }

    /// The open-loop fit on the path of a round, and those on it that have more modes. Of the inner option none where no further round
    /// is worth the time.
    fn opened(
        &self,
        screen: &Screen<'_>,
        task: &LinearTask<'_>,
        candidate: &ForceCandidate,
        way: &Way,
        asked: Asked,
        cancel: &Cancel,
    ) -> Option<Option<OpenStart>> {
        let first = way.round == 0;
        let most = self.fixed.map_or((SCREENED_MODES.1, MOST_MODES), |n| (n, n));
        let mut path = if first {
            screen.start_path(candidate, &way.known, most, cancel)?
        } else {
            let along = if way.explains { Along::Force } else { Along::Rough };
            screen.open_path(candidate, &way.known, most, along, cancel)?
        };
        let at = if way.explains && self.fixed.is_none() {
            self.worth(screen, candidate, &path)?
        } else {
            self.start_modes(candidate, &path, asked == Asked::MoreModes && first, cancel)?
        };
        // Along a force that explains the data, only a mode that it had hidden is worth another fit: one with which less is left.
        let (modes, left) = (path[at].0.poles.len(), path[at].1);
        if way.done && way.got.as_ref().is_some_and(|g| modes <= g.0.model.modes() || left >= g.1.error) {
            return Some(None);
        }
        let further = Some(path.split_off(at + 1));
        let fit = path.pop()?.0;
        let light = if way.explains || !self.chosen.0.is_empty() { None } else { of_light_modes(task, &fit.poles)? };
        Some(Some(OpenStart { fit: light.unwrap_or(fit), further }))
    }

    /// Where short stretches leave more than noise, a fit with more modes with which they do not, if there is one. None where the candidate
    /// is put off for it.
    fn richer(
        &self,
        open: OpenFit<'_>,
        further: Option<Vec<(ModalFit, f64)>>,
        left: BegunError,
        short: &mut ShortStretches,
        cancel: &Cancel,
    ) -> Option<Option<ModalFit>> {
        let path = if open.again { further.unwrap_or_default() } else { further? };
        let mut put_off = (open.fit.poles.clone(), left.noises());
        if let Some((at, reached)) = self.modes_for_stretches(open.candidate, &path, 0, cancel) {
            let more = path.into_iter().nth(at)?.0;
            let more = of_light_modes(open.task, &more.poles)?.unwrap_or(more);
            if reached.noises() < MODES_MISSING {
                short.richer = true;
                return Some(Some(more));
            }
            if reached.error < left.error {
                put_off = (more.poles, reached.noises());
            }
        }
        if open.again {
            return Some(None);
        }
        short.put_off = Some(put_off);
        None
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
