//! Candidates as cards, and as rows of a list.

use egui::{
    Align, Color32, FontId, Layout, Rect, Response, RichText, Sense, Stroke, StrokeKind, Ui, UiBuilder, Vec2,
    WidgetInfo, pos2, vec2,
};
use sindyscope_values::format::units::raised;

use super::act::{WalkAct, WalkFigure};
use super::canvas::WalkCanvas;
use super::figures::{self, Manner};
use super::known::{WalkContext, stage_color, stands};
use super::subject::short_title;
use super::words;
use crate::app::plot::painter::{Wish, entries};
use crate::app::theme;
use crate::app::widgets::line;
use sindyscope_search::{Candidate, Stage, Standing};
use sindyscope_values::format::number::significant_trimmed;

/// Narrowest card, points.
pub(super) const NARROWEST: f32 = 270.0;
/// Height of a card, points.
pub(super) const HEIGHT: f32 = 268.0;
/// Highest card: beyond it a plot gains nothing.
pub(super) const TALLEST: f32 = 460.0;
/// Height of a row of its text, points.
const TEXT_ROW: f32 = 15.0;
/// Height of its plot, points.
const PLOT: f32 = 138.0;

/// One line on how far a candidate has come: the first against the model without it, the others against the first.
pub(super) fn standing(candidate: &Candidate, context: &WalkContext<'_>) -> String {
    let looking = context.looking();
    match &candidate.standing {
        Standing::Refitted => match behind(candidate, context) {
            None => words::evidence(candidate.delta_bic).to_owned(),
            Some(delta) => words::against_first(delta).to_owned(),
        },
        Standing::Screened if looking => "fitted next if it is among the likeliest".to_owned(),
        Standing::Screened => "not fitted: click to preview it".to_owned(),
        Standing::Refused(reason) => format!("refused: {reason}"),
        Standing::NotShown(_) => "these data cannot show it".to_owned(),
    }
}

/// By how much a rival's criterion lies above that of the first candidate that stands; none for that one itself.
fn behind(candidate: &Candidate, context: &WalkContext<'_>) -> Option<f64> {
    let first = context.candidates().iter().find(|c| stands(c))?;
    (first.choice != candidate.choice).then_some(candidate.delta_bic - first.delta_bic)
}

/// A card; `rank` is shown where the candidate stands.
pub(super) fn card(
    ui: &mut Ui,
    canvas: &mut WalkCanvas,
    context: &WalkContext<'_>,
    before: &Stage,
    candidate: &Candidate,
    (rank, size): (Option<usize>, Vec2),
    acts: &mut Vec<WalkAct>,
) {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let plot_height = size.y - (HEIGHT - PLOT);
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, &candidate.title));
    if !ui.is_rect_visible(rect) {
        return;
    }
    let colors = theme::accents(context.dark);
    let chosen = canvas.view.selected.as_ref() == Some(&candidate.choice);
    let faded = !stands(candidate) && !matches!(candidate.standing, Standing::Screened);
    let color = stage_color(before.effects.len() + 1, context.dark);
    outline(ui, rect, &response, (chosen, faded), stands(candidate).then_some(color));
    let inner = rect.shrink2(vec2(10.0, 7.0));
    let mut child = ui.new_child(UiBuilder::new().max_rect(inner).layout(Layout::top_down(Align::Min)));
    let ui = &mut child;
    ui.shrink_clip_rect(rect.shrink(2.0));
    ui.spacing_mut().item_spacing.y = 2.0;
    let strong = if faded { ui.visuals().weak_text_color() } else { ui.visuals().strong_text_color() };
    line(ui, 20.0, |ui| {
        let number = rank.map_or_else(String::new, |r| format!("{r}  "));
        let title = short_title(candidate, context.subject.masses());
        let title = RichText::new(format!("{number}{title}")).size(14.0).strong().color(strong);
        ui.add(egui::Label::new(title).truncate())
            .on_hover_text(format!("{}\n\n{}", candidate.title, candidate.explanation));
    });
    let size = vec2(inner.width(), plot_height);
    let manner =
        Manner { sense: Sense::hover(), strength: if faded { 0.45 } else { 1.0 }, ..Manner::new(size).compact() };
    let figure = WalkFigure::Curve(candidate.choice.clone());
    if !figures::show(ui, canvas, context, (&figure, None), manner, acts) {
        let (plot, _) = ui.allocate_exact_size(size, Sense::hover());
        let text = match candidate.standing {
            Standing::NotShown(_) => "not tried",
            _ => "no curve",
        };
        ui.painter().text(plot.center(), egui::Align2::CENTER_CENTER, text, FontId::proportional(12.0), strong);
    }
    evidence(ui, context, before, candidate, strong);
    let (reason, confused) = reasons(candidate, context);
    let body = if faded { strong } else { ui.visuals().text_color() };
    explain(ui, (inner, rect.bottom()), (&reason, body), (&confused, colors.caution));
    if let Some(drawing) = figures::kept(canvas, context, &figure, None) {
        let table = || drawing.panels().next().map_or_else(String::new, |p| drawing.table(p, &(0.0..=0.0)));
        response.context_menu(|menu| match entries(menu, table) {
            Some(Wish::Table(text)) => acts.push(WalkAct::SaveTable(figure.name(), text)),
            Some(Wish::Picture) => acts.push(WalkAct::SaveFigure(figure.clone())),
            None => {}
        });
    }
    let full = format!("{}\n\n{}\n{confused}", candidate.explanation, raised(&candidate.why));
    if response.on_hover_text(full.trim()).clicked() {
        acts.push(WalkAct::Select(candidate.choice.clone()));
        acts.push(WalkAct::Go(crate::app::state::RoundStep::Add));
    }
}

