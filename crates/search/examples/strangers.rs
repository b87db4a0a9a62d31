//! Forces that no entry of the catalogue has, and what the search says of them: a line a draw, totals last.
//! `cargo run --profile study -p sindyscope-search --example strangers [-- NAME …]`.
//!
//! Unrelated: an effect is shown that shares neither the force's coordinate nor its kind. Wrong: so, and it is called *named*.

mod plants;

use std::time::Instant;

use plants::{Plant, drawn_drive, records};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use sindyscope_core::study::Cancel;
use sindyscope_search::{Ask, Search, Verdict};
use sindyscope_values::term::Term;

/// A force per unit of mass over (t, x, v, input, own states), and the rates of its own states.
type Force = fn(f64, f64, f64, f64, &[f64]) -> (f64, Vec<f64>);

struct Stranger {
    name: &'static str,
    /// Names that say something true of it.
    related: &'static [&'static str],
    states: usize,
    force: Force,
}

const DAMPINGS: &[&str] = &[
    "viscous_damping",
    "coulomb_friction",
    "stribeck_friction",
    "static_friction",
    "quadratic_damping",
    "cubic_damping",
    "displacement_dependent_damping",
    "position_dependent_friction",
    "power_law_damping",
    "bilinear_damping",
    "negative_damping",
];
const SPRINGS: &[&str] = &[
    "linear_stiffness",
    "quadratic_stiffness",
    "cubic_stiffness",
    "quintic_stiffness",
    "power_law_stiffness",
    "clearance",
    "one_sided_stop",
    "bilinear_stiffness",
    "pendulum_restoring",
    "oblique_springs",
    "constant_force",
    "sensor_offset",
];
const REMEMBERING: &[&str] = &[
    "bouc_wen_hysteresis",
    "viscoelastic_relaxation",
    "second_mode",
    "coulomb_friction",
    "stribeck_friction",
    "static_friction",
    "position_dependent_friction",
    "power_law_damping",
    "input_delay",
];

/// The displacements are of the order of one.
fn strangers() -> Vec<Stranger> {
    vec![
        Stranger {
            name: "magnet",
            related: SPRINGS,
            states: 0,
            force: |_, x, _, _, _| (0.25 / (2.6 - x).max(0.3).powi(2), vec![]),
        },
        Stranger {
            name: "washboard",
            related: SPRINGS,
            states: 0,
            force: |_, x, _, _, _| (-0.12 * (4.0 * x).sin(), vec![]),
        },
        Stranger {
            name: "saturating spring",
            related: SPRINGS,
            states: 0,
            force: |_, x, _, _, _| (-0.25 * (3.0 * x).tanh(), vec![]),
        },
        Stranger {
            name: "odd quartic spring",
            related: SPRINGS,
            states: 0,
            force: |_, x, _, _, _| (-0.08 * x.powi(4), vec![]),
        },
        Stranger {
            name: "exponential spring",
            related: SPRINGS,
            states: 0,
            force: |_, x, _, _, _| (-0.05 * ((1.2 * x).exp() - 1.0), vec![]),
        },
        Stranger {
            name: "relay at the middle",
            related: SPRINGS,
            states: 0,
            force: |_, x, _, _, _| (-0.08 * (x / 1e-3).tanh(), vec![]),
        },
        Stranger {
            name: "saturating damper",
            related: DAMPINGS,
            states: 0,
            force: |_, _, v, _, _| (-0.12 * v / (0.3 + v.abs()), vec![]),
        },
        Stranger {
            name: "damper off the middle",
            related: DAMPINGS,
            states: 0,
            force: |_, x, v, _, _| (-0.08 * v * (-3.0 * x).exp().min(30.0) / (1.0 + (-3.0 * x).exp()), vec![]),
        },
        Stranger {
            name: "quintic damper",
            related: DAMPINGS,
            states: 0,
            force: |_, _, v, _, _| (-0.03 * v.powi(5), vec![]),
        },
        Stranger {
            name: "friction under the spring's load",
            related: DAMPINGS,
            states: 0,
            force: |_, x, v, _, _| (-0.06 * (1.0 + 0.8 * x).abs() * (v / 1e-3).tanh(), vec![]),
        },
        Stranger {
            name: "friction that wears",
            related: &[
                "coulomb_friction",
                "stribeck_friction",
                "static_friction",
                "damping_drift",
                "power_law_damping",
                "position_dependent_friction",
                "viscous_damping",
            ],
            states: 0,
            force: |t, _, v, _, _| (-0.09 * (-t / 80.0).exp() * (v / 1e-3).tanh(), vec![]),
        },
        Stranger {
            name: "gyroscopic",
            related: &[
                "quadratic_stiffness",
                "quadratic_damping",
                "cubic_stiffness",
                "displacement_dependent_damping",
                "power_law_damping",
                "bilinear_damping",
            ],
            states: 0,
            force: |_, x, v, _, _| (-0.1 * x * v * v, vec![]),
        },
        Stranger {
            name: "even in the velocity",
            related: &["quadratic_stiffness", "quadratic_damping", "bilinear_damping", "bilinear_stiffness"],
            states: 0,
            force: |_, _, v, _, _| (-0.08 * v * v, vec![]),
        },
        Stranger {
            name: "fractional damper",
            related: &[
                "viscoelastic_relaxation",
                "viscous_damping",
                "second_mode",
                "power_law_damping",
                "linear_stiffness",
                "input_delay",
                "position_dependent_friction",
            ],
            states: 5,
            force: |_, x, _, _, z| {
                // Half a derivative as a sum of relaxing springs, a factor of four apart.
                let rates: [f64; 5] = [0.06, 0.25, 1.0, 4.0, 16.0];
                let force = rates.iter().zip(z).map(|(r, z)| -0.06 * r.sqrt() * (x - z)).sum();
                (force, rates.iter().zip(z).map(|(r, z)| r * (x - z)).collect())
            },
        },
        Stranger {
            name: "three slipping springs",
            related: REMEMBERING,
            states: 3,
            force: |_, _, v, _, z| {
                let slips: [f64; 3] = [0.15, 0.4, 0.9];
                let rate = |(s, z): (&f64, &f64)| if z.abs() >= *s && v * z > 0.0 { 0.0 } else { v };
                (-0.12 * z.iter().sum::<f64>(), slips.iter().zip(z).map(rate).collect())
            },
        },
        Stranger {
            name: "two absorbers",
            related: REMEMBERING,
            states: 4,
            force: |_, x, v, _, z| {
                let (a, b) = (1.7 * (z[0] - x) + 0.05 * (z[1] - v), 0.5 * (z[2] - x) + 0.03 * (z[3] - v));
                (0.06 * a + 0.08 * b, vec![z[1], -a, z[3], -b])
            },
        },
        Stranger {
            name: "motor on its own speed",
            related: &["unmeasured_harmonic_force", "parametric_stiffness", "constant_force"],
            states: 0,
            force: |t, _, _, _, _| (0.1 * (0.6 * t + 0.004 * t * t).sin(), vec![]),
        },
        Stranger {
            name: "turbulence",
            related: &["unmeasured_harmonic_force", "constant_force"],
            states: 0,
            force: |t, _, _, _, _| {
                let gust = |k: f64| (k * (0.37 + 0.11 * k) * t + 2.0 * k * k).sin();
                (0.05 * (1..9).map(|k| gust(f64::from(k))).sum::<f64>(), vec![])
            },
        },
        Stranger {
            name: "load that settles",
            related: &["constant_force", "sensor_offset", "stiffness_drift"],
            states: 0,
            force: |t, _, _, _, _| (0.3 * (-t / 30.0).exp(), vec![]),
        },
    ]
}

