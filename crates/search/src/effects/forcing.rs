use std::f64::consts::TAU;

use super::super::site::Site;
use super::{
    Addition, Coefficient, Direction, EffectSetting, ForceAxis, Form, Frame, Inner, OneTerm, coefficient, even,
    logarithmic, shared, spring, with_words,
};
use sindyscope_core::simulate::Delays;
use sindyscope_values::term::{Expression, Symbol, Term};

/// What drives the motion, or changes with time.
pub(super) fn add(setting: &EffectSetting, forms: &mut Vec<Form>) {
    constant(setting, forms);
    for (input, largest) in setting.inputs.iter().enumerate().filter(|(_, largest)| **largest > 0.0) {
        inputs(setting, (input, *largest), forms);
    }
    if !setting.lines.is_empty() && !setting.pulsations.is_empty() {
        harmonics(setting, forms);
    }
    for frame in setting.springs() {
        setting.offer(
            &frame,
            OneTerm {
                effect: "stiffness_drift",
                title: "Stiffness drift",
                explanation: "The spring gets stiffer or softer in the course of the record, as by warming.",
                separates: "the same amplitude early and late in the record",
                formula: r"\frac{dk}{dt}\,t\,r",
                force: frame.r() * Symbol::Time,
                coefficient: Coefficient { dimension: (0, -3), ..spring("dk/dt", 0) },
                axis: ForceAxis::Time,
            },
            forms,
        );
    }
}

fn constant(setting: &EffectSetting, forms: &mut Vec<Form>) {
    for frame in setting.each_mass() {
        setting.offer(
            &frame,
            OneTerm {
                effect: "constant_force",
                title: "Constant force",
                explanation: "A steady push, as of gravity or a preload: the same in every record.",
                separates: "nothing tells it from a sensor offset that is the same in every record",
                formula: r"b",
                force: Expression::Number(1.0),
                coefficient: coefficient("b", 1, -2, Direction::Any),
                axis: ForceAxis::Time,
            },
            forms,
        );
    }
}

/// What one of the inputs does; `largest` is its largest magnitude.
fn inputs(setting: &EffectSetting, (index, largest): (usize, f64), forms: &mut Vec<Form>) {
    let period = setting.frequency.recip();
    let which = if setting.inputs.len() > 1 { format!("of input {}", index + 1) } else { String::new() };
    // What the base does to a mass acts where it is joined to it.
    let there = |(mass, frame): (usize, Frame)| Frame {
        site: Site::Base(mass),
        form: with_words(&frame.form, &which),
        ..frame
    };
    let drives: Vec<Frame> = setting.each_mass().into_iter().enumerate().map(there).collect();
    let base_moves = setting.base_excited && index == 0;
    if base_moves || setting.input_open {
        for frame in &drives {
            setting.offer(
                frame,
                OneTerm {
                    effect: "base_velocity",
                    title: "Base-velocity coupling",
                    explanation: "A force in proportion to the velocity of the base.",
                    separates: "two octaves of frequency, also above resonance",
                    formula: r"c_b\,\dot u",
                    force: Symbol::InputRate(index).into(),
                    coefficient: coefficient("c_b", 0, -1, Direction::Any),
                    axis: ForceAxis::Input(index),
                },
                forms,
            );
        }
    }
    if !base_moves {
        for frame in setting.each_mass() {
            nonlinear_input(setting, &Frame { form: with_words(&frame.form, &which), ..frame }, index, forms);
        }
    }
    if base_moves {
        for frame in &drives {
            setting.offer(
                frame,
                OneTerm {
                    effect: "input_gain",
                    title: "Input gain",
                    explanation: "The base moves more (or less) than its sensor says.",
                    separates: "a slow motion of the base, which the mass follows",
                    formula: r"k\,u",
                    force: Symbol::Input(index).into(),
                    coefficient: coefficient("gain k", 0, -2, Direction::Any),
                    axis: ForceAxis::Input(index),
                },
                forms,
            );
        }
    }
    forms.push(Form {
        effect: "input_delay",
        title: "Input delay",
        explanation: "The input acts later (or earlier) than it was recorded, as by different filters of two channels.",
        separates: "a wide band of frequencies, or the edges of a pulse",
        formula: r"u(t)\;\to\; u(t-\tau)",
        form: which.clone(),
        site: None,
        coefficients: Vec::new(),
        inner: vec![Inner::new("tau", (0, 1), even(-0.1 * period, 0.1 * period, 20), (-0.3 * period, 0.3 * period))],
        contains: &[],
        axis: ForceAxis::Input(index),
        build: shared(move |inner| Addition { delays: Delays::from_iter([(index, inner[0])]), ..Addition::default() }),
    });
    forms.push(Form {
        effect: "input_saturation",
        title: "Input saturation",
        explanation: "The shaker cannot give more than a limit, though the recorded signal asks for it.",
        separates: "input levels below and above the limit",
        formula: r"u\;\to\;\max(-u_{max},\min(u,u_{max}))",
        form: which,
        site: None,
        coefficients: Vec::new(),
        inner: vec![Inner {
            of_input: Some(index),
            ..Inner::new("u_max", (0, 0), even(0.3 * largest, 0.98 * largest, 18), (0.1 * largest, 0.995 * largest))
        }],
        contains: &[],
        axis: ForceAxis::Input(index),
        build: shared(move |inner| Addition { input_limit: Some((index, inner[0])), ..Addition::default() }),
    });
}

