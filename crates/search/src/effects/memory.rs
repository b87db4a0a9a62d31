use std::f64::consts::TAU;

use super::{
    Addition, Direction, EffectSetting, ForceAxis, Form, Frame, Inner, coefficient, logarithmic, shared, with_words,
};
use sindyscope_values::model::Equation;
use sindyscope_values::term::{Expression, Symbol, Term};

/// An internal state, counted from zero.
fn z(index: usize) -> Expression {
    Symbol::Internal(index).into()
}

/// Forces that remember: they have states of their own.
pub(super) fn add(setting: &EffectSetting, forms: &mut Vec<Form>) {
    for frame in setting.frames() {
        hysteresis(setting, frame, forms);
        relaxation(setting, frame, forms);
    }
    for frame in setting.each_mass() {
        second_mode(setting, &frame, forms);
    }
}

/// The rate of the inner state `z` of Bouc and Wen's hysteresis, `w − (|w| z |z|ⁿ⁻¹ + r w |z|ⁿ)/x_bⁿ` with `r = γ/β` and n = 1
/// or 2, as terms with their weights; `w` is the velocity across the place.
///
/// Source: Y.-K. Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249.
pub fn hysteresis_rate(w: &Expression, z: &Expression, [yield_at, ratio]: [f64; 2], n: i32) -> [(Term, f64); 3] {
    let length = yield_at.powi(n);
    let (loops, slims) = if n == 1 {
        (w.clone().abs() * z.clone(), w.clone() * z.clone().abs())
    } else {
        (w.clone().abs() * z.clone() * z.clone().abs(), w.clone() * z.clone().power(2.0))
    };
    [(Term::new(w.clone()), 1.0), (Term::new(loops), -length.recip()), (Term::new(slims), -ratio / length)]
}

fn hysteresis(setting: &EffectSetting, frame: &Frame, forms: &mut Vec<Form>) {
    let reach = frame.reach;
    // A loop that is closed within a sample cannot be told from dry friction.
    let least = (0.04 * reach).max(frame.speed * setting.interval).min(0.5 * reach);
    for (form, power) in [("", 1), ("rounder", 2)] {
        let frame = frame.clone();
        forms.push(Form {
            effect: "bouc_wen_hysteresis",
            title: "Bouc–Wen hysteresis",
            explanation: "A spring in series with a slider: stiff at each reversal, then yielding, so that the force runs in loops.",
            separates: "slow loops at three amplitudes, with reversals in between",
            formula: r"-k_h\,z,\quad\dot z=w-\frac{|w|\,z\,|z|^{n-1}+(\gamma/\beta)\,w\,|z|^n}{x_b^n},\quad x_b=\beta^{-1/n},\quad n=1\text{ or, rounder, }2",
            form: with_words(&frame.form, form),
            site: Some(frame.site),
            coefficients: vec![coefficient("k_h", 0, -2, Direction::Against)],
            inner: vec![
                Inner::new("x_b", (1, 0), logarithmic(least, 3.0 * reach, 9), (0.1 * least, 10.0 * reach)),
                // Minus one is a force that does not yield, below it grows with the displacement before it turns.
                Inner::new("gamma/beta", (0, 0), vec![-1.3, -0.6, 0.1, 1.0], (-4.0, 10.0)),
            ],
            contains: &["coulomb_friction"],
            axis: ForceAxis::Displacement,
            build: shared(move |inner| Addition {
                terms: vec![Term::new(z(0))],
                internals: vec![Equation::known(hysteresis_rate(&frame.w(), &z(0), [inner[0], inner[1]], power))],
                ..Addition::default()
            }),
        });
    }
}

fn relaxation(setting: &EffectSetting, frame: &Frame, forms: &mut Vec<Form>) {
    let frame = frame.clone();
    let fastest = 0.5 * setting.interval;
    let slowest = 20.0 / (TAU * setting.frequency);
    forms.push(Form {
        effect: "viscoelastic_relaxation",
        title: "Viscoelastic relaxation",
        explanation: "A spring in series with a damper (a Maxwell branch): stiff to fast motion, soft to slow.",
        separates: "frequencies around the relaxation rate, or a step that is held",
        formula: r"-k_v\,z,\quad\dot z=w-\frac{z}{\tau}",
        form: frame.form.clone(),
        site: Some(frame.site),
        coefficients: vec![coefficient("k_v", 0, -2, Direction::Against)],
        inner: vec![Inner::new(
            "tau",
            (0, 1),
            logarithmic((slowest / 200.0).max(2.0 * fastest), slowest, 12),
            ((slowest / 1000.0).max(fastest), 4.0 * slowest),
        )],
        contains: &["viscous_damping", "linear_stiffness"],
        axis: ForceAxis::Displacement,
        build: shared(move |inner| Addition {
            terms: vec![Term::new(z(0))],
            internals: vec![Equation::known([(Term::new(frame.w()), 1.0), (Term::new(z(0)), -1.0 / inner[0])])],
            ..Addition::default()
        }),
    });
}

fn second_mode(setting: &EffectSetting, frame: &Frame, forms: &mut Vec<Form>) {
    let frame = frame.clone();
    let highest = 0.3 / setting.interval;
    forms.push(Form {
        effect: "second_mode",
        title: "Second mode",
        explanation: "A further mass on a spring of its own rides on this one: a notch and a second peak.",
        separates: "a sweep through the second frequency",
        formula: r"-\mu\,\ddot z,\quad\ddot z=-\omega_2^2(z-r)-2\zeta_2\omega_2(\dot z-w),\quad\omega_2=2\pi f_2",
        form: frame.form.clone(),
        site: Some(frame.site),
        coefficients: vec![coefficient("mu", 0, 0, Direction::Along)],
        inner: vec![
            Inner::new(
                "f_2",
                (0, -1),
                logarithmic(0.25 * setting.frequency, (4.0 * setting.frequency).min(highest), 56),
                (0.1 * setting.frequency, (8.0 * setting.frequency).min(1.2 * highest)),
            ),
            Inner::new("zeta_2", (0, 0), vec![0.012, 0.05], (1e-4, 0.6)),
        ],
        contains: &["linear_stiffness"],
        axis: ForceAxis::Displacement,
        build: shared(move |inner| {
            let omega = TAU * inner[0];
            let (spring, damper) = (omega * omega, 2.0 * inner[1] * omega);
            let force = (z(0) - frame.r()) * spring + (z(1) - frame.w()) * damper;
            Addition {
                terms: vec![Term::new(force)],
                internals: vec![
                    Equation::known([(Term::new(z(1)), 1.0)]),
                    Equation::known([
                        (Term::new(z(0)), -spring),
                        (Term::new(frame.r()), spring),
                        (Term::new(z(1)), -damper),
                        (Term::new(frame.w()), damper),
                    ]),
                ],
                ..Addition::default()
            }
        }),
    });
}
