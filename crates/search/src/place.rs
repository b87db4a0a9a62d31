//! Where simulation and measurement disagree: the missing force in time, over the state, along single quantities.

use sindyscope_values::format::units::raised;
use std::f64::consts::TAU;

use super::columns::MotionPath;
use super::data::{Data, RecordSeries};
use super::effects::unit;
use super::outcome::{Map, MissingForce, Place, Profile};
use super::screen::Motion;
use super::site::Site;
use sindyscope_core::signal::{Bins, VisitMean, mean_and_variance, rms};
use sindyscope_values::format::number::significant;
use sindyscope_values::term::Symbol;

/// Cells of the map along each quantity.
const CELLS: usize = 24;
/// Bins of a profile.
const BINS: usize = 24;
/// Stretches that are pointed out.
const WORST: usize = 3;

/// Visits from which on the scatter of their means says how sure a mean is.
const MIN_VISITS: usize = 3;

/// Standard error of a mean over visits; none of too few.
fn error(mean: &VisitMean) -> Option<f64> {
    (mean.visits() >= MIN_VISITS).then(|| mean.error())
}

struct ProfileQuantity {
    name: String,
    /// The motion across a site, not of the input or of time.
    motion: Option<Across>,
    unit: String,
    /// One series a record.
    values: Vec<Vec<f64>>,
}

/// A displacement or a velocity across a site.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Across {
    Displacement(Site),
    Velocity(Site),
}

impl Data {
    /// The mass that lacks most of the force that moves it.
    pub(super) fn lead(&self, motion: &Motion) -> usize {
        let lacks = |mass: usize| {
            let paths = motion.measured.iter().map(|p| rms(&p.x[mass])).fold(f64::MIN_POSITIVE, f64::max);
            motion.missing_of(mass).into_iter().map(rms).fold(0.0, f64::max) / paths
        };
        (1..self.masses()).fold(0, |lead, mass| if lacks(mass) > lacks(lead) { mass } else { lead })
    }

    /// Where the gap is.
    pub(super) fn place(&self, residuals: &[Vec<f64>], motion: &Motion) -> Place {
        let lead = self.lead(motion);
        let missing = motion.missing_of(lead);
        let force = self
            .fit()
            .iter()
            .zip(&missing)
            .zip(motion.deviation.iter().map(|record| &record[lead]))
            .zip(residuals)
            .map(|(((s, force), deviation), e)| MissingForce {
                record: s.name.clone(),
                start: s.start,
                interval: s.interval,
                force: (*force).into(),
                deviation: deviation.as_slice().into(),
                worst: self.worst(s, e.chunks(s.len().max(1)).nth(lead).unwrap_or_default()),
            })
            .collect();
        let quantities = self.quantities(motion);
        let mut profiles: Vec<Profile> = quantities.iter().map(|q| profile(q, &missing)).collect();
        profiles.sort_by(|a, b| b.share.total_cmp(&a.share));
        let find = |across: Across| quantities.iter().find(|q| q.motion == Some(across));
        let spring = if self.base_excited { Site::Base(lead) } else { Site::Ground(lead) };
        let map = match (find(Across::Displacement(spring)), find(Across::Velocity(Site::Ground(lead)))) {
            (Some(x), Some(v)) => map(x, v, &missing),
            _ => Map::default(),
        };
        let acceleration = raised(&unit(&self.unit, (1, -2)));
        let whose = (self.masses() > 1).then_some(lead);
        let sentence = sentence(&profiles, &quantities, (&missing, &motion.measured), (lead, whose), &acceleration);
        Place { sentence, mass: lead, force, map, profiles }
    }

