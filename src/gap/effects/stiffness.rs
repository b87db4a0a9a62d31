use super::{Addition, Axis, Form, Frame, Inner, Setting, Sign, coefficient, even, fixed, shared, term, with_words};

/// Restoring forces.
pub(super) fn add(setting: &Setting, forms: &mut Vec<Form>) {
    for frame in setting.frames() {
        powers(setting, frame, forms);
        contacts(frame, forms);
    }
    pendulum(setting, forms);
}

fn powers(setting: &Setting, frame: &Frame, forms: &mut Vec<Form>) {
    let mut push = |effect, title, explanation, separates, text: &str, name, length, sign| {
        let term = term(text, frame);
        if setting.has(&term, frame.site) {
            return;
        }
        forms.push(Form {
            effect,
            title,
            explanation,
            separates,
            form: frame.form.clone(),
            site: Some(frame.site),
            coefficients: vec![coefficient(name, length, -2, sign)],
            inner: Vec::new(),
            contains: &[],
            axis: Axis::Displacement,
            build: fixed(vec![term]),
        });
    };
    push(
        "linear_stiffness",
        "Linear stiffness",
        "A spring in proportion to the displacement.",
        "a wide band of frequencies",
        "R",
        "k",
        0,
        Sign::Any,
    );
    push(
        "quadratic_stiffness",
        "Quadratic stiffness",
        "A spring that is stiffer on one side than on the other.",
        "two amplitudes: the mean shifts with the amplitude squared",
        "R^2",
        "k_2",
        -1,
        Sign::Any,
    );
    push(
        "cubic_stiffness",
        "Cubic stiffness",
        "A spring that hardens (or, with the other sign, softens) with the displacement.",
        "amplitudes that differ three times or more",
        "R^3",
        "k_3",
        -2,
        Sign::Any,
    );
    push(
        "quintic_stiffness",
        "Quintic stiffness",
        "A spring that hardens (or softens) only at the largest displacements.",
        "the largest safe amplitude",
        "R^5",
        "k_5",
        -4,
        Sign::Any,
    );
    push(
        "bilinear_stiffness",
        "Bilinear stiffness",
        "A spring with one stiffness when pulled and another when pushed, as of a breathing crack.",
        "two amplitudes: the share of the second harmonic stays the same",
        "max(R,0)",
        "k_b",
        0,
        Sign::Any,
    );
}

fn contacts(frame: &Frame, forms: &mut Vec<Form>) {
    let reach = frame.reach;
    let gap = |from: f64| Inner {
        name: "d",
        dimension: (1, 0),
        grid: even(from * reach, 0.95 * reach, 24),
        bounds: (0.01 * reach, 0.98 * reach),
        jumps: false,
    };
    forms.push(Form {
        effect: "clearance",
        title: "Clearance",
        explanation: "A gap on both sides, then further springs: freeplay, or side stops.",
        separates: "amplitudes just below and just above the gap",
        form: frame.form.clone(),
        site: Some(frame.site),
        coefficients: vec![coefficient("k_c", 0, -2, Sign::Against)],
        inner: vec![gap(0.03)],
        contains: &[],
        axis: Axis::Displacement,
        build: {
            let frame = frame.clone();
            shared(move |inner| Addition {
                terms: vec![term(&format!("dz(R,{:e})", inner[0]), &frame)],
                ..Addition::default()
            })
        },
    });
    for (side, text) in [("above", "max(R-D,0)"), ("below", "min(R+D,0)")] {
        let there = frame.clone();
        forms.push(Form {
            effect: "one_sided_stop",
            title: "One-sided stop",
            explanation: "Contact with a further spring on one side only, beyond a gap.",
            separates: "amplitudes just below and just above the gap",
            form: with_words(&frame.form, side),
            site: Some(frame.site),
            coefficients: vec![coefficient("k_s", 0, -2, Sign::Against)],
            inner: vec![gap(0.03)],
            contains: &[],
            axis: Axis::Displacement,
            build: shared(move |inner| Addition {
                terms: vec![term(&text.replace('D', &format!("{:e}", inner[0])), &there)],
                ..Addition::default()
            }),
        });
    }
}

fn pendulum(setting: &Setting, forms: &mut Vec<Form>) {
    let angle = matches!(setting.unit.as_str(), "rad" | "");
    for frame in setting.springs() {
        let spring = term("R", &frame);
        if !angle || frame.reach < 0.05 || !setting.has(&spring, frame.site) {
            continue;
        }
        forms.push(Form {
            effect: "pendulum_restoring",
            title: "Pendulum restoring force",
            explanation: "Gravity on a pendulum: the restoring torque goes with the sine of the angle, in place of the spring.",
            separates: "swings beyond one radian",
            form: frame.form.clone(),
            site: Some(frame.site),
            coefficients: vec![coefficient("g/l", 0, -2, Sign::Against)],
            inner: Vec::new(),
            contains: &[],
            axis: Axis::Displacement,
            build: shared(move |_| Addition {
                terms: vec![term("sin(R)", &frame)],
                replaces: vec![spring.clone()],
                ..Addition::default()
            }),
        });
    }
}
