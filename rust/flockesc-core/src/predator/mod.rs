//! Predators and their strategies, one per file. A strategy sets the predator's next velocity (step 5).
//! `PredatorConfig` is the enum of all strategies.

mod attracted;
mod encircle;
mod herd;
mod intercept;
mod learned;
mod prescribed_path;
mod pure_pursuit;
mod shared;
mod wandering;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};
use strum::{AsRefStr, VariantNames};

pub use attracted::Attracted;
pub use encircle::Encircle;
pub use herd::Herd;
pub use intercept::Intercept;
pub use learned::Learned;
pub use prescribed_path::PrescribedPath;
pub use pure_pursuit::{PurePursuit, Target};
pub use shared::Predator;
pub(crate) use shared::Surroundings;
pub(crate) use shared::prey::Prey;
pub(crate) use shared::sighting::Sighting;
pub use wandering::Wandering;

use pure_pursuit::MAX_ASSIGNED;

use crate::base::check::{at_most, vector};
use crate::base::error::Result;
use crate::base::vector::embed;

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
    /// Moves toward all agents at once.
    Attracted(Attracted),
}

impl PredatorConfig {
    /// Returns whether the predator is controlled by actions.
    pub(crate) fn is_learned(&self) -> bool {
        self.role().learned.is_some()
    }

    /// Returns whether an initial state cannot replace the initial position and velocity.
    pub(crate) fn has_fixed_start(&self) -> bool {
        match self.start_fields() {
            Start::Given(..) => false,
            Start::Path(_) => true,
        }
    }

    fn role(&self) -> Role<'_> {
        let mut role = Role::default();
        match self {
            Self::PurePursuit(own) => role.is_assigned = own.target == Target::Assigned,
            Self::Encircle(own) => role.encircle = Some(own),
            Self::Learned(own) => role.learned = Some(own),
            Self::ConstantVelocity(_)
            | Self::Intercept(_)
            | Self::Wandering(_)
            | Self::Herd(_)
            | Self::PrescribedPath(_)
            | Self::Attracted(_) => {}
        }
        role
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
            Self::Attracted(own) => Start::Given(&own.position, &own.velocity),
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
    fn check(&self, index: usize, count: usize, dimension: usize) -> Result<()> {
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
            Self::Attracted(own) => own.check(&path),
        }
    }

    /// Sets the velocity of the predator at `index` for the next step.
    fn steer<const D: usize>(
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
            Self::Attracted(own) => own.steer(&mut predators[index], surroundings),
        }
    }
}

/// The paper's predator: keeps its velocity, v_p(t + dt) = v_p(t) (Section V).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConstantVelocity {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p in m/s.
    pub velocity: Vec<f64>,
}

/// The fields that determine a predator at t = 0.
enum Start<'a> {
    /// Position in m and velocity in m/s.
    Given(&'a [f64], &'a [f64]),
    Path(&'a PrescribedPath),
}

/// The strategies that a step prepares for all their predators together.
#[derive(Default)]
struct Role<'a> {
    /// Whether the predator pursues the agent that is assigned to it.
    is_assigned: bool,
    encircle: Option<&'a Encircle>,
    learned: Option<&'a Learned>,
}

/// Checks all predators of a scenario.
pub(crate) fn check(configs: &[PredatorConfig], dimension: usize) -> Result<()> {
    for (index, config) in configs.iter().enumerate() {
        config.check(index, configs.len(), dimension)?;
    }
    let assigned = configs.iter().filter(|config| config.role().is_assigned);
    let parts = "predators with assigned targets";
    at_most("predators", parts, assigned.count(), MAX_ASSIGNED)
}

/// Returns the observations of the learned predators, with their indices.
pub(crate) fn sightings<'a, const D: usize>(
    configs: &'a [PredatorConfig],
    predators: &'a [Predator<D>],
    prey: Prey<'a, D>,
) -> impl Iterator<Item = (usize, Sighting<D>)> {
    let all = configs.iter().enumerate();
    all.filter_map(move |(index, config)| {
        let max_speed = config.role().learned?.max_speed;
        Some((index, Sighting::of(index, predators, max_speed, prey)))
    })
}

/// Sets the actions of the learned predators: D entries in [-1, 1] per predator, in order. Missing actions
/// are 0.
pub(crate) fn set_actions<const D: usize>(
    configs: &[PredatorConfig],
    predators: &mut [Predator<D>],
    actions: &[f64],
) {
    let mut given = actions.chunks_exact(D);
    let all = configs.iter().zip(predators);
    for (_, predator) in all.filter(|(config, _)| config.is_learned()) {
        let action = given.next().map(SVector::<f64, D>::from_column_slice);
        let action =
            action.map_or_else(SVector::zeros, |action| action.map(|a| a.clamp(-1.0, 1.0)));
        // The norm is limited to 1, so that the acceleration does not depend on the direction of the action.
        predator.action = action / action.norm().max(1.0);
    }
}

/// Prepares a step of the learned predators from the state before it.
pub(crate) fn prepare<const D: usize>(
    configs: &[PredatorConfig],
    predators: &mut [Predator<D>],
    time_step: f64,
    prey: Prey<'_, D>,
) {
    for (index, config) in configs.iter().enumerate() {
        if let Some(own) = config.role().learned {
            predators[index].push = own.push(index, predators, time_step, prey);
        }
    }
}

/// Sets the next velocities of all predators, from the positions of agents and predators at the end of the
/// step.
pub(crate) fn steer<const D: usize>(
    configs: &[PredatorConfig],
    predators: &mut [Predator<D>],
    mut surroundings: Surroundings<'_, D>,
) {
    let Surroundings {
        time_step, prey, ..
    } = surroundings;
    let all = configs.iter().zip(predators.iter_mut());
    let assigned = all.filter(|(config, _)| config.role().is_assigned);
    pure_pursuit::assign_targets(assigned.map(|(_, predator)| predator), prey);
    let all = configs.iter().zip(predators.iter_mut());
    let encircling = all.filter_map(|(config, own)| Some((config.role().encircle?, own)));
    encircle::assign_stations(encircling, time_step, prey);
    for (index, config) in configs.iter().enumerate() {
        config.steer(index, predators, &mut surroundings);
    }
}
