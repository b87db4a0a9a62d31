use std::ops::Range;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::known::{Known, Pair};
use super::opposite::pairs;
use super::score::{ErrorSums, Score};
use super::{Covariance, Refinement, Settings};
use crate::remedy::Remedy;
use crate::signal::{Signals, central};
use sindyscope_values::model::{Mass, Mode, Model, Physical, Units, modes, physical};
use sindyscope_values::record::{Record, Role, Usage, metres};
use sindyscope_values::term::{Kind, Layout, Symbol, Term};

/// The simulated response of one degree of freedom (first order: of one state) as its sensor would show it, and its error.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorResponse {
    /// Which displacement or state.
    pub symbol: Symbol,
    /// What the sensor measures of it.
    pub role: Role,
    /// What the sensor would show of the simulated motion, one value a sample until that diverged.
    pub response: Vec<f64>,
    /// E(t) = |measured − simulated|, as long as `response`.
    pub error: Vec<f64>,
    /// The errors in figures; none if the response diverged at once.
    pub score: Option<Score>,
}

impl SensorResponse {
    /// The name of what the sensor measures: `x`, `a2`.
    pub fn name(&self, layout: &Layout) -> String {
        sensor_name(self.role, layout)
    }
}

/// What a study says of one record.
#[derive(Clone, Debug)]
pub struct RecordOutcome {
    /// The record.
    pub record: Arc<Record>,
    /// Fitted or held out.
    pub usage: Usage,
    /// The record smoothed and differentiated.
    pub signals: Arc<Signals>,
    /// Whether the inputs drove the simulation as measured; else as smoothed.
    pub driven_as_measured: bool,
    /// The first sample that the scores count: those before it the initial state was estimated from.
    pub scored_from: usize,
    /// Simulated states, displacements, then velocities, as long as the response lasted: `[state][sample]`.
    pub states: Vec<Vec<f64>>,
    /// Samples at which something was measured to stand whose velocity's sign is in the library.
    pub standing: Arc<[Range<usize>]>,
    /// When the response sticks, s; moments left out.
    pub sticks: Vec<Range<f64>>,
    /// Each displacement (or state) held against its measurement.
    pub channels: Vec<SensorResponse>,
    /// Time at which the response left the data's range, s.
    pub diverged_at: Option<f64>,
}

impl RecordOutcome {
    /// Share of the samples at which something was measured to stand.
    pub fn standing_share(&self) -> f64 {
        let standing: usize = self.standing.iter().map(Range::len).sum();
        standing as f64 / self.record.len().max(1) as f64
    }
}

/// The name of what is measured, as the interface writes it: `x1`, `v2`, `a1`.
fn sensor_name(role: Role, layout: &Layout) -> String {
    match role {
        Role::Displacement(i) => layout.name(Symbol::State(i)),
        Role::Velocity(i) => layout.name(Symbol::Rate(i)),
        Role::Acceleration(i) => layout.name(Symbol::Rate(i)).replacen('v', "a", 1),
        Role::Input(j) => layout.name(Symbol::Input(j)),
    }
}

/// A measured channel that the model's response can be held against, with its errors.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorScore {
    /// Its name as the interface writes it: `x1`, `v2`, `a1`.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The errors in figures, in its unit; none if the response diverged at once.
    pub score: Option<Score>,
}

impl RecordOutcome {
    /// The errors of every displacement, velocity and acceleration that was measured. What no score is made of yet is held
    /// against the response's states, an acceleration against the slopes of its velocities.
    pub fn sensors(&self, layout: &Layout) -> Vec<SensorScore> {
        let velocity = |i: usize| self.states.get(layout.freedoms + i).filter(|_| layout.kind == Kind::SecondOrder);
        let of_channel = |channel: &sindyscope_values::record::Channel| {
            let unit = channel.unit.clone();
            if let Some(known) = self.channels.iter().find(|c| c.role == channel.role) {
                return Some(SensorScore { name: known.name(layout), unit, score: known.score });
            }
            let response = match channel.role {
                Role::Displacement(i) => self.states.get(i)?.clone(),
                Role::Velocity(i) => velocity(i)?.clone(),
                Role::Acceleration(i) => central(velocity(i)?, self.record.interval),
                Role::Input(_) => return None,
            };
            let name = sensor_name(channel.role, layout);
            let score = ErrorSums::compare(&channel.values, &response, self.scored_from, &mut Vec::new()).score();
            Some(SensorScore { name, unit, score })
        };
        self.record.measured().filter_map(of_channel).collect()
    }
}

/// A term that was tried and dropped.
#[derive(Clone, Debug, PartialEq)]
pub struct DroppedTerm {
    /// The term.
    pub term: Term,
    /// The threshold at which it fell, as the settings compare it; none if locked out.
    pub fell_at: Option<f64>,
}

/// The course of one term's coefficient as the threshold rises.
#[derive(Clone, Debug, PartialEq)]
pub struct PathTerm {
    /// The term.
    pub term: Term,
    /// Coefficient in the records' units, with the threshold from which on it holds; zero once the term has dropped out.
    pub coefficients: Vec<(f64, f64)>,
    /// RMS of the term over that of the rate: times this, coefficients compare.
    pub standard: f64,
}

