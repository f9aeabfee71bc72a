//! The topological neighbor rule: neighbors are the k nearest agents in view.

use multiversion::multiversion;
use serde::{Deserialize, Serialize};

use super::rule::{Criterion, Found, Rule, SearchBuffers, Sensing};
use crate::agents::{Column, FANOUT, GROUP, TILE};
use crate::base::vector::{larger, smaller, squared_norm};
use crate::neighbor::engine::field_of_view::FieldOfView;
use crate::neighbor::engine::select::{TileColumn, nth_smallest, second_smallest};
use crate::neighbor::ranges::{Ranges, SAMPLE};
use crate::parallel;

/// The k nearest agents in view, ties included. The interaction range is k.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Topological {}

impl Rule for Topological {
    fn criterion(&self) -> Criterion {
        Criterion::Reach
    }

    fn find<const D: usize>(&self, sensing: &Sensing<'_, D>, found: &mut Found) {
        let num_groups = sensing.agents.groups.len();
        let Found {
            squares, searches, ..
        } = found;
        squares.resize(num_groups, [0.0; GROUP]);
        searches.resize_with(parallel::num_chunks(num_groups), SearchBuffers::default);
        parallel::for_each_chunk_with(squares, searches, |first, squares, buffers| {
            reach_nearest(sensing, first, squares, buffers);
            buffers.trim();
        });
    }

    fn bytes(&self, num_agents: usize) -> usize {
        let chunks = parallel::num_chunks(num_agents.div_ceil(GROUP));
        chunks * SearchBuffers::most_bytes(num_agents)
    }

    fn typical_reach(&self, _ranges: Ranges<'_>, found: &Found) -> f64 {
        let first = found.squares.iter().map(|squares| squares[0].sqrt());
        let sample = first.step_by(found.squares.len().div_ceil(SAMPLE).max(1));
        let (sum, count) = sample.fold((0.0, 1e-300), |(sum, count), r| (sum + r, count + 1.0));
        sum / count
    }
}

/// Ratio of the squared search radius to the squared reach in the last step.
const MARGIN: f64 = 1.3;
/// Factor of the squared search radius if a search has found too few agents.
const GROWTH: f64 = 4.0;

/// Replaces the squared reaches `squares` of the groups from `first` on by the squared distances in m^2 to
/// the k-th nearest other agents in view. The new reach is the largest number if there are fewer agents in
/// view, and 0 for k = 0. The old reaches determine the search radius.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn reach_nearest<const D: usize>(
    sensing: &Sensing<'_, D>,
    first: usize,
    squares: &mut [Column<f64>],
    buffers: &mut SearchBuffers,
) {
    for (group, squares) in (first..).zip(squares) {
        let ids = sensing.agents.ids_of(group);
        let tiles = squares.as_chunks_mut::<TILE>().0.iter_mut();
        for (tile, (squares, ids)) in tiles.zip(ids.chunks(TILE)).enumerate() {
            let mut numbers = [0; TILE];
            for (number, &id) in numbers.iter_mut().zip(ids) {
                *number = (sensing.ranges.of(id) + 0.5) as usize;
            }
            let search = Search {
                sensing,
                group,
                tile,
            };
            search.fill(&numbers, squares, buffers);
        }
    }
}

/// Search for the neighbors of the agents of one tile.
struct Search<'a, const D: usize> {
    sensing: &'a Sensing<'a, D>,
    group: usize,
    tile: usize,
}

impl<const D: usize> Search<'_, D> {
    /// Replaces the squared reaches in m^2 of the tile's agents. `numbers` are their k.
    #[inline(always)]
    fn fill(
        &self,
        numbers: &TileColumn<usize>,
        squares: &mut TileColumn<f64>,
        buffers: &mut SearchBuffers,
    ) {
        let Sensing {
            agents,
            tree,
            torus,
            ..
        } = *self.sensing;
        let SearchBuffers { tiles, distances } = buffers;
        let bounds = tree.levels[0][self.group].bounds_of(self.tile);
        let known = squares.iter().copied().filter(|square| *square < f64::MAX);
        let mut limit = MARGIN * known.fold(0.0, larger);
        if limit <= 0.0 {
            let size: [f64; D] = std::array::from_fn(|axis| bounds.high[axis] - bounds.low[axis]);
            limit = squared_norm(&size);
        }
        let is_wanted = |number: usize| number > 0 && number < agents.len();
        let wanted = numbers.map(|number| if is_wanted(number) { number } else { 0 });
        loop {
            tree.list_tiles(tiles, |node| torus.squared_gap(&bounds, node) <= limit);
            self.measure(tiles, distances);
            let found = if wanted.iter().all(|&number| number <= 1) {
                second_smallest(distances)
            } else {
                nth_smallest(distances, &wanted, limit, squares)
            };
            let is_all = tiles.len() == agents.len().div_ceil(TILE);
            let is_near = |agent: usize| wanted[agent] == 0 || found[agent] <= limit;
            if limit >= f64::MAX || (0..TILE).all(is_near) {
                for agent in 0..TILE {
                    squares[agent] = match numbers[agent] {
                        0 => 0.0,
                        number if is_wanted(number) => smaller(found[agent], f64::MAX),
                        _ => f64::MAX,
                    };
                }
                return;
            }
            let wider = (GROWTH * limit).min(f64::MAX);
            limit = if is_all || wider <= 0.0 {
                f64::MAX
            } else {
                wider
            };
        }
    }

    /// Computes the squared distances in m^2 of the tile's agents from all agents of `tiles`, row by row. They are
    /// infinite out of view.
    #[inline(always)]
    fn measure(&self, tiles: &[u32], distances: &mut Vec<TileColumn<f64>>) {
        let Sensing {
            agents,
            field_of_view,
            torus,
            ..
        } = *self.sensing;
        let lanes = self.tile * TILE..(self.tile + 1) * TILE;
        let group = &agents.groups[self.group];
        let (mut position, mut velocity) = ([[0.0; TILE]; D], [[0.0; TILE]; D]);
        let mut speed = [0.0; TILE];
        for axis in 0..D {
            position[axis].copy_from_slice(&group.position[axis][lanes.clone()]);
            velocity[axis].copy_from_slice(&group.velocity[axis][lanes.clone()]);
            for agent in 0..TILE {
                speed[agent] += velocity[axis][agent] * velocity[axis][agent];
            }
        }
        for speed in &mut speed {
            *speed = speed.sqrt();
        }
        distances.clear();
        for &tile in tiles {
            let first = tile as usize * TILE;
            let columns = &agents.groups[tile as usize / FANOUT].position;
            for place in first..agents.len().min(first + TILE) {
                let (mut squared, mut along) = ([0.0; TILE], [0.0; TILE]);
                for axis in 0..D {
                    let other = columns[axis][place % GROUP];
                    for agent in 0..TILE {
                        let offset = torus.offset(position[axis][agent], other);
                        squared[agent] += offset * offset;
                        along[agent] += velocity[axis][agent] * offset;
                    }
                }
                if field_of_view != FieldOfView::ALL_ROUND {
                    for agent in 0..TILE {
                        let sees = field_of_view.sees(along[agent], speed[agent], squared[agent]);
                        squared[agent] = if sees { squared[agent] } else { f64::INFINITY };
                    }
                }
                distances.push(squared);
            }
        }
    }
}
