//! A walk in *What's missing* is kept with the project and the session.

use std::sync::Arc;

use sindyscope_search::Diagnosis;

use super::*;

/// What the walk has come to, all of it; what is not a number is equal to itself here.
fn told(window: &Window) -> String {
    let diagnosis: &Arc<Diagnosis> = window.app().diagnosis().expect("the walk has come to something");
    format!("{diagnosis:#?}")
}

/// Says what the second record is used for.
fn use_second(window: &mut Window, usage: &str) {
    let name = window.app().records().entries[1].0.name.clone();
    window.click(&format!("Use of record {name}"));
    window.0.get_by_role_and_label(Role::Button, usage).click();
    window.settle();
}

/// The room with a search in it, in a window that keeps its session; what is in view is the card of the first candidate.
fn searched(session: &Path, folder: &Path) -> Window {
    let mut window = Window::revived(session, shaken(folder));
    use_second(&mut window, "held out");
    window.click("What's missing");
    window.click("Find what's missing");
    window.click("Next");
    window
}

#[test]
fn a_search_survives_a_killed_window_and_undo() {
    let home = tempfile::tempdir().unwrap();
    let session = home.path().join("state/session.json");
    let mut window = searched(&session, home.path());
    let before = told(&window);
    // No farewell: neither a save nor an exit is called.
    drop(window);
    let text = std::fs::read_to_string(&session).unwrap();
    let bytes = text.len();
    assert!(bytes < 200_000, "{bytes} bytes are written at every change");

    window = Window::revived(&session, Vec::new());
    assert_eq!(told(&window), before);
    assert!(window.shows("Coulomb"), "the card is in view again");

    // Another use of the records asks for another search; taken back, the first one is there again.
    let held_out = window.app().records().with(Usage::HeldOut).count();
    window.click("Identify");
    use_second(&mut window, "off");
    window.click("What's missing");
    assert!(window.app().diagnosis().is_none());
    window.press(CTRL, Key::Z);
    assert_eq!(window.app().records().with(Usage::HeldOut).count(), held_out);
    assert_eq!(told(&window), before);

    window.0.get_by_role_and_label(Role::Tab, "Name").click();
    window.settle();
    window.click("Next");
    window.click("Accept");
    let (walk, after) = (window.app().walk().clone(), told(&window));
    assert_eq!(walk.accepted.len(), 1);
    drop(window);
    let again = Window::revived(&session, Vec::new());
    assert_eq!((again.app().walk(), told(&again)), (&walk, after));
}

#[test]
fn a_search_comes_back_with_its_project_unless_the_data_changed() {
    let home = tempfile::tempdir().unwrap();
    let mut window = searched(&home.path().join("session.json"), home.path());
    let before = told(&window);
    let project = home.path().join("study.sindy");
    window.press(CTRL, Key::S);
    window.give_path(&project, "Save");
    let again = Window::of_files(vec![project.clone()]);
    assert_eq!(told(&again), before);
    assert!(!again.shows("was left out"));
    drop(again);

    let data = home.path().join("fit.csv");
    let text = std::fs::read_to_string(&data).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    std::fs::write(&data, lines[..lines.len() - 40].join("\n")).unwrap();
    let changed = Window::of_files(vec![project]);
    assert!(changed.app().diagnosis().is_none(), "it is not shown wrongly");
    assert!(changed.shows("What was found missing was left out"), "it is told");
}

/// A file as an older version wrote it.
fn stored(name: &str) -> String {
    std::fs::read_to_string(Path::new("tests/fixtures/kept").join(name)).unwrap()
}

#[test]
fn projects_of_every_version_open() {
    for version in 1..=5 {
        let home = tempfile::tempdir().unwrap();
        shaken(home.path());
        let path = home.path().join("study.json");
        std::fs::write(&path, stored(&format!("project-{version}.json"))).unwrap();
        let window = Window::of_files(vec![path]);
        let settings = window.app().settings();
        assert!((settings.threshold - 0.01 - 0.001 * f64::from(version)).abs() < 1e-12, "{version}: {settings:?}");
        assert_eq!(window.app().records().with(Usage::HeldOut).count(), 1, "{version}: the use of the records");
        let shown = serde_json::to_value(&window.app().state().shown).unwrap();
        let view = ["response", "phase", "phase", "spectrum", "spectrum"][version as usize - 1];
        assert_eq!(shown["view"], view, "{version}");
        let accepted = window.app().walk().accepted.len();
        assert_eq!(accepted, usize::from(version >= 4), "{version}: the walk");
        assert_eq!(window.app().state().document.pins.len(), usize::from(version >= 4), "{version}: the pins");
        assert!(!window.shows("Choose the file…"), "{version}");
    }
}

#[test]
fn sessions_of_every_version_open() {
    for version in 1..=2 {
        let home = tempfile::tempdir().unwrap();
        let data = friction(home.path());
        let session = home.path().join("session.json");
        let folder = home.path().display().to_string();
        std::fs::write(&session, stored(&format!("session-{version}.json")).replace("FOLDER", &folder)).unwrap();
        let window = Window::revived(&session, Vec::new());
        assert_eq!(window.app().state().document.source, Source::Files(vec![data]), "{version}");
        assert_eq!(window.app().settings().threshold, 0.004, "{version}");
        assert_eq!(window.app().records().with(Usage::HeldOut).count(), 1, "{version}");
        let shown = serde_json::to_value(&window.app().state().shown).unwrap();
        assert_eq!(shown["view"], "phase", "{version}");
        let other = Source::Files(vec![home.path().join("other/friction.csv")]);
        let kept = &window.app().state().kept;
        assert!(kept.iter().any(|kept| kept.source == other), "{version}: what was left with another file");
    }
}

#[test]
fn what_was_looked_at_in_a_walk_is_looked_at_again_after_a_restart() {
    let home = tempfile::tempdir().unwrap();
    let session = home.path().join("state/session.json");
    let mut window = searched(&session, home.path());
    window.click("Next");
    window.0.get_by_role_and_label(Role::Tab, "Add").click();
    window.settle();
    let left = window.app().state().shown.clone();
    let walk = serde_json::to_value(&left).unwrap()["walk"].clone();
    assert!(walk["selected"].is_object() && walk["step"] == "add", "{walk}");
    drop(window);
    let again = Window::revived(&session, Vec::new());
    assert_eq!(serde_json::to_value(&again.app().state().shown).unwrap()["walk"], walk);
    assert!(again.app().diagnosis().is_some());
}

#[test]
fn a_session_is_recorded_and_replayed_to_the_same_state() {
    let home = tempfile::tempdir().unwrap();
    let mut window = Window::of_files(shaken(home.path()));
    use_second(&mut window, "held out");
    window.slide("Threshold", 0.004);
    window.click("Add step ⏷");
    window.click("Decimate");
    window.press(CTRL, Key::Z);
    window.look("Tuning", "Compare");
    window.click("Pin as A");
    window.click("What's missing");
    window.click("Find what's missing");
    window.click("Next");
    window.click("Next");
    window.click("Accept");
    window.click("Virtual rig");
    window.slide("Frequency", 3.0);
    let log = window.app().log();
    let replayed = sindyscope::app::replay(&log).unwrap();
    assert!(replayed.messages > 10, "{}", replayed.messages);
    assert_eq!(replayed.differences, Vec::<String>::new());
}
