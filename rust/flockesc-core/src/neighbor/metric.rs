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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;
    use proptest::prelude::*;

    /// Mean velocity and number of neighbors, one pair at a time.
    fn reference<const D: usize>(
        positions: &[SVector<f64, D>],
        velocities: &[SVector<f64, D>],
        ranges: &[f64],
    ) -> Vec<(SVector<f64, D>, f64)> {
        let listener = |i: usize| {
            let mut sum = SVector::zeros();
            let mut count = 0.0;
            for j in 0..positions.len() {
                if (positions[i] - positions[j]).norm_squared() <= ranges[i] * ranges[i] {
                    sum += velocities[j];
                    count += 1.0;
                }
            }
            (sum / count, count)
        };
        (0..positions.len()).map(listener).collect()
    }

    fn kernel<const D: usize>(
        positions: &[SVector<f64, D>],
        velocities: &[SVector<f64, D>],
        ranges: Ranges<'_>,
    ) -> Vec<(SVector<f64, D>, f64)> {
        let mut out = Vec::new();
        for_each_listener(positions, velocities, ranges, |agent, mean, count| {
            assert_eq!(agent, out.len());
            out.push((mean, count));
        });
        out
    }

    fn vectors<const D: usize>(flat: &[f64]) -> Vec<SVector<f64, D>> {
        flat.chunks_exact(D)
            .map(SVector::from_column_slice)
            .collect()
    }

    proptest! {
        /// Bit for bit, for flocks that end before, on and after the edge of a tile.
        #[test]
        fn equals_the_reference(
            n in 1..200_usize,
            flat in prop::collection::vec(-20.0..20.0_f64, 200 * 6),
            ranges in prop::collection::vec(prop_oneof![Just(0.0), 0.0..60.0_f64], 200),
        ) {
            let (positions, velocities) = flat.split_at(n * 3);
            let (positions, velocities) = (vectors::<3>(positions), vectors::<3>(&velocities[..n * 3]));
            let ranges = &ranges[..n];
            prop_assert_eq!(
                kernel(&positions, &velocities, Ranges::PerAgent(ranges)),
                reference(&positions, &velocities, ranges)
            );
            let shared = ranges[0];
            prop_assert_eq!(
                kernel(&positions, &velocities, Ranges::Shared(shared)),
                kernel(&positions, &velocities, Ranges::PerAgent(&vec![shared; n]))
            );
        }
    }

    #[test]
    fn the_boundary_belongs_to_the_neighborhood() {
        let positions = [
            vector![0.0, 0.0],
            vector![3.0, 4.0],
            vector![0.0, 5.0 + 1e-12],
        ];
        let velocities = [vector![1.0, 0.0], vector![0.0, 1.0], vector![9.0, 9.0]];
        let heard = kernel(&positions, &velocities, Ranges::Shared(5.0));
        assert_eq!(heard[0], (vector![0.5, 0.5], 2.0));
    }

    #[test]
    fn coincident_agents_hear_each_other_at_range_zero() {
        let positions = [vector![1.0, 1.0]; 3];
        let velocities = [vector![3.0, 0.0], vector![0.0, 3.0], vector![0.0, 0.0]];
        for (mean, count) in kernel(&positions, &velocities, Ranges::Shared(0.0)) {
            assert_eq!((mean, count), (vector![1.0, 1.0], 3.0));
        }
    }
}
