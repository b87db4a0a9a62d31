use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::effects::ForceAxis;
use super::experiment::NextExperiment;
use super::fit::Fitted;
use super::records::RecordScore;
use super::site::Site;
use super::words::within;
use sindyscope_core::simulate::Delays;
use sindyscope_values::format::number::significant;
use sindyscope_values::model::Model;
use sindyscope_values::record::Usage;

/// What the search for missing effects has come to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Every effect that was added stands alone, and nothing significant is left.
    Named,
    /// The last effect cannot be told from others with these data.
    Ambiguous,
    /// A significant gap is left that no effect of the catalogue closes on data never fitted.
    Unexplained,
    /// The base model explains the data down to their noise.
    NothingMissing,
}

impl Verdict {
    /// The word of the interface.
    pub fn word(self) -> &'static str {
        match self {
            Self::Named => "named",
            Self::Ambiguous => "ambiguous",
            Self::Unexplained => "unexplained",
            Self::NothingMissing => "nothing_missing",
        }
    }
}

/// Simulated against measured displacement, in the record's unit; initial states are fitted, on held-out records too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// RMSE over the fitted records.
    pub train_rmse: f64,
    /// RMSE over data that were not fitted: held-out records, else records or blocks left out in turn.
    pub test_rmse: Option<f64>,
    /// `train_rmse` over the fitted records' standard deviation.
    pub train_nrmse: f64,
    /// `test_rmse` over the standard deviation of the same data.
    pub test_nrmse: Option<f64>,
    /// The longest run that the errors are those of, s: a record's length, or that of the stretches that were begun anew.
    pub horizon: f64,
}

/// A record's simulated response beside its measurement, at the samples that were compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Name of the record.
    pub record: Arc<str>,
    /// Fitted or held out.
    pub usage: Usage,
    /// Time of the first sample, s.
    pub start: f64,
    /// Sampling interval, s; longer than the record's where it was thinned.
    pub interval: f64,
    /// Measured displacement.
    pub measured: Arc<[f64]>,
    /// Simulated displacement, as the sensor would show it.
    pub simulated: Arc<[f64]>,
    /// The same of every other mass's sensor, that of the second mass first.
    pub others: Vec<SensorTrace>,
    /// What the simulated response begins with.
    pub beginnings: Beginnings,
}

/// What a simulated response along a record begins with: with the model, all that it takes to simulate it again.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beginnings {
    /// For each stretch that is simulated by itself, its samples and its initial state: displacements, velocities and, unless
    /// the measured motion drives them, internal states. Displacements count from the equilibrium that the data count from.
    pub stretches: Vec<(Range<usize>, Vec<f64>)>,
    /// The sensors' offsets; empty where they have none.
    pub offsets: Vec<f64>,
}

impl Trace {
    /// What a mass's sensor showed, and what it would show of the response; of a mass that there is not, the first's.
    pub fn of_mass(&self, mass: usize) -> (&Arc<[f64]>, &Arc<[f64]>) {
        let other = mass.checked_sub(1).and_then(|k| self.others.get(k));
        other.map_or((&self.measured, &self.simulated), |o| (&o.measured, &o.simulated))
    }
}

/// What the sensor of one mass showed, beside what the simulated response would have shown it.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorTrace {
    /// What it showed, in its unit.
    pub measured: Arc<[f64]>,
    /// What it would show of the response.
    pub simulated: Arc<[f64]>,
    /// Standard deviation of its noise.
    pub noise: f64,
}

/// A physical quantity that was fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its usual symbol: `F_c`, `d`, `tau`.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard error, if the data give one.
    pub std_error: Option<f64>,
    /// True if it is held at a physical bound, which leaves it no error.
    pub at_bound: bool,
    /// Its unit, per unit of mass where it is a force.
    pub unit: String,
}

/// A model with its response: before anything is added, or after.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// The equations, coefficients refined on the simulated response.
    pub model: Model,
    /// How much later than they were measured the inputs act.
    pub delays: Delays,
    /// The first sensor shows no displacement beyond ± this.
    pub ceiling: Option<f64>,
    /// The effects in it, in the order in which they were added.
    pub effects: Vec<Added>,
    /// Its gap.
    pub gap: Gap,
    /// Its response along every record, fitted ones first.
    pub traces: Vec<Trace>,
    /// The fit that it shows.
    pub fit: HeldFit,
}

