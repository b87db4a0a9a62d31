//! Forces that have no entry in the catalogue, each hidden once in every kind of draw, and whether a description closes the
//! gap; then draws with nothing hidden, in which nothing may be described.
//! `cargo run --profile study -p sindyscope-search --example unnamed [-- DRAWS_OF_NOTHING]`.

mod plants;

use std::time::Instant;

use plants::{Plant, drawn_drive, integrate, records};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use sindyscope_core::study::Cancel;
use sindyscope_search::{Ask, Diagnosis, Search, Verdict};
use sindyscope_values::record::RecordSet;
use sindyscope_values::term::Term;

/// A force per unit of mass over displacement, velocity and input, as it is written and as it is integrated.
struct Unnamed {
    terms: &'static [&'static str],
    force: fn(f64, f64, f64) -> f64,
    /// It needs an input.
    driven: bool,
}

/// A sign that takes a thousandth of the motion to turn: much less than the noise.
fn sign(a: f64) -> f64 {
    (a / 1e-3).tanh()
}

const FORCES: &[Unnamed] = &[
    Unnamed { terms: &["x*v"], force: |x, v, _| -0.15 * x * v, driven: false },
    Unnamed { terms: &["v^2"], force: |_, v, _| -0.12 * v * v, driven: false },
    Unnamed { terms: &["x*v^2"], force: |x, v, _| -0.15 * x * v * v, driven: false },
    Unnamed { terms: &["x*|v|"], force: |x, v, _| -0.15 * x * v.abs(), driven: false },
    Unnamed { terms: &["v^2*sgn(x)"], force: |x, v, _| -0.12 * v * v * sign(x), driven: false },
    Unnamed { terms: &["x*v*|v|"], force: |x, v, _| -0.08 * x * v * v.abs(), driven: false },
    Unnamed { terms: &["x^2*sgn(v)"], force: |x, v, _| -0.08 * x * x * sign(v), driven: false },
    Unnamed { terms: &["v*sin(x)"], force: |x, v, _| -0.15 * x.sin() * v, driven: false },
    Unnamed { terms: &["x*v*u"], force: |x, v, u| 0.4 * x * v * u, driven: true },
    Unnamed { terms: &["x^2*u"], force: |x, _, u| 0.5 * x * x * u, driven: true },
    Unnamed { terms: &["v*u"], force: |_, v, u| 0.5 * v * u, driven: true },
    Unnamed { terms: &["u*|v|"], force: |_, v, u| 0.5 * u * v.abs(), driven: true },
    Unnamed { terms: &["v^2*u"], force: |_, v, u| 0.3 * v * v * u, driven: true },
    Unnamed { terms: &["u^3"], force: |_, _, u| 4.0 * u * u * u, driven: true },
    Unnamed { terms: &["x*u^2"], force: |x, _, u| 1.5 * x * u * u, driven: true },
    Unnamed { terms: &["x*v", "v^2"], force: |x, v, _| -0.15 * x * v - 0.12 * v * v, driven: false },
    Unnamed { terms: &["x*v*u", "x*|v|"], force: |x, v, u| 0.6 * x * v * u - 0.12 * x * v.abs(), driven: true },
    // Beyond what a formula is made of: what describes it is an approximation.
    Unnamed { terms: &["x^2*v^3"], force: |x, v, _| -0.1 * x * x * v * v * v, driven: false },
];

/// A plant of about one radian per second, its records driven by noise-like inputs, by tones, or vibrating freely.
fn plant(force: Option<&'static Unnamed>, draw: usize, seed: u64) -> Plant {
    let mut random = Pcg64::seed_from_u64(seed);
    let stiffness: f64 = random.random_range(0.7..1.4);
    let damping = random.random_range(0.02..0.08);
    let strength = random.random_range(0.7..1.3);
    let drive = |k: u64| drawn_drive(draw, seed, k);
    let free = draw % 3 == 2;
    let push = force.map(|f| f.force);
    let with = |strength: f64| Plant {
        name: "unnamed",
        truth: force.map_or(&[], |f| f.terms),
        base: if free { "x,v" } else { "x,v,u" },
        rates: Box::new(move |_, y, u, _| {
            let hidden = push.map_or(0.0, |f| strength * f(y[0], y[1], u));
            vec![y[1], u - stiffness * y[0] - damping * y[1] + hidden]
        }),
        drives: (0..3).map(drive).collect(),
        initial: if free { vec![vec![1.5, 0.0], vec![0.9, 0.0], vec![1.3, 0.0]] } else { vec![vec![0.0; 2]; 3] },
        interval: 0.12,
        samples: if free { 700 } else { 1500 },
        steps: 40,
        seed,
        ..Plant::default()
    };
    // A force that feeds the motion runs away where it is strong.
    let peak = |plant: &Plant| {
        let each = plant.drives.iter().zip(&plant.initial);
        let motions = each.flat_map(|(drive, y)| integrate(plant, drive.as_ref(), y));
        motions.map(|y| if y[0].is_finite() { y[0].abs() } else { f64::INFINITY }).fold(0.0, f64::max)
    };
    let most = 1.5 * peak(&with(0.0));
    let bounded = |plant: &Plant| peak(plant) < most;
    let strengths = (0..8).map(|k| strength * 0.7_f64.powi(k));
    strengths.map(with).find(bounded).unwrap_or_else(|| with(0.0))
}

