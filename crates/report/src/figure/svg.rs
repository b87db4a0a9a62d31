//! Figures as SVG: the painter of reports and of saved pictures.

use std::collections::HashMap;
use std::fmt::Write as _;

use super::style::{self, STEPS, class};
use super::{
    Axis, Cells, Colours, Figure, Guide, KeyMark, Layer, LegendEntry, MarkerShape, Panel, PanelRow, Points, Shape, thin,
};
use crate::canvas::{Anchor, Svg};
use crate::palette::Ink;
use sindyscope_values::format::number::significant;
use sindyscope_values::format::shown::ShownUnits;

/// The room that a figure is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extent {
    /// Width, points.
    pub(crate) width: f64,
    /// Height, points; none: as high as the figure is by itself.
    pub(crate) height: Option<f64>,
}

/// The width of a page's text.
pub(crate) const WIDTH: f64 = 700.0;

/// Distance of figures beside each other.
pub(crate) const GUTTER: f64 = 14.0;

impl Extent {
    /// A figure as wide as the page's text.
    pub(crate) const PAGE: Self = Self { width: WIDTH, height: None };
    /// One of two figures beside each other.
    pub(crate) const HALF: Self = Self { width: 0.5 * (WIDTH - GUTTER), height: None };
}

/// A figure that was drawn: its pieces, and width and height.
#[derive(Clone, Debug)]
pub(crate) struct Drawing {
    pub(crate) svg: Svg,
    pub(crate) size: (f64, f64),
    pub(crate) caption: String,
}

/// Room below a panel for the labels of its marks and of its axis.
const BELOW: f64 = 34.0;
/// Further room for each further line of its marks' labels.
const LINE: f64 = 12.0;
/// Room left of a panel for the same.
const LEFT: f64 = 54.0;
/// Room right of a panel.
const RIGHT: f64 = 8.0;
/// Room right of a panel of cells for the scale of its colours.
const SCALE: f64 = 66.0;
/// Distance of panels that share an axis.
const GAP: f64 = 10.0;
/// Height of a line of keys.
const KEYS: f64 = 16.0;
/// Width of a letter of a tick or a key in any proportional font.
const LETTER: f64 = 5.6;
/// Length of the piece of line that stands for a curve.
const SAMPLE: f64 = 22.0;
/// Room that labels need along the abscissa and the ordinate, in steps of eight points.
const SPACING: (f64, f64) = (8.0, 3.5);
/// Least height of a panel.
const LEAST: f64 = 24.0;
/// Side of a dot.
const DOT: f64 = 2.2;
/// Points of a scatter that are drawn: more would only hide each other, and swell the document.
const DOTS: usize = 700;
/// Points of a line that runs in loops.
const LOOPS: usize = 6_000;
/// Most points of a line that are drawn without being thinned.
const FEW: usize = 1500;
/// Share of the width that the detail beside a whole record takes.
const DETAIL: f64 = 0.4;
/// Width from which on a whole record and its detail have room beside each other.
const TWO_COLUMNS: f64 = 450.0;

/// Where a panel stands: its frame, and which of its axes are labelled.
struct PanelPlace {
    at: (f64, f64),
    size: (f64, f64),
    x_labels: bool,
    y_labels: bool,
}

