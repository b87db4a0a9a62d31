//! The window's painter of figures: zoom, values at the pointer, linked axes, legends and menus.

use std::collections::{BTreeSet, HashMap};

use egui::{Align, Align2, Id, Layout, Pos2, Rangef, Rect, Stroke, TextStyle, Ui, Vec2, WidgetInfo, pos2, vec2};
use egui_plot::{AxisHints, GridInput, GridMark, Plot, PlotMemory, PlotResponse, PlotUi};

use super::layers::{self, Drawn};
pub(crate) use super::look::{Look, ShownPanel, stamp};
use super::palette::{self, Ink};
use super::{display, legend, pointer, readout};
use sindyscope_report::figure::{Axis, Figure, Guide, Panel, PanelRow, Shape};
use sindyscope_report::palette::Tint;
use sindyscope_values::format::shown::ShownUnits;
use sindyscope_values::format::units::Scale;

/// Room left of every plot for its ticks and label, so that plots above each other are aligned, points.
pub(crate) const AXIS_WIDTH: f32 = 72.0;
/// The same of a small plot, whose ordinate is named above it.
const COMPACT_AXIS: f32 = 40.0;
/// Distance from which on the marks of a small plot's abscissa bear labels, points.
const COMPACT_APART: f32 = 42.0;
/// Height of an abscissa's ticks and label, points.
const ABSCISSA: f32 = 34.0;
/// Width from which on a line above a plot has room for all that it may say, points.
const ROOMY: f32 = 520.0;
/// Least height of a plot, points.
const LEAST: f32 = 44.0;
/// Distance of plots beside each other, points.
const GAP: f32 = 6.0;

/// What the painter remembers from frame to frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plots {
    drawn: HashMap<(Id, usize), Drawn>,
    /// What each plot was last fitted to; other data are fitted anew, the same data keep their zoom.
    fitted: HashMap<Id, u64>,
    /// Range to be shown on linked abscissae from the next frame on.
    go_to: Option<(f64, f64)>,
}

impl Plots {
    /// Shows all of the data again, in every plot, from the next frame on.
    pub(crate) fn fit_all(&mut self) {
        self.fitted.clear();
    }
}

/// What a person asked for in a figure.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Wish {
    /// Save these numbers.
    Table(String),
    /// Save a picture.
    Picture,
}

/// What came of drawing a figure.
pub(crate) struct PaintedFigure<'a> {
    pub(crate) shown: Vec<ShownPanel<'a>>,
    pub(crate) wish: Option<Wish>,
}

