//! THRESHOLD: which of the library's terms stay.

use egui::{RichText, Ui};

use super::Desk;
use super::equation::symbol;
use crate::app::widgets::{Mark, Setting, Spread, row, section, switch};
use sindyscope_core::study::{Kinematics, Regressor, Scaling};
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::term::Kind;

/// The threshold's slider; a coefficient on its own scale is rarely outside.
const SCALED: std::ops::RangeInclusive<f64> = 1e-4..=1.0;
const RAW: std::ops::RangeInclusive<f64> = 1e-4..=1e4;

const REGRESSORS: [(Regressor, &str, &str); 7] = [
    (
        Regressor::Stlsq,
        "STLSQ",
        "Sequentially thresholded least squares: fit, drop what is below the threshold, fit again until nothing drops",
    ),
    (
        Regressor::Sr3L0,
        "SR3, L0",
        "Sparse relaxed regularized regression: a sparse copy of the coefficients is kept near those that fit (ν = 1), and \
         each term costs the same. The threshold sets the cost",
    ),
    (
        Regressor::Sr3L1,
        "SR3, L1",
        "The same, but a term costs its magnitude, as in the lasso; those kept are refitted without the cost",
    ),
    (
        Regressor::Ssr,
        "stepwise elimination (SSR)",
        "The smallest term leaves, one after the other. Of the sets of terms on the way the one is taken that leaves least, \
         a term being worth a share of the RMS acceleration as large as the threshold",
    ),
    (
        Regressor::Frols,
        "forward selection (FROLS)",
        "The term that explains most joins, one after the other, each made orthogonal to those before: for large \
         libraries. The threshold decides how many, as for elimination",
    ),
    (
        Regressor::BestSubset,
        "best subset",
        "Every set of terms is tried: exact up to 16 candidates; of more, those that elimination keeps longest. The \
         threshold decides how many, as for elimination",
    ),
    (
        Regressor::Bayes,
        "Bayes (spike and slab)",
        "Terms that belong more likely than not; their probabilities are in the equation's tooltips. A coefficient as \
         large as the threshold is as likely there by chance as not",
    ),
];

pub(super) fn show(ui: &mut Ui, desk: &mut Desk<'_>) {
    let layout = desk.bench.layout(desk.edit.settings.kind);
    let outcome = desk.bench.outcome.as_ref();
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
    let settings = &mut desk.edit.settings;
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
    row(ui, "Regression", "The way to a sparse equation", |ui| {
        let shown = REGRESSORS.iter().find(|(r, ..)| *r == settings.regressor).map_or("", |(_, label, _)| label);
        let width = ui.available_width();
        let combo = egui::ComboBox::from_id_salt("regressor").width(width).selected_text(shown).show_ui(ui, |ui| {
            for (regressor, label, tooltip) in REGRESSORS {
                ui.selectable_value(&mut settings.regressor, regressor, label).on_hover_text(tooltip);
            }
        });
        combo.response.accessible_name("Regression");
    });
    let (range, tooltip) = match settings.scaling {
        Scaling::Scaled => {
            (SCALED, "A term whose share of the RMS acceleration is smaller than this is dropped; marks show where")
        }
        Scaling::Raw => (RAW, "A term whose coefficient is smaller than this is dropped; marks show where"),
    };
    let same_scaling = desk.suggestion.scaling == settings.scaling;
    let threshold = Setting {
        label: "Threshold",
        tooltip,
        unit: "",
        range,
        spread: Spread::LogarithmicFromZero,
        grid: 0.0,
        suggestion: same_scaling.then_some(desk.suggestion.threshold),
        marks: &marks,
        format: &|v| significant_trimmed(v, 3),
    };
    threshold.show(ui, &mut settings.threshold);
    row(ui, "Compares", "What is compared with the threshold", |ui| {
        switch(
            ui,
            &mut settings.scaling,
            &[
                (
                    Scaling::Scaled,
                    "scaled",
                    "Columns and acceleration divided by their RMS: units do not matter, metres or millimetres give the same terms",
                ),
                (Scaling::Raw, "raw", "Coefficients as they stand, as the Python package does: units decide"),
            ],
        );
    });
    let ridge = Setting {
        label: "Ridge α",
        tooltip: "Weight of the penalty α‖c‖² on the coefficients: steadies terms that are hard to tell apart, at the price of bias",
        unit: "",
        range: 1e-8..=1e2,
        spread: Spread::LogarithmicFromZero,
        grid: 0.0,
        suggestion: Some(desk.suggestion.ridge),
        marks: &[],
        format: &|v| significant_trimmed(v, 3),
    };
    ridge.show(ui, &mut settings.ridge);
    if settings.kind == Kind::SecondOrder {
        row(ui, "dx/dt = v", "Whether this equation is known or looked for as well", |ui| {
            switch(
                ui,
                &mut settings.kinematics,
                &[
                    (Kinematics::Known, "known", "It is what velocity means"),
                    (Kinematics::Fitted, "fitted", "It is fitted from the library too: a check of the derivative"),
                ],
            );
        });
    }
}
