//! Laplacian and Perron matrix of a line's neighbor graph (paper, Section II).

use nalgebra::DMatrix;

/// Returns the Laplacian L = Delta - A of the graph with edges where |x_i - x_j| <= `range`, shape (n, n).
///
/// An agent is its own neighbor in both the degree matrix Delta and the adjacency matrix A. The self-loops
/// cancel in L, and `P = I - Delta^-1 L` is the matrix of Eq. 2.
#[must_use]
pub fn laplacian(states: &[f64], range: f64) -> DMatrix<f64> {
    let adjacency = adjacency(states, range);
    DMatrix::from_diagonal(&adjacency.column_sum()) - adjacency
}

/// Returns the Perron matrix P = I - Delta^-1 L of Eq. 2, shape (n, n). Its rows sum to 1.
#[must_use]
pub fn perron_matrix(states: &[f64], range: f64) -> DMatrix<f64> {
    let mut matrix = adjacency(states, range);
    for mut row in matrix.row_iter_mut() {
        let degree = row.sum();
        row /= degree;
    }
    matrix
}

fn adjacency(states: &[f64], range: f64) -> DMatrix<f64> {
    let n = states.len();
    DMatrix::from_fn(n, n, |i, j| {
        f64::from((states[i] - states[j]).abs() <= range)
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::line::LineConfig;
    use crate::line::{EscapeForce, Line};

    #[test]
    fn perron_matrix_is_i_minus_inverse_degree_times_laplacian() {
        let states = [0.0, 0.1, 0.25, 0.9, 0.3];
        let range = 0.15;
        let laplacian = laplacian(&states, range);
        assert_eq!(laplacian.column_sum().amax(), 0.0);
        let degrees = adjacency(&states, range).column_sum();
        let expected = DMatrix::identity(5, 5)
            - DMatrix::from_diagonal(&degrees.map(|degree| 1.0 / degree)) * laplacian;
        let perron = perron_matrix(&states, range);
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
        let product = perron * nalgebra::DVector::from_row_slice(&states);
        for (mean, entry) in line.states().iter().zip(product.iter()) {
            assert!((mean - entry).abs() < 1e-15);
        }
    }
}
