//! What a linear structure lacks: candidates screened linearly, fitted in closed loop, judged on data never fitted.

use nalgebra::{Complex, DMatrix, DVector};

use super::closed::{ClosedModel, Free, Loop};
use super::error::ModesError;
use super::force::{Effect, Site};
use super::identify::{Linear, Path, PathRequest, Split, inflation, linear, main_period, modes, path};
use super::judge::{Residuals, beats, compared, rms};
use super::linear::{LinearFit, Task};
use super::measurement::Measurement;
use super::motion::PARTS;
use super::outcome::Structure;
use super::pole::Pole;
use super::screen::{Candidate, Screen, deviation};
use super::study::{noise_floor, record_fits, structure};
use sindyscope_core::signal::standard_deviation;
use sindyscope_core::study::Cancel;
use sindyscope_search::Lead;
use sindyscope_values::model::Mode;
use sindyscope_values::record::RecordSet;

/// Times the noise that a linear model leaves at most where nothing is missing: as the search for missing effects has it.
const EXPLAINS: f64 = 1.06;
/// Times the noise at which a closed loop needs no other start.
const GOOD: f64 = 1.12;
/// Share of the linear model's error on data never fitted that a named effect leaves at most.
const BETTER: f64 = 0.97;
/// Candidates are fitted in closed loop where they lie behind the best by this factor at most, so many.
const CLOSE: f64 = 1.25;
const MOST_CANDIDATES: usize = 5;
/// The best place of a further effect counts if it lies behind the best by this factor at most.
const REACH: f64 = 2.0;
/// Modes beyond the linear model's chosen number that screening allows, and the number of the fits that follow.
const SCREENED_MODES: (usize, usize) = (6, 8);
/// The smallest number of modes within this factor of the best error counts.
const SAME_ERROR: f64 = 1.015;
/// Rounds of closed loop and further modes.
const ROUNDS: usize = 3;
/// Share of a record's deviation that its free oscillation has where it does not start at rest.
const AT_REST: f64 = 0.05;
/// Friction is smoothed less once the model follows the motion.
const SHARPER: f64 = 0.4;
/// How the model takes the place of the measured motion in the force: its share, the share of each record, steps.
const SCHEDULE: [(f64, f64, usize); 5] = [(0.0, 0.4, 3), (0.5, 0.4, 4), (1.0, 0.15, 8), (1.0, 0.4, 6), (1.0, 1.0, 8)];

/// The outcome of a search.
#[derive(Clone, Debug)]
pub struct StructureDiagnosis {
    /// The linear model.
    pub base: Structure,
    /// The model at the end; its modes are those of the linear part.
    pub last: Structure,
    /// The force that was found.
    pub found: Option<FoundForce>,
    /// True if what is left on data never fitted is noise.
    pub explained: bool,
    /// RMS of what the model leaves on data never fitted over that of the noise.
    pub noises: f64,
}

/// Times the noise from which what is left matters: as the search for missing effects has it.
const MATTERS: f64 = 1.2;

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
}

/// A force beside the linear structure.
#[derive(Clone, Debug)]
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
#[derive(Clone, Debug, PartialEq)]
pub struct ForceParameter {
    /// Its symbol.
    pub name: &'static str,
    /// Its value; a force is told as the acceleration that it makes at its place.
    pub value: f64,
    /// Its standard error; none where it is not known.
    pub std_error: Option<f64>,
    /// Its unit.
    pub unit: String,
}

/// A candidate fitted to its end.
struct Fitted {
    candidate: Candidate,
    closed: Option<(ClosedModel, Residuals)>,
    open: (LinearFit, Residuals),
    densities: Vec<f64>,
    error: f64,
}

