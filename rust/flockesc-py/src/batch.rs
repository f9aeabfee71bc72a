//! `FlockBatch`: Python class of a batch of flocks in two or three dimensions.

mod inner;
mod step;

use flockesc_core::{Batch, Episode, EpisodeConfig, Error};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

use crate::actions::RangeMap;
use crate::arrays::{Dict, Object, Tuple, column, overwrite, shaped};
use crate::errors::{CoreError, named, try_borrow, try_borrow_mut};
use crate::info::{self, columns, metric_columns, numbers, with_load};
use crate::long_call::{long_call, read};
use crate::models::flock;
use crate::rollout::{NetworkArguments, names, outcome_columns};
pub(crate) use inner::{Inner, by_dimension};
use inner::{Start, resets};
use step::Out;

#[pyclass(module = "flockesc_env._core")]
#[derive(Clone)]
pub(crate) struct FlockBatch {
    inner: Inner<Batch<2>, Batch<3>>,
    actions: RangeMap,
    count_components: bool,
    rows: usize,
    row_length: usize,
    num_flocks: usize,
    /// The seed is 0, because a snapshot contains the seeds of all slots.
    made_from: Arguments,
    /// Buffers for observations and rewards, before they are copied into `out`.
    scratch: (Vec<f32>, Vec<f64>),
}

/// Returns `measure(episode)` of all slots.
fn measured<const D: usize, T: Send + 'static>(
    py: Python<'_>,
    batch: &Batch<D>,
    visits: usize,
    measure: fn(&Episode<D>) -> T,
) -> PyResult<Vec<T>> {
    let all: Vec<usize> = (0..batch.num_flocks()).collect();
    read(py, batch, visits, move |batch, progress| {
        batch.measure(&all, progress, measure)
    })
}

/// Arguments of the constructor: the different scenarios, the index of each slot's scenario, options, actions, number of
/// threads, whether to count components, and the seed.
type Arguments = (
    Vec<String>,
    Vec<usize>,
    String,
    RangeMap,
    Option<usize>,
    bool,
    u64,
);

#[pymethods]
impl FlockBatch {
    #[new]
    #[pyo3(signature = (*arguments))]
    fn new(arguments: &Bound<'_, PyTuple>) -> Result<Self, CoreError> {
        let mut made_from: Arguments = arguments.extract()?;
        let (scenarios, slots, options, actions, num_threads, count_components, seed) = &made_from;
        let parsed = scenarios.iter().map(|document| flock(document));
        let parsed = parsed.collect::<PyResult<Vec<_>>>()?;
        let config = EpisodeConfig::from_json(options).map_err(CoreError::from)?;
        let per_slot: Option<Vec<_>> = slots
            .iter()
            .map(|index| parsed.get(*index).cloned())
            .collect();
        let Some(per_slot) = per_slot else {
            let expected = format!("indices below {}", parsed.len());
            return Err(Error::input("slots", expected, format!("{slots:?}")).into());
        };
        let mut inner = match per_slot.first().map_or(2, |scenario| scenario.dimension) {
            2 => Inner::Plane(Batch::with_scenarios(&per_slot, config, *num_threads)?),
            _ => Inner::Space(Batch::with_scenarios(&per_slot, config, *num_threads)?),
        };
        by_dimension!(&mut inner, batch => batch.seed(*seed));
        let (rows, row_length) = by_dimension!(&inner, batch => (batch.rows(), batch.row_length()));
        let (num_flocks, actions, count_components) =
            (slots.len(), actions.clone(), *count_components);
        made_from.6 = 0;
        Ok(Self {
            inner,
            actions,
            count_components,
            rows,
            row_length,
            num_flocks,
            made_from,
            scratch: Default::default(),
        })
    }

