//! The simulation stage: a model's response along a record, from the record's initial state.

use std::sync::Arc;

use super::{Cancel, StudyError};
use crate::dataset::{Prepared, SimulationDrive};
use crate::simulate::{Limits, Response, Simulator, Workspace};
use sindyscope_values::model::Model;

/// Responses of the last run, kept for records whose model and drive have not changed.
#[derive(Debug, Default)]
pub(super) struct Responses {
    known: Vec<(Model, Arc<SimulationDrive>, Arc<Response>)>,
    workspace: Workspace,
}

impl Responses {
    /// The model's response along the whole record.
    pub(super) fn get(
        &mut self,
        model: &Model,
        simulator: &Simulator,
        prepared: &Prepared,
        cancel: &Cancel,
    ) -> Result<Arc<Response>, StudyError> {
        if let Some((_, _, response)) =
            self.known.iter().find(|(m, d, _)| Arc::ptr_eq(d, prepared.drive()) && m == model)
        {
            return Ok(Arc::clone(response));
        }
        let tolerance = Limits::default().tolerance;
        let response = prepared.drive().respond(simulator, tolerance, &mut self.workspace, &|| cancel.is_cancelled());
        cancel.check()?;
        let response = Arc::new(response);
        self.known.retain(|(_, d, _)| !Arc::ptr_eq(d, prepared.drive()));
        self.known.push((model.clone(), Arc::clone(prepared.drive()), Arc::clone(&response)));
        Ok(response)
    }

    /// Keeps only responses to these records.
    pub(super) fn keep(&mut self, records: &[Prepared]) {
        self.known.retain(|(_, drive, _)| records.iter().any(|p| p.has_drive(drive)));
    }
}
