//! The strategy of the paper's predator: constant velocity.

use serde::{Deserialize, Serialize};

/// Keeps its velocity: v_p(t + dt) = v_p(t) (paper, Section V).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConstantVelocity {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p in m/s.
    pub velocity: Vec<f64>,
}
