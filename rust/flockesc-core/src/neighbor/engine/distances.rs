//! `Distances`: offsets and squared distances between agents, as the agents see each other.

use pulp::{Scalar, Simd};

use crate::agents::{Agents, GROUP, LEAF};
use crate::neighbor::engine::field_of_view::{FieldOfView, Torus, register_norm};
use crate::neighbor::engine::reach::bits;

/// The agents, their world and their field of view.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Distances<'a, const D: usize> {
    pub(crate) agents: &'a Agents<D>,
    pub(crate) field_of_view: FieldOfView,
    pub(crate) torus: Torus,
}

impl<const D: usize> Distances<'_, D> {
    /// Returns the offset in m from the agent at place `from` to the agent at place `to`.
    #[inline(always)]
    pub(crate) fn offset(&self, from: usize, to: usize) -> [f64; D] {
        let (from, to) = (self.agents.position(from), self.agents.position(to));
        std::array::from_fn(|axis| self.torus.offset(Scalar::new(), from[axis], to[axis]))
    }

    /// Returns the squared distance in m^2 from the agent at place `from` to the agent at place `to`. It is infinite if
    /// `from` does not see `to`.
    pub(crate) fn squared(&self, from: usize, to: usize) -> f64 {
        self.squared_to_register(Scalar::new(), from, to)
    }

    /// Returns one bit per agent of a leaf: whether it is in view of the agent at place `from`, within the squared
    /// distance `limit` in m^2.
    #[inline(always)]
    pub(crate) fn near<S: Simd>(&self, simd: S, from: usize, leaf: usize, limit: f64) -> u8 {
        let mut near = 0;
        for first in (0..LEAF).step_by(S::F64_LANES) {
            let squared = self.squared_to_register(simd, from, leaf * LEAF + first);
            let is_near = simd.less_than_or_equal_f64s(squared, simd.splat_f64s(limit));
            near |= bits(simd, is_near) << first;
        }
        near
    }

    /// Returns the squared distances in m^2 from the agent at place `from` to the agents of the register at place `to`.
    /// They are infinite to agents out of view.
    #[inline(always)]
    pub(crate) fn squared_to_register<S: Simd>(&self, simd: S, from: usize, to: usize) -> S::f64s {
        let (own, lane) = (&self.agents.groups[from / GROUP], from % GROUP);
        let others = &self.agents.groups[to / GROUP].position;
        let mut offset = [simd.splat_f64s(0.0); D];
        for axis in 0..D {
            let column = &others[axis][to % GROUP..to % GROUP + S::F64_LANES];
            let position = simd.splat_f64s(own.position[axis][lane]);
            offset[axis] = self
                .torus
                .offset(simd, position, S::as_simd_f64s(column).0[0]);
        }
        let squared = register_norm(simd, offset);
        if self.field_of_view == FieldOfView::ALL_ROUND {
            return squared;
        }
        let mut velocity = [simd.splat_f64s(0.0); D];
        for axis in 0..D {
            velocity[axis] = simd.splat_f64s(own.velocity[axis][lane]);
        }
        let speed = simd.sqrt_f64s(register_norm(simd, velocity));
        let is_seen = self
            .field_of_view
            .sees(simd, velocity, speed, offset, squared);
        simd.select_f64s(is_seen, squared, simd.splat_f64s(f64::INFINITY))
    }
}
