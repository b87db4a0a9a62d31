//! Figures as plain values: what is drawn, not how.
//!
//! A [`Figure`] is rows of [`Panel`]s; a panel has two [`Axis`] values, [`Layer`]s from back to front and [`Guide`]s. Pure functions
//! build figures ([`view`](crate::view), [`walk`](crate::walk)); two painters draw them: [`svg`] here, for reports and saved
//! pictures, and the window's, which adds zoom, values at the pointer and menus. Both ask [`Axis::marks`] for ticks,
//! [`Panel::keys`] for legends, [`thin`] for the points that show, and the [palette](crate::palette) for colours.

mod axis;
mod cells;
pub(crate) mod style;
pub(crate) mod svg;
pub mod thin;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::ops::RangeInclusive;
use std::sync::Arc;

use crate::palette::{Ink, Tint};
pub use axis::{Axis, TickMark, Ticks};
pub(crate) use axis::{extent, lead, percent};
pub use cells::{Cells, Colours};
use sindyscope_values::format::units::Scale;
use thin::{Envelope, Spacing};

/// Rows of panels, with a legend and a caption.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// From top to bottom.
    pub rows: Vec<PanelRow>,
    /// Keys of what several panels share; other keys stand above their panel.
    pub legend: Vec<LegendEntry>,
    /// What the figure shows, in words, for print.
    pub caption: String,
    /// Height of all panels together where the figure stands as it likes, points.
    pub height: f64,
}

/// Panels beside each other.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelRow {
    /// From left to right.
    pub panels: Vec<Panel>,
    /// Share of the figure's height, beside those of the other rows.
    pub share: f64,
    /// The panel to show if only one of them is to be seen at a time.
    pub one_of: Option<usize>,
}

/// One plot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Name that is unique in its figure.
    pub id: &'static str,
    /// What it shows, in a few words above it.
    pub title: String,
    /// What tells it from others of a row of which one is shown, with how much it stands out: a share that is 0.05 by chance.
    pub choice: Option<(String, f64)>,
    /// Abscissa.
    pub x: Axis,
    /// Ordinate.
    pub y: Axis,
    /// How the ordinate's range is found.
    pub fit: Fit,
    /// What is drawn, the hindmost first.
    pub layers: Vec<Layer>,
    /// What stands out without being data.
    pub guides: Vec<Guide>,
    /// What to say where nothing is drawn.
    pub note: String,
    /// Its numbers with their heads; none: those of its layers.
    pub columns: Vec<(String, Vec<f64>)>,
    /// Whether it stands as it is: neither zoomed nor moved.
    pub fixed: bool,
}

/// How the range of an ordinate is found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Fit {
    /// It is given.
    #[default]
    Given,
    /// From the curves that are shown, by the part that each plays.
    Curves,
    /// From magnitudes, which begin at zero and are shown up to this one, however large they are.
    Magnitudes(f64),
}

/// Something drawn in one ink.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Its colour and stroke.
    pub ink: Ink,
    /// Its name in the legend and at the pointer; empty: it has none.
    pub name: String,
    /// What is drawn.
    pub shape: Shape,
    /// How it counts for the range.
    pub part: LayerRole,
    /// Width of the line, points; none: the ink's own.
    pub width: Option<f32>,
}

/// The part that a layer plays in its panel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LayerRole {
    /// The range is fitted to it.
    #[default]
    Leads,
    /// It widens the range only so far: one that runs away must not flatten the measurement.
    Follows,
    /// As `Follows`, and it is neither read out at the pointer nor copied. While it is empty the window keeps room for its key.
    Ghost,
}

/// What is drawn. All numbers are values, also where an axis is logarithmic.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A line through evenly spaced samples.
    Samples(Samples),
    /// A band about evenly spaced samples, and half its width at each.
    Tube(Samples, Samples),
    /// A line through points; it pauses where one is not finite.
    Line(Points),
    /// Many small points.
    Dots(Points),
    /// A few points, each of which counts.
    Marks(Points),
    /// Upright bars of doubt: abscissa, lower and upper end.
    Errors(Vec<[f64; 3]>),
    /// A tint between two curves: abscissa, lower and upper.
    Band(Vec<[f64; 3]>),
    /// Bars from zero on; hollow ones are outlined.
    Bars {
        /// The bars.
        bars: Vec<PlotBar>,
        /// Outlined instead of filled.
        hollow: bool,
    },
    /// Rectangles, each coloured by its value.
    Cells(Cells),
}

