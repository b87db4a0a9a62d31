//! Several runs side by side: models alike but for their numbers, from initial states and along inputs of their own.
//!
//! A fit asks for the same response again and again, with one number moved a little. Runs that take the same steps go together, so
//! that each instruction of the compiled equations serves all of them; where one of them switches or sticks, it takes that step by
//! itself.

use std::ops::Range;

use super::grid::InputGrid;
use super::integrate::{FIRST_INTERVALS, KnownLevels, Machine, RunProgress, RungeKutta, Substep};
use super::{Limits, Response, Simulator, Workspace};
use fearless_simd::{Level, dispatch};
use sindyscope_values::term::LANES;

/// Runs that go side by side, at most; of half as many or less, each instruction serves half as many.
pub const SIDE_BY_SIDE: usize = 8;
const HALF: usize = SIDE_BY_SIDE / 2;

/// Most states of runs that go side by side: of more, little is the same for all.
const MOST_STATES: usize = 8;

/// One of several runs.
#[derive(Clone)]
pub struct RunTask<'a> {
    /// The model.
    pub simulator: &'a Simulator,
    /// Its inputs.
    pub grid: &'a InputGrid,
    /// As in [`Simulator::run`].
    pub initial: &'a [f64],
    /// The samples of the run.
    pub samples: Range<usize>,
    /// What bounds it.
    pub limits: Limits<'a>,
}

impl RunTask<'_> {
    /// True if two runs can take the same steps.
    fn is_like(&self, other: &Self) -> bool {
        let (a, b) = (&self.simulator.equations, &other.simulator.equations);
        let within = |task: &Self| !task.samples.is_empty() && task.samples.end <= task.grid.len();
        a.states == b.states
            && (1..=MOST_STATES).contains(&a.states)
            && a.surfaces.len() == b.surfaces.len()
            && a.rest_rows == b.rest_rows
            && a.copied == b.copied
            && a.rest.is_like(&b.rest)
            && self.grid.interval().to_bits() == other.grid.interval().to_bits()
            && within(self)
            && within(other)
    }
}

impl Simulator {
    /// Runs that it pays to have side by side: where the equations switch, each switches at an instant of its own, and few are at one
    /// for long.
    pub fn side_by_side(&self) -> usize {
        if self.equations.surfaces.is_empty() { SIDE_BY_SIDE } else { HALF }
    }
}

/// Memory of runs side by side.
#[derive(Clone, Debug, Default)]
pub struct Workspaces {
    each: Vec<Workspace>,
    few: Vec<[f64; HALF]>,
    many: Vec<[f64; SIDE_BY_SIDE]>,
}

