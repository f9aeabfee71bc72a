//! The line model's scenario.

use serde::{Deserialize, Serialize};

use super::escape::EscapeForce;
use crate::base::check::{MAX_AGENTS, MAX_STEPS, coordinate, not_negative, quantity, within};
use crate::base::document::parse;
use crate::base::error::Result;

/// The line model's parameters (docs/model.md). The default, also of each field that a document leaves out, is the
/// paper's line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LineConfig {
    /// n, number of agents, at least 1.
    pub num_agents: usize,
    /// x_p; `None` is a line without predator.
    pub predator_position: Option<f64>,
    /// rho_p, at least 0.
    pub predator_range: f64,
    /// s, at least 0.
    pub repulsion_strength: f64,
    /// Which escape force is added to the consensus.
    pub escape_force: EscapeForce,
    /// Largest move of any agent in one step that counts as standing still, at least 0.
    pub tolerance: f64,
    /// Steps after which an unsteady line is given up, at least 1.
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
    /// The document, with every field.
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::to_value(self).unwrap_or_default().to_string()
    }

    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`crate::Error::Config`] naming the field that is unknown, of a wrong type or out of bounds.
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
