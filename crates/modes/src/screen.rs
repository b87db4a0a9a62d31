//! Which force is missing, asked linearly: a candidate force, of the measured motion, as one more input of the subspace model.
//!
//! Source: J.-P. Noël, G. Kerschen, Mech. Syst. Signal Process. 40 (2013) 701 (frequency-domain nonlinear subspace identification).

use std::sync::Arc;

use super::chosen::ChosenPoles;
use super::closed::ClosedModel;
use super::force::{Effect, Site};
use super::identify::{Split, further, main_period, pool, residuals};
use super::judge::{Residuals, rms};
use super::limits::{
    APART, BAND_END, CORNERS, DRIVEN, FORCE_POLE_RATES, GAP_STEPS, GAPS, LAST_GAIN, LEAST_YIELD, MOST_PAIRS,
    MOST_SMOOTHING, MOST_YIELD, PATIENCE, POLE_STEPS, POOL_DAMPING, POOL_DISTANCE, ROUGH, SAME_POLE, SCREEN_ROWS,
    SCREEN_STEPS, SCREEN_VALUES, SMOOTHING, YIELD_RATIO, YIELDS,
};
use super::linear::{ForceSeries, LinearTask, ModalFit};
use super::measurement::{Measurement, Quantity, Sensor, SensorSeries};
use super::motion::{Band, PARTS, PlaceMotion, reconstructed};
use super::pole::Pole;
use super::subspace::distinct;
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::signal::Spectrum;
use sindyscope_core::study::Cancel;
use sindyscope_values::record::Role;

/// Which sites are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SiteKind {
    /// Between a sensor and the ground.
    Ground,
    /// Between two sensors.
    Pairs,
}

/// What a path of growing numbers of modes goes along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Along {
    /// A force of the measured motion that is one of many: poles are refined for the last number alone.
    Screened,
    /// The same, as a start: the modes that carry this motion come first, and none beside another one, since that would stand for the
    /// force's error.
    Reconstructed,
    /// The force of a model that does not explain the data yet.
    Rough,
    /// That of one that does.
    Force,
}

/// A force where and how it was screened.
#[derive(Clone)]
pub(crate) struct ForceCandidate {
    pub(crate) effect: Effect,
    pub(crate) site: Site,
    /// Number of the reconstructed motion that it was screened along.
    motion: usize,
    /// What is inside the force: see [`Effect`].
    pub(crate) inner: [f64; 2],
    /// Of the fitted and the unseen records, divided by `unit`.
    pub(crate) fitted: ForceSeries,
    pub(crate) unseen: ForceSeries,
    pub(crate) unit: f64,
    /// What the force depends on, `moved[record][sample]` of the fitted records, where no sensor measured it.
    moved: Option<Arc<[Vec<f64>]>>,
    pub(crate) poles: Vec<Pole>,
    /// Those that a closed loop starts with, once they were chosen.
    pub(crate) start: Option<Vec<Pole>>,
    /// Between which values the first number inside it must lie: a joint that yields below is not told from dry friction, since its
    /// loop is closed within a sample or very small, and one above is a spring; friction that turns over more is a damper.
    pub(crate) bounds: (f64, f64),
    /// RMS that is left on the records never fitted.
    pub(crate) error: f64,
    /// How often the steps of the integration in closed loop are halved.
    pub(crate) halvings: u32,
}

impl ForceCandidate {
    /// Steps of the integration between two samples in closed loop.
    pub(crate) fn parts(&self) -> usize {
        self.effect.parts() << self.halvings
    }

    /// Goes on along the force that a model makes itself, `[record][instant]` of the fitted and the unseen records in the model's unit;
    /// false where it makes none.
    pub(crate) fn goes_along(&mut self, model: &ClosedModel, fitted: Vec<Vec<f64>>, unseen: Vec<Vec<f64>>) -> bool {
        self.fitted.values = fitted;
        self.unseen.values = unseen;
        let unit = self.fitted.values.iter().map(|f| deviation(f)).fold(0.0, f64::max);
        if unit.is_nan() || unit <= 0.0 {
            return false;
        }
        self.unit = model.unit * unit;
        self.inner = model.inner;
        for v in self.fitted.values.iter_mut().chain(&mut self.unseen.values) {
            v.iter_mut().for_each(|f| *f /= unit);
        }
        true
    }
}

