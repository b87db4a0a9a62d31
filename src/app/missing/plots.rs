//! Plots of the room: stacks over time on one axis, and small ones drawn by hand on cards.

use crate::app::plot::palette::Painted as _;
use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::sync::Arc;

use egui::{Align2, Color32, FontId, Id, Mesh, Rect, Shape, Stroke, Ui, Vec2, pos2, vec2};
use egui_plot::{FilledArea, HLine, Line, LineStyle, Plot, PlotMemory, PlotPoints, PlotResponse, Span};

use crate::app::plot::decimate::{Decimated, Samples};
use crate::app::plot::palette::Ink;
use crate::app::plot::units::Scale;
use crate::app::plot::{axis, display, export, number, palette, pointer};
use sindyscope_search::Curve;

/// Room left of every plot for its ticks and label, points.
const AXIS: f32 = 66.0;
/// Height of a time axis' ticks and label, points.
const TIME_AXIS: f32 = 34.0;
/// Height of the line of names above a plot, points.
const LEGEND: f32 = 18.0;

/// Height below which a plot is named by its unit alone, points.
const LOW: f32 = 72.0;

type Series = Arc<[f64]>;

/// Series thinned for the screen, and series made of others; kept as long as they are drawn.
#[derive(Default)]
pub(in crate::app) struct Cache {
    curves: HashMap<(usize, u64), Kept<Decimated>>,
    made: HashMap<(usize, usize, u8), Kept<Series>>,
    now: u64,
    /// The time range that each stack was last fitted to.
    fitted: HashMap<&'static str, (u64, u64)>,
}

struct Kept<T> {
    value: T,
    /// What it was made of: as long as it is held, its address is not given to another.
    _of: [Arc<[f64]>; 2],
    used: u64,
}

impl Cache {
    /// Forgets what was not drawn lately.
    pub(in crate::app) fn tidy(&mut self) {
        self.now += 1;
        if self.now.is_multiple_of(64) {
            let now = self.now;
            self.curves.retain(|_, k| now - k.used < 64);
            self.made.retain(|_, k| now - k.used < 64);
        }
    }

    /// A series made of two others of the same length.
    pub(super) fn made(
        &mut self,
        kind: u8,
        a: &Arc<[f64]>,
        b: &Arc<[f64]>,
        make: impl Fn(f64, f64) -> f64,
    ) -> Arc<[f64]> {
        let key = (a.as_ptr() as usize, b.as_ptr() as usize, kind);
        let now = self.now;
        let kept = self.made.entry(key).or_insert_with(|| Kept {
            value: a.iter().zip(b.iter()).map(|(a, b)| make(*a, *b)).collect(),
            _of: [Arc::clone(a), Arc::clone(b)],
            used: now,
        });
        kept.used = now;
        Arc::clone(&kept.value)
    }

    fn curve(&mut self, plot: u64, values: &Arc<[f64]>) -> &mut Decimated {
        let now = self.now;
        let kept = self.curves.entry((values.as_ptr() as usize, plot)).or_insert_with(|| Kept {
            value: Decimated::new(values),
            _of: [Arc::clone(values), Arc::clone(values)],
            used: now,
        });
        kept.used = now;
        &mut kept.value
    }

    fn ready(&self, plot: u64, values: &Arc<[f64]>) -> Option<&Decimated> {
        self.curves.get(&(values.as_ptr() as usize, plot)).map(|k| &k.value)
    }
}

/// One curve over time.
pub(in crate::app) struct Trace<'a> {
    pub(in crate::app) name: &'a str,
    pub(in crate::app) color: Color32,
    pub(in crate::app) width: f32,
    pub(in crate::app) values: Arc<[f64]>,
    /// Whether the view is fitted to it.
    pub(in crate::app) leads: bool,
}

impl Trace<'_> {
    /// What was measured.
    pub(in crate::app) fn measured(values: &Arc<[f64]>, dark: bool) -> Self {
        Self {
            name: "measured",
            color: Ink::Measured.color(dark),
            width: Ink::Measured.width(),
            values: Arc::clone(values),
            leads: true,
        }
    }
}