impl Stage {
    /// The effects in it, in the order in which they were added.
    pub fn choices(&self) -> Vec<Choice> {
        self.effects.iter().map(|e| e.choice.clone()).collect()
    }
}

/// The fit that a stage shows; none where the stage was kept from an earlier search. What a stage shows makes it what it is:
/// whether it can be gone on with at once does not.
#[derive(Clone, Default)]
pub struct HeldFit(pub(super) Option<Arc<Fitted>>);

impl fmt::Debug for HeldFit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("HeldFit")
    }
}

impl PartialEq for HeldFit {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// An effect that a stage's model has beside the base.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Added {
    /// Which one, and where it acts.
    pub choice: Choice,
    /// Its name for people.
    pub title: String,
    /// Where it acts; none of the input and of the sensor.
    #[serde(default)]
    pub place: Option<Site>,
    /// What it added, as terms.
    pub terms: Vec<String>,
    /// The equations that they stand in, by the velocity whose rate each gives.
    #[serde(default)]
    pub equations: Vec<(String, Vec<String>)>,
    /// Its quantities.
    pub parameters: Vec<Parameter>,
}

/// An effect of the catalogue, by name, and which of its forms.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Choice {
    /// The name in the interface: `coulomb_friction`.
    pub effect: String,
    /// The form: `to ground`, `across the joint`; empty where there is only one.
    pub form: String,
}

/// A set of effects that is worth a fit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProposedSet {
    /// The effects, each with its place.
    pub effects: Vec<(Choice, Option<Site>)>,
    /// It is tried whatever the regression says: dry friction where a mass rests, and what has no force to be regressed on.
    pub always: bool,
}

impl ProposedSet {
    /// How many sets that the regression proposes stand before the first that is wanted, none before what is always tried; none if
    /// no set is.
    pub fn before(sets: &[Self], is_wanted: impl Fn(&Self) -> bool) -> Option<usize> {
        let (always, regressed): (Vec<&Self>, Vec<&Self>) = sets.iter().partition(|set| set.always);
        let tried = always.into_iter().any(&is_wanted).then_some(0);
        tried.or_else(|| regressed.into_iter().position(is_wanted))
    }
}

/// How far a candidate has come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Standing {
    /// Judged by the fast screen alone.
    Screened,
    /// Refitted on the simulated response.
    Refitted,
    /// Refitted, and refused for the reason given.
    Refused(String),
    /// These data cannot show it, for the reason given; it was not tried.
    NotShown(String),
}

/// One effect held against the gap.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Which effect and form.
    pub choice: Choice,
    /// Its name for people: "Coulomb (dry) friction to ground".
    pub title: String,
    /// Where it acts; none of the input and of the sensor.
    pub place: Option<Site>,
    /// What it is, in plain words.
    pub explanation: &'static str,
    /// How far it has come.
    pub standing: Standing,
    /// Share of the gap's energy that it explains along the measured motion, 0 to 1 (the screen's figure).
    pub explained: f64,
    /// Difference of the Bayesian information criterion to the base, for coloured residuals; negative speaks for it.
    pub delta_bic: f64,
    /// Why it is ranked where it is, one sentence.
    pub why: String,
    /// The stage with this effect added; none unless refitted.
    pub stage: Option<Arc<Stage>>,
    /// The effects that these data cannot tell from it, by title.
    pub confused_with: Vec<String>,
    /// The force (per mass) of the effect against `axis`, for its card.
    pub curve: Curve,
}

/// A force against the quantity that it depends on: points of the measured missing force, and a candidate's through them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Which kind of quantity is across; none where there is no curve.
    pub over: Option<ForceAxis>,
    /// The quantity across: `v`, `x − u`, `t`.
    pub axis: String,
    /// Its unit.
    pub unit: String,
    /// (quantity, missing force per mass), measured: a few hundred samples.
    pub measured: Vec<[f64; 2]>,
    /// (quantity, force per mass) of the effect, in order along the axis or in time.
    pub effect: Vec<[f64; 2]>,
    /// Standard error of each of these forces, as the covariance of the fitted coefficients gives it; empty where it was not
    /// asked for, or the fit gives none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub deviation: Vec<f64>,
}

/// How many times its own range a force that is a law of the quantity across may rise and fall.
const WINDING: f64 = 6.0;

impl Curve {
    /// True if the effect's force is one value for each value of the quantity across, as far as its points tell: a line
    /// through them shows it. A force that depends on more is a cloud.
    pub fn is_law(&self) -> bool {
        let (travelled, range) = self.course();
        travelled <= WINDING * range
    }

