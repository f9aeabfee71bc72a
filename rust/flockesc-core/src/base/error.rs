//! The one error type of the core: which field, what it had to be, what came.

/// What went wrong; every variant is the caller's to mend and nothing has changed when it is returned.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// A scenario, option or other document does not fit the schema or its bounds.
    #[error("{field}: expected {expected}, got {given}")]
    Config {
        /// Path of the field, for example `predators[0].pure_pursuit.max_turn_rate`.
        field: String,
        /// What would have been accepted.
        expected: String,
        /// What came.
        given: String,
    },
    /// An argument of a call has the wrong shape or value.
    #[error("{field}: expected {expected}, got {given}")]
    Argument {
        /// Name of the argument, with the index of the offending entry.
        field: String,
        /// What would have been accepted.
        expected: String,
        /// What came.
        given: String,
    },
    /// A call came at the wrong moment of an episode.
    #[error("{message}")]
    Episode {
        /// The situation, as a sentence.
        message: String,
    },
    /// A long call was told to stop before it had finished.
    #[error("interrupted")]
    Interrupted,
}

/// Result of the core.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub(crate) fn config(
        field: impl Into<String>,
        expected: impl Into<String>,
        given: impl ToString,
    ) -> Self {
        Self::Config {
            field: field.into(),
            expected: expected.into(),
            given: given.to_string(),
        }
    }

    /// An [`Error::Argument`].
    pub fn argument(
        field: impl Into<String>,
        expected: impl Into<String>,
        given: impl ToString,
    ) -> Self {
        Self::Argument {
            field: field.into(),
            expected: expected.into(),
            given: given.to_string(),
        }
    }

    pub(crate) fn episode(message: impl Into<String>) -> Self {
        Self::Episode {
            message: message.into(),
        }
    }
}
