//! Panels with axes, ticks and lines, as SVG.

use std::ops::RangeInclusive;

use super::svg::{Anchor, Svg};
use crate::palette::Ink;
use sindyscope_values::format::number::{plain, significant_trimmed, superscript};
use sindyscope_values::format::units::Scale;

/// The room that a figure is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    /// Width, points.
    pub(super) width: f64,
    /// Height, points; none: as high as the figure is by itself.
    pub(super) height: Option<f64>,
}

/// The width of a page's text.
pub(super) const WIDTH: f64 = 700.0;

/// Distance of figures beside each other.
pub(super) const GUTTER: f64 = 14.0;

/// Least factor on the heights of panels that have less room than they need.
const FLATTEST: f64 = 0.2;

impl Extent {
    /// A figure as wide as the page's text.
    pub(super) const PAGE: Self = Self { width: WIDTH, height: None };
    /// One of two figures beside each other.
    pub(super) const HALF: Self = Self { width: 0.5 * (WIDTH - GUTTER), height: None };

    /// The factor on the heights of panels, `panels` together, that fills the height beside what is `fixed`.
    pub(super) fn stretch(&self, fixed: f64, panels: f64) -> f64 {
        self.height.map_or(1.0, |height| ((height - fixed) / panels).max(FLATTEST))
    }
}

/// Line of a chart, in data coordinates.
pub(super) struct Line {
    /// What it shows; decides its colour and stroke.
    pub(super) ink: Ink,
    /// Points; the line pauses where one is not finite.
    pub(super) points: Vec<(f64, f64)>,
}

/// An axis: the values shown, in data coordinates, and how they are written.
#[derive(Clone)]
pub(super) struct Axis {
    /// What is measured along it, with its unit.
    pub(super) label: String,
    /// Data values from one end to the other; of a logarithmic axis, both above zero.
    pub(super) range: RangeInclusive<f64>,
    /// Shown value per data value.
    pub(super) factor: f64,
    /// Whether equal distances are equal ratios.
    pub(super) logarithmic: bool,
}

impl Axis {
    /// A linear axis in the prefix that suits the range.
    pub(super) fn linear(symbol: &str, range: RangeInclusive<f64>, unit: &str) -> Self {
        let scale = Scale::suited(range.start().abs().max(range.end().abs()), unit);
        Self { label: scale.axis(symbol), range, factor: scale.factor, logarithmic: false }
    }

    /// A logarithmic axis.
    pub(super) fn logarithmic(symbol: &str, range: RangeInclusive<f64>, unit: &str) -> Self {
        Self { label: Scale::plain(unit).axis(symbol), range, factor: 1.0, logarithmic: true }
    }

    /// Where a value lies, 0 at the start and 1 at the end of the range.
    fn share(&self, value: f64) -> f64 {
        let (low, high) = (*self.range.start(), *self.range.end());
        if self.logarithmic {
            if value > 0.0 { (value / low).ln() / (high / low).ln() } else { f64::NEG_INFINITY }
        } else {
            (value - low) / (high - low)
        }
    }

    /// Ticks with their labels, in data values; about one in `spacing` of `length`.
    fn ticks(&self, length: f64, spacing: f64) -> Vec<(f64, String)> {
        if self.logarithmic { self.decades(length, spacing) } else { self.round_values(length, spacing) }
    }

    fn round_values(&self, length: f64, spacing: f64) -> Vec<(f64, String)> {
        let (low, high) = (*self.range.start() * self.factor, *self.range.end() * self.factor);
        let least = (high - low) * spacing / length;
        if !(least > 0.0 && least.is_finite()) {
            return Vec::new();
        }
        let power = 10f64.powf(least.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|s| s * power).into_iter().find(|s| *s >= least * (1.0 - 1e-9));
        let step = step.unwrap_or(10.0 * power);
        let decimals = (-(step * (1.0 + 1e-9)).log10().floor()).clamp(0.0, 15.0) as usize;
        let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
        // Beyond 2⁵³ steps from zero neighbouring ticks fall together.
        if first.abs().max(last.abs()) > 9e15 {
            return Vec::new();
        }
        (first as i64..=last as i64)
            .map(|k| k as f64 * step)
            .map(|v| (v / self.factor, if v.abs() >= 1e7 { significant_trimmed(v, 6) } else { plain(v, decimals) }))
            .collect()
    }

