use super::{
    Addition, Coefficient, Direction, EffectSetting, ForceAxis, Form, Frame, Inner, OneTerm, coefficient, even,
    logarithmic, odd_power, shared, spring, with_words,
};
use sindyscope_values::term::{Expression, Term};

/// Restoring forces.
pub(super) fn add(setting: &EffectSetting, forms: &mut Vec<Form>) {
    for frame in setting.frames() {
        powers(setting, frame, forms);
        contacts(frame, forms);
        power_law(frame, forms);
        oblique(frame, forms);
    }
    pendulum(setting, forms);
}

/// A spring of any power on both sides, and beyond a contact point on one: Hertz's contact has the power 3/2.
fn power_law(frame: &Frame, forms: &mut Vec<Form>) {
    let reach = frame.reach.max(f64::MIN_POSITIVE);
    let form = |words: &str, inner: Vec<Inner>, contains: &'static [&'static str], build| Form {
        effect: "power_law_stiffness",
        title: "Power-law stiffness",
        explanation: "A spring whose force goes with a power of the displacement that is no whole number, as of two rounded bodies pressed together.",
        separates: "amplitudes that differ ten times or more",
        formula: r"-k_p\,|r|^p\operatorname{sgn} r\quad\text{or}\quad -k_p\max(r-d,0)^p",
        form: with_words(&frame.form, words),
        site: Some(frame.site),
        coefficients: vec![coefficient("k_p", 1, -2, Direction::Against)],
        inner,
        contains,
        axis: ForceAxis::Displacement,
        build,
    };
    let exponent = |grid: Vec<f64>, simple| Inner { simple, ..Inner::new("p", (0, 0), grid, (0.15, 7.0)) };
    let there = frame.clone();
    // Counted in the largest displacement, so that the coefficient's size does not hang on the exponent.
    let both = shared(move |inner: &[f64]| {
        let force = odd_power(there.r() * reach.recip(), inner[0]);
        Addition { terms: vec![Term::new(force)], ..Addition::default() }
    });
    forms.push(form(
        "",
        vec![exponent(even(0.5, 5.5, 11), &[1.0, 3.0, 5.0])],
        &["linear_stiffness", "cubic_stiffness", "quintic_stiffness"],
        both,
    ));
    for (words, side) in [("above", 1.0), ("below", -1.0)] {
        let there = frame.clone();
        let contact = shared(move |inner: &[f64]| {
            let pressed = ((there.r() * side - inner[0]) * reach.recip()).max(0.0);
            Addition { terms: vec![Term::new(odd_power(pressed, inner[1]) * side)], ..Addition::default() }
        });
        let inner = vec![
            Inner::new("d", (1, 0), even(-0.6 * reach, 0.8 * reach, 8), (-0.98 * reach, 0.95 * reach)),
            exponent(vec![1.5, 2.5], &[1.0]),
        ];
        forms.push(form(words, inner, &["one_sided_stop", "bilinear_stiffness"], contact));
    }
}

/// Springs that stand across the motion, beside the one along it: a snap-through truss, an isolator of next to no stiffness.
fn oblique(frame: &Frame, forms: &mut Vec<Form>) {
    // Springs that stand a quarter higher than the motion goes are a cubic spring but for six thousandths of their force.
    let reach = frame.reach.max(f64::MIN_POSITIVE);
    let frame = frame.clone();
    forms.push(Form {
        effect: "oblique_springs",
        title: "Oblique springs",
        explanation: "Springs that stand across the motion, as the bars of a shallow truss do: what they push along it goes with the sine of their angle.",
        separates: "amplitudes from far below to far above the height at which the springs stand",
        formula: r"k_g\,\frac{r}{\sqrt{r^2+h^2}}",
        form: frame.form.clone(),
        site: Some(frame.site),
        coefficients: vec![Coefficient { restoring: true, ..coefficient("k_g", 1, -2, Direction::Any) }],
        inner: vec![Inner::new("h", (1, 0), logarithmic(0.1 * reach, 1.15 * reach, 9), (0.02 * reach, 1.25 * reach))],
        contains: &["cubic_stiffness", "quintic_stiffness"],
        axis: ForceAxis::Displacement,
        build: shared(move |inner| {
            let length = (frame.r().power(2.0) + inner[0].powi(2)).power(0.5);
            Addition { terms: vec![Term::new(frame.r() * length.power(-1.0))], ..Addition::default() }
        }),
    });
}

