//! `InitialPositions`: the distributions of the initial positions.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use strum::{AsRefStr, VariantNames};

use super::space::{Space, repeat};
use crate::base::check::{MAX_AGENTS, positive_quantity, quantity, require, within};
use crate::base::error::Result;
use crate::base::rng;
use crate::base::vector::embed;

/// The distribution of r(0). Variants are named after shapes in the plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, AsRefStr, VariantNames)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[strum(serialize_all = "snake_case")]
pub enum InitialPositions {
    /// Uniform in the initial region `[0, side]^D`, or in `[0, side]^2` if the flock starts in the plane.
    Square {},
    /// Uniform within `radius` of the center of the initial region: in a disc, or in a ball for D = 3.
    Disc {
        /// Radius in m, from 1e-20 to 1e20.
        radius: f64,
    },
    /// Uniform within `width` / 2 of the circle (D = 3: sphere) of `radius` around the center of the initial
    /// region.
    Ring {
        /// Radius in m, from 1e-20 to 1e20.
        radius: f64,
        /// Width in m, from 0 to twice the radius.
        width: f64,
    },
    /// Uniform between `start` and `end`, each with D coordinates, or 2 for a point in the plane.
    Segment {
        /// One end in m.
        start: Vec<f64>,
        /// The other end in m.
        end: Vec<f64>,
    },
    /// Normal around the center of the initial region, independently in every coordinate.
    Gaussian {
        /// Standard deviation of every coordinate in m, at least 0.
        standard_deviation: f64,
    },
    /// Normal around centers that are uniform in the initial region. Agent i belongs to center i modulo
    /// `num_clusters`.
    Clusters {
        /// Number of centers, at least 1.
        num_clusters: usize,
        /// Standard deviation of every coordinate around its center in m, at least 0.
        standard_deviation: f64,
    },
    /// One point per agent, in the order of ids.
    GivenPositions {
        /// n points in m, each with D coordinates, or 2 for a point in the plane.
        points: Vec<Vec<f64>>,
    },
}

impl InitialPositions {
    /// Checks the parameters for a flock of `count` agents.
    pub(crate) fn check(&self, space: &Space, count: usize) -> Result<()> {
        let path = |field: &str| format!("initial_positions.{}.{field}", self.as_ref());
        match self {
            Self::Square {} => Ok(()),
            Self::Disc { radius } => positive_quantity(&path("radius"), *radius),
            Self::Ring { radius, width } => {
                positive_quantity(&path("radius"), *radius)?;
                let is_ring = (0.0..=2.0).contains(&(width / radius));
                let expected = "a number from 0 to twice the radius";
                require(is_ring, &path("width"), expected, width)
            }
            Self::Segment { start, end } => {
                space.check(&path("start"), start)?;
                space.check(&path("end"), end)
            }
            Self::Gaussian { standard_deviation } => {
                quantity(&path("standard_deviation"), *standard_deviation)
            }
            Self::Clusters {
                num_clusters,
                standard_deviation,
            } => {
                within(&path("num_clusters"), *num_clusters, 1, MAX_AGENTS)?;
                quantity(&path("standard_deviation"), *standard_deviation)
            }
            Self::GivenPositions { points } => space.check_each(&path("points"), points, count),
        }
    }

    /// Returns the width in m of the region that the distribution fills, if it is uniform over one. `side` is that of
    /// the initial region.
    pub(crate) fn width(&self, side: f64) -> Option<f64> {
        match self {
            Self::Square {} | Self::Clusters { .. } => Some(side),
            Self::Disc { radius } => Some(2.0 * radius),
            Self::Ring { radius, width } => Some(2.0 * radius + width),
            Self::Segment { .. } | Self::Gaussian { .. } | Self::GivenPositions { .. } => None,
        }
    }

    /// Draws the positions of `count` agents in m.
    pub(crate) fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        match self {
            Self::Square {} => repeat(count, || space.uniform(rng)),
            Self::Disc { radius } => repeat(count, || space.shell(0.0, *radius, rng)),
            Self::Ring { radius, width } => {
                let (inner, outer) = (radius - width / 2.0, radius + width / 2.0);
                repeat(count, || space.shell(inner, outer, rng))
            }
            Self::Segment { start, end } => repeat(count, || {
                let part = rng::uniform(rng, 1.0);
                embed(start) * (1.0 - part) + embed(end) * part
            }),
            Self::Gaussian {
                standard_deviation: deviation,
            } => repeat(count, || space.center() + space.normal(*deviation, rng)),
            Self::Clusters {
                num_clusters,
                standard_deviation: deviation,
            } => {
                let num_centers = (*num_clusters).min(count); // further clusters would have no agents
                let centers: Vec<SVector<f64, D>> = repeat(num_centers, || space.uniform(rng));
                let center = centers.iter().cycle().take(count);
                center
                    .map(|center| center + space.normal(*deviation, rng))
                    .collect()
            }
            Self::GivenPositions { points } => points.iter().map(|point| embed(point)).collect(),
        }
    }
}
