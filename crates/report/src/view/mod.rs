//! The views of a study: each a pure function from what was found to a [`Figure`].
//!
//! The window shows them, reports hold them, and they are saved as pictures: it is the same figure everywhere. A view is one file of
//! this folder and one line of the list below. The book's page "Add a view" does it step by step.

mod compare;
mod decay;
mod forces;
mod front;
mod input;
mod map;
mod path;
mod phase;
mod residual;
mod response;
mod scene;
mod spectrum;
mod transfer;
mod velocity;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::diagram::{ElementEnds, ResidualSource};
use crate::figure::Figure;
use sindyscope_core::study::{Outcome, SettingsGrid};

pub use compare::{MOST_PINS, pin_letter};
pub use forces::{across, deflection_name};
pub use front::dot as front_point;
pub use map::{MapQuantity, PARSIMONIOUS_SIGN, remark as setting_remark};
pub use scene::Scene;
pub(crate) use scene::time_range;
pub(crate) use spectrum::value_range;
pub use transfer::{AVERAGES, USUAL_AVERAGES};
pub(crate) use transfer::{quotient, runs};

/// What a view shows, and how.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// What was found.
    pub outcome: &'a Outcome,
    /// What had been found before the last change, drawn as a faint ghost.
    pub previous: Option<&'a Outcome>,
    /// Which of the outcome's records.
    pub record: usize,
    /// The map of settings, as far as it is known.
    pub landscape: Option<&'a SettingsGrid>,
    /// Outcomes kept to be compared, as A, B, C, …
    pub pins: &'a [Arc<Outcome>],
    /// What a person chose.
    pub options: &'a ViewOptions,
}

impl<'a> Subject<'a> {
    /// A record of an outcome, nothing beside it.
    pub fn new(outcome: &'a Outcome, record: usize, options: &'a ViewOptions) -> Self {
        Self { outcome, previous: None, record, landscape: None, pins: &[], options }
    }
}

/// How views are shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ViewOptions {
    /// The degree of freedom (or state) shown, from zero; the last one there is if there are fewer.
    pub freedom: usize,
    /// The input shown, likewise.
    pub input: usize,
    /// Whether the error is shown on a logarithmic axis.
    pub log_error: bool,
    /// Whether frequencies are shown on a logarithmic axis.
    pub log_frequency: bool,
    /// Whether the velocity's view shows the acceleration beneath.
    pub acceleration: bool,
    /// What the map is coloured by.
    pub quantity: MapQuantity,
    /// Whether views of all records together show the chosen one alone.
    pub alone: bool,
    /// What deflections are measured against; none: what suits the equation.
    pub across: Option<ElementEnds>,
    /// Whether the restoring force is shown without its straight part.
    pub curved: bool,
    /// Segments averaged in a frequency response; zero: the usual number.
    pub averages: usize,
    /// Whether the frequency response bears noise on the input (H2) instead of the response (H1).
    pub noisy_input: bool,
    /// Which residual is judged.
    pub residual_of: ResidualSource,
    /// Whether coefficients are shown in their units, not as shares of the rate.
    pub raw_path: bool,
    /// Whether they are shown with their signs, on a linear axis.
    pub signed_path: bool,
}

/// A figure, or why there is none.
pub type FigureResult = Result<Figure, String>;

/// What makes a view.
pub struct ViewEntry {
    /// The tab's text.
    pub label: &'static str,
    /// What the view shows, in one sentence.
    pub tooltip: &'static str,
    /// How it is to be read, in a sentence above it; empty: it speaks for itself.
    pub reading: &'static str,
    /// The views that it stands with.
    pub group: Group,
    /// What is shown of several records.
    pub records: RecordUse,
    /// Whether it takes longer than a frame: it is then made beside the window.
    pub slow: bool,
    /// Draws it.
    pub figure: fn(&Subject<'_>) -> FigureResult,
}

/// What a view shows of several records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordUse {
    /// One.
    One,
    /// All together, unless one alone is asked for.
    Pooled,
    /// None: it shows settings.
    None,
}

/// Views that belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Group {
    /// Over time, and over each other.
    Motion,
    /// Forces, resonance, damping, and what is left.
    Physics,
    /// The landscape of settings.
    Settings,
}

/// Declares [`View`] from the list of views.
macro_rules! views {
    ($($(#[$meta:meta])* $name:ident => $entry:path,)*) => {
        /// One way of looking at an outcome.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum View {
            $($(#[$meta])* $name,)*
        }

        impl View {
            /// Every view, in the order of the tabs.
            pub const ALL: [Self; [$(stringify!($name)),*].len()] = [$(Self::$name,)*];

            /// What makes it.
            pub fn entry(self) -> &'static ViewEntry {
                match self {
                    $(Self::$name => &$entry,)*
                }
            }
        }
    };
}

views! {
    /// Measured and identified displacement over time, with the error beneath.
    #[default]
    Response => response::VIEW,
    /// Velocity over time, and acceleration.
    Velocity => velocity::VIEW,
    /// Velocity over displacement.
    Phase => phase::VIEW,
    /// The inputs and their rates over time.
    Input => input::VIEW,
    /// Amplitude spectra.
    Spectrum => spectrum::VIEW,
    /// Segment length over threshold, coloured by the error.
    Map => map::VIEW,
    /// Coefficients along the threshold.
    Path => path::VIEW,
    /// Error over the number of terms.
    Front => front::VIEW,
    /// Pinned settings beside each other.
    Compare => compare::VIEW,
    /// The restoring force over deflection and velocity, and its slices.
    Restoring => forces::RESTORING,
    /// Damping and friction over velocity.
    Friction => forces::FRICTION,
    /// The frequency response.
    Transfer => transfer::VIEW,
    /// A free decay's backbone and damping.
    Decay => decay::VIEW,
    /// What is left of the measurement.
    Residual => residual::VIEW,
}

impl View {
    /// The tab's text.
    pub fn label(self) -> &'static str {
        self.entry().label
    }

    /// What the view shows, in one sentence.
    pub fn tooltip(self) -> &'static str {
        self.entry().tooltip
    }

    /// The views that it stands with.
    pub fn group(self) -> Group {
        self.entry().group
    }

    /// True if the view shows the map of settings, in one way or another.
    pub fn needs_map(self) -> bool {
        matches!(self, Self::Map | Self::Front)
    }

    /// The figure, or why there is none.
    ///
    /// # Errors
    /// A sentence that says what the view lacks.
    pub fn figure(self, subject: &Subject<'_>) -> FigureResult {
        (self.entry().figure)(subject)
    }
}

impl Group {
    /// Every group, in the order of the tabs.
    pub const ALL: [Self; 3] = [Self::Motion, Self::Physics, Self::Settings];

    /// The group's text.
    pub fn label(self) -> &'static str {
        match self {
            Self::Motion => "Motion",
            Self::Physics => "Physics",
            Self::Settings => "Tuning",
        }
    }

    /// What its views show, in one sentence.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Motion => "The motion, measured and identified",
            Self::Physics => "Forces, resonance and damping, and what the residual still tells",
            Self::Settings => "How the result depends on segment length, threshold and number of terms",
        }
    }

    /// Its views, in the order of their tabs.
    pub fn views(self) -> impl Iterator<Item = View> {
        View::ALL.into_iter().filter(move |v| v.group() == self)
    }
}
