//! The virtual rig's room, the class mode and the lessons, driven as a teacher and a student would.

use std::path::Path;

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use sindyscope::app::{Sample, Source, State};
use sindyscope_files::{ReadOptions, read_set};
use sindyscope_rig::{ExcitationChoice, PlantChoice, RigDrive};
use sindyscope_values::term::Term;

use super::{CTRL, Window, look_at, start};

impl Window {
    /// The room, its drawing held.
    fn rig() -> Self {
        Self::rig_of(start(Source::Nothing))
    }

    fn rig_of(state: State) -> Self {
        let mut window = Self::open(state);
        window.click("Virtual rig");
        if window.shows("Pause") {
            window.click("Pause");
        }
        window
    }

    /// Chooses an entry of a list.
    fn choose(&mut self, list: &str, entry: &str) {
        self.0.get_by_role_and_label(Role::ComboBox, list).click();
        self.settle();
        self.0.get_all_by_label(entry).last().unwrap().click_accesskit();
        self.settle();
        // A list stays open if its entry was not clicked with the pointer.
        self.press(Modifiers::NONE, Key::Escape);
    }

    fn save_to(&mut self, path: &Path) {
        self.press(CTRL, Key::A);
        self.type_into("Path", path.to_str().unwrap());
        self.click("Save");
    }

    fn rig_settings(&self) -> sindyscope_rig::RigSettings {
        self.app().state().rig.settings.clone()
    }

    fn begin_lesson(title: &str) -> Self {
        let mut window = Self::rig();
        window.click("Lessons");
        window.click_hidden(&format!("Begin the lesson {title}"));
        window
    }

    /// Takes the next step, once the one in view was noticed.
    fn noticed(&mut self, step: usize) {
        let position = self.app().state().lessons.current.clone().expect("a lesson is open");
        let error = self.app().outcome().and_then(|o| o.test.or(o.train)).map(|s| s.rmse);
        assert!(position.met.contains(&step), "step {step} of {}: {position:?}, error {error:?}", position.lesson);
        assert!(self.shows("✔"), "what was seen is said");
        self.click("Next step");
    }

    /// Ends the lesson after its closing sentence.
    fn finish(&mut self, id: &str) {
        self.click("Finish");
        let progress = self.app().state().lessons.clone();
        assert!(progress.finished.contains(id) && progress.current.is_none());
        assert!(self.shows("✔ done"), "the list shows it");
    }

    /// Types a term into the library and sends it off.
    fn add_term(&mut self, term: &str) {
        self.type_into("Add terms", term);
        self.press(Modifiers::NONE, Key::Enter);
    }

    /// A box of the library.
    fn tick(&mut self, term: &str) {
        self.0.get_by_role_and_label(Role::CheckBox, term).click_accesskit();
        self.settle();
    }
}

#[test]
fn the_rig_follows_its_controls_and_hands_its_record_over() {
    let home = tempfile::tempdir().unwrap();
    let mut window = Window::rig();
    for text in ["TRUTH BESIDE FOUND", "Drawing of the rig", "error held out", "natural frequency 2 Hz"] {
        assert!(window.shows(text), "{text}");
    }
    assert!(window.shows("sgn v: truth −"), "dry friction is what it starts with");
    let before = window.rig_settings();
    assert!(!before.effect_values.is_empty(), "suggested parameters are kept");
    window.slide("Frequency", 3.0);
    assert!(window.shows("natural frequency 3 Hz") && window.shows("x: truth −355"));
    window.press(CTRL, Key::Z);
    assert_eq!(window.rig_settings(), before, "undo takes it back, and not the suggestion");

    window.choose("Effect", "cubic stiffness");
    assert!(window.shows("x³: truth"));
    window.click("moving base");
    assert_eq!(window.rig_settings().drive, RigDrive::Base);
    assert!((window.rig_settings().level - before.level / 157.9).abs() < 1e-4, "as strong as before");
    window.choose("Effect", "a harmonic force that is not measured");
    window.click("plant's terms");
    assert!(window.shows("not found") || window.shows("no term for it"));
    window.click("plant's terms");
    window.slide("Rate", 4.0);
    assert!(window.shows("half the sampling rate"), "what cannot be is told, and the last record stays");
    window.press(CTRL, Key::Z);

    window.choose("Plant", "two masses");
    assert_eq!(window.rig_settings().plant, PlantChoice::TwoMasses);
    assert!(window.shows("natural frequencies") && window.shows("dv₂/dt ="));
    window.choose("Plant", "one mass");
    window.choose("Kind", "free decay");
    assert_eq!(window.rig_settings().excitation, ExcitationChoice::Decay);

    window.choose("Effect", "cubic stiffness");
    let path = home.path().join("rig.csv");
    window.click_hidden("Save as CSV…");
    window.save_to(&path);
    let read = read_set(std::slice::from_ref(&path), &[], &ReadOptions::default()).unwrap();
    assert_eq!(read.entries.len(), 2, "both records");
    let truth = std::fs::read_to_string(path.with_extension("truth.json")).unwrap();
    assert!(truth.contains("\"cubic_stiffness\"") && truth.contains("\"x^3\""), "{truth}");

    window.click_hidden("Study in Identify");
    let cube = Term::parse("x^3").unwrap();
    let found = window.app().outcome().unwrap().model.leading().unwrap().coefficient(&cube);
    let settings = window.rig_settings();
    let set = settings.effect_values.iter().find(|v| v.name == "k_3").unwrap().value;
    assert!((found.unwrap() / -set - 1.0).abs() < 0.1, "{found:?} of {set}");

    // All of it comes back, with a session and with a project.
    let text = serde_json::to_string(window.app().state()).unwrap();
    let again = Window::open(serde_json::from_str(&text).unwrap());
    assert_eq!(again.rig_settings(), settings);
    assert_eq!(again.app().outcome().unwrap().records.len(), 2);
    let project = home.path().join("study.json");
    window.press(CTRL, Key::S);
    window.save_to(&project);
    assert_eq!(Window::of_files(vec![project]).rig_settings(), settings);
}

