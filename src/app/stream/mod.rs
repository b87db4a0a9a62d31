//! A stream in the window: what arrives, what is identified from its last seconds, and the alarm.

mod act;
mod centre;
mod controls;
mod room;
pub(crate) mod work;

pub(crate) use act::StreamAct;
pub(crate) use centre::show;
pub(crate) use controls::{controls, findings};
pub(crate) use room::StreamRoom;
