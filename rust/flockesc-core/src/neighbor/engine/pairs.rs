//! `Pairs`: iteration over all pairs of an agent and a neighbor, for all neighbor rules.

use std::ops::Range;

use multiversion::multiversion;

use crate::agents::{Agents, Column, FANOUT, GROUP, TILE};
use crate::base::error::Result;
use crate::base::memory;
use crate::base::vector::{larger, squared_norm};
use crate::neighbor::engine::field_of_view::FieldOfView;
use crate::neighbor::engine::lists::{Lists, NO_PLACE, Pair, RANGE};
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::options::NeighborOptions;

/// The neighbor graph at one time.
#[derive(Clone, Copy)]
pub(crate) struct Pairs<'a, const D: usize> {
    pub(in crate::neighbor) agents: &'a Agents<D>,
    pub(in crate::neighbor) tree: &'a Tree<D>,
    pub(in crate::neighbor) options: &'a NeighborOptions,
    /// Squared reaches in m^2 of the agents, group by group.
    pub(in crate::neighbor) squares: &'a [Column<f64>],
    pub(in crate::neighbor) choice: Choice<'a>,
}

/// The agents among which neighbors are chosen.
#[derive(Clone, Copy)]
pub(in crate::neighbor) enum Choice<'a> {
    /// All agents. Neighbors are the ones within reach and in view.
    All,
    /// The agents in lists. Neighbors are the ones within reach and in view. The second field has the places
    /// of all agents by id.
    Listed(&'a Lists, &'a [u32]),
    /// The agents in lists; all of them are neighbors. The second field has the places of all agents by id.
    Frozen(&'a Lists, &'a [u32]),
}

