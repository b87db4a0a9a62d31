//! Terms compiled to a flat list of instructions: no tree is walked and nothing is allocated while they are evaluated.

use std::ops::Range;

use super::calculus::without_bounds;
use super::expression::{Expression, Function, Symbol, sign, whole};
use super::{Kind, Layout};

/// Expressions compiled to a flat list of instructions over numbered slots; shared parts are computed once.
///
/// Slots hold, in order: time, states, inputs, input rates, input accelerations, accelerations, one held sign for each surface,
/// constants, and intermediate values.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    layout: Layout,
    surfaces: usize,
    constants: Vec<f64>,
    instructions: Vec<Instruction>,
    /// The addends of all sums, each a product of two slots.
    addends: Vec<(usize, usize)>,
    outputs: Vec<usize>,
    /// Some expression depends on the first or second derivative of an input.
    rates: bool,
    /// Some expression depends on the second derivative of an input.
    bends: bool,
}

/// The memory that a [`Program`] works in.
pub type Slots = Vec<f64>;

/// Samples of a layout's symbols, one slice a symbol; all of one length.
#[derive(Clone, Copy, Debug)]
pub struct SampleBlock<'a> {
    /// Time of the first sample, s.
    pub start: f64,
    /// Sampling interval, s.
    pub interval: f64,
    /// State vector: displacements, then velocities.
    pub states: &'a [&'a [f64]],
    /// Inputs.
    pub inputs: &'a [&'a [f64]],
    /// Their first derivatives.
    pub input_rates: &'a [&'a [f64]],
    /// Accelerations of the degrees of freedom; empty where no term has one.
    pub accelerations: &'a [&'a [f64]],
}

/// A stretch of samples, as a [`SampleBlock`] borrows it.
#[derive(Clone, Debug)]
pub struct SampleStretch<'a> {
    start: f64,
    interval: f64,
    states: Vec<&'a [f64]>,
    inputs: Vec<&'a [f64]>,
    input_rates: Vec<&'a [f64]>,
    accelerations: Vec<&'a [f64]>,
}

impl<'a> SampleBlock<'a> {
    /// The samples of a range of indices.
    pub fn slice(&self, range: Range<usize>) -> SampleStretch<'a> {
        let cut = |series: &[&'a [f64]]| series.iter().map(|s| &s[range.clone()]).collect();
        SampleStretch {
            start: self.start + self.interval * range.start as f64,
            interval: self.interval,
            states: cut(self.states),
            inputs: cut(self.inputs),
            input_rates: cut(self.input_rates),
            accelerations: cut(self.accelerations),
        }
    }
}