/// Motions across a site along all records.
struct SiteMotion {
    site: Site,
    fitted: Vec<PlaceMotion>,
    unseen: Vec<PlaceMotion>,
}

/// What is needed to screen.
pub(crate) struct Screen<'a> {
    pub(crate) measurement: &'a Measurement,
    pub(crate) split: &'a Split,
    /// Poles of the linear model.
    pub(crate) poles: &'a [Pole],
    /// Those that were chosen by hand: a model has one mode for each.
    pub(crate) chosen: ChosenPoles<'a>,
    pub(crate) modes: usize,
    /// Poles that were proposed for it.
    pub(crate) pool: &'a [Pole],
    /// Standard deviation of each sensor's noise.
    pub(crate) noises: Vec<f64>,
}

impl Screen<'_> {
    /// Sensor weights of the displacement across a site, in the sensors' units; none where no sensor shows it.
    pub(crate) fn across(measurement: &Measurement, site: Site) -> Option<Vec<f64>> {
        let mut weights = vec![0.0; measurement.sensors.len()];
        let mut add = |place: usize, sign: f64| {
            let sensor = measurement.sensor_at(place)?;
            weights[sensor] += sign * measurement.sensors[sensor].scale;
            Some(())
        };
        match site {
            Site::Ground(i) => add(i, 1.0)?,
            Site::Between(i, j) => {
                add(i, 1.0)?;
                add(j, -1.0)?;
            }
        }
        Some(weights)
    }

    fn sites(&self, reach: SiteKind) -> Vec<Site> {
        let mut places: Vec<usize> = self.measurement.sensors.iter().map(|s| s.place()).collect();
        places.sort_unstable();
        places.dedup();
        if reach == SiteKind::Ground {
            return places.iter().map(|p| Site::Ground(*p)).collect();
        }
        let pairs =
            places.iter().enumerate().flat_map(|(k, i)| places[k + 1..].iter().map(move |j| Site::Between(*i, *j)));
        pairs.take(MOST_PAIRS).collect()
    }

    /// The lowest frequency of the motion and the end of its band, Hz: by the inputs where there are any.
    pub(crate) fn band(&self) -> (f64, f64) {
        let frequencies = self.poles.iter().map(|p| p.frequency());
        let (lowest, highest) = (frequencies.clone().fold(f64::INFINITY, f64::min), frequencies.fold(0.0, f64::max));
        match driven_band(&self.split.fitted) {
            Some((low, high)) => (lowest.clamp(low, 2.0 * low), highest.max(high)),
            None => {
                let strongest = main_period(&self.split.fitted).recip();
                (lowest.max(0.3 * strongest).min(strongest), highest.max(strongest))
            }
        }
    }

    fn motions(&self, reach: SiteKind, corner: f64) -> Vec<SiteMotion> {
        let (slowest, fastest) = self.band();
        let of = |series: &SensorSeries, site: Site| -> Option<PlaceMotion> {
            let weights = Self::across(self.measurement, site)?;
            let mut sum: Option<PlaceMotion> = None;
            for (k, weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                let quantity = self.measurement.sensors[k].quantity;
                let low = if quantity == Quantity::Displacement { 0.0 } else { corner * slowest };
                let band = Band { low, high: BAND_END * fastest };
                let own = reconstructed(&series.outputs[k], series.interval, quantity, band, (slowest, self.noises[k]));
                let total = sum.get_or_insert_with(|| PlaceMotion {
                    displacement: vec![0.0; own.displacement.len()],
                    velocity: vec![0.0; own.velocity.len()],
                });
                total.displacement.iter_mut().zip(&own.displacement).for_each(|(t, v)| *t += weight * v);
                total.velocity.iter_mut().zip(&own.velocity).for_each(|(t, v)| *t += weight * v);
            }
            sum
        };
        let all = |series: &[SensorSeries], site: Site| series.iter().map(|s| of(s, site)).collect::<Option<Vec<_>>>();
        let sites = self.sites(reach);
        let found = sites.into_par_iter().map(|site| {
            Some(SiteMotion { site, fitted: all(&self.split.fitted, site)?, unseen: all(&self.split.unseen, site)? })
        });
        found.collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// All candidates, the best first; `report` hears the share that is done.
    pub(crate) fn candidates(
        &self,
        reach: SiteKind,
        report: &(dyn Fn(f64) + Sync),
        cancel: &Cancel,
    ) -> Vec<ForceCandidate> {
        let measured = self.measurement.sensors.iter().all(|s| s.quantity == Quantity::Displacement);
        let corners = if measured { &CORNERS[..1] } else { &CORNERS[..] };
        let motions: Vec<SiteMotion> = corners.iter().flat_map(|c| self.motions(reach, *c)).collect();
        let rough = |m: &SiteMotion, effect: Effect| -> Vec<[f64; 2]> {
            match effect {
                Effect::Clearance => GAPS.iter().map(|g| [g * largest(m), 0.0]).collect(),
                Effect::BoucWenHysteresis => YIELDS.iter().map(|y| [y * size(m), YIELD_RATIO]).collect(),
                _ => vec![[inner(m), 0.0]],
            }
        };
        let tasks = |numbers: &[usize], several: bool| -> Vec<(usize, Effect, [f64; 2])> {
            let of = |k: usize| Effect::ALL.into_iter().map(move |effect| (k, effect));
            let all = numbers.iter().flat_map(|k| of(*k)).map(|(k, effect)| (k, effect, rough(&motions[k], effect)));
            let wanted = all.filter(|(.., inner)| (inner.len() > 1) == several);
            wanted.flat_map(|(k, effect, inner)| inner.into_iter().map(move |i| (k, effect, i))).collect()
        };
        let run = |tasks: Vec<(usize, Effect, [f64; 2])>| -> Vec<ForceCandidate> {
            let all: Vec<Option<ForceCandidate>> = tasks
                .into_par_iter()
                .map(
                    |(k, effect, g)| {
                        if cancel.is_cancelled() { None } else { self.candidate((k, &motions[k]), effect, g, cancel) }
                    },
                )
                .collect();
            all.into_iter().flatten().collect()
        };
        let numbers: Vec<usize> = (0..motions.len()).collect();
        let mut found = run(tasks(&numbers, false));
        report(0.3);
        // Of the motions of a place the one along which these leave least serves for forces with a number inside.
        let least = |k: usize| found.iter().filter(|c| c.motion == k).map(|c| c.error).fold(f64::INFINITY, f64::min);
        let better = |k: &usize, l: usize| motions[l].site == motions[*k].site && (least(l), l) < (least(*k), *k);
        let serving: Vec<usize> = numbers.iter().copied().filter(|k| !numbers.iter().any(|l| better(k, *l))).collect();
        let more = run(tasks(&serving, true));
        found.extend(more);
        report(0.7);
        // The squared error is a parabola of the gap near its least.
        for _ in 0..GAP_STEPS {
            let tasks = serving.iter().filter_map(|&k| {
                let tried = found.iter().filter(|c| c.effect == Effect::Clearance && c.motion == k);
                let tried: Vec<(f64, f64)> = tried.map(|c| (c.inner[0], c.error * c.error)).collect();
                lowest(tried).map(|gap| (k, Effect::Clearance, [gap, 0.0]))
            });
            let finer = run(tasks.collect());
            found.extend(finer);
        }
        report(1.0);
        sort(&mut found);
        found
    }

    fn longest_interval(&self) -> f64 {
        self.split.fitted.iter().map(|s| s.interval).fold(0.0, f64::max)
    }

    fn candidate(
        &self,
        (number, motion): (usize, &SiteMotion),
        effect: Effect,
        inner: [f64; 2],
        cancel: &Cancel,
    ) -> Option<ForceCandidate> {
        let argument =
            |m: &PlaceMotion| if effect.is_of_velocity() { m.velocity.clone() } else { m.displacement.clone() };
        let force = |m: &PlaceMotion| -> Vec<f64> { effect.along(&argument(m), inner) };
        let mut fitted = ForceSeries { parts: PARTS, values: motion.fitted.iter().map(force).collect() };
        let mut unseen = ForceSeries { parts: PARTS, values: motion.unseen.iter().map(force).collect() };
        let unit = fitted.values.iter().map(|f| deviation(f)).fold(0.0, f64::max);
        if !(unit > 0.0 && unit.is_finite()) {
            return None;
        }
        for values in fitted.values.iter_mut().chain(&mut unseen.values) {
            values.iter_mut().for_each(|f| *f /= unit);
        }
        let motion_site = motion.site;
        let mut candidate = ForceCandidate {
            effect,
            site: motion_site,
            motion: number,
            inner,
            fitted,
            unseen,
            unit,
            moved: None,
            poles: Vec::new(),
            start: None,
            bounds: match effect {
                Effect::BoucWenHysteresis => (
                    (LEAST_YIELD * size(motion)).max(speed(motion) * self.longest_interval()),
                    MOST_YIELD * size(motion),
                ),
                Effect::CoulombFriction => (0.0, MOST_SMOOTHING * speed(motion)),
                _ => (0.0, f64::INFINITY),
            },
            error: f64::INFINITY,
            halvings: 0,
        };
        let path = self.open_path(&candidate, self.poles, (self.modes, self.modes), Along::Screened, cancel)?;
        let (fit, error) = path.into_iter().last()?;
        candidate.poles = fit.poles;
        candidate.error = error;
        let sensor = |s: &Sensor| s.quantity != Quantity::Displacement;
        if self.measurement.sensors.iter().any(sensor) {
            let sampled = |m: &PlaceMotion| argument(m).into_iter().step_by(PARTS).collect();
            candidate.moved = Some(motion.fitted.iter().map(sampled).collect());
        }
        Some(candidate)
    }

    /// Poles with a force as a further input, one more at a time, each with the error on the records never fitted: so `most`, and up to
    /// `limit` as long as each further one is missed. Along a rough force the path ends where a few have been tried in vain.
    pub(crate) fn open_path(
        &self,
        candidate: &ForceCandidate,
        known: &[Pole],
        (most, limit): (usize, usize),
        along: Along,
        cancel: &Cancel,
    ) -> Option<Vec<(ModalFit, f64)>> {
        let sensors = &self.measurement.sensors;
        let rows: usize = self.split.fitted.iter().map(SensorSeries::len).sum();
        let last = along == Along::Screened;
        // Poles along a rough force are off by more than rows left out make them.
        let thinned = rows.div_ceil(SCREEN_ROWS.min(SCREEN_VALUES / sensors.len().max(1)).max(1));
        let stride = if along == Along::Force { 1 } else { thinned };
        let ForceCandidate { fitted, unseen, .. } = candidate;
        let steps = if last { SCREEN_STEPS } else { POLE_STEPS };
        let rough = matches!(along, Along::Reconstructed | Along::Rough);
        let apart = if rough { APART } else { SAME_POLE };
        let seen = candidate.moved.as_ref().filter(|_| along == Along::Reconstructed);
        let (series, choosing) = seen.map_or_else(
            || (self.split.fitted.clone(), sensors.clone()),
            |moved| self.with_motion(candidate.effect, candidate.site, moved),
        );
        let coarse = LinearTask::new(&series, &choosing, Some(fitted), thinned);
        let task = LinearTask::new(&self.split.fitted, sensors, Some(fitted), stride);
        let judge = LinearTask::new(&self.split.unseen, sensors, Some(unseen), stride);
        let found = pool(&self.split.fitted, Some(fitted), &FORCE_POLE_RATES);
        // A start is worth those of all rates.
        let others: &[Pole] = if last { &[] } else { self.pool };
        let proposed = known.iter().chain(&found).chain(others).copied();
        let pool = coarse.pool(&self.chosen.completed(distinct(proposed, POOL_DISTANCE.0, POOL_DISTANCE.1)));
        let (mut poles, mut refused): (Vec<Pole>, Vec<Pole>) = (Vec::new(), Vec::new());
        let mut taken: Vec<usize> = Vec::new();
        let mut all = Vec::new();
        let (mut least, mut idle) = (f64::INFINITY, 0);
        while poles.len() < limit && refused.len() < most {
            if cancel.is_cancelled() {
                return None;
            }
            let known: Vec<Pole> = poles.iter().chain(&refused).copied().collect();
            let open = |p: &Pole| self.chosen.is_open(p, &known, apart, &taken);
            let Some(next) = further(&coarse, &poles, &pool, &open) else { break };
            taken.extend(self.chosen.nearest(&next));
            poles.push(next);
            if last && poles.len() < most {
                continue;
            }
            let Some(fit) = task.refine(&poles, steps, cancel) else { break };
            if rough && self.chosen.0.is_empty() && !told_apart(&fit.poles) {
                poles.pop();
                refused.push(next);
                continue;
            }
            poles.clone_from(&fit.poles);
            let left = judge.unseen(&fit)?;
            let error = rms(left.iter().flatten());
            if !error.is_finite() {
                break;
            }
            all.push((fit, error));
            idle = if error < LAST_GAIN * least { 0 } else { idle + 1 };
            least = least.min(error);
            if (poles.len() >= most && idle > 0) || (!last && limit > most && idle > PATIENCE) {
                break;
            }
        }
        (!all.is_empty()).then_some(all)
    }

    /// The path that a closed loop starts from: the one whose modes carry the motion of the force's place, where that leaves about as
    /// little as the one that asks for nothing of the kind. Accelerations that were integrated may drift, and poles then follow the
    /// drift.
    pub(crate) fn start_path(
        &self,
        candidate: &ForceCandidate,
        known: &[Pole],
        most: (usize, usize),
        cancel: &Cancel,
    ) -> Option<Vec<(ModalFit, f64)>> {
        let plain = self.open_path(candidate, known, most, Along::Rough, cancel)?;
        if candidate.moved.is_none() {
            return Some(plain);
        }
        let least = |path: &[(ModalFit, f64)]| path.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
        let carrying = self.open_path(candidate, known, most, Along::Reconstructed, cancel);
        carrying.filter(|path| least(path) < ROUGH * least(&plain)).or(Some(plain))
    }

    /// The fitted records and sensors with one more: the reconstructed motion that a force depends on. A mode that carries this motion
    /// is part of the loop, though accelerometers show little of a slow one.
    fn with_motion(&self, effect: Effect, site: Site, moved: &[Vec<f64>]) -> (Vec<SensorSeries>, Vec<Sensor>) {
        let (mut series, mut sensors) = (self.split.fitted.clone(), self.measurement.sensors.clone());
        let scale = rms(moved.iter());
        for (series, moved) in series.iter_mut().zip(moved) {
            series.outputs.push(moved.iter().map(|x| x / scale).collect());
        }
        let quantity = if effect.is_of_velocity() { Quantity::Velocity } else { Quantity::Displacement };
        let role = Role::Displacement(match site {
            Site::Ground(i) | Site::Between(i, _) => i,
        });
        sensors.push(Sensor { name: String::new(), role, quantity, unit: String::new(), scale });
        (series, sensors)
    }

    /// What a linear model with a force as a further input leaves.
    pub(crate) fn left(&self, fitted: &ForceSeries, unseen: &ForceSeries, fit: &ModalFit) -> Option<Residuals> {
        let task = LinearTask::new(&self.split.fitted, &self.measurement.sensors, Some(fitted), 1);
        let judge = LinearTask::new(&self.split.unseen, &self.measurement.sensors, Some(unseen), 1);
        let own = task.fit(&fit.poles)?;
        let drives = self.measurement.inputs.len() + 1;
        Some(Residuals {
            fitted: residuals(&task, &own, &self.split.fitted),
            unseen: judge.unseen(&own)?,
            unknowns: own.poles.len() * (2 + drives * self.measurement.sensors.len()),
        })
    }
}