/// A force that grows with the input in another way than in proportion.
fn nonlinear_input(setting: &EffectSetting, frame: &Frame, index: usize, forms: &mut Vec<Form>) {
    let input = || Expression::from(Symbol::Input(index));
    setting.offer(
        frame,
        OneTerm {
            effect: "state_dependent_input",
            title: "State-dependent input",
            explanation: "The input acts the more strongly the further the mass is displaced, as a magnet does.",
            separates: "the same input about two rest positions",
            formula: r"g\,r\,u",
            force: frame.r() * input(),
            coefficient: coefficient("g", -1, 0, Direction::Any),
            axis: ForceAxis::Displacement,
        },
        forms,
    );
    setting.offer(
        frame,
        OneTerm {
            effect: "input_squared",
            title: "Squared input",
            explanation: "A force with the square of the input, as of a voltage between two plates or of a current in a coil.",
            separates: "two levels of the input, or one with a steady part",
            formula: r"g_2\,u^2",
            force: input().power(2.0),
            coefficient: coefficient("g_2", 0, 0, Direction::Any),
            axis: ForceAxis::Input(index),
        },
        forms,
    );
    electrostatic(frame, index, forms);
}

/// A plate that a voltage attracts across a gap, as in microsystems: the pull goes with the voltage over the gap that is left,
/// both squared (S. D. Senturia, Microsystem Design, 2001, section 6.4).
fn electrostatic(frame: &Frame, index: usize, forms: &mut Vec<Form>) {
    // In a gap fifty times as wide as the motion the pull changes by a twenty-fifth: a force with the square of the input alone.
    let reach = frame.reach.max(f64::MIN_POSITIVE);
    for (side, sign) in [("above", 1.0), ("below", -1.0)] {
        let there = frame.clone();
        forms.push(Form {
            effect: "electrostatic_force",
            title: "Electrostatic force",
            explanation: "The pull of a voltage across a gap: it goes with the square of the voltage, and the more strongly the closer the plates are.",
            separates: "voltages that move the plate over a tenth and over a half of the gap",
            formula: r"\pm g_e\,\frac{u^2}{(1\mp r/d)^2}",
            form: with_words(&frame.form, side),
            site: Some(frame.site),
            coefficients: vec![coefficient("g_e", 0, 0, if sign > 0.0 { Direction::Along } else { Direction::Against })],
            inner: vec![Inner::new("d", (1, 0), logarithmic(1.1 * reach, 25.0 * reach, 10), (1.02 * reach, 50.0 * reach))],
            contains: &["input_squared"],
            axis: ForceAxis::Displacement,
            build: shared(move |inner| {
                let left = Expression::Number(1.0) - there.r() * (sign / inner[0]);
                let pull = Expression::from(Symbol::Input(index)).power(2.0) * left.power(-2.0);
                Addition { terms: vec![Term::new(pull)], ..Addition::default() }
            }),
        });
    }
}

/// How far a tone of a frequency, Hz, has turned.
fn phase(frequency: f64) -> Expression {
    Expression::from(Symbol::Time) * (TAU * frequency)
}

fn harmonics(setting: &EffectSetting, forms: &mut Vec<Form>) {
    let frequencies =
        |grid: &[f64]| Inner::new("f", (0, -1), grid.to_vec(), (0.01 * setting.frequency, 0.5 / setting.interval));
    for frame in setting.each_mass().into_iter().filter(|_| !setting.lines.is_empty()) {
        forms.push(Form {
            effect: "unmeasured_harmonic_force",
            title: "Unmeasured harmonic force",
            explanation: "A force at one frequency that no channel recorded, as of an unbalance or of hum.",
            separates: "a record with the input off",
            formula: r"P_{\cos}\cos 2\pi f t+P_{\sin}\sin 2\pi f t",
            form: frame.form,
            site: Some(frame.site),
            coefficients: vec![
                coefficient("P cos", 1, -2, Direction::Any),
                coefficient("P sin", 1, -2, Direction::Any),
            ],
            inner: vec![frequencies(&setting.lines)],
            contains: &["constant_force"],
            axis: ForceAxis::Time,
            build: shared(|inner| {
                let phase = || phase(inner[0]);
                Addition { terms: vec![Term::new(phase().cos()), Term::new(phase().sin())], ..Addition::default() }
            }),
        });
    }
    for frame in setting.springs().into_iter().filter(|_| !setting.pulsations.is_empty()) {
        let pulsating = |words: &str, restoring: Expression| Form {
            effect: "parametric_stiffness",
            title: "Parametric stiffness",
            explanation: "The spring's stiffness pulsates at a frequency of its own, or the pivot of a pendulum moves up and down.",
            separates: "another frequency of excitation: the sidebands move with it",
            formula: r"(k_{p,\cos}\cos 2\pi f t+k_{p,\sin}\sin 2\pi f t)\,r\quad\text{or}\quad (\ldots)\,\sin r",
            form: with_words(&frame.form, words),
            site: Some(frame.site),
            coefficients: vec![spring("k_p cos", 0), spring("k_p sin", 0)],
            inner: vec![frequencies(&setting.pulsations)],
            contains: &["stiffness_drift", "linear_stiffness"],
            axis: ForceAxis::Time,
            build: shared(move |inner| {
                let phase = || phase(inner[0]);
                let term = |wave: Expression| Term::new(restoring.clone() * wave);
                Addition { terms: vec![term(phase().cos()), term(phase().sin())], ..Addition::default() }
            }),
        };
        forms.push(pulsating("", frame.r()));
        if setting.swings(&frame, 0.5) {
            forms.push(pulsating("of a pendulum", frame.r().sin()));
        }
    }
}
