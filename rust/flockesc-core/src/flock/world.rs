//! `World`: a flock and its predators, and one step of the model in the order of docs/model.md.

mod state;

use std::sync::Arc;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;

pub(crate) use state::WorldState;

use super::initial_state::InitialState;
use super::motion::{Predators, Response, advance};
use crate::agents::{Agents, GROUP};
use crate::base::error::Result;
use crate::base::load::Load;
use crate::base::rng::{self, Stream};
use crate::flock::metrics::{PredatorDistance, measure};
use crate::flock::scenario::FlockConfig;
use crate::neighbor::{Neighborhood, Ranges};
use crate::parallel;
use crate::predator::{self, Predator, Prey, Surroundings};

/// A flock and its predators at one time.
///
/// ```
/// use std::sync::Arc;
/// use flockesc_core::{FlockConfig, InitialState, Ranges, World};
///
/// let mut world = World::<2>::new(Arc::new(FlockConfig::default()), &InitialState::seeded(7));
/// for _ in 0..10 {
///     world.step(Ranges::Shared(12.0))?;
/// }
/// let distance = world.predator_distance();
/// assert!(distance.minimum < distance.mean);
/// assert_eq!(world.positions().len(), world.config().num_agents);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct World<const D: usize> {
    config: Arc<FlockConfig>,
    agents: Agents<D>,
    predators: Vec<Predator<D>>,
    /// The random stream of the predators.
    rng: ChaCha8Rng,
    neighborhood: Neighborhood<D>,
    response: Response<D>,
    predator_distance: PredatorDistance,
    pub(crate) load: Load,
    /// Positions of the predators in m before and after the last step.
    before: Vec<[f64; D]>,
    after: Vec<[f64; D]>,
}

impl<const D: usize> World<D> {
    /// Creates the world at t = 0. `config.dimension` must be D, and `start` must pass
    /// [`InitialState::check`]. A randomized scenario must be [`FlockConfig::drawn`] with the seed of `start`.
    pub fn new(config: Arc<FlockConfig>, start: &InitialState) -> Self {
        let mut agents = Agents::new(&start.positions(&config), &start.velocities(&config));
        if let Some(side) = config.periodic_side {
            agents.wrap(side);
        }
        let neighborhood = Neighborhood::new(config.neighbor_options(), &mut agents);
        let (predators, response) = (start.predators(&config), Response::new(start.seed));
        let rng = rng::stream(start.seed, Stream::Predators);
        Self::assemble(config, agents, predators, rng, neighborhood, response)
    }

    /// Creates a world from its parts and computes the predator distances.
    fn assemble(
        config: Arc<FlockConfig>,
        agents: Agents<D>,
        predators: Vec<Predator<D>>,
        rng: ChaCha8Rng,
        neighborhood: Neighborhood<D>,
        response: Response<D>,
    ) -> Self {
        let after: Vec<[f64; D]> = predators.iter().map(|p| p.position.into()).collect();
        let mut world = Self {
            predator_distance: PredatorDistance::of::<D>(&[], 0),
            load: Load::default(),
            before: after.clone(),
            after,
            config,
            agents,
            predators,
            rng,
            neighborhood,
            response,
        };
        world.measure();
        world
    }

    /// Computes the predator distances of all agents.
    fn measure(&mut self) {
        measure(&mut self.agents.groups, &self.after);
        if self.config.blocks_warnings {
            self.agents.mark_reached(self.config.predator_range);
        }
        self.predator_distance = PredatorDistance::of(&self.agents.groups, self.agents.len());
    }

    /// Stops the counting of neighbors, which takes about 5 % of a step. Only for worlds that are never observed.
    pub(crate) fn stop_counting(&mut self) {
        // Sensing noise and some laws of motion depend on the number of neighbors.
        if self.config.sensing_noise <= 0.0 && !self.config.motion.needs().counts {
            self.neighborhood.stop_counting();
        }
    }

    /// Advances the flock and its predators by one time step dt with the interaction ranges `ranges`.
    ///
    /// # Errors
    /// [`crate::Error::Memory`] for the neighbor graph that the scenario freezes. The world is unchanged.
    pub fn step(&mut self, ranges: Ranges<'_>) -> Result<()> {
        self.step_with_force(ranges, &[])
    }

