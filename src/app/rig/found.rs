//! The right column of the room: the equation that moved the rig, and beside it what was found in its record.

use egui::{FontId, RichText, Sense, Ui, WidgetInfo, pos2, vec2};

use super::class;
use super::room::{Made, RigAct, RigRoom};
use crate::app::purpose::Purpose;
use crate::app::state::{Page, RigState};
use crate::app::theme::{self, ROW};
use crate::app::widgets::{Headline, card, chip, headlines, section};
use sindyscope_core::study::Outcome;
use sindyscope_rig::hidden::title;
use sindyscope_rig::{PlantChoice, RigRun};
use sindyscope_values::format::number::{format_measured, significant_trimmed};
use sindyscope_values::format::units::format_si;
use sindyscope_values::model::WeightedTerm;
use sindyscope_values::term::{Expression, Symbol, Term};

/// A coefficient is right within so many standard errors, or within this share of it.
const ERRORS: f64 = 3.0;
const NEAR: f64 = 0.01;

impl RigRoom {
    /// Draws the right column.
    pub(crate) fn findings(&self, ui: &mut Ui, state: &mut RigState) -> Vec<RigAct> {
        let mut acts = Vec::new();
        if state.page == Page::Class {
            class::rules(ui);
            return acts;
        }
        section(ui, "FOUND IN THE RECORD", |_| {}, |_| {});
        let Some(made) = &self.made else {
            ui.weak(if self.failure.is_some() { "There is no record" } else { "recording…" });
            return acts;
        };
        let fresh = self.failure.is_none();
        ui.add_enabled_ui(fresh, |ui| {
            match &made.outcome {
                Ok(outcome) => {
                    figures(ui, made, outcome);
                    comparison(ui, made, outcome, state);
                }
                Err(problem) => {
                    ui.add(egui::Label::new(problem).wrap());
                }
            }
            section(ui, "THE PLANT", |_| {}, |_| {});
            plant(ui, made);
            section(ui, "THESE RECORDS", |_| {}, |_| {});
            ui.horizontal_wrapped(|ui| {
                let hint = "Open both records in Identify, with every setting; the truth is told in What's missing when asked for";
                if ui.button("Study in Identify").on_hover_text(hint).clicked() {
                    acts.push(RigAct::Study);
                }
                let hint = "Both records as CSV, and the truth beside them as JSON";
                if ui.button("Save as CSV…").on_hover_text(hint).clicked() {
                    acts.push(RigAct::Save(Purpose::RigRecords));
                }
            });
        });
        ui.add_space(8.0);
        acts
    }
}

/// The error on the record held out beside the noise.
fn figures(ui: &mut Ui, made: &Made, outcome: &Outcome) {
    let unit = made.settings.unit();
    let noise = outcome.noise_floor.unwrap_or(0.0);
    let colors = theme::accents(ui.visuals().dark_mode);
    let (figure, color) = match outcome.test {
        Some(score) if score.rmse <= 1.3 * noise => (format_si(score.rmse, unit, 3), colors.good),
        Some(score) => (format_si(score.rmse, unit, 3), ui.visuals().strong_text_color()),
        None => ("diverged".to_owned(), colors.wrong),
    };
    let hint = "RMSE of the simulated response on the record that was never fitted";
    let floor = "Standard deviation of the sensor's noise";
    let weak = ui.visuals().weak_text_color();
    headlines(
        ui,
        [
            Headline { text: &figure, color, label: "error held out", hint },
            Headline { text: &format_si(noise, unit, 3), color: weak, label: "noise floor", hint: floor },
        ],
    );
}

/// One line of the table: a term, its true coefficient and the one found.
struct Line {
    term: String,
    truth: Option<f64>,
    found: Option<WeightedTerm>,
    /// True if the library could hold it.
    can_be_found: bool,
}

/// The terms of one equation: those of the truth, then others that were found.
fn lines(run: &RigRun, outcome: &Outcome, state: Symbol) -> Vec<Line> {
    let layout = outcome.model.layout;
    let equation = outcome.model.iter().find(|(s, _)| *s == state).map(|(_, equation)| equation);
    let found = |term: &Term| equation.and_then(|e| e.terms.iter().find(|t| t.term == *term)).cloned();
    let mut lines: Vec<Line> = Vec::new();
    for true_term in run.truth.terms.iter().filter(|t| t.state == state) {
        lines.push(Line {
            term: true_term.text.clone(),
            truth: Some(true_term.coefficient),
            found: true_term.term.as_ref().and_then(found),
            can_be_found: true_term.term.is_some(),
        });
    }
    for term in equation.into_iter().flat_map(|e| &e.terms) {
        if run.truth.coefficient(state, &term.term).is_none() {
            let text = term.term.pretty(&layout);
            lines.push(Line { term: text, truth: None, found: Some(term.clone()), can_be_found: true });
        }
    }
    lines
}

/// True if a coefficient is what it should be.
pub(crate) fn agrees(truth: f64, found: &WeightedTerm) -> bool {
    let error = (found.coefficient - truth).abs();
    error <= NEAR * truth.abs() || found.std_error.is_some_and(|s| error <= ERRORS * s)
}