/// A bar from zero on.
#[derive(Clone, Debug, PartialEq)]
pub struct PlotBar {
    /// Left edge.
    pub from: f64,
    /// Right edge.
    pub to: f64,
    /// Its end.
    pub height: f64,
    /// Written above it.
    pub text: String,
    /// The ordinate from which on that is written.
    pub text_at: f64,
}

/// Evenly spaced samples, ready to be thinned to what shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// One value a sample; those that are not finite are not drawn.
    pub values: Arc<[f64]>,
    /// Where they lie.
    pub spacing: Spacing,
    envelope: Arc<Envelope>,
}

impl Samples {
    /// The samples of a series.
    pub fn new(values: impl Into<Arc<[f64]>>, spacing: Spacing) -> Self {
        let values = values.into();
        let envelope = Arc::new(Envelope::new(&values));
        Self { values, spacing, envelope }
    }

    /// Smallest and largest finite value.
    pub fn range(&self) -> Option<(f64, f64)> {
        self.envelope.range()
    }

    /// The sample nearest to an abscissa, if any lies within half an interval.
    pub fn nearest(&self, abscissa: f64) -> Option<usize> {
        let position = ((abscissa - self.spacing.start) / self.spacing.interval).round();
        (position >= 0.0 && position < self.values.len() as f64).then_some(position as usize)
    }

    /// What shows of them in a stretch of the abscissa on so many columns of pixels.
    pub fn thinned(&self, visible: RangeInclusive<f64>, columns: usize, out: &mut Vec<[f64; 2]>) {
        self.envelope.points(&self.values, self.spacing, visible, columns, out);
    }
}

/// Points in the order in which a line joins them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    /// The points.
    pub points: Arc<[[f64; 2]]>,
    /// Whether no abscissa lies before that of the point before.
    rising: bool,
}

impl Points {
    /// Pairs of an abscissa and an ordinate.
    pub fn new(points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let points: Arc<[[f64; 2]]> = points.into_iter().collect();
        let rising = points.is_sorted_by(|a, b| a[0] <= b[0]);
        Self { points, rising }
    }

    /// The same of two series.
    pub fn of(x: &[f64], y: &[f64]) -> Self {
        Self::new(x.iter().zip(y).map(|(x, y)| [*x, *y]))
    }

    /// Whether the line never runs back.
    pub fn is_rising(&self) -> bool {
        self.rising
    }

    /// The point nearest to an abscissa of a line that never runs back.
    pub fn nearest(&self, abscissa: f64) -> Option<[f64; 2]> {
        let after = self.points.partition_point(|p| p[0] <= abscissa);
        let near = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|k| self.points.get(k));
        let distance = |p: &&[f64; 2]| (p[0] - abscissa).abs();
        near.min_by(|a, b| distance(a).total_cmp(&distance(b))).copied()
    }
}

/// What stands out in a panel without being data.
#[derive(Clone, Debug, PartialEq)]
pub enum Guide {
    /// A horizontal line; its text stands in the legend.
    Level {
        /// Its colour and stroke.
        ink: Ink,
        /// The ordinate.
        at: f64,
        /// What it is.
        text: String,
    },
    /// A tint about zero up to a level on either side, beneath the data.
    Around {
        /// Its colour.
        ink: Ink,
        /// The ordinate.
        level: f64,
        /// What it is.
        text: String,
    },
    /// A vertical line; its text stands beside it.
    At {
        /// Its colour and stroke.
        ink: Ink,
        /// The abscissa.
        at: f64,
        /// What it is.
        text: String,
    },
    /// Tinted stretches of the abscissa; the text stands in the legend.
    Stretches {
        /// The tint.
        tint: Tint,
        /// From and to.
        stretches: Vec<(f64, f64)>,
        /// What they are; empty: they are named elsewhere.
        text: String,
    },
    /// A place that is marked.
    Sign {
        /// How it looks.
        sign: MarkerShape,
        /// The place.
        at: [f64; 2],
    },
}

