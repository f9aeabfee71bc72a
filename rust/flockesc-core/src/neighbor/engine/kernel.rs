//! The SIMD kernel of the neighbor sums, if neighbors are determined by distances and fields of view.
//!
//! Nodes entirely within reach are added at once, unless agents have a blind sector, and nodes out of reach
//! are skipped. Only tiles partly within reach are tested agent by agent.

use std::hint::black_box;

use bytemuck::{NoUninit, cast_ref, cast_slice};
use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Agents, Column, FANOUT, GROUP, Group, TILE};
use crate::neighbor::engine::field_of_view::FieldOfView;
use crate::neighbor::engine::reach::{Reach, bits, squared_norm};
use crate::neighbor::engine::sums::{NeighborSums, Scratch};
use crate::neighbor::engine::tree::{Siblings, Tree};
use crate::neighbor::ranges::Reaches;

/// Computes the sums of the groups from `first` on.
pub(in crate::neighbor) fn sum_neighbors<const D: usize>(
    agents: &Agents<D>,
    tree: &Tree<D>,
    reaches: Reaches<'_>,
    field_of_view: FieldOfView,
    first: usize,
    sums: &mut [NeighborSums<D>],
    scratch: &mut Scratch,
) {
    Arch::new().dispatch(SumNeighbors {
        agents,
        tree,
        reaches,
        field_of_view,
        first,
        sums,
        scratch,
    });
}

/// Sums over nodes entirely within reach.
#[derive(Clone, Copy)]
struct NodeSums<const D: usize> {
    sum: [i64; D],
    count: i64,
}

impl<const D: usize> NodeSums<D> {
    /// Adds the children of `block` whose bits are set.
    #[inline(always)]
    fn add(&mut self, block: &Siblings<D>, mut children: u8) {
        while children != 0 {
            let child = children.trailing_zeros() as usize;
            children &= children - 1;
            for axis in 0..D {
                self.sum[axis] += block.sum[axis][child];
            }
            self.count += block.count[child];
        }
    }
}

/// The arguments of [`sum_neighbors`], for dispatch to an instruction set.
pub(in crate::neighbor) struct SumNeighbors<'a, const D: usize> {
    pub(in crate::neighbor) agents: &'a Agents<D>,
    pub(in crate::neighbor) tree: &'a Tree<D>,
    pub(in crate::neighbor) reaches: Reaches<'a>,
    pub(in crate::neighbor) field_of_view: FieldOfView,
    pub(in crate::neighbor) first: usize,
    pub(in crate::neighbor) sums: &'a mut [NeighborSums<D>],
    pub(in crate::neighbor) scratch: &'a mut Scratch,
}

impl<const D: usize> WithSimd for SumNeighbors<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if self.field_of_view == FieldOfView::ALL_ROUND {
            self.sum::<S, false>(simd);
        } else {
            self.sum::<S, true>(simd);
        }
    }
}

impl<const D: usize> SumNeighbors<'_, D> {
    /// Computes the sums. `IS_BLIND`: whether agents have a blind sector.
    #[inline(always)]
    fn sum<S: Simd, const IS_BLIND: bool>(self, simd: S) {
        let Self {
            agents,
            tree,
            reaches,
            field_of_view,
            first,
            sums,
            scratch,
        } = self;
        scratch.num_tile_pairs = 0;
        let mut squared = [0.0; GROUP];
        for (group, sums) in (first..).zip(sums) {
            let ids = agents.ids_of(group);
            reaches.square(group, ids, &mut squared);
            let tiles = &tree.levels[0][group];
            let mut reach = Reach::new(tiles.bounds(), reaches, &squared[..ids.len()]);
            reach.may_enclose &= !IS_BLIND;
            let common = find_groups(simd, tree, &reach, scratch);
            for (tile, ids) in ids.chunks(TILE).enumerate() {
                let lanes = tile * TILE..tile * TILE + ids.len();
                let mut reach = Reach::new(tiles.bounds_of(tile), reaches, &squared[lanes]);
                reach.may_enclose &= !IS_BLIND;
                let (mut whole, num_tiles) = find_tiles(simd, tree, &reach, common, scratch);
                let found =
                    find_agents(simd, agents, tree, &reach, num_tiles, &mut whole, scratch);
                scratch.num_tile_pairs += num_tiles;
                for start in (tile * TILE..(tile + 1) * TILE).step_by(S::F64_LANES) {
                    let own =
                        Own::<S, D>::load::<IS_BLIND>(simd, &agents.groups[group], &squared, start);
                    let across = &scratch.agents[..found];
                    sum_agents::<S, D, IS_BLIND>(
                        simd,
                        own,
                        field_of_view,
                        start,
                        tree,
                        across,
                        whole,
                        sums,
                    );
                }
            }
        }
    }
}

