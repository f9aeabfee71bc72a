//! The kernel of a step: forces, motion and predator distances (steps 2 to 4 of docs/model.md).

use multiversion::multiversion;

use super::Motion;
use super::columns::ParameterColumns;
use super::forces::{Force, add_escape_force, consensus_force};
use super::parameters::Parameters;
use crate::agents::{GROUP, Group};
use crate::flock::metrics::distances;
use crate::neighbor::NeighborSums;

/// Positions of the predators before and after a step, in m.
pub(in crate::flock) struct Predators<'a, const D: usize> {
    pub(in crate::flock) before: &'a [[f64; D]],
    pub(in crate::flock) after: &'a [[f64; D]],
}

/// Advances the agents with these `ids` by one step and updates their predator distances. `forces` are the
/// neighbor forces; `None` computes the consensus force from `sums`.
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
    let mut columns = ParameterColumns::of_first(parameters);
    let agents = groups.iter_mut().zip(sums).zip(ids.chunks(GROUP));
    for (index, ((group, sums), ids)) in agents.enumerate() {
        columns.load(parameters, ids);
        let mut force = match forces {
            None => consensus_force(&columns, sums),
            Some(forces) => forces[index],
        };
        match predators.before {
            // With one predator, the stored distance to the nearest predator can be used.
            [only] => add_escape_force(range, &columns, group, only, &group.distance, &mut force),
            many => {
                for predator in many {
                    let distance = distances(&group.position, &[*predator]);
                    add_escape_force(range, &columns, group, predator, &distance, &mut force);
                }
            }
        }
        motion.integrate(parameters, &columns, &force, group);
        group.distance = distances(&group.position, predators.after);
    }
}
