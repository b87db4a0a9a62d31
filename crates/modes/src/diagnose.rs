//! What a linear structure lacks: candidates screened linearly, fitted in closed loop, judged on data never fitted.

use std::borrow::Cow;
use std::collections::VecDeque;

use nalgebra::{Complex, DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::chosen::ChosenPoles;
use super::closed::{ClosedModel, Course, Free, InitialState, Segment};
use super::error::ModesError;
use super::force::{Effect, Site};
use super::identify::{Path, PathRequest, Split, chosen_path, inflation, linear, main_period, path};
use super::judge::{Residuals, beats, compared, rms};
use super::limits::{
    AT_REST, BEGINNING, BEHIND, BEHIND_NOISES, CLOSE_NOISES, ENOUGH, EXPLAINS, FOLLOWED, FORCE_GAIN, HELD_GAIN,
    HELD_SAMPLES, HELD_STEPS, HELD_VALUES, HOLDS, KEPT, LAST_GAIN, LAST_POLE_STEPS, LEAST_ERROR, LEAST_STRETCH,
    LEFT_OUT, LEFT_OUT_STEPS, MATTERS, MODE_GAIN, MODES_MISSING, MORE_MODES, MOST_AGAIN, MOST_CANDIDATES, MOST_JOINTS,
    MOST_OTHERS, NEAR, NEAR_NOISES, NEAR_OTHER_EFFECT, NOTHING_MISSING, OTHER_START, RIVAL_STEPS, ROUGH, ROUND_GAIN,
    ROUNDS, SAME_HOLDS, SAME_WAY, SCREENED_MODES, SHARPER, STATE_STEPS, STRETCH, WHOLE_STEPS, WRONG_COUPLING,
};
use super::linear::{ForceSeries, LinearTask, ModalFit};
use super::measurement::{Measurement, SensorSeries};
use super::motion::PARTS;
use super::outcome::Structure;
use super::pole::{self, Pole};
use super::screen::{Along, ForceCandidate, Screen, SiteKind, deviation};
use super::settings::Base;
use super::start::RecordStart;
use super::study::{in_band, noise_floor, record_fits, structure};
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::signal::standard_deviation;
use sindyscope_core::study::Cancel;
use sindyscope_search::{Found, Lead};
use sindyscope_values::model::Mode;
use sindyscope_values::record::RecordSet;

/// The outcome of a search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StructureDiagnosis {
    /// What it was found of: what tells the records from others, and the base that was asked for.
    of: (String, Base),
    /// The poles of the linear model, fitted to what is not held back to judge.
    poles: Vec<Pole>,
    /// The model with the force.
    model: Option<ClosedModel>,
    /// The linear model.
    pub base: Structure,
    /// The model at the end; its modes are those of the linear part.
    pub last: Structure,
    /// The force that was found.
    pub found: Option<FoundForce>,
    /// True if what is left on data never fitted is noise.
    pub explained: bool,
    /// RMS of what the model leaves on data never fitted over that of the noise, or over half a per cent of the motion where the noise
    /// is less.
    pub noises: f64,
    /// What the linear model and the one at the end leave of the data that neither was fitted to; empty where the rest was kept in a
    /// file: see [`Self::redrawn`].
    #[serde(skip)]
    pub unseen: Vec<UnseenRecord>,
}

/// A record, or the end of the only one, that judged and was never fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct UnseenRecord {
    /// The record's name.
    pub name: String,
    /// Sampling interval, s.
    pub interval: f64,
    /// `measured[sensor][sample]`, in the sensors' units.
    pub measured: Vec<Vec<f64>>,
    /// The same of what the linear model leaves.
    pub before: Vec<Vec<f64>>,
    /// The same of what the model with the force leaves; none where no force was found.
    pub after: Option<Vec<Vec<f64>>>,
}

impl StructureDiagnosis {
    /// The verdict's word: as the search for missing effects has it. A force that leaves much is the best of those tried, and
    /// no name.
    pub fn verdict(&self) -> &'static str {
        match &self.found {
            Some(_) if self.noises >= MATTERS => "unexplained",
            Some(force) if force.rivals.is_empty() => "named",
            Some(_) => "ambiguous",
            None if self.noises < MATTERS => "nothing_missing",
            None => "unexplained",
        }
    }

    /// True if it was found of these records, used in this way, and from this base.
    pub fn is_of(&self, records: &RecordSet, base: &Base) -> bool {
        let (of, asked) = &self.of;
        asked == base && *of == Found::records_of(records)
    }

    /// The same with what its models leave of the data that they were not fitted to, after it was kept in a file: nothing is
    /// searched for.
    ///
    /// # Errors
    /// The records are others, or cancelled.
    pub fn redrawn(&self, records: &RecordSet, cancel: &Cancel) -> Result<Self, ModesError> {
        let measurement = Measurement::new(records, cancel)?;
        let split = Split::new(&measurement);
        let path = chosen_path(&measurement, &split, &self.poles, 0, cancel)?;
        let noise = noise(&split);
        let chosen = ChosenPoles(&[]);
        let search = ForceSearch { measurement: &measurement, split: &split, path: &path, chosen, fixed: None, noise };
        let after = self.model.as_ref().and_then(|model| search.unseen(model, model.parts(), cancel));
        if cancel.is_cancelled() {
            return Err(ModesError::Cancelled);
        }
        let before = &path.steps[path.chosen].residuals.unseen;
        let unseen = unseen_records(&measurement, &split, before, after.as_ref().map(|a| a.residuals.as_slice()));
        Ok(Self { unseen, ..self.clone() })
    }
}

