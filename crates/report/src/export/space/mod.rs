//! A structure's modes as a state space, to be taken along as a document, data or a program.
//!
//! `Ẋ = A X + B u + G f`, `y = C X + D u + H f + y₀` with the modal coordinates and their rates as states,
//! `X = (q₁ … qₘ, q₁′ … qₘ′)`; f is the force that the linear structure lacks, a function of the motion across its place.
//! C reads physical quantities off the modes: what each sensor shows, in its unit. D and H are the feed-through of
//! accelerometers, which show what a force does at once. A force with a memory has an inner state z, which is the last state:
//! `Ẋ = … + E g`, g its rate.

mod documents;
mod programs;
mod words;

use std::path::{Path, PathBuf};

use nalgebra::{Complex, DMatrix};

use super::{Export, ExportError, ExportFormat, StartState, input_file, stem};
use sindyscope_modes::{Effect, ForceParameter, FoundForce, Quantity, Sensor, Site, Structure};
use sindyscope_search::hysteresis_rate;
use sindyscope_values::model::{Equation, Model, Units};
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::{Expression, Symbol, Term, in_signs};

/// A linear structure in state space, with the force that it lacks.
#[derive(Clone, Debug)]
pub struct StateSpace<'a> {
    structure: &'a Structure,
    /// The same as equations of motion: what a simulation switches by.
    model: Model,
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
    force: Option<SpaceForce>,
    /// What each sensor shows beside the motion, on the record that the programs begin with.
    offsets: Vec<f64>,
}

/// A force beside the linear structure.
#[derive(Clone, Debug)]
struct SpaceForce {
    effect: Effect,
    site: Site,
    parameters: Vec<ForceParameter>,
    /// The force as a function of the states, in signs that a program may hold.
    expression: Expression,
    /// The rate of its inner state, where it has one.
    inner_rate: Option<Equation>,
    /// Weights of the states in the motion that it depends on.
    across: Vec<f64>,
    /// G: what it adds to the rates.
    on_rates: Vec<f64>,
    /// H: what it adds to the outputs.
    on_outputs: Vec<f64>,
}

impl<'a> StateSpace<'a> {
    /// The state space of a structure, with the force that was found beside it.
    pub fn new(structure: &'a Structure, found: Option<&FoundForce>) -> Self {
        let (m, inputs, sensors) = (structure.modes.len(), structure.inputs.len(), structure.sensors.len());
        let drive = |i: usize, j: usize| structure.participation.get(i).and_then(|p| p.get(j)).copied().unwrap_or(0.0);
        let states = 2 * m + usize::from(found.is_some_and(|f| f.effect.has_memory()));
        let mut a = DMatrix::zeros(states, states);
        let mut b = DMatrix::zeros(states, inputs);
        let mut c = DMatrix::zeros(sensors, states);
        let mut d = DMatrix::zeros(sensors, inputs);
        for i in 0..m {
            let [stiffness, damper] = rate_of(structure, i);
            a[(i, m + i)] = 1.0;
            (a[(m + i, i)], a[(m + i, m + i)]) = (stiffness, damper);
            for j in 0..inputs {
                b[(m + i, j)] = drive(i, j);
            }
            for (s, sensor) in structure.sensors.iter().enumerate() {
                let [of_displacement, of_velocity] = shown(structure, i, s, sensor.quantity);
                (c[(s, i)], c[(s, m + i)]) = (of_displacement, of_velocity);
                if sensor.quantity == Quantity::Acceleration {
                    for j in 0..inputs {
                        d[(s, j)] += entry(structure, i, s).re * drive(i, j);
                    }
                }
            }
        }
        let force = found.map(|found| SpaceForce::new(structure, found, states));
        let model = equations(m, &a, &b, force.as_ref());
        let start = first_start(structure);
        let offsets = start.map_or_else(|| vec![0.0; sensors], |(_, start)| start.offsets.clone());
        Self { structure, model, a, b, c, d, force, offsets }
    }

    /// The equations of the modal coordinates: `x1, x2, …` are `q₁, q₂, …`.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The inner state of the force and its rate, where it has one.
    fn inner_state(&self) -> Option<usize> {
        self.force.as_ref().filter(|f| f.inner_rate.is_some()).map(|_| self.a.nrows() - 1)
    }

    /// E: what the rate of the force's inner state adds to the rates; none where it has none.
    fn on_inner(&self) -> Option<Vec<f64>> {
        self.inner_state().map(|at| (0..self.a.nrows()).map(|i| f64::from(u8::from(i == at))).collect())
    }

    /// The names of the states: `q1, q2, …` and their rates `p1, p2, …`, then the force's inner state `z`.
    pub(super) fn state_names(&self) -> Vec<String> {
        let m = self.structure.modes.len();
        let named = |letter: &'static str| (1..=m).map(move |i| format!("{letter}{i}"));
        named("q").chain(named("p")).chain(self.inner_state().map(|_| "z1".to_owned())).collect()
    }