    fn decades(&self, length: f64, spacing: f64) -> Vec<(f64, String)> {
        let (low, high) = (self.range.start().log10(), self.range.end().log10());
        if !(high > low && (high - low).is_finite()) {
            return Vec::new();
        }
        let stride = ((high - low) * spacing / length).ceil().max(1.0) as i32;
        let powers: Vec<i32> =
            ((low - 1e-9).ceil() as i32..=(high + 1e-9).floor() as i32).filter(|p| p.rem_euclid(stride) == 0).collect();
        let plain = powers.iter().all(|p| (-2..=4).contains(p));
        let label = |power: i32| {
            if plain { significant_trimmed(10f64.powi(power), 1) } else { format!("10{}", superscript(power)) }
        };
        powers.into_iter().map(|p| (10f64.powi(p), label(p))).collect()
    }
}

/// A stretch of the abscissa or a level that stands out.
pub(super) enum Guide {
    /// A horizontal line.
    Level(Ink, f64),
    /// A vertical line.
    At(Ink, f64),
    /// A tinted stretch of the abscissa.
    Stretch(RangeInclusive<f64>),
}

/// A frame with lines in it.
pub(super) struct Panel {
    /// Left top corner of the frame.
    pub(super) at: (f64, f64),
    /// Size of the frame.
    pub(super) size: (f64, f64),
    pub(super) x: Axis,
    pub(super) y: Axis,
    /// Whether the abscissa's labels are written (the lowest panel of a column).
    pub(super) x_labels: bool,
    /// Whether the ordinate's labels are written (the first panel of a row).
    pub(super) y_labels: bool,
    pub(super) guides: Vec<Guide>,
    pub(super) lines: Vec<Line>,
    /// Single points below the lines.
    pub(super) dots: Vec<(f64, f64)>,
}

/// Room below a panel for tick labels and the axis label.
pub(super) const BELOW: f64 = 34.0;
/// Room left of a panel for the same.
pub(super) const LEFT: f64 = 54.0;
/// Room right of a panel.
pub(super) const RIGHT: f64 = 8.0;
/// Room above a panel for a line of keys.
const ABOVE: f64 = 20.0;
/// Height of each further line of keys.
const KEY_LINE: f64 = 14.0;
/// Width of a letter of a tick or a key in any proportional font.
const LETTER: f64 = 5.6;
/// Distances of ticks that leave room for their labels.
const TICK_SPACING: (f64, f64) = (64.0, 28.0);

/// Side of a dot.
const DOT: f64 = 2.2;

impl Panel {
    /// Columns of the picture's finest raster that the frame is wide.
    pub(super) fn columns(&self) -> usize {
        // Two a point: the raster of the picture for print.
        (2.0 * self.size.0) as usize
    }

