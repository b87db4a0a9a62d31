//! A fit with its effects in another order: the last effect's terms stand behind all others.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::fit::Fitted;
use super::outcome::Choice;
use super::parameters::Parameters;
use super::structure::choice;

impl Fitted {
    /// The same fit with its effects in the order given; those that are not given keep theirs, in front.
    pub(super) fn reordered(&self, order: &[Choice]) -> Self {
        let forms = &self.composition.forms;
        let place = |k: &usize| order.iter().position(|c| *c == choice(&forms[*k])).map_or(0, |p| p + 1);
        let mut sequence: Vec<usize> = (0..forms.len()).collect();
        sequence.sort_by_key(place);
        if sequence.is_sorted() {
            return self.clone();
        }
        let inner = &self.parameters.inner;
        let places = self.composition.places(inner);
        let positions = self.composition.positions();
        let first = places.iter().map(|p| p.start).min().unwrap_or(0);
        let of_terms = (0..first).chain(sequence.iter().flat_map(|k| places[*k].clone()));
        let inside = positions.inner.equilibrium.into_iter();
        let inside = inside.chain(sequence.iter().flat_map(|k| positions.inner.forms[*k].clone()));
        let shared: Vec<usize> = of_terms.map(|k| positions.coefficients[k]).chain(inside).collect();
        // Internal states stand in the order of the effects, behind displacements and velocities.
        let counts: Vec<usize> =
            forms.iter().zip(&inner.forms).map(|(f, own)| f.addition(own).internals.len()).collect();
        let states = 2 * self.composition.layout.freedoms;
        let start = |k: usize| states + counts[..k].iter().sum::<usize>();
        let internal: Vec<usize> = sequence.iter().flat_map(|k| start(*k)..start(*k) + counts[*k]).collect();
        let own = |values: usize| -> Vec<usize> {
            let all = (0..states).chain(internal.iter().copied());
            all.filter(|k| *k < values).collect()
        };
        let row = |values: &[f64]| -> Vec<f64> { shared.iter().map(|k| values[*k]).collect() };
        let mut refined = (*self.refined).clone();
        refined.point.shared = row(&refined.point.shared);
        for state in &mut refined.point.own {
            *state = own(state.len()).into_iter().map(|k| state[k]).collect();
        }
        let covariance = &self.refined.covariance;
        if covariance.nrows() == shared.len() {
            refined.covariance =
                DMatrix::from_fn(shared.len(), shared.len(), |i, j| covariance[(shared[i], shared[j])]);
        }
        if refined.at_bound.len() == shared.len() {
            refined.at_bound = shared.iter().map(|k| self.refined.at_bound[*k]).collect();
        }
        let offsets =
            if refined.point.offsets.is_empty() { 0 } else { self.runs.first().map_or(1, |r| r.outputs.len()) };
        for columns in refined.sensitivities.iter_mut().filter(|c| c.len() >= shared.len() + offsets) {
            let behind = shared.len() + offsets;
            let order: Vec<usize> = shared
                .iter()
                .copied()
                .chain(shared.len()..behind)
                .chain(own(columns.len() - behind).into_iter().map(|k| behind + k))
                .collect();
            *columns = order.into_iter().map(|k| std::mem::take(&mut columns[k])).collect();
        }
        let mut composition = self.composition.clone();
        composition.forms = sequence.iter().map(|k| forms[*k].clone()).collect();
        let scales = self.composition.scales.clone().row();
        let like: Vec<Vec<f64>> = sequence.iter().map(|k| inner.forms[*k].clone()).collect();
        let like = super::parameters::InnerValues { equilibrium: inner.equilibrium, forms: like };
        if scales.len() == shared.len() {
            composition.scales = Parameters::of_row(&row(&scales), &like);
        }
        let parameters = Parameters::of_row(&refined.point.shared, &like);
        let refitted = self.refitted.iter().map(|values| row(values)).collect();
        Self { composition, refined: Arc::new(refined), parameters, refitted, ..self.clone() }
    }
}