    /// Starts new episodes in `slots` and returns their observations and metrics. A seed starts a new schedule,
    /// and `None` continues the slot's schedule. `starts` has one entry per slot, or one for all.
    fn reset<'py>(
        slf: &Bound<'py, Self>,
        slots: Vec<usize>,
        seeds: Vec<Option<u64>>,
        starts: Vec<Start<'py>>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyDict>)> {
        let py = slf.py();
        let this = &mut *try_borrow_mut(slf)?;
        let shape = [slots.len() * this.rows, this.row_length];
        let resets = resets(&slots, seeds, starts)?;
        let (observations, measured) = this.inner.restart(py, resets, this.count_components)?;
        Ok((shaped(py, observations, shape)?, columns(py, &measured)?))
    }

    /// Draws the scenarios of the next episodes of `slots`, so that their reset after a step does not fail.
    fn draw_next(slf: &Bound<'_, Self>, slots: Vec<usize>) -> Result<(), CoreError> {
        let inner = &mut try_borrow_mut(slf)?.inner;
        by_dimension!(inner, batch => batch.draw_next(slots)).map_err(CoreError::from)
    }

    /// Steps all flocks with these ranges in m, and returns observations, rewards, whether each episode has ended,
    /// and metrics.
    ///
    /// `at_end` determines what happens to a slot whose episode has ended: "refuse" raises an
    /// error, "restart" starts the next episode, and "stay" changes nothing. The slot's ranges are
    /// ignored, as are those of caught agents. Observations and rewards are written to the arrays
    /// `out`, if they are given. `predator_actions` is an array, or a function that returns it; the
    /// function is called after all checks.
    #[pyo3(signature = (ranges, at_end, out, predator_actions))]
    fn step<'py>(
        slf: &Bound<'py, Self>,
        ranges: PyReadonlyArray1<'py, f64>,
        at_end: &str,
        out: Option<Out<'py>>,
        predator_actions: Option<Bound<'py, PyAny>>,
    ) -> Tuple<'py> {
        let py = slf.py();
        let stepped = step::step(slf, ranges.as_slice()?, at_end, predator_actions)?;
        let metrics = columns(py, &stepped.measured)?;
        let (observations, rewards) = match out {
            Some((observations, rewards)) => {
                overwrite(&observations, &stepped.observations)?;
                overwrite(&rewards, &stepped.rewards)?;
                try_borrow_mut(slf)?.scratch = (stepped.observations, stepped.rewards);
                (observations.into_any(), rewards)
            }
            None => {
                let shape = [stepped.rewards.len(), try_borrow(slf)?.row_length];
                let observations = shaped(py, stepped.observations, shape)?;
                (observations, stepped.rewards.into_pyarray(py))
            }
        };
        let ended = stepped.ended.into_pyarray(py);
        (observations, rewards, ended, metrics).into_pyobject(py)
    }

    /// Steps a batch with one range, and returns observation, reward, whether the episode has ended, and `info`.
    fn step_one<'py>(
        slf: &Bound<'py, Self>,
        interaction_range: f64,
        predator_actions: Option<Bound<'py, PyAny>>,
    ) -> Tuple<'py> {
        let py = slf.py();
        let stepped = step::step(slf, &[interaction_range], "refuse", predator_actions)?;
        let info = numbers(py, &stepped.measured[0])?;
        info.set_item(intern!(py, "interaction_range"), interaction_range)?;
        let observation = stepped.observations.into_pyarray(py);
        (observation, stepped.rewards[0], stepped.ended[0], info).into_pyobject(py)
    }

    /// Plays the flock of every seed to its end, under one network for all seeds or one per seed.
    ///
    /// Returns one array per outcome. The flocks of the batch stay unchanged. `report` is called with the
    /// number of finished flocks.
    #[pyo3(signature = (network, seeds, report=None))]
    fn rollout<'py>(
        slf: &Bound<'py, Self>,
        network: NetworkArguments<'py>,
        seeds: PyReadonlyArray1<'py, u64>,
        report: Option<&Bound<'py, PyAny>>,
    ) -> Dict<'py> {
        let py = slf.py();
        let (inner, actions) = {
            let this = try_borrow(slf)?;
            (this.inner.without_episodes(), this.actions.clone())
        };
        let seeds = seeds.as_slice()?.to_vec();
        let outcomes = by_dimension!(inner, batch => {
            let networks = network.networks(&names(batch.entries()), &actions)?;
            long_call(py, report, move |progress| batch.rollout(&networks, &seeds, progress))?
        });
        outcome_columns(py, &outcomes)
    }

    /// Returns the observations of `slots`, slot after slot: the rows of the batch's own view, "flock": one row
    /// per slot without optional entries, or "predators": one row per learned predator.
    #[pyo3(signature = (slots, view="own"))]
    fn observe<'py>(slf: &Bound<'py, Self>, slots: Vec<usize>, view: &str) -> Object<'py> {
        let py = slf.py();
        let this = &*try_borrow(slf)?;
        let observed = named("view", view)?;
        by_dimension!(&this.inner, batch => {
            let [rows, entries] = batch.shape_of(observed);
            let (visits, rows) = (batch.work_of_observations(slots.len()), slots.len() * rows);
            let observations = read(py, batch, visits, move |batch, progress| {
                batch.observe(&slots, observed, progress)
            })?;
            shaped(py, observations, [rows, entries])
        })
    }

    /// Returns the metrics of all slots, one array per metric, without the number of components.
    fn metrics<'py>(slf: &Bound<'py, Self>) -> Dict<'py> {
        let py = slf.py();
        let this = &*try_borrow(slf)?;
        let metrics = by_dimension!(&this.inner, batch => {
            let visits = batch.work_of_observations(batch.num_flocks());
            measured(py, batch, visits, Episode::metrics)?
        });
        with_load(metric_columns(py, &metrics)?, &metrics, |flock| flock.load)
    }

    /// Returns the number of connected components of every slot under the ranges of its last
    /// action.
    fn num_components<'py>(slf: &Bound<'py, Self>) -> Object<'py> {
        let py = slf.py();
        let this = &*try_borrow(slf)?;
        let components = by_dimension!(&this.inner, batch => {
            measured(py, batch, batch.work(), Episode::num_components)?
        });
        Ok(column(py, &components, |count| *count as i64))
    }

    /// Returns the seed of the episode in a slot.
    fn episode_seed(slf: &Bound<'_, Self>, slot: usize) -> Result<u64, CoreError> {
        let this = &*try_borrow(slf)?;
        Ok(by_dimension!(&this.inner, batch => batch.episode_seed(slot)?))
    }

    /// Returns whether the episode in each slot has ended.
    fn ended<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyArray1<bool>>, CoreError> {
        Ok(try_borrow(slf)?.inner.ended()?.into_pyarray(slf.py()))
    }

    /// Returns whether the episode in each slot has reached the limit of actions.
    fn reached_limit<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let py = slf.py();
        let reached = by_dimension!(&try_borrow(slf)?.inner, batch => {
            measured(py, batch, 0, Episode::has_reached_limit)?
        });
        Ok(reached.into_pyarray(py))
    }

    /// Returns whether the episode in a slot has ended.
    fn has_ended(slf: &Bound<'_, Self>, slot: usize) -> Result<bool, CoreError> {
        try_borrow(slf)?.inner.has_ended(slot)
    }

    /// Returns the state of a slot: step, ranges, distances, positions and velocities of agents and
    /// predators.
    fn state<'py>(slf: &Bound<'py, Self>, slot: usize) -> Dict<'py> {
        let py = slf.py();
        let this = &*try_borrow(slf)?;
        by_dimension!(&this.inner, batch => {
            info::state(py, batch.episode(slot).map_err(CoreError::from)?)
        })
    }

    /// Returns the predators' reward of every flock in the last step: minus the team's.
    fn predator_rewards<'py>(
        slf: &Bound<'py, Self>,
    ) -> Result<Bound<'py, PyArray1<f64>>, CoreError> {
        let inner = &try_borrow(slf)?.inner;
        let rewards = by_dimension!(inner, batch => batch.team_rewards()).into_iter();
        let negated: Vec<f64> = rewards.map(|reward| 0.0 - reward).collect();
        Ok(negated.into_pyarray(slf.py()))
    }

    /// Returns whether each agent of each slot was caught.
    fn caught<'py>(slf: &Bound<'py, Self>) -> Object<'py> {
        let py = slf.py();
        let this = &*try_borrow(slf)?;
        let caught = this.inner.is_caught()?;
        let agents = caught.len() / this.num_flocks;
        shaped(py, caught, [this.num_flocks, agents])
    }

    /// Returns a snapshot of `slots`.
    fn get_state<'py>(slf: &Bound<'py, Self>, slots: Vec<usize>) -> PyResult<Bound<'py, PyBytes>> {
        let py = slf.py();
        let this = &*try_borrow(slf)?;
        for slot in &slots {
            this.inner.has_ended(*slot)?; // raises if the slot was never reset
        }
        this.inner.save(py, &slots)
    }

    /// Restores `slots` from a snapshot of as many slots, or of one. A rejected snapshot changes
    /// nothing.
    fn set_state(slf: &Bound<'_, Self>, slots: Vec<usize>, state: &[u8]) -> Result<(), CoreError> {
        let py = slf.py();
        let inner = &mut try_borrow_mut(slf)?.inner;
        Ok(py.detach(|| by_dimension!(inner, batch => batch.restore(&slots, state)))?)
    }

    /// Drops the episodes of all slots.
    fn drop_episodes(slf: &Bound<'_, Self>) -> Result<(), CoreError> {
        let inner = &mut try_borrow_mut(slf)?.inner;
        *inner = inner.without_episodes();
        Ok(())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Tuple<'py> {
        let py = slf.py();
        let batch = &*try_borrow(slf)?;
        let all: Vec<usize> = (0..batch.num_flocks).collect();
        let (arguments, state) = (batch.made_from.clone(), batch.inner.save(py, &all)?);
        (slf.get_type(), arguments, state).into_pyobject(py)
    }

    fn __setstate__(slf: &Bound<'_, Self>, state: &[u8]) -> Result<(), CoreError> {
        let all = (0..try_borrow(slf)?.num_flocks).collect();
        Self::set_state(slf, all, state)
    }

    /// Returns an independent copy.
    fn __deepcopy__(slf: &Bound<'_, Self>, _memo: &Bound<'_, PyAny>) -> Result<Self, CoreError> {
        Ok(try_borrow(slf)?.clone())
    }
}
