//! What a search found, in plain sentences.

use std::sync::Arc;

use super::effects::Form;
use super::fit::Fitted;
use super::outcome::{Choice, Evidence, Finding, Gap, Lead, Remaining, Round, Stage, Verdict};
use sindyscope_values::format::number::significant;
use sindyscope_values::format::units::format_si;
use sindyscope_values::format::words::capitalised;

/// What the note says first of a gap that is left.
const MORE_THAN_NOISE: &str = "What is left is more than noise. ";

impl Remaining {
    /// What these data could still hide, without the sentence on whether anything is left.
    pub fn limits(&self) -> &str {
        self.note.strip_prefix(MORE_THAN_NOISE).unwrap_or(&self.note)
    }
}

/// Largest detection limit, as a share of the spring force, that is told as a number: an effect that could be larger than
/// this and not be seen is one that the data cannot show.
const LARGEST_LIMIT: f64 = 0.2;

/// What is left, in words.
pub(super) fn remaining(evidence: &Evidence, hidden_up_to: &[(String, f64)]) -> Remaining {
    let mut note = String::new();
    if evidence.significant {
        note.push_str(MORE_THAN_NOISE);
    }
    let mut sizes: Vec<&(String, f64)> = hidden_up_to.iter().filter(|(_, s)| s.is_finite()).collect();
    sizes.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (shown, unseen) = sizes.split_at(sizes.partition_point(|(_, s)| *s <= LARGEST_LIMIT));
    let limits: Vec<String> =
        shown.iter().map(|(title, s)| format!("{} {} %", within(title), significant(100.0 * s, 2))).collect();
    let unseen: Vec<String> = unseen.iter().map(|(title, _)| within(title)).collect();
    let mut sentences = Vec::new();
    if !limits.is_empty() {
        sentences.push(format!("Detection limits (share of the spring force): {}.", limits.join(", ")));
    }
    if !unseen.is_empty() {
        sentences.push(format!("These data cannot show: {}.", unseen.join(", ")));
    }
    note.push_str(&sentences.join(" "));
    Remaining { significant: evidence.significant, p_value: evidence.p_value, note }
}

/// Effects by their plain names.
pub(super) fn titles(choices: &[Choice]) -> String {
    let name = |c: &Choice| format!("{} {}", c.effect.replace('_', " "), c.form).trim().to_owned();
    choices.iter().map(name).collect::<Vec<_>>().join(" and ")
}

/// Why what was found does not explain the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Doubt {
    /// More than noise is left.
    MoreIsLeft,
    /// Forces between masses contradict the springs between them.
    Contradiction,
    /// Data never fitted are predicted worse than the data fitted.
    Unseen,
    /// Two effects are curves of free shape over the same quantity.
    Curves,
    /// A formula with fewer terms predicts data never fitted better.
    ShorterFormula,
    /// The model ought to follow the data further than it does.
    Horizon,
}

impl Doubt {
    fn words(self) -> &'static str {
        match self {
            Self::MoreIsLeft => "Something more is left that these data cannot name.",
            Self::Contradiction => {
                "The forces between the masses contradict the springs: something else may stand behind them."
            }
            Self::Unseen => {
                "It predicts data never fitted worse than the data fitted: something else may stand behind it."
            }
            Self::Curves => {
                "Two forces of free shape over one quantity follow any curve together: another force may stand behind them."
            }
            Self::ShorterFormula => {
                "A formula with fewer terms predicts data never fitted better: another force may stand behind them."
            }
            Self::Horizon => {
                "It follows the data over short stretches only, though the motion is not that sensitive: something else may stand \
                 behind it."
            }
        }
    }
}

/// How an error changes, in the middle of a sentence.
fn change(before: f64, after: f64, length: &str) -> String {
    let verb = if after < before { "falls" } else { "rises" };
    format!("{verb} from {} to {}", format_si(before, length, 3), format_si(after, length, 3))
}

