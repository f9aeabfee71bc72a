//! Herding: a predator drives the flock toward its partner, from behind.

use super::shared::flight::steering;
use super::shared::prey::Prey;
use super::{Predator, PredatorConfig};
use crate::base::check::quantity;
use crate::base::error::{Error, Result};
use crate::base::vector::unit;

steering! {
    /// Turns toward the point behind the flock as its partner sees it.
    Herd {
        /// Distance of that point from the centroid in m, at least 0.
        distance: f64,
        /// Index of the partner among the predators.
        partner: usize,
    }
}

impl Herd {
    /// Checks the predator with this `index` among `count`.
    pub(super) fn check(&self, path: &str, index: usize, count: usize) -> Result<()> {
        self.limits().check(path, &self.velocity)?;
        quantity(&format!("{path}.distance"), self.distance)?;
        if self.partner >= count || self.partner == index {
            let expected = format!("the index of another one of {count} predators");
            return Err(Error::config(
                format!("{path}.partner"),
                expected,
                self.partner,
            ));
        }
        Ok(())
    }
}

/// Tells every herding predator where to drive from; nothing where its partner is at the centroid.
pub(super) fn take_posts<const D: usize>(predators: &mut [Predator<D>], prey: Prey<'_, D>) {
    if !predators
        .iter()
        .any(|p| matches!(p.strategy, PredatorConfig::Herd(_)))
    {
        return;
    }
    let Some(center) = prey.centroid() else {
        return;
    };
    for index in 0..predators.len() {
        if let PredatorConfig::Herd(herd) = &predators[index].strategy {
            let behind = unit(&(center - predators[herd.partner].position));
            predators[index].agreed = behind.map(|away| center + away * herd.distance);
        }
    }
}
