//! Pure pursuit: the velocity turns toward a target, no faster than a given rate.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

use super::shared::flight::steering;
use super::shared::prey::{Prey, Quarry};
use crate::base::check::{not_negative, quantity};
use crate::base::error::{Error, Result};
use crate::base::rng;

steering! {
    /// Turns toward its target where that is at the time.
    PurePursuit {
        /// What is pursued.
        target: Target,
        /// How often every further agent in sight draws the predator off its target, in 1/s, at least 0.
        confusion_rate: f64,
        /// How far a predator that can be confused sees, in m, at least 0.
        sight: f64,
    }
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
    /// An agent of its own, where predators with this target share them out.
    Assigned,
}

impl PurePursuit {
    pub(super) fn check(&self, path: &str) -> Result<()> {
        self.limits().check(path, &self.velocity)?;
        quantity(&format!("{path}.confusion_rate"), self.confusion_rate)?;
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

    /// Where it aims, in m; `kept` is the name of the agent that a predator who can be confused is after.
    pub(super) fn aim<const D: usize>(
        &self,
        position: &SVector<f64, D>,
        time_step: f64,
        prey: Prey<'_, D>,
        agreed: Option<SVector<f64, D>>,
        kept: &mut Option<usize>,
        rng: &mut ChaCha8Rng,
    ) -> Option<SVector<f64, D>> {
        match self.target {
            Target::Nearest if self.can_be_confused() => {
                let quarry = self.choose(position, time_step, prey, *kept, rng);
                *kept = quarry.map(|quarry| quarry.name);
                quarry.map(|quarry| quarry.position)
            }
            Target::Nearest => prey.nearest(position).map(|quarry| quarry.position),
            Target::Centroid => prey.centroid(),
            Target::MostIsolated => prey.most_isolated(),
            Target::Assigned => agreed,
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
    use crate::neighbor::{NeighborOptions, Neighborhood};
    use nalgebra::vector;

    #[test]
    fn hunts_the_nearest() {
        let hunter = PurePursuit {
            position: vec![],
            velocity: vec![],
            max_turn_rate: 1e3,
            max_speed: None,
            acceleration: 0.0,
            target: Target::Nearest,
            confusion_rate: 0.0,
            sight: 0.0,
        };
        let positions = [vector![0.0, 9.0], vector![-4.0, 0.0]];
        let agents = Agents::new(&positions, &positions);
        let prey = Prey {
            agents: &agents,
            neighborhood: &Neighborhood::silent(NeighborOptions::METRIC, &agents),
        };
        let mut rng = rng::stream(0, rng::Stream::Predators);
        let aim = hunter.aim(&vector![0.0, 0.0], 0.05, prey, None, &mut None, &mut rng);
        assert_eq!(aim, Some(positions[1]));
    }
}
