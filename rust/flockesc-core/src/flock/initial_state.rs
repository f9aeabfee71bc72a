//! `InitialState`: the state of a flock at t = 0, drawn from a seed or given as arrays.

use nalgebra::SVector;

use crate::base::check::{coordinates, require};
use crate::base::error::{Error, Result};
use crate::base::rng::{self, Stream};
use crate::base::vector::{rows, unit};
use crate::flock::scenario::FlockConfig;
use crate::predator::{Predator, PredatorConfig};

/// The initial state of an episode. If an array of the agents is `None`, it is drawn from the seed. If an
/// array of the predators is `None`, it is taken from the scenario.
///
/// Arrays are flat, in row-major order: one row of D coordinates per agent or predator.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct InitialState {
    /// Seed of all random numbers: the flock at t = 0, noise, predators and randomized parameters.
    pub seed: u64,
    /// r(0) in m, n * D entries.
    pub positions: Option<Vec<f64>>,
    /// v(0) in m/s, n * D entries.
    pub velocities: Option<Vec<f64>>,
    /// r_p(0) in m, D entries per predator.
    pub predator_positions: Option<Vec<f64>>,
    /// v_p(0) in m/s, D entries per predator.
    pub predator_velocities: Option<Vec<f64>>,
}

impl InitialState {
    /// Creates the initial state that is drawn from `seed`.
    pub fn seeded(seed: u64) -> Self {
        Self {
            seed,
            ..Self::default()
        }
    }

    /// Checks the lengths and entries of the arrays.
    ///
    /// # Errors
    /// [`Error::Input`] if an array has the wrong length, an entry is out of bounds, or an array of the
    /// predators is given although one of them has a prescribed path.
    pub fn check(&self, config: &FlockConfig) -> Result<()> {
        let (n, p, d) = (config.num_agents, config.predators.len(), config.dimension);
        check("initial_positions", &self.positions, n, d)?;
        check("initial_velocities", &self.velocities, n, d)?;
        for (field, given) in [
            ("predator_positions", &self.predator_positions),
            ("predator_velocities", &self.predator_velocities),
        ] {
            let mut predators = config.predators.iter();
            if let (Some(_), Some(index)) =
                (given, predators.position(PredatorConfig::has_fixed_start))
            {
                let expected = format!("None, because predators[{index}] has a prescribed path");
                return Err(Error::input(field, expected, "an array"));
            }
            check(field, given, p, d)?;
        }
        Ok(())
    }

    pub(super) fn positions<const D: usize>(&self, config: &FlockConfig) -> Vec<SVector<f64, D>> {
        if let Some(given) = &self.positions {
            return rows(given).collect();
        }
        let mut rng = rng::stream(self.seed, Stream::Positions);
        let positions = &config.initial_positions;
        positions.draw(&config.space(), config.num_agents, &mut rng)
    }

    pub(super) fn velocities<const D: usize>(&self, config: &FlockConfig) -> Vec<SVector<f64, D>> {
        if let Some(given) = &self.velocities {
            return rows(given).collect();
        }
        let mut rng = rng::stream(self.seed, Stream::Headings);
        let headings = &config.initial_headings;
        let headings = headings.draw::<D>(&config.space(), config.num_agents, &mut rng);
        let speeds = (0..config.num_agents).map(|id| config.speed.of(id));
        headings
            .into_iter()
            .zip(speeds)
            .map(|(heading, speed)| unit(&heading).unwrap_or(heading) * speed)
            .collect()
    }

    pub(super) fn predators<const D: usize>(&self, config: &FlockConfig) -> Vec<Predator<D>> {
        let predators = config.predators.iter();
        let mut predators: Vec<_> = predators
            .map(|predator| predator.start(config.time_step))
            .collect();
        if let Some(given) = &self.predator_positions {
            for (predator, row) in predators.iter_mut().zip(rows(given)) {
                predator.position = row;
            }
        }
        if let Some(given) = &self.predator_velocities {
            for (predator, row) in predators.iter_mut().zip(rows(given)) {
                predator.set_velocity(row);
            }
        }
        predators
    }
}

fn check(field: &str, values: &Option<Vec<f64>>, rows: usize, axes: usize) -> Result<()> {
    let values = values.as_deref();
    values.map_or(Ok(()), |values| check_rows(field, values, rows, axes))
}

/// Checks that an array has `rows` rows of `axes` coordinates that are within bounds.
pub(super) fn check_rows(field: &str, values: &[f64], rows: usize, axes: usize) -> Result<()> {
    let (expected, given) = (
        format!("{rows} x {axes} numbers"),
        format!("{} numbers", values.len()),
    );
    require(values.len() == rows * axes, field, &expected, given)?;
    coordinates(values, |at| {
        format!("{field}[{}, {}]", at / axes, at % axes)
    })
}
