//! One step of the flock, in the order of docs/model.md: listen, forces, integrate, keep speed, predators.

use std::sync::Arc;

use nalgebra::SVector;

use super::InitialState;
use crate::config::FlockConfig;
use crate::metrics;
use crate::neighbor::{Neighborhood, Ranges};
use crate::predator::Predator;
use crate::vector::{heading, unit};

/// A flock and its predators at one moment.
#[derive(Debug, Clone)]
pub struct World<const D: usize> {
    config: Arc<FlockConfig>,
    positions: Vec<SVector<f64, D>>,
    velocities: Vec<SVector<f64, D>>,
    predators: Vec<Predator<D>>,
    neighborhood: Neighborhood<D>,
}

impl<const D: usize> World<D> {
    /// The world at t = 0. `config.dimension` is D, and `start` has passed [`InitialState::check`].
    #[must_use]
    pub fn new(config: Arc<FlockConfig>, start: &InitialState) -> Self {
        let velocities = start.velocities(&config);
        Self {
            positions: start.positions(&config),
            predators: start.predators(&config),
            neighborhood: Neighborhood::silent(config.neighbor_rule, &velocities),
            velocities,
            config,
        }
    }

    /// Advances from t to t + dt under `ranges`.
    pub fn step(&mut self, ranges: Ranges<'_>) {
        self.neighborhood
            .listen(&self.positions, &self.velocities, ranges);
        let FlockConfig {
            time_step,
            mass,
            speed,
            constant_speed,
            ..
        } = *self.config;
        for agent in 0..self.positions.len() {
            let force = self.consensus_force(agent) + self.escape_force(agent);
            let velocity = &mut self.velocities[agent];
            self.positions[agent] += *velocity * time_step;
            let pushed = *velocity + force * (time_step / mass);
            if constant_speed {
                if let Some(heading) = unit(&pushed) {
                    *velocity = heading * speed;
                }
            } else {
                *velocity = pushed;
            }
        }
        for predator in &mut self.predators {
            predator.advance(time_step, &self.positions);
        }
    }

    /// v0 <v>_i / ||<v>_i|| (Eq. 11); 0 where the mean is exactly 0.
    fn consensus_force(&self, agent: usize) -> SVector<f64, D> {
        heading(&self.neighborhood.mean_velocity[agent]) * self.config.speed
    }

    /// s (r_i - r_p) / ||r_i - r_p||, summed over the predators within their range of agent i.
    fn escape_force(&self, agent: usize) -> SVector<f64, D> {
        let mut force = SVector::zeros();
        for predator in &self.predators {
            let offset = self.positions[agent] - predator.position;
            let distance = offset.norm();
            if distance <= self.config.predator_range && distance > 0.0 {
                force += offset * (self.config.repulsion_strength / distance);
            }
        }
        force
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &FlockConfig {
        &self.config
    }

    /// r_i in m.
    #[must_use]
    pub fn positions(&self) -> &[SVector<f64, D>] {
        &self.positions
    }

    /// v_i in m/s.
    #[must_use]
    pub fn velocities(&self) -> &[SVector<f64, D>] {
        &self.velocities
    }

    /// The predators.
    #[must_use]
    pub fn predators(&self) -> &[Predator<D>] {
        &self.predators
    }

    /// What the agents heard in the last step.
    pub(crate) fn neighborhood(&self) -> &Neighborhood<D> {
        &self.neighborhood
    }

    /// Writes d_i, the distance of every agent to its nearest predator, in m.
    pub fn distances(&self, out: &mut Vec<f64>) {
        let predators = self.predators.iter().map(|p| &p.position);
        metrics::distances(&self.positions, predators, out);
    }

    /// Number of (weakly) connected components under `ranges`.
    #[must_use]
    pub fn num_components(&self, ranges: Ranges<'_>) -> usize {
        self.neighborhood.num_components(&self.positions, ranges)
    }

    /// Norm of the mean heading, in [0, 1].
    #[must_use]
    pub fn polarization(&self) -> f64 {
        metrics::polarization(&self.velocities)
    }
}
