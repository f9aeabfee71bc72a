//! Observation of the whole flock: one row of scalars that are invariant under rotations, translations and
//! permutations of the agents.

use nalgebra::SVector;

use super::row::squash;
use super::scene::Common;
use super::{Extras, Scene};
use crate::base::entry::{Entries, Numbers, Row};
use crate::base::error::Result;
use crate::base::vector::heading;
use crate::flock::{Approach, Headings, PredatorDistance, Preview, Straight, Summary};
use crate::neighbor::Profile;
use crate::parallel::Progress;

/// The values that a flock's row is computed from.
struct Features<'a, const D: usize> {
    common: Common,
    /// Mean range of the last action in m.
    mean_range: f64,
    flock: &'a Summary<D>,
    distance: PredatorDistance,
    /// The predator nearest to the centroid, if at least one agent senses a predator.
    predator: Option<Nearest<D>>,
    now: Response,
    /// The same after one step under every candidate range.
    candidates: Vec<Response>,
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

/// Averages over the agents of a flock. Values that no entry needs are 0.
#[derive(Debug, Clone, Copy, Default)]
struct Response {
    headings: Headings,
    heading_escape: f64,
    approach: Approach,
}

/// Adds all entries to `row`.
fn add<const D: usize>(row: &mut impl Row<f64>, extras: Extras<'_>, features: &Features<'_, D>) {
    let Features {
        flock,
        distance,
        now,
        ..
    } = features;
    let Common { length, speed, .. } = features.common;
    let sensed = |value| features.sensed(value);
    let sensed_distance = |distance| features.sensed_distance(distance);
    let last_range = features.mean_range / features.common.max_range;
    let velocity = SVector::from(flock.velocity);
    let (mut centroid_distance, mut velocity_away) = (0.0, 0.0);
    let (mut predator_speed, mut predator_aim) = (0.0, 0.0);
    if let Some(predator) = &features.predator {
        centroid_distance = squash(predator.distance, length);
        velocity_away = velocity.dot(&predator.away) / (velocity.norm() + speed);
        predator_speed = squash(predator.velocity.norm(), speed);
        predator_aim = heading(&predator.velocity).dot(&predator.away);
    }
    row.number("time", 0.0, features.common.time);
    row.number("running_minimum", 0.0, features.common.running_minimum);
    row.number("last_range", 0.0, last_range);
    row.number("speed", 0.0, squash(flock.speed, speed));
    row.number("polarization", 0.0, flock.polarization);
    row.number("spread", 0.0, squash(flock.dispersion, length));
    row.number("neighbor_count", 0.0, flock.neighbor_count);
    row.number("heard_alignment", 0.0, flock.heard_alignment);
    row.number("predator_sensed", 0.0, sensed(1.0));
    row.number("mean_distance", 0.0, sensed_distance(distance.mean));
    row.number("min_distance", 0.0, sensed_distance(distance.minimum));
    row.number("centroid_distance", 0.0, centroid_distance);
    row.number("fraction_in_range", 0.0, sensed(flock.fraction_in_range));
    row.number("heading_away", -1.0, sensed(flock.heading_away));
    let heading_away_in_range = sensed(flock.heading_away_in_range);
    row.number("heading_away_in_range", -1.0, heading_away_in_range);
    row.number("velocity_away", -1.0, velocity_away);
    row.number("predator_speed", 0.0, predator_speed);
    row.number("predator_aim", -1.0, predator_aim);
    features.add_response(row, extras, now);
    if extras.has_approach() {
        let time = squash(now.approach.time, length / speed);
        row.number("closest_approach_time", 0.0, sensed(time));
    }
    for (k, after) in features.candidates.iter().enumerate() {
        row.begin_candidate(k);
        row.number("polarization", 0.0, after.headings.polarization);
        row.number("neighbor_count", 0.0, after.headings.neighbor_count);
        row.number("heading_away", -1.0, sensed(after.headings.heading_away));
        features.add_response(row, extras, after);
    }
}

