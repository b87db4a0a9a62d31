//! The catalogue as a handbook shows it: what each effect is, how it enters the equation, what it is mistaken for.

use std::collections::BTreeSet;

use super::effects::{Addition, Direction, EffectSetting, FAMILIES, ForceAxis, Form, Frame, OwnEffect, own};
use super::site::Placed;
use sindyscope_values::term::{Layout, Term};

/// An effect of the catalogue.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its name in the interface.
    pub effect: &'static str,
    /// Its name for people.
    pub title: &'static str,
    /// The family that it belongs to.
    pub family: &'static str,
    /// What it is, in plain words.
    pub explanation: &'static str,
    /// What it adds to the acceleration, in LaTeX: `r` and `w` are displacement and velocity across its place.
    pub formula: &'static str,
    /// What an experiment needs to show it apart from others.
    pub separates: &'static str,
    /// The quantity that its force is drawn over.
    pub axis: &'static str,
    /// Coefficients first, then what stands inside terms; none of what is read off each record by itself.
    pub parameters: Vec<EntryParameter>,
    /// Every form that one mass on a moving base offers.
    pub forms: Vec<EntryForm>,
    /// Effects that it contains as special or limiting cases: where they do as well, they are preferred.
    pub contains: Vec<&'static str>,
    /// Effects that contain it.
    pub contained_in: Vec<&'static str>,
    /// On a linear spring it does the same as these: a shifted zero.
    pub shifts_the_zero_as: Vec<&'static str>,
}

/// A parameter of an effect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EntryParameter {
    /// Its usual symbol.
    pub name: String,
    /// Its unit where displacements are in metres; empty for a plain number.
    pub unit: String,
    /// It cannot be negative.
    pub positive: bool,
    /// It stands inside a term; otherwise it is a term's coefficient.
    pub inner: bool,
}

