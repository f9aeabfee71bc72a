//! What predators see: all agents where they now are.

use nalgebra::SVector;

use crate::agents::Agents;
use crate::metrics::centroid;
use crate::neighbor::Neighborhood;

/// The agents at the end of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prey<'a, const D: usize> {
    pub(crate) agents: &'a Agents<D>,
    pub(crate) neighborhood: &'a Neighborhood<D>,
}

/// One agent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quarry<const D: usize> {
    /// r in m.
    pub(super) position: SVector<f64, D>,
    /// v in m/s.
    pub(super) velocity: SVector<f64, D>,
}

impl<const D: usize> Prey<'_, D> {
    /// The agent nearest to `place`; the lowest name among equals.
    pub(super) fn nearest(&self, place: &SVector<f64, D>) -> Option<Quarry<D>> {
        let mut best = (f64::INFINITY, usize::MAX, None);
        for (name, position, velocity) in self.agents.iter() {
            let squared = (position - place).norm_squared();
            if squared < best.0 || (squared == best.0 && name < best.1) {
                best = (squared, name, Some(Quarry { position, velocity }));
            }
        }
        best.2
    }

    /// Mean position of all agents in m.
    pub(super) fn centroid(&self) -> SVector<f64, D> {
        let bounds = self.neighborhood.bounds();
        centroid(&self.agents.groups, bounds, self.agents.len()).into()
    }

    /// Position in m of the agent whose nearest other agent is farthest; the lowest name among equals.
    pub(super) fn most_isolated(&self) -> SVector<f64, D> {
        let (_, position, _) = self.agents.at(self.neighborhood.most_isolated(self.agents));
        position
    }
}