    pub(super) fn draw(&self, svg: &mut Svg) {
        let (left, top) = self.at;
        let (width, height) = self.size;
        let (right, bottom) = (left + width, top + height);
        let to = |(x, y): (f64, f64)| {
            // Far outside the frame, where the line is clipped anyway, coordinates are kept small enough to be written.
            let y = self.y.share(y).clamp(-10.0, 11.0);
            (left + width * self.x.share(x), bottom - height * y)
        };
        for guide in &self.guides {
            if let Guide::Stretch(stretch) = guide {
                let (from, until) = (self.x.share(*stretch.start()).max(0.0), self.x.share(*stretch.end()).min(1.0));
                svg.rect("stretch", (left + width * from, top), (width * (until - from), height));
            }
        }
        for (value, label) in self.x.ticks(width, TICK_SPACING.0) {
            let x = left + width * self.x.share(value);
            svg.line("grid", (x, top), (x, bottom));
            if self.x_labels {
                // The last label ends where the figure does.
                let half = 0.5 * LETTER * label.chars().count() as f64;
                svg.text("tick", (x.min(right + RIGHT - half), bottom + 13.0), Anchor::Middle, &label);
            }
        }
        for (value, label) in self.y.ticks(height, TICK_SPACING.1) {
            let y = bottom - height * self.y.share(value);
            svg.line("grid", (left, y), (right, y));
            if self.y_labels {
                svg.text("tick", (left - 6.0, y + 3.5), Anchor::End, &label);
            }
        }
        if self.x_labels {
            svg.text("label", (left + 0.5 * width, bottom + 29.0), Anchor::Middle, &self.x.label);
        }
        if self.y_labels {
            svg.upward_text("label", (left - LEFT + 12.0, top + 0.5 * height), &self.y.label);
        }
        svg.begin_clip(self.at, self.size);
        for dot in &self.dots {
            let (x, y) = to(*dot);
            if x.is_finite() && y.is_finite() {
                svg.rect("dot", (x - 0.5 * DOT, y - 0.5 * DOT), (DOT, DOT));
            }
        }
        for line in &self.lines {
            svg.path(class(line.ink), line.points.iter().copied().map(to));
        }
        for guide in &self.guides {
            match *guide {
                Guide::Level(ink, y) if (0.0..=1.0).contains(&self.y.share(y)) => {
                    let y = bottom - height * self.y.share(y);
                    svg.line(class(ink), (left, y), (right, y));
                }
                Guide::At(ink, x) => {
                    let x = left + width * self.x.share(x);
                    svg.line(class(ink), (x, top), (x, bottom));
                }
                Guide::Level(..) | Guide::Stretch(_) => {}
            }
        }
        svg.end_clip();
        svg.rect("frame", self.at, self.size);
    }
}

/// Keys of lines side by side, in as many lines as they need.
pub(super) struct Legend<'a> {
    lines: Vec<Vec<(f64, Ink, &'a str)>>,
    left: f64,
}

impl<'a> Legend<'a> {
    /// Keys from `left` on in a figure of this width.
    pub(super) fn new(entries: &[(Ink, &'a str)], left: f64, width: f64) -> Self {
        let mut lines: Vec<Vec<(f64, Ink, &str)>> = vec![Vec::new()];
        let mut x = left;
        for (ink, label) in entries {
            let wide = 32.0 + LETTER * label.chars().count() as f64;
            if x + wide > width && x > left {
                lines.push(Vec::new());
                x = left;
            }
            if let Some(line) = lines.last_mut() {
                line.push((x, *ink, *label));
            }
            x += wide + 16.0;
        }
        Self { lines, left }
    }

    /// Height above the panels that the keys take.
    pub(super) fn top(&self) -> f64 {
        ABOVE + KEY_LINE * (self.lines.len() - 1) as f64
    }

    /// Draws the keys, the last line just above the panels.
    pub(super) fn draw(&self, svg: &mut Svg) {
        for (k, line) in self.lines.iter().enumerate() {
            let base = ABOVE - 8.0 + KEY_LINE * k as f64;
            for (x, ink, label) in line {
                svg.line(class(*ink), (*x, base - 3.5), (x + 22.0, base - 3.5));
                svg.text("key", (x + 28.0, base), Anchor::Start, label);
            }
        }
    }

    /// Draws a dot's key in front of the others, which begin further right.
    pub(super) fn dot(&self, svg: &mut Svg, before: f64, label: &str) {
        svg.rect("dot", (self.left - before + 8.0, ABOVE - 14.0), (5.0, 5.0));
        svg.text("key", (self.left - before + 28.0, ABOVE - 8.0), Anchor::Start, label);
    }
}

/// The style sheet's name of an ink.
pub(super) fn class(ink: Ink) -> &'static str {
    match ink {
        Ink::Measured => "measured",
        Ink::Identified => "identified",
        Ink::Ghost => "ghost",
        Ink::Error => "error",
        Ink::ErrorGhost => "error-ghost",
        Ink::ErrorRms => "error-rms",
        Ink::Mean => "mean",
        Ink::NoiseFloor => "noise",
        Ink::Input => "input",
        Ink::Diverged => "diverged",
    }
}

/// What shows of evenly spaced samples on so many columns: all of them if they are few, else the smallest and the largest of
/// each column, each where it lies.
pub(super) fn thinned(values: &[f64], at: impl Fn(usize) -> f64, columns: usize) -> Vec<(f64, f64)> {
    let block = values.len() / columns.max(1);
    if block < 4 {
        return values.iter().enumerate().map(|(i, v)| (at(i), *v)).collect();
    }
    let mut points = Vec::with_capacity(2 * columns + 2);
    for (b, block_values) in values.chunks(block).enumerate() {
        let finite = || block_values.iter().enumerate().filter(|(_, v)| v.is_finite());
        let least = finite().min_by(|p, q| p.1.total_cmp(q.1));
        let most = finite().max_by(|p, q| p.1.total_cmp(q.1));
        if let (Some((i, low)), Some((j, high))) = (least, most) {
            let mut pair = [(i, *low), (j, *high)];
            pair.sort_unstable_by_key(|p| p.0);
            points.extend(pair.map(|(k, v)| (at(b * block + k), v)));
        }
    }
    points
}

/// The largest of each of `columns` columns of a logarithmic axis, for lines of a spectrum.
pub(super) fn thinned_logarithmic(points: &[(f64, f64)], columns: usize) -> Vec<(f64, f64)> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return Vec::new() };
    let scale = columns as f64 / (last.0 / first.0).ln();
    let mut out: Vec<(f64, f64)> = Vec::new();
    let mut current = f64::NAN;
    for &(x, y) in points {
        let column = ((x / first.0).ln() * scale).floor();
        match out.last_mut() {
            Some(kept) if column == current => {
                if y > kept.1 {
                    *kept = (x, y);
                }
            }
            _ => out.push((x, y)),
        }
        current = column;
    }
    out
}

