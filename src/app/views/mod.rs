//! The centre of the window: what was measured and what the identified model does, seen in several ways.
//!
//! A view is a function of a [`Picture`] (what is shown) and a [`ViewState`] (how); it computes nothing of the study.

mod cache;
mod compare;
mod decay;
mod figure;
mod forces;
mod frequency;
mod front;
mod header;
mod input;
mod kept;
mod legend;
mod map;
mod painter;
mod panel;
mod path;
mod phase;
mod residual;
mod response;
mod scene;
mod spectrum;
#[cfg(test)]
mod tests;
mod velocity;

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::plot::export::{self, Sheet};
use super::plot::palette::{self, Ink};
use super::plot::vector;
use cache::Cache;
use scene::Scene;
use sindyscope_core::study::{Outcome, SettingsGrid};
use sindyscope_report::diagram::{Across, Source};
use sindyscope_report::document::{FigureKind, FigureSize};
use sindyscope_values::format::shown::ShownUnits;

/// One way of looking at an outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum View {
    /// Measured and identified displacement over time, with the error beneath.
    #[default]
    Response,
    /// Velocity over time, and acceleration.
    Velocity,
    /// Velocity over displacement.
    Phase,
    /// The inputs and their rates over time.
    Input,
    /// Amplitude spectra.
    Spectrum,
    /// Segment length over threshold, coloured by the error.
    Map,
    /// Coefficients along the threshold.
    Path,
    /// Error over the number of terms.
    Front,
    /// Pinned settings beside each other.
    Compare,
    /// The restoring force over deflection and velocity, and its slices.
    Restoring,
    /// Damping and friction over velocity.
    Friction,
    /// The frequency response.
    Transfer,
    /// A free decay's backbone and damping.
    Decay,
    /// What is left of the measurement.
    Residual,
}

/// Views that belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Group {
    /// Over time, and over each other.
    Motion,
    /// Forces, resonance, damping, and what is left.
    Physics,
    /// The landscape of settings.
    Settings,
}

impl Group {
    /// Every group, in the order of the tabs.
    pub(crate) const ALL: [Self; 3] = [Self::Motion, Self::Physics, Self::Settings];

    /// The group's text.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Motion => "Motion",
            Self::Physics => "Physics",
            Self::Settings => "Tuning",
        }
    }

    /// What its views show, in one sentence.
    pub(crate) fn tooltip(self) -> &'static str {
        match self {
            Self::Motion => "The motion, measured and identified",
            Self::Physics => "Forces, resonance and damping, and what the residual still tells",
            Self::Settings => "How the result depends on segment length, threshold and number of terms",
        }
    }

    /// Its views, in the order of their tabs.
    pub(crate) fn views(self) -> impl Iterator<Item = View> {
        View::ALL.into_iter().filter(move |v| v.group() == self)
    }
}

impl View {
    /// Every view, in the order of the tabs.
    pub(crate) const ALL: [Self; 14] = [
        Self::Response,
        Self::Velocity,
        Self::Phase,
        Self::Input,
        Self::Spectrum,
        Self::Map,
        Self::Path,
        Self::Front,
        Self::Compare,
        Self::Restoring,
        Self::Friction,
        Self::Transfer,
        Self::Decay,
        Self::Residual,
    ];

