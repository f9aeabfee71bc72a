//! The flock model (docs/model.md), with an exchangeable neighbor search.

use pyo3::FromPyObject;

/// Coordinates x and y.
pub(crate) type Point = [f64; 2];

/// The parameters, which are read from the attributes of `speed.peers.Model`.
#[derive(FromPyObject)]
pub(crate) struct Model {
    time_step: f64,
    mass: f64,
    speed: f64,
    predator_range: f64,
    repulsion_strength: f64,
    predator_position: Point,
    predator_velocity: Point,
}

/// A flock and its predator at one time.
pub(crate) struct Flock {
    model: Model,
    pub(crate) positions: Vec<Point>,
    velocities: Vec<Point>,
    predator: Point,
}

impl Flock {
    pub(crate) fn new(model: Model, positions: Vec<Point>, velocities: Vec<Point>) -> Self {
        Self {
            predator: model.predator_position,
            model,
            positions,
            velocities,
        }
    }

    /// Runs `steps` steps and returns J_mean. `sum_neighbors` writes the sum of the velocities of each
    /// agent's neighbors.
    pub(crate) fn run(
        &mut self,
        steps: usize,
        mut sum_neighbors: impl FnMut(&[Point], &[Point], &mut [Point]),
    ) -> f64 {
        let mut sums = vec![[0.0; 2]; self.positions.len()];
        let mut minimum = self.mean_distance();
        for _ in 0..steps {
            sum_neighbors(&self.positions, &self.velocities, &mut sums);
            self.step(&sums);
            minimum = minimum.min(self.mean_distance());
        }
        minimum
    }

    fn step(&mut self, sums: &[Point]) {
        let model = &self.model;
        let agents = self.positions.iter_mut().zip(&mut self.velocities);
        for ((position, velocity), sum) in agents.zip(sums) {
            // The sum of the velocities has the same direction as their mean.
            let mut force = scaled(*sum, model.speed);
            let offset = [
                position[0] - self.predator[0],
                position[1] - self.predator[1],
            ];
            if norm(offset) <= model.predator_range {
                let escape = scaled(offset, model.repulsion_strength);
                force = [force[0] + escape[0], force[1] + escape[1]];
            }
            position[0] += model.time_step * velocity[0];
            position[1] += model.time_step * velocity[1];
            let gain = model.time_step / model.mass;
            let pushed = [velocity[0] + gain * force[0], velocity[1] + gain * force[1]];
            if norm(pushed) > 0.0 {
                *velocity = scaled(pushed, model.speed);
            }
        }
        self.predator[0] += model.time_step * model.predator_velocity[0];
        self.predator[1] += model.time_step * model.predator_velocity[1];
    }

    fn mean_distance(&self) -> f64 {
        let [x, y] = self.predator;
        let distances = self.positions.iter().map(|p| norm([p[0] - x, p[1] - y]));
        distances.sum::<f64>() / self.positions.len() as f64
    }
}

fn norm(vector: Point) -> f64 {
    (vector[0] * vector[0] + vector[1] * vector[1]).sqrt()
}

/// Returns the vector scaled to this length, or 0 if its norm is 0.
fn scaled(vector: Point, length: f64) -> Point {
    let norm = norm(vector);
    if norm > 0.0 {
        [length * vector[0] / norm, length * vector[1] / norm]
    } else {
        [0.0; 2]
    }
}
