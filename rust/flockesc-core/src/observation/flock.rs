//! Observation of the whole flock: one row of scalars that are invariant under rotations,
//! translations and permutations of the agents.

use nalgebra::SVector;

use super::agent::nearest;
use super::table::{Row, Table, squash};
use super::{Scene, extras};
use crate::base::error::Result;
use crate::base::vector::heading;
use crate::flock::{PredatorDistance, Summary};
use crate::parallel::Progress;

/// The values that a flock's observation is computed from.
pub(super) struct Features<'a, const D: usize> {
    time: f64,
    running_minimum: f64,
    last_range: f64,
    /// Scale of lengths in m.
    length: f64,
    /// Scale of speeds in m/s.
    speed: f64,
    flock: &'a Summary<D>,
    distance: PredatorDistance,
    /// The predator nearest to the centroid, if at least one agent senses a predator.
    predator: Option<Nearest<D>>,
}

/// A predator relative to the centroid.
struct Nearest<const D: usize> {
    /// Distance from the predator to the centroid in m.
    distance: f64,
    /// Unit vector from the predator to the centroid.
    away: SVector<f64, D>,
    /// v_p in m/s.
    velocity: SVector<f64, D>,
}

/// Adds the entries of a row to `table`.
#[inline(always)]
pub(super) fn table<'a, const D: usize>(table: &mut impl Table<Features<'a, D>>) {
    table.number("time", 0.0, |features| features.time);
    table.number("running_minimum", 0.0, |features| features.running_minimum);
    table.number("last_range", 0.0, |features| features.last_range);
    table.number("speed", 0.0, |features| {
        squash(features.flock.speed, features.speed)
    });
    table.number("polarization", 0.0, |features| features.flock.polarization);
    table.number("spread", 0.0, |features| {
        squash(features.flock.dispersion, features.length)
    });
    table.number("neighbor_count", 0.0, |features| {
        features.flock.neighbor_count
    });
    table.number("heard_alignment", 0.0, |features| {
        features.flock.heard_alignment
    });
    table.number("predator_sensed", 0.0, |features| {
        features.if_sensed(|_| 1.0)
    });
    table.number("mean_distance", 0.0, |features| {
        features.if_sensed(|_| squash(features.distance.mean, features.length))
    });
    table.number("min_distance", 0.0, |features| {
        features.if_sensed(|_| squash(features.distance.minimum, features.length))
    });
    table.number("centroid_distance", 0.0, |features| {
        features.if_sensed(|predator| squash(predator.distance, features.length))
    });
    table.number("fraction_in_range", 0.0, |features| {
        features.if_sensed(|_| features.flock.fraction_in_range)
    });
    table.number("heading_away", -1.0, |features| {
        features.if_sensed(|_| features.flock.heading_away)
    });
    table.number("heading_away_in_range", -1.0, |features| {
        features.if_sensed(|_| features.flock.heading_away_in_range)
    });
    table.number("velocity_away", -1.0, |features| {
        features.if_sensed(|predator| {
            let velocity = SVector::from(features.flock.velocity);
            velocity.dot(&predator.away) / (velocity.norm() + features.speed)
        })
    });
    table.number("predator_speed", 0.0, |features| {
        features.if_sensed(|predator| squash(predator.velocity.norm(), features.speed))
    });
    table.number("predator_aim", -1.0, |features| {
        features.if_sensed(|predator| heading(&predator.velocity).dot(&predator.away))
    });
}

impl<const D: usize> Features<'_, D> {
    /// Returns `value` of the sensed predator, or 0 if no agent senses one.
    fn if_sensed(&self, value: impl Fn(&Nearest<D>) -> f64) -> f64 {
        self.predator.as_ref().map_or(0.0, value)
    }
}

/// Writes one row.
pub(super) fn write<const D: usize>(
    scene: &Scene<'_, D>,
    out: &mut [f32],
    progress: &Progress,
) -> Result<()> {
    let (world, flock) = (scene.world, scene.summary());
    let distance = world.predator_distance();
    let centroid = SVector::from(flock.centroid);
    let is_sensed = world.fraction_surviving() > 0.0 && scene.is_sensed(distance.minimum);
    let predator = nearest(&centroid, world.predators()).filter(|_| is_sensed);
    let features = Features {
        time: scene.time(),
        running_minimum: scene.running_minimum(),
        last_range: scene.mean_range() / scene.max_range,
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
    let mut row = Row::new(&features, out);
    table(&mut row);
    extras::flock::write(scene, row.rest(), progress)
}
