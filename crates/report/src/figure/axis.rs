//! Axes: what is measured along them, their range, and marks at round values.

use sindyscope_values::format::number::{self, significant_trimmed};
use sindyscope_values::format::shown::ShownUnits;
use sindyscope_values::format::units::Scale;

/// Most marks on an axis, whatever the view.
const MOST_MARKS: f64 = 300.0;

/// An axis. Its coordinates are values, or their logarithms to base ten.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// What is measured along it.
    pub symbol: String,
    /// In which unit.
    pub unit: String,
    /// Whether equal distances are equal ratios: a coordinate is the logarithm of a value to base ten.
    pub logarithmic: bool,
    /// Coordinates shown at first.
    pub range: (f64, f64),
    /// Where marks stand.
    pub ticks: Ticks,
    /// Axes of this name, in all figures, are zoomed and moved together.
    pub link: Option<&'static str>,
}

/// Where the marks of an axis stand, and what they say.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Ticks {
    /// At round numbers; on a logarithmic axis at powers of ten.
    #[default]
    Round,
    /// At right angles, in degrees.
    Degrees,
    /// At whole numbers.
    Whole,
    /// As [`Ticks::Round`], shares written in percent.
    Percent,
    /// At coordinates that have names.
    Named(Vec<(f64, String)>),
}

/// A mark on an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickMark {
    /// Its coordinate.
    pub at: f64,
    /// Distance of marks that are as important.
    pub step: f64,
}

/// Step of a mark between powers of ten that bears no label.
const MINOR: f64 = 0.1;

/// Step of a mark between powers of ten that bears a label.
const LABELLED: f64 = 0.3;

/// Decades of a view below which marks between powers of ten bear labels.
const FEW_DECADES: f64 = 1.5;

impl Axis {
    /// A linear axis.
    pub fn linear(symbol: impl Into<String>, unit: impl Into<String>, range: (f64, f64)) -> Self {
        Self { symbol: symbol.into(), unit: unit.into(), range: sound(range), ..Self::default() }
    }

    /// A logarithmic axis; the range is of logarithms to base ten.
    pub fn logarithmic(symbol: impl Into<String>, unit: impl Into<String>, range: (f64, f64)) -> Self {
        Self { logarithmic: true, ..Self::linear(symbol, unit, range) }
    }

    /// With marks of another kind.
    #[must_use]
    pub fn with_ticks(self, ticks: Ticks) -> Self {
        Self { ticks, ..self }
    }

    /// Zoomed and moved together with others of this name.
    #[must_use]
    pub fn linked(self, link: &'static str) -> Self {
        Self { link: Some(link), ..self }
    }

    /// The coordinate of a value; that of zero on a logarithmic axis lies below all that is shown.
    pub fn coordinate(&self, value: f64) -> f64 {
        if self.logarithmic { value.max(f64::MIN_POSITIVE).log10() } else { value }
    }

    /// The value at a coordinate.
    pub fn value(&self, coordinate: f64) -> f64 {
        if self.logarithmic { 10f64.powf(coordinate) } else { coordinate }
    }

    /// How values are shown.
    pub fn scale(&self, units: &ShownUnits) -> Scale {
        let largest = if self.logarithmic { 0.0 } else { self.range.0.abs().max(self.range.1.abs()) };
        units.scale(largest, &self.unit)
    }

    /// What stands beside the axis: the symbol, and the unit unless the marks tell it.
    pub fn title(&self, scale: &Scale) -> String {
        if self.logarithmic || self.ticks == Ticks::Percent { self.symbol.clone() } else { scale.axis(&self.symbol) }
    }

    /// The symbol with the value at a coordinate.
    pub fn text(&self, coordinate: f64, units: &ShownUnits) -> String {
        let value = self.value(coordinate);
        let scale = if self.logarithmic { units.scale(value, &self.unit) } else { self.scale(units) };
        format!("{} {}", self.symbol, scale.format(value, 4))
    }

    /// The head of a column of its values.
    pub fn header(&self) -> String {
        Scale::plain(self.unit.as_str()).axis(&self.symbol)
    }

