//! `RangeMap`: conversion of actions into interaction ranges. Actions that cannot be read directly, and errors, are
//! left to the functions of `flockesc_env.episodes.action_checks`.

use std::sync::Arc;

use flockesc_core::{Error, NormalizedRange, bindings};
use numpy::{
    Element, IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2,
    PyUntypedArrayMethods,
};
use pyo3::call::PyCallArgs;
use pyo3::conversion::FromPyObjectOwned;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList, PyTuple};

use crate::arrays::{Object, shaped};
use crate::errors::CoreError;

/// Maps actions to interaction ranges. Arrays of float32 or float64 are read directly, or of int64
/// with a grid. Other array-likes are converted by NumPy first.
#[pyclass(frozen, module = "flockesc_env._core")]
#[derive(Clone)]
pub(crate) struct RangeMap {
    map: NormalizedRange,
    /// Whether actions lie in [-1, 1] instead of [`min_range`, `max_range`].
    is_normalized: bool,
    /// Ranges in m that a discrete action is an index into.
    grid: Option<Arc<[f64]>>,
}

#[pymethods]
impl RangeMap {
    #[new]
    #[pyo3(signature = (min_range, max_range, center, is_normalized, grid))]
    fn new(
        min_range: f64,
        max_range: f64,
        center: Option<f64>,
        is_normalized: bool,
        grid: Option<Vec<f64>>,
    ) -> Self {
        Self {
            map: NormalizedRange {
                min_range,
                max_range,
                center,
            },
            is_normalized,
            grid: grid.map(Arc::from),
        }
    }

    /// Returns the arguments of the constructor, for copies and pickles.
    fn __getnewargs__(&self) -> (f64, f64, Option<f64>, bool, Option<Vec<f64>>) {
        let grid = self.grid.as_ref().map(|grid| grid.to_vec());
        let NormalizedRange {
            min_range,
            max_range,
            center,
        } = self.map;
        (min_range, max_range, center, self.is_normalized, grid)
    }

    /// Returns the ranges of `count` stacked actions. `label(index)` returns the name of an action
    /// for errors.
    #[pyo3(signature = (actions, count, label=None))]
    fn to_ranges<'py>(
        &self,
        actions: &Bound<'py, PyAny>,
        count: usize,
        label: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let ranges = self.ranges(actions, count)?;
        self.check(&ranges, actions, label)?;
        Ok(ranges.into_pyarray(actions.py()))
    }

    /// Returns the range of a single action.
    pub(crate) fn to_range(&self, action: &Bound<'_, PyAny>) -> PyResult<f64> {
        let range = match &self.grid {
            Some(grid) => entry(grid, self.one(action, index, "action")?),
            None => self.of_number(self.one(action, number, "action")?),
        };
        if range.is_nan() {
            return Err(self.outside(action, 0, "action".to_owned()));
        }
        Ok(range)
    }

    /// Stacks the actions of `agents` in an array. `actions` is a mapping with exactly these agents
    /// as keys. `known` has the names of all agents.
    fn stack<'py>(
        &self,
        actions: &Bound<'py, PyAny>,
        agents: &Bound<'py, PyList>,
        known: &Bound<'py, PyAny>,
    ) -> Object<'py> {
        let py = actions.py();
        if self.grid.is_some() {
            let indices = self.each(actions, agents, known, index)?;
            return Ok(indices.into_pyarray(py).into_any());
        }
        let numbers = self.each(actions, agents, known, number)?;
        shaped(py, numbers, [agents.len(), 1])
    }
}

impl RangeMap {
    /// Returns the map from normalized actions to ranges.
    ///
    /// # Errors
    /// `InputError` on `action_mode` if it is not `"normalized"`.
    pub(crate) fn normalized(&self) -> Result<NormalizedRange, CoreError> {
        let given = match (self.is_normalized, &self.grid) {
            (true, None) => return Ok(self.map),
            (_, Some(_)) => "'discrete'",
            (false, None) => "'range'",
        };
        Err(Error::input("action_mode", "'normalized'", given).into())
    }

