//! The zero of an angle that turns over. Which way a pendulum hangs does not follow from the point that its motion is about: a sine
//! and a cosine of the angle together say it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::gram::Gram;
use super::{SetRegression, counted_from};
use crate::columns::MotionPath;
use crate::effects::Form;
use crate::site::Placed;
use crate::structure::Composed;
use sindyscope_values::term::Term;

impl SetRegression<'_> {
    /// The point at which a force that repeats with every turn pulls to neither side, within half a turn of the file's zero, where
    /// displacements are counted from a point and go through more than a turn. None without such a force among the forms.
    pub(super) fn turning_point(&self) -> Option<f64> {
        let form = self.forms.iter().find(|form| form.is_periodic())?;
        let span = |path: &MotionPath| {
            let range = |(low, high): (f64, f64), x: &f64| (low.min(*x), high.max(*x));
            let (low, high) = path.x[0].iter().fold((f64::INFINITY, f64::NEG_INFINITY), range);
            high - low
        };
        if !self.present.datum || self.paths.iter().all(|measured| span(&measured.path) < TAU) {
            return None;
        }
        let addition = form.addition(&[]);
        let sine = addition.terms.first()?;
        let cosine = sine.map(|term| counted_from(term, -FRAC_PI_2));
        let replaced: Vec<usize> = self.replaced_by(&addition).collect();
        let kept = (1 + self.constants..self.base.len()).filter(|column| !replaced.contains(column));
        let mut columns: Vec<Vec<f64>> = std::iter::once(0).chain(kept).map(|c| self.base[c].clone()).collect();
        columns
            .extend(self.columns(&Composed { terms: vec![sine.clone(), cosine], ..self.present.compose(self.inner) }));
        let gram = Gram::new(&columns, std::slice::from_ref(&(0..self.rows.len())), self.cancel);
        let solution = gram.solve(&(1..columns.len()).collect::<Vec<_>>())?;
        let [.., with_sine, with_cosine] = solution.coefficients[..] else { return None };
        // −A sin(x − e) is −A cos e sin x + A sin e cos x.
        let point = with_cosine.atan2(-with_sine) - self.present.origin;
        Some((point + PI).rem_euclid(TAU) - PI + self.present.origin)
    }

    /// The columns of a force that repeats with every turn, counted from its own point, and those of the present model that it
    /// takes the place of: what it replaces, and the constants of an open zero.
    pub(super) fn of_turning(&self, form: &Form, point: f64) -> (Vec<Vec<f64>>, Vec<usize>, usize) {
        let addition = form.addition(&[]);
        let from_there = |term: &Term| counted_from(term, point);
        let terms: Vec<Placed> = addition.terms.iter().map(|t| t.map(from_there)).collect();
        let columns = self.columns(&Composed { terms, ..self.present.compose(self.inner) });
        (columns, self.replaced_by(&addition).chain(1..=self.constants).collect(), 0)
    }
}