/// Ground and edge of a card; with a bar in the effect's colour where the candidate stands.
fn outline(ui: &Ui, rect: Rect, response: &Response, (chosen, faded): (bool, bool), bar: Option<Color32>) {
    let colors = theme::accents(ui.visuals().dark_mode);
    let edge = if chosen {
        Stroke::new(2.0, colors.accent)
    } else if response.hovered() || response.has_focus() {
        Stroke::new(1.5, colors.accent)
    } else {
        Stroke::new(1.0, colors.line)
    };
    let fill = if faded { ui.visuals().faint_bg_color } else { colors.card };
    ui.painter().rect(rect, 5.0, fill, edge, StrokeKind::Inside);
    if let Some(color) = bar {
        let bar = Rect::from_min_size(rect.min + vec2(0.0, 5.0), vec2(3.0, rect.height() - 10.0));
        ui.painter().rect_filled(bar, 1.0, color);
    }
}

/// Two lines: how the gap shrinks, and how far the candidate has come.
fn evidence(ui: &mut Ui, context: &WalkContext<'_>, before: &Stage, candidate: &Candidate, strong: Color32) {
    let colors = theme::accents(context.dark);
    line(ui, 18.0, |ui| match &candidate.stage {
        Some(stage) => {
            let what = if stage.gap.test_rmse.is_some() { "not fitted" } else { "fitted" };
            ui.label(RichText::new(what).weak());
            let text = words::shrinks(&before.gap, &stage.gap, context.unit);
            ui.label(RichText::new(text).strong().color(strong));
        }
        None if candidate.explained > 0.0 => {
            let share = significant_trimmed(100.0 * candidate.explained, 2);
            ui.label(RichText::new(format!("{share} % of the gap along the measured motion")).weak());
        }
        None => {}
    });
    let behind = behind(candidate, context);
    let color = match candidate.standing {
        Standing::Refitted if behind.is_none_or(|d| d <= 2.0) => colors.good,
        Standing::Refused(_) => colors.caution,
        _ => ui.visuals().weak_text_color(),
    };
    // The figure has its room first: the words before it are shortened where there is too little.
    ui.allocate_ui_with_layout(vec2(ui.available_width(), 18.0), Layout::right_to_left(Align::Center), |ui| {
        if candidate.stage.is_some() {
            let (value, hint) = match behind {
                None => (candidate.delta_bic, "Against the model without it; negative speaks for the effect"),
                Some(delta) => (delta, "Against the first candidate; positive speaks for that one"),
            };
            ui.label(RichText::new(words::delta_bic(value)).weak()).on_hover_text(hint);
        }
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            ui.add(egui::Label::new(RichText::new(standing(candidate, context)).color(color)).truncate());
        });
    });
}

