//! The nodes of the tree: boxes with the sums of velocities and the numbers of the agents in them.

use pulp::{Arch, Simd, WithSimd};

use crate::agents::{FANOUT, GROUP, Group, LEAF};
use crate::base::exact::Scale;
use crate::base::vector::{larger, smaller};

/// A block of eight sibling nodes: their bounding boxes, sums of velocities and numbers of agents.
///
/// The box of a node without agents extends from infinity to minus infinity.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Siblings<const D: usize> {
    pub(crate) low: [[f64; FANOUT]; D],
    pub(crate) high: [[f64; FANOUT]; D],
    pub(crate) sum: [[i64; FANOUT]; D],
    pub(crate) count: [i64; FANOUT],
}

/// A bounding box of some agents.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds<const D: usize> {
    pub(crate) low: [f64; D],
    pub(crate) high: [f64; D],
}

impl<const D: usize> Siblings<D> {
    pub(crate) const EMPTY: Self = Self {
        low: [[f64::INFINITY; FANOUT]; D],
        high: [[f64::NEG_INFINITY; FANOUT]; D],
        sum: [[0; FANOUT]; D],
        count: [0; FANOUT],
    };

    /// Returns the box of one node.
    #[inline(always)]
    pub(crate) fn bounds_of(&self, child: usize) -> Bounds<D> {
        Bounds {
            low: std::array::from_fn(|axis| self.low[axis][child]),
            high: std::array::from_fn(|axis| self.high[axis][child]),
        }
    }

    /// Returns the number of agents of the nodes whose bits are set.
    #[inline(always)]
    pub(crate) fn count_of(&self, bits: u8) -> i64 {
        let mut count = 0;
        for child in 0..FANOUT {
            count += self.count[child] * i64::from(bits >> child & 1);
        }
        count
    }

    /// Loads the corners of one register of boxes.
    #[inline(always)]
    pub(crate) fn corners<S: Simd>(
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
    pub(crate) fn bounds(&self) -> Bounds<D> {
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

/// Computes the velocities in fixed point and the sums of leaves of some groups. `num_agents` agents are in them and
/// the following groups.
pub(super) fn add_up_leaves<const D: usize>(
    groups: &mut [Group<D>],
    scale: Scale,
    num_agents: usize,
    leaves: &mut [Siblings<D>],
) {
    Arch::new().dispatch(AddUpLeaves {
        groups,
        scale,
        num_agents,
        leaves,
    });
}

/// Computes the boxes of the leaves of some groups.
pub(super) fn box_leaves<const D: usize>(groups: &[Group<D>], leaves: &mut [Siblings<D>]) {
    Arch::new().dispatch(BoxLeaves { groups, leaves });
}

struct AddUpLeaves<'a, const D: usize> {
    groups: &'a mut [Group<D>],
    scale: Scale,
    num_agents: usize,
    leaves: &'a mut [Siblings<D>],
}

impl<const D: usize> WithSimd for AddUpLeaves<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut remaining = self.num_agents as i64;
        for (group, leaves) in self.groups.iter_mut().zip(self.leaves) {
            for axis in 0..D {
                let (velocity, units) = (&group.velocity[axis], &mut group.fixed_velocity[axis]);
                for lane in 0..GROUP {
                    units[lane] = self.scale.quantize(velocity[lane]);
                }
                for leaf in 0..FANOUT {
                    leaves.sum[axis][leaf] = units.as_chunks::<LEAF>().0[leaf].iter().sum();
                }
            }
            for count in &mut leaves.count {
                *count = remaining.clamp(0, LEAF as i64);
                remaining -= LEAF as i64;
            }
        }
    }
}

struct BoxLeaves<'a, const D: usize> {
    groups: &'a [Group<D>],
    leaves: &'a mut [Siblings<D>],
}

impl<const D: usize> WithSimd for BoxLeaves<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (group, leaves) in self.groups.iter().zip(self.leaves) {
            for axis in 0..D {
                for leaf in 0..FANOUT {
                    let column = &group.position[axis].as_chunks::<LEAF>().0[leaf];
                    (leaves.low[axis][leaf], leaves.high[axis][leaf]) = extent(simd, column);
                }
            }
        }
    }
}

/// Returns the smallest and the largest coordinate. Empty lanes are NaN, and do not count.
#[inline(always)]
fn extent<S: Simd>(simd: S, column: &[f64; LEAF]) -> (f64, f64) {
    let mut lowest = simd.splat_f64s(f64::INFINITY);
    let mut highest = simd.splat_f64s(f64::NEG_INFINITY);
    for register in S::as_simd_f64s(column).0 {
        let is_agent = simd.equal_f64s(*register, *register);
        let low = simd.select_f64s(is_agent, *register, lowest);
        let high = simd.select_f64s(is_agent, *register, highest);
        (lowest, highest) = (simd.min_f64s(lowest, low), simd.max_f64s(highest, high));
    }
    (simd.reduce_min_f64s(lowest), simd.reduce_max_f64s(highest))
}
