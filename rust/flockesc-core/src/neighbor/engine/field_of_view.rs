//! `Torus` and `FieldOfView`: offsets in a periodic world, and the blind sector behind an agent.

use std::f64::consts::PI;

use crate::base::vector::{larger, smaller, squared_norm};
use crate::neighbor::engine::nodes::Bounds;

/// Fraction of the side by which gaps between boxes on a torus are reduced. It is larger than the rounding of
/// offsets.
const MARGIN: f64 = 1e-12;

/// A periodic world with this side in m, or the open world if it is infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Torus(f64);

impl Torus {
    /// The open world.
    pub(crate) const NONE: Self = Self(f64::INFINITY);

    pub(crate) fn new(side: Option<f64>) -> Self {
        side.map_or(Self::NONE, Self)
    }

    /// Returns the shortest offset from `a` to `b` along one axis in m. Both are in [0, side).
    #[inline(always)]
    pub(in crate::neighbor) fn offset(self, a: f64, b: f64) -> f64 {
        let (offset, half) = (b - a, 0.5 * self.0);
        let turn = if offset > half { self.0 } else { 0.0 };
        let back = if offset < -half { self.0 } else { 0.0 };
        offset - turn + back
    }

    /// Returns a lower bound in m^2 of the squared distance between agents in the two boxes.
    pub(in crate::neighbor) fn squared_gap<const D: usize>(
        self,
        a: &Bounds<D>,
        b: &Bounds<D>,
    ) -> f64 {
        let gap: [f64; D] = std::array::from_fn(|axis| {
            let above = b.low[axis] - a.high[axis];
            let below = a.low[axis] - b.high[axis];
            let direct = larger(above, below);
            let around = smaller(above, below) + self.0; // across the border; infinite in the open world
            let shortest = if around < direct { around } else { direct };
            let margin = if self.0.is_finite() {
                MARGIN * self.0
            } else {
                0.0
            };
            larger(shortest - margin, 0.0)
        });
        squared_norm(&gap)
    }
}

/// The field of view of the agents.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FieldOfView {
    /// Cosine of the largest visible angle from the heading; below -1 if all directions are visible.
    pub(in crate::neighbor) edge: f64,
}

impl FieldOfView {
    pub(crate) const ALL_ROUND: Self = Self { edge: -2.0 };

    /// Creates a field of view of all directions except a sector of `blind_angle` rad behind the agent.
    pub(crate) fn new(blind_angle: f64) -> Self {
        if blind_angle > 0.0 {
            let edge = libm::cos(PI - 0.5 * blind_angle);
            Self { edge }
        } else {
            Self::ALL_ROUND
        }
    }

    /// Returns whether an agent with this speed sees a point at the squared distance `squared` in m^2.
    /// `along` is the dot product of the agent's velocity and the offset. An agent at rest sees in all
    /// directions, and every agent sees points at its own position. `kernel` computes the same for registers of agents.
    #[inline(always)]
    pub(in crate::neighbor) fn sees(self, along: f64, speed: f64, squared: f64) -> bool {
        along >= self.edge * (speed * squared.sqrt())
    }
}
