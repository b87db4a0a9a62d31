//! A view's picture as data: graphs of points, curves and bands, made once for an outcome and drawn every frame.

use egui_plot::PlotPoint;

use crate::app::plot::palette::Ink;
use crate::app::plot::units::Scale;
use sindyscope_report::diagram::Cells;
use sindyscope_values::format::shown::ShownUnits;

/// What a view shows.
#[derive(Clone, Debug)]
pub(super) enum Figure {
    /// Why there is nothing to draw.
    Note(String),
    /// Graphs, arranged by the view.
    Graphs(Vec<Graph>),
}

/// One plot.
#[derive(Clone, Debug)]
pub(super) struct Graph {
    /// Name that is unique in its view.
    pub(super) id: &'static str,
    /// What is shown, in a few words above it.
    pub(super) caption: String,
    pub(super) x: Axis,
    pub(super) y: Axis,
    /// What is drawn, the hindmost first.
    pub(super) layers: Vec<(Ink, Shape)>,
    /// A map behind everything, with the name and unit of its values.
    pub(super) map: Option<(Cells, String, String)>,
    /// Its numbers: headers and columns.
    pub(super) columns: Vec<(String, Vec<f64>)>,
    /// Share of something that would be 0.05 by chance; large ones are marked where one chooses among graphs.
    pub(super) outside: Option<f64>,
}

/// An axis; on a logarithmic one coordinates are log₁₀ of values.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) symbol: String,
    pub(super) unit: String,
    pub(super) log: bool,
    /// Coordinates shown at first.
    pub(super) range: (f64, f64),
}

/// What is drawn in one ink.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    Line(Vec<PlotPoint>),
    /// Many small points.
    Dots(Vec<PlotPoint>),
    /// A few points, each of which counts.
    Marks(Vec<PlotPoint>),
    /// Abscissa, lower and upper end.
    Errors(Vec<[f64; 3]>),
    /// A tint between two curves: abscissae, lower, upper.
    Band([Vec<f64>; 3]),
    /// Edges and heights.
    Bars(Vec<f64>, Vec<f64>),
    /// Horizontal lines.
    Levels(Vec<f64>),
}

impl Axis {
    pub(super) fn linear(symbol: impl Into<String>, unit: impl Into<String>, range: (f64, f64)) -> Self {
        Self { symbol: symbol.into(), unit: unit.into(), log: false, range: sound(range) }
    }

    pub(super) fn log(symbol: impl Into<String>, unit: impl Into<String>, range: (f64, f64)) -> Self {
        Self { symbol: symbol.into(), unit: unit.into(), log: true, range: sound(range) }
    }

    /// How values are shown.
    pub(super) fn scale(&self, units: &ShownUnits) -> Scale {
        let largest = if self.log { 0.0 } else { self.range.0.abs().max(self.range.1.abs()) };
        units.scale(largest, &self.unit)
    }

    /// The value at a coordinate.
    pub(super) fn text(&self, coordinate: f64, units: &ShownUnits) -> String {
        let value = if self.log { 10f64.powf(coordinate) } else { coordinate };
        let scale = if self.log { units.scale(value, &self.unit) } else { self.scale(units) };
        format!("{} {}", self.symbol, scale.format(value, 4))
    }

    /// The head of a column of its values.
    pub(super) fn header(&self) -> String {
        Scale::plain(self.unit.as_str()).axis(&self.symbol)
    }
}

/// A range that a plot can show.
fn sound((low, high): (f64, f64)) -> (f64, f64) {
    if low < high && (high - low).is_finite() { (low, high) } else { (-1.0, 1.0) }
}

/// The range of values with a margin; ±1 of nothing.
pub(super) fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
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
pub(super) fn lead(measured: impl Iterator<Item = f64>, identified: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = extent(measured);
    let room = 0.35 * (high - low);
    let (least, most) = extent(identified.filter(|v| (low - room..=high + room).contains(v)).chain([low, high]));
    (least.max(low - room), most.min(high + room))
}

pub(super) fn points<'a>(x: impl IntoIterator<Item = &'a f64>, y: impl IntoIterator<Item = &'a f64>) -> Vec<PlotPoint> {
    let both = x.into_iter().zip(y).filter(|(x, y)| x.is_finite() && y.is_finite());
    both.map(|(x, y)| PlotPoint::new(*x, *y)).collect()
}
