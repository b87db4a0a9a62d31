//! A finished search told step by step, as every view of it needs it.

use super::outcome::{Added, Candidate, Diagnosis, Finding, Place, Round, Stage, Standing};
use super::records::RecordScore;
use sindyscope_core::signal::Spectrum;
use sindyscope_values::format::number::{significant, significant_trimmed};
use sindyscope_values::record::Usage;

/// An effect that was added and is still in the last model.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// The look at the gap that led to it.
    pub round: &'a Round,
    /// The effect as a candidate of that round.
    pub candidate: &'a Candidate,
    /// The effect with its parameters as fitted when it was added.
    pub added: &'a Added,
    /// The model before it was added.
    pub before: &'a Stage,
    /// The model with it.
    pub after: &'a Stage,
    /// What the model with it leaves on each record.
    pub scores: &'a [RecordScore],
}

impl<'a> Step<'a> {
    /// The other effects of the round that were refitted, best first.
    pub fn alternatives(&self) -> impl Iterator<Item = &'a Candidate> + use<'a> {
        let named = &self.candidate.choice;
        self.round.candidates.iter().filter(move |c| c.stage.is_some() && c.choice != *named)
    }

    /// The effects that the data cannot tell from it.
    pub fn indistinguishable(&self) -> Vec<&'a Candidate> {
        match &self.round.finding {
            Finding::Ambiguous(places) => places.iter().filter_map(|k| self.round.candidates.get(*k)).collect(),
            Finding::Nothing | Finding::Named | Finding::Unexplained => Vec::new(),
        }
    }
}

impl Candidate {
    /// Why it was refused, if it was.
    pub fn refusal(&self) -> Option<&str> {
        match &self.standing {
            Standing::Refused(reason) | Standing::NotShown(reason) => Some(reason),
            Standing::Screened | Standing::Refitted => None,
        }
    }
}

impl Diagnosis {
    /// The effects that were added and stayed, in order.
    pub fn steps(&self) -> Vec<Step<'_>> {
        let last = self.stages.last().map_or(&[][..], |s| &s.effects);
        self.added().filter(|step| last.iter().any(|e| e.choice == step.added.choice)).collect()
    }

    /// Effects that were added and that a later one made superfluous, by title.
    pub fn superseded(&self) -> Vec<&str> {
        let last = self.stages.last().map_or(&[][..], |s| &s.effects);
        self.added()
            .filter(|step| !last.iter().any(|e| e.choice == step.added.choice))
            .map(|step| step.added.title.as_str())
            .collect()
    }

    fn added(&self) -> impl Iterator<Item = Step<'_>> {
        // Each stage but the base came of the round before it.
        self.rounds.iter().zip(self.stages.windows(2)).enumerate().filter_map(|(k, (round, pair))| {
            let (before, after) = (&*pair[0], &*pair[1]);
            let candidate = round.candidates.first()?;
            let added = after.effects.iter().find(|e| e.choice == candidate.choice)?;
            Some(Step { round, candidate, added, before, after, scores: self.scores_of(k + 1) })
        })
    }

    /// What a stage leaves on each record; empty where that was not kept.
    pub fn scores_of(&self, stage: usize) -> &[RecordScore] {
        self.scores.get(stage).map_or(&[], Vec::as_slice)
    }

    /// What the last model leaves on each record, fitted ones first.
    pub fn records(&self) -> &[RecordScore] {
        self.scores.last().map_or(&[], Vec::as_slice)
    }

    /// True if whole records were held out; otherwise parts of the fitted ones were, in turn.
    pub fn has_held_out(&self) -> bool {
        self.stages.first().is_some_and(|s| s.traces.iter().any(|t| t.usage == Usage::HeldOut))
    }
}

/// Records whose worst stretch is said in words.
const RECORDS: usize = 3;

impl Place {
    /// Where in the state, in time and in frequency, in plain sentences.
    pub fn words(&self) -> String {
        let mut text = self.sentence.clone();
        let worst: Vec<_> = self.force.iter().filter_map(|f| Some((f, *f.worst.first()?))).collect();
        if !worst.is_empty() {
            let stretches: Vec<String> = worst
                .iter()
                .take(RECORDS)
                .map(|(force, (from, to))| {
                    let whose =
                        if self.force.len() > 1 { format!(" of record {}", force.record) } else { String::new() };
                    format!("{} to {} s{whose}", significant_trimmed(*from, 4), significant_trimmed(*to, 4))
                })
                .collect();
            let others = if worst.len() > RECORDS { ", …" } else { "." };
            text.push_str(&format!(" In time it is largest from {}{others}", stretches.join(", ")));
        }
        let longest = self.force.iter().max_by_key(|f| f.force.len());
        let peak = longest.and_then(|f| Spectrum::new(&f.force, f.interval)).and_then(|s| s.peak());
        if let Some(peak) = peak.filter(|p| p.frequency > 0.0) {
            text.push_str(&format!(" Its strongest tone is at {} Hz.", significant(peak.frequency, 3)));
        }
        text
    }
}