    /// The tab's text.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Response => "Response",
            Self::Velocity => "Velocity",
            Self::Phase => "Phase",
            Self::Input => "Input",
            Self::Spectrum => "Spectrum",
            Self::Map => "Map",
            Self::Path => "Path",
            Self::Front => "Pareto",
            Self::Compare => "Compare",
            Self::Restoring => "Restoring force",
            Self::Friction => "Friction",
            Self::Transfer => "FRF",
            Self::Decay => "Decay",
            Self::Residual => "Residual",
        }
    }

    /// What the view shows, in one sentence.
    pub(crate) fn tooltip(self) -> &'static str {
        match self {
            Self::Response => "Measured and identified displacement laid over each other, and the error E(t) beneath",
            Self::Velocity => "Velocity from the smoothed measurement and from the identified model",
            Self::Phase => "Velocity over displacement: loops, limit cycles and sticking show here",
            Self::Input => "The force or base motion that the model was driven by, and its rate",
            Self::Spectrum => "Amplitude spectra of measurement, model and error",
            Self::Map => "Every segment length and threshold at once, coloured by the error on what was not fitted",
            Self::Path => "Each term's coefficient along the threshold: what drops out where, and what it changes",
            Self::Front => "The error on what was not fitted over the number of terms: what each further term is worth",
            Self::Compare => {
                "Settings pinned as A, B, C, …: their responses, errors, terms and figures beside each other"
            }
            Self::Restoring => "Restoring force over deflection and velocity, with slices for stiffness and damping",
            Self::Friction => "What the velocity alone does: damping and friction, measured and identified",
            Self::Transfer => "Frequency response from the input to the displacement, with phase and coherence",
            Self::Decay => "Frequency and damping over amplitude while a free motion dies out",
            Self::Residual => "What the model leaves: its distribution, and what it still goes with",
        }
    }

    /// True if the view shows the map of settings, in one way or another.
    pub(crate) fn needs_map(self) -> bool {
        matches!(self, Self::Map | Self::Front)
    }

    /// The views that it stands with.
    pub(crate) fn group(self) -> Group {
        match self {
            Self::Response | Self::Velocity | Self::Phase | Self::Input | Self::Spectrum => Group::Motion,
            Self::Restoring | Self::Friction | Self::Transfer | Self::Decay | Self::Residual => Group::Physics,
            Self::Map | Self::Path | Self::Front | Self::Compare => Group::Settings,
        }
    }

    /// True if the view shows all records together unless one alone is asked for.
    fn pools(self) -> bool {
        matches!(self, Self::Restoring | Self::Friction | Self::Transfer)
    }

    /// True if the view shows one record, not the settings.
    fn of_a_record(self) -> bool {
        !matches!(self, Self::Map | Self::Path | Self::Front)
    }
}

/// What a view shows.
#[derive(Clone, Copy)]
pub(crate) struct Picture<'a> {
    /// The outcome.
    pub(crate) outcome: &'a Arc<Outcome>,
    /// The outcome before the last change of settings, drawn as a faint ghost.
    pub(crate) previous: Option<&'a Arc<Outcome>>,
    /// Which of the outcome's records.
    pub(crate) record: usize,
    /// True while a newer outcome is being computed: what is shown is dimmed, not removed.
    pub(crate) stale: bool,
    /// The map of settings.
    pub(crate) search: Search<'a>,
    /// Outcomes kept to be compared, as A, B, C, …
    pub(crate) pins: &'a [Arc<Outcome>],
}

/// How far the search through the settings has come.
#[derive(Clone, Copy, Default)]
pub(crate) struct Search<'a> {
    /// The map, as far as it is known.
    pub(crate) map: Option<&'a Arc<SettingsGrid>>,
    /// True if it is that of older settings.
    pub(crate) stale: bool,
    /// Why there is none.
    pub(crate) failure: Option<&'a str>,
}

/// How views show it. What is serialized survives a restart; the rest is remembered from frame to frame.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ViewState {
    /// Curves switched off in the legends.
    pub(crate) hidden: BTreeSet<Ink>,
    /// The degree of freedom (or state) shown, from zero; the last one there is if there are fewer.
    pub(crate) freedom: usize,
    /// The units that axes and coefficients are shown in, where a person chose.
    pub(crate) units: ShownUnits,
    /// The input shown, likewise.
    pub(crate) input: usize,
    /// Whether the error is shown on a logarithmic axis.
    pub(crate) log_error: bool,
    /// Whether frequencies are shown on a logarithmic axis.
    pub(crate) log_frequency: bool,
    /// Whether the velocity's view shows the acceleration beneath.
    pub(crate) acceleration: bool,
    /// What the map is coloured by.
    pub(crate) quantity: map::Quantity,
    /// Whether views of all records together show the chosen one alone.
    pub(crate) alone: bool,
    /// What deflections are measured against; none: what suits the equation.
    pub(crate) across: Option<Across>,
    /// Whether the restoring force is shown without its straight part.
    pub(crate) curved: bool,
    /// Segments averaged in a frequency response; zero: the usual number.
    pub(crate) averages: usize,
    /// Whether the frequency response bears noise on the input (H2) instead of the response (H1).
    pub(crate) noisy_input: bool,
    /// Which residual is judged.
    pub(crate) residual_of: Source,
    /// Which of the residual's correlations is shown.
    pub(crate) partner: usize,
    /// Whether coefficients are shown in their units, not as shares of the rate.
    pub(crate) raw_path: bool,
    /// Whether they are shown with their signs, on a linear axis.
    pub(crate) signed_path: bool,
    #[serde(skip)]
    recent: HashMap<Group, View>,
    #[serde(skip)]
    cache: Cache,
    #[serde(skip)]
    printing: bool,
}

impl ViewState {
    /// Notes which view is shown, to come back to it.
    pub(crate) fn remember(&mut self, view: View) {
        self.recent.insert(view.group(), view);
    }

