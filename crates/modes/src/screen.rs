//! Which force is missing, asked linearly: a candidate force, of the measured motion, as one more input of the subspace model.
//!
//! Source: J.-P. Noël, G. Kerschen, Mech. Syst. Signal Process. 40 (2013) 701 (frequency-domain nonlinear subspace identification).

use super::chosen::ChosenPoles;
use super::force::{Effect, Site};
use super::identify::{Split, further, main_period, pool, residuals};
use super::judge::Residuals;
use super::limits::{
    BAND_END, CORNERS, DRIVEN, FINER_GAPS, FORCE_POLE_RATES, GAPS, LEAST_YIELD, MOST_PAIRS, MOST_YIELD, NEAR_PLACE,
    SCREEN_ROWS, SCREEN_STEPS, SMOOTHING, YIELD_RATIO, YIELDS,
};
use super::linear::{ForceSeries, LinearTask, ModalFit};
use super::measurement::{Measurement, Quantity, SensorSeries};
use super::motion::{Band, PARTS, PlaceMotion, reconstructed};
use super::pole::Pole;
use super::subspace::distinct;
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::signal::Spectrum;
use sindyscope_core::study::Cancel;

/// Which sites are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SiteKind {
    /// Between a sensor and the ground.
    Ground,
    /// Between two sensors.
    Pairs,
}

/// A force where and how it was screened.
#[derive(Clone)]
pub(crate) struct ForceCandidate {
    pub(crate) effect: Effect,
    pub(crate) site: Site,
    /// What is inside the force: see [`Effect`].
    pub(crate) inner: [f64; 2],
    /// Of the fitted and the unseen records, divided by `unit`.
    pub(crate) fitted: ForceSeries,
    pub(crate) unseen: ForceSeries,
    pub(crate) unit: f64,
    pub(crate) poles: Vec<Pole>,
    /// Between which displacements a joint must yield: below, its loop is closed within a sample or very small, and nothing tells it
    /// from dry friction; above, it is a spring.
    pub(crate) yields: (f64, f64),
    /// RMS that is left on the records never fitted.
    pub(crate) error: f64,
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
        let mut tasks: Vec<(usize, Effect, [f64; 2])> = Vec::new();
        for (k, motion) in motions.iter().enumerate() {
            for effect in Effect::ALL {
                tasks.extend(rough(motion, effect).into_iter().map(|g| (k, effect, g)));
            }
        }
        let run = |tasks: Vec<(usize, Effect, [f64; 2])>| -> Vec<ForceCandidate> {
            let all: Vec<Option<ForceCandidate>> = tasks
                .into_par_iter()
                .map(
                    |(k, effect, g)| {
                        if cancel.is_cancelled() { None } else { self.candidate(&motions[k], effect, g, cancel) }
                    },
                )
                .collect();
            all.into_iter().flatten().collect()
        };
        let mut found = run(tasks);
        report(0.7);
        sort(&mut found);
        let plain = || found.iter().filter(|c| !c.effect.has_memory());
        let Some(best) = plain().next().map(|c| c.error) else { return found };
        let mut places: Vec<Site> = Vec::new();
        for c in plain().filter(|c| c.error < NEAR_PLACE * best) {
            if !places.contains(&c.site) {
                places.push(c.site);
            }
        }
        let mut finer: Vec<(usize, Effect, [f64; 2])> = Vec::new();
        for site in places.into_iter().take(2) {
            let at = motions.iter().enumerate().filter(|(_, m)| m.site == site);
            for (k, motion) in at {
                finer.extend(FINER_GAPS.iter().map(|g| (k, Effect::Clearance, [g * largest(motion), 0.0])));
            }
        }
        found.extend(run(finer));
        report(1.0);
        sort(&mut found);
        found
    }

    fn longest_interval(&self) -> f64 {
        self.split.fitted.iter().map(|s| s.interval).fold(0.0, f64::max)
    }

    fn candidate(
        &self,
        motion: &SiteMotion,
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
            inner,
            fitted,
            unseen,
            unit,
            poles: Vec::new(),
            yields: (
                (LEAST_YIELD * size(motion)).max(speed(motion) * self.longest_interval()),
                MOST_YIELD * size(motion),
            ),
            error: f64::INFINITY,
        };
        let path =
            self.open_path(&candidate.fitted, &candidate.unseen, self.poles, self.modes, SCREEN_STEPS, cancel, true)?;
        let (fit, error) = path.into_iter().last()?;
        candidate.poles = fit.poles;
        candidate.error = error;
        Some(candidate)
    }

    /// Poles with a force as a further input, one more at a time, each with the error on the records never fitted.
    ///
    /// `last` keeps the refinement for the last number of modes.
    #[expect(clippy::too_many_arguments, reason = "a path of fits has these inputs, and two callers")]
    pub(crate) fn open_path(
        &self,
        fitted: &ForceSeries,
        unseen: &ForceSeries,
        known: &[Pole],
        most: usize,
        steps: usize,
        cancel: &Cancel,
        last: bool,
    ) -> Option<Vec<(ModalFit, f64)>> {
        let sensors = &self.measurement.sensors;
        let rows: usize = self.split.fitted.iter().map(SensorSeries::len).sum();
        let stride = if last { rows.div_ceil(SCREEN_ROWS) } else { 1 };
        let coarse = LinearTask::new(&self.split.fitted, sensors, Some(fitted), rows.div_ceil(SCREEN_ROWS));
        let task = LinearTask::new(&self.split.fitted, sensors, Some(fitted), stride);
        let judge = LinearTask::new(&self.split.unseen, sensors, Some(unseen), stride);
        let found = pool(&self.split.fitted, Some(fitted), &FORCE_POLE_RATES);
        let pool = coarse.pool(&self.chosen.completed(distinct(known.iter().copied().chain(found), 0.006, 0.5)));
        let (mut poles, mut taken): (Vec<Pole>, Vec<usize>) = (Vec::new(), Vec::new());
        let mut all = Vec::new();
        while poles.len() < most {
            if cancel.is_cancelled() {
                return None;
            }
            let open = |p: &Pole| self.chosen.is_open(p, &poles, &taken);
            let Some(next) = further(&coarse, &poles, &pool, &open) else { break };
            taken.extend(self.chosen.nearest(&next));
            poles.push(next);
            if last && poles.len() < most {
                continue;
            }
            let Some(fit) = task.refine(&poles, steps, cancel) else { break };
            poles.clone_from(&fit.poles);
            let left = judge.unseen(&fit)?;
            let error = super::judge::rms(left.iter().flatten());
            if !error.is_finite() {
                break;
            }
            all.push((fit, error));
        }
        (!all.is_empty()).then_some(all)
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
