//! The right column: the gap in one figure, the evidence, the equation with what was added, what these data cannot show.

use egui::{Align, Color32, FontId, Layout as Flow, Rect, RichText, Sense, Ui, WidgetInfo, pos2, vec2};
use sindyscope_values::format::units::{as_fraction, format_si};

use super::act::{WalkAct, WalkFigure};
use super::canvas::WalkCanvas;
use super::figures::{self, Manner};
use super::known::{WalkContext, stage_color};
use super::words;
use crate::app::theme::{self, ROW};
use crate::app::widgets::{Headline, card, headlines, line, section, share_bar};
use sindyscope_rig::Truth;
use sindyscope_rig::hidden::title;
use sindyscope_search::{Choice, Stage, Test};
use sindyscope_values::format::equations::{by_share, is_kinematic};
use sindyscope_values::format::number::{align_at_point, format_measured, significant, significant_trimmed};
use sindyscope_values::term::{Expression, Term};

/// Why the figure may be smaller than that of Identify.
const NOISE: &str = "Standard deviation of the noise in the samples that are searched; where they were thinned behind a low-pass filter, \
     that has taken part of the noise off";

/// Questions that are shown without being asked for.
const SHOWN: usize = 5;

/// Height of the figure of the blocks, points.
const BLOCKS: f32 = 120.0;

pub(super) fn show(
    ui: &mut Ui,
    canvas: &mut WalkCanvas,
    context: &WalkContext<'_>,
    preview: Option<&Choice>,
    acts: &mut Vec<WalkAct>,
) {
    let stage = preview.and_then(|c| context.with(c)).or(context.stage());
    gap(ui, context);
    equation(ui, context, stage.map(|s| &**s), stage.is_some() && preview.and_then(|c| context.with(c)).is_some());
    why(ui, canvas, context, acts);
    evidence(ui, context);
    knowing(ui, context);
    ui.add_space(8.0);
}

/// What the virtual rig hid, beside what was found.
pub(super) fn truth(ui: &mut Ui, context: &WalkContext<'_>, truth: &Truth) {
    section(ui, "THE TRUTH", |_| {}, |_| {});
    let colors = theme::accents(context.dark);
    let found: Vec<&str> = context.walk.accepted.iter().map(|c| c.effect.as_str()).collect();
    let mut hidden: Vec<&str> = truth.effects.iter().map(String::as_str).collect();
    hidden.sort_unstable();
    let mut sorted = found.clone();
    sorted.sort_unstable();
    let titles: Vec<&str> = hidden.iter().map(|name| title(name).unwrap_or(name)).collect();
    let (edge, verdict) = if found.is_empty() {
        (colors.accent, "Nothing was added yet.")
    } else if sorted == hidden {
        (colors.good, "Found, by its name.")
    } else {
        (colors.caution, "What was added is something else.")
    };
    card(ui, edge, |ui| {
        ui.add(egui::Label::new(RichText::new(format!("Hidden: {}", titles.join(", "))).strong()).wrap());
        ui.add(egui::Label::new(RichText::new(&truth.description).size(12.0)).wrap());
        ui.label(RichText::new(verdict).color(edge));
        for p in truth.parameters.iter().filter(|p| p.effect.is_some()) {
            ui.label(
                RichText::new(format!("{} = {} {}", p.name, significant_trimmed(p.value, 4), as_fraction(&p.unit)))
                    .monospace(),
            );
        }
    });
}

/// The gap now, beside the noise floor.
fn gap(ui: &mut Ui, context: &WalkContext<'_>) {
    section(ui, "GAP", |_| {}, |_| {});
    let Some(stage) = context.stage() else {
        ui.add_space(50.0);
        return;
    };
    let figure = words::honest(&stage.gap);
    let noise = context.known.noise_floor;
    let colors = theme::accents(context.dark);
    let color = if figure <= 1.3 * noise { colors.good } else { ui.visuals().strong_text_color() };
    let what = if stage.gap.test_rmse.is_some() { "on data never fitted" } else { "on the fitted records" };
    let weak = ui.visuals().weak_text_color();
    let error = "RMS of what the model's simulated response leaves";
    let [figure, noise] = [figure, noise].map(|value| format_si(value, context.unit, 3));
    headlines(
        ui,
        [
            Headline { text: &figure, color, label: what, hint: error },
            Headline { text: &noise, color: weak, label: "noise floor", hint: NOISE },
        ],
    );
}

