use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use rand::SeedableRng as _;
use rand_distr::{Distribution as _, Normal};

use super::*;
use sindyscope_core::signal::Signals;
use sindyscope_core::study::{Elapsed, Outcome, RecordOutcome, SensorResponse, Settings};
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::record::{Channel as RecordChannel, Record, Role, Usage};
use sindyscope_values::term::{Kind, Layout, Symbol, Term};

const INTERVAL: f64 = 1e-2;

/// A motion as exact as it can be given: displacement, velocity, acceleration, input, input's rate.
struct ExactMotion {
    name: &'static str,
    x: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    u: Vec<f64>,
    du: Vec<f64>,
}

impl ExactMotion {
    /// Two tones that come by every sign of displacement and velocity, on a base that moves at a third.
    fn wandering(n: usize) -> Self {
        let mut motion = Self { name: "wandering", x: vec![], v: vec![], a: vec![], u: vec![], du: vec![] };
        for k in 0..n {
            let t = INTERVAL * k as f64;
            let (p, q, r) = (TAU * 0.83, TAU * 1.31, TAU * 0.57);
            motion.x.push((p * t).sin() + 0.5 * (q * t).sin());
            motion.v.push(p * (p * t).cos() + 0.5 * q * (q * t).cos());
            motion.a.push(-p * p * (p * t).sin() - 0.5 * q * q * (q * t).sin());
            motion.u.push(0.4 * (r * t).cos());
            motion.du.push(-0.4 * r * (r * t).sin());
        }
        motion
    }

    /// The same with the acceleration that an equation of motion gives.
    fn obeying(n: usize, law: impl Fn(f64, f64, f64, f64) -> f64) -> Self {
        let mut motion = Self::wandering(n);
        motion.a = (0..n).map(|k| law(motion.x[k], motion.v[k], motion.u[k], motion.du[k])).collect();
        motion
    }
}

fn outcome(terms: &[(&str, f64)], motions: &[ExactMotion]) -> Outcome {
    let equation = Equation::known(terms.iter().map(|(t, c)| (Term::parse(t).unwrap(), *c)));
    let inputs = usize::from(!motions[0].u.is_empty());
    let model = Model::second_order(inputs, vec![equation]);
    let channel = |role, name: &str, values: &[f64]| RecordChannel {
        name: name.into(),
        role,
        unit: "m".into(),
        values: values.into(),
        estimated: false,
    };
    let records = motions
        .iter()
        .map(|m| {
            let mut channels = vec![channel(Role::Displacement(0), "x", &m.x)];
            channels.extend((inputs > 0).then(|| channel(Role::Input(0), "u", &m.u)));
            RecordOutcome {
                record: Arc::new(Record {
                    name: m.name.into(),
                    source: None,
                    start: 0.0,
                    interval: INTERVAL,
                    channels,
                    notices: Vec::new(),
                }),
                usage: Usage::Fit,
                driven_as_measured: true,
                scored_from: 0,
                standing: Arc::default(),
                sticks: Vec::new(),
                signals: Arc::new(Signals::known(
                    (0.0, INTERVAL),
                    [vec![m.x.clone(), m.v.clone()], vec![m.v.clone(), m.a.clone()]],
                    [vec![m.u.clone(); inputs], vec![m.du.clone(); inputs]],
                )),
                states: vec![m.x.clone(), m.v.clone()],
                channels: vec![SensorResponse {
                    symbol: Symbol::State(0),
                    role: Role::Displacement(0),
                    response: m.x.clone(),
                    error: vec![0.0; m.x.len()],
                    score: None,
                }],
                diverged_at: None,
            }
        })
        .collect();
    let mut settings = Settings::default();
    // The series are exact: no filter has touched them.
    settings.smoothing.filter_library = false;
    Outcome {
        covariance: sindyscope_core::study::Covariance::default(),
        refinement: None,
        settings,
        model,
        fits: Vec::new(),
        records,
        train: None,
        test: None,
        noise_floor: None,
        warnings: Vec::new(),
        elapsed: Elapsed::default(),
    }
}

fn samples(element: &Element, outcome: &Outcome) -> Vec<ElementSamples> {
    outcome.records.iter().map(|r| element.samples(outcome, r).unwrap()).collect()
}

