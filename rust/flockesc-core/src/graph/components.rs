//! Who hangs together with whom in a flock.

use nalgebra::SVector;

use crate::agents::Agents;
use crate::error::{Error, Result};
use crate::flock::check_ranges;
use crate::neighbor::{self, Ranges};

/// The weakly connected component of every agent, named by the lowest index in it; neighbors are those within range.
///
/// # Errors
/// [`Error::Argument`] for ranges that are negative, not finite or not one per agent.
pub fn component_labels<const D: usize>(
    positions: &[SVector<f64, D>],
    ranges: Ranges<'_>,
) -> Result<Vec<u32>> {
    let (given, expected) = match ranges {
        Ranges::Shared(range) => (&[range][..], 1),
        Ranges::PerAgent(ranges) => (ranges, positions.len()),
    };
    if given.len() != expected {
        let expected = format!("{expected} ranges");
        return Err(Error::argument("interaction_range", expected, given.len()));
    }
    check_ranges("interaction_range", given)?;
    let still = vec![SVector::zeros(); positions.len()];
    let agents = Agents::new(positions, &still);
    Ok(neighbor::component_labels(&agents, ranges))
}
