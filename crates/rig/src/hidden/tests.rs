//! What the rig promises of what it hides: checked on the records alone, by formulas and methods of their own.

mod regimes;

use rayon::prelude::*;

use super::*;
use crate::NoiseKind;

/// Samples of the fitted records where an equation is to be checked: 320 a natural period.
const DENSE: usize = 24_000;

fn clean(effects: &[&str], excitation_kind: ExcitationKind, seed: u64) -> HiddenRequest {
    HiddenRequest {
        instruments: Instruments::white(0.0),
        ..HiddenRequest::new(effects.iter().copied(), excitation_kind, seed)
    }
}

fn everything() -> Vec<&'static str> {
    names().chain(outside_names()).collect()
}

/// A record's motion by central differences of fourth order, two samples lost at each end.
struct DifferencedMotion {
    h: f64,
    t: Vec<f64>,
    x: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    u: Vec<f64>,
    du: Vec<f64>,
}

impl DifferencedMotion {
    fn new(record: &Record) -> Self {
        let x = &record.channel(Role::Displacement(0)).unwrap().values;
        let none = vec![0.0; x.len()];
        let u = record.channel(Role::Input(0)).map_or(&none[..], |c| &c.values);
        let h = record.interval;
        let inner = 2..x.len() - 2;
        let first = |y: &[f64]| -> Vec<f64> {
            let slope = |k: usize| (y[k - 2] - 8.0 * y[k - 1] + 8.0 * y[k + 1] - y[k + 2]) / (12.0 * h);
            inner.clone().map(slope).collect()
        };
        let second = |k: usize| (16.0 * (x[k - 1] + x[k + 1]) - x[k - 2] - x[k + 2] - 30.0 * x[k]) / (12.0 * h * h);
        Self {
            h,
            t: inner.clone().map(|k| record.time(k)).collect(),
            x: x[inner.clone()].to_vec(),
            v: first(x),
            a: inner.clone().map(second).collect(),
            u: u[inner.clone()].to_vec(),
            du: first(u),
        }
    }

