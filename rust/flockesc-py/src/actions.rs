//! `RangeMap`: what an action means, the same in every interface.

use flockesc_core::Error;
use numpy::{
    Element, IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList};

use crate::arrays::shaped;
use crate::errors::CoreError;

/// Maps actions in plain form: float32 or float64 or, where there is a grid, int64. Other forms are left to
/// Python, which brings them into plain form or says what is wrong.
#[pyclass(frozen, module = "flockesc_env._core")]
#[derive(Clone)]
pub(crate) struct RangeMap {
    min_range: f64,
    max_range: f64,
    /// Whether actions lie in [-1, 1] instead of [`min_range`, `max_range`].
    is_normalized: bool,
    /// Ranges that an action is the index of.
    grid: Option<Vec<f64>>,
}

#[pymethods]
impl RangeMap {
    #[new]
    #[pyo3(signature = (min_range, max_range, is_normalized, grid))]
    fn new(min_range: f64, max_range: f64, is_normalized: bool, grid: Option<Vec<f64>>) -> Self {
        Self {
            min_range,
            max_range,
            is_normalized,
            grid,
        }
    }

    /// What copies and pickles are made from.
    fn __getnewargs__(&self) -> (f64, f64, bool, Option<Vec<f64>>) {
        (
            self.min_range,
            self.max_range,
            self.is_normalized,
            self.grid.clone(),
        )
    }

    /// Ranges of stacked actions in plain form, NaN for an action outside of the space.
    fn to_ranges<'py>(
        &self,
        py: Python<'py>,
        actions: &Bound<'py, PyUntypedArray>,
    ) -> Result<Bound<'py, PyArray1<f64>>, CoreError> {
        match self.ranges(actions.as_any(), actions.len()) {
            Some(ranges) => Ok(ranges.into_pyarray(py)),
            None => Err(Error::argument("action", "stacked actions in plain form", actions).into()),
        }
    }

    /// The range of a single action; `None` if it lies outside of the space or is not in plain form.
    pub(crate) fn to_range(&self, action: &Bound<'_, PyAny>) -> Option<f64> {
        let range = match &self.grid {
            Some(grid) => entry(grid, index(action)?),
            None => self.of_number(number(action)?),
        };
        (!range.is_nan()).then_some(range)
    }

    /// The actions of `agents`, stacked; `None` unless `actions` is a dict of just these, each in plain form.
    fn stack<'py>(
        &self,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
        agents: &Bound<'py, PyList>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let actions = match actions.cast::<PyDict>() {
            Ok(actions) if actions.len() == agents.len() => actions,
            _ => return Ok(None),
        };
        if self.grid.is_some() {
            let stacked = each(actions, agents, index)?;
            return Ok(stacked.map(|indices| indices.into_pyarray(py).into_any()));
        }
        let rows = [agents.len(), 1];
        match each(actions, agents, number)? {
            Some(numbers) => shaped(py, numbers, rows).map(Some),
            None => Ok(None),
        }
    }
}

impl RangeMap {
    /// Ranges of `count` stacked actions, NaN for an action outside of the space; `None` if they are not in plain
    /// form.
    pub(crate) fn ranges(&self, actions: &Bound<'_, PyAny>, count: usize) -> Option<Vec<f64>> {
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

    fn of_number(&self, value: f64) -> f64 {
        let (low, high) = if self.is_normalized {
            (-1.0, 1.0)
        } else {
            (self.min_range, self.max_range)
        };
        // The space's bounds are float32: an action on them must pass although float64 sees it beyond.
        let (least, most) = (f64::from(low as f32), f64::from(high as f32));
        if !(low.min(least)..=high.max(most)).contains(&value) {
            return f64::NAN;
        }
        let value = value.clamp(low, high);
        if self.is_normalized {
            self.min_range + (value + 1.0) / 2.0 * (self.max_range - self.min_range)
        } else {
            value
        }
    }
}

fn entry(grid: &[f64], index: i64) -> f64 {
    let range = usize::try_from(index).ok().and_then(|at| grid.get(at));
    range.copied().unwrap_or(f64::NAN)
}

/// The number in an array of shape (1,).
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

/// An integer that is no bool.
fn index(action: &Bound<'_, PyAny>) -> Option<i64> {
    (!action.is_instance_of::<PyBool>()).then(|| action.extract().ok())?
}

fn each<T>(
    actions: &Bound<'_, PyDict>,
    agents: &Bound<'_, PyList>,
    read: fn(&Bound<'_, PyAny>) -> Option<T>,
) -> PyResult<Option<Vec<T>>> {
    let mut values = Vec::with_capacity(agents.len());
    for agent in agents {
        match actions.get_item(agent)?.as_ref().and_then(read) {
            Some(value) => values.push(value),
            None => return Ok(None),
        }
    }
    Ok(Some(values))
}
