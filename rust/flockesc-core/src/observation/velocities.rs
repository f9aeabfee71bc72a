//! `Velocities`: what the agents of one group hear, or how they move, with the norms.

use crate::agents::{Column, GROUP};
use crate::base::exact::{Scale, to_float};
use crate::base::vector::{SHORTEST, squared_norm};
use crate::neighbor::NeighborSums;

/// Columns of velocities in m/s, along the axes of the world, and their norms.
pub(super) struct Velocities<const D: usize> {
    pub(super) vectors: [Column<f64>; D],
    pub(super) norms: Column<f64>,
}

impl<const D: usize> Velocities<D> {
    pub(super) const EMPTY: Self = Self {
        vectors: [[0.0; GROUP]; D],
        norms: [0.0; GROUP],
    };

    /// Sets the velocities to the means of sums over neighbors; `unit` is the unit of the sums.
    #[inline(always)]
    pub(super) fn set_to_means(&mut self, sums: &NeighborSums<D>, unit: Scale) {
        for axis in 0..D {
            for lane in 0..GROUP {
                let sum = unit.value(sums.sum[axis][lane]);
                self.vectors[axis][lane] = sum / to_float(sums.count[lane]);
            }
        }
        self.measure();
    }

    /// Computes the norms.
    #[inline(always)]
    pub(super) fn measure(&mut self) {
        for lane in 0..GROUP {
            let vector: [f64; D] = std::array::from_fn(|axis| self.vectors[axis][lane]);
            self.norms[lane] = squared_norm(&vector).sqrt();
        }
    }

    /// Returns every velocity w scaled to w / (||w|| + `speed`).
    #[inline(always)]
    pub(super) fn scaled(&self, speed: f64) -> [Column<f64>; D] {
        let mut scaled = self.vectors;
        for lane in 0..GROUP {
            let divisor = self.norms[lane] + speed;
            for column in &mut scaled {
                column[lane] /= divisor;
            }
        }
        scaled
    }

    /// Computes the cosines of the angles between the velocities and unit vectors; 0 for a velocity of 0.
    #[inline(always)]
    pub(super) fn cosines(&self, units: &[Column<f64>; D], cosines: &mut Column<f64>) {
        for lane in 0..GROUP {
            let product = (0..D).fold(0.0, |sum, axis| {
                sum + self.vectors[axis][lane] * units[axis][lane]
            });
            let norm = self.norms[lane];
            cosines[lane] = if norm > SHORTEST { product / norm } else { 0.0 };
        }
    }
}
