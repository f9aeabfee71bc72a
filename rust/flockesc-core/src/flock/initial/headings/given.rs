//! Given directions.

use nalgebra::SVector;
use serde::Deserialize;

use super::check_direction;
use crate::base::error::Result;
use crate::base::vector::heading;
use crate::flock::initial::space::{Space, embed};

/// One direction per agent, in the order of their names.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GivenHeadings {
    /// n vectors of any length but 0, each of length D, or 2 for a direction in the plane.
    pub directions: Vec<Vec<f64>>,
}

impl GivenHeadings {
    pub(super) fn check(&self, space: &Space, count: usize) -> Result<()> {
        let field = "initial_headings.given_headings.directions";
        space.check_each(field, &self.directions, count)?;
        let mut places = self.directions.iter().enumerate();
        places.try_for_each(|(k, direction)| check_direction(|| format!("{field}[{k}]"), direction))
    }

    pub(super) fn vectors<const D: usize>(&self) -> Vec<SVector<f64, D>> {
        let vectors = self.directions.iter();
        vectors.map(|vector| heading(&embed(vector))).collect()
    }
}
