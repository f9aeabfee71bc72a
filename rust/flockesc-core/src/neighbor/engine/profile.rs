//! The SIMD kernel of the neighbor sums under several ranges, if neighbors are determined by distances alone.
//!
//! One descent of the tree serves all ranges. Nodes entirely within a range are added to its sums at once.
//! Squared distances of agents are computed once, and compared only with the ranges that a pair of tiles is
//! partly within.

use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Agents, Column, FANOUT, GROUP, TILE};
use crate::neighbor::engine::box_distances::{BoxDistances, Total, find_groups, sum_enclosed};
use crate::neighbor::engine::nodes::Bounds;
use crate::neighbor::engine::own::lanes;
use crate::neighbor::engine::reach::squared_norm;
use crate::neighbor::engine::sums::NeighborSums;
use crate::neighbor::engine::tree::Tree;

/// Number of groups whose tiles are tested at once: one bit of a word per tile.
const BATCH: usize = u64::BITS as usize / FANOUT;

/// Number of tiles whose packed velocities are summed before they are unpacked: at most 2^5 agents.
const PACKED_TILES: usize = 4;

/// Number of bits for the number of agents in a packed sum. A velocity in fixed point has 52 bits with its
/// sign, so a packed sum has 52 + 5 + 6.
const COUNT_BITS: u32 = 6;

/// Velocity of an agent in fixed point. The lowest bits of the first coordinate count agents: one addition
/// then serves both sums.
type Packed<const D: usize> = [u64; D];

/// Squared distances in m^2 of the agents of two tiles. A row has the distances of one agent.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
struct Distances([[f64; TILE]; TILE]);

/// Buffers that are reused from group to group.
#[derive(Debug, Clone)]
pub(in crate::neighbor) struct ProfileScratch<const D: usize> {
    /// Velocities of all agents, tile by tile.
    packed: Vec<[Packed<D>; TILE]>,
    /// Stack of the nodes to visit, as pairs (level, block).
    stack: Vec<(usize, usize)>,
    /// Groups partly within some range of a group.
    groups: Vec<usize>,
    /// Totals of the other nodes within each range of a group.
    totals: Vec<Total<D>>,
    /// One bit per tile of a batch for each range: whether the tile is partly within it.
    across: Vec<u64>,
    /// Distances of the tiles of a batch that are partly within some range.
    distances: Vec<Distances>,
}

impl<const D: usize> ProfileScratch<D> {
    /// Creates the buffers for the agents of `tree`.
    pub(in crate::neighbor) fn new(tree: &Tree<D>, num_ranges: usize) -> Self {
        let packed =
            |tile: usize| std::array::from_fn(|lane| pack(tree.velocity(tile * TILE + lane)));
        let num_groups = tree.velocities.len();
        Self {
            packed: (0..num_groups * FANOUT).map(packed).collect(),
            stack: Vec::new(),
            groups: Vec::new(),
            totals: vec![Total::EMPTY; num_ranges],
            across: vec![0; num_ranges],
            distances: vec![Distances([[0.0; TILE]; TILE]); num_groups.min(BATCH) * FANOUT],
        }
    }

    /// Returns the memory in bytes for this many agents.
    pub(in crate::neighbor) fn bytes(num_agents: usize) -> usize {
        let num_tiles = num_agents.div_ceil(GROUP) * FANOUT;
        num_tiles * size_of::<[Packed<D>; TILE]>()
            + num_tiles.min(BATCH * FANOUT) * size_of::<Distances>()
    }
}

/// Packs the velocity of an agent and the number 1.
fn pack<const D: usize>(velocity: [i64; D]) -> Packed<D> {
    let mut packed = velocity.map(|units| units as u64);
    packed[0] = (packed[0] << COUNT_BITS) + 1;
    packed
}

/// Computes the sums of one group under each range. `squares` are the squared ranges in m^2, in ascending
/// order.
pub(in crate::neighbor) fn sum_profile<const D: usize>(
    agents: &Agents<D>,
    tree: &Tree<D>,
    squares: &[f64],
    group: usize,
    sums: &mut [NeighborSums<D>],
    scratch: &mut ProfileScratch<D>,
) {
    Arch::new().dispatch(SumProfile {
        agents,
        tree,
        squares,
        group,
        sums,
        scratch,
    });
}

/// The arguments of [`sum_profile`], for dispatch to an instruction set.
pub(in crate::neighbor) struct SumProfile<'a, const D: usize> {
    pub(in crate::neighbor) agents: &'a Agents<D>,
    pub(in crate::neighbor) tree: &'a Tree<D>,
    pub(in crate::neighbor) squares: &'a [f64],
    pub(in crate::neighbor) group: usize,
    pub(in crate::neighbor) sums: &'a mut [NeighborSums<D>],
    pub(in crate::neighbor) scratch: &'a mut ProfileScratch<D>,
}

