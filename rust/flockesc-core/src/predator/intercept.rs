//! The intercepting strategy: proportional navigation toward the nearest agent.

use nalgebra::SVector;

use super::shared::flight::steering;
use super::shared::prey::Prey;
use super::strategy::{Flight, Strategy, Surroundings};
use crate::base::check::quantity;
use crate::base::error::Result;
use crate::base::vector::{side_of, turn, unit};

steering! {
    /// Turns at `navigation_constant` times the turn rate of the line of sight to the nearest agent.
    Intercept {
        /// Navigation constant N, dimensionless, at least 0.
        navigation_constant: f64,
    }
}

impl Intercept {
    /// Returns the next heading, or `None` at the target's position or on a collision course, where the
    /// predator flies straight on.
    fn heading<const D: usize>(
        &self,
        position: &SVector<f64, D>,
        velocity: &SVector<f64, D>,
        time_step: f64,
        prey: Prey<'_, D>,
    ) -> Option<SVector<f64, D>> {
        let agent = prey.nearest(position)?;
        let offset = agent.position - position;
        let line_of_sight = unit(&offset)?;
        // A predator at rest starts along the line of sight.
        let Some(heading) = unit(velocity) else {
            return Some(line_of_sight);
        };
        // Let u be the line of sight and w = ||R|| du/dt the component of the relative velocity across it.
        // The turn rate omega = u x du/dt changes the heading h by omega x h = (w (u . h) - u (w . h)) /
        // ||R||, in any dimension.
        let relative = agent.velocity - velocity;
        let across = relative - line_of_sight * line_of_sight.dot(&relative);
        let push = across * line_of_sight.dot(&heading) - line_of_sight * across.dot(&heading);
        let rate = self.navigation_constant * push.norm() / offset.norm();
        let angle = rate.min(self.max_turn_rate) * time_step;
        Some(turn(&heading, &side_of(&heading, &push)?, angle))
    }
}

impl Strategy for Intercept {
    type Memory<const D: usize> = ();

    fn check(&self, path: &str, _index: usize, _count: usize) -> Result<()> {
        self.limits().check(path, &self.velocity)?;
        let field = format!("{path}.navigation_constant");
        quantity(&field, self.navigation_constant)
    }

    fn steer<const D: usize>(
        &self,
        (): &mut (),
        flight: &Flight<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) -> (SVector<f64, D>, f64) {
        let (position, velocity, time_step) =
            (&flight.position, &flight.velocity, surroundings.time_step);
        let heading = self.heading(position, velocity, time_step, surroundings.prey);
        self.limits()
            .next(velocity, flight.speed, heading, time_step)
    }
}
