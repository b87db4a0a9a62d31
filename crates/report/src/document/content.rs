//! What a report says, in order, whatever it is written as.

use super::math::{self, EquationRows, Math};
use super::report::Report;
use crate::figure::svg::Drawing;
use sindyscope_core::study::{Differentiation, Formulation, Outcome, SETTINGS, Score, Severity, setting};
use sindyscope_values::format::equations::{by_share, is_kinematic};
use sindyscope_values::format::number::{align_at_point, format_measured, significant, significant_trimmed};
use sindyscope_values::format::units::{Scale, format_si, raised};
use sindyscope_values::format::words::capitalised;
use sindyscope_values::model::{Mode, Model, Units};
use sindyscope_values::record::Usage;
use sindyscope_values::term::{Kind, Symbol, Term};

/// A piece of the document.
pub(super) enum Block {
    Title { title: String, subtitle: String },
    Tiles(Vec<Tile>),
    Warnings(Vec<(Severity, String)>),
    Heading(String),
    Subheading(String),
    Paragraph(String),
    Equations(Vec<EquationRows>),
    Table(DocumentTable),
    Figure(Drawing),
    Command(String),
}

/// One figure in large type.
pub(super) struct Tile {
    pub(super) label: &'static str,
    pub(super) value: String,
    pub(super) note: String,
}

pub(super) struct DocumentTable {
    /// Empty if the table needs no head.
    pub(super) head: Vec<&'static str>,
    pub(super) rows: Vec<Vec<Cell>>,
}

pub(super) enum Cell {
    Text(String),
    /// Of fixed width; numbers of a column are padded to stand below each other.
    Number(String),
    Formula(Math),
    /// A share of the whole, 0 to 1.
    Share(f64),
}

/// The title, and what the study was made from.
pub(super) fn title(title: &str, outcome: &Outcome) -> Block {
    Block::Title { title: title.to_owned(), subtitle: subtitle(outcome) }
}

/// The errors in large type, and the warnings.
pub(super) fn summary_blocks(outcome: &Outcome) -> Vec<Block> {
    let mut blocks = vec![Block::Tiles(tiles(outcome, displacement_unit(outcome)))];
    if !outcome.warnings.is_empty() {
        blocks.push(Block::Warnings(outcome.warnings.iter().map(|w| (w.severity, sentence(&w.text))).collect()));
    }
    blocks
}

/// Physical parameters, and the modes of several masses.
pub(super) fn parameters(outcome: &Outcome) -> Vec<Block> {
    let mut blocks = physical(outcome);
    blocks.extend(modes(outcome));
    blocks
}

/// What a terminal says beside the equations.
pub(super) fn summary(report: &Report<'_>) -> Vec<Block> {
    let outcome = report.outcome;
    let unit = displacement_unit(outcome);
    let mut blocks = vec![Block::Table(errors(outcome, unit))];
    if let Some(noise) = outcome.noise_floor {
        blocks.push(Block::Paragraph(format!(
            "noise floor {} (standard deviation, estimated)",
            format_si(noise, unit, 2)
        )));
    }
    for record in &outcome.records {
        if let Some(t) = record.diverged_at {
            let text = format!(
                "record {}: the response left the data's range at t = {} s",
                record.record.name,
                significant(t, 4)
            );
            blocks.push(Block::Paragraph(text));
        }
    }
    blocks.extend(parameters(outcome));
    blocks.push(Block::Heading("Settings".into()));
    blocks.push(Block::Table(settings(outcome)));
    blocks.extend(report.choice.map(|reason| Block::Paragraph(sentence(reason))));
    let notices = notices(report);
    if !notices.is_empty() {
        blocks.push(Block::Heading("Data".into()));
        blocks.extend(notices.into_iter().map(Block::Paragraph));
    }
    if !outcome.warnings.is_empty() {
        blocks.push(Block::Heading("To know".into()));
        blocks.push(Block::Warnings(outcome.warnings.iter().map(|w| (w.severity, sentence(&w.text))).collect()));
    }
    blocks
}

