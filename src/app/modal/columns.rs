//! The columns beside the views of modes: how many, and what was found.

use egui::{Align, ComboBox, Label, Layout, RichText, Sense, Ui, WidgetInfo, vec2};

use super::room::ModalRoom;
use crate::app::plot::display;
use crate::app::state::{Edit, ModalShown};
use crate::app::theme::{self, ROW};
use crate::app::widgets::{Headline, card, headlines, line, row, section};
use sindyscope_core::setting::Setting;
use sindyscope_modes::{BASE, Base, ModalAnalysis, ModeQuality, PoleCluster, Structure, position_text, positions};
use sindyscope_report::modal::cluster_words;
use sindyscope_values::format::number::{format_measured, plain, significant};
use sindyscope_values::format::units::{format_si, raised};
use sindyscope_values::model::Mode;
use sindyscope_values::record::Usage;

/// Numbers of modes to choose from.
const COUNTS: std::ops::RangeInclusive<usize> = 1..=14;

/// Modal phase collinearity below which a mode is told to be doubtful.
const DOUBTFUL: f64 = 0.8;

/// Draws the part of the left column: how many modes, and which poles were chosen by hand.
pub(crate) fn controls(ui: &mut Ui, edit: &mut Edit) {
    let Some(setting) = BASE.iter().find(|s: &&Setting<Base>| s.name == "modes") else { return };
    section(ui, "MODES", |_| {}, |_| {});
    let base = &mut edit.base;
    row(ui, "Number", setting.help, |ui| {
        let text = |modes: Option<usize>| modes.map_or_else(|| "as the data bear".to_owned(), |n| n.to_string());
        let shown = if base.poles.is_empty() { text(base.modes) } else { "poles chosen by hand".to_owned() };
        let combo = ComboBox::from_id_salt("number of modes").width(ui.available_width()).selected_text(shown);
        let combo = combo.show_ui(ui, |ui| {
            for choice in std::iter::once(None).chain(COUNTS.map(Some)) {
                let chosen = base.modes == choice && base.poles.is_empty();
                if ui.selectable_label(chosen, text(choice)).clicked() {
                    (base.modes, base.poles) = (choice, Vec::new());
                }
            }
        });
        combo.response.accessible_name("Number of modes");
    });
    if !base.poles.is_empty() {
        let hint = "Number and start of the modes are those of the poles that were clicked; the data choose again without them";
        row(ui, "", "", |ui| {
            if ui.button("Let the data choose").on_hover_text(hint).clicked() {
                base.poles.clear();
            }
        });
    }
    positions_row(ui, base);
}

/// Where the sensors stand, as typed; it is taken over where it can be read.
fn positions_row(ui: &mut Ui, base: &mut Base) {
    let Some(setting) = BASE.iter().find(|s: &&Setting<Base>| s.name == "positions") else { return };
    let id = egui::Id::unique("positions of the sensors");
    let kept = position_text(&base.positions);
    let mut text: String = ui.data(|d| d.get_temp(id)).unwrap_or_else(|| kept.clone());
    let read = positions(&text);
    row(ui, "Positions", setting.help, |ui| {
        let field = egui::TextEdit::singleline(&mut text).hint_text("a1=0,0.5; a2=0,1").desired_width(f32::INFINITY);
        let response = ui.add(field).accessible_name("Positions of the sensors");
        match &read {
            // Once it is left, what was typed counts.
            Ok(read) if response.lost_focus() => {
                base.positions.clone_from(read);
                ui.data_mut(|d| d.remove::<String>(id));
            }
            _ if response.has_focus() || read.is_err() => {
                ui.data_mut(|d| d.insert_temp(id, text.clone()));
            }
            _ => ui.data_mut(|d| d.remove::<String>(id)),
        }
    });
    if let Err(problem) = &read {
        let color = theme::accents(ui.visuals().dark_mode).wrong;
        ui.add(Label::new(RichText::new(problem).color(color).size(12.0)).wrap());
    }
}

