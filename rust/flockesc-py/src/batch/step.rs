//! Steps of a batch.

use flockesc_core::bindings::AtEnd;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use super::FlockBatch;
use super::inner::{Inner, by_dimension};
use crate::arrays::vector;
use crate::errors::{CoreError, named, try_borrow, try_borrow_mut};
use crate::info::Measured;

/// Output arrays for observations and rewards.
pub(super) type Out<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f64>>);

/// A step of all flocks.
pub(super) struct Stepped {
    pub(super) observations: Vec<f32>,
    pub(super) rewards: Vec<f64>,
    pub(super) measured: Vec<Measured>,
    /// Whether the episode in each slot has ended.
    pub(super) ended: Vec<bool>,
}

/// Steps all flocks with these ranges. `predator_actions` is an array, or a function that returns it.
pub(super) fn step(
    slf: &Bound<'_, FlockBatch>,
    ranges: &[f64],
    at_end: &str,
    predator_actions: Option<Bound<'_, PyAny>>,
) -> PyResult<Stepped> {
    let at_end = named("at_end", at_end)?;
    let ranges = ranges.to_vec(); // the caller may change its array during the call
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
    by_dimension!(&try_borrow(slf)?.inner, batch => batch.check_episodes(at_end))
        .map_err(CoreError::from)?;
    vector(&given.call0()?.extract()?)
}