/// The unit of what the first sensor shows; errors are in it.
pub(super) fn displacement_unit(outcome: &Outcome) -> &str {
    outcome.records.first().and_then(|r| r.record.sensor(0)).map_or("", |c| c.unit.as_str())
}

fn subtitle(outcome: &Outcome) -> String {
    let count = |usage| outcome.records.iter().filter(|r| r.usage == usage).count();
    let records = |n: usize| if n == 1 { "1 record".to_owned() } else { format!("{n} records") };
    let mut text = format!("Identified by sparse regression from {}", records(count(Usage::Fit)));
    match count(Usage::HeldOut) {
        0 => text.push_str("; none held out"),
        n => text.push_str(&format!("; checked on {} never fitted", records(n))),
    }
    text
}

fn tiles(outcome: &Outcome, unit: &str) -> Vec<Tile> {
    let mut tiles = Vec::new();
    if let Some(t) = outcome.records.iter().filter_map(|r| r.diverged_at).min_by(f64::total_cmp) {
        let at = format!("at t = {} s", significant(t, 4));
        tiles.push(Tile { label: "The response", value: "diverged".into(), note: at });
    }
    let mut score = |label, score: Option<Score>| {
        if let Some(score) = score {
            tiles.push(Tile {
                label,
                value: format_si(score.rmse, unit, 3),
                note: format!("RMSE; best fit {} %", percent(score.best_fit)),
            });
        }
    };
    score("Held-out error", outcome.test);
    score("Error on the fitted data", outcome.train);
    if let Some(noise) = outcome.noise_floor {
        let note = "standard deviation, estimated".into();
        tiles.push(Tile { label: "Measurement noise", value: format_si(noise, unit, 2), note });
    }
    tiles
}

/// A best fit with the digits that tell good from better: 99.98.
pub(super) fn percent(value: f64) -> String {
    let off = (100.0 - value).abs();
    let digits = if off > 0.0 && off < 10.0 { 3 + (-off.log10()).ceil().clamp(0.0, 6.0) as usize } else { 3 };
    significant(value, digits)
}

/// The coefficients of what was identified, with what was tried and dropped.
pub(super) fn identified(outcome: &Outcome) -> Vec<Block> {
    let mut blocks = coefficients(&outcome.model, &outcome.units(), |state| fit_sentence(outcome, state));
    if outcome.model.layout.kind == Kind::SecondOrder {
        blocks.push(Block::Paragraph(
            "Dots are time derivatives, v is the velocity. The share is the term's RMS over the fitted samples, of the sum over all \
             terms."
                .into(),
        ));
    }
    blocks
}

/// A table of the coefficients of each equation, known kinematics left out, with what is to be said beneath it.
pub(super) fn coefficients(model: &Model, units: &Units, beneath: impl Fn(Symbol) -> Option<String>) -> Vec<Block> {
    let mut blocks = Vec::new();
    let identified: Vec<_> = model.iter().filter(|(s, e)| !is_kinematic(model, *s, e)).collect();
    for (state, equation) in &identified {
        let terms = by_share(equation);
        let numbers: Vec<String> = terms.iter().map(|t| format_measured(t.coefficient, t.std_error)).collect();
        let shares = terms.iter().any(|t| t.share > 0.0);
        let rows = terms.iter().zip(align_at_point(&numbers)).map(|(term, number)| {
            let unit = units.coefficient(*state, &term.term);
            let mut row = vec![
                Cell::Formula(math::term(&term.term, &model.layout)),
                Cell::Text(term.term.text(&model.layout)),
                Cell::Number(number),
                Cell::Text(unit.map_or_else(String::new, |u| raised(&u))),
            ];
            row.extend(shares.then_some(Cell::Share(term.share)));
            row
        });
        if identified.len() > 1 {
            blocks.push(Block::Paragraph(format!("Terms of d{}/dt:", model.layout.name(*state))));
        }
        let mut head = vec!["term", "as typed", "coefficient ± std. error", "unit"];
        head.extend(shares.then_some("share of the rate"));
        blocks.push(Block::Table(DocumentTable { head, rows: rows.collect() }));
        blocks.extend(beneath(*state).map(Block::Paragraph));
    }
    blocks
}