#[test]
fn a_duffing_spring_is_its_slice_and_coulomb_friction_a_step() {
    let sign = sindyscope_values::term::sign;
    let motion = ExactMotion::obeying(4000, |x, v, u, _| -4.0 * x - 0.5 * x.powi(3) - 0.2 * v - 0.7 * sign(v) + u);
    let outcome = outcome(&[("x", -4.0), ("x^3", -0.5), ("v", -0.2), ("sgn(v)", -0.7), ("u", 1.0)], &[motion]);
    let element = Element::new(&outcome.model, 0, ElementEnds::Ground, false).unwrap();
    let force = RestoringForce::new(&element, &samples(&element, &outcome)).unwrap();
    assert!(force.stiffness.samples > 100 && force.damping.samples > 100);
    for (x, f) in force.stiffness.at.iter().zip(&force.stiffness.force) {
        assert!((f - (4.0 * x + 0.5 * x.powi(3))).abs() < 1e-12, "{x}: {f}");
    }
    for [x, f] in &force.stiffness.curve {
        assert!((f - (4.0 * x + 0.5 * x.powi(3))).abs() < 1e-12);
    }
    for (v, f) in force.damping.at.iter().zip(&force.damping.force) {
        assert!((f - (0.2 * v + 0.7 * sign(*v))).abs() < 1e-12, "{v}: {f}");
    }
    // The jump is drawn upright.
    let jump = force.damping.curve.windows(2).find(|w| w[0][0] < 0.0 && w[1][0] > 0.0).unwrap();
    assert!((jump[1][1] - jump[0][1] - 1.4).abs() < 1e-6 && jump[1][0] - jump[0][0] < 1e-6);
    for (column, row, mean) in force.map.visited() {
        let ((x, y), (v, w)) = (force.map.edges(0, column), force.map.edges(1, row));
        let at = |x: f64, v: f64| 4.0 * x + 0.5 * x.powi(3) + 0.2 * v + 0.7 * sign(v);
        assert!(at(x, v) - 1e-9 <= mean && mean <= at(y, w) + 1e-9, "{column} {row}: {mean}");
    }
}

#[test]
fn friction_that_the_equation_lacks_stays_in_the_view_of_friction() {
    let sign = sindyscope_values::term::sign;
    let motion = ExactMotion::obeying(6000, |x, v, u, du| -4.0 * (x - u) - 0.2 * (v - du) - 0.7 * sign(v));
    let outcome = outcome(&[("x", -4.0), ("u", 4.0), ("v", -0.2), ("du", 0.2)], &[motion]);
    let element = Element::new(&outcome.model, 0, ElementEnds::Ground, true).unwrap();
    let friction = FrictionForce::new(&element, &samples(&element, &outcome)).unwrap();
    for k in 0..friction.mean.at.len() {
        let (v, mean, visits) = (friction.mean.at[k], friction.mean.mean[k], friction.mean.visits[k]);
        // The interval around zero holds both signs, and none is wider than a fortieth of the range.
        if v.abs() > 0.3 && visits > 1 {
            assert!((mean - 0.2 * v - 0.7 * sign(v)).abs() < 0.2 * 0.21, "{v}: {mean}");
        }
    }
    let [v, f] = friction.curve[0];
    assert!((f - 0.2 * v).abs() < 1e-12, "the equation knows the damper alone");
}

#[test]
fn a_joint_on_a_moving_base_is_seen_across_it() {
    let law = |x: f64, v: f64, u: f64, du: f64| -4.0 * (x - u) - 2.0 * (x - u).powi(3) - 0.3 * (v - du);
    let written = outcome(&[("x-u", -4.0), ("(x-u)^3", -2.0), ("v-du", -0.3)], &[ExactMotion::obeying(3000, law)]);
    assert_eq!(Element::suited(&written.model, 0, true), ElementEnds::Input(0));
    let element = Element::new(&written.model, 0, ElementEnds::Input(0), true).unwrap();
    assert_eq!(element.names(), ["x − u", "v − du"]);
    let force = RestoringForce::new(&element, &samples(&element, &written)).unwrap();
    for (z, f) in force.stiffness.at.iter().zip(&force.stiffness.force) {
        assert!((f - (4.0 * z + 2.0 * z.powi(3))).abs() < 1e-12, "{z}: {f}");
    }
    // The ground sees none of it.
    let ground = Element::new(&written.model, 0, ElementEnds::Ground, true).unwrap();
    assert_eq!(ground.force(0.3, 0.2), 0.0);

    // A spring that the regression wrote as −k x + k u is across the base too, if there is a base; friction to the
    // ground is not.
    let apart = outcome(&[("x", -4.0), ("u", 4.0), ("sgn(v)", -0.7)], &[ExactMotion::wandering(100)]);
    assert_eq!(Element::choices(&apart.model, 0, true), [ElementEnds::Ground, ElementEnds::Input(0)]);
    assert_eq!(Element::choices(&apart.model, 0, false), [ElementEnds::Ground]);
    assert_eq!(Element::suited(&apart.model, 0, true), ElementEnds::Ground);
    let joint = Element::new(&apart.model, 0, ElementEnds::Input(0), true).unwrap();
    assert_eq!((joint.force(0.5, 1.0), joint.friction(1.0)), (2.0, 0.0));
}

