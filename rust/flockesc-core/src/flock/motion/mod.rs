//! The agents' motion (steps 2 to 4 of docs/model.md): one law per file, and the list of all.

mod forces;
mod inertial;
mod law;
mod noise;
mod parameters;
mod response;
mod reynolds;
mod step;
mod traits;
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
use crate::base::exact::Scale;
use crate::neighbor::Pairs;
use forces::Force;
use law::{Law, PairBuffers};
use traits::Traits;

/// Makes the list of all laws, and everything that matches on a law.
macro_rules! laws {
    ($($(#[$about:meta])* $Variant:ident($Law:ident),)+) => {
        /// The law by which forces set velocities.
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

            /// Whether the law has forces between pairs of neighbors.
            pub(crate) fn needs_pairs(&self) -> bool {
                match self {
                    $(Self::$Variant(law) => law.needs_pairs(),)+
                }
            }

            /// Adds these forces on the agents of a group.
            fn add_pair_forces<const D: usize>(
                &self,
                pairs: &Pairs<'_, D>,
                scale: Scale,
                group: usize,
                traits: &Traits,
                buffers: &mut PairBuffers<D>,
                force: &mut Force<D>,
            ) {
                match self {
                    $(Self::$Variant(law) => {
                        law.add_pair_forces(pairs, scale, group, traits, buffers, force);
                    })+
                }
            }

            /// Advances positions and velocities of a group by one step.
            #[inline(always)]
            fn integrate<const D: usize>(
                &self,
                parameters: &Parameters<'_>,
                traits: &Traits,
                force: &Force<D>,
                group: &mut Group<D>,
            ) {
                match self {
                    $(Self::$Variant(law) => law.integrate(parameters, traits, force, group),)+
                }
            }
        }
    };
}

laws! {
    /// Forces change velocities.
    Inertial(Inertial),
    /// Forces are the new headings.
    Vicsek(Vicsek),
    /// Forces change velocities, and neighbors also attract and repel each other.
    Reynolds(Reynolds),
}