/// A plot over time.
pub(in crate::app) struct Panel<'a> {
    pub(in crate::app) symbol: &'a str,
    pub(in crate::app) unit: String,
    pub(in crate::app) traces: Vec<Trace<'a>>,
    /// A band about the first curve: its name, and its half width.
    pub(in crate::app) band: Option<(&'a str, Arc<[f64]>)>,
    /// A dashed level on either side of zero, and its name.
    pub(in crate::app) level: Option<(String, f64)>,
    /// Text at the right of the names.
    pub(in crate::app) aside: String,
    /// What to say where nothing is drawn.
    pub(in crate::app) empty: &'a str,
    pub(in crate::app) share: f32,
}

/// What all plots of a stack share.
pub(in crate::app) struct Frame<'a> {
    /// A name that is unique in the room.
    pub(in crate::app) id: &'static str,
    pub(in crate::app) start: f64,
    pub(in crate::app) interval: f64,
    pub(in crate::app) samples: usize,
    pub(in crate::app) held_out: bool,
    /// Shaded stretches, the worst first.
    pub(in crate::app) worst: &'a [(f64, f64)],
    pub(in crate::app) dark: bool,
    pub(in crate::app) height: f32,
}

impl Frame<'_> {
    fn range(&self) -> (f64, f64) {
        let length = self.interval * self.samples.saturating_sub(1).max(1) as f64;
        (self.start - 0.01 * length, self.start + 1.01 * length)
    }
}

/// Draws plots above each other on one time axis; gives what each of them answered.
pub(in crate::app) fn stack(
    ui: &mut Ui,
    cache: &mut Cache,
    frame: &Frame<'_>,
    panels: &[Panel<'_>],
) -> Vec<PlotResponse<()>> {
    ui.spacing_mut().item_spacing.y = 1.0;
    let rows = panels.len() as f32 * (LEGEND + 2.0);
    let room = (frame.height - rows - TIME_AXIS).max(44.0 * panels.len() as f32);
    let shares: f32 = panels.iter().map(|p| p.share).sum();
    let range = frame.range();
    let stamp = (range.0.to_bits(), range.1.to_bits());
    let must_fit = cache.fitted.insert(frame.id, stamp) != Some(stamp);
    let mut shown: Vec<(PlotResponse<()>, Scale)> = Vec::new();
    let time = Scale::suited(range.1 - range.0, "s");
    for (k, panel) in panels.iter().enumerate() {
        names(ui, panel, frame.dark);
        let last = k + 1 == panels.len();
        let height = room * panel.share / shares + if last { TIME_AXIS } else { 0.0 };
        shown.push(plot(ui, cache, frame, panel, k as u64, &time, height, must_fit, last));
    }
    read_out(ui, frame, panels, &shown, &time);
    shown.into_iter().map(|(plot, _)| plot).collect()
}

/// The samples of a stack, one column a curve, in the record's units.
pub(super) fn table(frame: &Frame<'_>, panels: &[Panel<'_>]) -> String {
    let curves: Vec<(&Panel<'_>, &Trace<'_>)> =
        panels.iter().flat_map(|p| p.traces.iter().map(move |t| (p, t))).collect();
    let headers: Vec<String> = std::iter::once("t (s)".to_owned())
        .chain(curves.iter().map(|(p, t)| Scale::plain(p.unit.as_str()).axis(&format!("{} {}", p.symbol, t.name))))
        .collect();
    export::csv(&headers, frame.samples, |row, column| match column {
        0 => Some(frame.start + frame.interval * row as f64),
        _ => curves[column - 1].1.values.get(row).copied(),
    })
}

/// The line of names above a plot.
fn names(ui: &mut Ui, panel: &Panel<'_>, dark: bool) {
    let size = vec2(ui.available_width(), LEGEND);
    ui.allocate_ui_with_layout(size, egui::Layout::left_to_right(egui::Align::Center), |ui| {
        ui.set_min_size(size);
        ui.add_space(AXIS);
        for trace in &panel.traces {
            entry(ui, trace.name, trace.color, trace.width, None);
        }
        if let Some((name, _)) = &panel.band {
            let color = panel.traces.first().map_or(Color32::GRAY, |t| t.color);
            let (rect, _) = ui.allocate_exact_size(vec2(14.0, 9.0), egui::Sense::hover());
            ui.painter().rect_filled(rect, 1.0, color.gamma_multiply(0.3));
            ui.label(small(name));
        }
        if let Some((name, _)) = &panel.level {
            entry(ui, name, Ink::NoiseFloor.color(dark), 1.2, Some(4.0));
        }
        if !panel.aside.is_empty() {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.add(egui::Label::new(small(&panel.aside).weak()).truncate());
            });
        }
    });
}

