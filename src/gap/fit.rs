//! Fitting a composition to the records: start, refinement, and the gap on data never fitted.

use std::sync::Arc;

use super::columns::{Inputs, Path, forces};
use super::data::{Data, Series};
use super::motion::{Oscillator, Variation};
use super::outcome::Gap;
use super::structure::Composition;
use crate::model::Equation;
use crate::refine::{Bar, Goal, Landed, Options, Output, Point, Refined, Run, Structure, climb, levels, refine, shoot};
use crate::signal::{dot, mean_and_variance, rms};
use crate::study::Cancel;
use crate::term::{Expression, Layout, Symbol, Term, derivative};

/// A composition fitted to the fitted records, and held against data that were not.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub(super) composition: Composition,
    pub(super) refined: Arc<Refined>,
    /// What was fitted: whole records, or the segments at which the model still follows them.
    pub(super) runs: Arc<[Run]>,
    /// Doublings of the shortest segments; [`WHOLE`] for whole records.
    pub(super) level: usize,
    /// Residual sums of squares on data left out, one a fold, over segments as long as the fitted ones.
    pub(super) folds: Vec<Fold>,
    /// Simulated displacement of each held-out record, empty where there is none or it does not last.
    pub(super) held_out: Vec<Vec<f64>>,
    pub(super) gap: Gap,
}

/// The level at which whole records are fitted.
pub(super) const WHOLE: usize = usize::MAX;

/// The score of one set of data that was left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fold {
    pub(super) rss: f64,
    pub(super) samples: usize,
    /// Initial values that were fitted to it.
    pub(super) passing: usize,
}

impl Fold {
    pub(super) fn rmse(&self) -> f64 {
        (self.rss / self.samples.saturating_sub(self.passing).max(1) as f64).sqrt()
    }
}

impl Fitted {
    /// A series per run put together again: one series a fitted record.
    pub(super) fn by_record(&self, per_run: &[Vec<f64>]) -> Vec<Vec<f64>> {
        by_record(&self.runs, per_run)
    }

    /// RMS of the residuals, initial values allowed for.
    pub(super) fn error(&self) -> f64 {
        let freedom = self.refined.samples.saturating_sub(self.refined.passing()).max(1);
        (self.refined.rss / freedom as f64).sqrt()
    }

    /// RMS of what is left on data never fitted.
    pub(super) fn held_out_error(&self) -> f64 {
        let (rss, freedom) = self.folds.iter().fold((0.0, 0), |(rss, freedom), fold| {
            (rss + fold.rss, freedom + fold.samples.saturating_sub(fold.passing))
        });
        if freedom == 0 { self.error() } else { (rss / freedom as f64).sqrt() }
    }
}

fn by_record(runs: &[Run], per_run: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut out: Vec<Vec<f64>> = Vec::new();
    for (run, values) in runs.iter().zip(per_run) {
        out.resize_with(out.len().max(run.record + 1), Vec::new);
        out[run.record].extend_from_slice(values);
    }
    out
}

/// Steps of a refinement from a good start, and at most.
const STEPS: usize = 24;
pub(super) const FEW_STEPS: usize = 8;
/// Integration steps that one of several candidates may take: about half a second.
const EFFORT: usize = 800_000;
/// How many times less than expected of a fit a rival must have left for the fit not to be sought far from its start.
const SURPASSED: f64 = 2.0;
/// How many times the least sum of squares leaves a rival so far behind that its score does not matter.
const BEHIND: f64 = 2.25;
/// Motion left unexplained (a share of its RMS) above which a fit may have missed its basin.
const LOST: f64 = 0.3;
/// A held-out record that is left with so many times the error of the fitted ones may have been begun wrongly.
const ASTRAY: f64 = 1.5;
/// Least width of a secant, as a share of the motion's RMS.
const SECANT: f64 = 1e-3;
/// Share of a single record that is fitted when the rest is to judge.
const FITTED_SHARE: f64 = 0.7;

/// The derivative of a term, where it is a constant.
fn slope(term: &Term, symbol: Symbol) -> f64 {
    match derivative(term.expression(), symbol) {
        Expression::Number(n) => n,
        _ => 0.0,
    }
}

fn finite(value: f64, otherwise: f64) -> f64 {
    if value.is_finite() { value } else { otherwise }
}

