//! Rows at which something stands that a term takes to slide: there dry friction is whatever holds it, not its sign.

use std::ops::Range;
use std::sync::Arc;

use crate::signal::{Signals, median, shortest_standstill, standstills, standstills_from};
use sindyscope_values::record::Role;
use sindyscope_values::term::{Expression, Function, Layout, Symbol, Term, derivative};

/// Share of the rows that must be left; with fewer, all are fitted.
const MIN_ROW_SHARE: f64 = 0.05;

/// The stretches of a record's samples in which something stands, in order; `sliding` are the velocities whose sign is taken.
///
/// Only where the displacements that it moves by are measured.
pub(in crate::study) fn standing(sliding: &[Expression], layout: &Layout, signals: &Signals) -> Vec<Range<usize>> {
    let Some(period) = signals.main_period else { return Vec::new() };
    let found = sliding.iter().filter_map(|velocity| SlidingMotion::new(velocity, layout, signals));
    in_order(found.flat_map(|m| standstills(&m.values, m.noise, period / signals.interval)).collect())
}

/// Samples of the shortest standstill of each velocity whose sign is taken, as a record tells them; none where it tells none.
pub(in crate::study) fn shortest_standstills(
    sliding: &[Expression],
    layout: &Layout,
    signals: &Signals,
) -> Vec<Option<usize>> {
    let of = |velocity: &Expression| {
        let motion = SlidingMotion::new(velocity, layout, signals)?;
        shortest_standstill(&motion.values, motion.noise, signals.main_period? / signals.interval)
    };
    sliding.iter().map(of).collect()
}

/// As [`standing`], of a piece of a longer record that tells the shortest standstill of each velocity.
fn standing_from(
    sliding: &[Expression],
    shortest: &[Option<usize>],
    layout: &Layout,
    signals: &Signals,
) -> Vec<Range<usize>> {
    let known = sliding.iter().zip(shortest).filter_map(|(velocity, least)| Some((velocity, (*least)?)));
    let found = known.filter_map(|(velocity, least)| Some((SlidingMotion::new(velocity, layout, signals)?, least)));
    in_order(found.flat_map(|(m, least)| standstills_from(&m.values, m.noise, least)).collect())
}

/// The displacement that a velocity whose sign is taken is the rate of.
struct SlidingMotion {
    values: Vec<f64>,
    /// Standard deviation of its noise.
    noise: f64,
}

impl SlidingMotion {
    /// None where it is not measured.
    fn new(velocity: &Expression, layout: &Layout, signals: &Signals) -> Option<Self> {
        let parts = displacement(velocity, layout, signals)?;
        let mut values = vec![0.0; signals.states.first().map_or(0, Vec::len)];
        let mut variance = 0.0;
        for (channel, factor) in &parts {
            let measured = &signals.measured[*channel];
            values.iter_mut().zip(measured.values.iter()).for_each(|(m, value)| *m += factor * value);
            variance += (factor * measured.noise).powi(2);
        }
        Some(Self { values, noise: variance.sqrt() })
    }
}

/// Stretches in order, those that touch joined.
fn in_order(mut all: Vec<Range<usize>>) -> Vec<Range<usize>> {
    all.sort_by_key(|r| r.start);
    let mut joined: Vec<Range<usize>> = Vec::new();
    for stretch in all {
        match joined.last_mut() {
            Some(last) if last.end >= stretch.start => last.end = last.end.max(stretch.end),
            _ => joined.push(stretch),
        }
    }
    joined
}

/// The velocities whose sign some terms take, each once.
pub(in crate::study) fn sliding<'a>(terms: impl IntoIterator<Item = &'a Term>) -> Vec<Expression> {
    let mut found: Vec<Expression> = Vec::new();
    for term in terms {
        term.expression().visit(&mut |e| {
            if let Expression::Call(Function::Sgn, arguments) = e
                && let Some(velocity) = arguments.first()
                && !found.contains(velocity)
            {
                found.push(velocity.clone());
            }
        });
    }
    found
}

/// Samples from one standstill to the next, the median of all records; none where nothing stands twice. `terms` tell which
/// velocities' signs are taken.
pub(in crate::study) fn stretch_of_sliding(terms: &[Term], layout: &Layout, records: &[Arc<Signals>]) -> Option<usize> {
    let velocities = sliding(terms);
    let mut stretches: Vec<f64> = Vec::new();
    for signals in records {
        let standstills = standing(&velocities, layout, signals);
        stretches.extend(standstills.windows(2).map(|pair| (pair[1].start - pair[0].end) as f64));
    }
    median(stretches).map(|samples| samples as usize)
}

/// Share of a row's own span that must be clear of a standstill, tried in this order: what lies further out weighs little.
const CLEARANCES: [f64; 2] = [1.0, 0.5];

/// How the rows of a record lie on its samples.
#[derive(Clone, Copy, Debug)]
pub(in crate::study) struct RowRaster {
    /// Rows that there are.
    pub(in crate::study) rows: usize,
    /// Sample at the centre of the first.
    pub(in crate::study) first: usize,
    /// Samples from one to the next.
    pub(in crate::study) stride: usize,
    /// Samples on either side of its centre that a row is made of.
    pub(in crate::study) reach: usize,
}

/// The rows of each record that no standstill touches.
pub(super) struct Moving {
    pub(super) rows: Vec<Vec<Range<usize>>>,
}