fn equation(ui: &mut Ui, context: &WalkContext<'_>, stage: Option<&Stage>, preview: bool) {
    let aside = |ui: &mut Ui| {
        if preview {
            ui.label(RichText::new("preview").size(11.0).color(theme::accents(context.dark).accent));
        }
    };
    section(ui, "EQUATION", aside, |_| {});
    let Some(stage) = stage else {
        let failed = context.known.failure.is_some();
        ui.weak(if failed { "There is no base model" } else { "the base model is being fitted" });
        return;
    };
    let layout = stage.model.layout;
    let color_of = |text: &str| {
        let place = stage.effects.iter().position(|e| e.terms.iter().any(|t| t == text));
        place.map(|k| stage_color(k + 1, context.dark))
    };
    for (state, equation) in stage.model.iter() {
        let name = Term::new(Expression::Symbol(state)).pretty(&layout);
        if is_kinematic(&stage.model, state, equation) {
            heading(ui, &format!("d{name}/dt = {}", equation.terms[0].term.pretty(&layout)));
            continue;
        }
        heading(ui, &format!("d{name}/dt ="));
        let terms = by_share(equation);
        let numbers: Vec<String> = terms.iter().map(|t| format_measured(t.coefficient, t.std_error)).collect();
        ui.scope(|ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            for (term, number) in terms.iter().zip(align_at_point(&numbers)) {
                let color = color_of(&term.term.text(&layout));
                term_row(ui, &number, &term.term.pretty(&layout), term.share, color);
            }
        });
        ui.add_space(4.0);
    }
    for (k, effect) in stage.effects.iter().enumerate() {
        let color = stage_color(k + 1, context.dark);
        card(ui, color, |ui| {
            ui.add(egui::Label::new(RichText::new(&effect.title).strong()).wrap());
            for p in &effect.parameters {
                let text = format!("{} = {} {}", p.name, format_measured(p.value, p.std_error), as_fraction(&p.unit));
                ui.label(RichText::new(text).monospace());
            }
        });
    }
}

fn heading(ui: &mut Ui, text: &str) {
    let size = vec2(ui.available_width(), ROW);
    ui.allocate_ui_with_layout(size, Flow::left_to_right(Align::Center), |ui| {
        ui.label(RichText::new(text).size(14.0));
    });
}

/// One term: coefficient ± standard error, the term, its share; in the effect's colour where an effect added it.
fn term_row(ui: &mut Ui, number: &str, pretty: &str, share: f64, color: Option<Color32>) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    let said = format!("{} {pretty}", number.trim());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Label, true, &said));
    let text = ui.visuals().text_color();
    let accent = theme::accents(ui.visuals().dark_mode).accent;
    let bar = Rect::from_min_max(
        pos2(rect.right() - 48.0, rect.center().y - 3.0),
        pos2(rect.right() - 4.0, rect.center().y + 3.0),
    );
    share_bar(ui, bar, share, color.unwrap_or(accent));
    if let Some(color) = color {
        let mark = Rect::from_min_size(rect.min + vec2(-4.0, 4.0), vec2(3.0, rect.height() - 8.0));
        ui.painter().rect_filled(mark, 1.0, color);
    }
    let painter = ui.painter().with_clip_rect(Rect::from_min_max(rect.min, pos2(bar.left() - 4.0, rect.bottom())));
    let number = painter.layout_no_wrap(number.to_owned(), FontId::monospace(12.5), color.unwrap_or(text));
    let name = painter.layout_no_wrap(pretty.to_owned(), FontId::proportional(14.0), color.unwrap_or(text));
    let left = rect.left() + 4.0;
    let width = number.size().x;
    painter.galley(pos2(left, rect.center().y - 0.5 * number.size().y), number, text);
    painter.galley(pos2(left + width + 10.0, rect.center().y - 0.5 * name.size().y), name, text);
    response.on_hover_text(format!("{said}\n{} % of the forces' RMS", significant_trimmed(100.0 * share, 3)));
}

