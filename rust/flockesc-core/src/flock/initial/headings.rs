//! `InitialHeadings`: the distributions of the initial headings.

use std::f64::consts::{PI, TAU};

use nalgebra::{SVector, Vector3};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use strum::{AsRefStr, VariantNames};

use super::space::{Space, repeat};
use crate::base::check::within_bounds;
use crate::base::error::Result;
use crate::base::rng;
use crate::base::vector::{embed, heading, least_aligned_axis};

/// The distribution of v(0) / v0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, AsRefStr, VariantNames)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[strum(serialize_all = "snake_case")]
pub enum InitialHeadings {
    /// Uniform over all directions, or over the directions in the plane if the flock starts there.
    Random {},
    /// Uniform over the directions within `max_angle` of `direction`.
    Aligned {
        /// A nonzero vector with D coordinates, or 2 for a direction in the plane.
        direction: Vec<f64>,
        /// Largest angle from the direction in rad, from 0 to pi.
        max_angle: f64,
    },
    /// One direction per agent, in the order of ids.
    GivenHeadings {
        /// n nonzero vectors, each with D coordinates, or 2 for a direction in the plane.
        directions: Vec<Vec<f64>>,
    },
}

impl InitialHeadings {
    /// Checks the parameters for a flock of `count` agents.
    pub(crate) fn check(&self, space: &Space, count: usize) -> Result<()> {
        let path = |field: &str| format!("initial_headings.{}.{field}", self.as_ref());
        match self {
            Self::Random {} => Ok(()),
            Self::Aligned {
                direction,
                max_angle,
            } => {
                space.check_direction(&path("direction"), direction)?;
                within_bounds(&path("max_angle"), *max_angle, 0.0, PI)
            }
            Self::GivenHeadings { directions } => {
                let field = path("directions");
                space.check_each(&field, directions, count)?;
                let mut directions = directions.iter().enumerate();
                directions.try_for_each(|(k, direction)| {
                    space.check_direction(&format!("{field}[{k}]"), direction)
                })
            }
        }
    }

    /// Draws the headings of `count` agents, of length 1 up to rounding.
    pub(crate) fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        match self {
            Self::Random {} => repeat(count, || space.direction(rng)),
            Self::Aligned {
                direction,
                max_angle,
            } => {
                let ahead = heading(&embed(direction));
                repeat(count, || {
                    embed(turned(space, &ahead, *max_angle, rng).as_slice())
                })
            }
            Self::GivenHeadings { directions } => {
                let directions = directions.iter();
                directions.map(|vector| heading(&embed(vector))).collect()
            }
        }
    }
}

/// Draws a unit vector uniformly within `max_angle` rad of `ahead`.
fn turned(
    space: &Space,
    ahead: &Vector3<f64>,
    max_angle: f64,
    rng: &mut ChaCha8Rng,
) -> Vector3<f64> {
    if space.axes == 2 {
        let angle = max_angle * (2.0 * rng::uniform(rng, 1.0) - 1.0);
        let left = Vector3::new(-ahead.y, ahead.x, 0.0);
        return ahead * libm::cos(angle) + left * libm::sin(angle);
    }
    // Zones of a sphere with equal heights have equal areas. 2 sin^2(a / 2) is 1 - cos(a) without cancellation
    // for small angles.
    let half = libm::sin(max_angle / 2.0);
    let height = rng::uniform(rng, 2.0 * half * half);
    let across = (height * (2.0 - height)).sqrt();
    let angle = rng::uniform(rng, TAU);
    let left = heading(&ahead.cross(&least_aligned_axis(ahead)));
    let side = left * libm::cos(angle) + ahead.cross(&left) * libm::sin(angle);
    ahead * (1.0 - height) + side * across
}
