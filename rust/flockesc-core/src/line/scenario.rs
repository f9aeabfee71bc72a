//! `LineConfig`: the scenario of the line model, and its escape forces (paper, Eqs. 8 and 9).

use serde::{Deserialize, Serialize};

use crate::base::check::{MAX_AGENTS, MAX_STEPS, coordinate, not_negative, quantity, within};
use crate::base::document::parse;
use crate::base::error::Result;

/// Parameters of the line model (docs/model.md). The default is the paper's line, also for fields that are
/// missing in a document.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LineConfig {
    /// Number of agents n, at least 1.
    pub num_agents: usize,
    /// Position x_p of the predator; `None` is a line without a predator.
    pub predator_position: Option<f64>,
    /// Predator range rho_p, at least 0.
    pub predator_range: f64,
    /// Repulsion strength s, at least 0.
    pub repulsion_strength: f64,
    /// Escape force that is added to the consensus.
    pub escape_force: EscapeForce,
    /// Largest displacement of an agent in a step of a line in its steady state, at least 0.
    pub tolerance: f64,
    /// Largest number of steps of a run, at least 1.
    pub max_steps: usize,
}

impl Default for LineConfig {
    /// The paper's line (Section IV).
    fn default() -> Self {
        Self {
            num_agents: 100,
            predator_position: Some(0.6),
            predator_range: 0.2,
            repulsion_strength: 2.0,
            escape_force: EscapeForce::Linear,
            tolerance: 1e-12,
            max_steps: 1000,
        }
    }
}

impl LineConfig {
    /// Returns the document with all fields as JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }

    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if a field is unknown, has the wrong type or is out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let config: Self = parse(document)?;
        within("num_agents", config.num_agents, 1, MAX_AGENTS)?;
        if let Some(position) = config.predator_position {
            coordinate("predator_position", position)?;
        }
        quantity("predator_range", config.predator_range)?;
        quantity("repulsion_strength", config.repulsion_strength)?;
        not_negative("tolerance", config.tolerance)?;
        within("max_steps", config.max_steps, 1, MAX_STEPS)?;
        Ok(config)
    }
}

/// The escape force of the line model. It acts on agents strictly inside the predator range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum EscapeForce {
    /// s sign(x_i - x_p) (Eq. 8).
    Constant,
    /// s (x_p - x_i + rho_p sign(x_i - x_p)): Eq. 9 in the form that reproduces the paper's results.
    Linear,
    /// x_p - x_i + s rho_p sign(x_i - x_p): Eq. 9 as printed in the paper.
    LinearAsPrinted,
}

impl EscapeForce {
    /// Returns the force on an agent at `offset` = x_i - x_p. It is 0 at the predator's position and at
    /// distances of `range` or more.
    pub fn at(self, offset: f64, range: f64, strength: f64) -> f64 {
        if offset.abs() >= range {
            return 0.0;
        }
        let sign = if offset == 0.0 { 0.0 } else { offset.signum() };
        match self {
            Self::Constant => strength * sign,
            Self::Linear => strength * (range * sign - offset),
            Self::LinearAsPrinted => strength * range * sign - offset,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::EscapeForce::{Constant, Linear, LinearAsPrinted};

    #[test]
    fn forces_inside_at_and_outside_the_range() {
        assert_eq!(Constant.at(0.5, 1.0, 3.0), 3.0);
        assert_eq!(Constant.at(-0.5, 1.0, 3.0), -3.0);
        assert_eq!(Linear.at(0.25, 1.0, 2.0), 1.5);
        assert_eq!(LinearAsPrinted.at(0.25, 1.0, 2.0), 1.75);
        for force in [Constant, Linear, LinearAsPrinted] {
            assert_eq!(force.at(1.0, 1.0, 2.0), 0.0);
            assert_eq!(force.at(-3.0, 1.0, 2.0), 0.0);
            assert_eq!(force.at(0.0, 1.0, 2.0), 0.0);
        }
    }
}