/// A force beside the linear structure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundForce {
    /// Its kind.
    pub effect: Effect,
    /// Where it acts.
    pub site: Site,
    /// Its parameters.
    pub parameters: Vec<ForceParameter>,
    /// What it drives each mode with, for a unit of the force's shape.
    pub drives: Vec<f64>,
    /// How far it leads its nearest rival.
    pub lead: Lead,
    /// Others that these data do not tell from it.
    pub rivals: Vec<(Effect, Site)>,
    /// What was tried beside it, with the RMS that each leaves on data never fitted, as a share of the sensors' RMS.
    pub tried: Vec<(Effect, Site, f64)>,
}

/// A parameter of a force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForceParameter {
    /// Its symbol.
    pub name: Cow<'static, str>,
    /// Its value; a force is told as the acceleration that it makes at its place.
    pub value: f64,
    /// Its standard error; none where it is not known.
    pub std_error: Option<f64>,
    /// Its unit.
    pub unit: String,
}

/// What the candidates that were fitted before have come to.
#[derive(Clone)]
struct ForceStanding {
    /// True if one explains the data.
    explained: bool,
    /// Their least error.
    error: f64,
    /// The least noise that their residuals show.
    noise: f64,
    /// Poles of the one with the least error, where that is near the noise: they are nearer to the structure's than those of a fit
    /// along a force that is rough.
    poles: Vec<Pole>,
}

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

/// A candidate fitted to its end.
struct FittedStructure {
    candidate: ForceCandidate,
    model: ClosedModel,
    course: Course,
    residuals: Residuals,
    densities: Vec<f64>,
    error: f64,
}

/// Searches for the force that a linear structure lacks.
///
/// `base` says how many modes the structure has, or from which poles they are fitted: then each stands for one mode, which the force
/// may move, and none is added. `report` hears what is done and its share.
///
/// # Errors
/// As [`super::identify`].
pub fn diagnose(
    records: &RecordSet,
    base: &Base,
    report: &(dyn Fn(&'static str, f64) + Sync),
    cancel: &Cancel,
) -> Result<StructureDiagnosis, ModesError> {
    let measurement = Measurement::new(records, cancel)?;
    let split = Split::new(&measurement);
    report("looking for modes", 0.0);
    let (path, fixed) = if base.poles.is_empty() {
        let request = PathRequest { modes: base.modes, ..PathRequest::default() };
        (path(&measurement, &split, &request, cancel)?, base.modes)
    } else {
        (chosen_path(&measurement, &split, &base.poles, LAST_POLE_STEPS, cancel)?, Some(base.poles.len()))
    };
    let chosen = ChosenPoles(&base.poles);
    let start = if base.poles.is_empty() { &path.steps[path.chosen].poles } else { &base.poles };
    let linear = linear(&measurement, start, cancel)?;
    let linear_error = path.steps[path.chosen].residuals.unseen_rms();
    let noise = noise(&split);
    let of = (Found::records_of(records), base.clone());
    let poles = path.steps[path.chosen].poles.clone();
    let before = &path.steps[path.chosen].residuals.unseen;
    let plain = |explained: bool| StructureDiagnosis {
        of: of.clone(),
        poles: poles.clone(),
        model: None,
        base: structure(&measurement, &linear),
        last: structure(&measurement, &linear),
        found: None,
        explained,
        noises: linear_error / noise,
        unseen: unseen_records(&measurement, &split, before, None),
    };
    if linear_error < NOTHING_MISSING * noise {
        return Ok(plain(true));
    }
    let search = ForceSearch { measurement: &measurement, split: &split, path: &path, chosen, fixed, noise };
    report("asking which force is missing", 0.05);
    let fitted = search.fitted(report, cancel)?;
    let period = main_period(&split.fitted);
    let chosen = search.chosen(fitted, period);
    let Some((best, lead, rivals, tried)) = chosen else { return Ok(plain(false)) };
    let (error, noise) = (best.error, search.noise_in(&best.residuals.unseen));
    let unseen = unseen_records(&measurement, &split, before, Some(&best.residuals.unseen));
    let model = Some(best.model.clone());
    let (last, found) = search.told(best, lead, rivals, tried);
    Ok(StructureDiagnosis {
        base: structure(&measurement, &linear),
        of,
        poles,
        model,
        last,
        found: Some(found),
        explained: error < EXPLAINS * noise,
        noises: error / noise,
        unseen,
    })
}

/// What two models leave of the data that neither was fitted to, in the sensors' units.
fn unseen_records(
    measurement: &Measurement,
    split: &Split,
    before: &[Vec<Vec<f64>>],
    after: Option<&[Vec<Vec<f64>>]>,
) -> Vec<UnseenRecord> {
    let scaled = |all: &[Vec<f64>]| -> Vec<Vec<f64>> {
        all.iter().zip(&measurement.sensors).map(|(s, sensor)| s.iter().map(|v| v * sensor.scale).collect()).collect()
    };
    let of = |(k, series): (usize, &SensorSeries)| UnseenRecord {
        name: series.name.clone(),
        interval: series.interval,
        measured: scaled(&series.outputs),
        before: scaled(&before[k]),
        after: after.map(|a| scaled(&a[k])),
    };
    split.unseen.iter().enumerate().map(of).collect()
}

/// RMS of the noise over all sensors of the records never fitted, in units of the sensors' RMS.
fn noise(split: &Split) -> f64 {
    noise_of(split.unseen.iter().flat_map(|s| &s.outputs))
}

/// RMS of the noise over several series.
fn noise_of<'a>(series: impl Iterator<Item = &'a Vec<f64>>) -> f64 {
    let all: Vec<f64> = series.filter_map(|y| standard_deviation(y)).collect();
    (all.iter().map(|n| n * n).sum::<f64>() / all.len().max(1) as f64).sqrt().max(LEAST_ERROR)
}

struct ForceSearch<'a> {
    measurement: &'a Measurement,
    split: &'a Split,
    path: &'a Path,
    /// The poles that were chosen by hand.
    chosen: ChosenPoles<'a>,
    fixed: Option<usize>,
    noise: f64,
}

