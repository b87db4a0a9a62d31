//! Textbook oscillators identified without help, three seeds each with noise of 0.5 to 1 % of the motion: the terms found,
//! beside plain thresholded regression over products to degree 3 at the threshold that does best of all.
//! `cargo run --profile study -p sindyscope-core --example textbook [-- NAME …]`.

mod plants;

use std::time::Instant;

use plants::{PLANTS, Plant, records};
use sindyscope_core::study::{Cancel, FreeSettings, Outcome, Scaling, Settings, Study, choose, suggest};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::{Kind, Symbol, Term, polynomials};

/// Noise of each seed, as a share of the motion.
const NOISE: [f64; 3] = [0.005, 0.0075, 0.01];
/// Thresholds that the plain regression tries, from the smallest to the largest.
const THRESHOLDS: (f64, f64, usize) = (1e-3, 1.0, 61);

/// Terms with coefficients, in one order.
fn found(outcome: &Outcome) -> Vec<(Term, f64)> {
    let terms = outcome.model.leading().map(|e| e.terms.as_slice()).unwrap_or_default();
    let mut found: Vec<(Term, f64)> = terms.iter().map(|t| (t.term.clone(), t.coefficient)).collect();
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found
}

/// The largest relative error of a coefficient, if exactly the true terms are there.
fn error(found: &[(Term, f64)], plant: &Plant) -> Option<f64> {
    let mut truth: Vec<(Term, f64)> = plant.truth.iter().map(|(t, c)| (Term::parse(t).expect("a term"), *c)).collect();
    truth.sort_by(|a, b| a.0.cmp(&b.0));
    let same = found.len() == truth.len() && found.iter().zip(&truth).all(|(a, b)| a.0 == b.0);
    same.then(|| found.iter().zip(&truth).map(|(a, b)| (a.1 / b.1 - 1.0).abs()).fold(0.0, f64::max))
}

/// What plain regression over all products to degree 3 finds at the threshold that comes nearest to the truth.
fn plain(records: &RecordSet, plant: &Plant) -> Option<f64> {
    let mut settings = suggest(records, Kind::SecondOrder).expect("settings");
    let layout = records.entries[0].0.layout(Kind::SecondOrder);
    let mut symbols = vec![Symbol::State(0), Symbol::Rate(0)];
    symbols.extend((0..layout.inputs).map(Symbol::Input));
    settings.terms = polynomials(&symbols, 3, true);
    settings.terms.push(Term::parse("1").expect("a term"));
    settings.scaling = Scaling::Raw;
    settings.refine = false;
    let (low, high, count) = THRESHOLDS;
    let mut study = Study::default();
    let fitted = RecordSet { entries: vec![records.entries[0].clone()] };
    let tried = (0..count).filter_map(|k| {
        let threshold = low * f64::powf(high / low, k as f64 / (count - 1) as f64);
        let outcome = study.run(&fitted, &Settings { threshold, ..settings.clone() }, &Cancel::default()).ok()?;
        error(&found(&outcome), plant)
    });
    tried.min_by(f64::total_cmp)
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let chosen = |p: &&Plant| wanted.is_empty() || wanted.iter().any(|w| p.name.contains(w.as_str()));
    println!(
        "| system | noise | terms right | coefficients within | held-out error / noise | over s of s | seconds | plain |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let (mut right, mut plainly, mut runs) = (0, 0, 0);
    for plant in PLANTS.iter().filter(chosen) {
        for (seed, noise) in NOISE.into_iter().enumerate() {
            let (set, deviation) = records(plant, noise, seed as u64);
            let started = Instant::now();
            let start = suggest(&set, Kind::SecondOrder).expect("settings");
            let free =
                FreeSettings { window: true, order: true, threshold: true, form: true, refine: true, terms: true };
            let cancel = Cancel::default();
            let choice = choose(&set, &start, free, &cancel, &|_, _| {}).expect("a choice");
            let mut study = Study::default();
            let outcome = study.run(&set, &choice.settings, &cancel).expect("an outcome");
            let horizon = study.horizon(&outcome, Usage::HeldOut, &cancel).expect("an answer");
            let seconds = started.elapsed().as_secs_f64();
            let terms = found(&outcome);
            let own = error(&terms, plant);
            let by_plain = plain(&set, plant);
            runs += 1;
            right += usize::from(own.is_some());
            plainly += usize::from(by_plain.is_some());
            let percent = |e: Option<f64>| e.map_or("no".to_owned(), |e| format!("{:.2} %", 100.0 * e));
            let length = plant.samples as f64 * plant.interval;
            println!(
                "| {} | {:.2} % | {} | {} | {} | {} of {length:.0} | {seconds:.1} | {} |",
                plant.name,
                100.0 * noise,
                if own.is_some() { "yes" } else { "no" },
                percent(own),
                horizon.map_or("–".to_owned(), |h| format!("{:.2}", h.rmse / deviation)),
                horizon.map_or("–".to_owned(), |h| format!("{:.0}", h.seconds)),
                percent(by_plain),
            );
            if own.is_none() {
                let terms: Vec<String> = terms.iter().map(|(t, c)| format!("{c:.3} {t}")).collect();
                println!("  {}\n  {}", terms.join(", "), choice.reason);
            }
        }
    }
    println!("\nterms right in {right} of {runs} runs; plain regression at its best threshold {plainly}");
}
