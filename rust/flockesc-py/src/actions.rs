//! `RangeMap`: conversion of actions into interaction ranges. Python prepares the actions and phrases the errors.

use std::sync::Arc;

use flockesc_core::{ActionOptions, RangeMap as Map, bindings};
use numpy::{
    Element, IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyBool;

use crate::arrays::{Object, shaped};
use crate::errors::CoreError;

/// Maps actions to interaction ranges, and actions outside of the action space to NaN.
#[pyclass(frozen, from_py_object, module = "flockesc_env._core")]
#[derive(Clone)]
pub(crate) struct RangeMap {
    pub(crate) map: Arc<Map>,
    document: Arc<str>,
}

#[pymethods]
impl RangeMap {
    /// Parses and checks the document of `ActionOptions`.
    #[new]
    fn new(options: &str) -> Result<Self, CoreError> {
        let map = Arc::new(ActionOptions::from_json(options)?.into());
        let document = Arc::from(options);
        Ok(Self { map, document })
    }

    /// Returns the arguments of the constructor, for copies and pickles.
    fn __getnewargs__(&self) -> (&str,) {
        (&self.document,)
    }

    /// The ranges of discrete actions, in the order of their indices; `None` in other modes.
    #[getter]
    fn grid(&self) -> Option<Vec<f64>> {
        self.map.grid().map(<[f64]>::to_vec)
    }

    /// Returns the action of each range.
    fn actions_of<'py>(
        &self,
        ranges: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let py = ranges.py();
        let actions = ranges
            .as_slice()?
            .iter()
            .map(|range| self.map.action_of(*range));
        let actions = actions
            .collect::<Result<Vec<_>, _>>()
            .map_err(CoreError::from)?;
        Ok(actions.into_pyarray(py))
    }

    /// Returns the ranges of an array of actions.
    fn of_array<'py>(
        &self,
        actions: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let ranges = actions
            .as_slice()?
            .iter()
            .map(|action| self.map.of(*action));
        Ok(ranges.collect::<Vec<_>>().into_pyarray(actions.py()))
    }

    /// Returns the range of each action, or `None` if an action is neither a plain array of one float32 or float64
    /// nor, with a grid, an integer.
    fn of_each<'py>(
        &self,
        py: Python<'py>,
        actions: Vec<Bound<'py, PyAny>>,
    ) -> Option<Bound<'py, PyArray1<f64>>> {
        let ranges = actions.iter().map(|action| self.of_one(action));
        Some(ranges.collect::<Option<Vec<_>>>()?.into_pyarray(py))
    }

    /// Returns the range of one action, or `None` as `of_each`.
    fn of_one(&self, action: &Bound<'_, PyAny>) -> Option<f64> {
        if action.is_instance_of::<PyUntypedArray>()
            && !action.is_exact_instance_of::<PyUntypedArray>()
        {
            return None; // a subclass may mask its entry
        }
        let value = match (self.map.grid(), action.cast::<PyArray1<f32>>()) {
            (Some(_), _) if action.is_instance_of::<PyBool>() => None,
            (Some(_), _) => action.extract::<i64>().ok().map(|index| index as f64),
            (None, Ok(array)) => only(array),
            (None, Err(_)) => only(action.cast::<PyArray1<f64>>().ok()?),
        };
        Some(self.map.of(value?))
    }
}

/// Returns the number in an array of shape (1,).
fn only<T: Element + Into<f64>>(array: &Bound<'_, PyArray1<T>>) -> Option<f64> {
    let is_one = array.len() == 1 && array.is_aligned();
    is_one.then(|| array.get_owned(0).map(T::into))?
}

/// Returns the entries of predators' actions clipped to [-1, 1], with NaN for those outside of the action space.
#[pyfunction]
pub(crate) fn clipped<'py>(actions: PyReadonlyArray2<'py, f64>) -> Object<'py> {
    let shape = [actions.shape()[0], actions.shape()[1]];
    let entries = actions.as_slice()?.iter();
    let entries = entries.map(|entry| bindings::clipped(*entry, -1.0, 1.0));
    shaped(actions.py(), entries.collect(), shape)
}
