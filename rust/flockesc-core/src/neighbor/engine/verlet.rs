//! `VerletLists`: decides whether the candidates of an earlier step are still complete.

use multiversion::multiversion;
use pulp::Scalar;

use crate::agents::{Agents, Column, GROUP, Group, reduce};
use crate::base::vector::{larger, smaller, squared_norm};
use crate::neighbor::engine::field_of_view::Torus;
use crate::neighbor::ranges::{Ranges, SAMPLE};

/// Number of steps for which new candidates should be complete. More steps need a wider margin, whose candidates are
/// tested in every step; three to eight were no faster.
const STEPS: f64 = 5.0;
/// Number of steps after which too many candidates may have become few enough: at most one search in 32 is in vain.
const PAUSE: usize = 32;
/// Fraction of the reach, or of the side of a periodic domain, that covers the rounding of distances. It is larger
/// than the rounding.
const ROUNDING: f64 = 1e-12;

/// What a step does with the candidates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Reuse {
    /// Finds candidates and discards them.
    Discarded,
    /// Finds candidates with this margin in m for the following steps too.
    New(f64),
    /// Takes the candidates of an earlier step.
    Kept,
}

/// Positions and ranges at the time of the last search for candidates.
///
/// Since then, the distance of two agents has changed by at most the diameter of a circle around all displacements.
/// Candidates are complete while it is at most their margin.
#[derive(Debug, Clone)]
pub(crate) struct VerletLists<const D: usize> {
    torus: Torus,
    positions: Vec<[Column<f64>; D]>,
    /// In m: one range, or one per agent.
    ranges: Vec<f64>,
    /// Number of agents, or 0 if the candidates are useless.
    num_agents: usize,
    /// Margin of the candidates in m, if there are any.
    margin: Option<f64>,
    /// Number of steps that have taken these candidates.
    steps: usize,
    /// Number of steps for which candidates are not kept.
    pause: usize,
}

impl<const D: usize> VerletLists<D> {
    pub(crate) fn new(torus: Torus) -> Self {
        Self {
            torus,
            positions: Vec::new(),
            ranges: Vec::new(),
            num_agents: 0,
            margin: None,
            steps: 0,
            pause: 0,
        }
    }

    /// Forgets the candidates, and pauses because there were too many to keep.
    pub(crate) fn pause(&mut self) {
        self.margin = None;
        self.pause = PAUSE;
    }

    /// Decides what the next step does with the candidates.
    pub(crate) fn plan(&mut self, agents: &Agents<D>, ranges: Ranges<'_>) -> Reuse {
        let ranges = slice(&ranges);
        // NOTE: Lists belong to ranges: a longer range has further neighbors, and a shorter one no longer reaches all
        // that was added as a whole. New ranges get no margin, because a policy may change them in the next step too. A
        // capture moves agents to other places.
        if self.num_agents != agents.len() || self.ranges != ranges {
            return Reuse::Discarded;
        }
        if self.pause > 0 {
            self.pause -= 1;
            return Reuse::Discarded;
        }
        let drift = if self.torus == Torus::NONE {
            drift::<D, false>(&agents.groups, &self.positions, Torus::NONE)
        } else {
            drift::<D, true>(&agents.groups, &self.positions, self.torus)
        };
        // Offsets across the border have the rounding error of the side.
        let longest = ranges
            .iter()
            .copied()
            .fold(self.torus.0.unwrap_or(0.0), larger);
        let is_complete = |margin| drift <= margin - ROUNDING * (longest + margin);
        if self.margin.is_some_and(is_complete) {
            self.steps += 1;
            return Reuse::Kept;
        }
        // The drift per step since the last search predicts that of the next steps. A wrong prediction costs time only.
        Reuse::New(STEPS * drift / self.steps as f64)
    }

    /// Stores the time of a search for candidates. Places of agents must not change after it.
    pub(crate) fn store(&mut self, agents: &Agents<D>, ranges: Ranges<'_>, reuse: Reuse) {
        self.margin = match reuse {
            Reuse::New(margin) => Some(margin),
            Reuse::Discarded | Reuse::Kept => None,
        };
        self.positions.clear();
        self.positions.reserve_exact(agents.groups.len());
        let positions = agents.groups.iter().map(|group| group.position);
        self.positions.extend(positions);
        self.ranges.clear();
        self.ranges.extend_from_slice(slice(&ranges));
        self.num_agents = agents.len();
        self.steps = 1;
    }
}

fn slice<'a>(ranges: &'a Ranges<'_>) -> &'a [f64] {
    match ranges {
        Ranges::Shared(range) => std::slice::from_ref(range),
        Ranges::PerAgent(ranges) => ranges,
    }
}

/// Returns a bound in m of the change of any distance since `before`: the diameter of a circle around all
/// displacements. Its center is that of the bounding box of a sample.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn drift<const D: usize, const IS_PERIODIC: bool>(
    groups: &[Group<D>],
    before: &[[Column<f64>; D]],
    torus: Torus,
) -> f64 {
    // The compiler removes the wrapping by a constant `Torus::NONE`.
    let torus = if IS_PERIODIC { torus } else { Torus::NONE };
    let moved = |group: &Group<D>, before: &[Column<f64>; D], axis: usize, lane: usize| {
        let (before, after) = (before[axis][lane], group.position[axis][lane]);
        torus.offset(Scalar::new(), before, after)
    };
    let step = groups.len().div_ceil(SAMPLE);
    let center: [f64; D] = std::array::from_fn(|axis| {
        let (mut low, mut high) = ([f64::INFINITY; GROUP], [f64::NEG_INFINITY; GROUP]);
        for (group, before) in groups.iter().zip(before).step_by(step) {
            for lane in 0..GROUP {
                let moved = moved(group, before, axis, lane);
                low[lane] = smaller(low[lane], moved);
                high[lane] = larger(high[lane], moved);
            }
        }
        0.5 * (reduce(low, smaller) + reduce(high, larger))
    });
    let mut farthest = [0.0; GROUP];
    for (group, before) in groups.iter().zip(before) {
        for lane in 0..GROUP {
            let offset: [f64; D] =
                std::array::from_fn(|axis| moved(group, before, axis, lane) - center[axis]);
            farthest[lane] = larger(farthest[lane], squared_norm(&offset));
        }
    }
    2.0 * reduce(farthest, larger).sqrt()
}