impl<const D: usize> WithSimd for SumProfile<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            agents,
            tree,
            squares,
            group,
            sums,
            scratch,
        } = self;
        let ProfileScratch {
            packed,
            stack,
            groups,
            totals,
            across,
            distances,
        } = scratch;
        let tiles = &tree.levels[0][group];
        find_groups(simd, tree, &tiles.bounds(), squares, stack, groups, totals);
        for tile in 0..agents.ids_of(group).len().div_ceil(TILE) {
            let own = OwnTile {
                positions: &agents.groups[group].position,
                bounds: tiles.bounds_of(tile),
                first: tile * TILE,
            };
            for (sums, total) in sums.iter_mut().zip(&*totals) {
                own.set(total, sums);
            }
            for batch in groups.chunks(BATCH) {
                own.add_enclosed(simd, tree, batch, squares, sums, across);
                own.measure(simd, agents, batch, across, distances);
                for ((square, sums), across) in squares.iter().zip(&mut *sums).zip(&*across) {
                    for register in 0..TILE / S::F64_LANES {
                        let near = Near {
                            packed,
                            batch,
                            distances,
                            register,
                            square: *square,
                        };
                        let start = own.first + register * S::F64_LANES;
                        let mut across = *across;
                        while across != 0 {
                            near.add(simd, &mut across, start, sums);
                        }
                    }
                }
            }
        }
    }
}

/// A tile whose agents look for their neighbors.
struct OwnTile<'a, const D: usize> {
    /// Positions of the agents of the group, in m.
    positions: &'a [Column<f64>; D],
    bounds: Bounds<D>,
    /// Lane of the first agent.
    first: usize,
}

impl<const D: usize> OwnTile<'_, D> {
    /// Sets the sums of the agents to `total`.
    #[inline(always)]
    fn set(&self, total: &Total<D>, sums: &mut NeighborSums<D>) {
        let lanes = self.first..self.first + TILE;
        for axis in 0..D {
            sums.sum[axis][lanes.clone()].fill(total.sum[axis]);
        }
        sums.count[lanes].fill(total.count);
    }

    /// Adds the tiles of a batch of groups that are entirely within each range to its sums. Stores one bit per
    /// tile for those partly within it.
    #[inline(always)]
    fn add_enclosed<S: Simd>(
        &self,
        simd: S,
        tree: &Tree<D>,
        batch: &[usize],
        squares: &[f64],
        sums: &mut [NeighborSums<D>],
        across: &mut [u64],
    ) {
        let mut distances = [BoxDistances::EMPTY; BATCH];
        for (distances, group) in distances.iter_mut().zip(batch) {
            *distances = BoxDistances::of(simd, &self.bounds, &tree.levels[0][*group]);
        }
        for ((square, sums), across) in squares.iter().zip(sums).zip(across) {
            let total;
            (total, *across) = sum_enclosed(simd, tree, batch, &distances, *square);
            for lane in self.first..self.first + TILE {
                for axis in 0..D {
                    sums.sum[axis][lane] += total.sum[axis];
                }
                sums.count[lane] += total.count;
            }
        }
    }

    /// Computes the squared distances to the tiles of a batch that are partly within some range.
    #[inline(always)]
    fn measure<S: Simd>(
        &self,
        simd: S,
        agents: &Agents<D>,
        batch: &[usize],
        across: &[u64],
        distances: &mut [Distances],
    ) {
        let mut near = across.iter().fold(0, |near, across| near | across);
        while near != 0 {
            let tile = near.trailing_zeros() as usize;
            near &= near - 1;
            let others = &agents.groups[batch[tile / FANOUT]].position;
            for register in 0..TILE / S::F64_LANES {
                let start = self.first + register * S::F64_LANES;
                let mut position = [simd.splat_f64s(0.0); D];
                for axis in 0..D {
                    let column = &self.positions[axis][start..start + S::F64_LANES];
                    position[axis] = S::as_simd_f64s(column).0[0];
                }
                for index in 0..TILE {
                    let mut offset = position;
                    for axis in 0..D {
                        let other = simd.splat_f64s(others[axis][tile % FANOUT * TILE + index]);
                        offset[axis] = simd.sub_f64s(offset[axis], other);
                    }
                    let squared = squared_norm(simd, offset);
                    S::as_mut_simd_f64s(&mut distances[tile].0[index]).0[register] = squared;
                }
            }
        }
    }
}

/// The agents of a batch of groups that are partly within a range of one register of agents.
struct Near<'a, const D: usize> {
    packed: &'a [[Packed<D>; TILE]],
    batch: &'a [usize],
    distances: &'a [Distances],
    /// Index of the register in its tile.
    register: usize,
    /// Square of the range in m^2.
    square: f64,
}

impl<const D: usize> Near<'_, D> {
    /// Adds the agents within the range to the sums of the agents from lane `start` on. It takes at most
    /// [`PACKED_TILES`] tiles from `across`.
    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, across: &mut u64, start: usize, sums: &mut NeighborSums<D>) {
        let square = simd.splat_f64s(self.square);
        let mut sum = [simd.splat_u64s(0); D];
        for _ in 0..PACKED_TILES {
            if *across == 0 {
                break;
            }
            let tile = across.trailing_zeros() as usize;
            *across &= *across - 1;
            let others = &self.packed[self.batch[tile / FANOUT] * FANOUT + tile % FANOUT];
            let Distances(distances) = &self.distances[tile];
            for index in 0..TILE {
                let distance = S::as_simd_f64s(&distances[index]).0[self.register];
                let is_near = simd.less_than_or_equal_f64s(distance, square);
                for axis in 0..D {
                    let added = simd.add_u64s(sum[axis], simd.splat_u64s(others[index][axis]));
                    sum[axis] = simd.select_u64s(is_near, added, sum[axis]);
                }
            }
        }
        for lane in 0..S::F64_LANES {
            let packed = lanes(&sum[0])[lane];
            sums.sum[0][start + lane] += packed >> COUNT_BITS;
            sums.count[start + lane] += packed & ((1 << COUNT_BITS) - 1);
            for axis in 1..D {
                sums.sum[axis][start + lane] += lanes(&sum[axis])[lane];
            }
        }
    }
}
