//! When each record began, by the clock of a force that nothing measured.
//!
//! An unbalance or a hum goes on at one frequency through all records and does not wait for any of them: written from zero, the
//! times of two records have nothing to do with one another, and each meets the force at a phase of its own. One force for all
//! of them then fits none. Its line is looked for in what a linear model lacks, or in a motion whose inputs have no such line (a
//! spring without a damper swings along with the force and lacks nothing there); where every record has it, their clocks are set
//! by its phases. A clock moves by less than a period of that force, which nothing else goes by.

use std::f64::consts::TAU;
use std::ops::Range;

use super::data::RecordSeries;
use sindyscope_core::signal::{Spectrum, median, rms};
use sindyscope_core::sparse::{BoundedSolution, Bounds, bounded_least_squares};
use sindyscope_values::format::units::format_si;

/// What a line is: so many times the median of the lines around it, so many to either side.
const STANDS_OUT: f64 = 8.0;
const AROUND: usize = 24;
/// What a line of the inputs is: this share of their largest.
const DRIVEN: f64 = 0.01;
/// What one force is: its amplitudes in two records are no further apart than by this factor.
const ALIKE: f64 = 2.0;
/// A motion on springs that are not linear has lines at ratios of such whole numbers to those of its input, unless these are many.
const MANY: usize = 3;
const RATIOS: [f64; 5] = [1.0, 2.0, 3.0, 4.0, 5.0];
/// Periods of a tone in a record, at least, and its frequency over that of the motion, at most.
const PERIODS: f64 = 5.0;
const FASTEST: f64 = 4.0;
/// What it is to have begun together: phases that differ by less, in radians, or than three standard errors.
const TOGETHER: f64 = 0.35;
/// What matters is: this share of the acceleration. What smoothing leaves of a motion has lines too.
const MATTERS: f64 = 0.01;
/// What goes on is: in the halves of a record it differs by less than this share, beside what it is uncertain by.
const GOES_ON: f64 = 0.2;
/// Frequencies that are tried within a line's width, a matter of digits.
const TRIED: i32 = 8;

/// What is known of a record from its samples alone.
struct Sampled<'a> {
    series: &'a RecordSeries,
    mass: usize,
    /// What a linear model of the acceleration is made of, each under a window that ends at zero.
    columns: Vec<Vec<f64>>,
    /// The acceleration under the same window.
    target: Vec<f64>,
    window: Vec<f64>,
    inputs: Vec<Spectrum>,
}

/// A force that goes with time, or with that times the displacement.
#[derive(Clone, Copy)]
struct Wave {
    /// Hz.
    frequency: f64,
    pulsates: bool,
}

/// A tone that goes on through all records.
pub(super) struct Tone {
    /// Hz.
    pub(super) frequency: f64,
    /// It is no force, but the stiffness pulsates by it.
    pub(super) pulsates: bool,
    /// How much later than written each record began, s: `[record]`; empty where they began together.
    pub(super) later: Vec<f64>,
}

impl Tone {
    /// What is told of it.
    pub(super) fn notice(&self, series: &[RecordSeries]) -> String {
        let moved = series.iter().zip(&self.later).skip(1);
        let each: Vec<String> = moved.map(|(s, by)| format!("`{}` {} later", s.name, format_si(*by, "s", 3))).collect();
        format!(
            "{} at {} that no input has goes on through all records, each of which began at a phase of its own. Forces that go with time count it as one: {}.",
            if self.pulsates { "A pulsation" } else { "A tone" },
            format_si(self.frequency, "Hz", 4),
            each.join(", ")
        )
    }
}

