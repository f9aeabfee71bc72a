//! One row per flock: scalars that no turn, shift or renumbering of the agents changes.

use nalgebra::SVector;

use super::Scene;
use super::agent::nearest;
use super::table::{Row, Table, squash};
use crate::base::vector::heading;
use crate::flock::{PredatorDistance, Summary};

/// What the flock as a whole sees.
pub(super) struct Seen<'a, const D: usize> {
    time: f64,
    running_minimum: f64,
    last_range: f64,
    /// Scales of lengths in m and speeds in m/s.
    length: f64,
    speed: f64,
    flock: &'a Summary<D>,
    distance: PredatorDistance,
    predator: Option<Nearest<D>>,
}

/// The predator nearest to the centroid, if the agent nearest to a predator senses it.
struct Nearest<const D: usize> {
    /// Distance of the centroid in m, and the direction from the predator to it.
    distance: f64,
    away: SVector<f64, D>,
    /// v_p in m/s.
    velocity: SVector<f64, D>,
}

/// The entries of a row.
#[inline(always)]
pub(super) fn table<'a, const D: usize>(table: &mut impl Table<Seen<'a, D>>) {
    table.number("time", 0.0, |seen| seen.time);
    table.number("running_minimum", 0.0, |seen| seen.running_minimum);
    table.number("last_range", 0.0, |seen| seen.last_range);
    table.number("speed", 0.0, |seen| squash(seen.flock.speed, seen.speed));
    table.number("polarization", 0.0, |seen| seen.flock.polarization);
    table.number("spread", 0.0, |seen| {
        squash(seen.flock.dispersion, seen.length)
    });
    table.number("neighbor_count", 0.0, |seen| seen.flock.neighbor_count);
    table.number("heard_alignment", 0.0, |seen| seen.flock.heard_alignment);
    table.number("predator_sensed", 0.0, |seen| seen.of_predator(|_| 1.0));
    table.number("mean_distance", 0.0, |seen| {
        seen.of_predator(|_| squash(seen.distance.mean, seen.length))
    });
    table.number("min_distance", 0.0, |seen| {
        seen.of_predator(|_| squash(seen.distance.minimum, seen.length))
    });
    table.number("centroid_distance", 0.0, |seen| {
        seen.of_predator(|predator| squash(predator.distance, seen.length))
    });
    table.number("fraction_in_range", 0.0, |seen| {
        seen.of_predator(|_| seen.flock.fraction_in_range)
    });
    table.number("heading_away", -1.0, |seen| {
        seen.of_predator(|_| seen.flock.heading_away)
    });
    table.number("heading_away_in_range", -1.0, |seen| {
        seen.of_predator(|_| seen.flock.heading_away_in_range)
    });
    table.number("velocity_away", -1.0, |seen| {
        seen.of_predator(|predator| {
            let velocity = SVector::from(seen.flock.velocity);
            velocity.dot(&predator.away) / (velocity.norm() + seen.speed)
        })
    });
    table.number("predator_speed", 0.0, |seen| {
        seen.of_predator(|predator| squash(predator.velocity.norm(), seen.speed))
    });
    table.number("predator_aim", -1.0, |seen| {
        seen.of_predator(|predator| heading(&predator.velocity).dot(&predator.away))
    });
}

impl<const D: usize> Seen<'_, D> {
    /// A value that only a flock that senses a predator sees; 0 for others.
    fn of_predator(&self, value: impl Fn(&Nearest<D>) -> f64) -> f64 {
        self.predator.as_ref().map_or(0.0, value)
    }
}

/// Writes one row.
pub(super) fn write<const D: usize>(scene: &Scene<'_, D>, out: &mut [f32]) {
    let (world, flock) = (scene.world, scene.summary);
    let distance = world.predator_distance();
    let centroid = SVector::from(flock.centroid);
    let is_sensed = world.fraction_surviving() > 0.0 && scene.is_sensed(distance.minimum);
    let predator = nearest(&centroid, world.predators()).filter(|_| is_sensed);
    let seen = Seen {
        time: scene.time(),
        running_minimum: scene.running_minimum(),
        last_range: scene.ranges[0] / scene.max_range,
        length: scene.length(),
        speed: scene.speed(),
        flock,
        distance,
        predator: predator.map(|(predator, distance)| Nearest {
            distance,
            away: heading(&(centroid - predator.position)),
            velocity: predator.velocity,
        }),
    };
    table(&mut Row::new(&seen, out));
}
