//! The centre of the window: what was measured and what the identified model does, seen in several ways.
//!
//! What a view shows is a [figure](sindyscope_report::view) of a [`Picture`] and a [`ViewState`]; here it is made when it is asked
//! for, kept until it would be another, and drawn.

mod compare;
mod header;
mod kept;
mod picture;
mod settings;
#[cfg(test)]
mod tests;

use std::collections::{BTreeSet, HashMap};

use egui::Id;

use super::plot::beside::Ready;
use super::plot::painter::{self, Look, Plots, Wish};
use super::plot::palette::Ink;
use super::plot::{display, legend, palette};
use super::state::ViewState;
pub(crate) use kept::{FigureRequest, ViewFigures};
pub(crate) use picture::{MapProgress, Picture, ViewAct};
use sindyscope_report::figure::{Figure, PanelRow};
use sindyscope_report::view::Scene;
pub(crate) use sindyscope_report::view::{Group, View};
use sindyscope_values::format::number::plain;
use sindyscope_values::format::shown::ShownUnits;

/// Share of its strength that what is shown loses while a newer outcome is being computed.
const STALE_FADE: f32 = 0.45;

/// Seconds over which it fades: an outcome that comes at once leaves no flicker.
const FADE_TIME: f32 = 0.6;

/// Share of lags outside a band from which a correlation is marked: chance leaves 0.05, seldom twice that.
const SUSPECT: f64 = 0.15;

/// The name of a view's plot in egui's memory.
fn plot_id(view: View, panel: &'static str) -> Id {
    Id::unique(("view", view, panel))
}

/// Draws a view into all the room there is. What a person changes of how views show it changes `state`; `plots` is what the
/// drawing remembers.
pub(crate) fn show(
    ui: &mut egui::Ui,
    view: View,
    (picture, figures): (&Picture<'_>, &ViewFigures),
    state: &mut ViewState,
    plots: &mut Plots,
) -> Option<ViewAct> {
    let options = state.options.clone();
    let scene = match Scene::new(&picture.subject(&options)) {
        Ok(scene) => scene,
        Err(why) => {
            legend::note(ui, &why);
            return None;
        }
    };
    ui.scope(|ui| {
        ui.visuals_mut().extreme_bg_color = palette::ground(ui.visuals().dark_mode);
        ui.spacing_mut().item_spacing.y = 2.0;
        let asked = header::show(ui, view, &scene, picture, state);
        let drawn = figures.shown(view);
        let also = body(ui, view, &scene, (picture, drawn), state, plots);
        asked.or(also)
    })
    .inner
}

/// What stands beneath a view's header.
fn body(
    ui: &mut egui::Ui,
    view: View,
    scene: &Scene<'_>,
    (picture, drawn): (&Picture<'_>, Option<Ready>),
    state: &mut ViewState,
    plots: &mut Plots,
) -> Option<ViewAct> {
    if let Some(failure) = picture.search.failure.filter(|_| view.needs_map() && picture.search.map.is_none()) {
        legend::note(ui, failure);
        return None;
    }
    let Some(drawn) = drawn else {
        legend::note(ui, &format!("Computing {}…", view.label().to_lowercase()));
        return None;
    };
    let figure = match &*drawn {
        Ok(figure) => figure,
        Err(why) => {
            legend::note(ui, why);
            return None;
        }
    };
    if !view.entry().reading.is_empty() {
        legend::reading(ui, view.entry().reading);
    }
    let above = match (view, picture.search.map) {
        (View::Map | View::Front, Some(map)) => settings::signs(ui, map),
        (View::Compare, _) => compare::buttons(ui, scene, picture),
        _ => None,
    };
    let chosen = choices(ui, figure, state);
    let below = if view == View::Compare { compare::height(ui, scene, picture) } else { 0.0 };
    let record = &scene.record.record;
    let data = (&record.name, record.len(), record.start.to_bits(), record.interval.to_bits());
    let stale = ui.ctx().animate_bool_with_time(Id::unique("stale views"), picture.stale, FADE_TIME);
    let map_stale = view.needs_map() && picture.search.stale;
    let place = |panel: &'static str| plot_id(view, panel);
    let name = settings::name(view);
    let shown = (scene.index, scene.freedom, scene.input);
    let mut look = Look::new(&place, (data, shown, picture.fitted), &name);
    look.hidden = Some(&mut state.hidden);
    look.pick = chosen;
    look.strength = 1.0 - STALE_FADE * stale.max(f32::from(u8::from(map_stale)));
    let size = egui::vec2(ui.available_width(), ui.available_height() - below);
    let painted = ui.allocate_ui(size, |ui| painter::show(ui, plots, figure, &mut look)).inner;
    let also = settings::interact(ui, view, scene, picture, &painted.shown);
    let wish = painted.wish.map(|wish| match wish {
        Wish::Table(text) => ViewAct::SaveTable(text),
        Wish::Picture => ViewAct::SavePicture,
    });
    if view == View::Compare {
        compare::table(ui, scene, picture, below);
    }
    above.or(also).or(wish)
}

/// Which panel is shown of a row of which one is: chosen among their names.
fn choices(ui: &mut egui::Ui, figure: &Figure, state: &mut ViewState) -> Option<usize> {
    let row: &PanelRow = figure.rows.iter().find(|row| row.one_of.is_some() && row.panels.len() > 1)?;
    let shown = state.partner.min(row.panels.len() - 1);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.weak("Against");
        for (k, (name, outside)) in row.panels.iter().filter_map(|p| p.choice.as_ref()).enumerate() {
            let text = if *outside > SUSPECT { format!("{name} •") } else { name.clone() };
            let hint = format!("{} % of the lags lie outside the band; 5 % do by chance", plain(100.0 * outside, 0));
            let response = ui.selectable_label(k == shown, text).on_hover_text(hint);
            let spoken = format!("against {name}");
            response.widget_info(|| egui::WidgetInfo::selected(egui::Role::RadioButton, true, k == shown, &spoken));
            if response.clicked() {
                state.partner = k;
            }
        }
    });
    Some(shown)
}

