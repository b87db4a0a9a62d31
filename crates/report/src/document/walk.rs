//! The search for missing effects: what a report and a terminal say of it.

use sindyscope_values::format::units::{Scale, format_si, raised};
use std::fmt::Write;

use super::content::{Block, Cell, DocumentTable, Tile, coefficients, sentence};
use super::drawings::{self, FigureLimits};
use super::math;
use sindyscope_core::study::Severity;
use sindyscope_search::{
    CONSTANTS, Candidate, Description, Diagnosis, Finding, Gap, Parameter, Round, Stage, Standing, Step,
};
use sindyscope_values::format::equations;
use sindyscope_values::format::number::{
    align_at_point, format_measured, significant, significant_trimmed, superscript,
};
use sindyscope_values::model::{Model, Units};
use sindyscope_values::record::RecordSet;
use sindyscope_values::term::{Layout, Term};

/// A part of what is told of the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WalkPart {
    /// What it came to, and the base model it began with.
    Verdict,
    /// How the gap falls.
    Waterfall,
    /// Each round.
    Rounds,
    /// The model with what was added, and its response.
    Overlay,
    /// What is left, and what the data could not show.
    Remaining,
}

/// A part as a section of a report; nothing if there is nothing to tell.
pub(super) fn blocks(part: WalkPart, diagnosis: &Diagnosis, records: &RecordSet, room: &FigureLimits) -> Vec<Block> {
    let unit = super::report::displacement_unit(records);
    let (Some(base), Some(last)) = (diagnosis.stages.first(), diagnosis.stages.last()) else { return Vec::new() };
    let steps = diagnosis.steps();
    let model = |model: &Model| {
        let mut blocks = vec![Block::Equations(math::equations(model))];
        blocks.extend(coefficients(model, &super::report::units(records, model), |_| None));
        blocks
    };
    match part {
        WalkPart::Verdict => {
            let mut blocks =
                vec![Block::Tiles(tiles(diagnosis, base, last, unit)), Block::Paragraph(diagnosis.sentence.clone())];
            blocks.extend(diagnosis.description.iter().map(|d| Block::Paragraph(d.sentence.clone())));
            blocks.push(Block::Paragraph("The base model:".into()));
            blocks.extend(model(&base.model));
            blocks
        }
        WalkPart::Waterfall => drawings::waterfall(diagnosis, unit).map(Block::Figure).into_iter().collect(),
        WalkPart::Rounds => {
            let mut blocks = Vec::new();
            for (k, round) in diagnosis.rounds.iter().enumerate() {
                let step = steps.iter().find(|s| std::ptr::eq(s.round, round));
                blocks.push(Block::Subheading(match step {
                    Some(step) => format!("Round {}: {}", k + 1, step.added.title),
                    None => format!("Round {}: {}", k + 1, outcome_words(&round.finding)),
                }));
                blocks.extend(round_blocks(round, step, unit, tested(diagnosis)));
            }
            blocks
        }
        WalkPart::Overlay => {
            let mut blocks = Vec::new();
            if !steps.is_empty() {
                blocks.push(Block::Subheading("The model with every effect that was added".into()));
                blocks.extend(model(&last.model));
                blocks.extend(drawings::overlay(base, last, unit, room).into_iter().map(Block::Figure));
            }
            if let Some(description) = &diagnosis.description {
                blocks.push(Block::Subheading(DESCRIPTION.into()));
                blocks.push(Block::Paragraph(description_words(description, unit, tested(diagnosis))));
                blocks.extend(model(&description.stage.model));
                let formula = raised(&description.terms.join(" + "));
                blocks.extend(drawings::curve(&description.curve, &formula, unit).map(Block::Figure));
                blocks.extend(drawings::overlay(base, &description.stage, unit, room).into_iter().map(Block::Figure));
            }
            blocks
        }
        WalkPart::Remaining => {
            let mut blocks = vec![Block::Subheading("What remains".into()), Block::Paragraph(remaining(diagnosis))];
            blocks.extend(superseded(diagnosis).map(Block::Paragraph));
            if !diagnosis.notices.is_empty() {
                let notes = diagnosis.notices.iter().map(|n| (Severity::Note, sentence(n)));
                blocks.push(Block::Warnings(notes.collect()));
            }
            blocks.extend(not_shown(diagnosis).map(Block::Paragraph));
            blocks
        }
    }
}

