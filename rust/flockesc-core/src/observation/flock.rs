//! One row per flock: scalars that no turn, shift or renaming of the agents changes.

use nalgebra::SVector;

use super::agent::nearest;
use super::{Writer, running_minimum, squash};
use crate::base::vector::heading;
use crate::episode::Episode;

/// Names and lower bounds; every upper bound is 1.
pub(super) const ENTRIES: [(&str, f32); 18] = [
    ("time", 0.0),
    ("running_minimum", 0.0),
    ("last_range", 0.0),
    ("speed", 0.0),
    ("polarization", 0.0),
    ("spread", 0.0),
    ("neighbor_count", 0.0),
    ("heard_alignment", 0.0),
    ("predator_sensed", 0.0),
    ("mean_distance", 0.0),
    ("min_distance", 0.0),
    ("centroid_distance", 0.0),
    ("fraction_in_range", 0.0),
    ("heading_away", -1.0),
    ("heading_away_in_range", -1.0),
    ("velocity_away", -1.0),
    ("predator_speed", 0.0),
    ("predator_aim", -1.0),
];

/// Writes one row.
pub(crate) fn write<const D: usize>(episode: &Episode<D>, out: &mut [f32]) {
    let scenario = episode.world().config();
    let options = episode.config();
    let flock = episode.summary();
    let length = scenario.initial_side;
    let speed = scenario.speed.largest();

    let mut writer = Writer::new(out);
    writer.push(episode.step_count() as f64 / scenario.num_steps as f64);
    writer.push(running_minimum(episode));
    writer.push(episode.ranges()[0] / options.max_range);
    writer.push(squash(flock.speed, speed));
    writer.push(flock.polarization);
    writer.push(squash(flock.spread, length));
    writer.push(flock.neighbor_count);
    writer.push(flock.heard_alignment);

    let centroid = SVector::from(flock.centroid);
    let (mean, minimum) = (episode.mean_distance().now, episode.min_distance().now);
    let is_sensed = episode.fraction_surviving().now > 0.0 && options.is_sensed(minimum, scenario);
    let Some((predator, centroid_distance)) =
        nearest(&centroid, episode.world().predators()).filter(|_| is_sensed)
    else {
        writer.extend(&[0.0; 10]);
        return;
    };
    let away = heading(&(centroid - predator.position));
    let velocity = SVector::from(flock.velocity);
    writer.push(1.0);
    writer.push(squash(mean, length));
    writer.push(squash(minimum, length));
    writer.push(squash(centroid_distance, length));
    writer.push(flock.fraction_in_range);
    writer.push(flock.heading_away);
    writer.push(flock.heading_away_in_range);
    writer.push(velocity.dot(&away) / (velocity.norm() + speed));
    writer.push(squash(predator.velocity.norm(), speed));
    writer.push(heading(&predator.velocity).dot(&away));
}
