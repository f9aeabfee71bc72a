//! Consensus of a sorted line (Eq. 1) in linear time, with prefix sums and a sliding window.

use super::groups::Group;
use crate::base::exact::Scale;

/// The neighbors' means of a line, and a buffer to compute them.
#[derive(Debug, Clone)]
pub(super) struct Consensus {
    means: Vec<f64>,
    /// Sums over the first k groups of one component, from k = 0 to all.
    prefixes: Vec<Prefix>,
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
    /// Creates buffers for `num_groups` groups.
    pub(super) fn with_capacity(num_groups: usize) -> Self {
        Self {
            means: Vec::with_capacity(num_groups),
            prefixes: Vec::with_capacity(num_groups + 1),
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
                self.extend(component, scale, range);
            }
        }
        &mut self.means
    }

    /// Adds the means of a component.
    fn extend(&mut self, component: &[Group], scale: Scale, range: f64) {
        let mut sum = Prefix::default();
        self.prefixes.clear();
        self.prefixes.push(sum);
        for group in component {
            let size = i64::from(group.size);
            sum.state += size * scale.truncate(group.state);
            sum.size += size;
            self.prefixes.push(sum);
        }
        // The neighbors of a group are those from `low` to `high`.
        let (mut low, mut high) = (0, 0);
        for group in component {
            while group.state - component[low].state > range {
                low += 1;
            }
            while high < component.len() && component[high].state - group.state <= range {
                high += 1;
            }
            let (below, up_to) = (self.prefixes[low], self.prefixes[high]);
            let mean = scale.mean(up_to.state - below.state, up_to.size - below.size);
            self.means.push(mean);
        }
    }
}
