//! Initial headings given in the scenario.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::base::error::Result;
use crate::base::vector::heading;
use crate::flock::initial::distribution::Distribution;
use crate::flock::initial::space::{Space, embed};

/// One direction per agent, in the order of ids.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GivenHeadings {
    /// n nonzero vectors, each with D coordinates, or 2 for a direction in the plane.
    pub directions: Vec<Vec<f64>>,
}

impl Distribution for GivenHeadings {
    fn check(&self, path: &str, space: &Space, count: usize) -> Result<()> {
        let field = format!("{path}.directions");
        space.check_each(&field, &self.directions, count)?;
        let mut directions = self.directions.iter().enumerate();
        directions
            .try_for_each(|(k, entries)| space.check_direction(&format!("{field}[{k}]"), entries))
    }

    fn draw<const D: usize>(
        &self,
        _space: &Space,
        _count: usize,
        _rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        let directions = self.directions.iter();
        directions.map(|vector| heading(&embed(vector))).collect()
    }
}
