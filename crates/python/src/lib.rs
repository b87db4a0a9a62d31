//! The Python package's native half: analyses asked for from Python.
//!
//! It turns arrays into records, asks [`sindyscope_analysis`] as the commands do, and hands back what was found. What needs no
//! numerics (frames, text, the estimator) is Python, in `python/sindyscope`.
//!
//! Work runs on a thread of its own while the interpreter is free ([`work`]), so that Ctrl+C stops it and a callback hears of it.

#![cfg(feature = "extension")]

mod batch;
mod error;
mod model;
mod record;
mod request;
mod result;
mod work;

use std::path::PathBuf;

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use pyo3::types::PyModule;

use batch::{NativeJournal, write_table};
use error::{failed, rig_failed};
use model::NativeModel;
use record::NativeRecord;
use request::{joined, request};
use result::{NativeDiagnosis, NativeIdentification};
use sindyscope_analysis::{
    AnalysisError, AnalysisProgress, AnalysisRequest, KindName, MissingRequest, analyse, effects::of_file, json, search,
};
use sindyscope_core::clock::Stopwatch;
use sindyscope_core::setting::SettingForm;
use sindyscope_files::{MeasuredFile, NamedColumn, write_csv};
use sindyscope_report::document::{Arrangement, DocumentFormat, Paper, Report, Sections};
use sindyscope_report::modal::{diagnosis_text, modes_text};
use sindyscope_rig::hidden::{HIDDEN_SCENARIO, HiddenOptions, hidden_records};
use sindyscope_rig::{ScenarioOptions, generate as generated, scenarios};

/// Settings by name, each with its text.
type NamedSettings = Vec<(String, String)>;
/// The records of each source by themselves.
type Sources = Vec<Vec<NativeRecord>>;

/// The records of a file.
#[pyfunction]
fn read(py: Python<'_>, path: PathBuf, settings: NamedSettings) -> PyResult<Vec<NativeRecord>> {
    let request = request(&settings)?;
    work::done(py, None, move |cancel, _| {
        let file = MeasuredFile::open(&path)?.stopped_by(cancel);
        Ok(file.read(&request::apart(&request))?.into_iter().map(NativeRecord::from).collect())
    })
}

