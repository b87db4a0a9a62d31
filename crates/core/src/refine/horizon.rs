//! Multiple shooting with a growing horizon: a fit that lands where one long simulation from a rough start would not.
//!
//! Each record is cut into segments of about two periods, each with an initial state of its own. From there the segments'
//! length is doubled while the fit holds, up to the whole record. The longest length at which it holds is the *horizon*: how
//! far the model predicts before noise and its own sensitivity part it from the measurement.

use super::fitter::HOPELESS;
use super::{Bar, FitOptions, Point, Refined, Run, Structure, misfit, refine};
use crate::signal::{dot, mean_and_variance, rms};
use crate::simulate::{Delays, Limits, Response, Simulator};

/// Length of the shortest segments, in periods of the motion.
const SHORTEST_PERIODS: f64 = 2.0;
/// Samples of the shortest segments, at least.
const MIN_SEGMENT_SAMPLES: usize = 16;
/// Steps of the fit to the shortest segments.
const FIRST_STEPS: usize = 8;
/// Steps of the fit after each doubling: most of the way is gone before.
const DOUBLING_STEPS: usize = 5;
/// A longer segment holds if its error is at most this many times that of the shortest segments, or the noise.
const MAX_ERROR_GROWTH: f64 = 1.3;
/// Where a whole simulation misses the motion by less than this share of it, the whole record is fitted at once.
const DIRECT_FIT_ERROR: f64 = 0.3;
/// Parts that a run is cut into; its sensitivity to the initial state is compared between the first and the last.
const SENSITIVITY_PARTS: usize = 8;
/// Growth of that sensitivity from which on a motion counts as chaotic.
const CHAOTIC_GROWTH: f64 = 30.0;
/// How often the shortest segments of a chaotic motion are halved, at most.
pub const CHAOTIC_HALVINGS: usize = 3;
/// Where the shortest segments leave more than this many times the noise, the model itself is wrong and its horizon is not
/// sought.
const WRONG_MODEL_ERROR: f64 = 3.0;

/// Share of what a fit leaves from which on a single segment has led it away from what all others say.
const MOST_OF_WHAT_IS_LEFT: f64 = 0.5;

/// What a fit is to reach, and how.
#[derive(Clone, Copy)]
pub struct Goal<'a> {
    /// Period of the motion, s: 2π times the RMS of velocity over that of acceleration.
    pub period: f64,
    /// Weighted RMS that the noise leaves.
    pub noise: f64,
    /// Doublings of the shortest segments to reach; beyond the number there are, whole records.
    pub top: usize,
    /// A model that is far from the noise along the shortest segments stays there: longer ones bend its parameters to hold
    /// together what it lacks.
    pub short_if_wrong: bool,
    /// How the fits are done; steps count for the whole record.
    pub options: FitOptions<'a>,
}

/// A fit, and how far it predicts.
#[derive(Clone, Debug)]
pub struct Landed {
    /// The fit.
    pub refined: Refined,
    /// The runs that were fitted: whole records or segments.
    pub runs: Vec<Run>,
    /// How often the shortest segments were doubled.
    pub level: usize,
    /// Period that the shortest segments are measured by, s: of a chaotic motion less than its own.
    pub period: f64,
    /// The runs are whole records.
    pub whole: bool,
}

/// A fit whose motion another one starts on.
#[derive(Clone, Copy)]
pub struct Before<'a> {
    landed: &'a Landed,
    structure: &'a dyn Structure,
}

impl Landed {
    /// Root of the mean squared residual, for each value fitted to a run one sample less.
    pub fn error(&self) -> f64 {
        let freedom = self.refined.samples.saturating_sub(self.refined.passing()).max(1);
        (self.refined.rss / freedom as f64).sqrt()
    }

    /// Median over the runs of their root mean squared residual: a few that go astray do not change it.
    pub fn median_error(&self) -> f64 {
        let mut squares: Vec<f64> = self.refined.residuals.iter().map(|e| dot(e, e) / e.len().max(1) as f64).collect();
        squares.sort_by(f64::total_cmp);
        squares.get(squares.len() / 2).map_or(0.0, |s| s.sqrt())
    }

