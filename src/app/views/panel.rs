//! Plots over time, one above the other on one time axis.

use crate::app::plot::palette::Painted as _;
use std::collections::BTreeSet;
use std::fmt::Debug;
use std::hash::Hash;

use egui::{Align, Align2, Color32, Id, Layout, Rect, Stroke, Ui, pos2, vec2};
use egui_plot::{
    HLine, Line, Plot, PlotMemory, PlotPoint, PlotPoints, PlotResponse, PlotTransform, Points, Span, VLine,
};

use super::cache::Cache;
use super::legend::{self, Entry};
use super::scene::Scene;
use super::{Request, View, ViewState};
use crate::app::plot::decimate::Samples;
use crate::app::plot::palette::{self, Ink};
use crate::app::plot::units::Scale;
use crate::app::plot::{axis, display, export, number, pointer};
use sindyscope_values::format::shown::ShownUnits;
use sindyscope_values::record::Usage;

/// Room left of every plot for its ticks and label, so that plots above each other are aligned, points.
pub(super) const AXIS_WIDTH: f32 = 72.0;

/// Height of the time axis' ticks and label, points.
const TIME_AXIS_HEIGHT: f32 = 34.0;

/// Width from which on a legend has room for all that it may say, points.
const ROOMY: f32 = 520.0;
/// What a third curve's entry and each further one takes of it.
const ENTRY: f32 = 140.0;

/// Distance of neighbouring samples on the screen below which an error is a band, points, and how strong that is drawn.
const MERGED: f64 = 0.6;
const BAND: f32 = 0.32;

/// Distance of neighbouring samples on the screen from which on each is marked, points.
const SAMPLES_MARKED: f64 = 7.0;

/// How far response and ghosts may widen the view beyond the measurement, as a share of its range: one that runs away
/// must not flatten the measurement.
const WIDENED: f64 = 0.5;

/// Decades shown beneath the largest value of a logarithmic plot.
const DECADES: f64 = 4.0;

/// The part that a curve plays in its plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// The view is fitted to it.
    Leads,
    /// It widens the view only so far.
    Follows,
    /// As `Follows`, and it is neither read out at the pointer nor copied.
    Ghost,
}

/// One curve.
pub(super) struct Curve<'a> {
    pub(super) ink: Ink,
    pub(super) name: &'a str,
    pub(super) samples: Samples<'a>,
    /// How it counts.
    pub(super) part: Part,
}

/// A plot over time.
pub(super) struct Panel<'a> {
    /// Name that is unique in its view.
    pub(super) id: &'static str,
    /// What the values are, as `x`.
    pub(super) symbol: String,
    pub(super) unit: String,
    pub(super) curves: Vec<Curve<'a>>,
    /// A dashed level and its name.
    pub(super) level: Option<(String, f64)>,
    /// Logarithmic values.
    pub(super) log: bool,
    /// Values are magnitudes: zero is the least, and the view ends at this one, however large they are.
    pub(super) magnitude_up_to: Option<f64>,
    /// A stretch of time to mark: a click on it goes there.
    pub(super) mark: Option<Mark>,
    /// Stretches of time that are shaded, and what they are.
    pub(super) shaded: Option<(String, Vec<(f64, f64)>)>,
    /// What to say where nothing is drawn.
    pub(super) empty: Option<String>,
    /// Share of the height.
    pub(super) share: f32,
}

impl Panel<'_> {
    pub(super) fn new(id: &'static str, symbol: String, unit: String) -> Self {
        Self {
            id,
            symbol,
            unit,
            curves: Vec::new(),
            level: None,
            log: false,
            magnitude_up_to: None,
            mark: None,
            shaded: None,
            empty: None,
            share: 1.0,
        }
    }
}

/// A stretch of time that is marked.
pub(super) struct Mark {
    pub(super) from: f64,
    pub(super) to: f64,
    /// What it is, as a link in the legend's line.
    pub(super) text: String,
}

impl Mark {
    /// The stretch with as much before and after it.
    fn surroundings(&self) -> (f64, f64) {
        let length = self.to - self.from;
        (self.from - length, self.to + length)
    }
}

/// Range and scale of one panel's values.
struct Fit {
    low: f64,
    high: f64,
    scale: Scale,
}

