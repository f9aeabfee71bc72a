//! The kernel against a reference that tests all pairs: bitwise equal sums and equal components on every
//! instruction set.

mod offsets;
mod rules;
mod steps;

use std::f64::consts::PI;

use nalgebra::SVector;
use proptest::prelude::*;
use pulp::{Scalar, Simd};

use super::engine::field_of_view::{FieldOfView, Torus};
use super::engine::kernel::SumNeighbors;
use super::engine::sums::{NeighborSums, Scratch};
use super::engine::tree::Tree;
use super::engine::verlet::Reuse;
use super::ranges::Reaches;
use super::{NeighborOptions, Neighborhood, Ranges};
use crate::agents::{Agents, GROUP};
use crate::base::exact::Scale;
use crate::base::rng::{self, Stream};
use crate::base::vector::squared_norm;

/// A flock, and the range of every agent.
#[derive(Debug, Clone)]
struct Case<const D: usize> {
    positions: Vec<SVector<f64, D>>,
    velocities: Vec<SVector<f64, D>>,
    ranges: Vec<f64>,
    /// In rad.
    blind_angle: f64,
    /// Side in m of a periodic domain.
    side: Option<f64>,
}

impl<const D: usize> Case<D> {
    /// Returns the offset in m from agent i to agent j, by definition.
    fn offset(&self, i: usize, j: usize) -> [f64; D] {
        std::array::from_fn(|axis| {
            let offset = self.positions[j][axis] - self.positions[i][axis];
            match self.side {
                Some(side) if offset > side / 2.0 => offset - side,
                Some(side) if offset < -side / 2.0 => offset + side,
                _ => offset,
            }
        })
    }

    /// Returns the squared distance in m^2 between two agents.
    fn squared_distance(&self, i: usize, j: usize) -> f64 {
        squared_norm(&self.offset(i, j))
    }
}

fn range_of(ranges: Ranges<'_>, agent: usize) -> f64 {
    match ranges {
        Ranges::Shared(range) => range,
        Ranges::PerAgent(ranges) => ranges[agent],
    }
}

/// Returns the sum of velocities in units of `scale` and the number of neighbors of every agent, by
/// definition.
fn reference<const D: usize>(
    case: &Case<D>,
    ranges: Ranges<'_>,
    field_of_view: FieldOfView,
    scale: Scale,
) -> Vec<([i64; D], i64)> {
    let sums_of = |i: usize| {
        let mut sums = ([0; D], 0);
        for (j, velocity) in case.velocities.iter().enumerate() {
            let (offset, squared) = (case.offset(i, j), case.squared_distance(i, j));
            let own: [f64; D] = case.velocities[i].into();
            let speed = squared_norm(&own).sqrt();
            let is_seen = field_of_view == FieldOfView::ALL_ROUND
                || field_of_view.sees(Scalar::new(), own, speed, offset, squared);
            if is_seen && squared <= range_of(ranges, i).powi(2) {
                for axis in 0..D {
                    sums.0[axis] += scale.quantize(velocity[axis]);
                }
                sums.1 += 1;
            }
        }
        sums
    };
    (0..case.positions.len()).map(sums_of).collect()
}

/// Returns the labels of the weakly connected components, by repeated graph search.
fn reference_labels<const D: usize>(case: &Case<D>, ranges: Ranges<'_>) -> Vec<u32> {
    let mut labels = vec![u32::MAX; case.positions.len()];
    for start in 0..labels.len() {
        let mut frontier = vec![start];
        while let Some(agent) = frontier.pop() {
            if labels[agent] != u32::MAX {
                continue;
            }
            labels[agent] = start as u32;
            frontier.extend((0..labels.len()).filter(|&other| {
                let range = range_of(ranges, agent).max(range_of(ranges, other));
                labels[other] == u32::MAX && case.squared_distance(agent, other) <= range * range
            }));
        }
    }
    labels
}

/// Candidates with a margin. The module `steps` takes them again.
const WIDE: Reuse = Reuse::New(1.5);

