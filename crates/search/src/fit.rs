//! Fitting a composition to the records: start, refinement, and the gap on data never fitted.

use std::sync::{Arc, OnceLock};

use super::columns::{Inputs, MotionPath, forces};
use super::data::{Data, LEAST_NOISE, RecordSeries};
use super::folds::LeftOut;
use super::motion::{Oscillator, Slopes, Variation};
use super::outcome::{Beginnings, Gap};
use super::parameters::{InnerValues, Parameters};
use super::site::{Placed, accelerations};
use super::structure::Composition;
use sindyscope_core::refine::{
    Bar, CHAOTIC_HALVINGS, FitOptions, Goal, Landed, Output, Point, Refined, Run, climb, levels, refine, respond, shoot,
};
use sindyscope_core::signal::{dot, mean_and_variance, rms};
use sindyscope_core::sparse::OrthonormalBasis;
use sindyscope_core::study::Cancel;
use sindyscope_values::model::Equation;
use sindyscope_values::term::{Expression, Layout, Symbol, derivative};

/// A composition fitted to the fitted records, and held against data that were not.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub(super) composition: Composition,
    pub(super) refined: Arc<Refined>,
    /// What the records share of `refined`, part by part.
    pub(super) parameters: Parameters,
    /// What was fitted: whole records, or the segments at which the model still follows them.
    pub(super) runs: Arc<[Run]>,
    /// Doublings of the shortest segments; [`WHOLE`] for whole records.
    pub(super) level: usize,
    /// Period that the shortest segments are measured by, s.
    pub(super) period: f64,
    /// False if it was not asked yet what it leaves on data never fitted.
    pub(super) asked: bool,
    /// What the inputs' unknown course between samples may come to in its response, once that was asked.
    pub(super) between_samples: OnceLock<f64>,
    /// Residual sums of squares on data left out, one a fold, over segments as long as the fitted ones; none if it was not asked.
    pub(super) folds: Vec<Fold>,
    /// Shared parameters fitted without the data of each fold; none where whole records are held out. Those of all data if it was
    /// not asked, which flatter it.
    pub(super) refitted: Vec<Vec<f64>>,
    /// The response along each held-out record, empty where it does not last, and if it was not asked.
    pub(super) held_out: Vec<Followed>,
    pub(super) gap: Gap,
}

/// A response along one record.
#[derive(Clone, Debug, Default)]
pub(super) struct Followed {
    /// What the sensors would show, one behind the other.
    pub(super) simulated: Vec<f64>,
    pub(super) beginnings: Beginnings,
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
    /// Sum of squares and samples of the first sensor alone.
    pub(super) first: (f64, usize),
}

impl Fitted {
    /// A series per run put together again: one a fitted record, its sensors' series one behind the other.
    pub(super) fn by_record(&self, per_run: &[Vec<f64>]) -> Vec<Vec<f64>> {
        by_record(&self.runs, &slices(per_run))
    }

    /// The response along each fitted record.
    pub(super) fn followed(&self) -> Vec<Followed> {
        followed(&self.runs, &self.refined)
    }

    /// The same of all records, one behind the other.
    pub(super) fn rows(&self, per_run: &[Vec<f64>]) -> Vec<f64> {
        self.by_record(per_run).concat()
    }

    /// What a shared parameter does to all rows.
    pub(super) fn sensitivity(&self, parameter: usize) -> Vec<f64> {
        let series: Vec<&[f64]> = self.refined.sensitivities.iter().map(|run| run[parameter].as_slice()).collect();
        by_record(&self.runs, &series).concat()
    }

    /// Terms of the accelerations.
    pub(super) fn terms(&self) -> Vec<Placed> {
        self.composition.compose(&self.parameters.inner).terms
    }

    /// The fit to the data fitted.
    pub(super) fn landed(&self) -> Landed {
        Landed {
            refined: Refined::clone(&self.refined),
            runs: self.runs.to_vec(),
            level: self.level,
            period: self.period,
            whole: self.level == WHOLE,
        }
    }

    /// Log of how much likelier the data fitted are under this fit than under another of them, white noise of the size of each one's
    /// residuals given.
    pub(super) fn likelier(&self, than: &Self) -> f64 {
        0.5 * self.refined.samples as f64 * (than.refined.rss / self.refined.rss).ln()
    }

