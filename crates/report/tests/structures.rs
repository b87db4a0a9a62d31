//! Exported structures: the programs' states and sensors are those of the masses that the modes were made of.
//!
//! Two masses on springs with a force at one or between them are simulated in their own coordinates, and told to the export by
//! their modes. The interpreters are `cc`, `python3` with NumPy and SciPy, and `octave-cli`, or those that `SINDYSCOPE_CC`,
//! `SINDYSCOPE_PYTHON` and `SINDYSCOPE_OCTAVE` name; what is not there is skipped with a sentence.

use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use nalgebra::{Matrix2, SymmetricEigen};
use serde_json::Value;
use sindyscope_core::simulate::{InputGrid, Limits, Simulator};
use sindyscope_modes::{
    Effect, ForceParameter, FoundForce, Input, Quantity, RecordFit, RecordStart, Sensor, Site, Structure,
};
use sindyscope_report::export::{ExportError, ExportFormat, StateSpace};
use sindyscope_search::Lead;
use sindyscope_values::model::{Equation, Mode, Model};
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};
use sindyscope_values::term::Term;

/// The largest difference from the masses' own response, as a share of each series' largest magnitude.
const AGREE: f64 = 1e-6;
/// What holds the first mass to the ground (the second half as much), and what holds the two together, 1/s².
const STIFFNESS: [f64; 2] = [900.0, 400.0];
/// Damping in proportion to stiffness (s) and to mass (1/s): the modes are those of the undamped masses.
const DAMPING: [f64; 2] = [4e-4, 0.2];
const INITIAL: [f64; 4] = [0.002, -0.001, 0.05, 0.03];
const SAMPLES: usize = 1200;
const INTERVAL: f64 = 0.004;
/// What the displacement sensor shows beside the motion, m.
const OFFSET: f64 = 1e-3;
const GAP: f64 = 0.004;
/// Displacement at which the joint yields, m, with its γ/β, and its inner state at first, m.
const YIELDS: [f64; 2] = [0.003, 0.8];
const INNER: f64 = 0.0005;

/// The masses with a force of a kind, its size as an acceleration.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    effect: Option<Effect>,
    site: Site,
    size: f64,
    driven: bool,
}

const CASES: [Case; 8] = [
    Case { name: "linear", effect: None, site: Site::Ground(0), size: 0.0, driven: true },
    Case { name: "decay", effect: None, site: Site::Ground(0), size: 0.0, driven: false },
    Case { name: "cubic", effect: Some(Effect::CubicStiffness), site: Site::Ground(0), size: 2e6, driven: true },
    Case { name: "square", effect: Some(Effect::QuadraticStiffness), site: Site::Ground(1), size: 3e3, driven: true },
    Case { name: "friction", effect: Some(Effect::CoulombFriction), site: Site::Ground(0), size: 4.0, driven: true },
    Case { name: "gap", effect: Some(Effect::Clearance), site: Site::Between(0, 1), size: 2500.0, driven: true },
    Case { name: "drag", effect: Some(Effect::QuadraticDamping), site: Site::Between(0, 1), size: 2.0, driven: true },
    Case {
        name: "joint",
        effect: Some(Effect::BoucWenHysteresis),
        site: Site::Between(0, 1),
        size: 600.0,
        driven: true,
    },
];

/// What was simulated: series as the program is to write them, after time.
struct Simulated {
    times: Vec<f64>,
    inputs: Vec<f64>,
    series: Vec<Vec<f64>>,
}

/// A mode of the two masses: rad/s, the shape of unit length, and its larger entry.
#[derive(Clone, Copy)]
struct TrueMode {
    omega: f64,
    shape: [f64; 2],
    largest: f64,
}

impl TrueMode {
    /// The modal coordinate (largest entry of the shape one) of displacements, velocities or accelerations of the masses.
    fn coordinate(&self, of: [f64; 2]) -> f64 {
        (self.shape[0] * of[0] + self.shape[1] * of[1]) * self.largest
    }
}

