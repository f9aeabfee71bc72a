//! Memory layout of the agents: groups of 64, stored as columns for SIMD, in the order of a Hilbert curve.

use multiversion::multiversion;

use crate::base::exact::Scale;
use crate::base::vector::{larger, smaller};
use crate::parallel;

/// Number of agents in a leaf: one AVX-512 register of f64.
pub(crate) const LEAF: usize = 8;
/// Number of leaves in a group, and of children of a node of the tree.
pub(crate) const FANOUT: usize = 8;
/// Number of agents in a group.
pub(crate) const GROUP: usize = LEAF * FANOUT;

/// Returns whether a flock of `num_agents` is large enough to be stepped on several threads.
pub(crate) fn is_large(num_agents: usize) -> bool {
    num_agents / GROUP >= parallel::MIN_ITEMS
}

/// One value for every agent of a group. An agent's index in its group is its lane.
pub(crate) type Column<T> = [T; GROUP];

/// The agents of one group, column by column. Lanes without an agent have a position of NaN, for which every
/// comparison of distances is false.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct Group<const D: usize> {
    /// r in m.
    pub(crate) position: [Column<f64>; D],
    /// v in m/s; 0 in empty lanes.
    pub(crate) velocity: [Column<f64>; D],
    /// v in fixed point, in the unit of the tree; 0 in empty lanes. The tree computes it.
    pub(crate) fixed_velocity: [Column<i64>; D],
    /// ||v|| in m/s.
    pub(crate) speed: Column<f64>,
    /// Distance to the nearest predator in m; infinite without predators, NaN in empty lanes.
    pub(crate) distance: Column<f64>,
}

impl<const D: usize> Group<D> {
    pub(crate) const EMPTY: Self = Self {
        position: [[f64::NAN; GROUP]; D],
        velocity: [[0.0; GROUP]; D],
        fixed_velocity: [[0; GROUP]; D],
        speed: [0.0; GROUP],
        distance: [f64::NAN; GROUP],
    };

    /// Clears the lanes from `first` on.
    pub(super) fn empty_from(&mut self, first: usize) {
        for axis in 0..D {
            self.position[axis][first..].fill(f64::NAN);
            self.velocity[axis][first..].fill(0.0);
        }
        self.speed[first..].fill(0.0);
        self.distance[first..].fill(f64::NAN);
    }
}

/// Reduces values to one by pairwise folding of their halves. N is a power of two.
#[inline(always)]
pub(crate) fn reduce<T: Copy, const N: usize>(mut values: [T; N], fold: impl Fn(T, T) -> T) -> T {
    let mut width = N / 2;
    while width > 0 {
        for lane in 0..width {
            values[lane] = fold(values[lane], values[lane + width]);
        }
        width /= 2;
    }
    values[0]
}

/// Returns the corners in m of the bounding box of all agents.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(crate) fn corners<const D: usize>(groups: &[Group<D>]) -> ([f64; D], [f64; D]) {
    let (mut lowest, mut highest) = ([0.0; D], [0.0; D]);
    for axis in 0..D {
        let (mut low, mut high) = ([f64::INFINITY; GROUP], [f64::NEG_INFINITY; GROUP]);
        for group in groups {
            let column = &group.position[axis];
            for lane in 0..GROUP {
                low[lane] = smaller(low[lane], column[lane]);
                high[lane] = larger(high[lane], column[lane]);
            }
        }
        lowest[axis] = reduce(low, smaller);
        highest[axis] = reduce(high, larger);
    }
    (lowest, highest)
}

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

/// A place on the curve in the upper half, and the place of an agent in the lower half.
pub(super) type Key = u64;

/// Returns the place of the agent of a key.
pub(super) fn place_of(key: Key) -> usize {
    key as u32 as usize
}

/// Writes the keys of the first `num_agents` agents in the order of the curve.
pub(super) fn order<const D: usize>(groups: &[Group<D>], num_agents: usize, keys: &mut Vec<Key>) {
    let (low, high) = corners(groups);
    let extent = (0..D).fold(0.0, |most, axis| larger(most, high[axis] - low[axis]));
    let scale = f64::from((1_u32 << bits::<D>()) - 1) / extent;
    keys.resize(groups.len() * GROUP, 0);
    let (columns, _) = keys.as_chunks_mut::<GROUP>();
    parallel::for_each_chunk(columns, |first, columns| {
        write_keys(&groups[first..], low, scale, first, columns);
    });
    keys.truncate(num_agents);
    parallel::sort(keys);
}

/// Number of bits of a coordinate on the curve.
const fn bits<const D: usize>() -> u32 {
    30 / D as u32
}

/// Writes the keys of all lanes of some groups.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn write_keys<const D: usize>(
    groups: &[Group<D>],
    low: [f64; D],
    scale: f64,
    first: usize,
    keys: &mut [Column<Key>],
) {
    for (index, (group, keys)) in groups.iter().zip(keys).enumerate() {
        let mut coordinates = [[0; GROUP]; D];
        for axis in 0..D {
            for lane in 0..GROUP {
                let offset = group.position[axis][lane] - low[axis];
                coordinates[axis][lane] = (offset * scale) as u32;
            }
        }
        let distance = along_curve(coordinates);
        for lane in 0..GROUP {
            let place = (first + index) * GROUP + lane;
            keys[lane] = Key::from(distance[lane]) << 32 | place as Key;
        }
    }
}

/// Returns the places of points on a Hilbert curve: J. Skilling, "Programming the Hilbert curve", AIP Conf. Proc.
/// 707 (2004), for all lanes at once.
#[inline(always)]
fn along_curve<const D: usize>(mut x: [Column<u32>; D]) -> Column<u32> {
    let bits = bits::<D>();
    for bit in (1..bits).rev() {
        let below = (1 << bit) - 1;
        for axis in 0..D {
            for lane in 0..GROUP {
                // All ones if the bit is set: inverts the first coordinate. Otherwise both exchange their low bits.
                let is_set = (x[axis][lane] >> bit & 1).wrapping_neg();
                let exchanged = (x[0][lane] ^ x[axis][lane]) & below & !is_set;
                x[0][lane] ^= exchanged | (below & is_set);
                x[axis][lane] ^= exchanged;
            }
        }
    }
    for axis in 1..D {
        for lane in 0..GROUP {
            x[axis][lane] ^= x[axis - 1][lane];
        }
    }
    let mut inverted = [0; GROUP];
    for bit in (1..bits).rev() {
        for lane in 0..GROUP {
            inverted[lane] ^= (x[D - 1][lane] >> bit & 1).wrapping_neg() & ((1 << bit) - 1);
        }
    }
    let mut place = [0; GROUP];
    for bit in (0..bits).rev() {
        for column in &x {
            for lane in 0..GROUP {
                place[lane] = place[lane] << 1 | ((column[lane] ^ inverted[lane]) >> bit & 1);
            }
        }
    }
    place
}
