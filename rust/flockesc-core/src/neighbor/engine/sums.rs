//! `NeighborSums`: sum of the neighbors' velocities and number of neighbors of every agent (Eq. 11).

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use crate::agents::{Column, GROUP, Group};
use crate::base::vector::squared_norm;
use crate::neighbor::engine::candidates::Candidates;
use crate::neighbor::engine::pairs::Pairs;

/// Sums over the neighbors of the agents of one group. Values in empty lanes are unspecified.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct NeighborSums<const D: usize> {
    /// Sum of v_j over the neighbors N_i, in fixed point.
    pub(crate) sum: [Column<i64>; D],
    /// Number of neighbors |N_i|.
    pub(crate) count: Column<i64>,
    /// Norm of the sum in the same unit. The consensus force computes it.
    pub(crate) norm: Column<f64>,
}

impl<const D: usize> NeighborSums<D> {
    /// Sums over no agents.
    pub(crate) const EMPTY: Self = Self {
        sum: [[0; GROUP]; D],
        count: [0; GROUP],
        norm: [0.0; GROUP],
    };

    /// Creates the sums of agents whose only neighbor is the agent itself.
    pub(crate) fn isolated(group: &Group<D>) -> Self {
        let velocities = &group.fixed_velocity;
        let norm = |lane: usize| {
            let velocity: [f64; D] = std::array::from_fn(|axis| velocities[axis][lane] as f64);
            squared_norm(&velocity).sqrt()
        };
        Self {
            sum: *velocities,
            count: [1; GROUP],
            norm: std::array::from_fn(norm),
        }
    }

    /// Returns the sums of the agent in `lane`.
    pub(crate) fn of(&self, lane: usize) -> AgentSums<D> {
        AgentSums {
            sum: SVector::from_fn(|axis, _| self.sum[axis][lane]),
            count: self.count[lane],
            norm: self.norm[lane],
        }
    }

    /// Sets the sums of the agent in `lane`.
    pub(crate) fn set(&mut self, lane: usize, agent: &AgentSums<D>) {
        for axis in 0..D {
            self.sum[axis][lane] = agent.sum[axis];
        }
        (self.count[lane], self.norm[lane]) = (agent.count, agent.norm);
    }
}

/// The sums of one agent, for snapshots.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct AgentSums<const D: usize> {
    pub(crate) sum: SVector<i64, D>,
    pub(crate) count: i64,
    pub(crate) norm: f64,
}

/// Buffers that are reused from step to step.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scratch {
    pub(super) candidates: Candidates,
    /// Leaves near a leaf, for [`sum_pairs`].
    leaves: Vec<u32>,
    /// Whether the buffers of the last step were freed.
    pub(crate) is_trimmed: bool,
}

/// Memory in bytes that a chunk of groups keeps for candidates.
const MIN_BYTES: usize = 1024;
/// Smallest and largest memory in bytes that an agent's candidates keep. In between it grows with the square root
/// of the number of agents, as lists under a range of half the flock do. In dense flocks, candidates of a step
/// would take ten times as much, and a new search is faster than reading them.
const BYTES_PER_AGENT: (usize, usize) = (384, 1024);
const BYTES_PER_ROOT: usize = 12;

impl Scratch {
    /// Returns the memory in bytes that the buffers for `num_agents` agents of a chunk keep from step to step, in a
    /// flock of `flock` agents.
    pub(crate) fn most_bytes(num_agents: usize, flock: usize) -> usize {
        let per_agent = BYTES_PER_ROOT * flock.isqrt();
        MIN_BYTES + num_agents * per_agent.clamp(BYTES_PER_AGENT.0, BYTES_PER_AGENT.1)
    }

    /// Frees the buffers if they are larger than [`Self::most_bytes`].
    pub(crate) fn trim(&mut self, num_agents: usize, flock: usize) {
        let bytes = self.candidates.bytes() + self.leaves.capacity() * size_of::<u32>();
        self.is_trimmed = bytes > Self::most_bytes(num_agents, flock);
        if self.is_trimmed {
            (self.candidates, self.leaves) = Default::default();
        }
    }
}

/// Computes the sums of the groups from `first` on, from all pairs of neighbors.
pub(crate) fn sum_pairs<const D: usize>(
    pairs: Pairs<'_, D>,
    first: usize,
    sums: &mut [NeighborSums<D>],
    scratch: &mut Scratch,
) {
    for (group, sums) in (first..).zip(sums) {
        sums.count.fill(0);
        for sum in &mut sums.sum {
            sum.fill(0);
        }
        pairs.visit(group, &mut scratch.leaves, |lane, place| {
            let velocity = pairs.agents.fixed_velocity(place);
            for axis in 0..D {
                sums.sum[axis][lane] += velocity[axis];
            }
            sums.count[lane] += 1;
        });
    }
}

/// Removes the neighbors whose warnings are blocked from the sums of the groups from `first` on.
pub(crate) fn remove_warnings<const D: usize>(
    pairs: Pairs<'_, D>,
    first: usize,
    sums: &mut [NeighborSums<D>],
) {
    // PERF: Only reached agents are looked at, and few are: a predator reaches the edge of a flock.
    let places = 0..pairs.agents.len();
    let reached: Vec<_> = places
        .filter(|&place| pairs.agents.is_reached(place))
        .collect();
    for (group, sums) in (first..).zip(sums) {
        for lane in 0..pairs.agents.ids_of(group).len() {
            let own = group * GROUP + lane;
            for &other in &reached {
                if pairs.is_blocked(own, other) && pairs.is_neighbor(own, other) {
                    let velocity = pairs.agents.fixed_velocity(other);
                    for axis in 0..D {
                        sums.sum[axis][lane] -= velocity[axis];
                    }
                    sums.count[lane] -= 1;
                }
            }
        }
    }
}
