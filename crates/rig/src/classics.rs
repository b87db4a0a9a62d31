//! The oscillators that courses begin with, with the figures of their sources.

use sindyscope_values::model::{Equation, Model};
use sindyscope_values::term::{Expression, Symbol, Term};

use super::plant::{Contact, Plant};
use super::plants::{PlantKind, TWO_MASSES, at_least, parameter};
use super::scenarios::{BASIS, Scenario, ScenarioExcitation};
use super::sensor::{Noise, Sensor};

fn x() -> Expression {
    Symbol::State(0).into()
}

fn v() -> Expression {
    Symbol::Rate(0).into()
}

fn u() -> Expression {
    Symbol::Input(0).into()
}

/// A plant of one mass without dry friction, by the parts of its acceleration.
fn smooth(parts: impl IntoIterator<Item = (Expression, f64)>) -> Plant {
    let terms = parts.into_iter().filter(|(_, c)| *c != 0.0).map(|(e, c)| (Term::new(e), c));
    Plant::smooth(Model::second_order(1, vec![Equation::known(terms)]))
}

const FORCED: (&str, &str) = ("m", "m/s^2");

/// `ẍ + δẋ + αx + βx³ + F sgn ẋ = u`.
static TWO_WELLS: PlantKind = PlantKind {
    parameters: &[
        parameter("delta", 0.25, "1/s", "damping"),
        parameter("alpha", -1.0, "1/s^2", "linear stiffness"),
        parameter("beta", 1.0, "1/(m^2 s^2)", "cubic stiffness"),
        at_least(0.0, parameter("F", 0.0, "m/s^2", "dry friction over mass")),
    ],
    build: |p| {
        let wells = smooth([(x(), -p[1]), (x().power(3.0), -p[2]), (v(), -p[0]), (u(), 1.0)]);
        let rubs = p[3] > 0.0;
        Plant { contacts: rubs.then(|| Contact::coulomb(Term::new(v()), 1, p[3])).into_iter().collect(), ..wells }
    },
    units: FORCED,
};

/// `ẍ − μ(1 − x²)ẋ + x + βx³ = u`.
static VAN_DER_POL: PlantKind = PlantKind {
    parameters: &[
        parameter("mu", 1.0, "1/s", "negative damping about the middle"),
        parameter("beta", 0.0, "1/(m^2 s^2)", "cubic stiffness"),
    ],
    build: |p| {
        let parts = [(x(), -1.0), (v(), p[0]), (x().power(2.0) * v(), -p[0]), (x().power(3.0), -p[1]), (u(), 1.0)];
        smooth(parts)
    },
    units: FORCED,
};

/// `ẍ − μ(1 − ẋ²/3)ẋ + x = u`.
static RAYLEIGH: PlantKind = PlantKind {
    parameters: &[parameter("mu", 1.0, "1/s", "negative damping at low speed")],
    build: |p| smooth([(x(), -1.0), (v(), p[0]), (v().power(3.0), -p[0] / 3.0), (u(), 1.0)]),
    units: FORCED,
};

/// `θ̈ + θ̇/q + sin θ = u`.
static PENDULUM: PlantKind = PlantKind {
    parameters: &[at_least(1e-6, parameter("q", 2.0, "", "quality"))],
    build: |p| smooth([(x().sin(), -1.0), (v(), -p[0].recip()), (u(), 1.0)]),
    units: ("rad", "rad/s^2"),
};

/// `ẍ + cẋ + (a + b cos ωt) x + βx³ = u`.
static MATHIEU: PlantKind = PlantKind {
    parameters: &[
        parameter("a", 1.0, "1/s^2", "mean stiffness"),
        parameter("b", 0.4, "1/s^2", "how much the stiffness pulsates"),
        parameter("omega", 2.0, "rad/s", "angular frequency of the pulsation"),
        parameter("c", 0.05, "1/s", "damping"),
        parameter("beta", 0.1, "1/(m^2 s^2)", "cubic stiffness, which bounds the motion"),
    ],
    build: |p| {
        let pulsating = (Expression::from(Symbol::Time) * p[2]).cos() * x();
        smooth([(x(), -p[0]), (pulsating, -p[1]), (v(), -p[3]), (x().power(3.0), -p[4]), (u(), 1.0)])
    },
    units: FORCED,
};

