//! How an agent sees another one: the offset on a torus, and the blind sector behind the agent.

use std::f64::consts::PI;

use crate::base::vector::{larger, smaller, squared_norm};
use crate::neighbor::engine::tree::Bounds;

/// Fraction of the side by which gaps between boxes on a torus are reduced; larger than the rounding of offsets.
const MARGIN: f64 = 1e-12;

/// The side in m of a periodic world; infinite for the open world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Torus(f64);

impl Torus {
    /// The open world.
    pub(crate) const NONE: Self = Self(f64::INFINITY);

    pub(crate) fn new(side: Option<f64>) -> Self {
        side.map_or(Self::NONE, Self)
    }

    /// The shortest offset from `a` to `b` along one axis in m, both in [0, side).
    #[inline(always)]
    pub(in crate::neighbor) fn offset(self, a: f64, b: f64) -> f64 {
        let (offset, half) = (b - a, 0.5 * self.0);
        let turn = if offset > half { self.0 } else { 0.0 };
        let back = if offset < -half { self.0 } else { 0.0 };
        offset - turn + back
    }

    /// A lower bound in m^2 of the squared distance between any agents in the two boxes.
    pub(in crate::neighbor) fn squared_gap<const D: usize>(
        self,
        a: &Bounds<D>,
        b: &Bounds<D>,
    ) -> f64 {
        let gap: [f64; D] = std::array::from_fn(|axis| {
            let above = b.low[axis] - a.high[axis];
            let below = a.low[axis] - b.high[axis];
            let direct = larger(above, below);
            let around = smaller(above, below) + self.0; // past the border; infinite in the open world
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

/// The field of view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FieldOfView {
    /// Cosine of the largest visible angle off the heading; below -1 if everything is visible.
    edge: f64,
}

impl FieldOfView {
    pub(crate) const ALL_ROUND: Self = Self { edge: -2.0 };

    /// Everything except a sector of `blind_angle` rad behind the agent.
    pub(crate) fn new(blind_angle: f64) -> Self {
        if blind_angle > 0.0 {
            let edge = libm::cos(PI - 0.5 * blind_angle);
            Self { edge }
        } else {
            Self::ALL_ROUND
        }
    }

    /// Whether an agent of this speed sees a point at the squared distance `squared` m^2, where `along` is the scalar product
    /// of its velocity and the offset. An agent at rest sees all round; every agent sees its own point.
    #[inline(always)]
    pub(in crate::neighbor) fn sees(self, along: f64, speed: f64, squared: f64) -> bool {
        along >= self.edge * (speed * squared.sqrt())
    }
}
