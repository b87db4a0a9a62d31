//! What was found, as Python's objects take it: JSON, figures, series.

use numpy::PyArray1;
use pyo3::prelude::*;
use serde_json::Value;

use crate::error::error;
use crate::model::NativeModel;
use sindyscope_analysis::batch::{diagnosis_row, row};
use sindyscope_analysis::{Analysis, json};
use sindyscope_report::document::{FigureSize, walk};
use sindyscope_report::view::{Subject, View, ViewOptions};
use sindyscope_search::Diagnosis;
use sindyscope_values::format::shown::ShownUnits;
use sindyscope_values::record::{RecordSet, Usage};

/// What `identify` found.
#[pyclass(name = "NativeIdentification", module = "sindyscope._native", frozen)]
pub(crate) struct NativeIdentification {
    analysis: Analysis,
    diagnosis: Option<Value>,
}

/// A record's time, what was measured and what the model says, with name, unit and use.
type CurveArrays<'py> = (
    String,
    &'static str,
    String,
    String,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
);

impl NativeIdentification {
    pub(crate) fn new(analysis: Analysis) -> Self {
        Self { analysis, diagnosis: None }
    }

    pub(crate) fn with_diagnosis(self, diagnosis: Option<Value>) -> Self {
        Self { diagnosis, ..self }
    }
}

#[pymethods]
impl NativeIdentification {
    /// The result as the text that the command writes.
    fn json(&self) -> PyResult<String> {
        let mut result = json::identified(&self.analysis);
        if let Some(diagnosis) = &self.diagnosis {
            result["diagnosis"] = diagnosis.clone();
        }
        written(&result)
    }

    /// The row that a batch's table has of it, as JSON.
    fn row(&self) -> String {
        Value::Object(row(&self.analysis)).to_string()
    }

    /// The equations.
    fn model(&self) -> NativeModel {
        NativeModel { model: self.analysis.outcome.model.clone() }
    }

    /// The measured and the simulated response of a record, and the error, as SVG.
    #[pyo3(signature = (record = 0, width = 160.0, height = 80.0))]
    fn svg(&self, record: usize, width: f64, height: f64) -> PyResult<String> {
        let options = ViewOptions::default();
        let subject = Subject::new(&self.analysis.outcome, record, &options);
        let figure = View::Response.figure(&subject).map_err(|e| error(e, String::new()))?;
        Ok(figure.svg(FigureSize { width, height, ..FigureSize::default() }, &ShownUnits::default()))
    }

    /// The first sensor of each record: name, use, channel, unit, time, measured, simulated.
    fn curves<'py>(&self, py: Python<'py>) -> Vec<CurveArrays<'py>> {
        let layout = &self.analysis.outcome.model.layout;
        let mut curves = Vec::new();
        for of in &self.analysis.outcome.records {
            let record = &of.record;
            let (Some(measured), Some(simulated)) = (record.sensor(0), of.channels.first()) else { continue };
            let usage = if of.usage == Usage::Fit { "fit" } else { "held-out" };
            curves.push((
                record.name.clone(),
                usage,
                simulated.name(layout),
                measured.unit.clone(),
                PyArray1::from_iter(py, (0..record.len()).map(|k| record.time(k))),
                PyArray1::from_slice(py, &measured.values),
                PyArray1::from_slice(py, &simulated.response),
            ));
        }
        curves
    }

    /// How the records were smoothed, as JSON that [`NativeModel::follow`] takes.
    fn smoothing(&self) -> PyResult<String> {
        let smoothing = &self.analysis.outcome.settings.smoothing;
        serde_json::to_string(smoothing).map_err(|e| error(e.to_string(), String::new()))
    }

    /// The simulated states of each record at its first sample, and its sampling interval, s.
    fn starts(&self) -> Vec<(Vec<f64>, f64)> {
        let start = |states: &[Vec<f64>]| states.iter().map(|s| s.first().copied().unwrap_or(0.0)).collect();
        self.analysis.outcome.records.iter().map(|r| (start(&r.states), r.record.interval)).collect()
    }
}

/// A result as the text that the command writes.
pub(crate) fn written(result: &Value) -> PyResult<String> {
    json::text(result).map_err(|e| error(format!("cannot write the result as JSON: {e}"), String::new()))
}

/// What `diagnose` found.
#[pyclass(name = "NativeDiagnosis", module = "sindyscope._native", frozen)]
pub(crate) struct NativeDiagnosis {
    json: Value,
    text: String,
    model: Option<NativeModelParts>,
}

/// The equations of the last stage.
type NativeModelParts = sindyscope_values::model::Model;

impl NativeDiagnosis {
    pub(crate) fn new(diagnosis: &Diagnosis, records: &RecordSet) -> Self {
        let json = json::diagnosed(diagnosis, records);
        let model = diagnosis.stages.last().map(|stage| stage.model.clone());
        Self { json, text: walk(diagnosis, records), model }
    }
}

#[pymethods]
impl NativeDiagnosis {
    /// The result as the text that the command writes.
    fn json(&self) -> PyResult<String> {
        written(&self.json)
    }

    /// The row that a batch's table has of it, as JSON.
    fn row(&self) -> String {
        Value::Object(diagnosis_row(&self.json)).to_string()
    }

    /// The walk as the command prints it.
    fn text(&self) -> &str {
        &self.text
    }

    /// The final equations; none if no model could be fitted.
    fn model(&self) -> Option<NativeModel> {
        self.model.clone().map(|model| NativeModel { model })
    }
}