    fn quantities(&self, motion: &Motion) -> Vec<ProfileQuantity> {
        let speed = unit(&self.unit, (1, -1));
        let masses = self.masses();
        let of = |pick: &dyn Fn(&RecordSeries, &MotionPath, usize) -> f64| -> Vec<Vec<f64>> {
            let pairs = self.fit().iter().zip(&motion.measured);
            pairs.map(|(s, p)| (0..s.len()).map(|k| pick(s, p, k)).collect()).collect()
        };
        let input = |series: &[Vec<f64>], k: usize| series.first().map_or(0.0, |u| u[k]);
        let mut list = Vec::new();
        for site in Site::all(masses, self.base_excited) {
            let datum = if matches!(site, Site::Ground(_)) { self.datum } else { 0.0 };
            list.push(ProfileQuantity {
                name: site.displacement(&self.layout),
                motion: Some(Across::Displacement(site)),
                unit: self.unit.clone(),
                values: of(&|s, p, k| site.across(|i| p.x[i][k], input(&s.inputs, k)) + datum),
            });
            list.push(ProfileQuantity {
                name: site.velocity(&self.layout),
                motion: Some(Across::Velocity(site)),
                unit: speed.clone(),
                values: of(&|s, p, k| site.across(|i| p.v[i][k], input(&s.input_rates, k))),
            });
        }
        for (j, length) in self.input_units.iter().enumerate() {
            list.push(ProfileQuantity {
                name: self.layout.name(Symbol::Input(j)),
                motion: None,
                unit: length.clone(),
                values: self.fit().iter().map(|s| s.inputs[j].clone()).collect(),
            });
            list.push(ProfileQuantity {
                name: self.layout.name(Symbol::InputRate(j)),
                motion: None,
                unit: unit(length, (1, -1)),
                values: self.fit().iter().map(|s| s.input_rates[j].clone()).collect(),
            });
        }
        let lead = self.lead(motion);
        let omega = TAU * self.frequency;
        list.push(ProfileQuantity {
            name: "amplitude".into(),
            motion: None,
            unit: self.unit.clone(),
            values: of(&|_, p, k| p.x[lead][k].hypot(p.v[lead][k] / omega)),
        });
        list.push(ProfileQuantity {
            name: "phase".into(),
            motion: None,
            unit: "rad".into(),
            values: of(&|_, p, k| (-p.v[lead][k] / omega).atan2(p.x[lead][k])),
        });
        list.push(ProfileQuantity {
            name: "t".into(),
            motion: None,
            unit: "s".into(),
            values: of(&|s, _, k| s.start + s.interval * k as f64),
        });
        list
    }

    /// The stretches of two periods in which a sensor's error is largest, that do not overlap.
    fn worst(&self, s: &RecordSeries, residual: &[f64]) -> Vec<(f64, f64)> {
        let length = ((2.0 / (self.frequency * s.interval)) as usize).clamp(1, residual.len());
        let mut blocks: Vec<(usize, f64)> = residual.chunks(length).enumerate().map(|(k, c)| (k, rms(c))).collect();
        blocks.sort_by(|a, b| b.1.total_cmp(&a.1));
        let time = |k: usize| s.start + s.interval * k as f64;
        blocks
            .iter()
            .take(WORST)
            .map(|(k, _)| (time(k * length), time(((k + 1) * length).min(residual.len()))))
            .collect()
    }
}

fn map(across: &ProfileQuantity, up: &ProfileQuantity, missing: &[&[f64]]) -> Map {
    let over = |quantity: &ProfileQuantity| Bins::over(quantity.values.iter().flatten(), CELLS);
    let (columns, rows) = (over(across), over(up));
    let cells: Vec<Vec<Option<usize>>> = across
        .values
        .iter()
        .zip(&up.values)
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| Some(rows.index(*b)? * CELLS + columns.index(*a)?)).collect())
        .collect();
    let found = VisitMean::along(CELLS * CELLS, cells.iter().map(Vec::as_slice).zip(missing.iter().copied()));
    Map {
        across: (across.name.clone(), across.unit.clone()),
        up: (up.name.clone(), up.unit.clone()),
        columns: columns.edges().to_vec(),
        rows: rows.edges().to_vec(),
        mean: found.iter().map(VisitMean::mean).collect(),
        score: found.iter().map(|v| error(v).filter(|e| *e > 0.0).map_or(0.0, |e| v.mean() / e)).collect(),
    }
}

fn profile(quantity: &ProfileQuantity, missing: &[&[f64]]) -> Profile {
    let bins = Bins::over(quantity.values.iter().flatten(), BINS);
    let places: Vec<Vec<Option<usize>>> =
        quantity.values.iter().map(|v| v.iter().map(|v| bins.index(*v)).collect()).collect();
    let found = VisitMean::along(BINS, places.iter().map(Vec::as_slice).zip(missing.iter().copied()));
    Profile {
        axis: (quantity.name.clone(), quantity.unit.clone()),
        at: bins.middles().collect(),
        mean: found.iter().map(VisitMean::mean).collect(),
        error: found.iter().map(|v| error(v).unwrap_or(f64::NAN)).collect(),
        share: share(&places, missing),
    }
}

/// Share of the force's energy that the bins' means explain, each half of the data judged by the means of the other.
fn share(places: &[Vec<Option<usize>>], missing: &[&[f64]]) -> f64 {
    const BLOCK: usize = 64;
    let mut sums = vec![[(0.0, 0.0); 2]; BINS];
    let half = |k: usize| (k / BLOCK) % 2;
    for (places, force) in places.iter().zip(missing) {
        for (k, (place, f)) in places.iter().zip(*force).enumerate() {
            if let Some(p) = place {
                let sum = &mut sums[*p][half(k)];
                *sum = (sum.0 + f, sum.1 + 1.0);
            }
        }
    }
    let (mut whole, mut left) = (0.0, 0.0);
    for (places, force) in places.iter().zip(missing) {
        for (k, (place, f)) in places.iter().zip(*force).enumerate() {
            let predicted = place.map_or(0.0, |p| {
                let (sum, count) = sums[p][1 - half(k)];
                if count > 0.0 { sum / count } else { 0.0 }
            });
            whole += f * f;
            left += (f - predicted).powi(2);
        }
    }
    if whole > 0.0 { (1.0 - left / whole).max(0.0) } else { 0.0 }
}

