//! Exported models: the programs are run, and their responses are those of the simulator.
//!
//! The interpreters are `cc`, `python3` with NumPy and SciPy, and `octave-cli`, or those that the environment variables
//! `SINDYSCOPE_CC`, `SINDYSCOPE_PYTHON` and `SINDYSCOPE_OCTAVE` name; what is not there is skipped with a sentence.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use sindyscope_core::simulate::{InputGrid, Limits, Simulator};
use sindyscope_core::study::{Cancel, Lock, Outcome, Study, suggest};
use sindyscope_files::{ReadOptions, read_set};
use sindyscope_report::export::{Export, ExportError, ExportFormat, StartState, drive, write};
use sindyscope_values::model::{Equation, Model, Units};
use sindyscope_values::term::{Kind, Layout, Term, list};
use tempfile::TempDir;

/// The largest difference from the simulator's response, as a share of each state's largest magnitude.
const AGREE: f64 = 1e-6;

/// A response, one series a state, and what it is a response to.
struct Case {
    name: &'static str,
    programs: Vec<(ExportFormat, String)>,
    input: String,
    times: Vec<f64>,
    states: Vec<Vec<f64>>,
    /// Samples whose states are compared.
    compared: usize,
}

const PROGRAMS: [ExportFormat; 3] = [ExportFormat::C, ExportFormat::Python, ExportFormat::Matlab];

/// The programs that a model has: all, but where it switches those that have no events.
fn programs(export: &Export<'_>, name: &str) -> Vec<(ExportFormat, String)> {
    let written = PROGRAMS.into_iter().filter_map(|f| match export.text(f, name) {
        Err(ExportError::Switches(_)) => None,
        text => Some((f, text.expect("a program"))),
    });
    written.collect()
}

impl Case {
    /// The first record's response as a study found it.
    fn studied(name: &'static str, outcome: &Outcome) -> Self {
        let record = &outcome.records[0];
        assert!(record.diverged_at.is_none(), "{name} lasts");
        let export = Export::of(outcome);
        Self {
            name,
            programs: programs(&export, name),
            input: drive(record),
            times: (0..record.record.len()).map(|k| record.record.time(k)).collect(),
            states: record.states.clone(),
            compared: record.record.len(),
        }
    }

    /// The response of a model from a state; `inputs` are sampled from functions of time.
    fn known(
        name: &'static str,
        model: &Model,
        initial: &[f64],
        (samples, interval): (usize, f64),
        inputs: &[fn(f64) -> f64],
        least_switches: usize,
    ) -> Self {
        let start = 0.5;
        let times: Vec<f64> = (0..samples).map(|k| start + interval * k as f64).collect();
        let series: Vec<Vec<f64>> = inputs.iter().map(|f| times.iter().map(|t| f(*t)).collect()).collect();
        let slices: Vec<&[f64]> = series.iter().map(|s| &s[..]).collect();
        let grid = InputGrid::new(start, interval, samples, &slices, None);
        let simulator = Simulator::new(model).expect("a model that can be simulated");
        let response = simulator.run(&grid, initial, 0..samples, &Limits::default());
        assert!(response.switches >= least_switches, "{name} switches {} times", response.switches);
        assert_eq!(response.len(), samples, "{name} lasts");
        let reach = response.states.iter().map(|s| s.iter().fold(0.0_f64, |m, x| m.max(x.abs()))).collect();
        let begun = StartState { record: "simulated".into(), state: initial.to_vec(), reach };
        let export = Export::new(model, Units::default()).starting(vec![begun]);
        let mut input = "# made by a test\ntime [s]".to_owned();
        for j in 0..inputs.len() {
            input.push_str(&format!(", u{} (N)", j + 1));
        }
        input.push('\n');
        for (k, t) in times.iter().enumerate() {
            let row: Vec<String> = std::iter::once(t).chain(series.iter().map(|s| &s[k])).map(f64::to_string).collect();
            input.push_str(&(row.join(", ") + "\n"));
        }
        let programs = programs(&export, name);
        Self { name, programs, input, times, states: response.states, compared: samples }
    }

