//! Pure pursuit: the velocity turns toward a target, no faster than a given rate, at constant speed.

use nalgebra::SVector;
use serde::Deserialize;

use super::prey::Prey;
use super::steering::turn_toward;
use crate::config::not_negative;
use crate::error::Result;
use crate::vector::unit;

/// Turns toward its target where that is at the time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PurePursuit {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p(0) in m/s; its norm is the speed at all times.
    pub velocity: Vec<f64>,
    /// Largest turn rate in rad/s, at least 0.
    pub max_turn_rate: f64,
    /// What is pursued.
    pub target: Target,
}

/// What a predator pursues; among equal agents the one with the lowest index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// The agent nearest to the predator.
    Nearest,
    /// The mean position of all agents.
    Centroid,
    /// The agent whose nearest other agent is farthest.
    MostIsolated,
}

impl PurePursuit {
    pub(super) fn check(&self, path: &str) -> Result<()> {
        not_negative(&format!("{path}.max_turn_rate"), self.max_turn_rate)
    }

    pub(super) fn steer<const D: usize>(
        &self,
        position: &SVector<f64, D>,
        velocity: &SVector<f64, D>,
        time_step: f64,
        prey: Prey<'_, D>,
    ) -> SVector<f64, D> {
        let target = match self.target {
            Target::Nearest => prey.nearest(position).map(|quarry| quarry.position),
            Target::Centroid => Some(prey.centroid()),
            Target::MostIsolated => Some(prey.most_isolated()),
        };
        let sight = target.and_then(|target| unit(&(target - position)));
        match (unit(velocity), sight) {
            (Some(heading), Some(sight)) => {
                turn_toward(&heading, &sight, self.max_turn_rate * time_step) * velocity.norm()
            }
            _ => *velocity,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agents::Agents;
    use crate::neighbor::{NeighborRule, Neighborhood};
    use nalgebra::vector;

    #[test]
    fn hunts_the_nearest_and_flies_on_over_a_caught_agent() {
        let hunter = PurePursuit {
            position: vec![],
            velocity: vec![],
            max_turn_rate: 1e3,
            target: Target::Nearest,
        };
        let positions = [vector![0.0, 9.0], vector![-4.0, 0.0]];
        let agents = Agents::new(&positions, &positions);
        let prey = Prey {
            agents: &agents,
            neighborhood: &Neighborhood::silent(NeighborRule::Metric {}, &agents),
        };
        let velocity = vector![3.0, 0.0];
        let next = hunter.steer(&vector![0.0, 0.0], &velocity, 0.05, prey);
        assert!((next - vector![-3.0, 0.0]).norm() < 1e-12);
        assert_eq!(hunter.steer(&positions[0], &velocity, 0.05, prey), velocity);
    }
}
