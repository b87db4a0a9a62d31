//! The line above every view: which record, how it is used, how well it is met.

use egui::{Align, Layout, Ui};

use super::picture::{Picture, ViewAct};
use crate::app::plot::{number, units};
use crate::app::state::ViewState;
use crate::app::widgets::record_steps;
use sindyscope_core::study::Judge;
use sindyscope_report::diagram::ResidualSource;
use sindyscope_report::view::{self, AVERAGES, MapQuantity, RecordUse, Scene, USUAL_AVERAGES, View};
use sindyscope_values::record::Usage;
use sindyscope_values::term::Symbol;

const HEIGHT: f32 = 24.0;

/// Width kept for what is chosen of a view that tells errors, points.
const OPTIONS: f32 = 84.0;

pub(super) fn show(
    ui: &mut Ui,
    view: View,
    scene: &Scene<'_>,
    picture: &Picture<'_>,
    state: &mut ViewState,
) -> Option<ViewAct> {
    let mut asked = None;
    let size = egui::vec2(ui.available_width(), HEIGHT);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        if view != View::Front {
            ui.set_min_height(HEIGHT);
        }
        if view.entry().records == RecordUse::None {
            asked = of_settings(ui, view, scene, picture, state);
            return;
        }
        let count = scene.outcome.records.len();
        let pools = view.entry().records == RecordUse::Pooled;
        let together = pools && !state.options.alone && count > 1;
        if together {
            ui.strong(format!("all {count} records"));
        }
        if count > 1 && !together {
            asked = record_steps(ui, scene.index, count).map(ViewAct::ShowRecord);
        }
        if !together {
            let size = egui::vec2((ui.available_width() - OPTIONS).max(0.0), HEIGHT);
            ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
                of_the_record(ui, view, scene);
            });
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if pools && count > 1 {
                ui.checkbox(&mut state.options.alone, "one record").on_hover_text("Show the chosen record alone");
            }
            options(ui, view, scene, state);
        });
    });
    asked
}

/// Which record, how it is used, how well it is met.
fn of_the_record(ui: &mut Ui, view: View, scene: &Scene<'_>) {
    let count = scene.outcome.records.len();
    ui.strong(&scene.record.record.name);
    if count > 1 {
        ui.weak(format!("{} of {count}", scene.index + 1));
    }
    ui.weak("·");
    ui.label(match scene.record.usage {
        Usage::Fit => "fitted",
        Usage::HeldOut => "held out",
        Usage::Off => "off",
    })
    .on_hover_text("Held-out records are never fitted, only simulated: their error is the honest one");
    if matches!(view, View::Response | View::Spectrum)
        && let Some(score) = scene.channel().and_then(|c| c.score.as_ref())
    {
        ui.weak("·");
        let rmse = units::format_si(score.rmse, &scene.shown().1, 3);
        let text = format!("RMSE {rmse}, fit {} %", number::plain(score.best_fit, 2));
        ui.add(egui::Label::new(text).truncate())
            .on_hover_text("Root mean square of E(t), and 100 (1 − ‖y−ŷ‖ / ‖y−ȳ‖), on this record");
    }
}

