//! The trait of the distributions of initial positions and headings, and the macro that generates their
//! enums.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;

use super::space::Space;
use crate::base::error::Result;

/// A distribution of one vector per agent.
pub(super) trait Distribution {
    /// Checks the parameters for a flock of `count` agents. `path` is the distribution's path in the
    /// scenario.
    fn check(&self, _path: &str, _space: &Space, _count: usize) -> Result<()> {
        Ok(())
    }

    /// Draws the vectors of `count` agents: positions in m, or headings of length 1 up to rounding.
    fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>>;
}

/// Calls `draw` `count` times and collects the results.
pub(super) fn repeat<T>(count: usize, draw: impl FnMut() -> T) -> Vec<T> {
    std::iter::repeat_with(draw).take(count).collect()
}

/// Generates the enum of a family of distributions and its methods.
macro_rules! distributions {
    (
        $(#[$about:meta])*
        pub enum $Family:ident in $field:literal {
            $($(#[$note:meta])* $Variant:ident($Part:ident),)+
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[derive(strum::AsRefStr, strum::VariantNames)]
        #[serde(rename_all = "snake_case")]
        #[strum(serialize_all = "snake_case")]
        pub enum $Family {
            $($(#[$note])* $Variant($Part),)+
        }

        impl $Family {
            /// Names of all distributions in a scenario.
            pub const KINDS: &'static [&'static str] = <Self as strum::VariantNames>::VARIANTS;

            /// Checks the parameters for a flock of `count` agents.
            pub(crate) fn check(&self, space: &Space, count: usize) -> Result<()> {
                let path = format!("{}.{}", $field, self.as_ref());
                match self {
                    $(Self::$Variant(part) => part.check(&path, space, count),)+
                }
            }

            /// Draws the vectors of `count` agents.
            pub(crate) fn draw<const D: usize>(
                &self,
                space: &Space,
                count: usize,
                rng: &mut ChaCha8Rng,
            ) -> Vec<SVector<f64, D>> {
                match self {
                    $(Self::$Variant(part) => part.draw(space, count, rng),)+
                }
            }
        }
    };
}
pub(super) use distributions;
