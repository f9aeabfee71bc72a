//! Given points.

use nalgebra::SVector;
use serde::Deserialize;

use crate::base::error::Result;
use crate::flock::initial::space::{Space, embed};

/// One point per agent, in the order of their names.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GivenPositions {
    /// n points in m, each of length D, or 2 for a point in the plane.
    pub points: Vec<Vec<f64>>,
}

impl GivenPositions {
    pub(super) fn check(&self, space: &Space, count: usize) -> Result<()> {
        let field = "initial_positions.given_positions.points";
        space.check_each(field, &self.points, count)
    }

    pub(super) fn vectors<const D: usize>(&self) -> Vec<SVector<f64, D>> {
        self.points.iter().map(|point| embed(point)).collect()
    }
}
