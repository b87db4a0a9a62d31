//! The room "What's missing": a walk in rounds of four steps, from where model and measurement part to an effect that was
//! added and checked on data never fitted.
//!
//! [`Walk`] is what a person decided; [`Missing`] is what was found for it. Each step is a function of both and asks for
//! [`WalkAct`]s; none computes anything. [`WalkCanvas`] is what the drawing remembers.

mod act;
mod add;
mod base;
mod canvas;
mod cards;
mod chain;
mod choice;
mod compare;
pub(crate) mod figures;
mod findings;
mod keep;
mod known;
mod name;
mod own;
mod places;
mod room;
mod steps;
mod subject;
mod verify;
mod words;
pub(crate) mod work;

use egui::{Ui, vec2};

use super::plot::palette;
use super::records::OpenRecords;
use super::state::{Edit, RoundStep, Walk};
pub(crate) use act::{WalkAct, WalkFigure};
pub(crate) use canvas::WalkCanvas;
pub(crate) use figures::{main_figure, svg};
pub(crate) use keep::DROPPED;
use known::WalkContext;
pub(crate) use room::{Missing, WantedSearch};
use sindyscope_core::study::Settings;
use subject::WalkSubject;

/// Draws the centre; `mass` is the one whose response is shown.
pub(crate) fn show(
    ui: &mut Ui,
    room: &Missing,
    canvas: &mut WalkCanvas,
    (data, edit): (&OpenRecords, &Edit),
    mass: &mut usize,
) -> Vec<WalkAct> {
    let mut acts = Vec::new();
    canvas.hovered = None;
    let subject = WalkSubject::of(data);
    canvas.mass = (*mass).min(subject.masses().saturating_sub(1));
    ui.spacing_mut().item_spacing = vec2(6.0, 3.0);
    let context = context(ui, room, canvas, &edit.walk, &subject);
    steps::show(ui, canvas, &context, data.truth.is_some(), &mut acts);
    let shown = canvas.mass;
    ui.scope(|ui| {
        ui.visuals_mut().extreme_bg_color = palette::ground(context.dark);
        match (&room.known.failure, context.stage()) {
            (Some(failure), _) => {
                if words::failure(ui, failure, edit.walk != edit.walk.afresh()) {
                    acts.push(WalkAct::Restart);
                }
            }
            (None, None) => {
                ui.centered_and_justified(|ui| ui.weak("fitting the base model…"));
            }
            (None, Some(stage)) => match canvas.view.step {
                RoundStep::Compare => compare::show(ui, canvas, &context, stage, &mut acts),
                RoundStep::Name => name::show(ui, canvas, &context, &mut acts),
                RoundStep::Add => add::show(ui, canvas, &context, stage, &mut acts),
                RoundStep::Verify => verify::show(ui, canvas, &context, &mut acts),
            },
        }
    });
    canvas.figures.tidy();
    if canvas.mass != shown {
        *mass = canvas.mass;
    }
    acts
}

/// Draws the room's part of the left column.
pub(crate) fn controls(
    ui: &mut Ui,
    room: &Missing,
    canvas: &mut WalkCanvas,
    data: &OpenRecords,
    edit: &mut Edit,
) -> Vec<WalkAct> {
    base::choice(ui, &mut canvas.typing, data, edit);
    let mut acts = Vec::new();
    own::show(ui, &mut canvas.own, edit, &mut acts);
    let (subject, walk) = (WalkSubject::of(data), edit.walk.clone());
    let context = context(ui, room, canvas, &walk, &subject);
    places::show(ui, canvas, &context);
    acts.extend(base::walk(ui, &context, &edit.settings));
    acts
}

/// Draws the right column.
pub(crate) fn findings(
    ui: &mut Ui,
    room: &Missing,
    canvas: &mut WalkCanvas,
    data: &OpenRecords,
    edit: &Edit,
) -> Vec<WalkAct> {
    let mut acts = Vec::new();
    let subject = WalkSubject::of(data);
    let context = context(ui, room, canvas, &edit.walk, &subject);
    if let Some(truth) = data.truth.as_ref().filter(|_| canvas.view.revealed) {
        findings::truth(ui, &context, truth);
    }
    let looked_at = canvas.hovered.clone().or_else(|| canvas.view.selected.clone());
    let preview = looked_at.filter(|_| canvas.view.step == RoundStep::Add);
    findings::show(ui, canvas, &context, preview.as_ref(), &mut acts);
    acts
}

fn context<'a>(
    ui: &Ui,
    room: &'a Missing,
    canvas: &WalkCanvas,
    walk: &'a Walk,
    subject: &'a WalkSubject,
) -> WalkContext<'a> {
    room.context(walk, subject, (canvas.mass, canvas.view.site), ui.visuals().dark_mode)
}

impl Missing {
    /// The settings of Identify that take the model as it stands over; none while it is being fitted.
    pub(crate) fn taken_over(&self, edit: &Edit) -> Option<Result<Settings, String>> {
        self.stage(&edit.walk).map(|stage| base::settings(stage, &edit.settings))
    }
}
