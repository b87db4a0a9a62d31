//! The views of a structure's modes in the centre.

use std::sync::Arc;

use egui::{Align, ComboBox, Context, Id, Layout, Ui, vec2};

use super::room::ModalRoom;
use crate::app::figure_panel::FigureLook;
use crate::app::plot::painter::{self, Look, Plots, ShownPanel, Wish};
use crate::app::plot::{display, legend, palette};
use crate::app::records::OpenRecords;
use crate::app::state::ModalShown;
use crate::app::widgets::{record_steps, tab};
use sindyscope_modes::{ModalAnalysis, Pole, Stability};
use sindyscope_report::figure::Figure;
use sindyscope_report::modal::{ModalOptions, ModalSubject, ModalView, modal_averages};
use sindyscope_report::view::AVERAGES;
use sindyscope_values::record::Usage;

/// Height of the line above a view, points.
const HEIGHT: f32 = 24.0;

/// Distance within which a click finds a pole, points.
const REACH: f32 = 12.0;

/// What a person asked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ModalAct {
    /// Show another record, by its place among those that are open.
    ShowRecord(usize),
    /// Save a picture of the figure.
    SavePicture,
    /// Save these numbers.
    SaveTable(String),
    /// Look for the force that the modes lack.
    Search,
    /// Stop looking.
    StopSearch,
    /// Fit the modes from these poles.
    Poles(Vec<Pole>),
}

/// What the drawing of the views remembers from frame to frame.
#[derive(Default)]
pub(crate) struct ModalCanvas {
    plots: Plots,
    /// Whether shapes are shown swinging.
    swings: bool,
}

/// Seconds that a shape takes to swing once, and from one picture of it to the next.
const SWING: f64 = 2.0;
const NEXT_PICTURE: f32 = 0.04;

/// The name of a view's plot in egui's memory.
fn plot_id(view: ModalView, panel: &'static str) -> Id {
    Id::unique(("modal", view, panel))
}

/// Draws tabs and view into all the room there is.
pub(crate) fn show(
    ui: &mut Ui,
    room: &ModalRoom,
    shown: &mut ModalShown,
    (data, record, fitted): (&OpenRecords, usize, u64),
    canvas: &mut ModalCanvas,
) -> Option<ModalAct> {
    tabs(ui, &mut shown.view);
    let Some(analysis) = room.analysis() else {
        let text = room.failure().unwrap_or("looking for modes…").to_owned();
        ui.centered_and_justified(|ui| ui.weak(text));
        return None;
    };
    let place = ModalRoom::place(analysis, data, record);
    ui.scope(|ui| {
        ui.visuals_mut().extreme_bg_color = palette::ground(ui.visuals().dark_mode);
        ui.spacing_mut().item_spacing.y = 2.0;
        let asked = header(ui, analysis, (data, place), shown, &mut canvas.swings);
        let Some(drawn) = room.figures.shown(shown.view) else {
            legend::note(ui, "Computing the figure…");
            return asked;
        };
        let figure = match &*drawn {
            Ok(figure) => figure,
            Err(why) => {
                legend::note(ui, why);
                return asked;
            }
        };
        let swung = swung(ui, analysis, shown, canvas.swings);
        let figure = swung.as_ref().unwrap_or(figure);
        legend::reading(ui, shown.view.reading());
        let (view, name) = (shown.view, shown.view.label());
        let id = |panel: &'static str| plot_id(view, panel);
        let of = (place, &shown.options.sensor, &shown.options.input, fitted, data.generation);
        let mut look = Look::new(&id, of, name);
        look.hidden = Some(&mut shown.hidden);
        look.strength = if room.is_stale() { 0.55 } else { 1.0 };
        let painted = painter::show(ui, &mut canvas.plots, figure, &mut look);
        let picked = (view == ModalView::Stabilization).then(|| picked(ui, analysis, &painted.shown)).flatten();
        let wish = painted.wish.map(|wish| match wish {
            Wish::Table(text) => ModalAct::SaveTable(text),
            Wish::Picture => ModalAct::SavePicture,
        });
        asked.or(picked.map(ModalAct::Poles)).or(wish)
    })
    .inner
}

fn tabs(ui: &mut Ui, shown: &mut ModalView) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        for view in ModalView::ALL {
            if tab(ui, view.label(), view.tooltip(), *shown == view) {
                *shown = view;
            }
        }
    });
}

/// The line above a view: what is shown of it.
fn header(
    ui: &mut Ui,
    analysis: &Arc<ModalAnalysis>,
    (data, place): (&OpenRecords, usize),
    shown: &mut ModalShown,
    swings: &mut bool,
) -> Option<ModalAct> {
    let mut asked = None;
    let size = vec2(ui.available_width(), HEIGHT);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_height(HEIGHT);
        match shown.view {
            ModalView::Responses => {
                let count = analysis.records.len();
                let record = &analysis.records[place];
                if count > 1 {
                    let to = record_steps(ui, place, count).and_then(|to| {
                        let name = &analysis.records[to].name;
                        data.records.iter().position(|r| r.name == *name)
                    });
                    asked = to.map(ModalAct::ShowRecord);
                }
                ui.strong(&record.name);
                ui.weak("·");
                ui.label(if record.usage == Usage::HeldOut { "held out" } else { "fitted" });
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    of_responses(ui, analysis, place, &mut shown.options);
                });
            }
            ModalView::Stabilization => {
                let stable = analysis.stabilization.poles.iter().filter(|p| p.stability == Stability::Whole).count();
                ui.weak(format!("{} poles, {stable} of them stable", analysis.stabilization.poles.len()));
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    log_frequency(ui, &mut shown.options);
                    ui.checkbox(&mut shown.options.spurious, "spurious").on_hover_text(
                        "Poles too that stand for noise: no damping or too much, or a shape whose sensors have no common phase",
                    );
                });
            }
            ModalView::Shapes => {
                let text = match shown.options.mode {
                    None => "all modes in the band; a click on a mode in the table shows it alone".to_owned(),
                    Some(k) => format!("mode {} alone", analysis.structure.mode_number(k)),
                };
                ui.weak(text);
                if shown.options.mode.is_some() && ui.button("Show all").clicked() {
                    shown.options.mode = None;
                }
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    ui.checkbox(swings, "swing").on_hover_text("Let the shapes swing, slowed down, each as fast as the others");
                });
            }
        }
    });
    asked
}

