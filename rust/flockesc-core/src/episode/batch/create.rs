//! Construction of a batch, from one scenario for all slots or one per slot.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use super::Batch;
use crate::base::error::{Error, Result};
use crate::base::memory;
use crate::episode::options::EpisodeConfig;
use crate::episode::slot::Slot;
use crate::flock::{FlockConfig, flock_bytes};
use crate::parallel;
use crate::snapshot::Fingerprint;

/// Cost of a search for the neighbors under a candidate range, in units of the same search in a step.
const CANDIDATE_COST: usize = 4;

/// Number of copies of the observations and rewards: in the core, and in the arrays of an environment.
const ARRAYS: usize = 2;

impl<const D: usize> Batch<D> {
    /// Creates a batch of `num_flocks` empty slots for a scenario of dimension D. `num_threads` of
    /// `None` is one thread per core.
    ///
    /// # Errors
    /// [`Error::Input`] if the scenario or `config` is out of bounds, or if the scenario has no
    /// predator or another dimension; if `num_flocks` is 0 or `num_threads` is
    /// out of bounds; [`Error::Memory`].
    pub fn new(
        scenario: FlockConfig,
        config: EpisodeConfig,
        num_flocks: usize,
        num_threads: Option<usize>,
    ) -> Result<Self> {
        let scenario = Arc::new(scenario);
        Self::with_scenarios(&vec![scenario; num_flocks], config, num_threads)
    }

    /// Creates a batch with one empty slot per scenario. Scenarios are checked once per `Arc`, so equal ones
    /// should share it.
    ///
    /// # Errors
    /// As [`Self::new`]; [`Error::Input`] if the scenarios differ in the number of agents or of learned
    /// predators.
    pub fn with_scenarios(
        scenarios: &[Arc<FlockConfig>],
        config: EpisodeConfig,
        num_threads: Option<usize>,
    ) -> Result<Self> {
        config.check()?;
        let Some(first) = scenarios.first() else {
            return Err(Error::input("num_flocks", "an integer of at least 1", 0));
        };
        let is_one = scenarios.iter().all(|other| Arc::ptr_eq(first, other));
        let row_length = config.entries(D).len();
        let mut known = HashMap::new();
        let mut checked = Vec::with_capacity(scenarios.len());
        for (index, scenario) in scenarios.iter().enumerate() {
            let found = match known.entry(Arc::as_ptr(scenario)) {
                Entry::Occupied(found) => *found.get(),
                Entry::Vacant(place) => {
                    let mut label = String::new();
                    if !is_one {
                        label = format!("scenario[{index}].");
                    }
                    check_scenario::<D>(scenario, first, &config, &label)?;
                    *place.insert(Checked::new::<D>(scenario, &config, row_length))
                }
            };
            checked.push(found);
        }
        let bytes = checked.iter().map(|c| c.bytes);
        let field = if scenarios.len() == 1 {
            "num_agents"
        } else {
            "num_flocks"
        };
        memory::probe::<u8>(field, bytes.fold(0, usize::saturating_add))?;
        if scenarios.len() > 1 || num_threads.is_some() {
            parallel::pool(num_threads)?; // reports a bad number of threads before the first step
        }
        let work = checked.iter().map(|c| c.work);
        let observation_work = checked.iter().map(|c| c.observation_work);
        let slots = (0..).zip(scenarios).zip(&checked);
        let new_slot = |((index, scenario), found): ((u64, &Arc<FlockConfig>), &Checked)| {
            Arc::new(Slot::new(index, scenario.clone(), found.fingerprint))
        };
        Ok(Self {
            row_length,
            config: Arc::new(config),
            slots: slots.map(new_slot).collect(),
            num_threads,
            work: work.fold(0, usize::saturating_add),
            observation_work: observation_work.max().unwrap_or(0),
        })
    }
}

/// Checks a scenario of a batch. `label` stands before the names of fields in errors.
fn check_scenario<const D: usize>(
    scenario: &FlockConfig,
    first: &FlockConfig,
    config: &EpisodeConfig,
    label: &str,
) -> Result<()> {
    scenario.check()?;
    config.check_scenario(scenario)?;
    let refuse = |name: &str, expected: String, given: usize| {
        Err(Error::input(format!("{label}{name}"), expected, given))
    };
    let same = |count: usize, what: &str| format!("{count}{what}, as in scenario[0]");
    if scenario.dimension != D {
        return refuse("dimension", D.to_string(), scenario.dimension);
    }
    if scenario.predators.is_empty() {
        let expected = "at least one predator, because rewards depend on the distance to it";
        return Err(Error::input(format!("{label}predators"), expected, "none"));
    }
    if scenario.num_agents != first.num_agents {
        let expected = same(first.num_agents, "");
        return refuse("num_agents", expected, scenario.num_agents);
    }
    let (learned, expected) = (scenario.num_learned(), first.num_learned());
    if learned != expected {
        return refuse("predators", same(expected, " Learned"), learned);
    }
    Ok(())
}

/// A scenario that passed its checks: its fingerprint and estimates for one flock.
#[derive(Debug, Clone, Copy)]
struct Checked {
    fingerprint: Fingerprint,
    /// Number of agents that an action visits, with its observation.
    work: usize,
    /// Number of agents that an observation visits.
    observation_work: usize,
    /// Approximate memory in bytes of an episode and its arrays.
    bytes: usize,
}

impl Checked {
    fn new<const D: usize>(
        scenario: &FlockConfig,
        config: &EpisodeConfig,
        row_length: usize,
    ) -> Self {
        let (n, neighbors) = (scenario.num_agents, scenario.neighbor_options());
        let visits_per_step = if config.reward.repeats_actions() {
            n
        } else {
            neighbors.work_per_agent(n, config.max_range)
        };
        let steps = config.steps_per_action.min(scenario.num_steps);
        let work = n.saturating_mul(visits_per_step).saturating_mul(steps);
        let ranges = config.profile_ranges.iter();
        let observed = ranges.fold(1, |visits: usize, range| {
            visits.saturating_add(CANDIDATE_COST * neighbors.work_per_agent(n, *range))
        });
        let observation_work = n.saturating_mul(observed);
        let row_bytes = 2 * size_of::<f64>() + row_length * size_of::<f32>();
        let arrays = ARRAYS * config.view.rows(scenario) * row_bytes;
        Self {
            fingerprint: Fingerprint::of(&(scenario, config)),
            work: work.saturating_add(observation_work),
            observation_work,
            bytes: flock_bytes(scenario).saturating_add(arrays),
        }
    }
}
