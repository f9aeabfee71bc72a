//! Where a flock may start: the plane z = 0 or all of R^D, with what shapes are drawn from.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;

use crate::base::check::vector;
use crate::base::error::{Error, Result};
use crate::base::rng;
use crate::flock::scenario::FlockConfig;

/// The axes that a flock starts in; coordinates beyond them are 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Space {
    dimension: usize,
    /// 2, or 3 for a flock that fills space.
    pub(super) axes: usize,
    /// Side in m of the initial region `[0, side]^axes`.
    side: f64,
}

impl Space {
    pub(crate) fn of(config: &FlockConfig) -> Self {
        let dimension = config.dimension;
        Self {
            dimension,
            axes: if config.initial_plane { 2 } else { dimension },
            side: config.initial_side,
        }
    }

    /// Checks that a scenario's vector has 2 or D finite entries and lies in this space.
    pub(super) fn check(&self, field: &str, entries: &[f64]) -> Result<()> {
        vector(field, entries, self.dimension)?;
        match entries.get(self.axes) {
            Some(&above) if above != 0.0 => Err(Error::config(
                format!("{field}[{}]", self.axes),
                "0, as initial_plane is true",
                above,
            )),
            _ => Ok(()),
        }
    }

    /// Checks that a scenario has `count` such vectors.
    pub(super) fn check_each(&self, field: &str, vectors: &[Vec<f64>], count: usize) -> Result<()> {
        if vectors.len() != count {
            let expected = format!("{count} entries, one per agent");
            return Err(Error::config(field, expected, vectors.len()));
        }
        let mut places = vectors.iter().enumerate();
        places.try_for_each(|(k, vector)| self.check(&format!("{field}[{k}]"), vector))
    }

    fn along_axes<const D: usize>(&self, mut entry: impl FnMut() -> f64) -> SVector<f64, D> {
        SVector::from_fn(|axis, _| if axis < self.axes { entry() } else { 0.0 })
    }

    /// Center of the initial region.
    pub(super) fn center<const D: usize>(&self) -> SVector<f64, D> {
        self.along_axes(|| self.side / 2.0)
    }

    /// Uniform in the initial region.
    pub(super) fn uniform<const D: usize>(&self, rng: &mut ChaCha8Rng) -> SVector<f64, D> {
        self.along_axes(|| rng::uniform(rng, self.side))
    }

    /// Normal with mean 0 and this standard deviation along every axis.
    pub(super) fn normal<const D: usize>(
        &self,
        standard_deviation: f64,
        rng: &mut ChaCha8Rng,
    ) -> SVector<f64, D> {
        self.along_axes(|| standard_deviation * rng::normal(rng))
    }

    /// A unit vector, uniform over all directions.
    pub(super) fn direction<const D: usize>(&self, rng: &mut ChaCha8Rng) -> SVector<f64, D> {
        rng::direction(self.axes, rng)
    }

    /// Uniform between two spheres (in the plane: circles) around the center of the initial region.
    pub(super) fn shell<const D: usize>(
        &self,
        inner: f64,
        outer: f64,
        rng: &mut ChaCha8Rng,
    ) -> SVector<f64, D> {
        let direction = self.direction(rng);
        // The volume within a radius grows with its power `axes`; ratios do not overflow.
        let hollow: f64 = (0..self.axes).map(|_| inner / outer).product();
        let volume = hollow + rng::uniform(rng, 1.0 - hollow);
        let ratio = match self.axes {
            2 => volume.sqrt(),
            _ => libm::cbrt(volume),
        };
        self.center() + direction * (outer * ratio)
    }
}

/// The vector with these entries; missing ones are 0.
pub(super) fn embed<const D: usize>(entries: &[f64]) -> SVector<f64, D> {
    SVector::from_fn(|axis, _| entries.get(axis).copied().unwrap_or(0.0))
}
