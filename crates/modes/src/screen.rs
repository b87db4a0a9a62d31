//! Which force is missing, asked linearly: a candidate force, of the measured motion, as one more input of the subspace model.
//!
//! Source: J.-P. Noël, G. Kerschen, Mech. Syst. Signal Process. 40 (2013) 701 (frequency-domain nonlinear subspace identification).

use super::force::{Effect, Site};
use super::identify::{Split, further, main_period, pool, residuals};
use super::judge::Residuals;
use super::linear::{ForceSeries, LinearFit, Task};
use super::measurement::{Measurement, Quantity, Series};
use super::motion::{Band, Motion, PARTS, reconstructed};
use super::pole::Pole;
use super::subspace::distinct;
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::study::Cancel;

/// Gaps that are tried, as shares of the largest displacement; the second list about the best places.
const GAPS: [f64; 3] = [0.22, 0.35, 0.55];
const FINER_GAPS: [f64; 5] = [0.15, 0.27, 0.31, 0.4, 0.46];
/// Share of the velocity's deviation within which friction changes its sign while it is screened.
const SMOOTHING: f64 = 0.05;
/// Where accelerations are integrated, slower parts than this share of the lowest mode are cut off; both are tried.
const CORNERS: [f64; 2] = [0.25, 0.8];
/// Above this multiple of the band's end measured displacements are cut off.
const ABOVE: f64 = 1.3;
/// Rates and rows of the pool of poles.
const RATES: [(usize, usize); 1] = [(3, 40)];
/// Refinement steps of a screened candidate.
const STEPS: usize = 2;
/// Rows that a candidate's fit looks at, about.
const ROWS: usize = 5000;
/// Share by which a candidate may lie behind the best and still be looked at closer.
const NEAR: f64 = 1.3;
/// Sites at most between two sensors.
const MOST_PAIRS: usize = 10;

/// A force where and how it was screened.
#[derive(Clone)]
pub(crate) struct Candidate {
    pub(crate) effect: Effect,
    pub(crate) site: Site,
    /// The gap, or the velocity within which friction changes its sign.
    pub(crate) inner: f64,
    /// Of the fitted and the unseen records, divided by `unit`.
    pub(crate) fitted: ForceSeries,
    pub(crate) unseen: ForceSeries,
    pub(crate) unit: f64,
    /// The motion that it depends on, of the fitted records.
    pub(crate) motion: Vec<Vec<f64>>,
    pub(crate) poles: Vec<Pole>,
    /// RMS that is left on the records never fitted.
    pub(crate) error: f64,
}

/// Motions across a site along all records.
struct SiteMotion {
    site: Site,
    fitted: Vec<Motion>,
    unseen: Vec<Motion>,
}