/// Draws a figure into the room that it is given.
pub(crate) fn draw(figure: &Figure, extent: &Extent, units: &ShownUnits) -> Drawing {
    let mut svg = Svg::default();
    let legend = Keys::of(&figure.legend, "", LEFT, extent.width);
    let mut top = 2.0;
    legend.draw(&mut svg, top);
    top += legend.height();
    let rows: Vec<(&PanelRow, Vec<&Panel>)> = figure.rows.iter().map(|row| (row, shown(row, extent.width))).collect();
    let columns: Vec<Vec<(f64, f64)>> = rows.iter().map(|(_, panels)| frames(panels, extent.width)).collect();
    let heads: Vec<Vec<Keys>> =
        rows.iter().zip(&columns).map(|((_, panels), columns)| heads(figure, panels, columns)).collect();
    let above = |k: usize| heads[k].iter().map(Keys::height).fold(0.0, f64::max);
    // Panels above each other on one abscissa are labelled once, at the lowest.
    let shared = |k: usize| {
        let link = |k: usize| rows.get(k).and_then(|(_, panels)| panels.first()?.x.link);
        link(k).is_some() && link(k) == link(k + 1)
    };
    let below = |k: usize| if shared(k) { GAP } else { BELOW + LINE * (lines_below(&rows[k].1) - 1.0) };
    let fixed: f64 = top + (0..rows.len()).map(|k| above(k) + below(k)).sum::<f64>();
    let room = extent.height.map_or(figure.height, |height| height - fixed).max(LEAST * rows.len() as f64);
    let shares: f64 = rows.iter().map(|(row, _)| row.share).sum();
    for (k, (row, panels)) in rows.iter().enumerate() {
        let (height, head) = (room * row.share / shares, above(k));
        for (j, (panel, (left, width))) in panels.iter().zip(&columns[k]).enumerate() {
            heads[k][j].draw(&mut svg, top + head - heads[k][j].height());
            let y_labels = j == 0 || !shares_ordinate(panels[j - 1], panel);
            let place = PanelPlace { at: (*left, top + head), size: (*width, height), x_labels: !shared(k), y_labels };
            place.draw(&mut svg, panel, units);
        }
        top += head + height + below(k);
    }
    Drawing { svg, size: (extent.width, top), caption: figure.caption.clone() }
}

/// The panels of a row that are drawn.
fn shown(row: &PanelRow, width: f64) -> Vec<&Panel> {
    match (row.one_of, row.panels.as_slice()) {
        (Some(k), panels) => panels.get(k).into_iter().collect(),
        (None, [whole, detail]) if shares_ordinate(whole, detail) && width < TWO_COLUMNS => vec![detail],
        (None, panels) => panels.iter().collect(),
    }
}

/// Whether a panel repeats the ordinate of the one before it.
fn shares_ordinate(before: &Panel, panel: &Panel) -> bool {
    before.id == panel.id && before.y == panel.y
}

/// Left edges and widths of the frames of a row.
fn frames(panels: &[&Panel], width: f64) -> Vec<(f64, f64)> {
    let cells = |panel: &Panel| panel.layers.iter().any(|l| matches!(l.shape, Shape::Cells(_)));
    let after = |panel: &Panel| if cells(panel) { SCALE } else { RIGHT };
    if let [whole, detail] = panels
        && shares_ordinate(whole, detail)
    {
        let frame = width - LEFT - RIGHT;
        let first = (1.0 - DETAIL) * frame;
        return vec![(LEFT, first), (LEFT + first + GAP, DETAIL * frame - GAP)];
    }
    let fixed: f64 = panels.iter().map(|panel| LEFT + after(panel)).sum();
    let each = ((width - fixed) / panels.len().max(1) as f64).max(LEAST);
    let mut left = 0.0;
    let place = |panel: &&Panel| {
        let frame = (left + LEFT, each);
        left += LEFT + each + after(panel);
        frame
    };
    panels.iter().map(place).collect()
}

/// The lines above the panels of a row: titles, and keys that are not in the figure's legend.
fn heads(figure: &Figure, panels: &[&Panel], frames: &[(f64, f64)]) -> Vec<Keys> {
    panels
        .iter()
        .zip(frames)
        .enumerate()
        .map(|(k, (panel, (left, width)))| {
            if k > 0 && shares_ordinate(panels[k - 1], panel) {
                return Keys::of(&[], "", *left, left + width);
            }
            let keys: Vec<LegendEntry> = panel.keys().into_iter().filter(|key| !figure.legend.contains(key)).collect();
            let said: Vec<String> =
                std::iter::once(panel.title.clone()).chain(stretches_said(panel)).filter(|s| !s.is_empty()).collect();
            let right = if panels.len() > 1 && !shares_ordinate(panel, panels[panels.len() - 1]) {
                left + width + RIGHT
            } else {
                frames.last().map_or(left + width, |f| f.0 + f.1)
            };
            Keys::of(&keys, &said.join("; "), *left, right)
        })
        .collect()
}

/// What tinted stretches are.
fn stretches_said(panel: &Panel) -> impl Iterator<Item = String> {
    panel.guides.iter().filter_map(|guide| match guide {
        Guide::Stretches { text, .. } if !text.is_empty() => Some(text.clone()),
        _ => None,
    })
}

