//! How far the k-th nearest agent is, of those that are seen.

use super::Ranges;
use super::rule::NeighborOptions;
use super::tree::Tree;
use crate::agents::{Agents, Column, FAN, GROUP, TILE};
use crate::metrics::{larger, squared_norm};

/// By how much a search that has found too few is widened: the factor of the squared distance.
const WIDER: f64 = 4.0;

/// Lists that keep their memory from step to step.
#[derive(Debug, Clone, Default)]
pub(super) struct Scratch {
    tiles: Vec<u32>,
    distances: Vec<f64>,
}

/// k, the number that a range stands for: the nearest whole one.
fn number(range: f64) -> usize {
    (range + 0.5) as usize
}

/// Replaces `squares`, of the groups from `first` on, by the squared distance in m^2 to the k-th nearest other agent of
/// those that are seen: the largest number where there are fewer, 0 for k = 0. What it held guides the search.
pub(super) fn reach_nearest<const D: usize>(
    agents: &Agents<D>,
    tree: &Tree<D>,
    options: &NeighborOptions,
    ranges: Ranges<'_>,
    first: usize,
    squares: &mut [Column<f64>],
    scratch: &mut Scratch,
) {
    let mut numbers = [0; GROUP];
    for (group, squares) in (first..).zip(squares) {
        let names = agents.names_of(group);
        for (number_of, &name) in numbers.iter_mut().zip(names) {
            *number_of = number(ranges.of(name));
        }
        for start in (0..names.len()).step_by(TILE) {
            let lanes = start..names.len().min(start + TILE);
            let search = Search {
                agents,
                tree,
                options,
                group,
                start,
            };
            search.fill(&numbers[lanes.clone()], &mut squares[lanes], scratch);
        }
    }
}

/// The search for the agents of one tile.
struct Search<'a, const D: usize> {
    agents: &'a Agents<D>,
    tree: &'a Tree<D>,
    options: &'a NeighborOptions,
    group: usize,
    /// Lane of the first agent.
    start: usize,
}

impl<const D: usize> Search<'_, D> {
    fn fill(&self, numbers: &[usize], squares: &mut [f64], scratch: &mut Scratch) {
        let bounds = self.tree.levels[0][self.group].bounds_of(self.start / TILE);
        let size: [f64; D] = std::array::from_fn(|axis| bounds.high[axis] - bounds.low[axis]);
        let guess = squares.iter().copied().filter(|square| *square < f64::MAX);
        // A little more than in the last step; at first, as far as the tile is wide.
        let mut square = WIDER.sqrt() * larger(guess.fold(0.0, larger), squared_norm(&size));
        let mut next = 0;
        while next < numbers.len() {
            scratch.tiles.clear();
            self.tree
                .near(&bounds, square, self.options.torus, &mut scratch.tiles);
            while next < numbers.len() {
                match self.reach(next, numbers[next], square, scratch) {
                    Some(reach) => squares[next] = reach,
                    None if square >= f64::MAX => squares[next] = f64::MAX,
                    None => break,
                }
                next += 1;
            }
            let is_all = scratch.tiles.len() == self.agents.len().div_ceil(TILE);
            let wider = (WIDER * square).min(f64::MAX);
            square = if is_all || wider <= 0.0 {
                f64::MAX
            } else {
                wider
            };
        }
    }

    /// The squared distance to the k-th nearest agent that the agent sees, where it is at most `square`.
    fn reach(&self, agent: usize, k: usize, square: f64, scratch: &mut Scratch) -> Option<f64> {
        let Self {
            agents, options, ..
        } = *self;
        if k == 0 {
            return Some(0.0);
        }
        if k >= agents.len() {
            return Some(f64::MAX);
        }
        let lane = self.start + agent;
        let group = &agents.groups[self.group];
        let own: [f64; D] = std::array::from_fn(|axis| group.position[axis][lane]);
        let velocity: [f64; D] = std::array::from_fn(|axis| group.velocity[axis][lane]);
        let Scratch { tiles, distances } = scratch;
        distances.resize(tiles.len() * TILE, 0.0);
        let mut found = 0;
        for &tile in tiles.iter() {
            let other = &agents.groups[tile as usize / FAN].position;
            for place in (tile as usize % FAN * TILE..).take(TILE) {
                let offset: [f64; D] =
                    std::array::from_fn(|axis| options.torus.offset(own[axis], other[axis][place]));
                let squared = squared_norm(&offset);
                let is_seen = squared <= square && options.sight.sees(&velocity, &offset, squared);
                distances[found] = squared;
                found += usize::from(is_seen);
            }
        }
        // The agent itself is the nearest.
        let found = &mut distances[..found];
        (found.len() > k).then(|| *found.select_nth_unstable_by(k, f64::total_cmp).1)
    }
}
