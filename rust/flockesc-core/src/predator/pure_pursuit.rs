//! The pure pursuit strategy: the velocity turns toward a target at a limited rate.

use nalgebra::SVector;
use pathfinding::prelude::{Matrix, kuhn_munkres};
use serde::{Deserialize, Serialize};

use super::shared::prey::Prey;
use super::shared::{Limits, Predator, Surroundings};
use crate::agents::Agent;
use crate::base::check::{not_negative, quantity, require};
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::base::rng;

/// Turns toward the current position of its target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PurePursuit {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p(0) in m/s.
    pub velocity: Vec<f64>,
    /// Largest turn rate in rad/s, at least 0.
    pub max_turn_rate: f64,
    /// Largest speed in m/s, at least ||v_p(0)||; `None` is a constant speed.
    pub max_speed: Option<f64>,
    /// Rate in m/s^2 at which the speed increases up to `max_speed`, at least 0.
    pub acceleration: f64,
    /// The pursued target.
    pub target: Target,
    /// Rate in 1/s, per other visible agent, at which the predator changes its target (confusion effect), at
    /// least 0.
    pub confusion_rate: f64,
    /// Distance in m up to which agents are visible to a predator with a confusion rate, at least 0.
    pub sight: f64,
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

impl PurePursuit {
    fn limits(&self) -> Limits {
        Limits::new(self.max_turn_rate, self.max_speed, self.acceleration)
    }

    fn has_confusion(&self) -> bool {
        self.confusion_rate > 0.0
    }

    pub(super) fn check(&self, path: &str) -> Result<()> {
        self.limits().check(path, &self.velocity)?;
        quantity(&format!("{path}.confusion_rate"), self.confusion_rate)?;
        not_negative(&format!("{path}.sight"), self.sight)?;
        let is_used = !self.has_confusion() || self.target == Target::Nearest;
        let expected = "0 unless the target is the nearest agent";
        let field = format!("{path}.confusion_rate");
        require(is_used, &field, expected, self.confusion_rate)
    }

    pub(super) fn steer<const D: usize>(
        &self,
        own: &mut Predator<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) {
        let aim = self.aim(own, surroundings);
        self.limits().turn_toward(aim, own, surroundings.time_step);
    }

    /// Returns the position of the target in m.
    fn aim<const D: usize>(
        &self,
        own: &mut Predator<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) -> Option<SVector<f64, D>> {
        let prey = surroundings.prey;
        match self.target {
            Target::Nearest if self.has_confusion() => {
                let agent = self.choose(own, surroundings);
                own.target = agent.map(|agent| agent.id);
                agent.map(|agent| agent.position)
            }
            Target::Nearest => prey.nearest(&own.position).map(|agent| agent.position),
            Target::Centroid => prey.centroid(),
            Target::MostIsolated => prey.most_isolated(),
            Target::Assigned => own.aim,
        }
    }

    /// Returns the target under the confusion effect: with some probability a random visible agent, otherwise
    /// the current target if it is visible, otherwise the nearest agent.
    fn choose<const D: usize>(
        &self,
        own: &Predator<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) -> Option<Agent<D>> {
        let prey = surroundings.prey;
        let visible = || prey.within(&own.position, self.sight);
        let count = visible().count();
        let others = count.saturating_sub(1);
        let probability =
            -libm::expm1(-self.confusion_rate * others as f64 * surroundings.time_step);
        if rng::uniform(surroundings.rng, 1.0) < probability {
            let rank = (rng::uniform(surroundings.rng, count as f64) as usize).min(others);
            return prey.at_rank(&own.position, self.sight, rank);
        }
        visible()
            .find(|agent| Some(agent.id) == own.target)
            .or_else(|| prey.nearest(&own.position))
    }
}

/// Assigns an agent to every predator whose target is assigned.
pub(super) fn assign_targets<'a, const D: usize>(
    mut assigned: impl Iterator<Item = &'a mut Predator<D>>,
    prey: Prey<'_, D>,
) {
    let Some(first) = assigned.next() else {
        return;
    };
    let Some(second) = assigned.next() else {
        first.aim = prey.nearest(&first.position).map(|agent| agent.position);
        return;
    };
    let assigned: Vec<_> = [first, second].into_iter().chain(assigned).collect();
    let places: Vec<_> = assigned.iter().map(|p| p.position).collect();
    for (predator, agent) in assigned.into_iter().zip(assign(&places, prey)) {
        predator.aim = agent.map(|agent| agent.position);
    }
}

/// Largest number of predators with assigned targets. The cost matrix has up to `MAX_ASSIGNED`^3 entries.
pub(crate) const MAX_ASSIGNED: usize = 64;

/// Assigns a distinct agent to each of at least two `places`. If there are fewer agents than places, the
/// remaining places get their nearest agent.
pub(crate) fn assign<const D: usize>(
    places: &[SVector<f64, D>],
    prey: Prey<'_, D>,
) -> Vec<Option<Agent<D>>> {
    // With n predators, an optimal assignment needs only the n nearest agents of each predator.
    let nearest: Vec<_> = places
        .iter()
        .map(|r| prey.nearest_few(r, places.len()))
        .collect();
    let mut targets: Vec<Option<Agent<D>>> =
        nearest.iter().map(|few| few.first().copied()).collect();
    let mut candidates: Vec<Agent<D>> = nearest.into_iter().flatten().collect();
    candidates.sort_unstable_by_key(|candidate| candidate.id);
    candidates.dedup_by_key(|candidate| candidate.id);

    let distance = |place: usize, candidate: usize| {
        let offset: SVector<f64, D> = candidates[candidate].position - places[place];
        offset.norm().min(f64::MAX)
    };
    // Costs are integers, so that sums do not depend on their order. The scale leaves room for the
    // algorithm's sums.
    let pairs = (0..places.len()).flat_map(|p| (0..candidates.len()).map(move |q| (p, q)));
    let largest = pairs.map(|(p, q)| distance(p, q)).fold(0.0, f64::max);
    let scale = Scale::new(largest, 8 * MAX_ASSIGNED);
    let gain = |place, candidate| -scale.truncate(distance(place, candidate));
    if places.len() <= candidates.len() {
        let gains = Matrix::from_fn(places.len(), candidates.len(), |(p, q)| gain(p, q));
        for (target, candidate) in targets.iter_mut().zip(kuhn_munkres(&gains).1) {
            *target = Some(candidates[candidate]);
        }
    } else {
        let gains = Matrix::from_fn(candidates.len(), places.len(), |(q, p)| gain(p, q));
        for (candidate, place) in candidates.iter().zip(kuhn_munkres(&gains).1) {
            targets[place] = Some(*candidate);
        }
    }
    targets
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agents::Agents;
    use crate::neighbor::{NeighborOptions, Neighborhood};
    use nalgebra::vector;

    #[test]
    fn pursues_the_nearest_agent() {
        let strategy = PurePursuit {
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
        let mut agents = Agents::new(&positions, &positions);
        let neighborhood = Neighborhood::new(NeighborOptions::METRIC, &mut agents);
        let mut surroundings = Surroundings {
            time_step: 0.05,
            prey: Prey::new(&agents, &neighborhood),
            rng: &mut rng::stream(0, rng::Stream::Predators),
        };
        let mut own = Predator::new(vector![0.0, 0.0], vector![0.0, 0.0]);
        assert_eq!(
            strategy.aim(&mut own, &mut surroundings),
            Some(positions[1])
        );
    }
}