/// What a terminal says; `of_files` is what was noticed in reading the records.
pub(super) fn text(
    diagnosis: &Diagnosis,
    (unit, of_files): (&str, &[&str]),
    units: &dyn Fn(&Model) -> Units,
) -> String {
    const INDENT: usize = 15;
    let mut out = String::new();
    let (Some(base), Some(last)) = (diagnosis.stages.first(), diagnosis.stages.last()) else { return out };
    let tested = tested(diagnosis);
    let _ = write!(out, "Base model\n{}", equations::text(&base.model, Some(&units(&base.model))));
    let _ = writeln!(out, "gap: {}", gap_words(&base.gap, unit, tested));
    let noise = format_si(diagnosis.noise_floor, unit, 2);
    let _ = writeln!(out, "noise floor {noise} (standard deviation, estimated)");
    let steps = diagnosis.steps();
    for (k, step) in steps.iter().enumerate() {
        let _ = writeln!(out, "\n{}. {} ({})", k + 1, step.added.title, step.added.choice.effect);
        let mut line = |label: &str, text: &str| {
            if !text.is_empty() {
                let _ = writeln!(out, "   {label:<11} {}", wrapped(text, INDENT, INDENT));
            }
        };
        line("where", &step.round.place.words());
        line("terms", &summaries(&step.added.terms, &step.after.model.layout).join(", "));
        for parameter in &step.added.parameters {
            line("", &parameter_words(parameter));
        }
        line("gap", &fall_words(&step.before.gap, &step.after.gap, unit, tested));
        const SHOWN: usize = 6;
        let alternatives: Vec<&Candidate> = step.alternatives().collect();
        for candidate in alternatives.iter().take(SHOWN) {
            line("rather than", &alternative_words(candidate, step.candidate, unit));
        }
        if alternatives.len() > SHOWN {
            line("", &format!("and {} others, which fit worse", alternatives.len() - SHOWN));
        }
        let alike: Vec<&str> = step.indistinguishable().iter().map(|c| c.title.as_str()).collect();
        if !alike.is_empty() {
            line("or else", &format!("{}: these data cannot tell.", alike.join("; ")));
        }
        line("next", step.round.next_experiment.as_ref().map_or("", |next| &next.text));
    }
    if !steps.is_empty() {
        let _ = write!(out, "\nWith what was added\n{}", equations::text(&last.model, Some(&units(&last.model))));
        let _ = writeln!(out, "gap: {}", gap_words(&last.gap, unit, tested));
    }
    if let Some(description) = &diagnosis.description {
        let _ = writeln!(out, "\n{DESCRIPTION}");
        let _ = writeln!(out, "{}", wrapped(&description_words(description, unit, tested), 0, 0));
        let model = &description.stage.model;
        let _ = write!(out, "{}", equations::text(model, Some(&units(model))));
        let _ = writeln!(out, "gap: {}", gap_words(&description.stage.gap, unit, tested));
    }
    let mut say = |text: &str| {
        let _ = writeln!(out, "{}", wrapped(text, 0, 0));
    };
    say(&format!("\nVerdict: {}. {}", diagnosis.verdict.word().replace('_', " "), diagnosis.sentence));
    if let Some(unnamed) = unnamed(diagnosis) {
        say(&format!("The gap that is left: {}", unnamed.place.words()));
        const SHOWN: usize = 3;
        for candidate in unnamed.candidates.iter().filter(|c| c.stage.is_some()).take(SHOWN) {
            say(&format!("– {}: {}", candidate.title, candidate.why));
        }
    }
    say(&remaining(diagnosis));
    for text in superseded(diagnosis).into_iter().chain(not_shown(diagnosis)) {
        say(&text);
    }
    for notice in of_files.iter().copied().chain(diagnosis.notices.iter().map(String::as_str)) {
        say(&format!("Note. {}", sentence(notice)));
    }
    out
}

/// Width of a line for a terminal.
const COLUMNS: usize = 110;

/// Words in lines that a terminal shows whole, all but the first moved in by `indent`.
fn wrapped(text: &str, used: usize, indent: usize) -> String {
    let mut out = String::new();
    let mut width = used;
    for word in text.split(' ') {
        let length = word.chars().count();
        if width + 1 + length > COLUMNS && width > indent {
            out.push('\n');
            out.push_str(&" ".repeat(indent));
            width = indent;
        } else if !out.is_empty() {
            out.push(' ');
            width += 1;
        }
        out.push_str(word);
        width += length;
    }
    out
}

