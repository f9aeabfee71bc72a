//! Initial headings within an angle of one direction.

use std::f64::consts::{PI, TAU};

use nalgebra::{SVector, Vector3};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::base::check::within_bounds;
use crate::base::error::Result;
use crate::base::rng;
use crate::base::vector::{heading, least_aligned_axis};
use crate::flock::initial::distribution::{Distribution, repeat};
use crate::flock::initial::space::{Space, embed};

/// Uniform over the directions within `max_angle` of `direction`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlignedHeadings {
    /// A nonzero vector with D coordinates, or 2 for a direction in the plane.
    pub direction: Vec<f64>,
    /// Largest angle from the direction in rad, from 0 to pi.
    pub max_angle: f64,
}

impl Distribution for AlignedHeadings {
    fn check(&self, path: &str, space: &Space, _count: usize) -> Result<()> {
        space.check_direction(&format!("{path}.direction"), &self.direction)?;
        within_bounds(&format!("{path}.max_angle"), self.max_angle, 0.0, PI)
    }

    fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        let ahead: Vector3<f64> = heading(&embed(&self.direction));
        repeat(count, || self.draw_one(space, &ahead, rng))
    }
}

impl AlignedHeadings {
    fn draw_one<const D: usize>(
        &self,
        space: &Space,
        ahead: &Vector3<f64>,
        rng: &mut ChaCha8Rng,
    ) -> SVector<f64, D> {
        let drawn = match space.axes {
            2 => {
                let angle = self.max_angle * (2.0 * rng::uniform(rng, 1.0) - 1.0);
                let left = Vector3::new(-ahead.y, ahead.x, 0.0);
                ahead * libm::cos(angle) + left * libm::sin(angle)
            }
            _ => {
                // Zones of a sphere with equal heights have equal areas. 2 sin^2(a / 2) is 1 - cos(a) without
                // cancellation for small angles.
                let half = libm::sin(self.max_angle / 2.0);
                let height = rng::uniform(rng, 2.0 * half * half);
                let across = (height * (2.0 - height)).sqrt();
                let angle = rng::uniform(rng, TAU);
                let left = heading(&ahead.cross(&least_aligned_axis(ahead)));
                let side = left * libm::cos(angle) + ahead.cross(&left) * libm::sin(angle);
                ahead * (1.0 - height) + side * across
            }
        };
        embed(drawn.as_slice())
    }
}
