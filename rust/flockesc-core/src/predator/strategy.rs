//! `PredatorConfig`: the enum of all strategies, one struct per file.

use serde::{Deserialize, Serialize};
use strum::{AsRefStr, VariantNames};

pub use super::constant_velocity::ConstantVelocity;
pub use super::encircle::Encircle;
pub use super::herd::Herd;
pub use super::intercept::Intercept;
pub use super::learned::Learned;
pub use super::prescribed_path::PrescribedPath;
pub use super::pure_pursuit::{PurePursuit, Target};
pub use super::wandering::Wandering;

use super::shared::predator::{Predator, Surroundings};
use crate::base::check::vector;
use crate::base::error::Result;
use crate::base::vector::embed;
use crate::snapshot::{read, write};

/// A predator of a scenario: its strategy and initial state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, AsRefStr, VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum PredatorConfig {
    /// Flies straight on.
    ConstantVelocity(ConstantVelocity),
    /// Turns toward an agent or the centroid of the flock.
    PurePursuit(PurePursuit),
    /// Turns in proportion to the turn rate of the line of sight to the nearest agent.
    Intercept(Intercept),
    /// Turns at random.
    Wandering(Wandering),
    /// Turns toward a station on a circle around the flock.
    Encircle(Encircle),
    /// Turns toward a point behind the flock.
    Herd(Herd),
    /// Accelerates by the action of a policy.
    Learned(Learned),
    /// Follows a prescribed path.
    PrescribedPath(PrescribedPath),
}

impl PredatorConfig {
    /// Names of all strategies in documents.
    pub const KINDS: &[&str] = <Self as VariantNames>::VARIANTS;

    /// Returns whether the predator is controlled by actions.
    pub(crate) fn is_learned(&self) -> bool {
        matches!(self, Self::Learned(_))
    }

    /// Returns whether an initial state cannot replace the initial position and velocity.
    pub(crate) fn has_fixed_start(&self) -> bool {
        matches!(self.start_fields(), Start::Path(_))
    }

    /// Returns whether the predator pursues the agent that is assigned to it.
    pub(super) fn has_assigned_target(&self) -> bool {
        matches!(self, Self::PurePursuit(pursuit) if pursuit.target == Target::Assigned)
    }

    /// Returns the fields that determine the predator at t = 0.
    fn start_fields(&self) -> Start<'_> {
        match self {
            Self::ConstantVelocity(own) => Start::Given(&own.position, &own.velocity),
            Self::PurePursuit(own) => Start::Given(&own.position, &own.velocity),
            Self::Intercept(own) => Start::Given(&own.position, &own.velocity),
            Self::Wandering(own) => Start::Given(&own.position, &own.velocity),
            Self::Encircle(own) => Start::Given(&own.position, &own.velocity),
            Self::Herd(own) => Start::Given(&own.position, &own.velocity),
            Self::Learned(own) => Start::Given(&own.position, &own.velocity),
            Self::PrescribedPath(path) => Start::Path(path),
        }
    }

    /// Returns the predator at t = 0 for steps of `time_step` s. Missing coordinates are 0.
    pub(crate) fn start<const D: usize>(&self, time_step: f64) -> Predator<D> {
        match self.start_fields() {
            Start::Given(position, velocity) => Predator::new(embed(position), embed(velocity)),
            Start::Path(path) => path.start(time_step),
        }
    }

    /// Checks the predator at `index` of `count`.
    pub(super) fn check(&self, index: usize, count: usize, dimension: usize) -> Result<()> {
        let path = format!("predators[{index}].{}", self.as_ref());
        if let Start::Given(position, velocity) = self.start_fields() {
            vector(&format!("{path}.position"), position, dimension)?;
            vector(&format!("{path}.velocity"), velocity, dimension)?;
        }
        match self {
            Self::ConstantVelocity(_) => Ok(()),
            Self::PurePursuit(own) => own.check(&path),
            Self::Intercept(own) => own.check(&path),
            Self::Wandering(own) => own.check(&path),
            Self::Encircle(own) => own.check(&path),
            Self::Herd(own) => own.check(&path, index, count),
            Self::Learned(own) => own.check(&path),
            Self::PrescribedPath(own) => own.check(&path, dimension),
        }
    }

    /// Sets the velocity of the predator at `index` for the next step.
    pub(super) fn steer<const D: usize>(
        &self,
        index: usize,
        predators: &mut [Predator<D>],
        surroundings: &mut Surroundings<'_, D>,
    ) {
        let time_step = surroundings.time_step;
        match self {
            Self::ConstantVelocity(_) => {}
            Self::PurePursuit(own) => own.steer(&mut predators[index], surroundings),
            Self::Intercept(own) => own.steer(&mut predators[index], surroundings),
            Self::Wandering(own) => own.steer(&mut predators[index], surroundings),
            Self::Encircle(own) => own.steer(&mut predators[index], time_step),
            Self::Herd(own) => own.steer(index, predators, surroundings),
            Self::Learned(own) => own.steer(&mut predators[index]),
            Self::PrescribedPath(own) => own.steer(&mut predators[index], time_step),
        }
    }

    /// Serializes the fields of a predator that the strategy remembers between steps.
    pub(super) fn memory_of<const D: usize>(&self, predator: &Predator<D>) -> Vec<u8> {
        match self {
            Self::ConstantVelocity(_) | Self::Intercept(_) | Self::Wandering(_) => Vec::new(),
            Self::PurePursuit(_) => write(&(predator.target, predator.aim)),
            Self::Encircle(_) => write(&(predator.steps, predator.aim)),
            Self::Herd(_) => write(&predator.aim),
            Self::Learned(_) => write(&(predator.action, predator.push)),
            Self::PrescribedPath(_) => write(&predator.steps),
        }
    }

    /// Restores the fields that [`Self::memory_of`] serialized.
    pub(super) fn remember<const D: usize>(
        &self,
        predator: &mut Predator<D>,
        memory: &[u8],
    ) -> Result<()> {
        match self {
            Self::ConstantVelocity(_) | Self::Intercept(_) | Self::Wandering(_) => {}
            Self::PurePursuit(_) => (predator.target, predator.aim) = read(memory)?,
            Self::Encircle(_) => (predator.steps, predator.aim) = read(memory)?,
            Self::Herd(_) => predator.aim = read(memory)?,
            Self::Learned(_) => (predator.action, predator.push) = read(memory)?,
            Self::PrescribedPath(_) => predator.steps = read(memory)?,
        }
        Ok(())
    }
}

/// The fields that determine a predator at t = 0.
enum Start<'a> {
    /// Position in m and velocity in m/s.
    Given(&'a [f64], &'a [f64]),
    Path(&'a PrescribedPath),
}
