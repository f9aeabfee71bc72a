//! `RangeMap`: conversion of actions into interaction ranges, with validation.

mod map;

use std::sync::Arc;

use flockesc_core::{Error, NormalizedRange};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::arrays::shaped;
use crate::errors::{CoreError, action_error};
use map::{Map, entry, index, number};

/// Maps actions to interaction ranges. Arrays of float32 or float64 are read directly, or of int64
/// with a grid. Other array-likes are converted by NumPy first.
#[pyclass(frozen, module = "flockesc_env._core")]
#[derive(Clone)]
pub(crate) struct RangeMap(Arc<Map>);

#[pymethods]
impl RangeMap {
    #[new]
    #[pyo3(signature = (min_range, max_range, is_normalized, grid))]
    fn new(min_range: f64, max_range: f64, is_normalized: bool, grid: Option<Vec<f64>>) -> Self {
        Self(Arc::new(Map {
            min_range,
            max_range,
            is_normalized,
            grid,
        }))
    }

    /// Returns the arguments of the constructor, for copies and pickles.
    fn __getnewargs__(&self) -> (f64, f64, bool, Option<Vec<f64>>) {
        let map = &self.0;
        (
            map.min_range,
            map.max_range,
            map.is_normalized,
            map.grid.clone(),
        )
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
        let map = &self.0;
        let range = match &map.grid {
            Some(grid) => match index(action) {
                Some(index) => entry(grid, index),
                None => entry(grid, map.plain_one(action, "action")?.extract()?),
            },
            None => match number(action) {
                Some(value) => map.of_number(value),
                None => map.of_number(map.plain_one(action, "action")?.extract()?),
            },
        };
        if range.is_nan() {
            return Err(map.outside(action, 0, "action".to_owned()));
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
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, map) = (actions.py(), &self.0);
        if map.grid.is_some() {
            let indices = map.each(actions, agents, known, index)?;
            return Ok(indices.into_pyarray(py).into_any());
        }
        let numbers = map.each(actions, agents, known, number)?;
        shaped(py, numbers, [agents.len(), 1])
    }
}

impl RangeMap {
    /// Returns the map from normalized actions to ranges.
    ///
    /// # Errors
    /// `ArgumentError` on `action_mode` if it is not `"normalized"`.
    pub(crate) fn normalized(&self) -> Result<NormalizedRange, CoreError> {
        let map = &self.0;
        if map.is_normalized && map.grid.is_none() {
            return Ok(map.normalized());
        }
        let given = if map.grid.is_some() {
            "'discrete'"
        } else {
            "'range'"
        };
        Err(Error::argument("action_mode", "'normalized'", given).into())
    }

    /// Returns the ranges of `count` stacked actions, with NaN for actions outside of the action
    /// space.
    pub(crate) fn ranges(&self, actions: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<f64>> {
        let map = &self.0;
        if let Some(ranges) = map.direct(actions, count) {
            return Ok(ranges);
        }
        let shape = if map.grid.is_some() {
            vec![count]
        } else {
            vec![count, 1]
        };
        let plain = map.plain(actions, &shape, "action")?;
        let ranges = map.direct(&plain, count);
        ranges.ok_or_else(|| action_error(actions.py(), "action", "an array", &plain))
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
        Err(self.0.outside(actions, first, name))
    }
}
