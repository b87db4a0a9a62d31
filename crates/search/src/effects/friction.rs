use super::super::site::Site;
use super::{
    Addition, Direction, EffectSetting, ForceAxis, Form, Frame, Inner, OneTerm, coefficient, even, logarithmic, shared,
    with_words,
};
use sindyscope_values::term::Term;

/// Dry friction in its kinds.
pub(super) fn add(setting: &EffectSetting, forms: &mut Vec<Form>) {
    for frame in setting.frames() {
        let sliding = Term::new(frame.w().sgn());
        let axis = ForceAxis::Velocity;
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
            inner: vec![Inner {
                jumps: true,
                simple: &[1.0],
                ..Inner::new("F_s/F_c", (0, 0), vec![1.2, 1.6, 2.3], (1.0, 6.0))
            }],
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
        // A surface that moves is seen by the mass that goes along with it, or by the energy that it gives.
        if matches!(frame.site, Site::Ground(_)) && (frame.usual_speed.is_some() || !setting.passive) {
            belt(frame, forms);
        }
    }
}

/// Friction against a surface that moves, as a belt does: of one size, or falling with the speed across the contact.
fn belt(frame: &Frame, forms: &mut Vec<Form>) {
    let speed = frame.speed;
    let slip = |frame: &Frame, surface: f64| frame.w() - surface;
    let form = |words: &str, coefficients: Vec<_>, inner: Vec<Inner>, contains: &'static [&'static str], build| Form {
        effect: "belt_friction",
        title: "Friction against a moving surface",
        explanation: "Dry friction against a surface that moves at a steady speed, as a belt or a bow does: it carries the mass along.",
        separates: "the surface at two speeds, or at rest",
        formula: r"-\left(F_c+(F_s-F_c)\,e^{-|w-v_0|/v_s}\right)\operatorname{sgn}(w-v_0)",
        form: with_words(&frame.form, words),
        site: Some(frame.site),
        coefficients,
        inner,
        contains,
        axis: ForceAxis::Velocity,
        build,
    };
    // Where the mass goes along with it, the surface's speed is seen. While the mass slips one way only, nothing else tells it.
    let speeds = match frame.usual_speed {
        Some(usual) => vec![usual],
        None => even(-0.95 * speed, 0.95 * speed, 20),
    };
    let surface =
        || Inner { simple: &[0.0], ..Inner::new("v_0", (1, -1), speeds.clone(), (-1.5 * speed, 1.5 * speed)) };
    let sliding = || coefficient("F_c", 1, -2, Direction::Against);
    let there = frame.clone();
    let steady = shared(move |inner: &[f64]| Addition {
        terms: vec![Term::new(slip(&there, inner[0]).sgn())],
        ..Addition::default()
    });
    forms.push(form("", vec![sliding()], vec![surface()], &["coulomb_friction", "constant_force"], steady));
    let there = frame.clone();
    let falling = shared(move |inner: &[f64]| {
        let across = || slip(&there, inner[0]);
        let falling = (across().abs() * -inner[1].recip()).exp();
        let terms = vec![Term::new(across().sgn()), Term::new(across().sgn() * falling)];
        Addition { terms, ..Addition::default() }
    });
    let scale = Inner::new("v_s", (1, -1), logarithmic(0.08 * speed, 0.6 * speed, 3), (0.01 * speed, 2.0 * speed));
    let coefficients = vec![sliding(), coefficient("F_s - F_c", 1, -2, Direction::Against)];
    let contains = &["coulomb_friction", "constant_force", "stribeck_friction", "belt_friction"];
    forms.push(form("falling with the speed", coefficients, vec![surface(), scale], contains, falling));
}