/// Draws panels on one time axis that all stacks of all views share.
pub(super) fn stack(
    ui: &mut Ui,
    view: View,
    scene: &Scene<'_>,
    state: &mut ViewState,
    panels: &[Panel<'_>],
) -> Option<Request> {
    let time = scene.time_scale();
    let rows = panels.len() as f32 * (legend::HEIGHT + ui.spacing().item_spacing.y * 2.0);
    let room = (ui.available_height() - rows - TIME_AXIS_HEIGHT).max(80.0 * panels.len() as f32);
    let shares: f32 = panels.iter().map(|p| p.share).sum();
    let mut shown: Vec<(PlotResponse<()>, Fit)> = Vec::new();
    for (i, panel) in panels.iter().enumerate() {
        let last = i + 1 == panels.len();
        legend_row(ui, scene, state, panel, i == 0);
        prepare(ui, view, scene, &mut state.cache, panel);
        let fit = fit(&state.cache, panel, &state.hidden, &display::chosen(ui.ctx()));
        let height = room * panel.share / shares + if last { TIME_AXIS_HEIGHT } else { 0.0 };
        let response = plot(ui, view, scene, state, panel, &fit, &time, height, last);
        if !state.printing {
            let axes = [None, (!panel.log).then_some((&*panel.symbol, &*panel.unit))];
            choose_units(ui, response.transform.frame(), (view, panel.id), axes);
        }
        shown.push((response, fit));
    }
    state.cache.go_to = None;
    overlay(ui, scene, state, panels, &shown, &time);
    interact(ui, scene, state, panels, &shown)
}

fn legend_row(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState, panel: &Panel<'_>, first: bool) {
    let size = vec2(ui.available_width(), legend::HEIGHT);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        let width = ui.available_width();
        let roomy = width >= ROOMY;
        ui.add_space(if roomy { AXIS_WIDTH } else { 4.0 });
        let mut entries: Vec<Entry<'_>> = panel
            .curves
            .iter()
            .filter(|c| !c.samples.values.is_empty())
            .map(|c| Entry { ink: c.ink, name: c.name })
            .collect();
        if let Some((name, _)) = &panel.level {
            // In little room without its value, which stands in the right column too.
            let words = name.split(|c: char| c.is_ascii_digit()).next().unwrap_or(name).trim_end();
            let taken = ENTRY * entries.len().saturating_sub(2) as f32;
            entries.push(Entry { ink: Ink::NoiseFloor, name: if width - taken >= ROOMY { name } else { words } });
        }
        legend::entries(ui, scene, &entries, &mut state.hidden, state.printing);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if let Some(mark) = &panel.mark {
                if state.printing {
                    ui.label(&mark.text);
                } else if roomy
                    && ui.link(&mark.text).on_hover_text("Go there; so does a click on the shaded stretch").clicked()
                {
                    state.cache.go_to = Some(mark.surroundings());
                }
                legend::swatch(ui, palette::worst(scene.dark)).on_hover_text(&mark.text);
            }
            if let Some((text, _)) = &panel.shaded {
                if roomy {
                    ui.label(text);
                }
                legend::swatch(ui, palette::stands(scene.dark)).on_hover_text(text);
            }
            if first && scene.record.usage == Usage::HeldOut {
                ui.label("held out");
                legend::swatch(ui, palette::held_out(scene.dark));
            }
        });
    });
}

fn plot_id(view: View, panel: &Panel<'_>) -> Id {
    Id::unique(("view", view, panel.id))
}

/// Computes the points of what will be drawn.
fn prepare(ui: &Ui, view: View, scene: &Scene<'_>, cache: &mut Cache, panel: &Panel<'_>) {
    let memory = PlotMemory::load(ui.ctx(), plot_id(view, panel));
    let whole = scene.time_range();
    let visible = cache.go_to.map_or_else(
        || memory.filter(|m| !m.auto_bounds.x).map_or(whole.0..=whole.1, |m| m.bounds().range_x()),
        |(from, to)| from..=to,
    );
    let columns = (ui.available_width() * ui.ctx().pixels_per_point()).max(100.0) as usize;
    for curve in &panel.curves {
        cache.curve((panel.id, curve.ink), &curve.samples).view(&curve.samples, visible.clone(), columns);
    }
}

