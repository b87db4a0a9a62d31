use super::{Addition, Axis, Direction, Form, Frame, Inner, Setting, coefficient, even, fixed, shared, with_words};
use crate::term::{Expression, Term};

/// Restoring forces.
pub(super) fn add(setting: &Setting, forms: &mut Vec<Form>) {
    for frame in setting.frames() {
        powers(setting, frame, forms);
        contacts(frame, forms);
    }
    pendulum(setting, forms);
}

fn powers(setting: &Setting, frame: &Frame, forms: &mut Vec<Form>) {
    let mut push = |effect, title, explanation, separates, formula, force: Expression, name, length, sign| {
        let term = Term::new(force);
        if setting.has(&term, frame.site) {
            return;
        }
        forms.push(Form {
            effect,
            title,
            explanation,
            separates,
            formula,
            form: frame.form.clone(),
            site: Some(frame.site),
            coefficients: vec![coefficient(name, length, -2, sign)],
            inner: Vec::new(),
            contains: &[],
            axis: Axis::Displacement,
            build: fixed(term),
        });
    };
    push(
        "linear_stiffness",
        "Linear stiffness",
        "A spring in proportion to the displacement.",
        "a wide band of frequencies",
        r"k\,r",
        frame.r(),
        "k",
        0,
        Direction::Any,
    );
    push(
        "quadratic_stiffness",
        "Quadratic stiffness",
        "A spring that is stiffer on one side than on the other.",
        "two amplitudes: the mean shifts with the amplitude squared",
        r"k_2\,r^2",
        frame.r().power(2.0),
        "k_2",
        -1,
        Direction::Any,
    );
    push(
        "cubic_stiffness",
        "Cubic stiffness",
        "A spring that hardens (or, with the other sign, softens) with the displacement.",
        "amplitudes that differ three times or more",
        r"k_3\,r^3",
        frame.r().power(3.0),
        "k_3",
        -2,
        Direction::Any,
    );
    push(
        "quintic_stiffness",
        "Quintic stiffness",
        "A spring that hardens (or softens) only at the largest displacements.",
        "the largest safe amplitude",
        r"k_5\,r^5",
        frame.r().power(5.0),
        "k_5",
        -4,
        Direction::Any,
    );
    push(
        "bilinear_stiffness",
        "Bilinear stiffness",
        "A spring with one stiffness when pulled and another when pushed, as of a breathing crack.",
        "two amplitudes: the share of the second harmonic stays the same",
        r"k_b\max(r,0)",
        frame.r().max(0.0),
        "k_b",
        0,
        Direction::Any,
    );
}

fn contacts(frame: &Frame, forms: &mut Vec<Form>) {
    let reach = frame.reach;
    let gap = |from: f64| Inner {
        name: "d",
        dimension: (1, 0),
        of_input: None,
        grid: even(from * reach, 0.95 * reach, 24),
        bounds: (0.01 * reach, 0.98 * reach),
        jumps: false,
    };
    forms.push(Form {
        effect: "clearance",
        title: "Clearance",
        explanation: "A gap on both sides, then further springs: freeplay, or side stops.",
        separates: "amplitudes just below and just above the gap",
        formula: r"-k_c\,(r-\max(-d,\min(r,d)))",
        form: frame.form.clone(),
        site: Some(frame.site),
        coefficients: vec![coefficient("k_c", 0, -2, Direction::Against)],
        inner: vec![gap(0.03)],
        contains: &[],
        axis: Axis::Displacement,
        build: {
            let frame = frame.clone();
            shared(move |inner| Addition {
                terms: vec![Term::new(frame.r().dead_zone(inner[0]))],
                ..Addition::default()
            })
        },
    });
    type Stop = fn(Expression, f64) -> Expression;
    let sides: [(&str, Stop); 2] = [("above", |r, gap| (r - gap).max(0.0)), ("below", |r, gap| (r + gap).min(0.0))];
    for (side, beyond) in sides {
        let there = frame.clone();
        forms.push(Form {
            effect: "one_sided_stop",
            title: "One-sided stop",
            explanation: "Contact with a further spring on one side only, beyond a gap.",
            separates: "amplitudes just below and just above the gap",
            formula: r"-k_s\max(r-d,0)\quad\text{or}\quad -k_s\min(r+d,0)",
            form: with_words(&frame.form, side),
            site: Some(frame.site),
            coefficients: vec![coefficient("k_s", 0, -2, Direction::Against)],
            inner: vec![gap(0.03)],
            contains: &[],
            axis: Axis::Displacement,
            build: shared(move |inner| Addition {
                terms: vec![Term::new(beyond(there.r(), inner[0]))],
                ..Addition::default()
            }),
        });
    }
}

fn pendulum(setting: &Setting, forms: &mut Vec<Form>) {
    let angle = matches!(setting.unit.as_str(), "rad" | "");
    for frame in setting.springs() {
        let spring = Term::new(frame.r());
        if !angle || frame.reach < 0.05 || !setting.has(&spring, frame.site) {
            continue;
        }
        forms.push(Form {
            effect: "pendulum_restoring",
            title: "Pendulum restoring force",
            explanation: "Gravity on a pendulum: the restoring torque goes with the sine of the angle, in place of the spring.",
            separates: "swings beyond one radian",
            formula: r"-(g/l)\,\sin r\quad\text{in place of the spring}",
            form: frame.form.clone(),
            site: Some(frame.site),
            coefficients: vec![coefficient("g/l", 0, -2, Direction::Against)],
            inner: Vec::new(),
            contains: &[],
            axis: Axis::Displacement,
            build: shared(move |_| Addition {
                terms: vec![Term::new(frame.r().sin())],
                replaces: vec![spring.clone()],
                ..Addition::default()
            }),
        });
    }
}
