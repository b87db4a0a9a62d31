//! The lessons on structures: what a mode is, and a joint that slips.

use super::catalogue::step;
use super::facts::ModesFacts;
use super::lesson::{Course, Lesson, Start};
use crate::app::state::{Room, Sample};
use crate::app::views::View;
use sindyscope_report::modal::ModalView;

/// Modes of the tower of the lesson, one a floor.
const FLOORS: usize = 5;
/// A frequency that differs by this factor is another one: standard errors are far below it.
const OTHER_FREQUENCY: f64 = 1.03;

pub(super) const MODES: Lesson = Lesson {
    id: "modes",
    title: "Modes of a structure",
    about: "Five floors and three sensors: what a mode is, how it is told from noise, and how it swings.",
    start: Start::Sample(Sample::Floors, View::Response),
    steps: &[
        step(
            "A chain of masses takes each of the three sensors for a mass of its own, and the tower has five floors. Press Identify its \
             modes, above.",
            "Five modes from three sensors: in a mode all floors swing together, at one frequency. A sensor shows the sum of all of them.",
            |c| modes(c).is_some_and(|m| m.frequencies.len() >= FLOORS && !m.by_hand),
        ),
        step(
            "The stabilization diagram shows the poles of models of growing order. A column of full marks is a mode, for noise moves \
             about. Click a dashed line to leave that mode, or set Number (left, MODES) to 4.",
            "The modes were fitted again from those that are left, and the error beside the noise floor (right) tells what one mode \
             was worth.",
            |c| modes(c).is_some_and(|m| m.by_hand && m.frequencies.len() < FLOORS),
        ),
        step(
            "Press Let the data choose (left, MODES), or set Number back to as the data bear.",
            "A mode is kept where data that were never fitted ask for it. More than five would follow the noise.",
            |c| modes(c).is_some_and(|m| !m.by_hand && m.frequencies.len() >= FLOORS) && before_by_hand(c),
        ),
        step(
            "Look at Responses, the second tab.",
            "Every mode is a peak, the sharper the less it is damped. Between two peaks the modes add up or cancel each other, and the \
             model follows both.",
            |c| modes(c).is_some() && c.now.modal_view == ModalView::Responses,
        ),
        step(
            "Look at Shapes, the third tab, and tick swing.",
            "In the slowest mode all floors go one way; in each faster one they part once more. Squares near one off the diagonal would \
             be two modes that these sensors hardly tell apart.",
            |c| modes(c).is_some() && c.now.modal_view == ModalView::Shapes,
        ),
    ],
    closing: "A mode is a frequency, a damping ratio and a shape. What stays as the order grows, and what unseen data ask for, is one.",
};

pub(super) const JOINT: Lesson = Lesson {
    id: "joint",
    title: "A joint that slips",
    about: "A beam whose tip is held by a joint: in small motion it sticks, in large motion it slips. The modes give it away.",
    start: Start::Sample(Sample::Joint, View::Response),
    steps: &[
        step(
            "The same beam was driven softly and two hundred times as hard. Press Identify its modes, above.",
            "One set of modes was fitted to both records, and the error is far above the noise floor: no linear structure does both.",
            |c| modes(c).is_some(),
        ),
        step(
            "Fit the soft record alone: set the use of the two others (left, DATA) to off.",
            "The first mode is faster, and the error is near the noise: a joint that sticks is a spring among others.",
            |c| first_mode_moved(c, |now, before| now > OTHER_FREQUENCY * before),
        ),
        step(
            "Now the other way: set the soft record to off, and that of 10 N to fit.",
            "The first mode is far slower and damped several times as much: a joint that slips is softer, and takes energy at every turn. A frequency that \
             falls with the level is its mark.",
            |c| first_mode_moved(c, |now, before| OTHER_FREQUENCY * now < before),
        ),
        step(
            "Go to What's missing and press Find what's missing. It may take a minute.",
            "Bouc–Wen hysteresis at the tip: a spring that slips, with a state of its own. Its x_b says at which displacement it yields, and the \
             modes beside it are those of the beam without the joint: the first is slower than in either record.",
            |c| c.now.modal_verdict.is_some_and(|v| v != "nothing_missing") && c.now.room == Room::Missing,
        ),
    ],
    closing: "Test a structure at several levels: frequencies that fall and damping that grows with the level tell of joints that slip.",
};

/// The modes that are shown, where they are of the settings as they stand.
fn modes<'a>(course: &Course<'a>) -> Option<&'a ModesFacts> {
    course.now.modes.as_ref()
}

fn before_by_hand(course: &Course<'_>) -> bool {
    course.before.modes.as_ref().is_some_and(|m| m.by_hand)
}

/// Compares the first mode's frequency now with that when the step began, Hz.
fn first_mode_moved(course: &Course<'_>, is: fn(f64, f64) -> bool) -> bool {
    let first = |modes: Option<&ModesFacts>| modes.and_then(|m| m.frequencies.first().copied());
    first(modes(course)).zip(first(course.before.modes.as_ref())).is_some_and(|(now, before)| is(now, before))
}
