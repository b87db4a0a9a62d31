//! A walk that was kept, made whole again: whatever has one value a sample is simulated and estimated anew from the stored
//! parameters, nothing is fitted.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use sindyscope_core::parallel::prelude::*;

use super::data::RecordSeries;
use super::effects::{Addition, Form};
use super::error::GapError;
use super::experiment::NextExperiment;
use super::fit::{Fitted, Followed, WHOLE, followed, of_first};
use super::found::{Found, FoundCandidate, FoundConclusion, FoundDescription, FoundResponse, FoundRound, FoundStage};
use super::guide::{guide, guide_of_own};
use super::outcome::{Beginnings, Candidate, Choice, Curve, Description, Diagnosis, HeldFit, Round, Stage, Standing};
use super::parameters::Parameters;
use super::screen::Motion;
use super::search::Search;
use super::site::Placed;
use super::structure::{Composition, counted_from};
use sindyscope_core::refine::{FitOptions, Point, Refined, Run, respond};
use sindyscope_core::signal::dot;
use sindyscope_core::study::Cancel;
use sindyscope_values::model::WeightedTerm;
use sindyscope_values::term::Symbol;

/// A walk as it was when it was kept, each part by the effects that it belongs to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Restored {
    /// The stages.
    pub stages: HashMap<Vec<Choice>, Arc<Stage>>,
    /// The looks at them.
    pub rounds: HashMap<Vec<Choice>, Arc<Round>>,
    /// What the walk came to.
    pub conclusions: HashMap<Vec<Choice>, Arc<Diagnosis>>,
}

/// A stage with its model as one that was fitted: motion and forces are estimated along it, but it cannot be gone on with.
struct Revived {
    stage: Arc<Stage>,
    fitted: Fitted,
    /// The indices of the terms of the effect that was added last.
    last: Vec<usize>,
}

/// By what share a response may err otherwise than it did and still be the same.
const SAME: f64 = 0.01;

impl Search {
    /// A walk as it was when it was kept; nothing if its responses are not what they were. It must be of these records and
    /// this base model ([`Found::is_of`]).
    ///
    /// # Errors
    /// Cancelled.
    pub fn restore(&self, found: &Found, cancel: &Cancel) -> Result<Option<Restored>, GapError> {
        let models: Option<Vec<Revived>> = found.models.par_iter().map(|kept| self.revived(kept, cancel)).collect();
        let restored = models.and_then(|models| self.restored(found, &models, cancel));
        if cancel.is_cancelled() { Err(GapError::Cancelled) } else { Ok(restored) }
    }

    fn restored(&self, found: &Found, models: &[Revived], cancel: &Cancel) -> Option<Restored> {
        let entries = guide().into_iter().chain(guide_of_own(&self.ask.effects));
        let explanations: HashMap<&str, &'static str> = entries.map(|e| (e.effect, e.explanation)).collect();
        let mut restored = Restored::default();
        for fit in &found.fitted {
            restored.stages.insert(fit.effects.clone(), Arc::clone(&models.get(fit.model)?.stage));
        }
        for kept in &found.rounds {
            let round = self.restored_round(kept, models, &explanations, cancel)?;
            restored.rounds.insert(kept.effects.clone(), Arc::new(round));
        }
        for kept in &found.conclusions {
            let FoundConclusion { effects, looks, .. } = kept;
            let rounds = (0..*looks).map(|n| restored.rounds.get(effects.get(..n)?).map(|r| Round::clone(r)));
            let stages = kept.models.iter().map(|k| models.get(*k).map(|m| Arc::clone(&m.stage)));
            // Walks of before kept the scores of the last model alone.
            let mut scores = kept.earlier.clone();
            scores.resize(kept.models.len().saturating_sub(1), Vec::new());
            scores.push(kept.records.clone());
            let diagnosis = Diagnosis {
                verdict: kept.verdict,
                explained: kept.explained.unwrap_or(!kept.remaining.significant),
                sentence: kept.sentence.clone(),
                noise_floor: self.noise_floor(),
                notices: kept.notices.clone(),
                blind: self.blind().to_vec(),
                rounds: rounds.collect::<Option<_>>()?,
                stages: stages.collect::<Option<_>>()?,
                remaining: kept.remaining.clone(),
                scores,
                description: match &kept.description {
                    Some(kept) => Some(restored_description(kept, Arc::clone(&models.get(kept.model)?.stage))),
                    None => None,
                },
                elapsed_ms: kept.elapsed_ms,
            };
            restored.conclusions.insert(effects.clone(), Arc::new(diagnosis));
        }
        Some(restored)
    }

