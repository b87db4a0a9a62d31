//! The left column's picture of where effects may act, and which place the candidates are shown of.

use egui::{RichText, Ui};

use super::canvas::WalkCanvas;
use super::chain::{self, Chain};
use super::known::{WalkContext, stage_color, stands};
use super::subject::site_name;
use crate::app::widgets::section;
use sindyscope_search::{Candidate, Site, Stage, within};
use sindyscope_values::format::words::capitalised;
use sindyscope_values::term::{Expression, Symbol};

/// Draws the section; nothing where there is one place alone.
pub(super) fn show(ui: &mut Ui, canvas: &mut WalkCanvas, context: &WalkContext<'_>) {
    if context.subject.sites().len() < 2 {
        return;
    }
    section(ui, "PLACES", |_| {}, |_| {});
    let stage = context.stage().map(|s| &**s);
    let chosen = canvas.hovered.as_ref().or(canvas.view.selected.as_ref());
    let chosen = chosen.and_then(|choice| context.candidates().iter().find(|c| c.choice == *choice));
    let looked_at = chosen.or_else(|| context.offered().find(|c| stands(c))).and_then(|c| c.place);
    let effects = stage.map_or(&[][..], |s| &s.effects);
    let added: Vec<_> = effects
        .iter()
        .enumerate()
        .filter_map(|(k, effect)| Some((effect.place?, stage_color(k + 1, context.dark))))
        .collect();
    let picture = Chain {
        subject: context.subject,
        force: stage.and_then(driven),
        picked: canvas.view.site,
        looked_at,
        added: &added,
        known: &|site| known(context, stage, site),
    };
    if let Some(site) = chain::show(ui, &picture) {
        canvas.view.pick(site);
    }
    let masses = context.subject.masses();
    ui.horizontal(|ui| match canvas.view.site {
        Some(site) => {
            ui.strong(capitalised(&site_name(site, masses)));
            if ui.button("All places").on_hover_text("Show the candidates of every place").clicked() {
                canvas.view.site = None;
            }
        }
        None => {
            let text = RichText::new("Click a place: its candidates alone").weak().size(12.0);
            ui.add(egui::Label::new(text).truncate());
        }
    });
}

/// What was added at a place, and what its candidates come to.
fn known(context: &WalkContext<'_>, stage: Option<&Stage>, site: Site) -> String {
    let effects = stage.map_or(&[][..], |s| &s.effects);
    let mut lines: Vec<String> =
        effects.iter().filter(|e| e.place == Some(site)).map(|e| format!("added: {}", within(&e.title))).collect();
    let here: Vec<&Candidate> = context.candidates().iter().filter(|c| c.place == Some(site)).collect();
    let standing: Vec<&&Candidate> = here.iter().filter(|c| stands(c)).collect();
    match (standing.first(), here.len()) {
        (_, 0) => {}
        (Some(best), _) => lines.push(format!("{} that stand, the likeliest: {}", standing.len(), within(&best.title))),
        (None, tried) => lines.push(format!("{tried} effects tried, none stands")),
    }
    lines.join("\n")
}

/// The mass that the input acts on most, by the base model.
fn driven(stage: &Stage) -> Option<usize> {
    let share = |state: Symbol| {
        let Symbol::Rate(mass) = state else { return None };
        let equation = stage.model.iter().find(|(s, _)| *s == state)?.1;
        let of_input = |e: &Expression| matches!(e, Expression::Symbol(Symbol::Input(_)));
        let term = equation.terms.iter().find(|t| of_input(t.term.expression()))?;
        Some((mass, term.share))
    };
    stage.model.iter().filter_map(|(state, _)| share(state)).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(mass, _)| mass)
}
