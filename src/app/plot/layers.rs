//! Layers of a panel as the plot draws them, thinned to what shows.

use std::sync::Arc;

use egui::{Color32, Mesh, Painter, Rect, Stroke, pos2};
use egui_plot::{
    Bar, BarChart, FilledArea, HLine, Line, PlotPoint, PlotPoints, PlotTransform, PlotUi, Points, Span, VLine,
};

use super::look::Look;
use super::palette::{self, Ink, Painted as _};
use sindyscope_report::figure::thin::{self, Raster};
use sindyscope_report::figure::{Axis, Cells, Guide, Layer, LayerRole, Panel, Samples, Shape};
use sindyscope_report::palette::unsure;

/// Points of a curve in loops that are drawn at sixty frames a second.
const MOST_POINTS: usize = 20_000;
/// Points of a line that are drawn without being thinned.
const FEW: usize = 4000;
/// Distance of neighbouring samples on the screen below which an error is a band, points, and how strong that is drawn.
const MERGED: f64 = 0.6;
const BAND: f32 = 0.32;
/// Distance of neighbouring samples on the screen from which on each is marked, points.
const SAMPLES_MARKED: f64 = 7.0;

/// What a layer was made of: as long as it is held, its address is not given to another.
#[derive(Clone, Debug)]
enum LayerSource {
    Values(Arc<[f64]>),
    Points(Arc<[[f64; 2]]>),
}

impl LayerSource {
    fn of(layer: &Layer) -> Option<Self> {
        match &layer.shape {
            Shape::Samples(samples) | Shape::Tube(samples, _) => Some(Self::Values(Arc::clone(&samples.values))),
            Shape::Line(p) | Shape::Dots(p) | Shape::Marks(p) => Some(Self::Points(Arc::clone(&p.points))),
            _ => None,
        }
    }

    fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Values(a), Self::Values(b)) => Arc::ptr_eq(a, b),
            (Self::Points(a), Self::Points(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

/// Points of a layer as they were last asked for, for a view and for what lies around it: a view that is moved finds them ready.
#[derive(Clone, Debug, Default)]
pub(super) struct Drawn {
    source: Option<LayerSource>,
    logarithmic: [bool; 2],
    /// What they cover; none: all there is.
    covers: Option<Raster>,
    /// Coordinates; the line pauses where one is not finite.
    points: Vec<PlotPoint>,
}

impl Drawn {
    /// Makes the points ready that show within bounds on so many pixels.
    pub(super) fn prepare(&mut self, layer: &Layer, panel: &Panel, bounds: [(f64, f64); 2], pixels: [f64; 2]) {
        let Some(source) = LayerSource::of(layer) else { return };
        let logarithmic = [panel.x.logarithmic, panel.y.logarithmic];
        let same = self.source.as_ref().is_some_and(|s| s.is(&source)) && self.logarithmic == logarithmic;
        let scale: [f64; 2] = std::array::from_fn(|k| pixels[k] / (bounds[k].1 - bounds[k].0));
        // A series along the abscissa is thinned along that alone.
        let along = match &layer.shape {
            Shape::Line(p) => p.is_rising(),
            _ => true,
        };
        let axes = if along { 0..1 } else { 0..2 };
        let covered = |covers: &Raster| {
            axes.clone().all(|k| {
                covers.min[k] <= bounds[k].0
                    && bounds[k].1 <= covers.max[k]
                    && (0.8..1.25).contains(&(scale[k] / covers.scale[k]))
            })
        };
        if same && self.covers.as_ref().is_none_or(covered) {
            return;
        }
        if !scale.iter().all(|s| s.is_finite() && *s > 0.0) {
            return;
        }
        (self.source, self.logarithmic) = (Some(source), logarithmic);
        let margin: [f64; 2] = std::array::from_fn(|k| 0.4 * (bounds[k].1 - bounds[k].0));
        let raster = Raster {
            min: std::array::from_fn(|k| bounds[k].0 - margin[k]),
            max: std::array::from_fn(|k| bounds[k].1 + margin[k]),
            scale,
        };
        let (points, whole) = thinned(layer, panel, raster);
        self.covers = (!whole).then_some(raster);
        self.points.clear();
        self.points.extend(points.into_iter().map(|[x, y]| PlotPoint::new(x, y)));
    }
}

/// Coordinates of what shows of a layer, and whether that is all there is.
fn thinned(layer: &Layer, panel: &Panel, raster: Raster) -> (Vec<[f64; 2]>, bool) {
    let coordinates = |p: &[f64; 2]| [panel.x.coordinate(p[0]), panel.y.coordinate(p[1])];
    let columns = (raster.scale[0] * (raster.max[0] - raster.min[0])) as usize;
    let mut out = Vec::new();
    match &layer.shape {
        Shape::Samples(samples) | Shape::Tube(samples, _) => {
            samples.thinned(raster.min[0]..=raster.max[0], columns, &mut out);
            for point in out.iter_mut().filter(|_| panel.y.logarithmic) {
                point[1] = panel.y.coordinate(point[1]);
            }
            (out, false)
        }
        Shape::Line(line) if line.points.len() > FEW => {
            let points = line.points.iter().map(coordinates);
            if line.is_rising() {
                thin::columns(points, raster.min[0]..=raster.max[0], columns, &mut out);
            } else {
                thin::loops(points, raster, MOST_POINTS, &mut out);
            }
            (out, false)
        }
        Shape::Line(p) | Shape::Dots(p) | Shape::Marks(p) => {
            let pause = |p: &[f64; 2]| if p[1].is_finite() { coordinates(p) } else { [f64::NAN; 2] };
            (p.points.iter().map(pause).collect(), true)
        }
        _ => (out, true),
    }
}

/// Draws guides and layers, the hindmost first.
pub(super) fn draw<'a>(
    plot: &mut PlotUi<'a>,
    panel: &'a Panel,
    y_axis: &Axis,
    drawn: &[&'a Drawn],
    look: &Look<'_>,
    dark: bool,
) {
    beneath(plot, panel, look, dark);
    for (layer, drawn) in panel.layers.iter().zip(drawn).filter(|(layer, _)| look.shows(layer.ink)) {
        let color = look.color(layer.ink, dark);
        match &layer.shape {
            Shape::Samples(samples) => draw_samples(plot, panel, (layer, samples, drawn), color, look),
            Shape::Line(_) => {
                let stroke = Stroke::new(layer.width(), color);
                for run in drawn.points.split(|p| !p.y.is_finite()) {
                    let line = Line::new("", PlotPoints::Borrowed(run)).stroke(stroke).style(layer.ink.style());
                    plot.line(line.allow_hover(false).allow_band(false));
                }
            }
            Shape::Dots(_) => {
                // Where many lie on each other the colour deepens.
                let faint = if drawn.points.len() > 400 { 0.45 } else { 0.8 };
                let radius = if drawn.points.len() > 80 && panel.fixed { 1.1 } else { 1.5 };
                let dots = Points::new("", PlotPoints::Borrowed(&drawn.points)).radius(radius);
                plot.points(dots.color(color.gamma_multiply(faint)).allow_hover(false));
            }
            Shape::Marks(_) => {
                let radius = if layer.ink == Ink::Measured { 4.0 } else { 2.6 };
                let marks = Points::new("", PlotPoints::Borrowed(&drawn.points)).radius(radius);
                plot.points(marks.color(color).allow_hover(false));
            }
            Shape::Tube(_, half) => {
                let centre = drawn.points.iter().filter(|p| p.y.is_finite());
                let width = |x: f64| half.nearest(x).map_or(0.0, |k| half.values[k]);
                band(plot, centre.map(|p| [p.x, p.y - width(p.x), p.y + width(p.x)]), color);
            }
            Shape::Band(spans) => {
                let place = |s: &[f64; 3]| [panel.x.coordinate(s[0]), y_axis.coordinate(s[1]), y_axis.coordinate(s[2])];
                band(plot, spans.iter().map(place), color);
            }
            Shape::Errors(errors) => {
                for [x, low, high] in errors {
                    let bar = vec![[*x, *low], [*x, *high]];
                    plot.line(Line::new("", bar).stroke(Stroke::new(1.2, color)).allow_hover(false));
                }
            }
            Shape::Bars { bars, hollow } => {
                let fill = color.gamma_multiply(match (hollow, bars.iter().any(|b| !b.text.is_empty())) {
                    (true, _) => 0.3,
                    (false, true) => 1.0,
                    (false, false) => 0.5,
                });
                let outline = if *hollow { Stroke::new(1.0, color) } else { Stroke::NONE };
                let bar = |b: &sindyscope_report::figure::PlotBar| {
                    Bar::new(0.5 * (b.from + b.to), b.height).width(b.to - b.from).fill(fill).stroke(outline)
                };
                plot.bar_chart(BarChart::new("", bars.iter().map(bar).collect()).allow_hover(false));
                for bar in bars.iter().filter(|b| !b.text.is_empty()) {
                    let text = egui::RichText::new(&bar.text).size(11.0);
                    let at = PlotPoint::new(0.5 * (bar.from + bar.to), bar.text_at);
                    let text = egui_plot::Text::new("", at, text).anchor(egui::Align2::CENTER_BOTTOM);
                    plot.text(text.allow_hover(false));
                }
            }
            // Drawn over the plot, as one mesh.
            Shape::Cells(_) => {}
        }
    }
    above(plot, panel, look, dark);
}

/// Tints, which lie beneath the data.
fn beneath(plot: &mut PlotUi<'_>, panel: &Panel, look: &Look<'_>, dark: bool) {
    for guide in &panel.guides {
        match guide {
            Guide::Stretches { tint, stretches, .. } => {
                for (from, to) in stretches {
                    plot.span(quiet(Span::new("", *from..=*to), palette::tint(*tint, dark)));
                }
            }
            Guide::Around { ink, level, .. } if look.shows(*ink) => {
                let color = look.color(*ink, dark);
                let span = quiet(Span::new("", -*level..=*level), color.gamma_multiply(0.14));
                plot.span(span.axis(egui_plot::Axis::Y));
                let stroke = Stroke::new(1.0, color.gamma_multiply(0.7));
                for at in [*level, -*level] {
                    plot.hline(HLine::new("", at).stroke(stroke).style(ink.style()).allow_hover(false));
                }
            }
            _ => {}
        }
    }
}

/// Lines that stand out from the data.
fn above(plot: &mut PlotUi<'_>, panel: &Panel, look: &Look<'_>, dark: bool) {
    for guide in &panel.guides {
        match guide {
            Guide::Level { ink, at, .. } if look.shows(*ink) => {
                let stroke = Stroke::new(ink.width(), look.color(*ink, dark));
                let line = HLine::new("", panel.y.coordinate(*at)).stroke(stroke);
                plot.hline(line.style(ink.style()).allow_hover(false));
            }
            Guide::At { ink, at, .. } if look.shows(*ink) => {
                let stroke = Stroke::new(ink.width(), look.color(*ink, dark));
                let line = VLine::new("", panel.x.coordinate(*at)).stroke(stroke);
                plot.vline(line.style(ink.style()).allow_hover(false));
            }
            _ => {}
        }
    }
}

fn draw_samples<'a>(
    plot: &mut PlotUi<'a>,
    panel: &Panel,
    (layer, samples, drawn): (&Layer, &Samples, &'a Drawn),
    color: Color32,
    look: &Look<'_>,
) {
    let apart = samples.spacing.interval * plot.transform().dpos_dvalue_x();
    let running = panel.layers.iter().any(|l| l.ink == Ink::ErrorRms) && look.shows(Ink::ErrorRms);
    let banded = layer.ink == Ink::Error && apart < MERGED && running;
    let color = if banded { color.gamma_multiply(BAND) } else { color };
    // Bands are drawn upright, so that a wide line loses its width on steep flanks; few enough points need none.
    let line = Line::new("", PlotPoints::Borrowed(&drawn.points)).stroke(Stroke::new(layer.width(), color));
    plot.line(line.style(layer.ink.style()).allow_band(false).allow_hover(false));
    if layer.part != LayerRole::Ghost && (apart > SAMPLES_MARKED || samples.values.len() == 1) {
        let radius = if layer.ink == Ink::Measured { 2.6 } else { 1.8 };
        plot.points(
            Points::new("", PlotPoints::Borrowed(&drawn.points)).radius(radius).color(color).allow_hover(false),
        );
    }
}

/// A span without a border.
fn quiet(span: Span, fill: Color32) -> Span {
    span.fill(fill).border(Stroke::new(0.0, fill))
}

/// A filled band between two curves.
fn band(plot: &mut PlotUi<'_>, spans: impl Iterator<Item = [f64; 3]>, color: Color32) {
    let (mut x, mut low, mut high) = (Vec::new(), Vec::new(), Vec::new());
    for [at, least, most] in spans.filter(|s| s.iter().all(|v| v.is_finite())) {
        x.push(at);
        low.push(least);
        high.push(most);
    }
    if x.len() > 1 {
        plot.add(FilledArea::new("", &x, &low, &high).fill_color(color.gamma_multiply(0.25)).allow_hover(false));
    }
}

/// Rectangles, coloured by their values.
pub(super) fn cells(painter: &Painter, cells: &Cells, transform: &PlotTransform, strength: f32, dark: bool) {
    let mut mesh = Mesh::default();
    let corner = |[x, y]: [f64; 2]| pos2(transform.position_from_point_x(x), transform.position_from_point_y(y));
    for (k, low, high) in cells.drawn() {
        let color = if cells.is_unsure(k) { unsure(dark) } else { cells.rgb(cells.share(k), dark) };
        let color = palette::rgb(color).gamma_multiply(strength);
        mesh.add_colored_rect(Rect::from_two_pos(corner(low), corner(high)), color);
    }
    painter.add(mesh);
}
