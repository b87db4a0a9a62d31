//! Is there a gap? Questions put to what the fitted model leaves, each a score test: would this be zero but for chance if
//! nothing were missing?
//!
//! The columns of a question are evaluated on the *simulated* motion, which noise does not touch, and what the model's own
//! parameters (initial states and offsets too) can do is projected out, so the tests hold their level. The residual's
//! colour, taken from what is left when all questions are answered, is whitened first.

use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::columns::MotionPath;
use super::data::{Data, RecordSeries};
use super::effects::{Addition, Form};
use super::fit::{Fitted, WHOLE};
use super::outcome::{Evidence, Test};
use super::screen::{Motion, Screened};
use sindyscope_core::refine::{autoregression, lagged_products};
use sindyscope_core::signal::{dot, rms};
use sindyscope_core::sparse::{LocalColumn, OrthonormalBasis, Stretch};
use sindyscope_core::study::Cancel;

/// Residual, as a share of the motion, below which a fit is exact but for the simulation's own arithmetic.
const EXACT: f64 = 3e-6;
/// Noises of a residual that is no noise whatever its tests say: an estimate of the noise without a model does not err so far.
const FAR: f64 = 10.0;
/// Order of the autoregression that describes the residual's colour, as its smooth spectrum needs it.
const ORDER: usize = 6;

/// The residual's colour, whitened away.
pub(super) struct Whitener {
    /// For each sensor: its autoregression, and the first one's innovation over its own.
    sensors: Vec<(Vec<f64>, f64)>,
    spans: Vec<std::ops::Range<usize>>,
}

impl Whitener {
    /// From a residual out of which a basis was taken. What white noise lost with the basis is put back: where the basis has
    /// the motion's frequencies, noise would seem weak there, and any force at them strong.
    fn new(data: &Data, residual: &[f64], taken: &OrthonormalBasis) -> Self {
        let spans: Vec<_> = data.spans().collect();
        let count = data.outputs.len();
        let of = |sensor: usize| {
            let own = spans.iter().skip(sensor).step_by(count);
            let products = |first: usize, rows: &[f64]| {
                let part = |s: &std::ops::Range<usize>| {
                    let end = s.end.min(first + rows.len());
                    rows.get(s.start.max(first) - first..end.saturating_sub(first)).unwrap_or_default()
                };
                lagged_products(own.clone().map(part), ORDER)
            };
            let mut lost = vec![0.0; ORDER + 1];
            for stretch in taken.columns().iter().flat_map(LocalColumn::stretches) {
                let products = products(stretch.first, &stretch.values);
                lost.iter_mut().zip(products).for_each(|(lost, product)| *lost += product);
            }
            let samples = own.clone().map(|s| s.len()).sum::<usize>() as f64;
            let mut correlation = products(0, residual);
            let variance = correlation[0] / (samples - lost[0]).max(1.0);
            correlation.iter_mut().zip(lost).for_each(|(c, lost)| *c = (*c + variance * lost) / samples.max(1.0));
            autoregression(&correlation)
        };
        let fitted: Vec<(Vec<f64>, f64)> = (0..count).map(of).collect();
        let first = fitted[0].1;
        let relative = |own: f64| if own > 0.0 && first > 0.0 { (first / own).sqrt() } else { 1.0 };
        Self { sensors: fitted.into_iter().map(|(a, variance)| (a, relative(variance))).collect(), spans }
    }

    fn apply(&self, column: &[f64]) -> Vec<f64> {
        self.stretch(0, column).values
    }

    /// A column whitened.
    fn whitened(&self, column: &LocalColumn) -> LocalColumn {
        column.stretches().iter().map(|s| self.stretch(s.first, &s.values)).collect()
    }

    /// A stretch of a column whitened: what stands in a row is felt in those after it.
    fn stretch(&self, first: usize, values: &[f64]) -> Stretch {
        let end = first + values.len();
        let mut out = Stretch { first: 0, values: Vec::with_capacity(values.len() + ORDER) };
        // Where a span's rows begin among those whitened: the first ones of each cannot be predicted.
        let mut begins = 0;
        for (span, (coefficients, scale)) in self.spans.iter().zip(self.sensors.iter().cycle()) {
            let order = coefficients.len();
            let rows = span.len().saturating_sub(order);
            let begun = begins;
            begins += rows;
            if span.end <= first || span.start >= end || rows == 0 {
                continue;
            }
            let from = (first.max(span.start) - span.start).saturating_sub(order);
            let to = (end.min(span.end) - span.start).min(rows);
            let at = |row: usize| row.checked_sub(first).and_then(|k| values.get(k)).copied().unwrap_or(0.0);
            let within = span.start + from >= first && span.start + to + order <= end;
            let padded: Vec<f64>;
            let part = if within {
                &values[span.start + from - first..span.start + to + order - first]
            } else {
                padded = (span.start + from..span.start + to + order).map(at).collect();
                &padded
            };
            if out.values.is_empty() {
                out.first = begun + from;
            }
            out.values.resize(begun + from - out.first, 0.0);
            out.values.extend((order..part.len()).map(|n| {
                let predicted: f64 = coefficients.iter().enumerate().map(|(k, a)| a * part[n - 1 - k]).sum();
                scale * (part[n] - predicted)
            }));
        }
        out
    }
}

