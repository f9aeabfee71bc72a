//! `FlockBatch`: Python class of a batch of flocks in two or three dimensions.

mod inner;
mod reset;
mod step;

use std::sync::Arc;

use flockesc_core::{
    Batch, EpisodeConfig, Error, FlockConfig, Progress, flock_entries, predator_entries,
};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};

use crate::actions::RangeMap;
use crate::arrays::{column, shaped};
use crate::errors::{CoreError, option_error, try_borrow, try_borrow_mut};
use crate::info::{self, metric_columns};
use crate::long_call::{long_call, read};
use crate::rollout::{networks, outcome_columns};
use inner::{Inner, on_batch};
use reset::{Began, Start};
use step::{Out, Step, StepFlock, StepOne};

#[pyclass(module = "flockesc_env._core")]
#[derive(Clone)]
pub(crate) struct FlockBatch {
    inner: Inner,
    actions: RangeMap,
    count_components: bool,
    rows: usize,
    row_length: usize,
    num_flocks: usize,
    made_from: MadeFrom,
    /// Buffers for observations and rewards, before they are copied into `out`.
    scratch: (Vec<f32>, Vec<f64>),
}

/// Writes observations of `slots`, which have this shape.
type Write<const D: usize> =
    fn(&Batch<D>, &[usize], &mut [f32], &Progress) -> flockesc_core::Result<()>;

/// Returns an array of this shape with the observations of `slots`.
fn rows<'py, const D: usize>(
    py: Python<'py>,
    batch: &Batch<D>,
    slots: Vec<usize>,
    shape: [usize; 2],
    write: Write<D>,
) -> PyResult<Bound<'py, PyAny>> {
    let visits = batch.work_of_observations(slots.len());
    let observations = read(py, batch, visits, move |batch, progress| {
        let mut observations = vec![0.0; shape[0] * shape[1]];
        write(batch, &slots, &mut observations, progress)?;
        Ok(observations)
    })?;
    shaped(py, observations, shape)
}

/// Arguments of the constructor: the different scenarios, the index of each slot's scenario, options and number
/// of threads.
type MadeFrom = (Vec<String>, Vec<usize>, String, Option<usize>);

#[pymethods]
impl FlockBatch {
    /// `scenarios` are the different scenarios, and `slots` is the index of each slot's scenario.
    #[new]
    #[pyo3(signature = (scenarios, slots, options, actions, num_threads, count_components, seed))]
    fn new(
        scenarios: Vec<String>,
        slots: Vec<usize>,
        options: String,
        actions: &Bound<'_, RangeMap>,
        num_threads: Option<usize>,
        count_components: bool,
        seed: u64,
    ) -> Result<Self, CoreError> {
        let parsed = scenarios
            .iter()
            .map(|document| Ok(Arc::new(FlockConfig::from_json(document)?)))
            .collect::<flockesc_core::Result<Vec<_>>>()?;
        let config = EpisodeConfig::from_json(&options).map_err(option_error)?;
        let per_slot: Option<Vec<_>> = slots
            .iter()
            .map(|index| parsed.get(*index).cloned())
            .collect();
        let Some(per_slot) = per_slot else {
            let expected = format!("indices below {}", parsed.len());
            return Err(Error::argument("slots", expected, format!("{slots:?}")).into());
        };
        let mut inner = match per_slot.first().map_or(2, |scenario| scenario.dimension) {
            2 => Inner::Plane(Batch::with_scenarios(&per_slot, config, num_threads)?),
            _ => Inner::Space(Batch::with_scenarios(&per_slot, config, num_threads)?),
        };
        on_batch!(&mut inner, batch => batch.seed(seed));
        let (rows, row_length) = on_batch!(&inner, batch => (batch.rows(), batch.row_length()));
        let num_flocks = slots.len();
        Ok(Self {
            inner,
            actions: actions.get().clone(),
            count_components,
            rows,
            row_length,
            num_flocks,
            made_from: (scenarios, slots, options, num_threads),
            scratch: Default::default(),
        })
    }

