//! The left column of the room: the model that the walk starts from, what was added to it, and where it may go from here.

use std::collections::BTreeMap;

use egui::{RichText, Ui};

use super::act::WalkAct;
use super::known::{WalkContext, identified, stage_color};
use crate::app::records::OpenRecords;
use crate::app::state::{Base, Edit};
use crate::app::theme;
use crate::app::widgets::section;
use sindyscope_core::study::{Lock, Settings};
use sindyscope_search::Stage;
use sindyscope_values::term::{Kind, Layout as Symbols, Symbol, Term, list};

/// What was added to the base, and what may be done with the model as it stands.
pub(super) fn walk(ui: &mut Ui, context: &WalkContext<'_>, old: &Settings) -> Vec<WalkAct> {
    let mut acts = Vec::new();
    section(ui, "SEARCH", |_| {}, |_| {});
    let accepted = &context.walk.accepted;
    let stage = context.known.stages.get(accepted);
    match stage {
        Some(stage) if !stage.effects.is_empty() => {
            for (k, effect) in stage.effects.iter().enumerate() {
                let color = stage_color(k + 1, context.dark);
                ui.horizontal(|ui| {
                    let (mark, _) = ui.allocate_exact_size(egui::vec2(4.0, 16.0), egui::Sense::hover());
                    ui.painter().rect_filled(mark, 1.0, color);
                    ui.add(egui::Label::new(&effect.title).truncate());
                });
            }
        }
        _ => {
            ui.weak("Nothing was added yet");
        }
    }
    ui.horizontal_wrapped(|ui| {
        let begun = !accepted.is_empty();
        let mut button = |ui: &mut Ui, label: &str, hint: &str, enabled: bool, act: WalkAct| {
            let response = ui.add_enabled(enabled, egui::Button::new(label));
            if response.on_hover_text(hint).on_disabled_hover_text(hint).clicked() {
                acts.push(act);
            }
        };
        let hint = "Take the model with all that was added as the equation of Identify, its coefficients fitted there";
        button(ui, "Use in Identify", hint, stage.is_some(), WalkAct::Use);
        button(ui, "Copy", "Copy the model as plain text", stage.is_some(), WalkAct::Copy);
        button(ui, "Begin again", "Take every effect out of the model", begun, WalkAct::Restart);
    });
    if let Some(problem) = stage.and_then(|s| settings(s, old).err()) {
        let color = theme::accents(context.dark).caution;
        ui.add(egui::Label::new(RichText::new(problem).size(12.0).color(color)).wrap());
    }
    acts
}

/// The settings of Identify that keep a stage's terms and fit their coefficients to the response.
pub(super) fn settings(stage: &Stage, old: &Settings) -> Result<Settings, String> {
    if stage.model.layout.internals > 0 {
        let inner = "has a state of its own, for which the library of Identify has no term";
        let effect = stage.effects.last().map_or("the model", |e| e.title.as_str());
        return Err(format!("{effect} {inner}: copy the model, or put the walk into a report"));
    }
    let mut settings = Settings {
        kind: Kind::SecondOrder,
        terms: Vec::new(),
        locks: BTreeMap::new(),
        known: Vec::new(),
        own: BTreeMap::new(),
        refine: true,
        ..old.clone()
    };
    let freedoms = stage.model.layout.freedoms;
    for (state, equation) in stage.model.iter() {
        let Symbol::Rate(freedom) = state else { continue };
        let terms: Vec<Term> = equation.terms.iter().map(|t| t.term.clone()).collect();
        for term in &terms {
            settings.decide(freedom, freedoms, term.clone(), Lock::In);
        }
        // An effect of one mass is none of the others'.
        if freedoms > 1 {
            settings.own.entry(freedom).or_default().terms = Some(terms.clone());
        }
        for term in terms {
            if !settings.terms.contains(&term) {
                settings.terms.push(term);
            }
        }
    }
    Ok(settings)
}

