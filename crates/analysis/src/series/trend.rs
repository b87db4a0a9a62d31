//! A straight line through parameters with standard errors, some of which may not belong.

use serde_json::{Value, json};
use sindyscope_core::signal::median;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// A record is named as one that does not fit where chance would name one in so many series.
const ODD_BY_CHANCE: f64 = 0.01;
/// A trend is told where chance alone would make one as steep in so many series.
const TREND_BY_CHANCE: f64 = 0.01;
/// Tukey's biweight: a residual of so many standard deviations counts for nothing; 95 % as efficient as least squares.
const BIWEIGHT: f64 = 4.685;
/// The middle of the sizes of normal deviates of unit variance.
const MIDDLE_DEVIATE: f64 = 0.674_489_750_196_082;
/// Rounds of reweighting; it settles in fewer than ten.
const ROUNDS: usize = 40;

/// A parameter of one record.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrendPoint {
    pub(super) at: f64,
    pub(super) value: f64,
    pub(super) std_error: Option<f64>,
}

impl TrendPoint {
    fn variance(&self) -> f64 {
        self.std_error.map_or(0.0, |e| e * e)
    }
}

/// A straight line through the records of a series that fit each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trend {
    /// Mean place of the records, where [`Self::level`] holds.
    pub centre: f64,
    /// Value at the centre.
    pub level: f64,
    /// Standard error of the level.
    pub level_error: f64,
    /// Change of the value for a unit of the abscissa.
    pub slope: f64,
    /// Standard error of the slope.
    pub slope_error: f64,
    /// Standard deviation between records beyond what their standard errors say.
    pub scatter: f64,
    /// Chance of a slope as steep where there is none.
    pub p_value: f64,
    records: usize,
}

/// Fits a line: Theil and Sen's first (P. K. Sen, J. Am. Stat. Assoc. 63 (1968) 1379–1389), then weights of the standard errors and a
/// common scatter, with Tukey's biweight against records that do not belong (P. J. Huber, E. M. Ronchetti, Robust Statistics, 2009).
pub(super) fn fitted(readings: &[TrendPoint]) -> Trend {
    let n = readings.len() as f64;
    let centre = readings.iter().map(|r| r.at).sum::<f64>() / n;
    let mut slopes = Vec::new();
    for (k, a) in readings.iter().enumerate() {
        slopes.extend(readings[k + 1..].iter().filter(|b| b.at != a.at).map(|b| (b.value - a.value) / (b.at - a.at)));
    }
    let mut slope = median(slopes).unwrap_or(0.0);
    let mut level = median(readings.iter().map(|r| r.value - slope * (r.at - centre)).collect()).unwrap_or(0.0);
    let line = |level: f64, slope: f64, r: &TrendPoint| level + slope * (r.at - centre);
    let freedom = (n / (n - 2.0).max(1.0)).sqrt();
    let (mut scatter, mut errors) = (0.0, [0.0; 2]);
    for _ in 0..ROUNDS {
        let residual = |r: &TrendPoint| r.value - line(level, slope, r);
        scatter = common_scatter(readings, &residual, freedom);
        let [mut w, mut wt, mut wtt, mut wy, mut wty] = [0.0; 5];
        for r in readings {
            let variance = (r.variance() + scatter * scatter).max(f64::MIN_POSITIVE);
            let share = residual(r) / (BIWEIGHT * variance.sqrt());
            let weight = if share.abs() < 1.0 { (1.0 - share * share).powi(2) / variance } else { 0.0 };
            let t = r.at - centre;
            w += weight;
            wt += weight * t;
            wtt += weight * t * t;
            wy += weight * r.value;
            wty += weight * t * r.value;
        }
        let determinant = w * wtt - wt * wt;
        if !(w > 0.0 && w.is_finite()) {
            break;
        }
        // All records at one place: a mean.
        let before = (level, slope);
        if determinant > 1e-12 * w * wtt {
            level = (wtt * wy - wt * wty) / determinant;
            slope = (w * wty - wt * wy) / determinant;
            errors = [(wtt / determinant).sqrt(), (w / determinant).sqrt()];
        } else {
            (level, slope) = (wy / w, 0.0);
            errors = [w.recip().sqrt(), 0.0];
        }
        let still = |new: f64, old: f64, error: f64| (new - old).abs() <= 1e-6 * error;
        if still(level, before.0, errors[0]) && still(slope, before.1, errors[1]) {
            break;
        }
    }
    let p_value = student(readings.len()).map_or(1.0, |t| {
        let size = (slope / errors[1]).abs();
        if size.is_finite() { 2.0 * t.sf(size) } else { 1.0 }
    });
    let [level_error, slope_error] = errors;
    Trend { centre, level, level_error, slope, slope_error, scatter, p_value, records: readings.len() }
}

/// The scatter between records beside which the middle residual is what chance makes it.
fn common_scatter(readings: &[TrendPoint], residual: &dyn Fn(&TrendPoint) -> f64, freedom: f64) -> f64 {
    let size = |scatter: f64| {
        let of = |r: &TrendPoint| {
            freedom * residual(r).abs() / (r.variance() + scatter * scatter).sqrt().max(f64::MIN_POSITIVE)
        };
        median(readings.iter().map(of).collect()).unwrap_or(0.0)
    };
    if size(0.0) <= MIDDLE_DEVIATE {
        return 0.0;
    }
    let largest = readings.iter().map(|r| residual(r).abs()).fold(0.0, f64::max);
    let (mut low, mut high) = (0.0, 2.0 * freedom * largest / MIDDLE_DEVIATE);
    for _ in 0..60 {
        let between = 0.5 * (low + high);
        if size(between) > MIDDLE_DEVIATE { low = between } else { high = between }
    }
    high
}

fn student(records: usize) -> Option<StudentsT> {
    StudentsT::new(0.0, 1.0, records.saturating_sub(2).max(1) as f64).ok()
}

impl Trend {
    /// The line's value.
    pub fn at(&self, place: f64) -> f64 {
        self.level + self.slope * (place - self.centre)
    }

    /// Standard error of the line's value.
    pub fn error_at(&self, place: f64) -> f64 {
        self.level_error.hypot(self.slope_error * (place - self.centre))
    }

    /// True if the slope is more than chance.
    pub fn told(&self) -> bool {
        self.p_value < TREND_BY_CHANCE
    }

    /// How far a record lies from the line, in standard deviations.
    pub(super) fn distance(&self, reading: &TrendPoint) -> f64 {
        let deviation = (reading.variance() + self.scatter * self.scatter).sqrt();
        let off = (reading.value - self.at(reading.at)).abs();
        if off == 0.0 { 0.0 } else { off / deviation.max(f64::MIN_POSITIVE) }
    }

    /// The distance beyond which a record does not fit: chance makes one of all of them lie so far in few series.
    pub(super) fn bound(&self) -> f64 {
        let each = 0.5 * ODD_BY_CHANCE / self.records as f64;
        student(self.records).map_or(f64::INFINITY, |t| t.inverse_cdf(1.0 - each))
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "centre": self.centre,
            "level": self.level,
            "level_std_error": self.level_error,
            "slope": self.slope,
            "slope_std_error": self.slope_error,
            "scatter": self.scatter,
            "p_value": self.p_value,
            "told": self.told(),
        })
    }
}
