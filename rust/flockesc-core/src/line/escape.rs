//! Escape forces of the line model (paper, Eqs. 8 and 9).

use serde::{Deserialize, Serialize};

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
    /// Names of all escape forces in documents.
    pub const KINDS: &[&str] = <Self as strum::VariantNames>::VARIANTS;
}

impl EscapeForce {
    /// Returns the force on an agent at `offset` = x_i - x_p. It is 0 at the predator's position and at
    /// distances of `range` or more.
    #[must_use]
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
