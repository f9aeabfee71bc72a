//! Every neighbor rule with all options against its definition.

use std::f64::consts::PI;

use nalgebra::SVector;
use proptest::prelude::*;

use super::{Case, cases, range_of};
use crate::agents::{Agents, GROUP};
use crate::neighbor::{FieldOfView, NeighborOptions, NeighborRule, Neighborhood, Ranges, Torus};

/// Options of the neighbor graph in the form of a scenario.
#[derive(Debug, Clone, Copy)]
struct Options {
    rule: NeighborRule,
    blind_angle: f64,
    is_mutual: bool,
}

impl Options {
    fn internal(self, side: Option<f64>, is_frozen: bool) -> NeighborOptions {
        NeighborOptions {
            rule: self.rule,
            field_of_view: FieldOfView::new(self.blind_angle),
            torus: Torus::new(side),
            is_mutual: self.is_mutual,
            is_frozen,
            needs_pairs: true,
            ..NeighborOptions::METRIC
        }
    }
}

fn options() -> impl Strategy<Value = Options> {
    let rule = prop_oneof![
        Just(NeighborRule::Metric {}),
        Just(NeighborRule::Topological {})
    ];
    let blind_angle = prop_oneof![Just(0.0), 0.0..2.0 * PI];
    (rule, blind_angle, any::<bool>()).prop_map(|(rule, blind_angle, is_mutual)| Options {
        rule,
        blind_angle,
        is_mutual,
    })
}

fn squared(offset: &[f64]) -> f64 {
    offset.iter().map(|x| x * x).sum()
}

/// Returns whether agent i sees agent j, by definition.
fn sees<const D: usize>(case: &Case<D>, options: Options, i: usize, j: usize) -> bool {
    let (offset, velocity) = (case.offset(i, j), case.velocities[i]);
    let along: f64 = (0..D).map(|axis| velocity[axis] * offset[axis]).sum();
    let speed = squared(velocity.as_slice()).sqrt();
    let edge = libm::cos(PI - options.blind_angle / 2.0);
    options.blind_angle == 0.0 || along >= edge * (speed * squared(&offset).sqrt())
}

/// Returns all pairs (agent, neighbor) of different agents, by definition.
fn reference<const D: usize>(
    case: &Case<D>,
    ranges: Ranges<'_>,
    options: Options,
) -> Vec<(u32, u32)> {
    let n = case.positions.len();
    let distance = |i, j| case.squared_distance(i, j);
    let reach = |i: usize| {
        let range = range_of(ranges, i);
        match options.rule {
            NeighborRule::Metric {} | NeighborRule::Voronoi {} => (range * range).min(f64::MAX),
            NeighborRule::Topological {} => {
                let others = (0..n).filter(|&j| j != i && sees(case, options, i, j));
                let mut distances: Vec<f64> = others.map(|j| distance(i, j)).collect();
                distances.sort_by(f64::total_cmp);
                match (range + 0.5) as usize {
                    0 => 0.0,
                    k => distances.get(k - 1).copied().unwrap_or(f64::MAX),
                }
            }
        }
    };
    let reaches: Vec<f64> = (0..n).map(reach).collect();
    let is_neighbor =
        |i: usize, j: usize| distance(i, j) <= reaches[i] && sees(case, options, i, j);
    let pairs = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    pairs
        .filter(|&(i, j)| i != j && is_neighbor(i, j) && (!options.is_mutual || is_neighbor(j, i)))
        .map(|(i, j)| (i as u32, j as u32))
        .collect()
}

