//! What is not known of the channels themselves, found with the equation: how late a channel is, and by how much its sensor
//! shows too much.

use super::calibration::{Calibrated, Calibration};
use super::{Cancel, Settings, Study, StudyError};
use crate::prepare::{Preparation, prepare};
use sindyscope_values::record::{Record, RecordSet, Role, Usage};

/// Fits, each of records corrected by what the one before found, at most.
const MAX_ROUNDS: usize = 5;
/// A round that changes every value by less than this many standard errors is the last.
const MIN_CHANGE: f64 = 0.1;
/// A gain with a larger standard error, as a share of it, is not determined by the data.
const MAX_GAIN_ERROR: f64 = 0.2;

/// Finds what is sought of some channels with the coefficients of the terms that the settings keep: the response is fitted to
/// the measurement (output error), the records corrected, and fitted again until nothing changes.
///
/// # Errors
/// Something that no data tell, a channel that is not there, settings that do not fit the records, a model that cannot be
/// fitted to its response; cancelled.
pub fn calibrate(
    records: &RecordSet,
    settings: &Settings,
    sought: &[Calibration],
    cancel: &Cancel,
) -> Result<Vec<Calibrated>, StudyError> {
    let first = records.with(Usage::Fit).next().ok_or(StudyError::NothingToFit)?;
    check(first, sought)?;
    let mut found: Vec<Calibrated> =
        sought.iter().map(|what| Calibrated { what: *what, value: what.neutral(), std_error: None }).collect();
    for _ in 0..MAX_ROUNDS {
        let steps: Vec<Preparation> = found.iter().map(|f| f.treatment().into()).collect();
        let corrected = prepare(records, &steps).map_err(|e| StudyError::Setting(e.to_string()))?;
        let more = Study::default().calibrated(&corrected, settings, sought, cancel)?;
        let mut still = true;
        for (found, more) in found.iter_mut().zip(more) {
            let moved = (more.value - more.what.neutral()).abs();
            still &= more.std_error.is_some_and(|error| moved < MIN_CHANGE * error);
            *found = Calibrated { value: found.what.after(found.value, more.value), ..more };
        }
        if still {
            break;
        }
    }
    let untold = |f: &&Calibrated| match f.what {
        Calibration::Delay(_) => f.std_error.is_none(),
        Calibration::Gain(_) => f.std_error.is_none_or(|error| error > MAX_GAIN_ERROR * f.value.abs()),
    };
    match found.iter().find(untold) {
        Some(Calibrated { what, .. }) => Err(StudyError::Setting(format!(
            "these data do not tell {what}: coefficients make up for it; say more of the model, as with `m2/m1`, or give it with a step of the preparation"
        ))),
        None => Ok(found),
    }
}

