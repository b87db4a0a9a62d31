//! The window's own widgets: sections, switches, and the row of a setting.

use std::ops::RangeInclusive;

use egui::accesskit::{Action, ActionData};
use egui::text::{LayoutJob, TextFormat};
use egui::{
    Align, Color32, EventFilter, FontId, Id, InnerResponse, Key, Layout, Modifiers, Rect, Response, RichText, Sense,
    Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use super::theme::{self, ROW};
pub(crate) use sindyscope_core::setting::Spread;
use sindyscope_values::format::number::significant_trimmed;

/// Width of the labels' column, points.
const LABEL: f32 = 66.0;
/// Width of the typed values' column, points.
const VALUE: f32 = 62.0;
/// Width of the column of reset buttons, points.
const RESET: f32 = 18.0;
/// Radius of a slider's handle, points.
const HANDLE: f32 = 6.5;

/// A section of a side panel: a heading over a hairline, then what belongs to it.
pub(crate) fn section<R>(ui: &mut Ui, title: &str, aside: impl FnOnce(&mut Ui), body: impl FnOnce(&mut Ui) -> R) -> R {
    ui.add_space(6.0);
    let dark = ui.visuals().dark_mode;
    let heading =
        ui.allocate_ui_with_layout(vec2(ui.available_width(), ROW), Layout::left_to_right(Align::Center), |ui| {
            let color = ui.visuals().weak_text_color();
            ui.label(RichText::new(title).size(11.0).strong().color(color).extra_letter_spacing(0.8));
            ui.with_layout(Layout::right_to_left(Align::Center), aside);
        });
    let rect = heading.response.rect;
    let y = rect.bottom() - 1.0;
    ui.painter().hline(rect.x_range(), y, Stroke::new(1.0, theme::accents(dark).line));
    ui.add_space(1.0);
    body(ui)
}

/// A figure to be read at a glance, with what it is.
pub(crate) struct Headline<'a> {
    /// The figure and its unit.
    pub(crate) text: &'a str,
    pub(crate) color: Color32,
    pub(crate) label: &'a str,
    pub(crate) hint: &'a str,
}

/// Two figures in large type beside each other, their names beneath.
pub(crate) fn headlines(ui: &mut Ui, figures: [Headline<'_>; 2]) {
    const HEIGHT: f32 = 50.0;
    const LETTERS: f32 = 23.0;
    let size = vec2(ui.available_width(), HEIGHT);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Min), |ui| {
        ui.set_min_size(size);
        ui.spacing_mut().item_spacing.x = 0.0;
        let half = 0.5 * ui.available_width();
        for Headline { text, color, label, hint } in figures {
            ui.allocate_ui_with_layout(vec2(half, HEIGHT), Layout::top_down(Align::Min), |ui| {
                ui.set_min_width(half);
                ui.spacing_mut().item_spacing.y = 0.0;
                let (figure, unit) = text.split_once(' ').unwrap_or((text, ""));
                let mut job = LayoutJob::default();
                job.append(figure, 0.0, TextFormat::simple(FontId::proportional(LETTERS), color));
                // A unit as long as microstrain takes less room than the figure.
                let letters = if unit.chars().count() > 3 { 13.0 } else { LETTERS };
                job.append(unit, 5.0, TextFormat::simple(FontId::proportional(letters), color));
                ui.add(egui::Label::new(job).truncate()).on_hover_text(hint);
                ui.label(RichText::new(label).weak().size(12.0)).on_hover_text(hint);
            });
        }
    });
}

/// Two small buttons that lead to the record before and to the next one of so many; the one that was asked for.
pub(crate) fn record_steps(ui: &mut Ui, shown: usize, count: usize) -> Option<usize> {
    let step = |ui: &mut Ui, sign: &str, name: &str, to: Option<usize>| {
        let button = egui::Button::new(sign).small().frame(false);
        let response = ui.add_enabled(to.is_some(), button).on_hover_text(name);
        response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, to.is_some(), name));
        response.clicked().then_some(to).flatten()
    };
    let back = step(ui, "⏴", "Previous record", shown.checked_sub(1));
    let on = step(ui, "⏵", "Next record", Some(shown + 1).filter(|k| *k < count));
    back.or(on)
}

