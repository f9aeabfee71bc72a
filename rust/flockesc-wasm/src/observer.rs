//! `Observer`: the observation rows of a policy, of a flock that is played with other options.

use flockesc_core::{EpisodeConfig, FlockConfig};
use wasm_bindgen::prelude::*;

use crate::Flock;

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
        let mut rows = vec![0.0; self.rows * self.entries.len()];
        flock.observe_as(&self.config, &mut rows)?;
        Ok(rows)
    }
}
