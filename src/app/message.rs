//! What a person does, as a value: each act that changes the state, and nothing that only changes how the window is drawn.
//!
//! Messages can be kept in a log and replayed.

use std::path::PathBuf;

use egui::ThemePreference;
use serde::{Deserialize, Serialize};

use super::columns::ColumnsAct;
use super::commands::WindowCommand;
use super::figure_panel::FigureLook;
use super::lessons;
use super::missing;
use super::rig;
use super::series::SeriesAct;
use super::state::{Edit, ModalShown, RigState, Source, ViewState, WalkView};
use super::stream::StreamAct;
use sindyscope_core::prepare::Preparation;
use sindyscope_report::component::ComponentView;
use sindyscope_values::record::Role;
use sindyscope_values::term::Kind;

/// One act.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Message {
    /// A command that changes what is open or in view; the others are the window's own.
    Do(WindowCommand),
    /// Open a source of which nothing is known.
    OpenSource(Source),
    /// Open files: measurements, or a project.
    Open(Vec<PathBuf>),
    /// Add the records of files to those that are open.
    Add(Vec<PathBuf>),
    /// Open what was refused, with the file that was missing here.
    Locate(PathBuf),
    /// Do something in the window of columns.
    Columns(ColumnsAct),
    /// Read the records as data of this kind.
    Kind(Kind),
    /// Prepare the records by these steps.
    Prepare(Vec<Preparation>),
    /// Settings, usages, the base of the walk or the report are these now.
    Edit(Box<Edit>),
    /// What was changed has come to rest: it is a step that undo takes back.
    Step,
    /// Show another record.
    ShowRecord(usize),
    /// Show the whole record above the plots, to be cut by dragging, or hide it.
    Cut,
    /// Find what a step takes out of a channel, with the equation.
    Calibrate { step: usize, sought: Sought, role: Role },
    /// Stop reading records.
    StopOpening,
    /// Stop choosing settings and finding what a step takes out.
    StopChoosing,
    /// Take a setting over that was clicked in a view.
    Set {
        /// Samples of the segment, if that was clicked, too.
        window: Option<usize>,
        threshold: f64,
    },
    /// Keep the outcome that is shown, to be compared.
    Pin,
    /// Let go of a pinned outcome.
    Unpin(usize),
    /// Take a pinned outcome's settings over.
    Return(usize),
    /// Show what was found like this.
    Views(Box<ViewState>),
    /// Show a structure's modes like this.
    Modal(Box<ModalShown>),
    /// Show a component's force like this.
    Component(ComponentView),
    /// Look for what a component's force lacks, or stop looking.
    ComponentSearch(bool),
    /// Look for the force that a structure's modes lack, or stop looking.
    ModalSearch(bool),
    /// Do something in "What's missing".
    Walk(missing::WalkAct),
    /// Show something else in "What's missing".
    WalkView(Box<WalkView>),
    /// The rig's settings and the class mode are these now.
    Rig(Box<RigState>),
    /// What was changed of the rig has come to rest.
    RigStep,
    /// Do something in the rig's room.
    RigAct(rig::RigAct),
    /// Turn the page of the open lesson.
    Lesson(lessons::LessonAct),
    /// Draw the pages of the report so many pixels wide.
    PageWidth(u32),
    /// Draw in these colours.
    Theme(ThemePreference),
    /// Draw so many times as large.
    Zoom(f32),
    /// Save figures like this.
    Figure(FigureLook),
    /// Do something with the stream.
    Stream(StreamAct),
    /// Do something with the series.
    Series(SeriesAct),
    /// The project was saved here.
    ProjectSaved(PathBuf),
}

/// What is sought of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Sought {
    /// By how much it is late.
    Delay,
    /// How many times too small it shows what there is.
    Gain,
}

impl Message {
    /// True if this message says the last word on what `before` said: of a slider that is dragged, the last place counts.
    pub(crate) fn replaces(&self, before: &Self) -> bool {
        matches!(
            (self, before),
            (Self::Edit(_), Self::Edit(_))
                | (Self::Views(_), Self::Views(_))
                | (Self::Modal(_), Self::Modal(_))
                | (Self::WalkView(_), Self::WalkView(_))
                | (Self::Rig(_), Self::Rig(_))
                | (Self::Figure(_), Self::Figure(_))
                | (Self::Columns(ColumnsAct::Choose(_)), Self::Columns(ColumnsAct::Choose(_)))
                | (Self::PageWidth(_), Self::PageWidth(_))
                | (Self::Zoom(_), Self::Zoom(_))
                | (Self::Stream(StreamAct::Form(_)), Self::Stream(StreamAct::Form(_)))
                | (Self::Series(SeriesAct::Form(_)), Self::Series(SeriesAct::Form(_)))
        )
    }
}
