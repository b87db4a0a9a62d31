//! Whether the experiment that is proposed where two effects cannot be told apart does tell them apart.

use rayon::prelude::*;
use sindyscope_core::study::Cancel;
use sindyscope_rig::RigError;
use sindyscope_rig::hidden::{ExcitationKind, FollowUp, FollowUpDrive, Hidden, HiddenRequest, draw, follow_up};
use sindyscope_search::{Ask, Diagnosis, Finding, ProposedDrive, ProposedTest, Search, Verdict};
use sindyscope_values::record::{RecordSet, Usage};

use super::{tied, white};

/// What a proposed experiment came to.
#[derive(Clone, Debug)]
pub(crate) struct CarriedOut {
    pub(crate) hidden: String,
    pub(crate) seed: u64,
    /// The effect that was found and the first that could not be told from it.
    pub(crate) rivals: [String; 2],
    pub(crate) text: String,
    /// What was found with the further records.
    pub(crate) verdict: Verdict,
    pub(crate) steps: Vec<String>,
    pub(crate) others: Vec<String>,
}

impl CarriedOut {
    fn stands(&self, effect: &str) -> bool {
        self.steps.iter().chain(&self.others).any(|e| e == effect)
    }

    /// One of the rivals at most is left.
    pub(crate) fn told_apart(&self) -> bool {
        !self.rivals.iter().all(|rival| self.stands(rival))
    }

    /// The hidden effect is one of the two rivals.
    pub(crate) fn of_the_two(&self) -> bool {
        self.rivals.iter().any(|rival| tied(rival, &self.hidden))
    }

    /// The hidden effect stands still.
    pub(crate) fn right(&self) -> bool {
        self.steps.iter().chain(&self.others).any(|e| tied(e, &self.hidden))
    }
}

/// What came of one draw under a steady tone.
#[derive(Clone, Debug)]
pub(crate) enum Outcome {
    /// It was not ambiguous, or could not be drawn.
    Told,
    /// No experiment of the list tells the two apart.
    NoExperiment,
    /// The plant ran away when the experiment was carried out.
    RanAway,
    /// The experiment was carried out.
    CarriedOut(CarriedOut),
}

fn diagnosed(hidden: &Hidden, further: Option<[sindyscope_values::record::Record; 2]>) -> Option<Diagnosis> {
    let mut records = RecordSet::new(hidden.fit.clone(), Usage::Fit);
    let mut held_out = hidden.held_out.clone();
    if let Some([first, second]) = further {
        records.add([first], Usage::Fit);
        held_out.push(second);
    }
    records.add(held_out, Usage::HeldOut);
    let ask = Ask { base: hidden.base.clone(), ..Ask::default() };
    Search::new(&records, &ask).and_then(|s| s.diagnose(&|_| {}, &Cancel::default())).ok()
}

fn names(diagnosis: &Diagnosis) -> (Vec<String>, Vec<String>) {
    let steps = diagnosis
        .stages
        .last()
        .map_or(Vec::new(), |last| last.effects.iter().map(|e| e.choice.effect.clone()).collect());
    let others = diagnosis.rounds.iter().filter_map(|round| match &round.finding {
        Finding::Ambiguous(places) => {
            Some(places.iter().map(|k| round.candidates[*k].choice.effect.clone()).collect::<Vec<_>>())
        }
        _ => None,
    });
    (steps, others.flatten().collect())
}

fn proposed(diagnosis: &Diagnosis) -> Option<(&str, Option<ProposedTest>)> {
    let next = diagnosis.rounds.iter().rev().find_map(|round| round.next_experiment.as_ref())?;
    Some((&next.text, next.test))
}

/// Draws a plant under one steady tone, and carries out what is proposed if what it hides cannot be told.
pub(crate) fn carried_out(effect: &str, noise: f64, seed: u64) -> Outcome {
    let request =
        HiddenRequest { instruments: white(noise), ..HiddenRequest::new([effect], ExcitationKind::SingleTone, seed) };
    let Ok(hidden) = draw(&request) else { return Outcome::Told };
    let Some(before) = diagnosed(&hidden, None) else { return Outcome::Told };
    let (steps, others) = names(&before);
    let (Some(winner), Some(rival)) = (steps.last(), others.first()) else { return Outcome::Told };
    let Some((text, test)) = proposed(&before) else { return Outcome::Told };
    let Some(ProposedTest { drive, seconds, .. }) = test else { return Outcome::NoExperiment };
    let drive = match drive {
        ProposedDrive::Release(displacement) => FollowUpDrive::Release(displacement),
        ProposedDrive::Tone { amplitude, frequency, .. } => FollowUpDrive::Tone { amplitude, frequency },
        ProposedDrive::Sweep { amplitude, band, .. } => FollowUpDrive::Sweep { amplitude, band },
    };
    let further = match follow_up(&request, &FollowUp { drive, seconds }) {
        Ok(further) => further,
        Err(RigError::Unbounded { .. }) => return Outcome::RanAway,
        Err(error) => panic!("{effect} seed {seed}: {error}"),
    };
    let Some(after) = diagnosed(&hidden, Some(further)) else { return Outcome::Told };
    let (new_steps, new_others) = names(&after);
    Outcome::CarriedOut(CarriedOut {
        hidden: effect.to_owned(),
        seed,
        rivals: [winner.clone(), rival.clone()],
        text: text.to_owned(),
        verdict: after.verdict,
        steps: new_steps,
        others: new_others,
    })
}

/// All draws side by side, in their order.
pub(crate) fn all<'n>(effects: impl Iterator<Item = &'n str>, noise: f64, draws: u64) -> Vec<Outcome> {
    let cases: Vec<(&str, u64)> = effects.flat_map(|effect| (0..draws).map(move |seed| (effect, seed))).collect();
    cases.par_iter().map(|(effect, seed)| carried_out(effect, noise, *seed)).collect()
}
