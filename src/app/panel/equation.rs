//! EQUATION: what was identified, as mathematics.

use egui::text::{LayoutJob, TextFormat};
use egui::{
    Align, Color32, FontId, Layout as Flow, Popup, PopupCloseBehavior, Rect, RichText, Sense, Ui, WidgetInfo, pos2,
    vec2,
};

use super::context::{PanelAct, PanelContext};
use crate::app::commands::WindowCommand;
use crate::app::plot::display;
use crate::app::theme::{self, ROW};
use crate::app::widgets::{chip, section, share_bar};
use sindyscope_core::study::{EquationFit, Inclusion, Lock, Settings, setting};
use sindyscope_values::format::equations::{by_share, digits, is_kinematic};
use sindyscope_values::format::number::{align_at_point, format_measured, plain, significant, significant_trimmed};
use sindyscope_values::format::shown::ShownUnits;
use sindyscope_values::format::units::raised;
use sindyscope_values::model::{Equation, WeightedTerm};
use sindyscope_values::term::{Expression, Kind, Layout, Symbol, Term};

/// Seconds in which a changed coefficient's ground fades.
const FLASH: f64 = 0.7;
/// Share of a standard error from which on a shift is spoken of.
const SHIFTED: f64 = 0.3;
/// Width of the column of the shares' bars, points.
const BAR: f32 = 44.0;

pub(super) fn show(ui: &mut Ui, context: &mut PanelContext<'_>, now: f64) {
    let mut asks = Vec::new();
    let known = context.data.outcome.is_some();
    let layout = context.data.layout(context.edit.settings.kind);
    let refines = layout.kind == Kind::SecondOrder && layout.freedoms == 1;
    let refine = &mut context.edit.settings.refine;
    section(
        ui,
        "EQUATION",
        |ui| {
            ui.add_enabled_ui(known, |ui| {
                ui.menu_button("Copy ⏷", |ui| {
                    for command in [
                        WindowCommand::CopyText,
                        WindowCommand::CopyLatex,
                        WindowCommand::CopyPython,
                        WindowCommand::CopyJson,
                    ] {
                        if command.menu(ui, true) {
                            asks.push(PanelAct::Do(command));
                        }
                    }
                });
            });
            if refines && chip(ui, setting("refine").label, *refine, false, setting("refine").help).clicked() {
                *refine = !*refine;
            }
        },
        |_| {},
    );
    context.asks.append(&mut asks);
    let Some(outcome) = context.data.outcome.clone() else {
        return;
    };
    let layout = outcome.model.layout;
    for (state, equation) in outcome.model.iter() {
        let name = symbol(state, &layout);
        if is_kinematic(&outcome.model, state, equation) {
            let text = format!("d{name}/dt = {}", equation.terms[0].term.pretty(&layout));
            let known = RichText::new("known").weak().size(11.0);
            row_of(ui, |ui| {
                ui.label(RichText::new(text).size(14.0));
                ui.label(known).on_hover_text("It is what velocity means; set it to fitted beside the threshold");
            });
            continue;
        }
        row_of(ui, |ui| {
            ui.label(RichText::new(format!("d{name}/dt =")).size(14.0));
            if equation.terms.is_empty() {
                ui.weak("0");
            }
        });
        rows(ui, context, state, equation, &layout, now);
        if let Some(fit) = outcome.fits.iter().find(|f| f.state == state) {
            dropped(ui, context, fit, &layout);
        }
        ui.add_space(4.0);
    }
}

/// A state's name as mathematics: `x₁`.
pub(super) fn symbol(state: Symbol, layout: &Layout) -> String {
    Term::new(Expression::Symbol(state)).pretty(layout)
}

fn row_of(ui: &mut Ui, body: impl FnOnce(&mut Ui)) {
    let size = vec2(ui.available_width(), ROW);
    ui.allocate_ui_with_layout(size, Flow::left_to_right(Align::Center), body);
}