#[test]
fn records_without_derivatives_and_models_of_first_order_have_no_element() {
    let mut broken = outcome(&[("x", -4.0)], &[ExactMotion::wandering(100)]);
    let element = Element::new(&broken.model, 0, ElementEnds::Ground, false).unwrap();
    let motion = ExactMotion::wandering(100);
    let rates = vec![motion.v.clone(), motion.a[..50].to_vec()];
    let signals = Signals::known((0.0, INTERVAL), [vec![motion.x, motion.v], rates], Default::default());
    broken.records[0].signals = Arc::new(signals);
    assert!(element.samples(&broken, &broken.records[0]).is_none());
    assert!(RestoringForce::new(&element, &[]).is_none());
    assert!(FrictionForce::new(&element, &[]).is_none());
    let first = Model::first_order(0, vec![Equation { terms: Vec::new() }]);
    assert!(Element::new(&first, 0, ElementEnds::Ground, false).is_none());
    assert_eq!(first.layout, Layout { kind: Kind::FirstOrder, freedoms: 1, inputs: 0, internals: 0 });
}

/// Displacement over force of x″ + 2ζω x′ + ω² x = u.
fn receptance(frequency: f64, natural: f64, zeta: f64) -> (f64, f64) {
    let (w, n) = (TAU * frequency, TAU * natural);
    let (re, im) = (n * n - w * w, 2.0 * zeta * n * w);
    let phase = -im.atan2(re).to_degrees();
    (1.0 / re.hypot(im), phase)
}

fn driven(name: &'static str, n: usize, tones: &[f64], natural: f64) -> ExactMotion {
    let mut motion = ExactMotion { name, x: vec![], v: vec![], a: vec![], u: vec![], du: vec![] };
    for k in 0..n {
        let t = INTERVAL * k as f64;
        let (mut x, mut u) = (0.0, 0.0);
        for (i, f) in tones.iter().enumerate() {
            let start = 0.7 * (i * i) as f64;
            let (gain, phase) = receptance(*f, natural, 0.02);
            u += (TAU * f * t + start).cos();
            x += gain * (TAU * f * t + start + phase.to_radians()).cos();
        }
        motion.x.push(x);
        motion.u.push(u);
    }
    (motion.v, motion.a, motion.du) = (motion.x.clone(), motion.x.clone(), motion.u.clone());
    motion
}

#[test]
fn the_frequency_response_of_a_linear_oscillator_is_its_receptance() {
    // Eight averages of 4608 samples are segments of 1024: tones on every eighth line, apart in a Hann window.
    let (n, length) = (4608, 1024);
    let tones: Vec<f64> = (1..20).map(|k| (8 * k) as f64 / (length as f64 * INTERVAL)).collect();
    let outcome = outcome(&[("x", -1.0)], &[driven("multisine", n, &tones, 4.0)]);
    for noisy_input in [false, true] {
        let response = FrequencyResponse::new(&outcome, &[0], 0, 0, 8, noisy_input).unwrap();
        assert_eq!((response.segments, response.tones.len()), (8, 0));
        let mut found = 0;
        for tone in &tones {
            let Some(k) = response.frequency.iter().position(|f| (f / tone - 1.0).abs() < 1e-9) else { continue };
            let (gain, phase) = receptance(*tone, 4.0, 0.02);
            // The means of segments that are taken away leak a little of one tone into the next.
            assert!((response.measured.gain[k] / gain - 1.0).abs() < 1e-9, "{tone}");
            assert!((response.measured.phase[k] - phase).abs() < 1e-6, "{tone}: {}", response.measured.phase[k]);
            assert!(response.measured.coherence[k] > 1.0 - 1e-9);
            assert!((response.simulated.gain[k] / gain - 1.0).abs() < 1e-9, "{tone}");
            found += 1;
        }
        assert_eq!(found, tones.len());
    }
}

