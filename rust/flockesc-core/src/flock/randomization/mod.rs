//! Domain randomization: numbers of a scenario that every episode draws from its seed. One distribution per file.

mod choice;
mod document;
mod log_uniform;
#[cfg(test)]
mod tests;
mod uniform;

use serde::{Deserialize, Serialize};

pub(super) use document::{check, draw};

use crate::base::check::finite;
use crate::base::error::{Error, Result};

/// A distribution of one number of the scenario.
trait Draw {
    /// Path of the number in the scenario.
    fn field(&self) -> &str;

    /// Checks the parameters; errors begin with `path`.
    fn check(&self, path: &str) -> Result<()>;

    /// The smallest and the largest value, or all values.
    fn ends(&self) -> Vec<End>;

    /// The value for a uniform `part` in [0, 1). Rounding does not carry it out of the ends.
    fn draw(&self, part: f64) -> f64;
}

/// A value, and the parameter that holds it.
type End = (String, f64);

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

/// The number at `part` of the way from `low` to `high`.
fn between(low: f64, high: f64, part: f64) -> f64 {
    low * (1.0 - part) + high * part
}

/// The ends of an interval.
fn interval_ends(low: f64, high: f64) -> Vec<End> {
    vec![("low".to_owned(), low), ("high".to_owned(), high)]
}

/// Checks the ends of an interval.
fn check_interval(path: &str, low: f64, high: f64) -> Result<()> {
    finite(&format!("{path}.low"), low)?;
    let field = format!("{path}.high");
    finite(&field, high)?;
    if low <= high {
        return Ok(());
    }
    let expected = format!("a number of at least low = {low:?}");
    Err(Error::config(field, expected, high))
}
