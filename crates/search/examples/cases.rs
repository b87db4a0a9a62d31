//! Scores a folder of cases, each `NAME/{train.csv,test.csv,truth.json}`:
//! `cargo run --profile study -p sindyscope-search --example cases -- FOLDER [PREFIX …]`.
//!
//! First: the names of the steps are exactly what is hidden. In three: each hidden effect is a step, among the first two
//! alternatives of one, or what one cannot be told from. Wrong: named, and not exactly what is hidden. Proposed: exactly what is
//! hidden is among the first twelve sets that the regression proposes, or is always tried.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use sindyscope_core::study::Cancel;
use sindyscope_files::{ReadOptions, read_files};
use sindyscope_search::{Ask, Diagnosis, ProposedSet, Search, Verdict};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::Term;

/// What a case came to.
struct Score {
    first: bool,
    in_three: bool,
    wrong: bool,
    proposed: bool,
    seconds: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut given = std::env::args().skip(1);
    let folder = given.next().ok_or("give a folder of cases")?;
    let wanted: Vec<String> = given.collect();
    let mut names: Vec<String> = std::fs::read_dir(&folder)?
        .filter_map(|entry| Some(entry.ok()?.file_name().to_string_lossy().into_owned()))
        .filter(|name| wanted.is_empty() || wanted.iter().any(|w| name.starts_with(w.as_str())))
        .collect();
    names.sort();
    let mut scores = Vec::new();
    for name in &names {
        match score(&Path::new(&folder).join(name), name) {
            Ok(score) => scores.push(score),
            Err(error) => println!("{name:48} failed: {error}"),
        }
    }
    let share =
        |of: &dyn Fn(&Score) -> bool| scores.iter().filter(|s| of(s)).count() as f64 / scores.len().max(1) as f64;
    let mut seconds: Vec<f64> = scores.iter().map(|s| s.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    println!(
        "{} cases: first {:.3}, in three {:.3}, wrong {:.3}, proposed {:.3}, median {:.2} s, longest {:.1} s",
        scores.len(),
        share(&|s| s.first),
        share(&|s| s.in_three),
        share(&|s| s.wrong),
        share(&|s| s.proposed),
        seconds.get(seconds.len() / 2).copied().unwrap_or(0.0),
        seconds.last().copied().unwrap_or(0.0),
    );
    Ok(())
}

fn score(folder: &Path, name: &str) -> Result<Score, Box<dyn Error>> {
    let truth: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(folder.join("truth.json"))?)?;
    let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
    let mut hidden: Vec<String> = truth["hidden"].as_array().into_iter().flatten().map(text).collect();
    hidden.retain(|h| h != "nothing_missing");
    hidden.sort();
    let options = ReadOptions::default();
    let mut records = RecordSet::new(read_files(&[folder.join("train.csv")], &options)?, Usage::Fit);
    records.add(read_files(&[folder.join("test.csv")], &options)?, Usage::HeldOut);
    let base: Vec<Term> = text(&truth["base_terms"]).split(',').map(Term::parse).collect::<Result<_, _>>()?;
    let started = Instant::now();
    let search = Search::new(&records, &Ask { base: Some(base), ..Ask::default() })?;
    let found = search.diagnose(&|_| {}, &Cancel::default())?;
    let seconds = started.elapsed().as_secs_f64();
    let (first, in_three) = judged(&found, &hidden);
    let wrong = found.verdict == Verdict::Named && !first;
    let before = hidden.is_empty().then_some(0).or(proposed_before(&search, &hidden)?);
    let names: Vec<String> = found.steps().iter().map(|s| s.added.choice.effect.clone()).collect();
    let noise = truth["noise_sd"].as_f64().unwrap_or(f64::NAN);
    let error = found.stages.last().and_then(|s| s.gap.test_rmse).unwrap_or(f64::NAN) / noise;
    println!(
        "{name:48} {} {} {:20} {} {error:.2} noises {seconds:.2} s, proposed {}",
        if first { "ok" } else { "--" },
        if in_three { "3" } else { "-" },
        found.verdict.word(),
        names.join(", "),
        before.map_or_else(|| "never".to_owned(), |k| format!("{}.", k + 1)),
    );
    Ok(Score { first, in_three, wrong, proposed: before.is_some_and(|k| k < 12), seconds })
}

/// How many sets stand before exactly what is hidden, as [`ProposedSet::before`] counts.
fn proposed_before(search: &Search, hidden: &[String]) -> Result<Option<usize>, Box<dyn Error>> {
    let cancel = Cancel::default();
    let sets = search.proposed(&*search.base(&cancel)?, &cancel)?;
    let is_true = |set: &ProposedSet| {
        let mut names: Vec<&String> = set.effects.iter().map(|(choice, _)| &choice.effect).collect();
        names.sort();
        names.into_iter().eq(hidden)
    };
    Ok(ProposedSet::before(&sets, is_true))
}

/// Whether the steps are exactly what is hidden, and whether each of it is near one.
fn judged(found: &Diagnosis, hidden: &[String]) -> (bool, bool) {
    let steps = found.steps();
    let mut got: Vec<String> = steps.iter().map(|s| s.added.choice.effect.clone()).collect();
    got.sort();
    let near = |wanted: &String| {
        steps.iter().any(|s| {
            s.added.choice.effect == *wanted
                || s.alternatives().take(2).any(|c| c.choice.effect == *wanted)
                || s.indistinguishable().iter().any(|c| c.choice.effect == *wanted)
        })
    };
    let in_three = if hidden.is_empty() { got.is_empty() } else { hidden.iter().all(near) };
    (got == hidden, in_three)
}
