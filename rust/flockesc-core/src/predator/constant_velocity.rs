//! The paper's predator: constant velocity.

use serde::Deserialize;

/// v_p(t + dt) = v_p(t) (paper, Section V).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConstantVelocity {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p in m/s.
    pub velocity: Vec<f64>,
}
