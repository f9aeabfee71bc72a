//! Steps 2 to 4 of docs/model.md for some groups, and the distances to predators after them.

use multiversion::multiversion;

use super::Motion;
use super::forces::{Force, add_escape_force, consensus_force};
use super::parameters::Parameters;
use super::traits::Traits;
use crate::agents::{GROUP, Group};
use crate::flock::metrics::distances;
use crate::neighbor::NeighborSums;

/// Positions of the predators before and after a step, in m.
pub(in crate::flock) struct Predators<'a, const D: usize> {
    pub(in crate::flock) before: &'a [[f64; D]],
    pub(in crate::flock) after: &'a [[f64; D]],
}

/// Advances the agents with these `ids` by one step and measures their distances to the predators. `forces` are the
/// neighbors' forces; `None`: the consensus force follows from `sums`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(in crate::flock) fn advance<const D: usize>(
    motion: &Motion,
    parameters: &Parameters<'_>,
    predators: &Predators<'_, D>,
    ids: &[u32],
    groups: &mut [Group<D>],
    sums: &mut [NeighborSums<D>],
    forces: Option<&[Force<D>]>,
) {
    let range = parameters.predator_range;
    let mut traits = Traits::of_first(parameters);
    let agents = groups.iter_mut().zip(sums).zip(ids.chunks(GROUP));
    for (index, ((group, sums), ids)) in agents.enumerate() {
        traits.load(parameters, ids);
        let mut force = match forces {
            None => consensus_force(&traits, sums),
            Some(forces) => forces[index],
        };
        match predators.before {
            // The nearest predator is the only one.
            [only] => add_escape_force(range, &traits, group, only, &group.distance, &mut force),
            many => {
                for predator in many {
                    let distance = distances(&group.position, &[*predator]);
                    add_escape_force(range, &traits, group, predator, &distance, &mut force);
                }
            }
        }
        motion.integrate(parameters, &traits, &force, group);
        group.distance = distances(&group.position, predators.after);
    }
}
