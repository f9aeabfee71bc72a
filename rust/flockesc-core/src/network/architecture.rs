//! The shape of a network, and the document that it comes from.

use std::iter::once;

use serde::{Deserialize, Serialize};

use crate::base::check::{MAX_AGENTS, within};
use crate::base::document::parse;
use crate::base::error::{Error, Result};

/// What a network sees and how it is built: tanh layers, then a linear one whose first output is the action.
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
    /// Names of the observation entries that it sees.
    pub inputs: Vec<String>,
    /// Width of every hidden layer, at least 1.
    pub hidden: Vec<usize>,
    /// Numbers that it writes after every action and reads before the next; 0 where an episode begins.
    pub memory: usize,
    /// Whether agents see the world reflected such that the predator is on their left.
    pub mirror: bool,
    /// How the action is brought into [-1, 1].
    pub squash: Squash,
}

/// How an action is brought into [-1, 1].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Squash {
    /// Clamped.
    Clip,
    /// By tanh.
    Tanh,
}

impl Default for Architecture {
    /// One hidden layer of 8.
    fn default() -> Self {
        Self {
            inputs: Vec::new(),
            hidden: vec![8],
            memory: 0,
            mirror: false,
            squash: Squash::Clip,
        }
    }
}

impl Architecture {
    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`Error::Config`] naming the field that is unknown, of a wrong type or out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let architecture: Self = parse(document)?;
        architecture.check()?;
        Ok(architecture)
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::Config`] naming the field that is out of bounds.
    pub fn check(&self) -> Result<()> {
        if self.inputs.is_empty() {
            return Err(Error::config("inputs", "at least one name", "none"));
        }
        for (index, width) in self.hidden.iter().enumerate() {
            within(&format!("hidden[{index}]"), *width, 1, MAX_AGENTS)?;
        }
        within("memory", self.memory, 0, MAX_AGENTS)
    }

    /// Numbers of parameters: per layer the weights, row by row (a row per input), then the biases.
    #[must_use]
    pub fn size(&self) -> usize {
        let sizes = self.shapes().into_iter();
        let sizes = sizes.map(|(rows, columns)| (rows + 1).saturating_mul(columns));
        sizes.fold(0, usize::saturating_add)
    }

    /// Inputs and outputs of every layer.
    pub(super) fn shapes(&self) -> Vec<(usize, usize)> {
        let widths: Vec<usize> = once(self.inputs.len() + self.memory)
            .chain(self.hidden.iter().copied())
            .chain(once(1 + self.memory))
            .collect();
        widths.windows(2).map(|pair| (pair[0], pair[1])).collect()
    }
}