impl<'a> SampleStretch<'a> {
    /// Series from a start on at an interval: states, inputs, their first derivatives, accelerations.
    pub fn new((start, interval): (f64, f64), series: [&'a [Vec<f64>]; 4]) -> Self {
        let [states, inputs, input_rates, accelerations] =
            series.map(|series| series.iter().map(Vec::as_slice).collect());
        Self { start, interval, states, inputs, input_rates, accelerations }
    }

    /// Series from a start on at an interval, as in [`Self::new`].
    pub fn of_slices((start, interval): (f64, f64), series: [Vec<&'a [f64]>; 4]) -> Self {
        let [states, inputs, input_rates, accelerations] = series;
        Self { start, interval, states, inputs, input_rates, accelerations }
    }

    /// The stretch as a block.
    pub fn block(&self) -> SampleBlock<'_> {
        let Self { start, interval, states, inputs, input_rates, accelerations } = self;
        SampleBlock { start: *start, interval: *interval, states, inputs, input_rates, accelerations }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Operation {
    /// The sum of some of the program's addends, from one to before another: stays in a register while it grows.
    Sum(usize, usize),
    Multiply(usize, usize),
    /// To the power of a whole number.
    Whole(usize, i32),
    /// To the power of what another slot holds.
    Power(usize, usize),
    Call(Function, usize),
    Pair(Function, usize, usize),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Instruction {
    operation: Operation,
    target: usize,
}

/// Samples that one pass of [`Program::columns`] works on: small enough for the first-level cache.
pub const LANES: usize = 256;

impl Program {
    /// Compiles expressions whose signs are evaluated as they stand.
    pub fn new(expressions: &[Expression], layout: &Layout) -> Self {
        Compiler::new(layout, None).compile(expressions)
    }

    /// Compiles expressions in which the sign of each of `surfaces` is held: read from its slot, not evaluated.
    pub fn with_held_signs(expressions: &[Expression], layout: &Layout, surfaces: &[Expression]) -> Self {
        Compiler::new(layout, Some(surfaces)).compile(expressions)
    }

    /// The distinct arguments of `sgn` and `|·|` in expressions: where an equation of motion switches.
    pub fn surfaces(expressions: &[Expression]) -> Vec<Expression> {
        let mut found = Vec::new();
        for e in expressions {
            collect_surfaces(&e.normal(), &mut found);
        }
        found
    }

    /// True if some expression depends on a derivative of an input: [`Self::columns`] needs the inputs' rates only then.
    pub fn reads_input_rates(&self) -> bool {
        self.rates
    }

    /// Memory for [`Self::run`], constants in place.
    pub fn slots(&self) -> Slots {
        let mut slots = Slots::new();
        self.prepare_slots(&mut slots);
        slots
    }

    /// Makes memory that served another program ready for [`Self::run`].
    pub fn prepare_slots(&self, slots: &mut Slots) {
        slots.resize(self.slot_count(), 0.0);
        let first = self.first_constant();
        slots[first..first + self.constants.len()].copy_from_slice(&self.constants);
    }

    fn slot_count(&self) -> usize {
        self.first_constant() + self.constants.len() + self.instructions.len()
    }

    fn first_constant(&self) -> usize {
        self.first_sign() + self.surfaces
    }

    /// The slot of the first held sign.
    pub fn first_sign(&self) -> usize {
        symbol_count(&self.layout)
    }

    /// The slot of a symbol; the layout must have it.
    pub fn address(layout: &Layout, symbol: Symbol) -> usize {
        let states = layout.states();
        match symbol {
            Symbol::Time => 0,
            Symbol::State(i) => 1 + i,
            Symbol::Rate(i) => 1 + layout.freedoms + i,
            Symbol::Internal(i) => 1 + states - layout.internals + i,
            Symbol::Input(j) => 1 + states + j,
            Symbol::InputRate(j) => 1 + states + layout.inputs + j,
            Symbol::InputAcceleration(j) => 1 + states + 2 * layout.inputs + j,
            Symbol::Acceleration(i) => 1 + states + 3 * layout.inputs + i,
        }
    }

    /// The slot that holds expression `index` after [`Self::run`].
    #[inline]
    pub fn output(&self, index: usize) -> usize {
        self.outputs[index]
    }

    /// Evaluates every expression from the symbols and signs in `slots` (made by [`Self::slots`]).
    #[inline]
    pub fn run(&self, slots: &mut [f64]) {
        for Instruction { operation, target } in &self.instructions {
            slots[*target] = match *operation {
                Operation::Sum(from, to) => {
                    let addend = |(a, b): &(usize, usize)| slots[*a] * slots[*b];
                    let mut addends = self.addends[from..to].iter().map(addend);
                    let first = addends.next().unwrap_or(0.0);
                    addends.fold(first, |sum, addend| sum + addend)
                }
                Operation::Multiply(a, b) => slots[a] * slots[b],
                Operation::Whole(a, exponent) => slots[a].powi(exponent),
                Operation::Power(a, b) => slots[a].powf(slots[b]),
                Operation::Call(Function::Sgn, a) => sign(slots[a]),
                Operation::Call(Function::Abs, a) => slots[a].abs(),
                Operation::Call(function, a) => function.value(&[slots[a]]),
                Operation::Pair(function, a, b) => function.value(&[slots[a], slots[b]]),
            };
        }
    }

    /// True if another program does the same with other constants: then [`Self::run_beside`] serves both.
    pub fn is_like(&self, other: &Self) -> bool {
        self.layout == other.layout
            && self.surfaces == other.surfaces
            && self.constants.len() == other.constants.len()
            && self.instructions == other.instructions
            && self.addends == other.addends
            && self.outputs == other.outputs
    }

    /// Makes one place of each slot ready for [`Self::run_beside`], with this program's constants.
    pub fn prepare_beside<const W: usize>(&self, slots: &mut Vec<[f64; W]>, place: usize) {
        slots.resize(self.slot_count(), [0.0; W]);
        for (slot, constant) in slots[self.first_constant()..].iter_mut().zip(&self.constants) {
            slot[place] = *constant;
        }
    }

    /// As [`Self::run`], for programs that are alike at once: each slot holds a value of each of them.
    #[inline(always)] // into each width of registers
    pub fn run_beside<const W: usize>(&self, slots: &mut [[f64; W]]) {
        #[inline(always)]
        fn of_one<const W: usize>(a: [f64; W], f: impl Fn(f64) -> f64) -> [f64; W] {
            a.map(f)
        }
        #[inline(always)]
        fn of_two<const W: usize>(a: [f64; W], b: [f64; W], f: impl Fn(f64, f64) -> f64) -> [f64; W] {
            let mut out = a;
            out.iter_mut().zip(b).for_each(|(o, b)| *o = f(*o, b));
            out
        }
        for Instruction { operation, target } in &self.instructions {
            slots[*target] = match *operation {
                Operation::Sum(from, to) => {
                    let mut sum = [0.0; W];
                    for (k, (a, b)) in self.addends[from..to].iter().enumerate() {
                        let product = of_two(slots[*a], slots[*b], |a, b| a * b);
                        sum = if k == 0 { product } else { of_two(sum, product, |sum, product| sum + product) };
                    }
                    sum
                }
                Operation::Multiply(a, b) => of_two(slots[a], slots[b], |a, b| a * b),
                Operation::Whole(a, exponent) => of_one(slots[a], |a| a.powi(exponent)),
                Operation::Power(a, b) => of_two(slots[a], slots[b], f64::powf),
                Operation::Call(Function::Sgn, a) => of_one(slots[a], sign),
                Operation::Call(Function::Abs, a) => of_one(slots[a], f64::abs),
                Operation::Call(function, a) => of_one(slots[a], |a| function.value(&[a])),
                Operation::Pair(function, a, b) => of_two(slots[a], slots[b], |a, b| function.value(&[a, b])),
            };
        }
    }

    /// Evaluates every expression over samples: one column an expression, appended to `columns`. Second derivatives of inputs
    /// are differences of the first ones.
    ///
    /// # Panics
    /// If `columns` does not hold one vector an expression.
    pub fn columns(&self, samples: &SampleBlock<'_>, columns: &mut [Vec<f64>]) {
        assert_eq!(columns.len(), self.outputs.len(), "one column for each expression");
        let count = samples.states.first().or(samples.inputs.first()).map_or(0, |s| s.len());
        let mut memory = Slots::new();
        self.prepare_lanes(&mut memory);
        let second = self.layout.kind == Kind::SecondOrder;
        let first_acceleration = Self::address(&self.layout, Symbol::Acceleration(0));
        let first_bend = Self::address(&self.layout, Symbol::InputAcceleration(0));
        let bent = if self.bends { samples.input_rates } else { &[] };
        let bends: Vec<Vec<f64>> = bent.iter().map(|rate| differences(rate, samples.interval)).collect();
        for column in columns.iter_mut() {
            column.reserve(count);
        }
        for from in (0..count).step_by(LANES) {
            let lanes = LANES.min(count - from);
            for (lane, slot) in memory[..lanes].iter_mut().enumerate() {
                *slot = samples.start + samples.interval * (from + lane) as f64;
            }
            let symbols = samples.states.iter().chain(samples.inputs).chain(samples.input_rates);
            let accelerations = samples.accelerations.iter().take(if second { self.layout.freedoms } else { 0 });
            let places = (1..).zip(symbols).chain((first_acceleration..).zip(accelerations)).map(|(k, v)| (k, &**v));
            for (place, values) in places.chain((first_bend..).zip(bends.iter().map(Vec::as_slice))) {
                memory[place * LANES..][..lanes].copy_from_slice(&values[from..from + lanes]);
            }
            self.run_lanes(&mut memory, 0..lanes);
            for (column, output) in columns.iter_mut().zip(&self.outputs) {
                column.extend_from_slice(&memory[output * LANES..][..lanes]);
            }
        }
    }

    /// Makes memory ready for [`Self::run_lanes`]: [`LANES`] values of each slot, one slot after the other.
    pub fn prepare_lanes(&self, memory: &mut Slots) {
        memory.resize(self.slot_count() * LANES, 0.0);
        let first = self.first_constant();
        for (k, c) in self.constants.iter().enumerate() {
            memory[(first + k) * LANES..(first + k + 1) * LANES].fill(*c);
        }
    }

    /// Evaluates every expression at several instants at once, from the symbols in `memory` (see [`Self::prepare_lanes`]).
    pub fn run_lanes(&self, memory: &mut [f64], lanes: Range<usize>) {
        for Instruction { operation, target } in &self.instructions {
            let (known, rest) = memory.split_at_mut(target * LANES);
            let out = &mut rest[lanes.clone()];
            let slot = |k: usize| &known[k * LANES..][lanes.clone()];
            let map = |out: &mut [f64], a: usize, f: &dyn Fn(f64) -> f64| {
                for (o, a) in out.iter_mut().zip(slot(a)) {
                    *o = f(*a);
                }
            };
            match *operation {
                Operation::Sum(from, to) => {
                    for (k, (a, b)) in self.addends[from..to].iter().enumerate() {
                        for ((o, a), b) in out.iter_mut().zip(slot(*a)).zip(slot(*b)) {
                            *o = if k == 0 { a * b } else { *o + a * b };
                        }
                    }
                }
                Operation::Multiply(a, b) => {
                    for ((o, a), b) in out.iter_mut().zip(slot(a)).zip(slot(b)) {
                        *o = a * b;
                    }
                }
                Operation::Whole(a, exponent) => map(out, a, &|a| a.powi(exponent)),
                Operation::Power(a, b) => {
                    for ((o, a), b) in out.iter_mut().zip(slot(a)).zip(slot(b)) {
                        *o = a.powf(*b);
                    }
                }
                Operation::Call(Function::Sgn, a) => out.iter_mut().zip(slot(a)).for_each(|(o, a)| *o = sign(*a)),
                Operation::Call(Function::Abs, a) => out.iter_mut().zip(slot(a)).for_each(|(o, a)| *o = a.abs()),
                Operation::Call(function, a) => map(out, a, &|a| function.value(&[a])),
                Operation::Pair(function, a, b) => {
                    for ((o, a), b) in out.iter_mut().zip(slot(a)).zip(slot(b)) {
                        *o = function.value(&[*a, *b]);
                    }
                }
            }
        }
    }
}

fn symbol_count(layout: &Layout) -> usize {
    let accelerations = if layout.kind == Kind::SecondOrder { layout.freedoms } else { 0 };
    1 + layout.states() + 3 * layout.inputs + accelerations
}

/// The derivative of a series by central differences; one-sided at its ends.
fn differences(series: &[f64], interval: f64) -> Vec<f64> {
    let last = series.len().saturating_sub(1);
    (0..series.len())
        .map(|k| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
            (series[after] - series[before]) / ((after - before).max(1) as f64 * interval)
        })
        .collect()
}

fn collect_surfaces(e: &Expression, found: &mut Vec<Expression>) {
    if let Expression::Call(function, arguments) = e {
        if let Some(plain) = without_bounds(*function, arguments) {
            return collect_surfaces(&plain.normal(), found);
        }
        if matches!(function, Function::Sgn | Function::Abs) && !found.contains(&arguments[0]) {
            collect_surfaces(&arguments[0], found);
            if !found.contains(&arguments[0]) {
                found.push(arguments[0].clone());
            }
            return;
        }
    }
    match e {
        Expression::Number(_) | Expression::Symbol(_) => {}
        Expression::Sum(parts) | Expression::Product(parts) | Expression::Call(_, parts) => {
            parts.iter().for_each(|p| collect_surfaces(p, found));
        }
        Expression::Power(base, _) => collect_surfaces(base, found),
    }
}

struct Compiler<'a> {
    layout: &'a Layout,
    surfaces: Option<&'a [Expression]>,
    constants: Vec<f64>,
    known: Vec<(Expression, Operand)>,
    /// None where a product has become part of a sum.
    operations: Vec<Option<Operation>>,
    /// As in [`Program`]; operands until compiled.
    addends: Vec<(usize, usize)>,
}

/// Where a value will be: constants and results are numbered apart until both counts are known.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Operand {
    Slot(usize),
    Constant(usize),
    Result(usize),
}

/// Places are packed into the operands of [`Operation`] until compiled: constants and results get these offsets.
const CONSTANT: usize = 1 << 20;
const RESULT: usize = 1 << 24;

impl<'a> Compiler<'a> {
    fn new(layout: &'a Layout, surfaces: Option<&'a [Expression]>) -> Self {
        Self { layout, surfaces, constants: Vec::new(), known: Vec::new(), operations: Vec::new(), addends: Vec::new() }
    }

