//! Figures of the room to take along: drawn for print, their numbers as a table.

use egui::{Context, Response, Ui};

use super::{Act, Missing, RoundStep, Sight, add, compare, map, plots, verify, waterfall};
use crate::app::bench::Bench;
use crate::app::plot::export::csv;
use crate::app::plot::palette;
use crate::app::state::Edit;
use crate::app::views;
use sindyscope_report::document::FigureSize;
use sindyscope_search::{Choice, Curve, Map, Profile, Stage};
use sindyscope_values::format::units::Scale;

/// A figure that is saved alone.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Figure {
    /// The plots over time of the step that is in view.
    Time(RoundStep),
    /// The missing force over displacement and velocity.
    Map,
    /// The missing force along one quantity.
    Profile,
    /// The force of a candidate over the quantity at its place.
    Curve(Choice),
    /// The error after each effect.
    Waterfall,
}

impl Figure {
    /// What it is called, in the title of the panel and in the name of the file.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Time(RoundStep::Add) => "preview",
            Self::Time(RoundStep::Verify) => "before and after",
            Self::Time(_) => "gap",
            Self::Map => "map",
            Self::Profile => "missing force",
            Self::Curve(_) => "effect",
            Self::Waterfall => "errors",
        }
    }
}

/// The menu of a plot's right button.
pub(super) fn menu(response: &Response, figure: &Figure, table: impl FnOnce() -> String, acts: &mut Vec<Act>) {
    response.context_menu(|ui| {
        let (copy, save) = (ui.button("Copy as CSV").clicked(), ui.button("Save as CSV…").clicked());
        if copy {
            ui.ctx().copy_text(table());
            ui.close();
        } else if save {
            acts.push(Act::SaveTable(figure.name(), table()));
            ui.close();
        }
        if ui.button("Save this figure…").on_hover_text("As SVG, PDF or PNG, at a size on paper").clicked() {
            acts.push(Act::SaveFigure(figure.clone()));
            ui.close();
        }
    });
}

impl Missing {
    /// The figure that is saved without one being pointed at.
    pub(crate) fn main_figure(&self) -> Figure {
        match (self.step, &self.selected) {
            (RoundStep::Name, Some(choice)) => Figure::Curve(choice.clone()),
            (RoundStep::Name, None) => Figure::Profile,
            (step, _) => Figure::Time(step),
        }
    }

    /// A figure as an SVG document for print, zoomed as in the window (`like`, the window's context); none if there is
    /// nothing to draw.
    pub(crate) fn svg(
        &mut self,
        like: &Context,
        figure: &Figure,
        (bench, edit): (&Bench, &Edit),
        size: FigureSize,
    ) -> Option<String> {
        let subject = super::Subject::of(bench);
        let known = std::mem::take(&mut self.known);
        let sight = self.sight(&known, &edit.walk, &subject, false);
        let mut drawn = false;
        let text = views::on_paper(like, size, |ui| {
            ui.visuals_mut().extreme_bg_color = palette::ground(false);
            drawn = draw(ui, self, &sight, figure).is_some();
        });
        self.known = known;
        drawn.then_some(text)
    }
}

/// Draws a figure into all the room there is.
fn draw(ui: &mut Ui, room: &mut Missing, sight: &Sight<'_>, figure: &Figure) -> Option<()> {
    let (size, acceleration) = (ui.available_size(), &sight.subject.acceleration);
    let acts = &mut Vec::new();
    match figure {
        Figure::Time(RoundStep::Add) => {
            let before = sight.stage()?;
            let after = add::looked_at(room, sight).and_then(|c| sight.with(&c.choice));
            let record = before.traces.get(room.record)?.record.clone();
            add::overlay(ui, room, sight, (before, after, &record), size.y, acts);
        }
        Figure::Time(RoundStep::Verify) => {
            let stages = sight.stages();
            let trace = stages.last()?.traces.get(verify::record_shown(room, stages.last()?))?.clone();
            verify::before_and_after(ui, room, sight, (&stages, &trace), size.y, acts);
        }
        Figure::Time(_) => {
            let stage = sight.stage()?;
            compare::time(ui, room, sight, stage.traces.get(room.record)?, size.y, acts);
        }
        Figure::Map => drop(map::show(ui, &sight.place()?.map, acceleration, size, "")),
        Figure::Profile => {
            let place = sight.place().filter(|p| !p.profiles.is_empty())?;
            let shown = &place.profiles[compare::profile(room, sight, place)];
            map::profile(ui, shown, acceleration, size, "");
        }
        Figure::Curve(choice) => {
            let candidate = sight.candidates().iter().find(|c| c.choice == *choice)?;
            let (rect, _) = ui.allocate_exact_size(size, egui::Sense::hover());
            let color = super::stage_color(sight.stage()?.effects.len() + 1, sight.dark);
            plots::curve(ui, rect, &candidate.curve, acceleration, color, false);
        }
        Figure::Waterfall => drop(waterfall::show(ui, &sight.stages(), sight.known.noise_floor, sight.unit, size)),
    }
    Some(())
}

