//! The centre: figures of the force, and what it lacks.

use std::sync::Arc;

use egui::{Context, Label, RichText, Ui, vec2};

use super::room::{ComponentCanvas, ComponentRoom};
use crate::app::figure_panel::FigureLook;
use crate::app::plot::display;
use crate::app::plot::figures::FigurePlace;
use crate::app::plot::painter::Wish;
use crate::app::queue::JobProgress;
use crate::app::theme::{self, ROW};
use crate::app::widgets::{card, line, record_steps, tab};
use sindyscope_component::{ComponentModel, Specimen};
use sindyscope_report::component::{ComponentView, effect_lines, error_share, verdict};
use sindyscope_report::figure::Figure;
use sindyscope_values::record::Usage;

/// What a person asked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ComponentAct {
    /// Show this view.
    View(ComponentView),
    /// Show another record.
    ShowRecord(usize),
    /// Save a picture of the figure.
    SavePicture,
    /// Save these numbers.
    SaveTable(String),
    /// Look for what the force lacks.
    Search,
    /// Stop looking.
    StopSearch,
}

/// Draws tabs and figure of the identified force.
pub(crate) fn show(
    ui: &mut Ui,
    room: &ComponentRoom,
    (view, record): (ComponentView, usize),
    canvas: &mut ComponentCanvas,
) -> Option<ComponentAct> {
    let Some(of) = room.identified() else {
        let text = room.fit.failure().unwrap_or("fitting the force…").to_owned();
        ui.centered_and_justified(|ui| ui.weak(text));
        return None;
    };
    let stamp = room.fit.found().map_or(0, |found| Arc::as_ptr(found) as usize);
    let act = figure(ui, of, (view, record, stamp), canvas);
    canvas.tidy();
    act
}

/// Tabs, the record, and the figure in all the room there is.
fn figure(
    ui: &mut Ui,
    (specimen, model): (&Specimen, &ComponentModel),
    (view, record, stamp): (ComponentView, usize, usize),
    canvas: &mut ComponentCanvas,
) -> Option<ComponentAct> {
    let mut act = tabs(ui, view);
    let record = record.min(model.records.len().saturating_sub(1));
    if view != ComponentView::Energy
        && let Some(fit) = model.records.get(record)
    {
        line(ui, ROW, |ui| {
            if model.records.len() > 1
                && let Some(to) = record_steps(ui, record, model.records.len())
            {
                act = Some(ComponentAct::ShowRecord(to));
            }
            ui.strong(&fit.name);
            ui.weak("·");
            ui.label(if fit.usage == Usage::HeldOut { "held out" } else { "fitted" });
        });
    }
    let key = (stamp, view, record);
    let drawn: Option<Arc<Figure>> = canvas.get("component", key, || view.figure(specimen, model, record));
    let drawn = drawn?;
    let place = FigurePlace::new("component", view.label(), key);
    let wish = canvas.draw(ui, &drawn, &place).wish;
    act.or(wish.map(|wish| match wish {
        Wish::Table(text) => ComponentAct::SaveTable(text),
        Wish::Picture => ComponentAct::SavePicture,
    }))
}

fn tabs(ui: &mut Ui, shown: ComponentView) -> Option<ComponentAct> {
    let mut act = None;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        for view in ComponentView::ALL {
            if tab(ui, view.label(), view.tooltip(), shown == view) {
                act = Some(ComponentAct::View(view));
            }
        }
    });
    act
}

/// Draws "What's missing": what to do, how far it has come, or what was found.
pub(crate) fn show_missing(
    ui: &mut Ui,
    room: &ComponentRoom,
    progress: Option<JobProgress>,
    (view, record): (ComponentView, usize),
    canvas: &mut ComponentCanvas,
) -> Option<ComponentAct> {
    let search = &room.search;
    ui.add_space(4.0);
    if search.is_running() {
        let share = progress.and_then(|p| p.share).unwrap_or(0.0) as f32;
        ui.label("Looking for what the force lacks…");
        ui.add(egui::ProgressBar::new(share).desired_width(320.0).desired_height(6.0));
        ui.ctx().request_repaint_after_secs(0.1);
        return ui.button("Cancel").clicked().then_some(ComponentAct::StopSearch);
    }
    let mut act = None;
    let again = search.found().is_some() || search.failure().is_some();
    let hint =
        "Fits a spring and a damper, then looks for the effect that their force lacks, judged on data never fitted";
    ui.horizontal(|ui| {
        if ui.button(if again { "Look again" } else { "Find what's missing" }).on_hover_text(hint).clicked() {
            act = Some(ComponentAct::Search);
        }
    });
    if let Some(failure) = search.failure() {
        let wrong = theme::accents(ui.visuals().dark_mode).wrong;
        card(ui, wrong, |ui| {
            ui.add(Label::new(failure).wrap());
        });
    }
    let (Some(diagnosis), Some(of)) = (search.found(), room.diagnosed()) else { return act };
    let found = &diagnosis.found;
    let colors = theme::accents(ui.visuals().dark_mode);
    let edge = if matches!(found.verdict(), "named" | "nothing_missing") { colors.good } else { colors.caution };
    card(ui, edge, |ui| {
        ui.add(Label::new(RichText::new(verdict(found)).strong()).wrap());
        ui.add(
            Label::new(format!("Spring and damper alone leave {} % of the force.", error_share(&found.base))).wrap(),
        );
        for text in found.steps.iter().flat_map(effect_lines) {
            ui.add(Label::new(text).wrap());
        }
        let text = format!("Remaining: {}.", diagnosis.remaining());
        ui.add(Label::new(RichText::new(text).weak()).wrap());
    });
    let stamp = Arc::as_ptr(diagnosis) as usize;
    let size = vec2(ui.available_width(), ui.available_height().max(260.0));
    let also = ui.allocate_ui(size, |ui| figure(ui, of, (view, record, stamp), canvas)).inner;
    canvas.tidy();
    act.or(also)
}

/// The figure in view as SVG; none while there is none.
pub(crate) fn svg(
    ctx: &Context,
    of: Option<(&Specimen, &ComponentModel)>,
    (view, record): (ComponentView, usize),
    look: FigureLook,
) -> Option<String> {
    let (specimen, model) = of?;
    let figure = view.figure(specimen, model, record.min(model.records.len().saturating_sub(1)))?;
    Some(figure.svg(look.size, &display::chosen(ctx)))
}
