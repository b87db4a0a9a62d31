//! Textbook systems with a hidden effect, and what the search names: a table, one line a system.
//! `cargo run --profile study -p sindyscope-search --example classics [-- NAME …]`.

mod plants;

use std::f64::consts::TAU;
use std::time::Instant;

use plants::{Plant, multisine, records, tone};
use sindyscope_core::study::Cancel;
use sindyscope_search::{Ask, Diagnosis, Search};
use sindyscope_values::term::Term;

fn dead_zone(x: f64, gap: f64) -> f64 {
    x - x.clamp(-gap, gap)
}

fn self_excited() -> Vec<Plant> {
    vec![
        Plant {
            name: "van der Pol, forced",
            truth: &["displacement_dependent_damping"],
            rates: Box::new(|_, y, u, _| vec![y[1], u + (1.0 - y[0] * y[0]) * y[1] - y[0]]),
            drives: vec![tone(1.2, 1.1), tone(0.6, 0.9), tone(1.0, 1.05)],
            ..Plant::default()
        },
        Plant {
            name: "van der Pol, free",
            truth: &["displacement_dependent_damping"],
            base: "x,v",
            rates: Box::new(|_, y, _, _| vec![y[1], (1.0 - y[0] * y[0]) * y[1] - y[0]]),
            drives: vec![None, None, None],
            initial: vec![vec![0.1, 0.0], vec![3.0, 0.0], vec![1.0, 1.0]],
            samples: 1000,
            ..Plant::default()
        },
        Plant {
            name: "Rayleigh",
            truth: &["cubic_damping"],
            rates: Box::new(|_, y, u, _| vec![y[1], u + y[1] - y[1].powi(3) / 3.0 - y[0]]),
            drives: vec![tone(0.8, 1.3), tone(1.2, 0.8), tone(1.0, 1.1)],
            ..Plant::default()
        },
        Plant {
            name: "belt, stick-slip",
            truth: &["belt_friction"],
            base: "x,v",
            rates: Box::new(|_, y, _, _| {
                let slip = y[1] - 0.5;
                let friction = (0.6 + 0.6 * (-slip.abs() / 0.3).exp()) * (slip / 2e-4).tanh();
                vec![y[1], -y[0] - 0.05 * y[1] - friction]
            }),
            drives: vec![None, None, None],
            initial: vec![vec![0.0, 0.0], vec![2.5, 0.0], vec![1.0, 0.4]],
            interval: 0.06,
            samples: 2000,
            ..Plant::default()
        },
    ]
}

