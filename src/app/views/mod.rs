//! The centre of the window.