/// A force of springs, dampers and friction goes with the motion; other quantities must explain more to be spoken of.
const SECOND: f64 = 0.75;
/// Share of the force's RMS that its mean makes up where it is called constant.
const CONSTANT: f64 = 0.9;

/// One plain sentence on the profile that explains most.
fn sentence(
    profiles: &[Profile],
    quantities: &[ProfileQuantity],
    (missing, paths): (&[&[f64]], &[MotionPath]),
    (lead, whose): (usize, Option<usize>),
    acceleration: &str,
) -> String {
    let subject = match whose {
        Some(mass) => format!("The missing force on mass {}", mass + 1),
        None => "The missing force".to_owned(),
    };
    let motion = |p: &Profile| quantities.iter().find(|q| q.name == p.axis.0).and_then(|q| q.motion);
    let size = |v: f64| format!("{} {acceleration}", significant(v.abs(), 2)).trim().to_owned();
    let whole = rms(&missing.iter().flat_map(|m| m.iter().copied()).collect::<Vec<f64>>());
    let (mean, _) = mean_and_variance(&missing.iter().flat_map(|m| m.iter().copied()).collect::<Vec<f64>>());
    if mean.abs() > CONSTANT * whole {
        return format!("{subject} is the same everywhere: {} one way.", size(mean));
    }
    let weight = |p: &Profile| p.share * if motion(p).is_some() { 1.0 } else { SECOND };
    let best = profiles.iter().max_by(|a, b| weight(a).total_cmp(&weight(b)));
    let Some(top) = best.filter(|p| p.share > 0.05) else {
        return format!("Spread over the whole motion, {} RMS; no single quantity orders it.", size(whole));
    };
    // Power of the missing force: does it act against the motion?
    let (mut power, mut energy) = (0.0, 0.0);
    for (force, path) in missing.iter().zip(paths) {
        for (f, v) in force.iter().zip(&path.v[lead]) {
            power += f * v;
            energy += (f * v).abs();
        }
    }
    let way = match power / f64::max(energy, f64::MIN_POSITIVE) {
        p if p < -0.4 => ", against the motion",
        p if p > 0.4 => ", along the motion",
        _ => "",
    };
    let sound: Vec<(f64, f64)> =
        top.at.iter().zip(&top.mean).filter(|(_, m)| m.is_finite()).map(|(a, m)| (*a, *m)).collect();
    let largest = sound.iter().map(|(a, _)| a.abs()).fold(0.0, f64::max);
    let level = |inner: bool| {
        let part: Vec<f64> = sound
            .iter()
            .filter(|(a, _)| if inner { a.abs() < 0.35 * largest } else { a.abs() > 0.65 * largest })
            .map(|(_, m)| m.abs())
            .collect();
        mean_and_variance(&part).0
    };
    let (inside, outside) = (level(true), level(false));
    let across = |noun: &str, site: Site| match (site, whose.is_some()) {
        (Site::Ground(_), false) => noun.to_owned(),
        (Site::Base(_), false) => format!("{noun} across the joint"),
        (Site::Ground(i), true) => format!("{noun} of mass {}", i + 1),
        (Site::Joint(i, j), _) => format!("{noun} between masses {} and {}", i + 1, j + 1),
        (Site::Base(i), true) => format!("{noun} of mass {} against the base", i + 1),
    };
    let axis = match (motion(top), top.axis.0.as_str()) {
        (Some(Across::Velocity(site)), _) => across("velocity", site),
        (Some(Across::Displacement(site)), _) => across("displacement", site),
        (None, "u") => "input".to_owned(),
        (None, "du") => "rate of the input".to_owned(),
        (None, name) if name.starts_with('u') => format!("input {name}"),
        (None, name) if name.starts_with("du") => format!("rate of the input {}", &name[1..]),
        (None, "t") => "time".to_owned(),
        (None, other) => other.to_owned(),
    };
    let sides = {
        let side = |s: f64| {
            let part: Vec<f64> = sound.iter().filter(|(a, _)| a * s > 0.0).map(|(_, m)| *m).collect();
            mean_and_variance(&part).0
        };
        let (left, right) = (side(-1.0), side(1.0));
        if left * right < 0.0 && motion(top).is_some() { ", with opposite sign on the two sides of zero" } else { "" }
    };
    let shape = if outside > 2.0 * inside {
        format!("most at large {axis}, up to {}", size(outside))
    } else if inside > 2.0 * outside {
        format!("most near zero {axis}, about {}", size(inside))
    } else {
        format!("at nearly every {axis}, about {}", size(0.5 * (inside + outside)))
    };
    format!("{subject} goes with the {axis} ({:.0} % of it): {shape}{way}{sides}.", 100.0 * top.share)
}
