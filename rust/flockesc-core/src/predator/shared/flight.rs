//! Parameters of strategies that turn toward a point: initial position and velocity, and limits of speed and
//! turn rate.

use nalgebra::SVector;

use crate::base::check::{MAX_MAGNITUDE, quantity};
use crate::base::error::{Error, Result};
use crate::base::vector::unit;
use crate::predator::shared::steering::heading_toward;
use crate::predator::strategy::Flight;

/// Relative error of the norm of a velocity that was scaled to `max_speed`.
const ROUNDING: f64 = 1e-12;

/// Declares the struct of a strategy that turns toward a point, with the fields that all such strategies
/// share.
macro_rules! steering {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $field:ident: $kind:ty,)* }) => {
        $(#[$about])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
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
            $($(#[$doc])* pub $field: $kind,)*
        }

        $crate::predator::shared::start::given_start!($name);

        impl $name {
            pub(in crate::predator) fn limits(&self) -> $crate::predator::shared::flight::Limits {
                $crate::predator::shared::flight::Limits {
                    max_turn_rate: self.max_turn_rate,
                    max_speed: self.max_speed,
                    acceleration: self.acceleration,
                }
            }
        }
    };
}
pub(in crate::predator) use steering;

/// Limits of a predator's turn rate and speed.
pub(in crate::predator) struct Limits {
    pub(in crate::predator) max_turn_rate: f64,
    pub(in crate::predator) max_speed: Option<f64>,
    pub(in crate::predator) acceleration: f64,
}

impl Limits {
    /// Checks the limits for a predator with the initial velocity `velocity`.
    pub(in crate::predator) fn check(&self, path: &str, velocity: &[f64]) -> Result<()> {
        quantity(&format!("{path}.max_turn_rate"), self.max_turn_rate)?;
        quantity(&format!("{path}.acceleration"), self.acceleration)?;
        let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
        match self.max_speed {
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

    /// Returns the next velocity of a predator that turns toward the point `aim` in m, and its norm. Without
    /// an aim it flies straight on.
    pub(in crate::predator) fn toward<const D: usize>(
        &self,
        aim: Option<SVector<f64, D>>,
        flight: &Flight<D>,
        time_step: f64,
    ) -> (SVector<f64, D>, f64) {
        let velocity = &flight.velocity;
        let limit = self.max_turn_rate * time_step;
        let heading = aim.and_then(|aim| heading_toward(velocity, &(aim - flight.position), limit));
        self.next(velocity, flight.speed, heading, time_step)
    }

    /// Returns the next velocity along the unit vector `heading`, and its norm. Without a heading the
    /// predator flies straight on.
    pub(in crate::predator) fn next<const D: usize>(
        &self,
        velocity: &SVector<f64, D>,
        speed: f64,
        heading: Option<SVector<f64, D>>,
        time_step: f64,
    ) -> (SVector<f64, D>, f64) {
        let grown = match self.max_speed {
            Some(fastest) if speed < fastest => {
                (speed + self.acceleration * time_step).min(fastest)
            }
            _ => speed,
        };
        match heading {
            Some(heading) => (heading * grown, grown),
            // Returned without a multiplication, so that it stays bitwise equal.
            None if grown <= speed => (*velocity, speed),
            None => unit(velocity).map_or((*velocity, speed), |heading| (heading * grown, grown)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    #[test]
    fn the_speed_increases_to_its_limit_and_never_decreases() {
        let limits = |max_speed| Limits {
            max_turn_rate: 1.0,
            max_speed,
            acceleration: 4.0,
        };
        let next = |max_speed, velocity: SVector<f64, 2>, heading| {
            let speed = velocity.norm();
            let (next, norm) = limits(max_speed).next(&velocity, speed, heading, 0.5);
            assert_eq!(next.norm(), norm);
            next
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
}
