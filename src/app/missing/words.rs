//! Figures as words, and sentences that stand alone.

use egui::text::{LayoutJob, TextFormat};
use egui::{Color32, FontId, RichText, Ui};
use sindyscope_search::{CONSTANTS, Finding, Gap, Lead, Round, within};

use crate::app::theme;
use sindyscope_values::format::number::{significant, significant_trimmed, superscript};
use sindyscope_values::format::units::format_si;
use sindyscope_values::format::words::capitalised;

/// Probability below which an answer that is no yes is no plain no either.
const HINT: f64 = 0.01;

/// A probability: `p = 0.003`, `p < 10⁻¹²`.
pub(super) fn p_value(p: f64) -> String {
    if p < 1e-12 { "p < 10⁻¹²".to_owned() } else { format!("p = {}", significant_trimmed(p, 2)) }
}

/// The answer to a question about what is left; `gap` tells whether there is one beyond noise at all.
pub(super) fn answer(p: f64, gap: bool) -> String {
    let said = match p {
        p if p < CONSTANTS.level && gap => "yes",
        p if p < HINT => "not clearly",
        _ => "no sign of it",
    };
    format!("{said} ({})", p_value(p))
}

/// Why there is no gap, with the level that it was held against.
pub(super) fn no_gap(p: f64) -> String {
    let level = CONSTANTS.level;
    if p < level {
        // Steps of the sensor repeat with the motion as a force does: they are held against a far lower level.
        return format!("{}: not clear enough beside what noise, steps and arithmetic leave", p_value(p));
    }
    format!("{}; a gap counts below {}", p_value(p), power_of_ten(level))
}

fn power_of_ten(value: f64) -> String {
    format!("10{}", superscript(value.log10().round() as i32))
}

/// What a rival's difference of the Bayesian information criterion to the first candidate says, by the same scale.
pub(super) fn against_first(delta_bic: f64) -> &'static str {
    match delta_bic {
        // The first stands for more than its own difference: in company it may close more, or be met more often.
        d if d < -2.0 => "likelier than the first by itself",
        d if d <= 2.0 => "as likely as the first",
        d if d <= 6.0 => "some evidence for the first",
        d if d <= 10.0 => "strong evidence for the first",
        _ => "very strong evidence for the first",
    }
}

/// What a difference of the Bayesian information criterion says: Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773,
/// with a step of its own for odds beyond 20 000 to 1.
pub(super) fn evidence(delta_bic: f64) -> &'static str {
    match -delta_bic {
        d if d > 20.0 => "overwhelming evidence",
        d if d > 10.0 => "very strong evidence",
        d if d > 6.0 => "strong evidence",
        d if d > 2.0 => "some evidence",
        d if d > -2.0 => "no evidence either way",
        _ => "evidence against it",
    }
}

/// A figure's digits with its sign, as on cards.
pub(super) fn delta_bic(value: f64) -> String {
    // Less than a tenth is nothing.
    format!("ΔBIC {}", if value.abs() < 0.1 { "0".to_owned() } else { significant_trimmed(value, 3) })
}

/// The error on data never fitted; on the fitted where there is no other.
pub(super) fn honest(gap: &Gap) -> f64 {
    gap.test_rmse.unwrap_or(gap.train_rmse)
}

/// `12.0 µm → 1.10 µm`.
pub(super) fn shrinks(before: &Gap, after: &Gap, unit: &str) -> String {
    format!("{} → {}", format_si(honest(before), unit, 3), format_si(honest(after), unit, 3))
}

/// By how many times a gap got smaller; nothing where it did not.
pub(super) fn times(before: &Gap, after: &Gap) -> Option<String> {
    let factor = honest(before) / honest(after);
    (factor.is_finite() && factor >= 1.05).then(|| format!("{} × smaller", significant(factor, 2)))
}

