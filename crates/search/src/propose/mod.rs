//! Which sets of effects are worth a fit.
//!
//! A model is linear in its coefficients once its inner quantities (a gap, a speed, a delay, a hidden state's rate) are fixed. So
//! one regression in the weak form takes the base model and every effect at every point of its inner grid together, and each
//! set of effects is scored by how well it predicts blocks of data that are left out in turn. The base model's signs are free.
//! It cannot name an effect: it orders the sets that are then fitted. What it costs when it errs is time, or a set not tried.
//!
//! Source: D. Messenger, D. Bortz, Multiscale Model. Simul. 19 (2021) 1474–1497 (weak form).

mod gram;
mod grid;
mod path;
mod pool;
mod present;
mod rows;
mod sets;
mod turning;

use std::collections::HashMap;
use std::sync::Arc;

use super::data::RecordSeries;
use super::effects::Form;
use super::parameters::{InnerValues, Parameters};
use super::structure::{Composition, counted_from};
use gram::Gram;
pub(super) use path::{MeasuredPath, usual_speed};
pub(super) use present::PresentModel;
use sets::ranked;

/// A set of effects with the values that its fit starts from.
#[derive(Clone, Debug)]
pub(super) struct Proposal {
    /// Indices of the forms.
    pub(super) forms: Vec<usize>,
    /// The model with them.
    pub(super) composition: Composition,
    /// Its parameters by the regression.
    pub(super) shared: Vec<f64>,
    /// Log density of the blocks left out in turn, less that of the present model.
    pub(super) gain: f64,
}

/// An effect at one point of its inner grid.
#[derive(Clone, Debug)]
struct GridPoint {
    form: usize,
    inner: Vec<f64>,
    /// Distance of the next point in each direction, of the logarithm where the grid is logarithmic.
    step: Vec<GridStep>,
    /// Its columns in the pool.
    columns: std::ops::Range<usize>,
    /// Columns of the present model that its own take the place of.
    replaces: Vec<usize>,
    /// So many of its columns are terms of the present model, changed: of the input, or counted from another zero. Each stands
    /// for the replaced column of the same place.
    rewrites: usize,
    /// It has a state of its own.
    remembers: bool,
}

#[derive(Clone, Copy, Debug)]
enum GridStep {
    Even(f64),
    Ratio(f64),
}

/// Effects beside a present model as a regression.
struct SetRegression<'a> {
    model: &'a PresentModel<'a>,
    forms: &'a [Form],
    /// Length of each column in the pool before it was scaled to one.
    scales: Vec<f64>,
    /// The present model's columns, then those of effects.
    pool: Vec<Vec<f64>>,
    /// The products of those of the pool's columns that were there when it was last asked for.
    gram: Arc<Gram>,
    /// The zero of a force that repeats with every turn is open.
    turning: bool,
}

/// Best scores found: for each set of forms, sorted, the score and the grid points.
type FoundSets = HashMap<Vec<usize>, (f64, Vec<usize>)>;

/// What sets are scored by.
#[derive(Clone, Copy)]
enum Score {
    /// How well they predict blocks of rows that are left out in turn.
    LeftOut,
    /// How little they leave where all rows count at once.
    AllRows,
}