#[test]
fn a_round_of_the_class_mode_hides_guesses_and_reveals() {
    let home = tempfile::tempdir().unwrap();
    let mut state = start(Source::Nothing);
    state.rig.class.case.samples = 600;
    let mut window = Window::rig_of(state);
    window.click("Class");
    window.choose("Hide", "cubic stiffness");
    window.slide("Strength", 15.0);
    window.click("Begin the round");
    assert!(window.shows("Round 1: which effect is hidden?") && !window.shows("cubic stiffness"));
    window.click("Study the data in Identify");
    assert_eq!(window.app().outcome().unwrap().records.len(), 3);
    window.click("Virtual rig");
    let path = home.path().join("round.csv");
    window.click("Save the data…");
    window.save_to(&path);
    assert!(!std::fs::read_to_string(&path).unwrap().contains("cubic"), "the file does not tell");
    for (who, guess) in [("Ada", "cubic stiffness"), ("Bert", "Coulomb friction")] {
        window.type_into("Who", who);
        window.choose("Guess", guess);
        window.click("Take down");
    }
    window.click("Reveal");
    let round = window.app().state().rig.class.rounds[0].clone();
    assert_eq!((round.hidden.as_str(), round.guesses.len(), round.revealed), ("cubic_stiffness", 2, true));
    assert_eq!(round.answered.expect("the program searched").effects, ["cubic_stiffness"]);
    assert!(window.shows("right") && window.shows("wrong") && window.shows("The last truth"));
    let table = home.path().join("rounds.csv");
    window.click("Export as CSV…");
    window.save_to(&table);
    let table = std::fs::read_to_string(table).unwrap();
    assert!(table.contains("1,Bert,coulomb_friction,no,cubic_stiffness,cubic_stiffness,named"), "{table}");
    assert!(window.shows("Begin the round"), "the next one may begin");
}

#[test]
fn the_lesson_on_smoothing() {
    let mut window = Window::begin_lesson("Smoothing");
    window.slide("Segment", 9.0);
    window.noticed(0);
    window.slide("Segment", 501.0);
    window.noticed(1);
    window.click("Step back");
    window.click("Next step");
    window.click("Reset Segment");
    window.noticed(2);
    window.finish("smoothing");
}

#[test]
fn the_lesson_on_the_threshold() {
    let mut window = Window::begin_lesson("Threshold");
    window.slide("Threshold", 0.3);
    window.noticed(0);
    window.slide("Threshold", 0.0);
    window.noticed(1);
    window.click_hidden("Reset Threshold");
    window.noticed(2);
    window.finish("threshold");
}

#[test]
fn the_lesson_on_a_hidden_friction_leads_through_all_rooms() {
    let mut window = Window::begin_lesson("A hidden friction");
    window.slide("F", 0.25);
    window.noticed(0);
    // It survives a restart in the middle.
    let text = serde_json::to_string(window.app().state()).unwrap();
    window = Window::rig_of(serde_json::from_str(&text).unwrap());
    window.click_hidden("Study in Identify");
    window.noticed(1);
    window.tick("sgn v");
    window.noticed(2);
    window.click("What's missing");
    window.click("Find what's missing");
    window.noticed(3);
    window.click("Next");
    window.click("Next");
    window.click("Accept");
    window.noticed(4);
    window.finish("friction");
}

