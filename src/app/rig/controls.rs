//! The left column of the room: every number of the rig.

use egui::{RichText, Ui};

use super::class;
use super::number_row::{combo, number, seed, share, with_unit};
use super::room::{RigAct, RigRoom};
use crate::app::commands::{CLASSICS_HINT, WindowCommand};
use crate::app::state::{Page, RigState};
use crate::app::theme;
use crate::app::widgets::{SliderRow, Spread, row, section, switch};
use sindyscope_rig::hidden::{names, title};
use sindyscope_rig::{EffectValue, ExcitationChoice, PlantChoice, RigDrive, RigSettings};
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::format::units::raised;

/// How far a parameter may be moved from what was suggested.
const SPAN: f64 = 30.0;

pub(super) fn show(ui: &mut Ui, room: &RigRoom, state: &mut RigState, acts: &mut Vec<RigAct>) {
    if state.page == Page::Class {
        class::form(ui, &room.class, &mut state.class, acts);
        return;
    }
    let settings = &mut state.settings;
    plant(ui, settings, acts);
    excitation(ui, settings);
    sensors(ui, settings);
    record(ui, settings);
    ui.add_space(8.0);
}

impl RigRoom {
    /// Draws the left column.
    pub(crate) fn controls(&self, ui: &mut Ui, state: &mut RigState) -> Vec<RigAct> {
        let mut acts = Vec::new();
        show(ui, self, state, &mut acts);
        acts
    }
}

fn plant(ui: &mut Ui, settings: &mut RigSettings, acts: &mut Vec<RigAct>) {
    section(ui, "PLANT", |_| {}, |_| {});
    row(ui, "Classics", CLASSICS_HINT, |ui| {
        let menu = ui.menu_button("Open one in Identify ⏷", WindowCommand::classics);
        menu.response.on_hover_text(CLASSICS_HINT);
        if let Some(WindowCommand::Sample(sample)) = menu.inner.flatten() {
            acts.push(RigAct::Classic(sample));
        }
    });
    let plants = [
        (PlantChoice::OneMass, "one mass", "A mass on a spring and a damper, with any effect of the catalogue"),
        (PlantChoice::TwoMasses, "two masses", "Two masses in a chain; a force acts on the first"),
        (PlantChoice::ThreeMasses, "three masses", "Three masses in a chain; a force acts on the first"),
        (
            PlantChoice::FiveMasses,
            "five masses",
            "Five masses in a chain; a force acts on one, and an effect at a place",
        ),
        (PlantChoice::Beam, "beam", "A cantilever of six elements; a force acts on a node, and an effect at a place"),
    ];
    if let Some(plant) = combo(ui, "Plant", "What is tested", settings.plant, &plants) {
        *settings = settings.clone().with_plant(plant);
    }
    if settings.plant != PlantChoice::OneMass {
        chain(ui, settings);
        return;
    }
    let mass_unit = if settings.unit() == "rad" { "kg m²" } else { "kg" };
    number(ui, &mut settings.mass, "Mass", "The moving mass", mass_unit, 1e-3..=1e4);
    number(
        ui,
        &mut settings.frequency,
        "Frequency",
        "Natural frequency of the linear plant: √(k/m)/2π",
        "Hz",
        0.05..=500.0,
    );
    number(ui, &mut settings.damping_ratio, "Damping", "Damping ratio of the linear plant: c/(2√(km))", "", 5e-4..=1.0);
    row(ui, "Drive", "What sets it in motion", |ui| {
        let mut drive = settings.drive;
        let choices = [
            (RigDrive::Force, "force", "A force acts on the mass"),
            (RigDrive::Base, "moving base", "Spring and damper stand on a base that moves"),
        ];
        if switch(ui, &mut drive, &choices) {
            *settings = settings.clone().with_drive(drive);
        }
    });
    effect(ui, settings);
}

fn effect(ui: &mut Ui, settings: &mut RigSettings) {
    let mut list: Vec<(Option<&str>, &str, &str)> = vec![(None, "none", "Spring and damper alone")];
    list.extend(names().map(|name| (Some(name), title(name).unwrap_or(name), "")));
    let chosen = names().find(|name| Some(*name) == settings.effect.as_deref());
    if let Some(effect) = combo(ui, "Effect", "What the plant has beside spring and damper", chosen, &list) {
        *settings = settings.clone().with_effect(effect.map(str::to_owned));
    }
    if settings.effect.is_none() {
        return;
    }
    if settings.drive == RigDrive::Base {
        row(ui, "Acts", "Where the effect acts, if it has a choice", |ui| {
            let choices = [
                (true, "to the ground", "Between the mass and the ground"),
                (false, "in the joint", "Between the mass and its base"),
            ];
            switch(ui, &mut settings.to_ground, &choices);
        });
    }
    for value in &mut settings.effect_values {
        parameter(ui, value);
    }
}

