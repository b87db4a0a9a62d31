//! A stream in the window: a file that grows while it is watched.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use egui::{Key, Modifiers};
use sindyscope::app::{Sample, Source, State};
use sindyscope_rig::{
    Excitation, MeasuredChannel, MeasuredQuantity, Plant, RecordDrive, SampleTimes, Sensor, Sensors, Setup, Transition,
};
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::record::Role;
use sindyscope_values::term::Term;

use super::{CTRL, Window, look_at, start};

/// Rows of an oscillator at 1 Hz whose stiffness falls by a tenth after a minute.
fn rows() -> Vec<String> {
    let term = |text: &str| Term::parse(text).unwrap();
    let stiffness = (2.0 * std::f64::consts::PI).powi(2);
    let acceleration = Equation::known([
        (term("x"), -stiffness),
        (term("x*u2"), 0.1 * stiffness),
        (term("v"), -0.5),
        (term("u1"), 1.0),
    ]);
    let plant = Plant::smooth(Model::second_order(2, vec![acceleration]));
    let step = Excitation::transitions(vec![Transition { from: 60.0, duration: 0.5, distance: 1.0 }]);
    let sampling = SampleTimes { start: 0.0, interval: 0.01, count: 8000 };
    let drive = Excitation::multisine(8.0, (0.4, 1.6), 40, 7);
    let drive = RecordDrive::new("run", vec![drive, step], vec![0.0, 0.0], sampling);
    let channel = |name: &str, role, unit: &str, quantity, noise: f64| {
        MeasuredChannel::new(name, role, unit, quantity, Sensor::noisy(noise))
    };
    let x = channel("x", Role::Displacement(0), "m", MeasuredQuantity::State(0), 1e-3);
    let u = channel("u", Role::Input(0), "m/s^2", MeasuredQuantity::Input(0), 0.0);
    let setup = Setup { plant, drives: vec![drive], sensors: Sensors::new([x, u]), seed: 3 };
    let record = setup.run().unwrap().records.remove(0);
    let values = |role| record.channel(role).unwrap().values.clone();
    let (x, u) = (values(Role::Displacement(0)), values(Role::Input(0)));
    let row = |k: usize| format!("{:.2},{},{}\n", record.time(k), x[k], u[k]);
    std::iter::once("t [s],x [m],u [m/s^2]\n".to_owned()).chain((0..record.len()).map(row)).collect()
}

fn append(path: &Path, rows: &[String]) {
    let mut file = OpenOptions::new().create(true).append(true).open(path).unwrap();
    file.write_all(rows.concat().as_bytes()).unwrap();
}

impl Window {
    /// Draws until something is so.
    fn wait_for(&mut self, what: &str, so: impl Fn(&Self) -> bool) {
        let patience = Instant::now() + Duration::from_secs(120);
        while !so(self) {
            assert!(Instant::now() < patience, "{what}");
            std::thread::sleep(Duration::from_millis(10));
            self.0.step();
        }
        self.0.run_steps(3);
    }
}

#[test]
fn a_growing_file_is_identified_live_alarms_when_it_changes_and_its_end_is_kept() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("bench.csv");
    let rows = rows();
    let mut window = Window::open(start(Source::Sample(Sample::Duffing)));
    window.press(CTRL, Key::K);
    window.0.run_steps(2);
    window.type_into("Find a command", "open a stream");
    window.press(Modifiers::NONE, Key::Enter);
    assert!(window.app().state().stream.shown && window.shows("Say on the left where rows come from"));
    window.type_into("Stream's source", path.to_str().unwrap());
    window.type_into("Stream's terms", "x, v, u, x^3");
    window.click("Start");
    window.wait_for("it waits for the file", |w| w.shows("waiting for"));
    // A line that has not ended waits for the rest of it.
    append(&path, &rows[..1501]);
    let (half, rest) = rows[1501].split_at(7);
    append(&path, &[half.to_owned()]);
    window.wait_for("rows arrive", |w| w.shows("1500 rows"));
    append(&path, &[rest.to_owned()]);
    append(&path, &rows[1502..5900]);
    window.wait_for("it is identified", |w| w.app().streamed().0 > 30);
    assert!(window.shows("dv/dt =") && window.shows("The model explains what arrives"));
    assert!(window.shows("s identified · alarms: 0") && !window.shows("fitted in "), "the line at the bottom");
    assert_eq!(window.app().streamed().1, 0, "{:?}", window.app().streamed());
    window.click("Pause");
    append(&path, &rows[5900..6600]);
    std::thread::sleep(Duration::from_millis(400));
    window.0.run_steps(5);
    assert_eq!(window.app().streamed().1, 0, "what is paused stands still");
    window.click("Go on");
    window.wait_for("the softer spring is told", |w| w.app().streamed().2.is_some());
    let alarm = window.app().streamed().2.unwrap();
    assert!(alarm.contains("no longer explains") && window.shows("Alarm"), "{alarm}");
    window.wait_for("all of it came", |w| w.shows("6599 rows"));
    look_at(&mut window, "stream_light");
    window.press(CTRL, Key::L);
    look_at(&mut window, "stream_dark");

    window.click("Keep as record…");
    let kept = home.path().join("kept.csv");
    window.press(CTRL, Key::A);
    window.type_into("Path", kept.to_str().unwrap());
    window.click("Save");
    window.settle();
    assert!(!window.app().state().stream.shown);
    let records = window.app().records();
    let record = &records.entries[0].0;
    assert!((record.duration() - 20.0).abs() < 0.05, "{}", record.duration());
    assert!(window.app().outcome().is_some());
}

#[test]
fn a_source_that_cannot_be_followed_says_why() {
    let mut window = Window::open(State::with_source(Source::Nothing, egui::ThemePreference::Dark));
    window.click("no file ⏷");
    window.click("Open a stream…");
    window.type_into("Stream's source", "tcp://127.0.0.1:9");
    window.click("Start");
    window.settle();
    assert!(window.shows("is no source"), "the reason stands in the centre");
    window.click("Close");
    assert!(!window.app().state().stream.shown);
}