/// How long a refinement may take.
#[derive(Clone, Copy)]
pub(super) enum Pace<'a> {
    /// Until nothing changes.
    Thorough,
    /// One of a few that are gone on with.
    Again,
    /// One of many, given up where it stays behind the others.
    Rival(&'a Bar),
}

/// How hard data that were not fitted are tried to be followed.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Care {
    /// A beginning that leads astray is sought along short segments.
    Full,
    /// As the first attempt has it: for a rival that is far behind.
    Little,
}

impl Pace<'_> {
    /// How hard a fit of this sum of squares is tried to be followed beyond the data fitted.
    pub(super) fn care(self, rss: f64) -> Care {
        match self {
            Self::Rival(bar) if rss > BEHIND * bar.least() => Care::Little,
            _ => Care::Full,
        }
    }

    /// True if a rival does far better than this one is expected to.
    pub(super) fn surpassed(self, expected: f64) -> bool {
        matches!(self, Self::Rival(bar) if SURPASSED * bar.least() < expected)
    }
}

impl Data {
    pub(super) fn options<'a>(cancelled: &'a (dyn Fn() -> bool + Sync), steps: usize, pace: Pace<'a>) -> Options<'a> {
        let (effort, bar) = match pace {
            Pace::Thorough => (usize::MAX, None),
            Pace::Again => (4 * EFFORT, None),
            Pace::Rival(bar) => (EFFORT, Some(bar)),
        };
        Options { frozen: false, driven: false, steps, effort, bar, cancelled }
    }

