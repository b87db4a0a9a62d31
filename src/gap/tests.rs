use super::data::step;
use super::effects::{Setting, catalogue};
use super::motion::{Oscillator, Variation, smooth};
use super::outcome::Curve;
use crate::simulate::Output;
use crate::term::list;

fn setting(base_excited: bool) -> Setting {
    Setting {
        base_excited,
        input_open: false,
        has_input: true,
        terms: list(if base_excited { "x-u, v-du" } else { "x, v, u" }).unwrap(),
        unit: "rad".into(),
        reach: [1.0, 1.2],
        speed: [10.0, 12.0],
        input: 0.5,
        speed_noise: 0.01,
        frequency: 2.0,
        lines: vec![1.0],
        pulsations: vec![1.0],
        interval: 0.01,
        measured: 1.1,
        derivatives: 0,
    }
}

#[test]
fn the_catalogue_has_every_name_of_the_interface() {
    const NAMES: &str = "viscous_damping coulomb_friction stribeck_friction static_friction quadratic_damping cubic_damping \
        displacement_dependent_damping position_dependent_friction linear_stiffness quadratic_stiffness cubic_stiffness \
        quintic_stiffness clearance one_sided_stop bilinear_stiffness pendulum_restoring bouc_wen_hysteresis \
        viscoelastic_relaxation second_mode constant_force base_velocity input_delay input_saturation input_gain \
        unmeasured_harmonic_force parametric_stiffness stiffness_drift sensor_offset sensor_clipping";
    let forms = catalogue(&setting(true));
    for name in NAMES.split_whitespace() {
        assert!(forms.iter().any(|f| f.effect == name), "{name}");
    }
}

#[test]
fn every_form_builds_at_every_point_of_its_grid() {
    for base_excited in [false, true] {
        for form in catalogue(&setting(base_excited)) {
            for point in form.grid() {
                let addition = form.addition(&point);
                assert_eq!(addition.terms.len(), form.coefficients.len(), "{form:?} {point:?}");
                for (value, inner) in point.iter().zip(&form.inner) {
                    assert!((inner.bounds.0..=inner.bounds.1).contains(value), "{form:?} {}: {value}", inner.name);
                }
            }
        }
    }
}

#[test]
fn an_oscillator_answers_a_step_as_the_textbook_says() {
    // x″ = 1 − 4 x − 0.4 x′ from rest: x = (1 − e^{−0.2 t}(cos w t + 0.2/w sin w t))/4 with w² = 4 − 0.04.
    let oscillator = Oscillator::new(4.0, 0.4, 0.05);
    let mut x = Vec::new();
    oscillator.respond(&[1.0; 200], &mut x);
    let w = f64::sqrt(3.96);
    for (k, x) in x.iter().enumerate() {
        let t = 0.05 * k as f64;
        let want = 0.25 * (1.0 - (-0.2 * t).exp() * ((w * t).cos() + 0.2 / w * (w * t).sin()));
        assert!((x - want).abs() < 1e-12, "{t}: {x} {want}");
    }
}

#[test]
fn a_variation_follows_the_slopes_it_is_given() {
    // Constant slopes, put as kicks on another oscillator, are those of their own oscillator.
    let (interval, n) = (0.02, 1000);
    let force: Vec<f64> = (0..n).map(|k| (0.9 * interval * k as f64).sin()).collect();
    let (mut kicked, mut own) = (Vec::new(), Vec::new());
    Variation::new(Oscillator::new(4.0, 0.4, interval), &vec![(5.0, 0.7); n]).respond(
        &force,
        Output::Displacement(0),
        &mut kicked,
    );
    Oscillator::new(5.0, 0.7, interval).respond(&force, &mut own);
    let largest = own.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
    // Strang's splitting errs by the square of the step beside the period: (0.02 × √5)² / 12.
    assert!(kicked.iter().zip(&own).all(|(a, b)| (a - b).abs() < 1e-3 * largest));
}

#[test]
fn the_smoother_finds_a_known_missing_force_and_knows_how_well() {
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};
    let mut random = rand_pcg::Pcg64::seed_from_u64(7);
    let (interval, n) = (0.01, 4000);
    let oscillator = Oscillator::new(39.5, 0.3, interval);
    // A random walk, as the smoother takes the force to be.
    let mut walked = 0.0;
    let force: Vec<f64> = (0..n)
        .map(|_| {
            let step: f64 = StandardNormal.sample(&mut random);
            walked += 0.05 * step;
            walked
        })
        .collect();
    let mut left = Vec::new();
    oscillator.respond(&force, &mut left);
    for e in &mut left {
        let noise: f64 = StandardNormal.sample(&mut random);
        *e += 1e-3 * noise;
    }
    let found = smooth(&oscillator, &[&left], 1.0, Output::Displacement(0)).pop().unwrap();
    let deviation = |k: usize| (found.force[k] - force[k]) / found.force_deviation[k];
    // Errors of neighbouring samples go together over some ten: 4000 samples tell their size to about 4 %; the
    // intensity is taken from steps of a quarter of a decade.
    let size = ((0..n).map(|k| deviation(k).powi(2)).sum::<f64>() / n as f64).sqrt();
    assert!((0.8..1.25).contains(&size), "{size}");
}

#[test]
fn steps_are_told_from_noise() {
    let wave = |k: usize| (0.013 * k as f64).sin();
    let stepped: Vec<f64> = (0..3000).map(|k| (wave(k) / 0.01).round() * 0.01).collect();
    assert!((step(stepped).unwrap() - 0.01).abs() < 1e-12);
    assert_eq!(step((0..3000).map(wave).collect()), None);
    assert_eq!(step(vec![1.0; 100]), None);
}

#[test]
fn a_force_that_depends_on_more_than_its_axis_is_a_cloud() {
    let curve = |force: &dyn Fn(f64, usize) -> f64| {
        let over = |k: usize| 0.01 * k as f64 - 2.0;
        Curve { effect: (0..400).map(|k| [over(k), force(over(k), k)]).collect(), ..Curve::default() }
    };
    assert!(curve(&|v, _| -v.signum()).is_law());
    assert!(curve(&|v, _| v * v * v - v).is_law());
    // |x| sgn v, the displacement being another at every passage.
    assert!(!curve(&|v, k| ((k * 7919) % 101) as f64 * v.signum()).is_law());
}
