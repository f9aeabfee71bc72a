//! Search for the most isolated agent, whose nearest other agent is farthest away.

use super::Agents;
use crate::base::vector::{smaller, squared_norm};

impl<const D: usize> Agents<D> {
    /// Returns the place of the agent whose nearest other agent is farthest away; among equals, the one with the
    /// lowest id.
    pub(crate) fn most_isolated(&self) -> usize {
        let (mut farthest, mut best) = (f64::NEG_INFINITY, 0);
        for place in 0..self.len() {
            let nearest = nearest(self, place, farthest);
            let has_lower_id = || self.id(place) < self.id(best);
            if nearest > farthest || (nearest == farthest && has_lower_id()) {
                (farthest, best) = (nearest, place);
            }
        }
        best
    }
}

/// Returns the squared distance in m^2 from the agent at `place` to the nearest other one, or any that is below
/// `stop_below`. Agents that are close in memory are close in space, so most searches stop after some agents.
fn nearest<const D: usize>(agents: &Agents<D>, place: usize, stop_below: f64) -> f64 {
    let (own, mut nearest) = (agents.position(place), f64::INFINITY);
    for step in 1..agents.len() {
        for other in [place.wrapping_sub(step), place + step] {
            if other < agents.len() {
                let other = agents.position(other);
                let offset: [f64; D] = std::array::from_fn(|axis| other[axis] - own[axis]);
                nearest = smaller(nearest, squared_norm(&offset));
            }
        }
        if nearest < stop_below {
            break;
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;
    use proptest::prelude::*;

    /// Returns the ids of the most isolated agent from the search and from a comparison of all pairs.
    fn found_and_expected<const D: usize>(coordinates: &[i32]) -> (usize, usize) {
        let positions: Vec<SVector<f64, D>> = coordinates
            .chunks_exact(D)
            .map(|row| SVector::from_fn(|axis, _| f64::from(row[axis])))
            .collect();
        let agents = Agents::new(&positions, &positions);
        let nearest = |i: usize| {
            (0..positions.len())
                .filter(|&j| j != i)
                .map(|j| (positions[j] - positions[i]).norm_squared())
                .fold(f64::INFINITY, f64::min)
        };
        let expected = (0..positions.len()).fold((0, f64::NEG_INFINITY), |best, i| {
            let distance = nearest(i);
            if distance > best.1 {
                (i, distance)
            } else {
                best
            }
        });
        (agents.id(agents.most_isolated()), expected.0)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Integer coordinates, so that many agents coincide and many distances are equal.
        #[test]
        fn equals_all_pairs(coordinates in prop::collection::vec(-40..40_i32, 6..2400)) {
            let (found, expected) = found_and_expected::<2>(&coordinates);
            prop_assert_eq!(found, expected);
            let (found, expected) = found_and_expected::<3>(&coordinates);
            prop_assert_eq!(found, expected);
        }
    }
}