fn modes() -> [TrueMode; 2] {
    let eigen = SymmetricEigen::new(stiffness());
    let order = if eigen.eigenvalues[0] < eigen.eigenvalues[1] { [0, 1] } else { [1, 0] };
    order.map(|k| {
        let v = eigen.eigenvectors.column(k);
        let largest = if v[0].abs() > v[1].abs() { v[0] } else { v[1] };
        TrueMode { omega: eigen.eigenvalues[k].sqrt(), shape: [v[0], v[1]], largest }
    })
}

fn stiffness() -> Matrix2<f64> {
    let [ground, between] = STIFFNESS;
    Matrix2::new(ground + between, -between, -between, 0.5 * ground + between)
}

fn damping() -> Matrix2<f64> {
    stiffness() * DAMPING[0] + Matrix2::identity() * DAMPING[1]
}

impl Case {
    /// The acceleration of either mass by a unit of the force's shape.
    fn pull(&self) -> [f64; 2] {
        match self.site {
            Site::Ground(0) => [-self.size, 0.0],
            Site::Ground(_) => [0.0, -self.size],
            Site::Between(..) => [-self.size, self.size],
        }
    }

    fn term(&self) -> Option<String> {
        Some(match self.effect? {
            Effect::CubicStiffness => "x1^3".into(),
            Effect::QuadraticStiffness => "x2^2".into(),
            Effect::CoulombFriction => "sgn(v1)".into(),
            Effect::Clearance => format!("dz(x1-x2,{GAP})"),
            Effect::QuadraticDamping => "(v1-v2)*|v1-v2|".into(),
            Effect::BoucWenHysteresis => "z1".into(),
        })
    }

    fn model(&self) -> Model {
        let (k, c) = (stiffness(), damping());
        let equation = |i: usize| {
            let mut terms: Vec<(String, f64)> = Vec::new();
            for j in 0..2 {
                terms.extend([(format!("x{}", j + 1), -k[(i, j)]), (format!("v{}", j + 1), -c[(i, j)])]);
            }
            if i == 0 && self.driven {
                terms.push(("u".into(), 1.0));
            }
            terms.extend(self.term().map(|t| (t, self.pull()[i])));
            let used = terms.iter().filter(|t| t.1 != 0.0);
            Equation::known(used.map(|(text, v)| (Term::parse(text).expect("a term"), *v)))
        };
        let model = Model::second_order(usize::from(self.driven), vec![equation(0), equation(1)]);
        if self.effect != Some(Effect::BoucWenHysteresis) {
            return model;
        }
        let [yields, ratio] = YIELDS;
        let terms = [("v1-v2", 1.0), ("|v1-v2|*z1", -1.0 / yields), ("(v1-v2)*|z1|", -ratio / yields)];
        let known = terms.map(|(text, v)| (Term::parse(text).expect("a term"), v));
        model.with_internals(vec![Equation::known(known)])
    }

    /// Accelerations of the masses at displacements and velocities; dry friction holds a place that stands.
    fn accelerations(&self, states: [f64; 4], inner: f64, input: f64) -> [f64; 2] {
        let [x1, x2, v1, v2] = states;
        let (k, c) = (stiffness(), damping());
        let (x, v) = (x1 - x2, v1 - v2);
        let force = match self.effect {
            None => 0.0,
            Some(Effect::CubicStiffness) => x1.powi(3),
            Some(Effect::QuadraticStiffness) => x2.powi(2),
            Some(Effect::CoulombFriction) => v1.signum(),
            Some(Effect::Clearance) => x - x.clamp(-GAP, GAP),
            Some(Effect::QuadraticDamping) => v * v.abs(),
            Some(Effect::BoucWenHysteresis) => inner,
        };
        let of = |i: usize| {
            let linear = -k[(i, 0)] * x1 - k[(i, 1)] * x2 - c[(i, 0)] * v1 - c[(i, 1)] * v2;
            linear + self.pull()[i] * force + if i == 0 && self.driven { input } else { 0.0 }
        };
        if self.effect == Some(Effect::CoulombFriction) && v1.abs() < 1e-9 { [0.0, of(1)] } else { [of(0), of(1)] }
    }

