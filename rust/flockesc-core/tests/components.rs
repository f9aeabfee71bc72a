//! Connected components of a special arrangement that random flocks hardly ever contain.

mod common;

use std::sync::Arc;

use common::scenario;
use flockesc_core::{InitialState, Ranges, World};

/// Eight agents in a column are neighbors of eight agents beside its middle. The agents at the two ends of
/// the column are not neighbors; they are connected only through the eight others. Two clusters far to the
/// left and right put the eight agents of the column into one leaf.
#[test]
fn agents_connected_through_others_alone() {
    let cluster = |x: f64| (0..8).map(move |_| [x, 0.0]);
    let column = (0..8).map(|k| [0.0, if k < 4 { -0.6 } else { 0.6 }]);
    let positions: Vec<[f64; 2]> = cluster(-100.0)
        .chain(column)
        .chain(cluster(0.5))
        .chain(cluster(100.0))
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