/// Runs some tasks, each response as [`Simulator::run_into`] gives it: side by side where there are no more than [`SIDE_BY_SIDE`]
/// and they are alike, else one after the other. Those that are `abreast` are one run whose numbers are moved a little, and take
/// the steps that the first of them needs.
pub fn run_beside(tasks: &[RunTask<'_>], abreast: bool, workspaces: &mut Workspaces, responses: &mut [Response]) {
    let alike = tasks.len() <= SIDE_BY_SIDE && tasks.len() > 1 && tasks[1..].iter().all(|task| tasks[0].is_like(task));
    let needed = if alike { tasks.len() } else { 1 };
    workspaces.each.resize_with(workspaces.each.len().max(needed), Workspace::default);
    if !alike {
        for (RunTask { simulator, grid, initial, samples, limits }, response) in tasks.iter().zip(responses) {
            simulator.run_into(grid, initial, samples.clone(), limits, &mut workspaces.each[0], response);
        }
        return;
    }
    let Workspaces { each, few, many } = workspaces;
    match (tasks[0].simulator.equations.states, tasks.len()) {
        (..=2, ..=HALF) => together::<2, HALF>((tasks, abreast), (each, few), responses),
        (..=2, _) => together::<2, SIDE_BY_SIDE>((tasks, abreast), (each, many), responses),
        (3..=4, ..=HALF) => together::<4, HALF>((tasks, abreast), (each, few), responses),
        (3..=4, _) => together::<4, SIDE_BY_SIDE>((tasks, abreast), (each, many), responses),
        (_, ..=HALF) => together::<MOST_STATES, HALF>((tasks, abreast), (each, few), responses),
        (_, _) => together::<MOST_STATES, SIDE_BY_SIDE>((tasks, abreast), (each, many), responses),
    }
}

/// A run on its way.
struct Runner<'a, 'r, const N: usize> {
    machine: Machine<'a, N>,
    progress: RunProgress<N>,
    response: &'r mut Response,
    limits: Limits<'a>,
}

impl<const N: usize> Runner<'_, '_, N> {
    fn is_on_its_way(&self) -> bool {
        self.progress.is_on_its_way()
    }

    /// One step by itself.
    fn step(&mut self, k: usize, part: usize) {
        let span = self.machine.substep(self.progress.sample, k, part);
        self.machine.step(&span, self.response);
    }
}

fn together<const N: usize, const W: usize>(
    (tasks, abreast): (&[RunTask<'_>], bool),
    (each, rest): (&mut [Workspace], &mut Vec<[f64; W]>),
    responses: &mut [Response],
) {
    let mut runners: Vec<Runner<'_, '_, N>> = Vec::with_capacity(tasks.len());
    for ((task, workspace), response) in tasks.iter().zip(each).zip(responses) {
        let RunTask { simulator, grid, initial, samples, limits } = task;
        response.clear(simulator.equations.states, samples.len(), limits.rates);
        let mut machine = Machine::new(&simulator.equations, grid, workspace);
        if let Some(progress) = machine.set_out(initial, samples.clone(), limits, response) {
            runners.push(Runner { machine, progress, response, limits: *limits });
        }
    }
    let mut pack = Pack::new(&runners, rest);
    let mut levels: [KnownLevels; W] = std::array::from_fn(|_| KnownLevels::default());
    while runners.iter().any(Runner::is_on_its_way) {
        if runners.iter().any(|r| (r.limits.cancelled)()) {
            underway(&mut runners).for_each(|(_, r)| r.response.cancelled = true);
            break;
        }
        let mut level = 0;
        for (place, Runner { machine, progress, limits, .. }) in underway(&mut runners) {
            let levels = &mut levels[if abreast { 0 } else { place }];
            level = level.max(machine.level_at(progress.sample, limits.tolerance, levels));
        }
        runners.iter_mut().for_each(|r| r.machine.level = level);
        let most = runners.iter().filter(|r| r.is_on_its_way()).map(|r| r.machine.most(&r.progress));
        let count = most.min().unwrap_or(1);
        prepare(&mut runners, count, abreast);
        let (_, parts) = runners[0].machine.division();
        for k in 0..count {
            for (_, Runner { machine, progress, .. }) in underway(&mut runners) {
                machine.depart(progress);
            }
            for part in 0..parts {
                pack.step(&mut runners, k, part);
            }
            let mut stiffer = false;
            for (_, Runner { machine, progress, response, .. }) in underway(&mut runners) {
                machine.arrive(progress, response);
                stiffer |= machine.is_stiffness_new();
            }
            if stiffer {
                runners.iter_mut().for_each(|r| r.progress.length = FIRST_INTERVALS);
                break;
            }
        }
    }
    for Runner { machine, progress, response, limits } in &mut runners {
        machine.end(progress, limits, response);
    }
}

/// Makes so many intervals ready.
fn prepare<const N: usize>(runners: &mut [Runner<'_, '_, N>], count: usize, abreast: bool) {
    let mut runners = underway(runners);
    let Some((_, first)) = runners.next() else { return };
    first.machine.prepare(&mut first.progress, count, None);
    for (_, Runner { machine, progress, .. }) in runners {
        let same = abreast && std::ptr::eq(machine.grid, first.machine.grid);
        machine.prepare(progress, count, same.then_some(&first.machine));
    }
}

/// The runs that are on their way, with their places.
fn underway<'s, 'a, 'r, const N: usize>(
    runners: &'s mut [Runner<'a, 'r, N>],
) -> impl Iterator<Item = (usize, &'s mut Runner<'a, 'r, N>)> {
    runners.iter_mut().enumerate().filter(|(_, r)| r.is_on_its_way())
}

/// What differs from run to run in the right sides of equations that are alike: the place of each is its own in every value.
struct Pack<'w, const N: usize, const W: usize> {
    matrix: [[[f64; W]; N]; N],
    /// As in [`Machine`].
    held: [[f64; W]; N],
    /// Slots of what is neither linear nor forcing.
    rest: &'w mut Vec<[f64; W]>,
    /// The registers that the processor has.
    registers: Level,
}

impl<'w, const N: usize, const W: usize> Pack<'w, N, W> {
    fn new(runners: &[Runner<'_, '_, N>], rest: &'w mut Vec<[f64; W]>) -> Self {
        let mut pack = Self { matrix: [[[0.0; W]; N]; N], held: [[0.0; W]; N], rest, registers: Level::new() };
        for place in 0..W {
            // A place that nobody has goes with the first.
            let Some(Runner { machine, .. }) = runners.get(place).or(runners.first()) else { break };
            machine.equations.rest.prepare_beside(pack.rest, place);
            for (row, own) in pack.matrix.iter_mut().zip(&machine.matrix) {
                row.iter_mut().zip(own).for_each(|(values, own)| values[place] = *own);
            }
            pack.read_signs(place, machine);
        }
        pack
    }

    /// Takes over the signs that a run holds.
    fn read_signs(&mut self, place: usize, machine: &Machine<'_, N>) {
        self.held.iter_mut().zip(machine.held).for_each(|(values, held)| values[place] = held);
        let signs = machine.equations.rest.first_sign()..;
        let own = machine.work.rest[signs.clone()].iter().take(machine.equations.surfaces.len());
        self.rest[signs].iter_mut().zip(own).for_each(|(values, sign)| values[place] = *sign);
    }

    /// One step of every run that is on its way.
    fn step(&mut self, runners: &mut [Runner<'_, '_, N>], k: usize, part: usize) {
        let goes_along = |r: &Runner<'_, '_, N>| r.is_on_its_way() && r.machine.work.sliding.is_empty();
        let first = runners.iter().position(goes_along).unwrap_or_default();
        // A run that does not go along has the first one's state, and what comes of it is not used.
        let mut sources = [first; W];
        let mut alongside = 0;
        for (place, runner) in runners.iter().enumerate() {
            if goes_along(runner) {
                sources[place] = place;
                alongside += 1;
            }
        }
        let (mut ends, mut rates) = ([[0.0; W]; N], [[0.0; W]; N]);
        if alongside > 1 {
            (ends, rates) = self.advance(runners, sources, k, part);
        }
        for (place, runner) in runners.iter_mut().enumerate().filter(|(_, r)| r.is_on_its_way()) {
            if alongside > 1 && sources[place] == place && goes_along(runner) {
                let span = runner.machine.substep(runner.progress.sample, k, part);
                let switches = runner.response.switches;
                runner.machine.finish(ends.map(|v| v[place]), rates.map(|v| v[place]), &span, runner.response);
                if runner.response.switches == switches {
                    continue;
                }
            } else {
                runner.step(k, part);
            }
            self.read_signs(place, &runner.machine);
        }
    }

    /// The states at the end of a step, and the rates there, every sign as it is held.
    fn advance(
        &mut self,
        runners: &[Runner<'_, '_, N>],
        sources: [usize; W],
        k: usize,
        part: usize,
    ) -> ([[f64; W]; N], [[f64; W]; N]) {
        let machines = sources.map(|source| &runners[source].machine);
        let drives = machines.map(|machine| machine.work.drive.as_chunks::<N>().0);
        let gathered = |of: &dyn Fn(&Machine<'_, N>) -> [f64; N]| -> [[f64; W]; N] {
            let each = machines.map(of);
            std::array::from_fn(|i| each.map(|state| state[i]))
        };
        let start = (gathered(&|machine| machine.x), gathered(&|machine| machine.rate));
        let step = (machines[0].division().0, machines[0].substep(0, k, part));
        let registers = self.registers;
        let right_hand_sides = RightHandSides { pack: self, machines, drives };
        dispatch!(registers, _simd => right_hand_sides.advanced(start, step))
    }
}

/// The right sides of equations that are alike, of each run at once.
struct RightHandSides<'p, 'w, 'm, 'a, const N: usize, const W: usize> {
    pack: &'p mut Pack<'w, N, W>,
    machines: [&'m Machine<'a, N>; W],
    /// What depends on time and inputs alone, at each lane.
    drives: [&'m [[f64; N]]; W],
}

impl<const N: usize, const W: usize> RightHandSides<'_, '_, '_, '_, N, W> {
    /// The states at the end of a step, and the rates there.
    #[inline(always)] // into each width of registers
    fn advanced(
        mut self,
        (x, rate): ([[f64; W]; N], [[f64; W]; N]),
        (method, span): (RungeKutta, Substep),
    ) -> ([[f64; W]; N], [[f64; W]; N]) {
        let ends = method.advance(
            &x,
            &rate,
            (span.length, span.lane, span.end),
            #[inline(always)]
            |x, lane| self.rates(x, lane),
        );
        let at_end = self.rates(&ends, span.end);
        (ends, at_end)
    }

    /// A method asks for them in ten places, and is not compiled with ten of them.
    fn rates(&mut self, x: &[[f64; W]; N], lane: usize) -> [[f64; W]; N] {
        dispatch!(self.pack.registers, _simd => self.rates_here(x, lane))
    }

    #[inline(always)] // into each width of registers
    fn rates_here(&mut self, x: &[[f64; W]; N], lane: usize) -> [[f64; W]; N] {
        let Pack { matrix, held, rest, .. } = &mut *self.pack;
        let equations = self.machines[0].equations;
        let mut rates = *held;
        for ((i, rate), row) in rates.iter_mut().enumerate().zip(&*matrix) {
            rate.iter_mut().zip(self.drives).for_each(|(rate, drive)| *rate += drive[lane][i]);
            for (entry, x) in row.iter().zip(x) {
                rate.iter_mut().zip(entry).zip(x).for_each(|((rate, a), x)| *rate += a * x);
            }
        }
        if !equations.rest_rows.is_empty() {
            rest[1..=equations.states].iter_mut().zip(x).for_each(|(slot, x)| *slot = *x);
            for address in &equations.copied {
                rest[*address] = self.machines.map(|machine| machine.work.forcing[address * LANES + lane]);
            }
            equations.rest.run_beside(rest);
            for (row, slot) in &equations.rest_rows {
                rates[*row].iter_mut().zip(rest[*slot]).for_each(|(rate, more)| *rate += more);
            }
        }
        rates
    }
}
