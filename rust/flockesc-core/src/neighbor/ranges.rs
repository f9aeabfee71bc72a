//! `Ranges`: the interaction ranges of the agents, and their squared reaches.

use crate::agents::Column;
use crate::base::exact::Scale;
use crate::base::vector::larger;

/// Size of the samples of agents or groups that decide whether to re-sort the agents.
pub(super) const SAMPLE: usize = 64;

/// Interaction ranges rho in m: one for the flock, or one per agent.
#[derive(Debug, Clone, Copy)]
pub enum Ranges<'a> {
    /// The same range for every agent.
    Shared(f64),
    /// Entry i is the range of agent i; the neighbor graph is then directed.
    PerAgent(&'a [f64]),
}

impl<'a> From<&'a [f64]> for Ranges<'a> {
    /// A single range is that of every agent.
    fn from(ranges: &'a [f64]) -> Self {
        match ranges {
            [range] => Self::Shared(*range),
            ranges => Self::PerAgent(ranges),
        }
    }
}

impl Ranges<'_> {
    /// Returns the range in m of the agent with this id.
    pub(crate) fn of(self, id: u32) -> f64 {
        match self {
            Self::Shared(range) => range,
            Self::PerAgent(ranges) => ranges[id as usize],
        }
    }

    /// Writes the squared ranges in m^2 of the agents with these ids to `out`.
    #[inline(always)]
    pub(crate) fn square(self, ids: &[u32], out: &mut Column<f64>) {
        // Squares are finite, so that boxes without agents, which are at infinity, are out of reach.
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

    /// Returns the mean range in m of the agents with these ids, at least one, in any order.
    pub(crate) fn mean(self, ids: &[u32]) -> f64 {
        match self {
            Self::Shared(range) => range,
            Self::PerAgent(ranges) if ids.len() == ranges.len() => mean(ranges.iter().copied()),
            Self::PerAgent(ranges) => mean(ids.iter().map(|&id| ranges[id as usize])),
        }
    }

    /// Returns the mean range of a sample of the agents, in m.
    pub(crate) fn sample_mean(self) -> f64 {
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

/// Returns the mean of numbers >= 0 in any order. The mean of equal numbers has their bits.
fn mean(numbers: impl ExactSizeIterator<Item = f64> + Clone) -> f64 {
    let (largest, count) = (numbers.clone().fold(0.0, larger), numbers.len());
    let scale = Scale::for_registers(largest, count);
    let sum = numbers.map(|number| scale.quantize(largest - number)).sum();
    largest - scale.mean(sum, count as i64)
}

/// The reach of every agent, which is its interaction range or computed by a rule.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Reaches<'a> {
    /// Interaction ranges in m.
    Ranges(Ranges<'a>),
    /// Squared reaches in m^2, group by group.
    Squares(&'a [Column<f64>]),
}

impl Reaches<'_> {
    /// Returns whether all agents are known to have the same reach.
    #[inline(always)]
    pub(crate) fn are_equal(self) -> bool {
        match self {
            Self::Ranges(Ranges::Shared(_)) => true,
            Self::Ranges(Ranges::PerAgent(_)) | Self::Squares(_) => false,
        }
    }

    /// Writes the squared reaches in m^2 of a group's agents to `out`. `ids` are the ids of the agents.
    #[inline(always)]
    pub(crate) fn square(self, group: usize, ids: &[u32], out: &mut Column<f64>) {
        match self {
            Self::Ranges(ranges) => ranges.square(ids, out),
            Self::Squares(squares) => *out = squares[group],
        }
    }
}
