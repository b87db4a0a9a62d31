//! The zero of an angle that turns over. Which way a pendulum hangs does not follow from the point that its motion is about: a sine
//! and a cosine of the angle say it together, beside whatever else acts.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::pool::FormColumns;
use super::{GridPoint, SetRegression, counted_from};
use crate::effects::Form;
use crate::structure::Composed;

impl SetRegression<'_> {
    /// True if displacements are counted from a point and go through more than a turn, and some force repeats with every turn.
    pub(super) fn has_open_turns(&self) -> bool {
        self.model.present.datum && self.forms.iter().any(Form::is_periodic) && self.model.data.turns_over()
    }

    /// True if a form's columns are a sine and a cosine, which say together where its zero is.
    pub(super) fn is_turning(&self, form: usize) -> bool {
        self.turning && self.forms[form].is_periodic()
    }

    /// The columns of a force that repeats with every turn, and those of the present model that it takes the place of: what it
    /// replaces, and the constants of an open zero.
    pub(super) fn of_turning(&self, form: &Form) -> (FormColumns, Vec<usize>, usize) {
        let addition = form.addition(&[]);
        let sine = addition.terms.first();
        let cosine = sine.map(|placed| placed.map(|term| counted_from(term, -FRAC_PI_2)));
        let terms = sine.cloned().into_iter().chain(cosine).collect();
        let columns = FormColumns::Along(Composed { terms, ..self.model.composed.clone() });
        (columns, self.model.replaced_by(&addition).chain(1..=self.model.constants).collect(), 0)
    }

    /// The coefficient of a force that repeats with every turn, and the point at which it pulls to neither side, within half a turn
    /// of the file's zero; `value` gives those of its sine and its cosine.
    pub(super) fn turned(&self, point: &GridPoint, value: impl Fn(usize) -> Option<f64>) -> Option<(f64, f64)> {
        let [sine, cosine] = [value(point.columns.start)?, value(point.columns.start + 1)?];
        // −A sin(x − e) is −A cos e sin x + A sin e cos x.
        let zero = cosine.atan2(-sine) - self.model.present.origin;
        Some((-sine.hypot(cosine), (zero + PI).rem_euclid(TAU) - PI + self.model.present.origin))
    }
}
