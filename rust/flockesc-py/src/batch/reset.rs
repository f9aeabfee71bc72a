//! Resets of a batch.

use std::sync::Arc;

use flockesc_core::InitialState;
use flockesc_core::bindings::SlotReset;
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;

use crate::arrays::flat;

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

/// Returns the resets of `slots`. `starts` has one entry per slot, or one for all.
pub(super) fn resets(
    slots: &[usize],
    seeds: Vec<Option<u64>>,
    starts: Vec<Start<'_>>,
) -> PyResult<Vec<SlotReset>> {
    let starts = starts
        .into_iter()
        .map(Start::plain)
        .collect::<PyResult<Vec<_>>>()?;
    let resets = slots.iter().zip(seeds).zip(starts.iter().cycle());
    let reset = |((&slot, seed), (episode, start)): ((&usize, _), &(_, Arc<_>))| SlotReset {
        slot,
        seed,
        episode: *episode,
        start: Arc::clone(start),
    };
    Ok(resets.map(reset).collect())
}
