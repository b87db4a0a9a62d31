//! Steps across the jumps and kinks of an equation: which side of each surface the motion is on, and when it changes.

use std::ops::Range;

use super::integrate::{Machine, Substep};
use super::{Response, Stick};
use sindyscope_values::term::LANES;

/// Changes within one interval after which its rest is taken as it comes: a motion that switches without end (as
/// `d²x/dt² = −sgn(x) − dx/dt` does before it comes to rest) must not hold up the run.
pub(super) const MAX_CHANGES: usize = 16;

/// Surfaces that can be held at zero at once; further ones are passed.
pub(super) const MAX_SLIDING: usize = 8;

/// A surface's value below this share of its largest so far does not tell a side.
const RESOLUTION: f64 = 1e-12;

/// Which side of a surface the motion is on, and where it was at the beginning and at the end of the step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Side {
    /// The held sign: −1, 1, or 0 where the surface is zero for good or slides.
    sign: f64,
    /// The surface is held at zero.
    sliding: bool,
    /// The sign's equivalent value while sliding.
    equivalent: f64,
    /// The surface's value, or the equivalent value while sliding, at the step's beginning.
    value: f64,
    /// Its time derivative there.
    slope: f64,
    /// The value at the step's end.
    next: f64,
    /// Its time derivative there.
    next_slope: f64,
    /// Largest magnitude of the surface's value so far.
    largest: f64,
    /// Index of the present stick in the response.
    stick: usize,
}

/// What happens to a side within a step; places are shares of the step, estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SideChange {
    /// The surface goes through zero.
    Cross(f64),
    /// The equivalent value exceeds what a stick holds.
    Leave(f64),
    /// The surface comes near zero and turns back, and may have been beyond for a while.
    Touch(f64),
    /// A surface that was zero begins to differ from it.
    Begin,
    /// The surface has become zero for good.
    Vanish,
}

impl SideChange {
    fn place(self) -> f64 {
        match self {
            Self::Cross(p) | Self::Leave(p) | Self::Touch(p) => p,
            Self::Begin | Self::Vanish => 0.0,
        }
    }
}

impl Side {
    /// Below, above, or held at zero.
    pub(super) fn code(&self) -> u64 {
        match self.sliding {
            true => 3,
            false if self.sign > 0.0 => 2,
            false => u64::from(self.sign < 0.0),
        }
    }

    #[inline]
    fn change(&self, length: f64, hold: f64) -> Option<SideChange> {
        if self.sliding {
            return (self.next.abs() > hold + RESOLUTION).then(|| {
                let (before, after) = (hold - self.value.abs(), self.next.abs() - hold);
                SideChange::Leave(if before > 0.0 { before / (before + after) } else { 0.0 })
            });
        }
        if self.sign == 0.0 {
            return (self.next != 0.0).then_some(SideChange::Begin);
        }
        let (value, next) = (self.sign * self.value, self.sign * self.next);
        if next < -RESOLUTION * self.largest {
            return Some(SideChange::Cross(self.zero(length)));
        }
        let (slope, next_slope) = (self.sign * self.slope, self.sign * self.next_slope);
        if slope < 0.0 && next_slope > 0.0 && value < -slope * length && next < next_slope * length {
            return self.lowest(length, 0.5 * value.min(next)).map(SideChange::Touch);
        }
        (value == 0.0 && next == 0.0).then_some(SideChange::Vanish)
    }

    /// The cubic through values and slopes at both ends, at a share of the step.
    fn cubic(&self, share: f64, length: f64) -> f64 {
        let (s, r) = (share, 1.0 - share);
        self.sign
            * (r * r * ((1.0 + 2.0 * s) * self.value + s * length * self.slope)
                + s * s * ((1.0 + 2.0 * r) * self.next - r * length * self.next_slope))
    }

    /// About where the cubic passes zero; it starts on the side that is held and ends on the other.
    fn zero(&self, length: f64) -> f64 {
        let (mut low, mut high) = ((0.0, self.sign * self.value), (1.0, self.sign * self.next));
        let (mut share, mut kept) = (0.5, 0);
        // Regula falsi with the Illinois modification: an estimate, which the search for the change makes exact.
        for _ in 0..8 {
            let secant = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
            share = if secant > low.0 && secant < high.0 { secant } else { 0.5 * (low.0 + high.0) };
            let value = self.cubic(share, length);
            if value > 0.0 {
                low = (share, value);
                high.1 *= if kept == 1 { 0.5 } else { 1.0 };
                kept = 1;
            } else {
                high = (share, value);
                low.1 *= if kept == -1 { 0.5 } else { 1.0 };
                kept = -1;
            }
        }
        share
    }