/// Draws the right column; a click on a mode shows its shape alone.
pub(crate) fn findings(ui: &mut Ui, room: &ModalRoom, shown: &mut ModalShown) {
    if let Some(failure) = room.failure() {
        let wrong = theme::accents(ui.visuals().dark_mode).wrong;
        card(ui, wrong, |ui| {
            ui.add(Label::new(failure).wrap());
        });
    }
    let Some(analysis) = room.analysis() else {
        if room.failure().is_none() {
            ui.weak("Looking for modes…");
        }
        return;
    };
    ui.add_enabled_ui(!room.is_stale(), |ui| {
        fit(ui, analysis);
        let of = ShownModes {
            title: "MODES",
            structure: &analysis.structure,
            quality: &analysis.quality,
            clusters: &analysis.stabilization.clusters,
        };
        modes(ui, &of, shown);
        errors(ui, analysis);
        ui.add_space(8.0);
    });
}

/// The first sensor's error beside its noise.
fn fit(ui: &mut Ui, analysis: &ModalAnalysis) {
    section(ui, "FIT", |_| {}, |_| {});
    let structure = &analysis.structure;
    let Some(sensor) = structure.sensors.first() else { return };
    let (score, what) = match (structure.score(0, Usage::HeldOut), structure.score(0, Usage::Fit)) {
        (Some(score), _) => (Some(score), "held-out error"),
        (None, score) => (score, "fitted error"),
    };
    let colors = theme::accents(ui.visuals().dark_mode);
    let floor = structure.noise_floor.filter(|f| *f > 0.0);
    let color = match (score, floor) {
        (Some(s), Some(floor)) if s.rmse <= 1.3 * floor => colors.good,
        (Some(s), _) if s.nrmse <= 0.1 => ui.visuals().strong_text_color(),
        _ => colors.caution,
    };
    let ctx = ui.ctx().clone();
    let told =
        |value: Option<f64>| value.map_or_else(|| "–".into(), |v| raised(&display::format(&ctx, v, &sensor.unit, 3)));
    let (error, noise) = (told(score.map(|s| s.rmse)), told(floor));
    let weak = ui.visuals().weak_text_color();
    headlines(
        ui,
        [
            Headline { text: &error, color, label: what, hint: "RMSE of what the modes leave of the first sensor" },
            Headline {
                text: &noise,
                color: weak,
                label: "noise floor",
                hint: "The first sensor's noise, estimated without a model: no model can do better",
            },
        ],
    );
}

/// Modes that are listed.
pub(super) struct ShownModes<'a> {
    pub(super) title: &'static str,
    pub(super) structure: &'a Structure,
    /// What the stabilization diagram says of each; empty where there is none.
    pub(super) quality: &'a [ModeQuality],
    /// The clusters that those speak of.
    pub(super) clusters: &'a [PoleCluster],
}

/// A row for each mode: frequency, damping, how nearly all sensors swing in one phase.
pub(super) fn modes(ui: &mut Ui, of: &ShownModes<'_>, shown: &mut ModalShown) {
    let ShownModes { title, structure, quality, clusters } = *of;
    section(ui, title, |_| {}, |_| {});
    columns(ui, ["", "frequency (Hz)", "damping (%)", "MPC"].map(|t| RichText::new(t).weak().size(11.0)));
    let all = structure.modes.iter().enumerate();
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        for (k, mode) in all.clone().filter(|(k, _)| structure.in_band[*k]) {
            let quality = quality.get(k);
            let cluster = quality.and_then(|q| clusters.get(q.cluster?));
            mode_row(ui, (k, structure.mode_number(k)), mode, (quality, cluster), shown);
        }
    });
    let outside: Vec<String> =
        all.filter(|(k, _)| !structure.in_band[*k]).map(|(_, m)| significant(m.frequency, 3)).collect();
    if !outside.is_empty() {
        let text = format!("Outside the band that is driven: {} Hz", outside.join(", "));
        ui.add(Label::new(RichText::new(text).weak().size(12.0)).wrap()).on_hover_text(
            "Poles of the model that stand for what lies beyond the band and for drifts: no modes to go by",
        );
    }
}

