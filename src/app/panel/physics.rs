//! KNOWN PHYSICS: what every fit keeps to; and what the coefficients say in the words of mechanics.

use egui::{RichText, Ui, vec2};

use super::context::PanelContext;
use crate::app::questions::{adds, tie};
use crate::app::theme::{self, ROW};
use crate::app::widgets::{chip, row, section, switch};
use sindyscope_core::study::{Known, Lock, Outcome, Pair, Settings, force_over_mass, known_list, setting};
use sindyscope_values::format::number::{align_at_point, format_measured};
use sindyscope_values::record::Record;
use sindyscope_values::term::{Expression, Kind, Layout, Symbol, Term};

/// Whether a restoring force is known to be as large one way as the other.
#[derive(Clone, Copy, PartialEq)]
enum Symmetry {
    Any,
    Odd,
    Even,
}

const SYMMETRIES: [(Symmetry, &str, &str); 3] = [
    (Symmetry::Any, "any", "Nothing is known of the spring's symmetry"),
    (
        Symmetry::Odd,
        "symmetric",
        "As stiff one way as the other: even powers of displacements (x², |x|) are no candidates",
    ),
    (
        Symmetry::Even,
        "antisymmetric",
        "Stiffer one way than the other by as much as it is softer: beside the linear spring only even powers are candidates",
    ),
];

pub(super) fn show(ui: &mut Ui, context: &mut PanelContext<'_>) {
    let layout = context.data.layout(context.edit.settings.kind);
    let units = context.data.units(context.edit.settings.kind);
    if layout.kind != Kind::SecondOrder {
        return;
    }
    let settings = &mut context.edit.settings;
    let count = settings.known.len() + usize::from(settings.mass.is_some());
    section(
        ui,
        "KNOWN PHYSICS",
        |ui| {
            let text = if count == 0 { "nothing".to_owned() } else { format!("{count} known") };
            ui.label(RichText::new(text).weak());
        },
        |_| {},
    );
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        for (known, label, tooltip) in offered(&layout) {
            // No spring is stretched by the difference of a length and a force.
            if !adds(&known, &units, &layout) {
                continue;
            }
            let on = settings.known.contains(&known);
            if chip(ui, &label, on, false, tooltip).clicked() {
                set(settings, known, !on);
            }
        }
        let others: Vec<Known> = settings.known.iter().filter(|k| is_other(k, &layout)).cloned().collect();
        for known in others {
            let text = known.to_string();
            if chip(ui, &text, true, false, "Click to take it back").clicked() {
                set(settings, known, false);
            }
        }
    });
    let mut symmetry = match settings.known.iter().find(|k| matches!(k, Known::OddStiffness | Known::EvenStiffness)) {
        Some(Known::OddStiffness) => Symmetry::Odd,
        Some(_) => Symmetry::Even,
        None => Symmetry::Any,
    };
    row(ui, "Stiffness", "What is known of the spring's symmetry", |ui| {
        if switch(ui, &mut symmetry, &SYMMETRIES) {
            settings.known.retain(|k| !matches!(k, Known::OddStiffness | Known::EvenStiffness));
            match symmetry {
                Symmetry::Odd => settings.known.push(Known::OddStiffness),
                Symmetry::Even => settings.known.push(Known::EvenStiffness),
                Symmetry::Any => {}
            }
        }
    });
    if layout.freedoms == 1 {
        mass(ui, settings, context.data.records.first().map(|r| &**r));
    }
    typed(ui, settings, &mut context.typing.known);
}

/// What one click says.
fn offered(layout: &Layout) -> Vec<(Known, String, &'static str)> {
    let mut offered = Vec::new();
    if layout.freedoms == 1 && layout.inputs == 1 {
        offered.push((
            tie(Symbol::State(0), Symbol::Input(0)),
            "one spring: x−u".to_owned(),
            "A base moves the mass through one spring: x and u have the same coefficient with opposite signs",
        ));
        offered.push((
            tie(Symbol::Rate(0), Symbol::InputRate(0)),
            "one damper: v−du".to_owned(),
            "A base moves the mass through one damper: v and du have the same coefficient with opposite signs",
        ));
    }
    for first in 0..layout.freedoms.saturating_sub(1) {
        let (one, other) = (first + 1, first + 2);
        offered.push((
            Known::Opposite(Pair { first, second: first + 1, ratio: None }),
            format!("equal and opposite {one}–{other}"),
            "What one mass feels of the other, the other feels the other way round: one spring, one damper, one friction. The \
             ratio of the masses is found; one that is known is typed below, as m2/m1=0.5",
        ));
    }
    offered.push((
        Known::Passive,
        "damping takes energy".to_owned(),
        "No damping or friction term may feed energy in: coefficients of v, v³, v|v|, sgn v, x²v, … are zero or below",
    ));
    offered
}

fn is_other(known: &Known, layout: &Layout) -> bool {
    !matches!(known, Known::OddStiffness | Known::EvenStiffness) && !offered(layout).iter().any(|(k, ..)| k == known)
}

