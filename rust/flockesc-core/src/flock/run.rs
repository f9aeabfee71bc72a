//! `Run`: a flock that is stepped, changed and saved on demand, without the horizon of an episode.

use std::sync::Arc;

use super::initial_state::InitialState;
use super::scenario::FlockConfig;
use super::world::{World, WorldState};
use crate::agents::is_large;
use crate::base::check::{clipped, coordinates, rounding};
use crate::base::error::{Error, Result};
use crate::base::memory;
use crate::neighbor::Ranges;
use crate::parallel::{self, Progress};
use crate::snapshot::{Fingerprint, decode, encode};

/// A flock at one time. Arrays have D entries per agent or predator, in the order of ids.
#[derive(Debug, Clone)]
pub struct Run<const D: usize> {
    /// The scenario before random fields are drawn.
    scenario: Arc<FlockConfig>,
    num_threads: Option<usize>,
    world: World<D>,
    /// The seed, and the number of steps since t = 0.
    pub origin: (u64, usize),
    /// The step in which each agent was caught and the index of the nearest predator, or -1.
    pub captures: (Vec<i64>, Vec<i64>),
}

impl<const D: usize> Run<D> {
    /// Creates the flock at t = 0. `scenario.dimension` must be D. A large flock runs on `num_threads` threads.
    pub fn new(
        scenario: Arc<FlockConfig>,
        start: &InitialState,
        num_threads: Option<usize>,
    ) -> Result<Self> {
        scenario.check_draw(start.seed)?;
        probe_flocks(&scenario, 1)?;
        let nobody = vec![-1; scenario.num_agents];
        Ok(Self {
            world: World::new(scenario.clone(), start),
            num_threads,
            origin: (start.seed, 0),
            captures: (nobody.clone(), nobody),
            scenario,
        })
    }

    /// Advances the flock by `num_steps` steps with one range in m, or one per agent. `extra_force`, if there is one,
    /// is added to f_i. Learned predators without actions fly straight on.
    ///
    /// # Errors
    /// If an argument is out of bounds; the flock is then unchanged. If the call was cancelled, only some of the steps
    /// were made.
    pub fn step(
        &mut self,
        ranges: &[f64],
        num_steps: usize,
        predator_actions: &[f64],
        extra_force: &[f64],
        progress: &Progress,
    ) -> Result<()> {
        let learned = self.scenario.num_learned();
        check_predator_actions(predator_actions, learned * D)?;
        check_vectors::<D>("extra_force", extra_force)?;
        let ranges = match ranges {
            [range] => Ranges::Shared(*range),
            _ => Ranges::PerAgent(ranges),
        };
        let (is_large, threads) = (is_large(self.scenario.num_agents), self.num_threads);
        let mut run = || {
            (0..num_steps).try_for_each(|_| {
                progress.check()?;
                self.advance(ranges, predator_actions, extra_force)
            })
        };
        if is_large && threads != Some(1) {
            parallel::pool(threads)?.install(run)
        } else {
            rounding()?;
            run()
        }
    }

    /// Makes a step on the threads of the caller.
    pub(super) fn advance(
        &mut self,
        ranges: Ranges<'_>,
        predator_actions: &[f64],
        extra_force: &[f64],
    ) -> Result<()> {
        self.world.set_predator_actions(predator_actions);
        self.world.step_pushed(ranges, extra_force)?;
        self.origin.1 += 1;
        let (caught_at, caught_by) = &mut self.captures;
        for (agent, predator) in self.world.captures().rev() {
            if caught_at[agent] >= 0 {
                break; // so were all before
            }
            (caught_at[agent], caught_by[agent]) = (self.origin.1 as i64, predator);
        }
        Ok(())
    }

    /// Sets the positions in m, which a periodic domain wraps, or the velocities in m/s of all agents that are not
    /// caught.
    pub fn set(&mut self, field: &str, vectors: &[f64]) -> Result<()> {
        check_vectors::<D>(field, vectors)?;
        self.world.set(vectors, field == "velocities");
        Ok(())
    }