/// `θ̈ + cθ̇ + (a + b cos ωt) sin θ = u`: a pendulum whose pivot moves up and down.
static PUMPED_PENDULUM: PlantKind = PlantKind {
    parameters: &[
        parameter("a", 1.0, "1/s^2", "gravity over length"),
        parameter("b", 0.4, "1/s^2", "acceleration of the pivot over length"),
        parameter("omega", 2.0, "rad/s", "angular frequency of the pivot"),
        parameter("c", 0.1, "1/s", "damping"),
    ],
    build: |p| {
        let pulsating = (Expression::from(Symbol::Time) * p[2]).cos() * x().sin();
        smooth([(x().sin(), -p[0]), (pulsating, -p[1]), (v(), -p[3]), (u(), 1.0)])
    },
    units: ("rad", "rad/s^2"),
};

/// `θ̈ + cθ̇ + a sin θ = b + u`: a pendulum under a steady torque, as a synchronous machine or the phase of a Josephson junction.
static TURNED_PENDULUM: PlantKind = PlantKind {
    parameters: &[
        parameter("a", 1.0, "1/s^2", "gravity over length"),
        parameter("b", 1.2, "rad/s^2", "steady torque over the moment of inertia"),
        parameter("c", 0.3, "1/s", "damping"),
    ],
    build: |p| smooth([(Expression::Number(1.0), p[1]), (x().sin(), -p[0]), (v(), -p[2]), (u(), 1.0)]),
    units: ("rad", "rad/s^2"),
};

/// `θ̈ + cθ̇ + kθ − a sin θ = u`: a pendulum that stands upright, held by a spring.
static UPRIGHT_PENDULUM: PlantKind = PlantKind {
    parameters: &[
        parameter("a", 2.0, "1/s^2", "gravity over length"),
        parameter("k", 2.6, "1/s^2", "stiffness of the spring over the moment of inertia"),
        parameter("c", 0.15, "1/s", "damping"),
    ],
    build: |p| smooth([(x().sin(), p[0]), (x(), -p[1]), (v(), -p[2]), (u(), 1.0)]),
    units: ("rad", "rad/s^2"),
};

/// `θ̈₁ + cθ̇₁ + a sin θ₁ + k(θ₁ − θ₂) = u` and `θ̈₂ + cθ̇₂ + a sin θ₂ + k(θ₂ − θ₁) = 0`: two pendula with a spring between them.
static COUPLED_PENDULA: PlantKind = PlantKind {
    parameters: &[
        parameter("a", 1.0, "1/s^2", "gravity over length"),
        parameter("k", 0.2, "1/s^2", "stiffness of the spring over the moment of inertia"),
        parameter("c", 0.05, "1/s", "damping"),
    ],
    build: |p| {
        let hanging = |own: usize, other: usize, torque: f64| {
            let [angle, beside] = [own, other].map(|k| Expression::from(Symbol::State(k)));
            let rate = Expression::from(Symbol::Rate(own));
            let parts = [(angle.clone().sin(), -p[0]), (angle, -p[1]), (beside, p[1]), (rate, -p[2]), (u(), torque)];
            Equation::known(parts.into_iter().filter(|(_, c)| *c != 0.0).map(|(e, c)| (Term::new(e), c)))
        };
        Plant::smooth(Model::second_order(2, vec![hanging(0, 1, 1.0), hanging(1, 0, 0.0)]))
    },
    units: ("rad", "rad/s^2"),
};

