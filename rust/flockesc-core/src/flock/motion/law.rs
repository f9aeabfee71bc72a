//! The trait of a law of motion.

use super::forces::Force;
use super::parameters::Parameters;
use super::traits::Traits;
use crate::agents::Group;
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::neighbor::Pairs;

/// Buffers of one thread for forces between neighbors.
#[derive(Debug, Clone)]
pub(super) struct PairBuffers<const D: usize> {
    pub(super) tiles: Vec<u32>,
    /// Lane of an agent and the term of one neighbor in a force on it, agent by agent.
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

/// The law by which forces set velocities.
pub(super) trait Law {
    /// Checks the law's parameters; fields of errors begin with `path`.
    fn check(&self, _path: &str, _constant_speed: bool) -> Result<()> {
        Ok(())
    }

    /// Whether the law has forces between pairs of neighbors.
    fn needs_pairs(&self) -> bool {
        false
    }

    /// Adds these forces on the agents of a group. No coordinate of an offset between two agents exceeds the bound of
    /// `scale`.
    fn add_pair_forces<const D: usize>(
        &self,
        _pairs: &Pairs<'_, D>,
        _scale: Scale,
        _group: usize,
        _traits: &Traits,
        _buffers: &mut PairBuffers<D>,
        _force: &mut Force<D>,
    ) {
    }

    /// Advances positions and velocities of a group by one step (steps 3 and 4).
    fn integrate<const D: usize>(
        &self,
        parameters: &Parameters<'_>,
        traits: &Traits,
        force: &Force<D>,
        group: &mut Group<D>,
    );
}
