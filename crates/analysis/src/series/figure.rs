//! The picture of a series: each parameter over the quantity, with its trend.

use super::{ParameterSeries, Series, SeriesPoint, Trend};
use sindyscope_report::figure::{Axis, Figure, Guide, Layer, MarkerShape, Panel, Points, Shape};
use sindyscope_report::palette::Ink;

/// Names of the panels, and with that the most parameters that are drawn.
const PANELS: [&str; 8] = ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth"];
/// Points of a trend's band, which bends.
const BAND: usize = 60;
/// Panels of a figure that a page of a report has room for beside its caption.
const PANELS_A_PAGE: usize = 4;
/// Room left at both ends of an axis, as a share of what is drawn.
const MARGIN: f64 = 0.06;
/// Height of a panel, points.
const HEIGHT: f64 = 110.0;
/// Standard errors of a 95 % band.
const TWO_SIDED: f64 = 1.96;

impl Series {
    /// The first eight parameters that most records have, or the one of this name alone, each over the series: values with their standard
    /// errors, the trend with its 95 % band, and the records that do not fit.
    pub fn figure(&self, only: Option<&str>) -> Figure {
        let wanted = |p: &&ParameterSeries| only.is_none_or(|name| p.name == name);
        let shown: Vec<&ParameterSeries> = self.by_records().into_iter().filter(wanted).take(PANELS.len()).collect();
        self.figure_of(&shown)
    }

    /// Every parameter, those that most records have first, in figures of as many panels as a page has room for.
    pub(super) fn figures(&self) -> Vec<Figure> {
        self.by_records().chunks(PANELS_A_PAGE).map(|shown| self.figure_of(shown)).collect()
    }

    fn by_records(&self) -> Vec<&ParameterSeries> {
        let mut all: Vec<&ParameterSeries> = self.parameters.iter().collect();
        all.sort_by_key(|p| std::cmp::Reverse(p.points.len()));
        all
    }

    fn figure_of(&self, shown: &[&ParameterSeries]) -> Figure {
        let over = self.abscissa();
        let all = self.parameters.iter().flat_map(|p| &p.points).map(|p| [p.at; 2]);
        let across = range(all).unwrap_or((0.0, 1.0));
        let panels: Vec<(Panel, f64)> =
            shown.iter().zip(PANELS).map(|(parameter, id)| (panel(parameter, id, over, across), 1.0)).collect();
        let height = HEIGHT * panels.len().max(1) as f64;
        Figure::stacked(panels, height, format!("Identified parameters of {} records over {over}.", self.records))
    }
}

fn panel(parameter: &ParameterSeries, id: &'static str, over: &str, across: (f64, f64)) -> Panel {
    let interval = |p: &SeriesPoint| {
        let error = p.std_error.unwrap_or(0.0);
        [p.value - error, p.value + error]
    };
    let y = Axis::linear("", "", range(parameter.points.iter().map(interval)).unwrap_or((0.0, 1.0)));
    let mut panel = Panel::new(id, Axis::linear(over, "", across), y);
    panel.title.clone_from(&parameter.name);
    panel.layers = parameter.trend.iter().flat_map(|t| trend_layers(t, across)).collect();
    let bars = parameter.points.iter().filter(|p| p.std_error.is_some());
    let bars = bars.map(|p| [p.at, interval(p)[0], interval(p)[1]]).collect();
    panel.layers.push(Layer::new(Ink::Measured, "", Shape::Errors(bars)));
    for (ink, name, odd) in [(Ink::Measured, "record", false), (Ink::Error, "does not fit", true)] {
        let points: Vec<[f64; 2]> =
            parameter.points.iter().filter(|p| p.outlies == odd).map(|p| [p.at, p.value]).collect();
        if !points.is_empty() {
            let signs = points.iter().filter(|_| odd).map(|at| Guide::Sign { sign: MarkerShape::Circle, at: *at });
            panel.guides.extend(signs);
            panel.layers.push(Layer::new(ink, name, Shape::Marks(Points::new(points))));
        }
    }
    panel
}

/// From the least to the greatest end of intervals, with a margin; none of none.
fn range(intervals: impl Iterator<Item = [f64; 2]>) -> Option<(f64, f64)> {
    let (low, high) = intervals.map(|[low, high]| (low, high)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let margin = MARGIN * (high - low).max(1e-9 * high.abs()).max(f64::MIN_POSITIVE);
    Some((low - margin, high + margin))
}

fn trend_layers(trend: &Trend, (low, high): (f64, f64)) -> [Layer; 2] {
    let place = |k: usize| low + (high - low) * k as f64 / (BAND - 1) as f64;
    // Without a slope the mean is what the records share.
    let value = |t: f64| if trend.told() { trend.at(t) } else { trend.level };
    let error = |t: f64| if trend.told() { trend.error_at(t) } else { trend.level_error };
    let band = (0..BAND).map(|k| {
        let (t, half) = (place(k), TWO_SIDED * error(place(k)));
        [t, value(t) - half, value(t) + half]
    });
    let name = if trend.told() { "trend" } else { "mean" };
    let line = Points::new([[low, value(low)], [high, value(high)]]);
    [Layer::new(Ink::Identified, "", Shape::Band(band.collect())), Layer::new(Ink::Identified, name, Shape::Line(line))]
}
