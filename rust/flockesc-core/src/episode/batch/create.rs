//! Construction of a batch, from one scenario for all slots or one per slot.

use std::collections::HashMap;
use std::sync::Arc;

use super::Batch;
use crate::base::error::{Error, Result};
use crate::episode::options::EpisodeConfig;
use crate::episode::slot::Slot;
use crate::flock::FlockConfig;
use crate::parallel;
use crate::reward::Term;
use crate::snapshot::Fingerprint;

/// Cost of a search for the neighbors under a candidate range, in units of the same search in a step.
const CANDIDATE_COST: usize = 4;

impl<const D: usize> Batch<D> {
    /// Creates a batch of `num_flocks` empty slots for a scenario of dimension D. `num_threads` of
    /// `None` is one thread per core.
    ///
    /// # Errors
    /// [`Error::Config`] if the scenario or `config` is out of bounds, or if the scenario has no
    /// predator or another dimension; [`Error::Argument`] if `num_flocks` is 0 or `num_threads` is
    /// out of bounds.
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
    /// As [`Self::new`]; [`Error::Config`] if the scenarios differ in the number of agents or of learned
    /// predators.
    pub fn with_scenarios(
        scenarios: &[Arc<FlockConfig>],
        config: EpisodeConfig,
        num_threads: Option<usize>,
    ) -> Result<Self> {
        config.check()?;
        let Some(first) = scenarios.first() else {
            return Err(Error::argument("num_flocks", "an integer of at least 1", 0));
        };
        let is_one = scenarios.iter().all(|other| Arc::ptr_eq(first, other));
        let mut known = HashMap::new();
        let mut slots = Vec::with_capacity(scenarios.len());
        let (mut work, mut observation_work): (usize, usize) = (0, 0);
        for (index, scenario) in scenarios.iter().enumerate() {
            let (fingerprint, work_per_step, work_per_observation) =
                match known.get(&Arc::as_ptr(scenario)) {
                    Some(found) => *found,
                    None => {
                        let label = if is_one {
                            String::new()
                        } else {
                            format!("scenario[{index}].")
                        };
                        check_scenario::<D>(scenario, first, &config, &label)?;
                        let fingerprint = Fingerprint::of(&(scenario.as_ref(), &config));
                        let observation = work_per_observation(scenario, &config);
                        let step = work_per_step(scenario, &config).saturating_add(observation);
                        let new = (fingerprint, step, observation);
                        known.insert(Arc::as_ptr(scenario), new);
                        new
                    }
                };
            let slot = Slot::new(index as u64, scenario.clone(), fingerprint);
            slots.push(Arc::new(slot));
            work = work.saturating_add(work_per_step);
            observation_work = observation_work.max(work_per_observation);
        }
        if scenarios.len() > 1 || num_threads.is_some() {
            parallel::pool(num_threads)?; // reports a bad number of threads before the first step
        }
        Ok(Self {
            row_length: config.entries(D).len(),
            config: Arc::new(config),
            slots,
            num_threads,
            work,
            observation_work,
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
    let field = |name: &str| format!("{label}{name}");
    let same = |count: usize, what: &str| format!("{count}{what}, as in scenario[0]");
    if scenario.dimension != D {
        return Err(Error::config(
            field("dimension"),
            D.to_string(),
            scenario.dimension,
        ));
    }
    if scenario.predators.is_empty() {
        let expected = "at least one predator, because rewards depend on the distance to it";
        return Err(Error::config(field("predators"), expected, "none"));
    }
    if scenario.num_agents != first.num_agents {
        let expected = same(first.num_agents, "");
        return Err(Error::config(
            field("num_agents"),
            expected,
            scenario.num_agents,
        ));
    }
    if scenario.num_learned() != first.num_learned() {
        let expected = same(first.num_learned(), " Learned");
        return Err(Error::config(
            field("predators"),
            expected,
            scenario.num_learned(),
        ));
    }
    Ok(())
}

/// Estimates the number of agents that one action visits in one flock, without its observation.
fn work_per_step(scenario: &FlockConfig, config: &EpisodeConfig) -> usize {
    let n = scenario.num_agents;
    let neighbors = scenario.neighbor_options();
    let visits = match config.reward.term::<2>() {
        Term::Team(_) | Term::Individual(_) => neighbors.work_per_agent(n, config.max_range),
        Term::Counterfactual(_) => n,
    };
    let steps = config.steps_per_action.min(scenario.num_steps);
    n.saturating_mul(visits).saturating_mul(steps)
}

/// Estimates the number of agents that the observation of one flock visits.
fn work_per_observation(scenario: &FlockConfig, config: &EpisodeConfig) -> usize {
    let n = scenario.num_agents;
    let neighbors = scenario.neighbor_options();
    let ranges = config.profile_ranges.iter();
    let visits = ranges.fold(1, |visits: usize, range| {
        visits.saturating_add(CANDIDATE_COST * neighbors.work_per_agent(n, *range))
    });
    n.saturating_mul(visits)
}