    /// Returns a snapshot.
    pub fn save(&self) -> Result<Vec<u8>> {
        let state = (self.origin, &self.captures, self.world.save());
        encode(self.fingerprint(), &state)
    }

    /// Restores a snapshot of the same scenario. A rejected one changes nothing.
    pub fn restore(&mut self, state: &[u8]) -> Result<()> {
        let (origin, captures, world): ((u64, usize), _, WorldState<D>) =
            decode(self.fingerprint(), state)?;
        self.world = World::restore(world, &self.scenario, origin.0);
        (self.origin, self.captures) = (origin, captures);
        Ok(())
    }

    fn fingerprint(&self) -> Fingerprint {
        Fingerprint::of(&(&*self.scenario, "run"))
    }

    /// Estimates the number of agents that a step visits.
    pub fn work(&self, ranges: &[f64]) -> usize {
        let (n, range) = (self.scenario.num_agents, ranges.iter().copied());
        let options = self.scenario.neighbor_options();
        n.saturating_mul(options.work_per_agent(n, range.fold(0.0, f64::max)))
    }

    /// Returns the flock and its predators.
    pub fn world(&self) -> &World<D> {
        &self.world
    }
}

fn check_vectors<const D: usize>(field: &str, vectors: &[f64]) -> Result<()> {
    coordinates(vectors, |at| format!("{field}[{}, {}]", at / D, at % D))
}

/// Checks that all ranges are finite and at least 0.
///
/// # Errors
/// [`Error::Input`] naming the first entry of `field` that is not.
pub fn check_ranges(field: &str, ranges: &[f64]) -> Result<()> {
    let is_valid = |range: &f64| (*range >= 0.0) & (*range <= f64::MAX);
    // Without a branch per range this is vectorized.
    if ranges.iter().fold(true, |all, range| all & is_valid(range)) {
        return Ok(());
    }
    match ranges.iter().position(|range| !is_valid(range)) {
        Some(at) => Err(Error::input(
            format!("{field}[{at}]"),
            "a finite number of at least 0",
            ranges[at],
        )),
        None => Ok(()),
    }
}

/// Checks the actions of learned predators: `count` entries or none, each in [-1, 1] up to rounding in float32.
///
/// # Errors
/// [`Error::Input`] naming the wrong length or the first entry out of bounds.
pub fn check_predator_actions(actions: &[f64], count: usize) -> Result<()> {
    if !actions.is_empty() && actions.len() != count {
        let (expected, given) = (
            format!("{count} entries"),
            format!("{} entries", actions.len()),
        );
        return Err(Error::input("predator_actions", expected, given));
    }
    match actions.iter().position(|c| clipped(*c, -1.0, 1.0).is_nan()) {
        Some(at) => Err(Error::input(
            format!("predator_actions[{at}]"),
            "a number from -1 to 1",
            actions[at],
        )),
        None => Ok(()),
    }
}

/// Memory in bytes of a flock without its agents, rounded: one group of agents and the buffers of its slot.
const FLOCK_BYTES: usize = 1 << 14;

/// Memory in bytes of an agent in a large flock, rounded: its columns, sums and neighbor candidates.
const AGENT_BYTES: usize = 1 << 10;

/// Returns the approximate memory in bytes of a flock, with its delayed forces and without a frozen graph.
pub(crate) fn flock_bytes(config: &FlockConfig) -> usize {
    let past = config.sensing_delay.min(config.num_steps);
    let delayed = past.saturating_mul(config.dimension * size_of::<f64>());
    let agents = config
        .num_agents
        .saturating_mul(AGENT_BYTES.saturating_add(delayed));
    FLOCK_BYTES.saturating_add(agents)
}

/// Asks the system for the memory of this many flocks; see [`memory::probe`].
pub(crate) fn probe_flocks(config: &FlockConfig, num_flocks: usize) -> Result<()> {
    memory::probe::<u8>("num_agents", num_flocks.saturating_mul(flock_bytes(config)))
}