/// What is chosen of a view, from right to left.
fn options(ui: &mut Ui, view: View, scene: &Scene<'_>, state: &mut ViewState) {
    match view {
        View::Response => {
            ui.checkbox(&mut state.options.log_error, "log E").on_hover_text("Error on a logarithmic axis");
        }
        View::Velocity if scene.second_order() => {
            ui.checkbox(&mut state.options.acceleration, "acceleration").on_hover_text("Acceleration beneath");
        }
        View::Restoring | View::Friction => {
            if view == View::Restoring {
                ui.checkbox(&mut state.options.curved, "without linear")
                    .on_hover_text("Show what is left of the surface when the straight part, k x + c v, is taken away");
            }
            let (choices, chosen) = view::across(scene, state.options.across);
            if choices.len() > 1 {
                ui.separator();
                for across in choices.into_iter().rev() {
                    let name = view::deflection_name(scene, across);
                    let response = ui.selectable_label(across == chosen, name);
                    if response.on_hover_text("What the deflection is measured against").clicked() {
                        state.options.across = Some(across);
                    }
                }
            }
        }
        View::Transfer => {
            ui.checkbox(&mut state.options.log_frequency, "log f").on_hover_text("Frequency on a logarithmic axis");
            ui.checkbox(&mut state.options.noisy_input, "H2")
                .on_hover_text("For noise on the input; without it H1, for noise on the response");
            let averages = if state.options.averages == 0 { USUAL_AVERAGES } else { state.options.averages };
            let combo = egui::ComboBox::from_id_salt("averages").selected_text(averages.to_string()).width(46.0);
            let combo = combo.show_ui(ui, |ui| {
                for n in AVERAGES {
                    ui.selectable_value(&mut state.options.averages, n, n.to_string());
                }
            });
            let label = ui.label("averages").on_hover_text("More averages: less noise, coarser frequencies");
            combo.response.labelled_by(label.id);
        }
        View::Residual => {
            let (of, rate) =
                (&mut state.options.residual_of, if scene.second_order() { "acceleration" } else { "rate" });
            ui.selectable_value(of, ResidualSource::Equation, rate)
                .on_hover_text("What the equation leaves of the measured rate");
            ui.selectable_value(of, ResidualSource::Response, "response")
                .on_hover_text("Measured minus simulated response");
        }
        View::Spectrum => {
            ui.checkbox(&mut state.options.log_frequency, "log f").on_hover_text("Frequency on a logarithmic axis");
        }
        _ => {}
    }
    if matches!(view, View::Input | View::Transfer) {
        choose(ui, scene, scene.layout.inputs, Symbol::Input, scene.input, &mut state.options.input);
    }
    if view != View::Input {
        choose(ui, scene, scene.layout.freedoms, Symbol::State, scene.freedom, &mut state.options.freedom);
    }
}

/// One of several inputs or states, where there are several.
fn choose(ui: &mut Ui, scene: &Scene<'_>, several: usize, name: fn(usize) -> Symbol, shown: usize, chosen: &mut usize) {
    if several < 2 {
        return;
    }
    ui.separator();
    // Right to left, so that the first stands on the left.
    for i in (0..several).rev() {
        if ui.selectable_label(shown == i, scene.layout.name(name(i))).clicked() {
            *chosen = i;
        }
    }
}

/// The line above a view of the settings.
fn of_settings(
    ui: &mut Ui,
    view: View,
    scene: &Scene<'_>,
    picture: &Picture<'_>,
    state: &mut ViewState,
) -> Option<ViewAct> {
    match view {
        View::Map => {
            let judge = picture.search.map.map_or(Judge::CrossValidation, |m| m.judge);
            for quantity in MapQuantity::ALL {
                let quantity_label = ui.selectable_label(state.options.quantity == quantity, quantity.label(judge));
                if quantity_label.on_hover_text(quantity.tooltip()).clicked() {
                    state.options.quantity = quantity;
                }
            }
        }
        View::Path => {
            if scene.outcome.fits.len() > 1 {
                for (k, fit) in scene.outcome.fits.iter().enumerate() {
                    let name = format!("d{}/dt", scene.layout.name(fit.state));
                    if ui.selectable_label(state.options.freedom.min(scene.outcome.fits.len() - 1) == k, name).clicked()
                    {
                        state.options.freedom = k;
                    }
                }
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.checkbox(&mut state.options.raw_path, "in their units")
                    .on_hover_text("Magnitudes of the coefficients as they stand");
                ui.add_enabled(!state.options.raw_path, egui::Checkbox::new(&mut state.options.signed_path, "signed"))
                    .on_hover_text("With their signs, on a linear axis");
            });
        }
        _ => {}
    }
    None
}