/// Returns the sums by the kernel with the registers of `simd`, in the order of ids.
fn kernel<S: Simd, const D: usize>(
    simd: S,
    agents: &Agents<D>,
    tree: &Tree<D>,
    ranges: Ranges<'_>,
    (torus, field_of_view): (Torus, FieldOfView),
    reuse: Reuse,
) -> Vec<([i64; D], i64)> {
    let mut groups: Vec<NeighborSums<D>> =
        agents.groups.iter().map(NeighborSums::isolated).collect();
    simd.vectorize(SumNeighbors {
        agents,
        tree,
        reaches: Reaches::Ranges(ranges),
        torus,
        field_of_view,
        is_counting: true,
        reuse,
        first: 0,
        sums: &mut groups,
        scratch: &mut Scratch::default(),
    });
    by_id(agents, &groups)
}

fn by_id<const D: usize>(agents: &Agents<D>, groups: &[NeighborSums<D>]) -> Vec<([i64; D], i64)> {
    let mut sums = vec![([0; D], 0); agents.len()];
    for (place, &id) in agents.ids().iter().enumerate() {
        let (group, lane) = (&groups[place / GROUP], place % GROUP);
        sums[id as usize] = (
            std::array::from_fn(|axis| group.sum[axis][lane]),
            group.count[lane],
        );
    }
    sums
}

fn check<const D: usize>(case: &Case<D>) -> Result<(), TestCaseError> {
    let mut agents = Agents::new(&case.positions, &case.velocities);
    let mut tree = Tree::new(agents.groups.len());
    tree.refresh(&mut agents);
    tree.build_boxes(&agents);
    let (shared, per_agent) = (
        Ranges::Shared(case.ranges[0]),
        Ranges::PerAgent(&case.ranges),
    );
    let torus = Torus::new(case.side);
    for (ranges, view) in [
        (shared, FieldOfView::ALL_ROUND),
        (per_agent, FieldOfView::ALL_ROUND),
        (per_agent, FieldOfView::new(case.blind_angle)),
    ] {
        let expected = reference(case, ranges, view, tree.scale);
        let view = (torus, view);
        prop_assert_eq!(
            &kernel(Scalar::new(), &agents, &tree, ranges, view, WIDE),
            &expected
        );
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(simd) = pulp::x86::V3::try_new() {
                let once = Reuse::Discarded;
                prop_assert_eq!(&kernel(simd, &agents, &tree, ranges, view, once), &expected);
            }
            if let Some(simd) = pulp::x86::V4::try_new() {
                prop_assert_eq!(&kernel(simd, &agents, &tree, ranges, view, WIDE), &expected);
            }
        }
    }
    let options = NeighborOptions {
        torus,
        ..NeighborOptions::METRIC
    };
    for ranges in [shared, per_agent] {
        let labels = reference_labels(case, ranges);
        let first = |&(id, label): &(usize, &u32)| id == *label as usize;
        let neighborhood = Neighborhood::new(options, &mut agents);
        prop_assert_eq!(
            neighborhood.num_components(&agents, ranges),
            labels.iter().enumerate().filter(first).count()
        );
        prop_assert_eq!(neighborhood.component_labels(&agents, ranges), labels);
    }
    Ok(())
}

