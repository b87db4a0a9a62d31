//! The room "Virtual rig": a plant whose every number can be moved, its motion drawn, recorded and fitted at once; lessons
//! and the class mode beside it.
//!
//! [`RigState`] is what a person decided; [`RigRoom`] is what was made of it.

pub(crate) mod class;
mod controls;
mod drawing;
mod found;
mod number_row;
mod pages;
pub(crate) mod player;
mod room;
pub(crate) mod save;
pub(crate) mod sets;
pub(crate) mod work;

pub(crate) use pages::show;
pub(crate) use room::{Made, RigAct, RigRoom};