/// What the search says, the true noise, and its effort in millions of integration steps.
fn diagnosed(plant: &Plant) -> Result<(Diagnosis, f64, f64), Box<dyn std::error::Error>> {
    let (set, noise): (RecordSet, f64) = records(plant);
    let base: Vec<Term> = plant.base.split(',').map(Term::parse).collect::<Result<_, _>>()?;
    let ask = Ask { base: Some(base), ..Ask::default() };
    let search = Search::new(&set, &ask)?;
    let found = search.diagnose(&|_| {}, &Cancel::default())?;
    Ok((found, noise, 1e-6 * search.effort().steps as f64))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let still: usize = std::env::args().nth(1).map_or(Ok(200), |n| n.parse())?;
    let only = std::env::args().nth(2);
    let (mut open, mut closed, mut lengths, mut exact, mut named) = (0, 0, [0; 4], 0, 0);
    let mut draws = 0;
    for (kind, force) in FORCES.iter().enumerate() {
        let text = force.terms.join(" and ");
        if only.as_ref().is_some_and(|only| text != *only) {
            continue;
        }
        for draw in (0..3).filter(|draw| !(force.driven && draw % 3 == 2)) {
            let started = Instant::now();
            let plant = plant(Some(force), draw, 1000 + 100 * kind as u64 + 10 * draw as u64);
            let (found, noise, effort) = diagnosed(&plant)?;
            draws += 1;
            let names: Vec<&str> = found.steps().iter().map(|s| s.added.choice.effect.as_str()).collect();
            let error = |stage: &sindyscope_search::Stage| stage.gap.test_rmse.unwrap_or(f64::NAN) / noise;
            let of_steps = found.stages.last().map_or(f64::NAN, |s| error(s));
            let base = found.stages.first().map_or(f64::NAN, |s| error(s));
            let said = match &found.description {
                Some(d) => format!(
                    "described: {}{} → {:.2} noises{}",
                    d.terms.join(", "),
                    if d.beside.is_empty() { String::new() } else { format!(" beside {}", d.beside.join(", ")) },
                    error(&d.stage),
                    if d.closes { "" } else { ", more is left" }
                ),
                None => String::new(),
            };
            if found.explained {
                named += 1;
            } else {
                open += 1;
                if let Some(d) = found.description.as_ref().filter(|d| d.closes) {
                    closed += 1;
                    lengths[d.terms.len().min(3)] += 1;
                    let mut terms = d.terms.clone();
                    terms.sort_by_key(|t| plant.truth.iter().position(|own| own == t));
                    exact += usize::from(terms == plant.truth);
                }
            }
            println!(
                "{:16} {} {:15} {:24} {base:.2} → {of_steps:.2} noises {said} ({effort:.0} million steps, {:.1} s)",
                text,
                ["multisine", "tones    ", "free     "][draw],
                found.verdict.word(),
                names.join(", "),
                started.elapsed().as_secs_f64()
            );
        }
    }
    let mut wrong = 0;
    for draw in 0..still {
        let (found, ..) = diagnosed(&plant(None, draw, 50_000 + draw as u64))?;
        if let Some(d) = &found.description {
            wrong += 1;
            println!("nothing hidden, draw {draw}: {} described as {}", found.verdict.word(), d.terms.join(", "));
        }
        if found.verdict != Verdict::NothingMissing {
            println!("nothing hidden, draw {draw}: {}: {}", found.verdict.word(), found.sentence);
        }
    }
    println!(
        "{draws} draws: a name closes the gap in {named}, a description in {closed} of the other {open} (with one term {}, \
         two {}, three {}; the hidden terms and no others in {exact}); something described in {wrong} of {still} draws with nothing hidden",
        lengths[1], lengths[2], lengths[3]
    );
    if only.is_none() {
        assert!(10 * closed >= 8 * open, "a description closes the gap in fewer than eight of ten draws");
        assert!(100 * wrong <= still.max(100), "something is described where nothing is missing");
    }
    Ok(())
}