/// The bounds that each panel of a figure shows, as ranges of coordinates: how it is zoomed.
pub(crate) fn zoom(ctx: &egui::Context, place: &dyn Fn(&'static str) -> Id, panel: &Panel) -> Option<[(f64, f64); 2]> {
    let memory = PlotMemory::load(ctx, place(panel.id))?;
    let (min, max) = (memory.bounds().min(), memory.bounds().max());
    (min[0] < max[0] && min[1] < max[1]).then_some([(min[0], max[0]), (min[1], max[1])])
}

/// Draws a figure into all the room there is.
pub(crate) fn show<'a>(ui: &mut Ui, plots: &mut Plots, figure: &'a Figure, look: &mut Look<'_>) -> PaintedFigure<'a> {
    ui.visuals_mut().extreme_bg_color = palette::ground(ui.visuals().dark_mode);
    ui.spacing_mut().item_spacing.y = 2.0;
    let left = if look.compact { COMPACT_AXIS } else { AXIS_WIDTH };
    if !figure.legend.is_empty() {
        legend::line(ui, left, |ui| legend::entries(ui, &figure.legend, look));
    }
    let rows: Vec<(&PanelRow, Vec<&Panel>)> = figure.rows.iter().map(|row| (row, picked(row, look.pick))).collect();
    let shared = |k: usize| {
        let link = |k: usize| rows.get(k).and_then(|(_, panels)| panels.first()?.x.link);
        link(k).is_some() && link(k) == link(k + 1)
    };
    let headed = |panels: &[&Panel]| look.compact || panels.iter().any(|p| has_head(figure, p));
    let head = |k: usize| if headed(&rows[k].1) { legend::HEIGHT + ui.spacing().item_spacing.y } else { 0.0 };
    let heads: Vec<f32> = (0..rows.len()).map(head).collect();
    let below = |k: usize| if shared(k) { 0.0 } else { ABSCISSA };
    let spare = ui.spacing().item_spacing.y * rows.len() as f32;
    let fixed: f32 = spare + (0..rows.len()).map(|k| heads[k] + below(k)).sum::<f32>();
    let room = (ui.available_height() - fixed).max(LEAST * rows.len() as f32);
    let shares: f64 = rows.iter().map(|(row, _)| row.share).sum();
    let mut shown: Vec<ShownPanel<'a>> = Vec::new();
    for (k, (row, panels)) in rows.iter().enumerate() {
        let height = room * (row.share / shares) as f32 + below(k);
        let width = (ui.available_width() - GAP * panels.len().saturating_sub(1) as f32) / panels.len().max(1) as f32;
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = GAP;
            for panel in panels {
                let size = vec2(width, height + heads[k]);
                ui.allocate_ui_with_layout(size, Layout::top_down(Align::Min), |ui| {
                    ui.set_max_width(width);
                    if heads[k] > 0.0 {
                        head_line(ui, plots, figure, panel, look);
                    }
                    let plot = panel_plot(ui, plots, panel, look, (height, !shared(k)));
                    shown.push(ShownPanel { panel, plot });
                });
            }
        });
    }
    plots.go_to = None;
    readout::show(ui, figure, &shown, look);
    let wish = interact(ui, plots, figure, &shown, look);
    PaintedFigure { shown, wish }
}

/// The panels of a row that are shown.
fn picked(row: &PanelRow, pick: Option<usize>) -> Vec<&Panel> {
    match row.one_of {
        Some(own) => row.panels.get(pick.unwrap_or(own)).or(row.panels.last()).into_iter().collect(),
        None => row.panels.iter().collect(),
    }
}

fn has_head(figure: &Figure, panel: &Panel) -> bool {
    !panel.title.is_empty()
        || panel.keys().iter().any(|key| !figure.legend.contains(key))
        || panel.guides.iter().any(|g| matches!(g, Guide::Stretches { text, .. } if !text.is_empty()))
}

/// The line above a plot: its keys, and at its right what it shows and what is shaded.
fn head_line(ui: &mut Ui, plots: &mut Plots, figure: &Figure, panel: &Panel, look: &mut Look<'_>) {
    let dark = ui.visuals().dark_mode;
    let roomy = ui.available_width() >= ROOMY;
    let keys: Vec<_> = panel.keys().into_iter().filter(|key| !figure.legend.contains(key)).collect();
    let left = match (look.compact, roomy || keys.is_empty()) {
        (false, true) => AXIS_WIDTH,
        _ => 4.0,
    };
    legend::line(ui, left, |ui| {
        if look.compact {
            let scale = panel.y.scale(&display::chosen(ui.ctx()));
            ui.label(egui::RichText::new(panel.y.title(&scale)).size(11.5));
        } else {
            legend::entries(ui, &keys, look);
        }
        let title = egui::RichText::new(&panel.title).size(12.5);
        if keys.is_empty() && !panel.title.is_empty() && !look.compact {
            ui.add(egui::Label::new(title).truncate());
            return;
        }
        let mut room = ui.available_width();
        if !look.compact {
            room -= legend::to_come(ui, panel);
        }
        let said = stretches_said(ui, panel, room);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            for StretchesSaid { tint, first, text, whole } in said {
                let worst = if tint == Tint::Worst { first } else { None };
                match worst {
                    _ if text.is_empty() => {}
                    Some(stretch) => {
                        let hint = "Go there; so does a click on the shaded stretch";
                        if ui.link(text).on_hover_text(hint).clicked() {
                            plots.go_to = Some(surroundings(stretch));
                        }
                    }
                    None => {
                        ui.label(text).on_hover_text(whole);
                    }
                }
                legend::swatch(ui, palette::tint(tint, dark)).on_hover_text(whole);
            }
            if !panel.title.is_empty() {
                ui.add(egui::Label::new(title.weak()).truncate());
            }
        });
    });
}

