//! LIBRARY: the candidate terms.

use egui::{RichText, Ui, vec2};

use super::context::PanelContext;
use crate::app::theme::{self, ROW};
use crate::app::widgets::{chip, row, section, switch};
use sindyscope_core::study::Settings;
use sindyscope_values::model::Units;
use sindyscope_values::term::{Expression, Function, Layout, Symbol, Term, TermFamily, list, polynomials};

const FAMILIES: [(TermFamily, &str, &str); 11] = [
    (TermFamily::Constant, "1", "A constant force, or an offset"),
    (TermFamily::Inputs, "u", "The inputs: force, or base displacement"),
    (TermFamily::InputRates, "du", "The inputs' rates: base velocity"),
    (TermFamily::Relative, "x−u", "Relative motion across the joint: x−u, v−du"),
    (TermFamily::Of(Function::Sgn), "sgn", "Signs: dry friction is sgn v"),
    (TermFamily::Of(Function::Abs), "|·|", "Absolute values: one-sided or asymmetric forces"),
    (TermFamily::QuadraticDamping, "v|v|", "Quadratic damping: drag of a fluid"),
    (TermFamily::Of(Function::Sin), "sin", "Sines: a pendulum's restoring force is sin x"),
    (TermFamily::Of(Function::Cos), "cos", "Cosines"),
    (TermFamily::Of(Function::Exp), "exp", "Exponentials"),
    (TermFamily::Of(Function::Tanh), "tanh", "Hyperbolic tangents: smooth steps"),
];

/// Highest degree that a button offers; higher powers are typed.
const DEGREES: [(usize, &str, &str); 5] = [
    (1, "1", "Linear"),
    (2, "2", "Up to squares: asymmetric stiffness"),
    (3, "3", "Up to cubes: hardening or softening"),
    (4, "4", "Up to the fourth power"),
    (5, "5", "Up to the fifth power"),
];

pub(super) fn show(ui: &mut Ui, context: &mut PanelContext<'_>) {
    let settings = &mut context.edit.settings;
    let layout = context.data.layout(settings.kind);
    let units = context.data.units(settings.kind);
    let used = settings.terms.len();
    let differs = settings.terms != context.suggestion.terms;
    let mut reset = false;
    section(
        ui,
        "LIBRARY",
        |ui| {
            let label = RichText::new(format!("{used} terms")).weak();
            ui.label(label);
            if differs {
                let hint = "Back to the library that the program suggests for these records";
                reset = crate::app::widgets::icon(ui, "↺", "Reset library", hint, true).clicked();
            }
        },
        |_| {},
    );
    if reset {
        settings.terms.clone_from(&context.suggestion.terms);
    }
    row(ui, "Powers", "Polynomials of the states up to this degree", |ui| {
        let (mut degree, mut cross) = (degree(settings), has_cross(settings));
        let changed = switch(ui, &mut degree, &DEGREES);
        let crossed = ui.checkbox(&mut cross, "cross").on_hover_text("Products of different states too: x·v, x²·v");
        if changed || crossed.changed() {
            set_polynomials(settings, &layout, degree.max(if cross { 2 } else { 1 }), cross);
        }
    });
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        for (family, label, tooltip) in FAMILIES {
            let mut terms = family.terms(&layout);
            // No spring is stretched by the difference of a length and a force.
            terms.retain(|t| units.check(t, &layout).is_ok());
            if terms.is_empty() {
                continue;
            }
            let inside = terms.iter().filter(|t| settings.terms.contains(t)).count();
            if chip(ui, label, inside == terms.len(), inside > 0, tooltip).clicked() {
                if inside == terms.len() {
                    settings.terms.retain(|t| !terms.contains(t));
                } else {
                    add(settings, terms);
                }
            }
        }
    });
    ui.add_space(2.0);
    ticks(ui, settings, &layout);
    typed(ui, settings, (&layout, &units), &mut context.typing.terms);
}

/// A box to tick for each term on offer, in columns.
fn ticks(ui: &mut Ui, settings: &mut Settings, layout: &Layout) {
    let offered = offered(settings, layout);
    let names: Vec<String> = offered.iter().map(|t| t.pretty(layout)).collect();
    let font = egui::TextStyle::Button.resolve(ui.style());
    let width = |name: &String| ui.painter().layout_no_wrap(name.clone(), font.clone(), egui::Color32::WHITE).size().x;
    let widest = names.iter().map(width).fold(24.0, f32::max) + 28.0;
    let columns = ((ui.available_width() / widest) as usize).clamp(1, 6);
    let cell = ui.available_width() / columns as f32;
    ui.spacing_mut().item_spacing.x = 0.0;
    for (terms, names) in offered.chunks(columns).zip(names.chunks(columns)) {
        ui.horizontal(|ui| {
            for (term, name) in terms.iter().zip(names) {
                ui.allocate_ui(vec2(cell, ROW), |ui| {
                    ui.set_min_size(vec2(cell, ROW));
                    let mut on = settings.terms.contains(term);
                    if ui.checkbox(&mut on, name).changed() {
                        if on {
                            add(settings, vec![term.clone()]);
                        } else {
                            settings.terms.retain(|t| t != term);
                            settings.locks.remove(term);
                        }
                    }
                });
            }
        });
    }
    ui.spacing_mut().item_spacing.x = 6.0;
}