    fn compile(mut self, expressions: &[Expression]) -> Program {
        let (mut rates, mut bends) = (false, false);
        for e in expressions {
            e.visit(&mut |e| {
                bends |= matches!(e, Expression::Symbol(Symbol::InputAcceleration(_)));
                rates |= bends || matches!(e, Expression::Symbol(Symbol::InputRate(_)));
            });
        }
        let outputs: Vec<usize> = expressions.iter().map(|e| operand(self.place(&e.normal()))).collect();
        self.fuse(&outputs);
        let surfaces = self.surfaces.map_or(0, <[_]>::len);
        let first_constant = symbol_count(self.layout) + surfaces;
        let first_result = first_constant + self.constants.len();
        let mut targets = Vec::with_capacity(self.operations.len());
        let mut kept = 0;
        for operation in &self.operations {
            targets.push(first_result + kept);
            kept += usize::from(operation.is_some());
        }
        let settle = |k: usize| match k {
            k if k >= RESULT => targets[k - RESULT],
            k if k >= CONSTANT => first_constant + k - CONSTANT,
            k => k,
        };
        let instructions = self
            .operations
            .iter()
            .zip(&targets)
            .filter_map(|(operation, target)| Some((operation.as_ref()?, *target)))
            .map(|(operation, target)| Instruction {
                operation: match *operation {
                    Operation::Sum(from, to) => Operation::Sum(from, to),
                    Operation::Multiply(a, b) => Operation::Multiply(settle(a), settle(b)),
                    Operation::Whole(a, n) => Operation::Whole(settle(a), n),
                    Operation::Power(a, b) => Operation::Power(settle(a), settle(b)),
                    Operation::Call(f, a) => Operation::Call(f, settle(a)),
                    Operation::Pair(f, a, b) => Operation::Pair(f, settle(a), settle(b)),
                },
                target,
            })
            .collect();
        let addends = self.addends.iter().map(|(a, b)| (settle(*a), settle(*b))).collect();
        Program {
            layout: *self.layout,
            surfaces,
            constants: self.constants,
            instructions,
            addends,
            outputs: outputs.into_iter().map(settle).collect(),
            rates,
            bends,
        }
    }