/// The states along the fitted records as an open-loop fit has them.
struct States {
    /// `modes[record][mode][sample]`
    modes: Vec<Vec<Vec<Complex<f64>>>>,
    /// The force's inner state, `memory[record][sample]`; empty where it has none.
    memory: Vec<Vec<f64>>,
}

impl States {
    fn at(&self, record: usize, sample: usize) -> InitialState {
        let memory = self.memory.get(record).map_or(0.0, |m| m[sample]);
        InitialState { modes: self.modes[record].iter().map(|m| m[sample]).collect(), memory }
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

/// How a closed loop starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum StartKind {
    /// As the open-loop fit has it.
    Plain,
    /// With the force as large as the motion of its own states asks for.
    Matched,
}

impl StartKind {
    const ALL: [Self; 2] = [Self::Plain, Self::Matched];

    /// What is left of a coupling by which the force would push a mode the wrong way.
    fn wrong_coupling(self) -> f64 {
        WRONG_COUPLING[self as usize]
    }
}

/// A model fitted in closed loop.
struct FollowedForce {
    model: ClosedModel,
    course: Course,
    residuals: Vec<Vec<Vec<f64>>>,
    /// RMS that is left, jumps counted.
    error: f64,
}

/// A fit over short stretches.
struct BegunFit {
    model: ClosedModel,
    course: Course,
    /// The states at the records' beginnings; none where these are at rest.
    whole_initial: Vec<InitialState>,
    /// RMS that is left, jumps counted, and the noise in it.
    error: f64,
    noise: f64,
}

/// What is left of the records never fitted, and the force on the fine grid.
struct Unseen {
    residuals: Vec<Vec<Vec<f64>>>,
    forces: Vec<Vec<f64>>,
    error: f64,
}

/// A model with a force as plain values, the slowest mode first.
struct ToldModel {
    modes: Vec<Mode>,
    participation: Vec<Vec<f64>>,
    drives: Vec<f64>,
    parameters: Vec<ForceParameter>,
    starts: Vec<RecordStart>,
}

type ChosenForce = (FittedStructure, Lead, Vec<(Effect, Site)>, Vec<(Effect, Site, f64)>);

impl ForceSearch<'_> {
    fn linear_error(&self) -> f64 {
        self.path.steps[self.path.chosen].residuals.unseen_rms()
    }