/// The coefficients in the words of mechanics.
fn physical(outcome: &Outcome) -> Vec<Block> {
    let found = outcome.physical();
    if found.is_empty() {
        return Vec::new();
    }
    let numbers: Vec<String> = found.iter().map(|p| format_measured(p.value, p.std_error)).collect();
    let rows = found
        .iter()
        .zip(align_at_point(&numbers))
        .map(|(p, number)| {
            vec![
                Cell::Text(p.symbol.to_string()),
                Cell::Number(number),
                Cell::Text(if p.unit.is_empty() { "1".into() } else { raised(&p.unit) }),
                Cell::Text(p.title.into()),
            ]
        })
        .collect();
    vec![
        Block::Subheading("Physical parameters".into()),
        Block::Table(DocumentTable { head: vec!["parameter", "value ± std. error", "unit", ""], rows }),
    ]
}

/// Natural frequencies, damping ratios and shapes of several masses; those of one are among its parameters.
fn modes(outcome: &Outcome) -> Vec<Block> {
    let found = outcome.modes();
    if outcome.model.layout.freedoms < 2 || found.is_empty() {
        return Vec::new();
    }
    let column = |of: &dyn Fn(&Mode) -> String| align_at_point(&found.iter().map(of).collect::<Vec<_>>());
    let frequencies = column(&|m| format_measured(m.frequency, m.frequency_error));
    let dampings = column(&|m| format_measured(m.damping, m.damping_error));
    let swing = |m: &Mode| -> String {
        let one = |i: usize| {
            let size = format_measured(m.shape[i], m.shape_error[i]);
            let degrees = m.phase[i].to_degrees();
            if degrees.abs() < 0.5 { size } else { format!("{size} ({} °)", significant(degrees, 2)) }
        };
        (0..m.shape.len()).map(one).collect::<Vec<_>>().join(", ")
    };
    let rows = found
        .iter()
        .enumerate()
        .map(|(k, mode)| {
            vec![
                Cell::Number(frequencies[k].clone()),
                Cell::Text("Hz".into()),
                Cell::Number(dampings[k].clone()),
                Cell::Text(swing(mode)),
            ]
        })
        .collect();
    vec![
        Block::Subheading("Natural modes of the linear part, at rest".into()),
        Block::Table(DocumentTable {
            head: vec!["frequency ± std. error", "", "damping ratio", "shape (phase)"],
            rows,
        }),
    ]
}

/// What was tried and dropped, and how well the rate is explained.
fn fit_sentence(outcome: &Outcome, state: Symbol) -> Option<String> {
    let layout = &outcome.model.layout;
    let fit = outcome.fits.iter().find(|f| f.state == state)?;
    let mut sentences = Vec::new();
    if fit.rate_rms > 0.0 && fit.residual_rms.is_finite() {
        sentences.push(format!(
            "The equation leaves {} % of d{}/dt (RMS) unexplained.",
            significant_trimmed(100.0 * fit.residual_rms / fit.rate_rms, 2),
            layout.name(state)
        ));
    }
    if !fit.dropped.is_empty() {
        let names: Vec<String> = fit
            .dropped
            .iter()
            .map(|d| match d.fell_at {
                Some(threshold) => format!("{} (at {})", d.term.pretty(layout), significant_trimmed(threshold, 2)),
                None => format!("{} (locked out)", d.term.pretty(layout)),
            })
            .collect();
        sentences.push(format!("Tried and dropped: {}.", names.join(", ")));
    }
    (!sentences.is_empty()).then(|| sentences.join(" "))
}

