//! Effects of a person's own in *What's missing*: written down, found wrong, mended, searched, kept and handed on.

use sindyscope_rig::hidden::{ExcitationKind, HiddenRequest, draw};

use super::*;

const MAGNET: &str = r#"[[effect]]
name = "magnetic_pull"
words = "A magnet pulls the harder the nearer the mass comes; what it pulls at rest is taken off."
terms = ["1/(d-r)^2-1/d^2"]
coefficients = ["k_m"]
inner.d = { bounds = [0.5, 20.0], unit = "mm" }
"#;

const FIELD: &str = "Own effects as TOML";

/// The records of a rig with a magnet, which the catalogue does not have.
fn attracted(folder: &Path) -> Vec<PathBuf> {
    let request = HiddenRequest { ratio: Some(0.15), ..HiddenRequest::new(["magnet"], ExcitationKind::Multisine, 1) };
    let hidden = draw(&request).unwrap();
    let path = folder.join("run.csv");
    write_csv(&hidden.fit, &mut std::fs::File::create(&path).unwrap(), &[]).unwrap();
    vec![path]
}

impl Window {
    /// Types into the field of own effects in place of what stands there.
    fn write_effects(&mut self, text: &str) {
        self.click("Clear");
        self.0.get_by_label(FIELD).focus();
        self.0.run_steps(2);
        self.0.get_by_label(FIELD).type_text(text);
        self.settle();
    }

    fn own_text(&self) -> &str {
        self.app().walk().own.text()
    }
}

#[test]
fn an_effect_of_ones_own_is_written_mended_found_and_kept() {
    let home = tempfile::tempdir().unwrap();
    let session = home.path().join("state/session.json");
    let mut window = Window::revived(&session, attracted(home.path()));
    window.click("What's missing");
    window.click("Own effects…");
    let template = window.0.get_by_label(FIELD).value().unwrap();
    assert!(template.contains("[[effect]]") && window.shows("Magnetic pull: not taken over yet"), "{template}");

    snapshot(&mut window, "own_effects");
    window.write_effects(&MAGNET.replace("(d-r)", "(d-q)"));
    assert!(window.shows("line 4, column 16: there is no quantity"), "where it is wrong stands beside the field");
    look_at(&mut window, "own-effects-wrong");
    assert!(window.0.get_by_label("Take over").accesskit_node().is_disabled());
    // A click on what is wrong leads there: what is typed next mends it.
    window.0.get_by_label_contains("line 4, column 16").click();
    window.settle();
    window.press(Modifiers::NONE, Key::Delete);
    window.0.get_by_label(FIELD).type_text("r");
    window.settle();
    assert!(window.shows("Magnetic pull: not taken over yet"));
    window.write_effects(MAGNET);
    window.click("Take over");
    assert_eq!(window.own_text(), MAGNET);
    assert!(window.shows("Magnetic pull: searched beside the catalogue"));
    window.press(CTRL, Key::Z);
    assert_eq!(window.own_text(), "", "undo takes it back");
    window.press(CTRL | Modifiers::SHIFT, Key::Z);
    assert_eq!(window.own_text(), MAGNET);
    window.click("Own effects…");
    assert!(!window.shows("Take over"), "the window is closed");

    window.click("Find what's missing");
    window.click("Next");
    assert!(window.shows("Magnetic pull"), "a card");
    look_at(&mut window, "own-effects-card");
    window.click("Next");
    window.click("Accept");
    let accepted = window.app().walk().accepted.clone();
    assert_eq!(accepted.iter().map(|c| c.effect.as_str()).collect::<Vec<_>>(), ["magnetic_pull"]);
    let found = window.app().diagnosis().expect("concluded").clone();
    let stage = window.app().stage().expect("fitted").gap.train_rmse;
    window.click("Use in Identify");
    assert!(window.terms().iter().any(|term| term.starts_with("1/(-x+0.00")), "{:?}", window.terms());
    let rmse = window.app().outcome().unwrap().train.unwrap().rmse;
    assert!((rmse / stage - 1.0).abs() < 0.2, "the same model, to be exported: {rmse} of {stage}");
    window.press(CTRL, Key::Z);
    window.click("What's missing");
    // No farewell: neither a save nor an exit is called.
    drop(window);
    let mut again = Window::revived(&session, Vec::new());
    assert_eq!((again.own_text(), &again.app().walk().accepted), (MAGNET, &accepted));
    assert_eq!(format!("{:#?}", again.app().diagnosis()), format!("{:#?}", Some(&found)), "nothing is searched anew");

    // A report of the project searches it as well.
    let project = home.path().join("study.json");
    again.press(CTRL, Key::S);
    again.give_path(&project, "Save");
    let report = home.path().join("study.html");
    let made = std::process::Command::new(env!("CARGO_BIN_EXE_sindyscope"))
        .args(["report".as_ref(), project.as_os_str(), "--out".as_ref(), report.as_os_str()])
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert!(std::fs::read_to_string(&report).unwrap().contains("Magnetic pull"));

    // Without the entry what was added of it goes too.
    again.click("Own effects…");
    again.click("Clear");
    again.click("Take over");
    assert!(again.app().walk().accepted.is_empty() && again.app().walk().own.effects().is_empty());
}

#[test]
fn a_file_of_effects_is_opened_and_saved_for_the_commands() {
    let home = tempfile::tempdir().unwrap();
    let records = attracted(home.path());
    let (given, saved) = (home.path().join("own.toml"), home.path().join("again.toml"));
    std::fs::write(&given, MAGNET).unwrap();
    let mut window = Window::of_files(records.clone());
    window.click("What's missing");
    window.click("Own effects…");
    window.click("Open TOML…");
    window.give_path(&given, "Open");
    assert_eq!(window.0.get_by_label(FIELD).value().as_deref(), Some(MAGNET));
    window.click("Save TOML…");
    window.give_path(&saved, "Save");
    assert!(window.shows(&format!("sindyscope diagnose FILE --effects {}", saved.display())));
    assert_eq!(std::fs::read_to_string(&saved).unwrap(), MAGNET);
    window.click("Open TOML…");
    window.give_path(&home.path().join("none.toml"), "Open");
    assert!(window.shows("there is no such file"));
}