fn small(text: &str) -> egui::RichText {
    egui::RichText::new(text).size(12.0)
}

/// A piece of line and a name.
pub(super) fn entry(ui: &mut Ui, name: &str, color: Color32, width: f32, dash: Option<f32>) {
    let (rect, _) = ui.allocate_exact_size(vec2(20.0, LEGEND), egui::Sense::hover());
    let ends = [rect.left_center(), rect.right_center()];
    let stroke = Stroke::new(width.max(1.2), color);
    match dash {
        Some(length) => {
            ui.painter().extend(Shape::dashed_line(&ends, stroke, length, 3.0));
        }
        None => {
            ui.painter().line_segment(ends, stroke);
        }
    }
    ui.label(small(name));
}

#[expect(clippy::too_many_arguments, reason = "the one place where all that a plot is made of comes together")]
fn plot(
    ui: &mut Ui,
    cache: &mut Cache,
    frame: &Frame<'_>,
    panel: &Panel<'_>,
    index: u64,
    time: &Scale,
    height: f32,
    must_fit: bool,
    last: bool,
) -> (PlotResponse<()>, Scale) {
    let id = Id::unique(("missing", frame.id, index));
    let memory = PlotMemory::load(ui.ctx(), id);
    let whole = frame.range();
    let visible: RangeInclusive<f64> =
        memory.as_ref().filter(|m| !m.auto_bounds.x && !must_fit).map_or(whole.0..=whole.1, |m| m.bounds().range_x());
    let columns = (ui.available_width() * ui.ctx().pixels_per_point()).max(100.0) as usize;
    let key = Id::unique((frame.id, index)).value();
    let samples = |values| Samples { values, start: frame.start, interval: frame.interval };
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for trace in &panel.traces {
        let curve = cache.curve(key, &trace.values);
        if let Some((least, most)) = curve.range().filter(|_| trace.leads) {
            (low, high) = (low.min(least), high.max(most));
        }
        curve.view(&samples(&trace.values), visible.clone(), columns);
    }
    if let Some((_, half)) = &panel.band {
        let widest = half.iter().copied().filter(|h| h.is_finite()).fold(0.0, f64::max);
        // A band far wider than what it is about would flatten it; half of it tells as much.
        let widest = widest.min(2.0 * high.abs().max(low.abs()));
        (low, high) = (low - widest, high + widest);
    }
    if let Some((_, level)) = panel.level.as_ref().filter(|l| l.1 < 4.0 * high.max(-low)) {
        (low, high) = (low.min(-1.3 * level), high.max(1.3 * level));
    }
    if low > high || !(high - low).is_finite() {
        (low, high) = (-1.0, 1.0);
    }
    let margin = if high > low { 0.06 * (high - low) } else { high.abs().max(1e-9) };
    let scale = display::scale(ui.ctx(), low.abs().max(high.abs()), &panel.unit);
    let auto_y = memory.is_none_or(|m| m.auto_bounds.y);
    let (dark, held_out, worst) = (frame.dark, frame.held_out, frame.worst);
    let (start, end) = (frame.start, frame.start + frame.interval * frame.samples.saturating_sub(1) as f64);
    let cache = &*cache;
    let response = Plot::new(id)
        .id(id)
        .height(height)
        .show_axes([last, true])
        .y_axis_min_width(AXIS)
        // A low plot has no room for both; its curves are named above it.
        .y_axis_label(if height < LOW { scale.unit.clone() } else { scale.axis(panel.symbol) })
        .x_axis_label(time.axis("t"))
        .x_axis_formatter(|mark, _| axis::linear_label(mark, time))
        .y_axis_formatter(|mark, _| axis::linear_label(mark, &scale))
        .x_grid_spacer(axis::round_marks(10.0))
        .y_grid_spacer(axis::round_marks(3.0))
        .grid_color(palette::grid(dark))
        .grid_fade(0.0)
        .show_background(true)
        .link_axis(Id::unique(("missing time", frame.id)), [true, false])
        .default_x_bounds(whole.0, whole.1)
        .default_y_bounds(low - margin, high + margin)
        .show_x(false)
        .show_y(false)
        .allow_scroll(false)
        .allow_drag([true, !auto_y])
        .show(ui, |plot| {
            if must_fit || plot.response().double_clicked() {
                plot.set_auto_bounds(true);
            } else {
                pointer::wheel(plot);
            }
            if held_out {
                plot.span(palette::quiet(Span::new("", start..=end), palette::held_out(dark)));
            }
            for (k, (from, to)) in worst.iter().enumerate() {
                let tint = palette::worst(dark);
                plot.span(palette::quiet(
                    Span::new("", *from..=*to),
                    if k == 0 { tint } else { tint.gamma_multiply(0.55) },
                ));
            }
            // Beneath the curves, which would else be hidden where they are as small as noise.
            if let Some((_, level)) = &panel.level {
                let ink = Ink::NoiseFloor.color(dark);
                let tint = ink.gamma_multiply(0.14);
                plot.span(palette::quiet(Span::new("", -level..=*level), tint).axis(egui_plot::Axis::Y));
                let stroke = Stroke::new(1.0, ink.gamma_multiply(0.7));
                for level in [*level, -*level] {
                    let line = HLine::new("", level).stroke(stroke).style(LineStyle::Dashed { length: 5.0 });
                    plot.hline(line.allow_hover(false));
                }
            }
            if let Some((_, half)) = &panel.band
                && let Some(first) = panel.traces.first()
                && let Some(ready) = cache.ready(key, &first.values)
            {
                band(plot, ready, &samples(half), first.color);
            }
            for trace in &panel.traces {
                if let Some(ready) = cache.ready(key, &trace.values) {
                    let stroke = Stroke::new(trace.width, trace.color);
                    let line = Line::new("", PlotPoints::Borrowed(ready.points())).stroke(stroke).allow_band(false);
                    plot.line(line.allow_hover(false));
                }
            }
        });
    let area = *response.transform.frame();
    let labels = Rect::from_x_y_ranges(area.left() - AXIS..=area.left() - 2.0, area.y_range());
    display::on_axis(ui, labels, (frame.id, index), (panel.symbol, &panel.unit));
    if panel.traces.is_empty() {
        let frame = *response.transform.frame();
        let color = ui.visuals().weak_text_color();
        ui.painter().text(frame.center(), Align2::CENTER_CENTER, panel.empty, FontId::proportional(13.0), color);
    }
    (response, scale)
}

