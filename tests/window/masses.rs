//! Several masses, the places between them, and what is saved of the plots of "What's missing".

use super::*;
use sindyscope_core::prepare::{Treatment, prepare};
use sindyscope_values::format::units::format_si;
use sindyscope_values::record::{self, RecordSet};

/// Two masses with friction between them, one record.
fn chain(folder: &Path) -> PathBuf {
    let options = ScenarioOptions {
        duration: Some(6.0),
        noise: Some("0.5%".parse().unwrap()),
        parameters: vec![("F12".to_owned(), 1.0)],
        ..ScenarioOptions::default()
    };
    recorded(folder.join("chain.csv"), "two-masses", &options)
}

#[test]
fn the_candidates_of_a_place_are_shown_by_clicking_on_it_in_the_picture_of_the_chain() {
    let home = tempfile::tempdir().unwrap();
    let mut window = Window::of_files(vec![chain(home.path())]);
    assert!(window.shows("x2 displacement"), "the masses are listed with their channels");
    window.click("What's missing");
    window.click("Find what's missing");
    window.0.get_by_role_and_label(Role::Tab, "Name").click();
    window.settle();
    assert!(window.shows("Coulomb (dry) friction, between masses 1 and 2"), "a card");
    window.0.get_by_label_contains("show all").click();
    window.settle();
    let cards = |window: &Window, place: &str| {
        let at = |node: &egui_kittest::Node<'_>| {
            let node = node.accesskit_node();
            node.role() == Role::Button && node.label().is_some_and(|l| l.ends_with(place) && !l.starts_with("Place"))
        };
        window.0.root().children_recursive().filter(at).count()
    };
    assert!(cards(&window, "to ground at mass 1") > 0 && cards(&window, "between masses 1 and 2") > 0);
    window.click("Place between masses 1 and 2");
    assert!(window.shows("Between masses 1 and 2 alone"));
    assert!(cards(&window, "to ground at mass 1") == 0 && cards(&window, "between masses 1 and 2") > 0);
    window.click("All places");
    assert!(cards(&window, "to ground at mass 1") > 0);
    window.click("Place mass 2 to ground");
    window.click("Place mass 2 to ground");
    assert!(cards(&window, "between masses 1 and 2") > 0, "a second click shows all again");
    window.click("Next");
    window.click("Accept");
    assert!(window.app().walk().accepted[0].form.contains("between masses 1 and 2"), "{:?}", window.app().walk());
}

#[test]
fn a_force_that_was_recorded_late_is_found_with_the_equation_and_moved() {
    let home = tempfile::tempdir().unwrap();
    let options =
        ScenarioOptions { duration: Some(6.0), noise: Some("0.5%".parse().unwrap()), ..ScenarioOptions::default() };
    let made = generate("two-masses", &options).unwrap();
    let late = Treatment::Align { role: record::Role::Input(0), delay: Some(-0.012) };
    let records = prepare(&RecordSet::new(made.records, Usage::Fit), &[late.into()]).unwrap();
    let path = home.path().join("late.csv");
    let records: Vec<_> = records.entries.iter().map(|(record, _)| &**record).collect();
    write_csv(records, &mut std::fs::File::create(&path).unwrap(), &[]).unwrap();
    let mut window = Window::of_files(vec![path]);
    window.click_hidden("equal and opposite 1–2");
    assert!(window.shows("m2/m1"), "the ratio of the masses is among the physical parameters");
    window.click("Add step ⏷");
    window.click("Align u");
    window.click_hidden("Find");
    let step = window.app().state().document.edit.steps[0].clone();
    let Treatment::Align { delay: Some(delay), .. } = step.treatment else { panic!("{step:?}") };
    assert!((delay - 0.012).abs() < 0.001, "{delay} s");
    assert!(window.shows("Found with the equation"));
}