/// How a view is zoomed in the window, and what is hidden: what its picture shows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seen {
    zoom: HashMap<&'static str, [(f64, f64); 2]>,
    hidden: BTreeSet<Ink>,
    units: ShownUnits,
    pick: Option<usize>,
}

/// A view's figure as it is to be saved: as it is seen in the window, or whole.
///
/// # Errors
/// Why there is nothing to draw.
pub(crate) fn figure(
    view: View,
    picture: &Picture<'_>,
    state: &ViewState,
    seen: Option<&Seen>,
) -> Result<Figure, String> {
    let picture = Picture { previous: None, ..*picture };
    let figure = view.figure(&picture.subject(&state.options))?;
    let Some(seen) = seen else { return Ok(figure) };
    let mut figure = figure.as_seen(&seen.hidden, |panel| seen.zoom.get(panel.id).copied());
    for row in figure.rows.iter_mut().filter(|row| row.one_of.is_some()) {
        row.one_of = seen.pick.map(|k| k.min(row.panels.len().saturating_sub(1))).or(row.one_of);
    }
    Ok(figure)
}

impl Seen {
    /// What is seen of a view in the window.
    pub(crate) fn of(ctx: &egui::Context, view: View, state: &ViewState, figures: &ViewFigures) -> Self {
        let place = |panel: &'static str| plot_id(view, panel);
        let shown = figures.shown(view);
        let panels = shown.iter().flat_map(|drawn| drawn.iter().flat_map(Figure::panels));
        Self {
            zoom: panels.filter_map(|p| Some((p.id, painter::zoom(ctx, &place, p)?))).collect(),
            hidden: state.hidden.clone(),
            units: display::chosen(ctx),
            pick: Some(state.partner),
        }
    }

    /// The units in which values are shown.
    pub(crate) fn units(&self) -> &ShownUnits {
        &self.units
    }
}
