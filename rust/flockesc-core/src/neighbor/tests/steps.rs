//! Several steps: candidates of an earlier step give the sums of a new search.

use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use super::{Case, by_id, cases};
use crate::agents::Agents;
use crate::neighbor::engine::verlet::{Reuse, VerletLists};
use crate::neighbor::{FieldOfView, NeighborOptions, Neighborhood, Ranges, Torus};

fn fly<const D: usize>(agents: &mut Agents<D>, time_step: f64, side: Option<f64>) {
    for group in &mut agents.groups {
        for (position, velocity) in group.position.iter_mut().zip(&group.velocity) {
            for (coordinate, velocity) in position.iter_mut().zip(velocity) {
                *coordinate += velocity * time_step;
            }
        }
    }
    if let Some(side) = side {
        agents.wrap(side);
    }
}

/// Flies straight on, with ranges that change after some steps, and compares with a new neighborhood in every
/// step.
fn check<const D: usize>(case: &Case<D>, time_step: f64) -> Result<(), TestCaseError> {
    for blind_angle in [0.0, case.blind_angle] {
        let options = NeighborOptions {
            field_of_view: FieldOfView::new(blind_angle),
            torus: Torus::new(case.side),
            ..NeighborOptions::METRIC
        };
        let mut agents = Agents::new(&case.positions, &case.velocities);
        let mut neighborhood = Neighborhood::new(options, &mut agents);
        for step in 0..9 {
            let ranges = match step {
                0..6 => Ranges::PerAgent(&case.ranges),
                _ => Ranges::Shared(case.ranges[0]),
            };
            neighborhood.sum_neighbors(&mut agents, ranges);
            let mut fresh = Neighborhood::new(options, &mut agents);
            fresh.sum_neighbors(&mut agents.clone(), ranges);
            let expected = by_id(&agents, fresh.sums());
            prop_assert_eq!(by_id(&agents, neighborhood.sums()), expected);
            fly(&mut agents, time_step, case.side);
            neighborhood.refresh(&mut agents);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn in_the_plane_equal_a_new_search(case in cases::<2>(), time_step in 1e-4..0.5_f64) {
        check(&case, time_step)?;
    }

    #[test]
    fn in_space_equal_a_new_search(case in cases::<3>(), time_step in 1e-4..0.5_f64) {
        check(&case, time_step)?;
    }
}

/// Two agents fly apart at 2 m/s, in steps of 0.5 s.
#[test]
fn candidates_are_found_anew_after_a_change() {
    let vectors = |x: f64| [[-x, 0.0].into(), [x, 0.0].into()];
    let mut agents = Agents::<2>::new(&vectors(1.0), &vectors(1.0));
    let mut kept = VerletLists::new(Torus::NONE);
    let plans: Vec<Reuse> = [5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 6.0]
        .into_iter()
        .map(|range| {
            let plan = kept.plan(&agents, Ranges::Shared(range));
            if plan != Reuse::Kept {
                kept.store(&agents, Ranges::Shared(range), plan);
            }
            fly(&mut agents, 0.5, None);
            plan
        })
        .collect();
    let first = [Reuse::Discarded, Reuse::New(5.0)];
    assert_eq!(plans[..2], first);
    // The margin is the drift of five steps, less what covers rounding.
    assert_eq!(
        plans[2..7],
        [
            Reuse::Kept,
            Reuse::Kept,
            Reuse::Kept,
            Reuse::Kept,
            Reuse::New(5.0)
        ]
    );
    assert_eq!(plans[7..], [Reuse::Kept, Reuse::Discarded]);
}