    /// Marks between two coordinates, where eight points are as long as `step` and labels need room of `spacing` such steps.
    pub fn marks(&self, (low, high): (f64, f64), step: f64, spacing: f64) -> Vec<TickMark> {
        match &self.ticks {
            Ticks::Named(names) => {
                // Named marks stand for themselves: each has the room to its neighbour.
                let apart = names.windows(2).map(|w| w[1].0 - w[0].0).fold(f64::INFINITY, f64::min);
                let apart = if apart.is_finite() { apart } else { high - low };
                let every = ((2.5 * step / apart).ceil().max(1.0)) as usize;
                let shown = names.iter().step_by(every).filter(|(at, _)| (low..=high).contains(at));
                // A digit or two need less room than words.
                let short = names.iter().all(|(_, name)| name.chars().count() <= 2);
                let least = if short { 10.0 } else { 4.0 } * step;
                shown.map(|(at, _)| TickMark { at: *at, step: (every as f64 * apart).max(least) }).collect()
            }
            _ if self.logarithmic => decades(low, high, step),
            Ticks::Degrees => degrees(low, high, step),
            Ticks::Whole => {
                let distance = (6.0 * step).ceil().max(1.0);
                let whole = round(low, high, distance).into_iter().filter(|m| m.at.fract() == 0.0);
                // One digit needs less room than most labels.
                whole.map(|m| TickMark { step: m.step.max(10.0 * step), ..m }).collect()
            }
            Ticks::Round | Ticks::Percent => round(low, high, step * spacing),
        }
    }

    /// What a mark says; nothing at minor ones.
    pub fn label(&self, mark: TickMark, scale: &Scale) -> String {
        match &self.ticks {
            Ticks::Named(names) => {
                names.iter().find(|(at, _)| *at == mark.at).map_or_else(String::new, |(_, name)| name.clone())
            }
            Ticks::Percent if self.logarithmic && mark.step < 1.0 => String::new(),
            Ticks::Percent => percent(self.value(mark.at)),
            _ if self.logarithmic => decade_label(mark, &self.unit),
            Ticks::Whole => format!("{:.0}", mark.at),
            Ticks::Round | Ticks::Degrees => linear_label(mark, scale),
        }
    }
}

/// A share in words.
pub(crate) fn percent(share: f64) -> String {
    format!("{} %", significant_trimmed(100.0 * share, 2))
}

/// A range that a plot can show.
fn sound((low, high): (f64, f64)) -> (f64, f64) {
    if low < high && (high - low).is_finite() { (low, high) } else { (-1.0, 1.0) }
}

/// Marks at multiples of 1, 2 or 5 times a power of ten, at least `least` apart.
fn round(low: f64, high: f64, least: f64) -> Vec<TickMark> {
    if !(least > 0.0 && least.is_finite() && (high - low).is_finite()) {
        return Vec::new();
    }
    let power = 10f64.powf(least.log10().floor());
    let steps = [0.5, 1.0, 2.0, 5.0, 10.0].map(|s| s * power);
    let roomy = (1..steps.len()).find(|k| steps[*k] >= least * (1.0 - 1e-9)).unwrap_or(steps.len() - 1);
    let ends = |step: f64| ((low / step).ceil(), (high / step).floor());
    // One mark alone tells no scale: two of the next smaller step do.
    let (first, last) = ends(steps[roomy]);
    let step = if last - first < 1.0 { steps[roomy - 1] } else { steps[roomy] };
    let (first, last) = ends(step);
    // Beyond 2⁵³ steps from zero neighbouring marks fall together.
    if !(last - first <= MOST_MARKS && first.abs().max(last.abs()) < 9e15) {
        return Vec::new();
    }
    (0..=(last - first) as i64)
        .map(|i| TickMark { at: (first + i as f64) * step, step })
        .filter(|m| (low..=high).contains(&m.at))
        .collect()
}

