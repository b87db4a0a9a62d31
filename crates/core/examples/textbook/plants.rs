//! Textbook oscillators, integrated here by Runge and Kutta's fourth-order method at a small step: another route than the
//! identifier's own simulation. Dry friction is a hyperbolic tangent much narrower than the noise can tell.

use std::f64::consts::TAU;
use std::sync::Arc;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_pcg::Pcg64;
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};

/// An acceleration of displacement, velocity and input.
type Acceleration = fn(f64, f64, f64) -> f64;

/// What drives a plant.
#[derive(Clone, Copy)]
pub(crate) enum Drive {
    /// Nothing: the record has no input.
    Free,
    /// Amplitude and angular frequency of one line, rad/s.
    Tone(f64, f64),
    /// RMS, lowest and highest angular frequency of lines with random phases, rad/s.
    Lines(f64, f64, f64),
}

/// A plant and how it is measured.
#[derive(Clone, Copy)]
pub(crate) struct Plant {
    pub(crate) name: &'static str,
    /// The true terms with their coefficients.
    pub(crate) truth: &'static [(&'static str, f64)],
    pub(crate) acceleration: Acceleration,
    /// Of the record that is fitted and of the one that is held out.
    pub(crate) drives: [Drive; 2],
    pub(crate) starts: [[f64; 2]; 2],
    /// Sampling interval, s.
    pub(crate) interval: f64,
    pub(crate) samples: usize,
}

const LINES: usize = 16;
const STEPS: usize = 100;

fn input(drive: Drive, random: &mut Pcg64) -> Box<dyn Fn(f64) -> f64> {
    match drive {
        Drive::Free => Box::new(|_| 0.0),
        Drive::Tone(amplitude, omega) => Box::new(move |t| amplitude * (omega * t).cos()),
        Drive::Lines(rms, low, high) => {
            let phase = Uniform::new(0.0, TAU).expect("a range");
            let line = |k: usize| low + (high - low) * k as f64 / (LINES - 1) as f64;
            let parts: Vec<(f64, f64)> = (0..LINES).map(|k| (line(k), phase.sample(random))).collect();
            let amplitude = rms * (2.0 / LINES as f64).sqrt();
            Box::new(move |t| parts.iter().map(|(w, p)| amplitude * (w * t + p).cos()).sum())
        }
    }
}

/// Displacements at the samples.
fn integrate(plant: &Plant, input: &dyn Fn(f64) -> f64, start: [f64; 2]) -> Vec<f64> {
    let h = plant.interval / STEPS as f64;
    let [mut x, mut v] = start;
    let mut out = Vec::with_capacity(plant.samples);
    for n in 0..plant.samples {
        out.push(x);
        for j in 0..STEPS {
            let t = plant.interval * n as f64 + h * j as f64;
            let (u0, u1, u2) = (input(t), input(t + 0.5 * h), input(t + h));
            let f = plant.acceleration;
            let a = (v, f(x, v, u0));
            let b = (v + 0.5 * h * a.1, f(x + 0.5 * h * a.0, v + 0.5 * h * a.1, u1));
            let c = (v + 0.5 * h * b.1, f(x + 0.5 * h * b.0, v + 0.5 * h * b.1, u1));
            let d = (v + h * c.1, f(x + h * c.0, v + h * c.1, u2));
            x += h / 6.0 * (a.0 + 2.0 * b.0 + 2.0 * c.0 + d.0);
            v += h / 6.0 * (a.1 + 2.0 * b.1 + 2.0 * c.1 + d.1);
        }
    }
    out
}

