//! Spatial sort of the agents, so that agents that are close in space are close in memory.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::layout::TILE;
use crate::parallel;

/// Smallest number of agents whose halves are sorted on two threads.
const MIN_PARALLEL: usize = 1 << 14;

/// All data of one agent, for sorting and for snapshots.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Agent<const D: usize> {
    pub(super) id: u32,
    /// r in m.
    pub(super) position: SVector<f64, D>,
    /// v in m/s.
    pub(super) velocity: SVector<f64, D>,
    /// ||v|| in m/s, as the last step computed it. It may differ from the norm of `velocity` by rounding.
    pub(super) speed: f64,
    /// Distance to the nearest predator in m; recomputed after a restore.
    #[serde(skip)]
    pub(super) distance: f64,
}

/// Recursively splits the agents in two along the axis of their largest extent, as a k-d tree does. The size
/// of the first part is a power of two, so that tiles, groups and nodes of the tree are whole parts.
pub(super) fn split<const D: usize>(agents: &mut [Agent<D>]) {
    if agents.len() <= TILE {
        return;
    }
    let axis = longest_axis(agents);
    let middle = agents.len().next_power_of_two() / 2;
    agents.select_nth_unstable_by(middle, |a, b| a.position[axis].total_cmp(&b.position[axis]));
    let is_large = agents.len() >= MIN_PARALLEL;
    let (first, second) = agents.split_at_mut(middle);
    parallel::join(is_large, || split(first), || split(second));
}

fn longest_axis<const D: usize>(agents: &[Agent<D>]) -> usize {
    let (mut low, mut high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for agent in agents {
        for axis in 0..D {
            low[axis] = low[axis].min(agent.position[axis]);
            high[axis] = high[axis].max(agent.position[axis]);
        }
    }
    (1..D).fold(0, |best, axis| {
        if high[axis] - low[axis] > high[best] - low[best] {
            axis
        } else {
            best
        }
    })
}
