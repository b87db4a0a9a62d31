//! Each term's coefficient along the threshold.

use egui::{Align2, Color32, Id, Sense, Stroke, TextStyle, Ui, WidgetInfo, pos2, vec2};
use egui_plot::{Line, LineStyle, Plot, PlotPoint, PlotPoints, VLine};

use super::panel::{self, AXIS_WIDTH};
use super::scene::Scene;
use super::{Request, View, ViewState, legend};
use crate::app::plot::{axis, export, number, palette, pointer};
use sindyscope_core::study::{EquationFit, PathTerm, Scaling};

const ID: &str = "path";

/// Inks of the terms, before their lines are dashed.
const INKS: usize = 7;

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState) -> Option<Request> {
    let fits = &scene.outcome.fits;
    let Some(fit) = fits.get(state.freedom.min(fits.len().saturating_sub(1))).filter(|f| !f.path.is_empty()) else {
        legend::note(ui, "No term of the library can be used: there is no path to show");
        return None;
    };
    legend::reading(
        ui,
        "Each line is a term; where it ends the term drops out. A coefficient that stays level while others drop can be \
         trusted; one that jumps stood in for them. A click sets the threshold.",
    );
    names(ui, scene, fit);
    let raw = state.raw_path;
    let log = raw || !state.signed_path;
    let threshold = scene.outcome.settings.threshold;
    let (low, high) = range(fit);
    let (left, right) = (low.log10(), high.log10());
    let value = |term: &PathTerm, c: f64| match (raw, log) {
        (true, _) => c.abs().log10(),
        (false, true) => (c * term.standard).abs().log10(),
        (false, false) => c * term.standard,
    };
    let curves: Vec<Vec<Vec<PlotPoint>>> = fit.path.iter().map(|term| runs(term, low, high, &value)).collect();
    let values = curves.iter().flatten().flatten().map(|p| p.y).filter(|y| y.is_finite());
    let (bottom, top) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(y), b.max(y)));
    let margin = 0.06 * (top - bottom).max(0.1);
    let id = Id::unique(("view", View::Path, ID, raw, log, state.freedom));
    let must_fit = state.cache.must_fit(
        View::Path,
        match (raw, log) {
            (true, _) => "raw",
            (false, true) => "standard",
            (false, false) => "signed",
        },
    );
    let plain = crate::app::plot::units::Scale::plain("");
    let mut plot = Plot::new(ID)
        .id(id)
        .height(ui.available_height())
        .y_axis_min_width(AXIS_WIDTH)
        .x_axis_label("threshold")
        .x_axis_formatter(|mark, _| axis::decade_label(mark, ""))
        .x_grid_spacer(axis::decade_marks)
        .grid_color(palette::grid(scene.dark))
        .grid_fade(0.3)
        .default_x_bounds(left, right)
        .default_y_bounds(bottom - margin, top + margin)
        .show_x(false)
        .show_y(false)
        .allow_scroll(false);
    plot = if log {
        plot.y_axis_label(if raw { "magnitude of the coefficient" } else { "magnitude as a share of the rate's RMS" })
            .y_grid_spacer(axis::decade_marks)
            .y_axis_formatter(|mark, _| axis::decade_label(mark, ""))
    } else {
        plot.y_axis_label("coefficient, as a share of the rate's RMS")
            .y_grid_spacer(axis::round_marks(5.0))
            .y_axis_formatter(move |mark, _| axis::linear_label(mark, &plain))
    };
    let response = plot.show(ui, |plot| {
        if must_fit {
            plot.set_auto_bounds(true);
        }
        for (k, runs) in curves.iter().enumerate() {
            for run in runs {
                let line = Line::new("", PlotPoints::Borrowed(run)).stroke(Stroke::new(2.0, ink(k, scene.dark)));
                plot.line(line.style(style(k)).allow_hover(false).allow_band(false));
            }
        }
        let now =
            VLine::new("", threshold.max(0.5 * low).log10()).stroke(Stroke::new(1.5, palette::cursor(scene.dark)));
        plot.vline(now.style(LineStyle::Dashed { length: 6.0 }).allow_hover(false));
    });
    let plot = &response.response;
    plot.widget_info(|| WidgetInfo::labeled(egui::Role::Canvas, true, "Coefficients along the threshold"));
    let frame = *response.transform.frame();
    let x = response.transform.position_from_point_x(threshold.max(0.5 * low).log10());
    if frame.x_range().contains(x) && !state.printing {
        let painter = ui.painter().with_clip_rect(frame);
        let text = format!("now {}", number::significant_trimmed(threshold, 3));
        let (anchor, shift) = if x > frame.center().x { (Align2::RIGHT_TOP, -4.0) } else { (Align2::LEFT_TOP, 4.0) };
        let at = pos2(x + shift, frame.top() + 4.0);
        legend::tag(&painter, ui, anchor, at, &text, ui.visuals().text_color(), palette::ground(scene.dark));
    }
    let mut asked = None;
    if plot.double_clicked() {
        state.cache.fit_all();
        ui.ctx().request_repaint();
    }
    if let Some(pointer) = plot.hover_pos().filter(|_| !plot.dragged() && !state.printing) {
        let x = response.transform.value_from_position(pointer).x;
        let at: f64 = format!("{:.2e}", 10f64.powf(x)).parse().unwrap_or(threshold);
        let at = at.clamp(low, high);
        if plot.clicked() {
            asked = Some(Request::Set { window: None, threshold: at });
        }
        pointer::tooltip(plot).show(|ui| {
            let mut rows =
                vec![("threshold".to_owned(), number::significant_trimmed(at, 3), ui.visuals().text_color())];
            for (k, term) in fit.path.iter().enumerate() {
                let c = coefficient(term, at);
                if c != 0.0 {
                    let shown = if raw { c } else { c * term.standard };
                    rows.push((term.term.pretty(&scene.layout), number::significant(shown, 4), ink(k, scene.dark)));
                }
            }
            panel::table_of(ui, &rows);
        });
    }
    asked.or(panel::menu(&response.response, state, || table(scene, fit)))
}