/// What a line says of shaded stretches.
struct StretchesSaid<'a> {
    tint: Tint,
    /// The first of them, from and to.
    first: Option<(f64, f64)>,
    /// What is written beside the shade; empty: there is no room for words.
    text: &'a str,
    /// All there is to say.
    whole: &'a str,
}

/// What is said of the shaded stretches of a panel in this width, their shades included: everything; where that has no room, the widest is
/// shortened, in the end to its shade alone, until all fit.
fn stretches_said<'a>(ui: &Ui, panel: &'a Panel, width: f32) -> Vec<StretchesSaid<'a>> {
    let mut said: Vec<StretchesSaid<'a>> = panel
        .guides
        .iter()
        .filter_map(|guide| match guide {
            Guide::Stretches { tint, stretches, text } if !text.is_empty() => {
                Some(StretchesSaid { tint: *tint, first: stretches.first().copied(), text, whole: text })
            }
            _ => None,
        })
        .collect();
    let wide = |s: &StretchesSaid<'_>| legend::text_width(ui, s.text);
    let spacing = ui.spacing().item_spacing.x;
    let needed =
        |s: &StretchesSaid<'_>| legend::SWATCH + spacing + if s.text.is_empty() { 0.0 } else { wide(s) + spacing };
    while said.iter().map(needed).sum::<f32>() > width {
        let with_words = said.iter_mut().filter(|s| !s.text.is_empty());
        let Some(widest) = with_words.max_by(|a, b| wide(a).total_cmp(&wide(b))) else { break };
        widest.text = shortened(widest.text);
    }
    said
}

/// The words without their last part: what stands before a bracket, a comma or a time, then before a number, then nothing.
fn shortened(text: &str) -> &str {
    let part = ["(", ",", " at "].into_iter().filter_map(|sign| text.find(sign)).min();
    let end = part.or_else(|| text.find(|c: char| c.is_ascii_digit())).unwrap_or(0);
    text[..end].trim_end()
}

/// A stretch with as much before and after it.
fn surroundings((from, to): (f64, f64)) -> (f64, f64) {
    let length = to - from;
    (from - length, to + length)
}

/// Marks of an axis as the plot takes them.
fn spacer(axis: &Axis, spacing: f64) -> impl Fn(GridInput) -> Vec<GridMark> {
    move |input| {
        let marks = axis.marks(input.bounds, input.base_step_size, spacing);
        marks.into_iter().map(|m| GridMark { value: m.at, step_size: m.step }).collect()
    }
}

fn label<'a>(axis: &'a Axis, scale: &'a Scale) -> impl Fn(GridMark, &std::ops::RangeInclusive<f64>) -> String + 'a {
    move |mark, _| axis.label(sindyscope_report::figure::TickMark { at: mark.value, step: mark.step_size }, scale)
}

