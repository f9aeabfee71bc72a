//! Random streams: ChaCha8, one stream per purpose, so that new draws for one purpose never move another.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a stream is drawn for; the number is part of the meaning of a seed and never changes.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Stream {
    Positions = 0,
    Headings = 1,
    LineState = 2,
}

/// The generator for `purpose` under `seed`.
pub(crate) fn stream(seed: u64, purpose: Stream) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(purpose as u64);
    rng
}

/// Uniform on [0, `end`).
pub(crate) fn uniform(rng: &mut ChaCha8Rng, end: f64) -> f64 {
    end * rng.random::<f64>()
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
        ];
        let expected = [
            0.7090754154265618,
            0.755531016687046,
            0.3322203532055784,
            0.40248566366484806,
        ];
        assert_eq!(draws, expected);
    }
}
