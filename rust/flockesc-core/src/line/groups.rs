//! `Groups`: the distinct states of a line in ascending order, each with the agents that share it.
//!
//! Agents with equal states have the same neighbors and the same force, so that their states stay equal. A
//! line has few groups after some steps, and the cost of a step is proportional to the number of groups
//! instead of agents.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

/// A group of agents with the same state.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Group {
    pub(super) state: f64,
    /// Number of agents.
    pub(super) size: u32,
    /// The lowest id of the agents.
    first: u32,
}

/// All groups of a line.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Groups {
    /// Groups in ascending order of their states. Two groups may have the same state until the next step.
    sorted: Vec<Group>,
    /// For every agent the id of an agent with the same state and a lower id, or its own id if there is none.
    companion: Vec<u32>,
}

impl Groups {
    /// Creates one group per agent. There are at most 2^32 agents.
    pub(super) fn new(states: &[f64]) -> Self {
        let companion: Vec<u32> = (0..states.len() as u32).collect();
        let agents = companion.iter().zip(states);
        let mut sorted: Vec<Group> = agents
            .map(|(&first, &state)| Group {
                state: state + 0.0, // turns -0 into 0, so that equal states have equal bits
                size: 1,
                first,
            })
            .collect();
        sorted.sort_unstable_by(by_state);
        Self { sorted, companion }
    }

    /// Returns the groups in ascending order of their states.
    pub(super) fn sorted(&self) -> &[Group] {
        &self.sorted
    }

    /// Sets the next states of the groups, merges groups with equal states and returns the largest
    /// displacement.
    pub(super) fn move_to(&mut self, next: &[f64]) -> f64 {
        let mut moved = 0.0;
        for (group, state) in self.sorted.iter_mut().zip(next) {
            moved = f64::max(moved, (state - group.state).abs());
            group.state = *state;
        }
        let companion = &mut self.companion;
        self.sorted.dedup_by(|group, last| {
            let is_equal = group.state == last.state;
            if is_equal {
                let first = group.first.min(last.first);
                companion[group.first.max(last.first) as usize] = first;
                (last.first, last.size) = (first, last.size + group.size);
            }
            is_equal
        });
        // A linear force is larger on agents closer to the predator and reverses the order of some groups.
        if !self.sorted.is_sorted_by(|a, b| a.state <= b.state) {
            self.sorted.sort_unstable_by(by_state);
        }
        moved
    }

    /// Appends the states of all agents to `out`, in the order of ids.
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

fn by_state(a: &Group, b: &Group) -> Ordering {
    a.state.total_cmp(&b.state).then(a.first.cmp(&b.first))
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
        /// States are chosen from 200 values, so that many groups merge.
        #[test]
        fn moves_keep_order_and_ids(
            start in prop::collection::vec(0..200_u8, 1..300),
            maps in prop::collection::vec(prop::collection::vec(0..200_u8, 200), 1..6),
        ) {
            let mut agents: Vec<f64> = start.iter().copied().map(f64::from).collect();
            let mut groups = Groups::new(&agents);
            for map in maps {
                let next = |state: f64| f64::from(map[state as usize]);
                let group_states: Vec<f64> = groups.sorted().iter().map(|g| next(g.state)).collect();
                let largest = agents.iter().map(|&x| (next(x) - x).abs()).fold(0.0, f64::max);
                prop_assert_eq!(groups.move_to(&group_states), largest);
                agents.iter_mut().for_each(|state| *state = next(*state));
                prop_assert_eq!(&states(&groups), &agents);
                let sorted = groups.sorted();
                prop_assert!(sorted.is_sorted_by(|a, b| a.state <= b.state));
                prop_assert_eq!(sorted.iter().map(|g| g.size as usize).sum::<usize>(), agents.len());
            }
        }
    }

    #[test]
    fn groups_with_equal_states_are_merged() {
        let mut groups = Groups::new(&[3.0, 1.0, 2.0, 1.0]);
        assert_eq!(groups.move_to(&[1.5, 1.5, 1.5, 3.0]), 0.5);
        let sizes: Vec<u32> = groups.sorted().iter().map(|group| group.size).collect();
        assert_eq!(sizes, [3, 1]);
        assert_eq!(states(&groups), [3.0, 1.5, 1.5, 1.5]);
    }
}