impl<const D: usize> Pairs<'_, D> {
    /// Calls `visit(lane, place)` for every agent of a group and each of its neighbors, where `place` is the
    /// neighbor's. The first neighbor is the agent itself. Returns the number of tested pairs of tiles.
    /// `tiles` is a buffer.
    pub(crate) fn visit(
        &self,
        group: usize,
        tiles: &mut Vec<u32>,
        mut visit: impl FnMut(usize, usize),
    ) -> usize {
        let lanes = self.agents.ids_of(group).len();
        match self.choice {
            Choice::All => {
                let mut num_tile_pairs = 0;
                for tile in 0..lanes.div_ceil(TILE) {
                    self.list_near(group, tile, tiles);
                    num_tile_pairs += tiles.len();
                    let lanes = tile * TILE..lanes.min((tile + 1) * TILE);
                    visit_near(self, group, lanes, tiles, &mut visit);
                }
                num_tile_pairs
            }
            Choice::Listed(lists, places) => {
                for (lane, &id) in self.agents.ids_of(group).iter().enumerate() {
                    visit(lane, group * GROUP + lane);
                    for &other in lists.of(id as usize) {
                        let place = places[other as usize] as usize;
                        if self.is_neighbor(group, lane, place) {
                            visit(lane, place);
                        }
                    }
                }
                0
            }
            Choice::Frozen(lists, places) => {
                for (lane, &id) in self.agents.ids_of(group).iter().enumerate() {
                    visit(lane, group * GROUP + lane);
                    let others = lists.of(id as usize).iter();
                    for place in others.map(|&other| places[other as usize]) {
                        if place != NO_PLACE {
                            visit(lane, place as usize);
                        }
                    }
                }
                0
            }
        }
    }

    /// Returns the ids of all pairs of an agent and a neighbor other than itself.
    ///
    /// # Errors
    /// As [`Self::check_memory`].
    pub(crate) fn by_id(&self) -> Result<Vec<Pair>> {
        let mut pairs = memory::vector(RANGE, self.check_memory()?)?;
        let mut tiles = Vec::new();
        for group in 0..self.agents.groups.len() {
            self.visit(group, &mut tiles, |lane, place| {
                if place != group * GROUP + lane {
                    let id = self.agents.ids_of(group)[lane];
                    pairs.push((id, self.agents.id(place) as u32));
                }
            });
        }
        Ok(pairs)
    }

    /// Returns the number of pairs of an agent and a neighbor other than itself.
    ///
    /// # Errors
    /// [`crate::Error::Argument`] as soon as a list of the pairs does not fit into memory.
    pub(crate) fn check_memory(&self) -> Result<usize> {
        let (mut count, mut checked, mut tiles) = (0, 0, Vec::new());
        for group in 0..self.agents.groups.len() {
            self.visit(group, &mut tiles, |_, _| count += 1);
            count -= self.agents.ids_of(group).len();
            if count > 2 * checked {
                memory::check(RANGE, count as u128 * size_of::<Pair>() as u128)?;
                checked = count;
            }
        }
        memory::check(RANGE, count as u128 * size_of::<Pair>() as u128)?;
        Ok(count)
    }

    /// Lists the tiles that may contain neighbors of a tile's agents.
    fn list_near(&self, group: usize, tile: usize, tiles: &mut Vec<u32>) {
        let lanes = tile * TILE..self.agents.ids_of(group).len().min((tile + 1) * TILE);
        let longest = self.squares[group][lanes].iter().copied().fold(0.0, larger);
        let bounds = self.tree.levels[0][group].bounds_of(tile);
        let torus = self.options.torus;
        self.tree
            .list_tiles(tiles, |node| torus.squared_gap(&bounds, node) <= longest);
    }

    /// Returns one bit per agent of a tile: whether it is within reach and in view of the agent in `lane`. In
    /// a mutual graph the reach is the shorter one of the two agents.
    #[inline(always)]
    fn near(&self, group: usize, lane: usize, tile: usize) -> u8 {
        let NeighborOptions {
            field_of_view,
            torus,
            is_mutual,
            ..
        } = *self.options;
        let (one, other) = (
            &self.agents.groups[group],
            &self.agents.groups[tile / FANOUT],
        );
        let first = tile % FANOUT * TILE;
        let reach = self.squares[group][lane];
        let (mut squared, mut reaches) = ([0.0; TILE], [reach; TILE]);
        for axis in 0..D {
            let own = one.position[axis][lane];
            let column = &other.position[axis][first..first + TILE];
            for k in 0..TILE {
                let offset = torus.offset(own, column[k]);
                squared[k] += offset * offset;
            }
        }
        if is_mutual {
            let others = &self.squares[tile / FANOUT][first..first + TILE];
            for k in 0..TILE {
                reaches[k] = if others[k] < reach { others[k] } else { reach };
            }
        }
        let mut near = [false; TILE];
        for k in 0..TILE {
            near[k] = squared[k] <= reaches[k];
        }
        if field_of_view != FieldOfView::ALL_ROUND {
            let mut along = [0.0; TILE];
            for axis in 0..D {
                let (own, velocity) = (one.position[axis][lane], one.velocity[axis][lane]);
                let column = &other.position[axis][first..first + TILE];
                for k in 0..TILE {
                    along[k] += velocity * torus.offset(own, column[k]);
                }
            }
            let speed = self.speed(group, lane);
            for k in 0..TILE {
                near[k] &= field_of_view.sees(along[k], speed, squared[k]);
            }
        }
        (0..TILE).fold(0, |bits, k| bits | u8::from(near[k]) << k)
    }

    /// Returns whether the agent at `place` is a neighbor of the agent in `lane` by reach and view, mutually
    /// in a mutual graph.
    fn is_neighbor(&self, group: usize, lane: usize, place: usize) -> bool {
        let NeighborOptions {
            field_of_view,
            is_mutual,
            ..
        } = *self.options;
        let (offset, squared) = self.offset(group, lane, place);
        let other = self.squares[place / GROUP][place % GROUP];
        let own = self.squares[group][lane];
        if squared > if is_mutual && other < own { other } else { own } {
            return false;
        }
        let velocity = &self.agents.groups[group].velocity;
        let along = (0..D).fold(0.0, |sum, axis| sum + velocity[axis][lane] * offset[axis]);
        field_of_view == FieldOfView::ALL_ROUND
            || field_of_view.sees(along, self.speed(group, lane), squared)
                && self.sees_back(group, lane, place)
    }

    /// Returns whether the agent at `place` sees the agent in `lane`. Always true unless the graph is mutual.
    #[inline(always)]
    fn sees_back(&self, group: usize, lane: usize, place: usize) -> bool {
        let NeighborOptions {
            field_of_view,
            is_mutual,
            ..
        } = *self.options;
        if !is_mutual || field_of_view == FieldOfView::ALL_ROUND {
            return true;
        }
        let (offset, squared) = self.offset(group, lane, place);
        let velocity = &self.agents.groups[place / GROUP].velocity;
        let along = (0..D).fold(0.0, |sum, axis| {
            sum - velocity[axis][place % GROUP] * offset[axis]
        });
        field_of_view.sees(along, self.speed(place / GROUP, place % GROUP), squared)
    }

    /// Returns the speed ||v|| in m/s for the field of view.
    #[inline(always)]
    fn speed(&self, group: usize, lane: usize) -> f64 {
        let columns = &self.agents.groups[group].velocity;
        let velocity: [f64; D] = std::array::from_fn(|axis| columns[axis][lane]);
        squared_norm(&velocity).sqrt()
    }

    /// Returns the offset in m from the agent in `lane` to the agent at `place`, and the squared distance in
    /// m^2.
    #[inline(always)]
    pub(super) fn offset(&self, group: usize, lane: usize, place: usize) -> ([f64; D], f64) {
        let one = &self.agents.groups[group].position;
        let other = &self.agents.groups[place / GROUP].position;
        let offset: [f64; D] = std::array::from_fn(|axis| {
            let (own, place) = (one[axis][lane], other[axis][place % GROUP]);
            self.options.torus.offset(own, place)
        });
        (offset, squared_norm(&offset))
    }
}

/// Visits the neighbors of the agents in `lanes` among the agents of `tiles`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn visit_near<const D: usize, F: FnMut(usize, usize)>(
    pairs: &Pairs<'_, D>,
    group: usize,
    lanes: Range<usize>,
    tiles: &[u32],
    visit: &mut F,
) {
    for lane in lanes {
        let own = group * GROUP + lane;
        visit(lane, own);
        for &tile in tiles {
            let mut near = pairs.near(group, lane, tile as usize);
            while near != 0 {
                let place = tile as usize * TILE + near.trailing_zeros() as usize;
                near &= near - 1;
                if place != own && pairs.sees_back(group, lane, place) {
                    visit(lane, place);
                }
            }
        }
    }
}