/// One parameter of an effect: over decades if it has one sign, else about zero.
fn parameter(ui: &mut Ui, parameter: &mut EffectValue) {
    const SIGNED: [&str; 9] = ["k_2", "k_3", "k_5", "k_b", "g", "c_b", "gamma", "k_d", "phi"];
    let size = if parameter.suggested == 0.0 { 1.0 } else { parameter.suggested.abs() };
    let (range, spread, grid) = match parameter.name.as_str() {
        "n" => (1.0..=2.0, Spread::Linear, 1.0),
        "beta_share" => (0.5..=1.0, Spread::Linear, 0.0),
        "phi" => (-3.2..=3.2, Spread::Linear, 0.0),
        name if SIGNED.contains(&name) => (-5.0 * size..=5.0 * size, Spread::Linear, 0.0),
        _ => (size / SPAN..=size * SPAN, Spread::Logarithmic, 0.0),
    };
    let unit = raised(&parameter.unit);
    let tooltip = match unit.as_str() {
        "" => format!("{} of the effect", parameter.name),
        unit => format!("{} of the effect, in {unit} (forces over mass)", parameter.name),
    };
    let spoken = format!(", {unit}");
    let label = symbol(&parameter.name);
    let suggestion = Some(parameter.suggested);
    SliderRow { unit: &spoken, spread, grid, suggestion, ..SliderRow::new(&label, &tooltip, range) }
        .show(ui, &mut parameter.value);
}

/// A parameter's name as one writes it: `F_s` stays, Greek names become letters.
pub(super) fn symbol(name: &str) -> String {
    const GREEK: [(&str, &str); 8] = [
        ("beta", "β"),
        ("gamma", "γ"),
        ("mu", "μ"),
        ("omega", "ω"),
        ("Omega", "Ω"),
        ("phi", "φ"),
        ("tau", "τ"),
        ("zeta", "ζ"),
    ];
    let greek = |part: &str| {
        GREEK.iter().find(|(name, _)| *name == part).map_or(part.to_owned(), |(_, sign)| (*sign).to_owned())
    };
    match name.split_once('_') {
        Some((head, rest)) => format!("{}_{rest}", greek(head)),
        None => greek(name),
    }
}

fn chain(ui: &mut Ui, settings: &mut RigSettings) {
    for parameter in settings.plant.parameters() {
        let mut value = settings.chain_value(parameter);
        // Springs to the last ground, dampers and friction may be missing.
        let masslike = parameter.unit == "kg";
        let own = if parameter.value > 0.0 { parameter.value } else { size_of(parameter.unit) };
        let tooltip = match parameter.unit {
            "" => parameter.meaning.to_owned(),
            unit => format!("{}, {unit}", parameter.meaning),
        };
        if settings.plant.is_structure() && ["at", "place", "from"].contains(&parameter.name) {
            let range = parameter.least..=settings.plant.masses() as f64;
            let node = SliderRow {
                spread: Spread::Linear,
                grid: 1.0,
                suggestion: Some(parameter.value),
                ..SliderRow::new(parameter.name, &tooltip, range)
            };
            if node.show(ui, &mut value) {
                settings.chain.insert(parameter.name.to_owned(), value);
            }
            continue;
        }
        let spoken = if parameter.unit.is_empty() { String::new() } else { format!(", {}", parameter.unit) };
        let setting = SliderRow {
            unit: &spoken,
            spread: if masslike { Spread::Logarithmic } else { Spread::LogarithmicFromZero },
            suggestion: Some(parameter.value),
            ..SliderRow::new(parameter.name, &tooltip, own / SPAN..=own * SPAN)
        };
        if setting.show(ui, &mut value) {
            settings.chain.insert(parameter.name.to_owned(), value);
        }
    }
}

/// A usual size of what a chain lacks by itself, by its unit.
fn size_of(unit: &str) -> f64 {
    match unit {
        "N/m" => 500.0,
        "N s/m" => 1.0,
        "N/m^3" => 1e6,
        _ => 0.5,
    }
}