/// How a marked place looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkerShape {
    /// A circle.
    Circle,
    /// A cross.
    Cross,
    /// A square on its corner.
    Diamond,
}

/// An entry of a legend.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LegendEntry {
    /// Its ink.
    pub ink: Ink,
    /// What is drawn in it.
    pub name: String,
    /// How it is drawn.
    pub mark: KeyMark,
}

/// What stands for a layer in a legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyMark {
    /// A piece of line.
    Line,
    /// A dot.
    Dot,
    /// A tinted or outlined patch.
    Patch,
}

impl LegendEntry {
    /// A line's key.
    pub fn line(ink: Ink, name: impl Into<String>) -> Self {
        Self { ink, name: name.into(), mark: KeyMark::Line }
    }
}

impl PanelRow {
    /// Panels beside each other.
    pub fn new(panels: Vec<Panel>, share: f64) -> Self {
        Self { panels, share, one_of: None }
    }
}

impl Layer {
    /// A layer that has a name and that the range is fitted to.
    pub fn new(ink: Ink, name: impl Into<String>, shape: Shape) -> Self {
        Self { ink, name: name.into(), shape, part: LayerRole::Leads, width: None }
    }

    /// That plays another part.
    #[must_use]
    pub fn playing(self, part: LayerRole) -> Self {
        Self { part, ..self }
    }

    /// Of another width, points.
    #[must_use]
    pub fn wide(self, width: f32) -> Self {
        Self { width: Some(width), ..self }
    }

    /// Width of its line, points.
    pub fn width(&self) -> f32 {
        self.width.unwrap_or_else(|| self.ink.width())
    }

    /// The layer's value at the sample or point nearest to an abscissa; none of what is not read out.
    pub fn value_at(&self, abscissa: f64) -> Option<f64> {
        if self.name.is_empty() || self.part == LayerRole::Ghost {
            return None;
        }
        match &self.shape {
            Shape::Samples(samples) => samples.nearest(abscissa).map(|k| samples.values[k]),
            Shape::Line(points) if points.rising => points.nearest(abscissa).map(|p| p[1]),
            _ => None,
        }
        .filter(|v| v.is_finite())
    }

    /// Whether it has no samples to draw.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        matches!(&self.shape, Shape::Samples(s) if s.values.is_empty())
    }

    /// Smallest and largest ordinate.
    fn range(&self) -> Option<(f64, f64)> {
        let of = |values: &mut dyn Iterator<Item = f64>| {
            let ends = values.filter(|v| v.is_finite()).map(|v| (v, v));
            ends.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
        };
        match &self.shape {
            Shape::Samples(samples) => samples.range(),
            Shape::Tube(centre, half) => {
                let ((low, high), widest) = (centre.range()?, half.range()?.1);
                // A band far wider than what it is about would flatten it; half of it tells as much.
                let widest = widest.min(2.0 * high.abs().max(low.abs()));
                Some((low - widest, high + widest))
            }
            Shape::Line(p) | Shape::Dots(p) | Shape::Marks(p) => of(&mut p.points.iter().map(|p| p[1])),
            Shape::Errors(spans) | Shape::Band(spans) => of(&mut spans.iter().flat_map(|s| [s[1], s[2]])),
            Shape::Bars { bars, .. } => of(&mut bars.iter().map(|b| b.height)),
            Shape::Cells(_) => None,
        }
    }
}

/// How far what follows may widen the range beyond what leads, as a share of that.
const WIDENED: f64 = 0.5;

/// Decades shown beneath the largest value of a logarithmic panel that is fitted to its curves.
const DECADES: f64 = 4.0;

/// A level so many times as high as all curves would flatten them: it does not count.
const TOO_HIGH: f64 = 4.0;