fn comparison(ui: &mut Ui, made: &Made, outcome: &Outcome, state: &mut RigState) {
    let aside = |ui: &mut Ui| {
        let hint = "The library holds the plant's own terms beside the usual ones; without them a wrong library can be studied";
        if chip(ui, "plant's terms", !state.usual_library, false, hint).clicked() {
            state.usual_library = !state.usual_library;
        }
    };
    section(ui, "TRUTH BESIDE FOUND", aside, |_| {});
    let layout = outcome.model.layout;
    let rates = layout.state_symbols().filter(|s| matches!(s, Symbol::Rate(_)));
    for rate in rates {
        let name = Term::new(Expression::Symbol(rate)).pretty(&layout);
        header(ui, &format!("d{name}/dt ="));
        ui.scope(|ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            for line in lines(&made.run, outcome, rate) {
                show_line(ui, &line);
            }
        });
    }
}

/// Where the columns of the table end or begin, as shares of its width.
const TRUTH: f32 = 0.50;
const FOUND: f32 = 0.54;

fn header(ui: &mut Ui, text: &str) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Label, true, text));
    let painter = ui.painter();
    let (color, weak) = (ui.visuals().text_color(), ui.visuals().weak_text_color());
    let y = rect.center().y;
    painter.text(pos2(rect.left(), y), egui::Align2::LEFT_CENTER, text, FontId::proportional(14.0), color);
    let small = FontId::proportional(11.5);
    painter.text(pos2(rect.left() + TRUTH * rect.width(), y), egui::Align2::RIGHT_CENTER, "truth", small.clone(), weak);
    painter.text(pos2(rect.left() + FOUND * rect.width(), y), egui::Align2::LEFT_CENTER, "found", small, weak);
}

fn show_line(ui: &mut Ui, line: &Line) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW - 1.0), Sense::hover());
    let colors = theme::accents(ui.visuals().dark_mode);
    let (text, weak) = (ui.visuals().text_color(), ui.visuals().weak_text_color());
    let truth = line.truth.map_or("–".to_owned(), |t| significant_trimmed(t, 4));
    let (found, color, verdict) = match (&line.found, line.truth) {
        (Some(found), Some(truth)) if agrees(truth, found) => {
            (format_measured(found.coefficient, found.std_error), colors.good, "found: it agrees with the truth")
        }
        (Some(found), Some(_)) => {
            (format_measured(found.coefficient, found.std_error), colors.caution, "found, but not as it is")
        }
        (Some(found), None) => {
            (format_measured(found.coefficient, found.std_error), colors.caution, "found, but not in the plant")
        }
        (None, _) if line.can_be_found => ("not found".to_owned(), colors.caution, "in the plant, but not found"),
        (None, _) => {
            ("no term for it".to_owned(), weak, "the library can hold no term for it: What's missing can name it")
        }
    };
    let said = format!("{}: truth {truth}, found {found}", line.term);
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Label, true, &said));
    let y = rect.center().y;
    let left = pos2(rect.left() + 4.0, y);
    let cut = egui::Rect::from_min_max(rect.min, pos2(rect.left() + 0.33 * rect.width(), rect.bottom()));
    let mono = FontId::monospace(12.0);
    ui.painter().with_clip_rect(cut).text(
        left,
        egui::Align2::LEFT_CENTER,
        &line.term,
        FontId::proportional(13.5),
        text,
    );
    let painter = ui.painter().with_clip_rect(rect);
    painter.text(pos2(rect.left() + TRUTH * rect.width(), y), egui::Align2::RIGHT_CENTER, truth, mono.clone(), text);
    painter.text(pos2(rect.left() + FOUND * rect.width(), y), egui::Align2::LEFT_CENTER, found, mono, color);
    response.on_hover_text(format!("{said}\n{verdict}"));
}

/// What the plant is, in words and figures.
fn plant(ui: &mut Ui, made: &Made) {
    let run = &made.run;
    let colors = theme::accents(ui.visuals().dark_mode);
    let one = made.settings.plant == PlantChoice::OneMass;
    if let Some(effect) = made.settings.effect.as_deref().filter(|_| one) {
        card(ui, colors.accent, |ui| {
            let name = title(effect).unwrap_or(effect);
            ui.add(egui::Label::new(RichText::new(name).strong()).wrap());
            let share = significant_trimmed(100.0 * run.ratio, 3);
            ui.label(format!("its force: {share} % of the spring's (RMS)"));
            if run.stuck_share() > 0.0 {
                ui.label(format!("sticks for {} % of the time", significant_trimmed(100.0 * run.stuck_share(), 2)));
            }
        });
    }
    let found: Vec<String> = made.settings.natural_frequencies().iter().map(|f| significant_trimmed(*f, 4)).collect();
    let label = if found.len() > 1 { "natural frequencies" } else { "natural frequency" };
    ui.label(format!("{label} {} Hz", found.join(", ")));
}
