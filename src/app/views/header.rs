//! The line above every view: which record, how it is used, how well it is met.

use egui::{Align, Layout, Ui};

use super::scene::Scene;
use super::{Picture, Request, View, ViewState, map};
use crate::app::plot::{number, units};
use crate::record::Usage;
use crate::term::Symbol;

const HEIGHT: f32 = 24.0;

pub(super) fn show(
    ui: &mut Ui,
    view: View,
    scene: &Scene<'_>,
    picture: &Picture<'_>,
    state: &mut ViewState,
) -> Option<Request> {
    let mut asked = None;
    let size = egui::vec2(ui.available_width(), HEIGHT);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        if view != View::Front {
            ui.set_min_height(HEIGHT);
        }
        if !view.of_a_record() {
            asked = of_settings(ui, view, scene, picture, state);
            return;
        }
        let count = scene.outcome.records.len();
        if count > 1 && !state.printing {
            let step = |ui: &mut Ui, sign: &str, name: &str, to: Option<usize>| {
                let button = egui::Button::new(sign).small().frame(false);
                let response = ui.add_enabled(to.is_some(), button).on_hover_text(name);
                response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, to.is_some(), name));
                response.clicked().then_some(to).flatten()
            };
            let back = step(ui, "⏴", "Previous record", scene.index.checked_sub(1));
            let on = step(ui, "⏵", "Next record", Some(scene.index + 1).filter(|i| *i < count));
            asked = back.or(on).map(Request::ShowRecord);
        }
        ui.strong(&scene.record.record.name);
        if count > 1 && !state.printing {
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
            let rmse = units::format_si(score.rmse, &scene.unit(), 3);
            ui.label(format!("RMSE {rmse}, fit {} %", number::plain(score.best_fit, 2)))
                .on_hover_text("Root mean square of E(t), and 100 (1 − ‖y−ŷ‖ / ‖y−ȳ‖), on this record");
        }
        if state.printing {
            return;
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            match view {
                View::Response => {
                    ui.checkbox(&mut state.log_error, "log E").on_hover_text("Error on a logarithmic axis");
                }
                View::Velocity if scene.second_order() => {
                    ui.checkbox(&mut state.acceleration, "acceleration").on_hover_text("Acceleration beneath");
                }
                View::Spectrum => {
                    ui.checkbox(&mut state.log_frequency, "log f").on_hover_text("Frequency on a logarithmic axis");
                }
                _ => {}
            }
            let (several, name, shown, chosen): (usize, fn(usize) -> Symbol, usize, &mut usize) = match view {
                View::Input => (scene.layout.inputs, Symbol::Input, scene.input, &mut state.input),
                _ => (scene.layout.freedoms, Symbol::State, scene.freedom, &mut state.freedom),
            };
            if several > 1 {
                ui.separator();
                // Right to left, so that the first stands on the left.
                for i in (0..several).rev() {
                    if ui.selectable_label(shown == i, scene.layout.name(name(i))).clicked() {
                        *chosen = i;
                    }
                }
            }
        });
    });
    asked
}

/// The line above a view of the settings.
fn of_settings(
    ui: &mut Ui,
    view: View,
    scene: &Scene<'_>,
    picture: &Picture<'_>,
    state: &mut ViewState,
) -> Option<Request> {
    match view {
        View::Map => map::header(ui, picture, state),
        View::Path => {
            if scene.outcome.fits.len() > 1 {
                for (k, fit) in scene.outcome.fits.iter().enumerate() {
                    let name = format!("d{}/dt", scene.layout.name(fit.state));
                    if ui.selectable_label(state.freedom.min(scene.outcome.fits.len() - 1) == k, name).clicked() {
                        state.freedom = k;
                    }
                }
            }
            if state.printing {
                return None;
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.checkbox(&mut state.raw_path, "in their units")
                    .on_hover_text("Magnitudes of the coefficients as they stand");
                ui.add_enabled(!state.raw_path, egui::Checkbox::new(&mut state.signed_path, "signed"))
                    .on_hover_text("With their signs, on a linear axis");
            });
        }
        _ => {}
    }
    None
}