    /// RMS of the residuals, initial values allowed for.
    pub(super) fn error(&self) -> f64 {
        let freedom = self.refined.samples.saturating_sub(self.refined.passing()).max(1);
        (self.refined.rss_beside_jumps() / freedom as f64).sqrt()
    }

    /// RMS of what is left on data never fitted.
    pub(super) fn held_out_error(&self) -> f64 {
        let (rss, freedom) = self.folds.iter().fold((0.0, 0), |(rss, freedom), fold| {
            (rss + fold.rss, freedom + fold.samples.saturating_sub(fold.passing))
        });
        if freedom == 0 { self.error() } else { (rss / freedom as f64).sqrt() }
    }
}

fn by_record(runs: &[Run], per_run: &[&[f64]]) -> Vec<Vec<f64>> {
    let mut sensors: Vec<Vec<Vec<f64>>> = Vec::new();
    for (run, values) in runs.iter().zip(per_run) {
        sensors.resize_with(sensors.len().max(run.record + 1), || vec![Vec::new(); run.outputs.len()]);
        let parts = values.chunks(run.range.len().max(1));
        sensors[run.record].iter_mut().zip(parts).for_each(|(whole, part)| whole.extend_from_slice(part));
    }
    sensors.into_iter().map(|sensors| sensors.concat()).collect()
}

fn slices(series: &[Vec<f64>]) -> Vec<&[f64]> {
    series.iter().map(Vec::as_slice).collect()
}

/// The response along each record that runs are of.
pub(super) fn followed(runs: &[Run], refined: &Refined) -> Vec<Followed> {
    let simulated = by_record(runs, &slices(&refined.simulated));
    let Point { offsets, own, .. } = &refined.point;
    let of_record = |(record, simulated): (usize, Vec<f64>)| {
        let own_runs = || runs.iter().zip(own).filter(|(run, _)| run.record == record);
        let sensors = own_runs().next().map_or(1, |(run, _)| run.outputs.len()).max(1);
        let offsets = offsets.chunks(sensors).nth(record).unwrap_or_default().to_vec();
        let stretches = own_runs().map(|(run, own)| (run.range.clone(), own.clone())).collect();
        Followed { simulated, beginnings: Beginnings { stretches, offsets } }
    };
    simulated.into_iter().enumerate().map(of_record).collect()
}

/// Sum of squares and samples of the first sensor's rows of runs.
pub(super) fn of_first(runs: &[Run], residuals: &[Vec<f64>]) -> (f64, usize) {
    runs.iter().zip(residuals).fold((0.0, 0), |(squares, samples), (run, e)| {
        let first = &e[..run.range.len().min(e.len())];
        (squares + dot(first, first), samples + first.len())
    })
}

/// Least width of a secant, as a share of the motion's RMS.
const SECANT: f64 = 1e-3;
/// The derivative of a term, where it is a constant.
fn slope(term: &Placed, symbol: Symbol) -> f64 {
    match derivative(term.term.expression(), symbol) {
        Expression::Number(n) => n,
        _ => 0.0,
    }
}

fn finite(value: f64, otherwise: f64) -> f64 {
    if value.is_finite() { value } else { otherwise }
}

/// How far a model is to follow data that were not fitted, and how closely.
#[derive(Clone, Copy)]
pub(super) struct Wanted {
    /// Doublings of the shortest segments.
    pub(super) level: usize,
    /// Period that those are measured by, s.
    pub(super) period: f64,
    /// RMS that the data fitted leave.
    pub(super) error: f64,
}

