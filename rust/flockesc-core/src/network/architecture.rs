//! `Architecture`: the inputs and layers of a network, parsed from a document.

use std::iter::once;

use serde::{Deserialize, Serialize};

use crate::base::check::{MAX_AGENTS, require, within};
use crate::base::document::parse;
use crate::base::error::Result;

/// Inputs, layers and head of a network: hidden layers, then a linear layer, whose outputs the head turns into a
/// range.
///
/// ```
/// use flockesc_core::Architecture;
///
/// let network = Architecture { inputs: vec!["time".to_owned()], ..Architecture::default() };
/// assert_eq!(network.size(), (1 + 1) * 8 + (8 + 1) * 1);
/// assert_eq!(Architecture::from_json(r#"{"inputs": ["time"]}"#)?, network);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Architecture {
    /// Names of the observation entries that are inputs.
    pub inputs: Vec<String>,
    /// Names of the entries of a candidate range that are inputs, without `profile_k_`, or `range`, the
    /// candidate divided by the largest one. Not empty: the head is [`Head::Candidates`].
    pub candidate_inputs: Vec<String>,
    /// Ranges in m to choose from. Not empty: the head is [`Head::Argmax`].
    pub ranges: Vec<f64>,
    /// Width of every hidden layer, at least 1.
    pub hidden: Vec<usize>,
    /// The function of every hidden layer.
    pub activation: Activation,
    /// Number of recurrent values of [`Head::Value`]. The network outputs them with every action and receives
    /// them as inputs for the next. They are 0 at the start of an episode.
    pub memory: usize,
    /// Whether observations of agents are reflected such that the predator is on the left.
    pub mirror: bool,
    /// The function that maps the action to [-1, 1].
    pub squash: Squash,
}

/// What the outputs of the last layer are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Head {
    /// The action in [-1, 1], then the memory.
    Value,
    /// One score per entry of [`Architecture::ranges`]. The highest one sets the range, the first among equals.
    Argmax,
    /// The score of one candidate range. The layers are computed for every candidate, and the highest score sets
    /// the range, the first among equals.
    Candidates,
}

/// The function that a hidden layer applies to its sums.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Activation {
    /// Computes the tanh.
    #[default]
    Tanh,
    /// Replaces negative numbers by 0.
    Relu,
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
            ranges: Vec::new(),
            hidden: vec![8],
            activation: Activation::Tanh,
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
    /// [`crate::Error::Input`] if a field is unknown, has the wrong type or is out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let architecture: Self = parse(document)?;
        architecture.check()?;
        Ok(architecture)
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if a field is out of bounds.
    pub fn check(&self) -> Result<()> {
        let has_inputs = !self.inputs.is_empty() || !self.candidate_inputs.is_empty();
        require(has_inputs, "inputs", "at least one name", "none")?;
        for (index, width) in self.hidden.iter().enumerate() {
            within(&format!("hidden[{index}]"), *width, 1, MAX_AGENTS)?;
        }
        let has_one_head = self.candidate_inputs.is_empty() || self.ranges.is_empty();
        require(
            has_one_head,
            "ranges",
            "none for a network that scores candidates",
            "some",
        )?;
        let most = match self.head() {
            Head::Value => MAX_AGENTS,
            Head::Argmax | Head::Candidates => 0,
        };
        within("memory", self.memory, 0, most)
    }

    /// Returns the head.
    pub fn head(&self) -> Head {
        match (&self.candidate_inputs[..], &self.ranges[..]) {
            ([], []) => Head::Value,
            ([], _) => Head::Argmax,
            _ => Head::Candidates,
        }
    }

    /// Returns the number of parameters. Every layer has its weights, one row per input, and then
    /// its biases.
    pub fn size(&self) -> usize {
        let sizes = self.shapes().into_iter();
        let sizes = sizes.map(|(rows, columns)| (rows + 1).saturating_mul(columns));
        sizes.fold(0, usize::saturating_add)
    }

    /// Returns the numbers of inputs and outputs of every layer.
    pub(super) fn shapes(&self) -> Vec<(usize, usize)> {
        let inputs = self.inputs.len() + self.candidate_inputs.len() + self.memory;
        let outputs = match self.head() {
            Head::Value => 1 + self.memory,
            Head::Argmax => self.ranges.len(),
            Head::Candidates => 1,
        };
        let hidden = self.hidden.iter().copied();
        let widths: Vec<usize> = once(inputs).chain(hidden).chain(once(outputs)).collect();
        widths.windows(2).map(|pair| (pair[0], pair[1])).collect()
    }
}
