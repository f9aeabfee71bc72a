//! The topological neighbor rule: neighbors are the k nearest agents in view.

use multiversion::multiversion;
use serde::{Deserialize, Serialize};

use super::rule::{Criterion, Found, Rule, SearchBuffers, Sensing};
use crate::agents::{Column, FANOUT, GROUP, Group, TILE};
use crate::base::vector::{larger, squared_norm};
use crate::neighbor::engine::field_of_view::FieldOfView;
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
        });
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
    let mut numbers = [0; GROUP];
    for (group, squares) in (first..).zip(squares) {
        let ids = sensing.agents.ids_of(group);
        for (number, &id) in numbers.iter_mut().zip(ids) {
            *number = (sensing.ranges.of(id) + 0.5) as usize;
        }
        for start in (0..ids.len()).step_by(TILE) {
            let lanes = start..ids.len().min(start + TILE);
            let search = Search {
                sensing,
                group,
                start,
            };
            search.fill(&numbers[lanes.clone()], &mut squares[lanes], buffers);
        }
    }
}

/// Search for the neighbors of the agents of one tile.
struct Search<'a, const D: usize> {
    sensing: &'a Sensing<'a, D>,
    group: usize,
    /// Lane of the first agent.
    start: usize,
}

impl<const D: usize> Search<'_, D> {
    #[inline(always)]
    fn fill(&self, numbers: &[usize], squares: &mut [f64], buffers: &mut SearchBuffers) {
        let Sensing {
            agents,
            tree,
            torus,
            ..
        } = *self.sensing;
        let bounds = tree.levels[0][self.group].bounds_of(self.start / TILE);
        let known = squares.iter().copied().filter(|square| *square < f64::MAX);
        let mut square = MARGIN * known.fold(0.0, larger);
        if square <= 0.0 {
            let size: [f64; D] = std::array::from_fn(|axis| bounds.high[axis] - bounds.low[axis]);
            square = squared_norm(&size);
        }
        let mut next = 0;
        while next < numbers.len() {
            buffers.tiles.clear();
            tree.list_tiles(&mut buffers.tiles, |node| {
                torus.squared_gap(&bounds, node) <= square
            });
            while next < numbers.len() {
                let own = (MARGIN * squares[next]).min(square);
                let reach = self
                    .reach(next, numbers[next], own, buffers)
                    .or_else(|| self.reach(next, numbers[next], square, buffers));
                match reach {
                    Some(reach) => squares[next] = reach,
                    None if square >= f64::MAX => squares[next] = f64::MAX,
                    None => break,
                }
                next += 1;
            }
            let is_all = buffers.tiles.len() == agents.len().div_ceil(TILE);
            let wider = (GROWTH * square).min(f64::MAX);
            square = if is_all || wider <= 0.0 {
                f64::MAX
            } else {
                wider
            };
        }
    }

    /// Returns the squared distance in m^2 to the k-th nearest agent in view, if it is at most `square`.
    #[inline(always)]
    fn reach(
        &self,
        agent: usize,
        k: usize,
        square: f64,
        buffers: &mut SearchBuffers,
    ) -> Option<f64> {
        let Sensing { agents, torus, .. } = *self.sensing;
        if k == 0 {
            return Some(0.0);
        }
        if k >= agents.len() {
            return Some(f64::MAX);
        }
        let lane = self.start + agent;
        let group = &agents.groups[self.group];
        let own: [f64; D] = std::array::from_fn(|axis| group.position[axis][lane]);
        let SearchBuffers { tiles, distances } = buffers;
        distances.resize(tiles.len() * TILE, 0);
        let mut found = 0;
        for &tile in tiles.iter() {
            let others = &agents.groups[tile as usize / FANOUT];
            let first = tile as usize % FANOUT * TILE;
            let mut squared = [0.0; TILE];
            for axis in 0..D {
                let column = &others.position[axis][first..first + TILE];
                for (squared, &place) in squared.iter_mut().zip(column) {
                    let offset = torus.offset(own[axis], place);
                    *squared += offset * offset;
                }
            }
            for (place, squared) in (first..).zip(squared) {
                let is_near = squared <= square && self.sees(lane, others, place, squared);
                distances[found] = squared.to_bits();
                found += usize::from(is_near);
            }
        }
        // Index 0 is the agent itself.
        let found = &mut distances[..found];
        (found.len() > k).then(|| f64::from_bits(*found.select_nth_unstable(k).1))
    }

    /// Returns whether the agent in `lane` sees the agent in lane `place` of the group `others`.
    #[inline(always)]
    fn sees(&self, lane: usize, others: &Group<D>, place: usize, squared: f64) -> bool {
        let Sensing {
            agents,
            field_of_view,
            torus,
            ..
        } = *self.sensing;
        if field_of_view == FieldOfView::ALL_ROUND {
            return true;
        }
        let group = &agents.groups[self.group];
        let (mut along, mut speed) = (0.0, 0.0);
        for axis in 0..D {
            let (own, velocity) = (group.position[axis][lane], group.velocity[axis][lane]);
            along += velocity * torus.offset(own, others.position[axis][place]);
            speed += velocity * velocity;
        }
        field_of_view.sees(along, speed.sqrt(), squared)
    }
}
