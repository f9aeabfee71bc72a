//! Metric neighbors by testing all pairs: a tile of listeners at a time hears one candidate after the other.

use multiversion::multiversion;
use nalgebra::SVector;

use super::Ranges;

/// Listeners per tile: few enough for the first-level cache, enough for the compiler to vectorize over.
const TILE: usize = 64;

/// A tile of listeners, coordinate by coordinate, with what they have heard so far.
struct Tile<const D: usize> {
    position: [[f64; TILE]; D],
    squared_range: [f64; TILE],
    sum: [[f64; TILE]; D],
    count: [f64; TILE],
}

/// Calls `heard(i, <v>_i, |N_i|)` for every agent i in order.
pub(super) fn for_each_listener<const D: usize>(
    positions: &[SVector<f64, D>],
    velocities: &[SVector<f64, D>],
    ranges: Ranges<'_>,
    mut heard: impl FnMut(usize, SVector<f64, D>, f64),
) {
    for (index, listeners) in positions.chunks(TILE).enumerate() {
        let first = index * TILE;
        let mut tile = Tile {
            position: [[0.0; TILE]; D],
            squared_range: [0.0; TILE],
            sum: [[0.0; TILE]; D],
            count: [0.0; TILE],
        };
        for (lane, position) in listeners.iter().enumerate() {
            for axis in 0..D {
                tile.position[axis][lane] = position[axis];
            }
            tile.squared_range[lane] = ranges.of(first + lane).powi(2);
        }
        listen(&mut tile, positions, velocities);
        for lane in 0..listeners.len() {
            let sum = SVector::from_fn(|axis, _| tile.sum[axis][lane]);
            heard(first + lane, sum / tile.count[lane], tile.count[lane]);
        }
    }
}

/// Adds velocity and 1 to every listener with ||r - r_candidate||^2 <= rho^2, candidates in index order.
///
/// Lanes never meet, and Rust never fuses multiply and add: every instruction set gives the same bits.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn listen<const D: usize>(
    tile: &mut Tile<D>,
    positions: &[SVector<f64, D>],
    velocities: &[SVector<f64, D>],
) {
    for (position, velocity) in positions.iter().zip(velocities) {
        for lane in 0..TILE {
            let mut squared = 0.0;
            for axis in 0..D {
                let offset = tile.position[axis][lane] - position[axis];
                squared += offset * offset;
            }
            // A factor of 0 or 1, not a branch: this is what lets the loop run in vector registers.
            let near = f64::from(squared <= tile.squared_range[lane]);
            for axis in 0..D {
                tile.sum[axis][lane] += near * velocity[axis];
            }
            tile.count[lane] += near;
        }
    }
}