/// The whole range of a panel's values.
fn fit(cache: &Cache, panel: &Panel<'_>, hidden: &BTreeSet<Ink>, units: &ShownUnits) -> Fit {
    let ranges = |leads: bool| {
        panel
            .curves
            .iter()
            .filter(move |c| (c.part == Part::Leads) == leads && !hidden.contains(&c.ink))
            .filter_map(|c| cache.ready((panel.id, c.ink))?.range())
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    };
    let level = panel.level.as_ref().filter(|_| !hidden.contains(&Ink::NoiseFloor)).map(|(_, v)| *v);
    let (mut low, mut high) = match (ranges(true), ranges(false)) {
        (Some(lead), Some(other)) => {
            let extra = WIDENED * (lead.1 - lead.0);
            (lead.0.min(other.0.max(lead.0 - extra)), lead.1.max(other.1.min(lead.1 + extra)))
        }
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => (0.0, level.unwrap_or(1.0)),
    };
    // A noise level far above the error would flatten it; its name in the legend tells it all the same.
    if let Some(level) = level.filter(|l| *l <= 4.0 * high) {
        high = high.max(1.15 * level);
    }
    if let Some(most) = panel.magnitude_up_to {
        low = 0.0;
        high = high.min(most);
    }
    let scale = units.scale(low.abs().max(high.abs()), &panel.unit);
    if panel.log {
        let top = if high > 0.0 { high.log10() } else { 0.0 };
        return Fit { low: top - DECADES, high: top + 0.1, scale };
    }
    let span = high - low;
    if span.is_nan() || span <= 1e-12 * high.abs().max(low.abs()) {
        let half = if high == 0.0 { 1.0 } else { 0.2 * high.abs() };
        return Fit { low: low - if panel.magnitude_up_to.is_some() { 0.0 } else { half }, high: high + half, scale };
    }
    let margin = 0.06 * span;
    Fit { low: if panel.magnitude_up_to.is_some() { 0.0 } else { low - margin }, high: high + margin, scale }
}

/// The coordinate of a value.
fn ordinate(panel: &Panel<'_>, fit: &Fit, value: f64) -> f64 {
    // A zero has no logarithm: it lies below all that a fitted view shows.
    if panel.log { value.max(10f64.powf(fit.low - 8.0)).log10() } else { value }
}