fn ink(term: usize, dark: bool) -> Color32 {
    // Two of the eight are blues.
    const TOLD_APART: [usize; INKS] = [0, 1, 2, 3, 4, 6, 7];
    palette::effect(TOLD_APART[term % INKS], dark)
}

fn style(term: usize) -> LineStyle {
    match term / INKS {
        0 => LineStyle::Solid,
        1 => LineStyle::Dashed { length: 8.0 },
        _ => LineStyle::Dotted { spacing: 4.0 },
    }
}

/// A line of names in the colours of their curves.
fn names(ui: &mut Ui, scene: &Scene<'_>, fit: &EquationFit) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(10.0, 1.0);
        let kept = |term: &PathTerm| coefficient(term, scene.outcome.settings.threshold) != 0.0;
        for (k, term) in fit.path.iter().enumerate() {
            let color = ink(k, scene.dark);
            let font = TextStyle::Body.resolve(ui.style());
            let text = if kept(term) { ui.visuals().strong_text_color() } else { ui.visuals().weak_text_color() };
            let galley = ui.painter().layout_no_wrap(term.term.pretty(&scene.layout), font, text);
            let (rect, response) = ui.allocate_exact_size(galley.size() + vec2(22.0, 2.0), Sense::hover());
            let ends = [pos2(rect.left(), rect.center().y), pos2(rect.left() + 18.0, rect.center().y)];
            match style(k) {
                LineStyle::Solid => {
                    ui.painter().line_segment(ends, Stroke::new(2.0, color));
                }
                _ => {
                    ui.painter().extend(egui::Shape::dashed_line(&ends, Stroke::new(2.0, color), 4.0, 3.0));
                }
            }
            ui.painter().galley(pos2(ends[1].x + 4.0, rect.top() + 1.0), galley, text);
            let drops = fit.drop_marks.iter().find(|(_, t)| *t == term.term).map(|(at, _)| *at);
            response.on_hover_text(match drops {
                Some(at) => format!("Drops out at {}", number::significant_trimmed(at, 3)),
                None => "Never drops out: it is locked in or fixed".into(),
            });
        }
    });
}

/// Thresholds that the plot reaches over.
fn range(fit: &EquationFit) -> (f64, f64) {
    let changes = fit.path.iter().flat_map(|t| &t.coefficients).map(|(from, _)| *from).filter(|from| *from > 0.0);
    let (low, high) = changes.fold((f64::INFINITY, 0.0_f64), |(a, b), from| (a.min(from), b.max(from)));
    if high > 0.0 { (0.4 * low.max(1e-6 * high), 1.6 * high) } else { (1e-3, 1.0) }
}

/// A term's coefficient at a threshold.
fn coefficient(term: &PathTerm, threshold: f64) -> f64 {
    // A coefficient as large as the threshold stays.
    let after = term.coefficients.partition_point(|(from, _)| *from < threshold).max(1);
    term.coefficients.get(after - 1).map_or(0.0, |(_, c)| *c)
}

/// Level stretches of a coefficient with the steps between them, in pieces where the term is in use.
fn runs(term: &PathTerm, low: f64, high: f64, value: &impl Fn(&PathTerm, f64) -> f64) -> Vec<Vec<PlotPoint>> {
    let mut runs: Vec<Vec<PlotPoint>> = vec![Vec::new()];
    for (k, (from, c)) in term.coefficients.iter().enumerate() {
        let to = term.coefficients.get(k + 1).map_or(high, |(from, _)| *from).max(low);
        if *c == 0.0 {
            runs.push(Vec::new());
            continue;
        }
        if let Some(run) = runs.last_mut() {
            let y = value(term, *c);
            run.extend([PlotPoint::new(from.max(low).log10(), y), PlotPoint::new(to.log10(), y)]);
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// Coefficients in the records' units, one row a stretch of thresholds.
fn table(scene: &Scene<'_>, fit: &EquationFit) -> String {
    let compares = match scene.outcome.settings.scaling {
        Scaling::Scaled => "threshold from (share)",
        Scaling::Raw => "threshold from",
    };
    let headers: Vec<String> =
        std::iter::once(compares.to_owned()).chain(fit.path.iter().map(|t| t.term.to_string())).collect();
    let rows = fit.path.first().map_or(0, |t| t.coefficients.len());
    export::csv(&headers, rows, |row, column| match column {
        0 => Some(fit.path[0].coefficients[row].0),
        _ => fit.path[column - 1].coefficients.get(row).map(|(_, c)| *c),
    })
}
