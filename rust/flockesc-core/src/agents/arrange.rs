//! Order of the agents along a Hilbert curve, so that agents that are close in space are close in memory.

use multiversion::multiversion;

use super::layout::{Column, GROUP, Group, corners};
use crate::base::vector::larger;
use crate::parallel;

/// A place on the curve in the upper half, and the place of an agent in the lower half.
pub(super) type Key = u64;

/// Returns the place of the agent of a key.
pub(super) fn place_of(key: Key) -> usize {
    key as u32 as usize
}

/// Writes the keys of the first `num_agents` agents in the order of the curve.
pub(super) fn order<const D: usize>(groups: &[Group<D>], num_agents: usize, keys: &mut Vec<Key>) {
    let (low, high) = corners(groups);
    let extent = (0..D).fold(0.0, |most, axis| larger(most, high[axis] - low[axis]));
    let scale = f64::from((1_u32 << bits::<D>()) - 1) / extent;
    keys.resize(groups.len() * GROUP, 0);
    let (columns, _) = keys.as_chunks_mut::<GROUP>();
    parallel::for_each_chunk(columns, |first, columns| {
        write_keys(&groups[first..], low, scale, first, columns);
    });
    keys.truncate(num_agents);
    parallel::sort(keys);
}

/// Number of bits of a coordinate on the curve.
const fn bits<const D: usize>() -> u32 {
    30 / D as u32
}

/// Writes the keys of all lanes of some groups.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn write_keys<const D: usize>(
    groups: &[Group<D>],
    low: [f64; D],
    scale: f64,
    first: usize,
    keys: &mut [Column<Key>],
) {
    for (index, (group, keys)) in groups.iter().zip(keys).enumerate() {
        let mut coordinates = [[0; GROUP]; D];
        for axis in 0..D {
            for lane in 0..GROUP {
                let offset = group.position[axis][lane] - low[axis];
                coordinates[axis][lane] = (offset * scale) as u32;
            }
        }
        let distance = along_curve(coordinates);
        for lane in 0..GROUP {
            let place = (first + index) * GROUP + lane;
            keys[lane] = Key::from(distance[lane]) << 32 | place as Key;
        }
    }
}

/// Returns the places of points on a Hilbert curve: J. Skilling, "Programming the Hilbert curve", AIP Conf. Proc.
/// 707 (2004), for all lanes at once.
#[inline(always)]
fn along_curve<const D: usize>(mut x: [Column<u32>; D]) -> Column<u32> {
    let bits = bits::<D>();
    for bit in (1..bits).rev() {
        let below = (1 << bit) - 1;
        for axis in 0..D {
            for lane in 0..GROUP {
                // All ones if the bit is set: inverts the first coordinate. Otherwise both exchange their low bits.
                let is_set = (x[axis][lane] >> bit & 1).wrapping_neg();
                let exchanged = (x[0][lane] ^ x[axis][lane]) & below & !is_set;
                x[0][lane] ^= exchanged | (below & is_set);
                x[axis][lane] ^= exchanged;
            }
        }
    }
    for axis in 1..D {
        for lane in 0..GROUP {
            x[axis][lane] ^= x[axis - 1][lane];
        }
    }
    let mut inverted = [0; GROUP];
    for bit in (1..bits).rev() {
        for lane in 0..GROUP {
            inverted[lane] ^= (x[D - 1][lane] >> bit & 1).wrapping_neg() & ((1 << bit) - 1);
        }
    }
    let mut place = [0; GROUP];
    for bit in (0..bits).rev() {
        for column in &x {
            for lane in 0..GROUP {
                place[lane] = place[lane] << 1 | ((column[lane] ^ inverted[lane]) >> bit & 1);
            }
        }
    }
    place
}