/// The field for terms that no button offers, with what is wrong with them beneath.
fn typed(ui: &mut Ui, settings: &mut Settings, (layout, units): (&Layout, &Units), text: &mut String) {
    let read = list(text).map_err(|e| format!("column {}: {}", e.column, e.problem)).and_then(|terms| {
        match terms.iter().find_map(|t| t.foreign_symbol(layout).map(|s| (t, s))) {
            Some((term, symbol)) => Err(format!("{term} needs {}, which the records lack", layout.name(symbol))),
            None => terms.iter().try_for_each(|t| units.check(t, layout)).map(|()| terms),
        }
    });
    let ready = matches!(&read, Ok(terms) if !terms.is_empty());
    let mut taken = false;
    row(ui, "Add terms", "Any term as it is printed; several with commas between them", |ui| {
        let width = ui.available_width() - 44.0;
        let field = egui::TextEdit::singleline(text).hint_text("x^2*v, sgn(v-du)").desired_width(width);
        let response = ui.add(field);
        let entered = response.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        let response = response.accessible_name("Add terms");
        let clicked = ui.add_enabled(ready, egui::Button::new("Add")).clicked();
        taken = ready && (clicked || entered);
        if entered {
            response.request_focus();
        }
    });
    let colors = theme::accents(ui.visuals().dark_mode);
    let (message, color) = match &read {
        Err(problem) if !text.is_empty() => (problem.clone(), colors.wrong),
        Ok(terms) if !terms.is_empty() => {
            let names: Vec<String> = terms.iter().map(|t| t.pretty(layout)).collect();
            (format!("adds {}", names.join(", ")), colors.good)
        }
        _ => (String::new(), colors.good),
    };
    // A line of its own, also while empty: what lies below stays where it is.
    let size = vec2(ui.available_width(), ROW);
    ui.allocate_ui(size, |ui| {
        ui.set_min_size(size);
        let text = RichText::new(&message).color(color).size(12.0);
        ui.add(egui::Label::new(text).truncate()).on_hover_text(&message);
    });
    if taken && let Ok(terms) = read {
        add(settings, terms);
        text.clear();
    }
}

fn add(settings: &mut Settings, terms: Vec<Term>) {
    for term in terms {
        if !settings.terms.contains(&term) {
            settings.terms.push(term);
        }
    }
}

/// Every term with a box: the library itself, what its degree and families also hold, and what is locked.
fn offered(settings: &Settings, layout: &Layout) -> Vec<Term> {
    let states: Vec<Symbol> = layout.state_symbols().collect();
    let mut offered = polynomials(&states, degree(settings).max(1), has_cross(settings));
    for (family, ..) in FAMILIES {
        let terms = family.terms(layout);
        if terms.iter().any(|t| settings.terms.contains(t)) {
            offered.extend(terms);
        }
    }
    offered.extend(settings.terms.iter().cloned());
    offered.extend(settings.locks.keys().cloned());
    let mut seen = std::collections::HashSet::new();
    offered.retain(|t| seen.insert(t.clone()));
    offered
}

/// The powers of a monomial of states; none for any other term.
fn powers(expression: &Expression) -> Option<Vec<(Symbol, f64)>> {
    let is_state = |s: &Symbol| matches!(s, Symbol::State(_) | Symbol::Rate(_));
    match expression {
        Expression::Symbol(s) => is_state(s).then(|| vec![(*s, 1.0)]),
        Expression::Power(base, n) => match base.as_ref() {
            Expression::Symbol(s) if is_state(s) && *n > 0.0 && n.fract() == 0.0 => Some(vec![(*s, *n)]),
            _ => None,
        },
        Expression::Product(factors) => {
            let powers: Option<Vec<_>> = factors.iter().map(powers).collect();
            Some(powers?.concat())
        }
        _ => None,
    }
}

fn total(powers: &[(Symbol, f64)]) -> usize {
    powers.iter().map(|(_, n)| *n).sum::<f64>() as usize
}

/// The highest degree among the library's monomials of states.
fn degree(settings: &Settings) -> usize {
    settings.terms.iter().filter_map(|t| powers(t.expression())).map(|p| total(&p)).max().unwrap_or(0)
}

fn has_cross(settings: &Settings) -> bool {
    settings.terms.iter().filter_map(|t| powers(t.expression())).any(|p| p.len() > 1)
}

/// Makes the library hold every monomial of states up to a degree, and none above it.
fn set_polynomials(settings: &mut Settings, layout: &Layout, degree: usize, cross: bool) {
    settings.terms.retain(|t| powers(t.expression()).is_none_or(|p| total(&p) <= degree && (cross || p.len() == 1)));
    let states: Vec<Symbol> = layout.state_symbols().collect();
    add(settings, polynomials(&states, degree, cross));
}

#[cfg(test)]
mod tests {
    use super::*;
    use sindyscope_values::term::Kind;

    const ONE: Layout = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: 1, internals: 0 };

    fn library(text: &str) -> Settings {
        Settings { terms: list(text).unwrap(), ..Settings::default() }
    }

    fn texts(terms: &[Term]) -> Vec<&str> {
        terms.iter().map(Term::as_str).collect()
    }

    #[test]
    fn the_degree_is_read_from_the_terms_and_written_to_them() {
        let mut settings = library("x, v, x^3, sgn(v), u, x*|v|");
        assert_eq!((degree(&settings), has_cross(&settings)), (3, false));
        set_polynomials(&mut settings, &ONE, 2, true);
        assert_eq!(texts(&settings.terms), ["x", "v", "sgn(v)", "u", "x*|v|", "x^2", "x*v", "v^2"]);
        set_polynomials(&mut settings, &ONE, 1, false);
        assert_eq!(texts(&settings.terms), ["x", "v", "sgn(v)", "u", "x*|v|"]);
    }

    #[test]
    fn a_family_offers_its_other_terms_while_one_is_in_use() {
        let offered = offered(&library("x, sgn(v), x^2*sin(u)"), &ONE);
        assert_eq!(texts(&offered), ["x", "v", "sgn(x)", "sgn(v)", "sgn(u)", "sgn(du)", "x^2*sin(u)"]);
    }
}