    /// The names under which a program writes what sensors show.
    pub(super) fn output_names(&self) -> Vec<String> {
        self.structure.sensors.iter().map(|s| s.name.replace(['"', '\\', ',', '\n', '\'', '%'], "_")).collect()
    }

    /// The state at the first sample of each fitted record.
    fn starts(&self) -> Vec<StartState> {
        let fitted = self.structure.records.iter().filter_map(|r| r.start.as_ref().map(|start| (r, start)));
        fitted
            .map(|(record, start)| StartState {
                record: record.name.clone(),
                state: (start.displacement.iter().chain(&start.velocity).copied())
                    .chain(self.inner_state().map(|_| start.memory))
                    .collect(),
                reach: self.reach(),
            })
            .collect()
    }

    /// The size of each state's motion, as far as it is known from the sensors' sizes: what an error is held against.
    fn reach(&self) -> Vec<f64> {
        let yields = self.force.iter().flat_map(|f| &f.parameters).find(|p| p.name == "x_b").map_or(1.0, |p| p.value);
        let of = |state: usize| {
            if self.inner_state() == Some(state) {
                return yields;
            }
            let seen = |(s, sensor): (usize, &Sensor)| self.c[(s, state)].abs() / sensor.scale;
            let most = self.structure.sensors.iter().enumerate().map(seen).fold(0.0, f64::max);
            let m = self.structure.modes.len();
            // A rate that no sensor sees is as large as its displacement's.
            let other = if state < m { state + m } else { state - m };
            let omega = self.a[(m + state % m, state % m)].abs().sqrt();
            let beside = self.structure.sensors.iter().enumerate();
            let beside = beside.map(|(s, sensor)| self.c[(s, other)].abs() / sensor.scale).fold(0.0, f64::max);
            let factor = if state < m { omega } else { omega.recip() };
            most.max(beside * factor).recip()
        };
        (0..self.a.nrows()).map(of).collect()
    }

    fn export(&self) -> Export<'_> {
        let mut export = Export::new(&self.model, Units::default()).starting(self.starts());
        export.inputs = self.structure.inputs.iter().map(|u| u.name.clone()).collect();
        export.space = Some(self);
        export
    }

    /// The text of a file; `stem` is the file's name without its ending.
    ///
    /// # Errors
    /// A force that switches where the form has no events for it; a number that is not finite.
    pub fn text(&self, format: ExportFormat, stem: &str) -> Result<String, ExportError> {
        self.export().text(format, stem)
    }

    /// Writes the model in the form that the file's ending asks for; beside a program also the first fitted record's time and
    /// inputs, `…_input.csv`. Hands back the files written.
    ///
    /// # Errors
    /// An ending that stands for no format, a force that the form cannot hold, a file that cannot be written.
    pub fn write(&self, records: &RecordSet, path: &Path) -> Result<Vec<PathBuf>, ExportError> {
        let format = ExportFormat::of(path)?;
        let stem = stem(path);
        let save = |path: &Path, text: String| {
            sindyscope_system::fs::write(path, text)
                .map_err(|source| ExportError::Write { path: path.display().to_string(), source })
        };
        save(path, self.text(format, &stem)?)?;
        let mut written = vec![path.to_owned()];
        let begun = first_start(self.structure).map(|(name, _)| name);
        let first = records.with(Usage::Fit).find(|r| begun.is_none_or(|name| r.name == name));
        let first = first.or_else(|| records.with(Usage::Fit).next());
        if let (true, Some(record)) = (format.runs(), first) {
            let input = path.with_file_name(input_file(&stem));
            save(&input, self.drive(record))?;
            written.push(input);
        }
        Ok(written)
    }

    /// Time and inputs of a record, as CSV that the exported programs read.
    pub fn drive(&self, record: &Record) -> String {
        let inputs = &self.structure.inputs;
        let columns: Vec<_> = inputs.iter().filter_map(|u| u.along(record)).collect();
        let names = (0..columns.len()).map(|j| if inputs.len() > 1 { format!("u{}", j + 1) } else { "u".to_owned() });
        let mut out = std::iter::once("t".to_owned()).chain(names).collect::<Vec<_>>().join(",");
        out.push('\n');
        for k in 0..record.len() {
            let row = std::iter::once(record.time(k)).chain(columns.iter().map(|c| c[k]));
            out.push_str(&row.map(|v| format!("{v:?}")).collect::<Vec<_>>().join(","));
            out.push('\n');
        }
        out
    }
}