    /// What a fit up to a level is to reach.
    pub(super) fn goal<'a>(&self, top: usize, options: Options<'a>) -> Goal<'a> {
        Goal { period: self.period, noise: self.noise.max(self.least_noise()), top, options }
    }

    /// Below this share of the motion a residual is the simulation's own arithmetic.
    fn least_noise(&self) -> f64 {
        1e-6 * self.fit().iter().map(|s| rms(&s.measured)).fold(0.0, f64::max)
    }

    /// The fitted records, each as one run.
    pub(super) fn whole(&self) -> Vec<Run> {
        self.fit().iter().map(Series::run).collect()
    }

    /// Refines along whole records from a point; where that is lost, by way of segments that grow.
    ///
    /// It is lost if it leaves more than `lost`.
    pub(super) fn refine(
        &self,
        composition: &Composition,
        start: &Point,
        lost: f64,
        pace: Pace<'_>,
        cancel: &Cancel,
    ) -> Option<Refined> {
        let cancelled = || cancel.is_cancelled();
        let steps = if matches!(pace, Pace::Rival(_)) { 2 * FEW_STEPS + 4 } else { STEPS };
        let runs = self.whole();
        let direct = refine(composition, &runs, start, Self::options(&cancelled, steps, pace))
            .map(|found| self.again(composition, &runs, found, pace, cancel));
        if direct.as_ref().is_some_and(|f| f.rss <= lost) || pace.surpassed(lost) || cancel.is_cancelled() {
            return direct;
        }
        let goal = self.goal(WHOLE, Self::options(&cancelled, steps, Pace::Thorough));
        let first = shoot(composition, &runs, (&start.shared, None), 0, goal, FEW_STEPS);
        let held = first.map(|first| climb(composition, &runs, first, goal)).unwrap_or_default();
        let long = match held.into_iter().next_back() {
            Some(landed) if landed.whole => Some(landed.refined),
            Some(landed) => {
                let shared = &landed.refined.point.shared;
                shoot(composition, &runs, (shared, Some(&landed)), WHOLE, goal, steps).map(|l| l.refined)
            }
            None => None,
        };
        match (direct, long) {
            (Some(a), Some(b)) => Some(if b.rss < a.rss { b } else { a }),
            (a, b) => b.or(a),
        }
    }

    /// Refines from a point over segments of a level.
    pub(super) fn refine_at(
        &self,
        composition: &Composition,
        start: &Point,
        level: usize,
        cancel: &Cancel,
    ) -> Option<Landed> {
        let whole = self.whole();
        if level == WHOLE {
            let refined = self.refine(composition, start, self.lost(), Pace::Thorough, cancel)?;
            return Some(Landed { refined, runs: whole, level, whole: true });
        }
        let cancelled = || cancel.is_cancelled();
        let goal = self.goal(level, Self::options(&cancelled, STEPS, Pace::Thorough));
        shoot(composition, &whole, (&start.shared, None), level, goal, STEPS)
    }

    /// The sum of squares above which a fit without expectations has missed its basin.
    pub(super) fn lost(&self) -> f64 {
        LOST * LOST * self.fit().iter().map(|s| dot(&s.measured, &s.measured)).sum::<f64>()
    }

    /// Begins each record anew from where it was measured to begin, and goes on where that helps: an initial state may have
    /// been caught where a wrong model needed it.
    fn again(
        &self,
        composition: &Composition,
        runs: &[Run],
        found: Refined,
        pace: Pace<'_>,
        cancel: &Cancel,
    ) -> Refined {
        let cancelled = || cancel.is_cancelled();
        let frozen = Options { frozen: true, effort: EFFORT, ..Self::options(&cancelled, FEW_STEPS, Pace::Thorough) };
        let mut point = found.point.clone();
        let mut bettered = false;
        for (r, run) in runs.iter().enumerate() {
            let alone = [Run { record: 0, ..run.clone() }];
            let here: f64 = dot(&found.residuals[r], &found.residuals[r]);
            let mut start = Point::new(composition, &alone, point.shared.clone(), false);
            start.offsets = found.point.offsets.get(r).copied().into_iter().collect();
            if let Some(mut other) = refine(composition, &alone, &start, frozen)
                && other.rss < 0.9 * here
                && let Some(own) = other.point.own.pop()
            {
                point.own[r] = own;
                bettered = true;
            }
        }
        if !bettered {
            return found;
        }
        match refine(composition, runs, &point, Self::options(&cancelled, FEW_STEPS, pace)) {
            Some(better) if better.rss < found.rss => better,
            _ => found,
        }
    }

    /// The records (or parts of one) that are fitted and those that judge, one pair a fold.
    fn folds(&self) -> Vec<(Vec<Run>, Vec<Run>)> {
        let fit = self.whole();
        if !self.held_out().is_empty() {
            return Vec::new();
        }
        let numbered = |runs: Vec<Run>| -> Vec<Run> {
            runs.into_iter().enumerate().map(|(record, run)| Run { record, ..run }).collect()
        };
        if let [single] = fit.as_slice() {
            let n = single.range.len();
            let cut = (FITTED_SHARE * n as f64) as usize;
            return vec![(vec![single.part(0..cut)], vec![single.part(cut..n)])];
        }
        let groups = fit.len().min(4);
        (0..groups)
            .map(|g| {
                let (test, train): (Vec<_>, Vec<_>) =
                    fit.iter().cloned().enumerate().partition(|(k, _)| k % groups == g);
                let runs = |list: Vec<(usize, Run)>| numbered(list.into_iter().map(|(_, run)| run).collect());
                (runs(train), runs(test))
            })
            .collect()
    }

    /// Holds a refinement of whole records against data that were not fitted.
    pub(super) fn judge(&self, composition: Composition, refined: Refined, care: Care, cancel: &Cancel) -> Fitted {
        let landed = Landed { refined, runs: self.whole(), level: WHOLE, whole: true };
        self.judged_with(composition, landed, care, cancel)
    }

    /// Follows records that were not fitted with the parameters as they are: what each has of its own is fitted.
    fn follow(
        &self,
        composition: &Composition,
        shared: &[f64],
        records: &[Run],
        (level, expected): (usize, f64),
        care: Care,
        cancel: &Cancel,
    ) -> Option<Landed> {
        let cancelled = || cancel.is_cancelled();
        let options = Options { frozen: true, effort: EFFORT, ..Self::options(&cancelled, FEW_STEPS, Pace::Thorough) };
        let goal = Goal { noise: expected.max(self.noise), ..self.goal(level, options) };
        let direct = shoot(composition, records, (shared, None), level, goal, FEW_STEPS);
        let top = levels(records, self.period);
        let near = direct.as_ref().is_some_and(|d| d.error() < ASTRAY * expected);
        if near || top == 0 || level == 0 || care == Care::Little {
            return direct;
        }
        // A record begun a little wrongly goes astray though the model is right: the beginning is found along segments.
        let first = shoot(composition, records, (shared, None), 0, goal, FEW_STEPS)?;
        let longest = climb(composition, records, first, goal).into_iter().next_back();
        let reached = longest.filter(|l| l.level >= level.min(top));
        match (direct, reached) {
            (Some(a), Some(b)) => Some(if b.refined.rss < a.refined.rss { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    /// What parameters leave on the held-out records over segments of a level, as RMS; none without such records.
    pub(super) fn followed(
        &self,
        composition: &Composition,
        shared: &[f64],
        (level, expected): (usize, f64),
        cancel: &Cancel,
    ) -> Option<f64> {
        if self.held_out().is_empty() {
            return None;
        }
        let (mut rss, mut freedom) = (0.0, 0);
        for s in self.held_out() {
            let runs = [Run { record: 0, ..s.run() }];
            let Some(found) = self.follow(composition, shared, &runs, (level, expected), Care::Full, cancel) else {
                return Some(f64::INFINITY);
            };
            rss += found.refined.rss;
            freedom += found.refined.samples.saturating_sub(found.refined.passing());
        }
        Some((rss / freedom.max(1) as f64).sqrt())
    }

    /// Holds a fit against data that were not fitted, over segments as long as its own.
    pub(super) fn judged(&self, composition: Composition, landed: Landed, cancel: &Cancel) -> Fitted {
        self.judged_with(composition, landed, Care::Full, cancel)
    }

    fn judged_with(&self, composition: Composition, landed: Landed, care: Care, cancel: &Cancel) -> Fitted {
        let cancelled = || cancel.is_cancelled();
        let Landed { refined, runs, level, whole } = landed;
        let level = if whole { WHOLE } else { level };
        let lost = |runs: &[Run]| {
            let samples = runs.iter().map(|r| r.range.len()).sum();
            let rss = runs.iter().flat_map(|r| &r.measured[0][r.range.clone()]).map(|y| y * y).sum::<f64>();
            Fold { rss, samples, passing: 0 }
        };
        let fold = |found: &Option<Landed>, runs: &[Run]| {
            found.as_ref().map_or_else(
                || lost(runs),
                |l| Fold { rss: l.refined.rss, samples: l.refined.samples, passing: l.refined.passing() },
            )
        };
        let freedom = refined.samples.saturating_sub(refined.passing()).max(1) as f64;
        let expected = (level, (refined.rss / freedom).sqrt());
        let mut held_out = Vec::new();
        let mut folds = Vec::new();
        for s in self.held_out() {
            let runs = [Run { record: 0, ..s.run() }];
            let fit = self.follow(&composition, &refined.point.shared, &runs, expected, care, cancel);
            folds.push(fold(&fit, &runs));
            held_out.push(fit.map(|l| l.refined.simulated.concat()).unwrap_or_default());
        }
        for (train, test) in self.folds() {
            let goal = self.goal(level, Self::options(&cancelled, FEW_STEPS, Pace::Thorough));
            let found = shoot(&composition, &train, (&refined.point.shared, None), level, goal, FEW_STEPS)
                .and_then(|f| self.follow(&composition, &f.refined.point.shared, &test, expected, care, cancel));
            folds.push(fold(&found, &test));
        }
        let spread = |series: &[Series]| {
            let (mut squares, mut count) = (0.0, 0.0);
            for s in series {
                squares += s.len() as f64 * mean_and_variance(&s.measured).1;
                count += s.len() as f64;
            }
            f64::sqrt(squares / f64::max(count, 1.0))
        };
        let samples: usize = folds.iter().map(|f| f.samples).sum();
        let test_rmse = (samples > 0).then(|| (folds.iter().map(|f| f.rss).sum::<f64>() / samples as f64).sqrt());
        let judged = if self.held_out().is_empty() { self.fit() } else { self.held_out() };
        let gap = Gap {
            train_rmse: refined.rmse(),
            test_rmse,
            train_nrmse: refined.rmse() / spread(self.fit()),
            test_nrmse: test_rmse.map(|r| r / spread(judged)),
        };
        Fitted { composition, refined: Arc::new(refined), runs: runs.into(), level, folds, held_out, gap }
    }

    /// Coefficients of terms to start from: with `L` the response of a linear oscillator of the motion's frequency,
    /// `measured − L[k x + c v] = Σ coefficient · L[term]` but for free vibrations, in which everything is linear.
    /// Coefficients are drawn to that oscillator's by `prior`, a share of the data's own weight.
    pub(super) fn start(&self, terms: &[Term], internals: &[Equation], paths: &[Path], prior: f64) -> Option<Vec<f64>> {
        let omega = std::f64::consts::TAU * self.frequency;
        let (k, c) = (omega * omega, 0.1 * omega);
        let m = terms.len();
        let mut normal = nalgebra::DMatrix::zeros(m, m);
        let mut right = nalgebra::DVector::<f64>::zeros(m);
        for (s, path) in self.fit().iter().zip(paths) {
            let oscillator = Oscillator::new(k, c, s.interval);
            let known: Vec<f64> = path.x.iter().zip(&path.v).map(|(x, v)| k * x + c * v).collect();
            let mut response = Vec::new();
            oscillator.respond(&known, &mut response);
            let moved = if self.output == Output::Displacement(0) { &s.measured[..] } else { &path.x[..] };
            let mut target: Vec<f64> = moved.iter().zip(&response).map(|(y, r)| y - r).collect();
            let mut free = super::columns::Basis::default();
            for column in oscillator.free(s.len()) {
                free.push(column);
            }
            free.remove(&mut target);
            let columns: Vec<Vec<f64>> = forces(terms, internals, &self.layout, s, &s.inputs(), path)
                .iter()
                .map(|f| {
                    let mut out = Vec::new();
                    oscillator.respond(f, &mut out);
                    free.remove(&mut out);
                    out
                })
                .collect();
            for (i, a) in columns.iter().enumerate() {
                right[i] += dot(a, &target);
                for (j, b) in columns.iter().enumerate() {
                    normal[(i, j)] += dot(a, b);
                }
            }
        }
        let scale: Vec<f64> =
            (0..m).map(|i| f64::sqrt(normal[(i, i)]).recip()).map(|s| if s.is_finite() { s } else { 0.0 }).collect();
        let scaled = nalgebra::DMatrix::from_fn(m, m, |i, j| {
            normal[(i, j)] * scale[i] * scale[j] + if i == j { prior } else { 0.0 }
        });
        let mut expected = vec![0.0; m];
        for (symbol, value) in [(Symbol::State(0), -k), (Symbol::Rate(0), -c)] {
            let first = terms.iter().position(|t| slope(t, symbol) != 0.0);
            if let Some(i) = first {
                expected[i] = value / slope(&terms[i], symbol);
            }
        }
        let pull = |i: usize| if scale[i] > 0.0 { prior * expected[i] / scale[i] } else { 0.0 };
        let solved = scaled.cholesky()?.solve(&nalgebra::DVector::from_fn(m, |i, _| right[i] * scale[i] + pull(i)));
        Some((0..m).map(|i| solved[i] * scale[i]).collect())
    }

    /// Scales of a composition's shared parameters: what changes the acceleration by a hundredth of its size, and a
    /// fifth of an inner quantity.
    pub(super) fn scales(&self, composition: &Composition, inner: &[f64], paths: &[Path]) -> Vec<f64> {
        let composed = composition.compose(inner);
        let omega = std::f64::consts::TAU * self.frequency;
        let mut squares = vec![0.0; composed.terms.len()];
        let (mut motion, mut count) = (0.0, 0);
        for (s, path) in self.fit().iter().zip(paths) {
            let columns = forces(&composed.terms, &composed.internals, &self.layout, s, &s.inputs(), path);
            for (square, column) in squares.iter_mut().zip(&columns) {
                *square += dot(column, column);
            }
            motion += dot(&path.x, &path.x);
            count += s.len();
        }
        let acceleration = omega * omega * f64::sqrt(motion / count as f64);
        let mut scales: Vec<f64> = squares
            .iter()
            .map(|s| {
                let size = f64::sqrt(s / count as f64);
                if size > 0.0 { 0.01 * acceleration / size } else { 1.0 }
            })
            .collect();
        if composition.datum {
            scales.push(0.01 * f64::sqrt(motion / count as f64));
        }
        scales.extend(
            inner[usize::from(composition.datum)..]
                .iter()
                .map(|v| if *v == 0.0 { 0.01 / self.frequency } else { 0.2 * v.abs() }),
        );
        scales
    }

    /// What a small force does along a simulated motion under an acceleration of these terms.
    pub(super) fn variation(&self, terms: &[Term], coefficients: &[f64], s: &Series, path: &Path) -> Variation {
        let oscillator = self.oscillator(terms, coefficients, s.interval);
        let layout = Layout { internals: 0, ..self.layout };
        // Internal states stand still while displacement and velocity are varied.
        let (own, weights): (Vec<Term>, Vec<f64>) = terms
            .iter()
            .zip(coefficients)
            .filter(|(t, _)| layout.covers(t.expression()))
            .map(|(t, c)| (t.clone(), *c))
            .unzip();
        // A sign has no slope but a jump.
        let linear = |t: &Term| {
            let constant = |symbol| matches!(derivative(t.expression(), symbol), Expression::Number(_));
            !t.switches() && constant(Symbol::State(0)) && constant(Symbol::Rate(0))
        };
        if own.iter().all(linear) {
            return Variation::new(oscillator, &[]);
        }
        let n = s.len();
        let next = |k: usize| (k + 1).min(n - 1);
        let middle = |a: &[f64]| -> Vec<f64> { (0..n).map(|k| 0.5 * (a[k] + a[next(k)])).collect() };
        let values: Vec<Vec<f64>> = s.inputs.iter().map(|u| middle(u)).collect();
        let rates: Vec<Vec<f64>> = s.input_rates.iter().map(|u| middle(u)).collect();
        let inputs = Inputs {
            values: values.iter().map(Vec::as_slice).collect(),
            rates: rates.iter().map(Vec::as_slice).collect(),
        };
        let force = |x: Vec<f64>, v: Vec<f64>| -> Vec<f64> {
            let columns = forces(&own, &[], &self.layout, s, &inputs, &Path { x, v });
            (0..n).map(|k| columns.iter().zip(&weights).map(|(f, c)| c * f[k]).sum()).collect()
        };
        // As wide as the sample's own change, against ground or across the joint: no jump falls between two secants.
        let width = |a: &[f64], input: Option<&Vec<f64>>| -> Vec<f64> {
            let least = SECANT * rms(a);
            let change = |k: usize| {
                let across = input.filter(|_| self.base_excited).map_or(0.0, |u| u[next(k)] - u[k]);
                let own = a[next(k)] - a[k];
                own.abs().max((own - across).abs()).max(least)
            };
            (0..n).map(change).collect()
        };
        let aside = |a: &[f64], width: &[f64], side: f64| -> Vec<f64> {
            a.iter().zip(width).map(|(a, w)| a + side * w).collect()
        };
        let (x, v) = (middle(&path.x), middle(&path.v));
        let (wx, wv) = (width(&path.x, s.inputs.first()), width(&path.v, s.input_rates.first()));
        let pulls = [0.5, -0.5].map(|side| force(aside(&x, &wx, side), v.clone()));
        let drags = [0.5, -0.5].map(|side| force(x.clone(), aside(&v, &wv, side)));
        let slopes: Vec<(f64, f64)> = (0..n)
            .map(|k| ((pulls[1][k] - pulls[0][k]) / wx[k], (drags[1][k] - drags[0][k]) / wv[k]))
            .map(|(k, c)| (finite(k, oscillator.stiffness), finite(c, oscillator.damping)))
            .collect();
        Variation::new(oscillator, &slopes)
    }

    /// The oscillator that an acceleration is, to first order, in displacement and velocity.
    pub(super) fn oscillator(&self, terms: &[Term], coefficients: &[f64], interval: f64) -> Oscillator {
        let total = |symbol: Symbol| -> f64 { terms.iter().zip(coefficients).map(|(t, c)| c * slope(t, symbol)).sum() };
        let (k, c) = (-total(Symbol::State(0)), -total(Symbol::Rate(0)));
        let omega = std::f64::consts::TAU * self.frequency;
        let k = if k > 0.05 * omega * omega { k } else { omega * omega };
        Oscillator::new(k, c.max(0.002 * k.sqrt()), interval)
    }
}

/// What each record has of its own, carried from one composition to another: initial state, the internal states that both
/// have, the offset.
pub(super) fn carried(before: &Composition, after: &Composition, point: &Point) -> Point {
    let kept = 2 + before.internals().min(after.internals());
    let own = point.own.iter().map(|values| {
        let mut next = vec![0.0; 2 + after.internals()];
        let kept = kept.min(values.len());
        next[..kept].copy_from_slice(&values[..kept]);
        next
    });
    let offsets = match (before.offset(), after.offset()) {
        (_, false) => Vec::new(),
        (true, true) => point.offsets.clone(),
        (false, true) => vec![0.0; point.own.len()],
    };
    Point { shared: Vec::new(), offsets, own: own.collect() }
}
