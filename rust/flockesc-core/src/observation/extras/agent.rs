//! Optional entries of the agents' observations.

use multiversion::multiversion;
use nalgebra::SVector;

use super::features::{Common, Features, compute};
use super::{ExtraEntries, Extras};
use crate::agents::{Column, Group};
use crate::base::error::Result;
use crate::flock::{Drift, Straight};
use crate::neighbor::{NeighborSums, Profile};
use crate::observation::Scene;
use crate::observation::columns::{ColumnTable, GroupRows, Rows};
use crate::parallel::Progress;

/// Adds the entries of a row to `table`.
#[inline(always)]
pub(in crate::observation) fn table<const D: usize>(
    extras: Extras<'_>,
    table: &mut impl ColumnTable<Features<D>>,
) {
    let has_escape = extras.has(ExtraEntries::EscapeDirection);
    let has_approach = extras.has(ExtraEntries::ClosestApproach);
    if has_escape {
        table.vectors("escape_direction", |features| &features.escape);
        table.numbers("heard_escape_gain", -1.0, |features| {
            &features.heard_escape_gain
        });
    }
    if has_approach {
        table.numbers("closest_approach", 0.0, |features| &features.distance);
        table.numbers("closest_approach_time", 0.0, |features| &features.time);
        table.numbers("heard_closest_approach", 0.0, |features| {
            &features.heard_distance
        });
    }
    for k in 0..extras.ranges.len() {
        table.begin_candidate(k);
        table.vectors("velocity", |features| &features.candidates[k].velocity);
        table.numbers("neighbor_count", 0.0, |features| {
            &features.candidates[k].neighbor_count
        });
        if has_escape {
            table.numbers("escape_cosine", -1.0, |features| {
                &features.candidates[k].escape_cosine
            });
        }
        if has_approach {
            table.numbers("closest_approach", 0.0, |features| {
                &features.candidates[k].distance
            });
        }
    }
}

/// Writes the optional entries of one flock, group by group.
pub(in crate::observation) struct Writer<'a, const D: usize> {
    extras: Extras<'a>,
    profile: Profile<'a, D>,
    common: Common<D>,
    features: Features<D>,
}

impl<'a, const D: usize> Writer<'a, D> {
    /// Creates the writer of a scene; `None` without optional entries.
    pub(in crate::observation) fn new(
        scene: &Scene<'a, D>,
        progress: &Progress,
    ) -> Result<Option<Self>> {
        let (extras, world) = (scene.extras, scene.world);
        let num_agents = world.agents().len();
        if extras.is_empty() || num_agents == 0 {
            return Ok(None);
        }
        let predators: Vec<Straight<D>> = world.predators().iter().map(Straight::from).collect();
        let places = if extras.has(ExtraEntries::EscapeDirection) {
            let drift = Drift::of(&world.agents().groups, num_agents);
            let place = |predator: &Straight<D>| predator.after(drift.time_of_approach(predator));
            predators.iter().map(place).collect()
        } else {
            Vec::new()
        };
        let (agents, ranges) = (world.agents(), extras.ranges);
        let profile = Profile::new(world.neighborhood(), agents, ranges, progress)?;
        Ok(Some(Self {
            common: Common {
                places,
                predators,
                sensing_length: scene.sensing_length(),
                length: scene.length(),
                speed: scene.speed(),
                units: [world.neighborhood().scale(), profile.scale()],
            },
            extras,
            profile,
            features: Features::new(ranges.len()),
        }))
    }

    /// Computes the sums over the neighbors of a group's agents under every candidate range.
    pub(in crate::observation) fn listen(&mut self, group: usize) {
        self.profile.of_group(group);
    }

    /// Adds the sums of the velocities of an agent's neighbors under every candidate range to `cues`.
    pub(in crate::observation) fn add_cues(&self, lane: usize, cues: &mut Vec<SVector<f64, D>>) {
        let sum = |sums: &NeighborSums<D>| SVector::from_fn(|axis, _| sums.sum[axis][lane] as f64);
        cues.extend(self.profile.sums().iter().map(sum));
    }

    /// Adds the entries of the group of the last call of [`Self::listen`] to `rows`. `axes` are the axes of the
    /// agents' body frames, and `heard` the sums over their neighbors in the last step.
    pub(in crate::observation) fn add_entries(
        &mut self,
        group: &Group<D>,
        axes: &[[Column<f64>; D]; D],
        heard: &NeighborSums<D>,
        rows: &mut GroupRows,
    ) {
        compute(
            self.extras,
            group,
            axes,
            heard,
            self.profile.sums(),
            &self.common,
            &mut self.features,
        );
        add_entries(self.extras, &self.features, rows);
    }
}

/// Adds all entries to `rows`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_entries<const D: usize>(extras: Extras<'_>, features: &Features<D>, rows: &mut GroupRows) {
    table(extras, &mut Rows { features, rows });
}