/// One record to fit and one held out, with sensor noise of a share of the motion's standard deviation; and that deviation.
pub(crate) fn records(plant: &Plant, noise: f64, seed: u64) -> (RecordSet, f64) {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut set = RecordSet::default();
    let mut deviation = 0.0;
    for (k, (drive, start)) in plant.drives.into_iter().zip(plant.starts).enumerate() {
        let input = input(drive, &mut random);
        let mut x = integrate(plant, &input, start);
        if k == 0 {
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            deviation = noise * (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt();
        }
        for x in &mut x {
            let deviate: f64 = StandardNormal.sample(&mut random);
            *x += deviation * deviate;
        }
        let mut channels = vec![channel(Role::Displacement(0), x)];
        if !matches!(drive, Drive::Free) {
            let u = (0..plant.samples).map(|n| input(plant.interval * n as f64)).collect();
            channels.push(channel(Role::Input(0), u));
        }
        let name = format!("{} {k}", plant.name);
        let record = Record { name, start: 0.0, interval: plant.interval, channels, source: None, notices: Vec::new() };
        set.entries.push((Arc::new(record), if k == 0 { Usage::Fit } else { Usage::HeldOut }));
    }
    (set, deviation)
}

fn channel(role: Role, values: Vec<f64>) -> Channel {
    Channel { role, name: role.short_name(), unit: String::new(), values: values.into(), estimated: false }
}

fn sign(v: f64) -> f64 {
    (v / 1e-4).tanh()
}

const LINES_DRIVE: [Drive; 2] = [Drive::Lines(0.8, 0.3, 2.5), Drive::Lines(0.7, 0.3, 2.5)];
const PLANT: Plant = Plant {
    name: "",
    truth: &[],
    acceleration: |_, _, _| 0.0,
    drives: LINES_DRIVE,
    starts: [[0.1, 0.0], [0.1, 0.0]],
    interval: 0.05,
    samples: 5000,
};

/// Every plant of the table.
pub(crate) const PLANTS: &[Plant] = &[
    Plant {
        name: "linear",
        truth: &[("x", -1.0), ("v", -0.2), ("u", 1.0)],
        acceleration: |x, v, u| u - x - 0.2 * v,
        ..PLANT
    },
    Plant {
        name: "van der Pol, forced",
        truth: &[("x", -1.0), ("v", 1.0), ("x^2*v", -1.0), ("u", 1.0)],
        acceleration: |x, v, u| u + (1.0 - x * x) * v - x,
        drives: [Drive::Tone(1.2, 1.1), Drive::Tone(0.6, 0.9)],
        ..PLANT
    },
    Plant {
        name: "van der Pol, lines",
        truth: &[("x", -1.0), ("v", 1.0), ("x^2*v", -1.0), ("u", 1.0)],
        acceleration: |x, v, u| u + (1.0 - x * x) * v - x,
        ..PLANT
    },
    Plant {
        name: "van der Pol, free",
        truth: &[("x", -1.0), ("v", 1.0), ("x^2*v", -1.0)],
        acceleration: |x, v, _| (1.0 - x * x) * v - x,
        drives: [Drive::Free; 2],
        starts: [[0.1, 0.0], [3.0, 0.0]],
        samples: 3000,
        ..PLANT
    },
    Plant {
        name: "Rayleigh",
        truth: &[("x", -1.0), ("v", 1.0), ("v^3", -1.0 / 3.0), ("u", 1.0)],
        acceleration: |x, v, u| u + v - v.powi(3) / 3.0 - x,
        drives: [Drive::Tone(0.8, 1.3), Drive::Tone(1.2, 0.8)],
        ..PLANT
    },
    Plant {
        name: "double well",
        truth: &[("x", 1.0), ("v", -0.25), ("x^3", -1.0), ("u", 1.0)],
        acceleration: |x, v, u| u - 0.25 * v + x - x.powi(3),
        drives: [Drive::Tone(0.4, 1.0), Drive::Tone(0.35, 1.1)],
        ..PLANT
    },
    Plant {
        name: "Ueda",
        truth: &[("v", -0.05), ("x^3", -1.0), ("u", 1.0)],
        acceleration: |x, v, u| u - 0.05 * v - x.powi(3),
        drives: [Drive::Tone(7.5, 1.0), Drive::Tone(7.0, 1.0)],
        starts: [[3.0, 4.0], [1.0, 0.0]],
        interval: 0.025,
        samples: 6000,
    },
    Plant {
        name: "pendulum that turns over",
        truth: &[("v", -0.1), ("sin(x)", -1.0), ("u", 1.0)],
        acceleration: |x, v, u| u - 0.1 * v - x.sin(),
        drives: [Drive::Lines(0.9, 0.3, 1.5), Drive::Lines(0.8, 0.3, 1.5)],
        ..PLANT
    },
    Plant {
        name: "pendulum, chaotic",
        truth: &[("v", -0.5), ("sin(x)", -1.0), ("u", 1.0)],
        acceleration: |x, v, u| u - 0.5 * v - x.sin(),
        drives: [Drive::Tone(1.15, 2.0 / 3.0), Drive::Tone(1.2, 2.0 / 3.0)],
        ..PLANT
    },
    Plant {
        name: "Duffing",
        truth: &[("x", -1.0), ("v", -0.2), ("x^3", -0.6), ("u", 1.0)],
        acceleration: |x, v, u| u - x - 0.2 * v - 0.6 * x.powi(3),
        ..PLANT
    },
    Plant {
        name: "Duffing, dry friction",
        truth: &[("x", -1.0), ("v", -0.1), ("x^3", -0.6), ("sgn(v)", -0.15), ("u", 1.0)],
        acceleration: |x, v, u| u - x - 0.1 * v - 0.6 * x.powi(3) - 0.15 * sign(v),
        ..PLANT
    },
    Plant {
        name: "quadratic drag",
        truth: &[("x", -1.0), ("v", -0.05), ("v*|v|", -0.3), ("u", 1.0)],
        acceleration: |x, v, u| u - x - 0.05 * v - 0.3 * v * v.abs(),
        ..PLANT
    },
    Plant {
        name: "input times displacement",
        truth: &[("x", -1.0), ("v", -0.2), ("u", 1.0), ("u*x", 0.4)],
        acceleration: |x, v, u| u - x - 0.2 * v + 0.4 * x * u,
        ..PLANT
    },
    Plant {
        name: "input squared",
        truth: &[("x", -1.0), ("v", -0.2), ("u", 1.0), ("u^2", 0.4)],
        acceleration: |x, v, u| u - x - 0.2 * v + 0.4 * u * u,
        ..PLANT
    },
    Plant {
        name: "asymmetric spring",
        truth: &[("x", -1.0), ("v", -0.2), ("x^2", -0.4), ("x^3", -0.3), ("u", 1.0)],
        acceleration: |x, v, u| u - x - 0.2 * v - 0.4 * x * x - 0.3 * x.powi(3),
        ..PLANT
    },
    Plant {
        name: "van der Pol and Duffing",
        truth: &[("x", -1.0), ("v", 0.4), ("x^2*v", -0.6), ("x^3", -0.5), ("u", 1.0)],
        acceleration: |x, v, u| u - x + 0.4 * v - 0.6 * x * x * v - 0.5 * x.powi(3),
        ..PLANT
    },
];
