//! `Observer` and `Network`: the observation rows that a policy reads, and its network, which sets ranges from them.

use flockesc_core::{
    Architecture, EpisodeConfig, FlockConfig, Head, NetworkRanges, Networks, NormalizedRange,
    Progress,
};
use wasm_bindgen::prelude::*;

use crate::Flock;

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
    /// Creates a network from the document of its architecture, the names of the entries of a row, ranges in m,
    /// and its parameters. The ranges are those of the actions -1, 1 and optionally 0 or, for a network that chooses,
    /// those to choose from.
    ///
    /// # Errors
    /// An error that names the field, if they do not fit together.
    #[wasm_bindgen(constructor)]
    pub fn new(
        architecture: &str,
        entries: Vec<String>,
        ranges: Vec<f64>,
        parameters: &[f32],
    ) -> Result<Self, JsError> {
        let architecture = Architecture::from_json(architecture)?;
        let ranges = match (architecture.head(), &ranges[..]) {
            (Head::Value, &[min_range, max_range, ref rest @ ..]) if rest.len() < 2 => {
                NetworkRanges::Normalized(NormalizedRange {
                    min_range,
                    max_range,
                    center: rest.first().copied(),
                })
            }
            (Head::Value, _) => {
                return Err(JsError::new("ranges: expected a least and a largest range"));
            }
            (Head::Argmax | Head::Candidates, _) => NetworkRanges::Choices(ranges),
        };
        Ok(Self {
            networks: Networks::new(&architecture, &entries, ranges.clone(), parameters, 1)?,
            ranges,
            memory_per_row: architecture.memory,
            memory: Vec::new(),
        })
    }

    /// Returns the ranges in m for `count` observation rows.
    ///
    /// # Errors
    /// An error if there is another number of rows than before, or if a row has the wrong length.
    pub fn ranges(&mut self, observations: &[f32], count: usize) -> Result<Vec<f64>, JsError> {
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
    pub fn new(scenario: &str, options: &str) -> Result<Self, JsError> {
        let scenario = FlockConfig::from_json(scenario)?;
        let config = EpisodeConfig::from_json(options)?;
        config.check_scenario(&scenario)?;
        let entries = config.entries(scenario.dimension).into_iter();
        Ok(Self {
            rows: config.view.rows(&scenario),
            entries: entries.map(|entry| entry.name).collect(),
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

    /// Returns the rows of a flock of this scenario that is played with one range per agent.
    ///
    /// # Errors
    /// None in a page, where nobody cancels.
    pub fn observe(&self, flock: &Flock) -> Result<Vec<f32>, JsError> {
        let length = self.rows * self.entries.len();
        Ok(flock.observe_as(&self.config, length)?)
    }
}