/// The shapes as they swing, if they do; quick enough for every frame.
fn swung(ui: &Ui, analysis: &ModalAnalysis, shown: &ModalShown, swings: bool) -> Option<Figure> {
    if !swings || shown.view != ModalView::Shapes {
        return None;
    }
    ui.ctx().request_repaint_after_secs(NEXT_PICTURE);
    let angle = std::f64::consts::TAU * (ui.input(|i| i.time) / SWING).fract();
    let options = ModalOptions { swing: Some(angle), ..shown.options.clone() };
    shown.view.figure(&ModalSubject { analysis, record: 0, options: &options }).ok()
}

fn log_frequency(ui: &mut Ui, options: &mut ModalOptions) {
    ui.checkbox(&mut options.log_frequency, "log f").on_hover_text("Frequency on a logarithmic axis");
}

/// What is chosen of responses, from right to left.
fn of_responses(ui: &mut Ui, analysis: &ModalAnalysis, place: usize, options: &mut ModalOptions) {
    log_frequency(ui, options);
    let structure = &analysis.structure;
    if !structure.inputs.is_empty() {
        let usual = modal_averages(&ModalSubject { analysis, record: place, options });
        let text = |n: usize| if n == 0 { format!("usual ({usual})") } else { n.to_string() };
        let combo = ComboBox::from_id_salt("modal averages").selected_text(text(options.averages)).width(84.0);
        let combo = combo.show_ui(ui, |ui| {
            for n in std::iter::once(0).chain(AVERAGES) {
                ui.selectable_value(&mut options.averages, n, text(n));
            }
        });
        let label = ui.label("averages").on_hover_text("More averages: less noise, coarser frequencies");
        combo.response.labelled_by(label.id);
    }
    let mut choose = |names: &[&str], what: &str, chosen: &mut usize| {
        if names.len() < 2 {
            return;
        }
        let at = (*chosen).min(names.len() - 1);
        let combo = ComboBox::from_id_salt(what).selected_text(names[at]).width(60.0).show_ui(ui, |ui| {
            for (k, name) in names.iter().enumerate() {
                ui.selectable_value(chosen, k, *name);
            }
        });
        let label = ui.weak(what);
        combo.response.labelled_by(label.id);
    };
    let inputs: Vec<&str> = structure.inputs.iter().map(|i| i.name.as_str()).collect();
    let sensors: Vec<&str> = structure.sensors.iter().map(|s| s.name.as_str()).collect();
    choose(&inputs, "input", &mut options.input);
    choose(&sensors, "sensor", &mut options.sensor);
}

/// The poles after a click in the stabilization diagram: a mark is taken, or the mode that was chosen near it is left.
fn picked(ui: &Ui, analysis: &ModalAnalysis, shown: &[ShownPanel<'_>]) -> Option<Vec<Pole>> {
    let ShownPanel { panel, plot } = shown.first()?;
    let at = plot.response.interact_pointer_pos().filter(|_| plot.response.clicked())?;
    let place = |frequency: f64, order: f64| {
        let point = egui_plot::PlotPoint::new(panel.x.coordinate(frequency), order);
        plot.transform.position_from_point(&point)
    };
    let structure = &analysis.structure;
    let mut poles: Vec<Pole> = structure.modes.iter().map(|m| Pole::at(m.frequency, m.damping)).collect();
    // A chosen mode's line runs across all orders.
    let line = |k: &usize| (place(structure.modes[*k].frequency, 0.0).x - at.x).abs();
    let near = (0..poles.len()).min_by(|a, b| line(a).total_cmp(&line(b))).filter(|k| line(k) < 0.5 * REACH);
    if let Some(k) = near {
        poles.remove(k);
        ui.ctx().request_repaint();
        return (!poles.is_empty()).then_some(poles);
    }
    let distance = |pole: &Pole, order: usize| place(pole.frequency(), order as f64).distance(at);
    let marks = analysis.stabilization.poles.iter().filter(|p| p.stability != Stability::Spurious);
    let nearest = marks.map(|p| (p.pole, distance(&p.pole, p.order))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    (nearest.1 < REACH).then(|| {
        poles.push(nearest.0);
        poles.sort_by(|a, b| a.omega.total_cmp(&b.omega));
        poles
    })
}

/// The figure in view as SVG, as it is seen or whole; none while there is none.
pub(crate) fn svg(ctx: &Context, room: &ModalRoom, shown: &ModalShown, look: FigureLook) -> Option<String> {
    let drawn = room.figures.shown(shown.view)?;
    let mut figure = drawn.as_ref().ok()?.clone();
    if look.as_shown {
        let place = |panel: &'static str| plot_id(shown.view, panel);
        figure = figure.as_seen(&shown.hidden, |panel| painter::zoom(ctx, &place, panel));
    }
    Some(figure.svg(look.size, &display::chosen(ctx)))
}
