//! Poles that a person chose: each stands for one mode of the model, wherever a force beside it moves it.

use super::identify::is_new;
use super::pole::Pole;

/// The poles from which modes are fitted; none where the data choose them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChosenPoles<'a>(pub(crate) &'a [Pole]);

impl ChosenPoles<'_> {
    /// The chosen pole whose frequency is nearest, by its ratio to this one's; none where the data choose.
    pub(crate) fn nearest(self, pole: &Pole) -> Option<usize> {
        let away = |k: &usize| (self.0[*k].omega / pole.omega).ln().abs();
        (0..self.0.len()).min_by(|a, b| away(a).total_cmp(&away(b)))
    }

    /// True if a pole may join others, which stand for the chosen ones `taken`: each of these gets one mode, however close they are.
    /// Where the data choose, any that is `apart` from the others may.
    pub(crate) fn is_open(self, pole: &Pole, others: &[Pole], apart: f64, taken: &[usize]) -> bool {
        self.nearest(pole).map_or_else(|| is_new(others, pole, apart), |k| !taken.contains(&k))
    }

    /// Proposed poles, and each chosen one that none of them is nearest to.
    pub(crate) fn completed(self, mut proposed: Vec<Pole>) -> Vec<Pole> {
        let met: Vec<Option<usize>> = proposed.iter().map(|p| self.nearest(p)).collect();
        proposed.extend((0..self.0.len()).filter(|k| !met.contains(&Some(*k))).map(|k| self.0[k]));
        proposed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_chosen_pole_gets_one_mode() {
        let all = [Pole::at(1.0, 0.01), Pole::at(4.0, 0.02)];
        let chosen = ChosenPoles(&all);
        let moved = Pole::at(1.3, 0.05);
        assert_eq!(chosen.nearest(&moved), Some(0));
        assert!(!chosen.is_open(&moved, &[moved], 0.01, &[0]) && chosen.is_open(&moved, &[moved], 0.01, &[1]));
        let pool = chosen.completed(vec![moved, Pole::at(0.9, 0.01)]);
        assert_eq!(pool.len(), 3);
        assert!((pool[2].frequency() - 4.0).abs() < 1e-9);
        // Where the data choose, a pole joins if it is not there yet.
        let free = ChosenPoles(&[]);
        assert!(
            free.is_open(&moved, &all, 0.01, &[])
                && !free.is_open(&moved, &[moved], 0.01, &[])
                && free.completed(vec![moved]).len() == 1
        );
    }
}
