//! One row per flock: scalars that no turn, shift or renaming of the agents changes.

use nalgebra::SVector;

use super::agent::nearest;
use super::{HALF_COUNT, Writer, squash};
use crate::episode::Episode;
use crate::metrics::{mean, minimum};
use crate::vector::{heading, unit};

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
    let world = episode.world();
    let scenario = world.config();
    let options = episode.config();
    let (heard, scale) = world.heard();
    let positions = world.positions();
    let velocities = world.velocities();
    let mut distances = Vec::new();
    world.write_distances(&mut distances);
    let n = scenario.num_agents as f64;
    let length = scenario.initial_side;

    let centroid = positions.iter().sum::<SVector<f64, D>>() / n;
    let squared_spread: f64 = positions.iter()
        .map(|r| (r - centroid).norm_squared())
        .sum();
    let speeds: f64 = velocities.iter().map(|v| v.norm()).sum();
    let mut neighbors = 0.0;
    let mut alignment = 0.0;
    for place in 0..scenario.num_agents {
        let (heard, lane) = (&heard[place / 64], place % 64);
        let count = heard.count[lane] as f64;
        neighbors += squash(count - 1.0, HALF_COUNT);
        let v: SVector<f64, D> = SVector::from_fn(|axis, _| scale.value(heard.sum[axis][lane]) / count);
        alignment += squash(v.norm(), scenario.speed);
    }

    let mut writer = Writer::new(out);
    writer.push(episode.step_count() as f64 / scenario.num_steps as f64);
    writer.push(squash(episode.objective().minimum, length));
    writer.push(episode.ranges()[0] / options.max_range);
    writer.push(squash(speeds / n, scenario.speed));
    writer.push(world.polarization());
    writer.push(squash((squared_spread / n).sqrt(), length));
    writer.push(neighbors / n);
    writer.push(alignment / n);

    let is_sensed = options
        .predator_sensing_range
        .is_none_or(|range| minimum(&distances) <= range);
    let Some((predator, centroid_distance)) =
        nearest(&centroid, world.predators()).filter(|_| is_sensed)
    else {
        writer.extend(&[0.0; 10]);
        return;
    };
    let away = heading(&(centroid - predator.position));
    let mean_velocity = velocities.iter().sum::<SVector<f64, D>>() / n;
    let cosines: Vec<f64> = positions.iter()
        .zip(&velocities)
        .map(|(position, velocity)| {
            nearest(position, world.predators())
                .and_then(|(predator, _)| unit(&(position - predator.position)))
                .map_or(0.0, |away| away.dot(&heading(velocity)))
        })
        .collect();
    let in_range: Vec<f64> = cosines
        .iter()
        .zip(&distances)
        .filter(|(_, distance)| **distance <= scenario.predator_range)
        .map(|(cosine, _)| *cosine)
        .collect();

    writer.push(1.0);
    writer.push(squash(mean(&distances), length));
    writer.push(squash(minimum(&distances), length));
    writer.push(squash(centroid_distance, length));
    writer.push(in_range.len() as f64 / n);
    writer.push(mean(&cosines));
    writer.push(if in_range.is_empty() {
        0.0
    } else {
        mean(&in_range)
    });
    writer.push(mean_velocity.dot(&away) / (mean_velocity.norm() + scenario.speed));
    writer.push(squash(predator.velocity.norm(), scenario.speed));
    writer.push(heading(&predator.velocity).dot(&away));
}
