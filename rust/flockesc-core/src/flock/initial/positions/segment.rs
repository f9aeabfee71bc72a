//! A line segment.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

use crate::base::error::Result;
use crate::base::rng;
use crate::flock::initial::space::{Space, embed};

/// Uniform between `start` and `end`, each of length D, or 2 for a point in the plane.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// In m.
    pub start: Vec<f64>,
    /// In m.
    pub end: Vec<f64>,
}

impl Segment {
    pub(super) fn check(&self, space: &Space) -> Result<()> {
        space.check("initial_positions.segment.start", &self.start)?;
        space.check("initial_positions.segment.end", &self.end)
    }

    pub(super) fn draw<const D: usize>(&self, rng: &mut ChaCha8Rng) -> SVector<f64, D> {
        let part = rng::uniform(rng, 1.0);
        embed(&self.start) * (1.0 - part) + embed(&self.end) * part
    }
}
