//! What every agent hears: the sum of its neighbors' velocities and their number, found through the tree.
//!
//! A node that lies wholly within range is taken as a whole, one wholly out of range is left out, and only tiles
//! across the boundary are tested agent by agent.

use bytemuck::{NoUninit, cast_ref, cast_slice};
use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Agents, Column, FAN, GROUP, TILE};
use crate::base::vector;
use crate::neighbor::engine::pairs::Pairs;
use crate::neighbor::engine::reach::{Reach, bits, squared_norm};
use crate::neighbor::engine::tree::{Siblings, Speaker, Speakers, Tree};
use crate::neighbor::ranges::Reaches;
use crate::neighbor::rules::topological;

/// What the agents of one group heard; meaningless where there is no agent.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct Heard<const D: usize> {
    /// Sum of v_j over N_i, in the unit of the tree.
    pub(crate) sum: [Column<i64>; D],
    /// |N_i|.
    pub(crate) count: Column<i64>,
    /// The norm of the sum, left by the step that was made of it.
    pub(crate) norm: Column<f64>,
}

impl<const D: usize> Heard<D> {
    /// Every agent hears itself alone.
    pub(in crate::neighbor) fn alone(speakers: &Speakers<D>) -> Self {
        let norm =
            |speaker: Speaker<D>| vector::squared_norm(&speaker.signal.map(|v| v as f64)).sqrt();
        Self {
            sum: std::array::from_fn(|axis| speakers.0.map(|speaker| speaker.signal[axis])),
            count: [1; GROUP],
            norm: speakers.0.map(norm),
        }
    }
}

/// Lists that keep their memory from step to step.
#[derive(Debug, Clone, Default)]
pub(in crate::neighbor) struct Scratch {
    /// Nodes still to be opened: level and block.
    nodes: Vec<(usize, usize)>,
    /// Groups that are partly within reach of a listening group.
    groups: Vec<usize>,
    /// Tiles that are partly within reach of a listening tile; only the first ones count, as many as were found.
    tiles: Vec<u32>,
    /// How many of those there were in the last step, over all listening tiles.
    pub(in crate::neighbor) tests: usize,
    pub(in crate::neighbor) topological: topological::Scratch,
}

/// Fills `heard` for the groups from `first` on.
pub(in crate::neighbor) fn listen<const D: usize>(
    agents: &Agents<D>,
    tree: &Tree<D>,
    reaches: Reaches<'_>,
    first: usize,
    heard: &mut [Heard<D>],
    scratch: &mut Scratch,
) {
    Arch::new().dispatch(Listen {
        agents,
        tree,
        reaches,
        first,
        heard,
        scratch,
    });
}

/// The same, one neighbor after the other.
pub(in crate::neighbor) fn listen_to_pairs<const D: usize>(
    pairs: Pairs<'_, D>,
    first: usize,
    heard: &mut [Heard<D>],
    scratch: &mut Scratch,
) {
    scratch.tests = 0;
    for (group, heard) in (first..).zip(heard) {
        heard.count.fill(0);
        for sum in &mut heard.sum {
            sum.fill(0);
        }
        scratch.tests += pairs.visit(group, &mut scratch.tiles, |lane, place| {
            let speaker = &pairs.tree.speakers[place / GROUP].0[place % GROUP];
            for axis in 0..D {
                heard.sum[axis][lane] += speaker.signal[axis];
            }
            heard.count[lane] += 1;
        });
    }
}

/// Sums over nodes that lie wholly within reach.
#[derive(Clone, Copy)]
struct Whole<const D: usize> {
    sum: [i64; D],
    count: i64,
}

impl<const D: usize> Whole<D> {
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

pub(in crate::neighbor) struct Listen<'a, const D: usize> {
    pub(in crate::neighbor) agents: &'a Agents<D>,
    pub(in crate::neighbor) tree: &'a Tree<D>,
    pub(in crate::neighbor) reaches: Reaches<'a>,
    pub(in crate::neighbor) first: usize,
    pub(in crate::neighbor) heard: &'a mut [Heard<D>],
    pub(in crate::neighbor) scratch: &'a mut Scratch,
}

impl<const D: usize> WithSimd for Listen<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            agents,
            tree,
            reaches,
            first,
            heard,
            scratch,
        } = self;
        scratch.tests = 0;
        let mut squared = [0.0; GROUP];
        for (group, heard) in (first..).zip(heard) {
            let names = agents.names_of(group);
            reaches.square(group, names, &mut squared);
            let tiles = &tree.levels[0][group];
            let reach = Reach::new(tiles.bounds(), reaches, &squared[..names.len()]);
            let heard_by_all = find_groups(simd, tree, &reach, scratch);
            for (tile, names) in names.chunks(TILE).enumerate() {
                let lanes = tile * TILE..tile * TILE + names.len();
                let reach = Reach::new(tiles.bounds_of(tile), reaches, &squared[lanes]);
                let (whole, found) = find_tiles(simd, tree, &reach, heard_by_all, scratch);
                scratch.tests += found;
                for start in (tile * TILE..(tile + 1) * TILE).step_by(S::F64_LANES) {
                    let listeners = &agents.groups[group].position;
                    let across = &scratch.tiles[..found];
                    hear(simd, listeners, &squared, start, tree, across, whole, heard);
                }
            }
        }
    }
}