    /// As [`Self::step`], with an additional term of f_i: D entries per id, or none.
    pub(crate) fn step_with_force(&mut self, ranges: Ranges<'_>, extra: &[f64]) -> Result<()> {
        // Before anything changes, because only this can fail.
        self.neighborhood.freeze(&self.agents, ranges)?;
        let prey = Prey::new(&self.agents, &self.neighborhood);
        let (configs, time_step) = (&self.config.predators, self.config.time_step);
        // Learned predators see the flock of the time t, as their policy did.
        predator::prepare(configs, &mut self.predators, time_step, prey);
        if self.agents.len() > 0 {
            self.neighborhood.sum_neighbors(&mut self.agents, ranges);
            let (ids, num_agents) = (self.agents.ids(), self.agents.len());
            let num_heard = self.neighborhood.num_heard(num_agents);
            self.load.record(ranges.mean(ids), num_heard, num_agents);
        }
        // NOTE: The escape force needs the predators of the time t, captures those of t + dt: both stay in buffers.
        std::mem::swap(&mut self.before, &mut self.after);
        for (predator, after) in self.predators.iter_mut().zip(&mut self.after) {
            predator.position += predator.velocity * self.config.time_step;
            *after = predator.position.into();
        }
        let predators = Predators {
            before: &self.before,
            after: &self.after,
        };
        let (config, neighborhood) = (&self.config, &mut self.neighborhood);
        let forces = self
            .response
            .neighbor_forces(config, &self.agents, neighborhood, extra);
        let sums = neighborhood.sums_mut();
        let (groups, ids) = self.agents.groups_and_ids();
        parallel::for_each_pair(groups, sums, |first, groups, sums| {
            let ids = &ids[first * GROUP..];
            let forces = forces.map(|forces| &forces[first..]);
            advance(config, &predators, ids, groups, sums, forces);
        });
        // The kernel has written to empty lanes too, whose velocities must not enter sums.
        self.agents.clear_empty_places();
        self.response.apply_angular_noise(&mut self.agents);
        if let Some(side) = self.config.periodic_side {
            self.agents.wrap(side);
        }
        if let Some(radius) = self.config.capture_radius {
            // Observations show the neighbor sums of this step, so they move with their agents.
            let neighborhood = &mut self.neighborhood;
            self.agents
                .catch(radius, |from, to| neighborhood.relocate(from, to));
        }
        if self.config.blocks_warnings {
            self.agents.mark_reached(self.config.predator_range);
        }
        self.neighborhood.refresh(&mut self.agents);
        let surroundings = Surroundings {
            time_step: self.config.time_step,
            prey: Prey::new(&self.agents, &self.neighborhood),
            rng: &mut self.rng,
        };
        predator::steer(&self.config.predators, &mut self.predators, surroundings);
        self.predator_distance = PredatorDistance::of(&self.agents.groups, self.agents.len());
        Ok(())
    }

    /// Returns the number of pairs in the neighbor graph that the next step freezes; 0 if it freezes none.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub(crate) fn pairs_to_freeze(&self, ranges: Ranges<'_>) -> Result<usize> {
        let (agents, neighborhood) = (&self.agents, &self.neighborhood);
        if neighborhood.will_freeze() {
            neighborhood.with_pairs(agents, ranges, |pairs| pairs.count())
        } else {
            Ok(0)
        }
    }

    /// Sets the actions of the learned predators for the next steps: D entries in [-1, 1] per predator. With
    /// an empty slice they fly straight on.
    pub fn set_predator_actions(&mut self, actions: &[f64]) {
        predator::set_actions(&self.config.predators, &mut self.predators, actions);
    }

    /// Sets the positions in m, or the velocities in m/s, of all agents that are not caught: D entries per id.
    pub(crate) fn set(&mut self, vectors: &[f64], are_velocities: bool) {
        self.agents.set(vectors.as_chunks().0, are_velocities);
        if let Some(side) = self.config.periodic_side {
            self.agents.wrap(side);
        }
        self.measure();
        self.neighborhood.refresh_changed(&mut self.agents);
    }

    /// Returns the parameters, with the drawn numbers of a randomized scenario.
    pub fn config(&self) -> &FlockConfig {
        &self.config
    }

    /// Returns the positions r_i in m, in the order of ids. A caught agent keeps the position of its capture.
    pub fn positions(&self) -> Vec<SVector<f64, D>> {
        let mut positions = self.agents.by_id(|group| &group.position);
        for caught in self.agents.caught() {
            positions[caught.id as usize] = caught.position;
        }
        positions
    }

    /// Returns the velocities v_i in m/s, in the order of ids; 0 for caught agents.
    pub fn velocities(&self) -> Vec<SVector<f64, D>> {
        self.agents.by_id(|group| &group.velocity)
    }

    /// Returns the predators.
    pub fn predators(&self) -> &[Predator<D>] {
        &self.predators
    }

    /// Returns the agents in the form that predators use.
    pub(crate) fn prey(&self) -> Prey<'_, D> {
        Prey::new(&self.agents, &self.neighborhood)
    }

    /// Returns the mean and minimum predator distance in m.
    pub fn predator_distance(&self) -> PredatorDistance {
        self.predator_distance
    }

    /// Returns the ids of the caught agents, in the order of their capture.
    pub fn caught(&self) -> impl ExactSizeIterator<Item = usize> {
        self.agents.caught().iter().map(|agent| agent.id as usize)
    }

    /// Returns the fraction of the agents that were not caught.
    pub fn fraction_surviving(&self) -> f64 {
        self.agents.len() as f64 / self.agents.num_agents() as f64
    }

    /// Writes the predator distances d_i in m, in the order of ids; 0 for caught agents.
    pub fn write_distances(&self, out: &mut Vec<f64>) {
        out.clear();
        out.resize(self.agents.num_agents(), 0.0);
        for (index, group) in self.agents.groups.iter().enumerate() {
            for (&id, distance) in self.agents.ids_of(index).iter().zip(&group.distance) {
                out[id as usize] = *distance;
            }
        }
    }

    /// Returns the number of other agents that each agent heard in the last step, in the order of ids; 0 at t = 0 and
    /// for caught agents.
    pub fn heard(&self) -> Vec<i64> {
        let mut heard = vec![0; self.agents.num_agents()];
        for (place, &id) in self.agents.ids().iter().enumerate() {
            heard[id as usize] = self.neighborhood.sums()[place / GROUP].count[place % GROUP] - 1;
        }
        heard
    }

    /// Returns the number of weakly connected components under `ranges`.
    pub fn num_components(&self, ranges: Ranges<'_>) -> usize {
        self.neighborhood.num_components(&self.agents, ranges)
    }

    pub(crate) fn agents(&self) -> &Agents<D> {
        &self.agents
    }

    /// Returns the positions of the predators in m.
    pub(crate) fn predator_positions(&self) -> &[[f64; D]] {
        &self.after
    }

    pub(crate) fn neighborhood(&self) -> &Neighborhood<D> {
        &self.neighborhood
    }
}