/// Marks of a logarithmic axis: strong at each power of ten (or every few), faint at 2 to 9 of them where there is room.
fn decades(low: f64, high: f64, eight_points: f64) -> Vec<TickMark> {
    // A label needs about 30 points along either axis.
    let stride = (eight_points * 4.0).ceil().max(1.0);
    let marks = (high - low) / stride;
    if !stride.is_finite() || marks.is_nan() || marks > MOST_MARKS {
        return Vec::new();
    }
    let mut marks = Vec::new();
    let (first, last) = ((low / stride).floor() as i64, (high / stride).ceil() as i64);
    for decade in first..=last {
        let at = decade as f64 * stride;
        marks.push(TickMark { at, step: stride });
        if stride == 1.0 && eight_points < 0.12 {
            // Where the view holds one power of ten or none, others have to tell its scale.
            let labelled = |m| high - low < FEW_DECADES && (m == 2 || m == 5);
            let step = |m| if labelled(m) { LABELLED } else { MINOR };
            marks.extend((2..10).map(|m| TickMark { at: at + f64::from(m).log10(), step: step(m) }));
        }
    }
    marks.retain(|m| (low..=high).contains(&m.at));
    marks
}

/// Marks of an angle in degrees: whole right angles, or halves of them.
fn degrees(low: f64, high: f64, eight_points: f64) -> Vec<TickMark> {
    let fine = 45.0 / eight_points > 3.5;
    let step = if fine { 45.0 } else { 90.0 };
    if !((high - low) / step <= MOST_MARKS && high - low > step) {
        return round(low, high, 4.5 * eight_points);
    }
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last).map(|k| TickMark { at: k as f64 * step, step }).collect()
}

/// A linear mark, in the scale's unit, with as many decimals as its step needs.
fn linear_label(mark: TickMark, scale: &Scale) -> String {
    let step = mark.step * scale.factor;
    let decimals = (-(step * (1.0 + 1e-9)).log10().floor()).clamp(0.0, 15.0) as usize;
    let value = mark.at * scale.factor;
    if value.abs() >= 1e7 { significant_trimmed(value, 6) } else { number::plain(value, decimals) }
}

/// A mark of a logarithmic axis: the power of ten with the unit's own prefix, as `10 µm`; nothing at minor marks.
fn decade_label(mark: TickMark, unit: &str) -> String {
    if mark.step < LABELLED {
        return String::new();
    }
    let value = 10f64.powf(if mark.step < 1.0 { mark.at } else { mark.at.round() });
    let scale = Scale::suited(value, unit);
    if mark.step >= 1.0 && unit.is_empty() && !(1e-2..1e5).contains(&value) {
        return format!("10{}", number::superscript(mark.at.round() as i32));
    }
    let text = significant_trimmed(value * scale.factor, 1);
    if scale.unit.is_empty() { text } else { format!("{text} {}", scale.unit) }
}

/// The range of values with a margin; ±1 of nothing.
pub(crate) fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) =
        values.filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return (-1.0, 1.0);
    }
    let least = 1e-6 * low.abs().max(high.abs());
    let margin = (0.06 * (high - low)).max(if least > 0.0 { least } else { 1.0 });
    (low - margin, high + margin)
}

