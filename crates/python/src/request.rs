//! Settings and records as Python hands them over.

use pyo3::PyResult;

use crate::error::{error, failed};
use crate::record::NativeRecord;
use sindyscope_analysis::{AnalysisError, AnalysisRequest};
use sindyscope_core::setting::{Given, Said};
use sindyscope_files::{ReadOptions, join};
use sindyscope_modes::{BASE, Base, BaseModel};
use sindyscope_values::record::{Record, RecordSet};

/// A study that is asked for by names of settings with their texts.
pub(crate) fn request(settings: &[(String, String)]) -> PyResult<AnalysisRequest> {
    let pairs = settings.iter().map(|(name, text)| (name.as_str(), text.as_str()));
    AnalysisRequest::named(pairs).map_err(|e| failed(&e))
}

/// The base model of a structure by the names of its settings with their texts.
pub(crate) fn base(settings: &[(String, String)]) -> PyResult<Base> {
    let mut base = Base { model: BaseModel::Modes, ..Base::default() };
    for (name, text) in settings {
        let unknown = || format!("there is no setting `{name}`");
        let setting = BASE.iter().find(|s| s.name == name).ok_or_else(unknown);
        let said = setting.and_then(|s| Said::new(s, text).map_err(|reason| format!("{name}: {reason}")));
        said.and_then(|said| Given::new([said]).apply(&mut base)).map_err(|reason| error(reason, String::new()))?;
    }
    Ok(base)
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
