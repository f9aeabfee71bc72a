//! The encircling strategy: predators move to evenly spaced stations on a circle around the flock.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::shared::prey::Prey;
use super::shared::{Limits, Predator};
use crate::base::check::quantity;
use crate::base::error::Result;

/// Turns toward its station on a circle around the centroid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Encircle {
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
    /// Radius of the circle at t = 0 in m, at least 0.
    pub radius: f64,
    /// Rate in m/s at which the radius decreases to 0, at least 0.
    pub closing_speed: f64,
}

impl Encircle {
    fn limits(&self) -> Limits {
        Limits::new(self.max_turn_rate, self.max_speed, self.acceleration)
    }

    pub(super) fn check(&self, path: &str) -> Result<()> {
        self.limits().check(path, &self.velocity)?;
        quantity(&format!("{path}.radius"), self.radius)?;
        quantity(&format!("{path}.closing_speed"), self.closing_speed)
    }

    /// Turns toward the station.
    pub(super) fn steer<const D: usize>(&self, own: &mut Predator<D>, time_step: f64) {
        self.limits().turn_toward(own.aim, own, time_step);
    }
}

/// Assigns a station to every encircling predator.
pub(super) fn assign_stations<'a, const D: usize>(
    members: impl Iterator<Item = (&'a Encircle, &'a mut Predator<D>)>,
    time_step: f64,
    prey: Prey<'_, D>,
) {
    let mut members = members.peekable();
    let Some(center) = members.peek().and_then(|_| prey.centroid()) else {
        members.for_each(|(_, predator)| predator.aim = None);
        return;
    };
    // Stations are assigned in the order of bearings, so that no predator has to pass another one.
    let mut bearings: Vec<_> = members
        .map(|(circle, predator)| {
            let offset = predator.position - center;
            (libm::atan2(offset[1], offset[0]), circle, predator)
        })
        .collect();
    bearings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let count = bearings.len() as f64;
    // This rotation of the circle minimizes the sum of the squared angles between bearings and stations. The
    // branch cut of the bearings has no effect: adding a full turn to one bearing rotates the circle by one
    // station.
    let mean = bearings.iter().map(|(bearing, ..)| bearing).sum::<f64>() / count;
    for (rank, (_, circle, predator)) in bearings.into_iter().enumerate() {
        predator.steps += 1;
        let seconds = predator.steps as f64 * time_step;
        let radius = (circle.radius - circle.closing_speed * seconds).max(0.0);
        let angle = mean + (rank as f64 - (count - 1.0) / 2.0) * TAU / count;
        let mut station = center;
        station[0] += radius * libm::cos(angle);
        station[1] += radius * libm::sin(angle);
        predator.aim = Some(station);
    }
}
