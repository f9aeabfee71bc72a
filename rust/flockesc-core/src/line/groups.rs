//! A line as its distinct states in rising order, each with the agents that share it.
//!
//! Agents with equal states have equal neighbors and feel the same force: they stay together for ever. A line
//! falls into few groups within some steps, and a step costs as much as there are groups, not agents.

use std::hint::select_unpredictable;

/// Agents that share one state.
#[derive(Debug, Clone, Copy)]
pub(super) struct Group {
    /// Their state.
    pub(super) state: f64,
    /// How many they are.
    pub(super) size: u32,
    /// The first of them in the caller's order.
    first: u32,
}

/// What comes before the first group: equal to none.
const NOBODY: Group = Group {
    state: f64::NAN,
    size: 0,
    first: 0,
};

/// Shifts per group that putting groups in order may take before sorting them anew is cheaper.
const MAX_SHIFTS: usize = 16;

/// The distinct states of a line, rising.
#[derive(Debug, Clone)]
pub(super) struct Groups {
    sorted: Vec<Group>,
    /// For every agent one before it that shares its state, or itself if it is the first that does.
    companion: Vec<u32>,
}

impl Groups {
    /// The groups of agents at `states`; at most 2^32 of them.
    pub(super) fn new(states: &[f64]) -> Self {
        let companion: Vec<u32> = (0..states.len() as u32).collect();
        let agents = companion.iter().zip(states);
        let mut sorted: Vec<Group> = agents
            .map(|(&first, &state)| Group {
                state: state + 0.0, // -0 becomes 0, or the order of equal states would show
                size: 1,
                first,
            })
            .collect();
        sorted.sort_unstable_by(|a, b| a.state.total_cmp(&b.state));
        Self { sorted, companion }
    }

    /// The groups in rising order of their states.
    pub(super) fn sorted(&self) -> &[Group] {
        &self.sorted
    }

    /// Gives every group its next state and returns the furthest that one moved.
    pub(super) fn move_to(&mut self, next: &[f64]) -> f64 {
        let mut moved = 0.0;
        let mut is_rising = true;
        let mut last = NOBODY;
        let mut len = 0;
        for i in 0..self.sorted.len() {
            let Group {
                state: before,
                size,
                first,
            } = self.sorted[i];
            let state = next[i];
            moved = f64::max(moved, (state - before).abs());
            is_rising &= !(state < last.state);
            let equal = state == last.state;
            let later = select_unpredictable(equal, first.max(last.first), first);
            let first = select_unpredictable(equal, first.min(last.first), first);
            let size = size + select_unpredictable(equal, last.size, 0);
            self.companion[later as usize] = first;
            last = Group { state, size, first };
            len += usize::from(!equal);
            self.sorted[len - 1] = last;
        }
        self.sorted.truncate(len);
        if !is_rising {
            sort(&mut self.sorted);
        }
        moved
    }

    /// Appends the state of every agent, in the caller's order.
    pub(super) fn append_states(&self, out: &mut Vec<f64>) {
        let start = out.len();
        out.resize(start + self.companion.len(), 0.0);
        let out = &mut out[start..];
        for group in &self.sorted {
            out[group.first as usize] = group.state;
        }
        for (agent, companion) in self.companion.iter().enumerate() {
            out[agent] = out[*companion as usize];
        }
    }
}

/// Sorts, and tells whether there was anything to do: by insertion, as a step keeps most of the order, or by
/// the library where it did not.
fn sort(groups: &mut [Group]) {
    // The nearer to the predator, the further away a force drives.
    for falling in groups.chunk_by_mut(|a, b| a.state > b.state) {
        falling.reverse();
    }
    let mut shifts = MAX_SHIFTS * groups.len();
    for i in 1..groups.len() {
        let group = groups[i];
        let mut place = i;
        while place > 0 && groups[place - 1].state > group.state {
            groups[place] = groups[place - 1];
            place -= 1;
        }
        if place == i {
            continue;
        }
        groups[place] = group;
        if shifts < i - place {
            groups.sort_unstable_by(|a, b| a.state.total_cmp(&b.state));
            break;
        }
        shifts -= i - place;
    }
}