/// A mass on a spring that a belt drags along, with friction that falls with the speed across the contact.
static BELT: PlantKind = PlantKind {
    parameters: &[
        parameter("k", 1.0, "1/s^2", "stiffness over mass"),
        parameter("c", 0.0, "1/s", "viscous damping over mass"),
        parameter("v0", 0.2, "m/s", "speed of the belt"),
        at_least(0.0, parameter("F", 1.0, "m/s^2", "friction force at rest over mass")),
        at_least(0.0, parameter("delta", 3.0, "s/m", "how fast friction falls with the speed across the contact")),
    ],
    build: |p| {
        let slip = || v() - p[2];
        let falling = (slip().abs() * p[4] + 1.0).power(-1.0);
        let parts = [(x(), -p[0]), (v(), -p[1]), (u(), 1.0)];
        let terms = parts.into_iter().filter(|(_, c)| *c != 0.0).map(|(e, c)| (Term::new(e), c));
        let contact =
            Contact { sliding: vec![(Term::new(falling), p[3])], ..Contact::coulomb(Term::new(slip()), 1, p[3]) };
        Plant { smooth: Model::second_order(1, vec![Equation::known(terms)]), contacts: vec![contact] }
    },
    units: FORCED,
};

/// A mass on a spring with a stiff stop on one side.
static STOP: PlantKind = PlantKind {
    parameters: &[
        parameter("k", 40.0, "1/s^2", "stiffness over mass"),
        parameter("c", 0.4, "1/s", "damping over mass"),
        parameter("ks", 4000.0, "1/s^2", "stiffness of the stop over mass"),
        parameter("d", 0.005, "m", "distance to the stop"),
    ],
    build: |p| smooth([(x(), -p[0]), (v(), -p[1]), ((x() - p[3]).max(0.0), -p[2]), (u(), 1.0)]),
    units: FORCED,
};

/// A mass between two springs with a gap, and a weak spring that centres it.
static FREEPLAY: PlantKind = PlantKind {
    parameters: &[
        parameter("k", 10.0, "1/s^2", "stiffness within the gap over mass"),
        parameter("c", 0.6, "1/s", "damping over mass"),
        parameter("kc", 400.0, "1/s^2", "stiffness beyond the gap over mass"),
        at_least(0.0, parameter("d", 0.002, "m", "half of the gap")),
    ],
    build: |p| smooth([(x(), -p[0]), (v(), -p[1]), (x().dead_zone(p[3]), -p[2]), (u(), 1.0)]),
    units: FORCED,
};

/// The tip of two oblique springs: `ẍ + cẋ + k x (1 − l/√(b² + x²)) = u`, which snaps through where `l > b`.
static TRUSS: PlantKind = PlantKind {
    parameters: &[
        parameter("k", 40.0, "1/s^2", "stiffness of both springs over mass"),
        parameter("c", 0.5, "1/s", "damping over mass"),
        at_least(1e-6, parameter("b", 0.1, "m", "half of the span")),
        parameter("l", 0.11, "m", "length of a spring without load"),
    ],
    build: |p| {
        let length = (x().power(2.0) + p[2] * p[2]).power(-0.5);
        smooth([(x(), -p[0]), (x() * length, p[0] * p[3]), (v(), -p[1]), (u(), 1.0)])
    },
    units: FORCED,
};

/// A damper that resists one way more than the other, as a shock absorber's.
static UNEVEN_DAMPER: PlantKind = PlantKind {
    parameters: &[
        parameter("k", 60.0, "1/s^2", "stiffness over mass"),
        parameter("c", 2.0, "1/s", "damping in compression over mass"),
        parameter("c2", 4.0, "1/s", "what is added to it in extension"),
    ],
    build: |p| smooth([(x(), -p[0]), (v(), -p[1]), (v().max(0.0), -p[2]), (u(), 1.0)]),
    units: FORCED,
};

/// A plate on a spring that a voltage attracts across a gap: `ẍ + cẋ + kx = a u²/(d − x)²`.
static ACTUATOR: PlantKind = PlantKind {
    parameters: &[
        parameter("k", 100.0, "1/s^2", "stiffness over mass"),
        parameter("c", 1.0, "1/s", "damping over mass"),
        parameter("a", 1.0, "m^3/(V^2 s^2)", "permittivity times area over twice the mass"),
        at_least(1e-6, parameter("d", 1.0, "m", "gap at rest")),
    ],
    build: |p| {
        let gap = (Expression::Number(p[3]) - x()).power(-2.0);
        smooth([(x(), -p[0]), (v(), -p[1]), (u().power(2.0) * gap, p[2])])
    },
    units: ("m", "V"),
};

