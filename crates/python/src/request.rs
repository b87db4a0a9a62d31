//! Settings and records as Python hands them over.

use pyo3::PyResult;

use crate::error::failed;
use crate::record::NativeRecord;
use sindyscope_analysis::{AnalysisError, AnalysisRequest};
use sindyscope_files::{ReadOptions, join};
use sindyscope_values::record::{Record, RecordSet};

/// A study that is asked for by names of settings with their texts.
pub(crate) fn request(settings: &[(String, String)]) -> PyResult<AnalysisRequest> {
    let pairs = settings.iter().map(|(name, text)| (name.as_str(), text.as_str()));
    AnalysisRequest::named(pairs).map_err(|e| failed(&e))
}

/// How a source is read before it is joined with others.
pub(crate) fn apart(request: &AnalysisRequest) -> ReadOptions {
    ReadOptions { keep_constant_inputs: true, ..request.source.read_options() }
}

/// The records of all sources, prepared.
pub(crate) fn joined(
    fit: Vec<Vec<NativeRecord>>,
    held_out: Vec<Vec<NativeRecord>>,
    request: &AnalysisRequest,
) -> Result<RecordSet, AnalysisError> {
    let own = |sources: Vec<Vec<NativeRecord>>| -> Vec<Vec<Record>> {
        sources.into_iter().map(|of_one| of_one.into_iter().map(|r| (*r.record).clone()).collect()).collect()
    };
    let set = join(own(fit), own(held_out), &request.source.read_options())?;
    request.source.prepared(&set)
}
