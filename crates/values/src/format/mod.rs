//! Numbers, units and colours as a person sees them: the same in the window, in a report and on the command line.

pub mod equations;
pub mod number;
pub mod shown;
pub mod units;
pub mod words;