/// A panel as a plot of this height, its abscissa labelled or not.
fn panel_plot(
    ui: &mut Ui,
    plots: &mut Plots,
    panel: &Panel,
    look: &Look<'_>,
    (height, labelled): (f32, bool),
) -> PlotResponse<()> {
    let dark = ui.visuals().dark_mode;
    let id = (look.place)(panel.id);
    let must_fit = plots.fitted.insert(id, look.data) != Some(look.data);
    let units = display::chosen(ui.ctx());
    let y_range = panel.shown_y(look.hidden.as_deref().unwrap_or(&BTreeSet::new()));
    let y_axis = Axis { range: y_range, ..panel.y.clone() };
    let scales = [panel.x.scale(&units), y_axis.scale(&units)];
    let cells = panel.layers.iter().find_map(|layer| match &layer.shape {
        Shape::Cells(cells) => Some(cells),
        _ => None,
    });
    let width = ui.available_width() - cells.map_or(0.0, |cells| legend::colours_width(ui, cells, &units));
    let memory = PlotMemory::load(ui.ctx(), id).filter(|_| !must_fit);
    let go_to = plots.go_to.filter(|_| panel.x.link.is_some());
    let bounds = seen(memory.as_ref(), go_to, [panel.x.range, y_range]);
    let pixels = [width, height].map(|points| f64::from((points * ui.ctx().pixels_per_point()).max(100.0)));
    for (k, layer) in panel.layers.iter().enumerate() {
        plots.drawn.entry((id, k)).or_default().prepare(layer, panel, bounds, pixels);
    }
    let drawn: Vec<&Drawn> = (0..panel.layers.len()).filter_map(|k| plots.drawn.get(&(id, k))).collect();
    let auto_y = memory.as_ref().is_none_or(|m| m.auto_bounds.y);
    // A title as long as the plot is high may run into the line above it, not into the plot there.
    let along = height + legend::HEIGHT - if labelled { ABSCISSA } else { 0.0 };
    let fits = |title: &String| legend::text_width(ui, title) <= along;
    let y_title = [y_axis.title(&scales[1]), scales[1].unit.clone()].into_iter().find(fits).unwrap_or_default();
    let mut plot = framed(Plot::new(id).id(id), panel, &y_axis, &scales, vec2(width, height), look.compact)
        .y_axis_label(if look.compact { String::new() } else { y_title })
        .show_axes([labelled, true])
        .grid_color(palette::grid(dark));
    if let Some(link) = panel.x.link {
        plot = plot.link_axis(Id::unique(link), [true, false]).allow_drag([true, !auto_y]);
    }
    if panel.fixed {
        plot = plot.allow_drag(false).allow_zoom(false).allow_boxed_zoom(false).sense(look.sense);
    }
    let draw = |plot: &mut PlotUi<'_>| {
        if must_fit || panel.fixed || plot.response().double_clicked() {
            plot.set_auto_bounds(true);
        } else if let Some((from, to)) = go_to {
            plot.set_plot_bounds_x(from..=to);
        } else {
            wheel(plot, panel);
        }
    };
    let shown = ui.scope(|ui| {
        if look.compact {
            ui.style_mut().text_styles.insert(TextStyle::Body, small());
        }
        plot.show(ui, |plot| {
            draw(plot);
            layers::draw(plot, panel, &y_axis, &drawn, look, dark);
        })
    });
    let response = shown.inner;
    response.response.widget_info(|| WidgetInfo::labeled(egui::Role::Canvas, true, look.name));
    after(ui, panel, look, &response, &units);
    response
}

/// What a plot shows: where it is sent, else as it was moved, else all of its ranges.
fn seen(memory: Option<&PlotMemory>, go_to: Option<(f64, f64)>, ranges: [(f64, f64); 2]) -> [(f64, f64); 2] {
    let moved = |axis: usize| {
        let memory = memory.filter(|m| !m.auto_bounds[axis])?;
        Some((memory.bounds().min()[axis], memory.bounds().max()[axis]))
    };
    [go_to.or(moved(0)).unwrap_or(ranges[0]), moved(1).unwrap_or(ranges[1])]
}

/// Small letters, which may stand closer.
fn small() -> egui::FontId {
    egui::FontId::proportional(10.5)
}

