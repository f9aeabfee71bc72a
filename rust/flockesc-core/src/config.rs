//! Scenarios and environment options: parsed from one JSON document each, then checked field by field.

use std::f64::consts::TAU;
use std::sync::Arc;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::error::{Error, Result};
use crate::flock::{InitialHeadings, InitialPositions, Motion, Space};
use crate::line::EscapeForce;
use crate::neighbor::{NeighborOptions, NeighborRule, Sight, Torus};
use crate::per_agent::PerAgent;
use crate::predator::{self, PredatorConfig};
use crate::randomization::Randomization;
use crate::reward::Reward;

/// Largest flock or line that a scenario may name; guards against allocations no machine has.
pub const MAX_AGENTS: usize = 10_000_000;
/// Largest number of steps that a scenario may name.
pub const MAX_STEPS: usize = 1_000_000_000;
/// Largest length in m of an initial shape: what is drawn around any center stays finite.
const MAX_LENGTH: f64 = 1e290;

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
    /// dt in s, above 0.
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

/// The line model's parameters (docs/model.md). Every field is required: defaults live in Python.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineConfig {
    /// n, number of agents, at least 1.
    pub num_agents: usize,
    /// x_p; `None` is a line without predator.
    pub predator_position: Option<f64>,
    /// rho_p, at least 0.
    pub predator_range: f64,
    /// s, at least 0.
    pub repulsion_strength: f64,
    /// Which escape force is added to the consensus.
    pub escape_force: EscapeForce,
    /// Largest move of any agent in one step that counts as standing still, at least 0.
    pub tolerance: f64,
    /// Steps after which an unsteady line is given up, at least 1.
    pub max_steps: usize,
}

/// What an environment rewards and shows (docs/model.md).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodeConfig {
    /// Whose eyes the observation is made for.
    pub view: View,
    /// Which distance the episode is about.
    pub objective: Objective,
    /// What a step pays.
    pub reward: Reward,
    /// Largest range in m that an action can set, above 0; scales the observed last range.
    pub max_range: f64,
    /// Distance up to which a predator is seen; `None`: any distance.
    pub predator_sensing_range: Option<SensingRange>,
    /// Steps of the model during which one action holds, at least 1.
    pub steps_per_action: usize,
}

/// Distance up to which a predator is seen.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum SensingRange {
    /// In m.
    Length(f64),
    /// That of another range.
    Same(SameRange),
}

/// A range that another one is equal to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SameRange {
    /// rho_p of the episode's scenario.
    PredatorRange,
}

/// Whose eyes an observation is made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum View {
    /// One summary per flock.
    Flock,
    /// One row per agent, in its own frame.
    Agent,
}

/// What is to be kept large: a predator distance, or the flock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// The mean over agents (Eq. 12).
    Mean,
    /// The minimum over agents (Eq. 13).
    Minimum,
    /// The share of agents that have not been caught.
    Survival,
}

impl FlockConfig {
    /// Number of learned predators.
    pub(crate) fn num_learned(&self) -> usize {
        self.predators.iter().filter(|p| p.is_learned()).count()
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
        positive("time_step", config.time_step)?;
        config.mass.check("mass", config.num_agents, positive)?;
        config.speed.check("speed", config.num_agents, positive)?;
        positive("initial_side", config.initial_side)?;
        let space = Space::of(&config);
        config.initial_positions.check(&space, config.num_agents)?;
        config.initial_headings.check(&space, config.num_agents)?;
        not_negative("predator_range", config.predator_range)?;
        for (field, strength) in [
            ("repulsion_strength", &config.repulsion_strength),
            ("alignment_strength", &config.alignment_strength),
        ] {
            strength.check(field, config.num_agents, not_negative)?;
        }
        config.motion.check(config.constant_speed)?;
        within_bounds("angular_noise", config.angular_noise, 0.0, TAU)?;
        not_negative("sensing_noise", config.sensing_noise)?;
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
            within_bounds("periodic_side", side, f64::MIN_POSITIVE, MAX_LENGTH)?;
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

impl LineConfig {
    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`Error::Config`] naming the field that is unknown, missing, of a wrong type or out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let config: Self = parse(document)?;
        within("num_agents", config.num_agents, 1, MAX_AGENTS)?;
        if let Some(position) = config.predator_position {
            finite("predator_position", position)?;
        }
        not_negative("predator_range", config.predator_range)?;
        not_negative("repulsion_strength", config.repulsion_strength)?;
        not_negative("tolerance", config.tolerance)?;
        within("max_steps", config.max_steps, 1, MAX_STEPS)?;
        Ok(config)
    }
}