#[test]
fn noise_on_the_response_shows_in_the_coherence_and_in_the_error() {
    let tones: Vec<f64> = (1..20).map(|k| 0.78125 * f64::from(k)).collect();
    let mut motion = driven("multisine", 4608, &tones, 4.0);
    let mut random = rand_pcg::Pcg64::seed_from_u64(3);
    let normal = Normal::new(0.0, 2e-3).unwrap();
    motion.x.iter_mut().for_each(|x| *x += normal.sample(&mut random));
    let outcome = outcome(&[("x", -1.0)], &[motion]);
    let response = FrequencyResponse::new(&outcome, &[0], 0, 0, 8, false).unwrap();
    let at = |f: f64| response.frequency.iter().position(|g| (g / f - 1.0).abs() < 1e-9).unwrap();
    // At resonance the response stands far above the noise, at the highest tone it does not.
    let (near, far) = (at(0.78125 * 5.0), at(0.78125 * 19.0));
    assert!(response.measured.coherence[near] > 0.99 && response.measured.coherence[far] < 0.9);
    assert!(response.error[near] < 0.03 && response.error[far] > 0.08);
}

#[test]
fn single_tones_are_points_at_their_frequency() {
    let motions = [2.513, 3.871, 5.242].map(|f| driven("tone", 1600, &[f], 4.0));
    let outcome = outcome(&[("x", -1.0)], &motions);
    let response = FrequencyResponse::new(&outcome, &[2, 0, 1], 0, 0, 8, false).unwrap();
    assert!(response.frequency.is_empty());
    assert_eq!(response.tones.len(), 3);
    for (tone, f) in response.tones.iter().zip([2.513, 3.871, 5.242]) {
        let (gain, phase) = receptance(f, 4.0, 0.02);
        assert!((tone.frequency / f - 1.0).abs() < 1e-9, "{}", tone.frequency);
        assert!((tone.measured[0] / gain - 1.0).abs() < 1e-7 && (tone.measured[1] - phase).abs() < 1e-5);
        assert!((tone.simulated.unwrap()[0] / gain - 1.0).abs() < 1e-7);
    }
}

#[test]
fn what_has_no_frequency_response_says_why() {
    let mut still = ExactMotion::wandering(400);
    still.u.fill(0.2);
    let of = |motion: ExactMotion| FrequencyResponse::new(&outcome(&[("x", -1.0)], &[motion]), &[0], 0, 0, 8, false);
    assert_eq!(of(still), Err(NoResponse::Silent));
    let mut free = ExactMotion::wandering(400);
    (free.u, free.du) = (vec![], vec![]);
    assert_eq!(of(free), Err(NoResponse::NoInput));
    assert_eq!(of(driven("short", 20, &[1.0, 7.0], 4.0)), Err(NoResponse::TooShort));
}

/// A free motion by classical Runge–Kutta steps, ten a sample.
fn released(amplitude: f64, n: usize, law: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let (mut x, mut v, h) = (amplitude, 0.0, 0.1 * INTERVAL);
    (0..n)
        .map(|_| {
            let now = x;
            for _ in 0..10 {
                let (k1, l1) = (v, law(x, v));
                let (k2, l2) = (v + 0.5 * h * l1, law(x + 0.5 * h * k1, v + 0.5 * h * l1));
                let (k3, l3) = (v + 0.5 * h * l2, law(x + 0.5 * h * k2, v + 0.5 * h * l2));
                let (k4, l4) = (v + h * l3, law(x + h * k3, v + h * l3));
                x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                v += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
            }
            now
        })
        .collect()
}

#[test]
fn a_linear_decay_has_one_frequency_and_one_damping_ratio() {
    let (natural, zeta) = (TAU * 1.3, 0.013);
    let x = released(0.02, 6000, |x, v| -natural * natural * x - 2.0 * zeta * natural * v);
    let decay = Decay::new(&x, 5.0, INTERVAL, 0.0).unwrap();
    assert!(decay.time.len() > 100 && decay.time[0] > 5.0);
    let damped = 1.3 * f64::sqrt(1.0 - zeta * zeta);
    for k in 0..decay.time.len() {
        // A polynomial of fourth order over a quarter period misplaces an extreme by some 1e-5 of a period.
        assert!((decay.frequency[k] / damped - 1.0).abs() < 1e-4, "{k}: {}", decay.frequency[k]);
        assert!((decay.damping[k] / zeta - 1.0).abs() < 2e-3, "{k}: {}", decay.damping[k]);
        let envelope = 0.02 * (-zeta * natural * (decay.time[k] - 5.0)).exp();
        assert!((decay.amplitude[k] / envelope - 1.0).abs() < 1e-2, "{k}");
    }
}

