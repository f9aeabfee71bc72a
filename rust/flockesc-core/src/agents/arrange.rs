//! New places for agents, such that those that are near each other in the world are near each other in memory.

use super::layout::TILE;
use crate::parallel;

/// Agents from which on it pays to arrange two halves on two threads.
const FORK: usize = 1 << 14;

/// One agent, while all of them are being arranged.
#[derive(Debug, Clone, Copy)]
pub(super) struct Agent<const D: usize> {
    pub(super) position: [f64; D],
    pub(super) velocity: [f64; D],
    pub(super) speed: f64,
    pub(super) distance: f64,
    pub(super) name: u32,
}

/// Halves the agents across their longest extent, again and again. The first half takes a power of two, so that
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
