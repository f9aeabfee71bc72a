//! Strategies that turn toward a point: turns by a limited angle, and limits of speed and turn rate.

use nalgebra::SVector;

use super::predator::Predator;
use crate::base::check::{MAX_MAGNITUDE, quantity};
use crate::base::error::{Error, Result};
use crate::base::vector::{least_aligned_axis, side_of, turn, unit};

/// Relative error of the norm of a velocity that was scaled to `max_speed`.
const ROUNDING: f64 = 1e-12;

/// Limits of a predator's turn rate and speed.
pub(crate) struct Limits {
    /// Largest turn rate in rad/s.
    turn_rate: f64,
    /// Largest speed in m/s; `None` is a constant speed.
    speed: Option<f64>,
    /// Rate in m/s^2 at which the speed increases.
    acceleration: f64,
}

impl Limits {
    pub(crate) fn new(turn_rate: f64, speed: Option<f64>, acceleration: f64) -> Self {
        Self {
            turn_rate,
            speed,
            acceleration,
        }
    }

    /// Checks the limits for a predator with the initial velocity `velocity`.
    pub(crate) fn check(&self, path: &str, velocity: &[f64]) -> Result<()> {
        quantity(&format!("{path}.max_turn_rate"), self.turn_rate)?;
        quantity(&format!("{path}.acceleration"), self.acceleration)?;
        let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
        match self.speed {
            Some(fastest) if !(speed * (1.0 - ROUNDING)..=MAX_MAGNITUDE).contains(&fastest) => {
                let expected =
                    format!("a number from the initial speed {speed} to {MAX_MAGNITUDE:?}");
                Err(Error::config(
                    format!("{path}.max_speed"),
                    expected,
                    fastest,
                ))
            }
            None if self.acceleration > 0.0 => Err(Error::config(
                format!("{path}.acceleration"),
                "0 without a max_speed",
                self.acceleration,
            )),
            _ => Ok(()),
        }
    }

    /// Turns the velocity toward the point `aim` in m. Without an aim the predator flies straight on.
    pub(crate) fn turn_toward<const D: usize>(
        &self,
        aim: Option<SVector<f64, D>>,
        own: &mut Predator<D>,
        time_step: f64,
    ) {
        let limit = self.turn_rate * time_step;
        let heading =
            aim.and_then(|aim| heading_toward(&own.velocity, &(aim - own.position), limit));
        self.fly_along(heading, own, time_step);
    }

    /// Sets the velocity along the unit vector `heading`. Without a heading the predator flies straight on.
    pub(crate) fn fly_along<const D: usize>(
        &self,
        heading: Option<SVector<f64, D>>,
        own: &mut Predator<D>,
        time_step: f64,
    ) {
        let speed = match self.speed {
            Some(fastest) if own.speed < fastest => {
                (own.speed + self.acceleration * time_step).min(fastest)
            }
            _ => own.speed,
        };
        let straight_on = || unit(&own.velocity).filter(|_| speed > own.speed);
        // At a constant speed, a velocity straight on stays bitwise equal.
        if let Some(heading) = heading.or_else(straight_on) {
            own.velocity = heading * speed;
            own.speed = speed;
        }
    }
}

/// Returns the unit vector `heading` turned toward the unit vector `direction` by at most `limit` rad, in
/// their plane.
fn turn_toward<const D: usize>(
    heading: &SVector<f64, D>,
    direction: &SVector<f64, D>,
    limit: f64,
) -> SVector<f64, D> {
    let along = heading.dot(direction);
    if libm::atan2((direction - heading * along).norm(), along) <= limit {
        return *direction;
    }
    // If the aim is straight behind, the side is ambiguous: turn toward the axis that is least aligned with
    // the heading.
    let side =
        side_of(heading, direction).or_else(|| side_of(heading, &least_aligned_axis(heading)));
    side.map_or(*heading, |side| turn(heading, &side, limit))
}

/// Returns the next heading of a predator that turns toward a point at `offset` by at most `limit` rad, or
/// `None` if the offset is 0. A predator at rest starts straight toward the point.
fn heading_toward<const D: usize>(
    velocity: &SVector<f64, D>,
    offset: &SVector<f64, D>,
    limit: f64,
) -> Option<SVector<f64, D>> {
    let direction = unit(offset)?;
    let turned = unit(velocity).map(|heading| turn_toward(&heading, &direction, limit));
    Some(turned.unwrap_or(direction))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;
    use std::f64::consts::PI;

    #[test]
    fn the_speed_increases_to_its_limit_and_never_decreases() {
        let next = |max_speed, velocity: SVector<f64, 2>, heading| {
            let mut predator = Predator::new(vector![0.0, 0.0], velocity);
            Limits::new(1.0, max_speed, 4.0).fly_along(heading, &mut predator, 0.5);
            assert_eq!(predator.velocity.norm(), predator.speed);
            predator.velocity
        };
        let (up, still) = (Some(vector![0.0, 1.0]), vector![0.0, 0.0]);
        assert_eq!(next(Some(9.0), vector![3.0, 0.0], up), vector![0.0, 5.0]);
        assert_eq!(next(Some(4.5), vector![3.0, 0.0], up), vector![0.0, 4.5]);
        assert_eq!(next(Some(2.0), vector![3.0, 0.0], up), vector![0.0, 3.0]);
        assert_eq!(next(None, vector![3.0, 0.0], up), vector![0.0, 3.0]);
        assert_eq!(next(Some(9.0), vector![3.0, 0.0], None), vector![5.0, 0.0]);
        assert_eq!(next(Some(9.0), still, up), vector![0.0, 2.0]);
        assert_eq!(next(Some(9.0), still, None), still);
    }

    #[test]
    fn turns_at_the_limit_and_keeps_its_length() {
        let turned = turn_toward(&vector![1.0, 0.0], &vector![0.0, 1.0], PI / 6.0);
        assert!((turned - vector![(PI / 6.0).cos(), 0.5]).norm() < 1e-15);
        let direct = turn_toward(&vector![1.0, 0.0], &vector![0.0, 1.0], PI);
        assert_eq!(direct, vector![0.0, 1.0]);
    }

    #[test]
    fn keeps_its_length_although_the_aim_is_nearly_straight_behind() {
        let heading = unit(&vector![0.6, -0.3, 0.7]).expect("a direction");
        for offset in [1e-6, 1e-9, 1e-12, 1e-15] {
            let aim = unit(&(vector![offset, 0.0, 0.0] - heading)).expect("a direction");
            let turned = turn_toward(&heading, &aim, 0.1);
            assert!((turned.norm() - 1.0).abs() < 1e-15, "{offset}");
            assert!(
                (heading.dot(&turned) - libm::cos(0.1)).abs() < 1e-15,
                "{offset}"
            );
        }
    }

    #[test]
    fn turns_although_the_aim_is_straight_behind() {
        let turned = turn_toward(&vector![1.0, 0.0, 0.0], &vector![-1.0, 0.0, 0.0], 0.1);
        assert!((turned.norm() - 1.0).abs() < 1e-15);
        assert!((turned.x - libm::cos(0.1)).abs() < 1e-15);
    }

    #[test]
    fn flies_straight_on_at_its_aim_and_starts_from_rest() {
        let (up, none) = (vector![0.0, 2.0], vector![0.0, 0.0]);
        assert_eq!(heading_toward(&up, &none, 1.0), None);
        assert_eq!(heading_toward(&none, &up, 0.0), Some(vector![0.0, 1.0]));
    }
}