fn rows(ui: &mut Ui, context: &mut PanelContext<'_>, state: Symbol, equation: &Equation, layout: &Layout, now: f64) {
    let terms = by_share(equation);
    let units = context.data.outcome.as_ref().map(|o| o.units());
    let chosen = display::chosen(ui.ctx());
    let shown = |t: &WeightedTerm| -> ShownUnit {
        let found = units.as_ref().and_then(|u| u.coefficient_in(state, &t.term, |name| chosen.replacement(name)));
        found.map_or((None, 1.0), |(unit, factor)| (Some(raised(&unit)).filter(|u| u != "1"), factor))
    };
    let shown: Vec<ShownUnit> = terms.iter().map(|t| shown(t)).collect();
    let number =
        |t: &WeightedTerm, factor: f64| format_measured(factor * t.coefficient, t.std_error.map(|e| factor * e));
    let numbers: Vec<String> = terms.iter().zip(&shown).map(|(t, unit)| number(t, unit.1)).collect();
    let numbers = align_at_point(&numbers);
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        for ((term, number), unit) in terms.iter().zip(&numbers).zip(shown) {
            term_row(ui, context, &ShownTerm { state, term, layout, number, unit }, now);
        }
    });
}

/// The unit that a coefficient is shown in, if it has one, and how many of it one of the file's unit is.
type ShownUnit = (Option<String>, f64);

/// A term of an equation with what is shown of it.
struct ShownTerm<'a> {
    state: Symbol,
    term: &'a WeightedTerm,
    layout: &'a Layout,
    /// Its coefficient ± standard error.
    number: &'a str,
    /// The unit that the coefficient is shown in, if it has one, and how many of it one of the file's unit is.
    unit: ShownUnit,
}

/// One term: coefficient ± standard error, the term, its share of the rate; a click opens what can be done with it.
fn term_row(ui: &mut Ui, context: &mut PanelContext<'_>, shown: &ShownTerm<'_>, now: f64) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let pretty = shown.term.term.pretty(shown.layout);
    let said = match &shown.unit.0 {
        Some(unit) => format!("{} {unit} {pretty}", shown.number.trim()),
        None => format!("{} {pretty}", shown.number.trim()),
    };
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, &said));
    if let Some(since) = context.data.since_change(shown.state, &shown.term.term, now)
        && since < FLASH
    {
        let strength = (1.0 - since / FLASH) as f32;
        let accent = theme::accents(ui.visuals().dark_mode).accent;
        ui.painter().rect_filled(rect, 4.0, accent.gamma_multiply(0.30 * strength));
        ui.ctx().request_repaint();
    }
    if response.hovered() || response.has_focus() {
        ui.painter().rect_filled(rect, 4.0, ui.visuals().widgets.inactive.bg_fill);
    }
    draw_term(ui, context, shown, rect, pretty);
    popup(&response).show(|ui| {
        menu(ui, context, &shown.term.term, Some(shown.term.coefficient), shown.layout);
        shown_in(ui, context.data.unit());
    });
    response.on_hover_ui(|ui| {
        ui.label(RichText::new(&said).strong());
        hint(ui, context, shown);
        ui.weak("Click to keep, drop or fix it");
    });
}