impl Panel {
    /// A panel without anything in it.
    pub fn new(id: &'static str, x: Axis, y: Axis) -> Self {
        Self { id, x, y, ..Self::default() }
    }

    /// The keys above it, each once: named layers, levels.
    pub fn keys(&self) -> Vec<LegendEntry> {
        let mut keys: Vec<LegendEntry> = Vec::new();
        for layer in self.layers.iter().filter(|l| !l.name.is_empty() && !l.is_empty()) {
            let mark = match layer.shape {
                Shape::Samples(_) | Shape::Line(_) => KeyMark::Line,
                Shape::Dots(_) | Shape::Marks(_) => KeyMark::Dot,
                _ => KeyMark::Patch,
            };
            let key = LegendEntry { ink: layer.ink, name: layer.name.clone(), mark };
            if !keys.contains(&key) {
                keys.push(key);
            }
        }
        // What is beneath is told behind.
        keys.sort_by_key(|key| key.mark == KeyMark::Patch);
        keys.extend(self.guides.iter().filter_map(|guide| match guide {
            Guide::Level { ink, text, .. } | Guide::Around { ink, text, .. } if !text.is_empty() => {
                Some(LegendEntry::line(*ink, text.clone()))
            }
            _ => None,
        }));
        keys
    }

    /// Range of the ordinate, as coordinates, where some inks are hidden.
    pub fn shown_y(&self, hidden: &BTreeSet<Ink>) -> (f64, f64) {
        if self.fit == Fit::Given {
            return self.y.range;
        }
        let ranges = |leads: bool| {
            let counted =
                self.layers.iter().filter(|l| (l.part == LayerRole::Leads) == leads && !hidden.contains(&l.ink));
            counted.filter_map(Layer::range).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
        };
        let level = self.guides.iter().find_map(|guide| match guide {
            Guide::Level { ink, at, .. } if !hidden.contains(ink) => Some((*at, false)),
            Guide::Around { ink, level, .. } if !hidden.contains(ink) => Some((*level, true)),
            _ => None,
        });
        let (mut low, mut high) = match (ranges(true), ranges(false)) {
            (Some(lead), Some(other)) => {
                let extra = WIDENED * (lead.1 - lead.0);
                (lead.0.min(other.0.max(lead.0 - extra)), lead.1.max(other.1.min(lead.1 + extra)))
            }
            (Some(one), None) | (None, Some(one)) => one,
            (None, None) => (0.0, level.map_or(1.0, |l| l.0)),
        };
        if let Some((level, both)) = level.filter(|l| l.0 <= TOO_HIGH * high.max(-low)) {
            high = high.max(1.15 * level);
            low = if both { low.min(-1.15 * level) } else { low };
        }
        let magnitudes = if let Fit::Magnitudes(most) = self.fit {
            (low, high) = (0.0, high.min(most));
            true
        } else {
            false
        };
        if self.y.logarithmic {
            let top = if high > 0.0 { high.log10() } else { 0.0 };
            return (top - DECADES, top + 0.1);
        }
        let span = high - low;
        let flat = span.is_nan() || span <= 1e-12 * high.abs().max(low.abs());
        let margin = match (flat, high == 0.0) {
            (false, _) => 0.06 * span,
            (true, true) => 1.0,
            (true, false) => 0.2 * high.abs(),
        };
        (if magnitudes { 0.0 } else { low - margin }, high + margin)
    }

    /// Fits the ordinate's range to the curves.
    #[must_use]
    pub fn fitted(mut self) -> Self {
        self.y.range = self.shown_y(&BTreeSet::new());
        self
    }

