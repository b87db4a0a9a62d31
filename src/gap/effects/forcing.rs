use std::f64::consts::TAU;

use super::super::site::Site;
use super::{Addition, Axis, Form, Inner, Setting, Sign, coefficient, even, fixed, known, shared, term};

/// What drives the motion, or changes with time.
pub(super) fn add(setting: &Setting, forms: &mut Vec<Form>) {
    constant(setting, forms);
    if setting.has_input {
        inputs(setting, forms);
    }
    if !setting.lines.is_empty() && !setting.pulsations.is_empty() {
        harmonics(setting, forms);
    }
    for frame in setting.springs() {
        forms.push(Form {
            effect: "stiffness_drift",
            title: "Stiffness drift",
            explanation: "The spring gets stiffer or softer in the course of the record, as by warming.",
            separates: "the same amplitude early and late in the record",
            coefficients: vec![coefficient("dk/dt", 0, -3, Sign::Any)],
            inner: Vec::new(),
            contains: &[],
            axis: Axis::Time,
            build: fixed(vec![term("R*t", &frame)]),
            site: Some(frame.site),
            form: frame.form,
        });
    }
}

fn constant(setting: &Setting, forms: &mut Vec<Form>) {
    let one = known("1");
    for frame in setting.each_mass() {
        if setting.has(&one, frame.site) {
            continue;
        }
        forms.push(Form {
            effect: "constant_force",
            title: "Constant force",
            explanation: "A steady push, as of gravity or a preload: the same in every record.",
            separates: "nothing tells it from a sensor offset that is the same in every record",
            form: frame.form,
            site: Some(frame.site),
            coefficients: vec![coefficient("b", 1, -2, Sign::Any)],
            inner: Vec::new(),
            contains: &[],
            axis: Axis::Time,
            build: fixed(vec![one.clone()]),
        });
    }
}

fn inputs(setting: &Setting, forms: &mut Vec<Form>) {
    let period = setting.frequency.recip();
    let mut input = |effect, title, explanation, separates, text: &str, name, dimension: (i32, i32)| {
        let term = known(text);
        for (mass, frame) in setting.each_mass().into_iter().enumerate() {
            let site = Site::Base(mass);
            if setting.has(&term, site) {
                continue;
            }
            forms.push(Form {
                effect,
                title,
                explanation,
                separates,
                form: frame.form,
                site: Some(site),
                coefficients: vec![coefficient(name, dimension.0, dimension.1, Sign::Any)],
                inner: Vec::new(),
                contains: &[],
                axis: Axis::Input,
                build: fixed(vec![term.clone()]),
            });
        }
    };
    if setting.base_excited || setting.input_open {
        input(
            "base_velocity",
            "Base-velocity coupling",
            "A force in proportion to the velocity of the base.",
            "two octaves of frequency, also above resonance",
            "du",
            "c_b",
            (0, -1),
        );
    }
    if setting.base_excited {
        input(
            "input_gain",
            "Input gain",
            "The base moves more (or less) than its sensor says.",
            "a slow motion of the base, which the mass follows",
            "u",
            "gain k",
            (0, -2),
        );
    }
    forms.push(Form {
        effect: "input_delay",
        title: "Input delay",
        explanation: "The input acts later (or earlier) than it was recorded, as by different filters of two channels.",
        separates: "a wide band of frequencies, or the edges of a pulse",
        form: String::new(),
        site: None,
        coefficients: Vec::new(),
        inner: vec![Inner {
            name: "tau",
            dimension: (0, 1),
            grid: even(-0.1 * period, 0.1 * period, 20),
            bounds: (-0.3 * period, 0.3 * period),
            jumps: false,
        }],
        contains: &[],
        axis: Axis::Input,
        build: shared(|inner| Addition { delay: inner[0], ..Addition::default() }),
    });
    forms.push(Form {
        effect: "input_saturation",
        title: "Input saturation",
        explanation: "The shaker cannot give more than a limit, though the recorded signal asks for it.",
        separates: "input levels below and above the limit",
        form: String::new(),
        site: None,
        coefficients: Vec::new(),
        inner: vec![Inner {
            name: "u_max",
            dimension: (0, 0),
            grid: even(0.3 * setting.input, 0.98 * setting.input, 18),
            bounds: (0.1 * setting.input, 0.995 * setting.input),
            jumps: false,
        }],
        contains: &[],
        axis: Axis::Input,
        build: shared(|inner| Addition { input_limit: Some(inner[0]), ..Addition::default() }),
    });
}

fn harmonics(setting: &Setting, forms: &mut Vec<Form>) {
    let frequencies = |grid: &[f64]| Inner {
        name: "f",
        dimension: (0, -1),
        grid: grid.to_vec(),
        bounds: (0.01 * setting.frequency, 0.5 / setting.interval),
        jumps: false,
    };
    for frame in setting.each_mass() {
        forms.push(Form {
            effect: "unmeasured_harmonic_force",
            title: "Unmeasured harmonic force",
            explanation: "A force at one frequency that no channel recorded, as of an unbalance or of hum.",
            separates: "a record with the input off",
            form: frame.form,
            site: Some(frame.site),
            coefficients: vec![coefficient("P cos", 1, -2, Sign::Any), coefficient("P sin", 1, -2, Sign::Any)],
            inner: vec![frequencies(&setting.lines)],
            contains: &["constant_force"],
            axis: Axis::Time,
            build: shared(|inner| {
                let omega = TAU * inner[0];
                Addition {
                    terms: vec![known(&format!("cos({omega:e}*t)")), known(&format!("sin({omega:e}*t)"))],
                    ..Addition::default()
                }
            }),
        });
    }
    for frame in setting.springs() {
        let there = frame.clone();
        forms.push(Form {
            effect: "parametric_stiffness",
            title: "Parametric stiffness",
            explanation: "The spring's stiffness pulsates at a frequency of its own.",
            separates: "another frequency of excitation: the sidebands move with it",
            form: frame.form,
            site: Some(frame.site),
            coefficients: vec![coefficient("k_p cos", 0, -2, Sign::Any), coefficient("k_p sin", 0, -2, Sign::Any)],
            inner: vec![frequencies(&setting.pulsations)],
            contains: &["stiffness_drift", "linear_stiffness"],
            axis: Axis::Time,
            build: shared(move |inner| {
                let omega = TAU * inner[0];
                Addition {
                    terms: vec![
                        term(&format!("R*cos({omega:e}*t)"), &there),
                        term(&format!("R*sin({omega:e}*t)"), &there),
                    ],
                    ..Addition::default()
                }
            }),
        });
    }
}