/// Most lines of a mark's label in a row.
fn lines_below(panels: &[&Panel]) -> f64 {
    let lines = |panel: &&Panel| match &panel.x.ticks {
        super::Ticks::Named(names) => names.iter().map(|(_, name)| name.lines().count()).max().unwrap_or(1),
        _ => 1,
    };
    panels.iter().map(lines).max().unwrap_or(1).max(1) as f64
}

/// Words and keys side by side, in as many lines as they need.
struct Keys {
    lines: Vec<Vec<(f64, Option<LegendEntry>, String)>>,
}

impl Keys {
    fn of(keys: &[LegendEntry], title: &str, left: f64, right: f64) -> Self {
        let mut lines: Vec<Vec<(f64, Option<LegendEntry>, String)>> = Vec::new();
        let mut x = right;
        let mut put = |key: Option<LegendEntry>, text: &str| {
            let mark = if key.is_some() { SAMPLE + 6.0 } else { 0.0 };
            let wide = mark + LETTER * text.chars().count() as f64;
            if lines.is_empty() || x + wide > right && x > left {
                lines.push(Vec::new());
                x = left;
            }
            if let Some(line) = lines.last_mut() {
                line.push((x, key, text.to_owned()));
            }
            x += wide + 16.0;
        };
        for key in keys {
            put(Some(key.clone()), &key.name);
        }
        if !title.is_empty() {
            let most = ((right - left) / LETTER).max(8.0) as usize;
            let cut = title.chars().count() > most;
            put(None, &if cut { title.chars().take(most - 1).chain(['…']).collect() } else { title.to_owned() });
        }
        Self { lines }
    }

    fn height(&self) -> f64 {
        KEYS * self.lines.len() as f64 + if self.lines.is_empty() { 0.0 } else { 2.0 }
    }

    fn draw(&self, svg: &mut Svg, top: f64) {
        for (k, line) in self.lines.iter().enumerate() {
            let base = top + KEYS * (k + 1) as f64 - 4.0;
            for (x, key, text) in line {
                let Some(key) = key else {
                    svg.text("key", (*x, base), Anchor::Start, text);
                    continue;
                };
                let (name, middle) = (class(key.ink), base - 3.5);
                match key.mark {
                    KeyMark::Line => svg.line(&name, (*x, middle), (x + SAMPLE, middle)),
                    KeyMark::Dot => svg.circle(&format!("{name}-fill"), (x + 0.5 * SAMPLE, middle), 2.4),
                    KeyMark::Patch => svg.rect(&format!("{name}-fill"), (*x, middle - 4.5), (SAMPLE, 9.0)),
                }
                svg.text("key", (x + SAMPLE + 6.0, base), Anchor::Start, text);
            }
        }
    }
}

/// Coordinates of values to points on the paper.
struct PlotTransform<'a> {
    place: &'a PanelPlace,
    x: &'a Axis,
    y: &'a Axis,
}

impl PlotTransform<'_> {
    fn across(&self, coordinate: f64) -> f64 {
        let (low, high) = self.x.range;
        self.place.at.0 + self.place.size.0 * ((coordinate - low) / (high - low))
    }

    fn up(&self, coordinate: f64) -> f64 {
        let (low, high) = self.y.range;
        // Far outside the frame, where it is clipped anyway, a coordinate is kept small enough to be written.
        let share = ((coordinate - low) / (high - low)).clamp(-10.0, 11.0);
        self.place.at.1 + self.place.size.1 * (1.0 - share)
    }

    fn point(&self, value: [f64; 2]) -> (f64, f64) {
        if !(value[0].is_finite() && value[1].is_finite()) {
            return (f64::NAN, f64::NAN);
        }
        (self.across(self.x.coordinate(value[0])), self.up(self.y.coordinate(value[1])))
    }
}