    /// Returns the ranges of `count` stacked actions, with NaN for actions outside of the action
    /// space.
    pub(crate) fn ranges(&self, actions: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<f64>> {
        if let Some(ranges) = self.direct(actions, count) {
            return Ok(ranges);
        }
        let shape: &[usize] = match self.grid {
            Some(_) => &[count],
            None => &[count, 1],
        };
        let plain = self.plain(actions, shape, "action")?;
        Ok(self.direct(&plain, count).unwrap_or_default())
    }

    /// Returns an error for the first action whose range is NaN. `label(index)` returns its name.
    pub(crate) fn check(
        &self,
        ranges: &[f64],
        actions: &Bound<'_, PyAny>,
        label: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let Some(first) = ranges.iter().position(|range| range.is_nan()) else {
            return Ok(());
        };
        let name = match label {
            Some(label) => label.call1((first,))?.extract()?,
            None => format!("action[{first}]"),
        };
        Err(self.outside(actions, first, name))
    }

    /// Returns the ranges of `count` actions, or `None` if `actions` is not an array that can be
    /// read directly.
    fn direct(&self, actions: &Bound<'_, PyAny>, count: usize) -> Option<Vec<f64>> {
        if let Some(grid) = &self.grid {
            let array = actions.cast::<PyArray1<i64>>().ok()?.try_readonly().ok()?;
            let indices = array.as_slice().ok()?;
            return (indices.len() == count)
                .then(|| indices.iter().map(|index| entry(grid, *index)).collect());
        }
        self.column::<f32>(actions, count)
            .or_else(|| self.column::<f64>(actions, count))
    }

    fn column<T: Element + Copy + Into<f64>>(
        &self,
        actions: &Bound<'_, PyAny>,
        count: usize,
    ) -> Option<Vec<f64>> {
        let array = actions.cast::<PyArray2<T>>().ok()?;
        if array.shape() != [count, 1] {
            return None;
        }
        let array = array.try_readonly().ok()?;
        let values = array.as_slice().ok()?.iter();
        Some(
            values
                .map(|value| self.of_number((*value).into()))
                .collect(),
        )
    }

    /// Converts actions into a new contiguous array of float64, or int64 with a grid.
    ///
    /// # Errors
    /// `InputError` on `label` if the dtype or shape is wrong.
    fn plain<'py>(&self, actions: &Bound<'py, PyAny>, shape: &[usize], label: &str) -> Object<'py> {
        let py = actions.py();
        let shape = PyTuple::new(py, shape)?;
        python(
            py,
            "plain_array",
            (actions, shape, label, self.grid.is_some()),
        )
    }

    /// Reads a single action, directly or by way of NumPy.
    fn one<'py, T: FromPyObjectOwned<'py>>(
        &self,
        action: &Bound<'py, PyAny>,
        read: fn(&Bound<'_, PyAny>) -> Option<T>,
        label: &str,
    ) -> PyResult<T> {
        if let Some(value) = read(action) {
            return Ok(value);
        }
        let shape: &[usize] = if self.grid.is_some() { &[] } else { &[1] };
        let plain = self.plain(action, shape, label)?.call_method0("item")?;
        plain.extract().map_err(Into::into)
    }

    /// Reads the actions of `agents` one by one.
    fn each<'py, T: FromPyObjectOwned<'py>>(
        &self,
        actions: &Bound<'py, PyAny>,
        agents: &Bound<'py, PyList>,
        known: &Bound<'py, PyAny>,
        read: fn(&Bound<'_, PyAny>) -> Option<T>,
    ) -> PyResult<Vec<T>> {
        let py = actions.py();
        let dict = actions
            .cast::<PyDict>()
            .ok()
            .filter(|dict| dict.len() == agents.len());
        let check = || python(py, "check_agents", (actions, agents, known)).map(drop);
        if dict.is_none() {
            check()?;
        }
        let mut values = Vec::with_capacity(agents.len());
        for agent in agents {
            let action = match dict {
                Some(actions) => actions.get_item(&agent)?,
                None => Some(actions.get_item(&agent)?),
            };
            let Some(action) = action else {
                check()?;
                break; // check() has raised an error
            };
            values.push(match read(&action) {
                Some(value) => value,
                None => self.one(&action, read, &format!("action of {}", agent.repr()?))?,
            });
        }
        Ok(values)
    }

    /// Returns the error for an action outside of the action space.
    fn outside(&self, actions: &Bound<'_, PyAny>, place: usize, label: String) -> PyErr {
        let (low, high) = self.bounds();
        let size = self.grid.as_ref().map(|grid| grid.len());
        let error = python(
            actions.py(),
            "outside",
            (actions, place, label, low, high, size),
        );
        error.map_or_else(|error| error, PyErr::from_value)
    }

    /// Returns the bounds of the action space.
    fn bounds(&self) -> (f64, f64) {
        if self.is_normalized {
            (-1.0, 1.0)
        } else {
            (self.map.min_range, self.map.max_range)
        }
    }

    /// Returns the range of a continuous action, or NaN if it is outside of the action space.
    fn of_number(&self, value: f64) -> f64 {
        let (low, high) = self.bounds();
        let value = bindings::clipped(value, low, high);
        if self.is_normalized {
            self.map.of(value)
        } else {
            value
        }
    }
}

/// Returns the entries of predators' actions clipped to [-1, 1], with NaN for those outside of the action space.
#[pyfunction]
pub(crate) fn clipped<'py>(actions: PyReadonlyArray2<'py, f64>) -> Object<'py> {
    let shape = [actions.shape()[0], actions.shape()[1]];
    let entries = actions.as_slice()?.iter();
    let entries = entries.map(|entry| bindings::clipped(*entry, -1.0, 1.0));
    shaped(actions.py(), entries.collect(), shape)
}

/// Calls a function of `flockesc_env.episodes.action_checks`.
fn python<'py>(py: Python<'py>, name: &str, arguments: impl PyCallArgs<'py>) -> Object<'py> {
    let module = py.import("flockesc_env.episodes.action_checks")?;
    module.getattr(name)?.call1(arguments)
}

/// Returns the range of a discrete action, or NaN if it is outside of the action space.
fn entry(grid: &[f64], index: i64) -> f64 {
    let range = usize::try_from(index).ok().and_then(|at| grid.get(at));
    range.copied().unwrap_or(f64::NAN)
}

/// Returns the number in an array of shape (1,), if it can be read directly.
fn number(action: &Bound<'_, PyAny>) -> Option<f64> {
    fn only<T: Element + Into<f64>>(array: &Bound<'_, PyArray1<T>>) -> Option<f64> {
        let is_one = array.len() == 1 && array.is_aligned();
        is_one.then(|| array.get_owned(0).map(T::into))?
    }
    match action.cast::<PyArray1<f32>>() {
        Ok(array) => only(array),
        Err(_) => only(action.cast::<PyArray1<f64>>().ok()?),
    }
}

/// Returns an integer, if the action is one and not a bool.
fn index(action: &Bound<'_, PyAny>) -> Option<i64> {
    (!action.is_instance_of::<PyBool>()).then(|| action.extract().ok())?
}
