//! Interaction ranges, and the reach of every agent.

use crate::agents::Column;

/// Size of the sample of agents or groups by which a step decides whether to re-sort the agents.
pub(super) const SAMPLE: usize = 64;

/// Interaction ranges rho in m: one for the flock, or one per agent.
#[derive(Debug, Clone, Copy)]
pub enum Ranges<'a> {
    /// The same range for every agent.
    Shared(f64),
    /// Entry i is the range of agent i; the neighbor graph is then directed.
    PerAgent(&'a [f64]),
}

impl Ranges<'_> {
    /// The range of the agent with this id.
    pub(in crate::neighbor) fn of(self, id: u32) -> f64 {
        match self {
            Self::Shared(range) => range,
            Self::PerAgent(ranges) => ranges[id as usize],
        }
    }

    /// Squared ranges in m^2 of the agents with these ids.
    #[inline(always)]
    pub(in crate::neighbor) fn square(self, ids: &[u32], out: &mut Column<f64>) {
        // Finite, so that the empty boxes at infinity are out of reach.
        let square = |range: f64| (range * range).min(f64::MAX);
        match self {
            Self::Shared(range) => out.fill(square(range)),
            Self::PerAgent(ranges) => {
                for (squared, &id) in out.iter_mut().zip(ids) {
                    *squared = square(ranges[id as usize]);
                }
            }
        }
    }

    /// Mean over a sample of the agents, in m.
    pub(in crate::neighbor) fn typical(self) -> f64 {
        match self {
            Self::Shared(range) => range,
            Self::PerAgent(ranges) => {
                let sample = ranges.iter().step_by(ranges.len().div_ceil(SAMPLE));
                let count = sample.len() as f64;
                sample.sum::<f64>() / count
            }
        }
    }
}

/// The squared reach of every agent: from its interaction range, or found by a rule.
#[derive(Debug, Clone, Copy)]
pub(in crate::neighbor) enum Reaches<'a> {
    Ranges(Ranges<'a>),
    /// In m^2, for the agents of every group.
    Squares(&'a [Column<f64>]),
}

impl Reaches<'_> {
    /// Whether all agents reach equally far.
    #[inline(always)]
    pub(in crate::neighbor) fn are_equal(self) -> bool {
        match self {
            Self::Ranges(Ranges::Shared(_)) => true,
            Self::Ranges(Ranges::PerAgent(_)) | Self::Squares(_) => false,
        }
    }

    /// The squared reaches in m^2 of a group's agents, whose ids are `ids`.
    #[inline(always)]
    pub(in crate::neighbor) fn square(self, group: usize, ids: &[u32], out: &mut Column<f64>) {
        match self {
            Self::Ranges(ranges) => ranges.square(ids, out),
            Self::Squares(squares) => *out = squares[group],
        }
    }
}
