//! Equations of motion that Python simulates, prints and takes apart.

use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::error::{error, failed};
use crate::record::NativeRecord;
use crate::work;
use sindyscope_analysis::AnalysisError;
use sindyscope_core::dataset::{Dataset, Prepared};
use sindyscope_core::simulate::{InputGrid, Limits, Simulator, Workspace};
use sindyscope_core::study::{Smoothing, StudyError};
use sindyscope_values::format::equations;
use sindyscope_values::model::{Equation, Model, WeightedTerm};
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::{Kind, Layout, Term};

/// Equations of motion.
#[pyclass(name = "NativeModel", module = "sindyscope._native", frozen)]
pub(crate) struct NativeModel {
    pub(crate) model: Model,
}

/// A term as text and in Python, its coefficient and standard error.
type TermParts = (String, String, f64, Option<f64>);

/// A response: `[sample][state]`, and when it left all bounds, s.
type SimulatedArrays<'py> = (Bound<'py, PyArray2<f64>>, Option<f64>);

#[pymethods]
impl NativeModel {
    /// A model from its JSON.
    #[staticmethod]
    fn of_json(text: &str) -> PyResult<Self> {
        let model = serde_json::from_str(text).map_err(|e| error(format!("this is no model: {e}"), String::new()))?;
        Ok(Self { model })
    }

    /// A model of known coefficients: of each acceleration (second order) or state, terms as they are typed.
    #[staticmethod]
    fn of_terms(second_order: bool, inputs: usize, each: Vec<Vec<(String, f64)>>) -> PyResult<Self> {
        let equation = |terms: Vec<(String, f64)>| {
            let term = |(text, c): (String, f64)| {
                let term = Term::parse(&text).map_err(|e| error(format!("{text}: {e}"), String::new()))?;
                Ok((term, c))
            };
            Ok(Equation::known(terms.into_iter().map(term).collect::<PyResult<Vec<_>>>()?))
        };
        let equations = each.into_iter().map(equation).collect::<PyResult<Vec<_>>>()?;
        let model =
            if second_order { Model::second_order(inputs, equations) } else { Model::first_order(inputs, equations) };
        Ok(Self { model })
    }

    /// The model as JSON, to the last bit.
    fn json(&self) -> PyResult<String> {
        serde_json::to_string(&self.model).map_err(|e| error(format!("the model has no JSON: {e}"), String::new()))
    }

    /// Whether it is of second order.
    #[getter]
    fn second_order(&self) -> bool {
        self.model.layout.kind == Kind::SecondOrder
    }

    /// The names of the states.
    fn states(&self) -> Vec<String> {
        let layout = &self.model.layout;
        layout.state_symbols().map(|s| layout.name(s)).collect()
    }

    /// The number of inputs.
    #[getter]
    fn inputs(&self) -> usize {
        self.model.layout.inputs
    }

    /// Each state with its terms: text, Python, coefficient and standard error.
    fn equations(&self) -> Vec<(String, Vec<TermParts>)> {
        let layout = &self.model.layout;
        let parts = |t: &WeightedTerm| (t.term.text(layout), t.term.python(layout), t.coefficient, t.std_error);
        let of = |e: &Equation| e.terms.iter().map(parts).collect();
        self.model.iter().map(|(state, equation)| (layout.name(state), of(equation))).collect()
    }

    /// The equations, a line a term.
    fn text(&self) -> String {
        equations::text(&self.model, None)
    }

    /// The equations as LaTeX.
    fn latex(&self) -> String {
        equations::latex(&self.model)
    }

    /// The equations as a function for `scipy.integrate.solve_ivp`.
    fn python(&self) -> String {
        equations::python(&self.model)
    }

