//! The lessons, in the order in which they are best gone through. A new one is an entry of this table.

use super::lesson::{Course, Exercise, Lesson, Start};
use super::oscillators::{HYSTERESIS, PARAMETRIC, SELF_EXCITATION};
use super::structures::{JOINT, MODES};
use crate::app::state::{Room, Sample};
use crate::app::views::View;
use sindyscope_core::study::Scaling;
use sindyscope_rig::{EffectValue, ExcitationChoice, RigDrive, RigSettings};

/// Segment, in main periods, from which on smoothing flattens the motion.
const QUARTER: f64 = 0.25;

pub(super) const fn step(task: &'static str, seen: &'static str, done: fn(&Course<'_>) -> bool) -> Exercise {
    Exercise { task, seen, done }
}

/// A rig of one mass with an effect whose numbers are given.
pub(super) fn rig(effect: &str, values: &[(&str, f64, &str)]) -> RigSettings {
    let value = |(name, value, unit): &(&str, f64, &str)| EffectValue {
        name: (*name).to_owned(),
        value: *value,
        suggested: *value,
        unit: (*unit).to_owned(),
    };
    RigSettings {
        effect: Some(effect.to_owned()),
        effect_values: values.iter().map(value).collect(),
        ..RigSettings::default()
    }
}

fn plain() -> RigSettings {
    RigSettings { effect: None, ..RigSettings::default() }
}

pub(crate) static LESSONS: &[Lesson] = &[
    Lesson {
        id: "smoothing",
        title: "Smoothing",
        about: "Velocity and acceleration are derived from a noisy displacement: how long should the segments be?",
        start: Start::Sample(Sample::Duffing, View::Velocity),
        steps: &[
            step(
                "The displacement was measured, velocity and acceleration are its derivatives. Move Segment (left, SMOOTHING) down to \
                 9 samples or fewer and look at the velocity, or tick acceleration above the plot.",
                "Short segments let the sensor's noise through, and a derivative magnifies it: the acceleration is nearly all noise, and \
                 the coefficients' standard errors have grown.",
                |c| c.now.settings.smoothing.window <= 9 && c.now.identify.is_some(),
            ),
            step(
                "Now the other way: make the segment longer than a quarter of a main period (the figure under the slider), until the \
                 error held out grows.",
                "Long segments flatten the peaks of the motion: no noise is left, but the derivatives are too small where the motion \
                 turns, and the equation is wrong.",
                |c| c.now.segment.is_some_and(|s| s > QUARTER) && c.now.error() > 1.05 * c.best,
            ),
            step(
                "Go back to a good length: press ↺ beside Segment, or Choose for me.",
                "The error is small again. Noise falls with the segment's length and bias grows with it: the best lies between.",
                |c| {
                    c.now.error() < 1.1 * c.best
                        && c.now.settings.smoothing.window != c.before.settings.smoothing.window
                },
            ),
        ],
        closing: "Smoothing trades noise for bias: as long as the noise asks for, far shorter than the motion's period.",
    },
    Lesson {
        id: "threshold",
        title: "Threshold",
        about: "The sparse regression drops what is small: see true terms fall, and false ones stay.",
        start: Start::Sample(Sample::Duffing, View::Response),
        steps: &[
            step(
                "Four terms were found: x, v, x³ and the force. Raise Threshold (left) until one of them falls.",
                "A term that is there was dropped, and the response no longer follows the measurement.",
                |c| c.now.count() < c.first.count() && c.now.error() > 1.5 * c.first.error(),
            ),
            step(
                "Now lower it until more terms are kept than at the beginning: towards the left end of the slider.",
                "With so little asked of them, terms that are not there stay: their coefficients are noise. Look at their standard errors.",
                |c| c.now.count() > c.first.count(),
            ),
            step(
                "The marks under the slider show where each term falls. Set the threshold between the false terms and the true ones.",
                "Four terms again. Between the largest false term and the smallest true one every threshold gives the same equation.",
                |c| c.now.count() == c.first.count() && c.now.error() < 1.1 * c.first.error(),
            ),
        ],
        closing: "A good threshold lies in a gap: if moving it a little changes the equation, the data do not decide.",
    },
    Lesson {
        id: "friction",
        title: "A hidden friction",
        about: "Through all rooms: build a plant that rubs, study its record without that knowledge, and name what is missing.",
        start: Start::Rig(|| RigSettings { duration: 10.0, ..rig("coulomb_friction", &[("F", 0.15, "m/s^2")]) }),
        steps: &[
            step(
                "The mass rubs on the ground: dry friction, a force against the velocity that does not depend on how fast it is. Raise F \
                 (left, PLANT) to at least 0.2 m/s².",
                "The motion is smaller, and sgn v in the table on the right found the force that you set.",
                |c| c.now.parameter("F") >= 0.2 && c.now.rig_found.is_some(),
            ),
            step(
                "Press Study in Identify (right, below): the same two records, as if they had been measured.",
                "Here is the record with every setting of the study. Nobody tells Identify what moved it.",
                |c| c.now.of_the_rig && c.now.room == Room::Identify && c.now.identify.is_some(),
            ),
            step(
                "Forget the friction: take sgn v out of the library (left, LIBRARY).",
                "Without its term the response is wrong in places, and other terms try to stand in for it.",
                |c| c.now.of_the_rig && !c.now.tries("sgn(v)") && c.now.error() > 1.3 * c.best,
            ),
            step(
                "Go to What's missing and press Find what's missing. It starts from a spring and a damper.",
                "The gap is more than noise, it follows the velocity, and its sign changes at zero.",
                |c| c.now.of_the_rig && c.now.looked,
            ),
            step(
                "Step on with Next, look at the cards, and accept the friction.",
                "The gap on data that were never fitted has closed: the effect is named, with its force and a standard error.",
                |c| c.now.of_the_rig && c.now.added.iter().any(|effect| effect.contains("friction")),
            ),
        ],
        closing: "A force that the library lacks leaves a trace in what the model cannot follow: its shape names it.",
    },
    Lesson {
        id: "library",
        title: "The wrong library",
        about: "What the library does not hold cannot be found: other terms stand in for it, as far as the data reach.",
        start: Start::Rig(|| RigSettings {
            noise: 0.002,
            ..rig("clearance", &[("k_c", 150.0, "1/s^2"), ("d", 0.006, "m")])
        }),
        steps: &[
            step(
                "The mass meets springs on both sides beyond a gap. Its term dz(x, d) is in the library now. Switch “plant's terms” off \
                 (right, TRUTH BESIDE FOUND).",
                "Powers of x stand in for the corners of the true force. On the fitted record this may look well.",
                |c| c.now.usual_library && c.now.rig_error() > 1.2 * c.before.rig_error(),
            ),
            step(
                "Raise Held out (left, EXCITATION) to 1.5 or more: the record that is never fitted now moves farther than the one that is.",
                "Outside the data's range the powers go their own way, and the error grows.",
                |c| c.now.rig.held_out_level >= 1.5 && c.now.rig_error() > 1.2 * c.before.rig_error(),
            ),
            step(
                "Switch “plant's terms” on again, and leave the level as it is.",
                "With the right term the model holds beyond its data, too.",
                |c| !c.now.usual_library && c.now.rig_error() < 0.7 * c.before.rig_error(),
            ),
        ],
        closing: "A library is a claim about physics: a fit that is good where you measured is no proof of it.",
    },
    Lesson {
        id: "transient",
        title: "Transient against steady state",
        about: "One steady tone cannot tell a spring from a mass: why the transient is worth recording.",
        start: Start::Rig(|| RigSettings { excitation: ExcitationChoice::Harmonic, ..plain() }),
        steps: &[
            step(
                "A harmonic force acts from rest: the record begins with a transient at the natural frequency. Let it die down before \
                 the record: raise Settle (left, EXCITATION) to 40 s or more.",
                "In the steady state x and u are one tone each: any spring does, if the force's factor follows. The standard errors have \
                 exploded.",
                |c| c.now.rig.settle >= 40.0 && c.now.rig_doubt("x") > 3.0 * c.before.rig_doubt("x"),
            ),
            step(
                "Keep the settling time, but choose another kind of excitation with many frequencies, such as the multisine.",
                "Many frequencies tell inertia, damper and spring apart without any transient.",
                |c| {
                    let rich = !matches!(c.now.rig.excitation, ExcitationChoice::Harmonic | ExcitationChoice::Decay);
                    rich && c.now.rig.settle >= 40.0 && c.now.rig_doubt("x") < 0.3 * c.before.rig_doubt("x")
                },
            ),
        ],
        closing: "Each frequency gives two equations: record transients, or excite many frequencies.",
    },
    Lesson {
        id: "units",
        title: "Units",
        about: "A coefficient is a force over a mass: what its size means, and what it takes to read it in N/m.",
        start: Start::Records(|| RigSettings { mass: 2.5, level: 2.5, ..plain() }),
        steps: &[
            step(
                "The coefficient of x is a stiffness over a mass, in 1/s²; that of v is in 1/s. Compare them as bare numbers: switch what \
                 the threshold compares (left, THRESHOLD) from scaled to raw.",
                "Raw coefficients depend on units: in millimetres or minutes other terms would be the small ones.",
                |c| c.now.settings.scaling == Scaling::Raw && c.now.identify.is_some(),
            ),
            step(
                "Switch back to scaled: each term is compared by its share of the acceleration, whatever the units.",
                "A share has no unit: the equation is the same in m and in mm.",
                |c| c.now.settings.scaling == Scaling::Scaled && c.before.settings.scaling == Scaling::Raw,
            ),
            step(
                "Forces need the mass. Tick the box beside Mass (left, KNOWN PHYSICS) and give it: one over the coefficient of u, in kg.",
                "With the mass the coefficients become a stiffness in N/m and a damping in N s/m.",
                |c| c.now.settings.mass.is_some(),
            ),
        ],
        closing: "Say the unit of every coefficient: a number alone is no physics.",
    },
    Lesson {
        id: "noise",
        title: "Noise",
        about: "How sensor noise reaches the coefficients, and what helps against it.",
        start: Start::Rig(|| RigSettings { duration: 10.0, noise: 0.002, ..plain() }),
        steps: &[
            step(
                "The sensor's noise is 0.2 % of the motion. Raise Noise (left, SENSORS) to 4 % or more.",
                "The standard errors have grown. The error held out cannot fall below the noise: beside it stands the noise floor.",
                |c| c.now.rig.noise >= 0.04 && c.now.rig_doubt("x") > 1.5 * c.before.rig_doubt("x"),
            ),
            step(
                "Measure longer: raise Length (left, RECORD) to 40 s or more, with the same noise.",
                "Four times the samples halve the standard errors: noise averages out.",
                |c| {
                    let longer = c.now.rig.duration >= 4.0 * c.first.rig.duration;
                    longer && c.now.rig.noise >= 0.04 && c.now.rig_doubt("x") < 0.8 * c.before.rig_doubt("x")
                },
            ),
            step(
                "Or move more: reduce Noise to 1 % or less, as a larger motion would before the same sensor.",
                "A better ratio of motion to noise helps at once, and more than any smoothing.",
                |c| c.now.rig.noise <= 0.0101 && c.now.rig_doubt("x") < 0.8 * c.before.rig_doubt("x"),
            ),
        ],
        closing: "Against noise: move more, measure longer, then smooth. An error at the noise floor is as good as it gets.",
    },
    Lesson {
        id: "overfit",
        title: "An overfit",
        about: "A library too rich for the data: the fit is good, and fails at four times the force.",
        start: Start::Sample(Sample::Overfit, View::Response),
        steps: &[
            step(
                "The fitted record is followed well. Click the record that is held out (left, DATA): the same oscillator at four times \
                 the force.",
                "There the response is wrong: high powers that were invisible in small motion dominate the large one.",
                |c| c.now.shows_held_out && c.now.view == View::Response,
            ),
            step(
                "Take x⁷ out of the library (left, LIBRARY), or use the remedy that the window offers.",
                "The error held out has fallen: the motion that was fitted could not tell the powers apart.",
                |c| !c.now.tries("x^7") && c.now.error() < 0.7 * c.first.error(),
            ),
            step(
                "Try to do better: take out whatever else the data cannot tell (x⁵, x², the constant), as long as the error held out \
                 does not grow.",
                "Fewer terms, and an equation that holds beyond its data.",
                |c| {
                    c.now.settings.terms.len() < c.before.settings.terms.len()
                        && c.now.error() <= 1.05 * c.before.error()
                },
            ),
        ],
        closing: "The error on data that were never fitted is the honest one: judge a library by it.",
    },
    Lesson {
        id: "sticking",
        title: "Sticking",
        about: "Dry friction can hold the mass still: then its equation does not say what the force is.",
        start: Start::Rig(|| RigSettings {
            drive: RigDrive::Base,
            level: 0.004,
            frequency: 3.0,
            damping_ratio: 0.01,
            excitation: ExcitationChoice::Harmonic,
            tone: 0.9,
            noise: 0.0005,
            duration: 12.0,
            rate: 200.0,
            ..rig("static_friction", &[("F", 0.08, "m/s^2"), ("F_s", 0.1, "m/s^2")])
        }),
        steps: &[
            step(
                "The base moves slowly under a mass that rubs on the ground. Raise F (left, PLANT) until it sticks for a tenth of the time.",
                "While it sticks the velocity is zero, and friction is whatever it takes: between −F_s and +F_s. The rubbing strip in \
                 the drawing lights up.",
                |c| c.now.stuck >= 0.1,
            ),
            step(
                "Press Study in Identify and look at the response.",
                "The shaded stretches are where the measured motion stands still: they are left out of the regression.",
                |c| {
                    c.now.of_the_rig
                        && c.now.room == Room::Identify
                        && c.now.identify.as_ref().is_some_and(|f| f.standing > 0.02)
                },
            ),
            step(
                "Back to Virtual rig: raise Level until the mass hardly sticks any more (less than one part in fifty).",
                "Where it always slides the friction is a constant force against the velocity: two numbers are enough.",
                |c| {
                    c.now.room == Room::Rig && c.now.stuck < 0.02 && c.now.rig_found.is_some() && c.before.stuck >= 0.02
                },
            ),
        ],
        closing: "A record of a mass that sticks tells little about its friction: make it slide.",
    },
    SELF_EXCITATION,
    PARAMETRIC,
    HYSTERESIS,
    MODES,
    JOINT,
    Lesson {
        id: "chaos",
        title: "Chaos and its horizon",
        about: "An equation can be right to four digits and still not predict for long.",
        start: Start::Sample(Sample::Lorenz, View::Response),
        steps: &[
            step(
                "The Lorenz system: three measured states. Show the record that is held out (left, DATA).",
                "The response follows for a while, then goes another way: that time is the horizon.",
                |c| c.now.shows_held_out && c.now.view == View::Response,
            ),
            step(
                "Change a setting so that the coefficients hardly move: another Segment length, for instance.",
                "Coefficients that differ in the fourth digit part somewhere else. A difference grows by a factor in every second, and no \
                 smoothing stops that.",
                |c| {
                    let (Some(now), Some(before)) = (&c.now.identify, &c.before.identify) else { return false };
                    let alike = now.terms.len() == before.terms.len()
                        && now
                            .terms
                            .iter()
                            .zip(&before.terms)
                            .all(|(a, b)| (a.coefficient - b.coefficient).abs() < 0.1 * b.coefficient.abs());
                    alike && now != before && c.now.settings.smoothing != c.before.settings.smoothing
                },
            ),
            step(
                "Look at the Phase view (Motion, Phase).",
                "In the phase plane both move on the same figure: the equation is right about where the motion goes, not about when.",
                |c| c.now.view == View::Phase && c.before.view != View::Phase,
            ),
        ],
        closing: "Judge a chaotic model by its horizon and its attractor, not by its error after long times.",
    },
];
