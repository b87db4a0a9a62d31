//! Structures by their modes: the program proposes them, and shows where they come from.

use sindyscope_rig::{
    Excitation, MeasuredChannel, MeasuredQuantity, Noise, Plant, RecordDrive, SampleTimes, Sensor, Sensors, Setup,
};
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::record::Role as ChannelRole;

use super::*;

/// Stiffness of each spring over its mass, ground – 1 – 2 – 3, 1/s²: modes at 1.945, 4.945 and 7.44 Hz.
const SPRINGS: [f64; 3] = [900.0, 700.0, 500.0];

/// The springs of three masses, and what else acts on each.
fn chain(inputs: usize, first: Option<(Term, f64)>, third: Option<(Term, f64)>) -> Model {
    let term = |text: &str| Term::parse(text).unwrap();
    let [a, b, c] = SPRINGS;
    let part = |x: &str, v: &str, k: f64| [(term(x), k), (term(v), 8e-4 * k)];
    let one = part("x1", "v1", -a).into_iter().chain(part("x2-x1", "v2-v1", b)).chain(first);
    let two = part("x2-x1", "v2-v1", -b).into_iter().chain(part("x3-x2", "v3-v2", c));
    let three = part("x3-x2", "v3-v2", -c).into_iter().chain(third);
    Model::second_order(inputs, vec![Equation::known(one), Equation::known(two), Equation::known(three)])
}

fn accelerometers() -> impl Iterator<Item = MeasuredChannel> {
    let noisy = Sensor::noisy(Noise::ShareOfRms(0.01));
    (0..3).map(move |i| {
        let quantity = MeasuredQuantity::Rate(3 + i);
        MeasuredChannel::new(format!("a{}", i + 1), ChannelRole::Acceleration(i), "m/s^2", quantity, noisy)
    })
}

/// The records of a setup as a file.
fn measured(folder: &Path, name: &str, setup: &Setup) -> PathBuf {
    let path = folder.join(name);
    write_csv(&setup.run().unwrap().records, &mut std::fs::File::create(&path).unwrap(), &[]).unwrap();
    path
}

/// Three masses with three accelerometers, driven at the first: two records.
fn instrumented(folder: &Path) -> PathBuf {
    let smooth = chain(1, Some((Term::parse("u").unwrap(), 1.0)), None);
    let plant = Plant { smooth, contacts: Vec::new() };
    let force = MeasuredChannel::new("u", ChannelRole::Input(0), "N", MeasuredQuantity::Input(0), Sensor::PERFECT);
    let sampling = SampleTimes { start: 0.0, interval: 0.02, count: 1500 };
    let drives = (0..2_u64).map(|k| {
        let force = Excitation::multisine(40.0, (0.5, 10.0), 60, 11 + k);
        RecordDrive::new(format!("run {}", k + 1), vec![force], vec![0.0; 6], sampling)
    });
    let sensors = Sensors::new(accelerometers().chain([force]));
    measured(folder, "frame.csv", &Setup { plant, drives: drives.collect(), sensors, seed: 3 })
}

/// The same masses after a blow at the first, a damper at the third: its damping is not in proportion to the springs.
fn struck(folder: &Path) -> PathBuf {
    let smooth = chain(0, None, Some((Term::parse("v3").unwrap(), -5.0)));
    let plant = Plant { smooth, contacts: Vec::new() };
    let sampling = SampleTimes { start: 0.0, interval: 0.01, count: 800 };
    let blow = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    let drives = vec![RecordDrive::new("blow", Vec::new(), blow, sampling)];
    measured(folder, "blow.csv", &Setup { plant, drives, sensors: Sensors::new(accelerometers()), seed: 5 })
}

fn frequencies(window: &Window) -> Vec<f64> {
    let analysis = window.app().modes().expect("modes");
    let structure = &analysis.structure;
    structure.modes.iter().zip(&structure.in_band).filter(|(_, inside)| **inside).map(|(m, _)| m.frequency).collect()
}

#[test]
fn many_sensors_are_proposed_as_a_structure_and_its_modes_are_found() {
    let home = tempfile::tempdir().unwrap();
    let session = home.path().join("state/session.json");
    let mut window = Window::revived(&session, vec![instrumented(home.path())]);
    assert!(window.shows("3 accelerations are measured"), "the program asks");
    window.click("Identify its modes");
    let found = frequencies(&window);
    assert_eq!(found.len(), 3, "{found:?}");
    for (found, wanted) in found.iter().zip([1.945, 4.945, 7.44]) {
        assert!((found / wanted - 1.0).abs() < 1e-3, "{found} Hz is not {wanted} Hz");
    }
    for text in ["Mode 1: ", "Mode 3: ", "MPC", "fitted error", "noise floor", "stable frequency"] {
        assert!(window.shows(text), "{text}");
    }
    look_at(&mut window, "modes_stabilization");

    window.click("Responses");
    assert!(window.shows("coherence"));
    look_at(&mut window, "modes_responses");
    window.click("Shapes");
    assert!(window.shows("modal assurance criterion"));
    look_at(&mut window, "modes_shapes");

    // The session knows the base and the view.
    drop(window);
    window = Window::revived(&session, Vec::new());
    assert_eq!(frequencies(&window), found);
    assert!(window.shows("modal assurance criterion"), "the view that was open is open");

    // The chain is a choice all the same, and undo takes it back.
    window.click("chain of masses");
    assert!(window.shows("EQUATION") && !window.shows("Identify its modes"), "it is not asked again");
    window.press(CTRL, Key::Z);
    assert_eq!(frequencies(&window), found);
}