    /// Runs the program of a language and holds its response against the simulator's.
    fn agrees(&self, format: ExportFormat, run: impl Fn(&Path, &str) -> Command) {
        let here = tempfile::tempdir().expect("a folder for the test");
        let (_, program) = self.programs.iter().find(|(f, _)| *f == format).expect("its program");
        fs::write(here.path().join(format!("{}.{}", self.name, format.ending())), program).expect("written");
        fs::write(here.path().join("input.csv"), &self.input).expect("written");
        let output = run(here.path(), self.name).current_dir(here.path()).output().expect("the program starts");
        assert!(
            output.status.success(),
            "{} in {}: {}{}",
            self.name,
            format.name(),
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        );
        let text = fs::read_to_string(here.path().join("response.csv")).expect("a response");
        let rows: Vec<Vec<f64>> =
            text.lines().skip(1).map(|l| l.split(',').map(|c| c.parse().expect("a number")).collect()).collect();
        assert_eq!(rows.len(), self.times.len(), "{}: one row a sample", self.name);
        let mut worst: f64 = 0.0;
        for (i, expected) in self.states.iter().enumerate() {
            let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            assert!(largest > 0.0, "{} moves", self.name);
            for (k, (row, x)) in rows.iter().zip(expected).enumerate().take(self.compared) {
                assert!((row[0] - self.times[k]).abs() < 1e-9, "{} at sample {k}", self.name);
                let share = (row[1 + i] - x).abs() / largest;
                assert!(share <= AGREE, "{} in {}: state {i} at sample {k} is {share:e} off", self.name, format.name());
                worst = worst.max(share);
            }
        }
        println!("{} in {}: {worst:.1e}", self.name, format.name());
    }
}

fn equation(terms: &[(&str, f64)]) -> Equation {
    Equation::known(terms.iter().map(|(text, c)| (Term::parse(text).expect("a term"), *c)))
}

/// A sample, identified with a library; `fixed` gives coefficients that are not left to the data.
fn identified(file: &str, kind: Kind, terms: &str, fixed: &[(&str, f64)]) -> Outcome {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_data").join(file);
    study(&path, kind, terms, fixed)
}

fn study(path: &Path, kind: Kind, terms: &str, fixed: &[(&str, f64)]) -> Outcome {
    let options = ReadOptions { kind, ..ReadOptions::default() };
    let records = read_set(&[path.to_owned()], &[], &options).expect("a sample");
    let mut settings = suggest(&records, kind).expect("settings");
    settings.terms = list(terms).expect("terms");
    for (term, value) in fixed {
        settings.locks.insert(Term::parse(term).expect("a term"), Lock::Fixed(*value));
    }
    Study::default().run(&records, &settings, &Cancel::default()).expect("an outcome")
}

fn duffing() -> Case {
    Case::studied("duffing", &identified("duffing.csv", Kind::SecondOrder, "x, v, u, x^3, 1", &[]))
}

fn friction() -> Case {
    let terms = "x-u, v-du, sgn(v), sgn(x), sgn(u), sgn(du)";
    let outcome = identified("friction.csv", Kind::SecondOrder, terms, &[("sgn(x)", 1e-3), ("sgn(u)", 1e-3)]);
    assert!(outcome.records[0].driven_as_measured);
    Case::studied("friction", &outcome)
}

/// Noise on the input: its smoothed curve and that curve's own derivative drive the simulation.
fn noisy_input() -> Case {
    let outcome = identified("friction_steady.csv", Kind::SecondOrder, "x-u, v-du, sgn(v)", &[]);
    assert!(!outcome.records[0].driven_as_measured, "the case is about a smoothed input");
    Case::studied("noisy_input", &outcome)
}

fn stick_slip() -> Case {
    let fixed = [("x", -358.706), ("v", -0.0658), ("u", 358.706), ("du", 0.0658), ("sgn(v)", -0.4)];
    let outcome = identified("stick_slip.csv", Kind::SecondOrder, "x, v, u, du, sgn(v)", &fixed);
    let still = outcome.records[0].states[1].iter().filter(|v| v.abs() < 1e-9).count();
    assert!(still > 100, "the mass sticks for {still} samples");
    Case::studied("stick_slip", &outcome)
}

