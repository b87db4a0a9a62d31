//! Segment length over threshold, each setting coloured by how well it does.

use egui::{
    Align2, Color32, FontId, Key, Pos2, Rect, Sense, Stroke, StrokeKind, TextStyle, Ui, WidgetInfo, pos2, vec2,
};
use serde::{Deserialize, Serialize};

use super::scene::Scene;
use super::{Picture, Request, ViewState, legend, panel};
use crate::app::plot::{export, number, palette, pointer};
use sindyscope_core::study::{GridCell, GridPoint, Judge, SettingsGrid};

/// What the map is coloured by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Quantity {
    /// Error of the simulated response on what was not fitted.
    #[default]
    Error,
    /// Number of terms.
    Terms,
    /// What the regression leaves of the rate.
    FitError,
    /// Whiteness of the response's error.
    Whiteness,
}

impl Quantity {
    const ALL: [Self; 4] = [Self::Error, Self::Terms, Self::FitError, Self::Whiteness];

    pub(super) fn label(self, judge: Judge) -> &'static str {
        match (self, judge) {
            (Self::Error, Judge::HeldOut) => "held-out error",
            (Self::Error, Judge::CrossValidation) => "cross-validated error",
            (Self::Terms, _) => "number of terms",
            (Self::FitError, _) => "fit error",
            (Self::Whiteness, _) => "whiteness",
        }
    }

    fn tooltip(self) -> &'static str {
        match self {
            Self::Error => "Error of the simulated response on what was not fitted, as a share of the motion",
            Self::Terms => "Terms that stay in the fitted equations",
            Self::FitError => {
                "What the regression leaves of the acceleration: small wherever there are many terms, right or wrong, \
                 so it is no guide"
            }
            Self::Whiteness => {
                "1 − the largest autocorrelation of the response's error: near 1 where the error is noise alone, near 0 \
                 where it is a motion that the model misses"
            }
        }
    }

    fn value(self, cell: &GridCell) -> f64 {
        match self {
            Self::Error => cell.error,
            Self::Terms => cell.terms as f64,
            Self::FitError => cell.fit_error,
            Self::Whiteness => cell.whiteness,
        }
    }

    fn logarithmic(self) -> bool {
        matches!(self, Self::Error | Self::FitError)
    }

    fn text(self, value: f64) -> String {
        match self {
            Self::Error | Self::FitError => percent(value),
            Self::Terms => format!("{value:.0}"),
            Self::Whiteness => number::significant_trimmed(value, 2),
        }
    }
}

/// A share in words.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", number::significant_trimmed(100.0 * share, 2))
}

/// The range of colours: values that are shown dark and bright.
struct Shades {
    quantity: Quantity,
    low: f64,
    high: f64,
}