/// The benchmark's hysteresis: `m ÿ + c ẏ + k y + z = u` with `ż = α ẏ − β (γ |ẏ| z + δ ẏ |z|)`, an exponent `ν` of 1. No sensor
/// sees the state `z`, a force.
static BOUC_WEN: PlantKind = PlantKind {
    parameters: &[
        at_least(1e-9, parameter("m", 2.0, "kg", "mass")),
        parameter("c", 10.0, "N s/m", "viscous damping"),
        parameter("k", 5e4, "N/m", "stiffness beside the hysteresis"),
        parameter("alpha", 5e4, "N/m", "stiffness of the hysteresis at small amplitude"),
        parameter("beta", 1e3, "1/m", "how soon it yields"),
        parameter("gamma", 0.8, "", "share against the motion"),
        parameter("delta", -1.1, "", "share along the motion"),
    ],
    build: |p| {
        let z = || Expression::from(Symbol::Internal(0));
        let known = |parts: Vec<(Expression, f64)>| {
            Equation::known(parts.into_iter().filter(|(_, c)| *c != 0.0).map(|(e, c)| (Term::new(e), c)))
        };
        let forces = vec![(x(), -p[2] / p[0]), (v(), -p[1] / p[0]), (z(), -p[0].recip()), (u(), p[0].recip())];
        let yielding = [(v().abs() * z(), -p[4] * p[5]), (v() * z().abs(), -p[4] * p[6])];
        let rate = std::iter::once((v(), p[3])).chain(yielding).collect();
        Plant::smooth(Model::second_order(1, vec![known(forces)]).with_internals(vec![known(rate)]))
    },
    units: ("m", "N"),
};

const TONE: Scenario = Scenario { rate: 20.0, duration: 250.0, initial: &[0.1, 0.0], ..BASIS };

/// Random-phase lines from slow to fast, which show more than one tone does.
const LINES: Scenario =
    Scenario { excitation_kind: ScenarioExcitation::Multisine, rate: 200.0, duration: 40.0, lines: 40, ..BASIS };

/// The same about a radian a second.
const SLOW_LINES: Scenario = Scenario {
    excitation_kind: ScenarioExcitation::Multisine,
    duration: 150.0,
    frequencies: &[0.02, 0.5],
    lines: 25,
    ..TONE
};

/// Frequency of an angular frequency, Hz.
const fn turns(omega: f64) -> f64 {
    omega / std::f64::consts::TAU
}

/// Samples of the benchmark's record to be fitted, and how many a second.
const BOUC_WEN_SAMPLES: f64 = 8192.0;
const BOUC_WEN_RATE: f64 = 750.0;

/// J. P. Noël, M. Schoukens, Hysteretic benchmark with a dynamic nonlinearity, Workshop on Nonlinear System Identification
/// Benchmarks, Brussels 2016: every line of the record's spectrum from 5 to 150 Hz, 50 N RMS.
const HYSTERESIS: Scenario = Scenario {
    name: "bouc-wen",
    summary: "hysteresis (Bouc and Wen; the benchmark of Noël and Schoukens 2016), random-phase multisine force, noise of 0.008 mm",
    rate: BOUC_WEN_RATE,
    duration: BOUC_WEN_SAMPLES / BOUC_WEN_RATE,
    amplitude: 50.0 * std::f64::consts::SQRT_2,
    frequencies: &[55.0 * BOUC_WEN_RATE / BOUC_WEN_SAMPLES, 1638.0 * BOUC_WEN_RATE / BOUC_WEN_SAMPLES],
    lines: 1584,
    initial: &[0.0; 3],
    sensor: Sensor { noise: Noise::Deviation(8e-6), ..Sensor::PERFECT },
    plant: &BOUC_WEN,
    ..LINES
};

