//! Steps of a batch.

use flockesc_core::Error;
use flockesc_core::bindings::AtEnd;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::FlockBatch;
use super::inner::{Inner, on_batch};
use crate::arrays::{Dict, vector};
use crate::errors::{CoreError, try_borrow, try_borrow_mut};
use crate::info::{Measured, numbers};

/// Output arrays for observations and rewards.
pub(super) type Out<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f64>>);

/// A step of all flocks.
pub(super) struct Stepped {
    pub(super) observations: Vec<f32>,
    pub(super) rewards: Vec<f64>,
    pub(super) ranges: Vec<f64>,
    pub(super) measured: Vec<Measured>,
    /// Whether the episode in each slot has ended.
    pub(super) ended: Vec<bool>,
}

impl Stepped {
    /// Returns the metrics of the first flock as numbers.
    pub(super) fn first<'py>(&self, py: Python<'py>) -> Dict<'py> {
        match self.measured.first() {
            Some(measured) => numbers(py, measured),
            None => Ok(PyDict::new(py)),
        }
    }
}

/// Returns the ranges of stacked actions, with 0 in rows whose action is ignored. `label(index)` returns the name
/// of an action for errors.
pub(super) fn ranges(
    slf: &Bound<'_, FlockBatch>,
    actions: &Bound<'_, PyAny>,
    label: Option<&Bound<'_, PyAny>>,
    at_end: AtEnd,
) -> PyResult<Vec<f64>> {
    let (map, rows) = {
        let this = try_borrow(slf)?;
        (this.actions.clone(), this.num_flocks * this.rows)
    };
    let mut ranges = map.ranges(actions, rows)?; // may call Python, so no borrow is held
    let is_ignored = try_borrow(slf)?.inner.is_ignored(at_end)?;
    for (range, is_ignored) in ranges.iter_mut().zip(is_ignored) {
        if is_ignored {
            *range = 0.0;
        }
    }
    map.check(&ranges, actions, label)?;
    Ok(ranges)
}

/// Steps all flocks with these ranges. `predator_actions` is an array, or a function that returns it.
pub(super) fn step(
    slf: &Bound<'_, FlockBatch>,
    ranges: Vec<f64>,
    at_end: AtEnd,
    predator_actions: Option<Bound<'_, PyAny>>,
) -> PyResult<Stepped> {
    let predator_actions = predator_actions_of(slf, predator_actions, at_end)?;
    let this = &mut *try_borrow_mut(slf)?;
    let (mut observations, mut rewards) = if this.scratch.1.is_empty() {
        (
            vec![0.0; ranges.len() * this.row_length],
            vec![0.0; ranges.len()],
        )
    } else {
        std::mem::take(&mut this.scratch)
    };
    let measured = this.inner.advance(
        slf.py(),
        (&ranges, &predator_actions),
        at_end,
        (&mut rewards, &mut observations),
        this.count_components,
    )?;
    Ok(Stepped {
        observations,
        rewards,
        ranges,
        measured,
        ended: this.inner.ended()?,
    })
}

/// Returns the actions of the learned predators from an array, or from a function that returns it. The
/// function may change the memory of a policy, so it is called after all other checks of a step.
fn predator_actions_of(
    slf: &Bound<'_, FlockBatch>,
    given: Option<Bound<'_, PyAny>>,
    at_end: AtEnd,
) -> PyResult<Vec<f64>> {
    let Some(given) = given else {
        return Ok(Vec::new());
    };
    if !given.is_callable() {
        return vector(&given.extract()?);
    }
    on_batch!(&try_borrow(slf)?.inner, batch => batch.check_episodes(at_end))
        .map_err(CoreError::from)?;
    vector(&given.call0()?.extract()?)
}

pub(super) fn parsed(at_end: &str) -> Result<AtEnd, CoreError> {
    match at_end {
        "refuse" => Ok(AtEnd::Refuse),
        "restart" => Ok(AtEnd::Restart),
        "stay" => Ok(AtEnd::Stay),
        other => Err(Error::input("at_end", "refuse, restart or stay", other).into()),
    }
}
