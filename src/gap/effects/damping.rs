use super::{Axis, Direction, Form, Setting, coefficient, fixed};
use crate::term::{Expression, Term};

/// Damping that is smooth in the velocity.
pub(super) fn add(setting: &Setting, forms: &mut Vec<Form>) {
    for frame in setting.frames() {
        let mut push =
            |effect, title, explanation, separates, formula, force: Expression, name, dimension: (i32, i32)| {
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
                    coefficients: vec![coefficient(name, dimension.0, dimension.1, Direction::Against)],
                    inner: Vec::new(),
                    contains: &[],
                    axis: Axis::Velocity,
                    build: fixed(term),
                });
            };
        push(
            "viscous_damping",
            "Viscous damping",
            "A force in proportion to the velocity, against it.",
            "two amplitudes and two frequencies",
            r"-c\,w",
            frame.w(),
            "c",
            (0, -1),
        );
        push(
            "quadratic_damping",
            "Quadratic damping",
            "Drag of a fluid: a force with the square of the velocity, against it.",
            "amplitudes that differ three times or more",
            r"-c_2\,w\,|w|",
            frame.w() * frame.w().abs(),
            "c_2",
            (-1, 0),
        );
        push(
            "cubic_damping",
            "Cubic damping",
            "A force with the third power of the velocity, against it.",
            "the same amplitude at two frequencies",
            r"-c_3\,w^3",
            frame.w().power(3.0),
            "c_3",
            (-2, 1),
        );
        push(
            "displacement_dependent_damping",
            "Displacement-dependent damping",
            "Damping that grows with the square of the displacement.",
            "the same amplitude at two frequencies",
            r"-c_x\,r^2\,w",
            frame.r().power(2.0) * frame.w(),
            "c_x",
            (-2, -1),
        );
    }
}