impl Moving {
    /// Where the records are pieces of a longer one, `shortest` says its shortest standstill of each velocity whose sign is taken: the
    /// rows that are left are then few where a piece stands. Else the records tell it, and all rows count where too few would be
    /// left to fit the terms.
    pub(super) fn new(
        layout: &Layout,
        terms: &[Term],
        records: &[Arc<Signals>],
        shortest: Option<&[Option<usize>]>,
        raster: impl Fn(&Signals) -> RowRaster,
    ) -> Self {
        let sliding = sliding(terms);
        let rasters: Vec<RowRaster> = records.iter().map(|signals| raster(signals)).collect();
        if let Some(shortest) = shortest {
            let of = |(signals, raster): (&Arc<Signals>, &RowRaster)| {
                moving(&standing_from(&sliding, shortest, layout, signals), raster)
            };
            return Self { rows: records.iter().zip(&rasters).map(of).collect() };
        }
        let standing: Vec<Vec<Range<usize>>> =
            records.iter().map(|signals| standing(&sliding, layout, signals)).collect();
        let all: usize = rasters.iter().map(|r| r.rows).sum();
        for share in CLEARANCES {
            let near = |raster: &RowRaster| RowRaster { reach: (share * raster.reach as f64) as usize, ..*raster };
            let moving = |(standing, raster): (&Vec<Range<usize>>, &RowRaster)| moving(standing, &near(raster));
            let rows: Vec<Vec<Range<usize>>> = standing.iter().zip(&rasters).map(moving).collect();
            let left: usize = rows.iter().flatten().map(Range::len).sum();
            if left >= 3 * terms.len() && left as f64 >= MIN_ROW_SHARE * all as f64 {
                return Self { rows };
            }
        }
        let whole = |raster: &RowRaster| std::iter::once(0..raster.rows).collect();
        Self { rows: rasters.iter().map(whole).collect() }
    }

    /// The record and the rows of each stretch, counted among those that are kept.
    pub(super) fn stretches(&self) -> Vec<(usize, Range<usize>)> {
        let mut next = 0;
        let place = |(record, rows): (usize, &Range<usize>)| {
            let from = next;
            next += rows.len();
            (record, from..next)
        };
        let all = self.rows.iter().enumerate().flat_map(|(record, rows)| rows.iter().map(move |r| (record, r)));
        all.map(place).collect()
    }
}

/// Keeps some rows alone of those that series have from a place on.
pub(super) fn keep<'a>(rows: &[Range<usize>], from: usize, series: impl Iterator<Item = &'a mut Vec<f64>>) {
    for values in series {
        let mut next = from;
        for stretch in rows {
            values.copy_within(from + stretch.start..from + stretch.end, next);
            next += stretch.len();
        }
        values.truncate(next);
    }
}

fn moving(standing: &[Range<usize>], raster: &RowRaster) -> Vec<Range<usize>> {
    let mut kept: Vec<Range<usize>> = Vec::new();
    let mut next = 0;
    for row in 0..raster.rows {
        let centre = raster.first + row * raster.stride;
        while standing.get(next).is_some_and(|s| s.end + raster.reach <= centre) {
            next += 1;
        }
        if standing.get(next).is_some_and(|s| s.start <= centre + raster.reach) {
            continue;
        }
        match kept.last_mut() {
            Some(last) if last.end == row => last.end += 1,
            _ => kept.push(row..row + 1),
        }
    }
    kept
}

/// The channels that a sum of velocities is the rate of, with their factors; none if it is anything else, or one is not
/// measured.
fn displacement(velocity: &Expression, layout: &Layout, signals: &Signals) -> Option<Vec<(usize, f64)>> {
    let term = Term::new(velocity.clone());
    let mut parts = Vec::new();
    for symbol in term.symbols() {
        let role = match symbol {
            Symbol::Rate(i) => Role::Displacement(i),
            Symbol::InputRate(j) => Role::Input(j),
            _ => return None,
        };
        let Expression::Number(factor) = derivative(velocity, symbol) else { return None };
        if !layout.has(symbol) {
            return None;
        }
        parts.push((signals.measured.iter().position(|m| m.role == role)?, factor));
    }
    parts.sort_by_key(|p| p.0);
    Some(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_reach_into_a_standstill_go() {
        let raster = |rows, stride| RowRaster { rows, first: 0, stride, reach: 3 };
        assert_eq!(moving(&[10..20, 40..45], &raster(60, 1)), [0..7, 23..37, 48..60]);
        assert_eq!(moving(&[], &raster(5, 2)).first(), Some(&(0..5)));
        assert!(moving(&[0..60, 60..100], &raster(50, 2)).is_empty());
    }

    #[test]
    fn kept_rows_move_up() {
        let mut series = [vec![9.0, 0.0, 1.0, 2.0, 3.0, 4.0]];
        keep(&[0..1, 3..5], 1, series.iter_mut());
        assert_eq!(series[0], [9.0, 0.0, 3.0, 4.0]);
        let moving = Moving { rows: vec![vec![0..1, 3..5], vec![2..4]] };
        assert_eq!(moving.stretches(), [(0, 0..1), (0, 1..3), (1, 3..5)]);
    }

    #[test]
    fn only_signs_of_velocities_tell_of_sliding() {
        let count = |text: &str| sliding(&sindyscope_values::term::list(text).unwrap()).len();
        assert_eq!([count("x"), count("sgn(v), |x|*sgn(v)"), count("sgn(v), sgn(v-du)"), count("v*|v|")], [0, 1, 2, 0]);
    }
}