    /// Where the cubic is lowest, if it is below `limit` there and may be below zero.
    fn lowest(&self, length: f64, limit: f64) -> Option<f64> {
        let mut best = (f64::INFINITY, 0.5);
        for k in 1..32 {
            let share = f64::from(k) / 32.0;
            let value = self.cubic(share, length);
            if value < best.0 {
                best = (value, share);
            }
        }
        // The true lowest point lies between two of these, by less than this lower.
        let slack = 1e-3 * length * (self.slope.abs() + self.next_slope.abs());
        (best.0 < limit && best.0 < slack).then_some(best.1)
    }
}

impl<const N: usize> Machine<'_, N> {
    /// Takes the sides at the beginning of a run.
    pub(super) fn begin(&mut self, lane: usize, time: f64, response: &mut Response) {
        let x = self.x;
        let mut at_zero = [0; MAX_SLIDING];
        let mut count = 0;
        for k in 0..self.work.sides.len() {
            self.load_curved(&x, lane);
            let value = self.value(k, &x, lane);
            let surface = &self.equations.surfaces[k];
            let mut size: f64 = surface.support.iter().map(|i| (surface.gradient[*i] * x[*i]).abs()).sum();
            size += surface.offset.map_or(0.0, |(slot, _)| self.work.forcing[slot * LANES + lane].abs());
            let zero = value.abs() <= RESOLUTION * size || value == 0.0;
            if zero && surface.jumps && !surface.is_external() && count < MAX_SLIDING {
                at_zero[count] = k;
                count += 1;
            }
            self.set_sign(k, if zero { 0.0 } else { value.signum() });
        }
        self.settle(&x, lane, time, None, &at_zero[..count], response);
        self.rate = self.rates(&x, lane);
        let rate = self.rate;
        self.observe(&x, &rate, lane);
        for k in 0..self.work.sides.len() {
            let side = self.work.sides[k];
            if !side.sliding && side.sign == 0.0 && side.next_slope != 0.0 {
                self.set_sign(k, side.next_slope.signum());
            }
        }
        self.rate = self.rates(&x, lane);
        let rate = self.rate;
        self.observe(&x, &rate, lane);
        self.accept_sides();
        self.widen_scale(lane);
        for (side, surface) in self.work.sides.iter_mut().zip(&self.equations.surfaces) {
            let reach: f64 = surface.support.iter().map(|i| (surface.gradient[*i] * self.scale[*i]).abs()).sum();
            side.largest = side.largest.max(reach);
        }
    }

    /// Sees where every surface is at the end of a step.
    #[inline]
    pub(super) fn observe(&mut self, x: &[f64; N], rate: &[f64; N], lane: usize) {
        self.load_curved(x, lane);
        for k in 0..self.work.sides.len() {
            let (next, next_slope) = if self.work.sides[k].sliding {
                (self.work.sides[k].equivalent, 0.0)
            } else {
                (self.value(k, x, lane), self.along(k, rate) + self.drift(k, lane))
            };
            let side = &mut self.work.sides[k];
            (side.next, side.next_slope) = (next, next_slope);
        }
    }

    /// The step is taken: its end is the next one's beginning.
    #[inline]
    pub(super) fn accept_sides(&mut self) {
        for side in &mut self.work.sides {
            (side.value, side.slope) = (side.next, side.next_slope);
            if !side.sliding {
                side.largest = side.largest.max(side.next.abs());
            }
        }
    }

    /// True if some side changes within a step of this length.
    #[inline]
    pub(super) fn disturbed(&self, length: f64) -> bool {
        self.work.sides.iter().any(|side| side.change(length, self.equations.hold).is_some())
    }

    /// The change that comes first.
    fn first_change(&self, length: f64) -> Option<(usize, SideChange)> {
        let changes = self
            .work
            .sides
            .iter()
            .enumerate()
            .filter_map(|(k, s)| s.change(length, self.equations.hold).map(|c| (k, c)));
        changes.min_by(|a, b| a.1.place().total_cmp(&b.1.place()))
    }

    /// A step in which some side changes: from change to change.
    #[cold]
    pub(super) fn step_with_switches(&mut self, span: &Substep, response: &mut Response) {
        let time = |share: f64| {
            let place = span.from + share * (span.to - span.from);
            self.grid.time(span.sample) + self.grid.interval() * place
        };
        let (mut done, mut end) = (0.0, 1.0);
        while self.changes > 0 {
            self.changes -= 1;
            let part = self.trial(span, done, end);
            let Some((k, change)) = self.first_change(part.length) else {
                self.take(part.end);
                if end >= 1.0 {
                    return;
                }
                (done, end) = (end, 1.0);
                continue;
            };
            let at = match change {
                SideChange::Touch(place) => {
                    end = done + place * (end - done);
                    continue;
                }
                SideChange::Begin | SideChange::Vanish => done,
                SideChange::Cross(place) | SideChange::Leave(place) => {
                    let at = self.locate(k, change, span, done..end, place);
                    if at > done {
                        let part = self.trial(span, done, at);
                        let earlier = |(other, side): (usize, &Side)| {
                            other != k
                                && matches!(
                                    side.change(part.length, self.equations.hold),
                                    Some(SideChange::Cross(_) | SideChange::Leave(_))
                                )
                        };
                        if at < end && self.work.sides.iter().enumerate().any(earlier) {
                            end = at;
                            continue;
                        }
                        self.take(part.end);
                    }
                    at
                }
            };
            let part = self.part(span, at, 1.0);
            self.switch(k, change, part.lane, time(at), response);
            if 1.0 - at < 1e-9 {
                self.rejoin(span);
                return;
            }
            (done, end) = (at, 1.0);
        }
        if done < 1.0 {
            let part = self.trial(span, done, 1.0);
            self.take(part.end);
        }
        self.read_sides(span.end, time(1.0), response);
        self.rejoin(span);
    }

    /// Integrates a part of a span and sees where every surface is at its beginning and end; the state stays.
    fn trial(&mut self, span: &Substep, from: f64, to: f64) -> Substep {
        let part = self.part(span, from, to);
        let x = self.x;
        let rate = self.rates(&x, part.lane);
        self.observe(&x, &rate, part.lane);
        self.accept_sides();
        let next = self.advance(&x, &rate, &part);
        let next_rate = self.rates(&next, part.end);
        self.observe(&next, &next_rate, part.end);
        (self.ahead, self.rate) = (next, next_rate);
        part
    }

    /// Moves to the end of the last trial.
    fn take(&mut self, lane: usize) {
        self.x = self.ahead;
        self.accept_sides();
        if !self.work.sliding.is_empty() {
            self.project(lane);
        }
    }

    /// Takes rates and surfaces anew at the end of a span.
    fn rejoin(&mut self, span: &Substep) {
        let x = self.x;
        self.rate = self.rates(&x, span.end);
        let rate = self.rate;
        self.observe(&x, &rate, span.end);
        self.accept_sides();
    }

    /// The share of the span at which side `k` changes, within a part of it at whose beginning the state is.
    ///
    /// Regula falsi with the Illinois modification, from the estimate on.
    fn locate(&mut self, k: usize, change: SideChange, span: &Substep, within: Range<f64>, place: f64) -> f64 {
        let Range { start: done, end } = within;
        let sign = self.work.sides[k].sign;
        let leaves = matches!(change, SideChange::Leave(_));
        // A stick is left just beyond its limit, so that the motion then starts to the side that it is left to.
        let hold = self.equations.hold;
        let distance = |value: f64| if leaves { hold + RESOLUTION - value.abs() } else { sign * value };
        let side = self.work.sides[k];
        let resolution = match (leaves, self.equations.surfaces[k].jumps) {
            (true, _) => 0.5 * RESOLUTION,
            (false, true) => 1e-3 * RESOLUTION * side.largest,
            // A kink that is missed by a little changes the motion by the square of it.
            (false, false) => 1e-7 * side.largest,
        };
        let (mut low, mut high) = ((0.0, distance(side.value)), (1.0, distance(side.next)));
        if low.1 <= 0.0 && (leaves || sign * side.slope <= 0.0) {
            return done;
        }
        let mut next = place;
        let mut kept = 0;
        for _ in 0..60 {
            if !(next > low.0 && next < high.0) {
                next = 0.5 * (low.0 + high.0);
            }
            self.trial(span, done, done + next * (end - done));
            let found = distance(self.work.sides[k].next);
            if found.abs() <= resolution {
                return done + next * (end - done);
            }
            if found > 0.0 {
                low = (next, found);
                if kept == 1 {
                    high.1 *= 0.5;
                }
                kept = 1;
            } else {
                high = (next, found);
                if kept == -1 {
                    low.1 *= 0.5;
                }
                kept = -1;
            }
            if high.0 - low.0 < 1e-12 {
                break;
            }
            // A side that was changed a moment ago starts at zero: the zero that is sought lies further on.
            next = if low.1 > resolution { low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1) } else { f64::NAN };
        }
        if high.0 < 1e-9 && side.value * sign <= resolution { done } else { done + high.0 * (end - done) }
    }

    /// Carries out a change at the present state.
    fn switch(&mut self, k: usize, change: SideChange, lane: usize, time: f64, response: &mut Response) {
        response.switches += 1;
        let side = self.work.sides[k];
        match change {
            SideChange::Leave(_) => {
                let sign = if side.equivalent < 0.0 { -1.0 } else { 1.0 };
                self.release(k, sign, time, response);
            }
            SideChange::Vanish => self.set_sign(k, 0.0),
            SideChange::Begin if !self.can_slide(k) => self.set_sign(k, side.next.signum()),
            SideChange::Cross(_) | SideChange::Touch(_) if !self.can_slide(k) => self.set_sign(k, -side.sign),
            SideChange::Begin | SideChange::Cross(_) | SideChange::Touch(_) => {
                let mut active = [0; MAX_SLIDING];
                let mut count = 0;
                for other in self.work.sliding.iter().chain(&[k]) {
                    active[count] = *other;
                    count += 1;
                }
                let x = self.x;
                self.settle(&x, lane, time, Some(k), &active[..count], response);
            }
        }
    }

    fn can_slide(&self, k: usize) -> bool {
        let surface = &self.equations.surfaces[k];
        surface.jumps && !surface.is_external() && self.work.sliding.len() + 1 < MAX_SLIDING
    }

    /// Decides for surfaces at zero between passing and sticking; `changed` is the one that has just come there.
    ///
    /// The signs s are sought for which each surface's slope a + B s is zero, or points away from zero where s is at its
    /// bound: a linear complementarity problem, solved by projected Gauss–Seidel sweeps.
    fn settle(
        &mut self,
        x: &[f64; N],
        lane: usize,
        time: f64,
        changed: Option<usize>,
        active: &[usize],
        response: &mut Response,
    ) {
        let m = active.len();
        let mut signs = [0.0; MAX_SLIDING];
        let mut before = [0.0; MAX_SLIDING];
        for (i, k) in active.iter().enumerate() {
            let side = self.work.sides[*k];
            before[i] = side.sign;
            signs[i] = if side.sliding { side.equivalent } else { side.sign };
            self.work.sliding.retain(|s| s != k);
            self.set_sign(*k, 0.0);
        }
        let base = self.rates_held(x, lane);
        self.load_curved(x, lane);
        let mut slopes = [0.0; MAX_SLIDING];
        let mut effect = [[0.0; MAX_SLIDING]; MAX_SLIDING];
        for (j, k) in active.iter().enumerate() {
            slopes[j] = self.along(*k, &base) + self.drift(*k, lane);
            let column = self.column(*k, x, lane, &base);
            for (i, other) in active.iter().enumerate() {
                effect[i][j] = self.along(*other, &column);
            }
        }
        let hold = self.equations.hold;
        for _ in 0..200 {
            let mut moved: f64 = 0.0;
            for i in 0..m {
                let others: f64 = (0..m).filter(|j| *j != i).map(|j| effect[i][j] * signs[j]).sum();
                let slope = slopes[i] + others;
                let sign = if effect[i][i] < 0.0 {
                    let needed = -slope / effect[i][i];
                    // What sticks holds more than what slides pulls.
                    if needed.abs() < hold { needed } else { needed.clamp(-1.0, 1.0) }
                } else if changed == Some(active[i]) && before[i] != 0.0 {
                    -before[i]
                } else {
                    sindyscope_values::term::sign(slope)
                };
                moved = moved.max((sign - signs[i]).abs());
                signs[i] = sign;
            }
            if m < 2 || moved < 1e-14 {
                break;
            }
        }
        for (i, k) in active.iter().enumerate() {
            // A surface that is reached and yet left to where it was reached from is touched: it is let stick, and leaves.
            let touched = changed == Some(*k) && signs[i] == before[i];
            let sticks = effect[i][i] < 0.0 && ((signs[i].abs() < hold && signs[i].abs() != 1.0) || touched);
            if !sticks {
                let sign = if signs[i].is_nan() { 0.0 } else { signs[i] };
                self.release(*k, sign, time, response);
                continue;
            }
            self.work.sliding.push(*k);
            let side = &mut self.work.sides[*k];
            side.equivalent = signs[i];
            if !side.sliding {
                side.sliding = true;
                side.stick = response.sticks.len();
                response.sticks.push(Stick { surface: *k, from: time, to: time });
            }
        }
    }

    /// Ends a stick, if there is one, and holds a sign.
    fn release(&mut self, k: usize, sign: f64, time: f64, response: &mut Response) {
        let side = &mut self.work.sides[k];
        if side.sliding {
            side.sliding = false;
            response.sticks[side.stick].to = time;
            self.work.sliding.retain(|s| *s != k);
        }
        self.set_sign(k, sign);
    }

    /// Reads every held sign from where its surface is.
    fn read_sides(&mut self, lane: usize, time: f64, response: &mut Response) {
        let x = self.x;
        for k in 0..self.work.sides.len() {
            let side = self.work.sides[k];
            if side.sliding {
                if side.equivalent.abs() > self.equations.hold {
                    self.release(k, side.equivalent.signum(), time, response);
                }
                continue;
            }
            self.load_curved(&x, lane);
            let value = self.value(k, &x, lane);
            if value != 0.0 && !value.is_nan() && value.signum() != side.sign {
                response.switches += 1;
                self.set_sign(k, value.signum());
            }
        }
    }

    pub(super) fn end_sticks(&mut self, time: f64, response: &mut Response) {
        for side in self.work.sides.iter().filter(|s| s.sliding) {
            response.sticks[side.stick].to = time;
        }
    }

    fn set_sign(&mut self, k: usize, sign: f64) {
        self.work.sides[k].sign = sign;
        self.work.rest[self.equations.rest.first_sign() + k] = sign;
        self.work.curved[self.equations.curved.first_sign() + k] = sign;
        self.stiffness_changed |= self.equations.surfaces[k].mixed;
        self.held = [0.0; N];
        for (surface, side) in self.equations.surfaces.iter().zip(&self.work.sides) {
            for (held, gain) in self.held.iter_mut().zip(&surface.gain) {
                *held += gain * side.sign;
            }
        }
    }

    /// Adds to the rates what keeps every sliding surface at zero, and keeps the equivalent values.
    #[cold]
    #[expect(clippy::needless_range_loop, reason = "one index runs through several lists")]
    pub(super) fn slide(&mut self, x: &[f64; N], lane: usize, rates: &mut [f64; N]) {
        let m = self.work.sliding.len();
        let base = *rates;
        self.load_curved(x, lane);
        let mut right = [0.0; MAX_SLIDING];
        let mut signs = [0.0; MAX_SLIDING];
        self.work.columns.resize(MAX_SLIDING * N, 0.0);
        for j in 0..m {
            let k = self.work.sliding[j];
            let column = self.column(k, x, lane, &base);
            self.work.columns[j * N..(j + 1) * N].copy_from_slice(&column);
            right[j] = -(self.along(k, &base) + self.drift(k, lane));
            signs[j] = self.work.sides[k].equivalent;
        }
        self.solve_sliding(&right, &mut signs);
        for j in 0..m {
            self.work.sides[self.work.sliding[j]].equivalent = signs[j];
            for (rate, c) in rates.iter_mut().zip(&self.work.columns[j * N..(j + 1) * N]) {
                *rate += signs[j] * c;
            }
        }
    }

    /// Solves B s = right for the sliding surfaces; an entry that B does not determine keeps its value.
    #[expect(clippy::needless_range_loop, reason = "matrix algebra reads best by indices")]
    fn solve_sliding(&self, right: &[f64; MAX_SLIDING], signs: &mut [f64; MAX_SLIDING]) {
        let sliding = &self.work.sliding;
        let m = sliding.len();
        let column = |j: usize| &self.work.columns[j * N..(j + 1) * N];
        if m == 1 {
            let effect = self.along_slice(sliding[0], column(0));
            if effect != 0.0 {
                signs[0] = right[0] / effect;
            }
            return;
        }
        let mut b = [[0.0; MAX_SLIDING]; MAX_SLIDING];
        for (i, k) in sliding.iter().enumerate() {
            for j in 0..m {
                b[i][j] = self.along_slice(*k, column(j));
            }
        }
        let mut right = *right;
        let mut scale = [0.0; MAX_SLIDING];
        for i in 0..m {
            scale[i] = b[i][i].abs();
        }
        let mut free = [false; MAX_SLIDING];
        // The diagonal rules where friction dissipates, so no rows are exchanged.
        for i in 0..m {
            if b[i][i].abs() <= 1e-10 * scale[i] {
                free[i] = true;
                continue;
            }
            for row in i + 1..m {
                let factor = b[row][i] / b[i][i];
                for j in i..m {
                    b[row][j] -= factor * b[i][j];
                }
                right[row] -= factor * right[i];
            }
        }
        for i in (0..m).rev() {
            if !free[i] {
                let known: f64 = (i + 1..m).map(|j| b[i][j] * signs[j]).sum();
                signs[i] = (right[i] - known) / b[i][i];
            }
        }
    }

    /// Moves the state back on to its sliding surfaces, along the effect of their signs, which rounding and truncation
    /// have let it drift from.
    pub(super) fn project(&mut self, lane: usize) {
        let x = self.x;
        let m = self.work.sliding.len();
        self.load_curved(&x, lane);
        let mut right = [0.0; MAX_SLIDING];
        for (right, k) in right.iter_mut().zip(&self.work.sliding) {
            *right = -self.value(*k, &x, lane);
        }
        if right.iter().all(|r| *r == 0.0) {
            return;
        }
        let mut moves = [0.0; MAX_SLIDING];
        self.solve_sliding(&right, &mut moves);
        if moves.iter().all(|m| m.is_finite()) {
            for (j, amount) in moves.iter().enumerate().take(m) {
                for (x, c) in self.x.iter_mut().zip(&self.work.columns[j * N..(j + 1) * N]) {
                    *x += amount * c;
                }
            }
        }
    }

    /// What a sign of 1 adds to the rates; `base` are those at a sign of 0.
    fn column(&mut self, k: usize, x: &[f64; N], lane: usize, base: &[f64; N]) -> [f64; N] {
        let surface = &self.equations.surfaces[k];
        let mut column = [0.0; N];
        if surface.mixed {
            let slot = self.equations.rest.first_sign() + k;
            let before = std::mem::replace(&mut self.work.rest[slot], 1.0);
            column = self.rates_held(x, lane);
            self.work.rest[slot] = before;
            for (c, base) in column.iter_mut().zip(base) {
                *c -= base;
            }
        }
        for (c, gain) in column.iter_mut().zip(&surface.gain) {
            *c += gain;
        }
        column
    }

    /// Evaluates the curved parts of the surfaces and their gradients.
    #[inline]
    fn load_curved(&mut self, x: &[f64; N], lane: usize) {
        if !self.equations.has_curved {
            return;
        }
        let slots = &mut self.work.curved;
        slots[1..=self.equations.states].copy_from_slice(&x[..self.equations.states]);
        for address in &self.equations.copied {
            slots[*address] = self.work.forcing[address * LANES + lane];
        }
        self.equations.curved.run(slots);
    }

    /// A surface's value; its curved part must be loaded.
    #[inline]
    fn value(&self, k: usize, x: &[f64; N], lane: usize) -> f64 {
        let surface = &self.equations.surfaces[k];
        let mut value = 0.0;
        for i in &surface.support {
            value += surface.gradient[*i] * x[*i];
        }
        if let Some((slot, _)) = surface.offset {
            value += self.work.forcing[slot * LANES + lane];
        }
        if let Some(curved) = &surface.curved {
            value += self.work.curved[curved.value];
        }
        value
    }

    /// A surface's change along a direction of the state; its curved part must be loaded.
    #[inline]
    fn along(&self, k: usize, direction: &[f64; N]) -> f64 {
        self.along_slice(k, direction)
    }

    #[inline]
    fn along_slice(&self, k: usize, direction: &[f64]) -> f64 {
        let surface = &self.equations.surfaces[k];
        let mut sum = 0.0;
        for i in &surface.support {
            sum += surface.gradient[*i] * direction[*i];
        }
        if let Some(curved) = &surface.curved {
            for (i, slot) in &curved.gradient {
                sum += self.work.curved[*slot] * direction[*i];
            }
        }
        sum
    }

    /// A surface's rate at a fixed state.
    #[inline]
    fn drift(&self, k: usize, lane: usize) -> f64 {
        let surface = &self.equations.surfaces[k];
        let mut drift = surface.offset.map_or(0.0, |(_, slot)| self.work.forcing[slot * LANES + lane]);
        if let Some(curved) = &surface.curved {
            drift += self.work.curved[curved.drift];
        }
        drift
    }
}
