//! Stable poles gathered into clusters: what of a mode stays the same over all orders, and how far it scatters.

use super::limits::{CLUSTER_DISTANCE, CLUSTER_ORDERS, MOST_CLUSTERED};
use super::shape::assurance;
use super::stabilization::{ProposedPole, Stability};

/// Poles of several orders that are one mode, with mean and spread (standard deviation over the poles).
#[derive(Clone, Debug, PartialEq)]
pub struct PoleCluster {
    /// The poles, by their places in [`super::Stabilization::poles`].
    pub members: Vec<usize>,
    /// Lowest and highest order of the state spaces that have it, states.
    pub orders: (usize, usize),
    /// Natural frequency, Hz: mean and spread.
    pub frequency: (f64, f64),
    /// Damping ratio: mean and spread.
    pub damping: (f64, f64),
    /// Mean modal phase collinearity; none with one sensor.
    pub collinearity: Option<f64>,
}

/// The clusters of stable poles, the lowest frequency first.
///
/// Average linkage with the distance `|ln(ω₁/ω₂)| + 1 − MAC` (without shapes, the first part alone), up to [`CLUSTER_DISTANCE`]; what
/// fewer than [`CLUSTER_ORDERS`] poles have in common is no cluster. E. Reynders, J. Houbrechts, G. De Roeck, Mech. Syst.
/// Signal Process. 29 (2012) 228.
pub(crate) fn clusters(poles: &[ProposedPole]) -> Vec<PoleCluster> {
    let mut stable: Vec<usize> = (0..poles.len()).filter(|k| poles[*k].stability == Stability::Whole).collect();
    stable.sort_by(|a, b| poles[*a].pole.omega.total_cmp(&poles[*b].pole.omega));
    let mut found = Vec::new();
    // Poles farther apart than the distance in frequency alone are never joined: each run is clustered by itself.
    let mut from = 0;
    for k in 1..=stable.len() {
        let apart = |a: usize, b: usize| (poles[b].pole.omega / poles[a].pole.omega).ln();
        if k < stable.len() && apart(stable[k - 1], stable[k]) <= CLUSTER_DISTANCE {
            continue;
        }
        found.extend(linked(poles, &stable[from..k]));
        from = k;
    }
    let mut clusters: Vec<PoleCluster> = found
        .into_iter()
        .filter(|m| m.len() >= CLUSTER_ORDERS)
        .map(|members| PoleCluster::new(poles, members))
        .collect();
    clusters.sort_by(|a, b| a.frequency.0.total_cmp(&b.frequency.0));
    clusters
}

