//! The herding strategy: a predator drives the flock toward its partner.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::shared::flight::steering;
use super::shared::prey::Prey;
use super::strategy::{Flight, Memory, Pack, Strategy, Surroundings};
use crate::base::check::quantity;
use crate::base::error::{Error, Result};
use crate::base::vector::unit;
use crate::snapshot::check_vector;

steering! {
    /// Turns toward the driving position: the point behind the centroid, seen from its partner.
    Herd {
        /// Distance of the driving position from the centroid in m, at least 0.
        distance: f64,
        /// Index of the partner among the predators.
        partner: usize,
    }
}

/// The driving position in m; `None` if the partner is at the centroid.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct DrivingPosition<const D: usize>(Option<SVector<f64, D>>);

impl<const D: usize> Memory for DrivingPosition<D> {
    fn check(&self, _num_agents: usize) -> Result<()> {
        check_vector(self.0.as_ref(), "a predator's driving position")
    }
}

impl Strategy for Herd {
    type Memory<const D: usize> = DrivingPosition<D>;

    fn check(&self, path: &str, index: usize, count: usize) -> Result<()> {
        self.limits().check(path, &self.velocity)?;
        quantity(&format!("{path}.distance"), self.distance)?;
        if self.partner >= count || self.partner == index {
            let expected = format!("the index of another of the {count} predators");
            return Err(Error::config(
                format!("{path}.partner"),
                expected,
                self.partner,
            ));
        }
        Ok(())
    }

    /// Computes the driving position of every herding predator.
    fn coordinate<const D: usize>(
        pack: &mut (impl Pack<Self, D> + ?Sized),
        _time_step: f64,
        prey: Prey<'_, D>,
    ) {
        if pack.members().next().is_none() {
            return;
        }
        let Some(center) = prey.centroid() else {
            return;
        };
        for index in 0..pack.len() {
            let Some(herd) = pack.member(index) else {
                continue;
            };
            let (partner, distance) = (herd.strategy.partner, herd.strategy.distance);
            let behind = unit(&(center - pack.flight(partner).position));
            if let Some(herd) = pack.member(index) {
                herd.memory.0 = behind.map(|away| center + away * distance);
            }
        }
    }

    fn steer<const D: usize>(
        &self,
        driving_position: &mut DrivingPosition<D>,
        flight: &Flight<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) -> (SVector<f64, D>, f64) {
        self.limits()
            .toward(driving_position.0, flight, surroundings.time_step)
    }
}
