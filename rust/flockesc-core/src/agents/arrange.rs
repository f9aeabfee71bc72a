//! The sort of agents by position: agents that are close in space become close in memory.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::layout::TILE;
use crate::parallel;

/// Smallest number of agents whose halves are sorted on two threads.
const FORK: usize = 1 << 14;

/// One agent, as a sort moves it and a snapshot stores it.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Agent<const D: usize> {
    pub(super) id: u32,
    /// r in m.
    pub(super) position: SVector<f64, D>,
    /// v in m/s.
    pub(super) velocity: SVector<f64, D>,
    /// ||v|| as the step left it, which may differ from the norm of v by a rounding.
    pub(super) speed: f64,
    /// Distance to the nearest predator in m; recomputed after a restore.
    #[serde(skip)]
    pub(super) distance: f64,
}

/// Halves the agents across their longest extent, recursively. The size of the first half is a power of two, so that
/// tiles, groups and nodes of the tree are whole halves.
pub(super) fn split<const D: usize>(agents: &mut [Agent<D>]) {
    if agents.len() <= TILE {
        return;
    }
    let axis = longest_axis(agents);
    let middle = agents.len().next_power_of_two() / 2;
    agents.select_nth_unstable_by(middle, |a, b| a.position[axis].total_cmp(&b.position[axis]));
    let is_large = agents.len() >= FORK;
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