/// A line of a fixed height across all the room there is.
pub(crate) fn line<R>(ui: &mut Ui, height: f32, body: impl FnOnce(&mut Ui) -> R) -> InnerResponse<R> {
    let size = vec2(ui.available_width(), height);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_size(size);
        body(ui)
    })
}

/// A row of a fixed height with a label in the first column.
pub(crate) fn row<R>(ui: &mut Ui, label: &str, tooltip: &str, body: impl FnOnce(&mut Ui) -> R) -> R {
    let size = vec2(ui.available_width(), ROW);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        let name = label_cell(ui, label);
        name.on_hover_text(tooltip);
        body(ui)
    })
    .inner
}

fn label_cell(ui: &mut Ui, label: &str) -> Response {
    let size = vec2(LABEL, ROW);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_size(size);
        ui.add(egui::Label::new(label).truncate().selectable(false))
    })
    .inner
}

/// A switch between a few values; tells whether it was changed.
pub(crate) fn switch<T: Copy + PartialEq>(ui: &mut Ui, value: &mut T, choices: &[(T, &str, &str)]) -> bool {
    let mut changed = false;
    let dark = ui.visuals().dark_mode;
    egui::Frame::new().fill(ui.visuals().widgets.inactive.bg_fill).corner_radius(4).show(ui, |ui| {
        ui.spacing_mut().item_spacing.x = 0.0;
        for (choice, label, tooltip) in choices {
            let on = value == choice;
            let colors = theme::accents(dark);
            let text = RichText::new(*label).color(if on {
                ui.visuals().strong_text_color()
            } else {
                ui.visuals().weak_text_color()
            });
            let fill = if on { colors.accent_ground } else { Color32::TRANSPARENT };
            let button = egui::Button::new(text).fill(fill).stroke(Stroke::NONE).min_size(vec2(0.0, ROW - 2.0));
            let response = ui.add(button).on_hover_text(*tooltip);
            response.widget_info(|| WidgetInfo::selected(egui::Role::RadioButton, true, on, *label));
            if response.has_focus() {
                let ring = Stroke::new(1.0, colors.accent);
                ui.painter().rect_stroke(response.rect, 3.0, ring, StrokeKind::Inside);
            }
            if response.clicked() && !on {
                *value = *choice;
                changed = true;
            }
        }
    });
    changed
}

/// A small toggle: filled when on.
pub(crate) fn chip(ui: &mut Ui, label: &str, on: bool, partly: bool, tooltip: &str) -> Response {
    let colors = theme::accents(ui.visuals().dark_mode);
    let fill = if on { colors.accent_ground } else { Color32::TRANSPARENT };
    let line = if on || partly { colors.accent } else { colors.line };
    let text = if on || partly { ui.visuals().strong_text_color() } else { ui.visuals().weak_text_color() };
    let button = egui::Button::new(RichText::new(label).color(text))
        .fill(fill)
        .stroke(Stroke::new(1.0, line))
        .corner_radius(9)
        .min_size(vec2(0.0, ROW - 3.0));
    let response = ui.add(button).on_hover_text(tooltip);
    response.widget_info(|| WidgetInfo::selected(egui::Role::CheckBox, true, on, label));
    response
}

/// A tab above a figure, underlined while its view is shown; true if it was clicked.
pub(crate) fn tab(ui: &mut Ui, label: &str, hint: impl Into<egui::WidgetText>, on: bool) -> bool {
    let color = if on { ui.visuals().strong_text_color() } else { ui.visuals().weak_text_color() };
    let text = RichText::new(label).color(color);
    let button = egui::Button::new(text).frame_when_inactive(false).stroke(Stroke::NONE);
    let response = ui.add(button).on_hover_text(hint);
    response.widget_info(|| WidgetInfo::selected(egui::Role::Tab, true, on, label));
    if on {
        let accent = theme::accents(ui.visuals().dark_mode).accent;
        let line = response.rect.bottom() + 1.0;
        ui.painter().hline(response.rect.x_range().shrink(6.0), line, Stroke::new(2.0, accent));
    }
    response.clicked()
}

/// A button that is only a sign, with a name for those who do not see it.
pub(crate) fn icon(ui: &mut Ui, sign: &str, name: &str, hint: &str, enabled: bool) -> Response {
    let button = egui::Button::new(RichText::new(sign).size(15.0)).frame_when_inactive(false).min_size(vec2(26.0, ROW));
    let response = ui.add_enabled(enabled, button).on_hover_text(hint).on_disabled_hover_text(hint);
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, enabled, name));
    response
}

