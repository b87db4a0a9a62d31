//! Is there a gap? Questions put to what the fitted model leaves, each a score test: would this be zero but for chance if
//! nothing were missing?
//!
//! The columns of a question are evaluated on the *simulated* motion, which noise does not touch, and what the model's own
//! parameters (initial states and offsets too) can do is projected out, so the tests hold their level. The residual's
//! colour, taken from what is left when all questions are answered, is whitened first.

use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::columns::{Basis, Path};
use super::data::{Data, Series};
use super::effects::{Addition, Form};
use super::fit::Fitted;
use super::outcome::{Evidence, Test};
use super::screen::{Motion, Screened};
use crate::refine::autoregression;
use crate::signal::{dot, rms};
use crate::study::Cancel;
use crate::term::Term;

/// Level of the search: the probability of calling a gap where there is none.
pub const LEVEL: f64 = 1e-4;
/// The same where the sensor's steps are what is left: they are no chance, and repeat with the motion.
const LEVEL_OF_STEPS: f64 = 1e-11;

/// Residual, as a share of the motion, below which a fit is exact.
const EXACT: f64 = 3e-6;
/// Residual, as a share of the noise, below which nothing is left that the sensor could have shown.
const BELOW: f64 = 0.5;

/// Order of the autoregression that describes the residual's colour.
const COLOUR: usize = 6;

/// Hits of the screen that are asked for by name.
const NAMED: usize = 12;

/// The residual's colour, whitened away.
pub(super) struct Whitener {
    coefficients: Vec<f64>,
    spans: Vec<std::ops::Range<usize>>,
}

impl Whitener {
    fn new(data: &Data, residual: &[f64]) -> Self {
        let spans: Vec<_> = data.spans().collect();
        let series: Vec<&[f64]> = spans.iter().map(|s| &residual[s.clone()]).collect();
        Self { coefficients: autoregression(&series, COLOUR).0, spans }
    }

    fn apply(&self, column: &[f64]) -> Vec<f64> {
        let order = self.coefficients.len();
        let mut out = Vec::with_capacity(column.len());
        for span in &self.spans {
            let part = &column[span.clone()];
            out.extend((order..part.len()).map(|n| {
                let predicted: f64 = self.coefficients.iter().enumerate().map(|(k, a)| a * part[n - 1 - k]).sum();
                part[n] - predicted
            }));
        }
        out
    }
}

/// A fitted model, the motion under it, and what the screen says of the catalogue's forms.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    pub(super) fitted: &'a Fitted,
    pub(super) motion: &'a Motion,
    pub(super) forms: &'a [Form],
    pub(super) screened: &'a Screened,
}

