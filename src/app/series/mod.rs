//! A series in the window: the table that a batch wrote, its parameters over what was varied, and the records that do not fit.

mod act;
mod centre;
mod columns;
mod room;

pub(crate) use act::{SeriesAct, SeriesAsk};
pub(crate) use centre::{show, svg};
pub(crate) use columns::{controls, findings};
pub(crate) use room::{OpenSeries, SeriesRoom, read};
