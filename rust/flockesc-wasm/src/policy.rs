//! `PolicyFile`, `Observer` and `Network`: the policy in a file, the observation rows that it reads, and its network,
//! which sets ranges from them.

use flockesc_core::bindings::parse;
use flockesc_core::{
    ActionOptions, Architecture, EpisodeConfig, Error, FlockConfig, Head, NeighborRule,
    NetworkRanges, Networks, Progress, RangeMap, Result,
};
use serde::Deserialize;
use serde_json::{Map, Value};
use wasm_bindgen::prelude::*;

use crate::Flock;

type JsResult<T> = std::result::Result<T, JsError>;

/// The policy in a file: the network of a flock, with its options.
#[wasm_bindgen]
pub struct PolicyFile {
    architecture: Architecture,
    ranges: NetworkRanges,
    parameters: Vec<f32>,
    config: EpisodeConfig,
}

/// The header of a policy file, without what only Python reads.
#[derive(Deserialize)]
struct Header {
    model: String,
    #[serde(rename = "name")]
    _name: String,
    scenario: Value,
    per_agent: bool,
    options: Map<String, Value>,
    architecture: Value,
}

#[wasm_bindgen]
impl PolicyFile {
    /// Checks the policy of a header and parameters.
    ///
    /// # Errors
    /// An error that names the field, if `load_policy` of Python refuses the file or only Python can play it.
    #[wasm_bindgen(constructor)]
    pub fn new(header: &str, parameters: Vec<f32>) -> JsResult<Self> {
        let header: Header = parse(header)?;
        if header.model != "flock" {
            let given = format!("a policy for a {}", header.model);
            return Err(Error::input("model", "flock", given).into());
        }
        if let Value::String(rule) = &header.architecture {
            let given = format!("{rule}, a rule with parameters, which runs in Python only");
            return Err(Error::input("architecture", "a network", given).into());
        }
        let scenario = FlockConfig::from_json(&header.scenario.to_string())?;
        let is_topological = matches!(scenario.neighbor_rule, NeighborRule::Topological { .. });
        if is_topological && !header.options.contains_key("max_range") {
            let expected = "the largest number of neighbors, required by a topological rule";
            return Err(Error::input("max_range", expected, "none").into());
        }
        let view = if header.per_agent { "agent" } else { "flock" };
        let (actions, config) = split(header.options, view)?;
        let architecture = Architecture::from_json(&header.architecture.to_string())?;
        let map = RangeMap::from(actions);
        let choices = match architecture.head() {
            Head::Value | Head::Argmax => &architecture.ranges,
            Head::Candidates => &config.profile_ranges,
        };
        let set = |range: &f64| Ok(map.of(map.action_of(*range)?));
        let ranges = match architecture.head() {
            Head::Value => NetworkRanges::Normalized(map.normalized()?),
            Head::Argmax | Head::Candidates => {
                NetworkRanges::Choices(choices.iter().map(set).collect::<Result<_>>()?)
            }
        };
        let file = Self {
            architecture,
            ranges,
            parameters,
            config,
        };
        file.network(names(&file.config, &scenario))?;
        Ok(file)
    }

    /// The document of the options that decide what the policy observes.
    ///
    /// # Errors
    /// None: every option has a JSON value.
    #[wasm_bindgen(getter)]
    pub fn options(&self) -> JsResult<String> {
        Ok(serde_json::to_string(&self.config)?)
    }

    /// Number of model steps per action.
    #[wasm_bindgen(getter, js_name = stepsPerAction)]
    pub fn steps_per_action(&self) -> usize {
        self.config.steps_per_action
    }

    /// Creates the network of one episode, from the names of the entries of a row.
    ///
    /// # Errors
    /// An error that names an input that is not an entry.
    pub fn network(&self, entries: Vec<String>) -> JsResult<Network> {
        let ranges = self.ranges.clone();
        Ok(Network {
            networks: Networks::new(&self.architecture, &entries, ranges, &self.parameters, 1)?,
            ranges: self.ranges.clone(),
            memory_per_row: self.architecture.memory,
            memory: Vec::new(),
        })
    }
}