/// A filled band about a curve.
fn band(plot: &mut egui_plot::PlotUi<'_>, curve: &Decimated, half: &Samples<'_>, color: Color32) {
    let points = curve.points();
    if points.len() < 2 {
        return;
    }
    let width = |x: f64| half.nearest(x).map_or(0.0, |k| half.values[k]);
    let xs: Vec<f64> = points.iter().map(|p| p.x).collect();
    let low: Vec<f64> = points.iter().map(|p| p.y - width(p.x)).collect();
    let high: Vec<f64> = points.iter().map(|p| p.y + width(p.x)).collect();
    plot.add(FilledArea::new("", &xs, &low, &high).fill_color(color.gamma_multiply(0.25)).allow_hover(false));
}

/// A line through all plots at the pointer, and the values there.
fn read_out(ui: &Ui, frame: &Frame<'_>, panels: &[Panel<'_>], shown: &[(PlotResponse<()>, Scale)], time: &Scale) {
    let Some((response, pointer)) = shown.iter().find_map(|(r, _)| Some((&r.response, r.response.hover_pos()?))) else {
        return;
    };
    if response.dragged() {
        return;
    }
    let at = shown[0].0.transform.value_from_position(pointer).x;
    let index = ((at - frame.start) / frame.interval).round();
    if !(index >= 0.0 && index < frame.samples as f64) {
        return;
    }
    let (index, t) = (index as usize, frame.start + frame.interval * index);
    let mut rows = vec![("t".to_owned(), time.format(t, 5), ui.visuals().text_color())];
    for (panel, (plot, scale)) in panels.iter().zip(shown) {
        let area = *plot.transform.frame();
        let painter = ui.painter().with_clip_rect(area);
        let x = plot.transform.position_from_point_x(t);
        painter.vline(x, area.y_range(), Stroke::new(1.0, palette::cursor(frame.dark)));
        for trace in &panel.traces {
            if let Some(value) = trace.values.get(index).filter(|v| v.is_finite()) {
                let y = plot.transform.position_from_point_y(*value);
                painter.circle(pos2(x, y), 3.0, trace.color, Stroke::new(1.0, palette::ground(frame.dark)));
                let name = format!("{} {}", panel.symbol, if panel.traces.len() > 1 { trace.name } else { "" });
                rows.push((name, scale.format(*value, 4), trace.color));
            }
        }
    }
    pointer::tooltip(response).show(|ui| {
        let values: Vec<&str> = rows.iter().map(|r| r.1.as_str()).collect();
        let values = number::align_at_point(&values);
        egui::Grid::new("missing values").num_columns(2).spacing([12.0, 2.0]).show(ui, |ui| {
            for ((name, _, color), value) in rows.iter().zip(values) {
                ui.colored_label(*color, name);
                ui.monospace(value);
                ui.end_row();
            }
        });
    });
}

