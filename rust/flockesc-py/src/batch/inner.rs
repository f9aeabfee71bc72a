//! `Inner`: a batch or a flock in two or three dimensions, and the long-running calls of a batch.

use std::sync::Arc;

use flockesc_core::bindings::{AtEnd, Observed, SlotReset};
use flockesc_core::{Batch, Episode, InitialState, Progress};
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::flat;
use crate::errors::CoreError;
use crate::info::Measured;
use crate::long_call::{GRACE, LONG, change, long_step, maybe_detach};

/// A batch or a flock in two or three dimensions.
#[derive(Clone)]
pub(crate) enum Inner<P, S> {
    Plane(P),
    Space(S),
}

/// Evaluates the same expression in two or three dimensions.
macro_rules! by_dimension {
    ($inner:expr, $each:ident => $body:expr) => {
        match $inner {
            Inner::Plane($each) => $body,
            Inner::Space($each) => $body,
        }
    };
}
pub(crate) use by_dimension;

impl Inner<Batch<2>, Batch<3>> {
    /// Returns the same batch as before its first reset.
    pub(super) fn without_episodes(&self) -> Self {
        match self {
            Self::Plane(batch) => Self::Plane(batch.without_episodes()),
            Self::Space(batch) => Self::Space(batch.without_episodes()),
        }
    }

    /// Returns whether each agent was caught, slot after slot.
    pub(super) fn is_caught(&self) -> Result<Vec<bool>, CoreError> {
        by_dimension!(self, batch => {
            let mut all = Vec::new();
            for slot in 0..batch.num_flocks() {
                let world = batch.episode(slot)?.world();
                let first = all.len();
                all.resize(first + world.config().num_agents, false);
                world.caught().for_each(|agent| all[first + agent] = true);
            }
            Ok(all)
        })
    }

    /// Returns whether the episode in a slot has ended.
    pub(super) fn has_ended(&self, slot: usize) -> Result<bool, CoreError> {
        Ok(by_dimension!(self, batch => batch.episode(slot)?.has_ended()))
    }

    /// Returns whether the episode in each slot has ended.
    pub(super) fn ended(&self) -> Result<Vec<bool>, CoreError> {
        let flocks = by_dimension!(self, batch => batch.num_flocks());
        (0..flocks).map(|slot| self.has_ended(slot)).collect()
    }

    /// Returns a snapshot of `slots`.
    pub(super) fn save<'py>(
        &self,
        py: Python<'py>,
        slots: &[usize],
    ) -> PyResult<Bound<'py, PyBytes>> {
        let state = py
            .detach(|| by_dimension!(self, batch => batch.save(slots)))
            .map_err(CoreError::from)?;
        Ok(PyBytes::new(py, &state))
    }

    /// Starts new episodes and returns their observations and metrics. If the call is interrupted, the old
    /// episodes continue.
    pub(super) fn restart(
        &mut self,
        py: Python<'_>,
        resets: Vec<SlotReset>,
        count_components: bool,
    ) -> PyResult<(Vec<f32>, Vec<Measured>)> {
        by_dimension!(self, batch => {
            let visits = batch.work_of_reset(resets.len());
            change(py, batch, visits, move |batch, progress| {
                let slots: Vec<usize> = resets.iter().map(|reset| reset.slot).collect();
                batch.reset_many(resets, progress)?;
                let rows = batch.observe(&slots, Observed::Own, progress)?;
                let measure = |episode: &Episode<_>| Measured::of(episode, count_components);
                Ok((rows, batch.measure(&slots, progress, measure)?))
            })
        })
    }

    /// Steps all flocks. An interrupted step still ends if that takes at most 0.1 s. Otherwise all slots must be
    /// reset.
    pub(super) fn advance(
        &mut self,
        py: Python<'_>,
        (ranges, predator_actions): (&[f64], &[f64]),
        at_end: AtEnd,
        (rewards, observations): (&mut Vec<f64>, &mut Vec<f32>),
        count_components: bool,
    ) -> PyResult<Vec<Measured>> {
        by_dimension!(self, batch => {
            let measure = move |episode: &Episode<_>| Measured::of(episode, count_components);
            let visits = batch.work();
            if visits < LONG {
                let progress = Progress::default();
                let measured = maybe_detach(py, visits, || {
                    batch.step_measured((ranges, predator_actions), at_end, rewards, observations, &progress, measure)
                });
                return Ok(measured.map_err(CoreError::from)?);
            }
            let fallback = batch.without_episodes();
            let mut taken = std::mem::replace(batch, fallback);
            let (ranges, predator_actions) = (ranges.to_vec(), predator_actions.to_vec());
            let (mut out, mut rows) = (std::mem::take(rewards), std::mem::take(observations));
            let ended = long_step(py, None, GRACE, move |progress| {
                let action = (&ranges[..], &predator_actions[..]);
                let measured =
                    taken.step_measured(action, at_end, &mut out, &mut rows, progress, measure);
                Ok((taken, out, rows, measured))
            });
            let (stepped, interrupt) = match ended {
                Ok(stepped) => (Some(stepped), None),
                Err((interrupt, stepped)) => (stepped, Some(interrupt)),
            };
            let mut outcome = Ok(Vec::new());
            if let Some((stepped, out, rows, measured)) = stepped {
                *batch = stepped;
                (*rewards, *observations) = (out, rows);
                outcome = measured;
            }
            interrupt.map_or_else(|| Ok(outcome.map_err(CoreError::from)?), Err)
        })
    }
}

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
