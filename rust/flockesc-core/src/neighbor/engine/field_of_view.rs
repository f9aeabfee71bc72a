//! `Torus`, `FieldOfView` and `Own`: offsets in a periodic domain, the blind sector behind an agent, and whom a register of
//! agents senses.

use std::f64::consts::PI;
use std::ops::Range;

use bytemuck::{NoUninit, cast_slice};
use pulp::{Scalar, Simd};

use crate::agents::{Column, Group};
use crate::base::vector::{larger, squared_norm};
use crate::neighbor::engine::nodes::Bounds;

/// A periodic domain with this side in m, or the open domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Torus(pub(super) Option<f64>);

impl Torus {
    /// The open domain.
    pub(crate) const NONE: Self = Self(None);

    pub(crate) fn new(side: Option<f64>) -> Self {
        Self(side)
    }

    /// Returns the shortest offsets from `a` to `b` along one axis in m. Both are in [0, side).
    #[inline(always)]
    pub(crate) fn offset<S: Simd>(self, simd: S, a: S::f64s, b: S::f64s) -> S::f64s {
        self.shortest(simd, simd.sub_f64s(b, a))
    }

    /// Returns the shortest of the offsets in m along one axis that differ by multiples of the side. `offset` is
    /// shorter than the side.
    #[inline(always)]
    pub(crate) fn shortest<S: Simd>(self, simd: S, offset: S::f64s) -> S::f64s {
        let Some(side) = self.0 else {
            return offset;
        };
        let half = simd.splat_f64s(0.5 * side);
        let (zero, side) = (simd.splat_f64s(0.0), simd.splat_f64s(side));
        let is_above = simd.less_than_f64s(half, offset);
        let is_below = simd.less_than_f64s(offset, simd.sub_f64s(zero, half));
        let turn = simd.select_f64s(is_above, side, zero);
        let back = simd.select_f64s(is_below, side, zero);
        simd.add_f64s(simd.sub_f64s(offset, turn), back)
    }

    /// Returns a bound of the distance in m between two boxes along one axis, from the bounds `up` and `down` in
    /// both directions. The shorter way may cross the border of the world. Its length is rounded as in
    /// [`Self::offset`], so no margin is needed.
    #[inline(always)]
    pub(crate) fn bound<S: Simd>(self, simd: S, up: S::f64s, down: S::f64s) -> S::f64s {
        let direct = simd.max_f64s(up, down);
        let Some(side) = self.0 else {
            return direct;
        };
        let around = simd.add_f64s(simd.min_f64s(up, down), simd.splat_f64s(side));
        simd.min_f64s(direct, around)
    }

    /// Returns a lower bound in m^2 of the squared distance between agents in the two boxes.
    pub(crate) fn squared_gap<const D: usize>(self, a: &Bounds<D>, b: &Bounds<D>) -> f64 {
        let gap: [f64; D] = std::array::from_fn(|axis| {
            let above = b.low[axis] - a.high[axis];
            let below = a.low[axis] - b.high[axis];
            larger(self.bound(Scalar::new(), above, below), 0.0)
        });
        squared_norm(&gap)
    }
}

/// The field of view of the agents.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FieldOfView {
    /// Cosine of the largest visible angle from the heading; below -1 if all directions are visible.
    edge: f64,
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

    /// Returns a mask of the agents that see points at the given offsets in m, whose squared norms are `squared`. An
    /// agent at rest sees in all directions, and every agent sees points at its own position.
    #[inline(always)]
    pub(crate) fn sees<S: Simd, const D: usize>(
        self,
        simd: S,
        velocity: [S::f64s; D],
        speed: S::f64s,
        offset: [S::f64s; D],
        squared: S::f64s,
    ) -> S::m64s {
        let mut along = simd.mul_f64s(velocity[0], offset[0]);
        for axis in 1..D {
            along = simd.add_f64s(along, simd.mul_f64s(velocity[axis], offset[axis]));
        }
        let distance = simd.mul_f64s(speed, simd.sqrt_f64s(squared));
        let least = simd.mul_f64s(simd.splat_f64s(self.edge), distance);
        simd.less_than_or_equal_f64s(least, along)
    }
}

/// One register of agents.
#[derive(Clone, Copy)]
pub(super) struct Own<S: Simd, const D: usize> {
    /// Lane of the first agent.
    start: usize,
    /// -r in m. A sum with the broadcast position of another agent is one operation, a difference would be two.
    negated: [S::f64s; D],
    /// In m/s; only for agents with a blind sector, as the speed.
    velocity: [S::f64s; D],
    speed: S::f64s,
    field_of_view: FieldOfView,
    /// Squared reaches in m^2.
    squared: S::f64s,
}

impl<S: Simd, const D: usize> Own<S, D> {
    /// Loads the agents of a group from lane `start` on. `IS_BLIND`: whether agents have a blind sector.
    #[inline(always)]
    pub(super) fn load<const IS_BLIND: bool>(
        simd: S,
        group: &Group<D>,
        squared: &Column<f64>,
        field_of_view: FieldOfView,
        start: usize,
    ) -> Self {
        let load =
            |column: &Column<f64>| S::as_simd_f64s(&column[start..start + S::F64_LANES]).0[0];
        let mut own = Self {
            start,
            negated: [simd.splat_f64s(0.0); D],
            velocity: [simd.splat_f64s(0.0); D],
            speed: simd.splat_f64s(0.0),
            field_of_view,
            squared: load(squared),
        };
        for axis in 0..D {
            own.negated[axis] = simd.sub_f64s(simd.splat_f64s(0.0), load(&group.position[axis]));
            if IS_BLIND {
                own.velocity[axis] = load(&group.velocity[axis]);
            }
        }
        if IS_BLIND {
            own.speed = simd.sqrt_f64s(register_norm(simd, own.velocity));
        }
        own
    }

    /// Returns the lanes of the agents in their group.
    pub(super) fn lanes(&self) -> Range<usize> {
        self.start..self.start + S::F64_LANES
    }

    /// Returns the offsets in m to an agent at `position`, and a mask of the agents to which it is within reach
    /// and, with `IS_BLIND`, in view.
    #[inline(always)]
    pub(super) fn senses<const IS_BLIND: bool>(
        &self,
        simd: S,
        torus: Torus,
        position: &[f64; D],
    ) -> ([S::f64s; D], S::m64s) {
        let mut offset = self.negated;
        for axis in 0..D {
            let position = simd.splat_f64s(position[axis]);
            offset[axis] = torus.shortest(simd, simd.add_f64s(position, offset[axis]));
        }
        let squared = register_norm(simd, offset);
        let mut is_near = simd.less_than_or_equal_f64s(squared, self.squared);
        if IS_BLIND {
            let (velocity, speed) = (self.velocity, self.speed);
            let is_seen = self
                .field_of_view
                .sees(simd, velocity, speed, offset, squared);
            is_near = simd.and_m64s(is_near, is_seen);
        }
        (offset, is_near)
    }
}

/// Returns the integers in a register.
#[inline(always)]
pub(super) fn lanes<T: NoUninit>(register: &T) -> &[i64] {
    cast_slice(std::slice::from_ref(register))
}

/// Returns the squared Euclidean norm, lane by lane. It uses loops, because iterators over registers are not
/// always inlined.
#[inline(always)]
pub(crate) fn register_norm<S: Simd, const D: usize>(simd: S, vector: [S::f64s; D]) -> S::f64s {
    let mut sum = simd.mul_f64s(vector[0], vector[0]);
    for axis in 1..D {
        sum = simd.add_f64s(sum, simd.mul_f64s(vector[axis], vector[axis]));
    }
    sum
}