#[test]
fn the_lesson_on_the_wrong_library() {
    let mut window = Window::begin_lesson("The wrong library");
    window.click("plant's terms");
    window.noticed(0);
    window.slide("Held out", 1.6);
    window.noticed(1);
    window.click("plant's terms");
    window.noticed(2);
    window.finish("library");
}

#[test]
fn the_lesson_on_transients() {
    let mut window = Window::begin_lesson("Transient against steady state");
    window.slide("Settle", 45.0);
    window.noticed(0);
    window.choose("Kind", "multisine");
    window.noticed(1);
    window.finish("transient");
}

#[test]
fn the_lesson_on_units() {
    let mut window = Window::begin_lesson("Units");
    window.click_hidden("raw");
    window.noticed(0);
    window.click_hidden("scaled");
    window.noticed(1);
    window.click_hidden("Mass known");
    window.noticed(2);
    window.finish("units");
}

#[test]
fn the_lesson_on_noise() {
    let mut window = Window::begin_lesson("Noise");
    window.slide("Noise", 5.0);
    window.noticed(0);
    window.slide("Length", 45.0);
    window.noticed(1);
    window.slide("Noise", 1.0);
    window.noticed(2);
    window.finish("noise");
}

#[test]
fn the_lesson_on_an_overfit() {
    let mut window = Window::begin_lesson("An overfit");
    window.press(Modifiers::NONE, Key::Home);
    let held_out = window.app().records().entries[1].0.name.clone();
    window.click(&format!("Show record {held_out}"));
    window.noticed(0);
    window.tick("x⁷");
    window.noticed(1);
    window.tick("x⁵");
    window.noticed(2);
    window.finish("overfit");
}

#[test]
fn the_lesson_on_sticking() {
    let mut window = Window::begin_lesson("Sticking");
    window.slide("F", 0.4);
    window.noticed(0);
    window.click_hidden("Study in Identify");
    window.noticed(1);
    window.click("Virtual rig");
    window.slide("Level", 60.0);
    window.noticed(2);
    window.finish("sticking");
}

#[test]
fn the_lesson_on_chaos() {
    let mut window = Window::begin_lesson("Chaos and its horizon");
    let held_out = window.app().records().entries[1].0.name.clone();
    window.click(&format!("Show record {held_out}"));
    window.noticed(0);
    let segment = window.app().settings().smoothing.window;
    window.slide("Segment", segment as f64 + 4.0);
    window.noticed(1);
    window.look("Motion", "Phase");
    window.noticed(2);
    window.finish("chaos");
}

#[test]
fn the_lesson_on_self_excitation() {
    let mut window = Window::begin_lesson("Self-excitation");
    window.add_term("x^2*v");
    look_at(&mut window, "lesson-self-excitation");
    window.noticed(0);
    window.tick("sgn v");
    window.tick("v·|v|");
    let train = window.app().outcome().unwrap().train.unwrap();
    assert!(train.nrmse < 0.15, "the response grows as the motion does: {}", train.nrmse);
    window.noticed(1);
    window.look("Motion", "Phase");
    look_at(&mut window, "lesson-limit-cycle");
    window.noticed(2);
    window.tick("x²·v");
    window.noticed(3);
    window.finish("self-excitation");
}

#[test]
fn the_lesson_on_parametric_resonance() {
    let mut window = Window::begin_lesson("Parametric resonance");
    window.add_term("x*cos(2*t)");
    look_at(&mut window, "lesson-parametric");
    window.noticed(0);
    window.tick("x³");
    window.noticed(1);
    window.add_term("x^3");
    window.tick("x·cos(2·t)");
    window.add_term("x*cos(1.5*t)");
    window.noticed(2);
    window.finish("parametric");
}

#[test]
fn the_lesson_on_hysteresis() {
    let mut window = Window::begin_lesson("Hysteresis");
    let level = window.rig_settings().level;
    window.slide("Level", 0.01 * level);
    look_at(&mut window, "lesson-hysteresis-small");
    window.noticed(0);
    window.slide("Level", level);
    window.click_hidden("Study in Identify");
    look_at(&mut window, "lesson-hysteresis-identify");
    window.noticed(1);
    window.click("What's missing");
    window.click("Find what's missing");
    window.noticed(2);
    window.click("Next");
    assert!(window.shows("hysteresis"), "a card of it");
    look_at(&mut window, "lesson-hysteresis");
    window.click("Next");
    window.click("Accept");
    window.noticed(3);
    window.finish("hysteresis");
}