impl Shades {
    fn new(map: &SettingsGrid, quantity: Quantity) -> Self {
        let values = map.known().map(|(_, cell)| quantity.value(cell)).filter(|v| v.is_finite());
        let (mut low, mut high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        match quantity {
            // An error as large as the motion is as bad as any.
            Quantity::Error | Quantity::FitError => {
                high = high.min(1.0).max(1.5 * low);
                low = low.max(1e-6 * high);
            }
            Quantity::Terms => high = high.max(low + 1.0),
            Quantity::Whiteness => (low, high) = (0.0, 1.0),
        }
        Self { quantity, low, high }
    }

    /// 0 at the worst, 1 at the best.
    fn share(&self, value: f64) -> f64 {
        let place = |v: f64| if self.quantity.logarithmic() { v.max(f64::MIN_POSITIVE).ln() } else { v };
        let share = (place(value) - place(self.low)) / (place(self.high) - place(self.low));
        let share = share.clamp(0.0, 1.0);
        if self.quantity == Quantity::Whiteness { share } else { 1.0 - share }
    }

    fn at(&self, share: f64) -> f64 {
        let share = if self.quantity == Quantity::Whiteness { share } else { 1.0 - share };
        if self.quantity.logarithmic() {
            self.low * (self.high / self.low).powf(share)
        } else {
            self.low + share * (self.high - self.low)
        }
    }
}

const LEFT: f32 = 52.0;
const RIGHT: f32 = 92.0;
const BOTTOM: f32 = 42.0;
const TOP: f32 = 6.0;

/// What the buttons and the legend say; shown above the map.
pub(super) fn header(ui: &mut Ui, picture: &Picture<'_>, state: &mut ViewState) {
    let judge = picture.search.map.map_or(Judge::CrossValidation, |m| m.judge);
    if state.printing {
        ui.strong(state.quantity.label(judge));
        return;
    }
    for quantity in Quantity::ALL {
        let on = state.quantity == quantity;
        let response = ui.selectable_label(on, quantity.label(judge)).on_hover_text(quantity.tooltip());
        if response.clicked() {
            state.quantity = quantity;
        }
    }
}

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, picture: &Picture<'_>, state: &mut ViewState) -> Option<Request> {
    let Some(map) = picture.search.map else {
        legend::note(ui, picture.search.failure.unwrap_or("Computing the map…"));
        return None;
    };
    legend::reading(
        ui,
        "Brighter is better: look for a wide bright plateau, not a single bright spot; a click takes the setting over.",
    );
    let gone = signs(ui, map, state.printing);
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Canvas, true, "Map of segment length and threshold"));
    let frame = Rect::from_min_max(rect.min + vec2(LEFT, TOP), rect.max - vec2(RIGHT, BOTTOM));
    if frame.width() < 20.0 || frame.height() < 20.0 {
        return None;
    }
    let grid = Grid { map, frame };
    let shades = Shades::new(map, state.quantity);
    cells(ui, scene, &grid, &shades, picture.search.stale);
    axes(ui, scene, &grid, rect);
    scale(ui, scene, &shades, map, frame, rect);
    let settings = &scene.outcome.settings;
    let now = grid.position(settings.smoothing.window as f64, settings.threshold);
    if let Some(place) = map.best {
        mark(ui, grid.cell(place).center(), Marker::Best);
    }
    if let Some(place) = map.parsimonious {
        mark(ui, grid.cell(place).center(), Marker::Parsimonious);
    }
    mark(ui, now, Marker::Now);
    let mut asked = None;
    if let Some(place) = response.hover_pos().and_then(|p| grid.place(p)).filter(|_| !state.printing) {
        ui.painter().rect_stroke(grid.cell(place), 0.0, Stroke::new(1.0, Color32::WHITE), StrokeKind::Inside);
        let at = response.hover_pos().and_then(|p| grid.place(p));
        if response.clicked() {
            asked = at.map(|place| take(map, place));
            response.request_focus();
        }
        tooltip(&response, map, place);
    }
    if response.has_focus() {
        ui.painter().rect_stroke(frame.expand(1.0), 0.0, ui.visuals().selection.stroke, StrokeKind::Outside);
        let filter = egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..Default::default() };
        ui.memory_mut(|m| m.set_focus_lock_filter(response.id, filter));
        if let Some((window, threshold)) = map.place_of(settings) {
            let pressed = |key| ui.input_mut(|i| i.consume_key(egui::Modifiers::NONE, key));
            let steps =
                [(Key::ArrowUp, 1, 0), (Key::ArrowDown, -1, 0), (Key::ArrowRight, 0, 1), (Key::ArrowLeft, 0, -1)];
            for (key, up, right) in steps {
                if pressed(key) {
                    let step = |at: usize, by: isize, count: usize| at.saturating_add_signed(by).min(count - 1);
                    let to = (step(window, up, map.windows.len()), step(threshold, right, map.thresholds.len()));
                    asked = Some(take(map, to));
                }
            }
        }
    }
    let menu = panel::menu(&response, state, || table(map));
    gone.or(asked).or(menu)
}

/// What a place asks for.
pub(super) fn take(map: &SettingsGrid, (window, threshold): GridPoint) -> Request {
    Request::Set { window: Some(map.windows[window]), threshold: map.thresholds[threshold] }
}

/// Where cells lie.
struct Grid<'a> {
    map: &'a SettingsGrid,
    frame: Rect,
}