#[test]
fn the_views_are_drawn_in_the_dark_and_complex_shapes_in_their_plane() {
    let home = tempfile::tempdir().unwrap();
    let of = |path: PathBuf| State::with_source(Source::Files(vec![path]), egui::ThemePreference::Dark);
    let mut window = Window::open(of(instrumented(home.path())));
    window.click("Identify its modes");
    look_at(&mut window, "modes_stabilization_dark");
    window.click("Responses");
    look_at(&mut window, "modes_responses_dark");
    window.click("Shapes");
    assert!(!window.shows("complex plane"), "shapes that an input drives are real");
    look_at(&mut window, "modes_shapes_dark");
    for (state, name) in [
        (start(Source::Files(vec![struck(home.path())])), "modes_complex"),
        (of(struck(home.path())), "modes_complex_dark"),
    ] {
        let mut window = Window::open(state);
        window.click("Identify its modes");
        window.0.get_by_role_and_label(Role::ComboBox, "Number of modes").click();
        window.settle();
        window.0.get_by_role_and_label(Role::Button, "3").click();
        window.settle();
        window.click("Shapes");
        assert!(window.shows("complex plane"), "the third mass comes late");
        look_at(&mut window, name);
    }
}

#[test]
fn the_number_of_modes_is_a_choice_and_the_report_tells_them() {
    let home = tempfile::tempdir().unwrap();
    let session = home.path().join("state/session.json");
    let mut window = Window::revived(&session, vec![instrumented(home.path())]);
    window.click("modes");
    let count = frequencies(&window).len();
    window.0.get_by_role_and_label(Role::ComboBox, "Number of modes").click();
    window.settle();
    window.0.get_by_role_and_label(Role::Button, "2").click();
    window.settle();
    assert_eq!((count, window.app().modes().unwrap().structure.modes.len()), (3, 2));
    window.press(CTRL, Key::Z);
    assert_eq!(frequencies(&window).len(), 3);

    window.click("What's missing");
    window.click("Find what's missing");
    assert!(window.shows("Nothing is missing: the linear model explains the data."));
    look_at(&mut window, "modes_missing");
    // The session has it after a restart: nothing is searched for again.
    drop(window);
    window = Window::revived(&session, Vec::new());
    assert!(window.shows("Nothing is missing: the linear model explains the data.") && window.shows("Look again"));
    assert!(window.shows("never fitted"), "the figure of the record never fitted");
    window.click("Report");
    assert!(window.shows("Page 1 of "));
    look_at(&mut window, "modes_report");
    window.click("Save HTML…");
    let page = home.path().join("frame.html");
    window.give_path(&page, "Save");
    let page = std::fs::read_to_string(page).unwrap();
    for text in ["Stabilization diagram", "damping ratio (%)", "Nothing is missing"] {
        assert!(page.contains(text), "{text}");
    }
}

#[test]
fn which_input_is_the_force_of_a_component_can_be_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damper.csv");
    // Two load cells in line, the second with a gain.
    let row = |k: u32| {
        let t = 0.005 * f64::from(k);
        let (x, v) = ((6.0 * t).sin(), 6.0 * (6.0 * t).cos());
        let force = 3.0 * x + 0.5 * v;
        format!("{t},{x},{force},{}\n", 2.0 * force)
    };
    let table: String = (0..2000).map(row).collect();
    std::fs::write(&path, format!("t [s],x [m],force1 [N],force2 [N]\n{table}")).unwrap();
    let mut window = Window::of_files(vec![path]);
    window.click("component without a mass");
    // Both look like forces: nothing is guessed.
    assert!(window.app().component().is_none() && window.shows("choose…"));
    for (name, other) in [("force1", "force2"), ("force2", "force1")] {
        window.click("Force of the component");
        window.click(name);
        let found = window.app().component().expect("a force");
        assert_eq!((found.specimen.force().0, found.specimen.inputs()), (name, &[other.to_owned()][..]));
    }
    look_at(&mut window, "component_force_chosen");
    window.press(CTRL, Key::Z);
    assert_eq!(window.app().component().expect("a force").specimen.force().0, "force1");
}

#[test]
fn a_component_gets_the_equation_of_its_force() {
    let home = tempfile::tempdir().unwrap();
    let options = sindyscope_rig::ComponentOptions {
        seed: 3,
        effect: Some("coulomb_friction".into()),
        ..sindyscope_rig::ComponentOptions::default()
    };
    let (records, comments) = sindyscope_rig::component_records(&options).unwrap();
    let path = home.path().join("damper.csv");
    write_csv(&records, &mut std::fs::File::create(&path).unwrap(), &comments).unwrap();
    let session = home.path().join("state/session.json");
    let mut window = Window::revived(&session, vec![path]);
    window.click("component without a mass");
    let found = window.app().component().expect("a force").clone();
    assert!(found.found.model.force.terms.iter().any(|t| t.term == Term::parse("sgn(v)").unwrap()));
    assert!(window.shows("F =") && window.shows("energy"), "the equation and the records");
    look_at(&mut window, "component_loops");
    window.click("Force");
    look_at(&mut window, "component_force");
    window.click("Energy");
    look_at(&mut window, "component_energy");

    window.click("What's missing");
    window.click("Find what's missing");
    let verdict = window.app().component_diagnosis().expect("a diagnosis").found.verdict();
    assert_eq!(verdict, "named");
    assert!(window.shows("Coulomb (dry) friction"));
    look_at(&mut window, "component_missing");

    drop(window);
    window = Window::revived(&session, Vec::new());
    assert!(window.app().component().is_some(), "the session knows what was measured");
    let again = window.app().component_diagnosis().expect("and that it was looked for what is missing");
    assert_eq!(again.found.verdict(), "named");
    window.click("Identify");
    window.click("component without a mass");
    assert!(window.app().component().is_none() && window.shows("dv/dt ="));
    window.press(CTRL, Key::Z);
    assert!(window.app().component().is_some());
}
