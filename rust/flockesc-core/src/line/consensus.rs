//! The consensus of a sorted line (Eq. 1) in one pass: prefix sums, and a window with two moving ends.

use super::groups::Group;

/// Groups by which the upper end of a window moves at a time; comparing so many takes no branch.
const STRIDE: usize = 4;

/// The means of a line, with room for what it takes to find them.
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
    /// Room for `num_groups` groups.
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
    /// Groups with the same neighbors get the same bits, whatever the order of the agents.
    pub(super) fn means(&mut self, groups: &[Group], num_agents: usize, range: f64) -> &mut [f64] {
        self.means.clear();
        for component in components(groups, range) {
            let (first, last) = (component[0].state, component[component.len() - 1].state);
            if first == last {
                // Nobody moves, not even by a rounding.
                self.means.extend(component.iter().map(|group| group.state));
            } else {
                let scale = FixedPoint::new(num_agents, first.abs().max(last.abs()));
                self.sum_up(component, scale);
                self.extend_means(component, scale, range);
            }
        }
        &mut self.means
    }

    fn sum_up(&mut self, component: &[Group], scale: FixedPoint) {
        self.states.clear();
        self.states
            .extend(component.iter().map(|group| group.state));
        self.states.extend([f64::INFINITY; STRIDE]);
        let mut sum = Prefix::default();
        self.prefixes.clear();
        self.prefixes.push(sum);
        self.prefixes.extend(component.iter().map(|group| {
            let size = i64::from(group.size);
            sum.state += size * scale.to_fixed(group.state);
            sum.size += size;
            sum
        }));
    }

    fn extend_means(&mut self, component: &[Group], scale: FixedPoint, range: f64) {
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
                // Neighbors are mutual: the first that this group does not hear is the first not to hear it.
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
        let heard = next.iter().filter(|&next| next - state <= range).count();
        end += heard;
        if heard < STRIDE {
            break;
        }
    }
    end
}

/// States as integers times a power of two: their sums are exact, so that their order cannot matter.
#[derive(Debug, Clone, Copy)]
struct FixedPoint {
    to_fixed: f64,
    from_fixed: f64,
}

impl FixedPoint {
    /// As fine as an `i64` allows that holds the sum of `num_agents` states of at most `magnitude`.
    ///
    /// The unit for 100 agents is an eighth of the last place of `magnitude` as an `f64`. It grows with the
    /// number of agents, as does what rounding costs a sum of floats, and stays far below. It is 2^-1022 or more.
    fn new(num_agents: usize, magnitude: f64) -> Self {
        // num_agents < 2^(63 - spare_bits), magnitude < 2^exponent
        let spare_bits = i64::from((num_agents as u64).leading_zeros()) - 1;
        let exponent = (magnitude.to_bits() >> 52) as i64 - 1022;
        let shift = (spare_bits - exponent).min(1022); // a normal power of two, and so is its inverse
        let power_of_two = |exponent: i64| f64::from_bits(((1023 + exponent) as u64) << 52);
        Self {
            to_fixed: power_of_two(shift),
            from_fixed: power_of_two(-shift),
        }
    }

    fn to_fixed(self, state: f64) -> i64 {
        (state * self.to_fixed) as i64
    }

    /// The quotient first: a sum may be beyond every `f64`.
    fn mean(self, sum: i64, count: i64) -> f64 {
        sum as f64 / count as f64 * self.from_fixed
    }
}
