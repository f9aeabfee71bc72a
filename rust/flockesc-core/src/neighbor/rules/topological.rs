//! The topological neighbor rule: the reach of every agent is the distance to its k-th nearest agent in view.

use bytemuck::cast_slice;
use pulp::{Arch, Simd, WithSimd};

use super::rule::{RuleInput, RuleOutput, SearchBuffers};
use crate::agents::{Column, FANOUT, GROUP, LEAF};
use crate::base::vector::{larger, squared_norm};
use crate::neighbor::ranges::SAMPLE;
use crate::parallel;

/// Ratio of the squared search radius to the squared reach in the last step. A reach may grow by 14 % before a step
/// needs a second search.
const MARGIN: f64 = 1.3;
/// Factor of the squared search radius if a search has found too few agents: the radius doubles. Neither constant
/// changes a result.
const GROWTH: f64 = 4.0;

/// Computes the squared reaches.
pub(super) fn find_reaches<const D: usize>(input: &RuleInput<'_, D>, output: &mut RuleOutput) {
    let num_groups = input.distances.agents.groups.len();
    let RuleOutput {
        squares, searches, ..
    } = output;
    squares.resize(num_groups, [0.0; GROUP]);
    searches.resize_with(parallel::num_chunks(num_groups), SearchBuffers::default);
    parallel::for_each_chunk_with(squares, searches, |first, squares, buffers| {
        Arch::new().dispatch(ReachNearest {
            input,
            first,
            squares,
            buffers,
        });
        buffers.trim();
    });
}

/// Returns the mean reach of a sample of the agents, in m.
pub(super) fn typical_reach(output: &RuleOutput) -> f64 {
    let first = output.squares.iter().map(|squares| squares[0].sqrt());
    let sample = first.step_by(output.squares.len().div_ceil(SAMPLE).max(1));
    let (sum, count) = sample.fold((0.0, 1e-300), |(sum, count), r| (sum + r, count + 1.0));
    sum / count
}

/// Replaces the squared reaches `squares` of the groups from `first` on by the squared distances in m^2 to
/// the k-th nearest other agents in view. The new reach is the largest number if there are fewer agents in
/// view, and 0 for k = 0. The old reaches determine the search radius.
struct ReachNearest<'a, const D: usize> {
    input: &'a RuleInput<'a, D>,
    first: usize,
    squares: &'a mut [Column<f64>],
    buffers: &'a mut SearchBuffers,
}

impl<const D: usize> WithSimd for ReachNearest<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let leaves = self.squares.as_flattened_mut().as_chunks_mut::<LEAF>().0;
        for (leaf, squares) in (self.first * FANOUT..).zip(leaves) {
            reach_nearest(simd, self.input, leaf, squares, self.buffers);
        }
    }
}

/// Replaces the squared reaches in m^2 of the agents of one leaf.
#[inline(always)]
fn reach_nearest<S: Simd, const D: usize>(
    simd: S,
    input: &RuleInput<'_, D>,
    leaf: usize,
    squares: &mut [f64; LEAF],
    buffers: &mut SearchBuffers,
) {
    let RuleInput {
        distances,
        tree,
        ranges,
    } = *input;
    let agents = distances.agents;
    let SearchBuffers { leaves, near } = buffers;
    let bounds = tree.levels[0][leaf / FANOUT].bounds_of(leaf % FANOUT);
    let known = squares.iter().copied().filter(|square| *square < f64::MAX);
    let mut limit = MARGIN * known.fold(0.0, larger);
    // Without a reach of an earlier step, agents of the same leaf are the first guess.
    if limit <= 0.0 {
        let size: [f64; D] = std::array::from_fn(|axis| bounds.high[axis] - bounds.low[axis]);
        limit = squared_norm(&size);
    }
    let own = leaf * LEAF..agents.len().min((leaf + 1) * LEAF);
    let mut is_missing = [false; LEAF];
    let mut numbers = [0; LEAF];
    for (lane, place) in own.clone().enumerate() {
        numbers[lane] = (ranges.of(agents.id(place) as u32) + 0.5) as usize;
        squares[lane] = if numbers[lane] == 0 { 0.0 } else { f64::MAX };
        is_missing[lane] = (1..agents.len()).contains(&numbers[lane]);
    }
    // PERF: The agents of a leaf share the list of leaves; an agent leaves the loop as soon as it has its k nearest.
    while is_missing != [false; LEAF] {
        tree.list_leaves(leaves, |node| {
            distances.torus.squared_gap(&bounds, node) <= limit
        });
        for (lane, place) in own.clone().enumerate() {
            if !is_missing[lane] {
                continue;
            }
            near.clear();
            for &leaf in &*leaves {
                for first in (0..LEAF).step_by(S::F64_LANES) {
                    let other = leaf as usize * LEAF + first;
                    let squared = distances.squared_to_register(simd, place, other);
                    let squared: &[f64] = cast_slice(std::slice::from_ref(&squared));
                    near.extend(squared.iter().filter(|squared| **squared <= limit));
                }
            }
            // The agent itself is the nearest.
            if numbers[lane] < near.len() {
                let (_, reach, _) = near.select_nth_unstable_by(numbers[lane], f64::total_cmp);
                squares[lane] = *reach;
            }
            is_missing[lane] = near.len() <= numbers[lane] && limit < f64::MAX;
        }
        let wider = (GROWTH * limit).min(f64::MAX);
        let is_all = leaves.len() == agents.len().div_ceil(LEAF);
        limit = if is_all || wider <= 0.0 {
            f64::MAX
        } else {
            wider
        };
    }
}
