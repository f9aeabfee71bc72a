//! Consensus of a sorted line (Eq. 1) in linear time, with prefix sums and a sliding window.

use super::groups::Group;
use crate::base::exact::Scale;

/// Number of groups that the search for the upper end of a window compares at a time, without a branch.
const STRIDE: usize = 4;

/// The neighbors' means of a line, and buffers to compute them.
#[derive(Debug, Clone)]
pub(super) struct Consensus {
    means: Vec<f64>,
    /// States of one component, padded with `STRIDE` infinities.
    states: Vec<f64>,
    /// Sums over the first k groups of one component, from k = 0 to all.
    prefixes: Vec<Prefix>,
    /// Number of groups that leave the window when it moves to the k-th group of the component.
    leaving: Vec<u32>,
}

/// A prefix sum over groups.
#[derive(Debug, Clone, Copy, Default)]
struct Prefix {
    /// Sum of the agents' states in fixed point.
    state: i64,
    /// Number of agents.
    size: i64,
}

/// Returns the connected components under `range`, from left to right.
pub(super) fn components(groups: &[Group], range: f64) -> impl Iterator<Item = &[Group]> {
    groups.chunk_by(move |a, b| b.state - a.state <= range)
}

impl Consensus {
    /// Returns the memory in bytes of the buffers for this many groups.
    pub(super) fn bytes(num_groups: usize) -> usize {
        (num_groups + STRIDE) * (2 * size_of::<f64>() + size_of::<Prefix>() + size_of::<u32>())
    }

    /// Creates buffers for `num_groups` groups.
    pub(super) fn with_capacity(num_groups: usize) -> Self {
        Self {
            means: Vec::with_capacity(num_groups),
            states: Vec::with_capacity(num_groups + STRIDE),
            prefixes: Vec::with_capacity(num_groups + 1),
            leaving: Vec::with_capacity(num_groups + 1),
        }
    }

    /// Computes for every group the mean state of the agents within `range`, boundary included.
    ///
    /// Groups with the same neighbors get bitwise equal means, in any order of the agents.
    pub(super) fn means(&mut self, groups: &[Group], num_agents: usize, range: f64) -> &mut [f64] {
        self.means.clear();
        for component in components(groups, range) {
            let (first, last) = (component[0].state, component[component.len() - 1].state);
            if first == last {
                // All states are equal, so the mean is the state itself, without rounding.
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
                // Neighbors are mutual: the first group above this group's window is also the first group
                // whose window excludes this group.
                leaving[high] += 1;
                low += leaving[k] as usize;
                let (below, up_to) = (prefixes[low], prefixes[high]);
                scale.mean(up_to.state - below.state, up_to.size - below.size)
            }));
    }
}

/// Returns the index of the first of the ascending `states` above `state` + `range`, searching from index
/// `from`.
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