impl<const D: usize> Features<'_, D> {
    /// Returns `value`, or 0 if no agent senses a predator.
    fn sensed(&self, value: f64) -> f64 {
        self.predator.as_ref().map_or(0.0, |_| value)
    }

    /// Returns a distance to a predator, scaled to [0, 1), or 0 if no agent senses one.
    fn sensed_distance(&self, distance: f64) -> f64 {
        self.sensed(squash(distance, self.common.length))
    }

    /// Adds the optional entries of a response.
    fn add_response(&self, row: &mut impl Row<f64>, extras: Extras<'_>, response: &Response) {
        if extras.has_escape() {
            row.number("heading_escape", -1.0, self.sensed(response.heading_escape));
        }
        if extras.has_approach() {
            let mean = self.sensed_distance(response.approach.mean_distance);
            let minimum = self.sensed_distance(response.approach.min_distance);
            row.number("closest_mean_distance", 0.0, mean);
            row.number("closest_min_distance", 0.0, minimum);
        }
    }
}

/// Collects the entries of a row.
pub(super) fn name<const D: usize>(extras: Extras<'_>, entries: &mut Entries) {
    let features = Features::<D> {
        common: Common::default(),
        mean_range: 0.0,
        flock: &Summary::EMPTY,
        distance: PredatorDistance {
            mean: 0.0,
            minimum: 0.0,
        },
        predator: None,
        now: Response::default(),
        candidates: vec![Response::default(); extras.ranges.len()],
    };
    add(entries, extras, &features);
}

/// Writes one row.
pub(super) fn write<const D: usize>(
    scene: &Scene<'_, D>,
    out: &mut [f32],
    progress: &Progress,
) -> Result<()> {
    let (world, flock, common) = (scene.world, scene.summary(), scene.common());
    let distance = world.predator_distance();
    let centroid = SVector::from(flock.centroid);
    let predators = world.predators().iter();
    let nearest = predators
        .map(|predator| (predator, (predator.position - centroid).norm()))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(predator, distance)| Nearest {
            distance,
            away: heading(&(centroid - predator.position)),
            velocity: predator.velocity,
        });
    let is_sensed = world.fraction_surviving() > 0.0 && distance.minimum <= common.sensing_length;
    let (now, candidates) = responses(scene, progress)?;
    let features = Features {
        mean_range: scene.ranges.iter().sum::<f64>() / scene.ranges.len() as f64,
        flock,
        distance,
        predator: nearest.filter(|_| is_sensed),
        now,
        candidates,
        common,
    };
    add(&mut Numbers(out.iter_mut()), scene.extras, &features);
    Ok(())
}

/// Returns the averages now, and after one step under every candidate range.
fn responses<const D: usize>(
    scene: &Scene<'_, D>,
    progress: &Progress,
) -> Result<(Response, Vec<Response>)> {
    let (world, ranges) = (scene.world, scene.extras.ranges);
    if scene.extras.is_empty() || world.agents().len() == 0 {
        return Ok((Response::default(), vec![Response::default(); ranges.len()]));
    }
    let mut predators: Vec<Straight<D>> = world.predators().iter().map(Straight::from).collect();
    let mut preview = Preview::new(world, world.neighborhood().sums().to_vec());
    let now = response(&mut preview, Headings::default(), scene, &predators);
    for predator in &mut predators {
        predator.position = predator.after(world.config().time_step);
    }
    let num_groups = world.agents().groups.len();
    let mut profile = Profile::new(world.neighborhood(), world.agents(), ranges, progress)?;
    let mut candidates = vec![Vec::with_capacity(num_groups); ranges.len()];
    for group in 0..num_groups {
        progress.check()?;
        for (candidate, sums) in candidates.iter_mut().zip(profile.of_group(group)) {
            candidate.push(sums.clone());
        }
    }
    let response_after_step = |sums| {
        progress.check()?;
        preview.restart(world, sums);
        let headings = preview.advance(world, &predators);
        Ok(response(&mut preview, headings, scene, &predators))
    };
    let candidates: Result<_> = candidates.into_iter().map(response_after_step).collect();
    Ok((now, candidates?))
}

/// Adds the averages that the optional entries need to `headings`.
fn response<const D: usize>(
    preview: &mut Preview<D>,
    headings: Headings,
    scene: &Scene<'_, D>,
    predators: &[Straight<D>],
) -> Response {
    let mut response = Response {
        headings,
        ..Response::default()
    };
    if scene.extras.entries.is_empty() {
        return response;
    }
    let num_agents = scene.world.agents().len();
    let drift = preview.drift(num_agents);
    if scene.extras.has_escape() {
        response.heading_escape = preview.heading_escape(num_agents, &drift, predators);
    }
    if scene.extras.has_approach() {
        response.approach = preview.approach(num_agents, &drift, predators);
    }
    response
}