impl Data {
    /// Asks whether the fitted model leaves more than noise; none if cancelled.
    pub(super) fn evidence(&self, seen: &Seen<'_>, cancel: &Cancel) -> Option<Evidence> {
        let Seen { fitted, motion, forms, screened } = *seen;
        let shared = &fitted.refined.point.shared;
        let (_, composed) = fitted.composition.model(shared);
        let present = (composed.terms.as_slice(), &shared[..composed.terms.len()]);
        let tangent = self.tangent(fitted);
        let simulated = fitted.by_record(&fitted.refined.simulated);
        let residual: Vec<f64> = fitted.refined.residuals.iter().flatten().copied().collect();
        let groups = self.groups(motion);
        let mut questions: Vec<(String, Vec<Vec<f64>>, f64)> = groups
            .into_iter()
            .map(|(question, forces)| {
                let columns = forces.iter().map(|f| self.respond(f, motion)).collect();
                (question, columns, 1.0)
            })
            .collect();
        for hit in screened.hits.iter().take(NAMED) {
            if cancel.is_cancelled() {
                return None;
            }
            let form = &forms[hit.form];
            let columns =
                self.columns(&form.addition(&hit.inner), &motion.simulated, &motion.variations, present, &simulated);
            // Neighbours on a fine grid ask the same thing: two points of it are one question.
            let asked = 1.0 + form.grid().len() as f64 / 2.0;
            questions.push((format!("Has the shape of {}", form.full_title()), columns, asked));
        }
        let mut all = Basis::default();
        for column in tangent
            .iter()
            .chain(questions.iter().flat_map(|q| &q.1))
            .chain(screened.hits.iter().take(3).flat_map(|h| &h.columns))
        {
            if cancel.is_cancelled() {
                return None;
            }
            all.push(column.clone());
        }
        let mut rest = residual.clone();
        all.remove(&mut rest);
        let whitener = Whitener::new(self, &rest);
        let mut basis = Basis::default();
        for column in &tangent {
            basis.push(whitener.apply(column));
        }
        let mut target = whitener.apply(&residual);
        basis.remove(&mut target);
        let left = whitener.apply(&rest);
        let freedom = left.len().saturating_sub(all.columns.len()).max(1) as f64;
        let variance = dot(&left, &left) / freedom;
        let total: f64 = questions.iter().map(|q| q.2).sum::<f64>() + (forms.len().saturating_sub(NAMED)) as f64;
        let mut tests: Vec<Test> = questions
            .into_iter()
            .filter_map(|(question, columns, _)| {
                let mut own = Basis::default();
                let mut gain = 0.0;
                for column in &columns {
                    if cancel.is_cancelled() {
                        return None;
                    }
                    let mut column = whitener.apply(column);
                    let whole = dot(&column, &column).sqrt();
                    basis.remove(&mut column);
                    if dot(&column, &column).sqrt() > 1e-5 * whole && own.push(column) {
                        let share = own.columns.last().map_or(0.0, |q| dot(q, &target));
                        gain += share * share;
                    }
                }
                let m = own.columns.len() as f64;
                let law = FisherSnedecor::new(m.max(1.0), freedom).ok()?;
                let p = if m > 0.0 && variance > 0.0 { law.sf(gain / m / variance) } else { 1.0 };
                // Šidák's correction for the number of questions.
                let p = if p < 1e-9 { (p * total).min(1.0) } else { 1.0 - (1.0 - p).powf(total) };
                Some(Test { question, p_value: p })
            })
            .collect();
        if cancel.is_cancelled() {
            return None;
        }
        tests.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
        let p_value = tests.first().map_or(1.0, |t| t.p_value);
        let level = if self.stepped { LEVEL_OF_STEPS } else { LEVEL };
        // Below this the simulation's own arithmetic, or the sensor's, is what is left.
        let motion = self.fit().iter().map(|s| rms(&s.measured)).fold(0.0, f64::max);
        let exact = fitted.refined.rmse() < (EXACT * motion).max(BELOW * self.noise);
        Some(Evidence { significant: p_value < level && !exact, p_value: if exact { 1.0 } else { p_value }, tests })
    }

    /// The response to a force that is given at every sample of every fitted record.
    fn respond(&self, force: &[Vec<f64>], motion: &Motion) -> Vec<f64> {
        let mut response = Vec::new();
        let mut column = Vec::new();
        for (force, variation) in force.iter().zip(&motion.variations) {
            variation.respond(force, self.output, &mut response);
            column.extend_from_slice(&response);
        }
        column
    }

