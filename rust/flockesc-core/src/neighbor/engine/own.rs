//! `Own`: one register of agents that look for their neighbors.

use std::ops::Range;

use bytemuck::{NoUninit, cast_slice};
use pulp::Simd;

use crate::agents::{Column, Group};
use crate::neighbor::engine::field_of_view::{FieldOfView, Torus};
use crate::neighbor::engine::reach::squared_norm;

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
            own.speed = simd.sqrt_f64s(squared_norm(simd, own.velocity));
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
        let squared = squared_norm(simd, offset);
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
