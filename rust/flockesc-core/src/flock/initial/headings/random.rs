//! The paper's: every direction is as likely.

use serde::{Deserialize, Serialize};

/// Uniform over all directions, or those of the plane for a flock that starts there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomHeadings {}
