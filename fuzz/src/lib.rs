//! Shared code of the fuzz targets: generation of scenarios from bytes, and invariants of a flock.

mod maker;
mod numbers;
mod scenario;

use flockesc_core::{Ranges, World};

pub use numbers::{any_range, coordinates, rarely};
pub use scenario::documents;

/// Asserts that every number is finite and every count and fraction is in bounds.
pub fn assert_world_is_sound<const D: usize>(world: &World<D>, ranges: Ranges<'_>) {
    let predators = world.predators().iter();
    let vectors = [world.positions(), world.velocities()].concat();
    let predators = predators.flat_map(|predator| [predator.position, predator.velocity]);
    for vector in vectors.into_iter().chain(predators) {
        assert!(vector.iter().all(|entry| entry.is_finite()), "{vector}");
    }
    let n = world.config().num_agents;
    let num_left = n - world.caught().len();
    assert_eq!(world.fraction_surviving(), num_left as f64 / n as f64);
    assert!((num_left.min(1)..=num_left).contains(&world.num_components(ranges)));
    assert!((0.0..=1.0).contains(&world.polarization()));
    let distance = world.predator_distance();
    if world.predators().is_empty() {
        let expected = if num_left > 0 { f64::INFINITY } else { 0.0 };
        assert_eq!((distance.mean, distance.minimum), (expected, expected));
    } else {
        assert!(distance.mean.is_finite() && distance.minimum >= 0.0);
        // Rounding may make the mean of equal distances smaller than the distances.
        assert!(distance.minimum <= distance.mean * (1.0 + 1e-12));
    }
}
