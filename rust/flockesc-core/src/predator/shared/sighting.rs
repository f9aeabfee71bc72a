//! `Sighting`: the vectors that a learned predator observes, and its body frame.

use nalgebra::SVector;

use super::Predator;
use super::prey::Prey;
use crate::base::vector::{Frame, unit};

/// Positions and velocities relative to one predator. They are 0 if all agents were caught.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sighting<const D: usize> {
    /// v_p in m/s.
    pub(crate) velocity: SVector<f64, D>,
    /// Relative position of the nearest agent in m.
    pub(crate) nearest: SVector<f64, D>,
    /// Relative velocity of the nearest agent in m/s.
    pub(crate) nearest_velocity: SVector<f64, D>,
    /// Relative position of the centroid in m.
    pub(crate) centroid: SVector<f64, D>,
    /// Relative mean velocity of all agents in m/s.
    pub(crate) flock_velocity: SVector<f64, D>,
    /// Relative position of the nearest other predator in m.
    pub(crate) other: Option<SVector<f64, D>>,
    /// The predator's largest speed in m/s.
    pub(crate) max_speed: f64,
}

/// Fraction of the largest speed up to which a predator counts as at rest, because its heading would be
/// dominated by rounding errors.
const REST: f64 = 1e-9;

impl<const D: usize> Sighting<D> {
    /// Computes the observation of the predator at `index`. `max_speed` is its largest speed in m/s.
    pub(crate) fn of(
        index: usize,
        predators: &[Predator<D>],
        max_speed: f64,
        prey: Prey<'_, D>,
    ) -> Self {
        let own = &predators[index];
        let (centroid, velocity) = prey
            .centroid()
            .map_or((own.position, own.velocity), |mean| {
                let total = SVector::from(prey.neighborhood.total_velocity());
                (mean, total / prey.agents.len() as f64)
            });
        let nearest = prey.nearest(&own.position);
        let nearest = nearest.map_or((own.position, own.velocity), |agent| {
            (agent.position, agent.velocity)
        });
        let others = predators.iter().enumerate().filter(|(k, _)| *k != index);
        let other = others
            .map(|(_, other)| other.position - own.position)
            .min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
        Self {
            velocity: own.velocity,
            nearest: nearest.0 - own.position,
            nearest_velocity: nearest.1 - own.velocity,
            centroid: centroid - own.position,
            flock_velocity: velocity - own.velocity,
            other,
            max_speed,
        }
    }

    /// Returns the predator's body frame. The axis ahead is its heading or, at rest, the first observed
    /// vector that is not 0.
    pub(crate) fn frame(&self) -> Frame<D> {
        let seen = [
            self.nearest,
            self.nearest_velocity,
            self.centroid,
            self.flock_velocity,
            self.other.unwrap_or_else(SVector::zeros),
        ];
        let is_moving = self.velocity.norm() > self.max_speed * REST;
        let ahead = std::iter::once(&self.velocity)
            .filter(|_| is_moving)
            .chain(&seen)
            .find_map(unit);
        Frame::new(&ahead.unwrap_or_else(SVector::zeros), seen)
    }
}