/// Chaos: an error grows by e in about 1.1 s, so only the first four are compared.
fn lorenz() -> Case {
    let terms = "x1, x2, x3, x1*x2, x1*x3";
    let mut case = Case::studied("lorenz", &identified("lorenz.csv", Kind::FirstOrder, terms, &[]));
    case.compared = case.times.iter().filter(|t| **t < case.times[0] + 4.0).count();
    assert!(case.compared > 100, "{} samples are compared", case.compared);
    case
}

/// Two masses that rub on the ground and on each other, the second between stops; it holds more than it pulls.
fn rubbing() -> Model {
    let first =
        [("x1-u", -900.0), ("v1", -0.8), ("x1-x2", -300.0), ("sgn(v1)", -0.9), ("sgn(v1-v2)", -0.7), ("x1^3", -2e5)];
    let second =
        [("x1-x2", 200.0), ("v2", -0.3), ("sgn(v1-v2)", 0.45), ("dz(x2,0.004)", -6000.0), ("max(x2-0.006,0)", -2e4)];
    let mut model = Model::second_order(1, vec![equation(&first), equation(&second)]);
    model.static_ratio = 1.25;
    model
}

fn two_masses() -> Case {
    let base = |t: f64| 0.004 * (11.0 * t).sin() + 0.002 * (23.0 * t).cos();
    Case::known("two_masses", &rubbing(), &[0.003, -0.002, 0.0, 0.0], (1500, 0.004), &[base], 40)
}

/// Two masses as they are identified from both displacements.
fn two_masses_identified() -> Case {
    let first = [("x1", -900.0), ("v1", -1.2), ("x1-x2", -300.0), ("x1^3", -2e6), ("u", 1.0)];
    let second = [("x1-x2", 200.0), ("v2", -0.6)];
    let model = Model::second_order(1, vec![equation(&first), equation(&second)]);
    let force = |t: f64| 3.0 * (9.0 * t).sin() + 2.0 * (21.0 * t).cos();
    let made = Case::known("made", &model, &[0.003, -0.002, 0.0, 0.0], (2500, 0.004), &[force], 0);
    let mut text = "t [s],x1 [m],x2 [m],u [N]\n".to_owned();
    for (k, t) in made.times.iter().enumerate() {
        text.push_str(&format!("{t},{:?},{:?},{:?}\n", made.states[0][k], made.states[1][k], force(*t)));
    }
    let here = tempfile::tempdir().expect("a folder for the test");
    let path = here.path().join("masses.csv");
    fs::write(&path, text).expect("written");
    let outcome = study(&path, Kind::SecondOrder, "x1, x2, v1, v2, u, x1^3", &[]);
    assert_eq!(outcome.model.layout.freedoms, 2);
    Case::studied("two_masses_identified", &outcome)
}

/// Two linked bodies whose accelerations stand in each other's equations, with friction in the second joint.
fn linked() -> Case {
    let first = [("cos(x2-x1)*a2", -0.4), ("sin(x2-x1)*v2^2", 0.4), ("sin(x1)", -30.0), ("v1", -0.3), ("u", 2.0)];
    let second = [("cos(x2-x1)*a1", -0.9), ("sin(x2-x1)*v1^2", -0.9), ("sin(x2)", -25.0), ("sgn(v2-v1)", -1.5)];
    let model = Model::second_order(1, vec![equation(&first), equation(&second)]);
    let torque = |t: f64| 5.0 * (4.0 * t).sin();
    Case::known("linked", &model, &[0.4, -0.3, 0.0, 0.0], (1200, 0.004), &[torque], 5)
}