/// A range around values with room at both ends; around zero if there is nothing to show.
pub(super) fn padded(values: impl IntoIterator<Item = f64>) -> RangeInclusive<f64> {
    let (low, high) = values
        .into_iter()
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return -1.0..=1.0;
    }
    let room = 0.06 * (high - low);
    let room = if room > 0.0 { room } else { (0.1 * high.abs()).max(f64::MIN_POSITIVE.sqrt()) };
    low - room..=high + room
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(low: f64, high: f64) -> Axis {
        Axis::linear("x", low..=high, "m")
    }

    fn labels(axis: &Axis, length: f64) -> Vec<String> {
        axis.ticks(length, 60.0).into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_round_in_the_shown_unit() {
        let axis = axis(-2.3e-3, 2.3e-3);
        assert_eq!(axis.label, "x (mm)");
        assert_eq!(labels(&axis, 330.0), ["−2", "−1", "0", "1", "2"]);
        let decades = Axis::logarithmic("f", 0.05..=600.0, "Hz");
        assert_eq!(labels(&decades, 330.0), ["0.1", "1", "10", "100"]);
        assert_eq!(labels(&Axis::logarithmic("f", 1e-9..=1e-3, ""), 330.0), ["10⁻⁸", "10⁻⁶", "10⁻⁴"]);
    }

    #[test]
    fn strange_ranges_have_few_ticks() {
        for (low, high) in [(0.0, 0.0), (1e15, 1e15 + 1.0), (-1e300, 1e300), (0.0, 1e-300), (f64::NAN, 1.0)] {
            assert!(labels(&axis(low, high), 400.0).len() < 20, "{low} {high}");
        }
        assert!(labels(&Axis::logarithmic("f", 0.0..=1.0, "Hz"), 400.0).is_empty());
    }

    #[test]
    fn thinning_keeps_the_extremes() {
        let mut values = vec![0.0; 10_000];
        (values[777], values[5001]) = (3.0, -4.0);
        let points = thinned(&values, |i| i as f64, 100);
        assert!(points.len() <= 202);
        assert!(points.contains(&(777.0, 3.0)) && points.contains(&(5001.0, -4.0)));
        assert!(points.is_sorted_by(|a, b| a.0 <= b.0));
        assert_eq!(thinned(&values[..20], |i| i as f64, 100).len(), 20);
    }
}