fn springs() -> Vec<Plant> {
    vec![
        Plant {
            name: "double well",
            truth: &["cubic_stiffness"],
            rates: Box::new(|_, y, u, _| vec![y[1], u - 0.25 * y[1] + y[0] - y[0].powi(3)]),
            drives: vec![tone(0.4, 1.0), tone(0.3, 1.2), tone(0.35, 1.1)],
            ..Plant::default()
        },
        Plant {
            name: "Ueda",
            truth: &["cubic_stiffness"],
            rates: Box::new(|_, y, u, _| vec![y[1], u - 0.05 * y[1] - y[0].powi(3)]),
            drives: vec![tone(7.5, 1.0), tone(7.0, 1.0), tone(7.5, 1.0)],
            initial: vec![vec![3.0, 4.0], vec![1.0, 0.0], vec![2.0, -1.0]],
            interval: 0.05,
            ..Plant::default()
        },
        Plant {
            name: "Mathieu with a cubic spring",
            truth: &["parametric_stiffness", "cubic_stiffness"],
            base: "x,v",
            rates: Box::new(|t, y, _, _| {
                vec![y[1], -0.02 * y[1] - (1.0 + 0.25 * (2.1 * t).cos()) * y[0] - 0.3 * y[0].powi(3)]
            }),
            drives: vec![None, None, None],
            initial: vec![vec![0.1, 0.0], vec![1.5, 0.0], vec![0.5, 0.5]],
            ..Plant::default()
        },
        Plant {
            name: "pendulum that turns over",
            truth: &["pendulum_restoring"],
            rates: Box::new(|_, y, u, _| vec![y[1], u - 0.1 * y[1] - y[0].sin()]),
            drives: vec![
                multisine(0.9, (0.3, 1.5), 12, 1),
                multisine(0.8, (0.3, 1.5), 12, 2),
                multisine(0.8, (0.3, 1.5), 12, 3),
            ],
            samples: 1500,
            ..Plant::default()
        },
        Plant {
            name: "clearance alone, chaotic",
            truth: &["clearance"],
            rates: Box::new(|_, y, u, _| vec![y[1], u - 1.2 * y[1] - 400.0 * dead_zone(y[0], 0.03)]),
            drives: vec![tone(12.0, 9.0), tone(10.0, 7.0), tone(11.0, 8.0)],
            initial: vec![vec![0.0, 0.1], vec![0.01, 0.0], vec![-0.01, 0.0]],
            interval: 0.01,
            samples: 4000,
            ..Plant::default()
        },
        Plant {
            name: "snap-through truss",
            truth: &["oblique_springs"],
            rates: Box::new(|_, y, u, _| {
                vec![y[1], u - 0.2 * y[1] - 4.0 * y[0] * (1.0 - 1.0 / (y[0] * y[0] + 0.64).sqrt())]
            }),
            drives: vec![
                multisine(0.5, (0.3, 2.5), 16, 4),
                multisine(0.4, (0.3, 2.5), 16, 5),
                multisine(0.45, (0.3, 2.5), 16, 6),
            ],
            ..Plant::default()
        },
        Plant {
            name: "hard stop",
            truth: &["one_sided_stop"],
            rates: Box::new(|_, y, u, _| vec![y[1], u - 0.08 * y[1] - y[0] - 100.0 * (y[0] - 0.8_f64).max(0.0)]),
            drives: vec![
                multisine(0.5, (0.3, 2.5), 16, 7),
                multisine(0.4, (0.3, 2.5), 16, 8),
                multisine(0.45, (0.3, 2.5), 16, 9),
            ],
            interval: 0.05,
            noise: 0.005,
            ..Plant::default()
        },
    ]
}

/// An unsensed absorber, classical hysteresis, the Bouc–Wen benchmark.
fn remembering() -> Vec<Plant> {
    let lines = |rms, seed| multisine(rms, (0.3, 2.5), 16, seed);
    vec![
        Plant {
            name: "unsensed absorber",
            truth: &["second_mode"],
            rates: Box::new(|_, y, u, _| {
                let force = 1.2 * (y[2] - y[0]) + 0.05 * (y[3] - y[1]);
                vec![y[1], u - y[0] - 0.04 * y[1] + 0.1 * force, y[3], -force]
            }),
            drives: vec![lines(0.5, 11), lines(0.5, 12), lines(0.5, 13)],
            initial: vec![vec![0.0; 4]; 3],
            ..Plant::default()
        },
        Plant {
            name: "classical Bouc–Wen",
            truth: &["bouc_wen_hysteresis"],
            rates: Box::new(|_, y, u, _| {
                let (v, z) = (y[1], y[2]);
                vec![v, u - 0.5 * y[0] - 0.04 * v - 0.5 * z, v - 0.5 * v.abs() * z - 0.5 * v * z.abs()]
            }),
            drives: vec![lines(0.7, 14), lines(0.5, 15), lines(0.6, 16)],
            initial: vec![vec![0.0; 3]; 3],
            ..Plant::default()
        },
        Plant {
            name: "Bouc–Wen benchmark",
            truth: &["bouc_wen_hysteresis"],
            rates: Box::new(|_, y, u, _| {
                let (v, z) = (y[1], y[2]);
                vec![v, (u - 5e4 * y[0] - 10.0 * v - z) / 2.0, 5e4 * v - 1e3 * (0.8 * v.abs() * z - 1.1 * v * z.abs())]
            }),
            drives: (17..20).map(|seed| multisine(50.0, (TAU * 5.0, TAU * 150.0), 300, seed)).collect(),
            initial: vec![vec![0.0; 3]; 3],
            interval: 1.0 / 750.0,
            samples: 4096,
            sensor: Some(8e-6),
            ..Plant::default()
        },
    ]
}