    /// Integrates inner states along the path by the classical Runge–Kutta method over two samples at a time; gives what
    /// `force` says of them at every other sample.
    fn remember<const N: usize>(
        &self,
        begin: [f64; N],
        rate: impl Fn(usize, &[f64; N]) -> [f64; N],
        force: impl Fn(usize, &[f64; N]) -> f64,
    ) -> Vec<f64> {
        let mut z = begin;
        let mut forces = vec![f64::NAN; self.x.len()];
        let step = 2.0 * self.h;
        for k in (0..self.x.len() - 2).step_by(2) {
            forces[k] = force(k, &z);
            let along = |r: &[f64; N], share: f64| std::array::from_fn(|i| z[i] + share * step * r[i]);
            let a = rate(k, &z);
            let b = rate(k + 1, &along(&a, 0.5));
            let c = rate(k + 1, &along(&b, 0.5));
            let d = rate(k + 2, &along(&c, 1.0));
            z = std::array::from_fn(|i| z[i] + step / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
        forces
    }

    /// The input at another time than a sample's, by cubic interpolation.
    fn input(&self, series: &[f64], t: f64) -> f64 {
        let position = (t - self.t[0]) / self.h;
        let k = position.floor();
        if k < 1.0 || k as usize + 2 >= series.len() {
            return f64::NAN;
        }
        let (s, k) = (position - k, k as usize);
        let y = &series[k - 1..k + 3];
        -s * (s - 1.0) * (s - 2.0) / 6.0 * y[0] + (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0 * y[1]
            - (s + 1.0) * s * (s - 2.0) / 2.0 * y[2]
            + (s + 1.0) * s * (s - 1.0) / 6.0 * y[3]
    }
}

/// The missing acceleration that an effect's equation gives along a path; not a number where it says nothing.
fn expected(effect: &str, hidden: &Hidden, record: &Record, path: &DifferencedMotion) -> Vec<f64> {
    let truth = &hidden.truth;
    let p = |name: &str| truth.parameter(Some(effect), name).unwrap_or_else(|| panic!("{effect} has no {name}"));
    let joint = truth.description.contains("across the joint");
    let less = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
    let (q, w) =
        if joint { (less(&path.x, &path.u), less(&path.v, &path.du)) } else { (path.x.clone(), path.v.clone()) };
    let each = |f: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..q.len()).map(f).collect() };
    let own = |name| truth.parameter(None, name).unwrap_or_default();
    let (k, c) = (own("k"), own("c"));
    let given = |u: f64, du: f64| match truth.parameter(None, "b") {
        Some(b) => b * u,
        None => k * u + c * du,
    };
    let (x, v, u, du) = (&path.x, &path.v, &path.u, &path.du);
    match effect {
        "viscous_damping" => each(&|i| -p("c") * v[i]),
        "coulomb_friction" | "static_friction" => each(&|i| -p("F") * w[i].signum()),
        "stribeck_friction" => each(&|i| {
            let weakening = (-(w[i] / p("v_s")).powi(2)).exp();
            -(p("F") + (p("F_s") - p("F")) * weakening) * w[i].signum()
        }),
        "quadratic_damping" => each(&|i| -p("c_2") * w[i] * w[i].abs()),
        "cubic_damping" => each(&|i| -p("c_3") * w[i].powi(3)),
        "displacement_dependent_damping" => each(&|i| -p("mu") * q[i].powi(2) * w[i]),
        "position_dependent_friction" => each(&|i| -p("f") * q[i].abs() * w[i].signum()),
        "linear_stiffness" => each(&|i| -p("k_g") * x[i]),
        "quadratic_stiffness" => each(&|i| -p("k_2") * q[i].powi(2)),
        "cubic_stiffness" => each(&|i| -p("k_3") * q[i].powi(3)),
        "quintic_stiffness" => each(&|i| -p("k_5") * q[i].powi(5)),
        "clearance" => each(&|i| -p("k_c") * (q[i] - q[i].clamp(-p("d"), p("d")))),
        "one_sided_stop" => each(&|i| -p("k_s") * (q[i] - p("d")).max(0.0)),
        "bilinear_stiffness" => each(&|i| -p("k_b") * q[i].max(0.0)),
        "pendulum_restoring" => each(&|i| -k * (x[i].sin() - x[i])),
        "bouc_wen_hysteresis" => {
            let n = p("n");
            let sum = p("x_y").powf(-n);
            let (beta, gamma) = (p("beta_share") * sum, (1.0 - p("beta_share")) * sum);
            let rate = |i: usize, z: &[f64; 1]| {
                let size = z[0].abs().powf(n);
                [w[i] - beta * w[i].abs() * size * z[0].signum() - gamma * w[i] * size]
            };
            path.remember([0.0], rate, |_, z| -p("k_h") * z[0])
        }
        "viscoelastic_relaxation" => path.remember([0.0], |i, z| [w[i] - z[0] / p("tau")], |_, z| -p("k_v") * z[0]),
        "second_mode" => {
            let (rate, zeta) = (p("omega_2"), p("zeta_2"));
            let pull = |i: usize, z: &[f64; 2]| rate * rate * (z[0] - x[i]) + 2.0 * zeta * rate * (z[1] - v[i]);
            path.remember([x[0], v[0]], |i, z| [z[1], -pull(i, z)], |i, z| p("mu") * pull(i, z))
        }
        "constant_force" => each(&|_| p("g")),
        "base_velocity" => each(&|i| p("c_b") * du[i]),
        "input_delay" => each(&|i| {
            let then = path.t[i] - p("tau");
            given(path.input(u, then) - u[i], path.input(du, then) - du[i])
        }),
        "input_saturation" => each(&|i| {
            let limit = p("L");
            let over = if u[i].abs() > limit { du[i] } else { 0.0 };
            given(u[i].clamp(-limit, limit) - u[i], -over)
        }),
        "input_gain" => each(&|i| p("gamma") * k * u[i]),
        "unmeasured_harmonic_force" => each(&|i| p("P") * (p("Omega") * path.t[i] + p("phi")).cos()),
        "parametric_stiffness" => each(&|i| -p("k_p") * q[i] * (p("Omega") * path.t[i] + p("phi")).cos()),
        "stiffness_drift" => each(&|i| -p("k_d") * q[i] * (path.t[i] / p("T") - 0.5)),
        "sensor_offset" => each(&|_| k * p(&format!("y_0 of {}", record.name))),
        // Where it does not clip, nothing is missing.
        "sensor_clipping" => each(&|i| if x[i].abs() < 0.98 * p("L") { 0.0 } else { f64::NAN }),
        "fractional_damping" => {
            // The branches as the module's documentation gives them.
            let (order, natural) = (p("alpha"), k.sqrt());
            let spacing = 4.0 * std::f64::consts::LN_10 / 8.0;
            let tau = |j: usize| 0.05 * (spacing * j as f64).exp();
            let weight = p("c_alpha") * spacing * (std::f64::consts::PI * order).sin() / std::f64::consts::PI;
            let rate = |i: usize, z: &[f64; 9]| std::array::from_fn(|j| w[i] - z[j] / (tau(j) / natural));
            let force = |_: usize, z: &[f64; 9]| -(0..9).map(|j| weight * tau(j).powf(-order) * z[j]).sum::<f64>();
            path.remember([0.0; 9], rate, force)
        }
        "magnet" => each(&|i| p("q") * ((p("d") - q[i]).powi(-2) - p("d").powi(-2))),
        "play_operator" => {
            let engaged = |i: usize, z: &[f64; 1]| {
                let stretch = q[i] - z[0];
                stretch - stretch.clamp(-p("d"), p("d"))
            };
            path.remember([0.0], |i, z| [engaged(i, z) / p("tau")], |i, z| -p("k_j") * engaged(i, z))
        }
        "rate_dependent_friction" => each(&|i| {
            let grown = 0.5 * (1.0 + (w[i] / p("v_0")).powi(2)).ln();
            -p("F") * (1.0 + p("a") * grown) * w[i].signum()
        }),
        "impact_restitution" => each(&|i| -p("k_s") * (q[i] - p("d")).max(0.0) * (1.0 + p("a") * w[i]).max(0.0)),
        "inertia_nonlinearity" => each(&|i| -p("kappa") * (x[i].powi(2) * path.a[i] + x[i] * v[i].powi(2))),
        other => panic!("{other} is not checked"),
    }
}

/// What the records' acceleration has beyond the linear plant's.
fn found(hidden: &Hidden, path: &DifferencedMotion) -> Vec<f64> {
    let truth = &hidden.truth;
    let (k, c) = (truth.parameter(None, "k").unwrap(), truth.parameter(None, "c").unwrap());
    let b = truth.parameter(None, "b");
    let base = |i: usize| match b {
        Some(b) => -k * path.x[i] - c * path.v[i] + b * path.u[i],
        // Without an input, both are zero.
        None => -k * (path.x[i] - path.u[i]) - c * (path.v[i] - path.du[i]),
    };
    (0..path.x.len()).map(|i| path.a[i] - base(i)).collect()
}

fn spring_rms(hidden: &Hidden, path: &DifferencedMotion) -> f64 {
    let k = hidden.truth.parameter(None, "k").unwrap();
    let joint = |i: usize| if hidden.base_excited { path.x[i] - path.u[i] } else { path.x[i] };
    Magnitude::over((0..path.x.len()).map(|i| k * joint(i))).rms
}

fn holds(effect: &str, excitation_kind: ExcitationKind, seed: u64) {
    // A decay is shorter: as many samples would be too dense to differentiate.
    let samples = if excitation_kind == ExcitationKind::Decay { DENSE / 4 } else { DENSE };
    let hidden = draw(&HiddenRequest { samples, ..clean(&[effect], excitation_kind, seed) }).unwrap();
    for record in hidden.fit.iter().chain(&hidden.held_out) {
        let path = DifferencedMotion::new(record);
        let (found, expected) = (found(&hidden, &path), expected(effect, &hidden, record, &path));
        let spring = spring_rms(&hidden, &path);
        let mut errors: Vec<f64> =
            found.iter().zip(&expected).filter(|(_, e)| e.is_finite()).map(|(f, e)| (f - e).abs() / spring).collect();
        errors.sort_by(f64::total_cmp);
        // Ten digits of the peak, differentiated twice at 320 samples a period, are 1e-10 × 5.3/12 × (320/2π)² ≈ 1e-7 of the
        // peak's spring force at worst; inner states begin two samples late, which is forgotten. Near a kink or jump the
        // differences do not hold, and a mass that sticks is not held by its sliding force; that is up to half of the time.
        let share = if hidden.truth.description.contains("friction") { 0.5 } else { 0.9 };
        let error = errors[(share * errors.len() as f64) as usize];
        assert!(
            error < 2e-5,
            "{effect} {excitation_kind} {seed} {}: {error:e} {}",
            record.name,
            hidden.truth.description
        );
    }
}

#[test]
fn records_obey_the_equation_of_what_they_hide() {
    everything().par_iter().for_each(|effect| holds(effect, ExcitationKind::Multisine, 1));
}

#[test]
fn times_and_phases_are_the_records_own_after_a_transient_is_cut() {
    for effect in ["unmeasured_harmonic_force", "parametric_stiffness", "stiffness_drift", "input_delay"] {
        holds(effect, ExcitationKind::SingleTone, 3);
    }
}

#[test]
fn decays_obey_their_equation_too() {
    for effect in ["cubic_stiffness", "bilinear_stiffness", "quadratic_damping", "constant_force", "sensor_clipping"] {
        holds(effect, ExcitationKind::Decay, 4);
    }
}

#[test]
#[ignore = "half a minute where tests are not optimised; run with --profile study"]
fn pairs_are_both_there() {
    pairs().par_iter().filter(|p| !p.contains(&"second_mode")).for_each(|pair| {
        let hidden = draw(&HiddenRequest { samples: DENSE, ..clean(pair, ExcitationKind::Multisine, 5) }).unwrap();
        assert_eq!(hidden.truth.effects, pair);
        // Both are told across the joint or to the ground in one sentence: only pairs that agree can be checked by it.
        let places = ["across the joint", "to the ground"].map(|p| hidden.truth.description.contains(p));
        if places == [true, true] {
            return;
        }
        for record in &hidden.fit {
            let path = DifferencedMotion::new(record);
            let parts = pair.map(|effect| expected(effect, &hidden, record, &path));
            let found = found(&hidden, &path);
            let spring = spring_rms(&hidden, &path);
            let mut errors: Vec<f64> = (0..found.len())
                .map(|i| (found[i] - parts[0][i] - parts[1][i]).abs() / spring)
                .filter(|e| e.is_finite())
                .collect();
            errors.sort_by(f64::total_cmp);
            // As for single effects.
            assert!(errors[errors.len() / 2] < 2e-5, "{pair:?}: {:e}", errors[errors.len() / 2]);
        }
    });
}

#[test]
fn nothing_hidden_is_a_linear_plant() {
    for excitation_kind in ExcitationKind::ALL {
        let hidden = draw(&HiddenRequest { samples: DENSE, ..clean(&[], excitation_kind, 6) }).unwrap();
        assert_eq!((hidden.truth.ratio, hidden.truth.effects.len()), (0.0, 0));
        for record in hidden.fit.iter().chain(&hidden.held_out) {
            let path = DifferencedMotion::new(record);
            let error = Magnitude::over(found(&hidden, &path).into_iter()).rms / spring_rms(&hidden, &path);
            // Ten digits differentiated twice; a decay is sampled up to six times as densely, 36 × 1e-7 of its peak, and
            // ends at a twentieth of that.
            assert!(error < 1e-4, "{excitation_kind}: {error:e}");
        }
    }
}

#[test]
fn the_missing_force_is_of_the_size_asked_for() {
    // These stay below what was asked for only where they would no longer be what they are called.
    let weak = [
        "input_delay",
        "input_saturation",
        "input_gain",
        "base_velocity",
        "sensor_clipping",
        "magnet",
        "play_operator",
    ];
    let ways = [ExcitationKind::Multisine, ExcitationKind::SweepPair, ExcitationKind::Tones, ExcitationKind::Decay];
    let turn = |(k, effect): (usize, &'static str)| {
        let way = ways.into_iter().cycle().skip(k).find(|way| possible(effect, *way));
        (effect, way.unwrap())
    };
    let cases: Vec<(&str, ExcitationKind)> = everything().into_iter().enumerate().map(turn).collect();
    cases.par_iter().for_each(|(effect, excitation_kind)| {
        let hidden = draw(&HiddenRequest { ratio: Some(0.04), ..clean(&[effect], *excitation_kind, 7) }).unwrap();
        let reached = hidden.truth.ratio / 0.04;
        let least = if weak.contains(effect) || *effect == "static_friction" { 0.3 } else { 0.9 };
        // Static friction is raised until it holds the mass at all, lowered where it holds it most of the time.
        let most = if *effect == "static_friction" { 15.0 } else { 1.1 };
        assert!((least..most).contains(&reached), "{effect} {excitation_kind}: {reached} of what was asked for");
    });
}

#[test]
fn a_draw_is_the_same_for_ever_and_its_plant_whatever_watches_it() {
    let request = HiddenRequest::new(["coulomb_friction"], ExcitationKind::SweepPair, 8);
    let (one, two) = (draw(&request).unwrap(), draw(&request).unwrap());
    assert_eq!(one, two);
    let instruments = Instruments { kind: NoiseKind::Coloured, input_share: 0.0, ..Instruments::white(0.05) };
    let noisy = draw(&HiddenRequest { instruments, ..request.clone() }).unwrap();
    assert_eq!(one.truth.parameters, noisy.truth.parameters);
    assert_ne!(one.fit, noisy.fit);
    assert_ne!(one.truth.parameters, draw(&HiddenRequest { seed: 9, ..request }).unwrap().truth.parameters);
}

#[test]
fn usual_draws_are_what_they_were_when_studies_were_made_with_them() {
    // FNV-1a over the bits of every sample.
    let print = |effects: &[&str], excitation_kind, seed| {
        let hidden = draw(&HiddenRequest::new(effects.iter().copied(), excitation_kind, seed)).unwrap();
        let values =
            hidden.fit.iter().chain(&hidden.held_out).flat_map(|r| &r.channels).flat_map(|c| c.values.to_vec());
        let bytes = values.flat_map(|x| x.to_bits().to_le_bytes());
        bytes.fold(0xcbf2_9ce4_8422_2325_u64, |h, byte| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
    };
    let prints = [
        print(&["coulomb_friction"], ExcitationKind::Multisine, 0),
        print(&["input_delay"], ExcitationKind::SweepPair, 1),
        print(&["cubic_stiffness", "coulomb_friction"], ExcitationKind::Tones, 2),
        print(&["quadratic_damping"], ExcitationKind::Decay, 3),
        print(&["bouc_wen_hysteresis"], ExcitationKind::SingleTone, 4),
        print(&[], ExcitationKind::Multisine, 5),
    ];
    assert_eq!(
        prints,
        [
            18_000_292_679_249_185_644,
            4_384_798_982_319_049_932,
            16_936_732_503_845_929_660,
            13_180_221_814_484_214_387,
            11_392_761_991_955_605_978,
            12_001_221_856_200_059_779,
        ]
    );
}

#[test]
fn records_carry_no_hint() {
    let plain = draw(&clean(&[], ExcitationKind::SweepPair, 10)).unwrap();
    for effect in everything().into_iter().step_by(3) {
        let hidden = draw(&clean(&[effect], ExcitationKind::SweepPair, 10)).unwrap();
        for (own, other) in [(&hidden.fit, &plain.fit), (&hidden.held_out, &plain.held_out)] {
            assert_eq!(own.len(), other.len());
            for (own, other) in own.iter().zip(other) {
                assert_eq!((&own.name, own.len(), &own.notices), (&other.name, other.len(), &other.notices));
                assert_eq!((&own.source, own.channels.len()), (&None, 2));
                assert_eq!([&*own.channels[0].name, &*own.channels[1].name], ["x", "u"]);
            }
        }
    }
}

#[test]
fn friction_that_sticks_holds_the_mass_still_up_to_its_static_level() {
    let free = (0..40)
        .map(|seed| draw(&clean(&["static_friction"], ExcitationKind::Multisine, seed)).unwrap())
        .find(|h| !h.base_excited)
        .unwrap();
    let p = |name| free.truth.parameter(Some("static_friction"), name).unwrap();
    let (k, b) = (free.truth.parameter(None, "k").unwrap(), free.truth.parameter(None, "b").unwrap());
    let mut strongest = 0.0_f64;
    for record in &free.fit {
        let (x, u) = (&record.channels[0].values, &record.channels[1].values);
        for i in (1..x.len() - 1).filter(|i| x[i - 1] == x[*i] && x[*i] == x[i + 1]) {
            strongest = strongest.max((b * u[i] - k * x[i]).abs());
        }
    }
    // Sampled up to a fortieth of a period before it lets go.
    assert!(strongest < 1.0001 * p("F_s") && strongest > p("F"), "{strongest} {}", free.truth.description);
}

#[test]
#[ignore = "half a minute where tests are not optimised; run with --profile study"]
fn what_a_static_level_changes_is_known() {
    let beyond =
        |effect: &str, seed| draw(&clean(&[effect], ExcitationKind::Multisine, seed)).unwrap().truth.beyond_simpler;
    assert!((0..5).all(|seed| beyond("coulomb_friction", seed).is_none()));
    let changes: Vec<f64> = (0..5).map(|seed| beyond("static_friction", seed).unwrap()).collect();
    assert!(changes.iter().all(|c| *c >= 0.0 && c.is_finite()) && changes.iter().any(|c| *c > 0.0), "{changes:?}");
}

#[test]
fn a_velocity_or_an_acceleration_alone_is_that_of_the_displacement() {
    let made = |shown, share| {
        let instruments = Instruments { shown, input_share: 0.0, ..Instruments::white(share) };
        let effect = clean(&["cubic_damping"], ExcitationKind::Multisine, 3);
        draw(&HiddenRequest { instruments, samples: DENSE, ..effect }).unwrap()
    };
    let displacement = made(SensedMotion::Displacement, 0.0);
    let path = DifferencedMotion::new(&displacement.fit[0]);
    let length = &displacement.fit[0].channel(Role::Displacement(0)).unwrap().unit;
    for (shown, role, per, expected) in [
        (SensedMotion::Velocity, Role::Velocity(0), "/s", &path.v),
        (SensedMotion::Acceleration, Role::Acceleration(0), "/s^2", &path.a),
    ] {
        let hidden = made(shown, 0.0);
        let record = &hidden.fit[0];
        let channel = record.channel(role).unwrap();
        assert_eq!(channel.unit, format!("{length}{per}"));
        assert!(record.channel(Role::Displacement(0)).unwrap().estimated);
        let values = &channel.values[2..channel.values.len() - 2];
        let largest = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let off = values.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-5 * largest, "{shown:?}: {off} of {largest}");
        // The noise is a share of what is shown.
        let noisy = made(shown, 0.02);
        let fitted = hidden.fit.iter().flat_map(|r| r.channel(role).unwrap().values.to_vec());
        let rms = Magnitude::over(fitted).rms;
        assert!((noisy.truth.noise / rms / 0.02 - 1.0).abs() < 1e-9);
    }
    let fault = HiddenRequest::new(["sensor_offset"], ExcitationKind::Multisine, 1);
    let refused = draw(&HiddenRequest {
        instruments: Instruments { shown: SensedMotion::Velocity, ..fault.instruments },
        ..fault
    });
    assert!(matches!(refused, Err(RigError::BadOption { option: "measure", .. })), "{refused:?}");
}

#[test]
fn noise_is_of_the_kind_and_size_asked_for() {
    let draw_with = |kind, share| {
        let instruments = Instruments { kind, input_share: 0.0, ..Instruments::white(share) };
        draw(&HiddenRequest { instruments, ..clean(&["cubic_damping"], ExcitationKind::Tones, 11) }).unwrap()
    };
    let values = |h: &Hidden| -> Vec<f64> {
        h.fit.iter().flat_map(|r| r.channel(Role::Displacement(0)).unwrap().values.to_vec()).collect()
    };
    let clean = values(&draw_with(NoiseKind::White, 0.0));
    let rms = Magnitude::over(clean.iter().copied()).rms;
    for kind in NoiseKind::ALL {
        let hidden = draw_with(kind, 0.05);
        let noise: Vec<f64> = values(&hidden).iter().zip(&clean).map(|(a, b)| a - b).collect();
        let size = Magnitude::over(noise.iter().copied()).rms;
        let lagged = noise.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / noise.len() as f64 / size.powi(2);
        // 3000 samples, of which coloured noise leaves a ninth to count: four standard errors of 4 % are 16 %.
        assert!((size / hidden.truth.noise - 1.0).abs() < 0.16, "{kind}: {size} {}", hidden.truth.noise);
        match kind {
            NoiseKind::White => assert!(lagged.abs() < 0.08, "{lagged}"),
            NoiseKind::Coloured => assert!((lagged - 0.8).abs() < 0.08, "{lagged}"),
            NoiseKind::Quantised => {
                let step = 0.05 * rms;
                assert!(noise.iter().all(|e| e.abs() < 0.5001 * step), "{step}");
            }
        }
    }
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    for (effects, excitation_kind, part) in [
        (&["friction"][..], ExcitationKind::Tones, "there is no effect"),
        (&["input_delay"], ExcitationKind::Decay, "needs an input"),
        (&["pendulum_restoring", "base_velocity"], ExcitationKind::Tones, "different plants"),
    ] {
        let error = draw(&clean(effects, excitation_kind, 1)).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    for (ratio, samples, share) in
        [(Some(0.0), 3000, 0.0), (Some(f64::NAN), 3000, 0.0), (None, 0, 0.0), (None, 3000, -1.0)]
    {
        let request = HiddenRequest { ratio, samples, ..clean(&["magnet"], ExcitationKind::Tones, 1) };
        let request = HiddenRequest { instruments: Instruments { share, ..request.instruments }, ..request };
        assert!(matches!(draw(&request), Err(RigError::BadOption { .. })));
    }
}

#[test]
fn a_blind_draw_hides_one_named_effect() {
    let drawn: Vec<Hidden> = (0..12).map(|seed| blind(seed).unwrap()).collect();
    for hidden in &drawn {
        assert!(names().any(|n| hidden.truth.effects == [n]));
    }
    assert!(drawn.iter().any(|h| h.truth.effects != drawn[0].truth.effects));
}

#[test]
fn what_an_excitation_cannot_show_is_said() {
    assert!(
        exercised("base_velocity", ExcitationKind::Multisine) && !exercised("base_velocity", ExcitationKind::Decay)
    );
    assert!(
        exercised("sensor_offset", ExcitationKind::Decay) && !exercised("viscous_damping", ExcitationKind::SingleTone)
    );
    assert!(names().chain(outside_names()).all(|e| exercised(e, ExcitationKind::Tones)));
    assert_eq!((names().count(), outside_names().count(), pairs().len()), (29, 6, 12));
}
