//! Who is where, seen from an agent: offsets on a torus, and the blind sector behind.

use std::f64::consts::PI;

use crate::base::vector::{larger, smaller, squared_norm};
use crate::neighbor::engine::tree::Bounds;

/// Share of the side by which boxes on a torus are taken as nearer than they are: more than rounding makes of offsets.
const MARGIN: f64 = 1e-12;

/// The side in m of a world without border, or that of the open world: infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Torus(f64);

impl Torus {
    /// The open world.
    pub(crate) const NONE: Self = Self(f64::INFINITY);

    pub(crate) fn new(side: Option<f64>) -> Self {
        side.map_or(Self::NONE, Self)
    }

    /// The shortest way from `a` to `b` along one axis in m, both in [0, side).
    #[inline(always)]
    pub(in crate::neighbor) fn offset(self, a: f64, b: f64) -> f64 {
        let (offset, half) = (b - a, 0.5 * self.0);
        let turn = if offset > half { self.0 } else { 0.0 };
        let back = if offset < -half { self.0 } else { 0.0 };
        offset - turn + back
    }

    /// The square of a distance that no two agents in these boxes fall below, in m^2.
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
pub(crate) struct Sight {
    /// Cosine of the largest angle off the heading that is seen; below -1: everything is.
    edge: f64,
}

impl Sight {
    pub(crate) const ALL_ROUND: Self = Self { edge: -2.0 };

    /// All but a sector of `blind_angle` rad behind.
    pub(crate) fn new(blind_angle: f64) -> Self {
        if blind_angle > 0.0 {
            let edge = libm::cos(PI - 0.5 * blind_angle);
            Self { edge }
        } else {
            Self::ALL_ROUND
        }
    }

    /// Whether an agent with this speed sees what is `squared` m^2 away, and has a scalar product of `along` with its velocity.
    /// One at rest sees all round, and everyone what is in the same place.
    #[inline(always)]
    pub(in crate::neighbor) fn sees(self, along: f64, speed: f64, squared: f64) -> bool {
        along >= self.edge * (speed * squared.sqrt())
    }
}