/// Lists the groups that are partly within reach of a group, and sums the nodes that are wholly.
#[inline(always)]
fn find_groups<S: Simd, const D: usize>(
    simd: S,
    tree: &Tree<D>,
    reach: &Reach<D>,
    scratch: &mut Scratch,
) -> Whole<D> {
    let mut whole = Whole {
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
            scratch.nodes.push((level - 1, index * FAN + child));
        }
    }
    let room = scratch.groups.len() * FAN;
    if scratch.tiles.len() < room {
        scratch.tiles.resize(room, 0);
    }
    whole
}

/// Among the groups listed, lists the tiles that are partly within reach of a tile, tells how many they are, and adds
/// those that are wholly. Without a branch per tile, which no processor could predict.
#[inline(always)]
fn find_tiles<S: Simd, const D: usize>(
    simd: S,
    tree: &Tree<D>,
    reach: &Reach<D>,
    mut whole: Whole<D>,
    scratch: &mut Scratch,
) -> (Whole<D>, usize) {
    let mut found = 0;
    let zero = simd.splat_u64s(0);
    let (mut sum, mut count) = ([zero; D], zero);
    for &group in &scratch.groups {
        let block = &tree.levels[0][group];
        let mut across = reach.near(simd, block);
        if across != 0 && reach.may_enclose {
            for register in 0..FAN / S::F64_LANES {
                let is_inside = reach.encloses(simd, block, register);
                across &= !(bits(simd, is_inside) << (register * S::F64_LANES));
                for axis in 0..D {
                    let added = simd.add_u64s(sum[axis], load(simd, &block.sum[axis], register));
                    sum[axis] = simd.select_u64s(is_inside, added, sum[axis]);
                }
                let added = simd.add_u64s(count, load(simd, &block.count, register));
                count = simd.select_u64s(is_inside, added, count);
            }
        }
        let first = (group * FAN) as u32;
        let list = &mut scratch.tiles[found..found + FAN];
        for (tile, child) in list.iter_mut().zip(ONES[across as usize]) {
            *tile = first + u32::from(child);
        }
        found += across.count_ones() as usize;
    }
    if reach.may_enclose {
        for axis in 0..D {
            whole.sum[axis] += lanes(&sum[axis]).iter().sum::<i64>();
        }
        whole.count += lanes(&count).iter().sum::<i64>();
    }
    (whole, found)
}

/// The positions of the ones in every byte, lowest first; then zeros.
const ONES: [[u8; FAN]; 256] = {
    let mut table = [[0; FAN]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut bit, mut found) = (0, 0);
        while bit < FAN {
            if byte >> bit & 1 == 1 {
                table[byte][found] = bit as u8;
                found += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    table
};

/// Fills one register of listeners, from `start` on in their group: what is `whole`, and agent by agent `tiles`.
#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "a struct would only give them other names"
)]
fn hear<S: Simd, const D: usize>(
    simd: S,
    listeners: &[Column<f64>; D],
    squared: &Column<f64>,
    start: usize,
    tree: &Tree<D>,
    tiles: &[u32],
    whole: Whole<D>,
    heard: &mut Heard<D>,
) {
    let places = start..start + S::F64_LANES;
    let squared = S::as_simd_f64s(&squared[places.clone()]).0[0];
    let mut position = [squared; D];
    for axis in 0..D {
        position[axis] = S::as_simd_f64s(&listeners[axis][places.clone()]).0[0];
    }
    let one = simd.splat_u64s(1);
    let mut sum = [one; D];
    for axis in 0..D {
        sum[axis] = simd.splat_u64s(whole.sum[axis] as u64);
    }
    let mut count = simd.splat_u64s(whole.count as u64);
    for &tile in tiles {
        let speakers =
            &tree.speakers[tile as usize / FAN].0.as_chunks::<TILE>().0[tile as usize % FAN];
        for speaker in speakers {
            let mut offset = position;
            for axis in 0..D {
                offset[axis] = simd.sub_f64s(offset[axis], simd.splat_f64s(speaker.position[axis]));
            }
            let is_near = simd.less_than_or_equal_f64s(squared_norm(simd, offset), squared);
            for axis in 0..D {
                let added = simd.add_u64s(sum[axis], simd.splat_u64s(speaker.signal[axis] as u64));
                sum[axis] = simd.select_u64s(is_near, added, sum[axis]);
            }
            count = simd.select_u64s(is_near, simd.add_u64s(count, one), count);
        }
    }
    for axis in 0..D {
        heard.sum[axis][places.clone()].copy_from_slice(lanes(&sum[axis]));
    }
    heard.count[places].copy_from_slice(lanes(&count));
}

/// One register of eight whole numbers.
#[inline(always)]
fn load<S: Simd>(_: S, values: &[i64; FAN], register: usize) -> S::u64s {
    let values: &[u64; FAN] = cast_ref(values);
    S::as_simd_u64s(values).0[register]
}

/// The whole numbers in a register.
#[inline(always)]
fn lanes<T: NoUninit>(register: &T) -> &[i64] {
    cast_slice(std::slice::from_ref(register))
}