/// The tone that all records have and no input, the first `fitted` of which are fitted.
pub(super) fn unmeasured_tone(series: &[RecordSeries], fitted: usize, motion: f64) -> Option<Tone> {
    if series.len() < 2 || series.iter().any(RecordSeries::is_undriven) {
        return None;
    }
    let masses = series[0].smoothed.states.len() / 2;
    (0..masses).find_map(|mass| {
        let sampled: Vec<Sampled<'_>> = series.iter().map(|s| Sampled::new(s, mass)).collect();
        let linear = solved(&sampled[..fitted], None)?.coefficients;
        let lacking: Vec<Spectrum> = sampled.iter().map(|s| s.lacking(&linear)).collect::<Option<_>>()?;
        let moving: Vec<Spectrum> = sampled.iter().map(Sampled::moving).collect::<Option<_>>()?;
        [lacking, moving].into_iter().find_map(|spectra| {
            let own: Vec<f64> = spectra.iter().zip(&sampled).map(|(l, s)| s.undriven_line(l)).collect::<Option<_>>()?;
            let one =
                own.iter().zip(&sampled).all(|(f, s)| (f - own[0]).abs() < s.resolution() + sampled[0].resolution());
            let least = sampled.iter().map(|s| PERIODS * s.resolution()).fold(0.0, f64::max);
            if one && (least..FASTEST * motion).contains(&own[0]) { set_by(&sampled, fitted, own[0]) } else { None }
        })
    })
}