#[test]
fn plots_of_the_missing_force_are_saved_as_figures_and_as_tables() {
    let home = tempfile::tempdir().unwrap();
    let mut window = Window::missing(home.path(), Theme::Dark);
    window.click("Find what's missing");
    window.press(CTRL, Key::E);
    assert!(window.shows("Save figure: gap"));
    for (name, head) in [("gap.svg", &b"<svg"[..]), ("gap.pdf", b"%PDF"), ("gap.png", b"\x89PNG")] {
        let path = home.path().join(name);
        window.click("Save to…");
        window.give_path(&path, "Save");
        assert!(std::fs::read(&path).unwrap().starts_with(head), "{name}");
    }
    let drawn = std::fs::read_to_string(home.path().join("gap.svg")).unwrap();
    assert!(drawn.contains("gap (") && drawn.contains("t (s)") && drawn.contains("simulated"), "{}", &drawn[..300]);
    window.press(CTRL, Key::E);
    for (plot, head) in [
        ("Map of the missing force", "x − u (m),v (m/s),missing force (m/s²),"),
        ("Missing force along one quantity", "v (m/s),missing force (m/s²),"),
    ] {
        window.0.get_by_label(plot).click_secondary();
        window.settle();
        window.click("Save what is shown as CSV…");
        let path = home.path().join("table.csv");
        let _ = std::fs::remove_file(&path);
        window.give_path(&path, "Save");
        let table = std::fs::read_to_string(&path).unwrap();
        assert!(table.starts_with(head) && table.lines().count() > 10, "{}", &table[..200]);
    }
    window.0.get_by_label("Map of the missing force").click_secondary();
    window.settle();
    window.click("Save picture…");
    assert!(window.shows("Save figure: map"));
    let path = home.path().join("map.svg");
    window.click("Save to…");
    window.give_path(&path, "Save");
    assert!(std::fs::read_to_string(&path).unwrap().contains(">v ("));
}

#[test]
fn on_opening_a_base_and_a_mass_each_answer_says_what_it_would_buy() {
    let home = tempfile::tempdir().unwrap();
    // One tone under loud noise: spring and damper of the base and of the mass cannot be told apart by the data alone.
    let record = |seed, frequency, duration, name: &str| {
        let options = ScenarioOptions {
            seed,
            duration: Some(duration),
            rate: Some(400.0),
            frequencies: Some(vec![frequency]),
            noise: Some("1e-3".parse().unwrap()),
            ..ScenarioOptions::default()
        };
        recorded(home.path().join(name), "friction-noisy", &options)
    };
    let mut state = start(Source::Files(vec![record(3, 5.242, 2.0, "fit.csv"), record(4, 3.2, 4.0, "held_out.csv")]));
    state.document.edit.usage = vec![Usage::Fit, Usage::HeldOut];
    let mut window = Window::open(state);
    window.press(CTRL, Key::K);
    window.type_into("Find a command", "Reset settings");
    window.press(Modifiers::NONE, Key::Enter);
    let error = |window: &Window| window.app().outcome().unwrap().test.map_or(f64::INFINITY, |s| s.rmse);
    assert!(window.shows("What is known of base and mass?"));
    let text = |node: &egui_kittest::Node<'_>| node.accesskit_node().value();
    let promised: Vec<String> = window.0.root().children_recursive().filter_map(|n| text(&n)).collect();
    let before = format_si(error(&window), "m", 3);
    assert!(promised.iter().any(|l| l.contains(&before)), "{before}");
    window.click_hidden("One of each, and no energy added");
    let known: Vec<String> = window.app().settings().known.iter().map(ToString::to_string).collect();
    assert_eq!(known, ["x=-u", "v=-du", "passive"]);
    let found = format_si(error(&window), "m", 3);
    assert!(promised.contains(&found), "{found} of {promised:?}");
    assert!(!window.shows("What is known of base and mass?"), "answered");
    window.press(CTRL, Key::Z);
    assert!(window.app().settings().known.is_empty(), "undo takes it back");
}

#[test]
fn a_unit_is_chosen_by_a_click_on_an_axis_and_kept_in_the_project() {
    let home = tempfile::tempdir().unwrap();
    let mut window = Window::of_files(vec![friction(home.path())]);
    assert!(window.shows(" m/s² sgn v"));
    let before = window.app().settings().clone();
    window.click("Unit of x");
    window.click("µm");
    assert!(window.shows(" µm/s² sgn v"), "coefficients are told in it");
    assert_eq!(window.app().settings(), &before, "what is computed stays as it is");
    window.press(CTRL, Key::E);
    let figure = home.path().join("response.svg");
    window.click("Save to…");
    window.give_path(&figure, "Save");
    let drawn = std::fs::read_to_string(&figure).unwrap();
    assert!(drawn.contains("x (µm)") && drawn.contains("E (µm)"), "{}", &drawn[..300]);
    window.press(CTRL, Key::S);
    let project = home.path().join("study.json");
    window.give_path(&project, "Save");
    let again = Window::of_files(vec![project]);
    assert!(again.shows(" µm/s² sgn v"), "the choice is kept in the project");
    window.click("Unit of x");
    window.click("as suits the data");
    assert!(window.shows(" m/s² sgn v") && !window.shows(" µm/s² sgn v"));
}
