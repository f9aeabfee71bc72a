//! `FlockConfig`: the scenario of the flock model.

#[cfg(test)]
pub(super) mod tests;

use std::f64::consts::TAU;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::initial::{InitialHeadings, InitialPositions, Space};
use super::motion::Motion;
use super::randomization::{self, Distribution};
use crate::agents::PerAgent;
use crate::base::check::{
    MAX_AGENTS, MAX_PARTS, MAX_STEPS, at_most, not_negative, positive_quantity, quantity, within,
    within_bounds,
};
use crate::base::document::{parse, parse_value};
use crate::base::error::{Error, Result};
use crate::neighbor::{FieldOfView, NeighborOptions, NeighborRule, Torus};
use crate::predator::{self, ConstantVelocity, PredatorConfig};

/// Parameters of the flock model (docs/model.md). The default is the paper's flock, also for fields that are
/// missing in a document.
///
/// ```
/// use flockesc_core::{FlockConfig, PerAgent};
///
/// let slow = FlockConfig { speed: PerAgent::Shared(5.0), ..FlockConfig::default() };
/// slow.check()?;
/// assert_eq!(FlockConfig::from_json(r#"{"speed": 5.0}"#)?, slow);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FlockConfig {
    /// Number of agents n, at least 1.
    pub num_agents: usize,
    /// Dimension D, 2 or 3.
    pub dimension: usize,
    /// Number of steps of an episode, at least 1.
    pub num_steps: usize,
    /// Time step dt in s, from 1e-20 to 1e20.
    pub time_step: f64,
    /// Mass m in kg, from 1e-20 to 1e20.
    pub mass: PerAgent,
    /// Speed v0 in m/s, from 1e-20 to 1e20.
    pub speed: PerAgent,
    /// Side in m of the initial region `[0, side]^D`, from 1e-20 to 1e20. It is also the length scale of
    /// observations.
    pub initial_side: f64,
    /// Distribution of the initial positions.
    pub initial_positions: InitialPositions,
    /// Distribution of the initial headings.
    pub initial_headings: InitialHeadings,
    /// Whether initial positions and headings lie in the plane z = 0. For D = 3.
    pub initial_plane: bool,
    /// Predator range rho_p in m, at least 0.
    pub predator_range: f64,
    /// Repulsion strength s, the norm of the escape force, at least 0.
    pub repulsion_strength: PerAgent,
    /// Weight a of the consensus force, at least 0.
    pub alignment_strength: PerAgent,
    /// Law of motion.
    pub motion: Motion,
    /// Width eta in rad of the uniform error in a new heading, from 0 to 2 pi.
    pub angular_noise: f64,
    /// Norm of the error in the neighbors' mean velocity, in units of v0, at least 0.
    pub sensing_noise: f64,
    /// Number of steps by which neighbor forces are delayed.
    pub sensing_delay: usize,
    /// Whether velocities are scaled to the speed v0 (step 4). `false` is the literal law of the paper.
    pub constant_speed: bool,
    /// Distance in m to the nearest predator up to which an agent is caught, at least 0; `None` is no
    /// captures.
    pub capture_radius: Option<f64>,
    /// The predators; may be empty.
    pub predators: Vec<PredatorConfig>,
    /// Rule that determines which agents are neighbors.
    pub neighbor_rule: NeighborRule,
    /// Full angle in rad of the blind sector behind an agent, from 0 to 2 pi. It has no neighbors there.
    pub blind_angle: f64,
    /// Whether two agents are neighbors only if each is in the other's range and view.
    pub mutual: bool,
    /// Whether the neighbor graph of the first step is kept.
    pub frozen_graph: bool,
    /// Whether agents that no predator has reached hear no agent that one has reached: a predator reaches an
    /// agent that is within `predator_range` of it.
    pub blocks_warnings: bool,
    /// Side in m of a periodic domain, from 1e-20 to 1e20; `None` is the open domain.
    pub periodic_side: Option<f64>,
    /// Distributions of the numbers that every episode draws from its seed, in this order.
    pub randomization: Vec<Distribution>,
}

impl Default for FlockConfig {
    /// The paper's flock (Section V).
    fn default() -> Self {
        Self {
            num_agents: 300,
            dimension: 2,
            num_steps: 240,
            time_step: 0.05,
            mass: PerAgent::Shared(0.1),
            speed: PerAgent::Shared(10.0),
            initial_side: 100.0,
            initial_positions: InitialPositions::Square {},
            initial_headings: InitialHeadings::Random {},
            initial_plane: false,
            predator_range: 30.0,
            repulsion_strength: PerAgent::Shared(10.0),
            alignment_strength: PerAgent::Shared(1.0),
            motion: Motion::Inertial {},
            angular_noise: 0.0,
            sensing_noise: 0.0,
            sensing_delay: 0,
            constant_speed: true,
            capture_radius: None,
            predators: vec![PredatorConfig::ConstantVelocity(ConstantVelocity {
                position: vec![-30.0, -30.0],
                velocity: vec![10.0, 10.0],
            })],
            neighbor_rule: NeighborRule::Metric {},
            blind_angle: 0.0,
            mutual: false,
            frozen_graph: false,
            blocks_warnings: false,
            periodic_side: None,
            randomization: vec![],
        }
    }
}