/// Why it is among the candidates or cannot be shown, and what it cannot be told from; empty where there is nothing.
fn reasons(candidate: &Candidate, context: &WalkContext<'_>) -> (String, String) {
    let reason = match &candidate.standing {
        Standing::NotShown(reason) => reason.clone(),
        // Its figures stand above already.
        _ => raised(candidate.explanation),
    };
    let confused = if candidate.confused_with.is_empty() {
        String::new()
    } else {
        let named = context.round().is_some_and(|r| r.finding == sindyscope_search::Finding::Named);
        // Where one is named, what looks like it comes to the same motion here and has more to it than is needed.
        let words = if named { "Moves alike here, with more to it" } else { "Cannot be told from" };
        format!("{words}: {}.", candidate.confused_with.join(", "))
    };
    (reason, confused)
}

/// The reasons under a card's figures, each in its colour.
fn explain(
    ui: &Ui,
    (inner, bottom): (Rect, f32),
    (reason, body): (&str, Color32),
    (confused, caution): (&str, Color32),
) {
    let mut job = egui::text::LayoutJob::default();
    let format = |color| egui::text::TextFormat::simple(FontId::proportional(12.0), color);
    job.append(reason, 0.0, format(body));
    if !confused.is_empty() {
        job.append(&format!("\n{confused}"), 0.0, format(caution));
    }
    let at = pos2(inner.left(), ui.cursor().top() + 2.0);
    job.wrap.max_width = inner.width();
    // What has no room is elided; the card's hint says it all.
    job.wrap.max_rows = ((bottom - at.y) / TEXT_ROW).floor().max(1.0) as usize;
    let galley = ui.painter().layout_job(job);
    ui.painter().galley(at, galley, body);
}

/// A candidate as a row of a list: name, gap, standing. Tells whether it is under the pointer.
pub(super) fn row(
    ui: &mut Ui,
    context: &WalkContext<'_>,
    before: &Stage,
    candidate: &Candidate,
    marks: (bool, bool),
    acts: &mut Vec<WalkAct>,
) -> bool {
    let (chosen, skipped) = marks;
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 24.0), Sense::click());
    response.widget_info(|| WidgetInfo::selected(egui::Role::ListItem, true, chosen, &candidate.title));
    let colors = theme::accents(context.dark);
    if chosen || response.hovered() {
        let fill = if chosen { colors.accent_ground } else { ui.visuals().widgets.hovered.bg_fill };
        ui.painter().rect_filled(rect, 3.0, fill);
    }
    let faded = skipped || !(stands(candidate) || matches!(candidate.standing, Standing::Screened));
    let text = if faded { ui.visuals().weak_text_color() } else { ui.visuals().text_color() };
    let mut title = RichText::new(short_title(candidate, context.subject.masses())).color(text);
    if skipped {
        title = title.strikethrough();
    }
    if stands(candidate) {
        let mark = Rect::from_min_size(rect.min + vec2(2.0, 5.0), vec2(3.0, rect.height() - 10.0));
        ui.painter().rect_filled(mark, 1.0, stage_color(before.effects.len() + 1, context.dark));
    }
    let cells = [(0.0, 0.46), (0.46, 0.76), (0.76, 1.0)];
    let gap = context.with(&candidate.choice).map_or_else(
        || format!("explains {} %", significant_trimmed(100.0 * candidate.explained, 2)),
        |stage| words::shrinks(&before.gap, &stage.gap, context.unit),
    );
    let texts = [title, RichText::new(gap).color(text), RichText::new(standing(candidate, context)).weak()];
    for ((from, to), text) in cells.into_iter().zip(texts) {
        let x = |share: f32| rect.left() + 9.0 + share * (rect.width() - 12.0);
        let cell = Rect::from_x_y_ranges(x(from)..=x(to) - 4.0, rect.y_range());
        let mut child = ui.new_child(UiBuilder::new().max_rect(cell).layout(Layout::left_to_right(Align::Center)));
        child.add(egui::Label::new(text).truncate().selectable(false));
    }
    let hovered = response.hovered();
    if response.on_hover_text(&candidate.why).clicked() {
        acts.push(WalkAct::Select(candidate.choice.clone()));
    }
    hovered
}
