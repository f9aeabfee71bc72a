//! Predator distances and polarization: pure functions of the state.

use nalgebra::SVector;

use crate::vector::heading;

/// d_i, the distance of every agent to its nearest predator, in m; infinite where there is none.
pub(crate) fn distances<'a, const D: usize>(
    positions: &[SVector<f64, D>],
    predators: impl Iterator<Item = &'a SVector<f64, D>> + Clone,
    out: &mut Vec<f64>,
) {
    out.clear();
    out.extend(positions.iter().map(|position| {
        predators
            .clone()
            .map(|predator| (position - predator).norm())
            .fold(f64::INFINITY, f64::min)
    }));
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
pub(crate) fn polarization<const D: usize>(velocities: &[SVector<f64, D>]) -> f64 {
    let sum: SVector<f64, D> = velocities.iter().map(heading).sum();
    (sum / velocities.len() as f64).norm().min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    #[test]
    fn distance_is_to_the_nearest_predator() {
        let agents = [vector![0.0, 0.0], vector![10.0, 0.0]];
        let mut d = Vec::new();
        let predators = [vector![3.0, 4.0], vector![10.0, 2.0]];
        distances(&agents, predators.iter(), &mut d);
        assert_eq!(d, [5.0, 2.0]);
        assert_eq!((mean(&d), minimum(&d)), (3.5, 2.0));
        distances(&agents, [].iter(), &mut d);
        assert_eq!(mean(&d), f64::INFINITY);
    }

    #[test]
    fn polarization_of_opposed_and_equal_headings() {
        assert_eq!(polarization(&[vector![3.0, 0.0], vector![-1.0, 0.0]]), 0.0);
        assert_eq!(polarization(&[vector![0.0, 3.0], vector![0.0, 1.0]]), 1.0);
        assert_eq!(polarization(&[vector![0.0, 0.0], vector![0.0, 1.0]]), 0.5);
    }
}