    fn restored_round(
        &self,
        kept: &FoundRound,
        models: &[Revived],
        explanations: &HashMap<&str, &'static str>,
        cancel: &Cancel,
    ) -> Option<Round> {
        let (before, compared) = (models.get(kept.before)?, models.get(kept.compared)?);
        let motion = self.data.motion(&before.fitted, cancel)?;
        let place = self.data.place(&before.fitted.by_record(&before.fitted.refined.residuals), &motion);
        let candidate = |c: &FoundCandidate| {
            let with = match c.model {
                Some(k) => Some(models.get(k)?),
                None => None,
            };
            Some(Candidate {
                choice: c.choice.clone(),
                title: c.title.clone(),
                place: c.place,
                // What these data cannot show is named without being explained.
                explanation: match c.standing {
                    Standing::NotShown(_) => "",
                    _ => explanations.get(c.choice.effect.as_str()).copied().unwrap_or(""),
                },
                standing: c.standing.clone(),
                explained: c.explained,
                delta_bic: c.delta_bic,
                why: c.why.clone(),
                stage: with.map(|with| Arc::clone(&with.stage)),
                confused_with: c.confused_with.clone(),
                curve: self.restored_curve(c, (compared, with), &motion),
            })
        };
        Some(Round {
            before: Arc::clone(&before.stage),
            compared: Arc::clone(&compared.stage),
            evidence: kept.evidence.clone(),
            place,
            candidates: kept.candidates.par_iter().map(candidate).collect::<Option<_>>()?,
            finding: kept.finding.clone(),
            next_experiment: kept.next_experiment.clone().map(|text| NextExperiment { text, test: None }),
            hidden_up_to: kept
                .hidden_up_to
                .iter()
                .map(|(t, size)| (t.clone(), size.unwrap_or(f64::INFINITY)))
                .collect(),
            lead: kept.lead.clone(),
        })
    }

    fn restored_curve(
        &self,
        candidate: &FoundCandidate,
        (compared, with): (&Revived, Option<&Revived>),
        motion: &Motion,
    ) -> Curve {
        let Some(axis) = candidate.over else { return Curve::default() };
        let over = (axis, candidate.place);
        match with {
            Some(with) => self.partial_residuals(over, (&compared.fitted, &with.fitted), (&with.last, None), motion),
            None => self.measured_curve(over, motion),
        }
    }

