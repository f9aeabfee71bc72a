//! Parameters of the agents' motion.

use crate::agents::PerAgent;

/// The fields of a scenario for steps 2 to 4 (docs/model.md), except the law of motion.
#[derive(Debug, Clone, Copy)]
pub(in crate::flock) struct Parameters<'a> {
    pub(in crate::flock) num_agents: usize,
    pub(in crate::flock) time_step: f64,
    pub(in crate::flock) mass: &'a PerAgent,
    pub(in crate::flock) speed: &'a PerAgent,
    pub(in crate::flock) alignment_strength: &'a PerAgent,
    pub(in crate::flock) repulsion_strength: &'a PerAgent,
    pub(in crate::flock) predator_range: f64,
    pub(in crate::flock) angular_noise: f64,
    pub(in crate::flock) sensing_noise: f64,
    pub(in crate::flock) sensing_delay: usize,
    pub(in crate::flock) constant_speed: bool,
}
