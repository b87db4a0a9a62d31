//! Where sensors stand: what shapes are drawn over.

use serde::{Deserialize, Serialize};

use super::error::ModesError;
use super::measurement::Sensor;

/// Most coordinates of a position: a shape is drawn in a plane.
const MOST_COORDINATES: usize = 2;

/// Where a sensor stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorPosition {
    /// The channel's name.
    pub sensor: String,
    /// One coordinate, or two in a plane, in any unit of length that all share.
    pub at: Vec<f64>,
}

/// Positions as they are written: `a1=0,0.5; a2=0,1.0`.
///
/// # Errors
/// What is no position, in a sentence.
pub fn positions(text: &str) -> Result<Vec<SensorPosition>, String> {
    let mut all: Vec<SensorPosition> = Vec::new();
    for part in text.split(';').map(str::trim).filter(|p| !p.is_empty()) {
        let wrong = || format!("`{part}` is no position: write the sensor and one or two coordinates, a1=0,0.5");
        let (sensor, numbers) = part.split_once('=').ok_or_else(wrong)?;
        let at: Vec<f64> =
            numbers.split(',').map(|n| n.trim().parse()).collect::<Result<_, _>>().map_err(|_| wrong())?;
        let sensor = sensor.trim().to_owned();
        if sensor.is_empty() || at.is_empty() || at.len() > MOST_COORDINATES || at.iter().any(|x| !x.is_finite()) {
            return Err(wrong());
        }
        if all.first().is_some_and(|first| first.at.len() != at.len()) {
            return Err(format!("`{part}` has another number of coordinates than the sensors before it"));
        }
        if all.iter().any(|p| p.sensor == sensor) {
            return Err(format!("the position of `{sensor}` is given twice"));
        }
        all.push(SensorPosition { sensor, at });
    }
    Ok(all)
}

/// The inverse of [`positions`].
pub fn position_text(positions: &[SensorPosition]) -> String {
    let of = |p: &SensorPosition| {
        let at: Vec<String> = p.at.iter().map(f64::to_string).collect();
        format!("{}={}", p.sensor, at.join(","))
    };
    positions.iter().map(of).collect::<Vec<_>>().join("; ")
}

/// The position of each sensor; empty where not all have one.
///
/// # Errors
/// A position of a sensor that there is not.
pub(crate) fn of_sensors(positions: &[SensorPosition], sensors: &[Sensor]) -> Result<Vec<Vec<f64>>, ModesError> {
    let is = |p: &SensorPosition, s: &Sensor| p.sensor.eq_ignore_ascii_case(&s.name);
    if let Some(unknown) = positions.iter().find(|p| !sensors.iter().any(|s| is(p, s))) {
        let known = sensors.iter().map(|s| s.name.as_str()).collect::<Vec<_>>().join(", ");
        return Err(ModesError::UnknownSensor { sensor: unknown.sensor.clone(), known });
    }
    let of = |s: &Sensor| positions.iter().find(|p| is(p, s)).map(|p| p.at.clone());
    Ok(sensors.iter().map(of).collect::<Option<Vec<_>>>().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_read_as_they_are_written() {
        let text = "a1=0,0.5; a2=0,1.25";
        let read = positions(text).expect("positions");
        assert_eq!(position_text(&read), text);
        assert_eq!(read[1], SensorPosition { sensor: "a2".into(), at: vec![0.0, 1.25] });
        for wrong in ["a1", "a1=", "a1=0,1,2", "=3", "a1=nan", "a1=0; a2=0,1", "a1=0; a1=1"] {
            assert!(positions(wrong).is_err(), "{wrong}");
        }
    }
}