/// Compares the pairs, sums and components of the engine with the ones that follow from the expected pairs.
fn check<const D: usize>(
    case: &Case<D>,
    ranges: Ranges<'_>,
    options: NeighborOptions,
    expected: &[(u32, u32)],
) -> Result<(), TestCaseError> {
    let mut agents = Agents::new(&case.positions, &case.velocities);
    let mut neighborhood = Neighborhood::new(options, &mut agents);
    if !options.is_frozen {
        let mut pairs = neighborhood
            .pairs_by_id(&agents, ranges)
            .expect("few pairs");
        pairs.sort_unstable();
        prop_assert_eq!(&pairs[..], expected);
    }
    neighborhood.freeze(&agents, ranges).expect("few pairs");
    neighborhood.sum_neighbors(&mut agents, ranges);
    // The second step starts from the reaches of the first. With a frozen graph, ranges no longer matter.
    let again = if options.is_frozen {
        Ranges::Shared(0.0)
    } else {
        ranges
    };
    for ranges in [ranges, again] {
        neighborhood.sum_neighbors(&mut agents, ranges);
        let scale = neighborhood.scale();
        let mut sums: Vec<([i64; D], i64)> = case
            .velocities
            .iter()
            .map(|velocity| {
                (
                    std::array::from_fn(|axis| scale.quantize(velocity[axis])),
                    1,
                )
            })
            .collect();
        for &(i, j) in expected {
            for axis in 0..D {
                sums[i as usize].0[axis] += scale.quantize(case.velocities[j as usize][axis]);
            }
            sums[i as usize].1 += 1;
        }
        for (place, &id) in agents.ids().iter().enumerate() {
            let (found, lane) = (&neighborhood.sums()[place / GROUP], place % GROUP);
            let sum: [i64; D] = std::array::from_fn(|axis| found.sum[axis][lane]);
            prop_assert_eq!((sum, found.count[lane]), sums[id as usize]);
        }
        let mut labels: Vec<u32> = (0..agents.len() as u32).collect();
        let mut is_settled = false;
        while !is_settled {
            is_settled = true;
            for &(i, j) in expected {
                let lowest = labels[i as usize].min(labels[j as usize]);
                is_settled &= labels[i as usize] == labels[j as usize];
                (labels[i as usize], labels[j as usize]) = (lowest, lowest);
            }
        }
        prop_assert_eq!(&neighborhood.component_labels(&agents, ranges), &labels);
    }
    Ok(())
}

/// Compares the engine with the definition, with a shared range and with one range per agent.
fn check_all<const D: usize>(case: &Case<D>, options: Options) -> Result<(), TestCaseError> {
    for ranges in [
        Ranges::Shared(case.ranges[0]),
        Ranges::PerAgent(&case.ranges),
    ] {
        let expected = reference(case, ranges, options);
        for is_frozen in [false, true] {
            check(
                case,
                ranges,
                options.internal(case.side, is_frozen),
                &expected,
            )?;
        }
    }
    Ok(())
}

