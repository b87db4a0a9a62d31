//! What a walk made by hand has found, as a file keeps it.
//!
//! A stage is its model with what each response begins with; a round is what the look decided and said. Whatever has one value
//! a sample (responses, missing forces, maps, points of curves) is left out: [`super::Search::restore`] makes it again from
//! the records within a fraction of the time that the search took. So the text is short, and a change of it reads well.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use flate2::Crc;
use serde::{Deserialize, Serialize};

use super::effects::ForceAxis;
use super::outcome::{
    Added, Beginnings, Candidate, Choice, Curve, Description, Diagnosis, Evidence, Finding, Gap, Lead, Remaining,
    Round, Stage, Standing, Verdict,
};
use super::records::RecordScore;
use super::site::Site;
use sindyscope_core::simulate::Delays;
use sindyscope_values::model::Model;
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::Term;

/// What a walk has found, and of which records and base model that is true.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// What tells the records from others: see [`Found::records_of`].
    records: String,
    /// Terms of the base model; none for a linear spring and damper.
    base: Option<Vec<Term>>,
    /// Every model that was fitted.
    pub(super) models: Vec<FoundStage>,
    /// The model of each set of effects.
    pub(super) fitted: Vec<FoundFit>,
    /// The looks.
    pub(super) rounds: Vec<FoundRound>,
    /// What it came to.
    pub(super) conclusions: Vec<FoundConclusion>,
}

/// A model with its response.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FoundStage {
    pub(super) model: Model,
    #[serde(rename = "delay")]
    pub(super) delays: Delays,
    pub(super) ceiling: Option<f64>,
    pub(super) effects: Vec<Added>,
    pub(super) gap: Gap,
    /// One a record, fitted ones first.
    pub(super) responses: Vec<FoundResponse>,
}

/// What a response begins with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FoundResponse {
    pub(super) record: String,
    /// One a stretch.
    pub(super) stretches: Vec<KeptStretch>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) offsets: Vec<f64>,
}

/// The samples of a stretch and its initial state, one line of text: `0..500: 0.01 -0.2`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub(super) struct KeptStretch {
    pub(super) samples: Range<usize>,
    pub(super) state: Vec<f64>,
}

impl From<KeptStretch> for String {
    fn from(stretch: KeptStretch) -> Self {
        let KeptStretch { samples, state } = stretch;
        let state: Vec<Self> = state.iter().map(|value| format!("{value:?}")).collect();
        format!("{}..{}: {}", samples.start, samples.end, state.join(" "))
    }
}

impl TryFrom<String> for KeptStretch {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let read = || {
            let (samples, state) = text.split_once(':')?;
            let (start, end) = samples.split_once("..")?;
            let state = state.split_whitespace().map(|value| value.parse().ok()).collect::<Option<Vec<f64>>>()?;
            Some(Self { samples: start.parse().ok()?..end.parse().ok()?, state })
        };
        read().ok_or_else(|| format!("`{text}` is no stretch of a response, as `0..500: 0.01 -0.2` is"))
    }
}

/// Which model effects lead to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FoundFit {
    pub(super) effects: Vec<Choice>,
    /// Its place among the models, here and below.
    pub(super) model: usize,
}

/// A look at the model with some effects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FoundRound {
    pub(super) effects: Vec<Choice>,
    /// The model that was looked at, and the one that candidates were held against.
    pub(super) before: usize,
    pub(super) compared: usize,
    pub(super) evidence: Evidence,
    pub(super) finding: Finding,
    pub(super) next_experiment: Option<String>,
    pub(super) candidates: Vec<FoundCandidate>,
    /// None where no size would have been shown: JSON has no infinity.
    pub(super) hidden_up_to: Vec<(String, Option<f64>)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) lead: Option<Lead>,
}

/// An effect held against the gap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FoundCandidate {
    #[serde(flatten)]
    pub(super) choice: Choice,
    pub(super) title: String,
    pub(super) place: Option<Site>,
    pub(super) standing: Standing,
    pub(super) explained: f64,
    pub(super) delta_bic: f64,
    pub(super) why: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) model: Option<usize>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) confused_with: Vec<String>,
    /// What its force is drawn over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) over: Option<ForceAxis>,
}

/// What the walk came to with some effects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FoundConclusion {
    pub(super) effects: Vec<Choice>,
    pub(super) verdict: Verdict,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) explained: Option<bool>,
    /// Of the last of these models.
    #[serde(default)]
    pub(super) records: Vec<RecordScore>,
    /// Of those before it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) earlier: Vec<Vec<RecordScore>>,
    pub(super) sentence: String,
    pub(super) notices: Vec<String>,
    pub(super) remaining: Remaining,
    /// The formula for what the effects leave.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) description: Option<FoundDescription>,
    /// The base model, and the model after each effect.
    pub(super) models: Vec<usize>,
    /// How many looks it rests on: those at the first of these models.
    pub(super) looks: usize,
    pub(super) elapsed_ms: f64,
}

/// A formula for what effects leave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FoundDescription {
    pub(super) terms: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) beside: Vec<String>,
    pub(super) model: usize,
    pub(super) records: Vec<RecordScore>,
    pub(super) lead: Lead,
    pub(super) closes: bool,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) alternatives: Vec<Vec<String>>,
    #[serde(default)]
    pub(super) curve: Curve,
    pub(super) sentence: String,
}

/// Models without repeats.
#[derive(Default)]
struct Pool(Vec<Arc<Stage>>);

impl Pool {
    fn place(&mut self, stage: &Arc<Stage>) -> usize {
        let same = |known: &Arc<Stage>| Arc::ptr_eq(known, stage) || known == stage;
        self.0.iter().position(same).unwrap_or_else(|| {
            self.0.push(Arc::clone(stage));
            self.0.len() - 1
        })
    }
}

