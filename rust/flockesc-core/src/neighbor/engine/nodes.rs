//! The nodes of the tree: boxes with the sums of velocities and the numbers of the agents in them.

use pulp::Simd;

use crate::agents::FANOUT;
use crate::base::vector::{larger, smaller};

/// A block of eight sibling nodes: their bounding boxes, sums of velocities and numbers of agents.
///
/// The box of a node without agents extends from infinity to minus infinity.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(in crate::neighbor) struct Siblings<const D: usize> {
    pub(in crate::neighbor) low: [[f64; FANOUT]; D],
    pub(in crate::neighbor) high: [[f64; FANOUT]; D],
    pub(in crate::neighbor) sum: [[i64; FANOUT]; D],
    pub(in crate::neighbor) count: [i64; FANOUT],
}

/// A bounding box of some agents.
#[derive(Debug, Clone, Copy)]
pub(in crate::neighbor) struct Bounds<const D: usize> {
    pub(in crate::neighbor) low: [f64; D],
    pub(in crate::neighbor) high: [f64; D],
}

impl<const D: usize> Siblings<D> {
    pub(in crate::neighbor) const EMPTY: Self = Self {
        low: [[f64::INFINITY; FANOUT]; D],
        high: [[f64::NEG_INFINITY; FANOUT]; D],
        sum: [[0; FANOUT]; D],
        count: [0; FANOUT],
    };

    /// Returns the box of one node.
    #[inline(always)]
    pub(in crate::neighbor) fn bounds_of(&self, child: usize) -> Bounds<D> {
        Bounds {
            low: std::array::from_fn(|axis| self.low[axis][child]),
            high: std::array::from_fn(|axis| self.high[axis][child]),
        }
    }

    /// Returns the number of agents of the nodes whose bits are set.
    #[inline(always)]
    pub(in crate::neighbor) fn count_of(&self, bits: u8) -> i64 {
        let mut count = 0;
        for child in 0..FANOUT {
            count += self.count[child] * i64::from(bits >> child & 1);
        }
        count
    }

    /// Loads the corners of one register of boxes.
    #[inline(always)]
    pub(in crate::neighbor) fn corners<S: Simd>(
        &self,
        simd: S,
        register: usize,
    ) -> ([S::f64s; D], [S::f64s; D]) {
        let mut corners = ([simd.splat_f64s(0.0); D], [simd.splat_f64s(0.0); D]);
        for axis in 0..D {
            corners.0[axis] = S::as_simd_f64s(&self.low[axis]).0[register];
            corners.1[axis] = S::as_simd_f64s(&self.high[axis]).0[register];
        }
        corners
    }

    /// Returns the box around all eight nodes.
    #[inline(always)]
    pub(in crate::neighbor) fn bounds(&self) -> Bounds<D> {
        Bounds {
            low: std::array::from_fn(|axis| {
                self.low[axis].iter().copied().fold(f64::INFINITY, smaller)
            }),
            high: std::array::from_fn(|axis| {
                self.high[axis]
                    .iter()
                    .copied()
                    .fold(f64::NEG_INFINITY, larger)
            }),
        }
    }
}
