//! Components of flocks of a shape that chance hardly ever makes.

mod common;

use std::sync::Arc;

use common::scenario;
use flockesc_core::{InitialState, Ranges, World};

/// Eight agents in a column hear eight others beside its middle, but those at its ends do not hear each other: only
/// through the others are they connected. Two crowds far to the left and right make the eight stand together in memory.
#[test]
fn agents_connected_through_others_alone() {
    let crowd = |x: f64| (0..8).map(move |_| [x, 0.0]);
    let column = (0..8).map(|k| [0.0, if k < 4 { -0.6 } else { 0.6 }]);
    let positions: Vec<[f64; 2]> = crowd(-100.0)
        .chain(column)
        .chain(crowd(0.5))
        .chain(crowd(100.0))
        .collect();
    let start = InitialState {
        positions: Some(positions.concat()),
        ..InitialState::seeded(0)
    };
    let world = World::<2>::new(Arc::new(scenario(positions.len(), 2, 1, 1.0)), &start);
    for ranges in [Ranges::Shared(1.0), Ranges::PerAgent(&[1.0; 32])] {
        assert_eq!(world.num_components(ranges), 3);
    }
}
