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
