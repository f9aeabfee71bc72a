//! Memory layout of the agents: groups of 64, stored as columns for SIMD.

use multiversion::multiversion;

use crate::base::vector::{larger, smaller};
use crate::parallel;

/// Number of agents in a tile: one AVX-512 register of f64.
pub(crate) const TILE: usize = 8;
/// Number of tiles in a group, and of children of a node of the tree.
pub(crate) const FANOUT: usize = 8;
/// Number of agents in a group.
pub(crate) const GROUP: usize = TILE * FANOUT;

/// Returns whether a flock of `num_agents` is large enough to be stepped on several threads.
pub(crate) fn is_large(num_agents: usize) -> bool {
    num_agents / GROUP >= parallel::MIN_ITEMS
}

/// One value for every agent of a group. An agent's index in its group is its lane.
pub(crate) type Column<T> = [T; GROUP];

/// The agents of one group, column by column. Lanes without an agent have a position of NaN, for which every
/// comparison of distances is false.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct Group<const D: usize> {
    /// r in m.
    pub(crate) position: [Column<f64>; D],
    /// v in m/s; 0 in empty lanes.
    pub(crate) velocity: [Column<f64>; D],
    /// v in fixed point, in the unit of the tree; 0 in empty lanes. The tree computes it.
    pub(crate) fixed_velocity: [Column<i64>; D],
    /// ||v|| in m/s.
    pub(crate) speed: Column<f64>,
    /// Distance to the nearest predator in m; infinite without predators, NaN in empty lanes.
    pub(crate) distance: Column<f64>,
}

impl<const D: usize> Group<D> {
    pub(crate) const EMPTY: Self = Self {
        position: [[f64::NAN; GROUP]; D],
        velocity: [[0.0; GROUP]; D],
        fixed_velocity: [[0; GROUP]; D],
        speed: [0.0; GROUP],
        distance: [f64::NAN; GROUP],
    };

    /// Clears the lanes from `first` on.
    pub(super) fn empty_from(&mut self, first: usize) {
        for axis in 0..D {
            self.position[axis][first..].fill(f64::NAN);
            self.velocity[axis][first..].fill(0.0);
        }
        self.speed[first..].fill(0.0);
        self.distance[first..].fill(f64::NAN);
    }
}

/// Reduces values to one by pairwise folding of their halves. N is a power of two.
#[inline(always)]
pub(crate) fn reduce<T: Copy, const N: usize>(mut values: [T; N], fold: impl Fn(T, T) -> T) -> T {
    let mut width = N / 2;
    while width > 0 {
        for lane in 0..width {
            values[lane] = fold(values[lane], values[lane + width]);
        }
        width /= 2;
    }
    values[0]
}

/// Returns the corners in m of the bounding box of all agents.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(crate) fn corners<const D: usize>(groups: &[Group<D>]) -> ([f64; D], [f64; D]) {
    let (mut lowest, mut highest) = ([0.0; D], [0.0; D]);
    for axis in 0..D {
        let (mut low, mut high) = ([f64::INFINITY; GROUP], [f64::NEG_INFINITY; GROUP]);
        for group in groups {
            let column = &group.position[axis];
            for lane in 0..GROUP {
                low[lane] = smaller(low[lane], column[lane]);
                high[lane] = larger(high[lane], column[lane]);
            }
        }
        lowest[axis] = reduce(low, smaller);
        highest[axis] = reduce(high, larger);
    }
    (lowest, highest)
}
