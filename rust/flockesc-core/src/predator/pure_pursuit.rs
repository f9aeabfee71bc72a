//! Pure pursuit: the velocity turns toward a target, no faster than a given rate, at constant speed.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

use super::prey::{Prey, Quarry};
use super::steering::turn_toward;
use crate::config::not_negative;
use crate::error::{Error, Result};
use crate::rng;
use crate::vector::unit;

/// Turns toward its target where that is at the time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PurePursuit {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p(0) in m/s; its norm is the speed at all times.
    pub velocity: Vec<f64>,
    /// Largest turn rate in rad/s, at least 0.
    pub max_turn_rate: f64,
    /// What is pursued.
    pub target: Target,
    /// How often every further agent in sight draws the predator off its target, in 1/s, at least 0.
    pub confusion_rate: f64,
    /// How far a predator that can be confused sees, in m, at least 0.
    pub sight: f64,
}

/// What a predator pursues; among equal agents the one with the lowest index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// The agent nearest to the predator.
    Nearest,
    /// The mean position of all agents.
    Centroid,
    /// The agent whose nearest other agent is farthest.
    MostIsolated,
}

impl PurePursuit {
    pub(super) fn check(&self, path: &str) -> Result<()> {
        not_negative(&format!("{path}.max_turn_rate"), self.max_turn_rate)?;
        not_negative(&format!("{path}.confusion_rate"), self.confusion_rate)?;
        not_negative(&format!("{path}.sight"), self.sight)?;
        if self.can_be_confused() && self.target != Target::Nearest {
            return Err(Error::config(
                format!("{path}.confusion_rate"),
                "0 where the target is not the nearest agent",
                self.confusion_rate,
            ));
        }
        Ok(())
    }

    fn can_be_confused(&self) -> bool {
        self.confusion_rate > 0.0
    }

    /// The next velocity; `kept` is the name of the agent that a predator who can be confused is after.
    pub(super) fn steer<const D: usize>(
        &self,
        position: &SVector<f64, D>,
        velocity: &SVector<f64, D>,
        time_step: f64,
        prey: Prey<'_, D>,
        kept: &mut Option<usize>,
        rng: &mut ChaCha8Rng,
    ) -> SVector<f64, D> {
        let target = match self.target {
            Target::Nearest if self.can_be_confused() => {
                let quarry = self.choose(position, time_step, prey, *kept, rng);
                *kept = quarry.map(|quarry| quarry.name);
                quarry.map(|quarry| quarry.position)
            }
            Target::Nearest => prey.nearest(position).map(|quarry| quarry.position),
            Target::Centroid => prey.centroid(),
            Target::MostIsolated => prey.most_isolated(),
        };
        let sight = target.and_then(|target| unit(&(target - position)));
        match (unit(velocity), sight) {
            (Some(heading), Some(sight)) => {
                turn_toward(&heading, &sight, self.max_turn_rate * time_step) * velocity.norm()
            }
            _ => *velocity,
        }
    }

    /// Another one of the agents in sight, by chance, or the kept one; the nearest where that is out of sight.
    fn choose<const D: usize>(
        &self,
        position: &SVector<f64, D>,
        time_step: f64,
        prey: Prey<'_, D>,
        kept: Option<usize>,
        rng: &mut ChaCha8Rng,
    ) -> Option<Quarry<D>> {
        let count = prey.within(position, self.sight).count();
        let others = count.saturating_sub(1);
        let probability = -libm::expm1(-self.confusion_rate * others as f64 * time_step);
        if rng::uniform(rng, 1.0) < probability {
            let rank = (rng::uniform(rng, count as f64) as usize).min(others);
            return prey.at_rank(position, self.sight, rank);
        }
        prey.within(position, self.sight)
            .find(|quarry| Some(quarry.name) == kept)
            .or_else(|| prey.nearest(position))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agents::Agents;
    use crate::neighbor::{NeighborRule, Neighborhood};
    use nalgebra::vector;

    #[test]
    fn hunts_the_nearest_and_flies_on_over_a_caught_agent() {
        let hunter = PurePursuit {
            position: vec![],
            velocity: vec![],
            max_turn_rate: 1e3,
            target: Target::Nearest,
            confusion_rate: 0.0,
            sight: 0.0,
        };
        let positions = [vector![0.0, 9.0], vector![-4.0, 0.0]];
        let agents = Agents::new(&positions, &positions);
        let prey = Prey {
            agents: &agents,
            neighborhood: &Neighborhood::silent(NeighborRule::Metric {}, &agents),
        };
        let velocity = vector![3.0, 0.0];
        let mut rng = rng::stream(0, rng::Stream::Predators);
        let mut steered = |place: &SVector<f64, 2>| {
            hunter.steer(place, &velocity, 0.05, prey, &mut None, &mut rng)
        };
        let next = steered(&vector![0.0, 0.0]);
        assert!((next - vector![-3.0, 0.0]).norm() < 1e-12);
        assert_eq!(steered(&positions[0]), velocity);
    }
}