/// Sets of effects, the smaller ones first: the text must not depend on the order in a map.
fn in_order<T>(map: &HashMap<Vec<Choice>, T>) -> Vec<(&Vec<Choice>, &T)> {
    let mut list: Vec<_> = map.iter().collect();
    list.sort_by(|a, b| a.0.len().cmp(&b.0.len()).then_with(|| a.0.cmp(b.0)));
    list
}

impl Found {
    /// What was found of these records and this base model: the stage of each set of effects, the look at it, and what the
    /// walk came to with it.
    pub fn new(
        (records, base): (String, Option<Vec<Term>>),
        stages: &HashMap<Vec<Choice>, Arc<Stage>>,
        rounds: &HashMap<Vec<Choice>, Arc<Round>>,
        conclusions: &HashMap<Vec<Choice>, Arc<Diagnosis>>,
    ) -> Self {
        let mut pool = Pool::default();
        let fitted = in_order(stages)
            .into_iter()
            .map(|(effects, stage)| FoundFit { effects: effects.clone(), model: pool.place(stage) })
            .collect();
        let rounds = in_order(rounds).into_iter().map(|(effects, r)| FoundRound::of(effects, r, &mut pool)).collect();
        let conclusions = in_order(conclusions)
            .into_iter()
            .map(|(effects, diagnosis)| FoundConclusion {
                effects: effects.clone(),
                verdict: diagnosis.verdict,
                explained: Some(diagnosis.explained),
                sentence: diagnosis.sentence.clone(),
                notices: diagnosis.notices.clone(),
                description: diagnosis.description.as_ref().map(|d| FoundDescription::of(d, &mut pool)),
                remaining: diagnosis.remaining.clone(),
                records: diagnosis.records().to_vec(),
                earlier: diagnosis.scores.split_last().map(|(_, before)| before.to_vec()).unwrap_or_default(),
                models: diagnosis.stages.iter().map(|stage| pool.place(stage)).collect(),
                looks: diagnosis.rounds.len(),
                elapsed_ms: diagnosis.elapsed_ms,
            })
            .collect();
        let models = pool.0.iter().map(|stage| FoundStage::of(stage)).collect();
        Self { records, base, models, fitted, rounds, conclusions }
    }

    /// True if it was found of these records (told by [`Found::records_of`]) and this base model.
    pub fn is_of(&self, records: &str, base: Option<&[Term]>) -> bool {
        self.records == records && self.base.as_deref() == base
    }

    /// True if another was found of the same records and base model.
    pub fn is_of_the_same_as(&self, other: &Self) -> bool {
        self.is_of(&other.records, other.base.as_deref())
    }

    /// What tells the records of a search from others: names, uses, units and every value as a CRC-32. It changes with the
    /// file, with how it is read and with how it is prepared.
    pub fn records_of(records: &RecordSet) -> String {
        let used = || records.entries.iter().filter(|(_, usage)| *usage != Usage::Off);
        let (mut crc, mut samples) = (Crc::new(), 0);
        for (record, usage) in used() {
            samples += record.len();
            crc.update(format!("{}\n{usage:?}\n", record.name).as_bytes());
            crc.update(&record.start.to_le_bytes());
            crc.update(&record.interval.to_le_bytes());
            for channel in &record.channels {
                crc.update(format!("{:?} {} {}\n", channel.role, channel.name, channel.unit).as_bytes());
                channel.values.iter().for_each(|value| crc.update(&value.to_le_bytes()));
            }
        }
        format!("{} records, {samples} samples, crc32 {:08x}", used().count(), crc.sum())
    }
}

impl FoundStage {
    fn of(stage: &Stage) -> Self {
        let responses = stage.traces.iter().map(|trace| {
            let Beginnings { stretches, offsets } = trace.beginnings.clone();
            let stretches = stretches.into_iter().map(|(samples, state)| KeptStretch { samples, state }).collect();
            FoundResponse { record: trace.record.to_string(), stretches, offsets }
        });
        Self {
            model: stage.model.clone(),
            delays: stage.delays.clone(),
            ceiling: stage.ceiling,
            effects: stage.effects.clone(),
            gap: stage.gap,
            responses: responses.collect(),
        }
    }
}

impl FoundDescription {
    fn of(description: &Description, pool: &mut Pool) -> Self {
        let Description { terms, beside, stage, scores, lead, closes, alternatives, curve, sentence } =
            description.clone();
        Self { terms, beside, model: pool.place(&stage), records: scores, lead, closes, alternatives, curve, sentence }
    }
}

impl FoundRound {
    fn of(effects: &[Choice], round: &Round, pool: &mut Pool) -> Self {
        let (before, compared) = (pool.place(&round.before), pool.place(&round.compared));
        let candidate = |c: &Candidate| FoundCandidate {
            choice: c.choice.clone(),
            title: c.title.clone(),
            place: c.place,
            standing: c.standing.clone(),
            explained: c.explained,
            delta_bic: c.delta_bic,
            why: c.why.clone(),
            model: c.stage.as_ref().map(|stage| pool.place(stage)),
            confused_with: c.confused_with.clone(),
            over: c.curve.over,
        };
        Self {
            effects: effects.to_vec(),
            before,
            compared,
            evidence: round.evidence.clone(),
            finding: round.finding.clone(),
            next_experiment: round.next_experiment.as_ref().map(|next| next.text.clone()),
            candidates: round.candidates.iter().map(candidate).collect(),
            hidden_up_to: round
                .hidden_up_to
                .iter()
                .map(|(title, size)| (title.clone(), Some(*size).filter(|size| size.is_finite())))
                .collect(),
            lead: round.lead.clone(),
        }
    }
}
