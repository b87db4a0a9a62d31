//! A model with one mode less.

use nalgebra::{DMatrix, DVector};

use super::super::limits::TAKES_OVER;
use super::super::pole::Pole;
use super::ClosedModel;

impl ClosedModel {
    /// The model without a mode. Where another one is near in frequency, it takes over: its residues are the sum of both, made one
    /// shape and one row of drives again, and its pole lies between theirs, nearer to that of the larger residue.
    pub(crate) fn without(&self, mode: usize) -> Self {
        let near = |k: usize| (self.poles[k].omega / self.poles[mode].omega).ln().abs();
        let others = (0..self.modes()).filter(|k| *k != mode && near(*k) < TAKES_OVER.ln());
        let heir = others.min_by(|a, b| near(*a).total_cmp(&near(*b)));
        let mut new = self.clone();
        if let Some((heir, united)) = heir.and_then(|k| Some((k, self.united(mode, k)?))) {
            let power: f64 = united.shape.norm_squared();
            let share = |k: usize| united.shape.dot(&DVector::from_column_slice(&self.shape[k])) / power;
            let (own, other) = (share(heir), share(mode));
            for state in &mut new.initial {
                state.modes[heir] = state.modes[heir] * own + state.modes[mode] * other;
            }
            new.poles[heir] = united.pole;
            new.shape[heir] = united.shape.iter().copied().collect();
            new.drive[heir] = united.drive;
        }
        new.poles.remove(mode);
        new.shape.remove(mode);
        new.drive.remove(mode);
        for state in &mut new.initial {
            state.modes.remove(mode);
        }
        new
    }

    /// What a mode drives the sensors with: sensors by inputs and, last, the force in its unit.
    fn residues(&self, mode: usize) -> DMatrix<f64> {
        let by = |j: usize| self.drive[mode].get(j).copied().unwrap_or(-self.sign * self.coupling(mode));
        DMatrix::from_fn(self.sensors(), self.inputs() + 1, |s, j| self.shape[mode][s] * by(j))
    }

    /// One mode for two; none where they move nothing together.
    fn united(&self, first: usize, second: usize) -> Option<United> {
        let [one, two] = [first, second].map(|k| self.residues(k));
        let (weight, whole) = (one.norm_squared(), one.norm_squared() + two.norm_squared());
        let svd = (one + two).svd(true, true);
        let (u, v) = (svd.u?.column(0).into_owned(), svd.v_t?.row(0).transpose() * svd.singular_values[0]);
        let moved: f64 = self.across.iter().zip(u.iter()).map(|(e, u)| e * u).sum();
        let size = (v[self.inputs()] / moved).abs().sqrt();
        if !(size.is_finite() && size > 0.0 && whole > 0.0) {
            return None;
        }
        let between = |of: fn(&Pole) -> f64| {
            let share = weight / whole;
            (of(&self.poles[first]).ln() * share + of(&self.poles[second]).ln() * (1.0 - share)).exp()
        };
        let pole = Pole { omega: between(|p| p.omega), damping: between(|p| p.damping) };
        Some(United { pole, shape: u * size, drive: (0..self.inputs()).map(|j| v[j] / size).collect() })
    }
}

/// Two modes made one.
struct United {
    pole: Pole,
    shape: DVector<f64>,
    drive: Vec<f64>,
}