/// Lists the groups partly within reach of a group in `scratch`, and returns the sums over nodes entirely
/// within reach.
#[inline(always)]
fn find_groups<S: Simd, const D: usize>(
    simd: S,
    tree: &Tree<D>,
    reach: &Reach<D>,
    scratch: &mut Scratch,
) -> NodeSums<D> {
    let mut whole = NodeSums {
        sum: [0; D],
        count: 0,
    };
    scratch.groups.clear();
    scratch.nodes.push((tree.levels.len() - 1, 0));
    while let Some((level, index)) = scratch.nodes.pop() {
        if level == 0 {
            scratch.groups.push(index);
            continue;
        }
        let block = &tree.levels[level][index];
        let (inside, mut across) = reach.classify(simd, block);
        whole.add(block, inside);
        while across != 0 {
            let child = across.trailing_zeros() as usize;
            across &= across - 1;
            scratch.nodes.push((level - 1, index * FANOUT + child));
        }
    }
    let room = scratch.groups.len() * FANOUT;
    if scratch.tiles.len() < room {
        scratch.tiles.resize(room, 0);
        scratch.agents.resize(room * TILE, 0);
        scratch.enclosed.resize(room * TILE, 0);
    }
    whole
}

/// Lists the tiles partly within reach of a tile, among the groups in `scratch`. Returns `whole` plus the
/// sums over tiles entirely within reach, and the number of listed tiles. There is no branch per tile,
/// because it would be unpredictable.
#[inline(always)]
fn find_tiles<S: Simd, const D: usize>(
    simd: S,
    tree: &Tree<D>,
    reach: &Reach<D>,
    mut whole: NodeSums<D>,
    scratch: &mut Scratch,
) -> (NodeSums<D>, usize) {
    let mut found = 0;
    let zero = simd.splat_u64s(0);
    let (mut sum, mut count) = ([zero; D], zero);
    for &group in &scratch.groups {
        let block = &tree.levels[0][group];
        let mut across = reach.near(simd, block);
        if across != 0 && reach.may_enclose {
            for register in 0..FANOUT / S::F64_LANES {
                let (low, high) = block.corners(simd, register);
                let is_inside = reach.encloses(simd, low, high);
                across &= !(bits(simd, is_inside) << (register * S::F64_LANES));
                for axis in 0..D {
                    let added = simd.add_u64s(sum[axis], load(simd, &block.sum[axis], register));
                    sum[axis] = simd.select_u64s(is_inside, added, sum[axis]);
                }
                let added = simd.add_u64s(count, load(simd, &block.count, register));
                count = simd.select_u64s(is_inside, added, count);
            }
        }
        found += list(&mut scratch.tiles[found..], group * FANOUT, across);
    }
    if reach.may_enclose {
        for axis in 0..D {
            whole.sum[axis] += lanes(&sum[axis]).iter().sum::<i64>();
        }
        whole.count += lanes(&count).iter().sum::<i64>();
    }
    (whole, found)
}

/// Lists the agents partly within reach of a tile, among the first `num_tiles` tiles in `scratch`, and returns
/// their number. Adds the velocities of agents within reach of the whole tile to `whole`.
#[inline(always)]
fn find_agents<S: Simd, const D: usize>(
    simd: S,
    agents: &Agents<D>,
    tree: &Tree<D>,
    reach: &Reach<D>,
    num_tiles: usize,
    whole: &mut NodeSums<D>,
    scratch: &mut Scratch,
) -> usize {
    let (mut found, mut enclosed) = (0, 0);
    for &tile in &scratch.tiles[..num_tiles] {
        let tile = tile as usize;
        let columns = &agents.groups[tile / FANOUT].position;
        let (mut across, mut inside) = (0, 0);
        for register in 0..TILE / S::F64_LANES {
            let start = tile % FANOUT * TILE + register * S::F64_LANES;
            let mut position = [simd.splat_f64s(0.0); D];
            for axis in 0..D {
                let column = &columns[axis][start..start + S::F64_LANES];
                position[axis] = S::as_simd_f64s(column).0[0];
            }
            let shift = register * S::F64_LANES;
            across |= bits(simd, reach.meets(simd, position, position)) << shift;
            if reach.may_enclose {
                inside |= bits(simd, reach.encloses(simd, position, position)) << shift;
            }
        }
        let first = tile * TILE;
        found += list(&mut scratch.agents[found..], first, across & !inside);
        if reach.may_enclose {
            enclosed += list(&mut scratch.enclosed[enclosed..], first, inside);
        }
    }
    let rows = tree.agents.as_flattened();
    for &place in &scratch.enclosed[..enclosed] {
        for axis in 0..D {
            whole.sum[axis] += rows[place as usize].velocity[axis];
        }
    }
    whole.count += enclosed as i64;
    found
}