impl PresentModel<'_> {
    /// Sets of the forms beside the model, best first; the set of none is not among them. A set must bring more than the share
    /// `crumb` of what the best set that it contains gains.
    pub(super) fn propose(&self, forms: &[Form], crumb: f64) -> Vec<Proposal> {
        if self.rows.len() < 4 * (self.base.len() + 2) {
            return Vec::new();
        }
        let mut regression = SetRegression::new(self, forms);
        let mut points = regression.points();
        let found = regression.search(&mut points);
        if self.cancel.is_cancelled() {
            return Vec::new();
        }
        let mut sets: Vec<_> = regression.overlooked(&found, &mut points).into_iter().collect();
        sets.extend(ranked(&found, forms, crumb, &self.data.constants));
        sets.extend(regression.common(&points));
        sets.extend(regression.leaving_least(&found, &mut points));
        let mut known: Vec<Vec<usize>> = Vec::new();
        sets.retain(|(_, set)| {
            let new = !known.contains(set);
            known.push(set.clone());
            new
        });
        let none = found.get(&Vec::new()).map_or(0.0, |f| f.0);
        let proposal = |(score, set): (f64, Vec<usize>)| {
            let chosen: Vec<Form> = set.iter().map(|p| forms[points[*p].form].clone()).collect();
            let start = Proposal { gain: score - none, ..regression.proposal(&set, &points)? };
            Some(self.held_where_it_gains(start, regression.held_about(&set, &points), &chosen))
        };
        let proposals: Vec<Proposal> = sets.into_iter().filter_map(proposal).collect();
        self.data.counters.propose(proposals.len());
        proposals
    }

    /// Log density of the measured accelerations, each block predicted from the others, with the set of forms that predicts them best.
    pub(super) fn density(&self, forms: &[Form]) -> f64 {
        let mut regression = SetRegression::new(self, forms);
        let mut points = regression.points();
        let found = regression.search(&mut points);
        let best = found.values().map(|(score, _)| *score).fold(f64::NEG_INFINITY, f64::max);
        best - self.rows.worth * self.rows.log_scale()
    }

    /// The start of these forms together, displacements counted from a point; none where an effect among them holds the zero.
    fn about(&self, point: f64, forms: &[Form]) -> Option<Proposal> {
        if forms.iter().any(Form::has_a_mean) || self.present.holds_the_zero() {
            return None;
        }
        let from_there = InnerValues { equilibrium: Some(point), ..self.inner.clone() };
        PresentModel::along(self.paths, self.data, self.present, &from_there, self.cancel)
            .whitened()
            .together(forms)
            .map(|(start, _)| start)
    }

    /// The start of exactly these forms together beside the model; none where the data cannot tell their columns apart.
    pub(super) fn exactly(&self, forms: &[Form]) -> Option<Proposal> {
        let (start, about) = self.together(forms)?;
        Some(self.held_where_it_gains(start, about, forms))
    }

    /// A start of forms with displacements counted from where the base model's spring then holds the motion, if that is known; from the
    /// file's own zero where more is gained so. A motion in one of two wells is held about the ridge between them, as far as a cubic
    /// spring is asked.
    fn held_where_it_gains(&self, start: Proposal, about: Option<f64>, forms: &[Form]) -> Proposal {
        let origin =
            Some(self.present.origin).filter(|o| self.present.datum && *o != 0.0 && self.data.is_held_about(*o));
        let from_origin = origin.and_then(|origin| self.about(origin, forms));
        let from_origin = from_origin.filter(|there| there.gain > start.gain + self.data.constants.lead);
        let held =
            || about.and_then(|point| self.about(point, forms)).map(|held| Proposal { gain: start.gain, ..held });
        let found = from_origin.or_else(held);
        found.map(|found| Proposal { forms: start.forms.clone(), ..found }).unwrap_or(start)
    }

    /// The start of exactly these forms together, and the point that the base model's spring then holds the motion about, where
    /// that is open.
    fn together(&self, forms: &[Form]) -> Option<(Proposal, Option<f64>)> {
        let mut regression = SetRegression::new(self, forms);
        let mut points = regression.points();
        let mut found = FoundSets::new();
        let all: Vec<usize> = (0..forms.len()).filter(|k| !forms[*k].is_outside()).collect();
        let mut chosen: Vec<usize> = Vec::new();
        for form in &all {
            let best = (0..points.len()).filter(|p| points[*p].form == *form).max_by(|a, b| {
                let score = |p: usize| regression.gain(&[&chosen[..], &[p]].concat(), &points);
                score(*a).total_cmp(&score(*b))
            })?;
            chosen.push(best);
        }
        let gram = regression.gram();
        regression.note(&gram, &points, vec![chosen], &mut found, Score::LeftOut);
        regression.zoom(&mut points, &mut found, 1, Score::LeftOut);
        let (score, set) = found.into_values().next()?;
        let none = gram.predictive(&regression.columns_of(&[], &points), self.rows.worth);
        let mut start = Proposal { gain: score - none, ..regression.proposal(&set, &points)? };
        let about = regression.held_about(&set, &points);
        // What has no force of its own begins in the middle of its range.
        for (k, form) in forms.iter().enumerate().filter(|(_, form)| form.is_outside()) {
            let Parameters { coefficients, inner } = start.composition.named(&start.shared);
            let mut composition = start.composition.with(form);
            let inner = composition.inner_after(&start.composition, &inner, &[]);
            let paths: Vec<_> = self.data.fit().iter().map(RecordSeries::path).collect();
            composition.scales = self.data.scales(&composition, &inner, &paths);
            start.forms.push(k);
            start = Proposal { composition, shared: Parameters { coefficients, inner }.row(), ..start };
        }
        Some((start, about))
    }
}

