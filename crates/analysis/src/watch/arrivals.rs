//! Which of the rows that arrive are new, and how they lie on the even grid of the samples.

use std::collections::VecDeque;

/// A row that counts.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct NewRow {
    /// Time, s.
    pub(super) time: f64,
    /// A value of each channel; not a number where it is missing.
    pub(super) values: Vec<f64>,
    /// It does not follow the row before: the source has begun anew.
    pub(super) anew: bool,
}

/// What has become of the rows that arrived.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArrivalCounts {
    /// Rows that were taken.
    pub taken: usize,
    /// Rows that had come before, and were taken once.
    pub repeated: usize,
    /// Rows older than the newest, which no longer find their place.
    pub late: usize,
    /// Lines that are no row.
    pub unreadable: usize,
    /// Times at which the source began anew, its clock with it.
    pub restarts: usize,
    /// Gaps between rows.
    pub gaps: usize,
}

/// Tells new rows from repeated and late ones.
#[derive(Debug)]
pub(super) struct Arrivals {
    /// Sampling interval where rows have no time.
    interval: Option<f64>,
    /// The newest rows, by rising time: what comes twice is found among them.
    recent: VecDeque<(f64, Vec<f64>)>,
    /// How long these are kept, s.
    memory: f64,
    /// Rows older than the newest: rows out of order, unless they go on.
    late: Vec<(f64, Vec<f64>)>,
    /// The source said that it begins anew.
    fresh: bool,
    pub(super) counts: ArrivalCounts,
}

/// Rows in a row that are older than the newest, and rise, from which on the clock was set back and nothing is out of order.
const SET_BACK_ROWS: usize = 32;

impl Arrivals {
    /// Of a source without a column of time rows lie `interval` apart, s; rows that come twice are known for `memory` seconds.
    pub(super) fn new(interval: Option<f64>, memory: f64) -> Self {
        let counts = ArrivalCounts::default();
        Self { interval, recent: VecDeque::new(), memory, late: Vec::new(), fresh: false, counts }
    }

    /// The source begins anew: its next row need not be newer.
    pub(super) fn begin_anew(&mut self) {
        self.fresh = true;
    }

    /// Takes a row, and hands on those that count.
    pub(super) fn take(&mut self, time: Option<f64>, values: Vec<f64>, rows: &mut Vec<NewRow>) {
        let newest = self.recent.back().map(|(t, _)| *t);
        let anew = std::mem::take(&mut self.fresh);
        let Some(time) = time else {
            // Without a time a row comes one interval after the one before, whatever happened between.
            let interval = self.interval.unwrap_or(1.0);
            let time = newest.map_or(0.0, |t| t + interval);
            return self.accept(NewRow { time, values, anew: anew && newest.is_some() }, rows);
        };
        match newest {
            Some(newest) if time <= newest => {
                if self.known(time, &values) {
                    self.counts.repeated += 1;
                    // What repeats its rows may still begin anew behind them.
                    self.fresh = anew;
                } else if anew {
                    self.restart(vec![(time, values)], rows);
                } else {
                    self.hold(time, values, rows);
                }
            }
            _ => {
                self.give_up_late();
                self.accept(NewRow { time, values, anew: false }, rows);
            }
        }
    }

    fn known(&self, time: f64, values: &[f64]) -> bool {
        let place = self.recent.partition_point(|(t, _)| *t < time);
        let same = |a: &f64, b: &f64| a == b || (a.is_nan() && b.is_nan());
        self.recent.get(place).is_some_and(|(t, known)| *t == time && known.iter().zip(values).all(|(a, b)| same(a, b)))
    }

    /// Keeps a row that is older than the newest until it shows whether others follow it.
    fn hold(&mut self, time: f64, values: Vec<f64>, rows: &mut Vec<NewRow>) {
        if self.late.last().is_some_and(|(before, _)| time <= *before) {
            self.give_up_late();
        }
        self.late.push((time, values));
        if self.late.len() >= SET_BACK_ROWS {
            let late = std::mem::take(&mut self.late);
            self.restart(late, rows);
        }
    }

    fn restart(&mut self, first: Vec<(f64, Vec<f64>)>, rows: &mut Vec<NewRow>) {
        self.give_up_late();
        self.recent.clear();
        self.counts.restarts += 1;
        for (k, (time, values)) in first.into_iter().enumerate() {
            self.accept(NewRow { time, values, anew: k == 0 }, rows);
        }
    }

    fn give_up_late(&mut self) {
        self.counts.late += std::mem::take(&mut self.late).len();
    }

    fn accept(&mut self, row: NewRow, rows: &mut Vec<NewRow>) {
        self.counts.taken += 1;
        self.recent.push_back((row.time, row.values.clone()));
        while self.recent.front().is_some_and(|(t, _)| row.time - t > self.memory) {
            self.recent.pop_front();
        }
        rows.push(row);
    }
}

