//! The consensus of a sorted line (Eq. 1) in one pass: prefix sums, and windows with two moving ends.

use super::groups::Group;

/// Groups by which the end of a window is moved at a time.
const STRIDE: usize = 4;

/// The means of a line, with room for what it takes to find them.
#[derive(Debug, Clone, Default)]
pub(super) struct Consensus {
    means: Vec<f64>,
    states: Vec<f64>,
    prefixes: Vec<Prefix>,
}

/// Sums over the groups before one.
#[derive(Debug, Clone, Copy, Default)]
struct Prefix {
    /// Of quantised states, agent by agent.
    sum: i64,
    /// Of sizes.
    size: i64,
}

/// The connected components under `range`, from left to right.
pub(super) fn components(groups: &[Group], range: f64) -> impl Iterator<Item = &[Group]> {
    groups.chunk_by(move |a, b| b.state - a.state <= range)
}

impl Consensus {
    /// For every group the mean state of the agents within `range`.
    pub(super) fn means(&mut self, groups: &[Group], num_agents: usize, range: f64) -> &mut [f64] {
        self.means.clear();
        for component in components(groups, range) {
            match component {
                [alone] => self.means.push(alone.state),
                _ => self.extend(component, num_agents, range),
            }
        }
        &mut self.means
    }

    fn extend(&mut self, component: &[Group], num_agents: usize, range: f64) {
        let (to_fixed, from_fixed) = scales(component, num_agents);
        self.states.clear();
        self.states
            .extend(component.iter().map(|group| group.state));
        self.states.extend([f64::INFINITY; STRIDE]);
        let mut prefix = Prefix::default();
        self.prefixes.clear();
        self.prefixes.push(prefix);
        self.prefixes.extend(component.iter().map(|group| {
            let size = i64::from(group.size);
            prefix.sum += size * (group.state * to_fixed) as i64;
            prefix.size += size;
            prefix
        }));
        let (states, prefixes) = (&self.states[..], &self.prefixes[..=component.len()]);
        let first = component[0].state;
        let mut low = 0;
        let mut high = component.partition_point(|group| group.state - first <= range);
        self.means.extend(component.iter().map(|group| {
            if group.state - first > range {
                low = advanced(states, low, |state| group.state - state > range);
            }
            if high < component.len() {
                high = advanced(states, high, |state| state - group.state <= range);
            }
            let (before, after) = (prefixes[low], prefixes[high]);
            let mean = (after.sum - before.sum) as f64 / (after.size - before.size) as f64;
            mean * from_fixed
        }));
    }
}

fn advanced(states: &[f64], mut end: usize, passed: impl Fn(f64) -> bool) -> usize {
    while let Some(next) = states[end..].first_chunk::<STRIDE>() {
        let count: usize = next.iter().map(|&state| usize::from(passed(state))).sum();
        end += count;
        if count < STRIDE {
            break;
        }
    }
    end
}

fn scales(component: &[Group], num_agents: usize) -> (f64, f64) {
    let magnitude = component[0]
        .state
        .abs()
        .max(component[component.len() - 1].state.abs());
    let exponent = ((magnitude.to_bits() >> 52) as i64) - 1022; // magnitude < 2^exponent
    let bits = i64::from((num_agents as u64).leading_zeros()) - 1; // num_agents < 2^(63 - bits)
    let shift = (bits - exponent).min(1022);
    let power = |shift: i64| f64::from_bits(((1023 + shift) as u64) << 52);
    (power(shift), power(-shift))
}
