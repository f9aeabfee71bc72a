//! The error type of the crate.

/// The error type of the crate. All errors but [`Error::Rounding`], [`Error::Memory`] and [`Error::Interrupted`] are
/// caused by the caller's input. A call that returns one of them has changed nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// A field of a scenario or of options, or an argument, is unknown or has the wrong type or value.
    #[error("{field}: expected {expected}, got {given}")]
    Input {
        /// Path of the field, for example `predators[0].pure_pursuit.max_turn_rate`, or name of the argument.
        field: String,
        /// Description of the accepted values.
        expected: String,
        /// The rejected value.
        given: String,
    },
    /// A call came before the first reset or after the end of an episode.
    #[error("{message}")]
    Episode {
        /// The situation, as a sentence.
        message: String,
    },
    /// The thread that makes a call does not round to nearest.
    #[error(
        "this thread does not round to nearest, which results depend on; another library has called \
         fesetround()"
    )]
    Rounding,
    /// The system did not grant the memory for an argument.
    #[error("{field}: {bytes} bytes are not available")]
    Memory {
        /// Name of the argument that determines the size.
        field: String,
        /// The size.
        bytes: u128,
    },
    /// A long call was cancelled before it finished.
    #[error("interrupted")]
    Interrupted,
}

/// A `Result` with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Creates an [`Error::Input`].
    pub fn input(
        field: impl Into<String>,
        expected: impl Into<String>,
        given: impl ToString,
    ) -> Self {
        Self::Input {
            field: field.into(),
            expected: expected.into(),
            given: given.to_string(),
        }
    }

    /// Creates the error for `len` items that there is no memory for.
    pub(crate) fn memory<T>(field: &str, len: usize) -> Self {
        Self::Memory {
            field: field.to_owned(),
            bytes: len as u128 * size_of::<T>() as u128,
        }
    }

    pub(crate) fn episode(message: impl Into<String>) -> Self {
        Self::Episode {
            message: message.into(),
        }
    }
}
