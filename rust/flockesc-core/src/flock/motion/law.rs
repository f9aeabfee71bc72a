//! `Law`: the trait of a law of motion.

use super::columns::ParameterColumns;
use super::forces::Force;
use super::parameters::Parameters;
use crate::agents::Group;
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::neighbor::Pairs;

/// Buffers of one thread for the forces between pairs of neighbors.
#[derive(Debug, Clone)]
pub(super) struct PairBuffers<const D: usize> {
    pub(super) tiles: Vec<u32>,
    /// Pairs of an agent's lane and one neighbor's contribution to the force on the agent, in the order of
    /// lanes.
    pub(super) terms: Vec<(usize, [f64; D])>,
}

impl<const D: usize> PairBuffers<D> {
    pub(super) fn new() -> Self {
        Self {
            tiles: Vec::new(),
            terms: Vec::new(),
        }
    }
}

/// A law of motion: how forces change velocities.
pub(super) trait Law {
    /// Checks the parameters. `path` is the law's path in the scenario.
    fn check(&self, _path: &str, _constant_speed: bool) -> Result<()> {
        Ok(())
    }

    /// Returns whether the law has forces between pairs of neighbors.
    fn needs_pairs(&self) -> bool {
        false
    }

    /// Adds the forces between pairs to the agents of a group. `scale` holds the sum of the offsets of all
    /// agents.
    fn add_pair_forces<const D: usize>(
        &self,
        _pairs: &Pairs<'_, D>,
        _scale: Scale,
        _group: usize,
        _traits: &ParameterColumns,
        _buffers: &mut PairBuffers<D>,
        _force: &mut Force<D>,
    ) {
    }

    /// Advances the positions and velocities of a group by one step (steps 3 and 4).
    fn integrate<const D: usize>(
        &self,
        parameters: &Parameters<'_>,
        columns: &ParameterColumns,
        force: &Force<D>,
        group: &mut Group<D>,
    );
}