/// The scenarios.
pub(super) static CLASSICS: [Scenario; 22] = [
    Scenario {
        // P. Holmes, Phil. Trans. R. Soc. A 292 (1979) 419; F. C. Moon, P. J. Holmes, J. Sound Vib. 65 (1979) 275.
        name: "double-well",
        summary: "a beam between two magnets (Moon and Holmes 1979): two wells, chaotic",
        amplitude: 0.4,
        frequencies: &[turns(1.0)],
        plant: &TWO_WELLS,
        ..TONE
    },
    Scenario {
        name: "double-well-friction",
        summary: "a beam between two magnets that rubs, random-phase multisine force: two wells, chaotic",
        excitation_kind: ScenarioExcitation::Multisine,
        duration: 150.0,
        amplitude: 0.42,
        frequencies: &[0.05, 0.3],
        lines: 9,
        initial: &[0.9, 0.0],
        plant: &TWO_WELLS,
        changed: &[("delta", 0.15), ("F", 0.1)],
        ..TONE
    },
    Scenario {
        // Y. Ueda, J. Stat. Phys. 20 (1979) 181.
        name: "ueda",
        summary: "a cubic spring alone, strongly driven (Ueda 1979): chaotic",
        rate: 40.0,
        duration: 150.0,
        amplitude: 7.5,
        frequencies: &[turns(1.0)],
        initial: &[3.0, 4.0],
        plant: &TWO_WELLS,
        changed: &[("delta", 0.05), ("alpha", 0.0)],
        ..TONE
    },
    Scenario {
        name: "van-der-pol",
        summary: "an oscillator that keeps itself going (van der Pol 1926), let go near rest",
        excitation_kind: ScenarioExcitation::Release,
        duration: 150.0,
        amplitude: 0.1,
        plant: &VAN_DER_POL,
        ..TONE
    },
    Scenario {
        name: "van-der-pol-forced",
        summary: "the same under a harmonic force",
        amplitude: 1.2,
        frequencies: &[turns(1.1)],
        plant: &VAN_DER_POL,
        ..TONE
    },
    Scenario {
        name: "rayleigh",
        summary: "an oscillator whose damping is negative at low speed (Rayleigh 1883), under a harmonic force",
        amplitude: 0.8,
        frequencies: &[turns(1.3)],
        plant: &RAYLEIGH,
        ..TONE
    },
    Scenario {
        // G. L. Baker, J. P. Gollub, Chaotic Dynamics, Cambridge 1990: q = 2, drive 1.15 at 2/3 rad/s.
        name: "pendulum",
        summary: "a driven pendulum that turns over (Baker and Gollub 1990): chaotic",
        amplitude: 1.15,
        frequencies: &[turns(2.0 / 3.0)],
        plant: &PENDULUM,
        ..TONE
    },
    Scenario {
        name: "mathieu",
        summary: "a spring that pulsates at twice the natural frequency (parametric resonance), a cubic spring beside it",
        excitation_kind: ScenarioExcitation::Release,
        duration: 150.0,
        amplitude: 0.1,
        plant: &MATHIEU,
        ..TONE
    },
    Scenario {
        // A. Stephenson, Phil. Mag. 15 (1908) 233: a pivot that moves up and down.
        name: "parametric-pendulum",
        summary: "a pendulum whose pivot moves up and down at twice its frequency (parametric resonance)",
        excitation_kind: ScenarioExcitation::Release,
        duration: 100.0,
        amplitude: 0.5,
        plant: &PUMPED_PENDULUM,
        ..TONE
    },
    Scenario {
        // D. E. McCumber, J. Appl. Phys. 39 (1968) 3113.
        name: "turned-pendulum",
        summary: "a pendulum that a steady torque turns over and over (a Josephson junction, McCumber 1968), harmonic torque beside it, noise of 0.01 rad",
        duration: 100.0,
        amplitude: 0.3,
        frequencies: &[turns(0.7)],
        sensor: Sensor { noise: Noise::Deviation(0.01), ..Sensor::PERFECT },
        plant: &TURNED_PENDULUM,
        ..TONE
    },
    Scenario {
        name: "upright-pendulum",
        summary: "an upright pendulum that a spring holds, random-phase multisine torque",
        amplitude: 1.0,
        initial: &[0.0; 2],
        plant: &UPRIGHT_PENDULUM,
        ..SLOW_LINES
    },
    Scenario {
        name: "coupled-pendula",
        summary: "two pendula with a spring between them, random-phase multisine torque on the first",
        amplitude: 0.5,
        initial: &[0.0; 4],
        plant: &COUPLED_PENDULA,
        ..SLOW_LINES
    },
    Scenario {
        // R. I. Leine, D. H. van Campen, A. de Kraker, L. van den Steen, Nonlinear Dynamics 16 (1998) 41.
        name: "belt",
        summary: "a mass on a belt that sticks and slips, friction falls with the speed (Leine et al. 1998)",
        excitation_kind: ScenarioExcitation::Release,
        duration: 100.0,
        amplitude: 1.0,
        plant: &BELT,
        ..TONE
    },
    Scenario {
        name: "hard-stop",
        summary: "a mass that hits a stiff stop on one side, random-phase multisine force",
        amplitude: 0.1,
        frequencies: &[0.2, 6.0],
        plant: &STOP,
        ..LINES
    },
    Scenario {
        name: "freeplay",
        summary: "a mass with a gap before the springs on either side, random-phase multisine force",
        amplitude: 0.15,
        frequencies: &[0.2, 8.0],
        plant: &FREEPLAY,
        ..LINES
    },
    Scenario {
        name: "truss",
        summary: "two oblique springs that snap through (von Mises), random-phase multisine force",
        amplitude: 0.3,
        frequencies: &[0.1, 3.0],
        duration: 80.0,
        rate: 100.0,
        plant: &TRUSS,
        ..LINES
    },
    Scenario {
        name: "uneven-damper",
        summary: "a damper that resists extension more than compression, random-phase multisine force",
        amplitude: 1.0,
        frequencies: &[0.3, 5.0],
        plant: &UNEVEN_DAMPER,
        ..LINES
    },
    Scenario {
        name: "electrostatic",
        summary: "a plate on a spring that a voltage attracts across a gap, random-phase multisine voltage",
        amplitude: 1.0,
        frequencies: &[0.2, 4.0],
        plant: &ACTUATOR,
        ..LINES
    },
    Scenario {
        name: "energy-sink",
        summary: "a small mass on a purely cubic spring takes the energy of a large one, random-phase multisine force",
        amplitude: 4.0,
        frequencies: &[0.5, 8.0],
        initial: &[0.0; 4],
        plant: &TWO_MASSES,
        changed: &[("m2", 0.1), ("k12", 0.0), ("c12", 0.2), ("h12", 2e6)],
        ..LINES
    },
    HYSTERESIS,
    Scenario {
        name: "bouc-wen-sweep",
        summary: "the same under a sweep of 40 N from 20 to 50 Hz, up and down, without noise: the benchmark's test, swept faster",
        excitation_kind: ScenarioExcitation::Sweep,
        // The benchmark takes 10 Hz a minute.
        duration: 30.0,
        amplitude: 40.0,
        frequencies: &[20.0, 50.0],
        sensor: Sensor::PERFECT,
        ..HYSTERESIS
    },
    Scenario {
        // J. P. Den Hartog, Mechanical Vibrations, 4th ed. 1956, section 3.3: for a mass ratio μ = m2/m1 the absorber is tuned to
        // 1/(1 + μ) of the frequency Ω of the bare mass, c12 = 2 m2 Ω √(3μ/(8 (1 + μ)³)). Here μ = 1/20, Ω = 20 rad/s.
        name: "absorber",
        summary: "a mass with a tuned absorber that no sensor sees (Den Hartog), random-phase multisine force; x2 can be measured too",
        amplitude: 4.0,
        frequencies: &[0.5, 8.0],
        initial: &[0.0; 4],
        measures: &["x1"],
        plant: &TWO_MASSES,
        changed: &[("m2", 0.1), ("c1", 0.0), ("k12", 36.281_179_138_322), ("c12", 0.509_069_032_214_14)],
        ..LINES
    },
];