impl EpisodeConfig {
    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`Error::Config`] naming the field that is unknown, missing, of a wrong type or out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let config: Self = parse(document)?;
        positive("max_range", config.max_range)?;
        if let Some(SensingRange::Length(range)) = config.predator_sensing_range {
            not_negative("predator_sensing_range", range)?;
        }
        within("steps_per_action", config.steps_per_action, 1, MAX_STEPS)?;
        if config.reward.is_own() && config.view == View::Flock {
            return Err(Error::config(
                "reward",
                "running_minimum, distance or terminal where one range serves the whole flock",
                "a reward of each agent's own",
            ));
        }
        Ok(config)
    }

    /// Whether a predator is seen from this distance in m.
    pub(crate) fn is_sensed(&self, distance: f64, scenario: &FlockConfig) -> bool {
        match self.predator_sensing_range {
            None => true,
            Some(SensingRange::Length(range)) => distance <= range,
            Some(SensingRange::Same(SameRange::PredatorRange)) => {
                distance <= scenario.predator_range
            }
        }
    }
}

pub(crate) fn parse<T: DeserializeOwned>(document: &str) -> Result<T> {
    parse_value(&read(document)?)
}

fn read(document: &str) -> Result<Value> {
    serde_json::from_str(document).map_err(|error| Error::config("document", "valid JSON", error))
}

fn parse_value<T: DeserializeOwned>(value: &Value) -> Result<T> {
    serde_path_to_error::deserialize(value).map_err(|error| {
        let path = error.path().to_string();
        let message = error.inner().to_string();
        let (given, expected) = message
            .split_once(", expected ")
            .unwrap_or((&message, "a field that the schema names"));
        let field = if path == "." {
            quoted(given).unwrap_or("document").to_owned()
        } else {
            path
        };
        Error::config(field, plain(expected), given)
    })
}

/// What serde expects, in words of the document instead of Rust's.
fn plain(expected: &str) -> &str {
    match expected {
        "usize" => "an integer of at least 0",
        "f64" => "a number",
        "a sequence" => "a list",
        "a boolean" => "true or false",
        "newtype variant" | "struct variant" | "map" => "an object with its fields",
        other if other.starts_with("struct ") => "an object with its fields",
        other => other,
    }
}

/// The name in backquotes in serde's messages on unknown and missing fields.
fn quoted(message: &str) -> Option<&str> {
    message.split('`').nth(1)
}

pub(crate) fn finite(field: &str, value: f64) -> Result<()> {
    check(field, value, "a finite number", value.is_finite())
}

pub(crate) fn not_negative(field: &str, value: f64) -> Result<()> {
    let good = value.is_finite() && value >= 0.0;
    check(field, value, "a finite number of at least 0", good)
}

pub(crate) fn positive(field: &str, value: f64) -> Result<()> {
    let good = value.is_finite() && value > 0.0;
    check(field, value, "a finite number above 0", good)
}

/// A length of an initial shape in m.
pub(crate) fn length(field: &str, value: f64) -> Result<()> {
    within_bounds(field, value, 0.0, MAX_LENGTH)
}

pub(crate) fn within_bounds(field: &str, value: f64, low: f64, high: f64) -> Result<()> {
    let expected = format!("a number from {low:?} to {high:?}");
    check(field, value, &expected, (low..=high).contains(&value))
}

/// A point or direction: 2 or `dimension` finite numbers.
pub(crate) fn vector(field: &str, entries: &[f64], dimension: usize) -> Result<()> {
    if entries.len() != 2 && entries.len() != dimension {
        let expected = match dimension {
            2 => "2 numbers".to_owned(),
            _ => format!("2 or {dimension} numbers"),
        };
        return Err(Error::config(field, expected, entries.len()));
    }
    let mut places = entries.iter().enumerate();
    places.try_for_each(|(k, &entry)| finite(&format!("{field}[{k}]"), entry))
}

pub(crate) fn within(field: &str, value: usize, low: usize, high: usize) -> Result<()> {
    let expected = format!("an integer from {low} to {high}");
    check(field, value, &expected, (low..=high).contains(&value))
}

