//! Initial positions in several normally distributed clusters.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::base::check::{MAX_AGENTS, quantity, within};
use crate::base::error::Result;
use crate::flock::initial::distribution::{Distribution, repeat};
use crate::flock::initial::space::Space;

/// Normal around centers that are uniform in the initial region. Agent i belongs to center i modulo
/// `num_clusters`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Clusters {
    /// Number of centers, at least 1.
    pub num_clusters: usize,
    /// Standard deviation of every coordinate around its center in m, at least 0.
    pub standard_deviation: f64,
}

impl Distribution for Clusters {
    fn check(&self, path: &str, _space: &Space, _count: usize) -> Result<()> {
        within(
            &format!("{path}.num_clusters"),
            self.num_clusters,
            1,
            MAX_AGENTS,
        )?;
        quantity(
            &format!("{path}.standard_deviation"),
            self.standard_deviation,
        )
    }

    fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        let num_centers = self.num_clusters.min(count); // further clusters would have no agents
        let centers: Vec<SVector<f64, D>> = repeat(num_centers, || space.uniform(rng));
        let center = centers.iter().cycle().take(count);
        center
            .map(|center| center + space.normal(self.standard_deviation, rng))
            .collect()
    }
}
