//! `Motion`: the laws of motion, as in a scenario.

use serde::{Deserialize, Serialize};
use strum::{AsRefStr, VariantNames};

use super::forces::{Force, Neighbors, ParameterColumns};
use super::inertial;
use crate::agents::Group;
use crate::base::check::{not_negative, positive_quantity, quantity, require};
use crate::base::error::Result;
use crate::flock::scenario::FlockConfig;
use crate::neighbor::OffsetBuffers;

/// The law of motion: how forces change velocities.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, AsRefStr, VariantNames)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[strum(serialize_all = "snake_case")]
pub enum Motion {
    /// Forces change velocities.
    Inertial {},
    /// Forces set the new headings; the mass has no effect.
    Vicsek {},
    /// Forces change velocities, and neighbors also attract and repel each other.
    Reynolds(Reynolds),
    /// Forces change velocities, and neighbors also keep a preferred distance.
    PreferredDistance(PreferredDistance),
    /// Headings turn at a limited rate toward the direction of zones with priority.
    Zones(Zones),
    /// Forces, among them attraction and repulsion of neighbors, are velocities.
    FirstOrder(FirstOrder),
}

/// What a law of motion needs from a step.
pub(crate) struct Needs {
    /// Forces between pairs of neighbors.
    pub(crate) pairs: bool,
    /// The numbers of neighbors.
    pub(crate) counts: bool,
    /// An escape force that falls with the distance.
    pub(crate) decaying_escape: bool,
}

impl Motion {
    /// Checks the law's parameters, and fields of the scenario that it cannot use.
    pub(crate) fn check(&self, constant_speed: bool, sensing_noise: f64) -> Result<()> {
        let needs_constant_speed = || {
            let expected = format!("true if motion is {}", self.as_ref());
            require(constant_speed, "constant_speed", &expected, constant_speed)
        };
        match self {
            Self::Inertial {} => Ok(()),
            Self::Vicsek {} => needs_constant_speed(),
            Self::Reynolds(law) => law.check(),
            Self::PreferredDistance(law) => law.check(),
            Self::Zones(law) => {
                needs_constant_speed()?;
                let (is_exact, expected) = (sensing_noise <= 0.0, "0 if motion is zones");
                require(is_exact, "sensing_noise", expected, sensing_noise)?;
                law.check()
            }
            Self::FirstOrder(law) => law.check(),
        }
    }

    /// Returns what the law needs from a step.
    pub(crate) fn needs(&self) -> Needs {
        let (mut pairs, mut counts, mut decaying_escape) = (true, false, false);
        match self {
            Self::Inertial {} | Self::Vicsek {} => pairs = false,
            Self::Reynolds(_) | Self::Zones(_) => {}
            Self::PreferredDistance(_) => counts = true,
            Self::FirstOrder(_) => decaying_escape = true,
        }
        Needs {
            pairs,
            counts,
            decaying_escape,
        }
    }

    /// Adds the forces between pairs of neighbors to the agents of a group.
    pub(super) fn add_pair_forces<const D: usize>(
        &self,
        neighbors: &Neighbors<'_, D>,
        group: usize,
        columns: &ParameterColumns,
        buffers: &mut OffsetBuffers<D>,
        force: &mut Force<D>,
    ) {
        match self {
            Self::Inertial {} | Self::Vicsek {} => {}
            Self::Reynolds(law) => law.add_forces(neighbors, group, columns, buffers, force),
            Self::PreferredDistance(law) => {
                law.add_forces(neighbors, group, columns, buffers, force);
            }
            Self::Zones(law) => law.set_forces(neighbors, group, columns, buffers, force),
            Self::FirstOrder(law) => law.add_forces(neighbors, group, buffers, force),
        }
    }

    /// Moves the agents of a group, and sets their velocities from the forces.
    #[inline(always)]
    pub(super) fn integrate<const D: usize>(
        &self,
        config: &FlockConfig,
        columns: &ParameterColumns,
        force: &Force<D>,
        group: &mut Group<D>,
    ) {
        match self {
            Self::Inertial {} | Self::Reynolds(_) | Self::PreferredDistance(_) => {
                inertial::integrate(config, columns, force, group);
            }
            Self::Vicsek {} => inertial::integrate_vicsek(config, columns, force, group),
            Self::Zones(law) => law.integrate(config, columns, force, group),
            Self::FirstOrder(_) => FirstOrder::integrate(config, columns, force, group),
        }
    }
}

/// Forces change velocities, and neighbors also attract and repel each other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reynolds {
    /// Weight of the force away from close neighbors, at least 0.
    pub separation_strength: f64,
    /// Weight of the force toward the center of the neighbors, at least 0.
    pub cohesion_strength: f64,
    /// Distance in m up to which a neighbor is close, at least 0.
    pub separation_range: f64,
}

impl Reynolds {
    fn check(&self) -> Result<()> {
        let field = |name: &str| format!("motion.reynolds.{name}");
        quantity(&field("separation_strength"), self.separation_strength)?;
        quantity(&field("cohesion_strength"), self.cohesion_strength)?;
        not_negative(&field("separation_range"), self.separation_range)
    }
}

/// Forces change velocities, and neighbors also keep a preferred distance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PreferredDistance {
    /// Weight of the force, at least 0.
    pub strength: f64,
    /// Distance in m at which a neighbor neither attracts nor repels, at least 0.
    pub distance: f64,
    /// Difference in m from that distance at which the force has tanh(1) of its largest norm, from 1e-20 to 1e20.
    pub width: f64,
}

impl PreferredDistance {
    fn check(&self) -> Result<()> {
        let field = |name: &str| format!("motion.preferred_distance.{name}");
        quantity(&field("strength"), self.strength)?;
        quantity(&field("distance"), self.distance)?;
        positive_quantity(&field("width"), self.width)
    }
}

/// Headings turn at a limited rate toward the direction of zones with priority.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Zones {
    /// Distance in m up to which neighbors repel, at least 0. If there is one, all others are ignored.
    pub repulsion_radius: f64,
    /// Distance in m up to which neighbors beyond align, at least 0. All others attract.
    pub orientation_radius: f64,
    /// Largest turn rate in rad/s, at least 0.
    pub max_turn_rate: f64,
}

impl Zones {
    fn check(&self) -> Result<()> {
        let field = |name: &str| format!("motion.zones.{name}");
        not_negative(&field("repulsion_radius"), self.repulsion_radius)?;
        not_negative(&field("orientation_radius"), self.orientation_radius)?;
        quantity(&field("max_turn_rate"), self.max_turn_rate)
    }
}

/// Forces, among them attraction and repulsion of neighbors, are velocities.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FirstOrder {
    /// Strength in m^2/s of the repulsion between neighbors, at least 0.
    pub repulsion: f64,
    /// Strength in 1/s of the attraction between neighbors, at least 0.
    pub attraction: f64,
}

impl FirstOrder {
    fn check(&self) -> Result<()> {
        let field = |name: &str| format!("motion.first_order.{name}");
        quantity(&field("repulsion"), self.repulsion)?;
        quantity(&field("attraction"), self.attraction)
    }
}
