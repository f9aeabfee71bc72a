//! `Law`: the trait of a law of motion.

use super::columns::ParameterColumns;
use super::forces::Force;
use super::parameters::Parameters;
use crate::agents::Group;
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::neighbor::{OffsetBuffers, Pairs};

/// The pairs of the agents in one group and their neighbors.
#[derive(Clone, Copy)]
pub(super) struct GroupPairs<'a, const D: usize> {
    pub(super) pairs: &'a Pairs<'a, D>,
    /// Index of the group.
    pub(super) group: usize,
    pub(super) columns: &'a ParameterColumns,
    /// Fixed-point scale of sums of offsets between agents, in m.
    pub(super) scale: Scale,
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

    /// Adds the forces between pairs to the agents of a group.
    fn add_pair_forces<const D: usize>(
        &self,
        _pairs: &GroupPairs<'_, D>,
        _buffers: &mut OffsetBuffers<D>,
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
