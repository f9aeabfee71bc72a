//! Spatial sort of the agents, so that agents that are close in space are close in memory.

use multiversion::multiversion;

use super::layout::{Column, GROUP, Group, TILE, reduce};
use crate::base::vector::{larger, smaller};
use crate::parallel;

/// Smallest number of agents whose halves are sorted on two threads.
const MIN_PARALLEL: usize = 1 << 14;

/// A place and the position of its agent. Small keys sort faster than agents.
#[derive(Debug, Clone, Copy)]
pub(super) struct Key<const D: usize> {
    /// Offset from the lowest corner of the flock, in units of its longest extent / 2^32.
    position: [u32; D],
    pub(super) place: u32,
}

/// Returns the places of the first `num_agents` agents in a new order, in which the agents of every tile, group and
/// node of the tree are close together.
pub(super) fn order<const D: usize>(
    groups: &[Group<D>],
    num_agents: usize,
    keys: &mut Vec<Key<D>>,
) {
    let (low, extent) = corner(groups);
    let scale = f64::from(u32::MAX) / extent;
    keys.clear();
    keys.extend((0..num_agents).map(|place| {
        let (group, lane) = (&groups[place / GROUP], place % GROUP);
        Key {
            position: std::array::from_fn(|axis| {
                ((group.position[axis][lane] - low[axis]) * scale) as u32
            }),
            place: place as u32,
        }
    }));
    split(keys);
}

/// Returns the lowest corner of the flock and its longest extent in m.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn corner<const D: usize>(groups: &[Group<D>]) -> ([f64; D], f64) {
    let (mut corner, mut longest) = ([0.0; D], 0.0);
    for axis in 0..D {
        let (mut low, mut high) = ([f64::INFINITY; GROUP], [f64::NEG_INFINITY; GROUP]);
        for group in groups {
            let column: &Column<f64> = &group.position[axis];
            for lane in 0..GROUP {
                low[lane] = smaller(low[lane], column[lane]);
                high[lane] = larger(high[lane], column[lane]);
            }
        }
        corner[axis] = reduce(low, smaller);
        longest = larger(longest, reduce(high, larger) - corner[axis]);
    }
    (corner, longest)
}

/// Recursively splits the keys in two along the axis of their largest extent, as a k-d tree does. The size
/// of the first part is a power of two, so that tiles, groups and nodes of the tree are whole parts.
fn split<const D: usize>(keys: &mut [Key<D>]) {
    if keys.len() <= TILE {
        return;
    }
    let axis = longest_axis(keys);
    let middle = keys.len().next_power_of_two() / 2;
    keys.select_nth_unstable_by_key(middle, |key| key.position[axis]);
    let is_large = keys.len() >= MIN_PARALLEL;
    let (first, second) = keys.split_at_mut(middle);
    parallel::join(is_large, || split(first), || split(second));
}

fn longest_axis<const D: usize>(keys: &[Key<D>]) -> usize {
    let (mut low, mut high) = ([u32::MAX; D], [0; D]);
    for key in keys {
        for axis in 0..D {
            low[axis] = low[axis].min(key.position[axis]);
            high[axis] = high[axis].max(key.position[axis]);
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
