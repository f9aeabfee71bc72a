//! Groups of agents, column by column, in multiples of vector registers.

use crate::parallel;

/// Agents of a tile: one AVX-512 register of f64.
pub(crate) const TILE: usize = 8;
/// Tiles of a group, and children of every node of the tree above it.
pub(crate) const FAN: usize = 8;
/// Agents of a group.
pub(crate) const GROUP: usize = TILE * FAN;

/// Whether one flock of `num_agents` is stepped on several threads.
pub(crate) fn is_large(num_agents: usize) -> bool {
    num_agents / GROUP >= parallel::MIN_ITEMS
}

/// A column of one group.
pub(crate) type Column<T> = [T; GROUP];

/// The agents of one group. Empty lanes have a position of NaN, which no comparison finds near.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct Group<const D: usize> {
    /// r in m.
    pub(crate) position: [Column<f64>; D],
    /// v in m/s; 0 in empty lanes.
    pub(crate) velocity: [Column<f64>; D],
    /// ||v|| in m/s.
    pub(crate) speed: Column<f64>,
    /// Distance to the nearest predator in m; infinite without predators, NaN in empty lanes.
    pub(crate) distance: Column<f64>,
}

impl<const D: usize> Group<D> {
    pub(super) const EMPTY: Self = Self {
        position: [[f64::NAN; GROUP]; D],
        velocity: [[0.0; GROUP]; D],
        speed: [0.0; GROUP],
        distance: [f64::NAN; GROUP],
    };

    /// Empties the lanes from `first` on.
    pub(super) fn empty_from(&mut self, first: usize) {
        for axis in 0..D {
            self.position[axis][first..].fill(f64::NAN);
            self.velocity[axis][first..].fill(0.0);
        }
        self.speed[first..].fill(0.0);
        self.distance[first..].fill(f64::NAN);
    }
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