impl Grid<'_> {
    fn cell(&self, (window, threshold): GridPoint) -> Rect {
        let (columns, rows) = (self.map.thresholds.len() as f32, self.map.windows.len() as f32);
        let x = |k: usize| self.frame.left() + self.frame.width() * k as f32 / columns;
        let y = |k: usize| self.frame.bottom() - self.frame.height() * k as f32 / rows;
        Rect::from_min_max(pos2(x(threshold), y(window + 1)), pos2(x(threshold + 1), y(window)))
    }

    fn place(&self, at: Pos2) -> Option<GridPoint> {
        if !self.frame.contains(at) {
            return None;
        }
        let share = |value: f32, count: usize| ((value * count as f32) as usize).min(count.saturating_sub(1));
        let window = share((self.frame.bottom() - at.y) / self.frame.height(), self.map.windows.len());
        Some((window, share((at.x - self.frame.left()) / self.frame.width(), self.map.thresholds.len())))
    }

    /// Where a setting between cells lies; at the edge if it is outside.
    fn position(&self, window: f64, threshold: f64) -> Pos2 {
        let windows: Vec<f64> = self.map.windows.iter().map(|w| *w as f64).collect();
        let share = |values: &[f64], wanted: f64| (index(values, wanted) + 0.5) / values.len().max(1) as f64;
        pos2(
            self.frame.left() + self.frame.width() * share(&self.map.thresholds, threshold) as f32,
            self.frame.bottom() - self.frame.height() * share(&windows, window) as f32,
        )
    }
}

/// Where a value lies among ascending ones, by logarithms.
fn index(values: &[f64], wanted: f64) -> f64 {
    let after = values.partition_point(|v| *v < wanted);
    match (after.checked_sub(1).map(|k| values[k]), values.get(after)) {
        (Some(a), Some(b)) => (after - 1) as f64 + (wanted / a).ln() / (b / a).ln(),
        (None, Some(_)) if wanted >= values[0] => 0.0,
        (None, _) => -0.3,
        (Some(_), None) => values.len() as f64 - 0.7,
    }
}

fn cells(ui: &Ui, scene: &Scene<'_>, grid: &Grid<'_>, shades: &Shades, stale: bool) {
    let painter = ui.painter();
    painter.rect_filled(grid.frame, 0.0, palette::grid(scene.dark));
    let mut mesh = egui::Mesh::default();
    let fade = if stale { 0.45 } else { 1.0 };
    for window in 0..grid.map.windows.len() {
        for threshold in 0..grid.map.thresholds.len() {
            let Some(cell) = grid.map.nearest((window, threshold)) else { continue };
            let value = shades.quantity.value(cell);
            let simulated = matches!(shades.quantity, Quantity::Error | Quantity::Whiteness);
            if !value.is_finite() || (simulated && cell.failed > 0.0) {
                continue;
            }
            let color = palette::shade(shades.share(value)).gamma_multiply(fade);
            mesh.add_colored_rect(grid.cell((window, threshold)), color);
        }
    }
    painter.add(mesh);
}

