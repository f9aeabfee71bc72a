//! The paper's: uniform in the initial region.

use serde::{Deserialize, Serialize};

/// Uniform in `[0, side]^D`, or `[0, side]^2` for a flock that starts in the plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Square {}
