//! The encircling strategy: predators move to evenly spaced stations on a circle around the flock.

use std::f64::consts::TAU;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::shared::flight::steering;
use super::shared::prey::Prey;
use super::strategy::{Flight, Memory, Pack, Strategy, Surroundings};
use crate::base::check::quantity;
use crate::base::error::Result;
use crate::snapshot::check_vector;

steering! {
    /// Turns toward its station on a circle around the centroid.
    Encircle {
        /// Radius of the circle at t = 0 in m, at least 0.
        radius: f64,
        /// Rate in m/s at which the radius decreases to 0, at least 0.
        closing_speed: f64,
    }
}

/// A predator's station on the circle.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Station<const D: usize> {
    /// Number of steps so far, which determines the radius.
    steps: usize,
    /// Position in m.
    position: Option<SVector<f64, D>>,
}

impl<const D: usize> Memory for Station<D> {
    fn check(&self, _num_agents: usize) -> Result<()> {
        check_vector(self.position.as_ref(), "a predator's station")
    }
}

impl Encircle {
    /// Returns the radius in m after `seconds`.
    fn radius(&self, seconds: f64) -> f64 {
        (self.radius - self.closing_speed * seconds).max(0.0)
    }
}

impl Strategy for Encircle {
    type Memory<const D: usize> = Station<D>;

    fn check(&self, path: &str, _index: usize, _count: usize) -> Result<()> {
        self.limits().check(path, &self.velocity)?;
        quantity(&format!("{path}.radius"), self.radius)?;
        quantity(&format!("{path}.closing_speed"), self.closing_speed)
    }

    /// Assigns a station to every encircling predator.
    fn coordinate<const D: usize>(
        pack: &mut (impl Pack<Self, D> + ?Sized),
        time_step: f64,
        prey: Prey<'_, D>,
    ) {
        if pack.members().next().is_none() {
            return;
        }
        let Some(center) = prey.centroid() else {
            return;
        };
        // Stations are assigned in the order of bearings, so that no predator has to pass another one.
        let mut bearings: Vec<_> = pack
            .members()
            .map(|predator| {
                let offset = predator.position - center;
                (libm::atan2(offset[1], offset[0]), predator)
            })
            .collect();
        bearings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let count = bearings.len() as f64;
        // This rotation of the circle minimizes the sum of the squared angles between bearings and stations.
        // The branch cut of the bearings has no effect: adding a full turn to one bearing rotates the circle
        // by one station.
        let mean = bearings.iter().map(|(bearing, _)| bearing).sum::<f64>() / count;
        for (rank, (_, predator)) in bearings.into_iter().enumerate() {
            let station = predator.memory;
            station.steps += 1;
            let radius = predator.strategy.radius(station.steps as f64 * time_step);
            let angle = mean + (rank as f64 - (count - 1.0) / 2.0) * TAU / count;
            let mut position = center;
            position[0] += radius * libm::cos(angle);
            position[1] += radius * libm::sin(angle);
            station.position = Some(position);
        }
    }

    fn steer<const D: usize>(
        &self,
        station: &mut Station<D>,
        flight: &Flight<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) -> (SVector<f64, D>, f64) {
        let limits = self.limits();
        limits.toward(station.position, flight, surroundings.time_step)
    }
}