    /// The fit as one to start from, found with a structure.
    pub fn of<'a>(&'a self, structure: &'a dyn Structure) -> Before<'a> {
        Before { landed: self, structure }
    }

    /// True if some run ends many times as sensitive to its initial state as it begins: the motion is chaotic, or unstable.
    pub fn is_sensitive(&self) -> bool {
        let grows = |(columns, run): (&Vec<Vec<f64>>, &Run)| {
            let end = run.range.len() / SENSITIVITY_PARTS;
            let own = columns.len().saturating_sub(run.states());
            let size = |rows: &dyn Fn(&[f64]) -> f64| columns[own..].iter().map(|c| rows(c)).fold(0.0, f64::max);
            // Of the first output; the others follow the same motion.
            let early = size(&|c| rms(&c[..end]));
            let late = size(&|c| rms(&c[run.range.len() - end..run.range.len()]));
            end > 0 && late > CHAOTIC_GROWTH * early
        };
        self.refined.sensitivities.iter().zip(&self.runs).any(grows)
    }

    /// True if a fit along longer runs leaves no more than the initial states that it lacks would have explained by chance: six
    /// standard deviations of what that many numbers explain of white noise.
    pub fn goes_on_in(&self, longer: &Self) -> bool {
        let [less, more] = [&longer.refined, &self.refined];
        let lacks = more.passing().saturating_sub(less.passing()) as f64;
        let freedom = more.samples.saturating_sub(more.unknowns()).max(1) as f64;
        let lost = (less.rss - more.rss) / (more.rss / freedom);
        lost < lacks + 6.0 * (2.0 * lacks).sqrt() + 6.0
    }

    /// The longest run, s.
    pub fn horizon(&self) -> f64 {
        self.runs.iter().map(|r| r.range.len() as f64 * r.grid.interval()).fold(0.0, f64::max)
    }
}

/// How far a free run of a model predicts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Horizon {
    /// The longest run that fits its measurement as well as the shortest, or as the noise allows, s: the record's length
    /// where that lasts.
    pub seconds: f64,
    /// RMS error of the first displacement in runs of that length, each from the initial state that fits it best.
    pub rmse: f64,
}

/// True if an error is no more than noise leaves, by chance or by what it does to an initial state.
pub(crate) fn holds(error: f64, noise: f64) -> bool {
    error < MAX_ERROR_GROWTH * noise
}

/// The horizon of a model at given shared parameters, which stay: only initial states are fitted.
///
/// None where the model can be followed over no stretch, or it was cancelled.
pub(crate) fn horizon(structure: &dyn Structure, whole: &[Run], shared: &[f64], goal: Goal<'_>) -> Option<Horizon> {
    let goal = Goal { options: FitOptions { frozen: true, ..goal.options }, ..goal };
    let at = |level: usize, goal: Goal<'_>| shoot(structure, whole, (shared, None), level, goal, FIRST_STEPS);
    let top = levels(whole, goal.period);
    let longest = match at(top, goal) {
        Some(whole) if top == 0 || holds(whole.error(), goal.noise) => whole,
        _ => {
            // The smoothed state at a record's ends may be too rough for a chaotic motion to be found from it along two periods.
            let halved = |k: usize| Goal { period: goal.period / f64::from(1 << k), ..goal };
            let lands = |goal| at(0, goal).filter(|l| holds(l.error(), goal.noise)).map(|l| (l, goal));
            let (first, goal) = match (0..=CHAOTIC_HALVINGS).map(halved).find_map(lands) {
                Some(found) => found,
                None => (at(0, goal)?, goal),
            };
            climb(structure, whole, first, goal).pop()?
        }
    };
    let weight = longest.runs.first()?.weights.first()?;
    let first = || longest.refined.residuals.iter().zip(&longest.runs).flat_map(|(r, run)| &r[..run.range.len()]);
    let square = first().map(|e| e * e).sum::<f64>() / first().count().max(1) as f64;
    Some(Horizon { seconds: longest.horizon(), rmse: square.sqrt() / weight })
}

