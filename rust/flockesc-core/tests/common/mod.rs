//! Scenarios for the integration tests.

use flockesc_core::{ConstantVelocity, FlockConfig, PredatorConfig, PurePursuit, Target};

/// Returns a flock in a square (D = 3: cube) of side `initial_side` in m, with one predator of constant
/// velocity and one with pure pursuit.
pub(crate) fn scenario(
    num_agents: usize,
    dimension: usize,
    num_steps: usize,
    initial_side: f64,
) -> FlockConfig {
    let vector = |x: f64, y: f64| [x, y, 0.0][..dimension].to_vec();
    FlockConfig {
        num_agents,
        dimension,
        num_steps,
        initial_side,
        predators: vec![
            PredatorConfig::ConstantVelocity(ConstantVelocity {
                position: vector(-30.0, -30.0),
                velocity: vector(10.0, 10.0),
            }),
            PredatorConfig::PurePursuit(PurePursuit {
                position: vector(initial_side / 2.0, 0.0),
                velocity: vector(0.0, 8.0),
                max_turn_rate: 1.0,
                max_speed: None,
                acceleration: 0.0,
                target: Target::Nearest,
                confusion_rate: 0.0,
                sight: 30.0,
            }),
        ],
        ..FlockConfig::default()
    }
}