#[test]
fn the_rig_has_structures_and_identify_takes_them_for_such() {
    let mut window = Window::rig();
    for (plant, choice, words) in [
        ("five masses", PlantChoice::FiveMasses, "5 masses in a chain"),
        ("beam", PlantChoice::Beam, "6 nodes of a cantilever"),
    ] {
        window.choose("Plant", plant);
        assert_eq!(window.rig_settings().plant, choice);
        assert!(window.shows("natural frequencies"), "{words}");
        look_at(&mut window, &format!("rig-{}", choice.masses()));
    }
    window.slide("friction", 0.2);
    assert!(window.rig_settings().chain["friction"] > 0.1);
    window.click_hidden("Study in Identify");
    window.click("Identify its modes");
    let found = window.app().modes().map(|m| m.structure.modes.len());
    assert!(found.is_some_and(|m| m >= 3), "{found:?}");
    look_at(&mut window, "rig-beam-modes");
}

#[test]
fn the_lesson_on_modes() {
    let mut window = Window::begin_lesson("Modes of a structure");
    window.click("Identify its modes");
    look_at(&mut window, "lesson-modes");
    window.noticed(0);
    let number = |window: &mut Window, entry: &str| {
        window.0.get_by_role_and_label(Role::ComboBox, "Number of modes").click();
        window.settle();
        window.0.get_by_role_and_label(Role::Button, entry).click();
        window.settle();
    };
    number(&mut window, "4");
    window.noticed(1);
    number(&mut window, "as the data bear");
    window.noticed(2);
    window.click("Responses");
    window.noticed(3);
    window.click("Shapes");
    look_at(&mut window, "lesson-modes-shapes");
    window.noticed(4);
    window.finish("modes");
}

#[test]
fn the_lesson_on_a_joint_that_slips() {
    let mut window = Window::begin_lesson("A joint that slips");
    window.click("Identify its modes");
    look_at(&mut window, "lesson-joint");
    window.noticed(0);
    let names: Vec<String> = window.app().records().entries.iter().map(|(r, _)| r.name.clone()).collect();
    window.choose(&format!("Use of record {}", names[1]), "off");
    window.choose(&format!("Use of record {}", names[2]), "off");
    window.noticed(1);
    window.choose(&format!("Use of record {}", names[1]), "fit");
    window.choose(&format!("Use of record {}", names[0]), "off");
    window.noticed(2);
    window.click("What's missing");
    window.click("Find what's missing");
    look_at(&mut window, "lesson-joint-missing");
    window.noticed(3);
    window.finish("joint");
}

#[test]
fn a_classic_is_opened_by_its_name_from_the_welcome_page_the_menu_and_the_rig() {
    let opened = |window: &Window| window.app().state().document.source.clone();
    let mut window = Window::open(start(Source::Nothing));
    look_at(&mut window, "welcome");
    window.click("All classics ⏷");
    look_at(&mut window, "welcome-classics");
    window.click("Hidden absorber");
    assert_eq!(opened(&window), Source::Sample(Sample::Absorber));
    assert_eq!(window.app().records().entries.len(), 2);
    assert!(window.app().outcome().is_some(), "studied at once");
    window.click("absorber ⏷");
    window.click("Classics");
    window.click("Bouc–Wen hysteresis");
    assert_eq!(opened(&window), Source::Sample(Sample::BoucWen));
    window.click("Virtual rig");
    window.click("Open one in Identify ⏷");
    window.click("Mathieu's oscillator");
    assert_eq!(opened(&window), Source::Sample(Sample::Mathieu));
    assert_eq!(window.app().state().document.source, Source::Sample(Sample::Mathieu));
    assert!(window.shows("held-out error"), "the room is Identify");
}

#[test]
fn the_rig_looks_as_it_did() {
    let mut window = Window::rig();
    window.slide("Instant", 3.4);
    window.0.snapshot("rig");
}

#[test]
fn an_older_session_opens_in_a_window_with_a_rig() {
    let text = r#"{"record": 1, "source": {"sample": "duffing"}}"#;
    let state = State::of_any_version(serde_json::from_str(text).unwrap()).unwrap();
    assert_eq!(state.rig.settings, sindyscope_rig::RigSettings::default());
    let window = Window::open(state);
    assert_eq!(window.app().state().document.source, Source::Sample(Sample::Duffing));
}