/// What stands in a term's row, from both ends towards the middle.
fn draw_term(ui: &Ui, context: &PanelContext<'_>, shown: &ShownTerm<'_>, rect: Rect, pretty: String) {
    let ShownTerm { state, term, number, unit: (unit, _), .. } = shown;
    let accent = theme::accents(ui.visuals().dark_mode).accent;
    let sign = match context.edit.settings.locks.get(&term.term) {
        Some(Lock::In) => "🔒",
        Some(Lock::Fixed(_)) => "📌",
        _ => "",
    };
    let bar = Rect::from_min_max(
        pos2(rect.right() - BAR - 4.0, rect.center().y - 3.0),
        pos2(rect.right() - 4.0, rect.center().y + 3.0),
    );
    share_bar(ui, bar, term.share, accent);
    if let Some(sure) = context.data.inclusion(*state, &term.term) {
        inclusion(ui, pos2(bar.left() - 9.0, rect.center().y), sure.probability);
    }
    let (text, weak) = (ui.visuals().text_color(), ui.visuals().weak_text_color());
    let painter = ui.painter().with_clip_rect(rect);
    let at = |left: f32, galley: &egui::Galley| pos2(left, rect.center().y - galley.size().y / 2.0);
    let number = painter.layout_job(number_job(number, &FontId::monospace(12.5), text, weak));
    let name_left = rect.left() + 4.0 + number.size().x + 10.0;
    painter.galley(at(rect.left() + 4.0, &number), number, text);
    let lock = painter.layout_no_wrap(sign.to_owned(), FontId::proportional(11.0), accent);
    let lock_left = bar.left() - 16.0 - lock.size().x;
    painter.galley(at(lock_left, &lock), lock, accent);
    let name = painter.layout_no_wrap(pretty, FontId::proportional(14.0), ui.visuals().strong_text_color());
    let cut = painter.with_clip_rect(Rect::from_x_y_ranges(name_left..=lock_left - 2.0, rect.y_range()));
    let name_right = name_left + name.size().x;
    cut.galley(at(name_left, &name), name, text);
    if let Some(unit) = unit {
        let unit = painter.layout_no_wrap(unit.clone(), FontId::proportional(11.5), weak);
        // At the lock's left end where there is room, else in the tooltip alone.
        let unit_left = lock_left - 6.0 - unit.size().x;
        if unit_left > name_right + 8.0 {
            painter.galley(at(unit_left, &unit), unit, weak);
        }
    }
}

/// What is known of a term beyond its row.
fn hint(ui: &mut Ui, context: &PanelContext<'_>, shown: &ShownTerm<'_>) {
    let ShownTerm { state, term, layout, unit: (unit, factor), .. } = shown;
    if let Some(unit) = unit {
        ui.label(format!("The coefficient is in {unit}"));
    }
    ui.label(format!("{} % of the forces' RMS", significant_trimmed(100.0 * term.share, 3)));
    match term.std_error {
        Some(error) if error > 0.0 && term.coefficient != 0.0 => {
            let percent = 100.0 * (error / term.coefficient).abs();
            ui.label(format!("Standard error {} % of the coefficient", significant_trimmed(percent, 2)));
            let shift = context.data.outcome.as_ref().and_then(|o| o.shift(*state, &term.term));
            if let Some(shift) = shift.filter(|s| s.abs() > SHIFTED * error) {
                let percent = 100.0 * (shift / term.coefficient).abs();
                ui.label(format!(
                    "in it a shift of {} % by smoothing and noise, seen in the model's own response",
                    significant_trimmed(percent, 2)
                ));
            }
        }
        _ => {}
    }
    if let Some(p) = probability(context, *state, &term.term) {
        ui.label(format!("Belongs with a probability of {} %", plain(100.0 * p, 1)));
    }
    if let Some(sure) = context.data.inclusion(*state, &term.term) {
        resampled(ui, sure, term.std_error.map(|e| factor * e), *factor);
    }
    for (other, correlation) in confused(context, *state, &term.term).into_iter().take(3) {
        ui.label(format!(
            "Hard to tell from {}: their errors are correlated by {}",
            other.pretty(layout),
            plain(correlation, 3)
        ));
    }
}