/// True if the last of several poles came close to none of the others: one that did stands for a force's error. One that is damped as
/// no mode of a structure is stands for a drift, and beside nothing.
fn told_apart(poles: &[Pole]) -> bool {
    let Some((new, others)) = poles.split_last() else { return true };
    let light = |p: &Pole| p.damping < POOL_DAMPING.1;
    let near = |q: &&Pole| light(q) && (new.omega / q.omega).ln().abs() < 0.5 * APART;
    !light(new) || others.iter().find(near).is_none()
}

/// The band that holds the power of all inputs, Hz; none without inputs.
pub(crate) fn driven_band(series: &[SensorSeries]) -> Option<(f64, f64)> {
    let each = series.iter().flat_map(|s| s.inputs.iter().filter_map(|u| band_of(u, s.interval)));
    each.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// The band that holds an input's power, Hz.
fn band_of(input: &[f64], interval: f64) -> Option<(f64, f64)> {
    let spectrum = Spectrum::new(input, interval)?;
    let total: f64 = spectrum.amplitudes.iter().map(|a| a * a).sum();
    let mut sum = 0.0;
    let mut low = None;
    for (k, amplitude) in spectrum.amplitudes.iter().enumerate() {
        sum += amplitude * amplitude;
        if low.is_none() && sum > DRIVEN.0 * total {
            low = Some(spectrum.frequency(k));
        }
        if sum > DRIVEN.1 * total {
            return low.filter(|l| *l > 0.0).map(|low| (low, spectrum.frequency(k)));
        }
    }
    None
}

/// Where the parabola through the lowest value and its neighbours has its least; halfway to the neighbour where the lowest one is the
/// first or the last.
fn lowest(mut values: Vec<(f64, f64)>) -> Option<f64> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let at = (0..values.len()).min_by(|i, j| values[*i].1.total_cmp(&values[*j].1))?;
    let (middle, height) = values[at];
    let neighbour = |k: Option<usize>| k.and_then(|k| values.get(k)).copied();
    match (neighbour(at.checked_sub(1)), neighbour(Some(at + 1))) {
        (Some((left, rise_left)), Some((right, rise_right))) => {
            let (p, q) = ((middle - left) * (height - rise_right), (middle - right) * (height - rise_left));
            let least = middle - 0.5 * ((middle - left) * p - (middle - right) * q) / (p - q);
            let width = 0.02 * (right - left);
            let inside = least > left + width && least < right - width && (least - middle).abs() > width;
            // Beside a value that is known already lies nothing new.
            let longer = if middle - left > right - middle { 0.5 * (left + middle) } else { 0.5 * (middle + right) };
            Some(if inside { least } else { longer })
        }
        (Some((other, _)), None) | (None, Some((other, _))) => Some(0.5 * (middle + other)),
        (None, None) => None,
    }
}

fn sort(candidates: &mut [ForceCandidate]) {
    candidates.sort_by(|a, b| a.error.total_cmp(&b.error));
}

fn largest(motion: &SiteMotion) -> f64 {
    motion.fitted.iter().flat_map(|m| &m.displacement).fold(0.0, |a, x| a.max(x.abs()))
}

/// Deviation of the displacement, of the record where it is largest.
fn size(motion: &SiteMotion) -> f64 {
    motion.fitted.iter().map(|m| deviation(&m.displacement)).fold(0.0, f64::max)
}

/// The same of the velocity.
fn speed(motion: &SiteMotion) -> f64 {
    motion.fitted.iter().map(|m| deviation(&m.velocity)).fold(0.0, f64::max)
}

fn inner(motion: &SiteMotion) -> f64 {
    SMOOTHING * speed(motion)
}

pub(crate) fn deviation(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}