fn set(settings: &mut Settings, known: Known, on: bool) {
    // One ratio for two masses: the last one said.
    let same = |k: &Known| match (k, &known) {
        (Known::Opposite(a), Known::Opposite(b)) => a.is_of_same_masses(b),
        (a, b) => a == b,
    };
    settings.known.retain(|k| !same(k));
    if on {
        settings.known.push(known);
    }
}

/// The moving mass, and whether the force's coefficient follows from it.
fn mass(ui: &mut Ui, settings: &mut Settings, record: Option<&Record>) {
    let force = Term::new(Expression::Symbol(Symbol::Input(0)));
    let coefficient = |mass: f64| record.and_then(|r| force_over_mass(r, mass));
    let follows =
        settings.mass.and_then(coefficient).is_some_and(|c| settings.locks.get(&force) == Some(&Lock::Fixed(c)));
    row(ui, setting("mass").label, setting("mass").help, |ui| {
        let mut known = settings.mass.is_some();
        let mut value = settings.mass.unwrap_or(1.0);
        let box_ = ui.checkbox(&mut known, "").on_hover_text("The mass is known");
        box_.widget_info(|| egui::WidgetInfo::selected(egui::Role::CheckBox, true, known, "Mass known"));
        let ticked = box_.changed();
        let speed = 0.01 * value.max(1e-6);
        let field = egui::DragValue::new(&mut value).speed(speed).range(1e-9..=1e9).max_decimals(9);
        let dragged = ui.add_enabled_ui(known, |ui| ui.add_sized(vec2(74.0, ROW - 2.0), field.suffix(" kg")));
        let changed = dragged.inner.accessible_name("Mass").changed();
        if ticked || changed {
            settings.mass = known.then_some(value);
        }
        let mut fixed = follows;
        if coefficient(value).is_some() {
            let tooltip = "The input is a force in newtons: its coefficient is fixed at one over the mass";
            let box_ = ui.add_enabled(known, egui::Checkbox::new(&mut fixed, "u/m")).on_hover_text(tooltip);
            fixed &= known;
            if box_.changed() || ((ticked || changed) && follows) {
                match coefficient(value).filter(|_| fixed) {
                    Some(c) => drop(settings.locks.insert(force.clone(), Lock::Fixed(c))),
                    None => drop(settings.locks.remove(&force)),
                }
            }
        }
    });
}

/// The field for what no button says, with what is wrong with it beneath.
fn typed(ui: &mut Ui, settings: &mut Settings, text: &mut String) {
    let read = known_list(text);
    let ready = matches!(&read, Ok(known) if !known.is_empty());
    let mut taken = false;
    row(ui, "Add", "Ties and signs of coefficients; several with commas between them", |ui| {
        let width = ui.available_width() - 44.0;
        let field = egui::TextEdit::singleline(text).hint_text("x1=-x2, x^3>=0").desired_width(width);
        let response = ui.add(field);
        let entered = response.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        response.accessible_name("Add known physics");
        taken = ready && (ui.add_enabled(ready, egui::Button::new("Add")).clicked() || entered);
    });
    if let Err(problem) = &read
        && !text.is_empty()
    {
        let color = theme::accents(ui.visuals().dark_mode).wrong;
        let message = RichText::new(problem).color(color).size(12.0);
        ui.add(egui::Label::new(message).truncate()).on_hover_text(problem);
    }
    if taken && let Ok(known) = read {
        for known in known {
            set(settings, known, true);
        }
        text.clear();
    }
}

/// The physical parameters beneath the equation.
pub(super) fn found(ui: &mut Ui, outcome: &Outcome) {
    let found = outcome.physical();
    if found.is_empty() {
        return;
    }
    section(ui, "PHYSICAL PARAMETERS", |_| {}, |_| {});
    let numbers: Vec<String> = found.iter().map(|p| format_measured(p.value, p.std_error)).collect();
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        for (parameter, number) in found.iter().zip(align_at_point(&numbers)) {
            let text = format!("{:<3} {number} {}", parameter.symbol, parameter.unit);
            let label = egui::Label::new(RichText::new(text).monospace().size(12.5)).truncate();
            ui.add(label).on_hover_text(parameter.title);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use sindyscope_core::study::Sign;

    #[test]
    fn what_a_button_says_is_what_a_command_says() {
        let layout = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: 1, internals: 0 };
        let texts: Vec<String> = offered(&layout).iter().map(|(k, ..)| k.to_string()).collect();
        assert_eq!(texts, ["x=-u", "v=-du", "passive"]);
        let mut settings = Settings::default();
        let signed = Known::Signed(Term::new(Expression::Symbol(Symbol::State(0))), Sign::NotPositive);
        for known in [Known::Passive, signed.clone(), Known::OddStiffness] {
            set(&mut settings, known.clone(), true);
            set(&mut settings, known, true);
        }
        let chain = Layout { freedoms: 3, ..layout };
        let texts: Vec<String> = offered(&chain).iter().map(|(k, ..)| k.to_string()).collect();
        assert_eq!(texts, ["m2/m1", "m3/m2", "passive"]);
        assert_eq!(settings.known.len(), 3);
        assert_eq!(settings.known.iter().filter(|k| is_other(k, &layout)).collect::<Vec<_>>(), [&signed]);
    }
}
