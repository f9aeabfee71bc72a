//! `Motion`: the laws of motion, as in a scenario.

use serde::{Deserialize, Serialize};
use strum::{AsRefStr, VariantNames};

use crate::base::check::{not_negative, quantity};
use crate::base::error::{Error, Result};

/// The law of motion: how forces change velocities.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, AsRefStr, VariantNames)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[strum(serialize_all = "snake_case")]
pub enum Motion {
    /// Forces change velocities.
    Inertial {},
    /// Forces set the new headings; the mass has no effect.
    Vicsek {},
    /// Forces change velocities, and neighbors also attract and repel each other.
    Reynolds(Reynolds),
}

impl Motion {
    /// Names of all laws in a scenario.
    pub const KINDS: &[&str] = <Self as VariantNames>::VARIANTS;

    /// Checks the law's parameters.
    pub(crate) fn check(&self, constant_speed: bool) -> Result<()> {
        match self {
            Self::Vicsek {} if !constant_speed => {
                let expected = "true if motion is vicsek";
                Err(Error::config("constant_speed", expected, constant_speed))
            }
            Self::Inertial {} | Self::Vicsek {} => Ok(()),
            Self::Reynolds(law) => law.check(),
        }
    }

    /// Returns whether the law has forces between pairs of neighbors.
    pub(crate) fn needs_pairs(&self) -> bool {
        matches!(self, Self::Reynolds(_))
    }
}

/// Forces change velocities, and neighbors also attract and repel each other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reynolds {
    /// Weight of the force away from close neighbors, at least 0.
    pub separation_strength: f64,
    /// Weight of the force toward the center of the neighbors, at least 0.
    pub cohesion_strength: f64,
    /// Distance in m up to which a neighbor is close, at least 0.
    pub separation_range: f64,
}

impl Reynolds {
    fn check(&self) -> Result<()> {
        let field = |name: &str| format!("motion.reynolds.{name}");
        quantity(&field("separation_strength"), self.separation_strength)?;
        quantity(&field("cohesion_strength"), self.cohesion_strength)?;
        not_negative(&field("separation_range"), self.separation_range)
    }
}
