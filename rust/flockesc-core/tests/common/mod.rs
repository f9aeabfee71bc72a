//! Flocks that the tests share.

use flockesc_core::{
    ConstantVelocity, FlockConfig, Inertial, InitialHeadings, InitialPositions, Metric, Motion,
    NeighborRule, PerAgent, PredatorConfig, PurePursuit, RandomHeadings, Randomization, Square,
    Target,
};

/// A flock in a square (D = 3: cube) of `side` m, chased by one predator that flies straight on and one that pursues.
pub(crate) fn scenario(
    num_agents: usize,
    dimension: usize,
    num_steps: usize,
    initial_side: f64,
) -> FlockConfig {
    FlockConfig {
        num_agents,
        dimension,
        num_steps,
        time_step: 0.05,
        mass: PerAgent::Shared(0.1),
        speed: PerAgent::Shared(10.0),
        initial_side,
        initial_positions: InitialPositions::Square(Square {}),
        initial_headings: InitialHeadings::Random(RandomHeadings {}),
        initial_plane: false,
        predator_range: 30.0,
        repulsion_strength: PerAgent::Shared(10.0),
        alignment_strength: PerAgent::Shared(1.0),
        motion: Motion::Inertial(Inertial {}),
        angular_noise: 0.0,
        sensing_noise: 0.0,
        sensing_delay: 0,
        constant_speed: true,
        predators: vec![
            PredatorConfig::ConstantVelocity(ConstantVelocity {
                position: vec![-30.0, -30.0],
                velocity: vec![10.0, 10.0],
            }),
            PredatorConfig::PurePursuit(PurePursuit {
                position: vec![initial_side / 2.0, 0.0],
                velocity: vec![0.0, 8.0],
                max_turn_rate: 1.0,
                max_speed: None,
                acceleration: 0.0,
                target: Target::Nearest,
                confusion_rate: 0.0,
                sight: 30.0,
            }),
        ],
        capture_radius: None,
        neighbor_rule: NeighborRule::Metric(Metric {}),
        blind_angle: 0.0,
        mutual: false,
        frozen_graph: false,
        periodic_side: None,
        randomization: Randomization::default(),
    }
}