/// A plant of about one radian per second with a stranger's force on it; the third of each kind vibrates freely.
fn plant(stranger: &Stranger, draw: usize, seed: u64) -> Plant {
    let mut random = Pcg64::seed_from_u64(seed);
    let stiffness: f64 = random.random_range(0.7..1.4);
    let damping = random.random_range(0.02..0.08);
    let strength = random.random_range(0.6..1.4);
    let (force, states) = (stranger.force, stranger.states);
    let drive = |k: u64| drawn_drive(draw, seed, k);
    let free = draw % 3 == 2;
    let initial = |x: f64| [x, 0.0].into_iter().chain(std::iter::repeat_n(0.0, states)).collect();
    Plant {
        name: stranger.name,
        truth: stranger.related,
        base: if free { "x,v" } else { "x,v,u" },
        rates: Box::new(move |t, y, u, _| {
            let (push, own) = force(t, y[0], y[1], u, &y[2..]);
            [y[1], u - stiffness * y[0] - damping * y[1] + strength * push].into_iter().chain(own).collect()
        }),
        drives: (0..3).map(drive).collect(),
        initial: if free { vec![initial(1.5), initial(0.9), initial(1.3)] } else { vec![initial(0.0); 3] },
        interval: 0.12,
        samples: if free { 700 } else { 1500 },
        steps: 40,
        ..Plant::default()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let (mut draws, mut unrelated, mut wrong) = (0, 0, 0);
    for (kind, stranger) in strangers().iter().enumerate() {
        if !wanted.is_empty() && !wanted.iter().any(|w| stranger.name.contains(w.as_str())) {
            continue;
        }
        for draw in 0..3 {
            let plant = plant(stranger, draw, 100 * kind as u64 + 10 * draw as u64);
            let (set, noise) = records(&plant);
            let base: Vec<Term> = plant.base.split(',').map(Term::parse).collect::<Result<_, _>>()?;
            let started = Instant::now();
            let ask = Ask { base: Some(base), ..Ask::default() };
            let found = Search::new(&set, &ask).and_then(|s| s.diagnose(&|_| {}, &Cancel::default()))?;
            let names: Vec<&str> = found.steps().iter().map(|s| s.added.choice.effect.as_str()).collect();
            let strange = names.iter().any(|n| !plant.truth.contains(n));
            draws += 1;
            unrelated += usize::from(strange);
            wrong += usize::from(strange && found.verdict == Verdict::Named);
            let error = |k: Option<&std::sync::Arc<sindyscope_search::Stage>>| {
                k.and_then(|s| s.gap.test_rmse).unwrap_or(f64::NAN) / noise
            };
            println!(
                "{:34} {} {:16} {} {:.2} → {:.2} noises {:.1} s",
                stranger.name,
                if strange { "unrelated" } else { "         " },
                found.verdict.word(),
                names.join(", "),
                error(found.stages.first()),
                error(found.stages.last()),
                started.elapsed().as_secs_f64(),
            );
        }
    }
    println!("{draws} draws: unrelated effects shown in {unrelated}, wrong names in {wrong}");
    Ok(())
}
