use super::{Axis, Direction, Form, OneTerm, Setting, coefficient};

/// Damping that is smooth in the velocity.
pub(super) fn add(setting: &Setting, forms: &mut Vec<Form>) {
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
                axis: Axis::Velocity,
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
                axis: Axis::Velocity,
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
                axis: Axis::Velocity,
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
                axis: Axis::Velocity,
            },
            forms,
        );
    }
}
