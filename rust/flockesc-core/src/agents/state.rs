//! Agents as plain data, in the order of places.

use serde::{Deserialize, Serialize};

use super::arrange::Agent;
use super::layout::{GROUP, Group};
use super::{Agents, Caught};
use crate::base::error::Result;
use crate::base::vector::SHORTEST;
use crate::snapshot::{check, check_numbers, vector};

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct AgentsState {
    names: Vec<u32>,
    /// r in m and v in m/s, D entries each.
    positions: Vec<f64>,
    velocities: Vec<f64>,
    /// ||v|| as the step left it, which may differ from the norm of v by a rounding.
    speeds: Vec<f64>,
    /// Names of those that have left, and where.
    caught: Vec<(u32, Vec<f64>)>,
}

/// Whether a speed is the length of a velocity, but for rounding.
fn is_norm((velocity, speed): (&[f64], &f64)) -> bool {
    let norm = velocity
        .iter()
        .map(|entry| entry * entry)
        .sum::<f64>()
        .sqrt();
    (norm - speed).abs() <= 1e-9 * norm || (norm.max(speed.abs()) < SHORTEST && *speed >= 0.0)
}

impl<const D: usize> Agents<D> {
    pub(crate) fn save(&self) -> AgentsState {
        let all = || (0..self.len()).map(|place| self.agent(place));
        AgentsState {
            names: self.names.clone(),
            positions: all().flat_map(|agent| agent.position).collect(),
            velocities: all().flat_map(|agent| agent.velocity).collect(),
            speeds: all().map(|agent| agent.speed).collect(),
            caught: self
                .caught
                .iter()
                .map(|agent| (agent.name, agent.position.to_vec()))
                .collect(),
        }
    }

    /// `num_agents` agents, whose distances to predators are yet to be found.
    pub(crate) fn restore(state: &AgentsState, num_agents: usize) -> Result<Self> {
        let count = state.names.len();
        let mut is_named = vec![false; num_agents];
        let gone = state.caught.iter().map(|(name, _)| name);
        for name in state.names.iter().chain(gone) {
            let is_named = is_named.get_mut(*name as usize);
            let is_new = is_named.is_some_and(|is_named| !std::mem::replace(is_named, true));
            check(is_new, "names of agents")?;
        }
        check(!is_named.contains(&false), "names of agents")?;
        check_numbers(&state.positions, count * D, "positions")?;
        check_numbers(&state.velocities, count * D, "velocities")?;
        check_numbers(&state.speeds, count, "speeds")?;
        let vectors = state.velocities.chunks_exact(D);
        check(vectors.zip(&state.speeds).all(is_norm), "speeds")?;
        let caught = state.caught.iter().map(|(name, position)| {
            Ok(Caught {
                name: *name,
                position: vector::<D>(position, "positions of agents that were caught")?.into(),
            })
        });
        let mut agents = Self {
            groups: vec![Group::EMPTY; count.div_ceil(GROUP).max(1)],
            names: state.names.clone(),
            caught: caught.collect::<Result<_>>()?,
            scratch: Vec::with_capacity(count),
        };
        for place in 0..count {
            let axes = place * D;
            agents.put(
                place,
                Agent {
                    position: std::array::from_fn(|axis| state.positions[axes + axis]),
                    velocity: std::array::from_fn(|axis| state.velocities[axes + axis]),
                    speed: state.speeds[place],
                    distance: f64::INFINITY,
                    name: state.names[place],
                },
            );
        }
        Ok(agents)
    }
}