fn excitation(ui: &mut Ui, settings: &mut RigSettings) {
    section(ui, "EXCITATION", |_| {}, |_| {});
    let list = [
        (ExcitationChoice::Decay, "free decay", "Released from a displacement; nothing drives it"),
        (ExcitationChoice::Harmonic, "harmonic", "One frequency"),
        (ExcitationChoice::Multisine, "multisine", "Harmonics spread over a band, with random phases"),
        (ExcitationChoice::Sweep, "sweep", "A linear chirp through a band"),
        (ExcitationChoice::Bursts, "random bursts", "Random vibration in a band, with rests between"),
    ];
    if let Some(choice) = combo(ui, "Kind", "The time course of the input", settings.excitation, &list) {
        *settings = settings.clone().with_excitation(choice);
    }
    let decay = settings.excitation == ExcitationChoice::Decay;
    let unit = if decay { settings.unit() } else { settings.input_unit() };
    let tooltip = if decay {
        "The displacement from which the first mass is released"
    } else {
        "Amplitude of the input; a multisine's RMS is that of one harmonic of this amplitude"
    };
    // A hand thinks of vibration in millimetres.
    let (factor, unit) = if unit == "m" { (1e3, "mm") } else { (1.0, unit) };
    let mut level = factor * settings.level;
    if number(ui, &mut level, "Level", tooltip, unit, 1e-3..=1e4) {
        settings.level = level / factor;
    }
    match settings.excitation {
        ExcitationChoice::Decay => {}
        ExcitationChoice::Harmonic => {
            number(
                ui,
                &mut settings.tone,
                "Tone",
                "Frequency of the harmonic; the record held out has another, 1.2 times as high",
                "Hz",
                0.01..=1e3,
            );
        }
        ExcitationChoice::Multisine | ExcitationChoice::Sweep | ExcitationChoice::Bursts => {
            number(ui, &mut settings.band.0, "From", "Lower end of the band", "Hz", 0.01..=1e3);
            number(ui, &mut settings.band.1, "To", "Upper end of the band", "Hz", 0.01..=1e3);
        }
    }
    if !decay {
        let period = settings.natural_frequencies().first().map_or(1.0, |f| 1.0 / f);
        let tooltip = "Time before the record begins: the transient that dies down in it is not recorded";
        SliderRow {
            unit: "s",
            spread: Spread::LogarithmicFromZero,
            format: &with_unit("s"),
            ..SliderRow::new("Settle", tooltip, 0.1 * period..=200.0 * period)
        }
        .show(ui, &mut settings.settle);
    }
    number(
        ui,
        &mut settings.held_out_level,
        "Held out",
        "Level of the record that is never fitted, over that of the one that is",
        "×",
        0.1..=10.0,
    );
}

fn sensors(ui: &mut Ui, settings: &mut RigSettings) {
    section(ui, "SENSORS", |_| {}, |_| {});
    share(
        ui,
        &mut settings.noise,
        "Noise",
        "Standard deviation of the displacement's white noise, as a share of its RMS",
        0.5,
    );
    share(
        ui,
        &mut settings.offset,
        "Offset",
        "What the displacement sensor shows at rest, as a share of the RMS displacement",
        2.0,
    );
    share(
        ui,
        &mut settings.jitter,
        "Jitter",
        "Scatter of the sampling instants, as a share of the sampling interval",
        0.4,
    );
    seed(ui, &mut settings.seed, "Draws noise and phases: the same seed makes the same record", 100);
}

fn record(ui: &mut Ui, settings: &mut RigSettings) {
    let mut suited = false;
    let aside = |ui: &mut Ui| {
        let hint = "Band, sampling rate and length that suit the natural frequency";
        suited = ui.button("Suit the plant").on_hover_text(hint).clicked();
    };
    section(ui, "RECORD", aside, |_| {});
    if suited {
        *settings = settings.clone().suited();
    }
    number(ui, &mut settings.rate, "Rate", "Sampling rate", "Hz", 0.5..=1e5);
    number(ui, &mut settings.duration, "Length", "Duration of each record", "s", 0.01..=1e4);
    let found = settings.natural_frequencies();
    let (Some(lowest), Some(highest)) = (found.first(), found.last()) else { return };
    let a_period = settings.rate / highest;
    let colors = theme::accents(ui.visuals().dark_mode);
    let words = format!(
        "{} samples · {} periods · {} samples a period",
        settings.samples(),
        significant_trimmed(settings.duration * lowest, 2),
        significant_trimmed(a_period, 2)
    );
    let text = RichText::new(words).size(12.0);
    let text = if a_period < 10.0 { text.color(colors.caution) } else { text.weak() };
    ui.add(egui::Label::new(text).truncate()).on_hover_text("Fewer than ten samples a period blur the derivatives");
}
