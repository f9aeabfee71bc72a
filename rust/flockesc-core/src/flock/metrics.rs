//! Predator distances: of every agent, and their mean and minimum. Results do not depend on the order of the
//! agents.

use multiversion::multiversion;

use crate::agents::{Column, GROUP, Group, reduce};
use crate::base::exact::Scale;
use crate::base::vector::{larger, smaller, squared_norm};
use crate::parallel;

/// Returns d_i, the distance in m from every agent of a group to its nearest predator. It is infinite without
/// predators, and NaN in empty lanes.
#[inline(always)]
pub(crate) fn distances<const D: usize>(
    position: &[Column<f64>; D],
    predators: &[[f64; D]],
) -> Column<f64> {
    let mut squared = [f64::INFINITY; GROUP];
    for lane in 0..GROUP {
        let is_empty = position[0][lane].is_nan();
        squared[lane] = if is_empty { f64::NAN } else { f64::INFINITY };
    }
    for predator in predators {
        for lane in 0..GROUP {
            let offset: [f64; D] =
                std::array::from_fn(|axis| position[axis][lane] - predator[axis]);
            squared[lane] = smaller(squared[lane], squared_norm(&offset));
        }
    }
    let mut distances = squared;
    for lane in 0..GROUP {
        distances[lane] = squared[lane].sqrt();
    }
    distances
}

/// Sets the distances in m of the agents to the ones to the nearest of `places`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(crate) fn measure<const D: usize>(groups: &mut [Group<D>], places: &[[f64; D]]) {
    for group in groups {
        group.distance = distances(&group.position, places);
    }
}

/// Mean and minimum predator distance in m. Each agent's distance is the one to its nearest predator.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PredatorDistance {
    /// dbar, the mean over the agents. Infinite without predators, 0 without agents.
    pub mean: f64,
    /// dmin, the minimum over the agents. Infinite without predators, 0 without agents.
    pub minimum: f64,
}

impl PredatorDistance {
    pub(crate) fn of<const D: usize>(groups: &[Group<D>], num_agents: usize) -> Self {
        if num_agents == 0 {
            return Self::default();
        }
        let (minimum, maximum) = parallel::map_reduce(groups, extremes, |a, b| {
            (smaller(a.0, b.0), larger(a.1, b.1))
        })
        .unwrap_or((f64::INFINITY, f64::INFINITY));
        let mean = if maximum.is_finite() {
            let scale = Scale::for_registers(maximum, num_agents);
            let sum = parallel::map_reduce(groups, |chunk| total(chunk, scale), |a, b| a + b);
            scale.mean(sum.unwrap_or(0), num_agents as i64)
        } else {
            maximum
        };
        Self { mean, minimum }
    }
}

/// Returns the smallest and the largest distance.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn extremes<const D: usize>(groups: &[Group<D>]) -> (f64, f64) {
    let (mut smallest, mut largest) = ([f64::INFINITY; GROUP], [0.0; GROUP]);
    for group in groups {
        let column = &group.distance;
        for lane in 0..GROUP {
            smallest[lane] = smaller(smallest[lane], column[lane]);
            largest[lane] = larger(largest[lane], column[lane]);
        }
    }
    (reduce(smallest, smaller), reduce(largest, larger))
}

/// Returns the sum of the distances in units of `scale`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn total<const D: usize>(groups: &[Group<D>], scale: Scale) -> i64 {
    let mut sums = [0; GROUP];
    for group in groups {
        let column = &group.distance;
        for lane in 0..GROUP {
            let units = scale.quantize(column[lane]);
            sums[lane] += if column[lane].is_nan() { 0 } else { units };
        }
    }
    reduce(sums, |a, b| a + b)
}