/// What a formula for what is left is headed by.
const DESCRIPTION: &str = "A description, not a law";

/// What a formula adds, what it stays beside, and why it stands.
fn description_words(description: &Description, unit: &str, tested: &str) -> String {
    let beside = match description.beside.as_slice() {
        [] => "the base model".to_owned(),
        names => format!("the base model and {}", names.join(", ").replace('_', " ")),
    };
    let lead = &description.lead;
    let against = match lead.against.as_str() {
        "none" => "the base model alone".to_owned(),
        names => names.replace('_', " "),
    };
    let closes = match description.closes {
        true => "What it leaves is noise, or too little to matter.",
        false => "More than noise is left.",
    };
    let alike: Vec<String> = description.alternatives.iter().map(|terms| terms.join(" and ")).collect();
    let alike = match alike.is_empty() {
        true => String::new(),
        false => format!(" These data cannot tell it from {}.", alike.join("; ")),
    };
    format!(
        "No effect of the catalogue closes the gap. The shortest formula that follows the missing force, beside {beside}: {}. \
         The gap with it: {}. Of {} blocks that were never fitted {} are predicted better than by {against}; log density \
         +{} ± {}. {closes}{alike}",
        description.terms.join(" and "),
        gap_words(&description.stage.gap, unit, tested),
        lead.blocks,
        lead.won,
        significant(lead.difference, 2),
        significant(lead.std_error, 2)
    )
}

/// Terms as the equations show them, their numbers with five digits.
fn summaries(terms: &[String], layout: &Layout) -> Vec<String> {
    let summary = |text: &String| Term::parse(text).map_or_else(|_| text.clone(), |term| term.summary(layout));
    terms.iter().map(summary).collect()
}

/// The last round, if it left a gap without a name.
fn unnamed(diagnosis: &Diagnosis) -> Option<&Round> {
    diagnosis.rounds.last().filter(|r| r.finding == Finding::Unexplained)
}

fn outcome_words(finding: &Finding) -> &'static str {
    match finding {
        Finding::Nothing => "nothing more is missing",
        Finding::Named | Finding::Ambiguous(_) => "an effect that a later one made superfluous",
        Finding::Unexplained => "a gap without a name",
    }
}

/// How the figures on data that were not fitted are called.
fn tested(diagnosis: &Diagnosis) -> &'static str {
    if diagnosis.has_held_out() { "held out" } else { "left out in turn" }
}

fn tiles(diagnosis: &Diagnosis, base: &Stage, last: &Stage, unit: &str) -> Vec<Tile> {
    let rmse = |s: &Stage| s.gap.test_rmse.unwrap_or(s.gap.train_rmse);
    let of = if base.gap.test_rmse.is_some() { "RMSE on data never fitted" } else { "RMSE on the fitted data" };
    let mut tiles = vec![
        Tile { label: "Verdict", value: diagnosis.verdict.word().replace('_', " "), note: effects(last) },
        Tile { label: "Gap of the base model", value: format_si(rmse(base), unit, 3), note: of.into() },
    ];
    if last.effects.is_empty() {
        tiles.push(noise_tile(diagnosis, unit));
        return tiles;
    }
    let times = format!("{} times smaller", significant(rmse(base) / rmse(last), 2));
    tiles.push(Tile { label: "With what was added", value: format_si(rmse(last), unit, 3), note: times });
    tiles.push(noise_tile(diagnosis, unit));
    tiles
}

fn effects(stage: &Stage) -> String {
    match stage.effects.len() {
        0 => "no effect added".into(),
        1 => "one effect added".into(),
        n => format!("{n} effects added"),
    }
}

fn noise_tile(diagnosis: &Diagnosis, unit: &str) -> Tile {
    Tile {
        label: "Measurement noise",
        value: format_si(diagnosis.noise_floor, unit, 2),
        note: "standard deviation".into(),
    }
}