/// A mark on a slider's rail.
#[derive(Clone, Debug)]
pub(crate) struct Mark {
    pub(crate) at: f64,
    pub(crate) text: String,
}

/// The row of one setting: label, slider, typed value with its unit, and a reset where it was changed.
pub(crate) struct SliderRow<'a> {
    pub(crate) label: &'a str,
    pub(crate) tooltip: &'a str,
    pub(crate) unit: &'a str,
    pub(crate) range: RangeInclusive<f64>,
    pub(crate) spread: Spread,
    /// Values are this far apart, counted from the low end; zero for any value.
    pub(crate) grid: f64,
    /// What the program chose.
    pub(crate) suggestion: Option<f64>,
    pub(crate) marks: &'a [Mark],
    pub(crate) format: &'a dyn Fn(f64) -> String,
}

impl<'a> SliderRow<'a> {
    /// A row of any value within a range, evenly spread, shown with four digits.
    pub(crate) fn new(label: &'a str, tooltip: &'a str, range: RangeInclusive<f64>) -> Self {
        let (unit, spread, grid, suggestion, marks) = ("", Spread::Linear, 0.0, None, &[][..]);
        Self { label, tooltip, unit, range, spread, grid, suggestion, marks, format: &|v| significant_trimmed(v, 4) }
    }

    /// Draws the row; tells whether the value was changed.
    pub(crate) fn show(&self, ui: &mut Ui, value: &mut f64) -> bool {
        let before = *value;
        row(ui, self.label, self.tooltip, |ui| {
            let rail_width = (ui.available_width() - VALUE - RESET - 2.0 * ui.spacing().item_spacing.x).max(40.0);
            self.rail(ui, rail_width, value);
            self.typed(ui, value);
            self.reset(ui, value);
        });
        *value != before
    }

    fn low(&self) -> f64 {
        *self.range.start()
    }

    fn high(&self) -> f64 {
        *self.range.end()
    }