/// A quantity with its unit, as the head of a column.
fn head(name: &str, unit: &str) -> String {
    Scale::plain(unit).axis(name)
}

/// The cells of a map: their middles, the mean force and how many standard errors it is from zero.
pub(super) fn map_table(map: &Map, acceleration: &str) -> String {
    let heads = [
        head(&map.across.0, &map.across.1),
        head(&map.up.0, &map.up.1),
        head("missing force", acceleration),
        "over its standard error".to_owned(),
    ];
    let columns = map.columns.len().saturating_sub(1).max(1);
    let known: Vec<usize> = (0..map.mean.len()).filter(|k| map.mean[*k].is_finite()).collect();
    let middle = |edges: &[f64], k: usize| edges.get(k..k + 2).map(|e| 0.5 * (e[0] + e[1]));
    csv(&heads, known.len(), |row, column| match column {
        0 => middle(&map.columns, known[row] % columns),
        1 => middle(&map.rows, known[row] / columns),
        2 => Some(map.mean[known[row]]),
        _ => map.score.get(known[row]).copied(),
    })
}

/// A profile: middles of its bins, the mean force and its standard error.
pub(super) fn profile_table(profile: &Profile, acceleration: &str) -> String {
    let heads =
        [head(&profile.axis.0, &profile.axis.1), head("missing force", acceleration), head("std error", acceleration)];
    let columns = [&profile.at, &profile.mean, &profile.error];
    csv(&heads, profile.at.len(), |row, column| columns[column].get(row).copied())
}

/// The points of a candidate's card: the measured missing force, then the effect's own.
pub(super) fn curve_table(curve: &Curve, acceleration: &str) -> String {
    let axis = head(&curve.axis, &curve.unit);
    let heads = [
        axis.clone(),
        head("missing force", acceleration),
        format!("{axis} of the effect"),
        head("force of the effect", acceleration),
    ];
    let rows = curve.measured.len().max(curve.effect.len());
    csv(&heads, rows, |row, column| {
        let points = if column < 2 { &curve.measured } else { &curve.effect };
        points.get(row).map(|p| p[column % 2])
    })
}

/// The error after each stage, on data never fitted and on the fitted.
pub(super) fn waterfall_table(stages: &[&std::sync::Arc<Stage>], noise: f64, unit: &str) -> String {
    let heads = ["effects".to_owned(), head("RMSE not fitted", unit), head("RMSE fitted", unit), head("noise", unit)];
    csv(&heads, stages.len(), |row, column| match column {
        0 => Some(stages[row].effects.len() as f64),
        1 => stages[row].gap.test_rmse,
        2 => Some(stages[row].gap.train_rmse),
        _ => Some(noise),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_have_their_units_and_leave_out_what_is_not_known() {
        let map = Map {
            across: ("x".into(), "mm".into()),
            up: ("v".into(), "mm/s".into()),
            columns: vec![0.0, 1.0, 2.0],
            rows: vec![0.0, 4.0],
            mean: vec![f64::NAN, 3.0],
            score: vec![0.0, 5.0],
        };
        assert_eq!(
            map_table(&map, "mm/s²"),
            "x (mm),v (mm/s),missing force (mm/s²),over its standard error\n1.5,2,3,5\n"
        );
        let curve = Curve {
            over: None,
            axis: "v".into(),
            unit: "m/s".into(),
            measured: vec![[1.0, 2.0], [3.0, 4.0]],
            effect: vec![[0.5, 0.25]],
        };
        let text = curve_table(&curve, "m/s²");
        assert!(text.ends_with("1,2,0.5,0.25\n3,4,,\n"), "{text}");
    }
}
