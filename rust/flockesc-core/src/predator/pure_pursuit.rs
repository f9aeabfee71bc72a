//! The pure pursuit strategy: the velocity turns toward a target at a limited rate.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::shared::assignment::{MAX_ASSIGNED, assign};
use super::shared::flight::steering;
use super::shared::prey::{Prey, PreyAgent};
use super::strategy::{Flight, Memory, Pack, Strategy, Surroundings};
use crate::base::check::{not_negative, quantity};
use crate::base::error::{Error, Result};
use crate::base::rng;
use crate::snapshot;

steering! {
    /// Turns toward the current position of its target.
    PurePursuit {
        /// The pursued target.
        target: Target,
        /// Rate in 1/s, per other visible agent, at which the predator changes its target (confusion effect),
        /// at least 0.
        confusion_rate: f64,
        /// Distance in m up to which agents are visible to a predator with a confusion rate, at least 0.
        sight: f64,
    }
}

/// The target of a predator. Among equally suitable agents it is the one with the lowest id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Target {
    /// The agent nearest to the predator.
    Nearest,
    /// The mean position of all agents.
    Centroid,
    /// The agent whose nearest other agent is farthest away.
    MostIsolated,
    /// The assigned agent. Predators with this target pursue distinct agents.
    Assigned,
}

impl Target {
    /// Names of all targets in documents.
    pub const KINDS: &[&str] = <Self as strum::VariantNames>::VARIANTS;
}

/// The targets that a predator remembers.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct TargetMemory<const D: usize> {
    /// Id of the current target of a predator with a confusion rate.
    current: Option<usize>,
    /// Position in m of the agent assigned to the predator.
    assigned: Option<SVector<f64, D>>,
}

impl<const D: usize> Memory for TargetMemory<D> {
    fn check(&self, num_agents: usize) -> Result<()> {
        let is_agent = self.current.is_none_or(|agent| agent < num_agents);
        snapshot::check(is_agent, "a predator's target")?;
        snapshot::check_vector(self.assigned.as_ref(), "a predator's assigned target")
    }
}

impl Strategy for PurePursuit {
    type Memory<const D: usize> = TargetMemory<D>;

    fn check(&self, path: &str, _index: usize, _count: usize) -> Result<()> {
        self.limits().check(path, &self.velocity)?;
        quantity(&format!("{path}.confusion_rate"), self.confusion_rate)?;
        not_negative(&format!("{path}.sight"), self.sight)?;
        if self.has_confusion() && self.target != Target::Nearest {
            return Err(Error::config(
                format!("{path}.confusion_rate"),
                "0 unless the target is the nearest agent",
                self.confusion_rate,
            ));
        }
        Ok(())
    }

    fn check_all<'a>(predators: impl Iterator<Item = &'a Self>) -> Result<()> {
        let assigned = predators.filter(|p| p.target == Target::Assigned).count();
        if assigned > MAX_ASSIGNED {
            let expected = format!("at most {MAX_ASSIGNED} predators with assigned targets");
            return Err(Error::config("predators", expected, assigned));
        }
        Ok(())
    }

    /// Assigns an agent to every predator whose target is assigned.
    fn coordinate<const D: usize>(
        pack: &mut (impl Pack<Self, D> + ?Sized),
        _time_step: f64,
        prey: Prey<'_, D>,
    ) {
        let mut assigned = pack
            .members()
            .filter(|p| p.strategy.target == Target::Assigned);
        let Some(first) = assigned.next() else {
            return;
        };
        let Some(second) = assigned.next() else {
            let nearest = prey.nearest(&first.position);
            first.memory.assigned = nearest.map(|agent| agent.position);
            return;
        };
        let assigned: Vec<_> = [first, second].into_iter().chain(assigned).collect();
        let places: Vec<_> = assigned.iter().map(|p| p.position).collect();
        for (predator, agent) in assigned.into_iter().zip(assign(&places, prey)) {
            predator.memory.assigned = agent.map(|agent| agent.position);
        }
    }

    fn steer<const D: usize>(
        &self,
        memory: &mut TargetMemory<D>,
        flight: &Flight<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) -> (SVector<f64, D>, f64) {
        let aim = self.aim(&flight.position, memory, surroundings);
        self.limits().toward(aim, flight, surroundings.time_step)
    }
}

impl PurePursuit {
    fn has_confusion(&self) -> bool {
        self.confusion_rate > 0.0
    }

    /// Returns the position of the target in m.
    fn aim<const D: usize>(
        &self,
        position: &SVector<f64, D>,
        memory: &mut TargetMemory<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) -> Option<SVector<f64, D>> {
        let prey = surroundings.prey;
        match self.target {
            Target::Nearest if self.has_confusion() => {
                let agent = self.choose(position, memory.current, surroundings);
                memory.current = agent.map(|agent| agent.id);
                agent.map(|agent| agent.position)
            }
            Target::Nearest => prey.nearest(position).map(|agent| agent.position),
            Target::Centroid => prey.centroid(),
            Target::MostIsolated => prey.most_isolated(),
            Target::Assigned => memory.assigned,
        }
    }

    /// Returns the target under the confusion effect: with some probability a random visible agent, otherwise
    /// the current target if it is visible, otherwise the nearest agent.
    fn choose<const D: usize>(
        &self,
        position: &SVector<f64, D>,
        current: Option<usize>,
        surroundings: &mut Surroundings<'_, D>,
    ) -> Option<PreyAgent<D>> {
        let prey = surroundings.prey;
        let count = prey.within(position, self.sight).count();
        let others = count.saturating_sub(1);
        let probability =
            -libm::expm1(-self.confusion_rate * others as f64 * surroundings.time_step);
        if rng::uniform(surroundings.rng, 1.0) < probability {
            let rank = (rng::uniform(surroundings.rng, count as f64) as usize).min(others);
            return prey.at_rank(position, self.sight, rank);
        }
        prey.within(position, self.sight)
            .find(|agent| Some(agent.id) == current)
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
    fn pursues_the_nearest_agent() {
        let predator = PurePursuit {
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
            neighborhood: &Neighborhood::new(NeighborOptions::METRIC, &agents),
        };
        let mut surroundings = Surroundings {
            time_step: 0.05,
            prey,
            rng: &mut rng::stream(0, rng::Stream::Predators),
        };
        let aim = predator.aim(
            &vector![0.0, 0.0],
            &mut TargetMemory::default(),
            &mut surroundings,
        );
        assert_eq!(aim, Some(positions[1]));
    }
}
