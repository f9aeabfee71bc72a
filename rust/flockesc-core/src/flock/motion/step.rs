//! The kernel of a step: forces, motion and predator distances (steps 2 to 4 of docs/model.md).

use multiversion::multiversion;

use super::forces::{EscapeForce, Force, ParameterColumns, consensus_force};
use crate::agents::{GROUP, Group};
use crate::flock::metrics::distances;
use crate::flock::scenario::FlockConfig;
use crate::neighbor::NeighborSums;

/// Positions of the predators before and after a step, in m.
pub(crate) struct Predators<'a, const D: usize> {
    pub(crate) before: &'a [[f64; D]],
    pub(crate) after: &'a [[f64; D]],
}

/// Advances the agents with these `ids` by one step and updates their predator distances. `forces` are the
/// neighbor forces; `None` computes the consensus force from `sums`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(crate) fn advance<const D: usize>(
    config: &FlockConfig,
    predators: &Predators<'_, D>,
    ids: &[u32],
    groups: &mut [Group<D>],
    sums: &mut [NeighborSums<D>],
    forces: Option<&[Force<D>]>,
) {
    let escape = EscapeForce::of(config);
    let mut columns = ParameterColumns::of_first(config);
    let agents = groups.iter_mut().zip(sums).zip(ids.chunks(GROUP));
    for (index, ((group, sums), ids)) in agents.enumerate() {
        columns.load(config, ids);
        let mut force = match forces {
            None => consensus_force(&columns, sums),
            Some(forces) => forces[index],
        };
        match predators.before {
            // With one predator, the stored distance to the nearest predator can be used.
            [only] => escape.add(&columns, group, only, &group.distance, &mut force),
            many => {
                for predator in many {
                    let distance = &distances(&group.position, &[*predator]);
                    escape.add(&columns, group, predator, distance, &mut force);
                }
            }
        }
        config.motion.integrate(config, &columns, &force, group);
        group.distance = distances(&group.position, predators.after);
    }
}
