//! One step of the flock, in the order of docs/model.md: listen, forces, integrate, keep speed, predators, capture.

mod state;

use std::sync::Arc;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;

pub(crate) use state::WorldState;

use super::motion::{self, Predators, Response};
use super::{InitialState, Summary};
use crate::agents::{Agents, GROUP};
use crate::base::rng::{self, Stream};
use crate::flock::metrics::{PredatorDistance, distances};
use crate::flock::scenario::FlockConfig;
use crate::neighbor::{Neighborhood, Ranges};
use crate::parallel;
use crate::predator::{self, Predator, Prey};

/// A flock and its predators at one moment.
#[derive(Debug, Clone)]
pub struct World<const D: usize> {
    config: Arc<FlockConfig>,
    agents: Agents<D>,
    predators: Vec<Predator<D>>,
    /// What is random about the predators.
    rng: ChaCha8Rng,
    neighborhood: Neighborhood<D>,
    response: Response<D>,
    predator_distance: PredatorDistance,
    /// Positions of the predators before and after the step being made.
    before: Vec<[f64; D]>,
    after: Vec<[f64; D]>,
}

impl<const D: usize> World<D> {
    /// The world at t = 0. `config.dimension` is D, and `start` has passed [`InitialState::check`]; what the scenario
    /// draws comes from its seed.
    #[must_use]
    pub fn new(config: Arc<FlockConfig>, start: &InitialState) -> Self {
        let config = config.drawn(start.seed);
        let mut agents = Agents::new(&start.positions(&config), &start.velocities(&config));
        let predators: Vec<Predator<D>> = start.predators(&config);
        let after: Vec<[f64; D]> = predators.iter().map(|p| p.position.into()).collect();
        if let Some(side) = config.periodic_side {
            agents.wrap(side);
        }
        for group in &mut agents.groups {
            group.distance = distances(&group.position, &after);
        }
        Self {
            predator_distance: PredatorDistance::of(&agents.groups, agents.len()),
            neighborhood: Neighborhood::silent(config.neighbor_options(), &agents),
            rng: rng::stream(start.seed, Stream::Predators),
            response: Response::new(start.seed),
            before: after.clone(),
            after,
            predators,
            agents,
            config,
        }
    }

    /// Advances from t to t + dt under `ranges`.
    pub fn step(&mut self, ranges: Ranges<'_>) {
        let prey = Prey {
            agents: &self.agents,
            neighborhood: &self.neighborhood,
        };
        predator::prepare(&mut self.predators, self.config.time_step, prey);
        if self.agents.len() > 0 {
            self.neighborhood.listen(&mut self.agents, ranges);
        }
        std::mem::swap(&mut self.before, &mut self.after);
        for (predator, after) in self.predators.iter_mut().zip(&mut self.after) {
            predator.position += predator.velocity * self.config.time_step;
            *after = predator.position.into();
        }
        let predators = Predators {
            before: &self.before,
            after: &self.after,
        };
        let config = &*self.config;
        let response = self
            .response
            .find(config, &self.agents, &mut self.neighborhood);
        let heard = self.neighborhood.heard_mut();
        let (groups, names) = self.agents.groups_and_names();
        parallel::for_each_chunk(groups, heard, |first, groups, heard| {
            let names = &names[first * GROUP..];
            let response = response.map(|forces| &forces[first..]);
            motion::advance(config, &predators, names, groups, heard, response);
        });
        self.agents.clear_empty_places();
        self.response.err(&mut self.agents);
        if let Some(side) = self.config.periodic_side {
            self.agents.wrap(side);
        }
        if let Some(radius) = self.config.capture_radius {
            let neighborhood = &mut self.neighborhood;
            self.agents
                .catch(radius, |from, to| neighborhood.relocate(from, to));
        }
        self.neighborhood.follow(&self.agents);
        let prey = Prey {
            agents: &self.agents,
            neighborhood: &self.neighborhood,
        };
        predator::steer(
            &mut self.predators,
            self.config.time_step,
            prey,
            &mut self.rng,
        );
        self.predator_distance = PredatorDistance::of(&self.agents.groups, self.agents.len());
    }

    /// Sets what learned predators are steered by from now on: D entries in [-1, 1] for each; none: they fly straight
    /// on.
    pub fn control(&mut self, controls: &[f64]) {
        predator::set_actions(&mut self.predators, controls);
    }

    /// The parameters, as drawn.
    #[must_use]
    pub fn config(&self) -> &FlockConfig {
        &self.config
    }

    /// r_i in m, in the order of the agents' names; of an agent that was caught: where.
    #[must_use]
    pub fn positions(&self) -> Vec<SVector<f64, D>> {
        let mut positions = self.agents.by_name(|group| &group.position);
        for caught in self.agents.caught() {
            positions[caught.name as usize] = caught.position.into();
        }
        positions
    }

    /// v_i in m/s, in the order of the agents' names; 0 of an agent that was caught.
    #[must_use]
    pub fn velocities(&self) -> Vec<SVector<f64, D>> {
        self.agents.by_name(|group| &group.velocity)
    }

    /// The predators.
    #[must_use]
    pub fn predators(&self) -> &[Predator<D>] {
        &self.predators
    }

    /// What predators see.
    pub(crate) fn prey(&self) -> Prey<'_, D> {
        Prey {
            agents: &self.agents,
            neighborhood: &self.neighborhood,
        }
    }

    /// Mean and minimum predator distance.
    #[must_use]
    pub fn predator_distance(&self) -> PredatorDistance {
        self.predator_distance
    }

    /// Names of the agents that were caught, in the order of the steps that caught them.
    pub fn caught(&self) -> impl ExactSizeIterator<Item = usize> {
        self.agents.caught().iter().map(|agent| agent.name as usize)
    }

    /// Share of the agents that were not caught.
    #[must_use]
    pub fn fraction_surviving(&self) -> f64 {
        self.agents.len() as f64 / self.agents.num_names() as f64
    }

    /// Writes d_i, the distance of every agent to its nearest predator in m, in the order of the agents' names; 0 of an
    /// agent that was caught.
    pub fn write_distances(&self, out: &mut Vec<f64>) {
        out.clear();
        out.resize(self.agents.num_names(), 0.0);
        for (index, group) in self.agents.groups.iter().enumerate() {
            for (&name, distance) in self.agents.names_of(index).iter().zip(&group.distance) {
                out[name as usize] = *distance;
            }
        }
    }

    /// Number of (weakly) connected components under `ranges`.
    #[must_use]
    pub fn num_components(&self, ranges: Ranges<'_>) -> usize {
        self.neighborhood.num_components(&self.agents, ranges)
    }

    /// Norm of the mean heading, in [0, 1].
    #[must_use]
    pub fn polarization(&self) -> f64 {
        Summary::of(self).polarization
    }

    pub(crate) fn agents(&self) -> &Agents<D> {
        &self.agents
    }

    /// r_p in m.
    pub(crate) fn predator_positions(&self) -> &[[f64; D]] {
        &self.after
    }

    pub(crate) fn neighborhood(&self) -> &Neighborhood<D> {
        &self.neighborhood
    }
}