    fn place(&mut self, e: &Expression) -> Operand {
        if let Some((_, place)) = self.known.iter().find(|(known, _)| known == e) {
            return *place;
        }
        let place = match e {
            Expression::Number(n) => self.constant(*n),
            Expression::Symbol(s) => Operand::Slot(Program::address(self.layout, *s)),
            Expression::Sum(parts) => self.sum(parts),
            Expression::Product(parts) => self.product(parts),
            Expression::Power(base, n) => {
                let a = operand(self.place(base));
                match *n {
                    2.0 => self.push(Operation::Multiply(a, a)),
                    3.0 => {
                        let square = operand(self.place(&Expression::Power(base.clone(), 2.0)));
                        self.push(Operation::Multiply(square, a))
                    }
                    n => match whole(n) {
                        Some(n) => self.push(Operation::Whole(a, n)),
                        None => {
                            let b = operand(self.place(&Expression::Number(n)));
                            self.push(Operation::Power(a, b))
                        }
                    },
                }
            }
            Expression::Call(function, arguments) => self.call(*function, arguments),
        };
        self.known.push((e.clone(), place));
        place
    }

    fn call(&mut self, function: Function, arguments: &[Expression]) -> Operand {
        // Held signs need bounds written with `|·|`; values alone are better computed as they stand.
        if self.surfaces.is_some()
            && let Some(plain) = without_bounds(function, arguments)
        {
            return self.place(&plain.normal());
        }
        if let [a, b] = arguments {
            let (a, b) = (operand(self.place(a)), operand(self.place(b)));
            return self.push(Operation::Pair(function, a, b));
        }
        let argument = &arguments[0];
        let held = match function {
            Function::Sgn | Function::Abs => self.surfaces.and_then(|s| s.iter().position(|s| s == argument)),
            _ => None,
        };
        match (held, function) {
            (Some(k), Function::Sgn) => Operand::Slot(symbol_count(self.layout) + k),
            (Some(k), _) => {
                let a = operand(self.place(argument));
                self.push(Operation::Multiply(symbol_count(self.layout) + k, a))
            }
            (None, _) => {
                let a = operand(self.place(argument));
                self.push(Operation::Call(function, a))
            }
        }
    }

