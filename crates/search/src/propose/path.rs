//! The measured motion as the proposals see it: smoothed without a model, and where it sticks.

use super::super::columns::MotionPath;
use super::super::constants::Constants;
use super::super::data::{Data, RecordSeries};
use sindyscope_core::refine::Output;
use sindyscope_core::signal::{rests, rms};

/// The grid of smoothing weights, as powers of ten: from, to, step.
const WEIGHTS: [f64; 3] = [-3.0, 8.0, 0.5];
/// How much less the path is smoothed whose bias must not count: by this factor of the weight.
const LIGHTER: f64 = 100.0;
/// What a usual speed is: width of a bin of velocities, as a share of the largest, and the share of all samples that a full one
/// holds.
const BIN: f64 = 1.0 / 30.0;
const FULL: f64 = 0.12;

/// The motion of one fitted record.
#[derive(Debug)]
pub(in super::super) struct MeasuredPath {
    /// Displacements smoothed lightly, so that their bias does not count; velocities smoothed calmly, for their signs.
    pub(in super::super) path: MotionPath,
    /// For each mass, the samples at which it moves with something: there dry friction is whatever holds it.
    pub(in super::super) stuck: Vec<Vec<bool>>,
}

impl MeasuredPath {
    pub(in super::super) fn new(data: &Data, series: &RecordSeries) -> Self {
        let mut path = series.path();
        for (mass, output) in data.outputs.iter().enumerate() {
            if *output == Output::Displacement(mass) {
                let (calm, light) = smoothed(&series.measured[mass]);
                path.v[mass] = slope(&calm, series.interval);
                path.x[mass] = light;
            }
        }
        let stuck = (0..data.masses()).map(|mass| stuck(data, series, &path, mass)).collect();
        Self { path, stuck }
    }
}

/// Central differences, one-sided at the ends.
pub(super) fn slope(values: &[f64], interval: f64) -> Vec<f64> {
    let last = values.len() - 1;
    let at = |k: usize| {
        let (from, to) = (k.saturating_sub(1), (k + 1).min(last));
        (values[to] - values[from]) / ((to - from) as f64 * interval)
    };
    (0..values.len()).map(at).collect()
}

/// Samples at which a mass stands still against the ground or its base, or goes along with a surface that moves steadily.
fn stuck(data: &Data, series: &RecordSeries, path: &MotionPath, mass: usize) -> Vec<bool> {
    let n = series.len();
    let period = data.period / series.interval;
    let v = &path.v[mass];
    let slow = data.constants.still * rms(v);
    let across: Option<&Vec<f64>> = series.input_rates.first().filter(|_| data.base_excited);
    let mut still: Vec<bool> =
        (0..n).map(|k| v[k].abs() < slow || across.is_some_and(|du| (v[k] - du[k]).abs() < slow)).collect();
    if data.outputs[mass] == Output::Displacement(mass) {
        for rest in rests(&series.measured[mass], data.noise / data.weights[mass], period) {
            still[rest].fill(true);
        }
    }
    let mut stuck = spells(&still, period, data.constants.rest, &data.constants);
    if let Some(level) = usual_speed(v, data.constants.still) {
        let near = BIN * v.iter().fold(0.0_f64, |top, v| top.max(v.abs()));
        let with: Vec<bool> = v.iter().map(|v| (v - level).abs() < near).collect();
        let carried = spells(&with, period, data.constants.carried, &data.constants);
        stuck.iter_mut().zip(carried).for_each(|(s, c)| *s |= c);
    }
    stuck
}

/// The velocity far from zero that is seen most often, as that of a surface which carries the mass along: the median of the
/// fullest of narrow bins. None where no bin is much fuller than a smooth motion makes it. `still` is the share of the largest
/// below which a velocity is none.
pub(in super::super) fn usual_speed(velocities: &[f64], still: f64) -> Option<f64> {
    let top = velocities.iter().fold(0.0_f64, |top, v| top.max(v.abs()));
    let mut bins: Vec<Vec<f64>> = vec![Vec::new(); (2.0 / BIN) as usize + 1];
    let last = bins.len() - 1;
    for v in velocities.iter().filter(|v| v.abs() > still * top) {
        bins[(((v / top + 1.0) / BIN) as usize).min(last)].push(*v);
    }
    let mut fullest = bins.into_iter().max_by_key(Vec::len)?;
    if (fullest.len() as f64) < FULL * velocities.len() as f64 {
        return None;
    }
    fullest.sort_unstable_by(f64::total_cmp);
    Some(fullest[fullest.len() / 2])
}

