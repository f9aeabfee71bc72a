//! The consensus of a sorted line (Eq. 1) in one pass: prefix sums, and a window with two moving ends.

use super::groups::Group;
use crate::base::exact::Scale;

/// Number of groups compared at a time, without a branch, as the upper end of a window moves.
const STRIDE: usize = 4;

/// The means of a line, and buffers to compute them.
#[derive(Debug, Clone)]
pub(super) struct Consensus {
    means: Vec<f64>,
    /// States of one component, then `STRIDE` infinities, which no window reaches.
    states: Vec<f64>,
    /// Sums over the first k groups of one component, k = 0 to their number.
    prefixes: Vec<Prefix>,
    /// How many groups the window loses as it moves on to the k-th group of the component.
    leaving: Vec<u32>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Prefix {
    /// Of fixed-point states, agent by agent.
    state: i64,
    /// Of sizes.
    size: i64,
}

/// The connected components under `range`, from left to right.
pub(super) fn components(groups: &[Group], range: f64) -> impl Iterator<Item = &[Group]> {
    groups.chunk_by(move |a, b| b.state - a.state <= range)
}

impl Consensus {
    /// Buffers for `num_groups` groups.
    pub(super) fn with_capacity(num_groups: usize) -> Self {
        Self {
            means: Vec::with_capacity(num_groups),
            states: Vec::with_capacity(num_groups + STRIDE),
            prefixes: Vec::with_capacity(num_groups + 1),
            leaving: Vec::with_capacity(num_groups + 1),
        }
    }

    /// For every group the mean state of the agents within `range` of it, the boundary included.
    ///
    /// Groups with the same neighbors get the same bits, in any order of the agents.
    pub(super) fn means(&mut self, groups: &[Group], num_agents: usize, range: f64) -> &mut [f64] {
        self.means.clear();
        for component in components(groups, range) {
            let (first, last) = (component[0].state, component[component.len() - 1].state);
            if first == last {
                // No agent moves, not even by a rounding.
                self.means.extend(component.iter().map(|group| group.state));
            } else {
                let scale = Scale::new(first.abs().max(last.abs()), num_agents);
                self.sum_up(component, scale);
                self.extend_means(component, scale, range);
            }
        }
        &mut self.means
    }

    fn sum_up(&mut self, component: &[Group], scale: Scale) {
        self.states.clear();
        self.states
            .extend(component.iter().map(|group| group.state));
        self.states.extend([f64::INFINITY; STRIDE]);
        let mut sum = Prefix::default();
        self.prefixes.clear();
        self.prefixes.push(sum);
        self.prefixes.extend(component.iter().map(|group| {
            let size = i64::from(group.size);
            sum.state += size * scale.truncate(group.state);
            sum.size += size;
            sum
        }));
    }

    fn extend_means(&mut self, component: &[Group], scale: Scale, range: f64) {
        let (states, prefixes, leaving) = (&self.states, &self.prefixes, &mut self.leaving);
        leaving.clear();
        leaving.resize(component.len() + 1, 0);
        let first = component[0].state;
        let mut low = 0;
        let mut high = component.partition_point(|group| group.state - first <= range);
        self.means
            .extend(component.iter().enumerate().map(|(k, group)| {
                if high < component.len() {
                    high = window_end(states, high, group.state, range);
                }
                // Neighbors are mutual: the first group out of this group's window is the first whose window excludes this group.
                leaving[high] += 1;
                low += leaving[k] as usize;
                let (below, up_to) = (prefixes[low], prefixes[high]);
                scale.mean(up_to.state - below.state, up_to.size - below.size)
            }));
    }
}

/// The first of the rising `states` above `state` + `range`, at `from` or after it.
fn window_end(states: &[f64], from: usize, state: f64, range: f64) -> usize {
    let mut end = from;
    while let Some(next) = states[end..].first_chunk::<STRIDE>() {
        let inside = next.iter().filter(|&next| next - state <= range).count();
        end += inside;
        if inside < STRIDE {
            break;
        }
    }
    end
}
