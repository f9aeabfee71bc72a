//! The tiles of the tree: their sums of velocities, numbers of agents and boxes.

use pulp::{Arch, Simd, WithSimd};

use crate::agents::{FANOUT, GROUP, Group, TILE};
use crate::base::exact::Scale;
use crate::neighbor::engine::nodes::Siblings;

/// Computes the velocities in fixed point and the sums of tiles of some groups. `num_agents` agents are in them and
/// the following groups.
pub(super) fn add_up_tiles<const D: usize>(
    groups: &mut [Group<D>],
    scale: Scale,
    num_agents: usize,
    tiles: &mut [Siblings<D>],
) {
    Arch::new().dispatch(AddUpTiles {
        groups,
        scale,
        num_agents,
        tiles,
    });
}

/// Computes the boxes of the tiles of some groups.
pub(super) fn box_tiles<const D: usize>(groups: &[Group<D>], tiles: &mut [Siblings<D>]) {
    Arch::new().dispatch(BoxTiles { groups, tiles });
}

struct AddUpTiles<'a, const D: usize> {
    groups: &'a mut [Group<D>],
    scale: Scale,
    num_agents: usize,
    tiles: &'a mut [Siblings<D>],
}

impl<const D: usize> WithSimd for AddUpTiles<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut remaining = self.num_agents as i64;
        for (group, tiles) in self.groups.iter_mut().zip(self.tiles) {
            for axis in 0..D {
                let (velocity, units) = (&group.velocity[axis], &mut group.fixed_velocity[axis]);
                for lane in 0..GROUP {
                    units[lane] = self.scale.quantize(velocity[lane]);
                }
                for tile in 0..FANOUT {
                    tiles.sum[axis][tile] = units.as_chunks::<TILE>().0[tile].iter().sum();
                }
            }
            for count in &mut tiles.count {
                *count = remaining.clamp(0, TILE as i64);
                remaining -= TILE as i64;
            }
        }
    }
}

struct BoxTiles<'a, const D: usize> {
    groups: &'a [Group<D>],
    tiles: &'a mut [Siblings<D>],
}

impl<const D: usize> WithSimd for BoxTiles<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (group, tiles) in self.groups.iter().zip(self.tiles) {
            for axis in 0..D {
                for tile in 0..FANOUT {
                    let column = &group.position[axis].as_chunks::<TILE>().0[tile];
                    (tiles.low[axis][tile], tiles.high[axis][tile]) = extent(simd, column);
                }
            }
        }
    }
}

/// Returns the smallest and the largest coordinate. Empty lanes are NaN, and do not count.
#[inline(always)]
fn extent<S: Simd>(simd: S, column: &[f64; TILE]) -> (f64, f64) {
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
