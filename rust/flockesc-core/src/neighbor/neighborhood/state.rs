//! Snapshots of a neighborhood. Sums are stored per agent, so that a snapshot does not depend on the memory
//! layout. The tree and the reaches are recomputed on restore.

use serde::{Deserialize, Serialize};

use super::Neighborhood;
use crate::agents::{Agents, GROUP};
use crate::base::exact::Scale;
use crate::neighbor::engine::lists::Lists;
use crate::neighbor::engine::sums::AgentSums;
use crate::neighbor::options::NeighborOptions;

/// The serialized form of a [`Neighborhood`].
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct NeighborhoodState<const D: usize> {
    /// Sums of the last step, in the order of places.
    sums: Vec<AgentSums<D>>,
    /// Unit of the sums in m/s.
    unit: f64,
    /// The frozen graph, if there is one.
    frozen: Option<Lists>,
}

impl<const D: usize> Neighborhood<D> {
    pub(crate) fn save(&self, agents: &Agents<D>) -> NeighborhoodState<D> {
        let sums = |place: usize| self.sums[place / GROUP].of(place % GROUP);
        NeighborhoodState {
            sums: (0..agents.len()).map(sums).collect(),
            unit: self.scale.unit(),
            frozen: self.links.frozen().cloned(),
        }
    }

    pub(crate) fn restore(
        state: NeighborhoodState<D>,
        options: NeighborOptions,
        agents: &mut Agents<D>,
    ) -> Self {
        let mut neighborhood = Self::new(options, agents);
        neighborhood.scale = Scale::of_unit(state.unit);
        for (place, agent) in state.sums.iter().enumerate() {
            neighborhood.sums[place / GROUP].set(place % GROUP, agent);
        }
        if let Some(lists) = state.frozen {
            neighborhood.links.freeze(lists, agents);
        }
        neighborhood
    }
}
