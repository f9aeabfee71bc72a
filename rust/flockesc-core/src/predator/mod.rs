//! Predators and their strategies, one per file. A strategy sets the predator's next velocity (step 5).

mod constant_velocity;
mod encircle;
mod herd;
mod intercept;
mod learned;
mod prescribed_path;
mod pure_pursuit;
mod shared;
mod state;
mod strategy;
mod wandering;

use nalgebra::SVector;

pub use shared::predator::Predator;
pub(crate) use shared::predator::Surroundings;
pub(crate) use shared::prey::Prey;
pub(crate) use shared::sighting::Sighting;
pub(crate) use state::PredatorState;
pub use strategy::{
    ConstantVelocity, Encircle, Herd, Intercept, Learned, PredatorConfig, PrescribedPath,
    PurePursuit, Target, Wandering,
};

use shared::assignment::MAX_ASSIGNED;

use crate::base::error::{Error, Result};

/// Checks all predators of a scenario.
pub(crate) fn check(configs: &[PredatorConfig], dimension: usize) -> Result<()> {
    for (index, config) in configs.iter().enumerate() {
        config.check(index, configs.len(), dimension)?;
    }
    let assigned = configs.iter().filter(|config| config.has_assigned_target());
    let count = assigned.count();
    if count > MAX_ASSIGNED {
        let expected = format!("at most {MAX_ASSIGNED} predators with assigned targets");
        return Err(Error::config("predators", expected, count));
    }
    Ok(())
}

/// Returns the observations of the learned predators, with their indices.
pub(crate) fn sightings<'a, const D: usize>(
    configs: &'a [PredatorConfig],
    predators: &'a [Predator<D>],
    prey: Prey<'a, D>,
) -> impl Iterator<Item = (usize, Sighting<D>)> {
    let all = configs.iter().enumerate();
    all.filter_map(move |(index, config)| match config {
        PredatorConfig::Learned(own) => {
            Some((index, Sighting::of(index, predators, own.max_speed, prey)))
        }
        _ => None,
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
        let action = action.unwrap_or_else(SVector::zeros);
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
        if let PredatorConfig::Learned(own) = config {
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
    let assigned = all.filter(|(config, _)| config.has_assigned_target());
    pure_pursuit::assign_targets(assigned.map(|(_, predator)| predator), prey);
    let all = configs.iter().zip(predators.iter_mut());
    let encircling = all.filter_map(|(config, predator)| match config {
        PredatorConfig::Encircle(own) => Some((own, predator)),
        _ => None,
    });
    encircle::assign_stations(encircling, time_step, prey);
    for (index, config) in configs.iter().enumerate() {
        config.steer(index, predators, &mut surroundings);
    }
}
