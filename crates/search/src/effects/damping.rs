use super::{
    Addition, Direction, EffectSetting, ForceAxis, Form, Frame, Inner, OneTerm, coefficient, even, odd_power, shared,
};
use sindyscope_values::term::{Symbol, Term};

/// Damping that is smooth in the velocity.
pub(super) fn add(setting: &EffectSetting, forms: &mut Vec<Form>) {
    for frame in setting.frames() {
        setting.offer(
            frame,
            OneTerm {
                effect: "viscous_damping",
                title: "Viscous damping",
                explanation: "A force in proportion to the velocity, against it.",
                separates: "two amplitudes and two frequencies",
                formula: r"-c\,w",
                force: frame.w(),
                coefficient: coefficient("c", 0, -1, Direction::Against),
                axis: ForceAxis::Velocity,
            },
            forms,
        );
        setting.offer(
            frame,
            OneTerm {
                effect: "quadratic_damping",
                title: "Quadratic damping",
                explanation: "Drag of a fluid: a force with the square of the velocity, against it.",
                separates: "amplitudes that differ three times or more",
                formula: r"-c_2\,w\,|w|",
                force: frame.w() * frame.w().abs(),
                coefficient: coefficient("c_2", -1, 0, Direction::Against),
                axis: ForceAxis::Velocity,
            },
            forms,
        );
        setting.offer(
            frame,
            OneTerm {
                effect: "cubic_damping",
                title: "Cubic damping",
                explanation: "A force with the third power of the velocity, against it.",
                separates: "the same amplitude at two frequencies",
                formula: r"-c_3\,w^3",
                force: frame.w().power(3.0),
                coefficient: coefficient("c_3", -2, 1, Direction::Against),
                axis: ForceAxis::Velocity,
            },
            forms,
        );
        setting.offer(
            frame,
            OneTerm {
                effect: "displacement_dependent_damping",
                title: "Displacement-dependent damping",
                explanation: "Damping that grows with the square of the displacement.",
                separates: "the same amplitude at two frequencies",
                formula: r"-c_x\,r^2\,w",
                force: frame.r().power(2.0) * frame.w(),
                coefficient: coefficient("c_x", -2, -1, Direction::Against),
                axis: ForceAxis::Velocity,
            },
            forms,
        );
        setting.offer(
            frame,
            OneTerm {
                effect: "bilinear_damping",
                title: "Bilinear damping",
                explanation: "A damper with one coefficient in each direction, as a shock absorber's in rebound and in compression.",
                separates: "a motion in which both directions are equally fast",
                formula: r"-c_b\max(w,0)",
                force: frame.w().max(0.0),
                coefficient: coefficient("c_b", 0, -1, Direction::Any),
                axis: ForceAxis::Velocity,
            },
            forms,
        );
        power_law(frame, forms);
    }
    for frame in setting.springs() {
        negative(setting, &frame, forms);
        setting.offer(
            &frame,
            OneTerm {
                effect: "damping_drift",
                title: "Damping drift",
                explanation: "The damper gets weaker or stronger in the course of the record, as an oil that warms.",
                separates: "the same amplitude early and late in the record",
                formula: r"\frac{dc}{dt}\,t\,w",
                force: frame.w() * Symbol::Time,
                coefficient: coefficient("dc/dt", 0, -2, Direction::Any),
                axis: ForceAxis::Time,
            },
            forms,
        );
    }
}

/// A damper of the model that gives energy: of a model whose damper may push anyway it is nothing new.
fn negative(setting: &EffectSetting, frame: &Frame, forms: &mut Vec<Form>) {
    let damper = Term::new(frame.w());
    if !setting.passive || !setting.has(&damper, frame.site) {
        return;
    }
    forms.push(Form {
        effect: "negative_damping",
        title: "Negative damping",
        explanation: "The damper pushes instead of braking: something feeds energy into the motion, as a flow, a belt or a control does.",
        separates: "a release from a small displacement with the input off: the motion grows",
        formula: r"+c\,w\quad\text{in place of the damper}",
        form: frame.form.clone(),
        site: Some(frame.site),
        coefficients: vec![coefficient("c", 0, -1, Direction::Along)],
        inner: Vec::new(),
        contains: &[],
        axis: ForceAxis::Velocity,
        build: shared(move |_| Addition {
            terms: vec![damper.clone()],
            replaces: vec![damper.clone()],
            ..Addition::default()
        }),
    });
}

/// Exponents from a force that hardly depends on the speed to one of the fourth power.
fn power_law(frame: &Frame, forms: &mut Vec<Form>) {
    let there = frame.clone();
    let speed = frame.speed;
    forms.push(Form {
        effect: "power_law_damping",
        title: "Power-law damping",
        explanation: "A force against the motion with a power of the speed that is no whole number.",
        separates: "amplitudes that differ ten times or more",
        formula: r"-c_p\,|w|^p\operatorname{sgn} w",
        form: frame.form.clone(),
        site: Some(frame.site),
        coefficients: vec![coefficient("c_p", 1, -2, Direction::Against)],
        inner: vec![Inner { simple: &[1.0, 2.0, 3.0], ..Inner::new("p", (0, 0), even(0.4, 3.4, 11), (0.15, 5.0)) }],
        contains: &["coulomb_friction", "viscous_damping", "quadratic_damping", "cubic_damping"],
        axis: ForceAxis::Velocity,
        build: shared(move |inner| {
            // Counted in the largest speed, so that the coefficient's size does not hang on the exponent.
            let force = odd_power(there.w() * speed.max(f64::MIN_POSITIVE).recip(), inner[0]);
            Addition { terms: vec![Term::new(force)], ..Addition::default() }
        }),
    });
}