    /// Questions that name no effect: forces of any shape in the state, in the input, in time, and with memory.
    fn groups(&self, motion: &Motion) -> Vec<(String, Vec<Vec<Vec<f64>>>)> {
        let scale = |pick: fn(&Path) -> &Vec<f64>| {
            motion.simulated.iter().map(|p| rms(pick(p))).fold(f64::MIN_POSITIVE, f64::max) * 2.0
        };
        let (sx, sv) = (scale(|p| &p.x), scale(|p| &p.v));
        let each = |f: &dyn Fn(usize, &Series, &Path) -> Vec<f64>| -> Vec<Vec<f64>> {
            self.fit().iter().zip(&motion.simulated).enumerate().map(|(k, (s, p))| f(k, s, p)).collect()
        };
        let pointwise = |f: &dyn Fn(f64, f64) -> f64| {
            each(&|_, _, p| p.x.iter().zip(&p.v).map(|(x, v)| f(x / sx, v / sv)).collect())
        };
        let mut state = Vec::new();
        for i in 0..=5_i32 {
            for j in 0..=(5 - i) {
                if i + j >= 2 {
                    state.push(pointwise(&|x, v| x.powi(i) * v.powi(j)));
                }
            }
        }
        state.push(pointwise(&|_, _| 1.0));
        state.push(pointwise(&|_, v| crate::term::sign(v)));
        state.push(pointwise(&|x, _| x.abs()));
        state.push(pointwise(&|x, v| x.abs() * crate::term::sign(v)));
        let mut groups = vec![("Depends on displacement and velocity".to_owned(), state)];
        let lag = |quarters: usize, f: &dyn Fn(f64, f64) -> f64| {
            each(&|_, s, p| {
                let back = (quarters as f64 * 0.25 / (self.frequency * s.interval)).round() as usize;
                (0..s.len()).map(|k| if k >= back { f(p.x[k - back] / sx, p.v[k - back] / sv) } else { 0.0 }).collect()
            })
        };
        let mut memory = Vec::new();
        for quarters in [1, 2, 3] {
            memory.push(lag(quarters, &|x, _| x));
            memory.push(lag(quarters, &|x, _| x.powi(3)));
            memory.push(lag(quarters, &|_, v| crate::term::sign(v)));
        }
        groups.push(("Remembers the motion of up to a period ago".to_owned(), memory));
        let over = |f: &dyn Fn(f64, f64, f64) -> f64| {
            each(&|_, s, p| {
                let n = s.len() as f64;
                (0..s.len()).map(|k| f(2.0 * k as f64 / n - 1.0, p.x[k] / sx, p.v[k] / sv)).collect()
            })
        };
        let time: Vec<Vec<Vec<f64>>> = vec![
            over(&|t, x, _| t * x),
            over(&|t, _, v| t * v),
            over(&|t, x, _| t * t * x),
            over(&|t, _, v| t * t * v),
            over(&|t, _, _| t),
            over(&|_, _, _| 1.0),
        ];
        groups.push(("Changes in the course of a record".to_owned(), time));
        if self.layout.inputs > 0 {
            let largest = |pick: fn(&Series) -> &Vec<Vec<f64>>| {
                self.fit().iter().map(|s| rms(&pick(s)[0])).fold(f64::MIN_POSITIVE, f64::max) * 2.0
            };
            let (su, sdu) = (largest(|s| &s.inputs), largest(|s| &s.input_rates));
            let input = |f: &dyn Fn(f64, f64) -> f64| {
                each(&|_, s, _| s.inputs[0].iter().zip(&s.input_rates[0]).map(|(u, du)| f(u / su, du / sdu)).collect())
            };
            let input = vec![
                input(&|u, _| u),
                input(&|_, du| du),
                input(&|u, _| u * u),
                input(&|u, _| u.powi(3)),
                input(&|u, _| u.powi(5)),
                input(&|_, du| crate::term::sign(du)),
            ];
            groups.push(("Depends on the input".to_owned(), input));
        }
        groups
    }

    /// The least size of each form's effect that these data would have shown, in words: three standard errors of its first
    /// coefficient, as a share of the spring force. Of a cancelled search it is not complete.
    pub(super) fn detectable(&self, seen: &Seen<'_>, cancel: &Cancel) -> Vec<(String, f64)> {
        let Seen { fitted, motion, forms, screened } = *seen;
        let shared = &fitted.refined.point.shared;
        let (_, composed) = fitted.composition.model(shared);
        let present: (&[Term], &[f64]) = (&composed.terms, &shared[..composed.terms.len()]);
        let mut basis = Basis::default();
        for column in self.tangent(fitted) {
            basis.push(column);
        }
        let deviation = fitted.refined.rmse();
        let simulated = fitted.by_record(&fitted.refined.simulated);
        let omega = motion.variations.first().map_or(1.0, |v| v.oscillator.stiffness);
        let spring = omega * motion.measured.iter().map(|p| rms(&p.x)).fold(0.0, f64::max);
        let mut sizes = Vec::new();
        for hit in screened.hits.iter().take_while(|_| !cancel.is_cancelled()) {
            let form = &forms[hit.form];
            let addition: Addition = form.addition(&hit.inner);
            if addition.terms.len() != 1 {
                continue;
            }
            let columns = self.columns(&addition, &motion.simulated, &motion.variations, present, &simulated);
            let Some(mut column) = columns.into_iter().next() else { continue };
            basis.remove(&mut column);
            let size = dot(&column, &column).sqrt();
            let force: f64 = self
                .fit()
                .iter()
                .zip(&motion.simulated)
                .map(|(s, p)| {
                    let f =
                        super::columns::forces(&addition.terms, &addition.internals, &self.layout, s, &s.inputs(), p);
                    rms(&f[0])
                })
                .fold(0.0, f64::max);
            if size > 0.0 && spring > 0.0 {
                sizes.push((form.full_title(), 3.0 * deviation / size * force / spring));
            }
        }
        sizes
    }
}