fn axes(ui: &Ui, scene: &Scene<'_>, grid: &Grid<'_>, rect: Rect) {
    let Grid { map, frame } = grid;
    let painter = ui.painter();
    let font = FontId::proportional(11.0);
    let color = ui.visuals().text_color();
    let line = Stroke::new(1.0, color);
    painter.rect_stroke(*frame, 0.0, Stroke::new(1.0, palette::cursor(scene.dark)), StrokeKind::Outside);
    if let (Some(low), Some(high)) = (map.thresholds.first(), map.thresholds.last()) {
        let (from, to) = (low.log10().floor() as i32, high.log10().ceil() as i32);
        let few = to - from > 3;
        let mut taken = f32::NEG_INFINITY;
        for power in from..=to {
            for digit in 1..10 {
                let value = f64::from(digit) * 10f64.powi(power);
                if !(*low..=*high).contains(&value) {
                    continue;
                }
                let x = grid.position(0.0, value).x;
                let labelled = digit == 1 || (!few && (digit == 2 || digit == 5));
                painter.vline(x, frame.bottom()..=frame.bottom() + if labelled { 5.0 } else { 3.0 }, line);
                if labelled {
                    let text = number::significant_trimmed(value, 1);
                    let galley = painter.layout_no_wrap(text, font.clone(), color);
                    let left = (x - galley.size().x / 2.0).min(rect.right() - galley.size().x);
                    if left > taken {
                        taken = left + galley.size().x + 4.0;
                        painter.galley(pos2(left, frame.bottom() + 6.0), galley, color);
                    }
                }
            }
        }
    }
    let label = TextStyle::Body.resolve(ui.style());
    let below = pos2(frame.center().x, rect.bottom() - 1.0);
    painter.text(below, Align2::CENTER_BOTTOM, "threshold", label.clone(), color);
    let mut free = f32::INFINITY;
    for (k, window) in map.windows.iter().enumerate() {
        let y = grid.cell((k, 0)).center().y;
        if y + 8.0 > free {
            continue;
        }
        free = y - 8.0;
        painter.hline(frame.left() - 4.0..=frame.left(), y, line);
        painter.text(pos2(frame.left() - 6.0, y), Align2::RIGHT_CENTER, window.to_string(), font.clone(), color);
    }
    upright(ui, "segment (samples)", pos2(rect.left() + 2.0, frame.center().y), label, color);
}

/// Text that reads upwards, its left edge at `at`.
fn upright(ui: &Ui, text: &str, at: Pos2, font: FontId, color: Color32) {
    let galley = ui.painter().layout_no_wrap(text.to_owned(), font, color);
    let at = pos2(at.x, at.y + galley.size().x / 2.0);
    ui.painter().add(egui::epaint::TextShape::new(at, galley, color).with_angle(-std::f32::consts::FRAC_PI_2));
}

/// The colours with their values.
fn scale(ui: &Ui, scene: &Scene<'_>, shades: &Shades, map: &SettingsGrid, frame: Rect, rect: Rect) {
    const PIECES: usize = 64;
    let bar = Rect::from_min_max(pos2(frame.right() + 14.0, frame.top()), pos2(frame.right() + 28.0, frame.bottom()));
    let mut mesh = egui::Mesh::default();
    let y = |share: f64| bar.bottom() - bar.height() * share as f32;
    for k in 0..PIECES {
        let (from, to) = (k as f64 / PIECES as f64, (k + 1) as f64 / PIECES as f64);
        let piece = Rect::from_x_y_ranges(bar.x_range(), y(to)..=y(from));
        mesh.add_colored_rect(piece, palette::shade(0.5 * (from + to)));
    }
    ui.painter().add(mesh);
    ui.painter().rect_stroke(bar, 0.0, Stroke::new(1.0, palette::cursor(scene.dark)), StrokeKind::Outside);
    let (font, color) = (FontId::proportional(11.0), ui.visuals().text_color());
    let steps = if shades.quantity == Quantity::Terms { ((shades.high - shades.low) as usize).clamp(1, 6) } else { 4 };
    for k in 0..=steps {
        let share = k as f64 / steps as f64;
        let at = pos2(bar.right() + 4.0, y(share).clamp(bar.top() + 6.0, bar.bottom() - 6.0));
        let more = k == 0 && matches!(shades.quantity, Quantity::Error | Quantity::FitError);
        let text = shades.quantity.text(shades.at(share));
        let text = if more { format!("≥ {text}") } else { text };
        ui.painter().text(at, Align2::LEFT_CENTER, text, font.clone(), color);
    }
    let label = TextStyle::Body.resolve(ui.style());
    let galley = ui.painter().layout_no_wrap(shades.quantity.label(map.judge).to_owned(), label.clone(), color);
    let x = rect.right() - galley.size().y - 1.0;
    upright(ui, shades.quantity.label(map.judge), pos2(x, frame.center().y), label, color);
}

/// A place that is marked.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Marker {
    Now,
    Best,
    Parsimonious,
}

