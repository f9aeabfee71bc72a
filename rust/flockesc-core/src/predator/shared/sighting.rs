//! What a predator sees at one moment: vectors in m and m/s, and the frame that is made of them.

use nalgebra::SVector;

use crate::base::frame::Frame;
use crate::base::vector::unit;
use crate::predator::shared::prey::{Prey, Quarry};
use crate::predator::strategy::{Flight, Steered};

/// Offsets and velocities relative to one predator; 0 for agents that do not exist.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sighting<const D: usize> {
    /// v_p in m/s.
    pub(crate) velocity: SVector<f64, D>,
    /// Toward the nearest agent, in m, and its velocity relative to the predator's.
    pub(crate) nearest: SVector<f64, D>,
    pub(crate) nearest_velocity: SVector<f64, D>,
    /// Toward the mean position of all agents, in m, and their mean velocity relative to the predator's.
    pub(crate) centroid: SVector<f64, D>,
    pub(crate) flock_velocity: SVector<f64, D>,
    /// Toward the nearest other predator, in m.
    pub(crate) other: Option<SVector<f64, D>>,
    /// The predator's largest speed in m/s.
    pub(crate) max_speed: f64,
}

/// Up to this speed over the largest one a predator rests: its heading would be rounding.
const REST: f64 = 1e-9;

impl<const D: usize> Sighting<D> {
    /// What a predator that is steered from outside sees; `others` are the positions of the other predators.
    pub(in crate::predator) fn of(
        own: &Flight<D>,
        steered: Steered,
        others: impl Iterator<Item = SVector<f64, D>>,
        prey: Prey<'_, D>,
    ) -> Self {
        let nearest = prey.nearest(&own.position);
        let of_nearest = |vector: fn(&Quarry<D>) -> SVector<f64, D>, own: &SVector<f64, D>| {
            nearest.map_or_else(SVector::zeros, |quarry| vector(&quarry) - own)
        };
        let centroid = prey.centroid();
        let mean_velocity =
            |_| SVector::from(prey.neighborhood.total_velocity()) / prey.agents.len() as f64;
        let other = others
            .map(|position| position - own.position)
            .min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
        Self {
            velocity: own.velocity,
            nearest: of_nearest(|quarry| quarry.position, &own.position),
            nearest_velocity: of_nearest(|quarry| quarry.velocity, &own.velocity),
            centroid: centroid.map_or_else(SVector::zeros, |centroid| centroid - own.position),
            flock_velocity: centroid
                .map(mean_velocity)
                .map_or_else(SVector::zeros, |mean| mean - own.velocity),
            other,
            max_speed: steered.max_speed,
        }
    }

    /// The predator's own frame: ahead is its heading or, at rest, the first direction that it sees.
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
        Frame::new(&ahead.unwrap_or_else(SVector::zeros), &seen)
    }
}
