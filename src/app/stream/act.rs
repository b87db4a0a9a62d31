//! What a person does with a stream.

use serde::{Deserialize, Serialize};

use crate::app::state::StreamForm;

/// One act.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum StreamAct {
    /// The form is this now.
    Form(Box<StreamForm>),
    /// Follow the source, from now on.
    Start,
    /// Let the figures stand while the stream goes on, or let them go on.
    Pause(bool),
    /// Follow it no longer; what was found stays.
    Stop,
    /// Go back to the records.
    Close,
    /// Keep the last seconds as a record: the window asks for a file.
    Keep,
}
