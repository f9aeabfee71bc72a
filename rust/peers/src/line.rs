//! The line model, with a neighbor search over all pairs.

use pyo3::FromPyObject;

/// The predator and its linear escape force, which are read from the attributes of a `LineScenario`.
#[derive(FromPyObject)]
pub(crate) struct Predator {
    predator_position: f64,
    predator_range: f64,
    repulsion_strength: f64,
}

pub(crate) fn run(mut states: Vec<f64>, predator: Predator, range: f64, steps: usize) -> Vec<f64> {
    let mut next = vec![0.0; states.len()];
    for _ in 0..steps {
        for (next, &x) in next.iter_mut().zip(&states) {
            let (mut sum, mut count) = (0.0, 0.0);
            for &other in &states {
                if (other - x).abs() <= range {
                    sum += other;
                    count += 1.0;
                }
            }
            *next = sum / count + predator.force(x - predator.predator_position);
        }
        std::mem::swap(&mut states, &mut next);
    }
    states
}

impl Predator {
    fn force(&self, offset: f64) -> f64 {
        if offset == 0.0 || offset.abs() >= self.predator_range {
            0.0
        } else {
            self.repulsion_strength * (self.predator_range * offset.signum() - offset)
        }
    }
}