/// The even grid of the samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// Sampling interval, s.
    interval: f64,
    /// Time of the first sample of the stretch and the samples since then.
    start: f64,
    samples: usize,
    newest: f64,
}

/// How a row follows the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Follows {
    /// One interval after it.
    Next,
    /// Not: a stretch of its own begins.
    Anew,
    /// Less than half an interval after it: it is no sample of the grid.
    TooSoon,
}

/// How far a step may be off the interval, as a share of it: stamps jitter.
const STEP_TOLERANCE: f64 = 0.3;

impl Grid {
    pub(super) fn new(interval: f64) -> Self {
        Self { interval, start: 0.0, samples: 0, newest: 0.0 }
    }

    /// True before the first row.
    pub(super) fn is_empty(&self) -> bool {
        self.samples == 0
    }

    /// Puts a row onto the grid.
    pub(super) fn place(&mut self, row: &NewRow) -> Follows {
        let step = (row.time - self.newest) / self.interval;
        let first = self.samples == 0 || row.anew;
        if !first && step < 0.5 {
            return Follows::TooSoon;
        }
        self.newest = row.time;
        // An interval that is a little wrong must not shift the samples by more than half of it.
        let slip = (row.time - self.start) / self.interval - self.samples as f64;
        if first || (step - 1.0).abs() > STEP_TOLERANCE || slip.abs() > 0.5 {
            (self.start, self.samples) = (row.time, 1);
            return Follows::Anew;
        }
        self.samples += 1;
        Follows::Next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(arrivals: &mut Arrivals, times: impl IntoIterator<Item = f64>) -> Vec<NewRow> {
        let mut rows = Vec::new();
        times.into_iter().for_each(|t| arrivals.take(Some(t), vec![t.sin()], &mut rows));
        rows
    }

    fn times(range: std::ops::Range<usize>) -> impl Iterator<Item = f64> {
        range.map(|k| 0.01 * k as f64)
    }

    #[test]
    fn rows_that_come_twice_count_once() {
        let mut arrivals = Arrivals::new(None, 10.0);
        assert_eq!(taken(&mut arrivals, times(0..100)).len(), 100);
        // A datagram that was sent again, and a source that begins again with what it had sent.
        assert!(taken(&mut arrivals, times(60..100)).is_empty());
        arrivals.begin_anew();
        let rows = taken(&mut arrivals, times(0..150));
        assert_eq!(rows.len(), 50);
        assert!(!rows[0].anew, "nothing is missing between");
        assert_eq!(arrivals.counts, ArrivalCounts { taken: 150, repeated: 140, ..ArrivalCounts::default() });
    }

    #[test]
    fn rows_out_of_order_are_counted_and_do_not_end_the_stretch() {
        let mut arrivals = Arrivals::new(None, 10.0);
        taken(&mut arrivals, times(0..20));
        taken(&mut arrivals, times(30..50));
        let late = taken(&mut arrivals, times(20..30));
        let rows = taken(&mut arrivals, times(50..60));
        assert!(late.is_empty() && rows.len() == 10 && !rows[0].anew);
        assert_eq!((arrivals.counts.late, arrivals.counts.restarts), (10, 0));
    }

    #[test]
    fn a_clock_that_was_set_back_loses_no_row() {
        let mut arrivals = Arrivals::new(None, 10.0);
        taken(&mut arrivals, times(1000..1100));
        let rows = taken(&mut arrivals, (0..100).map(|k| 0.01 * f64::from(k) + 0.003));
        assert_eq!(rows.len(), 100);
        assert!(rows[0].anew && !rows[1].anew);
        // Told by the source it is seen at once.
        arrivals.begin_anew();
        let rows = taken(&mut arrivals, [0.0, 0.01]);
        assert!(rows.len() == 2 && rows[0].anew);
        assert_eq!((arrivals.counts.restarts, arrivals.counts.late), (2, 0));
    }

    #[test]
    fn steps_of_one_interval_follow_and_others_do_not() {
        let mut grid = Grid::new(0.01);
        let row = |time: f64, anew| NewRow { time, values: vec![], anew };
        let follows: Vec<Follows> =
            [0.0, 0.0101, 0.0199, 0.021, 0.03, 0.05, 0.06].map(|t| grid.place(&row(t, false))).into();
        use Follows::{Anew, Next, TooSoon};
        assert_eq!(follows, [Anew, Next, Next, TooSoon, Next, Anew, Next]);
        assert_eq!(grid.place(&row(0.07, true)), Anew);
        // A clock that is a thousandth off slips by half an interval in five hundred samples.
        let mut grid = Grid::new(0.01);
        let anew = (0..2000).filter(|k| grid.place(&row(0.01001 * f64::from(*k), false)) == Anew).count();
        assert_eq!(anew, 4);
    }
}