    fn constant(&mut self, value: f64) -> Operand {
        self.constants.push(value);
        Operand::Constant(self.constants.len() - 1)
    }

    fn product(&mut self, parts: &[Expression]) -> Operand {
        let places: Vec<Operand> = parts.iter().map(|part| self.place(part)).collect();
        let mut sofar = places[0];
        for next in &places[1..] {
            sofar = self.push(Operation::Multiply(operand(sofar), operand(*next)));
        }
        sofar
    }

    fn sum(&mut self, parts: &[Expression]) -> Operand {
        let places: Vec<usize> = parts.iter().map(|part| operand(self.place(part))).collect();
        let one = operand(self.place(&Expression::Number(1.0)));
        let from = self.addends.len();
        self.addends.extend(places.into_iter().map(|place| (place, one)));
        self.push(Operation::Sum(from, self.addends.len()))
    }

    /// Products that nothing but one sum needs are multiplied where they are added.
    fn fuse(&mut self, outputs: &[usize]) {
        let mut uses = vec![0; self.operations.len()];
        let mut count = |k: usize| {
            if let Some(k) = k.checked_sub(RESULT) {
                uses[k] += 1;
            }
        };
        outputs.iter().copied().for_each(&mut count);
        self.addends.iter().for_each(|(a, _)| count(*a));
        for operation in self.operations.iter().flatten() {
            match *operation {
                Operation::Sum(..) => {}
                Operation::Multiply(a, b) | Operation::Power(a, b) | Operation::Pair(_, a, b) => {
                    [a, b].into_iter().for_each(&mut count);
                }
                Operation::Whole(a, _) | Operation::Call(_, a) => count(a),
            }
        }
        for addend in &mut self.addends {
            let Some(k) = addend.0.checked_sub(RESULT) else { continue };
            if uses[k] == 1
                && let Some(Operation::Multiply(a, b)) = self.operations[k]
            {
                *addend = (a, b);
                self.operations[k] = None;
            }
        }
    }

    fn push(&mut self, operation: Operation) -> Operand {
        if let Some(k) = self.operations.iter().position(|known| *known == Some(operation)) {
            return Operand::Result(k);
        }
        self.operations.push(Some(operation));
        Operand::Result(self.operations.len() - 1)
    }
}

fn operand(place: Operand) -> usize {
    match place {
        Operand::Slot(k) => k,
        Operand::Constant(k) => CONSTANT + k,
        Operand::Result(k) => RESULT + k,
    }
}

impl Layout {
    /// True if every symbol of the expression is one that [`Program::columns`] is given.
    pub fn covers(&self, e: &Expression) -> bool {
        let mut all = true;
        e.visit(&mut |e| {
            if let Expression::Symbol(s) = e {
                all &= self.has(*s) && (self.kind == Kind::SecondOrder || !matches!(s, Symbol::Rate(_)));
            }
        });
        all
    }
}
