//! The mean change of distance over those near each agent, whom its range may reach.

use super::Moment;
use crate::exact::Scale;
use crate::neighbor::Ranges;

/// Adds to every agent in the flock the mean of d_j(t) - d_j(t-1) in m over those who are its neighbors at t under the
/// largest range, itself included.
pub(super) fn add_mean_changes<const D: usize>(moment: &Moment<'_, D>, rewards: &mut [f64]) {
    let names = moment.world.agents().names();
    let change = |name: &u32| {
        let name = *name as usize;
        moment.own_distances[name] - moment.own_distances_before[name]
    };
    let largest = names
        .iter()
        .fold(0.0, |most: f64, name| most.max(change(name).abs()));
    // Exact, so that a sum depends on nobody's place in memory.
    let scale = Scale::for_registers(largest, names.len());
    let mut units = vec![0; rewards.len()];
    for name in names {
        units[*name as usize] = scale.quantize(change(name));
    }
    let (mut sums, mut counts) = (vec![0; rewards.len()], vec![0; rewards.len()]);
    let visit = |agent: usize, neighbor: usize| {
        sums[agent] += units[neighbor];
        counts[agent] += 1;
    };
    let ranges = Ranges::Shared(moment.max_range);
    moment.world.visit_neighbors(ranges, visit);
    for &name in names {
        let name = name as usize;
        rewards[name] += scale.mean(sums[name], counts[name]);
    }
}
