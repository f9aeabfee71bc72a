//! The mean position of all agents, independent of their order.

use multiversion::multiversion;

use super::layout::{GROUP, Group, reduce};
use crate::base::exact::Scale;
use crate::parallel;

/// Returns the mean position in m of all agents. `low` and `high` are the corners of their bounding box.
pub(crate) fn centroid<const D: usize>(
    groups: &[Group<D>],
    (low, high): ([f64; D], [f64; D]),
    num_agents: usize,
) -> [f64; D] {
    let farthest = (0..D).fold(0.0, |most: f64, axis| {
        most.max(low[axis].abs()).max(high[axis].abs())
    });
    let scale = Scale::for_registers(farthest, num_agents);
    let sums = parallel::map_reduce(
        groups,
        |chunk| total_position(chunk, scale),
        |a: [i64; D], b| std::array::from_fn(|axis| a[axis] + b[axis]),
    );
    let sums = sums.unwrap_or([0; D]);
    // Rounding may move the mean out of the box; clamping bounds its distance to every agent by the box.
    std::array::from_fn(|axis| {
        let mean = scale.value(sums[axis]) / num_agents as f64;
        mean.max(low[axis]).min(high[axis])
    })
}

/// Returns the sum of the positions in units of `scale`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn total_position<const D: usize>(groups: &[Group<D>], scale: Scale) -> [i64; D] {
    let mut sums = [[0; GROUP]; D];
    for group in groups {
        for axis in 0..D {
            let column = &group.position[axis];
            for lane in 0..GROUP {
                let is_agent = -i64::from(!column[lane].is_nan());
                sums[axis][lane] += scale.quantize(column[lane]) & is_agent;
            }
        }
    }
    sums.map(|column| reduce(column, |a, b| a + b))
}