/// Axes of a plot drawn by hand.
pub(super) struct Axes {
    pub(super) area: Rect,
    x: (f64, f64),
    y: (f64, f64),
    pub(super) x_scale: Scale,
    pub(super) y_scale: Scale,
}

impl Axes {
    /// Draws ground, frame and ticks into `rect`, its axes over these ranges.
    pub(super) fn draw(ui: &Ui, rect: Rect, x: ((f64, f64), &str, &str), y: ((f64, f64), &str, &str)) -> Self {
        let dark = ui.visuals().dark_mode;
        let ((x, x_name, x_unit), (y, y_name, y_unit)) = (x, y);
        let (x, y) = (widened(x), widened(y));
        let units = display::chosen(ui.ctx());
        let x_scale = units.scale(x.0.abs().max(x.1.abs()), x_unit);
        let y_scale = units.scale(y.0.abs().max(y.1.abs()), y_unit);
        let area = Rect::from_min_max(rect.min + vec2(40.0, 16.0), rect.max - vec2(6.0, 30.0));
        let this = Self { area, x, y, x_scale, y_scale };
        let painter = ui.painter();
        painter.rect_filled(area, 0.0, palette::ground(dark));
        let (line, text) = (Stroke::new(1.0, palette::grid(dark)), ui.visuals().weak_text_color());
        let font = FontId::proportional(10.5);
        for (value, label) in ticks(x, &this.x_scale, (area.width() / 38.0) as usize) {
            let at = this.at(value, y.0).x;
            painter.vline(at, area.y_range(), line);
            painter.text(pos2(at, area.bottom() + 2.0), Align2::CENTER_TOP, label, font.clone(), text);
        }
        for (value, label) in ticks(y, &this.y_scale, (area.height() / 18.0) as usize) {
            let at = this.at(x.0, value).y;
            painter.hline(area.x_range(), at, line);
            painter.text(pos2(area.left() - 4.0, at), Align2::RIGHT_CENTER, label, font.clone(), text);
        }
        painter.rect_stroke(area, 0.0, line, egui::StrokeKind::Outside);
        let strong = ui.visuals().text_color();
        let below = pos2(area.center().x, rect.bottom());
        let name = FontId::proportional(11.5);
        painter.text(below, Align2::CENTER_BOTTOM, this.x_scale.axis(x_name), name.clone(), strong);
        painter.text(rect.min, Align2::LEFT_TOP, this.y_scale.axis(y_name), name, strong);
        this
    }

