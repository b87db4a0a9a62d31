//! The records that come with the program: files, and the classics that the virtual rig makes when they are opened.

use super::problem::OpeningProblem;
use super::state::Sample;
use sindyscope_core::study::Settings;
use sindyscope_files::{ReadOptions, read_text};
use sindyscope_rig::{ScenarioOptions, generate};
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::list;

/// A sample in words, and its records.
struct About {
    /// What it is, in two or three words.
    label: &'static str,
    /// What it is, in one sentence.
    tooltip: &'static str,
    fitted: Origin,
    held_out: HeldOut,
}

/// Where records come from.
#[derive(Clone, Copy)]
enum Origin {
    /// A file of `sample_data/`: its name and what it holds.
    File(&'static str, &'static [u8]),
    /// A scenario of the virtual rig, made when it is opened, and what of it is otherwise, as [`ScenarioOptions::typed`] reads it.
    Scenario(&'static str, &'static [(&'static str, &'static str)]),
}

/// What of a sample is held out.
enum HeldOut {
    /// Other records; of several the first.
    Other(Origin),
    /// The record from this time on, s.
    From(f64),
}

/// The library and threshold of the lesson in `sample_data/README.md`.
const OVERFIT_LIBRARY: &str = "x, v, u, x^2, x^3, x^5, x^7, 1";
const OVERFIT_THRESHOLD: f64 = 0.01;

macro_rules! bundled {
    ($name:literal) => {
        Origin::File($name, include_bytes!(concat!("../../sample_data/", $name)).as_slice())
    };
}

/// The samples, each with its words and its records.
macro_rules! samples {
    ($($sample:ident: $label:literal, $tooltip:literal, $fitted:expr, $held_out:expr;)*) => {
        fn about(sample: Sample) -> About {
            match sample {
                $(Sample::$sample => About { label: $label, tooltip: $tooltip, fitted: $fitted, held_out: $held_out },)*
            }
        }
    };
}