/// The records of arrays, each with the heading that a file would have over it.
#[pyfunction]
fn records(
    py: Python<'_>,
    name: String,
    columns: Vec<(String, PyReadonlyArray1<'_, f64>)>,
    settings: NamedSettings,
) -> PyResult<Vec<NativeRecord>> {
    let request = request(&settings)?;
    let column = |(heading, values): (String, PyReadonlyArray1<'_, f64>)| NamedColumn {
        heading,
        values: values.as_array().to_vec(),
    };
    let columns: Vec<NamedColumn> = columns.into_iter().map(column).collect();
    work::done(py, None, move |cancel, _| {
        let table = MeasuredFile::from_columns(&name, columns)?.stopped_by(cancel);
        Ok(table.read(&request::apart(&request))?.into_iter().map(NativeRecord::from).collect())
    })
}

/// Identifies the equation of motion of records.
#[pyfunction]
fn identify(
    py: Python<'_>,
    fit: Sources,
    held_out: Sources,
    settings: NamedSettings,
    progress: Option<Py<PyAny>>,
) -> PyResult<NativeIdentification> {
    let request = request(&settings)?;
    work::done(py, progress, move |cancel, tell| {
        let records = joined(fit, held_out, &request)?;
        Ok(NativeIdentification::new(analyse(&request, records, cancel, tell)?))
    })
}

/// The base model's terms, known terms, the most effects of a search, and the file of effects of one's own.
type AskedSearch = (Option<String>, Vec<String>, u8, Option<PathBuf>);

/// What a search for missing effects is asked for.
fn missing((base, known, max_effects, effects): &AskedSearch, request: &AnalysisRequest) -> PyResult<MissingRequest> {
    let value = |name: &str| {
        let name = name.to_owned();
        move |problem: String| failed(&AnalysisError::Value { name, problem })
    };
    let base = base.as_deref().map(|text| text.parse().map_err(value("terms"))).transpose()?;
    let known = known.iter().map(|text| text.parse().map_err(value("lock"))).collect::<PyResult<_>>()?;
    let initial = request.initial().map_err(|error| failed(&error))?;
    let effects = effects.as_deref().map(of_file).transpose().map_err(|error| failed(&error))?.unwrap_or_default();
    Ok(MissingRequest { base, known, max_effects: *max_effects, initial, effects })
}

/// Searches records for effects that a base model lacks.
#[pyfunction]
fn diagnose(
    py: Python<'_>,
    fit: Sources,
    held_out: Sources,
    settings: NamedSettings,
    asked: AskedSearch,
    progress: Option<Py<PyAny>>,
) -> PyResult<NativeDiagnosis> {
    let request = request(&settings)?;
    let missing = missing(&asked, &request)?;
    work::done(py, progress, move |cancel, tell| {
        if request.source.reading.kind == KindName::FirstOrder {
            return Err(AnalysisError::FirstOrder);
        }
        if request.source.reading.kind == KindName::Component {
            return Err(AnalysisError::NoMass);
        }
        let records = joined(fit, held_out, &request)?;
        let diagnosis = search(&missing, &records, cancel, tell)?;
        Ok(NativeDiagnosis::new(&diagnosis, &records))
    })
}

/// Finds the modes of a structure, as the base model's settings ask for them or the data bear, and the force that they lack if that is to
/// be searched for; the result as the command writes it, and as it prints it.
#[pyfunction]
fn modes(
    py: Python<'_>,
    fit: Sources,
    held_out: Sources,
    settings: NamedSettings,
    asked: (NamedSettings, bool),
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, String)> {
    let request = request(&settings)?;
    let base = request::base(&asked.0)?;
    let missing = asked.1;
    let (found, text) = work::done(py, progress, move |cancel, tell| {
        let records = joined(fit, held_out, &request)?;
        let told = |what: &'static str, share: f64| tell(AnalysisProgress::Share(what, share));
        let watch = Stopwatch::start();
        if missing {
            let found = sindyscope_modes::diagnose(&records, &base, &told, cancel)?;
            return Ok((json::structure::diagnosed(&found, &records, watch.milliseconds()), diagnosis_text(&found)));
        }
        told("looking for modes", 0.0);
        let found = sindyscope_modes::identify(&records, &base, cancel)?;
        Ok((json::structure::identified(&found, &records, watch.milliseconds()), modes_text(&found)))
    })?;
    Ok((result::written(&found)?, text))
}

/// How a document is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct NativeDocument {
    out: PathBuf,
    title: String,
    sections: Option<String>,
    letter: bool,
    /// The search for missing effects, if one is to be made.
    search: Option<AskedSearch>,
}

/// Identifies, searches if asked to, and writes the document.
#[pyfunction]
fn report(
    py: Python<'_>,
    fit: Sources,
    held_out: Sources,
    settings: NamedSettings,
    document: NativeDocument,
    progress: Option<Py<PyAny>>,
) -> PyResult<NativeIdentification> {
    // Said before the work is done, not after.
    DocumentFormat::of(&document.out).map_err(error::report_failed)?;
    let request = request(&settings)?;
    let asked = document.search.as_ref().map(|asked| missing(asked, &request)).transpose()?;
    let sections = document.sections.as_deref().map(str::parse::<Sections>).transpose();
    let sections = sections.map_err(|problem| failed(&AnalysisError::Value { name: "sections".into(), problem }))?;
    let written = work::done(py, progress, move |cancel, tell| {
        if asked.is_some() && request.source.reading.kind == KindName::FirstOrder {
            return Err(AnalysisError::FirstOrder);
        }
        let records = joined(fit, held_out, &request)?;
        let analysis = analyse(&request, records, cancel, tell)?;
        let diagnosis = asked.map(|asked| search(&asked, &analysis.records, cancel, tell)).transpose()?;
        let arrangement = sections.map_or_else(Arrangement::default, |s| Arrangement::of(&s.0));
        let paper = if document.letter { Paper::Letter } else { Paper::A4 };
        tell(AnalysisProgress::Stage("drawing"));
        let written = Report {
            title: &document.title,
            records: &analysis.records,
            outcome: &analysis.outcome,
            choice: analysis.choice.as_deref(),
            command: None,
            diagnosis: diagnosis.as_ref(),
            arrangement: &Arrangement { paper, ..arrangement },
        }
        .write(&document.out);
        let diagnosed = diagnosis.map(|d| json::diagnosed(&d, &analysis.records));
        Ok(written.map(|()| NativeIdentification::new(analysis).with_diagnosis(diagnosed)))
    })?;
    written.map_err(error::report_failed)
}

