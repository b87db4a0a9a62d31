//! The records that come with the program.

use super::state::Sample;
use sindyscope_core::study::Settings;
use sindyscope_files::{ReadError, ReadOptions, read_text};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::list;

/// A file of `sample_data/`, by its name.
type Bundled = (&'static str, &'static [u8]);

/// What of a sample is held out.
enum HeldOut {
    /// Another file.
    File(Bundled),
    /// The record from this time on, s.
    From(f64),
}

/// The library and threshold of the lesson in `sample_data/README.md`.
const OVERFIT_LIBRARY: &str = "x, v, u, x^2, x^3, x^5, x^7, 1";
const OVERFIT_THRESHOLD: f64 = 0.01;

macro_rules! bundled {
    ($name:literal) => {
        ($name, include_bytes!(concat!("../../sample_data/", $name)).as_slice())
    };
}

impl Sample {
    /// Every sample, the one shown first in front.
    pub(crate) const ALL: [Self; 8] = [
        Self::Duffing,
        Self::Friction,
        Self::Lorenz,
        Self::Overfit,
        Self::VanDerPol,
        Self::DoubleWell,
        Self::Pendulum,
        Self::Belt,
    ];

    /// What it is, in two or three words.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Duffing => "Duffing oscillator",
            Self::Friction => "Dry friction",
            Self::Lorenz => "Lorenz system",
            Self::Overfit => "An overfit",
            Self::VanDerPol => "Van der Pol",
            Self::DoubleWell => "Double well",
            Self::Pendulum => "Driven pendulum",
            Self::Belt => "Mass on a belt",
        }
    }

    /// What it is, in one sentence.
    pub(crate) fn tooltip(self) -> &'static str {
        match self {
            Self::Duffing => {
                "A mass on a hardening spring under a harmonic force, measured with noise; the last part is held out"
            }
            Self::Friction => {
                "A mass with dry friction on a shaken base, at four frequencies, and at a fifth that is held out"
            }
            Self::Lorenz => "Three states of a chaotic system, every one measured: equations of first order",
            Self::VanDerPol => {
                "Self-excitation: damping that is negative about the middle lets the motion grow to a limit cycle; no input"
            }
            Self::DoubleWell => "Chaos: a beam between two magnets under a harmonic force jumps from one to the other",
            Self::Pendulum => {
                "A pendulum that turns over under a harmonic torque: chaotic, its force a sine of the angle"
            }
            Self::Belt => {
                "Stick and slip: a moving belt drags a mass on a spring along by friction that falls with the speed"
            }
            Self::Overfit => {
                "A lesson: with powers in the library that the motion is too small for, the fit is good and fails at four times the force"
            }
        }
    }

    /// The file to fit, and what is held out.
    fn files(self) -> (Bundled, HeldOut) {
        match self {
            Self::Duffing => (bundled!("duffing_noisy.csv"), HeldOut::From(50.0)),
            Self::Friction => (bundled!("friction_noisy.csv"), HeldOut::File(bundled!("friction_noisy_test.csv"))),
            Self::Lorenz => (bundled!("lorenz.csv"), HeldOut::From(7.0)),
            Self::Overfit => (bundled!("overfit.csv"), HeldOut::File(bundled!("overfit_test.csv"))),
            Self::VanDerPol => (bundled!("van_der_pol.csv"), HeldOut::From(100.0)),
            Self::DoubleWell => (bundled!("double_well.csv"), HeldOut::From(100.0)),
            Self::Pendulum => (bundled!("pendulum.csv"), HeldOut::From(100.0)),
            Self::Belt => (bundled!("belt.csv"), HeldOut::From(70.0)),
        }
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

    /// Its records, what each is for, and the name for them all.
    ///
    /// # Errors
    /// It cannot be read in this way.
    pub(crate) fn records(self, reading: &ReadOptions) -> Result<(String, RecordSet), ReadError> {
        let (fitted, held_out) = self.files();
        let mut set = RecordSet::default();
        let read = |(name, bytes): Bundled| read_text(name, bytes, reading);
        let records = read(fitted)?;
        match held_out {
            HeldOut::File(file) => {
                set.add(records, Usage::Fit);
                set.add(read(file)?, Usage::HeldOut);
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
        Ok((fitted.0.to_owned(), set))
    }
}