/// Why a refitted candidate is where it is.
pub(super) fn why(form: &Form, before: &Fitted, after: &Fitted, refused: Option<&str>, length: &str) -> String {
    let rms = |f: &Fitted| f.gap.test_rmse.unwrap_or(f.gap.train_rmse);
    let (b, a) = (rms(before), rms(after));
    match refused {
        Some(reason) => format!("Refused: {reason}."),
        None => format!(
            "With {} the error on data never fitted {}, {} times.",
            within(form.title),
            change(b, a, length),
            significant((b / a).max(a / b), 2)
        ),
    }
}

/// What a formula does for the gap that effects leave, in sentences.
pub(super) fn described(
    (terms, closes): (&[String], bool),
    (before, after): (&Gap, &Gap),
    lead: &Lead,
    length: &str,
) -> String {
    let rms = |gap: &Gap| gap.test_rmse.unwrap_or(gap.train_rmse);
    let left = match closes {
        true => "closes the gap",
        false => "follows part of what is left",
    };
    format!(
        "A description, not a law, {left}: with {} the error on data never fitted {}, in {} of {} blocks.",
        terms.join(" and "),
        change(rms(before), rms(after), length),
        lead.won,
        lead.blocks
    )
}

/// How far a set leads the nearest one without an effect, in a sentence behind others.
pub(super) fn led(lead: &Lead) -> String {
    let (signed, error) = (lead.signed(), significant(lead.std_error, 2));
    format!(" {}; log density {signed} ± {error}{}.", lead.words(), lead.settled_words())
}

/// A title within a sentence: names keep their capitals.
pub fn within(title: &str) -> String {
    let name = ["Coulomb", "Stribeck", "Bouc", "Maxwell", "Duffing"].iter().any(|n| title.starts_with(n));
    let mut letters = title.chars();
    match letters.next() {
        Some(first) if !name => first.to_lowercase().chain(letters).collect(),
        _ => title.to_owned(),
    }
}

/// The verdict in one sentence, with what speaks against it.
pub(super) fn sentence(
    (verdict, doubt): (Verdict, Option<Doubt>),
    stages: &[Arc<Stage>],
    rounds: &[Round],
    length: &str,
) -> String {
    let (Some(first), Some(last)) = (stages.first(), stages.last()) else { return String::new() };
    let names: Vec<String> = last.effects.iter().map(|e| within(&e.title)).collect();
    let rms = |s: &Stage| s.gap.test_rmse.unwrap_or(s.gap.train_rmse);
    let gap = format!("the error on data never fitted {}", change(rms(first), rms(last), length));
    match verdict {
        Verdict::NothingMissing if rounds.last().is_some_and(|r| r.evidence.significant) => {
            "Nothing that matters is missing: a little more than noise is left, and no effect of the catalogue predicts data never fitted better.".to_owned()
        }
        Verdict::NothingMissing => "Nothing is missing that these data can show.".to_owned(),
        Verdict::Named => format!("Missing: {}; {gap}.", names.join(" and ")),
        Verdict::Ambiguous => {
            let others = rounds
                .iter()
                .rev()
                .find_map(|r| match &r.finding {
                    Finding::Ambiguous(places) => Some(
                        places
                            .iter()
                            .filter_map(|k| r.candidates.get(*k))
                            .map(|c| within(&c.title))
                            .collect::<Vec<_>>()
                            .join(", "),
                    ),
                    _ => None,
                })
                .unwrap_or_default();
            format!("{}, or just as well {others}: these data cannot tell; {gap}.", capitalised(&names.join(" and ")))
        }
        Verdict::Unexplained if names.is_empty() && doubt == Some(Doubt::Unseen) => format!(
            "The data fitted show nothing missing, but data never fitted are missed by {}, not by {}: something acts there that \
             the data fitted do not show. Fit such data too.",
            format_si(rms(last), length, 3),
            format_si(last.gap.train_rmse, length, 3)
        ),
        Verdict::Unexplained if names.is_empty() => {
            "Something is missing, and no effect of the catalogue closes the gap on data never fitted.".to_owned()
        }
        Verdict::Unexplained => {
            let doubt = doubt.unwrap_or(Doubt::MoreIsLeft).words();
            format!("Missing: {}; {gap}. {doubt}", names.join(" and "))
        }
    }
}
