//! Expressions evaluated along samples for sums that stand for integrals.

use super::expression::{Expression, Function, sign};
use super::{Layout, Program, SampleBlock};

/// Expressions whose jumps are at their instant, not at the nearest sample: a sign is the mean over the interval around
/// each sample, for what it is the sign of taken as straight from one sample to the next.
#[derive(Clone, Debug)]
pub struct Means {
    /// The expressions with those signs held.
    program: Program,
    /// What they are the signs of.
    surfaces: Program,
    count: usize,
}

impl Means {
    /// Compiles expressions.
    pub fn new(expressions: &[Expression], layout: &Layout) -> Self {
        let mut surfaces: Vec<Expression> = Vec::new();
        for e in expressions {
            e.normal().visit(&mut |e| {
                if let Expression::Call(Function::Sgn | Function::Step, arguments) = e
                    && !surfaces.contains(&arguments[0])
                {
                    surfaces.push(arguments[0].clone());
                }
            });
        }
        Self {
            program: Program::with_held_signs(expressions, layout, &surfaces),
            count: surfaces.len(),
            surfaces: Program::new(&surfaces, layout),
        }
    }

    /// Evaluates every expression over samples: one column an expression, appended to `columns`.
    ///
    /// # Panics
    /// If `columns` does not hold one vector an expression.
    pub fn columns(&self, samples: &SampleBlock<'_>, columns: &mut [Vec<f64>]) {
        let mut signs = vec![Vec::new(); self.count];
        self.surfaces.columns(samples, &mut signs);
        signs.iter_mut().for_each(|s| *s = mean_signs(s));
        self.program.columns_under(&signs, samples, columns);
    }
}

/// The mean sign of a series over the interval around each sample.
fn mean_signs(series: &[f64]) -> Vec<f64> {
    // The mean from a sample half way to a neighbour.
    let half = |here: f64, there: f64| {
        let crosses = here / (here - there);
        if here * there < 0.0 && crosses < 0.5 { (4.0 * crosses - 1.0) * sign(here) } else { sign(here) }
    };
    (0..series.len())
        .map(|i| {
            let beside = |k: Option<usize>| k.and_then(|k| series.get(k)).map_or(series[i], |s| *s);
            0.5 * (half(series[i], beside(i.checked_sub(1))) + half(series[i], beside(Some(i + 1))))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::term::{Kind, Term};

    #[test]
    fn a_sum_of_means_is_the_integral_whenever_the_sign_changes() {
        let layout = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: 0, internals: 0 };
        let expressions = ["sgn(x)", "x", "3*step(x)"].map(|t| Term::parse(t).unwrap().expression().clone());
        let means = Means::new(&expressions, &layout);
        for crossing in [3.01, 3.3, 3.5, 3.75, 4.0] {
            let x: Vec<f64> = (0..10).map(|k| k as f64 - crossing).collect();
            let samples = SampleBlock { start: 0.0, interval: 1.0, states: &[&x, &x], inputs: &[], input_rates: &[] };
            let mut columns = vec![Vec::new(); 3];
            means.columns(&samples, &mut columns);
            // From half a sample before the first to half a sample behind the last.
            let integral = 9.0 - 2.0 * crossing;
            let sum: f64 = columns[0].iter().sum();
            assert!((sum - integral).abs() < 1e-12, "{crossing}: {sum} {integral}");
            assert_eq!(columns[1], x);
            assert!((columns[2].iter().sum::<f64>() - 1.5 * (10.0 + sum)).abs() < 1e-12);
        }
    }
}
