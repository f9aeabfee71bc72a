//! `Vectors`: what the agents of one group see and hear, along the axes of the world, and their body frames.

use nalgebra::SVector;

use super::extras::agent::Writer;
use crate::agents::{Column, GROUP, Group};
use crate::base::frame::Frame;
use crate::base::vector::SHORTEST;

/// Columns of vectors along the axes of the world, for the agents of one group.
pub(super) struct Vectors<const D: usize> {
    /// ||v_i|| in m/s.
    pub(super) norm: Column<f64>,
    /// v_i / ||v_i||. Unspecified if v_i is 0.
    pub(super) heading: [Column<f64>; D],
    /// Mean velocity of the neighbors and the agent itself in m/s.
    pub(super) heard: [Column<f64>; D],
    /// Unit vector toward the nearest predator, or 0.
    pub(super) predator_direction: [Column<f64>; D],
    /// Velocity of the nearest predator relative to the agent in m/s, or 0.
    pub(super) approach: [Column<f64>; D],
}

impl<const D: usize> Vectors<D> {
    pub(super) const EMPTY: Self = Self {
        norm: [0.0; GROUP],
        heading: [[0.0; GROUP]; D],
        heard: [[0.0; GROUP]; D],
        predator_direction: [[0.0; GROUP]; D],
        approach: [[0.0; GROUP]; D],
    };

    /// Returns the body frame of the agent in a lane. `more` are further cues of its roll.
    fn frame(&self, lane: usize, group: &Group<D>, more: &[SVector<f64, D>]) -> Frame<D> {
        let at = |columns: &[Column<f64>; D]| SVector::from_fn(|axis, _| columns[axis][lane]);
        let cues = [
            at(&self.predator_direction),
            at(&self.heard),
            at(&self.approach),
        ];
        let cues = cues.into_iter().chain(more.iter().copied());
        if self.norm[lane] > SHORTEST {
            Frame::along(at(&self.heading), cues)
        } else {
            Frame::new(&at(&group.velocity), cues)
        }
    }

    /// Computes the axes of the body frames of the agents in the first `filled` lanes.
    pub(super) fn find_axes(
        &self,
        group: &Group<D>,
        filled: usize,
        extras: Option<&Writer<'_, D>>,
        axes: &mut [[Column<f64>; D]; D],
    ) {
        if D == 2 {
            axes[0] = self.heading;
            axes[1][1] = self.heading[0];
            for (left, ahead) in axes[1][0].iter_mut().zip(&self.heading[1]) {
                *left = -ahead;
            }
            let moving = self.norm[..filled].iter();
            if moving.fold(true, |all, norm| all & (*norm > SHORTEST)) {
                return;
            }
        }
        let mut cues = Vec::new();
        for lane in 0..filled {
            if let Some(writer) = extras {
                cues.clear();
                writer.add_cues(lane, &mut cues);
            }
            let frame = self.frame(lane, group, &cues);
            for (columns, axis) in axes.iter_mut().zip(frame.axes()) {
                for k in 0..D {
                    columns[k][lane] = axis[k];
                }
            }
        }
    }
}