fn check(field: &str, value: impl ToString, expected: &str, good: bool) -> Result<()> {
    if good {
        Ok(())
    } else {
        Err(Error::config(field, expected, value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn paper() -> Value {
        json!({
            "num_agents": 300, "dimension": 2, "num_steps": 240, "time_step": 0.05, "mass": 0.1,
            "speed": 10.0, "initial_side": 100.0, "predator_range": 30.0,
            "initial_positions": {"square": {}}, "initial_headings": {"random": {}},
            "initial_plane": false, "repulsion_strength": 10.0, "alignment_strength": 1.0,
            "motion": {"inertial": {}}, "angular_noise": 0.0, "sensing_noise": 0.0, "sensing_delay": 0,
            "constant_speed": true, "capture_radius": null,
            "predators": [{"constant_velocity": {"position": [-30.0, -30.0], "velocity": [10.0, 10.0]}}],
            "neighbor_rule": {"metric": {}}, "blind_angle": 0.0, "mutual": false, "frozen_graph": false,
            "periodic_side": null, "randomization": []
        })
    }

    fn refused(pointer: &str, value: Value) -> String {
        let mut document = paper();
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        let parent = document.pointer_mut(parent).expect("a parent");
        match parent {
            Value::Object(fields) => drop(fields.insert(key.to_owned(), value)),
            Value::Array(entries) => entries[key.parse::<usize>().expect("an index")] = value,
            _ => panic!("no container"),
        }
        match FlockConfig::from_json(&document.to_string()) {
            Err(Error::Config { field, .. }) => field,
            other => panic!("{pointer}: {other:?}"),
        }
    }

    #[test]
    fn the_paper_is_accepted() {
        assert!(FlockConfig::from_json(&paper().to_string()).is_ok());
    }

    #[test]
    fn errors_name_the_field() {
        let predator = json!({"pure_pursuit": {"position": [0.0, 0.0], "velocity": [1.0, 0.0],
                                               "max_turn_rate": -1.0, "max_speed": null,
                                               "acceleration": 0.0, "target": "nearest", "confusion_rate": 0.0,
                                               "sight": 30.0}});
        for (pointer, value, field) in [
            ("/num_agents", json!(0), "num_agents"),
            ("/num_agents", json!(-1), "num_agents"),
            ("/num_agents", json!(10_000_001), "num_agents"),
            ("/dimension", json!(4), "dimension"),
            ("/time_step", json!(0.0), "time_step"),
            ("/mass", json!("heavy"), "mass"),
            ("/mass", json!([0.1, 0.2]), "mass"),
            ("/speed", json!(vec![0.0; 300]), "speed[0]"),
            ("/alignment_strength", json!(-1.0), "alignment_strength"),
            (
                "/motion",
                json!({"vicsek": {"noise": 1.0}}),
                "motion.vicsek.noise",
            ),
            (
                "/motion",
                json!({"reynolds": {"separation_strength": 1.0, "cohesion_strength": 1.0, "separation_range": -1.0}}),
                "motion.reynolds.separation_range",
            ),
            ("/angular_noise", json!(6.3), "angular_noise"),
            ("/sensing_noise", json!(-0.1), "sensing_noise"),
            ("/sensing_delay", json!(1.5), "sensing_delay"),
            ("/predator_range", json!(-1.0), "predator_range"),
            ("/capture_radius", json!(-1.0), "capture_radius"),
            ("/capture_radius", json!("near"), "capture_radius"),
            ("/initial_positions", json!("torus"), "initial_positions"),
            (
                "/initial_positions",
                json!({"ring": {"radius": 5.0, "width": 11.0}}),
                "initial_positions.ring.width",
            ),
            (
                "/initial_headings",
                json!({"aligned": {"direction": [0.0, 0.0], "spread": 0.0}}),
                "initial_headings.aligned.direction",
            ),
            ("/wings", json!(2), "wings"),
            (
                "/neighbor_rule",
                json!({"metric": {"k": 3}}),
                "neighbor_rule.metric.k",
            ),
            ("/blind_angle", json!(6.3), "blind_angle"),
            ("/mutual", json!(1), "mutual"),
            ("/periodic_side", json!(0.0), "periodic_side"),
            ("/periodic_side", json!(100.0), "periodic_side"),
            (
                "/predators/0",
                predator,
                "predators[0].pure_pursuit.max_turn_rate",
            ),
            (
                "/predators/0",
                json!({"learned": {"position": [0.0, 0.0], "velocity": [1.0, 0.0],
                                   "max_acceleration": 20.0, "max_speed": 0.0}}),
                "predators[0].learned.max_speed",
            ),
            (
                "/predators/0/constant_velocity/position",
                json!([1.0, 2.0, 3.0]),
                "predators[0].constant_velocity.position",
            ),
            (
                "/predators/0/constant_velocity/velocity/1",
                json!(null),
                "predators[0].constant_velocity.velocity[1]",
            ),
        ] {
            assert_eq!(refused(pointer, value), field);
        }
    }

    #[test]
    fn a_missing_field_is_named() {
        let mut document = paper();
        document.as_object_mut().expect("an object").remove("mass");
        let error = FlockConfig::from_json(&document.to_string()).expect_err("mass is missing");
        assert!(matches!(error, Error::Config { field, .. } if field == "mass"));
    }

    #[test]
    fn text_that_is_no_document_is_refused() {
        for text in ["", "{", "[]", "3", "null", "\u{0}"] {
            assert!(FlockConfig::from_json(text).is_err(), "{text:?}");
        }
    }
}