/// What is needed to screen.
pub(crate) struct Screen<'a> {
    pub(crate) measurement: &'a Measurement,
    pub(crate) split: &'a Split,
    /// Poles of the linear model.
    pub(crate) poles: &'a [Pole],
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

    fn sites(&self) -> Vec<Site> {
        let mut places: Vec<usize> = self.measurement.sensors.iter().map(|s| s.place()).collect();
        places.sort_unstable();
        places.dedup();
        let mut sites: Vec<Site> = places.iter().map(|p| Site::Ground(*p)).collect();
        let pairs =
            places.iter().enumerate().flat_map(|(k, i)| places[k + 1..].iter().map(move |j| Site::Between(*i, *j)));
        sites.extend(pairs.take(MOST_PAIRS));
        sites
    }

    /// The lowest frequency of the motion and the end of its band, Hz.
    pub(crate) fn band(&self) -> (f64, f64) {
        let omega = self.poles.iter().map(|p| p.frequency());
        let lowest = omega.clone().fold(f64::INFINITY, f64::min);
        let strongest = main_period(&self.split.fitted).recip();
        (lowest.max(0.3 * strongest).min(strongest), omega.fold(0.0, f64::max).max(strongest))
    }

    fn motions(&self, corner: f64) -> Vec<SiteMotion> {
        let (slowest, fastest) = self.band();
        let of = |series: &Series, site: Site| -> Option<Motion> {
            let weights = Self::across(self.measurement, site)?;
            let mut sum: Option<Motion> = None;
            for (k, weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                let quantity = self.measurement.sensors[k].quantity;
                let low = if quantity == Quantity::Displacement { 0.0 } else { corner * slowest };
                let band = Band { low, high: ABOVE * fastest };
                let own = reconstructed(&series.outputs[k], series.interval, quantity, band, (slowest, self.noises[k]));
                let total = sum.get_or_insert_with(|| Motion {
                    displacement: vec![0.0; own.displacement.len()],
                    velocity: vec![0.0; own.velocity.len()],
                });
                total.displacement.iter_mut().zip(&own.displacement).for_each(|(t, v)| *t += weight * v);
                total.velocity.iter_mut().zip(&own.velocity).for_each(|(t, v)| *t += weight * v);
            }
            sum
        };
        let all = |series: &[Series], site: Site| series.iter().map(|s| of(s, site)).collect::<Option<Vec<_>>>();
        let sites = self.sites();
        let found = sites.into_par_iter().map(|site| {
            Some(SiteMotion { site, fitted: all(&self.split.fitted, site)?, unseen: all(&self.split.unseen, site)? })
        });
        found.collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// All candidates, the best first; `report` hears the share that is done.
    pub(crate) fn candidates(&self, report: &(dyn Fn(f64) + Sync), cancel: &Cancel) -> Vec<Candidate> {
        let measured = self.measurement.sensors.iter().all(|s| s.quantity == Quantity::Displacement);
        let corners = if measured { &CORNERS[..1] } else { &CORNERS[..] };
        let motions: Vec<SiteMotion> = corners.iter().flat_map(|c| self.motions(*c)).collect();
        let rough = |m: &SiteMotion, effect: Effect| -> Vec<f64> {
            if effect == Effect::Clearance { GAPS.iter().map(|g| g * largest(m)).collect() } else { vec![inner(m)] }
        };
        let mut tasks: Vec<(usize, Effect, f64)> = Vec::new();
        for (k, motion) in motions.iter().enumerate() {
            for effect in Effect::ALL {
                tasks.extend(rough(motion, effect).into_iter().map(|g| (k, effect, g)));
            }
        }
        let run = |tasks: Vec<(usize, Effect, f64)>| -> Vec<Candidate> {
            let all: Vec<Option<Candidate>> = tasks
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
        let Some(best) = found.first().map(|c| c.error) else { return found };
        let mut places: Vec<Site> = Vec::new();
        for c in found.iter().filter(|c| c.error < NEAR * best) {
            if !places.contains(&c.site) {
                places.push(c.site);
            }
        }
        let mut finer: Vec<(usize, Effect, f64)> = Vec::new();
        for site in places.into_iter().take(2) {
            let at = motions.iter().enumerate().filter(|(_, m)| m.site == site);
            for (k, motion) in at {
                finer.extend(FINER_GAPS.iter().map(|g| (k, Effect::Clearance, g * largest(motion))));
            }
        }
        found.extend(run(finer));
        report(1.0);
        sort(&mut found);
        found
    }

    fn candidate(&self, motion: &SiteMotion, effect: Effect, inner: f64, cancel: &Cancel) -> Option<Candidate> {
        let argument = |m: &Motion| if effect.is_of_velocity() { m.velocity.clone() } else { m.displacement.clone() };
        let force = |m: &Motion| -> Vec<f64> { argument(m).into_iter().map(|x| effect.at(x, inner)).collect() };
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
        let motion = motion.fitted.iter().map(argument).collect();
        let mut candidate = Candidate {
            effect,
            site: motion_site,
            inner,
            fitted,
            unseen,
            unit,
            motion,
            poles: Vec::new(),
            error: f64::INFINITY,
        };
        let path = self.open_path(&candidate.fitted, &candidate.unseen, self.poles, self.modes, STEPS, cancel, true)?;
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
    ) -> Option<Vec<(LinearFit, f64)>> {
        let sensors = &self.measurement.sensors;
        let rows: usize = self.split.fitted.iter().map(Series::len).sum();
        let stride = if last { rows.div_ceil(ROWS) } else { 1 };
        let coarse = Task::new(&self.split.fitted, sensors, Some(fitted), rows.div_ceil(ROWS));
        let task = Task::new(&self.split.fitted, sensors, Some(fitted), stride);
        let judge = Task::new(&self.split.unseen, sensors, Some(unseen), stride);
        let found = pool(&self.split.fitted, Some(fitted), &RATES);
        let pool = distinct(known.iter().copied().chain(found), 0.006, 0.5);
        let mut poles: Vec<Pole> = Vec::new();
        let mut all = Vec::new();
        while poles.len() < most {
            if cancel.is_cancelled() {
                return None;
            }
            let Some(next) = further(&coarse, &poles, &pool) else { break };
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
    pub(crate) fn left(&self, fitted: &ForceSeries, unseen: &ForceSeries, fit: &LinearFit) -> Option<Residuals> {
        let task = Task::new(&self.split.fitted, &self.measurement.sensors, Some(fitted), 1);
        let judge = Task::new(&self.split.unseen, &self.measurement.sensors, Some(unseen), 1);
        let own = task.fit(&fit.poles)?;
        let drives = self.measurement.inputs.len() + 1;
        Some(Residuals {
            fitted: residuals(&task, &own, &self.split.fitted),
            unseen: judge.unseen(&own)?,
            unknowns: own.poles.len() * (2 + drives * self.measurement.sensors.len()),
        })
    }
}

fn sort(candidates: &mut [Candidate]) {
    candidates.sort_by(|a, b| a.error.total_cmp(&b.error));
}

fn largest(motion: &SiteMotion) -> f64 {
    motion.fitted.iter().flat_map(|m| &m.displacement).fold(0.0, |a, x| a.max(x.abs()))
}

fn inner(motion: &SiteMotion) -> f64 {
    SMOOTHING * motion.fitted.iter().map(|m| deviation(&m.velocity)).fold(0.0, f64::max)
}

pub(crate) fn deviation(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}
