//! The learned strategy: an action sets the predator's acceleration in its body frame.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::shared::prey::Prey;
use super::shared::sighting::Sighting;
use super::shared::start::given_start;
use super::strategy::{ActionLimits, Flight, Memory, Pack, Strategy, Surroundings};
use crate::base::check::{positive_quantity, quantity};
use crate::base::error::Result;
use crate::snapshot::check_vector;

/// Accelerates by the action of a policy; without an action it flies straight on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learned {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p(0) in m/s.
    pub velocity: Vec<f64>,
    /// Acceleration in m/s^2 for an action of norm 1, at least 0.
    pub max_acceleration: f64,
    /// Largest speed in m/s, from 1e-20 to 1e20.
    pub max_speed: f64,
}

given_start!(Learned);

impl Learned {
    fn limits(&self) -> ActionLimits {
        ActionLimits {
            max_speed: self.max_speed,
        }
    }

    /// Returns v_p + `push`, scaled down to `max_speed` if it is faster.
    fn pushed<const D: usize>(
        &self,
        velocity: &SVector<f64, D>,
        push: &SVector<f64, D>,
    ) -> SVector<f64, D> {
        let pushed = velocity + push;
        let speed = pushed.norm();
        if speed > self.max_speed {
            pushed * (self.max_speed / speed)
        } else {
            pushed
        }
    }
}

/// The action of a learned predator.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct ActionMemory<const D: usize> {
    /// The action in the predator's body frame, of norm at most 1.
    action: SVector<f64, D>,
    /// The change of velocity in m/s in the current step.
    push: SVector<f64, D>,
}

impl<const D: usize> Default for ActionMemory<D> {
    fn default() -> Self {
        Self {
            action: SVector::zeros(),
            push: SVector::zeros(),
        }
    }
}

impl<const D: usize> Memory for ActionMemory<D> {
    fn check(&self, _num_agents: usize) -> Result<()> {
        check_vector(Some(&self.action), "a predator's action")?;
        check_vector(Some(&self.push), "a predator's change of velocity")
    }
}

impl Strategy for Learned {
    type Memory<const D: usize> = ActionMemory<D>;

    fn check(&self, path: &str, _index: usize, _count: usize) -> Result<()> {
        quantity(&format!("{path}.max_acceleration"), self.max_acceleration)?;
        positive_quantity(&format!("{path}.max_speed"), self.max_speed)
    }

    fn action_limits(&self) -> Option<ActionLimits> {
        Some(self.limits())
    }

    fn set_action<const D: usize>(memory: &mut ActionMemory<D>, action: SVector<f64, D>) {
        memory.action = action;
    }

    /// Computes the changes of velocity from the state before the step.
    fn prepare<const D: usize>(
        pack: &mut (impl Pack<Self, D> + ?Sized),
        time_step: f64,
        prey: Prey<'_, D>,
    ) {
        for index in 0..pack.len() {
            let Some(own) = pack.member(index) else {
                continue;
            };
            let size = own.strategy.max_acceleration * time_step;
            let (action, limits) = (own.memory.action, own.strategy.limits());
            let push = if action.norm() > 0.0 {
                let others = (0..pack.len()).filter(|other| *other != index);
                let others = others.map(|other| pack.flight(other).position);
                let sighting = Sighting::of(&pack.flight(index), limits, others, prey);
                sighting.frame().vector(&action) * size
            } else {
                SVector::zeros()
            };
            if let Some(own) = pack.member(index) {
                own.memory.push = push;
            }
        }
    }

    fn steer<const D: usize>(
        &self,
        memory: &mut ActionMemory<D>,
        flight: &Flight<D>,
        _surroundings: &mut Surroundings<'_, D>,
    ) -> (SVector<f64, D>, f64) {
        let velocity = self.pushed(&flight.velocity, &memory.push);
        (velocity, velocity.norm())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    #[test]
    fn is_no_faster_than_its_limit() {
        let learned = Learned {
            position: vec![],
            velocity: vec![],
            max_acceleration: 20.0,
            max_speed: 5.0,
        };
        let next = learned.pushed(&vector![3.0, 0.0], &vector![0.0, 4.0]);
        assert_eq!(next, vector![3.0, 4.0]);
        let next = learned.pushed(&vector![3.0, 0.0], &vector![3.0, 8.0]);
        assert!((next - vector![3.0, 4.0]).norm() < 1e-15);
    }

    #[test]
    fn snapshots_without_a_finite_action_or_push_are_rejected() {
        let memory = ActionMemory::<2>::default();
        assert_eq!(memory.check(1), Ok(()));
        let nan = vector![0.0, f64::NAN];
        let spoiled = [
            ActionMemory {
                action: nan,
                ..memory.clone()
            },
            ActionMemory {
                push: nan,
                ..memory
            },
        ];
        assert!(spoiled.iter().all(|memory| memory.check(1).is_err()));
    }
}