/// A plot with its size, ranges, grid and labelled axes.
fn framed<'a>(
    plot: Plot<'a>,
    panel: &'a Panel,
    y_axis: &'a Axis,
    scales: &'a [Scale; 2],
    size: Vec2,
    compact: bool,
) -> Plot<'a> {
    // Labels of a narrow plot stand closer.
    let apart = match (compact, size.x < 380.0) {
        (true, _) => f64::from(COMPACT_APART / 8.0),
        (false, true) => 7.6,
        (false, false) => 10.0,
    };
    let above = match (compact, panel.x.link.is_some()) {
        (true, _) => 2.6,
        (false, true) => 3.75,
        (false, false) => 4.5,
    };
    let logarithmic = panel.x.logarithmic || panel.y.logarithmic;
    let plot = plot
        .width(size.x)
        .height(size.y)
        .y_axis_min_width(if compact { COMPACT_AXIS } else { AXIS_WIDTH })
        .x_axis_label(panel.x.title(&scales[0]))
        .x_grid_spacer(spacer(&panel.x, apart))
        .y_grid_spacer(spacer(y_axis, above))
        .x_axis_formatter(label(&panel.x, &scales[0]))
        .y_axis_formatter(label(y_axis, &scales[1]))
        .grid_fade(if logarithmic { 0.3 } else { 0.0 })
        .show_background(true)
        .default_x_bounds(panel.x.range.0, panel.x.range.1)
        .default_y_bounds(y_axis.range.0, y_axis.range.1)
        .show_x(false)
        .show_y(false)
        .allow_scroll(false);
    if !compact {
        return plot;
    }
    let x = AxisHints::new_x().label(panel.x.title(&scales[0])).formatter(label(&panel.x, &scales[0]));
    let y = AxisHints::new_y().formatter(label(y_axis, &scales[1])).min_thickness(COMPACT_AXIS);
    let spacing = Rangef::new(COMPACT_APART - 12.0, COMPACT_APART);
    plot.custom_x_axes(vec![x.label_spacing(spacing).tick_label_font(small())])
        .custom_y_axes(vec![y.label_spacing(Rangef::new(14.0, 20.0)).tick_label_font(small())])
}

/// The wheel zooms along time or frequency, elsewhere both ways.
fn wheel(plot: &mut PlotUi<'_>, panel: &Panel) {
    if panel.x.link.is_some() {
        pointer::wheel(plot);
        return;
    }
    let scroll = plot.ctx().input(|i| i.smooth_scroll_delta.y);
    if scroll != 0.0 && plot.response().contains_pointer() {
        let factor = (scroll / 240.0).exp();
        let along = readout::reads_along(panel);
        plot.zoom_bounds_around_hovered(if along { vec2(factor, 1.0) } else { Vec2::splat(factor) });
    }
}

/// What is drawn over a plot: texts of guides, signs, the colours of cells, and where units are chosen.
fn after(ui: &Ui, panel: &Panel, look: &Look<'_>, plot: &PlotResponse<()>, units: &ShownUnits) {
    let dark = ui.visuals().dark_mode;
    let frame = *plot.transform.frame();
    let painter = ui.painter().with_clip_rect(frame);
    let (ground, text_color) = (palette::ground(dark), ui.visuals().text_color());
    let place = |value: [f64; 2]| -> Pos2 {
        let (x, y) = (panel.x.coordinate(value[0]), panel.y.coordinate(value[1]));
        pos2(plot.transform.position_from_point_x(x), plot.transform.position_from_point_y(y))
    };
    for guide in &panel.guides {
        match guide {
            Guide::At { ink, at, text } if !text.is_empty() => {
                let x = plot.transform.position_from_point_x(panel.x.coordinate(*at));
                // On the side where there is room.
                let right = x > frame.center().x;
                let low = *ink == Ink::Diverged;
                let anchor = match (right, low) {
                    (true, true) => Align2::RIGHT_BOTTOM,
                    (false, true) => Align2::LEFT_BOTTOM,
                    (true, false) => Align2::RIGHT_TOP,
                    (false, false) => Align2::LEFT_TOP,
                };
                let y = if low { frame.bottom() - 4.0 } else { frame.top() + 4.0 };
                let color = if low { look.color(*ink, dark) } else { text_color };
                let at = pos2(x + if right { -4.0 } else { 4.0 }, y);
                legend::tag(&painter, ui, anchor, at, text, color, ground);
            }
            Guide::Sign { sign, at } => {
                let at = place(*at);
                if frame.expand(1.0).contains(at) {
                    legend::sign(&painter, at, *sign);
                }
            }
            _ => {}
        }
    }
    if panel.layers.iter().all(|l| matches!(&l.shape, Shape::Samples(s) if s.values.is_empty()))
        && !panel.note.is_empty()
    {
        legend::tag(&painter, ui, Align2::CENTER_CENTER, frame.center(), &panel.note, text_color, ground);
    }
    for layer in &panel.layers {
        if let Shape::Cells(cells) = &layer.shape {
            layers::cells(&painter, cells, &plot.transform, look.strength, dark);
            legend::colours(ui, frame, cells, units);
        }
    }
    let axis_width = if look.compact { COMPACT_AXIS } else { AXIS_WIDTH };
    let labels = [
        Rect::from_x_y_ranges(frame.x_range(), frame.bottom() + 2.0..=frame.bottom() + ABSCISSA),
        Rect::from_x_y_ranges(frame.left() - axis_width..=frame.left() - 2.0, frame.y_range()),
    ];
    for ((axis, labels), which) in [&panel.x, &panel.y].into_iter().zip(labels).zip(["x", "y"]) {
        if !axis.logarithmic && (axis.link.is_none() || which == "y") && look.hidden.is_some() {
            display::on_axis(ui, labels, ((look.place)(panel.id), which), (&axis.symbol, &axis.unit));
        }
    }
}

