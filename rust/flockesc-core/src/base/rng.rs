//! Random streams: ChaCha8 with one stream per purpose, so that additional draws for one purpose do not
//! change another.

use std::f64::consts::TAU;

use nalgebra::SVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The purpose of a random stream. The numbers never change, because they determine what a seed generates.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Stream {
    Positions = 0,
    Headings = 1,
    LineState = 2,
    Episodes = 3,
    Predators = 4,
    Motion = 5,
    Scenario = 6,
}

/// Creates the generator of the stream for `purpose` under `seed`.
pub(crate) fn stream(seed: u64, purpose: Stream) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(purpose as u64);
    rng
}

/// Returns the seed of the `episode`-th episode after an episode with seed `seed`: `seed` itself for 0,
/// otherwise a number in [2^32, 2^63), which does not collide with the small seeds that users choose.
///
/// The seed depends on nothing else, so that every episode of a long run can be repeated by itself.
pub fn episode_seed(seed: u64, episode: u64) -> u64 {
    if episode == 0 {
        return seed;
    }
    let mut rng = stream(seed, Stream::Episodes);
    rng.set_word_pos(2 * u128::from(episode)); // one u64 per episode is two words of 32 bits
    rng.random::<u64>() >> 1 | 1 << 32
}

/// Draws a number uniformly from [0, `end`).
pub(crate) fn uniform(rng: &mut ChaCha8Rng, end: f64) -> f64 {
    end * rng.random::<f64>()
}

/// Draws a standard normal number by the Box-Muller transform of two uniform numbers.
///
/// `rand_distr` is not used, because it calls the platform's logarithm and exponential, which differ between
/// machines.
pub(crate) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * libm::log(1.0 - uniform(rng, 1.0))).sqrt();
    radius * libm::cos(uniform(rng, TAU))
}

/// Draws a unit vector uniformly from all directions in space, or in the plane z = 0 if `axes` is 2.
pub(crate) fn direction<const D: usize>(axes: usize, rng: &mut ChaCha8Rng) -> SVector<f64, D> {
    let angle = uniform(rng, TAU);
    let height = match axes {
        3 => 2.0 * uniform(rng, 1.0) - 1.0,
        _ => 0.0,
    };
    let radius = (1.0 - height * height).sqrt();
    // libm instead of the platform's sin and cos, so that a seed generates the same flock on every machine.
    let entries = [radius * libm::cos(angle), radius * libm::sin(angle), height];
    SVector::from_fn(|axis, _| entries[axis])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// These numbers must never change, on any machine, because they determine what a seed generates.
    #[test]
    fn first_draws_of_every_stream() {
        let first = |seed, purpose| uniform(&mut stream(seed, purpose), 1.0);
        let draws = [
            first(0, Stream::Positions),
            first(0, Stream::Headings),
            first(0, Stream::LineState),
            first(1, Stream::Positions),
            first(0, Stream::Predators),
            first(0, Stream::Motion),
            first(0, Stream::Scenario),
        ];
        let expected = [
            0.7090754154265618,
            0.755531016687046,
            0.3322203532055784,
            0.40248566366484806,
            0.8559481151591954,
            0.17798116242481665,
            0.1552739039243184,
        ];
        assert_eq!(draws, expected);
    }

    /// Normal numbers have the same bits on every machine, too.
    #[test]
    fn normal_numbers() {
        let mut rng = stream(0, Stream::Predators);
        assert_eq!(normal(&mut rng), -1.2841536497729553);
        let moments = (0..100_000).fold([0.0; 3], |[mean, square, fourth], _| {
            let x = normal(&mut rng);
            [mean + x, square + x * x, fourth + x.powi(4)]
        });
        for (sum, expected) in moments.into_iter().zip([0.0, 1.0, 3.0]) {
            assert!((sum / 1e5 - expected).abs() < 0.1);
        }
    }

    /// These numbers must never change either.
    #[test]
    fn seeds_of_later_episodes() {
        assert_eq!(episode_seed(7, 0), 7);
        let expected = [
            856_522_681_599_956_647,
            9_029_727_068_422_764_021,
            6_527_866_856_406_044_275,
        ];
        assert_eq!([1, 2, 1_000_000].map(|k| episode_seed(7, k)), expected);
        let mut seeds: Vec<u64> = (0..100)
            .flat_map(|seed| (1..100).map(move |episode| episode_seed(seed, episode)))
            .collect();
        assert!(seeds.iter().all(|seed| (1 << 32..1 << 63).contains(seed)));
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), 100 * 99);
    }
}