#[expect(clippy::too_many_arguments, reason = "the one place where all that a plot is made of comes together")]
fn plot<'a>(
    ui: &mut Ui,
    view: View,
    scene: &Scene<'_>,
    state: &'a mut ViewState,
    panel: &'a Panel<'_>,
    fit: &'a Fit,
    time: &'a Scale,
    height: f32,
    last: bool,
) -> PlotResponse<()> {
    let whole = scene.time_range();
    let id = plot_id(view, panel);
    let must_fit = state.cache.must_fit(view, panel.id);
    let go_to = state.cache.go_to;
    let auto_y = PlotMemory::load(ui.ctx(), id).is_none_or(|m| m.auto_bounds.y);
    let mut plot = Plot::new(panel.id)
        .id(id)
        .height(height)
        .show_axes([last, true])
        .y_axis_min_width(AXIS_WIDTH)
        .y_axis_label(if panel.log { panel.symbol.clone() } else { fit.scale.axis(&panel.symbol) })
        .x_axis_label(time.axis("t"))
        .x_axis_formatter(move |mark, _| axis::linear_label(mark, time))
        .x_grid_spacer(axis::round_marks(10.0))
        .grid_color(palette::grid(scene.dark))
        .grid_fade(0.0)
        .show_background(true)
        .link_axis(Id::unique("time axis"), [true, false])
        .default_x_bounds(whole.0, whole.1)
        .default_y_bounds(fit.low, fit.high)
        .show_x(false)
        .show_y(false)
        .allow_scroll(false)
        .allow_drag([true, !auto_y]);
    plot = if panel.log {
        plot.y_grid_spacer(axis::decade_marks).y_axis_formatter(|mark, _| axis::decade_label(mark, &panel.unit))
    } else {
        plot.y_grid_spacer(axis::round_marks(3.75)).y_axis_formatter(|mark, _| axis::linear_label(mark, &fit.scale))
    };
    let (dark, held_out) = (scene.dark, scene.record.usage == Usage::HeldOut);
    let start = scene.record.record.start;
    let end = start + scene.interval() * scene.record.record.len().saturating_sub(1) as f64;
    let colors: Vec<Color32> = panel.curves.iter().map(|c| scene.color(c.ink)).collect();
    let (noise, diverged) = (scene.color(Ink::NoiseFloor), scene.color(Ink::Diverged));
    let diverged_at = scene.record.diverged_at;
    let (cache, hidden) = (&state.cache, &state.hidden);
    let drawn = |ink: Ink| panel.curves.iter().any(|c| c.ink == ink) && !hidden.contains(&ink);
    plot.show(ui, move |plot| {
        let fitted = must_fit || plot.response().double_clicked();
        if fitted {
            plot.set_auto_bounds(true);
        } else if let Some((from, to)) = go_to {
            plot.set_plot_bounds_x(from..=to);
        } else {
            pointer::wheel(plot);
        }
        if held_out {
            plot.span(palette::quiet(Span::new("", start..=end), palette::held_out(dark)));
        }
        if let Some((_, stretches)) = &panel.shaded {
            for (from, to) in stretches {
                plot.span(palette::quiet(Span::new("", *from..=*to), palette::stands(dark)));
            }
        }
        if let Some(mark) = &panel.mark {
            plot.span(palette::quiet(Span::new("", mark.from..=mark.to), palette::worst(dark)));
        }
        for (curve, color) in panel.curves.iter().zip(colors) {
            let Some(ready) = cache.ready((panel.id, curve.ink)).filter(|_| !hidden.contains(&curve.ink)) else {
                continue;
            };
            let points = || -> PlotPoints<'a> {
                if panel.log {
                    let place = |p: &PlotPoint| PlotPoint::new(p.x, ordinate(panel, fit, p.y));
                    PlotPoints::Owned(ready.points().iter().map(place).collect())
                } else {
                    PlotPoints::Borrowed(ready.points())
                }
            };
            let apart = curve.samples.interval * plot.transform().dpos_dvalue_x();
            let banded = curve.ink == Ink::Error && apart < MERGED && drawn(Ink::ErrorRms);
            let color = if banded { color.gamma_multiply(BAND) } else { color };
            let stroke = Stroke::new(curve.ink.width(), color);
            // Bands are drawn upright, so that a wide line loses its width on steep flanks; few enough points need none.
            let line = Line::new("", points()).stroke(stroke).style(curve.ink.style()).allow_band(false);
            plot.line(line.allow_hover(false));
            if curve.part != Part::Ghost && (apart > SAMPLES_MARKED || curve.samples.values.len() == 1) {
                let radius = if curve.ink == Ink::Measured { 2.6 } else { 1.8 };
                plot.points(Points::new("", points()).radius(radius).color(color).allow_hover(false));
            }
        }
        if let Some((_, value)) = panel.level.as_ref().filter(|_| !hidden.contains(&Ink::NoiseFloor)) {
            let stroke = Stroke::new(Ink::NoiseFloor.width(), noise);
            plot.hline(
                HLine::new("", ordinate(panel, fit, *value))
                    .stroke(stroke)
                    .style(Ink::NoiseFloor.style())
                    .allow_hover(false),
            );
        }
        if let Some(at) = diverged_at {
            let stroke = Stroke::new(Ink::Diverged.width(), diverged);
            plot.vline(VLine::new("", at).stroke(stroke).style(Ink::Diverged.style()).allow_hover(false));
        }
    })
}