/// The choice of the model that the walk starts from.
pub(super) fn choice(ui: &mut Ui, typing: &mut Option<String>, data: &OpenRecords, edit: &mut Edit) {
    section(ui, "BASE MODEL", |_| {}, |_| {});
    let mut chosen = None;
    let width = ui.available_width() - 8.0;
    let combo = egui::ComboBox::from_id_salt("base model").width(width).selected_text(label(&edit.walk.base));
    let combo = combo.show_ui(ui, |ui| {
        let walk = &edit.walk;
        if ui.selectable_label(walk.base == Base::Linear, label(&Base::Linear)).clicked() {
            chosen = Some(Base::Linear);
        }
        let second = data.outcome.as_ref().is_some_and(|o| o.model.layout.kind == Kind::SecondOrder);
        let found = egui::Button::selectable(walk.base == Base::Identified, "the identified equation");
        if ui.add_enabled(second, found).clicked() {
            chosen = Some(Base::Identified);
        }
        if ui.selectable_label(matches!(walk.base, Base::Typed(_)), "typed terms").clicked() {
            let text = match &walk.base {
                Base::Typed(terms) => text_of(terms, data),
                _ => identified(data).map_or_else(|| "x, v".to_owned(), |t| text_of(&t, data)),
            };
            *typing = Some(text.clone());
            chosen = parse(&text, data).ok().map(Base::Typed);
        }
    });
    combo.response.on_hover_text("The model that the walk starts from: what is missing is missing from it");
    if let Some(base) = chosen {
        if !matches!(base, Base::Typed(_)) {
            *typing = None;
        }
        if base != edit.walk.base {
            edit.walk.base = base;
            edit.walk.accepted.clear();
        }
    }
    if let Base::Typed(terms) = &edit.walk.base {
        let text = typing.get_or_insert_with(|| text_of(terms, data));
        let parsed = parse(text, data);
        let wrong = parsed.is_err();
        let color = wrong.then(|| theme::accents(ui.visuals().dark_mode).wrong);
        let field = egui::TextEdit::singleline(text).desired_width(f32::INFINITY).text_color_opt(color);
        let response = ui.add(field).accessible_name("Base terms");
        let hint = match &parsed {
            Ok(_) => "Terms of the acceleration, with commas between: x, v, u. Enter takes them over".to_owned(),
            Err(problem) => problem.clone(),
        };
        let sent = response.lost_focus();
        response.on_hover_text(hint);
        if sent
            && let Ok(terms) = parsed
            && edit.walk.base != Base::Typed(terms.clone())
        {
            edit.walk.base = Base::Typed(terms);
            edit.walk.accepted.clear();
        }
    }
}

/// What a base is called.
pub(super) fn label(base: &Base) -> &'static str {
    match base {
        Base::Linear => "linear spring and damper, as needed",
        Base::Identified => "the identified equation",
        Base::Typed(_) => "typed terms",
    }
}

fn text_of(terms: &[Term], data: &OpenRecords) -> String {
    let layout: Symbols = data.layout(Kind::SecondOrder);
    terms.iter().map(|t| t.text(&layout)).collect::<Vec<_>>().join(", ")
}

/// Terms with commas between, which the records can have.
fn parse(text: &str, data: &OpenRecords) -> Result<Vec<Term>, String> {
    let terms = list(text).map_err(|e| e.to_string())?;
    if terms.is_empty() {
        return Err("type at least one term, as x".to_owned());
    }
    let (layout, units) = (data.layout(Kind::SecondOrder), data.units(Kind::SecondOrder));
    terms.iter().try_for_each(|t| units.check(t, &layout))?;
    Ok(terms)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typed_terms_are_read_and_wrong_ones_explained() {
        let parse = |text: &str| parse(text, &OpenRecords::default()).map(|t| t.len());
        assert_eq!(parse("x, v , u"), Ok(3));
        assert_eq!(parse("x, clip(x,0.1), max(x,v)"), Ok(3));
        assert!(parse(" , ").is_err());
        assert!(parse("x, x^2*").is_err());
    }
}