    /// Share of the rail left of a value.
    fn share(&self, value: f64) -> f64 {
        let (low, high) = (self.low(), self.high());
        let log = |v: f64, low: f64| ((v.max(low) / low).ln() / (high / low).ln()).clamp(0.0, 1.0);
        match self.spread {
            Spread::Linear => ((value - low) / (high - low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0),
            Spread::Logarithmic => log(value, low),
            // A tenth of the rail leads from zero to the smallest value.
            Spread::LogarithmicFromZero if value < low => 0.0,
            Spread::LogarithmicFromZero => 0.1 + 0.9 * log(value, low),
        }
    }

    fn value(&self, share: f64) -> f64 {
        let (low, high) = (self.low(), self.high());
        let share = share.clamp(0.0, 1.0);
        let log = |share: f64| low * (high / low).powf(share);
        let value = match self.spread {
            Spread::Linear => low + share * (high - low),
            Spread::Logarithmic => log(share),
            Spread::LogarithmicFromZero if share < 0.05 => 0.0,
            Spread::LogarithmicFromZero => log((share - 0.1).max(0.0) / 0.9),
        };
        self.on_grid(value)
    }

    fn on_grid(&self, value: f64) -> f64 {
        if self.grid > 0.0 {
            return (self.low() + ((value - self.low()) / self.grid).round() * self.grid)
                .clamp(self.low(), self.high());
        }
        if value == 0.0 || self.spread == Spread::Linear {
            return value;
        }
        // Three digits are more than a hand can aim at, and shorter to read.
        format!("{value:.2e}").parse().unwrap_or(value)
    }

    /// One step of an arrow key: a fortieth of the rail, finer with Shift, and never less than the grid.
    fn step(&self, value: f64, steps: f64, fine: bool) -> f64 {
        let share = self.share(value) + steps * if fine { 0.0025 } else { 0.025 };
        let there = self.value(share);
        if self.grid > 0.0 && (fine || (there - value).abs() < self.grid) {
            return self.on_grid(value + steps * self.grid);
        }
        there
    }

    fn rail(&self, ui: &mut Ui, width: f32, value: &mut f64) {
        let (rect, response) = ui.allocate_exact_size(vec2(width, ROW), Sense::click_and_drag());
        let ends = rect.x_range().shrink(HANDLE);
        let (x_of, share_of) =
            (|share: f64| ends.min + ends.span() * share as f32, |x: f32| f64::from((x - ends.min) / ends.span()));
        self.drag(ui, &response, value, &share_of);
        self.keys(ui, &response, value);
        self.actions(ui, response.id, value);
        let shown = *value;
        response.widget_info(|| WidgetInfo::slider(ui.is_enabled(), shown, self.label));
        let (low, high) = (self.low(), self.high());
        ui.ctx().accesskit_node_builder(response.id, |node| {
            node.set_min_numeric_value(low);
            node.set_max_numeric_value(high);
            node.add_action(Action::SetValue);
            node.add_action(Action::Increment);
            node.add_action(Action::Decrement);
        });
        self.paint(ui, rect, &response, x_of(self.share(shown)), &x_of);
        let near = response.hover_pos().and_then(|p| {
            let by_distance = |m: &&Mark| (x_of(self.share(m.at)) - p.x).abs();
            self.marks.iter().filter(|m| by_distance(m) < 4.0).min_by(|a, b| by_distance(a).total_cmp(&by_distance(b)))
        });
        response.on_hover_text(near.map_or(self.tooltip, |m| m.text.as_str()));
    }

    fn drag(&self, ui: &Ui, response: &Response, value: &mut f64, share_of: &impl Fn(f32) -> f64) {
        if response.double_clicked() {
            if let Some(suggestion) = self.suggestion {
                *value = suggestion;
            }
            return;
        }
        let Some(pointer) = response.interact_pointer_pos().filter(|_| response.is_pointer_button_down_on()) else {
            return;
        };
        // Shift makes the handle follow at a tenth of the pace, from where it was.
        let anchor = response.id.with("anchor");
        if ui.input(|i| i.modifiers.shift) {
            let (x, share): (f32, f64) =
                ui.data_mut(|d| *d.get_temp_mut_or_insert_with(anchor, || (pointer.x, self.share(*value))));
            *value = self.value(share + 0.1 * (share_of(pointer.x) - share_of(x)));
        } else {
            ui.data_mut(|d| d.remove::<(f32, f64)>(anchor));
            *value = self.value(share_of(pointer.x));
        }
        response.request_focus();
    }

    fn keys(&self, ui: &Ui, response: &Response, value: &mut f64) {
        if !response.has_focus() {
            return;
        }
        let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|m| m.set_focus_lock_filter(response.id, filter));
        for (key, sign) in [(Key::ArrowRight, 1.0), (Key::ArrowUp, 1.0), (Key::ArrowLeft, -1.0), (Key::ArrowDown, -1.0)]
        {
            for (modifiers, fine) in [(Modifiers::SHIFT, true), (Modifiers::NONE, false)] {
                let presses = ui.input_mut(|i| i.count_and_consume_key(modifiers, key));
                for _ in 0..presses {
                    *value = self.step(*value, sign, fine);
                }
            }
        }
    }

    /// What screen readers (and tests) ask for.
    fn actions(&self, ui: &Ui, id: Id, value: &mut f64) {
        ui.input(|i| {
            let steps = i.num_accesskit_action_requests(id, Action::Increment) as f64
                - i.num_accesskit_action_requests(id, Action::Decrement) as f64;
            if steps != 0.0 {
                *value = self.step(*value, steps, false);
            }
            for request in i.accesskit_action_requests(id, Action::SetValue) {
                if let Some(ActionData::NumericValue(wanted)) = request.data {
                    *value = self.on_grid(wanted.clamp(0.0, self.high()));
                }
            }
        });
    }

