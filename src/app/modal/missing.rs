//! "What's missing" for a structure: the force that its linear modes lack.

use egui::{Context, Label, RichText, ScrollArea, Ui, vec2};

use super::centre::ModalAct;
use super::columns::{ShownModes, modes};
use super::room::ModalRoom;
use crate::app::figure_panel::FigureLook;
use crate::app::plot::display;
use crate::app::plot::figures::{FigurePlace, Figures};
use crate::app::plot::painter::Wish;
use crate::app::queue::JobProgress;
use crate::app::state::ModalShown;
use crate::app::theme::{self, ROW};
use crate::app::widgets::{card, line, record_steps, section};
use sindyscope_modes::{FoundForce, StructureDiagnosis};
use sindyscope_report::figure::Figure;
use sindyscope_report::modal::{before_and_after, diagnosis_lines, remaining, verdict};
use sindyscope_values::format::number::{format_measured, significant};
use sindyscope_values::format::units::{as_fraction, raised};
use sindyscope_values::format::words::capitalised;

/// Least height of the figure, points.
const FIGURE: f32 = 300.0;

/// Draws the centre: what to do, how far it has come, or what was found.
pub(crate) fn show_missing(
    ui: &mut Ui,
    room: &ModalRoom,
    progress: Option<JobProgress>,
    shown: &mut ModalShown,
    figures: &mut Figures,
) -> Option<ModalAct> {
    let search = &room.search;
    ui.spacing_mut().item_spacing.y = 4.0;
    ui.add_space(4.0);
    if search.is_running() {
        return under_way(ui, progress);
    }
    let mut asked = None;
    ui.horizontal_wrapped(|ui| {
        let again = search.found().is_some() || search.failure().is_some();
        let label = if again { "Look again" } else { "Find what's missing" };
        let hint = "Looks for a force beside the linear modes, to the ground and between sensors, and compares what it finds on data \
                    never fitted";
        if ui.button(label).on_hover_text(hint).clicked() {
            asked = Some(ModalAct::Search);
        }
        if !again {
            ui.weak("Linear modes first; then a force that none of them has: stiffness, friction, clearance, damping, a joint that slips.");
        }
    });
    if let Some(failure) = search.failure() {
        let wrong = theme::accents(ui.visuals().dark_mode).wrong;
        card(ui, wrong, |ui| {
            ui.add(Label::new(failure).wrap());
        });
    }
    let Some(found) = search.found() else { return asked };
    let mut wish = None;
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        told(ui, found);
        wish = figure(ui, found, shown, figures);
        if let Some(force) = &found.found {
            alternatives(ui, force);
        }
    });
    figures.tidy();
    asked.or(wish)
}

fn under_way(ui: &mut Ui, progress: Option<JobProgress>) -> Option<ModalAct> {
    let stage = progress.and_then(|p| p.stage).unwrap_or("looking for modes");
    let share = progress.and_then(|p| p.share).unwrap_or(0.0) as f32;
    ui.label(format!("{}…", capitalised(stage)));
    ui.add(egui::ProgressBar::new(share).desired_width(320.0).desired_height(6.0));
    if let Some(words) = progress.map(|p| p.words()).filter(|w| !w.is_empty()) {
        ui.weak(words);
    }
    ui.ctx().request_repaint_after_secs(0.1);
    ui.button("Cancel").clicked().then_some(ModalAct::StopSearch)
}

/// The verdict, the force with its values, and why it stands.
fn told(ui: &mut Ui, found: &StructureDiagnosis) {
    let colors = theme::accents(ui.visuals().dark_mode);
    let edge = match found.verdict() {
        "named" | "nothing_missing" => colors.good,
        _ => colors.caution,
    };
    card(ui, edge, |ui| {
        ui.add(Label::new(RichText::new(verdict(found)).strong()).wrap());
        for text in diagnosis_lines(found).into_iter().filter(|text| *text != verdict(found)) {
            ui.add(Label::new(raised(&text)).wrap());
        }
        let text = format!("Remaining: {}.", remaining(found));
        ui.add(Label::new(RichText::new(text).weak()).wrap());
    });
}

