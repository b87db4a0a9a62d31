//! Records as Python sees them.

use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;

use crate::error::error;
use sindyscope_values::record::{Channel, Record, Role};

/// One trajectory: evenly sampled channels of one length.
#[pyclass(name = "NativeRecord", module = "sindyscope._native", frozen, from_py_object)]
#[derive(Clone)]
pub(crate) struct NativeRecord {
    pub(crate) record: Arc<Record>,
}

impl From<Record> for NativeRecord {
    fn from(record: Record) -> Self {
        Self { record: Arc::new(record) }
    }
}

/// A channel with its role, name, unit, values, and whether it was estimated.
type ChannelParts = (String, String, String, Vec<f64>, bool);

#[pymethods]
impl NativeRecord {
    /// Puts a record together again, as after pickling.
    #[staticmethod]
    fn of(
        name: String,
        start: f64,
        interval: f64,
        channels: Vec<ChannelParts>,
        notices: Vec<String>,
        source: Option<std::path::PathBuf>,
    ) -> PyResult<Self> {
        let channel = |(role, name, unit, values, estimated): ChannelParts| {
            let role = Role::of_short_name(&role)
                .ok_or_else(|| error(format!("`{role}` is no channel of a record"), String::new()))?;
            Ok(Channel { name, role, unit, values: values.into(), estimated })
        };
        let channels = channels.into_iter().map(channel).collect::<PyResult<_>>()?;
        Ok(Record { name, source, start, interval, channels, notices }.into())
    }

    #[getter]
    fn name(&self) -> &str {
        &self.record.name
    }

    #[getter]
    fn start(&self) -> f64 {
        self.record.start
    }

    #[getter]
    fn interval(&self) -> f64 {
        self.record.interval
    }

    #[getter]
    fn samples(&self) -> usize {
        self.record.len()
    }

    #[getter]
    fn notices(&self) -> Vec<String> {
        self.record.notices.clone()
    }

    #[getter]
    fn source(&self) -> Option<std::path::PathBuf> {
        self.record.source.clone()
    }

    /// Role (`x1`, `u2`), header's name, unit, and whether it was estimated, of each channel.
    fn channels(&self) -> Vec<(String, String, String, bool)> {
        let told = |c: &Channel| (c.role.short_name(), c.name.clone(), c.unit.clone(), c.estimated);
        self.record.channels.iter().map(told).collect()
    }

    /// The values of a channel by its place.
    fn values<'py>(&self, py: Python<'py>, channel: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let channel = self.record.channels.get(channel);
        let channel = channel.ok_or_else(|| error("the record has no such channel".into(), String::new()))?;
        Ok(PyArray1::from_slice(py, &channel.values))
    }

    /// Time of each sample, s.
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, (0..self.record.len()).map(|k| self.record.time(k)))
    }
}