    fn paint(&self, ui: &Ui, rect: Rect, response: &Response, x: f32, x_of: &impl Fn(f64) -> f32) {
        let visuals = ui.style().interact(response);
        let colors = theme::accents(ui.visuals().dark_mode);
        let y = rect.center().y;
        let painter = ui.painter();
        let rail = Rect::from_x_y_ranges(rect.x_range().shrink(HANDLE - 2.0), y - 2.0..=y + 2.0);
        painter.rect_filled(rail, 2.0, ui.visuals().widgets.active.bg_fill);
        let filled = Rect::from_x_y_ranges(rail.left()..=x, rail.y_range());
        painter.rect_filled(filled, 2.0, colors.accent.gamma_multiply(0.65));
        for mark in self.marks {
            let at = x_of(self.share(mark.at));
            let passed = at <= x;
            let color = if passed { ui.visuals().weak_text_color() } else { colors.accent };
            painter.vline(at, y + 4.0..=y + 9.0, Stroke::new(1.5, color));
        }
        if let Some(suggestion) = self.suggestion {
            let at = x_of(self.share(suggestion));
            painter.vline(at, y - 8.0..=y - 4.0, Stroke::new(1.0, ui.visuals().weak_text_color()));
        }
        let line = if response.has_focus() { Stroke::new(2.0, colors.accent) } else { Stroke::new(1.0, colors.accent) };
        let fill = if response.hovered() || response.dragged() { visuals.bg_fill } else { ui.visuals().window_fill };
        let center = pos2(x, y);
        painter.circle(center, HANDLE - 1.0, fill, line);
    }

    fn typed(&self, ui: &mut Ui, value: &mut f64) {
        let low = if self.spread == Spread::LogarithmicFromZero { 0.0 } else { self.low() };
        let format = |v: f64, _: RangeInclusive<usize>| (self.format)(v);
        let parse = |text: &str| {
            let number: String = text.trim().replace(',', ".").replace('−', "-");
            let number = number.trim_end_matches(|c: char| c.is_alphabetic() && c != 'e' || c == '%').trim();
            number.parse::<f64>().ok().filter(|v| v.is_finite())
        };
        let mut typed = *value;
        let field = egui::DragValue::new(&mut typed)
            .speed(if self.grid > 0.0 { 0.2 * self.grid } else { 0.01 * value.abs() })
            .range(low..=self.high().max(*value))
            .custom_formatter(format)
            .custom_parser(parse)
            .clip_text(true)
            .update_while_editing(false);
        let size = vec2(VALUE, ROW - 2.0);
        let response = ui.add_sized(size, field).on_hover_text(self.tooltip);
        let unit = if self.unit.is_empty() { String::new() } else { format!(", {}", self.unit) };
        let response = response.accessible_name(format!("{}, typed{unit}", self.label));
        if response.changed() {
            *value = if self.grid > 0.0 { self.on_grid(typed) } else { typed };
        }
    }

    fn reset(&self, ui: &mut Ui, value: &mut f64) {
        let (rect, _) = ui.allocate_exact_size(vec2(RESET, ROW), Sense::hover());
        let Some(suggestion) = self.suggestion.filter(|s| (s - *value).abs() > 1e-9 * s.abs().max(value.abs())) else {
            return;
        };
        let button = egui::Button::new(RichText::new("↺").size(14.0)).frame(false).min_size(rect.size());
        let hint = format!("Back to {}, which the program chose", (self.format)(suggestion));
        let response = ui.put(rect, button).on_hover_text(hint);
        let name = format!("Reset {}", self.label);
        response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, &name));
        if response.clicked() {
            *value = suggestion;
        }
    }
}

/// A bar that shows a share, on a rail of full width.
pub(crate) fn share_bar(ui: &Ui, rect: Rect, share: f64, color: Color32) {
    let rail = ui.visuals().widgets.inactive.bg_fill;
    ui.painter().rect_filled(rect, 2.0, rail);
    let width = rect.width() * share.clamp(0.0, 1.0) as f32;
    // What is there at all is seen.
    let bar = Rect::from_min_size(rect.min, vec2(width.max(1.5), rect.height()));
    ui.painter().rect_filled(bar, 2.0, color);
}

/// A frame around what belongs together.
pub(crate) fn card(ui: &mut Ui, edge: Color32, body: impl FnOnce(&mut Ui)) {
    let colors = theme::accents(ui.visuals().dark_mode);
    let frame = egui::Frame::new()
        .fill(colors.card)
        .stroke(Stroke::new(1.0, colors.line))
        .corner_radius(4)
        .inner_margin(egui::Margin { left: 11, right: 8, top: 6, bottom: 6 });
    let response = frame
        .show(ui, |ui| {
            ui.set_width(ui.available_width());
            body(ui);
        })
        .response;
    let edge_rect = Rect::from_min_size(response.rect.min, vec2(3.0, response.rect.height()));
    ui.painter().rect(edge_rect, 2.0, edge, Stroke::NONE, StrokeKind::Inside);
}