    /// Its numbers with their heads, samples within a stretch of the abscissa only.
    fn numbers(&self, visible: &RangeInclusive<f64>) -> Vec<(String, Vec<f64>)> {
        if !self.columns.is_empty() {
            return self.columns.clone();
        }
        let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
        for layer in self.layers.iter().filter(|l| l.part != LayerRole::Ghost) {
            let head = |axis: &Axis| {
                let symbol = format!("{} {}", axis.symbol, layer.name);
                Scale::plain(axis.unit.as_str()).axis(symbol.trim())
            };
            match &layer.shape {
                Shape::Samples(samples) => {
                    let shown = |k: &usize| visible.contains(&samples.spacing.at(*k));
                    let shown: Vec<usize> = (0..samples.values.len()).filter(shown).collect();
                    let (x, y) = (self.x.header(), head(&self.y));
                    columns.push((x, shown.iter().map(|k| samples.spacing.at(*k)).collect()));
                    columns.push((y, shown.iter().map(|k| samples.values[*k]).collect()));
                }
                Shape::Line(p) | Shape::Dots(p) | Shape::Marks(p) => {
                    columns.push((head(&self.x), p.points.iter().map(|p| p[0]).collect()));
                    columns.push((head(&self.y), p.points.iter().map(|p| p[1]).collect()));
                }
                _ => {}
            }
        }
        columns
    }
}

impl Figure {
    /// A figure of panels that stand below each other, with their shares of its height.
    pub fn stacked(panels: impl IntoIterator<Item = (Panel, f64)>, height: f64, caption: impl Into<String>) -> Self {
        let rows = panels.into_iter().map(|(panel, share)| PanelRow::new(vec![panel], share)).collect();
        Self { rows, legend: Vec::new(), caption: caption.into(), height }
    }

    /// Every panel.
    pub fn panels(&self) -> impl Iterator<Item = &Panel> {
        self.rows.iter().flat_map(|row| &row.panels)
    }

    /// Every panel, to be changed.
    pub fn panels_mut(&mut self) -> impl Iterator<Item = &mut Panel> {
        self.rows.iter_mut().flat_map(|row| &mut row.panels)
    }

    /// The numbers of a panel, and of those that share its abscissa, as CSV: what lies within `visible` of long series.
    pub fn table(&self, panel: &Panel, visible: &RangeInclusive<f64>) -> String {
        let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
        let together = |other: &&Panel| other.id == panel.id || other.x.link.is_some() && other.x.link == panel.x.link;
        for column in self.panels().filter(together).flat_map(|p| p.numbers(visible)) {
            // One abscissa does for all that share it.
            if !columns.iter().any(|c| c.0 == column.0 && column.1.iter().zip(&c.1).all(|(a, b)| a == b)) {
                columns.push(column);
            } else if let Some(longer) = columns.iter_mut().find(|c| c.0 == column.0 && c.1.len() < column.1.len()) {
                longer.1 = column.1;
            }
        }
        csv(&columns)
    }

    /// The same figure as it is seen: zoomed, given as ranges of coordinates by panel, and with hidden inks left out.
    #[must_use]
    pub fn as_seen(mut self, hidden: &BTreeSet<Ink>, zoom: impl Fn(&Panel) -> Option<[(f64, f64); 2]>) -> Self {
        self.legend.retain(|key| !hidden.contains(&key.ink));
        for panel in self.panels_mut() {
            panel.y.range = panel.shown_y(hidden);
            panel.fit = Fit::Given;
            if let Some([x, y]) = zoom(panel) {
                (panel.x.range, panel.y.range) = (x, y);
            }
            panel.layers.retain(|layer| !hidden.contains(&layer.ink));
            panel.guides.retain(|guide| match guide {
                Guide::Level { ink, .. } | Guide::Around { ink, .. } | Guide::At { ink, .. } => !hidden.contains(ink),
                Guide::Stretches { .. } | Guide::Sign { .. } => true,
            });
        }
        self
    }

    /// The same figure with a stretch of the abscissa drawn out at the right of every row of one panel.
    #[must_use]
    pub fn with_detail(mut self, stretch: (f64, f64)) -> Self {
        for row in self.rows.iter_mut().filter(|row| row.panels.len() == 1) {
            row.panels.extend(row.panels.first().cloned());
            if let [whole, detail] = row.panels.as_mut_slice() {
                let stretches = vec![stretch];
                whole.guides.insert(0, Guide::Stretches { tint: Tint::Detail, stretches, text: String::new() });
                detail.x.range = stretch;
                detail.title.clear();
            }
        }
        self
    }
}