/// What resampled data say of a term; its coefficient is shown times `factor`, with this standard error.
fn resampled(ui: &mut Ui, sure: &Inclusion, error: Option<f64>, factor: f64) {
    ui.label(format!("Stays in {} % of resampled data sets", plain(100.0 * sure.probability, 0)));
    if let Some((low, high)) = sure.interval.filter(|_| error.is_some()) {
        let end = |end: f64| significant(factor * end, digits((factor * end).abs(), error));
        ui.label(format!("90 % interval of its coefficient there: {} to {}", end(low), end(high)));
    }
    if sure.without_others.is_finite() && sure.without_others < sure.probability - 0.005 {
        let share = plain(100.0 * sure.without_others, 0);
        ui.label(format!("and in {share} % where another term is left out of the library"));
    }
}

/// The posterior probability of a term, where the regressor gives one.
fn probability(context: &PanelContext<'_>, state: Symbol, term: &Term) -> Option<f64> {
    let fit = context.data.outcome.as_ref()?.fits.iter().find(|f| f.state == state)?;
    fit.probability.iter().find(|(t, _)| t == term).map(|(_, p)| *p)
}

/// The terms that one is confused with, in the equation of a state.
fn confused(context: &PanelContext<'_>, state: Symbol, term: &Term) -> Vec<(Term, f64)> {
    let fits = context.data.outcome.iter().flat_map(|o| &o.fits).filter(|f| f.state == state);
    let other = |(a, b, correlation): &(Term, Term, f64)| match (a == term, b == term) {
        (true, _) => Some((b.clone(), *correlation)),
        (_, true) => Some((a.clone(), *correlation)),
        _ => None,
    };
    fits.flat_map(|f| &f.confused).filter_map(other).collect()
}

/// How often a term stays when the data are resampled: an upright bar.
fn inclusion(ui: &Ui, at: egui::Pos2, probability: f64) {
    let colors = theme::accents(ui.visuals().dark_mode);
    let color = match probability {
        p if p >= 0.95 => colors.good,
        p if p >= 0.5 => colors.caution,
        _ => colors.wrong,
    };
    let bar = Rect::from_center_size(at, vec2(4.0, ROW - 8.0));
    ui.painter().rect_filled(bar, 1.0, ui.visuals().widgets.inactive.bg_fill);
    let top = bar.bottom() - bar.height() * probability.clamp(0.05, 1.0) as f32;
    ui.painter().rect_filled(bar.with_min_y(top), 1.0, color);
}

/// The coefficient in the text's colour, its error in a weaker one.
fn number_job(number: &str, font: &FontId, strong: Color32, weak: Color32) -> LayoutJob {
    let mut job = LayoutJob::default();
    let cut = number.find('±').unwrap_or(number.len());
    let (value, error) = number.split_at(cut);
    job.append(value, 0.0, TextFormat::simple(font.clone(), strong));
    job.append(error, 0.0, TextFormat::simple(font.clone(), weak));
    job
}

/// A menu that stays while a coefficient is typed in it.
fn popup<'a>(response: &egui::Response) -> Popup<'a> {
    Popup::menu(response).close_behavior(PopupCloseBehavior::CloseOnClickOutside)
}

