//! Components without a mass: the force along a given motion, its equation, and what it lacks.

mod centre;
mod columns;
mod room;

pub(crate) use centre::{ComponentAct, show, show_missing, svg};
pub(crate) use columns::findings;
pub(crate) use room::{Asked, ComponentRoom, request};