/// Clicks, double clicks and menus.
fn interact(ui: &Ui, plots: &mut Plots, figure: &Figure, shown: &[ShownPanel<'_>], look: &Look<'_>) -> Option<Wish> {
    let mut wish = None;
    for ShownPanel { panel, plot } in shown {
        let response = &plot.response;
        if response.double_clicked() {
            plots.fit_all();
            ui.ctx().request_repaint();
        } else if response.clicked()
            && let Some(pointer) = response.interact_pointer_pos()
        {
            let x = plot.transform.value_from_position(pointer).x;
            let worst = panel.guides.iter().find_map(|guide| match guide {
                Guide::Stretches { tint: Tint::Worst, stretches, text } if !text.is_empty() => stretches.first(),
                _ => None,
            });
            if let Some(stretch) = worst.filter(|s| (s.0..=s.1).contains(&x)) {
                plots.go_to = Some(surroundings(*stretch));
                ui.ctx().request_repaint();
            }
        }
        if panel.fixed && !look.sense.senses_click() {
            continue;
        }
        let table = || figure.table(panel, &plot.transform.bounds().range_x());
        wish = menu(response, plots, panel, table).or(wish);
    }
    // A plot changed the range that those above it were drawn with in this frame.
    let linked = |s: &&ShownPanel<'_>| s.panel.x.link.is_some();
    let ranges: Vec<_> = shown.iter().filter(linked).map(|s| s.plot.transform.bounds().range_x()).collect();
    if ranges.windows(2).any(|w| w[0] != w[1]) || plots.go_to.is_some() {
        ui.ctx().request_repaint();
    }
    wish
}

/// The menu of a plot's right button.
fn menu(response: &egui::Response, plots: &mut Plots, panel: &Panel, table: impl FnOnce() -> String) -> Option<Wish> {
    let mut wish = None;
    response.context_menu(|ui| {
        if !panel.fixed && ui.button("Show all").on_hover_text("Or double-click on the plot").clicked() {
            plots.fit_all();
            ui.close();
        }
        wish = entries(ui, table);
    });
    wish
}

/// The entries of a menu that take a figure along.
pub(crate) fn entries(ui: &mut Ui, table: impl FnOnce() -> String) -> Option<Wish> {
    let mut wish = None;
    let copy = ui.button("Copy what is shown as CSV").clicked();
    if ui.button("Save what is shown as CSV…").clicked() {
        wish = Some(Wish::Table(table()));
        ui.close();
    } else if copy {
        ui.ctx().copy_text(table());
        ui.close();
    }
    if ui.button("Save picture…").on_hover_text("As SVG, PDF or PNG, at a size on paper").clicked() {
        wish = Some(Wish::Picture);
        ui.close();
    }
    wish
}

/// Draws a line over every plot of a figure, at an abscissa.
pub(crate) fn line_at(ui: &Ui, painted: &PaintedFigure<'_>, abscissa: f64, stroke: Stroke) {
    for ShownPanel { plot, .. } in &painted.shown {
        let area = *plot.transform.frame();
        let x = plot.transform.position_from_point_x(abscissa);
        if area.x_range().contains(x) {
            ui.painter().vline(x, area.y_range(), stroke);
        }
    }
}
