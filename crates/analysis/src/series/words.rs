//! A trend in words and figures.

use super::{LEAST_RECORDS, ParameterSeries, Trend};
use sindyscope_values::format::number::{format_measured, significant};

/// What is said of how a parameter goes along a series: the same on the terminal, in the window and in a report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrendWords {
    /// Its value at the middle of the series, ± standard error.
    pub level: String,
    /// The place to which that belongs.
    pub centre: String,
    /// Change for 1 of the abscissa, ± standard error; none where it is not more than chance.
    pub slope: Option<String>,
    /// Standard deviation between records beyond their standard errors; none where these say it all.
    pub scatter: Option<String>,
    /// Chance of a slope as steep where there is none.
    pub chance: String,
}

impl ParameterSeries {
    /// The trend in words.
    ///
    /// # Errors
    /// Why there is none: too few records have the parameter.
    pub fn words(&self) -> Result<TrendWords, String> {
        match &self.trend {
            Some(trend) => Ok(TrendWords::new(trend)),
            None => Err(format!("in {} records, too few for a trend ({LEAST_RECORDS})", self.points.len())),
        }
    }
}

impl TrendWords {
    fn new(trend: &Trend) -> Self {
        Self {
            level: format_measured(trend.level, Some(trend.level_error)),
            centre: significant(trend.centre, 3),
            slope: trend.told().then(|| format_measured(trend.slope, Some(trend.slope_error))),
            scatter: (trend.scatter > 0.0).then(|| significant(trend.scatter, 2)),
            chance: significant(trend.p_value, 2),
        }
    }
}
