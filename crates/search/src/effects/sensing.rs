use super::{Addition, EffectSetting, ForceAxis, Form, Inner, even, shared};

/// What the sensor does, and the motion does not.
pub(super) fn add(setting: &EffectSetting, forms: &mut Vec<Form>) {
    forms.push(Form {
        effect: "sensor_offset",
        title: "Sensor offset",
        explanation: "The sensor's zero is off, by another amount in each record.",
        separates: "a record of the mass at rest",
        formula: r"x_{shown}=x+x_0",
        form: String::new(),
        site: None,
        coefficients: Vec::new(),
        inner: Vec::new(),
        contains: &["constant_force"],
        axis: ForceAxis::Time,
        build: shared(|_| Addition { offset: true, ..Addition::default() }),
    });
    let highest = setting.measured;
    forms.push(Form {
        effect: "sensor_clipping",
        title: "Sensor clipping",
        explanation: "The sensor cannot show more than a limit: peaks are cut off flat, always at the same level.",
        separates: "a smaller amplitude",
        formula: r"x_{shown}=\max(-x_{max},\min(x,x_{max}))",
        form: String::new(),
        site: None,
        coefficients: Vec::new(),
        inner: vec![Inner::new(
            ["x_max", "v_max", "a_max"][setting.derivatives.min(2)],
            (1, -(setting.derivatives as i32)),
            even(0.75 * highest, 0.99 * highest, 13),
            (0.5 * highest, 1.02 * highest),
        )],
        contains: &[],
        axis: ForceAxis::Time,
        build: shared(|inner| Addition { ceiling: Some(inner[0]), ..Addition::default() }),
    });
}