fn mode_row(
    ui: &mut Ui,
    (index, number): (usize, usize),
    mode: &Mode,
    (quality, cluster): (Option<&ModeQuality>, Option<&PoleCluster>),
    shown: &mut ModalShown,
) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let colors = theme::accents(ui.visuals().dark_mode);
    let on = shown.options.mode == Some(index);
    if on {
        ui.painter().rect_filled(rect, 4.0, colors.accent_ground);
    } else if response.hovered() || response.has_focus() {
        ui.painter().rect_filled(rect, 4.0, ui.visuals().widgets.inactive.bg_fill);
    }
    let frequency = format_measured(mode.frequency, mode.frequency_error);
    let damping = format_measured(100.0 * mode.damping, mode.damping_error.map(|e| 100.0 * e));
    let collinearity = quality.and_then(|q| q.collinearity).map_or_else(|| "–".to_owned(), |c| plain(c, 2));
    let said = format!("Mode {number}: {frequency} Hz, damping {damping} %");
    response.widget_info(|| WidgetInfo::selected(egui::Role::Button, true, on, &said));
    let mut inner = ui.new_child(egui::UiBuilder::new().max_rect(rect));
    let doubtful = quality.is_some_and(|q| q.stable == 0 || q.collinearity.is_some_and(|c| c < DOUBTFUL));
    let color = if doubtful { colors.caution } else { inner.visuals().text_color() };
    let number = RichText::new(number.to_string()).weak();
    let texts = [frequency, damping, collinearity].map(|t| RichText::new(t).monospace().size(11.5).color(color));
    let [frequency, damping, collinearity] = texts;
    columns(&mut inner, [number, frequency, damping, collinearity]);
    let hint = match quality {
        None => "A click shows its shape alone, in Identify".to_owned(),
        Some(ModeQuality { stable: 0, .. }) => {
            "No pole of the stabilization diagram near it is stable: it may stand for noise or for several modes"
                .to_owned()
        }
        Some(ModeQuality { stable, deviation, .. }) => {
            let deviation =
                deviation.map_or_else(String::new, |d| format!(", mean phase deviation {:.1}°", d.to_degrees()));
            let cluster = cluster.map_or_else(String::new, |c| format!("\n{}", cluster_words(c)));
            format!(
                "{stable} stable poles of the stabilization diagram lie near it{deviation}; a click shows its shape alone{cluster}"
            )
        }
    };
    if response.on_hover_text(hint).clicked() {
        shown.options.mode = if on { None } else { Some(index) };
    }
}

/// Four cells: number, frequency, damping, collinearity.
fn columns(ui: &mut Ui, texts: [RichText; 4]) {
    let width = ui.available_width();
    let widths = [0.07, 0.44, 0.37, 0.12].map(|share| share * width);
    line(ui, ROW, |ui| {
        ui.spacing_mut().item_spacing.x = 0.0;
        for (k, (text, width)) in texts.into_iter().zip(widths).enumerate() {
            let flow = if k == 0 { Layout::left_to_right(Align::Center) } else { Layout::right_to_left(Align::Center) };
            ui.allocate_ui_with_layout(vec2(width, ROW), flow, |ui| {
                ui.set_min_size(vec2(width, ROW));
                if k == 0 {
                    ui.add_space(5.0);
                }
                ui.add(Label::new(text).truncate().selectable(false));
            });
        }
    });
}

/// What the modes leave of each sensor.
fn errors(ui: &mut Ui, analysis: &ModalAnalysis) {
    let structure = &analysis.structure;
    section(ui, "ERROR BY SENSOR", |_| {}, |_| {});
    for (s, sensor) in structure.sensors.iter().enumerate() {
        let (score, what) = match structure.score(s, Usage::HeldOut) {
            Some(score) => (Some(score), "held out"),
            None => (structure.score(s, Usage::Fit), "fitted"),
        };
        let Some(score) = score else { continue };
        line(ui, ROW - 4.0, |ui| {
            ui.add_sized(vec2(64.0, ROW - 4.0), Label::new(&sensor.name).truncate());
            let text = format!(
                "{}, {} % of it, {what}",
                raised(&format_si(score.rmse, &sensor.unit, 3)),
                significant(100.0 * score.nrmse, 3)
            );
            ui.add(Label::new(RichText::new(text).size(12.0)).truncate());
        });
    }
    let several = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let text = format!(
        "{}, {}, {}",
        several(structure.order(), "state"),
        several(structure.sensors.len(), "sensor"),
        several(structure.inputs.len(), "input")
    );
    ui.weak(text);
}
