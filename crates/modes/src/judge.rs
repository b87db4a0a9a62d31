//! Models held against each other on data that neither was fitted to, by the one rule of the search for missing effects.

use sindyscope_search::{CONSTANTS, Lead};

/// What a model leaves, sensor by sensor, in units of the sensors' RMS.
#[derive(Clone, Debug, Default)]
pub(crate) struct Residuals {
    /// On the fitted records: `fitted[record][sensor][sample]`.
    pub(crate) fitted: Vec<Vec<Vec<f64>>>,
    /// On records never fitted.
    pub(crate) unseen: Vec<Vec<Vec<f64>>>,
    /// Values that were fitted.
    pub(crate) unknowns: usize,
}

impl Residuals {
    /// RMS over all sensors of the records never fitted.
    pub(crate) fn unseen_rms(&self) -> f64 {
        rms(self.unseen.iter().flatten())
    }

    /// RMS over all sensors of the fitted records.
    pub(crate) fn fitted_rms(&self) -> f64 {
        rms(self.fitted.iter().flatten())
    }

    /// Log predictive density of each block of the records never fitted; `intervals` are the unseen records' sampling
    /// intervals, `period` the main period, s.
    pub(crate) fn densities(&self, intervals: &[f64], period: f64) -> Vec<f64> {
        let sensors = self.fitted.first().map_or(0, Vec::len);
        let scales: Vec<f64> = (0..sensors)
            .map(|s| {
                let all: Vec<f64> = self.fitted.iter().flat_map(|r| r[s].iter().copied()).collect();
                CONSTANTS.student_scale(&all, self.unknowns / sensors.max(1)).max(1e-6)
            })
            .collect();
        let seconds: f64 = self.unseen.iter().zip(intervals).map(|(r, dt)| r[0].len() as f64 * dt).sum();
        let block = CONSTANTS.block_length(period, seconds);
        let mut all = Vec::new();
        for (record, interval) in self.unseen.iter().zip(intervals) {
            let n = record[0].len();
            let count = ((n as f64 * interval / block).round() as usize).max(1);
            for k in 0..count {
                let range = k * n / count..(k + 1) * n / count;
                let own = record.iter().zip(&scales);
                all.push(own.map(|(s, scale)| CONSTANTS.density(&s[range.clone()], *scale)).sum());
            }
        }
        all
    }
}

/// RMS of all samples of several series.
pub(crate) fn rms<'a>(series: impl Iterator<Item = &'a Vec<f64>>) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for s in series {
        sum += s.iter().map(|v| v * v).sum::<f64>();
        count += s.len();
    }
    (sum / count.max(1) as f64).sqrt()
}

/// The comparison of two models' blocks.
pub(crate) fn compared(first: &[f64], second: &[f64], against: &str) -> Lead {
    CONSTANTS.compared(first, second, against)
}

/// True if the first model beats the second.
pub(crate) fn beats(first: &[f64], second: &[f64]) -> bool {
    CONSTANTS.is_enough(&compared(first, second, ""))
}
