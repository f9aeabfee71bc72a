//! Pure pursuit: the velocity turns toward the nearest agent, no faster than a given rate, at constant speed.

use nalgebra::SVector;
use serde::Deserialize;

use crate::agents::Agents;
use crate::config::not_negative;
use crate::error::Result;
use crate::vector::{least_aligned_axis, unit};

/// Turns toward the agent nearest at the time (the lowest index among equals).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PurePursuit {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p(0) in m/s; its norm is the speed at all times.
    pub velocity: Vec<f64>,
    /// Largest turn rate in rad/s, at least 0.
    pub max_turn_rate: f64,
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
        agents: &Agents<D>,
    ) -> SVector<f64, D> {
        let speed = velocity.norm();
        let sight = nearest(position, agents).and_then(|agent| unit(&(agent - position)));
        match (unit(velocity), sight) {
            (Some(heading), Some(sight)) => {
                turn(&heading, &sight, self.max_turn_rate * time_step) * speed
            }
            _ => *velocity,
        }
    }
}

fn nearest<const D: usize>(
    position: &SVector<f64, D>,
    agents: &Agents<D>,
) -> Option<SVector<f64, D>> {
    let mut best = (f64::INFINITY, usize::MAX, None);
    for (name, agent, _) in agents.iter() {
        let squared = (agent - position).norm_squared();
        if squared < best.0 || (squared == best.0 && name < best.1) {
            best = (squared, name, Some(agent));
        }
    }
    best.2
}

/// The unit vector `heading` turned toward the unit vector `sight` by at most `limit` rad, in their plane.
fn turn<const D: usize>(
    heading: &SVector<f64, D>,
    sight: &SVector<f64, D>,
    limit: f64,
) -> SVector<f64, D> {
    let along = heading.dot(sight);
    let across = sight - heading * along;
    if libm::atan2(across.norm(), along) <= limit {
        return *sight;
    }
    // Straight behind, every side is as good: the axis least along the heading settles it.
    let side = unit(&across).or_else(|| {
        let axis = least_aligned_axis(heading);
        unit(&(axis - heading * heading.dot(&axis)))
    });
    match side {
        Some(side) => heading * libm::cos(limit) + side * libm::sin(limit),
        None => *heading,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;
    use std::f64::consts::PI;

    #[test]
    fn turns_at_the_limit_and_keeps_its_speed() {
        let turned = turn(&vector![1.0, 0.0], &vector![0.0, 1.0], PI / 6.0);
        assert!((turned - vector![(PI / 6.0).cos(), 0.5]).norm() < 1e-15);
        let direct = turn(&vector![1.0, 0.0], &vector![0.0, 1.0], PI);
        assert_eq!(direct, vector![0.0, 1.0]);
    }

    #[test]
    fn turns_although_the_agent_is_straight_behind() {
        let turned = turn(&vector![1.0, 0.0, 0.0], &vector![-1.0, 0.0, 0.0], 0.1);
        assert!((turned.norm() - 1.0).abs() < 1e-15);
        assert!((turned.x - libm::cos(0.1)).abs() < 1e-15);
    }

    #[test]
    fn hunts_the_nearest_and_flies_on_over_a_caught_agent() {
        let hunter = PurePursuit {
            position: vec![],
            velocity: vec![],
            max_turn_rate: 1e3,
        };
        let positions = [vector![0.0, 9.0], vector![-4.0, 0.0]];
        let agents = Agents::new(&positions, &positions);
        let velocity = vector![3.0, 0.0];
        let next = hunter.steer(&vector![0.0, 0.0], &velocity, 0.05, &agents);
        assert!((next - vector![-3.0, 0.0]).norm() < 1e-12);
        assert_eq!(
            hunter.steer(&positions[0], &velocity, 0.05, &agents),
            velocity
        );
    }
}
