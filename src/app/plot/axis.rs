//! Ticks at round numbers, linear and by decades.

use egui_plot::{GridInput, GridMark};

use super::number;
use super::units::Scale;

/// Most marks on an axis, whatever the view.
const MOST_MARKS: f64 = 300.0;

/// Marks at multiples of 1, 2 or 5 times a power of ten, at least `spacing` grid steps (8 points each) apart.
pub fn round_marks(spacing: f64) -> impl Fn(GridInput) -> Vec<GridMark> {
    move |input| {
        let (low, high) = input.bounds;
        let least = input.base_step_size * spacing;
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
            .map(|i| GridMark { value: (first + i as f64) * step, step_size: step })
            .filter(|m| (low..=high).contains(&m.value))
            .collect()
    }
}

/// Marks of a logarithmic axis whose coordinate is log₁₀ of the value: strong at each power of ten (or every few), faint at 2 to 9 of
/// them where there is room.
pub fn decade_marks(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    // A label needs about 30 points along either axis.
    let stride = (input.base_step_size * 4.0).ceil().max(1.0);
    let marks = (high - low) / stride;
    if !stride.is_finite() || marks.is_nan() || marks > MOST_MARKS {
        return Vec::new();
    }
    let mut marks = Vec::new();
    let (first, last) = ((low / stride).floor() as i64, (high / stride).ceil() as i64);
    for decade in first..=last {
        let value = decade as f64 * stride;
        marks.push(GridMark { value, step_size: stride });
        if stride == 1.0 && input.base_step_size < 0.12 {
            // Where the view holds one power of ten or none, others have to tell its scale.
            let labelled = |m| high - low < FEW_DECADES && (m == 2 || m == 5);
            let step = |m| if labelled(m) { LABELLED } else { MINOR };
            marks.extend((2..10).map(|m| GridMark { value: value + f64::from(m).log10(), step_size: step(m) }));
        }
    }
    marks.retain(|m| (low..=high).contains(&m.value));
    marks
}

/// Step that is told of a minor mark: its line is drawn faint and it bears no label.
const MINOR: f64 = 0.1;

/// Step that is told of a mark between powers of ten that bears a label.
const LABELLED: f64 = 0.3;

/// Decades of a view below which marks between powers of ten bear labels.
const FEW_DECADES: f64 = 1.5;

/// Marks of an angle in degrees: whole right angles, or halves of them.
pub fn degree_marks(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let fine = 45.0 / input.base_step_size > 3.5;
    let step = if fine { 45.0 } else { 90.0 };
    if !((high - low) / step <= MOST_MARKS && high - low > step) {
        return round_marks(4.5)(input);
    }
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last).map(|k| GridMark { value: k as f64 * step, step_size: step }).collect()
}

/// A linear tick, in the scale's unit, with as many decimals as its step needs.
pub fn linear_label(mark: GridMark, scale: &Scale) -> String {
    let step = mark.step_size * scale.factor;
    let decimals = (-(step * (1.0 + 1e-9)).log10().floor()).clamp(0.0, 15.0) as usize;
    let value = mark.value * scale.factor;
    if value.abs() >= 1e7 { number::significant_trimmed(value, 6) } else { number::plain(value, decimals) }
}

/// A tick of a logarithmic axis: the power of ten with the unit's own prefix, as `10 µm`; nothing at minor marks.
pub fn decade_label(mark: GridMark, unit: &str) -> String {
    if mark.step_size < LABELLED {
        return String::new();
    }
    if mark.step_size < 1.0 {
        let value = 10f64.powf(mark.value);
        let scale = Scale::suited(value, unit);
        let text = number::significant_trimmed(value * scale.factor, 1);
        return if scale.unit.is_empty() { text } else { format!("{text} {}", scale.unit) };
    }
    let value = 10f64.powf(mark.value.round());
    let scale = Scale::suited(value, unit);
    if unit.is_empty() && !(1e-2..1e5).contains(&value) {
        return format!("10{}", number::superscript(mark.value.round() as i32));
    }
    let text = number::significant_trimmed(value * scale.factor, 1);
    if scale.unit.is_empty() { text } else { format!("{text} {}", scale.unit) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(low: f64, high: f64, pixels: f64) -> GridInput {
        GridInput { bounds: (low, high), base_step_size: (high - low) / pixels * 8.0 }
    }

    fn labels(low: f64, high: f64, scale: &Scale) -> Vec<String> {
        round_marks(10.0)(input(low, high, 400.0)).iter().map(|m| linear_label(*m, scale)).collect()
    }

    #[test]
    fn ticks_are_round_and_bear_only_the_decimals_they_need() {
        assert_eq!(labels(0.0, 1.0, &Scale::plain("s")), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(-0.0023, 0.0023, &Scale::suited(2e-3, "m")), ["−2", "−1", "0", "1", "2"]);
        assert_eq!(labels(12.0, 12.05, &Scale::plain("s")), ["12.00", "12.01", "12.02", "12.03", "12.04", "12.05"]);
        assert_eq!(labels(0.0, 100.0, &Scale::plain("s")), ["0", "20", "40", "60", "80", "100"]);
    }

    #[test]
    fn a_low_plot_has_more_than_one_tick() {
        let marks = round_marks(4.5)(input(-33.0, 33.0, 85.0));
        assert_eq!(marks.iter().map(|m| m.value).collect::<Vec<_>>(), [-20.0, 0.0, 20.0]);
    }

    #[test]
    fn ticks_of_strange_views_are_few() {
        for (low, high) in [(1e15, 1e15 + 1.0), (-1e300, 1e300), (0.0, 1e-300), (f64::NEG_INFINITY, 1.0), (0.0, 0.0)] {
            assert!(round_marks(10.0)(input(low, high, 400.0)).len() < 310);
            assert!(decade_marks(input(low, high, 400.0)).len() < 3100);
        }
    }

    #[test]
    fn decades_carry_their_unit() {
        let marks = decade_marks(input(-6.5, -2.5, 400.0));
        let labels: Vec<String> = marks.iter().map(|m| decade_label(*m, "m")).filter(|l| !l.is_empty()).collect();
        assert_eq!(labels, ["1 µm", "10 µm", "100 µm", "1 mm"]);
        assert!(marks.len() > 30, "minor marks where there is room");
        let mark = |value| GridMark { value, step_size: 1.0 };
        assert_eq!(decade_label(mark(-9.0), ""), "10⁻⁹");
        assert_eq!(decade_label(mark(1.0), ""), "10");
        assert_eq!(decade_label(mark(2.0), "Hz"), "100 Hz");
        assert_eq!(decade_marks(input(-60.0, 0.0, 400.0)).len(), 13);
        let close = decade_marks(input(-0.4, 0.6, 300.0));
        let labels: Vec<String> = close.iter().map(|m| decade_label(*m, "m")).filter(|l| !l.is_empty()).collect();
        assert_eq!(labels, ["0.5 m", "1 m", "2 m"], "a view of one decade tells its scale");
    }

    #[test]
    fn angles_are_marked_at_right_angles() {
        let values = |low, high, pixels| -> Vec<f64> {
            degree_marks(input(low, high, pixels)).iter().map(|m| m.value).collect()
        };
        assert_eq!(values(-190.0, 10.0, 120.0), [-180.0, -90.0, 0.0]);
        assert_eq!(values(-190.0, 10.0, 400.0), [-180.0, -135.0, -90.0, -45.0, 0.0]);
        assert!(values(-3.0, 3.0, 400.0).len() > 3);
    }
}
