//! `Network`: a policy file's network, which sets ranges from observation rows.

use flockesc_core::{Architecture, Head, NetworkRanges, Networks, NormalizedRange, Progress};
use wasm_bindgen::prelude::*;

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
        let outputs =
            self.networks
                .outputs(observations, &mut self.memory, &Progress::default())?;
        Ok(outputs
            .into_iter()
            .map(|output| self.ranges.of(output))
            .collect())
    }
}
