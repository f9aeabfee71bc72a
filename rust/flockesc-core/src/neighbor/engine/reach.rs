//! `Reach`: classification of the tree's nodes as out of reach, partly within reach or entirely within reach.
//!
//! Distances to boxes are computed with the same operations as distances to agents, and rounding is
//! monotonic. The computed squared distance to a box is therefore a lower bound of the computed squared
//! distance to any agent in the box, and the one to the box's farthest corner is an upper bound. No margin
//! for rounding is needed.

use bytemuck::{bytes_of, cast_slice};
use pulp::Simd;

use crate::agents::FANOUT;
use crate::base::vector::{larger, smaller};
use crate::neighbor::engine::field_of_view::{Torus, register_norm};
use crate::neighbor::engine::nodes::{Bounds, Siblings};
use crate::neighbor::ranges::Reaches;

/// The bounding box of some agents, and their shortest and longest reach.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach<const D: usize> {
    torus: Torus,
    bounds: Bounds<D>,
    /// Square of the shortest reach in m^2.
    shortest: f64,
    /// Square of the longest reach in m^2.
    longest: f64,
    /// Whether the shortest reach is at least half the diagonal of the box. Otherwise no node is entirely
    /// within reach.
    pub(crate) may_enclose: bool,
}

impl<const D: usize> Reach<D> {
    /// Creates the reach of agents with the bounding box `bounds` and the squared reaches `squared` in m^2.
    #[inline(always)]
    pub(crate) fn new(
        torus: Torus,
        bounds: Bounds<D>,
        reaches: Reaches<'_>,
        squared: &[f64],
    ) -> Self {
        let (shortest, longest) = if reaches.are_equal() {
            (squared[0], squared[0])
        } else {
            let extremes = (f64::INFINITY, 0.0);
            squared.iter().fold(extremes, |(low, high), &squared| {
                (smaller(low, squared), larger(high, squared))
            })
        };
        let mut diagonal = 0.0;
        for axis in 0..D {
            let side = bounds.high[axis] - bounds.low[axis];
            diagonal += side * side;
        }
        Self {
            torus,
            bounds,
            shortest,
            longest,
            may_enclose: diagonal <= 4.0 * shortest,
        }
    }

    /// Extends the reach by `margin` in m, and reduces the distance up to which agents are within reach of all
    /// agents by as much.
    #[inline(always)]
    pub(crate) fn widen(&mut self, margin: f64) {
        // NOTE: Lists with a margin stay exact: agents near the limit become candidates, which every step tests. Only
        // agents that are inside even after they have drifted by the margin are added without a test.
        let (shortest, longest) = (self.shortest.sqrt(), self.longest.sqrt() + margin);
        self.longest = (longest * longest).min(f64::MAX);
        self.may_enclose &= shortest >= margin;
        self.shortest = (shortest - margin) * (shortest - margin);
    }

    /// Returns a mask of the boxes of one register, with the corners `low` and `high`, that may contain agents
    /// within reach of one of the agents. An agent is a box whose corners coincide.
    #[inline(always)]
    pub(crate) fn meets<S: Simd>(&self, simd: S, low: [S::f64s; D], high: [S::f64s; D]) -> S::m64s {
        let zero = simd.splat_f64s(0.0);
        let mut gap = [zero; D];
        for axis in 0..D {
            let above = simd.sub_f64s(low[axis], simd.splat_f64s(self.bounds.high[axis]));
            let below = simd.sub_f64s(simd.splat_f64s(self.bounds.low[axis]), high[axis]);
            gap[axis] = simd.max_f64s(self.torus.bound(simd, above, below), zero);
        }
        let longest = simd.splat_f64s(self.longest);
        simd.less_than_or_equal_f64s(register_norm(simd, gap), longest)
    }

    /// Returns a mask of the boxes of one register that are entirely within reach of all agents. Only for
    /// [`Self::may_enclose`].
    #[inline(always)]
    pub(crate) fn encloses<S: Simd>(
        &self,
        simd: S,
        low: [S::f64s; D],
        high: [S::f64s; D],
    ) -> S::m64s {
        let mut extent = [simd.splat_f64s(0.0); D];
        for axis in 0..D {
            let up = simd.sub_f64s(high[axis], simd.splat_f64s(self.bounds.low[axis]));
            let down = simd.sub_f64s(simd.splat_f64s(self.bounds.high[axis]), low[axis]);
            extent[axis] = self.torus.bound(simd, up, down);
        }
        let shortest = simd.splat_f64s(self.shortest);
        simd.less_than_or_equal_f64s(register_norm(simd, extent), shortest)
    }

    /// Returns one bit per node for those entirely within reach, and one for those partly within reach.
    #[inline(always)]
    pub(crate) fn classify<S: Simd>(&self, simd: S, nodes: &Siblings<D>) -> (u8, u8) {
        let mut near = 0;
        for register in 0..FANOUT / S::F64_LANES {
            let (low, high) = nodes.corners(simd, register);
            near |= bits(simd, self.meets(simd, low, high)) << (register * S::F64_LANES);
        }
        if near == 0 || !self.may_enclose {
            return (0, near);
        }
        let mut inside = 0;
        for register in 0..FANOUT / S::F64_LANES {
            let (low, high) = nodes.corners(simd, register);
            inside |= bits(simd, self.encloses(simd, low, high)) << (register * S::F64_LANES);
        }
        (inside, near & !inside)
    }
}

/// Converts a mask to one bit per lane.
#[inline(always)]
pub(crate) fn bits<S: Simd>(simd: S, mask: S::m64s) -> u8 {
    if let [bits] = bytes_of(&mask) {
        return *bits; // AVX-512 keeps masks as bits
    }
    let flags = simd.select_u64s(mask, S::as_simd_u64s(&BITS).0[0], simd.splat_u64s(0));
    let flags: &[u64] = cast_slice(std::slice::from_ref(&flags));
    flags.iter().fold(0, |bits, flag| bits | flag) as u8
}

/// The bit of every child of a node.
pub(crate) const BITS: [u64; FANOUT] = [1, 2, 4, 8, 16, 32, 64, 128];