/// The range of what was measured, and of what was identified as far as it does not run away.
pub(crate) fn lead(measured: impl Iterator<Item = f64>, identified: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = extent(measured);
    let room = 0.35 * (high - low);
    let (least, most) = extent(identified.filter(|v| (low - room..=high + room).contains(v)).chain([low, high]));
    (least.max(low - room), most.min(high + room))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, pixels: f64, spacing: f64, scale: &Scale) -> Vec<String> {
        let step = (axis.range.1 - axis.range.0) / pixels * 8.0;
        let marks = axis.marks(axis.range, step, spacing);
        marks.into_iter().map(|m| axis.label(m, scale)).filter(|l| !l.is_empty()).collect()
    }

    fn linear(low: f64, high: f64, scale: &Scale) -> Vec<String> {
        labels(&Axis::linear("x", "", (low, high)), 400.0, 10.0, scale)
    }

    #[test]
    fn ticks_are_round_and_bear_only_the_decimals_they_need() {
        assert_eq!(linear(0.0, 1.0, &Scale::plain("s")), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(linear(-0.0023, 0.0023, &Scale::suited(2e-3, "m")), ["−2", "−1", "0", "1", "2"]);
        assert_eq!(linear(12.0, 12.05, &Scale::plain("s")), ["12.00", "12.01", "12.02", "12.03", "12.04", "12.05"]);
        assert_eq!(linear(0.0, 100.0, &Scale::plain("s")), ["0", "20", "40", "60", "80", "100"]);
    }

    #[test]
    fn a_low_plot_has_more_than_one_tick() {
        let marks = Axis::linear("x", "", (-33.0, 33.0)).marks((-33.0, 33.0), 66.0 / 85.0 * 8.0, 4.5);
        assert_eq!(marks.iter().map(|m| m.at).collect::<Vec<_>>(), [-20.0, 0.0, 20.0]);
    }

    #[test]
    fn ticks_of_strange_views_are_few() {
        for (low, high) in [(1e15, 1e15 + 1.0), (-1e300, 1e300), (0.0, 1e-300), (f64::NEG_INFINITY, 1.0), (0.0, 0.0)] {
            let step = (high - low) / 400.0 * 8.0;
            assert!(Axis::linear("x", "", (0.0, 1.0)).marks((low, high), step, 10.0).len() < 310);
            assert!(Axis::logarithmic("x", "", (0.0, 1.0)).marks((low, high), step, 10.0).len() < 3100);
        }
    }

    #[test]
    fn decades_carry_their_unit() {
        let axis = Axis::logarithmic("x", "m", (-6.5, -2.5));
        assert_eq!(labels(&axis, 400.0, 10.0, &Scale::plain("")), ["1 µm", "10 µm", "100 µm", "1 mm"]);
        assert!(axis.marks(axis.range, 0.08, 10.0).len() > 30, "minor marks where there is room");
        let mark = |at| TickMark { at, step: 1.0 };
        assert_eq!(decade_label(mark(-9.0), ""), "10⁻⁹");
        assert_eq!(decade_label(mark(1.0), ""), "10");
        assert_eq!(decade_label(mark(2.0), "Hz"), "100 Hz");
        assert_eq!(decades(-60.0, 0.0, 1.2).len(), 13);
        let close = Axis::logarithmic("x", "m", (-0.4, 0.6));
        let said = labels(&close, 300.0, 10.0, &Scale::plain(""));
        assert_eq!(said, ["0.5 m", "1 m", "2 m"], "a view of one decade tells its scale");
    }

    #[test]
    fn angles_are_marked_at_right_angles() {
        let axis = Axis::linear("phase", "°", (-190.0, 10.0)).with_ticks(Ticks::Degrees);
        let at = |(low, high): (f64, f64), pixels: f64| -> Vec<f64> {
            axis.marks((low, high), (high - low) / pixels * 8.0, 4.5).iter().map(|m| m.at).collect()
        };
        assert_eq!(at((-190.0, 10.0), 120.0), [-180.0, -90.0, 0.0]);
        assert_eq!(at((-190.0, 10.0), 400.0), [-180.0, -135.0, -90.0, -45.0, 0.0]);
        assert!(at((-3.0, 3.0), 400.0).len() > 3);
    }

    #[test]
    fn named_ticks_say_their_names_and_shares_are_percent() {
        let names = vec![(0.5, "7".to_owned()), (1.5, "9".to_owned()), (2.5, "11".to_owned())];
        let axis = Axis::linear("segment", "", (0.0, 3.0)).with_ticks(Ticks::Named(names));
        assert_eq!(labels(&axis, 200.0, 4.5, &Scale::plain("")), ["7", "9", "11"]);
        assert_eq!(labels(&axis, 30.0, 4.5, &Scale::plain("")), ["7", "11"]);
        let shares = Axis::logarithmic("error", "", (-2.2, 0.1)).with_ticks(Ticks::Percent);
        assert_eq!(labels(&shares, 200.0, 4.5, &Scale::plain("")), ["1 %", "10 %", "100 %"]);
    }
}
