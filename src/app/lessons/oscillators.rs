//! The lessons on what oscillators do that no linear one does: keep themselves going, grow by a pulsating spring, remember.

use super::catalogue::{rig, step};
use super::facts::Facts;
use super::lesson::{Lesson, Start};
use crate::app::state::{Room, Sample};
use crate::app::views::View;
use sindyscope_values::term::{Symbol, Term};

/// Of an error that grew or fell by this factor the response shows it.
const PLAIN: f64 = 3.0;
/// An error below this many times the sensor's noise is next to nothing but noise.
const AT_THE_NOISE: f64 = 3.0;

pub(super) const SELF_EXCITATION: Lesson = Lesson {
    id: "self-excitation",
    title: "Self-excitation",
    about: "No force acts and yet the motion grows, then stays as large as it is: where does the energy come from?",
    start: Start::Sample(Sample::VanDerPol, View::Response),
    steps: &[
        step(
            "The motion grows from next to nothing, and no force acts. Let the damping depend on the displacement: type x^2*v into the \
             field under LIBRARY (left) and press Enter.",
            "The factor of v is positive: near the middle the damper gives energy instead of taking it (the window warns, for most \
             structures that would be wrong). −x²·v takes it back farther out, and the motion settles where both balance.",
            |c| {
                let factor = |text: &str| c.now.identify.as_ref().and_then(|f| f.term(text)).map(|t| t.coefficient);
                factor("v").is_some_and(|c| c > 0.0) && factor("x^2*v").is_some_and(|c| c < 0.0)
            },
        ),
        step(
            "The response of the fitted record stays at rest: sgn v, which is not there, holds it. Take sgn v and v·|v| out of the \
             library.",
            "Three terms are left, x, v and x²·v: van der Pol's equation. Its response grows as the motion does, to an amplitude of 2.",
            |c| !c.now.tries("sgn(v)") && c.now.tries("x^2*v") && c.now.count() == 3,
        ),
        step(
            "Look at the Phase view (Motion, Phase).",
            "The motion winds outwards onto one closed curve, the limit cycle. Its size is the equation's own: from a larger start it \
             would wind inwards onto the same curve.",
            |c| c.now.view == View::Phase && c.before.view != View::Phase,
        ),
        step(
            "Take x²·v out of the library again.",
            "A damper of one sign lets a motion grow for ever or die away: no linear equation has a limit cycle.",
            |c| !c.now.tries("x^2*v") && c.now.error() > PLAIN * c.best,
        ),
    ],
    closing: "Self-excitation: energy in at small amplitude, out at large. What settles is a limit cycle.",
};

pub(super) const PARAMETRIC: Lesson = Lesson {
    id: "parametric",
    title: "Parametric resonance",
    about: "A damped motion without any force grows: the spring pulsates.",
    start: Start::Sample(Sample::Mathieu, View::Response),
    steps: &[
        step(
            "No force acts and the damper takes energy, and yet the motion grows. Let the spring pulsate, at twice the natural \
             frequency of 1 rad/s: type x*cos(2*t) into the field under LIBRARY (left) and press Enter.",
            "The response follows now. The spring is stiff where it pulls the mass back and soft where the mass moves out, twice in \
             each period: so it gives energy.",
            |c| pulsates(c.now, "x*cos(2*t)") && PLAIN * c.now.error() < c.first.error(),
        ),
        step(
            "What bounds the growth? Take x³ out of the library.",
            "A linear spring that pulsates lets the motion grow for ever. The stiffening one changes the natural frequency with the \
             amplitude, until the pulsation no longer meets it.",
            |c| !c.now.tries("x^3") && pulsates(c.now, "x*cos(2*t)") && c.now.error() > PLAIN * c.best,
        ),
        step(
            "Put x³ back: type x^3. Then try another frequency: take x·cos(2·t) out and add x*cos(1.5*t).",
            "This pulsation explains nothing: energy is given near twice the natural frequency, and far less near a whole fraction of \
             that.",
            |c| {
                let other = !c.now.tries("x*cos(2*t)") && c.now.settings.terms.iter().any(in_time);
                other && c.now.tries("x^3") && c.now.error() > PLAIN * c.best
            },
        ),
    ],
    closing: "Where a motion grows without a force, look for a stiffness that pulsates at twice its frequency.",
};

pub(super) const HYSTERESIS: Lesson = Lesson {
    id: "hysteresis",
    title: "Hysteresis",
    about: "A force that depends on where the motion came from: over the displacement it runs in a loop.",
    start: Start::Rig(|| {
        rig(
            "bouc_wen_hysteresis",
            &[("k_h", 120.0, "1/s^2"), ("x_y", 0.004, "m"), ("n", 2.0, ""), ("beta_share", 0.8, "")],
        )
    }),
    steps: &[
        step(
            "The mass hangs on a spring and on one that yields beyond x_y (left, PLANT). Lower Level (left, EXCITATION) to a \
             hundredth, so that it hardly yields.",
            "In small motion the yielding spring is a spring: the two act as one that is stiffer, and the equation of a spring and a \
             damper suits.",
            |c| {
                let small = c.now.rig.level <= 0.0101 * c.first.rig.level;
                small && c.now.rig_found.as_ref().is_some_and(|f| c.now.rig_error() < AT_THE_NOISE * f.noise)
            },
        ),
        step(
            "Bring Level back to what it was, or beyond, and press Study in Identify (right, below).",
            "Now it yields at every reversal, and no term of the library has a memory: the response stays wrong, however many terms \
             there are.",
            |c| {
                let large = c.now.rig.level >= 0.99 * c.first.rig.level;
                large && c.now.of_the_rig && c.now.room == Room::Identify && c.now.identify.is_some()
            },
        ),
        step(
            "Go to What's missing and press Find what's missing.",
            "The missing force is not one of the displacement alone, nor of the velocity alone.",
            |c| c.now.of_the_rig && c.now.looked,
        ),
        step(
            "Step on with Next to the cards: the hysteresis has its force drawn over the displacement. Accept it.",
            "The force is a loop: on the way out it is another than on the way back. A spring is a line and a damper an ellipse that \
             closes up where the motion is slow; this loop stays open.",
            |c| c.now.of_the_rig && c.now.added.iter().any(|effect| effect.contains("hysteresis")),
        ),
    ],
    closing: "A loop over the displacement that stays open in slow motion is hysteresis: it needs a state of its own.",
};

/// True if a term was found whose force changes with time by itself, as it is typed.
fn pulsates(facts: &Facts, text: &str) -> bool {
    facts.tries(text) && facts.identify.as_ref().is_some_and(|found| found.term(text).is_some())
}

fn in_time(term: &Term) -> bool {
    term.symbols().into_iter().any(|symbol| symbol == Symbol::Time)
}