pub(super) fn errors(outcome: &Outcome, unit: &str) -> DocumentTable {
    let scores: Vec<(String, &str, Option<Score>)> = outcome
        .records
        .iter()
        .flat_map(|r| r.channels.iter().map(move |c| (r, c)))
        .map(|(r, c)| {
            let name = if r.channels.len() > 1 {
                format!("{}, {}", r.record.name, c.name(&outcome.model.layout))
            } else {
                r.record.name.clone()
            };
            (name, usage(r.usage), c.score)
        })
        .collect();
    let pooled = [("all fitted", Usage::Fit, outcome.train), ("all held out", Usage::HeldOut, outcome.test)]
        .into_iter()
        .filter(|(_, usage, _)| outcome.records.iter().filter(|r| r.usage == *usage).count() > 1)
        .map(|(name, usage_, score)| (name.to_owned(), usage(usage_), score));
    let scores: Vec<_> = scores.into_iter().chain(pooled).collect();
    let largest = scores.iter().filter_map(|s| s.2).map(|s| s.max_error).filter(|e| e.is_finite()).fold(0.0, f64::max);
    let scale = Scale::suited(largest, unit);
    let column = |value: &dyn Fn(&Score) -> String| -> Vec<String> {
        align_at_point(&scores.iter().map(|s| s.2.as_ref().map_or_else(|| "–".into(), value)).collect::<Vec<_>>())
    };
    let rmse = column(&|s| scale.format(s.rmse, 3));
    let nrmse = column(&|s| format!("{} %", significant(100.0 * s.nrmse, 3)));
    let most = column(&|s| scale.format(s.max_error, 3));
    let fit = column(&|s| format!("{} %", percent(s.best_fit)));
    let samples = column(&|s| s.samples.to_string());
    let rows = scores
        .iter()
        .enumerate()
        .map(|(k, (name, usage, _))| {
            let mut row = vec![Cell::Text(name.clone()), Cell::Text((*usage).into())];
            row.extend([&rmse, &nrmse, &most, &fit, &samples].map(|c| Cell::Number(c[k].clone())));
            row
        })
        .collect();
    DocumentTable { head: vec!["record", "", "RMSE", "NRMSE", "largest error", "best fit", "samples"], rows }
}

fn usage(usage: Usage) -> &'static str {
    match usage {
        Usage::Fit => "fitted",
        Usage::HeldOut => "held out",
        Usage::Off => "left out",
    }
}

pub(super) fn data(report: &Report<'_>) -> DocumentTable {
    let entries = &report.records.entries;
    let column = |value: &dyn Fn(&sindyscope_values::record::Record) -> String| {
        align_at_point(&entries.iter().map(|(r, _)| value(r)).collect::<Vec<_>>())
    };
    let samples = column(&|r| r.len().to_string());
    let rate = column(&|r| format!("{} Hz", significant_trimmed(1.0 / r.interval, 5)));
    let duration = column(&|r| format!("{} s", significant_trimmed(r.duration(), 4)));
    let rows = entries
        .iter()
        .enumerate()
        .map(|(k, (record, used))| {
            let channels: Vec<String> =
                record.channels.iter().map(|c| Scale::plain(raised(&c.unit)).axis(&c.name)).collect();
            let file = record.source.as_ref().and_then(|p| p.file_name()).map(|f| f.to_string_lossy().into_owned());
            vec![
                Cell::Text(record.name.clone()),
                Cell::Text(file.unwrap_or_default()),
                Cell::Text(usage(*used).into()),
                Cell::Number(samples[k].clone()),
                Cell::Number(rate[k].clone()),
                Cell::Number(duration[k].clone()),
                Cell::Text(channels.join(", ")),
            ]
        })
        .collect();
    DocumentTable { head: vec!["record", "file", "used", "samples", "rate", "duration", "channels"], rows }
}

/// A text with a capital in front and a full stop behind.
pub(super) fn sentence(text: &str) -> String {
    let text = text.trim();
    let mut out = capitalised(text);
    if !text.ends_with(['.', '!', '?']) {
        out.push('.');
    }
    out
}