fn round_blocks(round: &Round, step: Option<&Step<'_>>, unit: &str, tested: &'static str) -> Vec<Block> {
    let mut blocks = Vec::new();
    if round.evidence.significant {
        blocks.push(Block::Paragraph(format!(
            "The gap is more than noise ({}). Where it sits: {}",
            p_words(round.evidence.p_value),
            round.place.words()
        )));
    } else {
        blocks.push(Block::Paragraph(format!("What is left is noise ({}).", no_gap(round.evidence.p_value))));
    }
    if let Some(step) = step {
        blocks.push(Block::Paragraph(format!(
            "{}. {}",
            step.candidate.explanation.trim_end_matches('.'),
            step.candidate.why
        )));
        let parameters = &step.added.parameters;
        if !parameters.is_empty() {
            blocks.push(Block::Table(parameter_table(parameters)));
        }
        blocks.extend(drawings::curve(&step.candidate.curve, &step.added.title, unit).map(Block::Figure));
        let index = step.before.effects.len();
        blocks.extend(round.lead.as_ref().and_then(|lead| drawings::why(lead, index)).map(Block::Figure));
        let alike: Vec<&str> = step.indistinguishable().iter().map(|c| c.title.as_str()).collect();
        if !alike.is_empty() {
            let text = format!("These data cannot tell it from: {}.", alike.join(", "));
            blocks.push(Block::Warnings(vec![(Severity::Caution, text)]));
        }
    }
    if let Some(next) = &round.next_experiment {
        blocks.push(Block::Paragraph(format!("Next experiment: {}", next.text)));
    }
    if round.evidence.significant {
        blocks.extend(candidates(round, unit, tested));
    }
    blocks
}

/// Why there is no gap, with the level that it was held against.
fn no_gap(p: f64) -> String {
    let level = CONSTANTS.level;
    if p < level {
        return p_words(p);
    }
    format!("{}; a gap counts below 10{}", p_words(p), superscript(level.log10().round() as i32))
}

fn p_words(p: f64) -> String {
    match p {
        p if p < 1e-6 => "p below 10⁻⁶".into(),
        p => format!("p = {}", significant_trimmed(p, 2)),
    }
}

fn parameter_table(parameters: &[Parameter]) -> DocumentTable {
    let numbers: Vec<String> = parameters.iter().map(|p| format_measured(p.value, p.std_error)).collect();
    let rows = parameters
        .iter()
        .zip(align_at_point(&numbers))
        .map(|(p, number)| vec![Cell::Text(p.name.clone()), Cell::Number(number), Cell::Text(raised(&p.unit))]);
    DocumentTable { head: vec!["quantity", "value ± std. error", "unit"], rows: rows.collect() }
}

/// The refitted candidates as a table, the others in a sentence.
fn candidates(round: &Round, unit: &str, tested: &'static str) -> Vec<Block> {
    let refitted: Vec<(&Candidate, &Gap)> =
        round.candidates.iter().filter_map(|c| Some((c, &c.stage.as_ref()?.gap))).collect();
    let mut blocks = Vec::new();
    if !refitted.is_empty() {
        let largest = refitted.iter().flat_map(|(_, g)| [Some(g.train_rmse), g.test_rmse]).flatten();
        let scale = Scale::suited(largest.filter(|v| v.is_finite()).fold(0.0, f64::max), unit);
        let column = |value: &dyn Fn(&Candidate, &Gap) -> String| {
            align_at_point(&refitted.iter().map(|(c, g)| value(c, g)).collect::<Vec<_>>())
        };
        let bic =
            column(&|c, _| if c.delta_bic.is_finite() { significant_trimmed(c.delta_bic, 3) } else { "–".into() });
        let rmse = column(&|_, g| scale.format(g.test_rmse.unwrap_or(g.train_rmse), 3));
        let rows = refitted.iter().enumerate().map(|(k, (c, _))| {
            let why = c.refusal().map_or_else(|| c.why.clone(), |reason| format!("Refused: {reason}."));
            vec![
                Cell::Text(c.title.clone()),
                Cell::Number(bic[k].clone()),
                Cell::Number(rmse[k].clone()),
                Cell::Text(why),
            ]
        });
        blocks
            .push(Block::Table(DocumentTable {
                head: vec!["candidate", "ΔBIC", tested, "why"], rows: rows.collect()
            }));
    }
    let screened: Vec<&str> = round
        .candidates
        .iter()
        .filter(|c| c.stage.is_none() && !matches!(c.standing, Standing::NotShown(_)))
        .map(|c| c.title.as_str())
        .collect();
    if !screened.is_empty() {
        let text =
            format!("Only screened along the measured motion, where they explain less: {}.", screened.join("; "));
        blocks.push(Block::Paragraph(text));
    }
    blocks
}

