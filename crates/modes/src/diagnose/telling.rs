//! A model with a force as plain values.

use super::super::closed::{ClosedModel, Course};
use super::super::force::{Effect, Site};
use super::super::identify::inflation;
use super::super::judge::Residuals;
use super::super::measurement::Measurement;
use super::super::outcome::Structure;
use super::super::pole::Pole;
use super::super::start::RecordStart;
use super::super::study::{in_band, noise_floor, record_fits};
use super::{FittedStructure, ForceParameter, ForceSearch, FoundForce};
use nalgebra::DVector;
use sindyscope_search::Lead;
use sindyscope_values::model::Mode;

/// A model with a force as plain values, the slowest mode first.
struct ToldModel {
    modes: Vec<Mode>,
    participation: Vec<Vec<f64>>,
    drives: Vec<f64>,
    parameters: Vec<ForceParameter>,
    starts: Vec<RecordStart>,
}

impl ForceSearch<'_> {
    /// The model at the end as plain values.
    pub(super) fn told(
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

/// The unit of the displacement at a site, as far as the sensor's own tells.
fn force_unit(measurement: &Measurement, site: Site) -> String {
    let place = match site {
        Site::Ground(i) | Site::Between(i, _) => i,
    };
    let unit = measurement.sensor_at(place).map_or("", |s| measurement.sensors[s].unit.as_str());
    let length = unit.split('/').next().unwrap_or("");
    if length.is_empty() { "1".into() } else { length.to_owned() }
}
