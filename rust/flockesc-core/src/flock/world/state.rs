//! Snapshots of a world: one struct per component. Distances and summaries are recomputed on restore.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::World;
use crate::agents::{Agents, AgentsState};
use crate::base::load::Load;
use crate::base::rng::{self, Stream};
use crate::flock::motion::{Response, ResponseState};
use crate::flock::scenario::FlockConfig;
use crate::neighbor::{Neighborhood, NeighborhoodState};
use crate::predator::Predator;

/// The serialized form of a [`World`].
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct WorldState<const D: usize> {
    agents: AgentsState<D>,
    predators: Vec<Predator<D>>,
    /// Position in the random stream of the predators.
    stream_position: u128,
    neighborhood: NeighborhoodState<D>,
    response: ResponseState<D>,
    load: Load,
}

impl<const D: usize> World<D> {
    pub(crate) fn save(&self) -> WorldState<D> {
        WorldState {
            agents: self.agents.save(),
            predators: self.predators.clone(),
            stream_position: self.rng.get_word_pos(),
            neighborhood: self.neighborhood.save(&self.agents),
            response: self.response.save(),
            load: self.load,
        }
    }

    /// Restores a world that was started with `seed` in the drawn scenario `config`.
    pub(crate) fn restore(state: WorldState<D>, config: Arc<FlockConfig>, seed: u64) -> Self {
        let mut agents = Agents::restore(state.agents);
        let mut rng = rng::stream(seed, Stream::Predators);
        rng.set_word_pos(state.stream_position);
        let options = config.neighbor_options();
        let neighborhood = Neighborhood::restore(state.neighborhood, options, &mut agents);
        let response = Response::restore(state.response, seed);
        Self {
            load: state.load,
            ..Self::assemble(config, agents, state.predators, rng, neighborhood, response)
        }
    }
}