/// Samples in spells of at least a share of the period, short gaps closed and the ends widened. None where they are rarer
/// than chance makes them.
fn spells(near: &[bool], period: f64, least: f64, constants: &Constants) -> Vec<bool> {
    let (gap, margin) = (0.5 * constants.rest * period, 0.375 * constants.rest * period);
    let mut parts: Vec<std::ops::Range<usize>> = Vec::new();
    let mut from = 0;
    for run in near.chunk_by(|a, b| a == b) {
        let here = from..from + run.len();
        from = here.end;
        if !run[0] {
            continue;
        }
        match parts.last_mut() {
            Some(last) if ((here.start - last.end) as f64) < gap => last.end = here.end,
            _ => parts.push(here),
        }
    }
    parts.retain(|p| p.len() as f64 >= (least * period).max(4.0));
    let margin = margin as usize;
    let mut out = vec![false; near.len()];
    for part in parts {
        out[part.start.saturating_sub(margin)..(part.end + margin).min(near.len())].fill(true);
    }
    out
}

/// A series smoothed by penalised third differences, its weight by generalised cross-validation, and with a lighter weight.
///
/// `min ‖y − s‖² + λ ‖D³ s‖²`. Source: P. Eilers, "A perfect smoother", Anal. Chem. 75 (2003) 3631.
fn smoothed(y: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let n = y.len() as f64;
    let [low, high, step] = WEIGHTS;
    let count = ((high - low) / step) as usize;
    let angles = 1024;
    let transfer = |weight: f64| -> f64 {
        (0..angles)
            .map(|k| {
                (1.0 + weight * (2.0 - 2.0 * (std::f64::consts::PI * k as f64 / angles as f64).cos()).powi(3)).recip()
            })
            .sum::<f64>()
            / angles as f64
    };
    let mut best = (f64::INFINITY, Vec::new(), 1.0);
    for k in 0..=count {
        let weight = 10_f64.powf(low + step * k as f64);
        let s = penalised(y, weight);
        let rss: f64 = y.iter().zip(&s).map(|(y, s)| (y - s).powi(2)).sum();
        let score = rss / (n - 1.3 * n * transfer(weight)).max(1e-9).powi(2);
        if score < best.0 {
            best = (score, s, weight);
        }
    }
    let light = penalised(y, best.2 / LIGHTER);
    (best.1, light)
}

/// Solves `(I + λ DᵀD) s = y` for third differences D by a banded Cholesky factorisation.
fn penalised(y: &[f64], weight: f64) -> Vec<f64> {
    const D: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];
    let n = y.len();
    // `band[i][d]` is the entry in row i, column i − d.
    let mut band = vec![[0.0; 4]; n];
    for row in 0..n.saturating_sub(3) {
        for a in 0..4 {
            for b in 0..=a {
                band[row + a][a - b] += weight * D[a] * D[b];
            }
        }
    }
    band.iter_mut().for_each(|row| row[0] += 1.0);
    let mut s = y.to_vec();
    for i in 0..n {
        for d in (0..=3.min(i)).rev() {
            let j = i - d;
            let mut value = band[i][d];
            for e in d + 1..=3.min(i) {
                if e - d <= 3 {
                    value -= band[i][e] * band[j][e - d];
                }
            }
            band[i][d] = if d == 0 { value.max(f64::MIN_POSITIVE).sqrt() } else { value / band[j][0] };
        }
        for d in 1..=3.min(i) {
            s[i] -= band[i][d] * s[i - d];
        }
        s[i] /= band[i][0];
    }
    for i in (0..n).rev() {
        for d in 1..=3.min(n - 1 - i) {
            s[i] -= band[i + d][d] * s[i + d];
        }
        s[i] /= band[i][0];
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_left_as_it_is_however_heavy_the_weight() {
        let y: Vec<f64> = (0..50).map(|k| 1.0 + 0.3 * f64::from(k) - 0.01 * f64::from(k * k)).collect();
        let s = penalised(&y, 1e4);
        assert!(y.iter().zip(&s).all(|(y, s)| (y - s).abs() < 1e-6));
    }
}
