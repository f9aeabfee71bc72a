//! Rewards equal to the change of predator distance in a step, of each agent or averaged over its
//! neighborhood.

use super::term::{StepContext, add_changes};
use crate::agents::GROUP;
use crate::base::exact::Scale;
use crate::neighbor::Ranges;

/// Adds d_i(t) - d_i(t-1).
pub(super) fn individual<const D: usize>(step: &StepContext<'_, D>, rewards: &mut [f64]) {
    add_changes(step.distances, step.distances_before, rewards);
}

/// Adds the mean of d_j(t) - d_j(t-1) in m over the neighborhood of every agent that was not caught. The
/// neighborhood is the one at t under the largest range, the agent itself included.
pub(super) fn neighborhood<const D: usize>(step: &StepContext<'_, D>, rewards: &mut [f64]) {
    let agents = step.world.agents();
    if agents.len() == 0 {
        return;
    }
    let now = step.distances;
    let change = |&id: &u32| now[id as usize] - step.distances_before[id as usize];
    let changes: Vec<f64> = agents.ids().iter().map(change).collect();
    let largest = changes
        .iter()
        .fold(0.0, |most: f64, change| most.max(change.abs()));
    let scale = Scale::for_registers(largest, changes.len());
    let units: Vec<i64> = changes
        .iter()
        .map(|change| scale.quantize(*change))
        .collect();
    let (ranges, mut tiles) = (Ranges::Shared(step.max_range), Vec::new());
    step.world
        .neighborhood()
        .with_pairs(agents, ranges, |pairs| {
            for group in 0..agents.groups.len() {
                let (mut sums, mut counts) = ([0; GROUP], [0; GROUP]);
                pairs.visit(group, &mut tiles, |lane, place| {
                    sums[lane] += units[place];
                    counts[lane] += 1;
                });
                for (lane, &id) in agents.ids_of(group).iter().enumerate() {
                    rewards[id as usize] += scale.mean(sums[lane], counts[lane]);
                }
            }
        });
}