/// What else a term can be: hysteresis with an internal state, Stribeck friction on a moving base, broken powers,
/// saturation, a sine, signs of inputs, time itself, two inputs.
fn everything() -> Case {
    let layout = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: 2, internals: 1 };
    let acceleration = [
        ("sin(x)", -60.0),
        ("v", -0.4),
        ("exp(-|v-du2|/0.2)*sgn(v-du2)", -0.5),
        ("|x|*sgn(v)", -3.0),
        ("(x^2+0.01)^0.75", -4.0),
        ("clip(u,0.6)", 5.0),
        ("sgn(u)*x^2", -4.0),
        ("step(t-3)", 0.8),
        ("-x*|x|/(1+x^2)", 2.0),
        ("atan(v)*u2", 0.5),
        ("z", -8.0),
    ];
    let hysteresis = [("v", 1.0), ("|v|*z", -4.0), ("v*|z|", -3.0)];
    let model = Model::second_order(2, vec![equation(&acceleration)]).with_internals(vec![equation(&hysteresis)]);
    assert_eq!(model.layout, layout);
    let force = |t: f64| (3.0 * t).sin();
    let base = |t: f64| 0.1 * (5.0 * t).cos();
    Case::known("everything", &model, &[0.2, 0.0, 0.0], (1600, 0.005), &[force, base], 25)
}

fn each_agrees(format: ExportFormat, run: impl Fn(&Path, &str) -> Command, cases: &[fn() -> Case]) {
    for case in cases {
        case().agrees(format, &run);
    }
}

const CASES: [fn() -> Case; 9] =
    [duffing, friction, noisy_input, stick_slip, lorenz, two_masses, two_masses_identified, linked, everything];

/// A tool, if it does what is asked of it.
fn tool(variable: &str, otherwise: &str, arguments: &[&str], what: &str) -> Option<PathBuf> {
    let path = std::env::var_os(variable).map_or_else(|| otherwise.into(), PathBuf::from);
    let works = Command::new(&path).args(arguments).output().is_ok_and(|o| o.status.success());
    if !works {
        println!("skipped: {what} is not here ({variable} may name it)");
    }
    works.then_some(path)
}

#[test]
fn c_programs_agree() {
    let Some(cc) = tool("SINDYSCOPE_CC", "cc", &["--version"], "a C compiler") else { return };
    let run = |here: &Path, name: &str| {
        let built = Command::new(&cc)
            .args(["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-o", "program"])
            .arg(format!("{name}.c"))
            .arg("-lm")
            .current_dir(here)
            .output()
            .expect("the compiler starts");
        assert!(built.status.success(), "{name}: {}", String::from_utf8_lossy(&built.stderr));
        let mut command = Command::new(here.join("program"));
        command.args(["input.csv", "response.csv"]);
        command
    };
    each_agrees(ExportFormat::C, run, &CASES);
}

#[test]
fn python_programs_agree() {
    let check = ["-c", "import numpy, scipy"];
    let Some(python) = tool("SINDYSCOPE_PYTHON", "python3", &check, "Python with NumPy and SciPy") else { return };
    let run = |_: &Path, name: &str| {
        let mut command = Command::new(&python);
        command.arg(format!("{name}.py")).args(["input.csv", "response.csv"]);
        command
    };
    each_agrees(ExportFormat::Python, run, &CASES);
}

#[test]
fn matlab_functions_agree_in_octave() {
    let Some(octave) = tool("SINDYSCOPE_OCTAVE", "octave-cli", &["--version"], "GNU Octave") else { return };
    let run = |_: &Path, name: &str| {
        let mut command = Command::new(&octave);
        command.args(["--quiet", "--no-init-file", "--eval"]).arg(format!("{name}('input.csv', 'response.csv');"));
        command
    };
    // Octave takes a minute for what C does in a hundredth of a second.
    each_agrees(ExportFormat::Matlab, run, &[duffing]);
}

/// Forms that hold a model only where nothing switches in it.
const SMOOTH: [ExportFormat; 2] = [ExportFormat::Matlab, ExportFormat::Modelica];

fn files(here: &TempDir, outcome: &Outcome, formats: &[ExportFormat]) -> Vec<PathBuf> {
    formats
        .iter()
        .flat_map(|f| write(outcome, &here.path().join(format!("my model.{}", f.ending()))).expect("written"))
        .collect()
}