/// What a round came to, in one sentence.
pub(super) fn finding(round: &Round) -> String {
    let first = round.candidates.first().map_or("", |c| c.title.as_str());
    match &round.finding {
        Finding::Nothing => "No gap beyond noise: nothing is missing that these data can show.".into(),
        Finding::Named => format!("Named: {}.", within(first)),
        Finding::Ambiguous(_) => format!("{}.", closes(round)),
        Finding::Unexplained => "A gap that no effect of the catalogue closes on data never fitted.".into(),
    }
}

/// What closes a gap, as a clause: the first candidate, and what these data cannot tell from it.
pub(super) fn closes(round: &Round) -> String {
    let first = round.candidates.first().map_or("", |c| c.title.as_str());
    let better = |lead: &Lead| lead.difference <= 0.0;
    match &round.finding {
        Finding::Ambiguous(rivals) => {
            let others: Vec<String> =
                rivals.iter().filter_map(|k| round.candidates.get(*k)).map(|c| within(&c.title)).collect();
            format!("These data cannot tell {} from {}", within(first), others.join(", "))
        }
        // Where nothing explains the data, the likelier may be shown before what predicts them a little better.
        _ if round.lead.as_ref().is_some_and(better) => format!("{first} closes part of it"),
        _ => format!("{first} closes it best"),
    }
}

/// Text with a word of it in another colour.
pub(super) fn two(ui: &Ui, first: &str, color: Color32, rest: &str) -> LayoutJob {
    let mut job = LayoutJob::default();
    job.append(first, 0.0, TextFormat::simple(FontId::proportional(13.0), color));
    job.append(rest, 5.0, TextFormat::simple(FontId::proportional(13.0), ui.visuals().text_color()));
    job
}

/// Why nothing can be searched for, in the middle of the room; true if one wants to begin again, where that may help.
pub(super) fn failure(ui: &mut Ui, text: &str, may_help: bool) -> bool {
    let mut again = false;
    let width = ui.available_width().min(520.0);
    ui.vertical_centered(|ui| {
        ui.add_space(0.3 * ui.available_height());
        ui.set_max_width(width);
        let sentence = capitalised(text);
        let color = theme::accents(ui.visuals().dark_mode).wrong;
        ui.add(egui::Label::new(RichText::new(sentence).color(color)).wrap());
        ui.add_space(8.0);
        again = may_help && ui.button("Begin again with a linear base").clicked();
    });
    again
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evidence_is_said_in_words() {
        assert_eq!(evidence(-300.0), "overwhelming evidence");
        assert_eq!(evidence(-7.0), "strong evidence");
        assert_eq!(evidence(9.0), "evidence against it");
        assert_eq!(against_first(482.0), "very strong evidence for the first");
        assert_eq!(against_first(-40.0), "likelier than the first by itself");
        assert_eq!(against_first(0.3), "as likely as the first");
        assert_eq!(p_value(1e-40), "p < 10⁻¹²");
        assert_eq!(p_value(0.0312), "p = 0.031");
        assert_eq!(answer(1e-40, true), "yes (p < 10⁻¹²)");
        assert_eq!(answer(0.4, true), "no sign of it (p = 0.4)");
        assert_eq!(answer(0.002, true), "not clearly (p = 0.002)");
    }

    #[test]
    fn without_a_gap_no_answer_is_yes_and_the_level_is_said() {
        assert_eq!(answer(1e-5, false), "not clearly (p = 1×10⁻⁵)");
        assert_eq!(no_gap(0.042), "p = 0.042; a gap counts below 10⁻⁴");
        assert!(no_gap(1e-6).contains("not clear enough"));
    }

    #[test]
    fn a_gap_that_grew_is_not_called_smaller() {
        let gap = |test_rmse| Gap { test_rmse: Some(test_rmse), ..Gap::default() };
        assert_eq!(times(&gap(10.0), &gap(2.0)).as_deref(), Some("5.0 × smaller"));
        assert_eq!(times(&gap(1.0), &gap(2.0)), None);
        assert_eq!(shrinks(&gap(12e-6), &gap(1.1e-6), "m"), "12.0 µm → 1.10 µm");
    }
}