impl PanelPlace {
    fn draw(&self, svg: &mut Svg, panel: &Panel, units: &ShownUnits) {
        let to = PlotTransform { place: self, x: &panel.x, y: &panel.y };
        let ((left, top), (width, height)) = (self.at, self.size);
        self.axes(svg, panel, units, &to);
        svg.begin_clip(self.at, self.size);
        for guide in &panel.guides {
            match guide {
                Guide::Stretches { tint, stretches, .. } => {
                    for (from, until) in stretches {
                        let ends = [*from, *until].map(|v| to.across(v).clamp(left, left + width));
                        svg.rect(style::tint(*tint), (ends[0], top), (ends[1] - ends[0], height));
                    }
                }
                Guide::Around { ink, level, .. } => {
                    let (upper, lower) = (to.up(*level), to.up(-*level));
                    let fill = format!("{}-fill", class(*ink));
                    svg.styled_rect(&fill, " fill-opacity=\"0.14\"", (left, upper), (width, lower - upper));
                    for y in [upper, lower] {
                        svg.line(&class(*ink), (left, y), (left + width, y));
                    }
                }
                _ => {}
            }
        }
        for layer in &panel.layers {
            self.layer(svg, panel, layer, &to);
        }
        for guide in &panel.guides {
            match guide {
                Guide::Level { ink, at, .. } => {
                    let y = to.up(panel.y.coordinate(*at));
                    svg.line(&class(*ink), (left, y), (left + width, y));
                }
                Guide::At { ink, at, .. } => {
                    let x = to.across(panel.x.coordinate(*at));
                    svg.line(&class(*ink), (x, top), (x, top + height));
                }
                _ => {}
            }
        }
        svg.end_clip();
        for guide in &panel.guides {
            match guide {
                Guide::At { at, text, .. } if !text.is_empty() => {
                    let x = to.across(panel.x.coordinate(*at));
                    if (left..=left + width).contains(&x) {
                        let right = x > left + 0.5 * width;
                        let (x, anchor) = if right { (x - 4.0, Anchor::End) } else { (x + 4.0, Anchor::Start) };
                        svg.text("halo", (x, top + 13.0), anchor, text);
                        svg.text("note", (x, top + 13.0), anchor, text);
                    }
                }
                Guide::Sign { sign, at } => draw_sign(svg, *sign, to.point(*at)),
                _ => {}
            }
        }
        if panel.layers.iter().all(|l| l.is_empty()) && !panel.note.is_empty() {
            svg.text("note", (left + 0.5 * width, top + 0.5 * height), Anchor::Middle, &panel.note);
        }
        svg.rect("frame", self.at, self.size);
    }

    fn axes(&self, svg: &mut Svg, panel: &Panel, units: &ShownUnits, to: &PlotTransform<'_>) {
        let ((left, top), (width, height)) = (self.at, self.size);
        let (right, bottom) = (left + width, top + height);
        let marks = |axis: &Axis, length: f64, spacing: f64| {
            axis.marks(axis.range, (axis.range.1 - axis.range.0) / length * 8.0, spacing)
        };
        let scale = panel.x.scale(units);
        for mark in marks(&panel.x, width, SPACING.0) {
            let x = to.across(mark.at);
            svg.line("grid", (x, top), (x, bottom));
            let label = panel.x.label(mark, &scale);
            if self.x_labels && !label.is_empty() {
                // The last label ends where the figure does.
                let half = 0.5 * LETTER * label.lines().map(|l| l.chars().count()).max().unwrap_or(0) as f64;
                for (k, line) in label.lines().enumerate() {
                    let at = (x.min(right + RIGHT - half), bottom + 13.0 + LINE * k as f64);
                    svg.text("tick", at, Anchor::Middle, line);
                }
            }
        }
        let y_scale = panel.y.scale(units);
        for mark in marks(&panel.y, height, SPACING.1) {
            let y = to.up(mark.at);
            svg.line("grid", (left, y), (right, y));
            if self.y_labels {
                svg.text("tick", (left - 6.0, y + 3.5), Anchor::End, &panel.y.label(mark, &y_scale));
            }
        }
        if self.x_labels {
            let base = bottom + 29.0 + LINE * (lines_below(&[panel]) - 1.0);
            svg.text("label", (left + 0.5 * width, base), Anchor::Middle, &panel.x.title(&scale));
        }
        if self.y_labels {
            let title = panel.y.title(&y_scale);
            // A low panel has no room for both; its curves are named above it.
            let title =
                if LETTER * title.chars().count() as f64 > height + 16.0 { y_scale.unit.clone() } else { title };
            svg.upward_text("label", (left - LEFT + 12.0, top + 0.5 * height), &title);
        }
    }

