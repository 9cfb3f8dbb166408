//! Cases from files, texts and dictionaries.

use std::path::{Path, PathBuf};

use gluey::case::Override;
use gluey::flow::MeshSize;
use gluey::{CaseSummary, RunError, memory};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use toml::{Table, Value};

use crate::errors::{DICTIONARY, of_case, of_run};
use crate::pool::compute;

/// A checked case.
#[pyclass(frozen, module = "gluey._gluey")]
pub struct Case {
    inner: gluey::Case,
}

impl Case {
    /// The case.
    pub fn inner(&self) -> &gluey::Case {
        &self.inner
    }
}

#[pymethods]
impl Case {
    /// From a file, with keys set otherwise.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, overrides: &Bound<'_, PyDict>) -> PyResult<Self> {
        let overrides = read_overrides(overrides)?;
        let loaded = compute(py, None, || gluey::Case::load_with(path, &overrides))?;
        Ok(Self { inner: loaded.map_err(|error| of_case(py, &error))? })
    }

    /// From TOML text, with keys set otherwise.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str, overrides: &Bound<'_, PyDict>) -> PyResult<Self> {
        Self::parsed(py, text, Path::new("text"), &read_overrides(overrides)?)
    }

    /// From a dictionary with the keys of a case file, with keys set otherwise.
    #[staticmethod]
    fn of_dict(py: Python<'_>, dict: &Bound<'_, PyDict>, overrides: &Bound<'_, PyDict>) -> PyResult<Self> {
        let text =
            toml::to_string(&table(dict, "")?).map_err(|error| PyValueError::new_err(error.to_string()))?;
        Self::parsed(py, &text, Path::new(DICTIONARY), &read_overrides(overrides)?)
    }

    /// The case as it would be run, with all defaults, as TOML.
    fn toml(&self) -> PyResult<String> {
        self.inner.to_toml().map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// What the names of all results begin with.
    fn stem(&self) -> String {
        self.inner.file_stem()
    }

    /// What a run would be: numbers of a summary and of the first mesh.
    fn check<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let case = &self.inner;
        let size = compute(py, None, || {
            memory::check_within(case, None).map_err(RunError::from)?;
            MeshSize::of(case).map_err(|error| RunError::Flow(error.into()))
        })?;
        let size = size.map_err(|error| of_run(py, &error))?;
        let CaseSummary { name, dimension, particles, volume_fraction, strategy, formulation, .. } =
            CaseSummary::of(case);
        let found = PyDict::new(py);
        found.set_item("name", name)?;
        found.set_item("dimension", dimension)?;
        found.set_item("particles", particles)?;
        found.set_item("volume_fraction", volume_fraction)?;
        found.set_item("strategy", strategy)?;
        found.set_item("formulation", formulation)?;
        found.set_item("time_step", case.time.step)?;
        found.set_item("steps", case.step_count())?;
        found.set_item("cells", size.map(|size| size.cell_count))?;
        found.set_item("unknowns", size.map(|size| size.dof_count))?;
        found.set_item("memory_bytes", size.map(|size| size.bytes))?;
        found.set_item("memory_available_bytes", memory::available())?;
        Ok(found)
    }
}

impl Case {
    fn parsed(py: Python<'_>, text: &str, file: &Path, overrides: &[Override]) -> PyResult<Self> {
        let parsed = compute(py, None, || gluey::Case::parse_with(text, file, overrides))?;
        Ok(Self { inner: parsed.map_err(|error| of_case(py, &error))? })
    }
}

/// `{"time.step": 0.01}` as the command line's `time.step=0.01`.
fn read_overrides(overrides: &Bound<'_, PyDict>) -> PyResult<Vec<Override>> {
    let read = |(key, wanted): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let key: String = key.extract()?;
        let text = format!("{key}={}", value(&wanted, &key)?);
        text.parse().map_err(|error| PyValueError::new_err(format!("overrides, {text}: {error}")))
    };
    overrides.iter().map(read).collect()
}

/// A dictionary as a table. What is `None` is absent; `at` is the key of the dictionary.
fn table(dict: &Bound<'_, PyDict>, at: &str) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, entry) in dict {
        let Ok(key) = key.extract::<String>() else {
            let place = if at.is_empty() { "the case" } else { at };
            return Err(PyTypeError::new_err(format!("{place}: a key is {}, not a text", in_words(&key))));
        };
        if !entry.is_none() {
            let at = if at.is_empty() { key.clone() } else { format!("{at}.{key}") };
            table.insert(key, value(&entry, &at)?);
        }
    }
    Ok(table)
}

/// A value of a case; `at` is its key.
fn value(object: &Bound<'_, PyAny>, at: &str) -> PyResult<Value> {
    if let Ok(dict) = object.cast::<PyDict>() {
        return Ok(Value::Table(table(dict, at)?));
    }
    if object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>() {
        let entries = object.try_iter()?.enumerate();
        let entries = entries.map(|(index, entry)| value(&entry?, &format!("{at}[{index}]")));
        return Ok(Value::Array(entries.collect::<PyResult<_>>()?));
    }
    if object.is_instance_of::<PyBool>() {
        return Ok(Value::Boolean(object.extract()?));
    }
    if object.is_instance_of::<PyInt>() {
        let number =
            object.extract().map_err(|_| PyValueError::new_err(format!("{at}: {object} is too large")))?;
        return Ok(Value::Integer(number));
    }
    if object.is_instance_of::<PyFloat>() {
        return Ok(Value::Float(object.extract()?));
    }
    if object.is_instance_of::<PyString>() {
        return Ok(Value::String(object.extract()?));
    }
    if let Ok(path) = object.extract::<PathBuf>() {
        return Ok(Value::String(path.display().to_string()));
    }
    // Arrays and scalars of numpy.
    if object.hasattr("tolist")? {
        return value(&object.call_method0("tolist")?, at);
    }
    let wanted = "a number, a text, True or False, a list, an array or a dictionary";
    Err(PyTypeError::new_err(format!("{at}: found {}; expected {wanted}", in_words(object))))
}

fn in_words(object: &Bound<'_, PyAny>) -> String {
    object
        .get_type()
        .name()
        .map_or_else(|_| "something else".to_owned(), |name| format!("a value of type {name}"))
}