impl FlockConfig {
    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`Error::Input`] if a field is unknown, has the wrong type or is out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let config: Self = parse(document)?;
        config.check()?;
        Ok(config)
    }

    /// Returns the document with all fields as JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }

    /// Checks every field, and the parameters of the randomization. [`Self::drawn`] checks what they draw.
    ///
    /// # Errors
    /// [`Error::Input`] if a field is out of bounds.
    pub fn check(&self) -> Result<()> {
        self.check_fields()?;
        if self.randomization.is_empty() {
            return Ok(());
        }
        randomization::check(&self.randomization, self.undrawn_document())
    }

    /// Returns the number of learned predators.
    pub fn num_learned(&self) -> usize {
        self.predators.iter().filter(|p| p.is_learned()).count()
    }

    /// Checks every field except `randomization`.
    fn check_fields(&self) -> Result<()> {
        at_most("predators", "predators", self.predators.len(), MAX_PARTS)?;
        let count = self.randomization.len();
        at_most("randomization", "distributions", count, MAX_PARTS)?;
        within("num_agents", self.num_agents, 1, MAX_AGENTS)?;
        within("dimension", self.dimension, 2, 3)?;
        within("num_steps", self.num_steps, 1, MAX_STEPS)?;
        positive_quantity("time_step", self.time_step)?;
        for (field, value) in [("mass", &self.mass), ("speed", &self.speed)] {
            value.check(field, self.num_agents, positive_quantity)?;
        }
        positive_quantity("initial_side", self.initial_side)?;
        let space = self.space();
        self.initial_positions.check(&space, self.num_agents)?;
        self.initial_headings.check(&space, self.num_agents)?;
        not_negative("predator_range", self.predator_range)?;
        for (field, strength) in [
            ("repulsion_strength", &self.repulsion_strength),
            ("alignment_strength", &self.alignment_strength),
        ] {
            strength.check(field, self.num_agents, quantity)?;
        }
        self.motion.check(self.constant_speed, self.sensing_noise)?;
        within_bounds("angular_noise", self.angular_noise, 0.0, TAU)?;
        quantity("sensing_noise", self.sensing_noise)?;
        within("sensing_delay", self.sensing_delay, 0, MAX_STEPS)?;
        if let Some(radius) = self.capture_radius {
            not_negative("capture_radius", radius)?;
        }
        predator::check(&self.predators, self.dimension)?;
        self.check_neighbors()
    }

    fn check_neighbors(&self) -> Result<()> {
        within_bounds("blind_angle", self.blind_angle, 0.0, TAU)?;
        self.neighbor_rule
            .check(self.dimension, self.periodic_side)?;
        if let Some(side) = self.periodic_side {
            positive_quantity("periodic_side", side)?;
            if !self.predators.is_empty() {
                let expected = "None with predators, which need an open domain";
                return Err(Error::input("periodic_side", expected, side));
            }
            // The box would fold a wider start, and some places would get more agents than others.
            let width = self.initial_positions.width(self.initial_side);
            if let Some(width) = width.filter(|width| *width > side) {
                let source = match self.initial_positions.as_ref() {
                    "square" | "clusters" => "initial_side".to_owned(),
                    kind => format!("initial_positions.{kind}"),
                };
                let expected = format!("at least {width}, the width of the start ({source})");
                return Err(Error::input("periodic_side", expected, side));
            }
        }
        Ok(())
    }

    /// Returns the space that the flock starts in.
    pub(crate) fn space(&self) -> Space {
        Space::new(self.dimension, self.initial_plane, self.initial_side)
    }

    /// Returns the options of the neighbor graph.
    pub(crate) fn neighbor_options(&self) -> NeighborOptions {
        NeighborOptions {
            rule: self.neighbor_rule,
            field_of_view: FieldOfView::new(self.blind_angle),
            torus: Torus::new(self.periodic_side),
            is_mutual: self.mutual,
            is_frozen: self.frozen_graph,
            blocks_warnings: self.blocks_warnings,
            needs_pairs: self.motion.needs().pairs,
        }
    }

    /// Returns the scenario of the episode with this seed: with drawn numbers and without randomization.
    ///
    /// # Errors
    /// [`Error::Input`] if a drawn number, alone or with others, is out of bounds.
    pub fn drawn(self: &Arc<Self>, seed: u64) -> Result<Arc<Self>> {
        if self.randomization.is_empty() {
            return Ok(Arc::clone(self));
        }
        let mut document = self.undrawn_document();
        randomization::draw(&self.randomization, seed, &mut document);
        let drawn = parse_value::<Self>(&document);
        let checked = drawn.and_then(|drawn| drawn.check_fields().map(|()| Arc::new(drawn)));
        checked.map_err(|error| match error {
            Error::Input {
                field,
                expected,
                given,
            } => {
                let given = format!("{given}, drawn by the episode with seed {seed}");
                Error::input(field, expected, given)
            }
            other => other,
        })
    }

    /// Returns the document without its randomization.
    fn undrawn_document(&self) -> Value {
        let mut document = serde_json::to_value(self).unwrap_or_default();
        document["randomization"] = Value::Array(Vec::new());
        document
    }
}
