//! `RangeMap`: conversion of actions into interaction ranges. Python prepares the actions and phrases the errors.

use std::sync::Arc;

use flockesc_core::{Error, NormalizedRange, bindings};
use numpy::{
    Element, IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray2, PyReadonlyArrayDyn,
    PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyBool;

use crate::arrays::{Object, shaped};
use crate::errors::CoreError;

/// Maps actions to interaction ranges, and actions outside of the action space to NaN.
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

    /// Returns the ranges of an array of actions.
    fn of_array<'py>(
        &self,
        actions: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let ranges = actions.as_slice()?.iter().map(|action| self.of(*action));
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
        let value = match (&self.grid, action.cast::<PyArray1<f32>>()) {
            (Some(_), _) if action.is_instance_of::<PyBool>() => None,
            (Some(_), _) => action.extract::<i64>().ok().map(|index| index as f64),
            (None, Ok(array)) => only(array),
            (None, Err(_)) => only(action.cast::<PyArray1<f64>>().ok()?),
        };
        Some(self.of(value?))
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

    /// Returns the range of a number or index, or NaN if it is outside of the action space.
    fn of(&self, value: f64) -> f64 {
        let NormalizedRange {
            min_range,
            max_range,
            ..
        } = self.map;
        match &self.grid {
            Some(grid) if value >= 0.0 => grid.get(value as usize).copied().unwrap_or(f64::NAN),
            Some(_) => f64::NAN,
            None if self.is_normalized => self.map.of(bindings::clipped(value, -1.0, 1.0)),
            None => bindings::clipped(value, min_range, max_range),
        }
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
