//! The picture of a series: each parameter over the quantity, with its trend.

use super::{ParameterSeries, Series, SeriesPoint, Trend};
use sindyscope_report::figure::{Axis, Figure, Layer, Panel, Points, Shape};
use sindyscope_report::palette::Ink;

/// Names of the panels, and with that the most parameters that are drawn.
const PANELS: [&str; 8] = ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth"];
/// Points of a trend's band, which bends.
const BAND: usize = 60;
/// Height of a panel, points.
const HEIGHT: f64 = 110.0;
/// Standard errors of a 95 % band.
const TWO_SIDED: f64 = 1.96;

impl Series {
    /// The first eight parameters that most records have, each over the series: values with their standard errors, the trend with its 95 %
    /// band, and the records that do not fit.
    pub fn figure(&self) -> Figure {
        let mut shown: Vec<&ParameterSeries> = self.parameters.iter().collect();
        shown.sort_by_key(|p| std::cmp::Reverse(p.points.len()));
        let over = self.over.as_deref().unwrap_or("place in the table");
        let ends = |of: &dyn Fn(&SeriesPoint) -> [f64; 2], points: &[SeriesPoint]| {
            let (low, high) =
                points.iter().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), [a, b]| (l.min(a), h.max(b)));
            let margin = 0.06 * (high - low).max(1e-9 * high.abs()).max(f64::MIN_POSITIVE);
            (low - margin, high + margin)
        };
        let all: Vec<SeriesPoint> = shown.iter().flat_map(|p| p.points.iter().cloned()).collect();
        let across = if all.is_empty() { (0.0, 1.0) } else { ends(&|p| [p.at; 2], &all) };
        let panel = |(parameter, id): (&&ParameterSeries, &&'static str)| {
            let interval = |p: &SeriesPoint| {
                let error = p.std_error.unwrap_or(0.0);
                [p.value - error, p.value + error]
            };
            let y = Axis::linear("", "", ends(&interval, &parameter.points));
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
                    panel.layers.push(Layer::new(ink, name, Shape::Marks(Points::new(points))));
                }
            }
            (panel, 1.0)
        };
        let panels: Vec<(Panel, f64)> = shown.iter().zip(&PANELS).map(panel).collect();
        let height = HEIGHT * panels.len().max(1) as f64;
        Figure::stacked(panels, height, format!("Identified parameters of {} records over {over}.", self.records))
    }
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