impl Marker {
    const ALL: [(Self, &'static str); 3] = [
        (Self::Now, "now"),
        (Self::Best, "smallest error"),
        (Self::Parsimonious, "fewest terms within one standard error of it"),
    ];
}

/// Draws a sign: white with a dark edge, so that it shows on every colour.
pub(super) fn mark(ui: &Ui, at: Pos2, sign: Marker) {
    let painter = ui.painter();
    let (dark, light) = (Stroke::new(4.0, Color32::BLACK), Stroke::new(2.0, Color32::WHITE));
    for stroke in [dark, light] {
        match sign {
            Marker::Now => {
                painter.circle_stroke(at, 7.0, stroke);
            }
            Marker::Best => {
                painter.line_segment([at - vec2(5.0, 5.0), at + vec2(5.0, 5.0)], stroke);
                painter.line_segment([at - vec2(5.0, -5.0), at + vec2(5.0, -5.0)], stroke);
            }
            Marker::Parsimonious => {
                let corners = [vec2(0.0, -9.0), vec2(9.0, 0.0), vec2(0.0, 9.0), vec2(-9.0, 0.0)];
                painter.add(egui::Shape::closed_line(corners.map(|c| at + c).to_vec(), stroke));
            }
        }
    }
}

/// What the signs mean, and buttons that go there.
pub(super) fn signs(ui: &mut Ui, map: &SettingsGrid, printing: bool) -> Option<Request> {
    ui.horizontal(|ui| row(ui, map, printing)).inner
}

fn row(ui: &mut Ui, map: &SettingsGrid, printing: bool) -> Option<Request> {
    let mut asked = None;
    for (sign, text) in Marker::ALL {
        if sign != Marker::Now {
            ui.add_space(10.0);
        }
        let (rect, _) = ui.allocate_exact_size(vec2(20.0, legend::HEIGHT), Sense::hover());
        mark(ui, rect.center(), sign);
        let place = match sign {
            Marker::Now => None,
            Marker::Best => map.best,
            Marker::Parsimonious => map.parsimonious,
        };
        match place.filter(|_| !printing) {
            None => {
                ui.label(text);
            }
            Some(place) => {
                let button = egui::Button::new(text).frame_when_inactive(false).min_size(vec2(0.0, legend::HEIGHT));
                if ui.add(button).on_hover_text("Take this setting over").clicked() {
                    asked = Some(take(map, place));
                }
            }
        }
    }
    asked
}

/// What is known of a cell, at the pointer.
pub(super) fn tooltip(response: &egui::Response, map: &SettingsGrid, place: GridPoint) {
    let Some(cell) = map.cell(place) else { return };
    pointer::tooltip(response).show(|ui| {
        let color = ui.visuals().text_color();
        let error = if cell.failed > 0.0 { "diverges".to_owned() } else { percent(cell.error) };
        let whiteness =
            if cell.whiteness.is_finite() { number::significant_trimmed(cell.whiteness, 2) } else { "–".into() };
        let rows = [
            ("segment", format!("{}", map.windows[place.0])),
            ("threshold", number::significant_trimmed(map.thresholds[place.1], 3)),
            (Quantity::Error.label(map.judge), error),
            ("terms", cell.terms.to_string()),
            ("fit error", percent(cell.fit_error)),
            ("whiteness", whiteness),
        ];
        panel::table_of(ui, &rows.map(|(name, value)| (name.to_owned(), value, color)));
    });
}

/// Every cell that is known.
pub(super) fn table(map: &SettingsGrid) -> String {
    let headers = [
        "segment (samples)",
        "threshold",
        "error (share of the motion)",
        "share of stretches that diverged",
        "terms",
        "fit error (share of the rate)",
        "whiteness",
    ]
    .map(str::to_owned);
    let known: Vec<(GridPoint, &GridCell)> = map.known().collect();
    export::csv(&headers, known.len(), |row, column| {
        let ((window, threshold), cell) = known[row];
        Some(match column {
            0 => map.windows[window] as f64,
            1 => map.thresholds[threshold],
            2 => cell.error,
            3 => cell.failed,
            4 => cell.terms as f64,
            5 => cell.fit_error,
            _ => cell.whiteness,
        })
    })
}