/// Records of the virtual rig, and the comments that a file of them would have.
#[pyfunction]
fn generate(py: Python<'_>, scenario: String, options: NamedSettings) -> PyResult<(Vec<NativeRecord>, Vec<String>)> {
    let pairs = || options.iter().map(|(name, text)| (name.as_str(), text.as_str()));
    let made = py.detach(|| {
        if scenario == HIDDEN_SCENARIO {
            HiddenOptions::typed(pairs()).and_then(|options| hidden_records(&options))
        } else {
            let run = ScenarioOptions::typed(pairs()).and_then(|options| generated(&scenario, &options));
            run.map(|run| (run.records, run.comments))
        }
    });
    let (records, comments) = made.map_err(|e| rig_failed(&e))?;
    Ok((records.into_iter().map(NativeRecord::from).collect(), comments))
}

/// The scenarios of the virtual rig: name and what it is.
#[pyfunction]
fn scenario_names() -> Vec<(&'static str, &'static str)> {
    scenarios().iter().map(|s| (s.name, s.summary)).collect()
}

/// Writes records as the CSV that the readers take.
#[pyfunction]
fn csv(records: Vec<NativeRecord>, comments: Vec<String>) -> PyResult<Vec<u8>> {
    let records: Vec<_> = records.into_iter().map(|r| (*r.record).clone()).collect();
    let mut out = Vec::new();
    write_csv(&records, &mut out, &comments)
        .map_err(|e| error::error(format!("cannot write the records as CSV: {e}"), String::new()))?;
    Ok(out)
}

/// The catalogue of effects as JSON.
#[pyfunction]
fn effects() -> String {
    json::effects(&sindyscope_search::guide()).to_string()
}

/// The settings that a study takes: name, what it does, and how it is given (`value`, `list`, `flag` or `switch`).
#[pyfunction]
fn settings() -> Vec<(&'static str, &'static str, &'static str)> {
    let form = |form: SettingForm| match form {
        SettingForm::One(_) | SettingForm::Signed(_) | SettingForm::Names { .. } => "value",
        SettingForm::Many(_) => "list",
        SettingForm::Flag => "flag",
        SettingForm::Switch => "switch",
    };
    AnalysisRequest::names().into_iter().map(|(name, help, of)| (name, help, form(of))).collect()
}

/// How many analyses are at work in this process, those that were given up and have not heard of it yet among them.
#[pyfunction]
fn at_work() -> usize {
    work::at_work()
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<NativeRecord>()?;
    module.add_class::<NativeModel>()?;
    module.add_class::<NativeIdentification>()?;
    module.add_class::<NativeDiagnosis>()?;
    module.add_class::<NativeJournal>()?;
    for function in [
        wrap_pyfunction!(read, module)?,
        wrap_pyfunction!(records, module)?,
        wrap_pyfunction!(identify, module)?,
        wrap_pyfunction!(diagnose, module)?,
        wrap_pyfunction!(modes, module)?,
        wrap_pyfunction!(write_table, module)?,
        wrap_pyfunction!(report, module)?,
        wrap_pyfunction!(generate, module)?,
        wrap_pyfunction!(scenario_names, module)?,
        wrap_pyfunction!(csv, module)?,
        wrap_pyfunction!(effects, module)?,
        wrap_pyfunction!(settings, module)?,
        wrap_pyfunction!(at_work, module)?,
    ] {
        module.add_function(function)?;
    }
    Ok(())
}