    /// The response along each record from the initial state that fits its opening best, as held-out records are scored; of the first
    /// sensor, until it diverges. `smoothing` says how the initial state is guessed.
    fn follow<'py>(
        &self,
        py: Python<'py>,
        records: Vec<NativeRecord>,
        smoothing: &str,
    ) -> PyResult<Vec<Bound<'py, PyArray1<f64>>>> {
        let smoothing: Smoothing =
            serde_json::from_str(smoothing).map_err(|e| error(format!("this is no smoothing: {e}"), String::new()))?;
        let simulator = Simulator::new(&self.model).map_err(|e| failed(&AnalysisError::Settings(e.to_string())))?;
        let layout = self.model.layout;
        let responses = work::done(py, None, move |cancel, _| {
            let records: Vec<Record> = records.into_iter().map(|r| (*r.record).clone()).collect();
            if records.iter().any(|r| Layout { internals: layout.internals, ..r.layout(layout.kind) } != layout) {
                return Err(AnalysisError::Settings("the record does not have the model's channels".into()));
            }
            let set = RecordSet::new(records, Usage::HeldOut);
            let mut dataset = Dataset::default();
            let going_on = || if cancel.is_cancelled() { Err(StudyError::Cancelled) } else { Ok(()) };
            dataset.update(&set, &Layout { internals: 0, ..layout }, &smoothing, going_on)?;
            let mut workspace = Workspace::default();
            let mut follow = |prepared: &Prepared| -> Vec<f64> {
                let drive = prepared.drive();
                let tolerance = Limits::default().tolerance;
                let response = drive.respond(&simulator, tolerance, None, &mut workspace, &|| cancel.is_cancelled());
                let zero = drive.zeros.first().copied().unwrap_or(0.0);
                let shown = drive.outputs.first().map(|output| output.series(&response, layout.freedoms));
                shown.unwrap_or_default().iter().map(|v| v + zero).collect()
            };
            Ok(dataset.records.iter().map(&mut follow).collect::<Vec<_>>())
        })?;
        Ok(responses.into_iter().map(|r| PyArray1::from_vec(py, r)).collect())
    }

    /// The response along inputs `[sample][input]` that were sampled every `interval` s, from a state at the first sample. Without
    /// inputs the array has no column and as many rows as samples are wanted.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        inputs: PyReadonlyArray2<'py, f64>,
        interval: f64,
        initial: Vec<f64>,
    ) -> PyResult<SimulatedArrays<'py>> {
        let bad = |reason: String| Err(error(reason, String::new()));
        let inputs = inputs.as_array();
        let (samples, given) = inputs.dim();
        let layout = self.model.layout;
        if given != layout.inputs {
            return bad(format!("the model has {} inputs, and {given} were given", layout.inputs));
        }
        if !(interval.is_finite() && interval > 0.0) {
            return bad(format!("the sampling interval is {interval} s: it must be above zero"));
        }
        if initial.len() != layout.states() || initial.iter().any(|v| !v.is_finite()) {
            let names = self.states().join(", ");
            return bad(format!("the initial state has one finite value for each of {names}"));
        }
        if inputs.iter().any(|v| !v.is_finite()) {
            return bad("the inputs hold a value that is not a number".into());
        }
        let columns: Vec<Vec<f64>> = inputs.columns().into_iter().map(|c| c.to_vec()).collect();
        let simulator = Simulator::new(&self.model).map_err(|e| failed(&AnalysisError::Settings(e.to_string())))?;
        let states = layout.states();
        let (rows, diverged_at) = work::done(py, None, move |cancel, _| {
            let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            let grid = InputGrid::new(0.0, interval, samples, &columns, None);
            let cancelled = || cancel.is_cancelled();
            let limits = Limits { cancelled: &cancelled, ..Limits::default() };
            let response = simulator.run(&grid, &initial, 0..samples, &limits);
            let row = |k: usize| -> Vec<f64> {
                (0..states)
                    .map(|s| response.states.get(s).and_then(|v| v.get(k)).copied().unwrap_or(f64::NAN))
                    .collect()
            };
            Ok(((0..samples).map(row).collect::<Vec<_>>(), response.diverged_at))
        })?;
        let array = PyArray2::from_vec2(py, &rows).map_err(|e| error(e.to_string(), String::new()))?;
        Ok((array, diverged_at))
    }
}