#[test]
fn every_file_says_what_it_is() {
    let outcome = identified("friction.csv", Kind::SecondOrder, "x-u, v-du, sgn(v)", &[("sgn(v)", -0.08)]);
    let smooth = identified("duffing.csv", Kind::SecondOrder, "x, v, u, x^3", &[]);
    let here = tempfile::tempdir().expect("a folder for the test");
    let others: Vec<ExportFormat> = ExportFormat::ALL.into_iter().filter(|f| !SMOOTH.contains(f)).collect();
    let written = files(&here, &outcome, &others);
    assert_eq!(written.len(), others.len() + 2, "two programs have their inputs beside them: {written:?}");
    let written = files(&here, &smooth, &SMOOTH);
    assert_eq!(written.len(), SMOOTH.len() + 2, "so have these: {written:?}");
    let read = |ending: &str| fs::read_to_string(here.path().join(format!("my model.{ending}"))).expect("a file");
    for (ending, sign, run, parts) in [
        ("py", "#", "python3 my model.py", ["sgn(v)", "Sticking"]),
        ("c", "//", "cc -O2", ["sgn(v)", "Sticking"]),
        ("m", "%", "my_model('my model_input.csv'", ["x^3", "u"]),
        ("mo", "//", "my_model.Experiment", ["x^3", "u"]),
    ] {
        let head: Vec<String> = read(ending).lines().take_while(|l| l.starts_with(sign)).map(str::to_owned).collect();
        let head = head.join("\n");
        for part in ["Sindyscope", "dv/dt =", "Units:", "x in m", "v in m/s", run].into_iter().chain(parts) {
            assert!(head.contains(part), "{ending} says {part:?}:\n{head}");
        }
    }
    for (outcome, endings) in [(&outcome, ["py", "c", "txt"].as_slice()), (&smooth, &["m", "mo"])] {
        for (t, ending) in outcome.model.equations[1].terms.iter().flat_map(|t| endings.iter().map(move |e| (t, e))) {
            assert!(read(ending).contains(&format!("{:?}", t.coefficient.abs())), "{ending} has {}", t.coefficient);
        }
    }
    for format in SMOOTH {
        let refused = Export::of(&outcome).text(format, "model").expect_err("a model that switches");
        assert!(refused.to_string().contains(".py and .c"), "{refused}");
    }
    let json: Value = serde_json::from_str(&read("json")).expect("JSON");
    let terms = json["equations"][1]["terms"].as_array().expect("terms");
    for (told, t) in terms.iter().zip(&outcome.model.equations[1].terms) {
        assert_eq!(told["coefficient"].as_f64(), Some(t.coefficient));
        assert_eq!(Term::parse(told["term"].as_str().expect("a text")).expect("a term"), t.term);
    }
    assert_eq!(json["initial_states"][0]["state"][0].as_f64(), Some(outcome.records[0].states[0][0]));
}

#[test]
fn the_latex_is_whole() {
    let mut outcome = identified(
        "friction.csv",
        Kind::SecondOrder,
        "x-u, v-du, sgn(v), v*|v|",
        &[("sgn(v)", -0.08), ("v*|v|", -0.01)],
    );
    let mut record = (*outcome.records[0].record).clone();
    record.name = "run_1 at 50% {#2}".into();
    outcome.records[0].record = std::sync::Arc::new(record);
    let text = Export::of(&outcome).text(ExportFormat::Latex, "model").expect("a document");
    assert!(text.contains("run\\_1 at 50\\% \\{\\#2\\}"), "{text}");
    for part in ["\\ddot{x} &=", "\\operatorname{sgn}\\left(\\dot{x}\\right)", "\\dot{x} \\, \\left|\\dot{x}\\right|"] {
        assert!(text.contains(part), "{part}:\n{text}");
    }
    let mut depth = 0_i32;
    let mut environments = Vec::new();
    let body = text.lines().filter(|l| !l.starts_with('%')).collect::<Vec<_>>().join("\n");
    for (at, c) in body.char_indices() {
        let escaped = body[..at].chars().rev().take_while(|c| *c == '\\').count() % 2 == 1;
        match c {
            '{' if !escaped => depth += 1,
            '}' if !escaped => depth -= 1,
            _ => {}
        }
        assert!(depth >= 0, "a brace closes what none opened: {}", &body[..at]);
        let name = |rest: &str| rest.split('}').next().map(str::to_owned);
        if let Some(rest) = body[at..].strip_prefix("\\begin{") {
            environments.push(name(rest));
        } else if let Some(rest) = body[at..].strip_prefix("\\end{") {
            assert_eq!(environments.pop(), Some(name(rest)));
        }
    }
    assert_eq!((depth, environments.len()), (0, 0));
    assert_eq!(body.matches('$').count() % 2, 0);
    assert_eq!(body.matches("\\left").count(), body.matches("\\right").count());
}