#[test]
fn a_duffing_oscillator_has_its_backbone() {
    // ω ≈ ω₀ + 3/8 γA²/ω₀, good to the square of γA²/ω₀² (here 0.045).
    let (w, gamma) = (TAU, 200.0);
    let x = released(0.1, 12_000, |x, v| -w * w * x - gamma * x.powi(3) - 0.1 * v);
    let decay = Decay::new(&x, 0.0, INTERVAL, 0.0).unwrap();
    assert!(decay.amplitude[0] > 0.09 && *decay.amplitude.last().unwrap() < 0.01);
    for (a, f) in decay.amplitude.iter().zip(&decay.frequency) {
        let backbone = (w + 0.375 * gamma * a * a / w) / TAU;
        let next = 0.1 * (gamma * a * a / w / w).powi(2);
        assert!((f / backbone - 1.0).abs() < next + 2e-4, "{a}: {f} {backbone}");
    }
}

#[test]
fn coulomb_friction_damps_small_swings_more() {
    // Each half swing is smaller by 2 F / k, so the equivalent damping ratio is 2 F / (π k A).
    let (k, friction) = (TAU * TAU, 0.02);
    let x = released(0.1, 6000, |x, v| -k * x - friction * sindyscope_values::term::sign(v));
    let decay = Decay::new(&x, 0.0, INTERVAL, 0.0).unwrap();
    for (a, zeta) in decay.amplitude.iter().zip(&decay.damping).filter(|(a, _)| **a > 0.01) {
        let exact = 2.0 * friction / (PI * k * a);
        // Averaged over swings between which the amplitude falls by a fifth.
        assert!((zeta / exact - 1.0).abs() < 0.03, "{a}: {zeta} {exact}");
    }
}

#[test]
fn noise_blurs_a_decay_no_more_than_it_must() {
    let (natural, zeta) = (TAU * 1.3, 0.01);
    let mut x = released(0.02, 5000, |x, v| -natural * natural * x - 2.0 * zeta * natural * v);
    let mut random = rand_pcg::Pcg64::seed_from_u64(11);
    let normal = Normal::new(0.0, 1e-4).unwrap();
    x.iter_mut().for_each(|x| *x += normal.sample(&mut random));
    let decay = Decay::new(&x, 0.0, INTERVAL, 1e-4).unwrap();
    let large: Vec<usize> = (0..decay.time.len()).filter(|k| decay.amplitude[*k] > 4e-3).collect();
    assert!(large.len() > 30);
    for k in large {
        assert!((decay.frequency[k] / 1.3 - 1.0).abs() < 5e-3, "{k}: {}", decay.frequency[k]);
        assert!((decay.damping[k] / zeta - 1.0).abs() < 0.3, "{k}: {}", decay.damping[k]);
    }
}

#[test]
fn what_is_no_decay_says_so() {
    let steady: Vec<f64> = (0..2000).map(|k| (TAU * 1.3 * INTERVAL * k as f64).sin()).collect();
    assert_eq!(Decay::new(&steady, 0.0, INTERVAL, 0.0), Err(NoDecay::NotDecaying));
    assert_eq!(Decay::new(&[1.0; 500], 0.0, INTERVAL, 0.0), Err(NoDecay::FewSwings));
    assert_eq!(Decay::new(&[], 0.0, INTERVAL, 0.0), Err(NoDecay::FewSwings));
    let driven = outcome(&[("x", -1.0)], &[ExactMotion::wandering(900)]);
    assert_eq!(Decay::stretch(&driven.records[0].record), Err(NoDecay::Driven));
    // Pushed for a second, then left alone.
    let mut pushed = ExactMotion::wandering(900);
    pushed.u[100..].fill(0.1);
    let pushed = outcome(&[("x", -1.0)], &[pushed]);
    assert_eq!(Decay::stretch(&pushed.records[0].record), Ok(100..900));
}