    fn simulated(&self) -> Simulated {
        let times: Vec<f64> = (0..SAMPLES).map(|n| 0.5 + INTERVAL * n as f64).collect();
        let inputs: Vec<f64> = times.iter().map(|t| 4.0 * (23.0 * t).sin() + 3.0 * (41.0 * t).cos()).collect();
        let driving: &[&[f64]] = &[&inputs];
        let grid = InputGrid::new(times[0], INTERVAL, SAMPLES, if self.driven { driving } else { &[] }, None);
        let model = self.model();
        let mut initial = INITIAL.to_vec();
        initial.extend((self.effect == Some(Effect::BoucWenHysteresis)).then_some(INNER));
        let simulator = Simulator::new(&model).expect("a model that can be simulated");
        let response = simulator.run(&grid, &initial, 0..SAMPLES, &Limits::default());
        assert_eq!(response.len(), SAMPLES, "{} lasts", self.name);
        let states = |n: usize| [0, 1, 2, 3].map(|i| response.states[i][n]);
        if self.effect == Some(Effect::CoulombFriction) {
            let stands = (0..SAMPLES).filter(|n| states(*n)[2].abs() < 1e-9).count();
            assert!(stands > 20, "the friction is to hold now and then, it does for {stands} samples");
        }
        let inner = |n: usize| response.states.get(4).map_or(0.0, |z| z[n]);
        let each = |of: &dyn Fn(usize) -> f64| (0..SAMPLES).map(of).collect::<Vec<f64>>();
        let [slow, fast] = modes();
        let series = vec![
            each(&|n| slow.coordinate([states(n)[0], states(n)[1]])),
            each(&|n| fast.coordinate([states(n)[0], states(n)[1]])),
            each(&|n| slow.coordinate([states(n)[2], states(n)[3]])),
            each(&|n| fast.coordinate([states(n)[2], states(n)[3]])),
            each(&|n| states(n)[0] + OFFSET),
            each(&|n| states(n)[3]),
            each(&|n| self.accelerations(states(n), inner(n), inputs[n])[0]),
            each(&|n| self.accelerations(states(n), inner(n), inputs[n])[1]),
        ];
        let mut series = series;
        if self.effect == Some(Effect::BoucWenHysteresis) {
            series.insert(4, each(&inner));
        }
        Simulated { times, inputs, series }
    }

    fn structure(&self) -> (Structure, Option<FoundForce>) {
        let modes = modes();
        let sensor = |name: &str, role: Role, quantity: Quantity, unit: &str| Sensor {
            name: name.into(),
            role,
            quantity,
            unit: unit.into(),
            scale: 1.0,
        };
        let told = |mode: &TrueMode| {
            let [first, second] = mode.shape.map(|s| s / mode.largest);
            Mode {
                frequency: mode.omega / TAU,
                frequency_error: None,
                damping: (DAMPING[0] * mode.omega.powi(2) + DAMPING[1]) / (2.0 * mode.omega),
                damping_error: None,
                shape: vec![first, second, first, second],
                shape_error: vec![None; 4],
                phase: vec![0.0; 4],
            }
        };
        let start = |from: usize| modes.iter().map(|m| m.coordinate([INITIAL[from], INITIAL[from + 1]])).collect();
        let record = RecordFit {
            name: "run".into(),
            usage: Usage::Fit,
            samples: SAMPLES,
            interval: INTERVAL,
            scores: Vec::new(),
            start: Some(RecordStart {
                displacement: start(0),
                velocity: start(2),
                memory: if self.effect == Some(Effect::BoucWenHysteresis) { INNER } else { 0.0 },
                offsets: vec![OFFSET, 0.0, 0.0, 0.0],
            }),
        };
        let participation = |m: &TrueMode| if self.driven { vec![m.coordinate([1.0, 0.0])] } else { Vec::new() };
        let input = Input { name: "push".into(), unit: "N".into(), scale: 1.0, rate_of: None };
        let structure = Structure {
            sensors: vec![
                sensor("x1", Role::Displacement(0), Quantity::Displacement, "m"),
                sensor("v2", Role::Velocity(1), Quantity::Velocity, "m/s"),
                sensor("a1", Role::Acceleration(0), Quantity::Acceleration, "m/s^2"),
                sensor("a2", Role::Acceleration(1), Quantity::Acceleration, "m/s^2"),
            ],
            inputs: if self.driven { vec![input] } else { Vec::new() },
            modes: modes.iter().map(told).collect(),
            in_band: vec![true; 2],
            participation: modes.iter().map(participation).collect(),
            noise_floor: None,
            records: vec![record],
        };
        let parameter =
            |name: &'static str, value| ForceParameter { name: name.into(), value, std_error: None, unit: "m".into() };
        let force = self.effect.map(|effect| FoundForce {
            effect,
            site: self.site,
            parameters: vec![
                parameter("k", self.size),
                parameter("gap", GAP),
                parameter("x_b", YIELDS[0]),
                parameter("gamma/beta", YIELDS[1]),
            ],
            drives: modes.iter().map(|m| m.coordinate(self.pull())).collect(),
            lead: Lead {
                blocks: 1,
                won: 1,
                difference: 1.0,
                std_error: 1.0,
                quantile: 1.0,
                against: "none".into(),
                ..Lead::default()
            },
            rivals: Vec::new(),
            tried: Vec::new(),
        });
        (structure, force)
    }