#[test]
fn an_ending_without_a_format_is_refused_before_the_work() {
    let here = tempfile::tempdir().expect("a folder for the test");
    let said = Command::new(env!("CARGO_BIN_EXE_sindyscope"))
        .args(["identify", "no-such-file.csv", "--export", "model.xyz"])
        .current_dir(here.path())
        .output()
        .expect("the program starts");
    assert_eq!(said.status.code(), Some(1));
    let said = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(said.contains("model.xyz") && said.contains(".mo") && !said.contains("no-such-file"), "{said}");
}

#[test]
fn the_command_writes_what_it_is_asked_for() {
    let here = tempfile::tempdir().expect("a folder for the test");
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_data/duffing.csv");
    let output = Command::new(env!("CARGO_BIN_EXE_sindyscope"))
        .arg("identify")
        .arg(sample)
        .args(["--terms", "x, v, u, x^3", "--window", "31", "--order", "5", "--threshold", "0.01"])
        .args(["--export", "a.c", "--export", "b.tex"])
        .current_dir(here.path())
        .output()
        .expect("the program starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for file in ["a.c", "a_input.csv", "b.tex"] {
        assert!(here.path().join(file).is_file(), "{file}");
    }
    assert!(!here.path().join("b_input.csv").exists(), "a document needs no inputs");
}

#[test]
fn a_form_that_cannot_hold_the_model_takes_nothing_from_the_others() {
    let here = tempfile::tempdir().expect("a folder for the test");
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_data/duffing.csv");
    let output = Command::new(env!("CARGO_BIN_EXE_sindyscope"))
        .arg("identify")
        .arg(sample)
        .args([
            "--terms",
            "x, v, u, x^3",
            "--fix",
            "sgn(v)=-0.01",
            "--window",
            "31",
            "--order",
            "5",
            "--threshold",
            "0.01",
        ])
        .args(["--export", "a.m", "--export", "b.c", "--json", "result.json"])
        .current_dir(here.path())
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("MATLAB") && said.contains(".py"), "{said}");
    for (file, there) in [("a.m", false), ("b.c", true), ("result.json", true)] {
        assert_eq!(here.path().join(file).is_file(), there, "{file}");
    }
}

#[test]
fn a_structure_is_exported_by_its_modes() {
    let here = tempfile::tempdir().expect("a folder for the test");
    let run = |words: &[&str]| {
        let program = Path::new(env!("CARGO_BIN_EXE_sindyscope"));
        Command::new(program).args(words).current_dir(here.path()).output().expect("the program starts")
    };
    let made = run(&["generate", "chain", "--set", "n=3", "--duration", "10", "--out", "frame.csv"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let words = ["identify", "frame.csv", "--base", "modes", "--export", "frame.c", "--export", "frame.json"];
    let output = run(&words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: Value =
        serde_json::from_str(&fs::read_to_string(here.path().join("frame.json")).expect("a file")).expect("JSON");
    assert_eq!((json["kind"].as_str(), json["A"].as_array().map(Vec::len)), (Some("state-space"), Some(6)));
    let input = fs::read_to_string(here.path().join("frame_input.csv")).expect("its inputs lie beside the program");
    assert!(input.starts_with("t,u\n0"), "{}", &input[..20]);
    let refused = run(&["diagnose", "frame.csv", "--export", "frame.py"]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--base modes"), "equations are exported by identify");
}
