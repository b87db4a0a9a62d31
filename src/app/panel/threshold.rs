//! THRESHOLD: which of the library's terms stay.

use egui::{RichText, Ui};

use super::context::PanelContext;
use super::equation::symbol;
use super::setting_row::{pick, slider, switch_of};
use crate::app::widgets::{Mark, SliderRow, section};
use sindyscope_core::study::{KINEMATICS, REGRESSORS, SCALINGS, Scaling, setting};
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::term::Kind;

/// The threshold's slider where it is compared with coefficients as they stand: they are rarely outside.
const RAW: std::ops::RangeInclusive<f64> = 1e-4..=1e4;

pub(super) fn show(ui: &mut Ui, context: &mut PanelContext<'_>) {
    let layout = context.data.layout(context.edit.settings.kind);
    let outcome = context.data.outcome.as_ref();
    let kept: usize = outcome.map_or(0, |o| {
        let fitted = |s| o.fits.iter().any(|f| f.state == s);
        o.model.iter().filter(|(s, _)| fitted(*s)).map(|(_, e)| e.terms.len()).sum()
    });
    let tried: usize = kept + outcome.map_or(0, |o| o.fits.iter().map(|f| f.dropped.len()).sum());
    section(
        ui,
        "THRESHOLD",
        |ui| {
            ui.label(RichText::new(format!("{kept} of {tried} terms stay")).weak());
        },
        |_| {},
    );
    let settings = &mut context.edit.settings;
    let several = outcome.is_some_and(|o| o.fits.len() > 1);
    let marks: Vec<Mark> = outcome
        .filter(|o| o.settings.scaling == settings.scaling && o.settings.regressor == settings.regressor)
        .into_iter()
        .flat_map(|o| &o.fits)
        .flat_map(|fit| fit.drop_marks.iter().map(move |(at, term)| (fit.state, *at, term)))
        .map(|(state, at, term)| {
            let of = if several { format!(" of d{}/dt", symbol(state, &layout)) } else { String::new() };
            let text = format!("{}{of} drops out at {}", term.pretty(&layout), significant_trimmed(at, 3));
            Mark { at, text }
        })
        .collect();
    pick(ui, setting("regressor"), &REGRESSORS, &mut settings.regressor, |a, b| a == b);
    let same_scaling = context.suggestion.scaling == settings.scaling;
    let plain = slider(setting("threshold"));
    let (range, tooltip) = match settings.scaling {
        Scaling::Scaled => (plain.range.clone(), format!("{}; marks show where", plain.tooltip)),
        Scaling::Raw => (RAW, "A term whose coefficient is smaller than this is dropped; marks show where".to_owned()),
    };
    let threshold = SliderRow {
        tooltip: &tooltip,
        range,
        suggestion: same_scaling.then_some(context.suggestion.threshold),
        marks: &marks,
        ..plain
    };
    threshold.show(ui, &mut settings.threshold);
    switch_of(ui, setting("scaling"), &SCALINGS, &mut settings.scaling);
    let ridge = SliderRow { suggestion: Some(context.suggestion.ridge), ..slider(setting("ridge")) };
    ridge.show(ui, &mut settings.ridge);
    if settings.kind == Kind::SecondOrder {
        switch_of(ui, setting("fit-kinematics"), &KINEMATICS, &mut settings.kinematics);
    }
}
