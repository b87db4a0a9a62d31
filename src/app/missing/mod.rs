//! The room "What's missing": a walk in rounds of four steps, from where model and measurement part to an effect that was
//! added and checked on data never fitted.
//!
//! [`Walk`] is what a person decided; [`Missing`] is what was found for it. Each step is a function of both and asks for
//! [`WalkAct`]s; none computes anything.

mod act;
mod add;
mod base;
mod cards;
mod chain;
mod choice;
mod compare;
pub(crate) mod figures;
mod findings;
mod keep;
mod known;
mod name;
mod places;
pub(in crate::app) mod plots;
mod room;
mod steps;
mod subject;
mod verify;
mod words;
pub(crate) mod work;

use egui::{Ui, vec2};

use super::records::OpenRecords;
use super::state::{Edit, RoundStep, Walk};
pub(crate) use act::{Figure, WalkAct};
pub(crate) use room::{Missing, Wanted};
use sindyscope_core::study::Settings;
use subject::Subject;

impl Missing {
    /// Draws the centre; `mass` is the one whose response is shown.
    pub(crate) fn show(&mut self, ui: &mut Ui, bench: &OpenRecords, edit: &Edit, mass: &mut usize) -> Vec<WalkAct> {
        let mut acts = Vec::new();
        self.hovered = None;
        let subject = Subject::of(bench);
        self.mass = (*mass).min(subject.masses().saturating_sub(1));
        ui.spacing_mut().item_spacing = vec2(6.0, 3.0);
        let known = std::mem::take(&mut self.known);
        let walk = edit.walk.clone();
        let sight = self.sight(&known, &walk, &subject, ui.visuals().dark_mode);
        steps::show(ui, self, &sight, bench.truth.is_some(), &mut acts);
        let shown = self.mass;
        ui.scope(|ui| {
            ui.visuals_mut().extreme_bg_color = crate::app::plot::palette::ground(sight.dark);
            match (&known.failure, sight.stage()) {
                (Some(failure), _) => {
                    if words::failure(ui, failure, walk != Walk::default()) {
                        acts.push(WalkAct::Restart);
                    }
                }
                (None, None) => {
                    ui.centered_and_justified(|ui| ui.weak("fitting the base model…"));
                }
                (None, Some(stage)) => match self.view.step {
                    RoundStep::Compare => compare::show(ui, self, &sight, stage, &mut acts),
                    RoundStep::Name => name::show(ui, self, &sight, &mut acts),
                    RoundStep::Add => add::show(ui, self, &sight, stage, &mut acts),
                    RoundStep::Verify => verify::show(ui, self, &sight, &mut acts),
                },
            }
        });
        self.known = known;
        self.figures.tidy();
        if self.mass != shown {
            *mass = self.mass;
        }
        acts
    }

    /// Draws the room's part of the left column.
    pub(crate) fn controls(&mut self, ui: &mut Ui, bench: &OpenRecords, edit: &mut Edit) -> Vec<WalkAct> {
        base::column(ui, self, bench, edit)
    }

    /// The settings of Identify that take the model as it stands over; none while it is being fitted.
    pub(crate) fn taken_over(&self, edit: &Edit) -> Option<Result<Settings, String>> {
        self.stage(&edit.walk).map(|stage| base::settings(stage, &edit.settings))
    }

    /// Draws the right column.
    pub(crate) fn findings(&mut self, ui: &mut Ui, bench: &OpenRecords, edit: &Edit) {
        let subject = Subject::of(bench);
        let sight = self.sight(&self.known, &edit.walk, &subject, ui.visuals().dark_mode);
        if let Some(truth) = bench.truth.as_ref().filter(|_| self.view.revealed) {
            findings::truth(ui, &sight, truth);
        }
        findings::show(
            ui,
            &sight,
            self.hovered.as_ref().or(self.view.selected.as_ref()).filter(|_| self.view.step == RoundStep::Add),
        );
    }
}
