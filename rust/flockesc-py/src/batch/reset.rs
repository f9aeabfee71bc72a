//! Resets of a batch.

use std::sync::Arc;

use flockesc_core::InitialState;
use flockesc_core::bindings::SlotReset;
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::FlockBatch;
use crate::arrays::{flat, shaped};
use crate::errors::try_borrow_mut;
use crate::info::columns;

/// Observations and metrics of the slots that were reset.
pub(super) type Began<'py> = (Bound<'py, PyAny>, Bound<'py, PyDict>);

/// The options of a reset, as `flockesc_env.episodes.starts` returns them.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(super) struct Start<'py> {
    initial_positions: Option<PyReadonlyArrayDyn<'py, f64>>,
    initial_velocities: Option<PyReadonlyArrayDyn<'py, f64>>,
    predator_positions: Option<PyReadonlyArrayDyn<'py, f64>>,
    predator_velocities: Option<PyReadonlyArrayDyn<'py, f64>>,
    episode: Option<u64>,
}

impl Start<'_> {
    /// Returns the number of the episode and copies of the arrays.
    fn plain(self) -> PyResult<(Option<u64>, Arc<InitialState>)> {
        let state = InitialState {
            seed: 0,
            positions: flat(self.initial_positions)?,
            velocities: flat(self.initial_velocities)?,
            predator_positions: flat(self.predator_positions)?,
            predator_velocities: flat(self.predator_velocities)?,
        };
        Ok((self.episode, Arc::new(state)))
    }
}

/// Starts new episodes in `slots`; see [`FlockBatch::reset`].
pub(super) fn reset<'py>(
    slf: &Bound<'py, FlockBatch>,
    py: Python<'py>,
    slots: &[usize],
    seeds: Vec<Option<u64>>,
    starts: Vec<Start<'py>>,
) -> PyResult<Began<'py>> {
    let this = &mut *try_borrow_mut(slf)?;
    let starts = starts
        .into_iter()
        .map(Start::plain)
        .collect::<PyResult<Vec<_>>>()?;
    let resets: Vec<_> = slots
        .iter()
        .zip(seeds)
        .zip(starts.iter().cycle())
        .map(|((&slot, seed), (episode, start))| SlotReset {
            slot,
            seed,
            episode: *episode,
            start: Arc::clone(start),
        })
        .collect();
    let counts = this.count_components;
    let (observations, measured) = this.inner.restart(py, resets, counts)?;
    let rows = slots.len() * this.rows;
    Ok((
        shaped(py, observations, [rows, this.row_length])?,
        columns(py, &measured)?,
    ))
}
