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