    /// Where a point lies.
    pub(super) fn at(&self, x: f64, y: f64) -> egui::Pos2 {
        let share = |v: f64, (low, high): (f64, f64)| ((v - low) / (high - low)) as f32;
        pos2(
            self.area.left() + self.area.width() * share(x, self.x),
            self.area.bottom() - self.area.height() * share(y, self.y),
        )
    }

    /// The point under a position.
    pub(super) fn value(&self, at: egui::Pos2) -> [f64; 2] {
        let x = f64::from((at.x - self.area.left()) / self.area.width());
        let y = f64::from((self.area.bottom() - at.y) / self.area.height());
        [self.x.0 + x * (self.x.1 - self.x.0), self.y.0 + y * (self.y.1 - self.y.0)]
    }
}

/// A range that has a width.
fn widened((low, high): (f64, f64)) -> (f64, f64) {
    if !(low.is_finite() && high.is_finite()) || low > high {
        return (-1.0, 1.0);
    }
    if high - low > 1e-12 * high.abs().max(low.abs()) {
        return (low, high);
    }
    let half = if high == 0.0 { 1.0 } else { 0.2 * high.abs() };
    (low - half, high + half)
}

/// At most so many round ticks.
fn ticks((low, high): (f64, f64), scale: &Scale, most: usize) -> Vec<(f64, String)> {
    let most = most.max(2) as f64;
    // `round_marks` counts in grid steps of 8 points.
    let input = egui_plot::GridInput { bounds: (low, high), base_step_size: (high - low) / most };
    axis::round_marks(1.0)(input).into_iter().map(|m| (m.value, axis::linear_label(m, scale))).collect()
}

/// Smallest and largest finite value, with a margin.
pub(super) fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) =
        values.filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let margin = 0.05 * (high - low);
    (low - margin, high + margin)
}

/// Shares of the points below and above which a lone one does not set the limits.
const OUTLYING: f64 = 0.005;

/// Least and largest value with a margin, without the few that lie far off: one outlier must not flatten a plot.
fn usual_extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut sorted: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    if sorted.is_empty() {
        return extent(sorted.into_iter());
    }
    sorted.sort_by(f64::total_cmp);
    let cut = (OUTLYING * sorted.len() as f64).ceil() as usize;
    let (low, high) = (sorted[cut.min(sorted.len() - 1)], sorted[sorted.len().saturating_sub(1 + cut)]);
    let (least, most) = (sorted[0], sorted[sorted.len() - 1]);
    // Only what lies beyond all the others' range is an outlier.
    let reach = high - low;
    extent([least.max(low - reach), most.min(high + reach)].into_iter())
}

/// The small plot of a card: the measured missing force as points, the effect's curve through them.
pub(super) fn curve(ui: &Ui, rect: Rect, curve: &Curve, unit: &str, color: Color32, faded: bool) {
    let x = extent(curve.measured.iter().chain(&curve.effect).map(|p| p[0]));
    let y = usual_extent(curve.measured.iter().chain(&curve.effect).map(|p| p[1]));
    let axes = Axes::draw(ui, rect, (x, &curve.axis, &curve.unit), (y, "missing force", unit));
    let dark = ui.visuals().dark_mode;
    let strength = if faded { 0.45 } else { 1.0 };
    let ink = Ink::Measured.color(dark).gamma_multiply(0.75 * strength);
    let dots = |points: &[[f64; 2]], ink: Color32| {
        let mut mesh = Mesh::default();
        for [a, f] in points {
            mesh.add_colored_rect(Rect::from_center_size(axes.at(*a, *f), Vec2::splat(2.0)), ink);
        }
        mesh
    };
    let painter = ui.painter().with_clip_rect(axes.area);
    painter.add(dots(&curve.measured, ink));
    let color = color.gamma_multiply(strength);
    // Over time it is a dense curve, over a quantity of the motion a law, or a cloud where it depends on more.
    let over_time = curve.axis == "t";
    if !over_time && !curve.is_law() {
        painter.add(dots(&curve.effect, color));
        return;
    }
    let points: Vec<egui::Pos2> = curve.effect.iter().map(|[a, f]| axes.at(*a, *f)).collect();
    painter.add(Shape::line(points, Stroke::new(if over_time { 1.0 } else { 2.0 }, color)));
}
