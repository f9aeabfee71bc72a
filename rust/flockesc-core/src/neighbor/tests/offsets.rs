//! The sums of offsets against their definition.

use nalgebra::SVector;
use proptest::prelude::*;
use pulp::Scalar;

use super::{Case, cases};
use crate::agents::Agents;
use crate::base::exact::Scale;
use crate::base::vector::{SHORTEST, squared_norm};
use crate::neighbor::engine::offsets::OffsetBuffers;
use crate::neighbor::{FieldOfView, NeighborOptions, Neighborhood, Ranges, Torus};

/// Returns agent i's neighbors within `reach`, by definition.
fn neighbors<const D: usize>(case: &Case<D>, i: usize, reach: f64) -> Vec<SVector<f64, D>> {
    let field_of_view = FieldOfView::new(case.blind_angle);
    let sees = |offset: [f64; D], squared: f64| {
        let velocity: [f64; D] = case.velocities[i].into();
        let speed = squared_norm(&velocity).sqrt();
        field_of_view == FieldOfView::ALL_ROUND
            || field_of_view.sees(Scalar::new(), velocity, speed, offset, squared)
    };
    let is_neighbor = |offset: &[f64; D]| {
        let squared = squared_norm(offset);
        squared <= (reach * reach).min(f64::MAX) && sees(*offset, squared)
    };
    let offsets = (0..case.positions.len()).map(|j| case.offset(i, j));
    offsets.filter(is_neighbor).map(SVector::from).collect()
}

/// Compares the sums by the kernel and, as the graph of agents with equal ranges that see all around is mutual, the
/// sums over all pairs with the definition.
fn check<const D: usize>(case: &Case<D>, separation_range: f64) -> Result<(), TestCaseError> {
    let mut case = case.clone();
    for position in &mut case.positions {
        *position = position.map(|x| x.clamp(-1e9, 1e9));
    }
    for (is_mutual, blind_angle) in [(false, 0.0), (true, 0.0), (false, case.blind_angle)] {
        case.blind_angle = blind_angle;
        let mut agents = Agents::new(&case.positions, &case.velocities);
        let options = NeighborOptions {
            needs_pairs: true,
            is_mutual,
            torus: Torus::new(case.side),
            field_of_view: FieldOfView::new(blind_angle),
            ..NeighborOptions::METRIC
        };
        let mut neighborhood = Neighborhood::new(options, &mut agents);
        neighborhood.sum_neighbors(&mut agents, Ranges::Shared(case.ranges[0]));
        let scale = Scale::for_registers(4e9, agents.len());
        let mut buffers = OffsetBuffers::default();
        let pairs = neighborhood.pairs(&agents);
        for group in 0..agents.groups.len() {
            let sums = pairs.sum_offsets(group, scale, separation_range, &mut buffers);
            for (lane, &id) in agents.ids_of(group).iter().enumerate() {
                let offsets = neighbors(&case, id as usize, case.ranges[0]);
                let close: Vec<_> = offsets
                    .iter()
                    .map(|offset| (offset, offset.iter().map(|x| x * x).sum::<f64>()))
                    .filter(|(_, squared)| {
                        *squared > SHORTEST * SHORTEST
                            && *squared <= separation_range * separation_range
                    })
                    .map(|(offset, squared)| offset.map(|x| -x / squared))
                    .collect();
                let largest = close.iter().map(SVector::amax).fold(0.0, f64::max);
                let fine = Scale::new(largest, close.len());
                for axis in 0..D {
                    let expected: i64 = offsets
                        .iter()
                        .map(|offset| scale.quantize(offset[axis]))
                        .sum();
                    prop_assert_eq!(sums.toward_all[axis][lane], expected);
                    let expected = close.iter().map(|term| fine.truncate(term[axis])).sum();
                    prop_assert_eq!(sums.from_close[axis][lane], fine.value(expected));
                }
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn plane_equals_the_definition(case in cases::<2>(), range in 0.0..60.0_f64) {
        check(&case, range)?;
    }

    #[test]
    fn space_equals_the_definition(case in cases::<3>(), range in 0.0..60.0_f64) {
        check(&case, range)?;
    }
}
