//! Snapshots of a neighborhood. Sums are stored agent by agent, so that a snapshot does not depend on the layout of
//! groups; the tree and the reaches are rebuilt from the agents.

use serde::{Deserialize, Serialize};

use super::Neighborhood;
use crate::agents::{Agents, GROUP};
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::neighbor::engine::lists::Lists;
use crate::neighbor::engine::sums::AgentSums;
use crate::neighbor::options::NeighborOptions;
use crate::snapshot::{check, damaged, is_sound};

/// The sums of the last step, and the graph that is kept.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct NeighborhoodState<const D: usize> {
    /// In the order of places.
    sums: Vec<AgentSums<D>>,
    /// Unit of the sums in m/s.
    unit: f64,
    /// The graph of the first step, if it has been found and is kept.
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
        agents: &Agents<D>,
    ) -> Result<Self> {
        let counts = 1..=agents.num_agents() as i64;
        let is_possible = |agent: &AgentSums<D>| {
            counts.contains(&agent.count) && is_sound(agent.norm) && agent.norm >= 0.0
        };
        check(state.sums.len() == agents.len(), "sums over neighbors")?;
        check(state.sums.iter().all(is_possible), "sums over neighbors")?;
        let mut neighborhood = Self::new(options, agents);
        let scale = Scale::of_unit(state.unit).filter(|_| is_sound(state.unit));
        neighborhood.scale = scale.ok_or_else(|| damaged("unit of sums over neighbors"))?;
        for (place, agent) in state.sums.iter().enumerate() {
            neighborhood.sums[place / GROUP].set(place % GROUP, agent);
        }
        if let Some(lists) = state.frozen {
            let fits = options.is_frozen && lists.fit(agents.num_agents());
            check(fits, "neighbor graph")?;
            neighborhood.links.freeze(lists, agents);
        }
        Ok(neighborhood)
    }
}
