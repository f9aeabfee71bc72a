//! Search for the most isolated agent, whose nearest other agent is farthest away.

use crate::agents::{Agents, FANOUT, TILE};
use crate::base::vector::{smaller, squared_norm};
use crate::neighbor::engine::field_of_view::Torus;
use crate::neighbor::engine::nodes::Bounds;
use crate::neighbor::engine::tree::Tree;

/// Returns the place of the agent whose nearest other agent is farthest away; among equals, the one with the
/// lowest id.
pub(in crate::neighbor) fn most_isolated<const D: usize>(
    agents: &Agents<D>,
    tree: &Tree<D>,
) -> usize {
    let (mut farthest, mut best) = (f64::NEG_INFINITY, 0);
    for place in 0..agents.len() {
        let mut search = Search {
            agents,
            tree,
            place,
            position: agents.position(place),
            nearest: f64::INFINITY,
            stop_below: farthest,
        };
        // The agent's own tile first, because it already excludes most agents.
        search.visit_tile(place / TILE);
        search.descend(tree.levels.len() - 1, 0);
        let has_lower_id = || agents.id(place) < agents.id(best);
        if search.nearest > farthest || (search.nearest == farthest && has_lower_id()) {
            (farthest, best) = (search.nearest, place);
        }
    }
    best
}

/// Search for the agent nearest to the one at `place`.
struct Search<'a, const D: usize> {
    agents: &'a Agents<D>,
    tree: &'a Tree<D>,
    place: usize,
    position: [f64; D],
    /// Squared distance in m^2 to the nearest agent so far.
    nearest: f64,
    /// The search stops when `nearest` is below this squared distance in m^2.
    stop_below: f64,
}

impl<const D: usize> Search<'_, D> {
    fn descend(&mut self, level: usize, block: usize) {
        let nodes = &self.tree.levels[level][block];
        for child in 0..FANOUT {
            if self.nearest < self.stop_below {
                return;
            }
            let point = Bounds {
                low: self.position,
                high: self.position,
            };
            if Torus::NONE.squared_gap(&point, &nodes.bounds_of(child)) < self.nearest {
                let node = block * FANOUT + child;
                match level.checked_sub(1) {
                    Some(below) => self.descend(below, node),
                    None => self.visit_tile(node),
                }
            }
        }
    }

    fn visit_tile(&mut self, tile: usize) {
        for place in tile * TILE..self.agents.len().min((tile + 1) * TILE) {
            if place != self.place {
                let other = self.agents.position(place);
                let offset: [f64; D] =
                    std::array::from_fn(|axis| other[axis] - self.position[axis]);
                self.nearest = smaller(self.nearest, squared_norm(&offset));
            }
        }
    }
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
        let mut agents = Agents::new(&positions, &positions);
        let mut tree = Tree::new(agents.groups.len());
        tree.refresh(&mut agents);
        tree.build_boxes(&agents);
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
        (agents.id(most_isolated(&agents, &tree)), expected.0)
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
