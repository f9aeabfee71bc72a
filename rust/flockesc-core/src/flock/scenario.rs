//! The flock model's scenario.

#[cfg(test)]
pub(super) mod tests;

use std::f64::consts::TAU;
use std::sync::Arc;

use serde::Deserialize;
use serde_json::Value;

use super::randomization::Randomization;
use super::{InitialHeadings, InitialPositions, Motion, Space};
use crate::agents::PerAgent;
use crate::base::check::{
    MAX_AGENTS, MAX_STEPS, not_negative, positive_quantity, quantity, within, within_bounds,
};
use crate::base::document::{parse_value, read};
use crate::base::error::{Error, Result};
use crate::neighbor::{NeighborOptions, NeighborRule, Sight, Torus};
use crate::predator::{self, PredatorConfig};

/// The flock model's parameters (docs/model.md). Every field is required: defaults live in Python.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlockConfig {
    /// n, number of agents, at least 1.
    pub num_agents: usize,
    /// D, 2 or 3.
    pub dimension: usize,
    /// T / dt, number of steps of an episode, at least 1.
    pub num_steps: usize,
    /// dt in s; from 1e-20 to 1e20, as all that is above 0 here.
    pub time_step: f64,
    /// m in kg, above 0.
    pub mass: PerAgent,
    /// v0 in m/s, above 0.
    pub speed: PerAgent,
    /// Side in m of the initial region `[0, side]^D`, above 0; also the length scale of observations.
    pub initial_side: f64,
    /// Where agents start.
    pub initial_positions: InitialPositions,
    /// Where they head then.
    pub initial_headings: InitialHeadings,
    /// Whether a flock in space starts in the plane z = 0, positions and headings.
    pub initial_plane: bool,
    /// rho_p in m, at least 0.
    pub predator_range: f64,
    /// s, at least 0.
    pub repulsion_strength: PerAgent,
    /// Weight a of the consensus force, at least 0.
    pub alignment_strength: PerAgent,
    /// How forces set velocities.
    pub motion: Motion,
    /// eta in rad, from 0 to 2 pi: the width of the error in the new heading.
    pub angular_noise: f64,
    /// Error in the mean velocity heard, over v0, at least 0.
    pub sensing_noise: f64,
    /// Steps that pass between hearing neighbors and acting on it.
    pub sensing_delay: usize,
    /// Whether step 4 (constant speed) is applied; `false` is the literal law of the paper.
    pub constant_speed: bool,
    /// Distance in m to the nearest predator up to which an agent is caught, at least 0; `None`: nobody is.
    pub capture_radius: Option<f64>,
    /// Predators; none is allowed.
    pub predators: Vec<PredatorConfig>,
    /// Who is a neighbor.
    pub neighbor_rule: NeighborRule,
    /// Full angle in rad of the sector behind an agent in which it sees no neighbor, from 0 to 2 pi.
    pub blind_angle: f64,
    /// Whether only agents that would both listen to each other are neighbors.
    pub mutual: bool,
    /// Whether the neighbor graph of the first step stays.
    pub frozen_graph: bool,
    /// Side in m of a world without border, above 0; `None`: the open world.
    pub periodic_side: Option<f64>,
    /// What every episode draws anew.
    pub randomization: Randomization,
}

impl FlockConfig {
    /// Number of learned predators.
    pub(crate) fn num_learned(&self) -> usize {
        self.predators.iter().filter(|p| p.is_steered()).count()
    }

    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`Error::Config`] naming the field that is unknown, missing, of a wrong type or out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let value = read(document)?;
        let mut config = Self::from_value(&value)?;
        config.randomization.prepare(value)?;
        Ok(config)
    }

    /// As [`Self::from_json`], without a look at what is drawn.
    pub(crate) fn from_value(document: &Value) -> Result<Self> {
        let config: Self = parse_value(document)?;
        within("num_agents", config.num_agents, 1, MAX_AGENTS)?;
        within("dimension", config.dimension, 2, 3)?;
        within("num_steps", config.num_steps, 1, MAX_STEPS)?;
        positive_quantity("time_step", config.time_step)?;
        for (field, value) in [("mass", &config.mass), ("speed", &config.speed)] {
            value.check(field, config.num_agents, positive_quantity)?;
        }
        positive_quantity("initial_side", config.initial_side)?;
        let space = Space::of(&config);
        config.initial_positions.check(&space, config.num_agents)?;
        config.initial_headings.check(&space, config.num_agents)?;
        not_negative("predator_range", config.predator_range)?;
        for (field, strength) in [
            ("repulsion_strength", &config.repulsion_strength),
            ("alignment_strength", &config.alignment_strength),
        ] {
            strength.check(field, config.num_agents, quantity)?;
        }
        config.motion.check(config.constant_speed)?;
        within_bounds("angular_noise", config.angular_noise, 0.0, TAU)?;
        quantity("sensing_noise", config.sensing_noise)?;
        within("sensing_delay", config.sensing_delay, 0, MAX_STEPS)?;
        if let Some(radius) = config.capture_radius {
            not_negative("capture_radius", radius)?;
        }
        predator::check(&config.predators, config.dimension)?;
        config.check_neighbors()?;
        Ok(config)
    }

    fn check_neighbors(&self) -> Result<()> {
        within_bounds("blind_angle", self.blind_angle, 0.0, TAU)?;
        let is_voronoi = match self.neighbor_rule {
            NeighborRule::Metric {} | NeighborRule::Topological {} => false,
            NeighborRule::Voronoi {} => true,
        };
        if is_voronoi && self.dimension != 2 {
            let expected = "metric or topological, where the dimension is not 2";
            return Err(Error::config("neighbor_rule", expected, "voronoi"));
        }
        if let Some(side) = self.periodic_side {
            positive_quantity("periodic_side", side)?;
            let reason = if is_voronoi {
                "None with neighbor_rule voronoi"
            } else if !self.predators.is_empty() {
                "None with predators, which come from outside"
            } else {
                return Ok(());
            };
            return Err(Error::config("periodic_side", reason, side));
        }
        Ok(())
    }

    /// What this says of the neighbor graph.
    pub(crate) fn neighbor_options(&self) -> NeighborOptions {
        NeighborOptions {
            rule: self.neighbor_rule,
            sight: Sight::new(self.blind_angle),
            torus: Torus::new(self.periodic_side),
            is_mutual: self.mutual,
            is_frozen: self.frozen_graph,
            visits: matches!(self.motion, Motion::Reynolds(_)),
        }
    }

    /// The scenario of the episode with this seed: itself, if it draws nothing.
    #[must_use]
    pub fn drawn(self: &Arc<Self>, seed: u64) -> Arc<Self> {
        match self.randomization.draw(seed) {
            Some((_, config)) => Arc::new(config),
            None => Arc::clone(self),
        }
    }

    /// The document of [`Self::drawn`]; `None`, if the scenario draws nothing.
    #[must_use]
    pub fn drawn_json(&self, seed: u64) -> Option<String> {
        self.randomization
            .draw(seed)
            .map(|(document, _)| document.to_string())
    }
}