    /// How often the effect's force rises and falls through its own range along the axis: the less, the better the quantity
    /// across orders it.
    pub(super) fn winding(&self) -> f64 {
        let (travelled, range) = self.course();
        if range > 0.0 { travelled / range } else { f64::INFINITY }
    }

    /// By how much the effect's force changes along the axis in all, and its range.
    fn course(&self) -> (f64, f64) {
        let forces = || self.effect.iter().map(|p| p[1]);
        let (low, high) = forces().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), f| (l.min(f), h.max(f)));
        (forces().zip(forces().skip(1)).map(|(a, b)| (b - a).abs()).sum(), high - low)
    }
}

/// One statistical question put to the residual.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Test {
    /// What is asked, in words.
    pub question: String,
    /// Probability of a statistic as large if nothing were missing, corrected for how many were asked.
    pub p_value: f64,
}

/// Whether simulation and measurement differ by more than noise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// True where `p_value` is below the level of the search (one in ten thousand).
    pub significant: bool,
    /// Probability of a gap like this if nothing were missing.
    pub p_value: f64,
    /// The single questions, most telling first.
    pub tests: Vec<Test>,
}

/// A map of the mean missing force over two quantities.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// The quantity across, with its unit: `x − u (mm)` is written by the view.
    pub across: (String, String),
    /// The quantity upwards and its unit.
    pub up: (String, String),
    /// Edges of the columns.
    pub columns: Vec<f64>,
    /// Edges of the rows.
    pub rows: Vec<f64>,
    /// Mean missing force per mass in each cell, row by row; NaN where the motion never was.
    pub mean: Vec<f64>,
    /// The mean over its standard error; beyond ±3 it is no chance.
    pub score: Vec<f64>,
}

/// The mean missing force along one quantity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    /// The quantity and its unit.
    pub axis: (String, String),
    /// Middle of each bin.
    pub at: Vec<f64>,
    /// Mean missing force per mass.
    pub mean: Vec<f64>,
    /// Its standard error.
    pub error: Vec<f64>,
    /// Share of the missing force's energy that this quantity alone explains, cross-validated.
    pub share: f64,
}

/// The missing force along one record: what the model would need at each instant to follow the measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct MissingForce {
    /// Name of the record.
    pub record: Arc<str>,
    /// Time of the first sample, s.
    pub start: f64,
    /// Sampling interval, s.
    pub interval: f64,
    /// Force per mass.
    pub force: Arc<[f64]>,
    /// Its standard deviation.
    pub deviation: Arc<[f64]>,
    /// Stretches (from, to), s, in which simulation and measurement differ most, worst first.
    pub worst: Vec<(f64, f64)>,
}

/// Where simulation and measurement disagree.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Place {
    /// One plain sentence.
    pub sentence: String,
    /// The mass whose missing force it is, from zero.
    pub mass: usize,
    /// The missing force in time, one entry a fitted record.
    pub force: Vec<MissingForce>,
    /// Over displacement and velocity.
    pub map: Map,
    /// Along displacement, velocity, amplitude, input, phase, time, the one that explains most first.
    pub profiles: Vec<Profile>,
}

/// How far a set of effects leads another on data never fitted, in log predictive density.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lead {
    /// Blocks that both predicted.
    pub blocks: usize,
    /// Blocks that the first predicted better.
    pub won: usize,
    /// Sum of the blocks' differences.
    pub difference: f64,
    /// Its standard error.
    pub std_error: f64,
    /// 2.3 % quantile of the sum over resampled blocks.
    pub quantile: f64,
    /// The other set, by the names of its effects; `none` for the model without any.
    pub against: String,
    /// The titles of those effects, with their places; empty where they are not known.
    #[serde(default)]
    pub titles: Vec<String>,
    /// Each block's difference, in the order of records and time; empty in a walk that was stored before they were kept.
    #[serde(default)]
    pub each: Vec<f64>,
    /// How much likelier the data fitted are under the first, as a logarithm, where they settle what the blocks leave open.
    #[serde(default)]
    pub fitted: Option<f64>,
}

impl Lead {
    /// How many blocks it won against which set, as a clause.
    pub fn words(&self) -> String {
        format!(
            "{} of {} blocks that were never fitted are predicted better than by {}",
            self.won,
            self.blocks,
            self.against_words()
        )
    }

