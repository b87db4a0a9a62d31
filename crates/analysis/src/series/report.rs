//! The report of a series.

use super::{ParameterSeries, Series};
use sindyscope_report::document::{OddRow, Paper, SeriesReport, TrendRow};

impl Series {
    /// Everything that a report tells of the series, under this title.
    pub fn report(&self, title: &str) -> SeriesReport {
        SeriesReport {
            title: title.to_owned(),
            over: self.over.clone(),
            records: self.records,
            figures: self.figures(),
            trends: self.parameters.iter().map(trend_row).collect(),
            odd: self
                .odd
                .iter()
                .map(|odd| OddRow { record: odd.record.clone(), reasons: odd.reasons.clone() })
                .collect(),
            command: None,
            paper: Paper::default(),
        }
    }
}

fn trend_row(parameter: &ParameterSeries) -> TrendRow {
    let (name, records) = (parameter.name.clone(), parameter.points.len());
    match parameter.words() {
        Ok(words) => TrendRow {
            name,
            records,
            level: words.level,
            centre: words.centre,
            trend: words.slope.is_some(),
            slope: words.slope.unwrap_or_else(|| "none".to_owned()),
            scatter: words.scatter.unwrap_or_else(|| "none".to_owned()),
            chance: words.chance,
        },
        Err(_) => TrendRow { name, records, slope: "too few records".to_owned(), ..TrendRow::default() },
    }
}
