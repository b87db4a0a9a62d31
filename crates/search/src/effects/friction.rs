use super::{Addition, Axis, Direction, Form, Inner, OneTerm, Setting, coefficient, logarithmic, shared};
use sindyscope_values::term::Term;

/// Dry friction in its kinds.
pub(super) fn add(setting: &Setting, forms: &mut Vec<Form>) {
    for frame in setting.frames() {
        let sliding = Term::new(frame.w().sgn());
        let axis = Axis::Velocity;
        let site = Some(frame.site);
        setting.offer(
            frame,
            OneTerm {
                effect: "coulomb_friction",
                title: "Coulomb (dry) friction",
                explanation: "A force of constant size against the motion, whatever the speed.",
                separates: "a free decay until the motion stops, or small amplitudes beside large ones",
                formula: r"-F_c\,\operatorname{sgn} w",
                force: frame.w().sgn(),
                coefficient: coefficient("F_c", 1, -2, Direction::Against),
                axis,
            },
            forms,
        );
        let speed = frame.speed;
        let slowest = (2.0 * frame.speed_noise).max(0.01 * speed).min(0.3 * speed);
        forms.push(Form {
            effect: "stribeck_friction",
            title: "Stribeck friction",
            explanation: "Dry friction that is larger at low speed and falls to its sliding level as the motion gets faster.",
            separates: "many reversals at low speed: a slow, large motion of the base",
            formula: r"-\left(F_c+(F_s-F_c)\,e^{-(w/v_s)^2}\right)\operatorname{sgn} w",
            form: frame.form.clone(),
            site,
            coefficients: vec![
                coefficient("F_c", 1, -2, Direction::Against),
                coefficient("F_s - F_c", 1, -2, Direction::Against),
            ],
            inner: vec![Inner::new("v_s", (1, -1), logarithmic(slowest, 0.7 * speed, 10), (0.5 * slowest, 0.9 * speed))],
            contains: &["coulomb_friction", "static_friction"],
            axis,
            build: {
                let (frame, sliding) = (frame.clone(), sliding.clone());
                shared(move |inner| {
                    let falling = (-(frame.w() * inner[0].recip()).power(2.0)).exp();
                    let terms = vec![sliding.clone(), Term::new(frame.w().sgn() * falling)];
                    Addition { terms, ..Addition::default() }
                })
            },
        });
        forms.push(Form {
            effect: "static_friction",
            title: "Static friction (stick-slip)",
            explanation: "The mass sticks until the pull exceeds a level above that of sliding, then slips.",
            separates: "motion slow and small enough that the mass stops in every period",
            formula: r"-F_c\,\operatorname{sgn} w,\quad\text{stuck while the other forces stay below } F_s",
            form: frame.form.clone(),
            site,
            coefficients: vec![coefficient("F_c", 1, -2, Direction::Against)],
            inner: vec![Inner { jumps: true, ..Inner::new("F_s/F_c", (0, 0), vec![1.2, 1.6, 2.3], (1.0, 6.0)) }],
            contains: &["coulomb_friction"],
            axis,
            build: {
                let sliding = sliding.clone();
                shared(move |inner| Addition {
                    terms: vec![sliding.clone()],
                    static_ratio: Some(inner[0]),
                    ..Addition::default()
                })
            },
        });
        setting.offer(
            frame,
            OneTerm {
                effect: "position_dependent_friction",
                title: "Position-dependent friction",
                explanation: "Dry friction that grows with the displacement (also called structural or rate-independent damping).",
                separates: "the same amplitude at two frequencies an octave apart",
                formula: r"-h\,|r|\,\operatorname{sgn} w",
                force: frame.r().abs() * frame.w().sgn(),
                coefficient: coefficient("h", 0, -2, Direction::Against),
                axis,
            },
            forms,
        );
    }
}