/// Columns with their heads as CSV; cells that do not exist are empty.
pub fn csv(columns: &[(String, Vec<f64>)]) -> String {
    let quoted =
        |h: &String| if h.contains([',', '"']) { format!("\"{}\"", h.replace('"', "\"\"")) } else { h.clone() };
    let mut text = columns.iter().map(|(head, _)| quoted(head)).collect::<Vec<_>>().join(",");
    text.push('\n');
    for row in 0..columns.iter().map(|(_, values)| values.len()).max().unwrap_or(0) {
        for (k, (_, values)) in columns.iter().enumerate() {
            if k > 0 {
                text.push(',');
            }
            if let Some(value) = values.get(row).filter(|v| v.is_finite()) {
                // Writing to a string cannot fail.
                let _ = write!(text, "{value}");
            }
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(values: &[f64]) -> Shape {
        Shape::Samples(Samples::new(values, Spacing { start: 0.0, interval: 0.5 }))
    }

    fn panel(y: Axis) -> Panel {
        Panel::new("p", Axis::linear("t", "s", (0.0, 1.0)).linked("time"), y)
    }

    #[test]
    fn what_follows_widens_the_range_only_so_far() {
        let mut one = panel(Axis::linear("x", "m", (0.0, 1.0)));
        one.fit = Fit::Curves;
        one.layers.push(Layer::new(Ink::Measured, "measured", samples(&[-1.0, 1.0])));
        one.layers.push(Layer::new(Ink::Identified, "identified", samples(&[0.0, 1e9])).playing(LayerRole::Follows));
        let (low, high) = one.shown_y(&BTreeSet::new());
        assert!((-1.3..-1.0).contains(&low) && (2.0..2.3).contains(&high), "{low} {high}");
        let (_, high) = one.shown_y(&BTreeSet::from([Ink::Measured]));
        assert!(high > 1e9, "alone it is shown whole");
    }

    #[test]
    fn tables_join_what_shares_its_abscissa_and_leave_out_ghosts() {
        let mut upper = panel(Axis::linear("x", "m", (0.0, 1.0)));
        upper.layers.push(Layer::new(Ink::Measured, "measured", samples(&[1.0, 2.0, 3.0])));
        upper.layers.push(Layer::new(Ink::Ghost, "before", samples(&[9.0])).playing(LayerRole::Ghost));
        let mut lower = Panel { id: "q", ..panel(Axis::linear("E", "m", (0.0, 1.0))) };
        lower.layers.push(Layer::new(Ink::Error, "error", samples(&[0.5])));
        let figure = Figure::stacked([(upper, 1.0), (lower, 1.0)], 100.0, "");
        let first = figure.panels().next().unwrap();
        assert_eq!(
            figure.table(first, &(0.0..=0.6)),
            "t (s),x measured (m),E error (m)\n0,1,0.5\n0.5,2,\n",
            "one column of time, as long as the longest"
        );
    }

    #[test]
    fn csv_has_one_line_a_row_and_leaves_out_what_is_not_there() {
        let columns = [("t (s)".to_owned(), vec![0.0, 0.1, 0.2]), ("x, \"raw\"".to_owned(), vec![1.5, f64::NAN])];
        assert_eq!(csv(&columns), "t (s),\"x, \"\"raw\"\"\"\n0,1.5\n0.1,\n0.2,\n");
    }

    #[test]
    fn the_nearest_point_of_a_step_is_the_one_on_its_side() {
        let step = Points::new([[0.0, 1.0], [1.0, 1.0], [1.0, 5.0], [2.0, 5.0]]);
        assert!(step.is_rising());
        assert_eq!(step.nearest(0.9).map(|p| p[1]), Some(1.0));
        assert_eq!(step.nearest(1.1).map(|p| p[1]), Some(5.0));
        assert!(!Points::new([[1.0, 0.0], [0.0, 0.0]]).is_rising());
    }
}
