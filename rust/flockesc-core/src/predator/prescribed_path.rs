//! The strategy of a predator on a prescribed path, for example that of a tracked animal.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::shared::Predator;
use crate::base::check::{positive_quantity, require, vector};
use crate::base::error::Result;
use crate::base::vector::embed;

/// Follows given positions: straight between two of them, and straight on after the last one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrescribedPath {
    /// r_p in m at the times 0, `interval`, 2 `interval`, ..; at least two positions.
    pub positions: Vec<Vec<f64>>,
    /// Time in s between two positions, from 1e-20 to 1e20; `None` is the scenario's time step.
    pub interval: Option<f64>,
}

impl PrescribedPath {
    pub(super) fn check(&self, path: &str, dimension: usize) -> Result<()> {
        let (field, count) = (format!("{path}.positions"), self.positions.len());
        require(count >= 2, &field, "at least 2 positions", count)?;
        for (k, entries) in self.positions.iter().enumerate() {
            vector(&format!("{field}[{k}]"), entries, dimension)?;
        }
        let field = format!("{path}.interval");
        self.interval
            .map_or(Ok(()), |interval| positive_quantity(&field, interval))
    }

    /// Returns r_p in m after `steps` steps.
    fn at<const D: usize>(&self, steps: usize, time_step: f64) -> SVector<f64, D> {
        let intervals = match self.interval {
            Some(interval) => steps as f64 * time_step / interval,
            None => steps as f64,
        };
        let last = self.positions.len().saturating_sub(2);
        let segment = (intervals as usize).min(last);
        let point = |k: usize| embed(self.positions.get(k).map_or(&[], Vec::as_slice));
        let (from, to): (SVector<f64, D>, _) = (point(segment), point(segment + 1));
        from + (to - from) * (intervals - segment as f64)
    }

    /// Returns the predator at t = 0.
    pub(super) fn start<const D: usize>(&self, time_step: f64) -> Predator<D> {
        let position = self.at(0, time_step);
        Predator::new(position, (self.at(1, time_step) - position) / time_step)
    }

    /// Sets the velocity from the present position to the path's position at the end of the next step, so
    /// that rounding errors do not accumulate.
    pub(super) fn steer<const D: usize>(&self, own: &mut Predator<D>, time_step: f64) {
        own.steps += 1;
        own.set_velocity((self.at(own.steps + 1, time_step) - own.position) / time_step);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    fn path(interval: Option<f64>) -> PrescribedPath {
        PrescribedPath {
            positions: vec![vec![0.0, 0.0], vec![4.0, 0.0], vec![4.0, 2.0]],
            interval,
        }
    }

    #[test]
    fn is_straight_between_positions_and_after_the_last_one() {
        let slow = path(Some(2.0));
        let at = |steps| slow.at::<2>(steps, 0.5);
        assert_eq!(at(1), vector![1.0, 0.0]);
        assert_eq!(at(4), vector![4.0, 0.0]);
        assert_eq!(at(6), vector![4.0, 1.0]);
        assert_eq!(at(8), vector![4.0, 2.0]);
        assert_eq!(at(12), vector![4.0, 4.0]);
    }

    #[test]
    fn has_a_position_per_step_without_an_interval() {
        assert_eq!(path(None).at::<2>(2, 0.3), vector![4.0, 2.0]);
    }

    #[test]
    fn a_step_may_span_several_positions() {
        let start = path(Some(1.0)).start::<2>(2.0);
        assert_eq!(start.position, vector![0.0, 0.0]);
        assert_eq!(start.velocity, vector![2.0, 1.0]);
    }
}
