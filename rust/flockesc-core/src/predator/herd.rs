//! The herding strategy: a predator drives the flock toward its partner.

use serde::{Deserialize, Serialize};

use super::shared::{Limits, Predator, Surroundings};
use crate::base::check::{quantity, require};
use crate::base::error::Result;
use crate::base::vector::unit;

/// Turns toward the driving position: the point behind the centroid, seen from its partner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Herd {
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
    /// Distance of the driving position from the centroid in m, at least 0.
    pub distance: f64,
    /// Index of the partner among the predators.
    pub partner: usize,
}

impl Herd {
    fn limits(&self) -> Limits {
        Limits::new(self.max_turn_rate, self.max_speed, self.acceleration)
    }

    /// Checks the predator at `index` of `count`.
    pub(super) fn check(&self, path: &str, index: usize, count: usize) -> Result<()> {
        self.limits().check(path, &self.velocity)?;
        quantity(&format!("{path}.distance"), self.distance)?;
        let is_other = self.partner < count && self.partner != index;
        let expected = format!("the index of another of the {count} predators");
        require(
            is_other,
            &format!("{path}.partner"),
            &expected,
            self.partner,
        )
    }

    /// Turns the predator at `index` toward its driving position.
    pub(super) fn steer<const D: usize>(
        &self,
        index: usize,
        predators: &mut [Predator<D>],
        surroundings: &Surroundings<'_, D>,
    ) {
        let partner = predators[self.partner].position;
        let own = &mut predators[index];
        let center = surroundings.prey.centroid();
        own.aim = center.and_then(|center| {
            let away = unit(&(center - partner))?;
            Some(center + away * self.distance)
        });
        self.limits()
            .turn_toward(own.aim, own, surroundings.time_step);
    }
}