    /// That the data fitted settle it, as a clause behind; empty where the blocks do.
    pub fn settled_words(&self) -> String {
        let settled = |likelier: f64| format!("; the data fitted settle it (+{})", significant(likelier, 2));
        self.fitted.map(settled).unwrap_or_default()
    }

    /// The difference with its sign: a set that cannot be told from another may predict worse.
    pub fn signed(&self) -> String {
        let sign = if self.difference < 0.0 { "" } else { "+" };
        format!("{sign}{}", significant(self.difference, 2))
    }

    /// The other set in words, for a sentence.
    pub fn against_words(&self) -> String {
        if !self.titles.is_empty() {
            return self.titles.iter().map(|title| within(title)).collect::<Vec<_>>().join(" and ");
        }
        match self.against.as_str() {
            "none" => "the model without it".to_owned(),
            names => names.replace('_', " "),
        }
    }
}

/// One look: is there a gap beyond the stage, where is it, which effects might it be.
#[derive(Clone, Debug, PartialEq)]
pub struct Round {
    /// The stage that was looked at.
    pub before: Arc<Stage>,
    /// The stage that candidates were held against: that one, or the same effects fitted along shorter stretches.
    pub compared: Arc<Stage>,
    /// Whether there is a gap.
    pub evidence: Evidence,
    /// Where.
    pub place: Place,
    /// Every effect, best first.
    pub candidates: Vec<Candidate>,
    /// What the round came to on its own.
    pub finding: Finding,
    /// The experiment that would tell the candidates apart that cannot be told apart.
    pub next_experiment: Option<NextExperiment>,
    /// Effects by title with the least size, as a share of the spring force, that these data would have shown.
    pub hidden_up_to: Vec<(String, f64)>,
    /// How far its first candidate leads the best set without it; none where nothing stands.
    pub lead: Option<Lead>,
}

/// What one look came to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// No gap.
    Nothing,
    /// The first candidate, alone.
    Named,
    /// The first candidate or one of these (indices in the candidates).
    Ambiguous(Vec<usize>),
    /// A gap that no candidate closes on data never fitted.
    Unexplained,
}

/// An effect that these data cannot show, said before any fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Blind {
    /// The effect's name.
    pub effect: &'static str,
    /// Why.
    pub reason: String,
}

/// The whole walk, from the base model to what remains.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// What it came to.
    pub verdict: Verdict,
    /// True if what is left is noise, or too little to matter.
    pub explained: bool,
    /// The verdict in one sentence.
    pub sentence: String,
    /// Estimated standard deviation of the measurement noise, without a model.
    pub noise_floor: f64,
    /// What was done to the data and what they cannot show, one sentence each.
    pub notices: Vec<String>,
    /// Effects that these data cannot show.
    pub blind: Vec<Blind>,
    /// The look that led to each effect that was added, in the company of all others, and the look at what is left.
    pub rounds: Vec<Round>,
    /// The base, then the stage after each effect that was added.
    pub stages: Vec<Arc<Stage>>,
    /// What each stage leaves on each record, fitted ones first: one list a stage.
    pub scores: Vec<Vec<RecordScore>>,
    /// Whether what remains is significant, and what these data could still hide.
    pub remaining: Remaining,
    /// Where the effects that were found leave a gap, the formula that follows what they do not say.
    pub description: Option<Description>,
    /// Time that it took, ms.
    pub elapsed_ms: f64,
}

/// A formula that follows what no effect of the catalogue says: a description, not a law.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// The terms that it adds, as they are printed.
    pub terms: Vec<String>,
    /// The effects, by name, that stay beside it.
    pub beside: Vec<String>,
    /// The model with it.
    pub stage: Arc<Stage>,
    /// What that leaves on each record, fitted ones first.
    pub scores: Vec<RecordScore>,
    /// How far it leads the best model without it.
    pub lead: Lead,
    /// True if what it leaves is noise, or too little to matter.
    pub closes: bool,
    /// Formulas as short that these data cannot tell from it.
    pub alternatives: Vec<Vec<String>>,
    /// Its force over the quantity that orders it best, with the error that the fit gives it.
    pub curve: Curve,
    /// What it says, in a sentence.
    pub sentence: String,
}

/// What is left after the last round.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Remaining {
    /// True if a gap is left.
    pub significant: bool,
    /// Its p-value.
    pub p_value: f64,
    /// What these data could still hide, and how large.
    pub note: String,
}