    fn layer(&self, svg: &mut Svg, panel: &Panel, layer: &Layer, to: &PlotTransform<'_>) {
        let (line, fill) = (class(layer.ink), format!("{}-fill", class(layer.ink)));
        let look = layer.width.map_or_else(String::new, |w| format!(" style=\"stroke-width:{}\"", 0.9 * w));
        match &layer.shape {
            Shape::Samples(samples) => {
                let apart = samples.spacing.interval * self.size.0 / (panel.x.range.1 - panel.x.range.0);
                // An error whose samples merge is a band, through which its running mean is drawn.
                let banded = layer.ink == Ink::Error
                    && apart < 0.6
                    && panel.layers.iter().any(|other| other.ink == Ink::ErrorRms);
                let look = if banded { " opacity=\"0.32\"".to_owned() } else { look };
                let points = self.samples(panel, samples);
                svg.styled_path(&line, &look, points.into_iter().map(|p| to.point(p)));
            }
            Shape::Line(points) => {
                let points = self.thinned(panel, points);
                svg.styled_path(&line, &look, points.into_iter().map(|p| to.point(p)));
            }
            Shape::Dots(points) => {
                let step = points.points.len().div_ceil(DOTS).max(1);
                let mut squares = String::new();
                for (x, y) in points.points.iter().step_by(step).map(|p| to.point(*p)).filter(|p| p.0.is_finite()) {
                    let (left, top) = (x - 0.5 * DOT, y - 0.5 * DOT);
                    let _ = write!(squares, "M{left:.2} {top:.2}h{DOT}v{DOT}h-{DOT}Z");
                }
                svg.area(&fill, "", &squares);
            }
            Shape::Marks(points) => {
                for at in points.points.iter().map(|p| to.point(*p)).filter(|p| p.0.is_finite()) {
                    svg.circle(&fill, at, 2.4);
                }
            }
            Shape::Errors(errors) => {
                for [x, low, high] in errors {
                    svg.styled_path(
                        &line,
                        " style=\"stroke-width:1.1\"",
                        [to.point([*x, *low]), to.point([*x, *high])],
                    );
                }
            }
            Shape::Band(spans) => draw_band(svg, &fill, spans.iter().copied(), to),
            Shape::Tube(centre, half) => {
                let points = self.samples(panel, centre);
                let width = |x: f64| half.nearest(x).map_or(0.0, |k| half.values[k]);
                draw_band(svg, &fill, points.into_iter().map(|[x, y]| [x, y - width(x), y + width(x)]), to);
            }
            Shape::Bars { bars, hollow } => {
                for bar in bars {
                    let (from, foot) = to.point([bar.from, 0.0]);
                    let (until, end) = to.point([bar.to, bar.height]);
                    let (at, size) = ((from, end.min(foot)), (until - from, (end - foot).abs().max(0.8)));
                    if *hollow {
                        svg.styled_rect(&fill, " fill-opacity=\"0.3\"", at, size);
                        svg.rect(&line, at, size);
                    } else if bar.text.is_empty() {
                        svg.styled_rect(&fill, " fill-opacity=\"0.5\"", at, size);
                    } else {
                        svg.rect(&fill, at, size);
                    }
                    let (_, foot) = to.point([bar.from, bar.text_at]);
                    for class in ["halo", "tick"] {
                        svg.text(class, (0.5 * (from + until), foot - 3.0), Anchor::Middle, &bar.text);
                    }
                }
            }
            Shape::Cells(cells) => self.cells(svg, cells, to),
        }
    }

    /// What shows of evenly spaced samples, at two points of a line to each point of the paper.
    fn samples(&self, panel: &Panel, samples: &super::Samples) -> Vec<[f64; 2]> {
        let mut points = Vec::new();
        samples.thinned(panel.x.range.0..=panel.x.range.1, (2.0 * self.size.0) as usize, &mut points);
        points
    }

    /// What shows of a line.
    fn thinned(&self, panel: &Panel, line: &Points) -> Vec<[f64; 2]> {
        let (x, y) = (&panel.x, &panel.y);
        if line.points.len() <= FEW {
            return line.points.to_vec();
        }
        let coordinates = line.points.iter().map(|p| [x.coordinate(p[0]), y.coordinate(p[1])]);
        let mut out = Vec::new();
        if line.is_rising() {
            thin::columns(coordinates, x.range.0..=x.range.1, self.size.0 as usize, &mut out);
        } else {
            let scale = |length: f64, range: (f64, f64)| 2.0 * length / (range.1 - range.0);
            let raster = thin::Raster {
                min: [x.range.0, y.range.0],
                max: [x.range.1, y.range.1],
                scale: [scale(self.size.0, x.range), scale(self.size.1, y.range)],
            };
            thin::loops(coordinates, raster, LOOPS, &mut out);
        }
        out.into_iter().map(|[a, b]| [x.value(a), y.value(b)]).collect()
    }

