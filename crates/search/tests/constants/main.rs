//! The constants of the search: what each of them moves, and what searches cost and say with them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod drawn;
mod effort;
mod study;
