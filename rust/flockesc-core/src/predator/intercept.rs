//! The intercepting strategy: proportional navigation toward the nearest agent.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::shared::Limits;
use super::shared::prey::Prey;
use super::shared::{Predator, Surroundings};
use crate::base::check::quantity;
use crate::base::error::Result;
use crate::base::vector::{side_of, turn, unit};

/// Turns at `navigation_constant` times the turn rate of the line of sight to the nearest agent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Intercept {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p(0) in m/s.
    pub velocity: Vec<f64>,
    /// Largest turn rate in rad/s, at least 0.
    pub max_turn_rate: f64,
    /// Largest speed in m/s, at least ||v_p(0)||; `None` is a constant speed.
    pub max_speed: Option<f64>,
    /// Rate in m/s^2 at which the speed increases up to `max_speed`, at least 0.
    pub acceleration: f64,
    /// Navigation constant N, dimensionless, at least 0.
    pub navigation_constant: f64,
}

impl Intercept {
    fn limits(&self) -> Limits {
        Limits::new(self.max_turn_rate, self.max_speed, self.acceleration)
    }

    pub(super) fn check(&self, path: &str) -> Result<()> {
        self.limits().check(path, &self.velocity)?;
        let field = format!("{path}.navigation_constant");
        quantity(&field, self.navigation_constant)
    }

    pub(super) fn steer<const D: usize>(
        &self,
        own: &mut Predator<D>,
        surroundings: &Surroundings<'_, D>,
    ) {
        let time_step = surroundings.time_step;
        let heading = self.heading(own, time_step, surroundings.prey);
        self.limits().fly_along(heading, own, time_step);
    }

    /// Returns the next heading, or `None` at the target's position or on a collision course, where the
    /// predator flies straight on.
    fn heading<const D: usize>(
        &self,
        own: &Predator<D>,
        time_step: f64,
        prey: Prey<'_, D>,
    ) -> Option<SVector<f64, D>> {
        let agent = prey.nearest(&own.position)?;
        let offset = agent.position - own.position;
        let line_of_sight = unit(&offset)?;
        // A predator at rest starts along the line of sight.
        let Some(heading) = unit(&own.velocity) else {
            return Some(line_of_sight);
        };
        // Let u be the line of sight and w = ||R|| du/dt the component of the relative velocity across it.
        // The turn rate omega = u x du/dt changes the heading h by omega x h = (w (u . h) - u (w . h)) /
        // ||R||, in any dimension.
        let relative = agent.velocity - own.velocity;
        let across = relative - line_of_sight * line_of_sight.dot(&relative);
        let push = across * line_of_sight.dot(&heading) - line_of_sight * across.dot(&heading);
        let rate = self.navigation_constant * push.norm() / offset.norm();
        let angle = rate.min(self.max_turn_rate) * time_step;
        Some(turn(&heading, &side_of(&heading, &push)?, angle))
    }
}
