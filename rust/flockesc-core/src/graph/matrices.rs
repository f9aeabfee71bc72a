//! Laplacian and Perron matrix of a line's neighbor graph (paper, Section II).

use crate::base::error::Result;
use crate::base::memory;

/// Returns the Laplacian L = Delta - A of the graph with edges where |x_i - x_j| <= `range`: n * n entries in row-major
/// order.
///
/// An agent is its own neighbor in both the degree matrix Delta and the adjacency matrix A. The self-loops
/// cancel in L, and `P = I - Delta^-1 L` is the matrix of Eq. 2.
///
/// # Errors
/// [`crate::Error::Memory`] for the matrix.
pub fn laplacian(states: &[f64], range: f64) -> Result<Vec<f64>> {
    matrix(states, range, |adjacency, degree, is_self| {
        f64::from(is_self) * degree - adjacency
    })
}

/// Returns the Perron matrix P = I - Delta^-1 L of Eq. 2: n * n entries in row-major order. Its rows sum to 1.
///
/// # Errors
/// As [`laplacian`].
pub fn perron_matrix(states: &[f64], range: f64) -> Result<Vec<f64>> {
    matrix(states, range, |adjacency, degree, _| adjacency / degree)
}

/// Returns the matrix with the entries `entry(adjacency, degree of the row, whether it is on the diagonal)`.
fn matrix(states: &[f64], range: f64, entry: impl Fn(f64, f64, bool) -> f64) -> Result<Vec<f64>> {
    let n = states.len();
    let mut entries = memory::vector("states", n.saturating_mul(n))?;
    for (row, state) in states.iter().enumerate() {
        let adjacency = |other: &f64| f64::from((state - other).abs() <= range);
        let degree = states.iter().map(adjacency).sum();
        let columns = states.iter().enumerate();
        entries.extend(columns.map(|(j, other)| entry(adjacency(other), degree, row == j)));
    }
    Ok(entries)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::line::{EscapeForce, Line, LineConfig};

    #[test]
    fn perron_matrix_is_i_minus_inverse_degree_times_laplacian() {
        let states = [0.0, 0.1, 0.25, 0.9, 0.3];
        let range = 0.15;
        let square = |entries: Result<Vec<f64>>| {
            DMatrix::from_row_slice(5, 5, &entries.expect("a small matrix"))
        };
        let laplacian = square(laplacian(&states, range));
        assert_eq!(laplacian.column_sum().amax(), 0.0);
        let degrees = laplacian.diagonal().add_scalar(1.0);
        let expected = DMatrix::identity(5, 5)
            - DMatrix::from_diagonal(&degrees.map(|degree| 1.0 / degree)) * laplacian;
        let perron = square(perron_matrix(&states, range));
        assert!((&perron - expected).amax() < 1e-15);
        let config = LineConfig {
            num_agents: states.len(),
            predator_position: None,
            predator_range: 0.0,
            repulsion_strength: 0.0,
            escape_force: EscapeForce::Constant,
            tolerance: 0.0,
            max_steps: 1,
        };
        let mut line = Line::new(Arc::new(config), 0, Some(&states)).expect("finite states");
        line.step(range).expect("a good range");
        let product = perron * DVector::from_row_slice(&states);
        for (mean, entry) in line.states().iter().zip(product.iter()) {
            assert!((mean - entry).abs() < 1e-15);
        }
    }
}