    /// Runs the program of a language and holds what it writes against the masses' response.
    fn agrees(&self, format: ExportFormat, run: impl Fn(&Path, &str) -> Command) {
        let (structure, force) = self.structure();
        let space = StateSpace::new(&structure, force.as_ref());
        let text = match space.text(format, self.name) {
            Err(ExportError::Switches(_)) if format == ExportFormat::Matlab => return,
            text => text.expect("a program"),
        };
        let Simulated { times, inputs, series } = self.simulated();
        let here = tempfile::tempdir().expect("a folder for the test");
        fs::write(here.path().join(format!("{}.{}", self.name, format.ending())), text).expect("written");
        let row = |(t, u): (&f64, &f64)| if self.driven { format!("{t},{u}\n") } else { format!("{t}\n") };
        let head = if self.driven { "t,push [N]\n" } else { "t\n" };
        let rows: String = times.iter().zip(&inputs).map(row).collect();
        fs::write(here.path().join("input.csv"), format!("{head}{rows}")).expect("written");
        let output = run(here.path(), self.name).current_dir(here.path()).output().expect("the program starts");
        let said = [&output.stdout, &output.stderr].map(|s| String::from_utf8_lossy(s).into_owned()).concat();
        assert!(output.status.success(), "{} in {}: {said}", self.name, format.name());
        let text = fs::read_to_string(here.path().join("response.csv")).expect("a response");
        let inner = if self.effect == Some(Effect::BoucWenHysteresis) { "z1," } else { "" };
        assert_eq!(text.lines().next(), Some(format!("t,q1,q2,p1,p2,{inner}x1,v2,a1,a2").as_str()));
        let cells = |l: &str| l.split(',').map(|c| c.parse().expect("a number")).collect();
        let rows: Vec<Vec<f64>> = text.lines().skip(1).map(cells).collect();
        assert_eq!(rows.len(), times.len(), "{}: one row a sample", self.name);
        let mut worst: f64 = 0.0;
        for (i, expected) in series.iter().enumerate() {
            let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for (n, (row, x)) in rows.iter().zip(expected).enumerate() {
                let share = (row[1 + i] - x).abs() / largest;
                assert!(share <= AGREE, "{} in {}: column {i}, sample {n}: {share:e}", self.name, format.name());
                worst = worst.max(share);
            }
        }
        println!("{} in {}: {worst:.1e}", self.name, format.name());
    }
}

fn each_agrees(format: ExportFormat, run: impl Fn(&Path, &str) -> Command) {
    CASES.iter().for_each(|case| case.agrees(format, &run));
}

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
    each_agrees(ExportFormat::C, |here, name| {
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
    });
}

