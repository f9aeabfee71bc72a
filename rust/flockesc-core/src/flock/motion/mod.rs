//! Motion of the agents (steps 2 to 4 of docs/model.md): forces, noise, and one law of motion per file.

mod columns;
mod forces;
mod inertial;
mod law;
mod noise;
mod parameters;
mod response;
mod reynolds;
mod step;
mod vicsek;

use serde::{Deserialize, Serialize};
use strum::{AsRefStr, VariantNames};

pub use inertial::Inertial;
pub use reynolds::Reynolds;
pub use vicsek::Vicsek;

pub(super) use parameters::Parameters;
pub(super) use response::{Response, ResponseState};
pub(super) use step::{Predators, advance};

use crate::agents::Group;
use crate::base::error::Result;
use crate::neighbor::OffsetBuffers;
use columns::ParameterColumns;
use forces::Force;
use law::{GroupPairs, Law};

/// Generates [`Motion`] and its methods from the list of all laws.
macro_rules! laws {
    ($($(#[$about:meta])* $Variant:ident($Law:ident),)+) => {
        /// The law of motion: how forces change velocities.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, AsRefStr, VariantNames)]
        #[serde(rename_all = "snake_case")]
        #[strum(serialize_all = "snake_case")]
        pub enum Motion {
            $($(#[$about])* $Variant($Law),)+
        }

        impl Motion {
            /// Names of all laws in a scenario.
            pub const KINDS: &'static [&'static str] = <Self as VariantNames>::VARIANTS;

            /// Checks the law's parameters.
            pub(crate) fn check(&self, constant_speed: bool) -> Result<()> {
                let path = format!("motion.{}", self.as_ref());
                match self {
                    $(Self::$Variant(law) => law.check(&path, constant_speed),)+
                }
            }

            /// Returns whether the law has forces between pairs of neighbors.
            pub(crate) fn needs_pairs(&self) -> bool {
                match self {
                    $(Self::$Variant(law) => law.needs_pairs(),)+
                }
            }

            /// Adds the forces between pairs to the agents of a group.
            fn add_pair_forces<const D: usize>(
                &self,
                pairs: &GroupPairs<'_, D>,
                buffers: &mut OffsetBuffers<D>,
                force: &mut Force<D>,
            ) {
                match self {
                    $(Self::$Variant(law) => law.add_pair_forces(pairs, buffers, force),)+
                }
            }

            /// Advances the positions and velocities of a group by one step.
            #[inline(always)]
            fn integrate<const D: usize>(
                &self,
                parameters: &Parameters<'_>,
                columns: &ParameterColumns,
                force: &Force<D>,
                group: &mut Group<D>,
            ) {
                match self {
                    $(Self::$Variant(law) => law.integrate(parameters, columns, force, group),)+
                }
            }
        }
    };
}

laws! {
    /// Forces change velocities.
    Inertial(Inertial),
    /// Forces set the new headings.
    Vicsek(Vicsek),
    /// Forces change velocities, and neighbors also attract and repel each other.
    Reynolds(Reynolds),
}