    /// The view of a group that was shown last; its first if none was.
    pub(crate) fn recent(&self, group: Group) -> View {
        self.recent.get(&group).copied().or_else(|| group.views().next()).unwrap_or_default()
    }

    /// True while a view's figure is being computed.
    pub(crate) fn busy(&self) -> bool {
        self.cache.figures.busy()
    }

    /// Shows all of the data again, in every view, from the next frame on.
    pub(crate) fn fit(&mut self) {
        self.cache.fit_all();
    }
}

/// What a person asked for in a view and the window has to do.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Request {
    /// Show another of the outcome's records.
    ShowRecord(usize),
    /// Save a picture of this view: ask for a file, then [`render`] and [`export::save_png`].
    SavePicture,
    /// Save this text, the numbers of a plot as CSV: ask for a file.
    SaveTable(String),
    /// Take this threshold over, and this segment length if there is one.
    Set {
        /// Samples.
        window: Option<usize>,
        /// As the settings compare it.
        threshold: f64,
    },
    /// Keep the outcome shown, to be compared.
    Pin,
    /// Let go of a pinned outcome.
    Unpin(usize),
    /// Take a pinned outcome's settings over.
    Return(usize),
}

/// Draws a view into all the room there is.
pub(crate) fn show(ui: &mut egui::Ui, view: View, picture: &Picture<'_>, state: &mut ViewState) -> Option<Request> {
    let Some(scene) = Scene::new(ui, picture, state) else {
        legend::note(ui, "No record is marked fit or held out, so there is nothing to show");
        return None;
    };
    ui.scope(|ui| {
        ui.visuals_mut().extreme_bg_color = palette::ground(scene.dark);
        ui.spacing_mut().item_spacing.y = 2.0;
        let asked = header::show(ui, view, &scene, picture, state);
        let also = match view {
            View::Response => response::show(ui, &scene, state),
            View::Velocity => velocity::show(ui, &scene, state),
            View::Phase => phase::show(ui, &scene, state),
            View::Input => input::show(ui, &scene, state),
            View::Spectrum => spectrum::show(ui, &scene, state),
            View::Map => map::show(ui, &scene, picture, state),
            View::Path => path::show(ui, &scene, state),
            View::Front => front::show(ui, &scene, picture, state),
            View::Compare => compare::show(ui, &scene, picture, state),
            View::Restoring => forces::restoring(ui, &scene, state),
            View::Friction => forces::friction(ui, &scene, state),
            View::Transfer => frequency::show(ui, &scene, state),
            View::Decay => decay::show(ui, &scene, state),
            View::Residual => residual::show(ui, &scene, state),
        };
        asked.or(also)
    })
    .inner
}

/// What is drawn into all the room there is, as an SVG document for print; `like` is the window's context.
pub(crate) fn on_paper(like: &egui::Context, size: FigureSize, draw: impl FnMut(&mut egui::Ui)) -> String {
    /// Points to the millimetre.
    const POINTS_A_MM: f64 = 72.0 / 25.4;
    let size = size.sound();
    let scale = LETTERS / size.font * POINTS_A_MM;
    let sheet =
        Sheet { size: egui::vec2((size.width * scale) as f32, (size.height * scale) as f32), ..Sheet::default() };
    let (ground, shapes) = export::shapes(&sheet, Some(like), draw);
    vector::svg(&shapes, sheet.size, ground, size.width)
}

/// A view as an SVG document for print: as zoomed in the window (`like`, the window's context), without its buttons.
pub(crate) fn vector(
    like: &egui::Context,
    view: View,
    picture: &Picture<'_>,
    state: &ViewState,
    size: FigureSize,
) -> String {
    let picture = Picture { stale: false, previous: None, ..*picture };
    let mut state = ViewState { printing: true, ..state.clone() };
    on_paper(like, size, |ui| {
        show(ui, view, &picture, &mut state);
    })
}

/// Size of the axes' labels on the screen, points.
const LETTERS: f64 = 13.0;

impl View {
    /// The report's own figure of what the view shows, if it has one.
    pub(crate) fn figure(self, state: &ViewState) -> Option<FigureKind> {
        let kind = match self {
            Self::Response => FigureKind::Response,
            Self::Phase => FigureKind::Phase,
            Self::Spectrum => FigureKind::Spectrum,
            Self::Restoring => FigureKind::Restoring,
            Self::Friction => FigureKind::Friction,
            Self::Residual => FigureKind::Residual,
            _ => return None,
        };
        // The report draws the first degree of freedom of several, but of the response every one.
        (state.freedom == 0 || kind == FigureKind::Response).then_some(kind)
    }
}
