//! `Architecture`: the inputs and layers of a network, parsed from a document.

use std::iter::once;

use serde::{Deserialize, Serialize};

use crate::base::check::{MAX_AGENTS, within};
use crate::base::document::parse;
use crate::base::error::{Error, Result};

/// Inputs and layers of a network: tanh layers, then a linear layer. Its first output is the
/// action, the others are the memory.
///
/// ```
/// use flockesc_core::Architecture;
///
/// let network = Architecture { inputs: vec!["time".to_owned()], ..Architecture::default() };
/// assert_eq!(network.size(), (1 + 1) * 8 + (8 + 1) * 1);
/// assert_eq!(Architecture::from_json(r#"{"inputs": ["time"]}"#)?, network);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Architecture {
    /// Names of the observation entries that are inputs.
    pub inputs: Vec<String>,
    /// Names of the entries of a candidate range that are inputs, without `profile_k_`, or `range`, the
    /// candidate divided by the largest one. The output is then the score of the candidate, and the action is
    /// the candidate with the highest score, the shortest among equals.
    pub candidate_inputs: Vec<String>,
    /// Width of every hidden layer, at least 1.
    pub hidden: Vec<usize>,
    /// Number of recurrent values. The network outputs them with every action and receives them as
    /// inputs for the next. They are 0 at the start of an episode.
    pub memory: usize,
    /// Whether observations of agents are reflected such that the predator is on the left.
    pub mirror: bool,
    /// The function that maps the action to [-1, 1].
    pub squash: Squash,
}

/// A function that maps an action to [-1, 1].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Squash {
    /// Clamps the action.
    Clip,
    /// Computes the tanh of the action.
    Tanh,
}

impl Default for Architecture {
    /// Returns an architecture without inputs, with one hidden layer of width 8.
    fn default() -> Self {
        Self {
            inputs: Vec::new(),
            candidate_inputs: Vec::new(),
            hidden: vec![8],
            memory: 0,
            mirror: false,
            squash: Squash::Clip,
        }
    }
}

impl Architecture {
    /// Parses and checks a JSON document.
    ///
    /// # Errors
    /// [`Error::Config`] if a field is unknown, has the wrong type or is out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let architecture: Self = parse(document)?;
        architecture.check()?;
        Ok(architecture)
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::Config`] if a field is out of bounds.
    pub fn check(&self) -> Result<()> {
        if self.inputs.is_empty() && self.candidate_inputs.is_empty() {
            return Err(Error::config("inputs", "at least one name", "none"));
        }
        for (index, width) in self.hidden.iter().enumerate() {
            within(&format!("hidden[{index}]"), *width, 1, MAX_AGENTS)?;
        }
        let most = if self.is_scorer() { 0 } else { MAX_AGENTS };
        within("memory", self.memory, 0, most)
    }

    /// Returns whether the network scores candidate ranges.
    #[must_use]
    pub fn is_scorer(&self) -> bool {
        !self.candidate_inputs.is_empty()
    }

    /// Returns the number of parameters. Every layer has its weights, one row per input, and then
    /// its biases.
    #[must_use]
    pub fn size(&self) -> usize {
        let sizes = self.shapes().into_iter();
        let sizes = sizes.map(|(rows, columns)| (rows + 1).saturating_mul(columns));
        sizes.fold(0, usize::saturating_add)
    }

    /// Returns the numbers of inputs and outputs of every layer.
    pub(super) fn shapes(&self) -> Vec<(usize, usize)> {
        let widths: Vec<usize> =
            once(self.inputs.len() + self.candidate_inputs.len() + self.memory)
                .chain(self.hidden.iter().copied())
                .chain(once(1 + self.memory))
                .collect();
        widths.windows(2).map(|pair| (pair[0], pair[1])).collect()
    }
}
