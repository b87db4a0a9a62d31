//! The simulation stage: a model's response along a record, from the record's initial state.

use std::sync::Arc;

use super::{Cancel, StudyError};
use crate::dataset::{Prepared, SimulationDrive};
use crate::simulate::{Limits, Response, Simulator, Workspace};
use sindyscope_values::model::Model;

/// The response of a model along a drive, its initial state estimated from so many samples.
#[derive(Debug)]
struct KnownResponse {
    model: Model,
    drive: Arc<SimulationDrive>,
    initial: Option<usize>,
    response: Arc<Response>,
}

/// Responses of the last run, kept for records whose model and drive have not changed.
#[derive(Debug, Default)]
pub(super) struct Responses {
    known: Vec<KnownResponse>,
    workspace: Workspace,
}

impl Responses {
    /// The model's response along the whole record; `initial` as in [`SimulationDrive::respond`].
    pub(super) fn get(
        &mut self,
        (model, simulator): (&Model, &Simulator),
        prepared: &Prepared,
        initial: Option<usize>,
        cancel: &Cancel,
    ) -> Result<Arc<Response>, StudyError> {
        let same =
            |k: &&KnownResponse| Arc::ptr_eq(&k.drive, prepared.drive()) && k.initial == initial && k.model == *model;
        if let Some(known) = self.known.iter().find(same) {
            return Ok(Arc::clone(&known.response));
        }
        let tolerance = Limits::default().tolerance;
        let drive = Arc::clone(prepared.drive());
        let response = drive.respond(simulator, tolerance, initial, &mut self.workspace, &|| cancel.is_cancelled());
        cancel.check()?;
        let response = Arc::new(response);
        self.known.retain(|k| !Arc::ptr_eq(&k.drive, &drive));
        self.known.push(KnownResponse { model: model.clone(), drive, initial, response: Arc::clone(&response) });
        Ok(response)
    }

    /// Keeps only responses to these records.
    pub(super) fn keep(&mut self, records: &[Prepared]) {
        self.known.retain(|known| records.iter().any(|p| p.has_drive(&known.drive)));
    }
}
