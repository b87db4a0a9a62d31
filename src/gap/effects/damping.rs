use super::{Axis, Form, Setting, Sign, coefficient, fixed, term};

/// Damping that is smooth in the velocity.
pub(super) fn add(setting: &Setting, forms: &mut Vec<Form>) {
    for frame in setting.frames() {
        let mut push = |effect, title, explanation, separates, text: &str, name, dimension: (i32, i32)| {
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
                coefficients: vec![coefficient(name, dimension.0, dimension.1, Sign::Against)],
                inner: Vec::new(),
                contains: &[],
                axis: Axis::Velocity,
                build: fixed(vec![term]),
            });
        };
        push(
            "viscous_damping",
            "Viscous damping",
            "A force in proportion to the velocity, against it.",
            "two amplitudes and two frequencies",
            "W",
            "c",
            (0, -1),
        );
        push(
            "quadratic_damping",
            "Quadratic damping",
            "Drag of a fluid: a force with the square of the velocity, against it.",
            "amplitudes that differ three times or more",
            "W*|W|",
            "c_2",
            (-1, 0),
        );
        push(
            "cubic_damping",
            "Cubic damping",
            "A force with the third power of the velocity, against it.",
            "the same amplitude at two frequencies",
            "W^3",
            "c_3",
            (-2, 1),
        );
        push(
            "displacement_dependent_damping",
            "Displacement-dependent damping",
            "Damping that grows with the square of the displacement.",
            "the same amplitude at two frequencies",
            "R^2*W",
            "c_x",
            (-2, -1),
        );
    }
}