/// Searches for the force that a linear structure lacks.
///
/// `modes` fixes the number of modes; `report` hears what is done and its share.
///
/// # Errors
/// As [`super::identify`].
pub fn diagnose(
    records: &RecordSet,
    modes: Option<usize>,
    report: &(dyn Fn(&'static str, f64) + Sync),
    cancel: &Cancel,
) -> Result<StructureDiagnosis, ModesError> {
    let measurement = Measurement::new(records, cancel)?;
    let split = Split::new(&measurement);
    report("looking for modes", 0.0);
    let path = path(&measurement, &split, &PathRequest { modes, ..PathRequest::default() }, cancel)?;
    let base = linear(&measurement, &path.steps[path.chosen].poles, cancel)?;
    let linear_error = path.steps[path.chosen].residuals.unseen_rms();
    let noise = noise(&split);
    let plain = |base: &Linear, explained: bool| StructureDiagnosis {
        base: structure(&measurement, base),
        last: structure(&measurement, base),
        found: None,
        explained,
        noises: linear_error / noise,
    };
    if linear_error < EXPLAINS * noise {
        return Ok(plain(&base, true));
    }
    let search = ForceSearch { measurement: &measurement, split: &split, path: &path, fixed: modes, noise };
    report("asking which force is missing", 0.05);
    let fitted = search.fitted(report, cancel)?;
    let period = main_period(&split.fitted);
    let chosen = search.chosen(fitted, period);
    let Some((best, lead, rivals, tried)) = chosen else { return Ok(plain(&base, false)) };
    let error = best.error;
    let (last, found) = search.told(best, lead, rivals, tried, cancel)?;
    Ok(StructureDiagnosis {
        base: structure(&measurement, &base),
        last,
        found: Some(found),
        explained: error < GOOD * noise,
        noises: error / noise,
    })
}

/// RMS of the noise over all sensors of the records never fitted, in units of the sensors' RMS.
fn noise(split: &Split) -> f64 {
    let all: Vec<f64> = split.unseen.iter().flat_map(|s| &s.outputs).filter_map(|y| standard_deviation(y)).collect();
    (all.iter().map(|n| n * n).sum::<f64>() / all.len().max(1) as f64).sqrt().max(1e-9)
}

struct ForceSearch<'a> {
    measurement: &'a Measurement,
    split: &'a Split,
    path: &'a Path,
    fixed: Option<usize>,
    noise: f64,
}

/// What is left of the records never fitted, and the force on the fine grid.
type UnseenRun = (Vec<Vec<Vec<f64>>>, Vec<Vec<f64>>);

type Chosen = (Fitted, Lead, Vec<(Effect, Site)>, Vec<(Effect, Site, f64)>);

impl ForceSearch<'_> {
    fn linear_error(&self) -> f64 {
        self.path.steps[self.path.chosen].residuals.unseen_rms()
    }

    fn fitted(&self, report: &(dyn Fn(&'static str, f64) + Sync), cancel: &Cancel) -> Result<Vec<Fitted>, ModesError> {
        let poles = &self.path.steps[self.path.chosen].poles;
        let modes = self.fixed.unwrap_or_else(|| (poles.len() + 1).clamp(SCREENED_MODES.0, SCREENED_MODES.1));
        let noises = (0..self.measurement.sensors.len())
            .map(|s| {
                self.split.fitted.iter().filter_map(|r| standard_deviation(&r.outputs[s])).fold(f64::INFINITY, f64::min)
            })
            .map(|n| if n.is_finite() { n } else { 0.0 })
            .collect();
        let screen = Screen { measurement: self.measurement, split: self.split, poles, modes, noises };
        let candidates =
            screen.candidates(&|share| report("asking which force is missing", 0.05 + 0.3 * share), cancel);
        if cancel.is_cancelled() {
            return Err(ModesError::Cancelled);
        }
        let mut chosen: Vec<Candidate> = Vec::new();
        let best = candidates.first().map_or(f64::INFINITY, |c| c.error);
        for c in candidates {
            let new = chosen.iter().all(|k| (k.effect, k.site) != (c.effect, c.site));
            // Of each effect the best place, of the near ones every place.
            let first = chosen.iter().all(|k| k.effect != c.effect);
            let near = c.error < if first { REACH } else { CLOSE } * best;
            if new && near && c.error < BETTER * self.linear_error() && chosen.len() < MOST_CANDIDATES {
                chosen.push(c);
            }
        }
        let count = chosen.len();
        let mut all = Vec::new();
        for (k, candidate) in chosen.into_iter().enumerate() {
            report("fitting the force", 0.35 + 0.65 * k as f64 / count as f64);
            // Where one explains the data, those that are far from it need no fit.
            let explained = all.iter().any(|f: &Fitted| f.error < GOOD * self.noise);
            if explained && candidate.error > CLOSE * best {
                continue;
            }
            all.extend(self.closed(&screen, candidate, cancel));
            if cancel.is_cancelled() {
                return Err(ModesError::Cancelled);
            }
        }
        Ok(all)
    }

    /// A candidate fitted in open loop, then in closed loop from several starts.
    fn closed(&self, screen: &Screen<'_>, mut candidate: Candidate, cancel: &Cancel) -> Option<Fitted> {
        let most = self.fixed.unwrap_or(SCREENED_MODES.1);
        let across = Screen::across(self.measurement, candidate.site)?;
        let parts = if candidate.effect.is_of_velocity() { PARTS } else { 2 };
        let measured: Vec<Vec<f64>> =
            candidate.motion.iter().map(|m| m.iter().copied().step_by(PARTS / parts).collect()).collect();
        let mut known = self.path.steps[self.path.chosen].poles.clone();
        known.splice(0..0, candidate.poles.iter().copied());
        let mut opened: Option<(LinearFit, Residuals)> = None;
        let mut got: Option<(ClosedModel, f64, f64)> = None;
        for _ in 0..ROUNDS {
            let steps = screen.open_path(&candidate.fitted, &candidate.unseen, &known, most, 5, cancel, false)?;
            let best = steps.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
            let at = match self.fixed {
                Some(_) => steps.len() - 1,
                None => steps.iter().position(|s| s.1 < SAME_ERROR * best)?,
            };
            let (fit, _) = steps.into_iter().nth(at)?;
            let task = Task::new(&self.split.fitted, &self.measurement.sensors, Some(&candidate.fitted), 1);
            let offsets: Vec<Vec<f64>> = (0..self.split.fitted.len())
                .map(|r| (0..self.measurement.sensors.len()).map(|s| task.offset(&fit, s, r)).collect())
                .collect();
            let base = Loop {
                sensors: &self.measurement.sensors,
                series: &self.split.fitted,
                offsets: &offsets,
                measured: &measured,
                closed: 1.0,
                parts,
                share: 1.0,
            };
            let mut best_start: Option<(ClosedModel, f64)> = None;
            for clipped in [false, true] {
                let start = self.start(&task, &fit, &candidate, &across, clipped);
                let found = follow(start, base, cancel);
                if let Some((model, error)) = found
                    && best_start.as_ref().is_none_or(|b| error < b.1)
                {
                    best_start = Some((model, error));
                }
                if best_start.as_ref().is_some_and(|b| b.1 < GOOD * self.noise) {
                    break;
                }
            }
            if opened.is_none() {
                let left = screen.left(&candidate.fitted, &candidate.unseen, &fit)?;
                opened = Some((fit, left));
            }
            let Some((model, error)) = best_start else { break };
            let unseen = self.unseen(&model, parts, cancel);
            let unseen_error = unseen.as_ref().map_or(f64::INFINITY, |u| rms(u.0.iter().flatten()));
            let before = got.as_ref().map(|g| g.2);
            if before.is_none_or(|b| unseen_error < b) {
                got = Some((model.clone(), error, unseen_error));
            }
            if unseen_error < 1.03 * self.noise || before.is_some_and(|b| unseen_error > 0.97 * b) {
                break;
            }
            // The model's own force lets further modes be seen.
            let Some(unseen) = unseen else { break };
            let fine = Loop { parts: PARTS, measured: &[], ..base };
            let Some(simulated) = model.simulate(fine) else { break };
            candidate.fitted.values = simulated.forces;
            candidate.unseen.values = unseen.1;
            let unit = candidate.fitted.values.iter().map(|f| deviation(f)).fold(0.0, f64::max);
            if unit.is_nan() || unit <= 0.0 {
                break;
            }
            candidate.unit = model.unit * unit;
            candidate.inner = model.inner;
            for v in candidate.fitted.values.iter_mut().chain(&mut candidate.unseen.values) {
                v.iter_mut().for_each(|f| *f /= unit);
            }
            known = model.poles.clone();
        }
        let (fit, left) = opened?;
        let period = main_period(&self.split.fitted);
        let closed = got.and_then(|(model, _, error)| {
            let unseen = self.unseen(&model, parts, cancel)?.0;
            let offsets = vec![vec![0.0; self.measurement.sensors.len()]; self.split.fitted.len()];
            let of = Loop {
                sensors: &self.measurement.sensors,
                series: &self.split.fitted,
                offsets: &offsets,
                measured: &[],
                closed: 1.0,
                parts,
                share: 1.0,
            };
            let fitted = model.simulate(of)?.residuals;
            let unknowns = model.shared();
            Some((error, (model, Residuals { fitted, unseen, unknowns })))
        });
        // What stays in range only along the measured motion is no model.
        let (error, (_, residuals)) = closed.as_ref()?;
        let (densities, error) = (residuals.densities(&self.split.intervals(), period), *error);
        Some(Fitted { candidate, closed: closed.map(|c| c.1), open: (fit, left), densities, error })
    }

    /// A closed-loop model from an open-loop fit: the residues of each mode for inputs and force are made one shape, as
    /// reciprocity asks; `clipped` sets couplings of the wrong sign to nearly nothing, else their size is kept.
    fn start(
        &self,
        task: &Task<'_>,
        fit: &LinearFit,
        candidate: &Candidate,
        across: &[f64],
        clipped: bool,
    ) -> ClosedModel {
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
        let mut shape = Vec::new();
        for (u, v) in &parts {
            let reach = moved(u);
            let square = -v[inputs] * sign / reach;
            let size = if square > 0.0 {
                square.sqrt()
            } else if clipped {
                0.1 * square.abs().sqrt()
            } else {
                square.abs().sqrt() * 0.5
            };
            let size = if size.is_finite() && size > 0.0 { size } else { 1.0 };
            shape.push(u.iter().map(|u| u * size).collect());
            drive.push((0..inputs).map(|j| v[j] / size).collect());
        }
        let inner =
            if candidate.effect == Effect::CoulombFriction { SHARPER * candidate.inner } else { candidate.inner };
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
        model.initial = self.initial(task, fit, &model);
        model
    }

    /// The initial states that the free oscillations of an open-loop fit tell; none where all records start at rest.
    fn initial(&self, task: &Task<'_>, fit: &LinearFit, model: &ClosedModel) -> Vec<Vec<Complex<f64>>> {
        let sensors = &self.measurement.sensors;
        let records = self.split.fitted.len();
        let mut largest = 0.0_f64;
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
        let states: Vec<Vec<Complex<f64>>> =
            (0..records).map(|r| (0..fit.poles.len()).map(|i| of(r, i)).collect()).collect();
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
        if largest > AT_REST || self.measurement.inputs.is_empty() { states } else { Vec::new() }
    }

    /// What a model leaves on the records never fitted, from initial states fitted to them, and its force on the fine grid.
    fn unseen(&self, model: &ClosedModel, parts: usize, cancel: &Cancel) -> Option<UnseenRun> {
        let series = &self.split.unseen;
        let offsets: Vec<Vec<f64>> = series.iter().map(|s| s.outputs.iter().map(|_| 0.0).collect()).collect();
        let of = Loop {
            sensors: &self.measurement.sensors,
            series,
            offsets: &offsets,
            measured: &[],
            closed: 1.0,
            parts,
            share: 1.0,
        };
        let mut model = model.clone();
        model.initial = vec![vec![Complex::new(0.0, 0.0); model.modes()]; series.len()];
        let fitted = model.fitted(Loop { share: 0.15, ..of }, Free::Initial, 6, 1e-4, cancel)?.0;
        let (fitted, simulated) = fitted.fitted(of, Free::Initial, 3, 1e-4, cancel)?;
        let forces = fitted.simulate(Loop { parts: PARTS, ..of })?.forces;
        Some((simulated.residuals, forces))
    }

    /// The effect that stands, with its lead over the nearest rival, those that it does not beat, and all that were tried.
    fn chosen(&self, mut fitted: Vec<Fitted>, period: f64) -> Option<Chosen> {
        let step = &self.path.steps[self.path.chosen];
        let plain = step.residuals.densities(&self.split.intervals(), period);
        fitted.sort_by(|a, b| {
            let sum = |f: &Fitted| f.densities.iter().sum::<f64>();
            sum(b).total_cmp(&sum(a))
        });
        let tried: Vec<(Effect, Site, f64)> =
            fitted.iter().map(|f| (f.candidate.effect, f.candidate.site, f.error)).collect();
        let stands =
            fitted.iter().position(|f| f.error < BETTER * self.linear_error() && beats(&f.densities, &plain))?;
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
        best: Fitted,
        lead: Lead,
        rivals: Vec<(Effect, Site)>,
        tried: Vec<(Effect, Site, f64)>,
        cancel: &Cancel,
    ) -> Result<(Structure, FoundForce), ModesError> {
        let Fitted { candidate, closed, open, error, .. } = best;
        let sensors = &self.measurement.sensors;
        let unit = force_unit(self.measurement, candidate.site);
        let (modes, participation, drives, parameters, residuals) = match closed {
            Some((model, residuals)) if residuals.unseen_rms() <= 1.1 * error => {
                let told = self.told_closed(&model, &residuals, &unit);
                (told.0, told.1, told.2, told.3, residuals)
            }
            _ => {
                let task = Task::new(&self.split.fitted, sensors, Some(&candidate.fitted), 1);
                let (fit, residuals) = open;
                let (modes, participation) = modes(self.measurement, &task, &fit, &residuals);
                (modes, participation, Vec::new(), Vec::new(), residuals)
            }
        };
        let _ = cancel;
        let structure = Structure {
            sensors: sensors.clone(),
            inputs: self.measurement.inputs.clone(),
            modes,
            participation,
            noise_floor: noise_floor(self.measurement),
            records: record_fits(self.measurement, self.split, &residuals),
        };
        let found =
            FoundForce { effect: candidate.effect, site: candidate.site, parameters, drives, lead, rivals, tried };
        Ok((structure, found))
    }

    fn told_closed(
        &self,
        model: &ClosedModel,
        residuals: &Residuals,
        unit: &str,
    ) -> (Vec<Mode>, Vec<Vec<f64>>, Vec<f64>, Vec<ForceParameter>) {
        let (sensors, inputs) = (&self.measurement.sensors, &self.measurement.inputs);
        let offsets = vec![vec![0.0; sensors.len()]; self.split.fitted.len()];
        let parts = if model.effect.is_of_velocity() { PARTS } else { 2 };
        let of = Loop {
            sensors,
            series: &self.split.fitted,
            offsets: &offsets,
            measured: &[],
            closed: 1.0,
            parts,
            share: 1.0,
        };
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
        for i in order {
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
        };
        let of_velocity = model.effect == Effect::QuadraticDamping;
        let unit_of = match (power, of_velocity) {
            (0, _) => format!("{unit}/s^2"),
            (1, _) => "1/s^2".to_owned(),
            (_, true) => format!("1/{unit}"),
            (2, _) => format!("1/({unit} s^2)"),
            _ => format!("1/({unit}^2 s^2)"),
        };
        let mut parameters = vec![ForceParameter { name, value: size, std_error: size_error, unit: unit_of }];
        if model.has_gap() {
            let at = model.shared() - 1;
            parameters.push(ForceParameter {
                name: "gap",
                value: model.inner,
                std_error: error(at).map(|e| e * model.inner),
                unit: unit.to_owned(),
            });
        }
        (all, participation, drives, parameters)
    }
}

/// Takes the model's own motion into the force by steps, then fits all of every record; with the RMS that is left.
fn follow(start: ClosedModel, base: Loop<'_>, cancel: &Cancel) -> Option<(ClosedModel, f64)> {
    let mut model = start;
    let free = if model.initial.is_empty() { Free::Shared } else { Free::All };
    let mut error = None;
    for (closed, share, steps) in SCHEDULE {
        let of = Loop { closed, share, ..base };
        match model.fitted(of, free, steps, 1e-3, cancel) {
            Some((found, left)) => {
                model = found;
                error = Some((left.squares / left.samples as f64).sqrt());
            }
            None if closed < 1.0 => {}
            None => return None,
        }
    }
    error.map(|e| (model, e))
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