impl SetRegression<'_> {
    /// The value of each column of a set.
    fn values(&self, set: &[usize], points: &[GridPoint]) -> Option<HashMap<usize, f64>> {
        let columns = self.columns_of(set, points);
        let chosen: Vec<Vec<f64>> =
            std::iter::once(0).chain(columns.iter().copied()).map(|c| self.pool[c].clone()).collect();
        let gram = Gram::new(&chosen, std::slice::from_ref(&(0..self.model.rows.len())), self.model.cancel);
        let solution = gram.solve(&(1..chosen.len()).collect::<Vec<_>>())?;
        Some(columns.iter().zip(&solution.coefficients).map(|(c, x)| (*c, x / self.scales[*c])).collect())
    }

    /// The point from which the spring of the base model pulls beside a set, where that point is open: the constants beside it
    /// say how far it is from where displacements were counted from. None where it is further off than any motion is held about.
    fn held_about(&self, set: &[usize], points: &[GridPoint]) -> Option<f64> {
        let counted = self.model.inner.equilibrium.filter(|_| self.model.present.datum)?;
        let value = self.values(set, points)?;
        let first = 1 + self.model.constants;
        let spring = self.model.present.plain_terms(self.model.inner).iter().position(|t| t.term.as_str() == "x")?;
        let pull = value.get(&(first + spring))?;
        let force = (1..first).map(|c| value.get(&c)).sum::<Option<f64>>()? / self.model.constants as f64;
        let point = counted - force / pull;
        self.model.data.is_held_about(point).then_some(point)
    }

    /// A set as a model with values to start from.
    fn proposal(&self, set: &[usize], points: &[GridPoint]) -> Option<Proposal> {
        let value = self.values(set, points)?;
        let mut composition = self.model.present.clone();
        let mut inner = self.model.inner.clone();
        for p in set {
            let next = composition.with(&self.forms[points[*p].form]);
            inner = next.inner_after(&composition, &inner, &points[*p].inner);
            composition = next;
        }
        let value = |column: usize| value.get(&column).copied();
        let turning = set.iter().find(|p| self.is_turning(points[**p].form));
        let turned = turning.and_then(|p| self.turned(&points[*p], value));
        inner.equilibrium = inner.equilibrium.map(|e| match turned {
            _ if composition.holds_the_zero() => composition.origin,
            Some((_, point)) => point,
            None => e,
        });
        let first = 1 + self.model.constants;
        let terms = self.model.composed.terms.len();
        // A changed term keeps its place.
        let rewritten = |c: usize| {
            let changed = |p: &GridPoint| p.replaces.iter().take(p.rewrites).position(|r| *r == c);
            set.iter().find_map(|p| changed(&points[*p]).map(|k| points[*p].columns.start + k))
        };
        let base = (first..first + terms).filter_map(|c| value(rewritten(c).unwrap_or(c)));
        let own = set.iter().filter(|p| !self.forms[points[**p].form].is_offset());
        let own = own.flat_map(|p| match turned.filter(|_| Some(p) == turning) {
            Some((coefficient, _)) => vec![coefficient],
            None => points[*p].columns.clone().skip(points[*p].rewrites).filter_map(value).collect(),
        });
        let mut coefficients: Vec<f64> = base.chain(own).collect();
        let ranges = composition.begun().ranges().coefficients;
        if coefficients.len() != ranges.len() {
            return None;
        }
        coefficients.iter_mut().zip(&ranges).for_each(|(c, (low, high))| *c = c.clamp(*low, *high));
        let paths: Vec<_> = self.model.data.fit().iter().map(RecordSeries::path).collect();
        composition.scales = self.model.data.scales(&composition, &inner, &paths);
        let forms = set.iter().map(|p| points[*p].form).collect();
        Some(Proposal { forms, composition, shared: Parameters { coefficients, inner }.row(), gain: 0.0 })
    }
}
