//! How far the k-th nearest agent is, of those that are seen.

use multiversion::multiversion;

use crate::agents::{Agents, Column, FAN, GROUP, Group, TILE};
use crate::base::vector::{larger, squared_norm};
use crate::neighbor::Ranges;
use crate::neighbor::engine::field_of_view::Sight;
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::options::NeighborOptions;

/// The factor of the squared distance by which a search looks beyond what sufficed in the last step.
const AHEAD: f64 = 1.3;
/// The factor by which a search that has found too few is widened.
const WIDER: f64 = 4.0;

/// Lists that keep their memory from step to step.
#[derive(Debug, Clone, Default)]
pub(in crate::neighbor) struct Scratch {
    tiles: Vec<u32>,
    /// Squared distances in m^2 as bits, which have the order of the numbers where none is negative.
    distances: Vec<u64>,
}

/// Replaces `squares`, of the groups from `first` on, by the squared distance in m^2 to the k-th nearest other agent of
/// those that are seen: the largest number where there are fewer, 0 for k = 0. What it held guides the search.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(in crate::neighbor) fn reach_nearest<const D: usize>(
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
        for (number, &name) in numbers.iter_mut().zip(names) {
            *number = (ranges.of(name) + 0.5) as usize;
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
    #[inline(always)]
    fn fill(&self, numbers: &[usize], squares: &mut [f64], scratch: &mut Scratch) {
        let bounds = self.tree.levels[0][self.group].bounds_of(self.start / TILE);
        let known = squares.iter().copied().filter(|square| *square < f64::MAX);
        let mut square = AHEAD * known.fold(0.0, larger);
        if square <= 0.0 {
            let size: [f64; D] = std::array::from_fn(|axis| bounds.high[axis] - bounds.low[axis]);
            square = squared_norm(&size);
        }
        let mut next = 0;
        while next < numbers.len() {
            scratch.tiles.clear();
            let torus = self.options.torus;
            self.tree.near(&bounds, square, torus, &mut scratch.tiles);
            while next < numbers.len() {
                let own = (AHEAD * squares[next]).min(square);
                let reach = self
                    .reach(next, numbers[next], own, scratch)
                    .or_else(|| self.reach(next, numbers[next], square, scratch));
                match reach {
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
    #[inline(always)]
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
        let Scratch { tiles, distances } = scratch;
        distances.resize(tiles.len() * TILE, 0);
        let mut found = 0;
        for &tile in tiles.iter() {
            let others = &agents.groups[tile as usize / FAN];
            let first = tile as usize % FAN * TILE;
            let mut squared = [0.0; TILE];
            for axis in 0..D {
                let column = &others.position[axis][first..first + TILE];
                for (squared, &place) in squared.iter_mut().zip(column) {
                    let offset = options.torus.offset(own[axis], place);
                    *squared += offset * offset;
                }
            }
            for (place, squared) in (first..).zip(squared) {
                let is_near = squared <= square && self.sees(lane, others, place, squared);
                distances[found] = squared.to_bits();
                found += usize::from(is_near);
            }
        }
        // The agent itself is the nearest.
        let found = &mut distances[..found];
        (found.len() > k).then(|| f64::from_bits(*found.select_nth_unstable(k).1))
    }

    /// Whether the agent in `lane` sees the one in `place` of a group.
    #[inline(always)]
    fn sees(&self, lane: usize, others: &Group<D>, place: usize, squared: f64) -> bool {
        let Self {
            agents, options, ..
        } = *self;
        if options.sight == Sight::ALL_ROUND {
            return true;
        }
        let group = &agents.groups[self.group];
        let (mut along, mut speed) = (0.0, 0.0);
        for axis in 0..D {
            let (own, velocity) = (group.position[axis][lane], group.velocity[axis][lane]);
            along += velocity * options.torus.offset(own, others.position[axis][place]);
            speed += velocity * velocity;
        }
        options.sight.sees(along, speed.sqrt(), squared)
    }
}
