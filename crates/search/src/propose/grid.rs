//! The grid of each effect's inner quantities, and a finer one about what the best sets hold.

use std::collections::HashMap;

use super::gram::Gram;
use super::pool::FormColumns;
use super::sets::best_of;
use super::{FoundSets, GridPoint, GridStep, Score, SetRegression};
use crate::columns::COLUMNS_AT_ONCE;
use crate::constants::LARGEST_SET;
use crate::effects::{ForceAxis, Form};
use crate::site::Site;
use crate::structure::Composed;
use sindyscope_core::parallel::prelude::*;

/// Rounds of a finer grid about what the best sets hold: each makes its step a third, and a ninth is near enough for a fit.
const ZOOMS: usize = 2;

impl SetRegression<'_> {
    /// The best points of every form's grid, with their columns in the pool.
    pub(super) fn points(&mut self) -> Vec<GridPoint> {
        let base = Gram::new(&self.pool, std::slice::from_ref(&(0..self.model.rows.len())), self.model.cancel);
        let of_base: Vec<usize> = (1..self.pool.len()).collect();
        let alone = base.solve(&of_base).map_or(f64::INFINITY, |s| s.left);
        let grid: Vec<(usize, Vec<f64>, Vec<GridStep>)> = self
            .forms
            .iter()
            .enumerate()
            .filter(|(_, form)| !form.is_outside())
            .flat_map(|(k, form)| {
                let steps = steps(form);
                form.grid().into_iter().map(move |inner| (k, inner, steps.clone()))
            })
            .collect();
        let mut preloads = self.model.zeros();
        self.model.rows.whiten(&mut preloads);
        let pool: Vec<&[f64]> = self.pool.iter().map(Vec::as_slice).collect();
        let preloaded = base.beside(&pool, &preloads);
        // Something holds a motion that pulsates by itself, and may hide at which frequency: what is met most often does.
        let mut met_often: Vec<(Option<Site>, Gram, Vec<Vec<f64>>)> = Vec::new();
        for site in self.forms.iter().filter(|form| form.pulsates()).map(|form| form.site) {
            if !met_often.iter().any(|(known, ..)| *known == site) {
                let columns = self.commonest(site);
                met_often.push((site, base.beside(&pool, &columns), columns));
            }
        }
        // What it leaves beside the base, and beside a constant force too: under a load a contact lies elsewhere.
        type Built = ([f64; 2], Vec<Vec<f64>>, GridPoint);
        let useful = |(columns, point): (Vec<Vec<f64>>, GridPoint)| -> Option<Built> {
            let form = point.form;
            let beside = |base: &Gram, further: &[Vec<f64>]| {
                self.left_beside((base, further), &columns, (&point.replaces, point.rewrites), form)
            };
            let Form { axis, site, .. } = &self.forms[form];
            let often = met_often.iter().find(|(there, ..)| there == site && self.forms[form].pulsates());
            // Only what depends on the displacement has a place that a load moves.
            let beside_others = match often {
                Some((_, base, columns)) => beside(base, columns),
                None if *axis == ForceAxis::Displacement => beside(&preloaded, &preloads),
                None => None,
            };
            let left = [beside(&base, &[]), beside_others].map(|l| l.unwrap_or(f64::INFINITY));
            // What takes the place of a term may leave more than it alone, and less beside what else is missing.
            let exchanged = !point.replaces.is_empty() && left[0].is_finite();
            // What is met often may be nothing alone, or act the wrong way round, and be right beside another effect: a steady
            // force beside the sine of an angle whose zero is open, friction beside a spring that is none.
            let asked = self.forms[form].is_common();
            (left[0] < alone || left[1] < alone || exchanged || asked).then_some((left, columns, point))
        };
        let built: Vec<Built> = grid
            .chunks(COLUMNS_AT_ONCE)
            .collect::<Vec<_>>()
            .into_par_iter()
            .flat_map_iter(|some| self.with_columns(some).into_iter().filter_map(useful))
            .collect();
        let constants = &self.model.data.constants;
        let mut kept: Vec<Built> = Vec::new();
        for form in 0..self.forms.len() {
            let of_form: Vec<&Built> = built.iter().filter(|(_, _, p)| p.form == form).collect();
            let mut own: Vec<&Built> = Vec::new();
            for (beside, count) in [(0, constants.grid_points), (1, constants.grid_points.div_ceil(3))] {
                let mut sorted = of_form.clone();
                sorted.retain(|b| b.0[beside].is_finite() || beside == 0 && b.0[1].is_infinite());
                sorted.sort_by(|a, b| a.0[beside].total_cmp(&b.0[beside]));
                let further = sorted.into_iter().take(count);
                own.extend(further.filter(|b| !own.iter().any(|o| std::ptr::eq(*o, *b))).collect::<Vec<_>>());
            }
            kept.extend(own.into_iter().cloned());
        }
        kept.into_iter().map(|(_, columns, point)| self.admit(columns, point)).collect()
    }

    /// Columns of what is met most often of forces that depend on the motion at a place.
    fn commonest(&self, site: Option<Site>) -> Vec<Vec<f64>> {
        let over_motion = |form: &Form| matches!(form.axis, ForceAxis::Displacement | ForceAxis::Velocity);
        let is_wanted = |form: &Form| form.site == site && form.is_common() && over_motion(form);
        let there: Vec<_> = self.forms.iter().enumerate().filter(|(_, form)| is_wanted(form)).collect();
        let points: Vec<_> = there.into_iter().map(|(k, _)| (k, Vec::new(), Vec::new())).collect();
        self.with_columns(&points).into_iter().flat_map(|(columns, _)| columns).collect()
    }

    /// Points of forms (index, inner values, steps) with their columns, which are whitened together.
    fn with_columns(&self, points: &[(usize, Vec<f64>, Vec<GridStep>)]) -> Vec<(Vec<Vec<f64>>, GridPoint)> {
        let points: Vec<_> = points.iter().filter(|_| !self.model.cancel.is_cancelled()).collect();
        let wanted: Vec<_> = points.iter().map(|(form, inner, _)| self.of_form(&self.forms[*form], inner)).collect();
        let along: Vec<&Composed> = wanted.iter().filter_map(|(columns, ..)| columns.along()).collect();
        let mut found = self.model.columns_of_each(&along).into_iter();
        let mut all = Vec::new();
        let mut made = Vec::new();
        for ((form, inner, step), (columns, replaces, rewrites)) in points.into_iter().zip(wanted) {
            let own = match columns {
                FormColumns::Made(columns) => columns,
                FormColumns::Along(_) => found.next().unwrap_or_default(),
            };
            let remembers = !self.forms[*form].addition(inner).internals.is_empty();
            let (form, inner, step, columns) = (*form, inner.clone(), step.clone(), 0..own.len());
            all.extend(own);
            made.push(GridPoint { form, inner, step, columns, replaces, rewrites, remembers });
        }
        self.model.rows.whiten(&mut all);
        let mut all = all.into_iter();
        made.into_iter().map(|point| (all.by_ref().take(point.columns.len()).collect(), point)).collect()
    }

    fn admit(&mut self, columns: Vec<Vec<f64>>, point: GridPoint) -> GridPoint {
        let from = self.pool.len();
        columns.into_iter().for_each(|c| self.push(c));
        GridPoint { columns: from..self.pool.len(), ..point }
    }

    /// What one effect's columns leave beside the base's and further ones, of which the products are given; none where its signs
    /// are wrong.
    fn left_beside(
        &self,
        (base, further): (&Gram, &[Vec<f64>]),
        columns: &[Vec<f64>],
        (replaces, rewrites): (&[usize], usize),
        form: usize,
    ) -> Option<f64> {
        let before: Vec<&[f64]> = self.pool[..self.model.base.len()].iter().chain(further).map(Vec::as_slice).collect();
        let gram = base.beside(&before, columns);
        let chosen: Vec<usize> = (1..before.len() + columns.len()).filter(|k| !replaces.contains(k)).collect();
        let own = chosen.len() - columns.len() + rewrites;
        let solution = gram.solve(&chosen)?;
        self.signs_hold(form, &solution.coefficients[own..]).then_some(solution.left)
    }

    /// Makes the grid finer, round by round, about what the best sets hold.
    pub(super) fn zoom(&mut self, points: &mut Vec<GridPoint>, found: &mut FoundSets, beam: usize, by: Score) {
        for _ in 0..ZOOMS {
            if !self.model.cancel.is_cancelled() {
                self.look_between(points, found, beam, by);
            }
        }
    }

    /// Tries points between those of the grid about what the best sets hold, one inner quantity at a time.
    fn look_between(&mut self, points: &mut Vec<GridPoint>, found: &mut FoundSets, beam: usize, by: Score) {
        let sets: Vec<Vec<usize>> = (1..=LARGEST_SET).flat_map(|n| best_of(found, n, beam)).collect();
        let mut new: Vec<(usize, Vec<f64>, Vec<GridStep>)> = Vec::new();
        let mut about: HashMap<usize, std::ops::Range<usize>> = HashMap::new();
        for p in sets.iter().flatten() {
            if about.contains_key(p) || points[*p].inner.is_empty() || self.model.cancel.is_cancelled() {
                continue;
            }
            let form = points[*p].form;
            let from = points.len() + new.len();
            new.extend(between(&points[*p], &self.forms[form]).into_iter().map(|(inner, step)| (form, inner, step)));
            about.insert(*p, from..points.len() + new.len());
        }
        let made: Vec<_> = new
            .chunks(COLUMNS_AT_ONCE)
            .collect::<Vec<_>>()
            .into_par_iter()
            .flat_map_iter(|some| self.with_columns(some))
            .collect();
        for (columns, point) in made {
            points.push(self.admit(columns, point));
        }
        // Of a cancelled search they are not all there.
        if self.model.cancel.is_cancelled() {
            return;
        }
        let gram = self.gram();
        let mut nearer: Vec<Vec<usize>> = Vec::new();
        for set in &sets {
            for (place, p) in set.iter().enumerate() {
                for new in about.get(p).cloned().into_iter().flatten() {
                    let mut changed = set.clone();
                    changed[place] = new;
                    nearer.push(changed);
                }
            }
        }
        self.note(&gram, points, nearer, found, by);
    }
}