/// Segments that a record has at the shortest length: a power of two, so that doublings join neighbours.
fn parts(run: &Run, period: f64) -> usize {
    let length = (SHORTEST_PERIODS * period / run.grid.interval()).max(MIN_SEGMENT_SAMPLES as f64);
    let doublings = (run.range.len() as f64 / length).log2().round().max(0.0);
    1 << (doublings as u32).min(16)
}

/// Number of doublings from the shortest segments to whole records.
pub fn levels(whole: &[Run], period: f64) -> usize {
    whole.iter().map(|r| parts(r, period).ilog2() as usize).max().unwrap_or(0)
}

/// The segments of records after `level` doublings of the shortest ones.
pub fn cut(whole: &[Run], period: f64, level: usize) -> Vec<Run> {
    let segments = whole.iter().flat_map(|run| {
        let parts = (parts(run, period) >> level.min(16)).max(1);
        let (from, n) = (run.range.start, run.range.len());
        (0..parts).map(move |k| run.part(from + k * n / parts..from + (k + 1) * n / parts))
    });
    segments.collect()
}

/// Fits at one length of segments from shared parameters; initial states are those of `before` where its motion passes
/// there, else those of the measured motion.
pub fn shoot(
    structure: &dyn Structure,
    whole: &[Run],
    (shared, before): (&[f64], Option<Before<'_>>),
    level: usize,
    goal: Goal<'_>,
    steps: usize,
) -> Option<Landed> {
    let runs = cut(whole, goal.period, level);
    let full = level >= levels(whole, goal.period);
    let options = FitOptions { driven: !full, steps, ..goal.options };
    let point = start(structure, &runs, shared, before, !full);
    let refined = refine(structure, &runs, &point, options)?;
    Some(Landed { refined, runs, level, period: goal.period, whole: full })
}

/// Every `every`-th of the shortest segments, each record's first among them: what a preview of many rivals fits.
pub fn sampled(whole: &[Run], period: f64, every: usize) -> Vec<Run> {
    let mut seen = 0;
    let mut record = None;
    let mut segments = cut(whole, period, 0);
    segments.retain(|run| {
        seen = if record == Some(run.record) { seen + 1 } else { 0 };
        record = Some(run.record);
        seen % every == 0
    });
    segments
}

/// Fits along some of the shortest segments, each with an initial state of its own: the shared parameters, and what they
/// leave there.
pub fn look(
    structure: &dyn Structure,
    segments: &[Run],
    shared: &[f64],
    goal: Goal<'_>,
    steps: usize,
) -> Option<(Vec<f64>, f64)> {
    let options = FitOptions { driven: true, steps, ..goal.options };
    let point = start(structure, segments, shared, None, true);
    let refined = refine(structure, segments, &point, options)?;
    Some((refined.point.shared, refined.rss))
}

/// Where a fit of these runs starts.
fn start(structure: &dyn Structure, runs: &[Run], shared: &[f64], before: Option<Before<'_>>, driven: bool) -> Point {
    let mut point = Point::new(structure, runs, shared.to_vec(), driven);
    if !driven && structure.internals() > 0 {
        for (own, run) in point.own.iter_mut().zip(runs) {
            let first = own.len() - structure.internals();
            let along = structure.driven(shared, run);
            own[first..].iter_mut().zip(along).for_each(|(z, along)| *z = along[run.range.start]);
        }
    }
    let Some(before) = before else { return point };
    let mut passed = Passed::new(before);
    let Before { landed: before, structure: had } = before;
    if point.offsets.len() == before.refined.point.offsets.len() {
        point.offsets.clone_from_slice(&before.refined.point.offsets);
    }
    let carried = |run: &Run| {
        let internals = if had.internals() == structure.internals() { had.internals() } else { 0 };
        run.motion.states.len() + internals
    };
    for (own, run) in point.own.iter_mut().zip(runs) {
        let known = before.runs.iter().position(|b| b.record == run.record && b.range.start == run.range.start);
        let state = match known {
            Some(k) => Some(before.refined.point.own[k].clone()),
            None => passed.state(run),
        };
        if let Some(state) = state {
            own.iter_mut().zip(state).take(carried(run)).for_each(|(o, b)| *o = b);
        }
    }
    point
}

/// The motion that a fit found, for runs that begin within its own: simulated once a run, when first asked for.
struct Passed<'a> {
    before: Before<'a>,
    simulator: Option<(Simulator, Delays)>,
    responses: Vec<Option<Response>>,
}

