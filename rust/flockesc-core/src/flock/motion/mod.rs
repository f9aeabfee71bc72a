//! How agents move, in the order of docs/model.md: steps 2 to 4, and the distances after them. One law per file.

mod forces;
mod inertial;
mod noise;
mod response;
mod reynolds;
mod traits;
mod vicsek;

use multiversion::multiversion;
use serde::Deserialize;

pub use inertial::Inertial;
pub use reynolds::Reynolds;
pub use vicsek::Vicsek;

pub(super) use response::{Response, ResponseState};

use crate::agents::{Column, GROUP, Group};
use crate::base::error::{Error, Result};
use crate::flock::metrics::distances;
use crate::flock::scenario::FlockConfig;
use crate::neighbor::Heard;
use forces::{add_escape_force, consensus_force};
use traits::Traits;

/// The law by which forces set velocities.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// Forces change velocities.
    Inertial(Inertial),
    /// Forces are the new headings.
    Vicsek(Vicsek),
    /// Forces change velocities, and neighbors attract and repel each other, too.
    Reynolds(Reynolds),
}

impl Motion {
    pub(crate) fn check(&self, constant_speed: bool) -> Result<()> {
        match self {
            Self::Vicsek(_) if !constant_speed => Err(Error::config(
                "constant_speed",
                "true, as motion is vicsek",
                constant_speed,
            )),
            Self::Inertial(_) | Self::Vicsek(_) => Ok(()),
            Self::Reynolds(law) => law.check(),
        }
    }
}

/// A force on every agent of a group.
type Force<const D: usize> = [Column<f64>; D];

/// Where the predators are before and after a step, in m.
pub(super) struct Predators<'a, const D: usize> {
    pub(super) before: &'a [[f64; D]],
    pub(super) after: &'a [[f64; D]],
}

/// Advances the agents of these `names` by one step under what they heard, or where there is one under their
/// `response` to it, and measures how far the predators are then.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn advance<const D: usize>(
    config: &FlockConfig,
    predators: &Predators<'_, D>,
    names: &[u32],
    groups: &mut [Group<D>],
    heard: &mut [Heard<D>],
    response: Option<&[Force<D>]>,
) {
    let mut traits = Traits::of_first(config);
    let agents = groups.iter_mut().zip(heard).zip(names.chunks(GROUP));
    for (index, ((group, heard), names)) in agents.enumerate() {
        traits.follow(config, names);
        let mut force = match response {
            None => consensus_force(&traits, heard),
            Some(forces) => forces[index],
        };
        match predators.before {
            // The nearest predator is the only one.
            [only] => add_escape_force(config, &traits, group, only, &group.distance, &mut force),
            many => {
                for predator in many {
                    let distance = distances(&group.position, &[*predator]);
                    add_escape_force(config, &traits, group, predator, &distance, &mut force);
                }
            }
        }
        match config.motion {
            Motion::Inertial(_) | Motion::Reynolds(_) => {
                inertial::integrate(config, &traits, &force, group);
            }
            Motion::Vicsek(_) => vicsek::integrate(config, &traits, &force, group),
        }
        group.distance = distances(&group.position, predators.after);
    }
}
