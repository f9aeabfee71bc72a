//! Every agent and every neighbor of it, one after the other, under any rule.

use std::ops::Range;

use multiversion::multiversion;

use crate::agents::{Agents, Column, FAN, GROUP, TILE};
use crate::base::vector::{larger, squared_norm};
use crate::neighbor::engine::field_of_view::{Sight, Torus};
use crate::neighbor::engine::links::NOWHERE;
use crate::neighbor::engine::lists::Lists;
use crate::neighbor::engine::tree::{Bounds, Tree};
use crate::neighbor::options::NeighborOptions;

/// The neighbor graph of one moment.
#[derive(Clone, Copy)]
pub(crate) struct Pairs<'a, const D: usize> {
    pub(in crate::neighbor) agents: &'a Agents<D>,
    pub(in crate::neighbor) tree: &'a Tree<D>,
    pub(in crate::neighbor) options: &'a NeighborOptions,
    /// Squared reach in m^2 of the agents of every group.
    pub(in crate::neighbor) squares: &'a [Column<f64>],
    pub(in crate::neighbor) candidates: Candidates<'a>,
}

/// Among whom an agent's neighbors are.
#[derive(Clone, Copy)]
pub(in crate::neighbor) enum Candidates<'a> {
    /// All agents.
    All,
    /// Those in its list, as far as it reaches and sees.
    Listed(&'a Lists, &'a [u32]),
    /// Those in its list are its neighbors; the places of all names.
    Frozen(&'a Lists, &'a [u32]),
}

