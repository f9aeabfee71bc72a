//! Encirclement: predators take evenly spaced stations on a circle around the flock.

use std::f64::consts::TAU;

use super::shared::flight::steering;
use super::shared::prey::Prey;
use super::{Predator, PredatorConfig};
use crate::base::check::quantity;
use crate::base::error::Result;

steering! {
    /// Turns toward its station on a circle around the centroid.
    Encircle {
        /// Radius of the circle at t = 0 in m, at least 0.
        radius: f64,
        /// How fast the circle closes in, down to 0, in m/s, at least 0.
        closing_speed: f64,
    }
}

impl Encircle {
    pub(super) fn check(&self, path: &str) -> Result<()> {
        self.limits().check(path, &self.velocity)?;
        quantity(&format!("{path}.radius"), self.radius)?;
        quantity(&format!("{path}.closing_speed"), self.closing_speed)
    }

    /// Radius in m after `seconds`.
    fn radius(&self, seconds: f64) -> f64 {
        (self.radius - self.closing_speed * seconds).max(0.0)
    }
}

/// Tells every encircling predator where its station is.
pub(super) fn take_stations<const D: usize>(
    predators: &mut [Predator<D>],
    time_step: f64,
    prey: Prey<'_, D>,
) {
    let encircles = |p: &Predator<D>| matches!(p.strategy, PredatorConfig::Encircle(_));
    if !predators.iter().any(encircles) {
        return;
    }
    let Some(center) = prey.centroid() else {
        return;
    };
    // In the order of their bearings, so that none has to pass another one.
    let mut bearings: Vec<(f64, &mut Predator<D>)> = predators
        .iter_mut()
        .filter(|p| encircles(p))
        .map(|p| {
            (
                libm::atan2(p.position[1] - center[1], p.position[0] - center[0]),
                p,
            )
        })
        .collect();
    bearings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let count = bearings.len() as f64;
    // The turn of the whole circle at which the squares of all angles left to fly have the smallest sum. Where the
    // bearings begin, at -pi or elsewhere, does not matter: one more turn of one of them turns the circle by a station.
    let mean = bearings.iter().map(|(bearing, _)| bearing).sum::<f64>() / count;
    for (rank, (_, predator)) in bearings.into_iter().enumerate() {
        let PredatorConfig::Encircle(strategy) = &predator.strategy else {
            continue;
        };
        predator.steps += 1;
        let radius = strategy.radius(predator.steps as f64 * time_step);
        let angle = mean + (rank as f64 - (count - 1.0) / 2.0) * TAU / count;
        let mut station = center;
        station[0] += radius * libm::cos(angle);
        station[1] += radius * libm::sin(angle);
        predator.agreed = Some(station);
    }
}
