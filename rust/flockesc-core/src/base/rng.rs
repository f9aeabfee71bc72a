//! Random streams: ChaCha8, one stream per purpose, so that new draws for one purpose never move another.

use std::f64::consts::TAU;

use nalgebra::SVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a stream is drawn for; the number is part of the meaning of a seed and never changes.
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

/// The generator for `purpose` under `seed`.
pub(crate) fn stream(seed: u64, purpose: Stream) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(purpose as u64);
    rng
}

/// Seed of the `episode`-th episode that follows one started with `seed`: `seed` itself for 0, then numbers
/// in [2^32, 2^63), so that a seed that people name never comes up by chance.
///
/// A pure function: every episode of a long run can be played alone.
#[must_use]
pub fn episode_seed(seed: u64, episode: u64) -> u64 {
    if episode == 0 {
        return seed;
    }
    let mut rng = stream(seed, Stream::Episodes);
    rng.set_word_pos(2 * u128::from(episode)); // an episode's u64 is two words of 32 bits
    rng.random::<u64>() >> 1 | 1 << 32
}

/// Uniform on [0, `end`).
pub(crate) fn uniform(rng: &mut ChaCha8Rng, end: f64) -> f64 {
    end * rng.random::<f64>()
}

/// Standard normal, by Box and Muller from two uniforms.
///
/// Not of `rand_distr`: its logarithms and exponentials are the platform's, and a seed would mean another flock on
/// another machine.
pub(crate) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * libm::log(1.0 - uniform(rng, 1.0))).sqrt();
    radius * libm::cos(uniform(rng, TAU))
}

/// A unit vector, uniform over all directions in space, or where `axes` is 2 in the plane z = 0.
pub(crate) fn direction<const D: usize>(axes: usize, rng: &mut ChaCha8Rng) -> SVector<f64, D> {
    let angle = uniform(rng, TAU);
    let height = match axes {
        3 => 2.0 * uniform(rng, 1.0) - 1.0,
        _ => 0.0,
    };
    let radius = (1.0 - height * height).sqrt();
    // libm, not the platform's sin and cos: a seed means the same flock on every machine.
    let entries = [radius * libm::cos(angle), radius * libm::sin(angle), height];
    SVector::from_fn(|axis, _| entries[axis])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The meaning of a seed: these numbers must never change, on any machine.
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

    /// Made of the uniform draws in pairs; the same bits on every machine, too.
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

    /// The schedule of seeds: these numbers must never change either.
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
