use super::{Direction, EffectSetting, ForceAxis, Form, OneTerm, coefficient};

/// Damping with the fifth power of the velocity.
pub(crate) fn add(setting: &EffectSetting, forms: &mut Vec<Form>) {
    for frame in setting.frames() {
        setting.offer(
            frame,
            OneTerm {
                effect: "quintic_damping",
                title: "Quintic damping",
                explanation: "A force with the fifth power of the velocity, against it.",
                separates: "the same amplitude at two frequencies",
                formula: r"-c_5\,w^5",
                force: frame.w().power(5.0),
                coefficient: coefficient("c_5", -4, 3, Direction::Against),
                axis: ForceAxis::Velocity,
            },
            forms,
        );
    }
}