/// Splits the options of a file, as `EnvOptions` of Python, into those of actions and those of episodes.
fn split(options: Map<String, Value>, view: &str) -> Result<(ActionOptions, EpisodeConfig)> {
    let is_of_actions = |name: &str| ActionOptions::FIELDS.contains(&name);
    let (actions, mut options): (Map<_, _>, Map<_, _>) = options
        .into_iter()
        .partition(|(name, _)| is_of_actions(name));
    let actions = ActionOptions::from_json(&Value::Object(actions).to_string())?;
    let check = |name, is_good: fn(&Value) -> bool, expected| match options.get(name) {
        Some(value) if !is_good(value) => Err(Error::input(name, expected, value)),
        _ => Ok(()),
    };
    check("count_components", Value::is_boolean, "true or false")?;
    check("view", |_| false, "the field per_agent instead")?;
    let is_list = |value: &Value| value.as_array().is_none_or(|ranges| !ranges.is_empty());
    check("profile_ranges", is_list, "at least one range, or null")?;
    options.retain(|name, value| {
        name != "count_components" && (name != "profile_ranges" || !value.is_null())
    });
    options.insert("view".into(), view.into());
    options.insert("max_range".into(), actions.max_range.into());
    options.insert("steps_per_action".into(), actions.steps_per_action.into());
    let config = EpisodeConfig::from_json(&Value::Object(options).to_string())?;
    Ok((actions, config))
}

fn names(config: &EpisodeConfig, scenario: &FlockConfig) -> Vec<String> {
    let entries = config.entries(scenario.dimension).into_iter();
    entries.map(|entry| entry.name).collect()
}

/// A network and its memory during one episode.
#[wasm_bindgen]
pub struct Network {
    networks: Networks,
    ranges: NetworkRanges,
    memory_per_row: usize,
    memory: Vec<f64>,
}

#[wasm_bindgen]
impl Network {
    /// Returns the ranges in m for `count` observation rows.
    ///
    /// # Errors
    /// An error if there is another number of rows than before, or if a row has the wrong length.
    pub fn ranges(&mut self, observations: &[f32], count: usize) -> JsResult<Vec<f64>> {
        if self.memory.is_empty() {
            self.memory = vec![0.0; count * self.memory_per_row];
        }
        let progress = Progress::default();
        let outputs = self
            .networks
            .outputs(observations, &mut self.memory, &progress)?;
        let ranges = outputs.into_iter().map(|output| self.ranges.of(output));
        Ok(ranges.collect())
    }
}

/// The observation that a policy reads.
#[wasm_bindgen]
pub struct Observer {
    config: EpisodeConfig,
    rows: usize,
    entries: Vec<String>,
}

#[wasm_bindgen]
impl Observer {
    /// Creates the observer of flocks of a scenario. `options` are the policy's options.
    ///
    /// # Errors
    /// An error that names the field, if a document is not valid, or the scenario does not define the observation.
    #[wasm_bindgen(constructor)]
    pub fn new(scenario: &str, options: &str) -> JsResult<Self> {
        let scenario = FlockConfig::from_json(scenario)?;
        let config = EpisodeConfig::from_json(options)?;
        config.check_scenario(&scenario)?;
        Ok(Self {
            rows: config.view.rows(&scenario),
            entries: names(&config, &scenario),
            config,
        })
    }

    /// Names of the entries of a row.
    #[wasm_bindgen(getter)]
    pub fn entries(&self) -> Vec<String> {
        self.entries.clone()
    }

    /// Number of rows: one for the flock, or one per agent.
    #[wasm_bindgen(getter)]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the rows of a flock of this scenario that is played with one range per agent, or with the view of
    /// this observer.
    ///
    /// # Errors
    /// None in a page, where nobody cancels.
    pub fn observe(&self, flock: &Flock) -> JsResult<Vec<f32>> {
        let mut rows = vec![0.0; self.rows * self.entries.len()];
        flock.observe_as(&self.config, &mut rows)?;
        Ok(rows)
    }
}