    fn fitted(
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
        let mut nearest = Nearest { plain: f64::INFINITY, any: f64::INFINITY };
        // Where a force to the ground explains the data, none between sensors is asked for.
        for (reach, from, to) in [(SiteKind::Ground, 0.05, 0.6), (SiteKind::Pairs, 0.6, 1.0)] {
            if all.iter().any(explains) {
                break;
            }
            let screened = |share| report("asking which force is missing", from + 0.4 * (to - from) * share);
            let candidates = screen.candidates(reach, &screened, cancel);
            nearest.see(&candidates);
            let mut chosen = VecDeque::from(self.promising(&candidates, &all, nearest));
            let mut others = self.others(&candidates, chosen.make_contiguous());
            let (near, mut count) = (chosen.len(), 0);
            let again: Vec<ForceCandidate> =
                chosen.iter().chain(&others).filter(|c| !c.effect.has_memory()).take(MOST_AGAIN).cloned().collect();
            while let Some(candidate) = chosen.pop_front().or_else(|| self.next_other(&mut others, &all)) {
                let share = f64::from(count) / (near + MOST_OTHERS) as f64;
                report("fitting the force", from + (to - from) * (0.4 + 0.6 * share));
                count += 1;
                // Where one explains the data, those that are far from it need no fit.
                if all.iter().any(explains) && candidate.error > NEAR * nearest.to(candidate.effect) {
                    continue;
                }
                all.extend(self.closed(&screen, candidate, &self.standing(&all), false, cancel));
                if cancel.is_cancelled() {
                    return Err(ModesError::Cancelled);
                }
                // Where none of the near ones explains the data, the next ones are asked for.
                if count as usize >= near + MOST_OTHERS || (chosen.is_empty() && all.iter().any(explains)) {
                    break;
                }
            }
            // Where none did, modes may be hidden that the first ones were fitted without.
            for candidate in again {
                let standing = self.standing(&all);
                if standing.explained || !standing.poles.is_empty() {
                    break;
                }
                if let Some(fitted) = self.closed(&screen, candidate, &standing, true, cancel) {
                    keep_better(&mut all, fitted);
                }
            }
            if cancel.is_cancelled() {
                return Err(ModesError::Cancelled);
            }
        }
        // What was fitted before a mode was found that its force had hidden gets that mode too.
        let standing = self.standing(&all);
        if standing.explained {
            let poorer = |f: &&FittedStructure| f.model.modes() < standing.poles.len() && !self.explains(f);
            let again: Vec<ForceCandidate> = all.iter().filter(poorer).map(|f| f.candidate.clone()).collect();
            for candidate in again {
                if let Some(fitted) = self.closed(&screen, candidate, &standing, false, cancel) {
                    keep_better(&mut all, fitted);
                }
            }
        }
        Ok(all)
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
        for c in candidates.iter().filter(|c| !c.effect.has_memory() && c.error < FORCE_GAIN * self.linear_error()) {
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
        let at = others.iter().position(|c| Some(c.site) == best).unwrap_or(0);
        (!others.is_empty()).then(|| others.remove(at))
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
        // Before one that contains another stands that other, which it must beat.
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

    /// A candidate fitted in open loop, then in closed loop from several starts; a rival of one that explains the data gets
    /// one start.
    fn closed(
        &self,
        screen: &Screen<'_>,
        mut candidate: ForceCandidate,
        standing: &ForceStanding,
        with_more_modes: bool,
        cancel: &Cancel,
    ) -> Option<FittedStructure> {
        // Beside one that is near the noise, one start is enough; further rounds are for what comes before it.
        let (rival, near) = (standing.explained, !standing.poles.is_empty());
        let most = self.fixed.unwrap_or(SCREENED_MODES.1);
        let parts = candidate.effect.parts();
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
                // Along a force that explains the data, only a mode that it had hidden is worth another fit.
                if done && got.as_ref().is_some_and(|g| path[at].0.poles.len() <= g.0.model.modes()) {
                    break;
                }
                path.into_iter().nth(at)?.0
            };
            // In a further round the second kind may be the first one again, which is all there is then.
            let open = OpenFit { task: &task, fit: &fit, candidate: &candidate, again: round > 0 };
            let best_start = self.best_start(&open, &starts, (bound, near), cancel);
            let Some((found, kind)) = best_start else { break };
            // Where the starts part, they do so at first.
            starts = vec![kind];
            let Some(unseen) = self.unseen(&found.model, parts, cancel) else { break };
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
        let (found, unseen) = if rival { (found, unseen) } else { self.without_needless(found, unseen, parts, cancel) };
        let unknowns = found.model.shared();
        let residuals = Residuals { fitted: found.residuals, unseen: unseen.residuals, unknowns };
        let densities = residuals.densities(&self.split.intervals(), period);
        let FollowedForce { model, course, .. } = found;
        Some(FittedStructure { candidate, model, course, residuals, densities, error: unseen.error })
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
        let parts = candidate.effect.parts();
        let mut best: Option<(FollowedForce, StartKind)> = None;
        let mut errors = Vec::new();
        for which in kinds {
            let tried = [Some(*which), again.then_some(StartKind::Plain)];
            let first = tried.into_iter().flatten().find_map(|k| self.start(task, fit, candidate, &across, k));
            let Some((start, states)) = first else { continue };
            let found = self
                .begun(start, &states, &offsets, parts, cancel)
                .and_then(|begun| self.follow(begun, &states, (parts, bound, candidate.bounds.1), &mut errors, cancel));
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

    /// A closed-loop model from an open-loop fit, and the states that the fit has. The responses of each mode to inputs and
    /// force are made one shape, as reciprocity asks. None where a start would be the first one again.
    fn start(
        &self,
        task: &LinearTask<'_>,
        fit: &ModalFit,
        candidate: &ForceCandidate,
        across: &[f64],
        which: StartKind,
    ) -> Option<(ClosedModel, States)> {
        let (sensors, inputs) = (self.measurement.sensors.len(), self.measurement.inputs.len());
        let residue = |mode: usize| {
            let omega: f64 = fit.poles[mode].omega;
            DMatrix::from_fn(sensors, inputs + 1, |s, j| {
                let power = 2 - self.measurement.sensors[s].quantity.derivatives();
                task.amplitude(fit, s, mode, j) * omega.powi(power)
            })
        };
        let split = |mode: usize| -> Option<(DVector<f64>, DVector<f64>)> {
            let svd = residue(mode).svd(true, true);
            let (u, v) = (svd.u?, svd.v_t?);
            Some((u.column(0).into_owned(), v.row(0).transpose() * svd.singular_values[0]))
        };
        let parts: Vec<(DVector<f64>, DVector<f64>)> = (0..fit.poles.len())
            .map(|i| split(i).unwrap_or_else(|| (DVector::zeros(sensors), DVector::zeros(inputs + 1))))
            .collect();
        let moved = |u: &DVector<f64>| across.iter().zip(u.iter()).map(|(e, u)| e * u).sum::<f64>();
        let weight: f64 = parts.iter().map(|(u, v)| -v[inputs] * moved(u)).sum();
        let sign = if weight < 0.0 && candidate.effect.has_either_sign() { -1.0 } else { 1.0 };
        let mut drive = Vec::new();
        let (mut shape, mut forced) = (Vec::new(), Vec::new());
        let mut restoring = true;
        for (u, v) in &parts {
            let reach = moved(u);
            let square = -v[inputs] * sign / reach;
            let share = if square > 0.0 { 1.0 } else { which.wrong_coupling() };
            let size = share * square.abs().sqrt();
            restoring &= square > 0.0;
            let size = if size.is_finite() && size > 0.0 { size } else { 1.0 };
            shape.push(u.iter().map(|u| u * size).collect());
            drive.push((0..inputs).map(|j| v[j] / size).collect());
            forced.push(v[inputs] / size);
        }
        let mut inner = candidate.inner;
        if candidate.effect == Effect::CoulombFriction {
            inner[0] *= SHARPER;
        }
        let mut model = ClosedModel {
            effect: candidate.effect,
            across: across.to_vec(),
            sign,
            unit: candidate.unit,
            inner,
            poles: fit.poles.clone(),
            drive,
            shape,
            initial: Vec::new(),
        };
        let free = self.initial(task, fit, &model);
        let states = (0..self.split.fitted.len()).map(|r| {
            let series = &self.split.fitted[r];
            let along = |i: usize| {
                let lambda = fit.poles[i].eigenvalue();
                let mut sum = vec![Complex::new(0.0, 0.0); series.len()];
                let mut one = sum.clone();
                let mut add = |one: &[Complex<f64>], size: f64| {
                    sum.iter_mut().zip(one).for_each(|(s, z)| *s += z * size);
                };
                for (j, input) in series.inputs.iter().enumerate() {
                    pole::response(lambda, series.interval, &pole::padded(input), &mut one);
                    add(&one, model.drive[i][j]);
                }
                let force = &candidate.fitted;
                pole::response_fine(lambda, series.interval, &force.values[r], force.parts, &mut one);
                add(&one, forced[i]);
                let mut own = free[r].modes[i];
                let decay = (lambda * series.interval).exp();
                for z in &mut sum {
                    *z += own;
                    own *= decay;
                }
                sum
            };
            (0..fit.poles.len()).map(along).collect::<Vec<_>>()
        });
        let memory = |values: &Vec<f64>| -> Vec<f64> {
            values.iter().step_by(candidate.fitted.parts).map(|f| f * candidate.unit).collect()
        };
        let memory = candidate.effect.has_memory().then(|| candidate.fitted.values.iter().map(memory).collect());
        let mut states = States { modes: states.collect(), memory: memory.unwrap_or_default() };
        if which == StartKind::Matched && !matched(&mut model, &mut states, &candidate.fitted) && restoring {
            return None;
        }
        if !self.at_rest(task, fit) {
            model.initial = (0..free.len()).map(|r| states.at(r, 0)).collect();
        }
        Some((model, states))
    }

    /// The initial states that the free oscillations of an open-loop fit tell.
    fn initial(&self, task: &LinearTask<'_>, fit: &ModalFit, model: &ClosedModel) -> Vec<InitialState> {
        let sensors = &self.measurement.sensors;
        let of = |record: usize, mode: usize| {
            let lambda = fit.poles[mode].eigenvalue();
            let (mut sum, mut power) = (Complex::new(0.0, 0.0), 0.0);
            for (s, sensor) in sensors.iter().enumerate() {
                let [re, im] = task.free(fit, s, mode, record);
                let own = lambda.powi(sensor.quantity.derivatives()) * (model.shape[mode][s] / lambda.im);
                sum += Complex::new(re, -im) * Complex::new(0.0, 1.0) * own.conj();
                power += own.norm_sqr();
            }
            sum / power.max(1e-300)
        };
        let modes = |r: usize| (0..fit.poles.len()).map(|i| of(r, i)).collect();
        (0..self.split.fitted.len()).map(|r| InitialState { modes: modes(r), memory: 0.0 }).collect()
    }

    /// True if all records start at rest: none has free oscillations worth the name.
    fn at_rest(&self, task: &LinearTask<'_>, fit: &ModalFit) -> bool {
        if self.measurement.inputs.is_empty() {
            return false;
        }
        let mut largest = 0.0_f64;
        for (r, series) in self.split.fitted.iter().enumerate() {
            for (s, output) in series.outputs.iter().enumerate() {
                let size = deviation(output);
                for i in 0..fit.poles.len() {
                    let [re, im] = task.free(fit, s, i, r);
                    // The RMS of the decay over the record.
                    let lasts =
                        (0.5 / (fit.poles[i].damping * fit.poles[i].omega)).min(series.len() as f64 * series.interval);
                    let share = (lasts / (series.len() as f64 * series.interval)).sqrt();
                    largest = largest.max(re.hypot(im) / size * share);
                }
            }
        }
        largest <= AT_REST
    }

    /// The noise that a residual shows, where it is less than that of the raw series: a force that switches looks like noise there.
    fn noise_in(&self, residuals: &[Vec<Vec<f64>>]) -> f64 {
        noise_of(residuals.iter().flatten()).min(self.noise)
    }

    /// A fit over short stretches that are hardly held together.
    fn begun(
        &self,
        start: ClosedModel,
        states: &States,
        offsets: &[Vec<f64>],
        parts: usize,
        cancel: &Cancel,
    ) -> Option<BegunFit> {
        let (sensors, series) = (&self.measurement.sensors, &self.split.fitted);
        let whole_initial = start.initial.clone();
        let total: usize = series.iter().map(SensorSeries::len).sum();
        let samples = HELD_SAMPLES.min(HELD_VALUES / sensors.len() as f64);
        let segments = stretches(series, self.stretch(&start), samples / total as f64);
        let mut model = start;
        model.initial = segments.iter().map(|s| states.at(s.record, s.start)).collect();
        let rest = whole_initial.is_empty();
        let mut course = Course { segments, weights: Vec::new(), rest, offsets: offsets.to_vec() };
        model = model.eased(course.along(sensors, series, parts), STATE_STEPS, 1e-2, cancel);
        course.weights = held(&model, HOLDS[0]);
        let of = course.along(sensors, series, parts);
        let (model, left) = model.fitted(of, Free::All, HELD_STEPS, HELD_GAIN, cancel)?;
        let error = (left.squares / left.samples as f64).sqrt();
        let residuals = course.residuals(of, &left);
        let noise = self.noise_in(&residuals);
        Some(BegunFit { model, course, whole_initial, error, noise })
    }

    /// The number of modes (less one), from a number on, with which stretches that are hardly held together leave no more than noise.
    /// Whatever a force lacks, it lacks over a longer time: what such short stretches leave is what modes are missing for.
    fn modes_for_stretches(
        &self,
        candidate: &ForceCandidate,
        steps: &[(ModalFit, f64)],
        from: usize,
        cancel: &Cancel,
    ) -> Option<usize> {
        let enough = |(fit, _): &(ModalFit, f64)| {
            let begun = self.first_start(candidate, fit, StartKind::Plain, cancel);
            begun.is_some_and(|b| b.error < MODES_MISSING * b.noise)
        };
        steps.iter().skip(from).take(MORE_MODES).position(enough).map(|more| from + more)
    }

    fn first_start(
        &self,
        candidate: &ForceCandidate,
        fit: &ModalFit,
        kind: StartKind,
        cancel: &Cancel,
    ) -> Option<BegunFit> {
        let task = LinearTask::new(&self.split.fitted, &self.measurement.sensors, Some(&candidate.fitted), 1);
        let across = Screen::across(self.measurement, candidate.site)?;
        let (start, states) = self.start(&task, fit, candidate, &across, kind)?;
        self.begun(start, &states, &self.offsets(&task, fit), candidate.effect.parts(), cancel)
    }

    fn offsets(&self, task: &LinearTask<'_>, fit: &ModalFit) -> Vec<Vec<f64>> {
        let sensors = 0..self.measurement.sensors.len();
        (0..self.split.fitted.len()).map(|r| sensors.clone().map(|s| task.offset(fit, s, r)).collect()).collect()
    }

    /// Goes on from short stretches to ones that are held together ever more, then over whole records; where these cannot be followed,
    /// because small differences grow, the stretches stay. None where the error over stretches exceeds the bound, or what
    /// is inside the force exceeds `most_inner`.
    fn follow(
        &self,
        begun: BegunFit,
        states: &States,
        (parts, bound, most_inner): (usize, f64, f64),
        known: &mut Vec<f64>,
        cancel: &Cancel,
    ) -> Option<FollowedForce> {
        let (sensors, series) = (&self.measurement.sensors, &self.split.fitted);
        let BegunFit { mut model, mut course, whole_initial, mut error, .. } = begun;
        let (rest, offsets) = (whole_initial.is_empty(), course.offsets.clone());
        let whole =
            Course { segments: Segment::whole(series, 1.0), weights: Vec::new(), rest, offsets: offsets.clone() };
        let mut errors = Vec::new();
        for hold in HOLDS {
            if hold > HOLDS[0] {
                course.weights = held(&model, hold);
                let of = course.along(sensors, series, parts);
                let (found, left) = model.fitted(of, Free::All, HELD_STEPS, HELD_GAIN, cancel)?;
                model = found;
                error = (left.squares / left.samples as f64).sqrt();
            }
            // At first a start may still be far from where it goes.
            let bound = if errors.len() + 1 < SAME_HOLDS { 2.0 * bound } else { bound };
            if error > bound || model.inner[0] > most_inner {
                return None;
            }
            errors.push(error);
            // From here on another start goes the same way.
            let as_before = known.get(errors.len() - 1).is_some_and(|k| (error / k - 1.0).abs() < SAME_WAY);
            if as_before && errors.len() >= SAME_HOLDS {
                return None;
            }
            // Where whole records can be followed from here, nothing needs to be held.
            if rest && hold > HOLDS[0] {
                let run =
                    ClosedModel { initial: Vec::new(), ..model.clone() }.simulate(whole.along(sensors, series, parts));
                if run.is_some_and(|r| rms(r.residuals.iter().flatten()) < FOLLOWED * error) {
                    break;
                }
            }
        }
        *known = errors;
        let mut free_run = model.clone();
        free_run.initial = whole_initial;
        for (r, initial) in free_run.initial.iter_mut().enumerate() {
            if let Some(k) = course.segments.iter().position(|s| (s.record, s.start) == (r, 0)) {
                initial.clone_from(&model.initial[k]);
            }
        }
        let free = if rest { Free::Shared } else { Free::All };
        let of = whole.along(sensors, series, parts);
        if let Some((found, left)) = free_run.fitted(of, free, WHOLE_STEPS, 1e-3, cancel) {
            let own = (left.squares / left.samples as f64).sqrt();
            if own < KEPT * error {
                return Some(FollowedForce {
                    residuals: whole.residuals(of, &left),
                    error: own,
                    model: found,
                    course: whole,
                });
            }
        }
        let state = |r: usize| {
            let first = course.segments.iter().position(|s| (s.record, s.start) == (r, 0));
            first.map_or_else(|| states.at(r, 0), |k| model.initial[k].clone())
        };
        let starts = (0..series.len()).map(state).collect();
        let (model, course) = self.shadowed(&model, starts, (series, &offsets, rest), parts, cancel)?;
        let of = course.along(sensors, series, parts);
        let left = model.simulate(of)?;
        let error = (left.squares / left.samples as f64).sqrt();
        Some(FollowedForce { residuals: course.residuals(of, &left), error, model, course })
    }

    /// The motion that a model allows, but for the smallest jumps between stretches, and that follows the data best; `starts`
    /// are the states at the records' beginnings.
    fn shadowed(
        &self,
        model: &ClosedModel,
        starts: Vec<InitialState>,
        (series, offsets, rest): (&[SensorSeries], &[Vec<f64>], bool),
        parts: usize,
        cancel: &Cancel,
    ) -> Option<(ClosedModel, Course)> {
        let sensors = &self.measurement.sensors;
        let segments = stretches(series, self.stretch(model), 1.0);
        let mut model = model.clone();
        model.initial = segments.iter().map(|s| starts[s.record].clone()).collect();
        let mut course = Course { segments, weights: Vec::new(), rest, offsets: offsets.to_vec() };
        model = model.swept(course.along(sensors, series, parts), STATE_STEPS, cancel);
        for hold in HOLDS {
            course.weights = held(&model, hold);
            let of = course.along(sensors, series, parts);
            model = model.fitted(of, Free::Initial, HELD_STEPS, HELD_GAIN, cancel)?.0;
        }
        Some((model, course))
    }

    /// Samples of a stretch.
    fn stretch(&self, model: &ClosedModel) -> f64 {
        (STRETCH * 2.0 * model.modes() as f64 / self.measurement.sensors.len() as f64).max(LEAST_STRETCH)
    }

    /// What a model leaves on the records never fitted, from initial states fitted to them.
    fn unseen(&self, model: &ClosedModel, parts: usize, cancel: &Cancel) -> Option<Unseen> {
        let (sensors, series) = (&self.measurement.sensors, &self.split.unseen);
        let offsets: Vec<Vec<f64>> = series.iter().map(|s| vec![0.0; s.outputs.len()]).collect();
        let [begin, whole] = [BEGINNING, 1.0].map(|share| Course {
            segments: Segment::whole(series, share),
            weights: Vec::new(),
            rest: false,
            offsets: offsets.clone(),
        });
        let told = |model: &ClosedModel, course: &Course| -> Option<Unseen> {
            let of = course.along(sensors, series, parts);
            let left = model.simulate(of)?;
            let fine = course.along(sensors, series, PARTS);
            let forces = course.records(fine, model.simulate(fine)?.forces, 1);
            let error = (left.squares / left.samples as f64).sqrt();
            Some(Unseen { residuals: course.residuals(of, &left), forces, error })
        };
        let mut model = model.clone();
        model.initial = vec![InitialState::rest(model.modes()); series.len()];
        let at_start = model.fitted(begin.along(sensors, series, parts), Free::Initial, 6, 1e-4, cancel)?.0;
        let run = at_start.fitted(whole.along(sensors, series, parts), Free::Initial, 3, 1e-4, cancel);
        let free = run.and_then(|(m, _)| told(&m, &whole));
        if free.as_ref().is_some_and(|f| f.error < EXPLAINS * self.noise_in(&f.residuals)) {
            return free;
        }
        // Where small differences grow, a motion that the model allows, but for the smallest jumps, may still follow the data.
        let starts = at_start.initial.clone();
        let found = self.shadowed(&at_start, starts, (series, &offsets, false), parts, cancel);
        let Some((model, shadow)) = found else { return free };
        let shadowed = told(&model, &shadow);
        match (free, shadowed) {
            (Some(free), Some(shadowed)) if free.error <= shadowed.error => Some(free),
            (free, shadowed) => shadowed.or(free),
        }
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

    /// The effect that stands, with its lead over the nearest rival, those that it does not beat, and all that were tried.
    fn chosen(&self, mut fitted: Vec<FittedStructure>, period: f64) -> Option<ChosenForce> {
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

    /// The model at the end as plain values.
    fn told(
        &self,
        best: FittedStructure,
        lead: Lead,
        rivals: Vec<(Effect, Site)>,
        tried: Vec<(Effect, Site, f64)>,
    ) -> (Structure, FoundForce) {
        let FittedStructure { candidate, model, course, residuals, .. } = best;
        let sensors = &self.measurement.sensors;
        let unit = force_unit(self.measurement, candidate.site);
        let ToldModel { modes, participation, drives, parameters, starts } =
            self.told_closed(&model, &course, &residuals, &unit);
        let structure = Structure {
            sensors: sensors.clone(),
            inputs: self.measurement.inputs.clone(),
            in_band: in_band(self.measurement, &modes),
            modes,
            participation,
            noise_floor: noise_floor(self.measurement),
            records: record_fits(self.measurement, self.split, &residuals, &starts),
        };
        let found =
            FoundForce { effect: candidate.effect, site: candidate.site, parameters, drives, lead, rivals, tried };
        (structure, found)
    }

    fn told_closed(&self, model: &ClosedModel, course: &Course, residuals: &Residuals, unit: &str) -> ToldModel {
        let (sensors, inputs) = (&self.measurement.sensors, &self.measurement.inputs);
        let parts = model.parts();
        let of = course.along(sensors, &self.split.fitted, parts);
        let count = residuals.fitted.iter().flatten().count().max(1);
        let inflated = residuals.fitted.iter().flatten().map(|r| inflation(r)).sum::<f64>() / count as f64;
        let variance = residuals.fitted_rms().powi(2) * inflated;
        let covariance = model.covariance(of);
        let error = |k: usize| {
            let value = covariance.as_ref().map(|c| (c[(k, k)] * variance).sqrt());
            value.filter(|v| v.is_finite() && *v > 0.0)
        };
        let mut order: Vec<usize> = (0..model.modes()).collect();
        order.sort_by(|a, b| model.poles[*a].omega.total_cmp(&model.poles[*b].omega));
        let (mut all, mut participation, mut drives) = (Vec::new(), Vec::new(), Vec::new());
        let mut sizes = Vec::new();
        for &i in &order {
            let shape: Vec<f64> = model.shape[i].iter().zip(sensors).map(|(p, s)| p * s.scale).collect();
            let reference = DVector::from_vec(shape.clone()).iamax();
            let largest = shape[reference];
            let at = model.place_of(i);
            let pole: Pole = model.poles[i];
            let deviation = |s: usize| error(at + 2 + inputs.len() + s).map(|e| e * sensors[s].scale / largest.abs());
            let shape_error = |s: usize| {
                let own = deviation(s)?.hypot(shape[s] / largest * deviation(reference)?);
                (s != reference).then_some(own)
            };
            all.push(Mode {
                frequency: pole.frequency(),
                frequency_error: error(at).map(|e| e * pole.frequency()),
                damping: pole.damping,
                damping_error: error(at + 1).map(|e| e * pole.damping),
                shape: shape.iter().map(|s| s / largest).collect(),
                shape_error: (0..sensors.len()).map(shape_error).collect(),
                phase: vec![0.0; sensors.len()],
            });
            participation.push(inputs.iter().enumerate().map(|(j, u)| model.drive[i][j] * largest / u.scale).collect());
            drives.push(-model.sign * model.coupling(i) * largest / model.unit);
            sizes.push(largest);
        }
        let size = model.sign * (0..model.modes()).map(|i| model.coupling(i).powi(2)).sum::<f64>() / model.unit;
        let size_error = covariance.as_ref().map(|c| {
            // d(Σρ²)/dφₛᵢ = 2 ρᵢ eₛ.
            let mut slope = DVector::zeros(c.nrows());
            for i in 0..model.modes() {
                for (s, e) in model.across.iter().enumerate() {
                    slope[model.place_of(i) + 2 + inputs.len() + s] = 2.0 * model.coupling(i) * e / model.unit;
                }
            }
            (slope.dot(&(c * &slope)) * variance).sqrt()
        });
        let (name, power) = match model.effect {
            Effect::CubicStiffness => ("k_3", 3),
            Effect::CoulombFriction => ("F_c", 0),
            Effect::Clearance => ("k", 1),
            Effect::QuadraticDamping => ("c_2", 2),
            Effect::QuadraticStiffness => ("k_2", 2),
            Effect::BoucWenHysteresis => ("k_h", 1),
        };
        let of_velocity = model.effect == Effect::QuadraticDamping;
        let unit_of = match (power, of_velocity) {
            (0, _) => format!("{unit}/s^2"),
            (1, _) => "1/s^2".to_owned(),
            (_, true) => format!("1/{unit}"),
            (2, _) => format!("1/({unit} s^2)"),
            _ => format!("1/({unit}^2 s^2)"),
        };
        let mut parameters =
            vec![ForceParameter { name: name.into(), value: size, std_error: size_error, unit: unit_of }];
        let inner_names: &[&str] = match model.effect {
            Effect::Clearance => &["gap"],
            Effect::BoucWenHysteresis => &["x_b", "gamma/beta"],
            _ => &[],
        };
        for (k, name) in inner_names.iter().enumerate() {
            let at = model.shared() - model.effect.free_inner() + k;
            parameters.push(ForceParameter {
                name: (*name).into(),
                value: model.inner[k],
                std_error: error(at).map(|e| e * model.effect.inner_scale(k, model.inner)),
                unit: if k == 0 { unit.to_owned() } else { String::new() },
            });
        }
        let starts = RecordStart::closed(sensors, model, course, (&order, &sizes));
        ToldModel { modes: all, participation, drives, parameters, starts }
    }
}

/// Adds a candidate, or puts it in the place of the same force that leaves more.
fn keep_better(all: &mut Vec<FittedStructure>, fitted: FittedStructure) {
    let same = |f: &FittedStructure| {
        (f.candidate.effect, f.candidate.site) == (fitted.candidate.effect, fitted.candidate.site)
    };
    match all.iter().position(same) {
        Some(k) if all[k].error <= fitted.error => {}
        Some(k) => all[k] = fitted,
        None => all.push(fitted),
    }
}

/// What jumps of the states count for, each beside the size of its state.
fn held(model: &ClosedModel, hold: f64) -> Vec<f64> {
    let size = |i: usize| {
        let sum: f64 = model.initial.iter().map(|s| s.modes[i].norm_sqr()).sum();
        (sum / model.initial.len() as f64).sqrt().max(1e-300)
    };
    // That of an inner state is at most about the displacement at which it yields.
    let memory = model.effect.has_memory().then(|| hold / model.inner[0]);
    (0..model.modes()).map(|i| hold / size(i)).chain(memory).collect()
}

/// Makes a model's force as large as an open-loop fit has it along the motion that its own states make: accelerations that
/// were integrated show the motion too small or too large. False where it is as large already, or none would serve.
fn matched(model: &mut ClosedModel, states: &mut States, force: &ForceSeries) -> bool {
    let derivative = i32::from(model.effect.is_of_velocity());
    let mut pairs: Vec<(f64, f64)> = Vec::new();
    for (own, values) in states.modes.iter().zip(&force.values) {
        let samples = own.first().map_or(0, Vec::len);
        let at = |t: usize| {
            let shown = |i: usize| {
                let lambda = model.poles[i].eigenvalue();
                model.coupling(i) * (lambda.powi(derivative) * own[i][t]).im / lambda.im
            };
            (0..own.len()).map(shown).sum::<f64>()
        };
        pairs.extend((0..samples).map(|t| (at(t), values[t * force.parts])));
    }
    if model.effect == Effect::Clearance {
        // The gap is left as often.
        let beyond = pairs.iter().filter(|(_, f)| *f != 0.0).count();
        let mut sizes: Vec<f64> = pairs.iter().map(|(x, _)| x.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        if let Some(gap) = sizes.get(sizes.len() - beyond.clamp(1, sizes.len().max(1))).filter(|g| **g > 0.0) {
            model.inner[0] = *gap;
        }
    }
    let (mut product, mut square) = (0.0, 0.0);
    let motion: Vec<f64> = pairs.iter().map(|(x, _)| *x).collect();
    for (own, (_, measured)) in model.effect.along(&motion, model.inner).into_iter().zip(pairs) {
        let own = own / model.unit;
        product += own * measured;
        square += own * own;
    }
    let size = (product / square).sqrt();
    if !(size.is_finite() && size > 0.0 && size.ln().abs() > OTHER_START) {
        return false;
    }
    model.shape.iter_mut().flatten().for_each(|s| *s *= size);
    model.drive.iter_mut().flatten().for_each(|d| *d /= size);
    states.modes.iter_mut().flatten().flatten().for_each(|z| *z /= size);
    true
}

/// The beginnings of all records, a share of each, in stretches of about so many samples; each one's last sample is the next one's first.
fn stretches(series: &[SensorSeries], samples: f64, share: f64) -> Vec<Segment> {
    let mut all = Vec::new();
    for Segment { record, length, .. } in Segment::whole(series, share.min(1.0)) {
        let count = ((length as f64 / samples).round() as usize).max(1);
        let bound = |k: usize| k * (length - 1) / count;
        all.extend((0..count).map(|k| Segment { record, start: bound(k), length: bound(k + 1) - bound(k) + 1 }));
    }
    all
}

/// The unit of the displacement at a site, as far as the sensor's own tells.
fn force_unit(measurement: &Measurement, site: Site) -> String {
    let place = match site {
        Site::Ground(i) | Site::Between(i, _) => i,
    };
    let unit = measurement.sensor_at(place).map_or("", |s| measurement.sensors[s].unit.as_str());
    let length = unit.split('/').next().unwrap_or("");
    if length.is_empty() { "1".into() } else { length.to_owned() }
}