/// A fitted model, the motion under it, and what the screen says of the catalogue's forms.
#[derive(Clone, Copy)]
pub(super) struct Examined<'a> {
    pub(super) fitted: &'a Fitted,
    pub(super) motion: &'a Motion,
    pub(super) forms: &'a [Form],
    pub(super) screened: &'a Screened,
}

impl Data {
    /// Asks whether the fitted model leaves more than noise; none if cancelled.
    pub(super) fn evidence(&self, seen: &Examined<'_>, cancel: &Cancel) -> Option<Evidence> {
        let Examined { fitted, motion, forms, screened } = *seen;
        let terms = fitted.terms();
        let present = (terms.as_slice(), fitted.parameters.coefficients.as_slice());
        let tangent = self.tangent(fitted);
        let simulated = fitted.by_record(&fitted.refined.simulated);
        let residual = fitted.rows(&fitted.refined.residuals);
        let groups = self.groups(motion);
        let mut questions: Vec<(String, Vec<Vec<f64>>, f64)> = groups
            .into_iter()
            .map(|(question, forces)| {
                let columns = forces.iter().map(|(mass, f)| self.respond(*mass, f, motion)).collect();
                (question, columns, 1.0)
            })
            .collect();
        for hit in screened.hits.iter().take(2 * self.constants.proposals) {
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
        let mut all = OrthonormalBasis::default();
        let asked = questions.iter().flat_map(|q| &q.1).chain(screened.hits.iter().flat_map(|h| &h.columns));
        for column in tangent.iter().cloned().chain(asked.cloned().map(LocalColumn::from)) {
            if cancel.is_cancelled() {
                return None;
            }
            all.push(column);
        }
        let mut rest = residual.clone();
        all.remove(&mut rest);
        let whitener = Whitener::new(self, &rest, &all);
        let mut basis = OrthonormalBasis::default();
        for column in &tangent {
            basis.push(whitener.whitened(column));
        }
        let mut target = whitener.apply(&residual);
        basis.remove(&mut target);
        let left = whitener.apply(&rest);
        let freedom = left.len().saturating_sub(all.columns().len()).max(1) as f64;
        let variance = dot(&left, &left) / freedom;
        let unasked = forms.len().saturating_sub(2 * self.constants.proposals);
        let total: f64 = questions.iter().map(|q| q.2).sum::<f64>() + unasked as f64;
        let mut tests: Vec<Test> = questions
            .into_iter()
            .filter_map(|(question, columns, _)| {
                let mut own = OrthonormalBasis::default();
                let mut gain = 0.0;
                for column in &columns {
                    if cancel.is_cancelled() {
                        return None;
                    }
                    let mut column = whitener.apply(column);
                    let whole = dot(&column, &column).sqrt();
                    basis.remove(&mut column);
                    if dot(&column, &column).sqrt() > 1e-5 * whole && own.push(column) {
                        let share = own.columns().last().map_or(0.0, |q| q.dot(&target));
                        gain += share * share;
                    }
                }
                let m = own.columns().len() as f64;
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
        let level = self.constants.level_of(self.stepped);
        let far = fitted.refined.rmse() > FAR * self.noise;
        // Below this the simulation's own arithmetic, or the sensor's, is what is left.
        let exact = fitted.refined.rmse() < (EXACT * self.loudest()).max(self.noise / self.constants.loud);
        // What would explain the rest bears no name.
        let (within, _) = self.constants.explaining();
        let settled = !fitted.composition.forms.is_empty() && self.is_within(fitted, (within, within), cancel);
        Some(Evidence {
            significant: (p_value < level || far) && !exact && !settled,
            p_value: if exact { 1.0 } else { p_value },
            tests,
        })
    }

    /// The response to a force on one mass that is given at every sample of every fitted record.
    fn respond(&self, mass: usize, force: &[Vec<f64>], motion: &Motion) -> Vec<f64> {
        let mut response = Vec::new();
        let mut column = Vec::new();
        let shown = self.shown();
        for (force, variation) in force.iter().zip(&motion.variations) {
            variation.respond(&[(mass, force)], &shown, &mut response);
            column.extend_from_slice(&response);
        }
        column
    }

    /// Questions that name no effect: forces of any shape in the state, in the input, in time, and with memory, on each mass.
    fn groups(&self, motion: &Motion) -> Vec<Question> {
        type Kind = fn(&Shapes<'_>) -> Vec<PerRecord>;
        let kinds: [(&str, Kind); 4] = [
            ("Depends on displacement and velocity", |s| s.state()),
            ("Remembers the motion of up to a period ago", |s| s.memory()),
            ("Changes in the course of a record", |s| s.time()),
            ("Depends on the input", |s| s.input()),
        ];
        let masses = self.masses();
        let mut groups: Vec<Question> = Vec::new();
        for (words, kind) in kinds {
            let mut forces = Vec::new();
            for mass in 0..masses {
                let shapes = Shapes { data: self, motion, mass, other: None };
                forces.extend(kind(&shapes).into_iter().map(|f| (mass, f)));
            }
            groups.push((words.to_owned(), forces));
        }
        for other in 1..masses {
            let mut forces = Vec::new();
            for mass in [other - 1, other] {
                let shapes = Shapes { data: self, motion, mass: other - 1, other: Some(other) };
                forces.extend(shapes.state().into_iter().map(|f| (mass, f)));
            }
            groups.push((format!("Depends on the motion between masses {other} and {}", other + 1), forces));
        }
        groups.retain(|(_, forces)| !forces.is_empty());
        groups
    }

    /// The least size of each form's effect that these data would have shown, in words: three standard errors of its first
    /// coefficient, as a share of the spring force. Of a cancelled search it is not complete; there is none where the motion is too
    /// sensitive to be followed whole, for what an effect does to it then grows out of proportion.
    pub(super) fn detectable(&self, seen: &Examined<'_>, cancel: &Cancel) -> Vec<(String, f64)> {
        let Examined { fitted, motion, forms, screened } = *seen;
        if fitted.level != WHOLE {
            return Vec::new();
        }
        let terms = fitted.terms();
        let present = (terms.as_slice(), fitted.parameters.coefficients.as_slice());
        let mut basis = OrthonormalBasis::default();
        for column in self.tangent(fitted) {
            basis.push(column);
        }
        let deviation = fitted.refined.rmse();
        let simulated = fitted.by_record(&fitted.refined.simulated);
        let spring = |mass: usize| {
            let stiffness = motion.variations.first().map_or(1.0, |v| v.oscillator.stiffness[(mass, mass)]);
            stiffness * motion.measured.iter().map(|p| rms(&p.x[mass])).fold(0.0, f64::max)
        };
        let mut sizes = Vec::new();
        for hit in screened.hits.iter().take_while(|_| !cancel.is_cancelled()) {
            let form = &forms[hit.form];
            let addition: Addition = form.addition(&hit.inner);
            // In a joint, what acts on the one mass and what acts on the other.
            let single = matches!(addition.terms.as_slice(), [_])
                || matches!(addition.terms.as_slice(), [a, b] if a.mass != b.mass);
            if !single {
                continue;
            }
            let columns = self.columns(&addition, &motion.simulated, &motion.variations, present, &simulated);
            let limit = |mut column: Vec<f64>, k: usize| -> Option<f64> {
                basis.remove(&mut column);
                let size = dot(&column, &column).sqrt();
                let shape = |(s, p): (&RecordSeries, &MotionPath)| {
                    let terms = &addition.terms[k..=k];
                    rms(&super::columns::forces(terms, &addition.internals, &self.layout, s, &s.inputs(), p)[0])
                };
                let force = self.fit().iter().zip(&motion.simulated).map(shape).fold(0.0, f64::max);
                let spring = spring(addition.terms[k].mass);
                (size > 0.0 && spring > 0.0).then(|| 3.0 * deviation / size * force / spring)
            };
            let least = columns.into_iter().enumerate().filter_map(|(k, c)| limit(c, k)).reduce(f64::min);
            sizes.extend(least.map(|least| (form.full_title(), least)));
        }
        sizes
    }
}

/// A question in words, and the forces that it asks for, each with the mass that it acts on.
type Question = (String, Vec<(usize, PerRecord)>);
/// One value a sample: `[record][sample]`.
type PerRecord = Vec<Vec<f64>>;

/// Shapes of forces that follow the motion of one mass, or that between it and another.
struct Shapes<'a> {
    data: &'a Data,
    motion: &'a Motion,
    mass: usize,
    other: Option<usize>,
}

impl Shapes<'_> {
    /// Displacement and velocity, each by twice its largest RMS.
    fn scaled(&self) -> Vec<(Vec<f64>, Vec<f64>)> {
        let across = |all: &[Vec<f64>]| -> Vec<f64> {
            match self.other {
                None => all[self.mass].clone(),
                Some(other) => all[self.mass].iter().zip(&all[other]).map(|(a, b)| a - b).collect(),
            }
        };
        let paths = || self.motion.simulated.iter();
        let mut pairs: Vec<(Vec<f64>, Vec<f64>)> = paths().map(|p| (across(&p.x), across(&p.v))).collect();
        let scale = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::MIN_POSITIVE, f64::max) * 2.0;
        let sx = scale(&mut pairs.iter().map(|p| rms(&p.0)));
        let sv = scale(&mut pairs.iter().map(|p| rms(&p.1)));
        for (x, v) in &mut pairs {
            x.iter_mut().for_each(|x| *x /= sx);
            v.iter_mut().for_each(|v| *v /= sv);
        }
        pairs
    }

    fn state(&self) -> Vec<PerRecord> {
        let pairs = self.scaled();
        let pointwise = |f: &dyn Fn(f64, f64) -> f64| -> PerRecord {
            pairs.iter().map(|(x, v)| x.iter().zip(v).map(|(x, v)| f(*x, *v)).collect()).collect()
        };
        let mut state = Vec::new();
        for i in 0..=5_i32 {
            for j in 0..=(5 - i) {
                if i + j >= 2 {
                    state.push(pointwise(&|x, v| x.powi(i) * v.powi(j)));
                }
            }
        }
        if self.other.is_none() {
            state.push(pointwise(&|_, _| 1.0));
        }
        state.push(pointwise(&|_, v| sindyscope_values::term::sign(v)));
        state.push(pointwise(&|x, _| x.abs()));
        state.push(pointwise(&|x, v| x.abs() * sindyscope_values::term::sign(v)));
        state
    }

    fn memory(&self) -> Vec<PerRecord> {
        let pairs = self.scaled();
        let lag = |quarters: usize, f: &dyn Fn(f64, f64) -> f64| -> PerRecord {
            let series = |(s, (x, v)): (&RecordSeries, &(Vec<f64>, Vec<f64>))| {
                let back = (quarters as f64 * 0.25 / (self.data.frequency * s.interval)).round() as usize;
                (0..s.len()).map(|k| if k >= back { f(x[k - back], v[k - back]) } else { 0.0 }).collect()
            };
            self.data.fit().iter().zip(&pairs).map(series).collect()
        };
        let mut memory = Vec::new();
        for quarters in [1, 2, 3] {
            memory.push(lag(quarters, &|x, _| x));
            memory.push(lag(quarters, &|x, _| x.powi(3)));
            memory.push(lag(quarters, &|_, v| sindyscope_values::term::sign(v)));
        }
        memory
    }

    fn time(&self) -> Vec<PerRecord> {
        let pairs = self.scaled();
        let over = |f: &dyn Fn(f64, f64, f64) -> f64| -> PerRecord {
            let series = |(x, v): &(Vec<f64>, Vec<f64>)| {
                let n = x.len() as f64;
                (0..x.len()).map(|k| f(2.0 * k as f64 / n - 1.0, x[k], v[k])).collect()
            };
            pairs.iter().map(series).collect()
        };
        vec![
            over(&|t, x, _| t * x),
            over(&|t, _, v| t * v),
            over(&|t, x, _| t * t * x),
            over(&|t, _, v| t * t * v),
            over(&|t, _, _| t),
            over(&|_, _, _| 1.0),
        ]
    }

    fn input(&self) -> Vec<PerRecord> {
        (0..self.data.layout.inputs).flat_map(|j| self.of_input(j)).collect()
    }

    fn of_input(&self, j: usize) -> Vec<PerRecord> {
        let data = self.data;
        let largest = |pick: fn(&RecordSeries) -> &Vec<Vec<f64>>| {
            data.fit().iter().map(|s| rms(&pick(s)[j])).fold(f64::MIN_POSITIVE, f64::max) * 2.0
        };
        let (su, sdu) = (largest(|s| &s.inputs), largest(|s| &s.input_rates));
        let input = |f: &dyn Fn(f64, f64) -> f64| -> PerRecord {
            let series = |s: &RecordSeries| {
                s.inputs[j].iter().zip(&s.input_rates[j]).map(|(u, du)| f(u / su, du / sdu)).collect()
            };
            data.fit().iter().map(series).collect()
        };
        vec![
            input(&|u, _| u),
            input(&|_, du| du),
            input(&|u, _| u * u),
            input(&|u, _| u.powi(3)),
            input(&|u, _| u.powi(5)),
            input(&|_, du| sindyscope_values::term::sign(du)),
        ]
    }
}