/// How the regression of one equation went.
#[derive(Clone, Debug, PartialEq)]
pub struct EquationFit {
    /// The state whose rate was fitted.
    pub state: Symbol,
    /// The terms tried and dropped.
    pub dropped: Vec<DroppedTerm>,
    /// Thresholds at which a term drops out while the slider rises, ascending, with the term.
    pub drop_marks: Vec<(f64, Term)>,
    /// Every coefficient along the threshold, terms that are never used left out.
    pub path: Vec<PathTerm>,
    /// Condition number of the kept columns, each scaled to RMS 1.
    pub condition: f64,
    /// Pairs of the library's terms whose coefficients' errors are correlated by more than 0.95, with the correlation,
    /// strongest first: the data hardly tell them apart.
    pub confused: Vec<(Term, Term, f64)>,
    /// What smoothing and noise shift each of the equation's coefficients by, as the model's own response tells, which
    /// the covariance allows for; empty where it is not known or the coefficients were refined.
    pub shift: Vec<f64>,
    /// Posterior probability that each term of the library belongs; empty but for [`Regressor::Bayes`](super::Regressor).
    pub probability: Vec<(Term, f64)>,
    /// RMS of what the equation leaves unexplained of the rate.
    pub residual_rms: f64,
    /// RMS of the rate itself.
    pub rate_rms: f64,
}

/// How much a warning matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Good to know.
    Note,
    /// The result may mislead.
    Caution,
    /// The result cannot be used.
    Wrong,
}

/// What is wrong or doubtful, in words.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// How much it matters.
    pub severity: Severity,
    /// One sentence.
    pub text: String,
    /// What would help: settings or another use of a record, to be taken over.
    pub remedy: Option<Remedy>,
}

/// Time spent, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Elapsed {
    /// Smoothing, library, regression and, where asked for, refinement; errors of a regression are found beside the response.
    pub fit: f64,
    /// Simulation of every record.
    pub simulate: f64,
}

/// Everything that a view shows.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The settings it came from.
    pub settings: Settings,
    /// The identified equations.
    pub model: Model,
    /// The regression of each fitted equation.
    pub fits: Vec<EquationFit>,
    /// How the coefficients' errors are correlated.
    pub covariance: Covariance,
    /// What fitting the response itself changed, if that was asked for and possible.
    pub refinement: Option<Refinement>,
    /// Each record that is not off, in the set's order.
    pub records: Vec<RecordOutcome>,
    /// First displacement, fitted records pooled.
    pub train: Option<Score>,
    /// First displacement, held-out records pooled.
    pub test: Option<Score>,
    /// Standard deviation of the fitted records' noise on the first displacement, estimated without a model.
    pub noise_floor: Option<f64>,
    /// What is wrong, worst first.
    pub warnings: Vec<Warning>,
    /// Time spent.
    pub elapsed: Elapsed,
}

impl Outcome {
    /// What the leading equation's coefficients say in the words of mechanics.
    pub fn physical(&self) -> Vec<Physical> {
        let Some(record) = self.records.first().map(|r| &*r.record) else { return Vec::new() };
        let covariance = self.covariance.of_equation(self.fits.len().saturating_sub(1));
        let mass = match self.settings.mass {
            Some(mass) => Mass::Given(mass),
            None if is_force(record) => Mass::FromForce,
            None => Mass::Unknown,
        };
        let unit = record.channel(Role::Displacement(0)).map_or("", |c| c.unit.as_str());
        let mut found = physical(&self.model, &covariance, mass, metres(unit));
        found.extend(pairs(&self.settings).iter().filter_map(|pair| self.mass_ratio(pair)));
        found
    }

    /// The ratio of two masses between which forces are known to be equal and opposite; none where it was given.
    fn mass_ratio(&self, pair: &Pair) -> Option<Physical> {
        let (value, std_error) = pair.found(&self.model, self.covariance.all()).filter(|_| pair.ratio.is_none())?;
        let name = Known::Opposite(*pair).to_string();
        let title = "ratio of two masses, from the forces between them";
        Some(Physical { symbol: name.clone().into(), name: name.into(), title, value, std_error, unit: String::new() })
    }

    /// Natural frequencies, damping ratios and shapes of the equations' linear part.
    pub fn modes(&self) -> Vec<Mode> {
        // Where dx/dt was fitted too, its coefficients come first.
        let known = self.model.layout.freedoms == self.fits.len();
        modes(&self.model, if known { self.covariance.all() } else { &[] })
    }

    /// The units of the model's terms.
    pub fn units(&self) -> Units {
        self.records.first().map_or_else(Units::default, |r| Units::from_record(&r.record, &self.model.layout))
    }

    /// What smoothing and noise shift the coefficient of a term by, in the equation of a state; none where it is not known.
    pub fn shift(&self, state: Symbol, term: &Term) -> Option<f64> {
        let fit = self.fits.iter().find(|f| f.state == state)?;
        let index = self.model.layout.state_symbols().position(|s| s == state)?;
        let place = self.model.equations.get(index)?.terms.iter().position(|t| t.term == *term)?;
        fit.shift.get(place).copied()
    }

    /// True if some record's response left the data's range.
    pub fn diverged(&self) -> bool {
        self.records.iter().any(|r| r.diverged_at.is_some())
    }
}

/// True if a record's only input is a force in newtons.
fn is_force(record: &Record) -> bool {
    let inputs = record.channels.iter().filter(|c| matches!(c.role, Role::Input(_))).count();
    inputs == 1 && record.channel(Role::Input(0)).is_some_and(|c| matches!(c.unit.trim(), "N" | "newton" | "newtons"))
}

/// What one newton of a record's input does to a mass: the input's coefficient, in the displacement's unit over s²; none if
/// the input is no force in newtons.
pub fn force_over_mass(record: &Record, mass: f64) -> Option<f64> {
    let unit = record.channel(Role::Displacement(0)).map_or("", |c| c.unit.as_str());
    is_force(record).then_some(())?;
    Some(1.0 / (mass * metres(unit)?))
}
