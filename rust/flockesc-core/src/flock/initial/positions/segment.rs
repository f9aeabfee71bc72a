//! Initial positions along a line segment.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::base::error::Result;
use crate::base::rng;
use crate::flock::initial::distribution::{Distribution, repeat};
use crate::flock::initial::space::{Space, embed};

/// Uniform between `start` and `end`, each with D coordinates, or 2 for a point in the plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// One end in m.
    pub start: Vec<f64>,
    /// The other end in m.
    pub end: Vec<f64>,
}

impl Distribution for Segment {
    fn check(&self, path: &str, space: &Space, _count: usize) -> Result<()> {
        space.check(&format!("{path}.start"), &self.start)?;
        space.check(&format!("{path}.end"), &self.end)
    }

    fn draw<const D: usize>(
        &self,
        _space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        repeat(count, || {
            let part = rng::uniform(rng, 1.0);
            embed(&self.start) * (1.0 - part) + embed(&self.end) * part
        })
    }
}
