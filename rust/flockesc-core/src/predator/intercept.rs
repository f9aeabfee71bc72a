//! Proportional navigation: the velocity turns as the line of sight to the nearest agent does, times a constant.

use nalgebra::SVector;
use serde::Deserialize;

use super::prey::{Prey, Quarry};
use super::steering::{side_of, turn};
use crate::config::not_negative;
use crate::error::Result;
use crate::vector::unit;

/// Turns at `navigation_constant` times the rate of the line of sight, at constant speed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Intercept {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p(0) in m/s; its norm is the speed at all times.
    pub velocity: Vec<f64>,
    /// Largest turn rate in rad/s, at least 0.
    pub max_turn_rate: f64,
    /// N, without a unit, at least 0.
    pub navigation_constant: f64,
}

impl Intercept {
    pub(super) fn check(&self, path: &str) -> Result<()> {
        not_negative(&format!("{path}.max_turn_rate"), self.max_turn_rate)?;
        let field = format!("{path}.navigation_constant");
        not_negative(&field, self.navigation_constant)
    }

    pub(super) fn steer<const D: usize>(
        &self,
        position: &SVector<f64, D>,
        velocity: &SVector<f64, D>,
        time_step: f64,
        prey: Prey<'_, D>,
    ) -> SVector<f64, D> {
        prey.nearest(position)
            .and_then(|quarry| self.turned(position, velocity, time_step, &quarry))
            .unwrap_or(*velocity)
    }

    /// `None` where nothing turns: at rest, at the target, or on a collision course.
    fn turned<const D: usize>(
        &self,
        position: &SVector<f64, D>,
        velocity: &SVector<f64, D>,
        time_step: f64,
        quarry: &Quarry<D>,
    ) -> Option<SVector<f64, D>> {
        let heading = unit(velocity)?;
        let offset = quarry.position - position;
        let sight = unit(&offset)?;
        // With w = ||R|| du/dt across the sight u, the rate omega = u x du/dt turns the heading h by
        // omega x h = (w (u . h) - u (w . h)) / ||R||, in every dimension.
        let relative = quarry.velocity - velocity;
        let across = relative - sight * sight.dot(&relative);
        let push = across * sight.dot(&heading) - sight * across.dot(&heading);
        let rate = self.navigation_constant * push.norm() / offset.norm();
        let angle = rate.min(self.max_turn_rate) * time_step;
        Some(turn(&heading, &side_of(&heading, &push)?, angle) * velocity.norm())
    }
}