/// Holds what is sought against what a record has.
fn check(record: &Record, sought: &[Calibration]) -> Result<(), StudyError> {
    let refused = |text: String| Err(StudyError::Setting(text));
    let sensors: Vec<Role> = record.sensors().map(|c| c.role).collect();
    let inputs: Vec<Role> = record.channels.iter().map(|c| c.role).filter(|r| matches!(r, Role::Input(_))).collect();
    for (k, what) in sought.iter().enumerate() {
        if !sensors.contains(&what.role()) && !inputs.contains(&what.role()) {
            let fitted: Vec<String> =
                sensors.iter().chain(&inputs).map(|r| Calibration::Delay(*r).to_string()).collect();
            return refused(format!(
                "{what}: no response is held against that channel; there are {}. A second sensor of a mass is aligned with the first by `align` in the preparation",
                fitted.join(", ")
            ));
        }
        if sought[..k].contains(what) {
            return refused(format!("{what} is asked for twice"));
        }
    }
    let count = |pick: &dyn Fn(&Calibration) -> bool| sought.iter().filter(|what| pick(what)).count();
    if count(&|what| matches!(what, Calibration::Delay(_))) == sensors.len() + inputs.len() {
        return refused("delays are told against each other: take one channel as being on time".into());
    }
    if count(&|what| matches!(what, Calibration::Gain(_))) == sensors.len() && !sensors.is_empty() {
        return refused("gains are told against each other: take one sensor as being right".into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::prepare::Treatment;
    use crate::study::{Own, calibration_list, known_list, suggest};
    use sindyscope_rig::{Noise, ScenarioOptions, generate};
    use sindyscope_values::term::{Kind, list};

    /// Two masses; the force recorded late by so much, the second sensor showing so many times too much.
    fn chain(late: f64, gain: f64) -> (RecordSet, Settings) {
        let options = ScenarioOptions {
            seed: 4,
            duration: Some(10.0),
            noise: Some(Noise::ShareOfPeak(0.01)),
            ..ScenarioOptions::default()
        };
        let records = RecordSet::new(generate("two-masses", &options).unwrap().records, Usage::Fit);
        let wrong = [
            Treatment::Align { role: Role::Input(0), delay: Some(-late) },
            Treatment::Gain { role: Role::Displacement(1), gain: 1.0 / gain },
        ];
        let records = prepare(&records, &wrong.map(Preparation::from)).unwrap();
        let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
        let own = |terms: &str| Own { terms: Some(list(terms).unwrap()), ..Own::default() };
        settings.own = [(0, own("x1, x2-x1, v1, v2-v1, u")), (1, own("x2-x1, v2-v1"))].into();
        settings.known = known_list("m2/m1=0.5").unwrap();
        settings.threshold = 0.0;
        (records, settings)
    }

    #[test]
    fn a_late_input_and_a_sensor_that_shows_too_much_are_found() {
        let (records, settings) = chain(0.013, 1.04);
        let sought = calibration_list("delay(u), gain(x2)").unwrap();
        let found = calibrate(&records, &settings, &sought, &Cancel::default()).unwrap();
        for (found, truth, least) in [(found[0], 0.013, 1e-3), (found[1], 1.04, 0.01)] {
            let error = found.std_error.unwrap();
            assert!(error < least && (found.value - truth).abs() < 4.0 * error, "{found:?}");
        }
        let sensor = calibration_list("delay(x2)").unwrap();
        let found = calibrate(&chain(0.0, 1.0).0, &settings, &sensor, &Cancel::default()).unwrap();
        assert!(found[0].value.abs() < 4.0 * found[0].std_error.unwrap() && found[0].std_error.unwrap() < 1e-3);
    }

    #[test]
    fn what_no_data_tell_is_refused_in_words() {
        let (records, settings) = chain(0.0, 1.0);
        let refused = |text: &str| {
            let sought = calibration_list(text).unwrap();
            calibrate(&records, &settings, &sought, &Cancel::default()).unwrap_err().to_string()
        };
        assert!(refused("delay(u), delay(x1), delay(x2)").contains("on time"));
        assert!(refused("gain(x1), gain(x2)").contains("being right"));
        assert!(refused("delay(a1)").contains("delay(x1), delay(x2), delay(u1)"));
        assert!(refused("delay(u), delay(u)").contains("twice"));
        // Without relative terms each mass may have a unit of its own: coefficients make up for any gain.
        let mut free = Settings { known: Vec::new(), own: BTreeMap::new(), ..settings.clone() };
        free.terms = list("x1, x2, v1, v2, u").unwrap();
        let sought = calibration_list("gain(x2)").unwrap();
        let error = calibrate(&records, &free, &sought, &Cancel::default()).unwrap_err().to_string();
        assert!(error.contains("do not tell"), "{error}");
        for (text, said) in
            [("delay", "nothing to estimate"), ("gain(u)", "coefficient"), ("lag(x)", "nothing to estimate")]
        {
            assert!(text.parse::<Calibration>().unwrap_err().contains(said), "{text}");
        }
    }
}
