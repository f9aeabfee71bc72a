//! What was heard, and a graph that stays, as plain data; everything else is found anew from the agents.

use serde::{Deserialize, Serialize};

use crate::agents::{Agents, GROUP};
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::neighbor::engine::lists::Lists;
use crate::neighbor::{NeighborOptions, Neighborhood};
use crate::snapshot::{check, check_numbers, damaged, is_sound};

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct NeighborhoodState {
    /// Sums, D entries each, numbers and norms of the agents in their places.
    sums: Vec<i64>,
    counts: Vec<i64>,
    norms: Vec<f64>,
    /// The sums' unit in m/s.
    unit: f64,
    /// The graph of the first step, where it stays and has been found.
    frozen: Option<Lists>,
}

impl<const D: usize> Neighborhood<D> {
    pub(crate) fn save(&self, agents: &Agents<D>) -> NeighborhoodState {
        let all = || (0..agents.len()).map(|place| (&self.heard[place / GROUP], place % GROUP));
        NeighborhoodState {
            sums: all()
                .flat_map(|(heard, lane)| heard.sum.map(|column| column[lane]))
                .collect(),
            counts: all().map(|(heard, lane)| heard.count[lane]).collect(),
            norms: all().map(|(heard, lane)| heard.norm[lane]).collect(),
            unit: self.scale.unit(),
            frozen: self.links.frozen().cloned(),
        }
    }

    pub(crate) fn restore(
        state: NeighborhoodState,
        options: NeighborOptions,
        agents: &Agents<D>,
    ) -> Result<Self> {
        let num_agents = agents.num_names();
        let all = 1..=num_agents as i64;
        check(state.sums.len() == agents.len() * D, "velocities heard")?;
        check(state.counts.len() == agents.len(), "numbers of neighbors")?;
        check(
            state.counts.iter().all(|count| all.contains(count)),
            "numbers of neighbors",
        )?;
        check_numbers(&state.norms, agents.len(), "velocities heard")?;
        check(
            state.norms.iter().all(|norm| *norm >= 0.0),
            "velocities heard",
        )?;
        check(is_sound(state.unit), "unit of velocities heard")?;
        let mut neighborhood = Self::silent(options, agents);
        neighborhood.scale =
            Scale::of_unit(state.unit).ok_or_else(|| damaged("unit of velocities heard"))?;
        for place in 0..agents.len() {
            let (heard, lane) = (&mut neighborhood.heard[place / GROUP], place % GROUP);
            for axis in 0..D {
                heard.sum[axis][lane] = state.sums[place * D + axis];
            }
            heard.count[lane] = state.counts[place];
            heard.norm[lane] = state.norms[place];
        }
        if let Some(lists) = state.frozen {
            check(options.is_frozen && lists.fit(num_agents), "neighbor graph")?;
            neighborhood.links.freeze(lists, agents);
        }
        Ok(neighborhood)
    }
}