/// Why each effect was named, or is the first candidate: its lead over the best set without it, on data never fitted.
fn why(ui: &mut Ui, canvas: &mut WalkCanvas, context: &WalkContext<'_>, acts: &mut Vec<WalkAct>) {
    let leads = (0..=context.walk.accepted.len()).filter_map(|k| Some((k, context.lead(k)?)));
    for (place, (k, (title, lead))) in leads.enumerate() {
        if place == 0 {
            section(ui, "WHY?", |_| {}, |_| {});
        }
        let said = format!("{title}: {}.", lead.words());
        let sum = format!(
            "log density {} ± {}; over resampled blocks at least {}{}",
            lead.signed(),
            significant(lead.std_error, 2),
            significant(lead.quantile, 2),
            lead.settled_words()
        );
        ui.add(egui::Label::new(RichText::new(said).size(12.5)).wrap()).on_hover_text(&sum);
        ui.add(egui::Label::new(RichText::new(&sum).weak().size(12.0)).wrap());
        let manner = Manner::new(vec2(ui.available_width(), BLOCKS)).compact();
        figures::show(ui, canvas, context, (&WalkFigure::Why(k), None), manner, acts);
    }
}

/// The statistical questions and their answers in words.
fn evidence(ui: &mut Ui, context: &WalkContext<'_>) {
    let Some(round) = context.round() else { return };
    section(ui, "IS IT CHANCE?", |_| {}, |_| {});
    let colors = theme::accents(context.dark);
    let whole = &round.evidence;
    let (color, text) = if whole.significant {
        (colors.caution, "The gap is more than noise")
    } else if context.doubted().is_some() {
        (colors.caution, "The gap of the data fitted is no more than noise")
    } else {
        (colors.good, "The gap is no more than noise")
    };
    let why = if whole.significant { words::p_value(whole.p_value) } else { words::no_gap(whole.p_value) };
    ui.label(RichText::new(text).color(color)).on_hover_text(why);
    let (first, rest) = whole.tests.split_at(whole.tests.len().min(SHOWN));
    questions(ui, first, whole.significant);
    if !rest.is_empty() {
        egui::CollapsingHeader::new(RichText::new(format!("{} more questions", rest.len())).weak().size(12.0))
            .id_salt("more questions")
            .show(ui, |ui| questions(ui, rest, whole.significant));
    }
}

fn questions(ui: &mut Ui, tests: &[Test], gap: bool) {
    for test in tests {
        let said = words::answer(test.p_value, gap);
        line(ui, ROW - 3.0, |ui| {
            ui.with_layout(Flow::right_to_left(Align::Center), |ui| {
                ui.label(RichText::new(&said).weak().size(12.0));
                ui.with_layout(Flow::left_to_right(Align::Center), |ui| {
                    ui.add(egui::Label::new(RichText::new(&test.question).size(12.0)).truncate());
                });
            });
        })
        .response
        .on_hover_text(format!("{}: {said}", test.question));
    }
}

/// What was done to the data, and what they cannot show: said before any fit.
fn knowing(ui: &mut Ui, context: &WalkContext<'_>) {
    let known = context.known;
    if known.notices.is_empty() && known.blind.is_empty() {
        return;
    }
    section(ui, "WORTH KNOWING", |_| {}, |_| {});
    let colors = theme::accents(context.dark);
    for notice in &known.notices {
        card(ui, colors.accent, |ui| {
            ui.add(egui::Label::new(RichText::new(notice).size(12.5)).wrap());
        });
    }
    // One card a reason: many effects may share it.
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for blind in &known.blind {
        let name = blind.effect.replace('_', " ");
        match reasons.iter_mut().find(|(reason, _)| *reason == blind.reason) {
            Some((_, names)) => names.push(name),
            None => reasons.push((&blind.reason, vec![name])),
        }
    }
    for (reason, names) in reasons {
        card(ui, colors.line, |ui| {
            let text = format!("Cannot be shown by these data: {} ({reason}).", names.join(", "));
            ui.add(egui::Label::new(RichText::new(text).size(12.0).weak()).wrap());
        });
    }
}