impl<const D: usize> Pairs<'_, D> {
    /// Calls `visit(lane, place of a neighbor)` for the agents of one group and all of their neighbors, of which each agent
    /// is its own first; tells how many tiles were tested against others. `tiles` is room for a list.
    pub(crate) fn visit(
        &self,
        group: usize,
        tiles: &mut Vec<u32>,
        mut visit: impl FnMut(usize, usize),
    ) -> usize {
        let lanes = self.agents.names_of(group).len();
        match self.candidates {
            Candidates::All => {
                let mut tests = 0;
                for tile in 0..lanes.div_ceil(TILE) {
                    self.list_near(group, tile, tiles);
                    tests += tiles.len();
                    let lanes = tile * TILE..lanes.min((tile + 1) * TILE);
                    visit_near(self, group, lanes, tiles, &mut visit);
                }
                tests
            }
            Candidates::Listed(lists, places) => {
                for (lane, &name) in self.agents.names_of(group).iter().enumerate() {
                    visit(lane, group * GROUP + lane);
                    for &other in lists.of(name as usize) {
                        let place = places[other as usize] as usize;
                        if self.is_neighbor(group, lane, place) {
                            visit(lane, place);
                        }
                    }
                }
                0
            }
            Candidates::Frozen(lists, places) => {
                for (lane, &name) in self.agents.names_of(group).iter().enumerate() {
                    visit(lane, group * GROUP + lane);
                    let others = lists.of(name as usize).iter();
                    for place in others.map(|&other| places[other as usize]) {
                        if place != NOWHERE {
                            visit(lane, place as usize);
                        }
                    }
                }
                0
            }
        }
    }

    /// All pairs of an agent and a neighbor other than itself, by name.
    pub(crate) fn by_name(&self) -> Vec<(u32, u32)> {
        let mut pairs = Vec::new();
        let mut tiles = Vec::new();
        for group in 0..self.agents.groups.len() {
            self.visit(group, &mut tiles, |lane, place| {
                if place != group * GROUP + lane {
                    let name = self.agents.names_of(group)[lane];
                    pairs.push((name, self.agents.name(place) as u32));
                }
            });
        }
        pairs
    }

    /// Lists the tiles that are near a tile, as `visit` needs them.
    fn list_near(&self, group: usize, tile: usize, tiles: &mut Vec<u32>) {
        let lanes = tile * TILE..self.agents.names_of(group).len().min((tile + 1) * TILE);
        let longest = self.squares[group][lanes].iter().copied().fold(0.0, larger);
        let bounds = self.tree.levels[0][group].bounds_of(tile);
        tiles.clear();
        self.tree.near(&bounds, longest, self.options.torus, tiles);
    }

    /// Which agents of a tile are within reach of an agent (where it counts, within reach of each other) and seen by it: one
    /// bit per agent.
    #[inline(always)]
    fn near(&self, group: usize, lane: usize, tile: usize) -> u8 {
        let NeighborOptions {
            sight,
            torus,
            is_mutual,
            ..
        } = *self.options;
        let (one, other) = (&self.agents.groups[group], &self.agents.groups[tile / FAN]);
        let first = tile % FAN * TILE;
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
            let others = &self.squares[tile / FAN][first..first + TILE];
            for k in 0..TILE {
                reaches[k] = if others[k] < reach { others[k] } else { reach };
            }
        }
        let mut near = [false; TILE];
        for k in 0..TILE {
            near[k] = squared[k] <= reaches[k];
        }
        if sight != Sight::ALL_ROUND {
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
                near[k] &= sight.sees(along[k], speed, squared[k]);
            }
        }
        (0..TILE).fold(0, |bits, k| bits | u8::from(near[k]) << k)
    }

    /// Whether the agent in `place` is within reach and seen, and the other way round where that counts.
    fn is_neighbor(&self, group: usize, lane: usize, place: usize) -> bool {
        let bit = 1 << (place % TILE);
        self.near(group, lane, place / TILE) & bit != 0 && self.sees_back(group, lane, place)
    }

    /// Whether the agent in `place` sees back, where that counts.
    #[inline(always)]
    fn sees_back(&self, group: usize, lane: usize, place: usize) -> bool {
        let NeighborOptions {
            sight, is_mutual, ..
        } = *self.options;
        if !is_mutual || sight == Sight::ALL_ROUND {
            return true;
        }
        let (offset, squared) = self.offset(group, lane, place);
        let velocity = &self.agents.groups[place / GROUP].velocity;
        let along = (0..D).fold(0.0, |sum, axis| {
            sum - velocity[axis][place % GROUP] * offset[axis]
        });
        sight.sees(along, self.speed(place / GROUP, place % GROUP), squared)
    }

    /// ||v|| in m/s, as the field of view takes it.
    #[inline(always)]
    fn speed(&self, group: usize, lane: usize) -> f64 {
        let columns = &self.agents.groups[group].velocity;
        let velocity: [f64; D] = std::array::from_fn(|axis| columns[axis][lane]);
        squared_norm(&velocity).sqrt()
    }

    /// From an agent to the one in `place` in m, and the square of the distance.
    #[inline(always)]
    pub(crate) fn offset(&self, group: usize, lane: usize, place: usize) -> ([f64; D], f64) {
        let one = &self.agents.groups[group].position;
        let other = &self.agents.groups[place / GROUP].position;
        let offset: [f64; D] = std::array::from_fn(|axis| {
            let (own, place) = (one[axis][lane], other[axis][place % GROUP]);
            self.options.torus.offset(own, place)
        });
        (offset, squared_norm(&offset))
    }
}

/// Visits the neighbors of some agents among the tiles listed.
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

impl<const D: usize> Tree<D> {
    /// Lists the tiles of which some agent may be within `square` m^2 of some place in `bounds`.
    pub(in crate::neighbor) fn near(
        &self,
        bounds: &Bounds<D>,
        square: f64,
        torus: Torus,
        tiles: &mut Vec<u32>,
    ) {
        self.descend(self.levels.len() - 1, 0, tiles, &|node| {
            torus.squared_gap(bounds, node) <= square
        });
    }

    fn descend(
        &self,
        level: usize,
        block: usize,
        tiles: &mut Vec<u32>,
        is_near: &impl Fn(&Bounds<D>) -> bool,
    ) {
        let nodes = &self.levels[level][block];
        for child in (0..FAN).filter(|&child| nodes.count[child] > 0) {
            if is_near(&nodes.bounds_of(child)) {
                let node = block * FAN + child;
                match level.checked_sub(1) {
                    Some(below) => self.descend(below, node, tiles, is_near),
                    None => tiles.push(node as u32),
                }
            }
        }
    }
}