/// An effect at one place.
#[derive(Clone, Debug, PartialEq)]
pub struct EntryForm {
    /// The form in words; empty if there is one.
    pub form: String,
    /// The place as the interface writes it; none of the input and of the sensor.
    pub place: Option<String>,
    /// The values of the inner parameters in `terms` and `states`, an example.
    pub example: Vec<(&'static str, f64)>,
    /// Its terms in the acceleration.
    pub terms: Vec<String>,
    /// Rates of its own states, as `name: terms with coefficients`.
    pub states: Vec<(String, Vec<(String, f64)>)>,
    /// Terms of the model that it replaces.
    pub replaces: Vec<String>,
}

/// The catalogue, in its order.
pub fn guide() -> Vec<Entry> {
    let settings = [example(true), example(false)];
    let mut entries: Vec<Entry> = Vec::new();
    let mut shifting: BTreeSet<&'static str> = BTreeSet::new();
    for (family, add) in FAMILIES {
        for setting in &settings {
            let known = entries.len();
            let mut forms = Vec::new();
            add(setting, &mut forms);
            for form in &forms {
                if form.moves_the_zero(false) {
                    shifting.insert(form.effect);
                }
                match entries.iter().position(|e| e.effect == form.effect) {
                    // Forms are those of the first setting that has the effect.
                    Some(place) if place >= known => entries[place].forms.push(placed(form)),
                    Some(_) => {}
                    None => entries.push(entry(form, family)),
                }
            }
        }
    }
    let contained: Vec<(&'static str, Vec<&'static str>)> =
        entries.iter().map(|e| (e.effect, e.contains.clone())).collect();
    for entry in &mut entries {
        let holds = contained.iter().filter(|(_, inside)| inside.contains(&entry.effect));
        entry.contained_in = holds.map(|(effect, _)| *effect).collect();
        if shifting.contains(entry.effect) {
            entry.shifts_the_zero_as = shifting.iter().copied().filter(|e| *e != entry.effect).collect();
        }
    }
    entries
}

/// What the user adds to the catalogue, as it would stand there.
pub fn guide_of_own(effects: &[OwnEffect]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for form in own(effects, &example(true), &[]) {
        match entries.iter_mut().find(|e| e.effect == form.effect) {
            Some(known) => known.forms.push(placed(&form)),
            None => entries.push(entry(&form, OWN)),
        }
    }
    entries
}

/// The family of effects that the user adds.
const OWN: &str = "Your own";

/// One mass that moves about a metre at about a hertz, on a moving base or under a force: between the two every effect of the
/// catalogue makes sense.
fn example(base_excited: bool) -> EffectSetting {
    let mut frames = Frame::all(1, base_excited);
    frames.iter_mut().for_each(|f| (f.reach, f.speed, f.speed_noise, f.usual_speed) = (1.0, 6.0, 0.01, Some(2.0)));
    // The second has a damper, which an effect may turn round; the first has none, so that one can be added.
    let across: &[&str] = if base_excited { &["x-u"] } else { &["x", "v"] };
    let terms = across.iter().filter_map(|text| Some(Placed { mass: 0, term: Term::parse(text).ok()? }));
    EffectSetting {
        base_excited,
        passive: true,
        input_open: false,
        frames,
        terms: terms.collect(),
        // A pendulum's displacement is an angle, or of a unit that is not known.
        unit: String::new(),
        inputs: vec![1.0],
        frequency: 1.0,
        lines: vec![2.0],
        pulsations: vec![2.0],
        interval: 0.01,
        measured: 1.0,
        derivatives: 0,
    }
}

fn entry(form: &Form, family: &'static str) -> Entry {
    let coefficients = form.coefficients.iter().map(|c| EntryParameter {
        name: c.name.clone(),
        unit: c.unit("m"),
        positive: c.sign != Direction::Any,
        inner: false,
    });
    let inner = form.inner.iter().map(|i| EntryParameter {
        name: i.name.to_owned(),
        unit: i.unit("m"),
        positive: i.bounds.0 >= 0.0,
        inner: true,
    });
    Entry {
        effect: form.effect,
        title: form.title,
        family,
        explanation: form.explanation,
        formula: form.formula,
        separates: form.separates,
        axis: match form.axis {
            ForceAxis::Displacement => "displacement",
            ForceAxis::Velocity => "velocity",
            ForceAxis::Input(_) => "input",
            ForceAxis::Time => "time",
        },
        parameters: coefficients.chain(inner).collect(),
        forms: vec![placed(form)],
        contains: form.contains.to_vec(),
        contained_in: Vec::new(),
        shifts_the_zero_as: Vec::new(),
    }
}

/// A form with round numbers inside.
fn placed(form: &Form) -> EntryForm {
    let example: Vec<(&'static str, f64)> =
        form.inner.iter().map(|i| (i.name, round(i.grid.get(i.grid.len() / 2).copied().unwrap_or(1.0)))).collect();
    let Addition { terms, internals, replaces, .. } =
        form.addition(&example.iter().map(|(_, value)| *value).collect::<Vec<f64>>());
    let layout = Layout { freedoms: 1, inputs: 1, internals: internals.len(), ..Layout::default() };
    let text = |term: &Term| term.summary(&layout);
    let rates = layout.state_symbols().skip(2).zip(&internals);
    EntryForm {
        form: form.form.clone(),
        place: form.site.map(|site| site.to_string()),
        terms: terms.iter().map(|t| text(&t.term)).collect(),
        states: rates
            .map(|(state, equation)| {
                let terms = equation.terms.iter().map(|t| (text(&t.term), t.coefficient)).collect();
                (layout.name(state), terms)
            })
            .collect(),
        replaces: replaces.iter().map(|t| text(&t.term)).collect(),
        example,
    }
}

/// A number's first digit with its power of ten.
fn round(value: f64) -> f64 {
    format!("{value:.0e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_of_the_catalogue_has_its_page() {
        let entries = guide();
        assert_eq!(entries.len(), 39);
        for entry in &entries {
            for text in [entry.title, entry.explanation, entry.formula, entry.separates] {
                assert!(!text.is_empty(), "{}", entry.effect);
            }
            for other in entry.contains.iter().chain(&entry.contained_in).chain(&entry.shifts_the_zero_as) {
                assert!(entries.iter().any(|e| e.effect == *other), "{}: {other}", entry.effect);
            }
        }
        let friction = entries.iter().find(|e| e.effect == "coulomb_friction").expect("an entry");
        assert!(friction.contained_in.contains(&"stribeck_friction"));
        assert_eq!(friction.forms.iter().map(|f| f.form.as_str()).collect::<Vec<_>>(), ["to ground", "in the joint"]);
        let constant = entries.iter().find(|e| e.effect == "constant_force").expect("an entry");
        assert_eq!(constant.shifts_the_zero_as, ["sensor_offset"]);
    }

    #[test]
    fn a_formula_names_every_parameter() {
        // Letters of the symbol, however LaTeX sets them: `zeta_2` as `\zeta_2`, `P cos` as `P_{\cos}`.
        let letters = |text: &str| text.chars().filter(char::is_ascii_alphanumeric).collect::<String>();
        for entry in guide() {
            let formula = letters(entry.formula);
            for parameter in &entry.parameters {
                let symbol = match parameter.name.as_str() {
                    "gain k" => "k".to_owned(),
                    "dc/dt" => r"fracdcdt".to_owned(),
                    "F_s/F_c" => "Fs".to_owned(),
                    "dk/dt" => r"fracdkdt".to_owned(),
                    name => letters(name),
                };
                assert!(formula.contains(&symbol), "{}: {} in {}", entry.effect, parameter.name, entry.formula);
            }
        }
    }
}