/// Returns whether the Voronoi cells of two points share an edge of positive length, in exact integer
/// arithmetic.
fn share_an_edge(points: &[[i128; 2]], i: usize, j: usize) -> bool {
    let dot = |a: [i128; 2], b: [i128; 2]| a[0] * b[0] + a[1] * b[1];
    let minus = |a: [i128; 2], b: [i128; 2]| [a[0] - b[0], a[1] - b[1]];
    let (a, b) = (points[i], points[j]);
    if a == b {
        return true;
    }
    // At the point (a + b) / 2 + t across of the bisector, k is at least as far away as a if p + t q >= 0.
    let across = [a[1] - b[1], b[0] - a[0]];
    let (mut low, mut high) = ((-1, 0), (1, 0)); // bounds of t as fractions with denominators >= 0
    for &k in points {
        let p = dot([a[0] + b[0], a[1] + b[1]], minus(a, k)) + dot(k, k) - dot(a, a);
        let q = 2 * dot(across, minus(a, k));
        if q == 0 && p < 0 {
            return false;
        }
        let is_above = |x: (i128, i128), y: (i128, i128)| x.0 * y.1 > y.0 * x.1;
        if q > 0 && (low.1 == 0 || is_above((-p, q), low)) {
            low = (-p, q);
        }
        if q < 0 && (high.1 == 0 || is_above(high, (p, -q))) {
            high = (p, -q);
        }
    }
    low.1 == 0 || high.1 == 0 || low.0 * high.1 < high.0 * low.1
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn plane_equals_the_definition(case in cases::<2>(), options in options()) {
        check_all(&case, options)?;
    }

    #[test]
    fn space_equals_the_definition(case in cases::<3>(), options in options()) {
        check_all(&case, options)?;
    }

    /// Integer coordinates, so that points lie on common lines and circles and many coincide.
    #[test]
    fn voronoi_cells_share_edges(
        points in prop_oneof![
            prop::collection::vec((0..5_i32, 0..5_i32), 1..40),
            prop::collection::vec((0..9_i32, Just(0)), 1..20),
            prop::collection::vec((-1000..1000_i32, -1000..1000_i32), 1..70),
        ],
        range in prop_oneof![Just(0.0), 0.0..5.0_f64, Just(1e9)],
        headings in prop::collection::vec(0.0..2.0 * PI, 70),
        blind_angle in prop_oneof![Just(0.0), 0.0..2.0 * PI],
        is_mutual in any::<bool>(),
    ) {
        let case = Case {
            blind_angle: 0.0,
            side: None,
            positions: points.iter().map(|&(x, y)| SVector::from([f64::from(x), f64::from(y)])).collect(),
            velocities: headings[..points.len()]
                .iter()
                .map(|angle| SVector::from([angle.cos(), angle.sin()]))
                .collect(),
            ranges: vec![range],
        };
        let whole: Vec<[i128; 2]> = points.iter().map(|&(x, y)| [x.into(), y.into()]).collect();
        let options = Options { rule: NeighborRule::Voronoi {}, blind_angle, is_mutual };
        let ranges = Ranges::Shared(range);
        let mut expected = reference(&case, ranges, options);
        expected.retain(|&(i, j)| share_an_edge(&whole, i as usize, j as usize));
        for is_frozen in [false, true] {
            check(&case, ranges, options.internal(None, is_frozen), &expected)?;
        }
    }
}

/// The triangulation accepts coordinates up to 2^201 m.
/// Coordinates beyond the bounds of a triangulation: 2^201 m, and 2^-142 m or 0.
#[test]
fn agents_beyond_the_bounds_of_a_triangulation_have_neighbors_at_the_same_point() {
    let far = [
        [0.0, 0.0],
        [1e70, 0.0],
        [1.0, 0.0],
        [1e70, 0.0],
        [1e70, 1.0],
    ];
    let near = |least: f64| [0.0, 1.0, 0.0, 2.0, 3.0].map(|x| [x * least, 0.0]);
    let least = 0.5_f64.powi(142);
    let everyone = (0..5).flat_map(|i| (0..5).map(move |j| (i, j)));
    let cases = [
        (far, vec![(0, 2), (1, 3), (2, 0), (3, 1)]),
        (
            near(least),
            [(0, 1), (1, 2), (0, 2), (1, 3), (3, 4)]
                .into_iter()
                .flat_map(|(i, j)| [(i, j), (j, i)])
                .collect(),
        ),
        (
            near(least / 4.0),
            everyone.filter(|(i, j)| i != j).collect(),
        ),
    ];
    let options = Options {
        rule: NeighborRule::Voronoi {},
        blind_angle: 0.0,
        is_mutual: false,
    };
    for (points, mut expected) in cases {
        let case = Case {
            blind_angle: 0.0,
            side: None,
            positions: points.map(SVector::from).to_vec(),
            velocities: vec![SVector::from([1.0, 0.0]); points.len()],
            ranges: vec![f64::MAX],
        };
        expected.sort_unstable();
        check(
            &case,
            Ranges::Shared(f64::MAX),
            options.internal(None, false),
            &expected,
        )
        .expect("equal");
    }
}
