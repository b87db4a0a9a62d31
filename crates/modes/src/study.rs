//! Records in, structure out.

use super::error::ModesError;
use super::identify::{Linear, PathRequest, Split, linear, path};
use super::judge::Residuals;
use super::limits::BAND_MARGIN;
use super::measurement::{Measurement, SensorSeries};
use super::outcome::{RecordFit, Structure};
use super::screen::driven_band;
use super::settings::Base;
use super::start::RecordStart;
use sindyscope_core::signal::standard_deviation;
use sindyscope_core::study::{Cancel, Score};
use sindyscope_values::model::Mode;
use sindyscope_values::record::{RecordSet, Usage};

/// Identifies the modes of a structure.
///
/// `base` says their number, or from which poles they are fitted; without either data never fitted choose the number: the records held
/// out or, where there are none, the last record or the end of the only one, which are fitted once it is chosen.
///
/// # Errors
/// Records that do not go together or show no oscillation; cancelled.
pub fn identify(records: &RecordSet, base: &Base, cancel: &Cancel) -> Result<Structure, ModesError> {
    let measurement = Measurement::new(records, cancel)?;
    Ok(structure(&measurement, &of_base(&measurement, base, cancel)?))
}

/// The linear model of all fitted records from the poles that a base has, or as many as the data ask for.
pub(crate) fn of_base(measurement: &Measurement, base: &Base, cancel: &Cancel) -> Result<Linear, ModesError> {
    if !base.poles.is_empty() {
        return linear(measurement, &base.poles, cancel);
    }
    let request = PathRequest { modes: base.modes, ..PathRequest::default() };
    let path = path(measurement, &Split::new(measurement), &request, cancel)?;
    linear(measurement, &path.steps[path.chosen].poles, cancel)
}

pub(crate) fn structure(measurement: &Measurement, linear: &Linear) -> Structure {
    Structure {
        sensors: measurement.sensors.clone(),
        inputs: measurement.inputs.clone(),
        in_band: in_band(measurement, &linear.modes),
        modes: linear.modes.clone(),
        participation: linear.participation.clone(),
        noise_floor: noise_floor(measurement),
        records: record_fits(measurement, &Split::whole(measurement), &linear.residuals, &linear.starts),
    }
}

/// True for each mode in the band that the inputs drive.
pub(crate) fn in_band(measurement: &Measurement, modes: &[Mode]) -> Vec<bool> {
    let inside = |frequency: f64| {
        driven_band(&measurement.fitted)
            .is_none_or(|(low, high)| frequency > (1.0 - BAND_MARGIN) * low && frequency < (1.0 + BAND_MARGIN) * high)
    };
    modes.iter().map(|m| inside(m.frequency)).collect()
}

/// Standard deviation of the first sensor's noise, in its unit.
pub(crate) fn noise_floor(measurement: &Measurement) -> Option<f64> {
    let of = |s: &SensorSeries| standard_deviation(&s.outputs[0]);
    let mut all: Vec<f64> = measurement.fitted.iter().filter_map(of).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).map(|noise| noise * measurement.sensors[0].scale)
}

/// Scores of every record that a model was fitted to or that was held out of it; `split` are the records that the residuals are of,
/// `starts` how the fitted ones begin.
pub(crate) fn record_fits(
    measurement: &Measurement,
    split: &Split,
    residuals: &Residuals,
    starts: &[RecordStart],
) -> Vec<RecordFit> {
    let of = |usage: Usage, series: &SensorSeries, left: &Vec<Vec<f64>>, start: Option<RecordStart>| RecordFit {
        name: series.name.clone(),
        usage,
        samples: series.len(),
        interval: series.interval,
        scores: (0..measurement.sensors.len())
            .filter_map(|s| {
                let score = Score::of_residual(&series.outputs[s][..left[s].len()], &left[s])?;
                Some(score.scaled(measurement.sensors[s].scale))
            })
            .collect(),
        start,
    };
    let fitted = split.fitted.iter().zip(&residuals.fitted).enumerate();
    let fitted = fitted.map(|(k, (s, left))| of(Usage::Fit, s, left, starts.get(k).cloned()));
    let unseen = split.unseen.iter().zip(&residuals.unseen).map(|(s, left)| of(Usage::HeldOut, s, left, None));
    fitted.chain(unseen).collect()
}