impl<'a> Passed<'a> {
    fn new(before: Before<'a>) -> Self {
        let instance = before.structure.instance(&before.landed.refined.point.shared);
        let simulator = instance.and_then(|i| Some((Simulator::new(&i.model).ok()?, i.delays)));
        Self { before, simulator, responses: vec![None; before.landed.runs.len()] }
    }

    /// The state at a run's beginning; none if no run of the fit holds it.
    fn state(&mut self, run: &Run) -> Option<Vec<f64>> {
        let at = run.range.start;
        let holds = |b: &Run| b.record == run.record && b.range.contains(&at);
        let Before { landed, structure } = self.before;
        let k = landed.runs.iter().position(holds)?;
        if self.responses[k].is_none() {
            let (simulator, delays) = self.simulator.as_ref()?;
            let from = &landed.runs[k];
            let point = &landed.refined.point;
            let mut initial = point.own[k].clone();
            let states = from.motion.states.len();
            if initial.len() < states + structure.internals() {
                let along = structure.driven(&point.shared, from);
                initial.extend(along.iter().map(|z| z[from.range.start]));
            }
            let delayed;
            let grid = if delays.is_none() {
                &*from.grid
            } else {
                delayed = from.grid.delayed(delays);
                &delayed
            };
            let limits = Limits { states: &from.limits, ..Limits::default() };
            self.responses[k] = Some(simulator.run(grid, &initial, from.range.clone(), &limits));
        }
        let index = at - landed.runs[k].range.start;
        let response = self.responses[k].as_ref()?;
        response.states.iter().map(|s| s.get(index).copied()).collect()
    }
}

/// Doubles the segments of a fit while it holds; the fits at each length, the shortest first. Where the whole record can be
/// fitted at once the lengths between are left out.
pub fn climb(structure: &dyn Structure, whole: &[Run], first: Landed, goal: Goal<'_>) -> Vec<Landed> {
    let top = levels(whole, goal.period).min(goal.top);
    let bound = MAX_ERROR_GROWTH * first.error().max(goal.noise);
    let motion = motion(whole);
    let mut held = vec![first];
    // A whole record of a chaotic motion is no step away from shorter ones.
    let mut chaotic = false;
    while let Some(last) = held.last().filter(|l| l.level < top && !(goal.options.cancelled)()) {
        let shared = last.refined.point.shared.clone();
        // From a good start the whole record is one step away.
        let glance = || {
            let driven = top < levels(whole, goal.period);
            let runs = cut(whole, goal.period, top);
            let point = start(structure, &runs, &shared, Some(last.of(structure)), driven);
            // One glance is no fit that a budget is kept for.
            misfit(structure, &runs, &point, FitOptions { driven, meter: None, ..goal.options })
        };
        let follows = |rss: f64| rss < (DIRECT_FIT_ERROR * motion).powi(2) * last.refined.samples as f64;
        let near = !chaotic && last.level + 1 < top && glance().is_some_and(follows);
        let at_once = near
            .then(|| shoot(structure, whole, (&shared, Some(last.of(structure))), top, goal, goal.options.steps))
            .flatten();
        chaotic |= at_once.as_ref().is_some_and(Landed::is_sensitive);
        let at_once = at_once.filter(|l| l.error() < bound);
        let next = at_once.or_else(|| {
            let doubled = |steps: usize| {
                shoot(structure, whole, (&shared, Some(last.of(structure))), last.level + 1, goal, steps)
                    .filter(|l| l.error() < bound)
            };
            doubled(DOUBLING_STEPS).or_else(|| doubled(3 * DOUBLING_STEPS))
        });
        match next {
            Some(next) => held.push(next),
            None => break,
        }
    }
    held
}