/// The steps of a form's grid.
fn steps(form: &Form) -> Vec<GridStep> {
    let of = |grid: &[f64]| {
        let [.., a, b] = grid else { return GridStep::Even(0.0) };
        match grid {
            [first, second, ..]
                if *first > 0.0 && grid.len() > 2 && ((second / first) / (b / a) - 1.0).abs() < 1e-6 =>
            {
                GridStep::Ratio(b / a)
            }
            _ => GridStep::Even(b - a),
        }
    };
    form.inner.iter().map(|inner| of(&inner.grid)).collect()
}

/// Points between a point and its neighbours, one inner quantity at a time, with finer steps.
fn between(point: &GridPoint, form: &Form) -> Vec<(Vec<f64>, Vec<GridStep>)> {
    let mut out = Vec::new();
    for (k, quantity) in form.inner.iter().enumerate() {
        for share in [-2.0 / 3.0, -1.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0] {
            let (mut inner, mut step) = (point.inner.clone(), point.step.clone());
            let (value, finer) = match step[k] {
                GridStep::Even(d) => (inner[k] + share * d, GridStep::Even(d / 3.0)),
                GridStep::Ratio(d) => (inner[k] * d.powf(share), GridStep::Ratio(d.powf(1.0 / 3.0))),
            };
            let (low, high) = quantity.bounds;
            if value > low && value < high && value != inner[k] {
                (inner[k], step[k]) = (value, finer);
                out.push((inner, step));
            }
        }
    }
    out
}
