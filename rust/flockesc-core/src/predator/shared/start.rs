//! `Start`: a predator's position and velocity at t = 0.

use nalgebra::SVector;

use crate::base::error::Result;

/// The position and velocity of a predator at t = 0.
pub(in crate::predator) trait Start {
    /// Whether the strategy determines them, so that an initial state cannot replace them.
    const IS_FIXED: bool = false;

    /// Checks their fields. `path` is the strategy's path in the scenario.
    fn check_start(&self, path: &str, dimension: usize) -> Result<()>;

    /// Returns r_p(0) in m and v_p(0) in m/s. `time_step` is dt in s.
    fn start<const D: usize>(&self, time_step: f64) -> (SVector<f64, D>, SVector<f64, D>);
}

/// Implements [`Start`] for a strategy with the fields `position` and `velocity`.
macro_rules! given_start {
    ($Strategy:ident) => {
        impl $crate::predator::shared::start::Start for $Strategy {
            fn check_start(&self, path: &str, dimension: usize) -> $crate::base::error::Result<()> {
                use $crate::base::check::vector;
                vector(&format!("{path}.position"), &self.position, dimension)?;
                vector(&format!("{path}.velocity"), &self.velocity, dimension)
            }

            fn start<const D: usize>(
                &self,
                _time_step: f64,
            ) -> (nalgebra::SVector<f64, D>, nalgebra::SVector<f64, D>) {
                use $crate::predator::shared::start::embed;
                (embed(&self.position), embed(&self.velocity))
            }
        }
    };
}
pub(in crate::predator) use given_start;

/// Converts coordinates into a vector. Missing ones are 0.
pub(in crate::predator) fn embed<const D: usize>(coordinates: &[f64]) -> SVector<f64, D> {
    SVector::from_fn(|k, _| coordinates.get(k).copied().unwrap_or(0.0))
}
