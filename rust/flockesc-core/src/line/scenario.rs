//! `LineConfig`: the scenario of the line model.

use serde::{Deserialize, Serialize};

use super::escape::EscapeForce;
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
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::to_value(self).unwrap_or_default().to_string()
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