samples! {
    Duffing: "Duffing oscillator",
        "A mass on a hardening spring under a harmonic force, measured with noise; the last part is held out",
        bundled!("duffing_noisy.csv"), HeldOut::From(50.0);
    Friction: "Dry friction",
        "A mass with dry friction on a shaken base, at four frequencies, and at a fifth that is held out",
        bundled!("friction_noisy.csv"), HeldOut::Other(bundled!("friction_noisy_test.csv"));
    Lorenz: "Lorenz system",
        "Three states of a chaotic system, every one measured: equations of first order",
        bundled!("lorenz.csv"), HeldOut::From(7.0);
    Overfit: "An overfit",
        "A lesson: with powers in the library that the motion is too small for, the fit is good and fails at four times the force",
        bundled!("overfit.csv"), HeldOut::Other(bundled!("overfit_test.csv"));
    VanDerPol: "Van der Pol",
        "Self-excitation: damping that is negative about the middle lets the motion grow to a limit cycle; no input",
        bundled!("van_der_pol.csv"), HeldOut::From(100.0);
    DoubleWell: "Double well",
        "Chaos: a beam between two magnets under a harmonic force jumps from one to the other",
        bundled!("double_well.csv"), HeldOut::From(100.0);
    Pendulum: "Driven pendulum",
        "A pendulum that turns over under a harmonic torque: chaotic, its force a sine of the angle",
        bundled!("pendulum.csv"), HeldOut::From(100.0);
    Belt: "Mass on a belt",
        "Stick and slip: a moving belt drags a mass on a spring along by friction that falls with the speed",
        bundled!("belt.csv"), HeldOut::From(70.0);
    Ueda: "Ueda's oscillator",
        "Chaos: a cubic spring alone, without a linear one, under a strong harmonic force",
        Origin::Scenario("ueda", &[("seed", "1"), ("noise", "0.5%")]), HeldOut::From(100.0);
    VanDerPolForced: "Van der Pol, forced",
        "Self-excitation under a harmonic force near its own frequency",
        Origin::Scenario("van-der-pol-forced", &[("seed", "1"), ("noise", "0.5%"), ("duration", "150")]), HeldOut::From(100.0);
    Rayleigh: "Rayleigh's oscillator",
        "Self-excitation: damping that is negative at low speed, under a harmonic force",
        Origin::Scenario("rayleigh", &[("seed", "1"), ("noise", "0.5%"), ("duration", "150")]), HeldOut::From(100.0);
    Mathieu: "Mathieu's oscillator",
        "Parametric resonance: a spring that pulsates at twice the natural frequency lets the motion grow; no input",
        Origin::Scenario("mathieu", &[("seed", "1"), ("noise", "0.5%")]), HeldOut::From(100.0);
    ParametricPendulum: "Parametric pendulum",
        "Parametric resonance: the pivot moves up and down at twice the natural frequency; no input",
        Origin::Scenario("parametric-pendulum", &[("seed", "1"), ("noise", "0.5%")]), HeldOut::From(70.0);
    UprightPendulum: "Upright pendulum",
        "A pendulum on its head that a spring holds, under a torque of many frequencies: the sine pushes away, the spring back",
        Origin::Scenario("upright-pendulum", &[("seed", "1"), ("noise", "0.5%")]),
        HeldOut::Other(Origin::Scenario("upright-pendulum", &[("seed", "101"), ("noise", "0.5%"), ("amplitude", "0.85")]));
    CoupledPendula: "Coupled pendula",
        "Two pendula with a spring between them, a torque of many frequencies on the first: a sine of each angle",
        Origin::Scenario("coupled-pendula", &[("seed", "1"), ("noise", "0.5%")]), HeldOut::From(100.0);
    HardStop: "A stiff stop",
        "A mass that hits a stiff stop on one side, under a force of many frequencies",
        Origin::Scenario("hard-stop", &[("seed", "1"), ("noise", "0.5%")]), HeldOut::From(30.0);
    Freeplay: "Freeplay",
        "A mass with a gap before the springs on either side, under a force of many frequencies",
        Origin::Scenario("freeplay", &[("seed", "1"), ("noise", "0.5%")]), HeldOut::From(30.0);
    Truss: "Snap-through truss",
        "Two oblique springs that snap through, under a force of many frequencies",
        Origin::Scenario("truss", &[("seed", "1"), ("noise", "0.5%")]), HeldOut::From(60.0);
    UnevenDamper: "Uneven damper",
        "A damper that resists extension more than compression, as a shock absorber's, under a force of many frequencies",
        Origin::Scenario("uneven-damper", &[("seed", "1"), ("noise", "0.5%")]), HeldOut::From(30.0);
    Electrostatic: "Electrostatic actuator",
        "A plate on a spring that a voltage attracts across a gap: the input is the voltage",
        Origin::Scenario("electrostatic", &[("seed", "1"), ("noise", "0.5%")]), HeldOut::From(30.0);
    EnergySink: "Nonlinear energy sink",
        "Two masses: a small one on a purely cubic spring takes the energy of the large one",
        Origin::Scenario("energy-sink", &[("seed", "1"), ("noise", "0.5%")]), HeldOut::From(30.0);
    BoucWen: "Bouc–Wen hysteresis",
        "Hysteresis: the benchmark of 2016, a force of many frequencies with 8 µm of noise; a sweep without noise is held out",
        Origin::Scenario("bouc-wen", &[("seed", "1")]), HeldOut::Other(Origin::Scenario("bouc-wen-sweep", &[]));
    Absorber: "Hidden absorber",
        "A mass with a tuned absorber on it that no sensor sees, under a force of many frequencies",
        Origin::Scenario("absorber", &[("seed", "1"), ("noise", "0.5%")]), HeldOut::From(30.0);
    Floors: "Tower with five floors",
        "Modes: five floors, the displacements of three of them, under a force of many frequencies",
        Origin::Scenario("chain", &[("seed", "1"), ("measure", "x1,x3,x5"), ("duration", "40")]), HeldOut::From(30.0);
    Joint: "Joint that slips",
        "Modes that depend on the level: a beam whose tip is held by a joint that slips, driven softly and hard",
        Origin::Scenario("joint", &[("seed", "1"), ("measure", "x"), ("levels", "0.05,10")]),
        HeldOut::Other(Origin::Scenario("joint", &[("seed", "2"), ("measure", "x"), ("levels", "5")]));
}

