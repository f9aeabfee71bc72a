//! Optional entries of the flock's observation.

use super::{ExtraEntries, Extras};
use crate::base::error::Result;
use crate::flock::{Approach, Headings, Preview, Straight};
use crate::neighbor::{NeighborSums, Profile};
use crate::observation::Scene;
use crate::observation::table::{Row, Table, squash};
use crate::parallel::Progress;

/// The values that the entries are computed from.
pub(in crate::observation) struct Features {
    now: Response,
    /// The same after one step under every candidate range.
    candidates: Vec<Response>,
    is_sensed: bool,
    /// Scale of lengths in m.
    length: f64,
    /// Scale of times in s.
    time: f64,
}

/// Averages over the agents of a flock. Values that no entry needs are 0.
#[derive(Debug, Clone, Copy, Default)]
struct Response {
    headings: Headings,
    heading_escape: f64,
    approach: Approach,
}

/// Adds the entries of a row to `table`.
#[inline(always)]
pub(in crate::observation) fn table(extras: Extras<'_>, table: &mut impl Table<Features>) {
    let has_escape = extras.has(ExtraEntries::EscapeDirection);
    let has_approach = extras.has(ExtraEntries::ClosestApproach);
    if has_escape {
        table.number("heading_escape", -1.0, |features| {
            features.if_sensed(features.now.heading_escape)
        });
    }
    if has_approach {
        table.number("closest_mean_distance", 0.0, |features| {
            features.distance(features.now.approach.mean_distance)
        });
        table.number("closest_min_distance", 0.0, |features| {
            features.distance(features.now.approach.min_distance)
        });
        table.number("closest_approach_time", 0.0, |features| {
            features.if_sensed(squash(features.now.approach.time, features.time))
        });
    }
    for k in 0..extras.ranges.len() {
        table.begin_candidate(k);
        let after = move |features: &Features| features.candidates[k];
        table.number("polarization", 0.0, move |features| {
            after(features).headings.polarization
        });
        table.number("neighbor_count", 0.0, move |features| {
            after(features).headings.neighbor_count
        });
        table.number("heading_away", -1.0, move |features| {
            features.if_sensed(after(features).headings.heading_away)
        });
        if has_escape {
            table.number("heading_escape", -1.0, move |features| {
                features.if_sensed(after(features).heading_escape)
            });
        }
        if has_approach {
            table.number("closest_mean_distance", 0.0, move |features| {
                features.distance(after(features).approach.mean_distance)
            });
            table.number("closest_min_distance", 0.0, move |features| {
                features.distance(after(features).approach.min_distance)
            });
        }
    }
}

impl Features {
    /// Returns `value`, or 0 if no agent senses a predator.
    fn if_sensed(&self, value: f64) -> f64 {
        if self.is_sensed { value } else { 0.0 }
    }

    /// Returns a distance to a predator, scaled to [0, 1), or 0 if no agent senses one.
    fn distance(&self, distance: f64) -> f64 {
        self.if_sensed(squash(distance, self.length))
    }
}

/// Writes one row.
pub(in crate::observation) fn write<const D: usize>(
    scene: &Scene<'_, D>,
    out: &mut [f32],
    progress: &Progress,
) -> Result<()> {
    let (world, num_agents) = (scene.world, scene.world.agents().len());
    if scene.extras.is_empty() || num_agents == 0 {
        out.fill(0.0);
        return Ok(());
    }
    let predators: Vec<Straight<D>> = world.predators().iter().map(Straight::from).collect();
    let mut preview = Preview::new(world, world.neighborhood().sums().to_vec());
    let features = Features {
        now: response(&mut preview, Headings::default(), scene, &predators),
        candidates: candidates(&mut preview, scene, predators, progress)?,
        is_sensed: scene.is_sensed(world.predator_distance().minimum),
        length: scene.length(),
        time: scene.length() / scene.speed(),
    };
    table(scene.extras, &mut Row::new(&features, out));
    Ok(())
}

/// Returns the averages after one step under every candidate range.
fn candidates<const D: usize>(
    preview: &mut Preview<D>,
    scene: &Scene<'_, D>,
    mut predators: Vec<Straight<D>>,
    progress: &Progress,
) -> Result<Vec<Response>> {
    let (world, ranges) = (scene.world, scene.extras.ranges);
    for predator in &mut predators {
        predator.position = predator.after(scene.scenario().time_step);
    }
    let num_groups = world.agents().groups.len();
    let mut profile = Profile::new(world.neighborhood(), world.agents(), ranges, progress)?;
    let mut candidates: Vec<Vec<NeighborSums<D>>> = ranges
        .iter()
        .map(|_| Vec::with_capacity(num_groups))
        .collect();
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
        Ok(response(preview, headings, scene, &predators))
    };
    candidates.into_iter().map(response_after_step).collect()
}

/// Adds the averages that the extra entries need to `headings`.
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
    if scene.extras.has(ExtraEntries::EscapeDirection) {
        response.heading_escape = preview.heading_escape(num_agents, &drift, predators);
    }
    if scene.extras.has(ExtraEntries::ClosestApproach) {
        response.approach = preview.approach(num_agents, &drift, predators);
    }
    response
}