/// Generates flocks of various shapes, with sizes close to multiples of leaves, groups and nodes.
fn cases<const D: usize>() -> impl Strategy<Value = Case<D>> {
    let sizes = prop_oneof![4 => 1..80_usize, 1 => 120..140_usize, 1 => 505..530_usize];
    let coordinates = (sizes, 0..7_u8).prop_flat_map(|(n, shape)| {
        let coordinate = match shape {
            0 => (-50.0..50.0_f64).boxed(),
            1 => (0..6_u8).prop_map(f64::from).boxed(), // a lattice: coincident agents, equal distances
            2 => Just(3.5).boxed(),                     // all at one point
            3 => prop_oneof![Just(-0.0), Just(0.0), -1e-9..1e-9_f64].boxed(),
            4 => (0..3_u8, -1.0..1.0_f64)
                .prop_map(|(c, x)| 1e3 * f64::from(c) + x)
                .boxed(), // clusters
            5 => (-1e150..1e150_f64).boxed(),
            _ => (-30.0..30.0_f64).boxed(), // made collinear below
        };
        let positions = prop::collection::vec(prop::collection::vec(coordinate, D), n);
        positions.prop_map(move |mut positions| {
            if shape == 6 {
                for position in &mut positions {
                    let first = position[0];
                    position.fill(first);
                }
            }
            positions
        })
    });
    // Offsets on a lattice are exactly half the side of 4 m.
    let side =
        prop_oneof![2 => Just(None), 1 => (10.0..80.0_f64).prop_map(Some), 1 => Just(Some(4.0))];
    (coordinates, side).prop_flat_map(|(mut coordinates, side)| {
        if let Some(side) = side {
            for coordinate in coordinates.iter_mut().flatten() {
                *coordinate = coordinate.rem_euclid(side);
                *coordinate = if *coordinate < side { *coordinate } else { 0.0 };
            }
        }
        let positions: Vec<SVector<f64, D>> = coordinates
            .iter()
            .map(|r| SVector::from_column_slice(r))
            .collect();
        let n = positions.len();
        let between = Case {
            positions: positions.clone(),
            velocities: Vec::new(),
            ranges: Vec::new(),
            blind_angle: 0.0,
            side,
        };
        let range = prop_oneof![
            Just(0.0),
            0.0..60.0_f64,
            // Exactly the distance between two agents, or less by one rounding error.
            (0..n, 0..n, any::<bool>()).prop_map(move |(i, j, is_exact)| {
                let distance = between.squared_distance(i, j).sqrt();
                if is_exact {
                    distance
                } else {
                    distance * (1.0 - f64::EPSILON)
                }
            }),
            Just(1e151),
            Just(f64::MAX),
        ];
        let ranges = prop::collection::vec(range, n);
        let velocities = prop::collection::vec(prop::collection::vec(-20.0..20.0_f64, D), n);
        let blind_angle = 0.0..2.0 * PI;
        let parts = (Just(positions), velocities, ranges, blind_angle);
        parts.prop_map(move |(positions, velocities, ranges, blind_angle)| Case {
            blind_angle,
            side,
            positions,
            velocities: velocities
                .iter()
                .map(|v| SVector::from_column_slice(v))
                .collect(),
            ranges,
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(5000))]

    #[test]
    fn plane_equals_all_pairs(case in cases::<2>()) {
        check(&case)?;
    }

    #[test]
    fn space_equals_all_pairs(case in cases::<3>()) {
        check(&case)?;
    }
}

/// A tree of three levels. Sums do not depend on the agents' places.
#[test]
fn a_large_flock_equals_all_pairs_in_any_order() {
    let mut rng = rng::stream(0, Stream::Positions);
    let positions: Vec<SVector<f64, 2>> = (0..5000)
        .map(|_| SVector::from_fn(|_, _| rng::uniform(&mut rng, 100.0)))
        .collect();
    let mut case = Case {
        blind_angle: 0.0,
        side: Some(100.0),
        velocities: positions.iter().map(|r| r / 10.0).collect(),
        ranges: positions.iter().map(|r| r[0] / 3.0).collect(),
        positions,
    };
    check(&case).expect("equal");
    case.side = None;
    check(&case).expect("equal");
    let mut agents = Agents::new(&case.positions, &case.velocities);
    let mut neighborhood = Neighborhood::new(NeighborOptions::METRIC, &mut agents);
    neighborhood.sum_neighbors(&mut agents, Ranges::Shared(7.0));
    let counts_by_id = |neighborhood: &Neighborhood<2>, agents: &Agents<2>| {
        let mut counts = vec![0; agents.len()];
        for (place, &id) in agents.ids().iter().enumerate() {
            counts[id as usize] = neighborhood.sums()[place / GROUP].count[place % GROUP];
        }
        counts
    };
    let counts = counts_by_id(&neighborhood, &agents);
    // The same agents with other ids, and therefore at other places.
    case.positions.reverse();
    case.velocities.reverse();
    let mut agents = Agents::new(&case.positions, &case.velocities);
    let mut neighborhood = Neighborhood::new(NeighborOptions::METRIC, &mut agents);
    neighborhood.sum_neighbors(&mut agents, Ranges::Shared(7.0));
    let mut reversed = counts_by_id(&neighborhood, &agents);
    reversed.reverse();
    assert_eq!(counts, reversed);
}
