//! Domain randomization: every episode draws some numbers of the scenario from its seed. One distribution per
//! file.

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

/// Generates [`Distribution`] and its methods. The name of a distribution in documents is the name of its
/// module.
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
            /// Names of all distributions in documents.
            pub const KINDS: &[&str] = &[$(stringify!($module)),*];

            /// Returns its name in documents.
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
    /// Uniform on an interval.
    uniform::Uniform,
    /// Log-uniform on an interval above 0.
    log_uniform::LogUniform,
    /// One of several numbers, all equally likely.
    choice::Choice,
}