/// Before and after on data never fitted.
fn figure(ui: &mut Ui, found: &StructureDiagnosis, shown: &mut ModalShown, figures: &mut Figures) -> Option<ModalAct> {
    let at = shown.unseen.min(found.unseen.len().checked_sub(1)?);
    let (record, sensors) = (&found.unseen[at], &found.last.sensors);
    let sensor = shown.options.sensor.min(sensors.len().checked_sub(1)?);
    line(ui, ROW, |ui| {
        if found.unseen.len() > 1
            && let Some(to) = record_steps(ui, at, found.unseen.len())
        {
            shown.unseen = to;
        }
        ui.strong(&record.name);
        ui.weak("never fitted");
        if sensors.len() > 1 {
            ui.separator();
            for (k, one) in sensors.iter().enumerate() {
                if ui.selectable_label(k == sensor, &one.name).clicked() {
                    shown.options.sensor = k;
                }
            }
        }
    });
    let key = (std::ptr::from_ref(found) as usize, at, sensor);
    let drawn = figures.get("structure's force", key, || Some(before_and_after(record, sensor, &sensors[sensor])));
    let drawn: std::sync::Arc<Figure> = drawn?;
    let place = FigurePlace::new("structure's force", "Before and after", key);
    let size = vec2(ui.available_width(), FIGURE.max(ui.available_height() - 150.0));
    let wish = ui
        .allocate_ui(size, |ui| {
            ui.set_min_size(size);
            figures.draw(ui, &drawn, &place).wish
        })
        .inner;
    match wish? {
        Wish::Table(text) => Some(ModalAct::SaveTable(text)),
        Wish::Picture => Some(ModalAct::SavePicture),
    }
}

/// What was tried beside the force that stands.
fn alternatives(ui: &mut Ui, force: &FoundForce) {
    let others: Vec<_> = force.tried.iter().filter(|(e, s, _)| (*e, *s) != (force.effect, force.site)).collect();
    if others.is_empty() {
        return;
    }
    section(ui, "TRIED BESIDE IT", |_| {}, |_| {});
    for (effect, site, error) in others {
        line(ui, ROW - 4.0, |ui| {
            ui.label(format!("{} at {site}", effect.title()));
            ui.weak(format!("leaves {} % of the sensors' RMS on data never fitted", significant(100.0 * error, 3)));
        });
    }
}

/// Draws the right column: the parameters, and the modes of the structure without the force.
pub(crate) fn missing_findings(ui: &mut Ui, room: &ModalRoom, shown: &mut ModalShown) {
    let Some(found) = room.search.found() else {
        if let Some(analysis) = room.analysis() {
            modes(
                ui,
                &ShownModes {
                    title: "MODES",
                    structure: &analysis.structure,
                    quality: &analysis.quality,
                    clusters: &analysis.stabilization.clusters,
                },
                shown,
            );
        }
        return;
    };
    if let Some(force) = &found.found {
        section(ui, "FORCE", |_| {}, |_| {});
        ui.add(Label::new(RichText::new(format!("{} at {}", force.effect.title(), force.site)).strong()).wrap());
        for p in &force.parameters {
            let text = format!("{} = {} {}", p.name, format_measured(p.value, p.std_error), as_fraction(&p.unit));
            ui.label(RichText::new(text).monospace());
        }
        ui.weak("as the acceleration that it makes at its place");
    }
    modes(
        ui,
        &ShownModes { title: "MODES WITHOUT THE FORCE", structure: &found.last, quality: &[], clusters: &[] },
        shown,
    );
}

/// The figure before and after as SVG; none while nothing was found.
pub(crate) fn missing_svg(ctx: &Context, room: &ModalRoom, shown: &ModalShown, look: FigureLook) -> Option<String> {
    let found = room.search.found()?;
    let record = found.unseen.get(shown.unseen.min(found.unseen.len().checked_sub(1)?))?;
    let at = shown.options.sensor.min(found.last.sensors.len().checked_sub(1)?);
    let drawn = before_and_after(record, at, &found.last.sensors[at]);
    Some(drawn.svg(look.size, &display::chosen(ctx)))
}
