//! Predator distances and polarization: pure functions of the state, free of the order of the agents.

use multiversion::multiversion;

use crate::agents::{Column, GROUP, Group};
use crate::exact::Scale;

/// d_i, the distance of every agent of a group to its nearest predator, in m; infinite where there is none, NaN where
/// there is no agent.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct Distances(pub(crate) Column<f64>);

impl Distances {
    #[inline(always)]
    pub(crate) fn of<const D: usize>(group: &Group<D>, predators: &[[f64; D]]) -> Self {
        // Infinity for agents, NaN where there is none.
        let mut squared = group.position[0];
        for lane in 0..GROUP {
            squared[lane] = if squared[lane].is_nan() { f64::NAN } else { f64::INFINITY };
        }
        for predator in predators {
            for lane in 0..GROUP {
                let offset: [f64; D] = std::array::from_fn(|axis| group.position[axis][lane] - predator[axis]);
                let square = squared_norm(&offset);
                squared[lane] = if square < squared[lane] { square } else { squared[lane] };
            }
        }
        Self(squared.map(f64::sqrt))
    }
}

/// Mean and minimum over the agents of the distance to the nearest predator, in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredatorDistance {
    /// dbar; infinite without predators.
    pub mean: f64,
    /// dmin; infinite without predators.
    pub minimum: f64,
}

impl PredatorDistance {
    pub(crate) fn of(distances: &[Distances], num_agents: usize) -> Self {
        let (minimum, maximum) = extremes(distances);
        let mean = if maximum.is_finite() {
            let scale = Scale::new(maximum, num_agents);
            scale.value(total(distances, scale)) / num_agents as f64
        } else {
            maximum
        };
        Self { mean, minimum }
    }
}

/// The smallest and the largest distance.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn extremes(distances: &[Distances]) -> (f64, f64) {
    let (mut smallest, mut largest) = ([f64::INFINITY; GROUP], [0.0; GROUP]);
    for Distances(column) in distances {
        for lane in 0..GROUP {
            smallest[lane] = smaller(smallest[lane], column[lane]);
            largest[lane] = larger(largest[lane], column[lane]);
        }
    }
    (reduce(smallest, smaller), reduce(largest, larger))
}

/// Sum of the distances in units of `scale`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn total(distances: &[Distances], scale: Scale) -> i64 {
    let mut sums = [0; GROUP];
    for Distances(column) in distances {
        for lane in 0..GROUP {
            let units = scale.quantize(column[lane]);
            sums[lane] += if column[lane].is_nan() { 0 } else { units };
        }
    }
    reduce(sums, |a, b| a + b)
}

/// Folds a column into one value, half onto half.
#[inline(always)]
pub(crate) fn reduce<T: Copy>(mut column: Column<T>, fold: impl Fn(T, T) -> T) -> T {
    let mut width = GROUP / 2;
    while width > 0 {
        for lane in 0..width {
            column[lane] = fold(column[lane], column[lane + width]);
        }
        width /= 2;
    }
    column[0]
}

/// The smaller one; `a` where `b` is NaN.
#[inline(always)]
pub(crate) fn smaller(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The larger one; `a` where `b` is NaN.
#[inline(always)]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// The squared Euclidean norm.
#[inline(always)]
pub(crate) fn squared_norm<const D: usize>(vector: &[f64; D]) -> f64 {
    (1..D).fold(vector[0] * vector[0], |sum, axis| sum + vector[axis] * vector[axis])
}

/// The arithmetic mean; summed in index order.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The smallest value.
pub(crate) fn minimum(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Norm of the mean heading, in [0, 1]; an agent at rest has no heading and counts as 0.
pub(crate) fn polarization<const D: usize>(groups: &[Group<D>], num_agents: usize) -> f64 {
    let scale = Scale::new(1.0, num_agents);
    let sum = headings(groups, scale).map(|sum| scale.value(sum) / num_agents as f64);
    squared_norm(&sum).sqrt().min(1.0)
}

/// Sum of the headings in units of `scale`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn headings<const D: usize>(groups: &[Group<D>], scale: Scale) -> [i64; D] {
    let mut sums = [[0; GROUP]; D];
    for group in groups {
        for lane in 0..GROUP {
            let velocity: [f64; D] = std::array::from_fn(|axis| group.velocity[axis][lane]);
            let norm = squared_norm(&velocity).sqrt();
            let factor = if norm > 0.0 { norm.recip() } else { 0.0 };
            for axis in 0..D {
                sums[axis][lane] += scale.quantize(velocity[axis] * factor);
            }
        }
    }
    sums.map(|sum| reduce(sum, |a, b| a + b))
}
