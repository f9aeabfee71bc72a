//! The mean change of distance over those near each agent, whom it may hear.

use super::Moment;
use crate::agents::GROUP;
use crate::base::exact::Scale;
use crate::neighbor::Ranges;

/// Adds to every agent in the flock the mean of d_j(t) - d_j(t-1) in m over those who are its neighbors at t under the
/// largest range, itself included.
pub(super) fn add_mean_changes<const D: usize>(moment: &Moment<'_, D>, rewards: &mut [f64]) {
    let agents = moment.world.agents();
    if agents.len() == 0 {
        return;
    }
    let now = moment.own_distances;
    let change = |&name: &u32| now[name as usize] - moment.own_distances_before[name as usize];
    let changes: Vec<f64> = agents.names().iter().map(change).collect();
    let largest = changes
        .iter()
        .fold(0.0, |most: f64, change| most.max(change.abs()));
    let scale = Scale::for_registers(largest, changes.len());
    let units: Vec<i64> = changes
        .iter()
        .map(|change| scale.quantize(*change))
        .collect();
    let (ranges, mut tiles) = (Ranges::Shared(moment.max_range), Vec::new());
    moment
        .world
        .neighborhood()
        .with_pairs(agents, ranges, |pairs| {
            for group in 0..agents.groups.len() {
                let (mut sums, mut counts) = ([0; GROUP], [0; GROUP]);
                pairs.visit(group, &mut tiles, |lane, place| {
                    sums[lane] += units[place];
                    counts[lane] += 1;
                });
                for (lane, &name) in agents.names_of(group).iter().enumerate() {
                    rewards[name as usize] += scale.mean(sums[lane], counts[lane]);
                }
            }
        });
}
