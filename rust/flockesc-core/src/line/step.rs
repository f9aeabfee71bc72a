//! `Line`: a line of agents, and one step of the model, consensus (Eq. 1) plus escape force (Eq. 7).

use std::cmp::Ordering;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::base::check::{coordinates, length, not_negative, rounding};
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::base::memory;
use crate::base::rng::{self, Stream};
use crate::line::scenario::LineConfig;

/// Memory in bytes of an agent, rounded: its group and the buffers of a step.
const AGENT_BYTES: usize = 64;

/// A line of agents at one time.
#[derive(Debug, Clone)]
pub struct Line {
    config: Arc<LineConfig>,
    groups: Groups,
    /// A buffer: the next state of every group.
    next: Vec<f64>,
}

impl Line {
    /// Creates a line with these groups.
    pub(super) fn of_groups(config: Arc<LineConfig>, groups: Groups) -> Self {
        Self {
            next: Vec::with_capacity(config.num_agents),
            config,
            groups,
        }
    }

    pub(super) fn groups(&self) -> &Groups {
        &self.groups
    }

    /// Creates a line at `states`. If they are `None`, x(0) ~ U[0, 1]^n is drawn from `seed`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if `states` does not have one entry per agent or an entry is out of bounds;
    /// [`crate::Error::Memory`]; [`crate::Error::Rounding`].
    pub fn new(config: Arc<LineConfig>, seed: u64, states: Option<&[f64]>) -> Result<Self> {
        rounding()?;
        let num_agents = config.num_agents;
        memory::probe::<[u8; AGENT_BYTES]>("num_agents", num_agents)?;
        let groups = match states {
            Some(given) => {
                check_states(given, num_agents)?;
                Groups::new(given)
            }
            None => Groups::new(&initial_states(num_agents, seed)),
        };
        Ok(Self::of_groups(config, groups))
    }

    /// Returns the states x(t), length n, in the order of ids.
    pub fn states(&self) -> Vec<f64> {
        let mut states = vec![0.0; self.groups.companion.len()];
        for group in &self.groups.sorted {
            states[group.first as usize] = group.state;
        }
        for (agent, companion) in self.groups.companion.iter().enumerate() {
            states[agent] = states[*companion as usize];
        }
        states
    }

    /// Returns the offsets x_i - x_p in ascending order, length n; the states without a predator.
    pub(super) fn offsets(&self) -> impl Iterator<Item = f64> {
        let predator = self.config.predator_position.unwrap_or_default();
        let groups = self.groups.sorted.iter();
        groups
            .flat_map(move |group| std::iter::repeat_n(group.state - predator, group.size as usize))
    }

    /// Returns the parameters.
    pub fn config(&self) -> &Arc<LineConfig> {
        &self.config
    }

    /// Advances the line by one step and returns the largest displacement max_i |x_i(t+1) - x_i(t)|.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if `range` is negative or not finite.
    pub fn step(&mut self, range: f64) -> Result<f64> {
        not_negative("interaction_range", range)?;
        let groups = &self.groups.sorted;
        neighbor_means(groups, self.config.num_agents, range, &mut self.next);
        if let Some(predator) = self.config.predator_position {
            let LineConfig {
                predator_range,
                repulsion_strength,
                escape_force,
                ..
            } = *self.config;
            for (next, group) in self.next.iter_mut().zip(groups) {
                let offset = group.state - predator;
                *next += escape_force.at(offset, predator_range, repulsion_strength);
            }
        }
        Ok(self.groups.move_to(&self.next))
    }

    /// Returns whether the line is in its steady state after a step with the largest displacement `moved`.
    pub fn is_steady(&self, moved: f64) -> bool {
        moved <= self.config.tolerance
    }

    /// Returns the escape distance d(t) = min_i |x_i - x_p|; infinite without a predator.
    pub fn escape_distance(&self) -> f64 {
        let Some(predator) = self.config.predator_position else {
            return f64::INFINITY;
        };
        let groups = self.groups.sorted.iter();
        groups
            .map(|group| (group.state - predator).abs())
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns the number of connected components m(t) under `range`.
    pub fn num_components(&self, range: f64) -> usize {
        components(&self.groups.sorted, range).count()
    }
}

/// Draws x(0) ~ U[0, 1]^n.
fn initial_states(num_agents: usize, seed: u64) -> Vec<f64> {
    let mut rng = rng::stream(seed, Stream::LineState);
    (0..num_agents)
        .map(|_| rng::uniform(&mut rng, 1.0))
        .collect()
}

fn check_states(states: &[f64], num_agents: usize) -> Result<()> {
    let (field, note) = ("initial_state", ", one per agent");
    length(field, states.len(), num_agents, "entries", note)?;
    coordinates(states, |i| format!("{field}[{i}]"))
}

/// A group of agents with the same state.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Group {
    state: f64,
    /// Number of agents.
    size: u32,
    /// The lowest id of the agents.
    first: u32,
}