impl Sample {
    /// The program's own, the one shown first in front.
    pub(crate) const OWN: [Self; 4] = [Self::Duffing, Self::Friction, Self::Lorenz, Self::Overfit];

    /// The oscillators that courses begin with; the first four stand beside the program's own where there is room.
    pub(crate) const CLASSICS: [Self; 21] = [
        Self::VanDerPol,
        Self::DoubleWell,
        Self::Pendulum,
        Self::Belt,
        Self::Ueda,
        Self::VanDerPolForced,
        Self::Rayleigh,
        Self::Mathieu,
        Self::ParametricPendulum,
        Self::UprightPendulum,
        Self::CoupledPendula,
        Self::HardStop,
        Self::Freeplay,
        Self::Truss,
        Self::UnevenDamper,
        Self::Electrostatic,
        Self::EnergySink,
        Self::BoucWen,
        Self::Absorber,
        Self::Floors,
        Self::Joint,
    ];

    /// Every sample.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        Self::OWN.into_iter().chain(Self::CLASSICS)
    }

    /// What it is, in two or three words.
    pub(crate) fn label(self) -> &'static str {
        about(self).label
    }

    /// What it is, in one sentence.
    pub(crate) fn tooltip(self) -> &'static str {
        about(self).tooltip
    }

    /// The settings that it opens with, where they are other than what the program suggests.
    pub(crate) fn settings(self, suggestion: &Settings) -> Settings {
        let mut settings = suggestion.clone();
        if self == Self::Overfit
            && let Ok(terms) = list(OVERFIT_LIBRARY)
        {
            (settings.terms, settings.threshold) = (terms, OVERFIT_THRESHOLD);
        }
        settings
    }

    /// Its records, what each is for, and the name for them all. A scenario takes up to a second: not for the window's own thread.
    ///
    /// # Errors
    /// It cannot be read in this way.
    pub(crate) fn records(self, reading: &ReadOptions) -> Result<(String, RecordSet), OpeningProblem> {
        let About { fitted, held_out, .. } = about(self);
        let mut set = RecordSet::default();
        let records = fitted.records(reading)?;
        match held_out {
            HeldOut::Other(other) => {
                set.add(records, Usage::Fit);
                // Of a sweep up and down, up is enough.
                let kept = if matches!(other, Origin::Scenario(..)) { 1 } else { usize::MAX };
                set.add(other.records(reading)?.into_iter().take(kept), Usage::HeldOut);
            }
            HeldOut::From(time) => {
                for record in records {
                    let (mut first, mut last) = record.split_at(time);
                    first.name = format!("up to {time} s");
                    last.name = format!("from {time} s");
                    set.add([first], Usage::Fit);
                    set.add([last], Usage::HeldOut);
                }
            }
        }
        Ok((fitted.name().to_owned(), set))
    }
}

impl Origin {
    fn name(&self) -> &'static str {
        match self {
            Self::File(name, _) | Self::Scenario(name, _) => name,
        }
    }

    fn records(self, reading: &ReadOptions) -> Result<Vec<Record>, OpeningProblem> {
        match self {
            Self::File(name, bytes) => read_text(name, bytes, reading).map_err(|e| OpeningProblem::reading(&e)),
            Self::Scenario(name, options) => {
                let made = ScenarioOptions::typed(options.iter().copied()).and_then(|options| generate(name, &options));
                made.map(|run| run.records).map_err(|e| {
                    OpeningProblem::new(format!("the virtual rig made no records: {e}"), "open another sample")
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_sample_has_its_own_name() {
        let names: BTreeSet<&str> = Sample::all().map(Sample::label).collect();
        assert_eq!(names.len(), Sample::all().count());
    }
}