/// Fits whole records from a point; where that is lost, by way of segments that grow. The result never fits worse than its
/// start; where whole records cannot be followed it is the fit at the longest segments that can.
///
/// None if the model can be simulated nowhere, or the fit was cancelled.
pub fn land(structure: &dyn Structure, whole: &[Run], start: &Point, goal: Goal<'_>) -> Option<Landed> {
    let top = levels(whole, goal.period);
    let options = FitOptions { driven: false, ..goal.options };
    let direct = refine(structure, whole, start, options).map(|refined| Landed {
        refined,
        runs: whole.to_vec(),
        level: top,
        period: goal.period,
        whole: true,
    });
    // Along a chaotic motion the sum of squares has many local minima, and only a shorter fit tells whether this is the least.
    let sensitive = direct.as_ref().is_some_and(|d| d.is_sensitive());
    let near_noise = direct.as_ref().is_some_and(|d| holds(d.error(), goal.noise)) && !sensitive;
    // A fit that falls still may be on its way to values beside a kink of the response from which no slope leads back.
    let falls = direct.as_ref().is_some_and(|d| !d.refined.converged);
    if near_noise && !falls || (goal.options.cancelled)() || top == 0 {
        return direct;
    }
    // What a rival leaves along whole records tells nothing of shorter segments, but that a fit which leaves more along two
    // periods is no better than it.
    let bar = goal.options.bar.map(Bar::least);
    let mut goal = Goal { options: FitOptions { bar: None, ..goal.options }, ..goal };
    let steps = if sensitive { goal.options.steps } else { FIRST_STEPS };
    let shortest = |goal| shoot(structure, whole, (&start.shared, None), 0, goal, steps);
    let Some(mut first) = shortest(goal) else { return direct };
    for _ in 0..CHAOTIC_HALVINGS {
        if !sensitive || (holds(first.error(), goal.noise) && !first.is_sensitive()) {
            break;
        }
        // A chaotic motion may part from its neighbours within two periods.
        let halved = Goal { period: 0.5 * goal.period, ..goal };
        let Some(shorter) = shortest(halved) else { break };
        (first, goal) = (shorter, halved);
    }
    if !sensitive
        && goal.short_if_wrong
        && let Some(again) = begun_shorter(structure, whole, &start.shared, &first, goal)
    {
        (first, goal) = again;
    }
    let top = levels(whole, goal.period);
    if direct.is_some() && bar.is_some_and(|least| first.refined.rss > HOPELESS.0 * least) {
        return direct;
    }
    // Where the whole record is followed as well as two periods of it, the model is wrong, not the fit.
    if direct.as_ref().is_some_and(|d| holds(d.error(), first.error().max(goal.noise))) && !sensitive && !near_noise {
        return direct;
    }
    let near = |fit: &Landed| fit.error() < WRONG_MODEL_ERROR * goal.noise;
    if goal.short_if_wrong && !near(&first) {
        let from = (first.refined.point.shared.as_slice(), Some(first.of(structure)));
        if !first.refined.converged
            && let Some(ended) = shoot(structure, whole, from, 0, goal, goal.options.steps)
        {
            first = ended;
        }
        if !near(&first) {
            return Some(first);
        }
    }
    let near = near(&first);
    let exact = holds(first.error(), goal.noise);
    let mut held = climb(structure, whole, first, goal);
    // What a longer fit of such a motion ends in may be far from the truth by its own standard errors.
    let sound = |shorter: &Landed, longer: &Landed| shorter.goes_on_in(longer) && !longer.is_sensitive();
    let count = held.windows(2).take_while(|pair| !exact || sound(&pair[0], &pair[1])).count() + 1;
    let from = |landed: &Landed, level: usize| {
        let from = (landed.refined.point.shared.as_slice(), Some(landed.of(structure)));
        shoot(structure, whole, from, level, goal, goal.options.steps)
    };
    let ended = |landed: Landed| {
        if landed.refined.converged { Some(landed) } else { from(&landed, landed.level).or(Some(landed)) }
    };
    if count < held.len() {
        held.truncate(count);
        let mut longest = held.pop()?;
        // The lengths between may have been left out.
        while let Some(next) = from(&longest, longest.level + 1).filter(|next| sound(&longest, next) && !next.whole) {
            longest = next;
        }
        return ended(longest);
    }
    let longest = held.pop()?;
    if longest.whole {
        return match direct {
            Some(direct) if direct.refined.rss <= longest.refined.rss => Some(direct),
            _ => Some(longest),
        };
    }
    if near {
        return ended(longest);
    }
    // Far from the noise at every length: the whole record's own fit tells as much, from whichever start is better.
    let again = shoot(
        structure,
        whole,
        (&longest.refined.point.shared, Some(longest.of(structure))),
        top,
        goal,
        goal.options.steps,
    );
    let best = match (direct, again) {
        (Some(a), Some(b)) => Some(if b.refined.rss < a.refined.rss { b } else { a }),
        (a, b) => a.or(b),
    };
    // A model that loses the motion would be fitted to what carries it away: a drift that nothing holds.
    best.filter(|b| b.error() < DIRECT_FIT_ERROR * motion(whole)).or(Some(longest))
}

