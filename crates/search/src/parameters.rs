//! The parameters that records share, part by part.

/// Something of each shared parameter of a composition: its value, its scale, its bounds, its position in the optimiser's row.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Parameters<T = f64> {
    /// One a term of an acceleration.
    pub(super) coefficients: Vec<T>,
    /// What stands inside terms.
    pub(super) inner: InnerValues<T>,
}

/// Something of each quantity inside a composition's terms.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct InnerValues<T = f64> {
    /// The displacement from which others count, where it is fitted.
    pub(super) equilibrium: Option<T>,
    /// For each form, its inner quantities.
    pub(super) forms: Vec<Vec<T>>,
}

impl<T> Parameters<T> {
    /// All in the order in which the optimiser has them.
    pub(super) fn row(self) -> Vec<T> {
        let InnerValues { equilibrium, forms } = self.inner;
        self.coefficients.into_iter().chain(equilibrium).chain(forms.into_iter().flatten()).collect()
    }
}

impl<T: Clone> Parameters<T> {
    /// A row of the optimiser's, part by part: its end is told apart as another's inner values are, which are no more than it
    /// has.
    pub(super) fn of_row<U>(row: &[T], like: &InnerValues<U>) -> Self {
        let inside = like.forms.iter().map(Vec::len).sum::<usize>() + usize::from(like.equilibrium.is_some());
        let (coefficients, mut rest) = row.split_at(row.len() - inside);
        let mut next = |count: usize| {
            let (own, others) = rest.split_at(count);
            rest = others;
            own.to_vec()
        };
        let equilibrium = next(usize::from(like.equilibrium.is_some())).pop();
        let forms = like.forms.iter().map(|own| next(own.len())).collect();
        Self { coefficients: coefficients.to_vec(), inner: InnerValues { equilibrium, forms } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_told_apart_as_it_was_put_together() {
        let parts = Parameters {
            coefficients: vec![1.0, 2.0],
            inner: InnerValues { equilibrium: Some(3.0), forms: vec![vec![], vec![4.0, 5.0]] },
        };
        let row = parts.clone().row();
        assert_eq!(row, [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(Parameters::of_row(&row, &parts.inner), parts);
    }
}
