//! Fits of a model over segments, by Levenberg and Marquardt's method.

use nalgebra::{Cholesky, DMatrix};

use super::super::limits::STRAY_STRETCH;
use super::driven::{Driven, Propagation};
use super::{ClosedModel, Free, InitialState, KnownPart, Loop, Segment, Simulated};
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::study::Cancel;

impl ClosedModel {
    /// The model fitted from this one by at most so many steps of Levenberg and Marquardt, with what it leaves.
    pub(crate) fn fitted(
        &self,
        of: Loop<'_>,
        free: Free,
        steps: usize,
        gain: f64,
        cancel: &Cancel,
    ) -> Option<(Self, Simulated)> {
        if free != Free::Initial {
            return self.fitted_along(of, free, (steps, gain), None, cancel);
        }
        let propagation = self.propagation(of, false);
        let driven = self.driven(of.segments, &propagation);
        let known = KnownPart { propagation: &propagation, driven: Some(&driven) };
        self.fitted_along(of, free, (steps, gain), Some(known), cancel)
    }

    /// What inputs make of the modes along each segment.
    fn driven(&self, segments: &[Segment], propagation: &[Propagation]) -> Vec<Driven> {
        segments.par_iter().map(|s| Driven::new(self, &propagation[s.record], *s, false)).collect()
    }

    /// As `fitted`; `known` stays where the initial states alone are free.
    fn fitted_along(
        &self,
        of: Loop<'_>,
        free: Free,
        (steps, gain): (usize, f64),
        known: Option<KnownPart<'_>>,
        cancel: &Cancel,
    ) -> Option<(Self, Simulated)> {
        let mut model = self.clone();
        let (mut simulated, mut normal) = model.run(of, Some(free), known)?;
        let mut damping = 1e-3;
        for _ in 0..steps {
            if cancel.is_cancelled() {
                return None;
            }
            let sums = normal.take()?;
            let mut better = None;
            for _ in 0..7 {
                let candidate = sums.step(damping).map(|change| model.moved(&change));
                if let Some(candidate) = candidate
                    && let Some((found, _)) = candidate.run(of, None, known)
                    && found.squares < simulated.squares
                {
                    better = Some((candidate, found));
                    damping = f64::max(damping / 8.0, 1e-9);
                    break;
                }
                damping = f64::max(damping * 8.0, 1e-6);
            }
            let Some((candidate, found)) = better else { break };
            let enough = simulated.squares - found.squares > gain * simulated.squares;
            model = candidate;
            simulated = found;
            if !enough {
                break;
            }
            normal = model.run(of, Some(free), known)?.1;
        }
        Some((model, simulated))
    }

    /// The model with initial states fitted segment by segment, each at its own pace; where one stays far behind the others,
    /// it is tried from the end of the one before.
    pub(crate) fn eased(&self, of: Loop<'_>, steps: usize, gain: f64, cancel: &Cancel) -> Self {
        let count = of.segments.len().min(self.initial.len());
        let propagation = self.propagation(of, false);
        let driven = self.driven(of.segments, &propagation);
        let known = |k: usize| KnownPart { propagation: &propagation, driven: Some(&driven[k..=k]) };
        let fitted = |k: usize, state: &InitialState| -> Option<(InitialState, f64)> {
            let own = Self { initial: vec![state.clone()], ..self.clone() };
            let of = Loop { segments: &of.segments[k..=k], joint: None, ..of };
            let (model, left) = own.fitted_along(of, Free::Initial, (steps, gain), Some(known(k)), cancel)?;
            Some((model.initial.into_iter().next()?, left.squares / left.samples as f64))
        };
        let numbers: Vec<usize> = (0..count).collect();
        let first: Vec<_> = numbers.into_par_iter().map(|k| fitted(k, &self.initial[k])).collect();
        let mut sizes: Vec<f64> = first.iter().flatten().map(|f| f.1).collect();
        sizes.sort_by(f64::total_cmp);
        let bad = sizes.get(sizes.len() / 2).map_or(0.0, |middle| STRAY_STRETCH * middle);
        let mut new = self.clone();
        for (k, found) in first.into_iter().enumerate() {
            let mut best = found;
            let follows = k > 0 && {
                let (before, own) = (of.segments[k - 1], of.segments[k]);
                before.record == own.record && own.start + 1 == before.start + before.length
            };
            if follows && best.as_ref().is_none_or(|b| b.1 > bad) {
                let before = Self { initial: vec![new.initial[k - 1].clone()], ..self.clone() };
                let of = Loop { segments: &of.segments[k - 1..k], joint: None, ..of };
                let along = &propagation[of.segments[0].record];
                let end = before.run_segment(of, 0, None, along, Some(&driven[k - 1])).map(|r| r.2.states);
                let other = end.and_then(|end| fitted(k, &end));
                if let Some(other) = other
                    && best.as_ref().is_none_or(|b| other.1 < b.1)
                {
                    best = Some(other);
                }
            }
            if let Some((state, _)) = best {
                new.initial[k] = state;
            }
        }
        new
    }

    /// The model with the initial states of segments fitted one after the other, each from the end of the one before; the first
    /// ones of records from what they are.
    pub(crate) fn swept(&self, of: Loop<'_>, steps: usize, cancel: &Cancel) -> Self {
        let mut new = self.clone();
        let propagation = self.propagation(of, false);
        let driven = self.driven(of.segments, &propagation);
        for k in 0..of.segments.len() {
            let known = KnownPart { propagation: &propagation, driven: Some(&driven[k..=k]) };
            let along = &propagation[of.segments[k].record];
            let alone = Loop { segments: &of.segments[k..=k], joint: None, ..of };
            let own = Self { initial: vec![new.initial[k].clone()], ..self.clone() };
            let found = own.fitted_along(alone, Free::Initial, (steps, 1e-2), Some(known), cancel).map_or(own, |f| f.0);
            let next = of.segments.get(k + 1).is_some_and(|n| n.record == of.segments[k].record);
            if next && let Some((_, _, end)) = found.run_segment(alone, 0, None, along, Some(&driven[k])) {
                new.initial[k + 1] = end.states;
            }
            if let Some(state) = found.initial.into_iter().next() {
                new.initial[k] = state;
            }
        }
        new
    }

    /// The covariance of the shared parameters for a residual of unit variance, their places as in `shared`.
    pub(crate) fn covariance(&self, of: Loop<'_>) -> Option<DMatrix<f64>> {
        let free = if self.initial.is_empty() { Free::Shared } else { Free::All };
        let normal = self.run(of, Some(free), None)?.1?;
        let scale = normal.shared.scale();
        let inverse = Cholesky::new(normal.eliminated(0.0, &scale)?.matrix)?.inverse();
        Some(DMatrix::from_fn(scale.len(), scale.len(), |i, j| inverse[(i, j)] / (scale[i] * scale[j])))
    }
}
