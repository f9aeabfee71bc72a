//! `Space`: the space that a flock starts in, either the plane z = 0 or R^D, and basic distributions in it.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;

use crate::base::check::{length, require, vector};
use crate::base::error::{Error, Result};
use crate::base::rng;
use crate::base::vector::{SHORTEST, embed};

/// The space that a flock starts in: the plane z = 0 or R^D.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Space {
    dimension: usize,
    /// Number of axes, 2 or 3. Initial coordinates along other axes are 0.
    pub(super) axes: usize,
    /// Side in m of the initial region `[0, side]^axes`.
    side: f64,
}

impl Space {
    /// Creates the plane z = 0 if `is_plane`, otherwise R^`dimension`. `side` is in m.
    pub(crate) fn new(dimension: usize, is_plane: bool, side: f64) -> Self {
        Self {
            dimension,
            axes: if is_plane { 2 } else { dimension },
            side,
        }
    }

    /// Checks that a scenario's vector has 2 or D finite entries and lies in this space.
    pub(super) fn check(&self, field: &str, entries: &[f64]) -> Result<()> {
        let expected = match entries.len() {
            2 => 2,
            _ if self.dimension == 2 => 2,
            3 => 3,
            given => {
                let given = format!("{given} numbers");
                return Err(Error::input(field, "2 or 3 numbers", given));
            }
        };
        vector(field, entries, expected)?;
        let above = entries.get(self.axes).copied().unwrap_or(0.0);
        let field = format!("{field}[{}]", self.axes);
        require(above == 0.0, &field, "0 if initial_plane is true", above)
    }

    /// Checks that there are `count` vectors, each as [`Self::check`] does.
    pub(super) fn check_each(&self, field: &str, vectors: &[Vec<f64>], count: usize) -> Result<()> {
        length(field, vectors.len(), count, "entries", ", one per agent")?;
        let mut places = vectors.iter().enumerate();
        places.try_for_each(|(k, vector)| self.check(&format!("{field}[{k}]"), vector))
    }

    /// Checks a vector as [`Self::check`] does, and that it is long enough to have a direction.
    pub(super) fn check_direction(&self, field: &str, entries: &[f64]) -> Result<()> {
        self.check(field, entries)?;
        let norm = embed::<3>(entries).norm();
        let expected = format!("a vector longer than {SHORTEST:?}");
        require(norm > SHORTEST, field, &expected, norm)
    }

    fn along_axes<const D: usize>(&self, mut entry: impl FnMut() -> f64) -> SVector<f64, D> {
        SVector::from_fn(|axis, _| if axis < self.axes { entry() } else { 0.0 })
    }

    /// Returns the center of the initial region in m.
    pub(super) fn center<const D: usize>(&self) -> SVector<f64, D> {
        self.along_axes(|| self.side / 2.0)
    }

    /// Draws a point uniformly from the initial region.
    pub(super) fn uniform<const D: usize>(&self, rng: &mut ChaCha8Rng) -> SVector<f64, D> {
        self.along_axes(|| rng::uniform(rng, self.side))
    }

    /// Draws a normal vector with mean 0 and this standard deviation along every axis.
    pub(super) fn normal<const D: usize>(
        &self,
        standard_deviation: f64,
        rng: &mut ChaCha8Rng,
    ) -> SVector<f64, D> {
        self.along_axes(|| standard_deviation * rng::normal(rng))
    }

    /// Draws a unit vector uniformly from all directions.
    pub(super) fn direction<const D: usize>(&self, rng: &mut ChaCha8Rng) -> SVector<f64, D> {
        rng::direction(self.axes, rng)
    }

    /// Draws a point uniformly from the region between two spheres (in the plane: circles) around the center
    /// of the initial region. `inner` and `outer` are their radii in m.
    pub(super) fn shell<const D: usize>(
        &self,
        inner: f64,
        outer: f64,
        rng: &mut ChaCha8Rng,
    ) -> SVector<f64, D> {
        let direction = self.direction(rng);
        // The volume inside a radius is proportional to radius^axes. Ratios of radii do not overflow.
        let hollow: f64 = (0..self.axes).map(|_| inner / outer).product();
        let volume = hollow + rng::uniform(rng, 1.0 - hollow);
        let ratio = match self.axes {
            2 => volume.sqrt(),
            _ => libm::cbrt(volume),
        };
        self.center() + direction * (outer * ratio)
    }
}

/// Calls `draw` `count` times and collects the results.
pub(super) fn repeat<T>(count: usize, draw: impl FnMut() -> T) -> Vec<T> {
    std::iter::repeat_with(draw).take(count).collect()
}
