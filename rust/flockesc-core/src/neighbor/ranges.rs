//! What actions set: one range for the flock, or one per agent; and how far agents reach by that.

use crate::agents::Column;

/// Agents or groups looked at to tell whether it pays to arrange all of them.
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
    /// The range of the agent of this name.
    pub(in crate::neighbor) fn of(self, name: u32) -> f64 {
        match self {
            Self::Shared(range) => range,
            Self::PerAgent(ranges) => ranges[name as usize],
        }
    }

    /// Squares of the ranges of the agents named, in m^2.
    #[inline(always)]
    pub(in crate::neighbor) fn square(self, names: &[u32], out: &mut Column<f64>) {
        // Finite, so that nobody hears the boxes at infinity that stand for no agent.
        let square = |range: f64| (range * range).min(f64::MAX);
        match self {
            Self::Shared(range) => out.fill(square(range)),
            Self::PerAgent(ranges) => {
                for (squared, &name) in out.iter_mut().zip(names) {
                    *squared = square(ranges[name as usize]);
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

/// How far agents reach, squared: by their ranges, or found otherwise.
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

    /// The squares of a group, in m^2, of which `names` are the agents.
    #[inline(always)]
    pub(in crate::neighbor) fn square(self, group: usize, names: &[u32], out: &mut Column<f64>) {
        match self {
            Self::Ranges(ranges) => ranges.square(names, out),
            Self::Squares(squares) => *out = squares[group],
        }
    }
}
