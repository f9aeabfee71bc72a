//! `Load`: what interaction ranges cost a run.

use serde::{Deserialize, Serialize};

/// What interaction ranges cost so far. Agents that were caught before a step do not count in it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// Mean range over steps and agents, in m for a flock; 0 at t = 0.
    pub mean_range: f64,
    agent_steps: u64,
    num_heard: u128,
}

impl Load {
    /// Adds a step in which `num_agents` agents heard `num_heard` others, summed over the agents.
    pub(crate) fn record(&mut self, mean_range: f64, num_heard: i64, num_agents: usize) {
        self.agent_steps += num_agents as u64;
        self.num_heard += num_heard as u128;
        // Unlike a sum this cannot overflow, and equal ranges have exactly their mean.
        let weight = num_agents as f64 / self.agent_steps as f64;
        self.mean_range += (mean_range - self.mean_range) * weight;
    }

    /// Returns the mean number of others that an agent heard in a step; 0 at t = 0.
    pub fn mean_heard(&self) -> f64 {
        self.num_heard as f64 / self.agent_steps.max(1) as f64
    }
}