/// The distinct states of a line, each with the agents that share it.
///
/// Agents with equal states have the same neighbors and the same force, so that their states stay equal. A
/// line has few groups after some steps, and the cost of a step is proportional to the number of groups
/// instead of agents.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Groups {
    /// Groups in ascending order of their states. Two groups may have the same state until the next step.
    sorted: Vec<Group>,
    /// Entry i is a lower id of an agent with the same state as agent i, or i if there is none.
    companion: Vec<u32>,
}

impl Groups {
    /// Creates one group per agent. There are at most 2^32 agents.
    fn new(states: &[f64]) -> Self {
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

    /// Sets the next states of the groups, merges groups with equal states and returns the largest
    /// displacement.
    fn move_to(&mut self, next: &[f64]) -> f64 {
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
}

fn by_state(a: &Group, b: &Group) -> Ordering {
    a.state.total_cmp(&b.state).then(a.first.cmp(&b.first))
}

/// Returns the connected components under `range`, from left to right.
fn components(groups: &[Group], range: f64) -> impl Iterator<Item = &[Group]> {
    groups.chunk_by(move |a, b| b.state - a.state <= range)
}

/// Computes for every group the mean state of the agents within `range`, boundary included (Eq. 1).
///
/// The neighbors of a group lie in a window of the sorted groups. Its sum is exact, in fixed point, so that
/// groups with the same neighbors get bitwise equal means, in any order of the agents.
fn neighbor_means(groups: &[Group], num_agents: usize, range: f64, means: &mut Vec<f64>) {
    means.clear();
    for component in components(groups, range) {
        let (first, last) = (component[0].state, component[component.len() - 1].state);
        if first == last {
            // All states are equal, so the mean is the state itself, without rounding.
            means.extend(component.iter().map(|group| group.state));
            continue;
        }
        let scale = Scale::new(first.abs().max(last.abs()), num_agents);
        let sum_of = |group: &Group| i64::from(group.size) * scale.truncate(group.state);
        let (mut low, mut high, mut sum, mut size) = (0, 0, 0, 0);
        for group in component {
            while high < component.len() && component[high].state - group.state <= range {
                sum += sum_of(&component[high]);
                size += i64::from(component[high].size);
                high += 1;
            }
            while group.state - component[low].state > range {
                sum -= sum_of(&component[low]);
                size -= i64::from(component[low].size);
                low += 1;
            }
            means.push(scale.mean(sum, size));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::EscapeForce;
    use proptest::prelude::*;

    fn line(states: &[f64]) -> Line {
        let config = LineConfig {
            num_agents: states.len(),
            predator_position: None,
            predator_range: 0.2,
            repulsion_strength: 2.0,
            escape_force: EscapeForce::Linear,
            tolerance: 1e-12,
            max_steps: 1000,
        };
        Line::new(Arc::new(config), 0, Some(states)).expect("finite states")
    }

    proptest! {
        /// Lemma 1: without a predator m(t) never decreases. The convex hull of the states never grows.
        #[test]
        fn components_never_merge_and_the_hull_never_grows(
            states in prop::collection::vec(0.0..1.0_f64, 1..60),
            range in 0.0..0.5_f64,
        ) {
            let mut line = line(&states);
            let hull = |line: &Line| {
                let states = line.states();
                let low = states.iter().copied().fold(f64::INFINITY, f64::min);
                (low, states.into_iter().fold(low, f64::max))
            };
            let (mut components, mut before) = (line.num_components(range), hull(&line));
            for _ in 0..30 {
                line.step(range).expect("a good range");
                let after = hull(&line);
                prop_assert!(line.num_components(range) >= components);
                // Rounding may move the mean of equal numbers away from them.
                prop_assert!(after.0 >= before.0 - 1e-15 && after.1 <= before.1 + 1e-15);
                (components, before) = (line.num_components(range), after);
            }
        }
    }

    #[test]
    fn two_agents_meet_in_one_step_only_if_in_range() {
        let mut near = line(&[0.0, 1.0]);
        assert_eq!(near.step(1.0), Ok(0.5));
        assert_eq!(near.states(), [0.5, 0.5]);
        let mut far = line(&[0.0, 1.0]);
        assert_eq!(far.step(0.999), Ok(0.0));
        assert_eq!(far.num_components(0.999), 2);
    }

    #[test]
    fn rejected_ranges_change_nothing() {
        let mut line = line(&[0.0, 1.0]);
        for range in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(line.step(range).is_err());
        }
        assert_eq!(line.states(), [0.0, 1.0]);
    }
}