/// What was found and done while reading; a sentence that holds for several records is said once.
pub(super) fn notices(report: &Report<'_>) -> Vec<String> {
    let mut seen: Vec<(&str, Vec<&str>)> = Vec::new();
    for (record, _) in &report.records.entries {
        for notice in &record.notices {
            match seen.iter_mut().find(|(text, _)| text == notice) {
                Some((_, names)) => names.push(&record.name),
                None => seen.push((notice, vec![&record.name])),
            }
        }
    }
    let every = report.records.entries.len();
    seen.into_iter()
        .map(|(text, names)| match names.len() {
            n if n == every => sentence(text),
            n if n > 4 => format!("{n} records: {}", sentence(text)),
            _ => format!("{}: {}", names.join(", "), sentence(text)),
        })
        .collect()
}

/// The settings, row by row as their table has them, with what came of those that tell it.
pub(super) fn settings(outcome: &Outcome) -> DocumentTable {
    let layout = &outcome.model.layout;
    let mut rows = vec![(setting("differentiation").title, differentiation(outcome))];
    for setting in SETTINGS {
        rows.extend((setting.describe)(&outcome.settings, layout).map(|text| (setting.title, text)));
        if setting.name == "threshold" {
            rows.extend(came_of_regression(outcome));
        }
    }
    let rows = rows.into_iter().map(|(name, value)| vec![Cell::Text(name.into()), Cell::Text(value)]).collect();
    DocumentTable { head: Vec::new(), rows }
}

/// How the refinement ended, and how likely each term belongs, where there are such.
fn came_of_regression(outcome: &Outcome) -> Vec<(&'static str, String)> {
    let layout = &outcome.model.layout;
    let mut rows = Vec::new();
    if let Some(refinement) = &outcome.refinement {
        let ended = if refinement.converged { "" } else { ", ended before it came to rest" };
        let text = format!("coefficients fitted to the response itself (output error){ended}");
        rows.push((setting("refine").title, text));
    }
    for fit in outcome.fits.iter().filter(|f| !f.probability.is_empty()) {
        let said = |(term, p): &(Term, f64)| format!("{} {p:.2}", term.pretty(layout));
        rows.push(("terms' probabilities", fit.probability.iter().map(said).collect::<Vec<_>>().join(", ")));
    }
    rows
}

/// The smoothing in samples, milliseconds and share of the main period.
pub(super) fn differentiation(outcome: &Outcome) -> String {
    let smoothing = outcome.settings.smoothing;
    if smoothing.method == Differentiation::Difference {
        return "central differences of the measured samples, no smoothing".into();
    }
    let mut text = if smoothing.method.is_local() {
        format!("Savitzky–Golay, segment {} samples", smoothing.window)
    } else {
        let length = outcome.records.first().map_or(0.0, |r| r.signals.length);
        let whence = if smoothing.from_data { " (from the data)" } else { "" };
        let length = significant_trimmed(length, 3);
        format!("{}, half the amplitude passes at a period of {length} samples{whence}", smoothing.method.title())
    };
    if let Some(record) = outcome.records.first() {
        let samples =
            if smoothing.method.is_local() { smoothing.window.saturating_sub(1) as f64 } else { record.signals.length };
        let length = record.record.interval * samples;
        text.push_str(&format!(" = {}", format_si(length, "s", 3)));
        if let Some(period) = record.signals.main_period.filter(|p| *p > 0.0) {
            text.push_str(&format!(" = {} main periods", significant_trimmed(length / period, 2)));
        }
    }
    if smoothing.method.is_local() {
        text.push_str(&format!(", order {}", smoothing.order));
    }
    match smoothing.method {
        Differentiation::Filter => text.push_str(", differentiated by the filter"),
        Differentiation::SmoothThenDifference => text.push_str(", then central differences"),
        _ => {}
    }
    if let Formulation::Weak { half_width } = outcome.settings.form {
        text.push_str("; equation in the weak form: averages over test functions");
        if let Some(half_width) = half_width {
            text.push_str(&format!(" of half width {half_width} samples"));
        }
        text.push_str(", whitened for the sensors' noise");
        return text;
    }
    if smoothing.filter_library && smoothing.method != Differentiation::TotalVariation {
        text.push_str("; every library column passed through the same filter");
    }
    if outcome.settings.form == Formulation::Integral {
        text.push_str("; equation integrated once over time");
    }
    text
}
