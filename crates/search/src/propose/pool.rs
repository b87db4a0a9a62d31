//! The present model and the effects as columns of one regression.

use std::sync::Arc;

use super::gram::Gram;
use super::{GridPoint, PresentModel, SetRegression};
use crate::effects::Form;
use crate::parameters::InnerValues;
use crate::site::Placed;
use crate::structure::{Composed, counted_from};
use sindyscope_core::signal::dot;
use sindyscope_values::term::{Symbol, Term};

/// Columns of a form at inner values, not whitened.
pub(super) enum FormColumns {
    Made(Vec<Vec<f64>>),
    /// One for each term along the measured motion.
    Along(Composed),
}

impl FormColumns {
    pub(super) fn along(&self) -> Option<&Composed> {
        match self {
            Self::Made(_) => None,
            Self::Along(composed) => Some(composed),
        }
    }
}

impl<'a> SetRegression<'a> {
    pub(super) fn new(model: &'a PresentModel<'a>, forms: &'a [Form]) -> Self {
        let mut new = Self { model, forms, scales: Vec::new(), pool: Vec::new(), gram: Arc::default(), turning: false };
        new.turning = new.has_open_turns();
        model.base.iter().for_each(|column| new.push(column.clone()));
        new
    }

    pub(super) fn push(&mut self, mut column: Vec<f64>) {
        let scale = if self.pool.is_empty() { 1.0 } else { dot(&column, &column).sqrt().max(f64::MIN_POSITIVE) };
        column.iter_mut().for_each(|c| *c /= scale);
        self.pool.push(column);
        self.scales.push(scale);
    }

    /// The columns of a form at inner values, which of the present model's they replace, and how many of them are changed terms of
    /// its own.
    pub(super) fn of_form(&self, form: &Form, inner: &[f64]) -> (FormColumns, Vec<usize>, usize) {
        if self.turning && form.is_periodic() {
            return self.of_turning(form);
        }
        let addition = form.addition(inner);
        let first = 1 + self.model.constants;
        let composed = self.model.composed.clone();
        if form.rewrites_input() {
            let with = self.model.present.with(form);
            let all = with.inner_after(self.model.present, self.model.inner, inner);
            let changed = with.compose(&all);
            let of_input = |placed: &Placed| {
                placed.term.symbols().iter().any(|s| matches!(s, Symbol::Input(_) | Symbol::InputRate(_)))
            };
            let places: Vec<usize> = (0..composed.terms.len()).filter(|k| of_input(&composed.terms[*k])).collect();
            let terms = places.iter().map(|k| changed.terms[*k].clone()).collect();
            let rewrites = places.len();
            let columns = FormColumns::Along(Composed { terms, ..changed });
            return (columns, places.into_iter().map(|k| first + k).collect(), rewrites);
        }
        if addition.offset {
            return (FormColumns::Made(self.model.zeros()), Vec::new(), 0);
        }
        if self.model.present.datum && form.has_a_mean() {
            let equilibrium = Some(self.model.present.origin);
            let from_there = self.model.present.compose(&InnerValues { equilibrium, ..self.model.inner.clone() });
            let mut columns = self.model.columns(&from_there);
            let rewrites = columns.len();
            let own = Composed { terms: addition.terms, internals: addition.internals, ..composed };
            columns.extend(self.model.columns(&own));
            return (FormColumns::Made(columns), (first..first + rewrites).chain(1..first).collect(), rewrites);
        }
        // Displacements count from the equilibrium here as in the present model's own terms.
        let from_there = |term: &Term| match self.model.inner.equilibrium {
            Some(equilibrium) if equilibrium != 0.0 => counted_from(term, equilibrium),
            _ => term.clone(),
        };
        let replaces = self.model.replaced_by(&addition).collect();
        let mut internals = addition.internals;
        internals.iter_mut().flat_map(|e| &mut e.terms).for_each(|t| t.term = from_there(&t.term));
        let terms = addition.terms.iter().map(|t| t.map(from_there)).collect();
        let own = Composed { terms, internals, ..composed };
        (FormColumns::Along(own), replaces, 0)
    }

    /// The products of all columns of the pool: those of columns that came since it was last asked for are made now.
    pub(super) fn gram(&mut self) -> Arc<Gram> {
        Arc::make_mut(&mut self.gram).extend(&self.pool, &self.model.rows.blocks, self.model.cancel);
        Arc::clone(&self.gram)
    }

    /// The columns of a set: the base's that are not replaced, then each effect's.
    pub(super) fn columns_of(&self, set: &[usize], points: &[GridPoint]) -> Vec<usize> {
        let gone = |c: &usize| set.iter().any(|p| points[*p].replaces.contains(c));
        let base = (1..self.model.base.len()).filter(|c| !gone(c));
        base.chain(set.iter().flat_map(|p| points[*p].columns.clone())).collect()
    }
}