/// The wave that explains most near a line, and coefficients of the columns beside it: a force, or a stiffness that pulsates, of
/// which the line is a sideband.
fn explaining_most(fit: &[Sampled<'_>], line: f64) -> Option<(Wave, Vec<f64>)> {
    let width = fit.iter().map(Sampled::resolution).fold(f64::INFINITY, f64::min);
    let main = lines(&fit[0].moving()?).first().map_or(0.0, |(f, _)| *f);
    let pulsations = [line + main, (line - main).abs()].map(|frequency| Wave { frequency, pulsates: true });
    let kinds = pulsations.into_iter().filter(|wave| wave.frequency > 2.0 * width);
    let kinds = kinds.chain([Wave { frequency: line, pulsates: false }]);
    let near = |wave: Wave| {
        let at = move |k: i32| wave.frequency + width * f64::from(k) / f64::from(TRIED);
        (-TRIED..=TRIED).map(move |k| Wave { frequency: at(k), ..wave })
    };
    let all = kinds.flat_map(near).filter_map(|wave| Some((wave, solved(fit, Some(wave))?)));
    let (wave, found) = all.min_by(|a, b| a.1.sum_of_squares.total_cmp(&b.1.sum_of_squares))?;
    let shared = found.coefficients[..fit[0].columns.len()].to_vec();
    Some((wave, shared))
}

/// The clocks by a line near a frequency.
fn set_by(sampled: &[Sampled<'_>], fitted: usize, line: f64) -> Option<Tone> {
    let (wave, shared) = explaining_most(&sampled[..fitted], line)?;
    let shared = shared.as_slice();
    let size = |s: &Sampled<'_>| s.size(shared, wave, 0..s.target.len());
    let sizes: Vec<(f64, f64)> = sampled.iter().map(size).collect::<Option<_>>()?;
    let amplitudes = sizes.iter().map(|(a, b)| a.hypot(*b));
    let (least, largest) = amplitudes.fold((f64::INFINITY, 0.0_f64), |(least, most), a| (least.min(a), most.max(a)));
    let alike = largest < ALIKE * least;
    // How far the line is above those around it says how well its phase is known.
    let uncertain = |s: &Sampled<'_>| {
        let lacking = s.lacking(shared)?;
        let k = s.nearest(&lacking, line);
        Some(around(&lacking.amplitudes, k) / lacking.amplitudes[k])
    };
    let uncertain: Vec<f64> = sampled.iter().map(uncertain).collect::<Option<_>>()?;
    let goes_on = |((s, uncertain), (a, b)): ((&Sampled<'_>, &f64), &(f64, f64))| {
        let middle = s.target.len() / 2;
        let halves = [0..middle, middle..s.target.len()].map(|half| s.size(shared, wave, half));
        let [Some(first), Some(second)] = halves else { return false };
        let share = GOES_ON + 4.0 * uncertain;
        STANDS_OUT * uncertain < 1.0 && (first.0 - second.0).hypot(first.1 - second.1) < share * a.hypot(*b)
    };
    let is_most = |(s, (a, b)): (&Sampled<'_>, &(f64, f64))| {
        let (lacking, rest) = (s.without(shared), s.beside(shared, wave, (*a, *b)));
        let of_lines = |values: &[f64]| Some(lines(&s.spectrum(values)?).iter().map(|(_, a)| a * a).sum::<f64>());
        let matters = a.hypot(*b) * rms(&s.waves(wave)[0]) > MATTERS * rms(&s.target);
        matters && of_lines(&rest).zip(of_lines(&lacking)).is_some_and(|(rest, all)| rest < 0.5 * all)
    };
    let all_go_on = sampled.iter().zip(&uncertain).zip(&sizes).all(goes_on);
    if !alike || !all_go_on || !sampled.iter().zip(&sizes).all(is_most) {
        return None;
    }
    // `a cos ωt + b sin ωt` is largest where ωt is the angle of (a, b).
    let angle = |(a, b): &(f64, f64)| b.atan2(*a);
    let turned = |size: &(f64, f64)| {
        let by = angle(&sizes[0]) - angle(size);
        by - TAU * (by / TAU).round()
    };
    let apart: Vec<f64> = sizes.iter().map(turned).collect();
    let together = apart.iter().zip(&uncertain).all(|(by, u)| by.abs() < TOGETHER.max(3.0 * u.hypot(uncertain[0])));
    let later = if together { Vec::new() } else { apart.iter().map(|by| by / (TAU * wave.frequency)).collect() };
    Some(Tone { frequency: wave.frequency, pulsates: wave.pulsates, later })
}

/// Coefficients of the columns over records, then of each record's cosine and sine.
fn solved(records: &[Sampled<'_>], wave: Option<Wave>) -> Option<BoundedSolution> {
    let over_all = |k: usize| records.iter().flat_map(|s| &s.columns[k]).copied().collect::<Vec<f64>>();
    let mut columns: Vec<Vec<f64>> = (0..records.first()?.columns.len()).map(over_all).collect();
    for (r, s) in records.iter().enumerate() {
        let rows = |of: &[Sampled<'_>]| vec![0.0; of.iter().map(|s| s.target.len()).sum()];
        let alone = |own: Vec<f64>| [rows(&records[..r]), own, rows(&records[r + 1..])].concat();
        columns.extend(wave.into_iter().flat_map(|wave| s.waves(wave)).map(alone));
    }
    let target: Vec<f64> = records.iter().flat_map(|s| &s.target).copied().collect();
    bounded_least_squares(&columns, &target, &vec![Bounds::OPEN; columns.len()])
}

/// The lines of a spectrum that stand out, Hz with their amplitudes, the largest first.
fn lines(spectrum: &Spectrum) -> Vec<(f64, f64)> {
    let a = &spectrum.amplitudes;
    let mut peaks: Vec<usize> = (1..a.len().saturating_sub(1))
        .filter(|k| a[*k] >= a[k - 1] && a[*k] > a[k + 1] && a[*k] > STANDS_OUT * around(a, *k))
        .collect();
    peaks.sort_by(|k, l| a[*l].total_cmp(&a[*k]));
    peaks.into_iter().map(|k| (spectrum.frequency(k), a[k])).collect()
}

/// The median of the lines around one, without those that it spreads to.
fn around(amplitudes: &[f64], k: usize) -> f64 {
    let near = k.saturating_sub(AROUND)..(k + AROUND + 1).min(amplitudes.len());
    let near = near.filter(|j| j.abs_diff(k) > 3 && *j > 0);
    median(near.map(|j| amplitudes[j]).collect()).unwrap_or(f64::INFINITY)
}

impl<'a> Sampled<'a> {
    fn new(series: &'a RecordSeries, mass: usize) -> Self {
        let n = series.len();
        let window: Vec<f64> = (0..n).map(|k| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / n as f64).cos()).collect();
        let under = |values: &[f64]| values.iter().zip(&window).map(|(v, w)| v * w).collect::<Vec<f64>>();
        let states = &series.smoothed.states;
        let known = states.iter().chain(&series.inputs).chain(&series.input_rates);
        Self {
            columns: known.map(|c| under(c)).chain([window.clone()]).collect(),
            target: under(&series.path().acceleration(mass, series.interval)),
            inputs: series.inputs.iter().filter_map(|u| Spectrum::new(u, series.interval)).collect(),
            window,
            series,
            mass,
        }
    }

    /// What coefficients of the columns leave of the acceleration, under the window.
    fn without(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut rest = self.target.clone();
        for (column, coefficient) in self.columns.iter().zip(coefficients) {
            rest.iter_mut().zip(column).for_each(|(rest, c)| *rest -= coefficient * c);
        }
        rest
    }

    /// What is left with a wave of this size, cosine and sine, too.
    fn beside(&self, coefficients: &[f64], wave: Wave, size: (f64, f64)) -> Vec<f64> {
        let mut rest = self.without(coefficients);
        for (wave, size) in self.waves(wave).iter().zip([size.0, size.1]) {
            rest.iter_mut().zip(wave).for_each(|(rest, w)| *rest -= size * w);
        }
        rest
    }

    /// Cosine's and sine's part in what coefficients of the columns leave of some samples.
    fn size(&self, coefficients: &[f64], wave: Wave, range: Range<usize>) -> Option<(f64, f64)> {
        let rest = self.without(coefficients);
        let waves = self.waves(wave);
        let parts = waves.each_ref().map(|wave| &wave[range.clone()]);
        let found = bounded_least_squares(&parts, &rest[range.clone()], &[Bounds::OPEN; 2])?.coefficients;
        Some((found[0], found[1]))
    }

    /// The spectrum of values that are under the window.
    fn spectrum(&self, values: &[f64]) -> Option<Spectrum> {
        let bare: Vec<f64> = values.iter().zip(&self.window).map(|(v, w)| v / w).collect();
        Spectrum::new(&bare, self.series.interval)
    }

    fn lacking(&self, coefficients: &[f64]) -> Option<Spectrum> {
        self.spectrum(&self.without(coefficients))
    }

    fn moving(&self) -> Option<Spectrum> {
        Spectrum::new(&self.series.measured[0], self.series.interval)
    }

    /// Cosine and sine at a frequency, times the displacement where they pulsate, under the window.
    fn waves(&self, Wave { frequency, pulsates }: Wave) -> [Vec<f64>; 2] {
        let phase = |k: usize| TAU * frequency * (self.series.start + self.series.interval * k as f64);
        let carrier = if pulsates { &self.columns[self.mass] } else { &self.window };
        let wave = |of: fn(f64) -> f64| carrier.iter().enumerate().map(|(k, c)| c * of(phase(k))).collect();
        [wave(f64::cos), wave(f64::sin)]
    }

    /// Width of a line, Hz.
    fn resolution(&self) -> f64 {
        (self.series.interval * self.series.len() as f64).recip()
    }

    fn nearest(&self, spectrum: &Spectrum, frequency: f64) -> usize {
        ((frequency / spectrum.step).round() as usize).min(spectrum.amplitudes.len().saturating_sub(1))
    }

    /// The line of a spectrum of the record that no input has, Hz, where it is most of all such lines: a spring that pulsates, and one
    /// that is not linear, have many.
    fn undriven_line(&self, spectrum: &Spectrum) -> Option<f64> {
        let mut undriven = lines(spectrum);
        undriven.retain(|(f, _)| !self.is_driven(*f) && !self.is_ratio(*f));
        let all: f64 = undriven.iter().map(|(_, a)| a * a).sum();
        undriven.first().filter(|(_, a)| a * a > 0.5 * all).map(|(f, _)| *f)
    }

    /// True if an input has a line at a frequency.
    fn is_driven(&self, frequency: f64) -> bool {
        self.inputs.iter().any(|input| {
            let a = &input.amplitudes;
            let largest = a.iter().copied().fold(0.0, f64::max);
            let k = self.nearest(input, frequency);
            let near = k.saturating_sub(2)..(k + 3).min(a.len());
            near.into_iter().any(|k| a[k] > DRIVEN * largest && a[k] > STANDS_OUT * around(a, k))
        })
    }

    /// True if a frequency is in a ratio of small whole numbers to that of an input.
    fn is_ratio(&self, frequency: f64) -> bool {
        let near = |line: f64| {
            let is = |p: f64, q: f64| (p * frequency - q * line).abs() < self.resolution();
            RATIOS.iter().any(|p| RATIOS.iter().any(|q| is(*p, *q)))
        };
        // Of many tones some line is in such a ratio to any frequency.
        let tones = self.inputs.iter().map(lines).filter(|tones| tones.len() < MANY);
        tones.flatten().any(|(line, _)| near(line))
    }
}