fn white(n: usize, seed: u64) -> Vec<f64> {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let normal = Normal::new(0.0, 3.0).unwrap();
    (0..n).map(|_| normal.sample(&mut random)).collect()
}

#[test]
fn a_white_residual_stays_within_its_bands() {
    let (e, u) = (white(20_000, 1), white(20_000, 2));
    let partner = Partner::Symbol(Symbol::Input(0));
    let residual = Residual::of(&e, INTERVAL, Some(100.0), vec![(partner, u)]).unwrap();
    assert_eq!(residual.itself.lags, 0..=200);
    assert!((residual.itself.value[0] - 1.0).abs() < 1e-12);
    assert!((residual.itself.band - 1.96 / f64::sqrt(20_000.0)).abs() < 1e-6);
    // Of 200 lags about 10 are outside, give or take 3; of 401 about 20.
    assert!((0.01..0.10).contains(&residual.itself.outside), "{}", residual.itself.outside);
    assert_eq!(residual.with[0].lags, -200..=200);
    assert!((0.015..0.10).contains(&residual.with[0].outside), "{}", residual.with[0].outside);
    let histogram = &residual.histogram;
    assert!((histogram.deviation - 3.0).abs() < 0.05 && histogram.mean.abs() < 0.1);
    assert!(histogram.skewness.abs() < 0.06 && histogram.kurtosis.abs() < 0.12);
    let area: f64 = histogram.edges.windows(2).zip(&histogram.density).map(|(e, d)| (e[1] - e[0]) * d).sum();
    assert!((area - 1.0).abs() < 1e-12);
    let middle = histogram.density[histogram.density.len() / 2];
    assert!((middle / histogram.normal(histogram.mean) - 1.0).abs() < 0.1);
}

#[test]
fn two_slow_series_that_have_nothing_to_do_with_each_other_stay_within_wider_bands() {
    let slow = |seed| {
        let mut state = 0.0;
        let next = |e: &f64| {
            state = 0.95 * state + e;
            state
        };
        white(20_000, seed).iter().map(next).collect::<Vec<f64>>()
    };
    let partner = Partner::Symbol(Symbol::State(0));
    let residual = Residual::of(&slow(5), INTERVAL, Some(200.0), vec![(partner, slow(6))]).unwrap();
    assert!(residual.itself.outside > 0.2, "it remembers, and says so");
    let plain = 1.96 / f64::sqrt(20_000.0);
    // √((1 + 0.95²) / (1 − 0.95²)) = 4.4
    assert!((residual.with[0].band / plain / 4.4 - 1.0).abs() < 0.15, "{}", residual.with[0].band / plain);
    assert!(residual.with[0].outside < 0.25, "{}", residual.with[0].outside);
}

#[test]
fn a_delayed_echo_shows_at_its_lag() {
    let u = white(5000, 3);
    let e: Vec<f64> = white(5000, 4).iter().enumerate().map(|(k, e)| e + if k >= 7 { u[k - 7] } else { 0.0 }).collect();
    let residual = Residual::of(&e, INTERVAL, Some(20.0), vec![(Partner::Symbol(Symbol::Input(0)), u)]).unwrap();
    let with = &residual.with[0];
    let (at, _) = with.value.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
    assert_eq!(with.lags.clone().nth(at), Some(7), "what follows its cause by 7 samples is at lag 7");
    assert!((with.value[at] - 0.5_f64.sqrt()).abs() < 0.03, "{}", with.value[at]);
}

#[test]
fn the_residual_of_an_equation_goes_with_the_term_that_it_lacks() {
    let motion = ExactMotion::obeying(4000, |x, v, u, _| -4.0 * x - 0.5 * x.powi(3) - 0.2 * v + u);
    let outcome = outcome(&[("x", -4.0), ("v", -0.2), ("u", 1.0)], &[motion]);
    let residual = Residual::new(&outcome, &outcome.records[0], 0, ResidualSource::Equation).unwrap();
    let at_once = |c: &Correlation| c.value[c.value.len() / 2].abs();
    let best = residual.with.iter().max_by(|a, b| at_once(a).total_cmp(&at_once(b))).unwrap();
    assert_eq!(best.partner, Partner::Power(Symbol::State(0), 3));
    assert!(at_once(best) > 1.0 - 1e-9);
    // The response is the measurement here: nothing is left of it.
    assert!(Residual::new(&outcome, &outcome.records[0], 0, ResidualSource::Response).is_none());
}