    /// Starts new episodes in `slots`. A seed starts a new schedule, and `None` continues the
    /// slot's schedule. `starts` has one entry per slot, or one for all.
    fn reset<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        slots: Vec<usize>,
        seeds: Vec<Option<u64>>,
        starts: Vec<Start<'py>>,
    ) -> PyResult<Began<'py>> {
        reset::reset(slf, py, &slots, seeds, starts)
    }

    /// Steps all flocks with stacked actions. `label(index)` returns the name of an action for
    /// errors.
    ///
    /// `at_end` determines what happens to a slot whose episode has ended: "refuse" raises an
    /// error, "restart" starts the next episode, and "stay" changes nothing. The slot's action is
    /// ignored, as are actions of caught agents. Observations and rewards are written to the arrays
    /// `out`, if they are given. `predator_actions` is an array, or a function that returns it; the
    /// function is called after all checks.
    #[pyo3(signature = (actions, label=None, at_end="refuse", out=None, predator_actions=None))]
    fn step<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
        label: Option<&Bound<'py, PyAny>>,
        at_end: &str,
        out: Option<Out<'py>>,
        predator_actions: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Step<'py>> {
        step::step(slf, py, actions, label, at_end, out, predator_actions)
    }

    /// Steps a batch of one flock, as `step` does. The end flag and the metrics are not arrays.
    #[pyo3(signature = (actions, label=None, predator_actions=None))]
    fn step_flock<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        actions: &Bound<'py, PyAny>,
        label: Option<&Bound<'py, PyAny>>,
        predator_actions: Option<Bound<'py, PyAny>>,
    ) -> PyResult<StepFlock<'py>> {
        step::step_flock(slf, py, actions, label, predator_actions)
    }

    /// Steps a batch of one flock with one shared range, as `step` does.
    #[pyo3(signature = (action, predator_actions=None))]
    fn step_one<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        action: &Bound<'py, PyAny>,
        predator_actions: Option<Bound<'py, PyAny>>,
    ) -> PyResult<StepOne<'py>> {
        step::step_one(slf, py, action, predator_actions)
    }

    /// Plays the flock of every seed to its end, under one network for all seeds or one per seed.
    ///
    /// Returns one array per outcome. The flocks of the batch stay unchanged. `candidates` are the
    /// ranges that the candidates set, for networks that score them. `report` is called with the
    /// number of finished flocks.
    #[pyo3(signature = (architecture, parameters, candidates, seeds, report=None))]
    fn rollout<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        architecture: &str,
        parameters: PyReadonlyArray2<'py, f32>,
        candidates: Vec<f64>,
        seeds: PyReadonlyArray1<'py, u64>,
        report: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (inner, actions) = {
            let this = try_borrow(slf)?;
            (this.inner.without_episodes(), this.actions.clone())
        };
        let seeds = seeds.as_slice()?.to_vec();
        let outcomes = on_batch!(inner, batch => {
            let entries = batch.entries();
            let networks = networks(architecture, &parameters, &entries, &actions, candidates)?;
            long_call(py, report, move |progress| batch.rollout(&networks, &seeds, progress))?
        });
        outcome_columns(py, &outcomes)
    }

    /// Returns the observations of `slots`, slot after slot.
    fn observe<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        slots: Vec<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &*try_borrow(slf)?;
        let shape = [slots.len() * this.rows, this.row_length];
        on_batch!(&this.inner, batch => rows(py, batch, slots, shape, Batch::observe))
    }

    /// Returns one row per slot: the flock view without optional entries.
    fn observe_flock<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        slots: Vec<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &*try_borrow(slf)?;
        let inner = &this.inner;
        let dimension = on_batch!(inner, batch => batch.dimension());
        let shape = [slots.len(), flock_entries(dimension).len()];
        on_batch!(inner, batch => rows(py, batch, slots, shape, Batch::observe_flock))
    }

    /// Returns the observations of the learned predators of `slots`, slot after slot and one row
    /// per predator.
    fn observe_predators<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        slots: Vec<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &*try_borrow(slf)?;
        let inner = &this.inner;
        let (learned, dimension) =
            on_batch!(inner, batch => (batch.num_learned(), batch.dimension()));
        let shape = [slots.len() * learned, predator_entries(dimension).len()];
        on_batch!(inner, batch => rows(py, batch, slots, shape, Batch::observe_predators))
    }

    /// Returns the metrics of all slots, one array per metric, without the number of components.
    fn metrics<'py>(slf: &Bound<'py, Self>, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let this = &*try_borrow(slf)?;
        let metrics = on_batch!(&this.inner, batch => {
            let visits = batch.work_of_observations(batch.num_flocks());
            read(py, batch, visits, Batch::metrics)
        })?;
        metric_columns(py, &metrics)
    }

    /// Returns the number of connected components of every slot under the ranges of its last
    /// action.
    fn num_components<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
    ) -> PyResult<Bound<'py, PyArray1<i64>>> {
        let this = &*try_borrow(slf)?;
        let components = on_batch!(&this.inner, batch => {
            read(py, batch, batch.work(), Batch::num_components)
        })?;
        Ok(column(py, &components, |count| *count as i64))
    }

    /// Returns the seed of the episode in a slot.
    fn episode_seed(slf: &Bound<'_, Self>, slot: usize) -> Result<u64, CoreError> {
        let this = &*try_borrow(slf)?;
        Ok(on_batch!(&this.inner, batch => batch.episode_seed(slot)?))
    }

    /// Returns whether the episode in a slot has ended.
    fn has_ended(slf: &Bound<'_, Self>, slot: usize) -> Result<bool, CoreError> {
        try_borrow(slf)?.inner.has_ended(slot)
    }

    /// Returns the state of a slot: step, ranges, distances, positions and velocities of agents and
    /// predators.
    fn state<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        slot: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let this = &*try_borrow(slf)?;
        on_batch!(&this.inner, batch => {
            info::state(py, batch.episode(slot).map_err(CoreError::from)?)
        })
    }

    /// Returns the team's reward of every flock in the last step, or the mean of individual rewards
    /// over its agents.
    fn team_rewards<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyArray1<f64>>, CoreError> {
        let inner = &try_borrow(slf)?.inner;
        Ok(on_batch!(inner, batch => batch.team_rewards()).into_pyarray(slf.py()))
    }

    /// Returns the predators' reward of every flock in the last step.
    fn predator_rewards<'py>(
        slf: &Bound<'py, Self>,
    ) -> Result<Bound<'py, PyArray1<f64>>, CoreError> {
        let inner = &try_borrow(slf)?.inner;
        Ok(on_batch!(inner, batch => batch.predator_rewards()).into_pyarray(slf.py()))
    }

    /// Returns whether each agent of each slot was caught.
    fn caught<'py>(slf: &Bound<'py, Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let this = &*try_borrow(slf)?;
        let caught = this.inner.is_caught()?;
        let agents = caught.len() / this.num_flocks;
        shaped(py, caught, [this.num_flocks, agents])
    }

    /// Returns a snapshot of `slots`.
    fn get_state<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        slots: Vec<usize>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let this = &*try_borrow(slf)?;
        for slot in &slots {
            this.inner.has_ended(*slot)?; // raises if the slot was never reset
        }
        this.inner.save(py, &slots)
    }

    /// Restores `slots` from a snapshot of as many slots, or of one. A rejected snapshot changes
    /// nothing.
    fn set_state(
        slf: &Bound<'_, Self>,
        py: Python<'_>,
        slots: Vec<usize>,
        state: &[u8],
    ) -> Result<(), CoreError> {
        let inner = &mut try_borrow_mut(slf)?.inner;
        Ok(py.detach(|| on_batch!(inner, batch => batch.restore(&slots, state)))?)
    }

    /// Drops the episodes of all slots.
    fn drop_episodes(slf: &Bound<'_, Self>) -> Result<(), CoreError> {
        let inner = &mut try_borrow_mut(slf)?.inner;
        *inner = inner.without_episodes();
        Ok(())
    }

    #[expect(clippy::type_complexity, reason = "the protocol of pickle")]
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(
        Bound<'py, PyType>,
        (
            Vec<String>,
            Vec<usize>,
            String,
            RangeMap,
            Option<usize>,
            bool,
            u64,
        ),
        Bound<'py, PyBytes>,
    )> {
        let batch = &*try_borrow(slf)?;
        let (scenarios, slots, options, num_threads) = batch.made_from.clone();
        let all: Vec<usize> = (0..batch.num_flocks).collect();
        let arguments = (
            scenarios,
            slots,
            options,
            batch.actions.clone(),
            num_threads,
            batch.count_components,
            0, // the state contains the seeds of all slots
        );
        Ok((slf.get_type(), arguments, batch.inner.save(slf.py(), &all)?))
    }

    fn __setstate__(slf: &Bound<'_, Self>, py: Python<'_>, state: &[u8]) -> Result<(), CoreError> {
        let all = (0..try_borrow(slf)?.num_flocks).collect();
        Self::set_state(slf, py, all, state)
    }

    /// Returns an independent copy.
    fn __deepcopy__(slf: &Bound<'_, Self>, _memo: &Bound<'_, PyAny>) -> Result<Self, CoreError> {
        Ok(try_borrow(slf)?.clone())
    }
}