impl Data {
    pub(super) fn options<'a>(
        &'a self,
        cancelled: &'a (dyn Fn() -> bool + Sync),
        steps: usize,
        bar: Option<&'a Bar>,
    ) -> FitOptions<'a> {
        let effort = if bar.is_some() { self.constants.effort } else { usize::MAX };
        FitOptions { frozen: false, driven: false, steps, effort, meter: Some(&self.counters.steps), bar, cancelled }
    }

    /// What a fit up to a level is to reach.
    pub(super) fn goal<'a>(&self, top: usize, options: FitOptions<'a>) -> Goal<'a> {
        let noise = self.noise.max(self.least_noise());
        Goal { period: self.period, noise, top, short_if_wrong: true, options }
    }

    /// Below this a residual is the simulation's own arithmetic.
    fn least_noise(&self) -> f64 {
        LEAST_NOISE * self.loudest()
    }

    /// The largest RMS of what the first sensor showed of a fitted record.
    pub(super) fn loudest(&self) -> f64 {
        self.fit().iter().map(|s| rms(&s.measured[0])).fold(0.0, f64::max)
    }

    /// The fitted records, each as one run.
    pub(super) fn whole(&self) -> Vec<Run> {
        self.fit().iter().map(RecordSeries::run).collect()
    }

    /// Follows records that were not fitted with the parameters as they are: what each has of its own is fitted.
    pub(super) fn follow(
        &self,
        composition: &Composition,
        shared: &[f64],
        records: &[Run],
        wanted: Wanted,
        cancel: &Cancel,
    ) -> Option<Landed> {
        let cancelled = || cancel.is_cancelled();
        // A record never fitted may be noisier than those that are.
        let error = records.iter().map(|run| self.noise_in(run)).fold(wanted.error, f64::max);
        let wanted = Wanted { error, ..wanted };
        let Wanted { level, period, .. } = wanted;
        let goal = self.followed_to(wanted, &cancelled);
        let (steps, astray) = (self.constants.few_steps(), self.constants.unseen_ratio * error);
        let direct = shoot(composition, records, (shared, None), level, goal, steps);
        let top = levels(records, period);
        if direct.as_ref().is_some_and(|d| d.error() < astray) || top == 0 {
            return direct;
        }
        // A record begun a little wrongly goes astray though the model is right: the beginning is found along segments, which are
        // halved where one of them goes astray too.
        let halved =
            |times: usize| Goal { period: period / f64::from(1 << times), top: goal.top.saturating_add(times), ..goal };
        let shortest = |times: usize| shoot(composition, records, (shared, None), 0, halved(times), steps);
        let some_go_astray = |l: &Landed| l.error() >= astray && l.median_error() < astray;
        let mut first = if level == 0 { direct.clone() } else { None }.or_else(|| shortest(0))?;
        let mut times = 0;
        while times < CHAOTIC_HALVINGS
            && some_go_astray(&first)
            && let Some(shorter) = shortest(times + 1)
        {
            (first, times) = (shorter, times + 1);
        }
        let longest = climb(composition, records, first, halved(times)).pop();
        // A chaotic motion that is not one of the fitted records may be followed less far than those.
        let chaotic = |l: &Landed| l.is_sensitive() || direct.as_ref().is_some_and(Landed::is_sensitive);
        let reached = longest.filter(|l| l.level >= level.min(top) + times || l.error() < astray && chaotic(l));
        match (direct, reached) {
            (Some(a), Some(b)) => Some(if b.refined.rss < a.refined.rss { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    /// What a fit of initial states alone is to reach, over segments of a level.
    pub(super) fn followed_to<'a>(&'a self, wanted: Wanted, cancelled: &'a (dyn Fn() -> bool + Sync)) -> Goal<'a> {
        let Wanted { level, period, error } = wanted;
        let (steps, effort) = (self.constants.few_steps(), self.constants.effort);
        let options = FitOptions { frozen: true, effort, ..self.options(cancelled, steps, None) };
        Goal { period, noise: error.max(self.noise), ..self.goal(level, options) }
    }

    /// True if a fit can be held against others before it is asked what it leaves on data never fitted: whole records are held out,
    /// which its parameters alone predict.
    pub(super) fn can_be_asked_later(&self) -> bool {
        !self.held_out().is_empty() && !self.shows_rates()
    }

    /// Holds a fit against data that were not fitted, over segments as long as its own.
    pub(super) fn judged(&self, composition: Composition, landed: Landed, cancel: &Cancel) -> Fitted {
        self.held_against(composition, landed, true, cancel)
    }

    /// A fit that is not asked what it leaves on data never fitted: it lost on those fitted, or is asked later. Where it is held
    /// against others all the same and no record is held out, it is flattered by parameters that saw all data, and loses still.
    pub(super) fn unasked(&self, composition: Composition, landed: Landed, cancel: &Cancel) -> Fitted {
        self.held_against(composition, landed, false, cancel)
    }

    /// The same fit, asked what it leaves on data never fitted.
    pub(super) fn asked_now(&self, fitted: &Fitted, cancel: &Cancel) -> Fitted {
        let asked = self.judged(fitted.composition.clone(), fitted.landed(), cancel);
        Fitted { refined: Arc::clone(&fitted.refined), between_samples: fitted.between_samples.clone(), ..asked }
    }

    fn held_against(&self, composition: Composition, landed: Landed, asked: bool, cancel: &Cancel) -> Fitted {
        let cancelled = || cancel.is_cancelled();
        let shared = &landed.refined.point.shared;
        let (period, level) = (landed.period, if landed.whole { WHOLE } else { landed.level });
        let lost = |runs: &[Run]| {
            let shown: Vec<Vec<f64>> = runs.iter().map(|r| r.target().collect()).collect();
            let rss = shown.iter().map(|y| dot(y, y)).sum::<f64>();
            let samples = runs.iter().map(Run::rows).sum();
            Fold { rss, samples, passing: 0, first: of_first(runs, &shown) }
        };
        let fold = |found: &Option<Landed>, runs: &[Run]| {
            found.as_ref().map_or_else(
                || lost(runs),
                |l| Fold {
                    rss: l.refined.rss_beside_jumps(),
                    samples: l.refined.samples,
                    passing: l.refined.passing(),
                    first: of_first(&l.runs, &l.refined.residuals),
                },
            )
        };
        let expected = Wanted { level, period, error: landed.error() };
        let longest = |runs: &[Run]| runs.iter().map(|r| r.range.len() as f64 * r.grid.interval()).fold(0.0, f64::max);
        let mut horizon = longest(&landed.runs);
        let mut held_out = Vec::new();
        let (mut folds, mut refitted) = (Vec::new(), Vec::new());
        for s in self.held_out() {
            if !asked {
                held_out.push(Followed::default());
                continue;
            }
            let runs = [Run { record: 0, ..s.run() }];
            let fit = self.follow(&composition, shared, &runs, expected, cancel);
            let mut judged = fold(&fit, &runs);
            if let Some(cut) = fit.as_ref().filter(|f| f.runs.len() > 1) {
                horizon = horizon.min(longest(&cut.runs));
            }
            held_out.push(match self.initial {
                None => fit.and_then(|l| followed(&l.runs, &l.refined).pop()).unwrap_or_default(),
                Some(initial) => {
                    let (followed, scored) = self.predicted_after(initial, &composition, shared, s, cancel);
                    // A motion that a model follows to the noise along stretches, but not to its end, parts from its neighbours: the
                    // opening says nothing of the end.
                    if level == WHOLE || expected.error > self.constants.mattering() * self.noise {
                        judged.first = scored.unwrap_or_else(|| lost(&runs).first);
                    }
                    followed
                }
            });
            folds.push(judged);
        }
        let goal = Goal { period, ..self.goal(level, self.options(&cancelled, self.constants.few_steps(), None)) };
        for (train, test) in self.folds() {
            if !asked {
                refitted.push(shared.clone());
                continue;
            }
            let again = self.fitted_to_the_rest(&composition, &landed, &train, (level, goal));
            let found = again
                .as_ref()
                .and_then(|f| self.follow(&composition, &f.refined.point.shared, &test, expected, cancel));
            // Where the rest cannot be fitted the fold is lost, not predicted by a fit that saw it.
            let lost = || vec![f64::NAN; shared.len()];
            refitted.push(again.map_or_else(lost, |f| f.refined.point.shared));
            folds.push(fold(&found, &test));
        }
        let spread = |series: &[RecordSeries]| {
            let (mut squares, mut count) = (0.0, 0.0);
            for s in series {
                squares += s.len() as f64 * mean_and_variance(&s.measured[0]).1;
                count += s.len() as f64;
            }
            f64::sqrt(squares / f64::max(count, 1.0))
        };
        let root = |(squares, samples): (f64, usize)| (squares / samples.max(1) as f64).sqrt();
        let test = folds.iter().fold((0.0, 0), |(s, n), f| (s + f.first.0, n + f.first.1));
        let test_rmse = (test.1 > 0).then(|| root(test));
        let parameters = composition.named(shared);
        let Landed { refined, runs, .. } = landed;
        let train_rmse = root(of_first(&runs, &refined.residuals));
        let judged = if self.held_out().is_empty() { self.fit() } else { self.held_out() };
        let gap = Gap {
            train_rmse,
            test_rmse,
            train_nrmse: train_rmse / spread(self.fit()),
            test_nrmse: test_rmse.map(|r| r / spread(judged)),
            horizon,
        };
        Fitted {
            composition,
            refined: Arc::new(refined),
            parameters,
            runs: runs.into(),
            level,
            period,
            asked,
            between_samples: OnceLock::new(),
            folds,
            refitted,
            held_out,
            gap,
        }
    }

    /// A fit to what is left where a part of the data is left out, begun from the fit to all of them. Fewer data need leave no more than
    /// all do: a fit that leaves so much more has not landed, and begins once more on the motion of that to all.
    fn fitted_to_the_rest(
        &self,
        composition: &Composition,
        all: &Landed,
        rest: &[Run],
        (level, goal): (usize, Goal<'_>),
    ) -> Option<Landed> {
        let shared = all.refined.point.shared.as_slice();
        let first = shoot(composition, rest, (shared, None), level, goal, self.constants.few_steps());
        let has_landed = |l: &Landed| l.error() <= self.constants.unseen_ratio * all.error();
        if first.as_ref().is_some_and(has_landed) {
            return first;
        }
        // Records that are left out whole are numbered anew.
        let motion = (!matches!(self.left_out(), LeftOut::Records)).then(|| all.of(composition));
        let again = shoot(composition, rest, (shared, motion), level, goal, self.constants.steps);
        first.into_iter().chain(again).min_by(|a, b| a.refined.rss.total_cmp(&b.refined.rss))
    }

    /// The response along a held-out record whose initial state is estimated from its first `initial` samples alone, and the sum of squares
    /// and number of the first sensor's errors on the others; nothing where it does not last.
    fn predicted_after(
        &self,
        initial: usize,
        composition: &Composition,
        shared: &[f64],
        s: &RecordSeries,
        cancel: &Cancel,
    ) -> (Followed, Option<(f64, usize)>) {
        let cancelled = || cancel.is_cancelled();
        let steps = self.constants.few_steps();
        let frozen = FitOptions { frozen: true, driven: true, ..self.options(&cancelled, steps, None) };
        let run = Run { record: 0, ..s.run() };
        let opening = [run.part(0..initial)];
        let start = Point::new(composition, &opening, shared.to_vec(), true);
        let simulated = || {
            let found = refine(composition, &opening, &start, frozen)?.point;
            Some((respond(composition, std::slice::from_ref(&run), &found, frozen)?.pop()?, found))
        };
        let Some((simulated, found)) = simulated() else { return (Followed::default(), None) };
        let errors: Vec<f64> = run.target().zip(&simulated).map(|(y, m)| y - m).collect();
        let scored = errors.chunks(run.range.len()).next().and_then(|sensor| sensor.get(initial..)).unwrap_or_default();
        let scored = (dot(scored, scored), scored.len());
        let stretches = found.own.first().map(|own| (run.range.clone(), own.clone())).into_iter().collect();
        let beginnings = Beginnings { stretches, offsets: found.offsets };
        (Followed { simulated, beginnings }, Some(scored))
    }

    /// Coefficients of terms to start from: with `L` the response of a linear oscillator of the motion's frequency,
    /// `measured − L[k x + c v] = Σ coefficient · L[term]` for each mass, but for free vibrations, in which everything is linear.
    /// Coefficients are drawn to that oscillator's by `prior`, a share of the data's own weight.
    pub(super) fn start(
        &self,
        terms: &[Placed],
        internals: &[Equation],
        paths: &[MotionPath],
        prior: f64,
    ) -> Option<Vec<f64>> {
        let omega = std::f64::consts::TAU * self.frequency;
        let (k, c) = (omega * omega, 0.1 * omega);
        let m = terms.len();
        let mut normal = nalgebra::DMatrix::zeros(m, m);
        let mut right = nalgebra::DVector::<f64>::zeros(m);
        for (s, path) in self.fit().iter().zip(paths) {
            let oscillator = Oscillator::single(k, c, s.interval);
            let mut free = OrthonormalBasis::default();
            for column in oscillator.free(s.len()) {
                free.push(column);
            }
            let mut response = Vec::new();
            let targets: Vec<Vec<f64>> = (0..self.masses())
                .map(|mass| {
                    let (x, v) = (&path.x[mass], &path.v[mass]);
                    let known: Vec<f64> = x.iter().zip(v).map(|(x, v)| k * x + c * v).collect();
                    oscillator.respond(&known, &mut response);
                    let shown = self.outputs[mass] == Output::Displacement(mass);
                    let moved = if shown { &s.measured[mass][..] } else { &x[..] };
                    let mut target: Vec<f64> = moved.iter().zip(&response).map(|(y, r)| y - r).collect();
                    free.remove(&mut target);
                    target
                })
                .collect();
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
                right[i] += dot(a, &targets[terms[i].mass]);
                for (j, b) in columns.iter().enumerate().filter(|(j, _)| terms[*j].mass == terms[i].mass) {
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
        for mass in 0..self.masses() {
            for (symbol, value) in [(Symbol::State(mass), -k), (Symbol::Rate(mass), -c)] {
                let first = terms.iter().position(|t| t.mass == mass && slope(t, symbol) != 0.0);
                if let Some(i) = first {
                    expected[i] = value / slope(&terms[i], symbol);
                }
            }
        }
        let pull = |i: usize| if scale[i] > 0.0 { prior * expected[i] / scale[i] } else { 0.0 };
        let solved = scaled.cholesky()?.solve(&nalgebra::DVector::from_fn(m, |i, _| right[i] * scale[i] + pull(i)));
        Some((0..m).map(|i| solved[i] * scale[i]).collect())
    }

    /// Scales of a composition's shared parameters: what changes the acceleration by a hundredth of its size, and a
    /// fifth of an inner quantity.
    pub(super) fn scales(&self, composition: &Composition, inner: &InnerValues, paths: &[MotionPath]) -> Parameters {
        let composed = composition.compose(inner);
        let omega = std::f64::consts::TAU * self.frequency;
        let mut squares = vec![0.0; composed.terms.len()];
        let (mut motion, mut count) = (vec![0.0; self.masses()], 0);
        for (s, path) in self.fit().iter().zip(paths) {
            let columns = forces(&composed.terms, &composed.internals, &self.layout, s, &s.inputs(), path);
            for (square, column) in squares.iter_mut().zip(&columns) {
                *square += dot(column, column);
            }
            motion.iter_mut().zip(&path.x).for_each(|(motion, x)| *motion += dot(x, x));
            count += s.len();
        }
        let moved = |mass: usize| f64::sqrt(motion[mass] / count as f64);
        let coefficients = squares
            .iter()
            .zip(&composed.terms)
            .map(|(s, placed)| {
                let size = f64::sqrt(s / count as f64);
                if size > 0.0 { 0.01 * omega * omega * moved(placed.mass) / size } else { 1.0 }
            })
            .collect();
        let quantity = |v: &f64| if *v == 0.0 { 0.01 / self.frequency } else { 0.2 * v.abs() };
        let inner = InnerValues {
            equilibrium: inner.equilibrium.map(|_| 0.01 * moved(0)),
            forms: inner.forms.iter().map(|own| own.iter().map(quantity).collect()).collect(),
        };
        Parameters { coefficients, inner }
    }

    /// What a small force does along a simulated motion under accelerations of these terms.
    pub(super) fn variation(
        &self,
        terms: &[Placed],
        coefficients: &[f64],
        s: &RecordSeries,
        path: &MotionPath,
    ) -> Variation {
        let oscillator = self.oscillator(terms, coefficients, s.interval);
        let layout = Layout { internals: 0, ..self.layout };
        let masses = self.masses();
        // Internal states stand still while displacement and velocity are varied.
        let (own, weights): (Vec<Placed>, Vec<f64>) = terms
            .iter()
            .zip(coefficients)
            .filter(|(t, _)| layout.covers(t.term.expression()))
            .map(|(t, c)| (t.clone(), *c))
            .unzip();
        // A sign has no slope but a jump.
        let linear = |t: &Placed| {
            let constant = |symbol| matches!(derivative(t.term.expression(), symbol), Expression::Number(_));
            !t.term.switches() && (0..masses).all(|i| constant(Symbol::State(i)) && constant(Symbol::Rate(i)))
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
        let force = |path: &MotionPath| -> Vec<Vec<f64>> {
            let columns = forces(&own, &[], &self.layout, s, &inputs, path);
            accelerations(masses, &own, &weights, &columns, n)
        };
        // As wide as the sample's own change, against ground, across the joints and to the base: no jump falls between two
        // secants.
        let width = |all: &[Vec<f64>], mass: usize, input: Option<&Vec<f64>>| -> Vec<f64> {
            let least = SECANT * rms(&all[mass]);
            let step = |a: &[f64], k: usize| a[next(k)] - a[k];
            let change = |k: usize| {
                let own = step(&all[mass], k);
                let joints = [mass.checked_sub(1), Some(mass + 1)].into_iter().flatten().filter_map(|j| all.get(j));
                let base = input.filter(|_| self.base_excited);
                joints.chain(base).map(|other| (own - step(other, k)).abs()).fold(own.abs().max(least), f64::max)
            };
            (0..n).map(change).collect()
        };
        let centre =
            MotionPath { x: path.x.iter().map(|x| middle(x)).collect(), v: path.v.iter().map(|v| middle(v)).collect() };
        let mut slopes = Slopes { stiffness: vec![0.0; n * masses * masses], damping: vec![0.0; n * masses * masses] };
        for j in 0..masses {
            let wx = width(&path.x, j, s.inputs.first());
            let wv = width(&path.v, j, s.input_rates.first());
            let aside = |series: &mut [f64], width: &[f64], side: f64| {
                series.iter_mut().zip(width).for_each(|(a, w)| *a += side * w);
            };
            let [pushed, pulled] = [0.5, -0.5].map(|side| {
                let mut moved = centre.clone();
                aside(&mut moved.x[j], &wx, side);
                force(&moved)
            });
            let [faster, slower] = [0.5, -0.5].map(|side| {
                let mut moved = centre.clone();
                aside(&mut moved.v[j], &wv, side);
                force(&moved)
            });
            for i in 0..masses {
                for k in 0..n {
                    let place = (k * masses + i) * masses + j;
                    let stiffness = (pulled[i][k] - pushed[i][k]) / wx[k];
                    let damping = (slower[i][k] - faster[i][k]) / wv[k];
                    slopes.stiffness[place] = finite(stiffness, oscillator.stiffness[(i, j)]);
                    slopes.damping[place] = finite(damping, oscillator.damping[(i, j)]);
                }
            }
        }
        Variation::along(oscillator, slopes)
    }

    /// The linear system that accelerations are, to first order, in displacements and velocities.
    pub(super) fn oscillator(&self, terms: &[Placed], coefficients: &[f64], interval: f64) -> Oscillator {
        let total = |mass: usize, symbol: Symbol| -> f64 {
            let of_mass = terms.iter().zip(coefficients).filter(|(t, _)| t.mass == mass);
            of_mass.map(|(t, c)| c * slope(t, symbol)).sum()
        };
        let omega = std::f64::consts::TAU * self.frequency;
        let n = self.masses();
        let stiffness = nalgebra::DMatrix::from_fn(n, n, |i, j| -total(i, Symbol::State(j)));
        let damping = nalgebra::DMatrix::from_fn(n, n, |i, j| -total(i, Symbol::Rate(j)));
        if n > 1 {
            return settling(&stiffness, &damping, omega, interval);
        }
        let (k, c) = (stiffness[0], damping[0]);
        let k = if k > 0.05 * omega * omega { k } else { omega * omega };
        Oscillator::single(k, c.max(LEAST_DAMPING * k.sqrt()), interval)
    }
}

/// Twice the least damping ratio of the linear system that stands for a model.
const LEAST_DAMPING: f64 = 0.002;

/// A linear system whose free vibrations die away: damping is added as needed, and one that is pushed away from rest is
/// replaced by masses that vibrate each for itself at the motion's frequency.
fn settling(
    stiffness: &nalgebra::DMatrix<f64>,
    damping: &nalgebra::DMatrix<f64>,
    omega: f64,
    interval: f64,
) -> Oscillator {
    let n = stiffness.nrows();
    let unit = nalgebra::DMatrix::<f64>::identity(n, n);
    for added in [0.0, 1.0, 3.0, 10.0, 30.0, 100.0] {
        let more = damping + &unit * (added * LEAST_DAMPING * omega);
        let values = Oscillator::matrix(stiffness, &more).complex_eigenvalues();
        let settles = |v: &nalgebra::Complex<f64>| v.re <= -0.4 * LEAST_DAMPING * v.norm() && v.norm() > 0.1 * omega;
        if values.iter().all(settles) {
            return Oscillator::new(stiffness.clone(), more, interval);
        }
    }
    Oscillator::new(&unit * (omega * omega), unit * (LEAST_DAMPING * omega), interval)
}
