//! The window. What a person does becomes a [`message`]; [`update`] makes of it the next state ([`state`]: what was decided) and
//! asks for background work ([`jobs`], on one [`queue`]); what that finds ([`derived`]) is drawn beside the state, one file a
//! panel, one file a view. The window holds no numerics.

mod answer;
mod columns;
mod command_palette;
mod commands;
mod component;
mod cutter;
mod derived;
#[cfg(not(target_arch = "wasm32"))]
mod desktop;
mod dialogs;
mod disk;
mod figure_panel;
mod help;
mod history;
mod jobs;
mod lessons;
mod log;
mod message;
pub(crate) mod missing;
mod modal;
mod moved;
mod notices;
mod open;
mod overlay;
#[cfg(target_arch = "wasm32")]
mod page;
mod panel;
pub mod plot;
mod problem;
mod program;
mod project;
mod purpose;
mod questions;
mod queue;
mod records;
mod remedy;
mod replay;
mod report;
mod rig;
mod samples;
mod saving;
mod series;
mod session;
mod settings_map;
mod state;
mod status;
mod stream;
mod theme;
mod toolbar;
mod update;
pub(crate) mod views;
mod welcome;
mod widgets;
mod window;

// What is around the window: a desktop or a page.
#[cfg(not(target_arch = "wasm32"))]
use desktop as around;
#[cfg(not(target_arch = "wasm32"))]
pub use desktop::{AppError, run};
#[cfg(target_arch = "wasm32")]
use page as around;
#[cfg(target_arch = "wasm32")]
pub use page::{described, run_on_page};
#[cfg(not(target_arch = "wasm32"))]
pub(crate) use project::is_project_file as is_project;
pub use replay::{Replayed, replay};
#[cfg(not(target_arch = "wasm32"))]
pub(crate) use report::headless::project as report_of_project;
pub use state::{
    Base, ClassCase, ClassRound, ClassState, Document, Edit, FolderReading, FoundBeside, Guess, LessonPosition,
    LessonProgress, OwnEffects, Pin, RigState, Sample, SeriesForm, SeriesOver, Shown, Source, State, StreamForm, Walk,
    WalkView,
};
pub use window::App;