/// What can be done with a term.
fn menu(ui: &mut Ui, context: &mut PanelContext<'_>, term: &Term, coefficient: Option<f64>, layout: &Layout) {
    ui.set_width(230.0);
    ui.label(RichText::new(term.pretty(layout)).strong());
    ui.separator();
    let settings = &mut context.edit.settings;
    let lock = settings.locks.get(term).copied();
    let entry = |ui: &mut Ui, on: bool, label: &str, tooltip: &str| {
        let button = egui::Button::selectable(on, label).min_size(vec2(ui.available_width(), 0.0));
        let clicked = ui.add(button).on_hover_text(tooltip).clicked();
        if clicked {
            ui.close();
        }
        clicked
    };
    if entry(ui, lock.is_none(), "Let the threshold decide", "Kept while it is larger than the threshold") {
        settings.decide_for_all(term, None);
    }
    if entry(ui, lock == Some(Lock::In), "Always keep", "Known physics: kept whatever the threshold") {
        set_lock(settings, term, Lock::In);
    }
    if entry(ui, lock == Some(Lock::Out), "Never use", "Locked out: tried no more until it is kept again") {
        set_lock(settings, term, Lock::Out);
    }
    ui.separator();
    let is_fixed = |lock: Option<Lock>| matches!(lock, Some(Lock::Fixed(_)));
    let start = match lock {
        Some(Lock::Fixed(value)) => value,
        _ => significant_value(coefficient.unwrap_or(0.0)),
    };
    if !matches!(&context.typing.fixed, Some((t, _)) if t == term) {
        context.typing.fixed = Some((term.clone(), start));
    }
    ui.horizontal(|ui| {
        let Some((_, value)) = &mut context.typing.fixed else { return };
        ui.label("Fix at");
        let speed = 0.002 * value.abs().max(1e-6);
        let field = egui::DragValue::new(value).speed(speed).max_decimals(12);
        ui.add_sized(vec2(90.0, ROW), field).accessible_name("Fixed coefficient");
        let fixed = *value;
        if ui.selectable_label(is_fixed(lock), "Fix").on_hover_text("Kept at this coefficient, not fitted").clicked() {
            set_lock(settings, term, Lock::Fixed(fixed));
            ui.close();
        }
    });
}

/// The unit that coefficients are shown in, by that of the displacement.
fn shown_in(ui: &mut Ui, unit: &str) {
    if ShownUnits::choices(unit).is_empty() {
        return;
    }
    ui.separator();
    let chosen = display::chosen(ui.ctx());
    let now = chosen.chosen(unit).unwrap_or("the file's unit");
    ui.menu_button(format!("Coefficients and axes in {now} ⏵"), |ui| display::menu(ui, unit));
    if chosen.chosen(unit).is_some() {
        ui.weak(format!("a coefficient is fixed in the file's unit, {unit}"));
    }
}

fn set_lock(settings: &mut Settings, term: &Term, lock: Lock) {
    settings.decide_for_all(term, Some(lock));
}

/// A value to start typing from: as many digits as one reads.
fn significant_value(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// The terms that were tried and dropped, in grey.
fn dropped(ui: &mut Ui, context: &mut PanelContext<'_>, fit: &EquationFit, layout: &Layout) {
    if fit.dropped.is_empty() {
        return;
    }
    ui.add_space(2.0);
    row_of(ui, |ui| {
        ui.label(RichText::new(format!("tried and dropped: {}", fit.dropped.len())).weak().size(12.0));
    });
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        for dropped in &fit.dropped {
            let text = RichText::new(dropped.term.pretty(layout)).weak();
            let locked_out = context.edit.settings.locks.get(&dropped.term) == Some(&Lock::Out);
            let text = if locked_out { text.strikethrough() } else { text };
            let button = egui::Button::new(text).frame_when_inactive(true).min_size(vec2(0.0, ROW - 3.0));
            let why = match dropped.fell_at {
                Some(at) => format!("Fell at threshold {}", significant_trimmed(at, 3)),
                None if locked_out => "Locked out".to_owned(),
                None => "Dropped".to_owned(),
            };
            let sure = context.data.inclusion(fit.state, &dropped.term).map(|sure| sure.probability);
            let why = match sure {
                Some(sure) if sure > 0.005 => {
                    format!("{why}; stays in {} % of resampled data sets", plain(100.0 * sure, 0))
                }
                _ => why,
            };
            let why = match probability(context, fit.state, &dropped.term) {
                Some(p) => format!("{why}; belongs with a probability of {} %", plain(100.0 * p, 1)),
                None => why,
            };
            let response = ui.add(button);
            let name = format!("Dropped {}", dropped.term.pretty(layout));
            response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, &name));
            popup(&response).show(|ui| menu(ui, context, &dropped.term, None, layout));
            response.on_hover_text(format!("{why}. Click to keep it"));
        }
    });
}