/// Labels on the plots and, at the pointer, a line through all of them with the values there.
fn overlay(
    ui: &Ui,
    scene: &Scene<'_>,
    state: &ViewState,
    panels: &[Panel<'_>],
    shown: &[(PlotResponse<()>, Fit)],
    time: &Scale,
) {
    let ground = palette::ground(scene.dark);
    for (i, (panel, (response, _))) in panels.iter().zip(shown).enumerate() {
        let frame = *response.transform.frame();
        let painter = ui.painter().with_clip_rect(frame);
        let text = ui.visuals().text_color();
        if let Some(at) = scene.record.diverged_at.filter(|_| i == 0) {
            let x = response.transform.position_from_point_x(at);
            let label = format!("diverged at t = {}", Scale::plain("s").format(at, 4));
            // On the side where there is room.
            let (anchor, shift) =
                if x > frame.center().x { (Align2::RIGHT_BOTTOM, -4.0) } else { (Align2::LEFT_BOTTOM, 4.0) };
            let color = scene.color(Ink::Diverged);
            legend::tag(&painter, ui, anchor, pos2(x + shift, frame.bottom() - 4.0), &label, color, ground);
        }
        if let Some(sentence) = &panel.empty {
            legend::tag(&painter, ui, Align2::CENTER_CENTER, frame.center(), sentence, text, ground);
        }
    }
    let Some((response, pointer)) =
        shown.iter().find_map(|(r, _)| Some((&r.response, r.response.hover_pos()?))).filter(|(r, _)| !r.dragged())
    else {
        return;
    };
    let Some(curve) = panels.iter().flat_map(|p| &p.curves).max_by_key(|c| c.samples.values.len()) else { return };
    let abscissa = shown[0].0.transform.value_from_position(pointer).x;
    let Some(index) = curve.samples.nearest(abscissa) else { return };
    let t = curve.samples.at(index);
    for (panel, (plot, fit)) in panels.iter().zip(shown) {
        mark_values(ui, scene, state, panel, fit, &plot.transform, index, t);
    }
    read_out(scene, state, panels, shown, time, response, index, t);
}

#[expect(clippy::too_many_arguments, reason = "each is needed, none belongs with another")]
fn mark_values(
    ui: &Ui,
    scene: &Scene<'_>,
    state: &ViewState,
    panel: &Panel<'_>,
    fit: &Fit,
    transform: &PlotTransform,
    index: usize,
    t: f64,
) {
    let frame: Rect = *transform.frame();
    let painter = ui.painter().with_clip_rect(frame);
    let x = transform.position_from_point_x(t);
    painter.vline(x, frame.y_range(), Stroke::new(1.0, palette::cursor(scene.dark)));
    for curve in panel.curves.iter().filter(|c| c.part != Part::Ghost && !state.hidden.contains(&c.ink)) {
        if let Some(value) = curve.samples.values.get(index).filter(|v| v.is_finite()) {
            let at = pos2(x, transform.position_from_point_y(ordinate(panel, fit, *value)));
            painter.circle(at, 3.5, scene.color(curve.ink), Stroke::new(1.2, palette::ground(scene.dark)));
        }
    }
}

#[expect(clippy::too_many_arguments, reason = "each is needed, none belongs with another")]
fn read_out(
    scene: &Scene<'_>,
    state: &ViewState,
    panels: &[Panel<'_>],
    shown: &[(PlotResponse<()>, Fit)],
    time: &Scale,
    response: &egui::Response,
    index: usize,
    t: f64,
) {
    pointer::tooltip(response).show(|ui| {
        let decimals = (-(scene.interval() * time.factor).log10()).ceil().clamp(0.0, 9.0) as usize;
        let at = format!("{} {}", number::plain(t * time.factor, decimals), time.unit);
        let mut rows = vec![("t".to_owned(), at, ui.visuals().text_color())];
        for (panel, (_, fit)) in panels.iter().zip(shown) {
            let alone = panel.curves.iter().filter(|c| c.part != Part::Ghost).count() == 1;
            for curve in panel.curves.iter().filter(|c| c.part != Part::Ghost && !state.hidden.contains(&c.ink)) {
                if let Some(value) = curve.samples.values.get(index) {
                    let name = if alone { panel.symbol.clone() } else { format!("{} {}", panel.symbol, curve.name) };
                    rows.push((name, fit.scale.format(*value, 4), scene.color(curve.ink)));
                }
            }
        }
        table_of(ui, &rows);
    });
}

/// Names and values below each other, decimal points aligned.
pub(super) fn table_of(ui: &mut Ui, rows: &[(String, String, Color32)]) {
    let values: Vec<&str> = rows.iter().map(|r| r.1.as_str()).collect();
    let values = number::align_at_point(&values);
    egui::Grid::new("values at the pointer").num_columns(2).spacing([12.0, 2.0]).show(ui, |ui| {
        for ((name, _, color), value) in rows.iter().zip(values) {
            ui.colored_label(*color, name);
            ui.monospace(value);
            ui.end_row();
        }
    });
}

/// Clicks, double clicks and menus.
fn interact(
    ui: &Ui,
    scene: &Scene<'_>,
    state: &mut ViewState,
    panels: &[Panel<'_>],
    shown: &[(PlotResponse<()>, Fit)],
) -> Option<Request> {
    let mut asked = None;
    for (panel, (plot, _)) in panels.iter().zip(shown) {
        let response = &plot.response;
        if response.double_clicked() {
            state.cache.fit_all();
            ui.ctx().request_repaint();
        } else if response.clicked()
            && let Some(mark) = &panel.mark
            && let Some(pointer) = response.interact_pointer_pos()
        {
            let t = plot.transform.value_from_position(pointer).x;
            if (mark.from..=mark.to).contains(&t) {
                state.cache.go_to = Some(mark.surroundings());
                ui.ctx().request_repaint();
            }
        }
        if let Some(request) = menu(response, state, || table(scene, panels, plot.transform.bounds().range_x())) {
            asked = Some(request);
        }
    }
    // A plot changed the range that those above it were drawn with in this frame.
    let range = |p: &(PlotResponse<()>, Fit)| p.0.transform.bounds().range_x();
    if shown.windows(2).any(|w| range(&w[0]) != range(&w[1])) || state.cache.go_to.is_some() {
        ui.ctx().request_repaint();
    }
    asked
}

/// Lets the units of the axes of a plot be chosen by a click on their labels: symbol and unit of the abscissa and of the
/// ordinate, where they can be.
pub(super) fn choose_units(ui: &Ui, frame: &Rect, plot: impl Hash + Debug + Copy, axes: [Option<(&str, &str)>; 2]) {
    let left = Rect::from_x_y_ranges(frame.left() - AXIS_WIDTH..=frame.left() - 2.0, frame.y_range());
    let below = Rect::from_x_y_ranges(frame.x_range(), frame.bottom() + 2.0..=frame.bottom() + TIME_AXIS_HEIGHT);
    for ((axis, labels), which) in axes.into_iter().zip([below, left]).zip(["x", "y"]) {
        if let Some(axis) = axis {
            display::on_axis(ui, labels, (plot, which), axis);
        }
    }
}

/// The menu of a plot's right button.
pub(super) fn menu(
    response: &egui::Response,
    state: &mut ViewState,
    table: impl FnOnce() -> String,
) -> Option<Request> {
    let mut asked = None;
    response.context_menu(|ui| {
        if ui.button("Show all").on_hover_text("Or double-click on the plot").clicked() {
            state.cache.fit_all();
            ui.close();
        }
        let copy = ui.button("Copy what is shown as CSV").clicked();
        if ui.button("Save what is shown as CSV…").clicked() {
            asked = Some(Request::SaveTable(table()));
            ui.close();
        } else if copy {
            ui.ctx().copy_text(table());
            ui.close();
        }
        if ui.button("Save picture…").clicked() {
            asked = Some(Request::SavePicture);
            ui.close();
        }
    });
    asked
}

/// The samples in a range of time, in the record's units.
fn table(scene: &Scene<'_>, panels: &[Panel<'_>], visible: std::ops::RangeInclusive<f64>) -> String {
    let curves: Vec<(&Panel<'_>, &Curve<'_>)> = panels
        .iter()
        .flat_map(|p| p.curves.iter().map(move |c| (p, c)))
        .filter(|(_, c)| c.part != Part::Ghost)
        .collect();
    let time = scene.samples(&[]);
    let most = curves.iter().map(|(_, c)| c.samples.values.len()).max().unwrap_or(0);
    let first = ((visible.start() - time.start) / time.interval).ceil().clamp(0.0, most as f64) as usize;
    let end = ((visible.end() - time.start) / time.interval).floor().clamp(-1.0, most as f64 - 1.0) + 1.0;
    let headers: Vec<String> = std::iter::once("t (s)".to_owned())
        .chain(curves.iter().map(|(p, c)| Scale::plain(p.unit.as_str()).axis(&format!("{} {}", p.symbol, c.name))))
        .collect();
    export::csv(&headers, (end as usize).saturating_sub(first), |row, column| match column {
        0 => Some(time.at(first + row)),
        _ => curves[column - 1].1.samples.values.get(first + row).copied(),
    })
}