    /// A stage simulated again; none if it does not fit these records, or does not err as it did.
    fn revived(&self, kept: &FoundStage, cancel: &Cancel) -> Option<Revived> {
        let data = &self.data;
        let masses = data.masses();
        let model = &kept.model;
        let fitting = model.layout.freedoms == masses && model.layout.inputs == data.layout.inputs;
        if !fitting || model.equations.len() < 2 * masses || kept.responses.len() != data.series.len() {
            return None;
        }
        // Terms as shown count displacements from zero, those of a fit from where the data count.
        let inward = |t: &WeightedTerm| {
            let term = if data.datum == 0.0 { t.term.clone() } else { counted_from(&t.term, -data.datum) };
            WeightedTerm { term, ..t.clone() }
        };
        let mut internals = model.equations[2 * masses..].to_vec();
        internals.iter_mut().flat_map(|e| &mut e.terms).for_each(|t| *t = inward(t));
        let (mut base, mut coefficients, mut last) = (Vec::new(), Vec::new(), Vec::new());
        for (mass, equation) in model.equations[masses..2 * masses].iter().enumerate() {
            base.extend(equation.terms.iter().map(|t| Placed { mass, term: inward(t).term }));
            coefficients.extend(equation.terms.iter().map(|t| t.coefficient));
            // An effect's terms stand behind all others.
            let name = model.layout.name(Symbol::Rate(mass));
            let added = kept.effects.last().and_then(|e| e.equations.iter().find(|(velocity, _)| *velocity == name));
            last.extend(base.len().checked_sub(added.map_or(0, |(_, terms)| terms.len()))?..base.len());
        }
        let mut composition = Composition::new(data.layout, base);
        composition.zero = self.base.zero;
        composition.forms.push(Form::given(Addition {
            internals,
            delays: kept.delays.clone(),
            static_ratio: Some(model.static_ratio),
            ceiling: kept.ceiling,
            offset: kept.responses.iter().any(|r| !r.offsets.is_empty()),
            ..Addition::default()
        }));
        let parameters = Parameters { coefficients, inner: composition.middle() };
        let (fit, held) = kept.responses.split_at(data.fit().len());
        let refined =
            |series: &[RecordSeries], kept: &[FoundResponse]| retraced(&composition, &parameters, series, kept, cancel);
        let (runs, refined_fit) = refined(data.fit(), fit)?;
        let mut held_out = Vec::new();
        for (s, kept) in data.held_out().iter().zip(held) {
            held_out.push(match kept.stretches.is_empty() {
                true => Followed { simulated: Vec::new(), beginnings: Beginnings::default() },
                false => {
                    let (runs, refined) = refined(std::slice::from_ref(s), std::slice::from_ref(kept))?;
                    followed(&runs, &refined).pop()?
                }
            });
        }
        let (squares, samples) = of_first(&runs, &refined_fit.residuals);
        let rmse = (squares / samples.max(1) as f64).sqrt();
        if (rmse - kept.gap.train_rmse).abs() > SAME * kept.gap.train_rmse.max(data.noise) {
            return None;
        }
        let fitted = Fitted {
            composition,
            refined: Arc::new(refined_fit),
            parameters,
            runs: runs.into(),
            level: WHOLE,
            period: data.period,
            asked: true,
            between_samples: OnceLock::new(),
            folds: Vec::new(),
            refitted: Vec::new(),
            held_out,
            gap: kept.gap,
        };
        let stage = Stage {
            model: model.clone(),
            delays: kept.delays.clone(),
            ceiling: kept.ceiling,
            effects: kept.effects.clone(),
            gap: kept.gap,
            traces: self.traces(&fitted),
            fit: HeldFit::default(),
        };
        Some(Revived { stage: Arc::new(stage), fitted, last })
    }
}

fn restored_description(kept: &FoundDescription, stage: Arc<Stage>) -> Description {
    let FoundDescription { terms, beside, records, lead, closes, alternatives, curve, sentence, .. } = kept.clone();
    Description { terms, beside, stage, scores: records, lead, closes, alternatives, curve, sentence }
}

/// The responses along records from what they begin with; none if that does not go with the records.
fn retraced(
    composition: &Composition,
    parameters: &Parameters,
    series: &[RecordSeries],
    kept: &[FoundResponse],
    cancel: &Cancel,
) -> Option<(Vec<Run>, Refined)> {
    let states = 2 * composition.layout.freedoms;
    let all = states + sindyscope_core::refine::Structure::internals(composition);
    let (mut runs, mut point) = (Vec::new(), Point { shared: parameters.clone().row(), ..Point::default() });
    for (record, (s, kept)) in series.iter().zip(kept).enumerate() {
        let mut next = 0;
        for stretch in &kept.stretches {
            let range = stretch.samples.clone();
            let sound = [states, all].contains(&stretch.state.len()) && range.start == next && range.end > next;
            if *s.name != *kept.record || !sound || range.end > s.len() {
                return None;
            }
            next = range.end;
            runs.push(Run { record, ..s.stretch(range) });
            point.own.push(stretch.state.clone());
        }
        point.offsets.extend_from_slice(&kept.offsets);
    }
    let cancelled = || cancel.is_cancelled();
    let driven = point.own.iter().any(|own| own.len() < all);
    let options = FitOptions {
        frozen: true,
        driven,
        steps: 0,
        effort: usize::MAX,
        meter: None,
        bar: None,
        cancelled: &cancelled,
    };
    let simulated = respond(composition, &runs, &point, options)?;
    let residual = |(run, s): (&Run, &Vec<f64>)| run.target().zip(s).map(|(y, s)| y - s).collect();
    let residuals: Vec<Vec<f64>> = runs.iter().zip(&simulated).map(residual).collect();
    let rss = residuals.iter().map(|e| dot(e, e)).sum();
    let samples = runs.iter().map(Run::rows).sum();
    Some((runs, Refined { point, rss, samples, residuals, simulated, ..Refined::default() }))
}