/// A fit along the shortest segments that a few have led away from values which are right for all others, done again from what shorter
/// ones say: a single segment holds most of what is left, or most are near the noise. The fit along the shorter ones itself where a
/// chaotic motion cannot be followed for longer; none where those stay far from the noise too, or nothing less is left. Near a
/// separatrix segments part from what they measure however little is wrong.
fn begun_shorter<'a>(
    structure: &dyn Structure,
    whole: &[Run],
    shared: &[f64],
    first: &Landed,
    goal: Goal<'a>,
) -> Option<(Landed, Goal<'a>)> {
    let near = WRONG_MODEL_ERROR * goal.noise;
    let largest = first.refined.residuals.iter().map(|e| dot(e, e)).fold(0.0, f64::max);
    let led_away = largest > MOST_OF_WHAT_IS_LEFT * first.refined.rss || first.median_error() < near;
    if first.error() < near || first.runs.len() < 3 || !led_away {
        return None;
    }
    let mut halved = goal;
    let shorter = (0..CHAOTIC_HALVINGS).find_map(|_| {
        halved.period *= 0.5;
        let shorter = shoot(structure, whole, (shared, None), 0, halved, FIRST_STEPS)?;
        (shorter.error() < near).then_some(shorter)
    })?;
    let from = (shorter.refined.point.shared.as_slice(), Some(shorter.of(structure)));
    let again = shoot(structure, whole, from, 0, goal, goal.options.steps);
    if again.as_ref().is_none_or(|again| again.error() > near && again.is_sensitive()) {
        return Some((shorter, halved));
    }
    again.filter(|again| again.refined.rss < first.refined.rss).map(|again| (again, goal))
}

/// RMS of the weighted motion about its mean.
fn motion(runs: &[Run]) -> f64 {
    let of_run = |run: &Run| -> f64 {
        let outputs = run.measured.iter().zip(&run.weights);
        let square = outputs.map(|(y, w)| w * w * mean_and_variance(&y[run.range.clone()]).1).sum::<f64>();
        square * run.range.len() as f64
    };
    let rows: usize = runs.iter().map(Run::rows).sum();
    (runs.iter().map(of_run).sum::<f64>() / rows.max(1) as f64).sqrt()
}