impl SpaceForce {
    fn new(structure: &Structure, found: &FoundForce, states: usize) -> Self {
        let m = structure.modes.len();
        let of_velocity = found.effect.is_of_velocity();
        let moves = |place: usize, i: usize| structure.sensor_at(place).map_or(0.0, |s| entry(structure, i, s).re);
        let mut across = vec![0.0; states];
        for i in 0..m {
            let weight = match found.site {
                Site::Ground(place) => moves(place, i),
                Site::Between(first, second) => moves(first, i) - moves(second, i),
            };
            across[if of_velocity { m + i } else { i }] = weight;
        }
        let drive = |i: usize| found.drives.get(i).copied().unwrap_or(0.0);
        let mut on_rates = vec![0.0; states];
        (0..m).for_each(|i| on_rates[m + i] = drive(i));
        let on_output = |(s, sensor): (usize, &Sensor)| match sensor.quantity {
            Quantity::Acceleration => (0..m).map(|i| entry(structure, i, s).re * drive(i)).sum(),
            Quantity::Displacement | Quantity::Velocity => 0.0,
        };
        let sum = |of_velocity: bool| {
            let weights = (0..m).map(|i| (i, across[i] + across[m + i])).filter(|(_, weight)| *weight != 0.0);
            let symbol = |i: usize| if of_velocity { Symbol::Rate(i) } else { Symbol::State(i) };
            Expression::Sum(weights.map(|(i, weight)| Expression::from(symbol(i)) * weight).collect())
        };
        let motion = sum(of_velocity);
        let parameter = |name: &str| found.parameters.iter().find(|p| p.name == name).map_or(0.0, |p| p.value);
        let gap = parameter("gap");
        let inner = Expression::from(Symbol::Internal(0));
        let inner_rate = found.effect.has_memory().then(|| {
            Equation::known(hysteresis_rate(&sum(true), &inner, [parameter("x_b"), parameter("gamma/beta")], 1))
        });
        let term = Term::new(match found.effect {
            Effect::CubicStiffness => motion.power(3.0),
            Effect::QuadraticStiffness => motion.power(2.0),
            Effect::CoulombFriction => motion.sgn(),
            Effect::QuadraticDamping => motion.clone() * motion.abs(),
            Effect::Clearance => motion.dead_zone(gap),
            Effect::BoucWenHysteresis => inner,
        });
        Self {
            effect: found.effect,
            site: found.site,
            parameters: found.parameters.clone(),
            expression: in_signs(term.expression()),
            inner_rate,
            across,
            on_rates,
            on_outputs: structure.sensors.iter().enumerate().map(on_output).collect(),
        }
    }
}

/// What a mode's displacement and velocity contribute to its acceleration: `−ω²`, `−2ζω`.
fn rate_of(structure: &Structure, mode: usize) -> [f64; 2] {
    let omega = std::f64::consts::TAU * structure.modes[mode].frequency;
    [-omega * omega, -2.0 * structure.modes[mode].damping * omega]
}

/// The entry of a shape, complex where a mode swings with a phase of its own at each sensor.
fn entry(structure: &Structure, mode: usize, sensor: usize) -> Complex<f64> {
    let mode = &structure.modes[mode];
    Complex::from_polar(1.0, mode.phase.get(sensor).copied().unwrap_or(0.0)) * mode.shape[sensor]
}

/// What a sensor shows of a mode's displacement and velocity.
///
/// With φ the shape's entry, a free oscillation `Im(φ Z)/ω_d` is `Re φ · q + Im φ · (q′ + ζω q)/ω_d`; a sensor of velocity or
/// acceleration shows its derivatives.
fn shown(structure: &Structure, mode: usize, sensor: usize, quantity: Quantity) -> [f64; 2] {
    let [stiffness, damper] = rate_of(structure, mode);
    let further = |[x, v]: [f64; 2]| [v * stiffness, x + v * damper];
    let mut row = [1.0, 0.0];
    let times = match quantity {
        Quantity::Displacement => 0,
        Quantity::Velocity => 1,
        Quantity::Acceleration => 2,
    };
    for _ in 0..times {
        row = further(row);
    }
    let (phi, zeta) = (entry(structure, mode, sensor), structure.modes[mode].damping);
    let omega = (-stiffness).sqrt();
    let turned = phi.im / (omega * (1.0 - zeta * zeta).sqrt());
    let next = further(row);
    [0, 1].map(|k| phi.re * row[k] + turned * (next[k] + zeta * omega * row[k]) + 0.0)
}

fn equations(m: usize, a: &DMatrix<f64>, b: &DMatrix<f64>, force: Option<&SpaceForce>) -> Model {
    let own = |symbol: Symbol| Term::new(Expression::from(symbol));
    let of = |i: usize| {
        let mut terms = vec![(own(Symbol::State(i)), a[(m + i, i)]), (own(Symbol::Rate(i)), a[(m + i, m + i)])];
        terms.extend((0..b.ncols()).map(|j| (own(Symbol::Input(j)), b[(m + i, j)])));
        terms.extend(force.map(|f| (Term::new(f.expression.clone()), f.on_rates[m + i])));
        Equation::known(terms)
    };
    let model = Model::second_order(b.ncols(), (0..m).map(of).collect());
    match force.and_then(|f| f.inner_rate.clone()) {
        Some(inner) => model.with_internals(vec![inner]),
        None => model,
    }
}

/// The first fitted record's name and start.
fn first_start(structure: &Structure) -> Option<(&str, &sindyscope_modes::RecordStart)> {
    structure.records.iter().find_map(|r| r.start.as_ref().map(|start| (r.name.as_str(), start)))
}