#[test]
fn python_programs_agree() {
    let check = ["-c", "import numpy, scipy"];
    let Some(python) = tool("SINDYSCOPE_PYTHON", "python3", &check, "Python with NumPy and SciPy") else { return };
    each_agrees(ExportFormat::Python, |_, name| {
        let mut command = Command::new(&python);
        command.arg(format!("{name}.py")).args(["input.csv", "response.csv"]);
        command
    });
}

#[test]
fn matlab_functions_agree_in_octave() {
    let Some(octave) = tool("SINDYSCOPE_OCTAVE", "octave-cli", &["--version"], "GNU Octave") else { return };
    each_agrees(ExportFormat::Matlab, |_, name| {
        let mut command = Command::new(&octave);
        command.args(["--quiet", "--no-init-file", "--eval"]).arg(format!("{name}('input.csv', 'response.csv');"));
        command
    });
}

#[test]
fn documents_hold_the_matrices_and_the_force() {
    let (structure, force) = CASES[2].structure();
    let space = StateSpace::new(&structure, force.as_ref());
    let text = |format| space.text(format, "model").expect("a document");
    let json: Value = serde_json::from_str(&text(ExportFormat::Json)).expect("JSON");
    let number = |path: &str| json.pointer(path).and_then(Value::as_f64).expect("a number");
    let slowest = modes()[0].omega;
    assert!((number("/A/2/0") + slowest * slowest).abs() < 1e-9);
    assert!((number("/D/2/0") - 1.0).abs() < 1e-12, "a force moves its own mass of one kilogram at once");
    assert!(number("/D/3/0").abs() < 1e-12, "and no other one");
    assert!((number("/force/H/2") + CASES[2].size).abs() < 1e-6);
    assert_eq!(json["force"]["effect"], "cubic_stiffness");
    assert_eq!(json["outputs"][2]["unit"], "m/s^2");
    let plain = text(ExportFormat::Text);
    for part in ["dX/dt = A X + B U + G f", "push in N", "acceleration a1 in m/s^2", "cubic stiffness at ground-1"] {
        assert!(plain.contains(part), "{part}:\n{plain}");
    }
    let latex = text(ExportFormat::Latex);
    assert_eq!(latex.matches("\\begin{").count(), latex.matches("\\end{").count());
    assert!(latex.contains("\\begin{bmatrix}") && latex.contains("G f"), "{latex}");
    let modelica = text(ExportFormat::Modelica);
    for part in ["der(X) = A*X + B*{u} + G*force;", "Y = C*X + D*{u} + H*force + offset;", "end Motion;"] {
        assert!(modelica.contains(part), "{part}:\n{modelica}");
    }
    assert!(matches!(
        StateSpace::new(&structure, CASES[4].structure().1.as_ref()).text(ExportFormat::Matlab, "model"),
        Err(ExportError::Switches(_))
    ));
}

#[test]
fn the_first_record_s_input_lies_beside_a_program() {
    let (structure, _) = CASES[0].structure();
    let Simulated { inputs, .. } = CASES[0].simulated();
    let role = Role::Input(0);
    let channel =
        Channel { name: "push".into(), unit: "N".into(), role, values: inputs.clone().into(), estimated: false };
    let mut records = RecordSet::default();
    let (name, channels) = ("run".into(), vec![channel]);
    let record = Record { name, source: None, start: 0.5, interval: INTERVAL, channels, notices: Vec::new() };
    records.add([record], Usage::Fit);
    let here = tempfile::tempdir().expect("a folder for the test");
    let space = StateSpace::new(&structure, None);
    let written = space.write(&records, &here.path().join("tower.py")).expect("written");
    assert_eq!(written.len(), 2, "{written:?}");
    let text = fs::read_to_string(here.path().join("tower_input.csv")).expect("inputs");
    assert_eq!(text.lines().nth(1), Some(format!("0.5,{:?}", inputs[0]).as_str()));
}