/// Writes `first` plus the position of every set bit to `places`, and returns their number. There is no branch per
/// bit, because it would be unpredictable.
#[inline(always)]
fn list(places: &mut [u32], first: usize, bits: u8) -> usize {
    for (place, bit) in places[..FANOUT].iter_mut().zip(SET_BITS[bits as usize]) {
        *place = first as u32 + bit;
    }
    bits.count_ones() as usize
}

/// Positions of the set bits of every byte, lowest first, padded with zeros.
static SET_BITS: [[u32; FANOUT]; 256] = {
    let mut table = [[0; FANOUT]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut bit, mut found) = (0, 0);
        while bit < FANOUT {
            if byte >> bit & 1 == 1 {
                table[byte][found] = bit as u32;
                found += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    table
};

/// One register of agents.
#[derive(Clone, Copy)]
struct Own<S: Simd, const D: usize> {
    position: [S::f64s; D],
    /// In m/s; only for agents with a blind sector.
    velocity: [S::f64s; D],
    /// Squared reaches in m^2.
    squared: S::f64s,
}

impl<S: Simd, const D: usize> Own<S, D> {
    /// Loads the agents from lane `start` on.
    #[inline(always)]
    fn load<const IS_BLIND: bool>(
        simd: S,
        group: &Group<D>,
        squared: &Column<f64>,
        start: usize,
    ) -> Self {
        let load =
            |column: &Column<f64>| S::as_simd_f64s(&column[start..start + S::F64_LANES]).0[0];
        let mut own = Self {
            position: [simd.splat_f64s(0.0); D],
            velocity: [simd.splat_f64s(0.0); D],
            squared: load(squared),
        };
        for axis in 0..D {
            own.position[axis] = load(&group.position[axis]);
            if IS_BLIND {
                own.velocity[axis] = load(&group.velocity[axis]);
            }
        }
        own
    }
}

/// Computes the sums of one register of agents, which begins at lane `start`: `whole` plus the sums over the
/// agents of `tiles` within reach and, with `IS_BLIND`, in view.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a struct would only rename them")]
fn sum_agents<S: Simd, const D: usize, const IS_BLIND: bool>(
    simd: S,
    own: Own<S, D>,
    field_of_view: FieldOfView,
    start: usize,
    tree: &Tree<D>,
    others: &[u32],
    whole: NodeSums<D>,
    sums: &mut NeighborSums<D>,
) {
    let places = start..start + S::F64_LANES;
    let edge = simd.splat_f64s(field_of_view.edge);
    let speed = simd.sqrt_f64s(squared_norm(simd, own.velocity));
    // The compiler does not know that it is 1. It would replace each masked addition by two operations.
    let one = simd.splat_u64s(black_box(1));
    let mut sum = [one; D];
    for axis in 0..D {
        sum[axis] = simd.splat_u64s(whole.sum[axis] as u64);
    }
    let mut count = simd.splat_u64s(whole.count as u64);
    let rows = tree.agents.as_flattened();
    for &place in others {
        let other = &rows[place as usize];
        let mut offset = own.position;
        for axis in 0..D {
            offset[axis] = simd.sub_f64s(simd.splat_f64s(other.position[axis]), offset[axis]);
        }
        let squared = squared_norm(simd, offset);
        let mut is_near = simd.less_than_or_equal_f64s(squared, own.squared);
        if IS_BLIND {
            let mut along = simd.mul_f64s(own.velocity[0], offset[0]);
            for axis in 1..D {
                along = simd.add_f64s(along, simd.mul_f64s(own.velocity[axis], offset[axis]));
            }
            let least = simd.mul_f64s(edge, simd.mul_f64s(speed, simd.sqrt_f64s(squared)));
            is_near = simd.and_m64s(is_near, simd.less_than_or_equal_f64s(least, along));
        }
        for axis in 0..D {
            let added = simd.add_u64s(sum[axis], simd.splat_u64s(other.velocity[axis] as u64));
            sum[axis] = simd.select_u64s(is_near, added, sum[axis]);
        }
        count = simd.select_u64s(is_near, simd.add_u64s(count, one), count);
    }
    for axis in 0..D {
        sums.sum[axis][places.clone()].copy_from_slice(lanes(&sum[axis]));
    }
    sums.count[places].copy_from_slice(lanes(&count));
}

/// Loads one register of eight integers.
#[inline(always)]
fn load<S: Simd>(_: S, values: &[i64; FANOUT], register: usize) -> S::u64s {
    let values: &[u64; FANOUT] = cast_ref(values);
    S::as_simd_u64s(values).0[register]
}

/// Returns the integers in a register.
#[inline(always)]
fn lanes<T: NoUninit>(register: &T) -> &[i64] {
    cast_slice(std::slice::from_ref(register))
}