    fn cells(&self, svg: &mut Svg, cells: &Cells, to: &PlotTransform<'_>) {
        let letter = if matches!(cells.colours, Colours::Diverging(_)) { 'd' } else { 's' };
        let step = |share: f64| format!("{letter}{}", (share * STEPS as f64).round() as usize);
        // Neighbouring areas of one colour are one path: seams between them would show.
        let mut areas: HashMap<String, String> = HashMap::new();
        let mut order: Vec<String> = Vec::new();
        for (k, low, high) in cells.drawn() {
            let name = if cells.is_unsure(k) { "unsure".to_owned() } else { step(cells.share(k)) };
            let (a, b) = ((to.across(low[0]), to.up(low[1])), (to.across(high[0]), to.up(high[1])));
            let area = areas.entry(name.clone()).or_insert_with(|| {
                order.push(name);
                String::new()
            });
            area.push_str(&format!("M{:.2} {:.2}H{:.2}V{:.2}H{:.2}Z", a.0, a.1, b.0, b.1, a.0));
        }
        for name in order {
            svg.area(&name, "", &areas[&name]);
        }
        svg.end_clip();
        self.scale(svg, cells, letter);
        svg.begin_clip(self.at, self.size);
    }

    /// The colours with their values, right of the frame.
    fn scale(&self, svg: &mut Svg, cells: &Cells, letter: char) {
        let ((left, top), (width, height)) = (self.at, self.size);
        let x = left + width + 10.0;
        let each = height / (STEPS + 1) as f64;
        for k in 0..=STEPS {
            let y = top + height - each * (k + 1) as f64;
            svg.rect(&format!("{letter}{k}"), (x, y), (10.0, each + 0.3));
        }
        svg.rect("frame", (x, top), (10.0, height));
        let marks = cells.marks(&ShownUnits::default());
        for (share, text) in marks {
            let y = (top + height * (1.0 - share)).clamp(top + 8.0, top + height);
            svg.text("tick", (x + 14.0, y), Anchor::Start, &text);
        }
    }
}

impl Cells {
    /// What stands beside the scale of colours: the place, 0 to 1, and the value with its unit.
    pub fn marks(&self, units: &ShownUnits) -> Vec<(f64, String)> {
        match &self.colours {
            Colours::Shades(marks) => marks.clone(),
            Colours::Diverging(most) => {
                let scale = units.scale(*most, &self.unit);
                let text = |share: f64| significant((2.0 * share - 1.0) * most * scale.factor, 2);
                let top = format!("{} {}", text(1.0), scale.unit).trim().to_owned();
                vec![(0.0, text(0.0)), (0.5, text(0.5)), (1.0, top)]
            }
        }
    }
}

/// An area between two curves, in stretches where both are finite.
fn draw_band(svg: &mut Svg, fill: &str, spans: impl Iterator<Item = [f64; 3]>, to: &PlotTransform<'_>) {
    let spans: Vec<[f64; 3]> = spans.filter(|s| s.iter().all(|v| v.is_finite())).collect();
    let edge = |k: usize| spans.iter().map(move |s| to.point([s[0], s[k]]));
    let outline: Vec<String> = edge(2).chain(edge(1).rev()).map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
    if !outline.is_empty() {
        svg.area(fill, " fill-opacity=\"0.25\"", &format!("M{}Z", outline.join("L")));
    }
}

fn draw_sign(svg: &mut Svg, sign: MarkerShape, (x, y): (f64, f64)) {
    if !(x.is_finite() && y.is_finite()) {
        return;
    }
    for name in ["edge", "sign"] {
        match sign {
            MarkerShape::Circle => svg.circle(name, (x, y), 6.0),
            MarkerShape::Cross => {
                svg.line(name, (x - 4.5, y - 4.5), (x + 4.5, y + 4.5));
                svg.line(name, (x - 4.5, y + 4.5), (x + 4.5, y - 4.5));
            }
            MarkerShape::Diamond => {
                let corners = [(0.0, -8.0), (8.0, 0.0), (0.0, 8.0), (-8.0, 0.0), (0.0, -8.0)];
                svg.path(name, corners.map(|(dx, dy)| (x + dx, y + dy)));
            }
        }
    }
}
