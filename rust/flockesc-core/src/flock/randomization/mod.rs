//! Domain randomization: numbers of a scenario that every episode draws from its seed. One distribution per file.

mod choice;
mod distribution;
mod document;
mod log_uniform;
#[cfg(test)]
mod tests;
mod uniform;

use serde::{Deserialize, Serialize};

pub(super) use document::{check, draw};

use distribution::Draw;

/// Makes the list of all distributions. A module has the name of its distribution in documents.
macro_rules! distributions {
    ($($(#[$about:meta])* $module:ident::$Distribution:ident,)*) => {
        $(pub use $module::$Distribution;)*

        /// The distribution of a number of the scenario.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Distribution {
            $($(#[$about])* $Distribution($Distribution),)*
        }

        impl Distribution {
            /// The names of all distributions in documents.
            pub const KINDS: &[&str] = &[$(stringify!($module)),*];

            /// Its name in documents.
            fn kind(&self) -> &'static str {
                match self {
                    $(Self::$Distribution(_) => stringify!($module),)*
                }
            }

            fn as_draw(&self) -> &dyn Draw {
                match self {
                    $(Self::$Distribution(distribution) => distribution,)*
                }
            }
        }
    };
}

distributions! {
    /// Uniform.
    uniform::Uniform,
    /// Uniform in its logarithm; above 0.
    log_uniform::LogUniform,
    /// One of several values, all equally likely.
    choice::Choice,
}
