//! A line as its distinct states in rising order, each with the agents that share it.
//!
//! Agents with equal states have equal neighbors and feel the same force: they stay together. A line falls into
//! few groups within some steps, and a step costs as much as there are groups, not agents.

use std::hint::select_unpredictable;

use serde::{Deserialize, Serialize};

use crate::snapshot::is_sound;

/// Agents that share one state.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Group {
    /// Their state.
    pub(super) state: f64,
    /// Number of agents.
    pub(super) size: u32,
    /// The first of them in the caller's order.
    first: u32,
}

/// Stands before the first group: NaN equals no state.
const NO_GROUP: Group = Group {
    state: f64::NAN,
    size: 0,
    first: 0,
};

/// Shifts per group after which insertion sort gives up and the library sorts.
const MAX_SHIFTS: usize = 16;

/// All groups of a line.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Groups {
    /// In rising order. Two groups may share a state until the next move.
    sorted: Vec<Group>,
    /// For every agent one before it that shares its state, or itself if it is the first that does.
    companion: Vec<u32>,
}

impl Groups {
    /// Every agent of `states` by itself; at most 2^32 of them.
    pub(super) fn new(states: &[f64]) -> Self {
        let companion: Vec<u32> = (0..states.len() as u32).collect();
        let agents = companion.iter().zip(states);
        let mut sorted: Vec<Group> = agents
            .map(|(&first, &state)| Group {
                state: state + 0.0, // -0 is 0: equal states are to be equal bits
                size: 1,
                first,
            })
            .collect();
        sorted.sort_unstable_by(|a, b| a.state.total_cmp(&b.state));
        Self { sorted, companion }
    }

    /// Whether these can be the groups of a line of `num_agents` agents.
    pub(super) fn fit(&self, num_agents: usize) -> bool {
        let is_agent = |id: u32| (id as usize) < num_agents;
        let sizes: usize = self.sorted.iter().map(|group| group.size as usize).sum();
        self.companion.len() == num_agents
            && self
                .companion
                .iter()
                .zip(0..)
                .all(|(companion, id)| *companion <= id)
            && sizes == num_agents
            && self.sorted.len() <= num_agents
            && self
                .sorted
                .iter()
                .all(|group| is_sound(group.state) && group.size > 0 && is_agent(group.first))
            && self.sorted.is_sorted_by(|a, b| a.state <= b.state)
    }

    /// The groups in rising order of their states.
    pub(super) fn sorted(&self) -> &[Group] {
        &self.sorted
    }

    /// Gives every group its next state, unites those that meet, and returns the furthest that one moved.
    pub(super) fn move_to(&mut self, next: &[f64]) -> f64 {
        let mut moved = 0.0;
        let mut is_falling = false;
        let mut last = NO_GROUP;
        let mut len = 0;
        // Meetings are unpredictable: no branches.
        for i in 0..self.sorted.len() {
            let Group {
                state: before,
                size,
                first,
            } = self.sorted[i];
            let state = next[i];
            moved = f64::max(moved, (state - before).abs());
            is_falling |= state < last.state;
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
        if is_falling {
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

/// Sorts by insertion, because a step keeps most of the order.
fn sort(groups: &mut [Group]) {
    // The nearer to the predator, the further a linear force drives: it turns the order around.
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn states(groups: &Groups) -> Vec<f64> {
        let mut states = Vec::new();
        groups.append_states(&mut states);
        states
    }

    proptest! {
        /// Few different states, so that many meet; enough of them for the library's sort.
        #[test]
        fn moves_keep_order_and_names(
            start in prop::collection::vec(0..200_u8, 1..300),
            maps in prop::collection::vec(prop::collection::vec(0..200_u8, 200), 1..6),
        ) {
            let mut agents: Vec<f64> = start.iter().copied().map(f64::from).collect();
            let mut groups = Groups::new(&agents);
            for map in maps {
                let next = |state: f64| f64::from(map[state as usize]);
                let group_states: Vec<f64> = groups.sorted().iter().map(|g| next(g.state)).collect();
                let furthest = agents.iter().map(|&x| (next(x) - x).abs()).fold(0.0, f64::max);
                prop_assert_eq!(groups.move_to(&group_states), furthest);
                agents.iter_mut().for_each(|state| *state = next(*state));
                prop_assert_eq!(&states(&groups), &agents);
                let sorted = groups.sorted();
                prop_assert!(sorted.is_sorted_by(|a, b| a.state <= b.state));
                prop_assert_eq!(sorted.iter().map(|g| g.size as usize).sum::<usize>(), agents.len());
            }
        }
    }

    #[test]
    fn neighbors_that_meet_become_one_group() {
        let mut groups = Groups::new(&[3.0, 1.0, 2.0, 1.0]);
        assert_eq!(groups.move_to(&[1.5, 1.5, 1.5, 3.0]), 0.5);
        let sizes: Vec<u32> = groups.sorted().iter().map(|group| group.size).collect();
        assert_eq!(sizes, [3, 1]);
        assert_eq!(states(&groups), [3.0, 1.5, 1.5, 1.5]);
    }
}