fn remaining(diagnosis: &Diagnosis) -> String {
    let remaining = &diagnosis.remaining;
    let left = match remaining.significant {
        true => "Remaining gap",
        // Little more than noise, or steps of the sensor, is no gap however small the probability.
        false if remaining.p_value < CONSTANTS.level => "What is left is hardly more than noise",
        false if diagnosis.explained => "What is left is noise",
        false => "What is left of the data fitted is noise",
    };
    let p = if remaining.significant { p_words(remaining.p_value) } else { no_gap(remaining.p_value) };
    format!("{left} ({p}). {}", remaining.note).trim_end().to_owned()
}

fn superseded(diagnosis: &Diagnosis) -> Option<String> {
    let gone = diagnosis.superseded();
    (!gone.is_empty())
        .then(|| format!("Added, and dropped again when a later effect did its work: {}.", gone.join(", ")))
}

/// The effects that the data cannot show, by reason.
fn not_shown(diagnosis: &Diagnosis) -> Option<String> {
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for blind in &diagnosis.blind {
        let name = blind.effect.replace('_', " ");
        match reasons.iter_mut().find(|(reason, _)| *reason == blind.reason) {
            Some((_, names)) => names.push(name),
            None => reasons.push((&blind.reason, vec![name])),
        }
    }
    let parts: Vec<String> = reasons.iter().map(|(reason, names)| format!("{} ({reason})", names.join(", "))).collect();
    (!parts.is_empty()).then(|| format!("These data cannot show: {}.", parts.join("; ")))
}

fn parameter_words(parameter: &Parameter) -> String {
    let number = format_measured(parameter.value, parameter.std_error).replace('−', "-");
    format!("{} = {number} {}", parameter.name, raised(&parameter.unit)).trim_end().to_owned()
}

/// `fitted 12.0 µm (1.20 %), held out 15.0 µm (1.50 %)`.
fn gap_words(gap: &Gap, unit: &str, tested: &str) -> String {
    let one = |rmse: f64, nrmse: f64| format!("{} ({} %)", format_si(rmse, unit, 3), significant(100.0 * nrmse, 3));
    let mut text = format!("fitted {}", one(gap.train_rmse, gap.train_nrmse));
    if let Some(rmse) = gap.test_rmse {
        let _ = write!(text, ", {tested} {}", one(rmse, gap.test_nrmse.unwrap_or(f64::NAN)));
    }
    text
}

fn fall_words(before: &Gap, after: &Gap, unit: &str, tested: &str) -> String {
    let one = |before: f64, after: f64| {
        let times = match before / after {
            t if !t.is_finite() => String::new(),
            t if t >= 1.0 => format!(" ({} times smaller)", significant(t, 2)),
            t => format!(" ({} times larger)", significant(t.recip(), 2)),
        };
        format!("{} → {}{times}", format_si(before, unit, 3), format_si(after, unit, 3))
    };
    let mut text = format!("fitted {}", one(before.train_rmse, after.train_rmse));
    if let (Some(before), Some(after)) = (before.test_rmse, after.test_rmse) {
        let _ = write!(text, ", {tested} {}", one(before, after));
    }
    text
}

fn alternative_words(candidate: &Candidate, named: &Candidate, unit: &str) -> String {
    let rmse = candidate.stage.as_ref().map(|s| s.gap.test_rmse.unwrap_or(s.gap.train_rmse));
    let rmse = rmse.map_or_else(String::new, |r| format!(", {}", format_si(r, unit, 3)));
    let difference = candidate.delta_bic - named.delta_bic;
    // Less than a tenth is nothing.
    let difference = match significant_trimmed(difference, 3) {
        _ if difference.abs() < 0.1 => "0".to_owned(),
        text if difference > 0.0 => format!("+{text}"),
        text => text,
    };
    let refused = candidate.refusal().map_or_else(String::new, |reason| format!("; refused: {reason}"));
    format!("{} (ΔBIC {difference}{rmse}{refused})", candidate.title)
}