/// One run of poles in clusters by average linkage.
fn linked(poles: &[ProposedPole], run: &[usize]) -> Vec<Vec<usize>> {
    // So many marks in one run are noise from end to end, and their table would be large.
    let run = &run[..run.len().min(MOST_CLUSTERED)];
    let distance = |a: usize, b: usize| {
        let (a, b) = (&poles[a], &poles[b]);
        let shapes = if a.shape.len() < 2 { 0.0 } else { 1.0 - assurance(&a.shape, &b.shape) };
        (a.pole.omega / b.pole.omega).ln().abs() + shapes
    };
    let mut groups: Vec<Vec<usize>> = run.iter().map(|k| vec![*k]).collect();
    let mut between: Vec<Vec<f64>> = run.iter().map(|a| run.iter().map(|b| distance(*a, *b)).collect()).collect();
    loop {
        let pairs = (0..groups.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let nearest = pairs.min_by(|a, b| between[a.0][a.1].total_cmp(&between[b.0][b.1]));
        let Some((i, j)) = nearest.filter(|(i, j)| between[*i][*j] <= CLUSTER_DISTANCE) else { return groups };
        let (first, second) = (groups[i].len() as f64, groups[j].len() as f64);
        let both = |(a, b): (&f64, &f64)| (first * a + second * b) / (first + second);
        let joined: Vec<f64> = between[i].iter().zip(&between[j]).map(both).collect();
        for (row, mean) in between.iter_mut().zip(&joined) {
            row[j] = *mean;
        }
        between[j] = joined;
        let moved = groups.swap_remove(i);
        groups[j].extend(moved);
        between.swap_remove(i);
        between.iter_mut().for_each(|row| {
            row.swap_remove(i);
        });
    }
}

impl PoleCluster {
    fn new(poles: &[ProposedPole], mut members: Vec<usize>) -> Self {
        members.sort_unstable();
        let of = |value: &dyn Fn(&ProposedPole) -> f64| -> (f64, f64) {
            let n = members.len() as f64;
            let mean = members.iter().map(|k| value(&poles[*k])).sum::<f64>() / n;
            let squares = members.iter().map(|k| (value(&poles[*k]) - mean).powi(2)).sum::<f64>();
            (mean, (squares / (n - 1.0).max(1.0)).sqrt())
        };
        let orders = members.iter().map(|k| poles[*k].order);
        let collinear: Vec<f64> = members.iter().filter_map(|k| poles[*k].collinearity).collect();
        Self {
            orders: (orders.clone().min().unwrap_or(0), orders.max().unwrap_or(0)),
            frequency: of(&|p| p.pole.frequency()),
            damping: of(&|p| p.pole.damping),
            collinearity: (!collinear.is_empty()).then(|| collinear.iter().sum::<f64>() / collinear.len() as f64),
            members,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pole::Pole;
    use nalgebra::Complex;

    fn pole(order: usize, frequency: f64, damping: f64, shape: [f64; 2]) -> ProposedPole {
        ProposedPole {
            order,
            thinning: 1,
            pole: Pole::at(frequency, damping),
            shape: shape.map(|s| Complex::new(s, 0.0)).to_vec(),
            collinearity: Some(1.0),
            deviation: Some(0.0),
            stability: Stability::Whole,
        }
    }

    /// Two modes 0.4 % apart that swing differently, one far off, and poles that stay for too few orders.
    #[test]
    fn modes_of_one_frequency_are_told_by_their_shapes() {
        let mut poles = Vec::new();
        for k in 0..8_usize {
            let turn = if k % 2 == 0 { 1.0 } else { -1.0 };
            poles.push(pole(4 + 2 * k, 5.00 + 0.005 * turn, 0.010 + 0.001 * turn, [1.0, 0.6]));
            poles.push(pole(4 + 2 * k, 5.02, 0.02, [1.0, -0.7]));
            poles.push(pole(4 + 2 * k, 9.0, 0.01, [0.2, 1.0]));
        }
        poles.push(pole(20, 7.0, 0.01, [1.0, 0.1]));
        let found = clusters(&poles);
        let means: Vec<f64> = found.iter().map(|c| c.frequency.0).collect();
        assert_eq!(means.len(), 3, "{means:?}");
        assert!((means[0] - 5.0).abs() < 1e-9 && (means[1] - 5.02).abs() < 1e-9 && (means[2] - 9.0).abs() < 1e-9);
        let slow = &found[0];
        assert_eq!((slow.members.len(), slow.orders), (8, (4, 18)));
        assert!((slow.frequency.1 - 0.005 * (8.0_f64 / 7.0).sqrt()).abs() < 1e-9, "{:?}", slow.frequency);
        assert!((slow.damping.0 - 0.01).abs() < 1e-9 && (slow.damping.1 - 0.001 * (8.0_f64 / 7.0).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn noise_makes_no_cluster() {
        let mut poles: Vec<_> = (0..8).map(|k| pole(4 + 2 * k, 3.0 + 0.9 * k as f64, 0.01, [1.0, 0.2])).collect();
        poles.iter_mut().for_each(|p| p.stability = Stability::Frequency);
        assert!(clusters(&poles).is_empty());
    }
}