fn mechanisms() -> Vec<Plant> {
    let road = |seed| multisine(0.02, (2.0, 60.0), 40, seed);
    let lines = |rms, seed| multisine(rms, (0.3, 2.5), 16, seed);
    vec![
        Plant {
            name: "suspension, rebound",
            truth: &["bilinear_damping"],
            base: "x-u,v-du",
            rates: Box::new(|_, y, u, du| {
                let (r, w) = (y[0] - u, y[1] - du);
                vec![y[1], -60.0 * r - if w > 0.0 { 4.0 } else { 1.0 } * w]
            }),
            drives: vec![road(21), road(22), road(23)],
            initial: vec![vec![0.0; 2]; 3],
            interval: 0.01,
            base_moves: true,
            ..Plant::default()
        },
        Plant {
            name: "energy sink, two masses",
            truth: &["cubic_stiffness"],
            base: "x1,x2,v1,v2,u",
            masses: 2,
            rates: Box::new(|_, y, u, _| {
                let (r, w) = (y[0] - y[1], y[2] - y[3]);
                let force = 0.5 * r.powi(3) + 0.01 * w;
                vec![y[2], y[3], u - y[0] - 0.02 * y[2] - force, 10.0 * force]
            }),
            drives: vec![lines(0.3, 24), lines(0.25, 25), lines(0.3, 26)],
            initial: vec![vec![0.0; 4]; 3],
            samples: 2000,
            ..Plant::default()
        },
    ]
}

fn line(classic: &Plant, noise: f64, found: Result<Diagnosis, String>, seconds: f64) -> String {
    let diagnosis = match found {
        Ok(diagnosis) => diagnosis,
        Err(error) => return format!("| {} | {error} | | | | {seconds:.1} |", classic.name),
    };
    let last = diagnosis.stages.last();
    let effects: Vec<String> = last
        .iter()
        .flat_map(|s| &s.effects)
        .map(|e| {
            let values: Vec<String> = e
                .parameters
                .iter()
                .map(|p| format!("{} {:.4} ± {:.4}", p.name, p.value, p.std_error.unwrap_or(f64::NAN)))
                .collect();
            format!("{} {} ({})", e.choice.effect, e.choice.form, values.join(", "))
        })
        .collect();
    let mut names: Vec<&str> = last.iter().flat_map(|s| &s.effects).map(|e| e.choice.effect.as_str()).collect();
    let mut truth = classic.truth.to_vec();
    names.sort_unstable();
    truth.sort_unstable();
    let others: Vec<&str> = diagnosis
        .steps()
        .last()
        .map(|s| s.indistinguishable().iter().map(|c| c.choice.effect.as_str()).collect())
        .unwrap_or_default();
    format!(
        "| {} | {} | {}{} | {:.2} → {:.2} over {:.0} s | {} | {seconds:.1} |",
        classic.name,
        if names == truth { "right" } else { "–" },
        effects.join("; "),
        if others.is_empty() { String::new() } else { format!(" or {}", others.join(", ")) },
        diagnosis.stages.first().and_then(|s| s.gap.test_rmse).unwrap_or(f64::NAN) / noise,
        last.and_then(|s| s.gap.test_rmse).unwrap_or(f64::NAN) / noise,
        last.map_or(f64::NAN, |s| s.gap.horizon),
        diagnosis.verdict.word(),
    )
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    println!("| system | | named | held-out error, noises | verdict | s |");
    println!("| --- | --- | --- | --- | --- | --- |");
    let all = [self_excited(), springs(), remembering(), mechanisms()].into_iter().flatten();
    for classic in all.filter(|c| wanted.is_empty() || wanted.iter().any(|w| c.name.contains(w.as_str()))) {
        let (set, noise) = records(&classic);
        let base: Vec<Term> = classic.base.split(',').map(Term::parse).collect::<Result<_, _>>()?;
        let ask = Ask { base: Some(base), ..Ask::default() };
        let started = Instant::now();
        let found = Search::new(&set, &ask).and_then(|s| s.diagnose(&|_| {}, &Cancel::default()));
        println!("{}", line(&classic, noise, found.map_err(|e| e.to_string()), started.elapsed().as_secs_f64()));
    }
    Ok(())
}