fn powers(setting: &EffectSetting, frame: &Frame, forms: &mut Vec<Form>) {
    setting.offer(
        frame,
        OneTerm {
            effect: "linear_stiffness",
            title: "Linear stiffness",
            explanation: "A spring in proportion to the displacement.",
            separates: "a wide band of frequencies",
            formula: r"k\,r",
            force: frame.r(),
            coefficient: spring("k", 0),
            axis: ForceAxis::Displacement,
        },
        forms,
    );
    setting.offer(
        frame,
        OneTerm {
            effect: "quadratic_stiffness",
            title: "Quadratic stiffness",
            explanation: "A spring that is stiffer on one side than on the other.",
            separates: "two amplitudes: the mean shifts with the amplitude squared",
            formula: r"k_2\,r^2",
            force: frame.r().power(2.0),
            coefficient: spring("k_2", -1),
            axis: ForceAxis::Displacement,
        },
        forms,
    );
    setting.offer(
        frame,
        OneTerm {
            effect: "cubic_stiffness",
            title: "Cubic stiffness",
            explanation: "A spring that hardens (or, with the other sign, softens) with the displacement.",
            separates: "amplitudes that differ three times or more",
            formula: r"k_3\,r^3",
            force: frame.r().power(3.0),
            coefficient: spring("k_3", -2),
            axis: ForceAxis::Displacement,
        },
        forms,
    );
    setting.offer(
        frame,
        OneTerm {
            effect: "quintic_stiffness",
            title: "Quintic stiffness",
            explanation: "A spring that hardens (or softens) only at the largest displacements.",
            separates: "the largest safe amplitude",
            formula: r"k_5\,r^5",
            force: frame.r().power(5.0),
            coefficient: spring("k_5", -4),
            axis: ForceAxis::Displacement,
        },
        forms,
    );
    setting.offer(
        frame,
        OneTerm {
            effect: "bilinear_stiffness",
            title: "Bilinear stiffness",
            explanation: "A spring with one stiffness when pulled and another when pushed, as of a breathing crack.",
            separates: "two amplitudes: the share of the second harmonic stays the same",
            formula: r"k_b\max(r,0)",
            force: frame.r().max(0.0),
            coefficient: spring("k_b", 0),
            axis: ForceAxis::Displacement,
        },
        forms,
    );
}

fn contacts(frame: &Frame, forms: &mut Vec<Form>) {
    let reach = frame.reach;
    let gap = |from: f64| Inner::new("d", (1, 0), even(from * reach, 0.95 * reach, 24), (0.01 * reach, 0.98 * reach));
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
        axis: ForceAxis::Displacement,
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
            axis: ForceAxis::Displacement,
            build: shared(move |inner| Addition {
                terms: vec![Term::new(beyond(there.r(), inner[0]))],
                ..Addition::default()
            }),
        });
    }
}

fn pendulum(setting: &EffectSetting, forms: &mut Vec<Form>) {
    let several = setting.masses() > 1;
    for frame in setting.springs() {
        let spring = Term::new(frame.r());
        let sine = Term::new(frame.r().sin());
        let sprung = setting.has(&spring, frame.site);
        if !setting.swings(&frame, 0.05) || setting.has(&sine, frame.site) {
            continue;
        }
        let alone = Form {
            effect: "pendulum_restoring",
            title: "Pendulum restoring force",
            explanation: "Gravity on a pendulum: the torque goes with the sine of the angle, in place of the spring or beside it.",
            separates: "swings beyond one radian",
            formula: r"-(g/l)\,\sin r\quad\text{in place of the spring}",
            form: frame.form.clone(),
            site: Some(frame.site),
            coefficients: vec![coefficient("g/l", 0, -2, Direction::Against)],
            inner: Vec::new(),
            contains: &[],
            axis: ForceAxis::Displacement,
            build: {
                let (spring, sine) = (spring.clone(), sine.clone());
                // Of an angle that turns over and over nothing else may be there to hold it.
                let replaced = if sprung { vec![spring] } else { Vec::new() };
                shared(move |_| Addition {
                    terms: vec![sine.clone()],
                    replaces: replaced.clone(),
                    ..Addition::default()
                })
            },
        };
        forms.push(alone.clone());
        // Up to a radian a spring and a sine are a spring with a cubic part. What couples several masses is such a spring.
        if sprung && setting.swings(&frame, 1.0) {
            forms.push(Form {
                formula: r"-(g/l)\,\sin r-k\,r\quad\text{in place of the spring}",
                form: if several { format!("{}, beside a spring", frame.form) } else { "beside a spring".to_owned() },
                coefficients: vec![
                    coefficient("g/l", 0, -2, Direction::Any),
                    coefficient("k", 0, -2, Direction::Against),
                ],
                contains: &["cubic_stiffness", "pendulum_restoring"],
                // The spring is the effect's own: that it is there is asked of the data too.
                build: shared(move |_| Addition {
                    terms: vec![sine.clone(), spring.clone()],
                    replaces: vec![spring.clone()],
                    ..Addition::default()
                }),
                ..alone
            });
        }
    }
}
