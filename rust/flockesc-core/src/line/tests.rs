//! The line against a reference that tests all pairs, and its invariances under permutations and scaling.

use std::sync::Arc;

use proptest::prelude::*;

use super::{EscapeForce, Line};
use crate::line::scenario::LineConfig;

/// A line without a predator.
const NO_PREDATOR: LineConfig = LineConfig {
    num_agents: 1,
    predator_position: None,
    predator_range: 0.0,
    repulsion_strength: 0.0,
    escape_force: EscapeForce::Linear,
    tolerance: 0.0,
    max_steps: 1,
};

/// Returns x(t+1) of Eqs. 1 and 7, computed from all pairs.
fn reference(config: &LineConfig, states: &[f64], range: f64) -> Vec<f64> {
    let next = |state: &f64| {
        let near = neighbors(states, *state, range);
        let mean = near.iter().map(|&j| states[j]).sum::<f64>() / near.len() as f64;
        let force = config.predator_position.map_or(0.0, |predator| {
            let LineConfig {
                predator_range,
                repulsion_strength,
                ..
            } = *config;
            config
                .escape_force
                .at(state - predator, predator_range, repulsion_strength)
        });
        mean + force
    };
    states.iter().map(next).collect()
}

fn neighbors(states: &[f64], state: f64, range: f64) -> Vec<usize> {
    (0..states.len())
        .filter(|&j| (state - states[j]).abs() <= range)
        .collect()
}

fn line(config: &LineConfig, states: &[f64]) -> Line {
    let config = LineConfig {
        num_agents: states.len(),
        ..config.clone()
    };
    Line::new(Arc::new(config), 0, Some(states)).expect("finite states")
}

fn bits(states: &[f64]) -> Vec<u64> {
    states.iter().map(|state| state.to_bits()).collect()
}

fn configs() -> impl Strategy<Value = LineConfig> {
    let predators = prop_oneof![Just(None), Just(Some(0.25)), (-1.0..1.0_f64).prop_map(Some)];
    let ranges = prop_oneof![Just(0.0), Just(0.25), 0.0..0.5_f64];
    let forces = prop::sample::select(vec![
        EscapeForce::Constant,
        EscapeForce::Linear,
        EscapeForce::LinearAsPrinted,
    ]);
    (predators, ranges, 0.0..3.0_f64, forces).prop_map(
        |(predator_position, predator_range, repulsion_strength, escape_force)| LineConfig {
            predator_position,
            predator_range,
            repulsion_strength,
            escape_force,
            ..NO_PREDATOR
        },
    )
}

/// Many states are multiples of 1/16, so that some agents share a state and some distances equal the range.
fn states() -> impl Strategy<Value = Vec<f64>> {
    let state = prop_oneof![
        (-16..=16_i8).prop_map(|i| f64::from(i) / 16.0),
        -1.0..1.0_f64
    ];
    prop::collection::vec(state, 1..120)
}

fn ranges() -> impl Strategy<Value = f64> {
    let some = prop::sample::select(vec![0.0, 0.0625, 0.25, 0.5, 2.0, 1e300]);
    prop_oneof![some, 0.0..0.5_f64]
}

proptest! {
    #[test]
    fn equals_the_reference_and_agents_with_equal_neighbors_have_equal_bits(
        config in configs(), states in states(), range in ranges(),
    ) {
        let mut line = line(&config, &states);
        let mut before = states;
        for _ in 0..10 {
            let moved = line.step(range).expect("a good range");
            let after = line.states();
            for (state, expected) in after.iter().zip(reference(&config, &before, range)) {
                prop_assert!((state - expected).abs() <= 1e-13, "{state} {expected}");
            }
            let moves = after.iter().zip(&before).map(|(after, before)| (after - before).abs());
            prop_assert_eq!(moved, moves.fold(0.0, f64::max));
            if config.predator_position.is_none() {
                let lists: Vec<_> = before.iter().map(|&x| neighbors(&before, x, range)).collect();
                let bits = bits(&after);
                for i in 0..bits.len() {
                    prop_assert!((0..i).all(|j| lists[i] != lists[j] || bits[i] == bits[j]));
                }
            }
            before = after;
        }
    }

    #[test]
    fn permuted_agents_have_permuted_states(
        config in configs(),
        (states, order) in states().prop_flat_map(|states| {
            let order: Vec<usize> = (0..states.len()).collect();
            (Just(states), Just(order).prop_shuffle())
        }),
        range in ranges(),
    ) {
        let permuted = |states: &[f64]| order.iter().map(|&i| states[i]).collect::<Vec<f64>>();
        let mut first = line(&config, &states);
        let mut second = line(&config, &permuted(&states));
        for _ in 0..10 {
            prop_assert_eq!(first.step(range), second.step(range));
            prop_assert_eq!(bits(&permuted(&first.states())), bits(&second.states()));
        }
    }

    /// Results do not depend on the unit of length, from the smallest normal numbers to the largest accepted
    /// ones.
    #[test]
    fn scaled_lines_have_scaled_states(
        states in states(), range in 0.0..0.5_f64, exponent in -900..66_i32,
    ) {
        let scaled = |states: &[f64]| states.iter().map(|x| x * 2.0_f64.powi(exponent)).collect::<Vec<_>>();
        let (mut small, mut large) = (line(&NO_PREDATOR, &states), line(&NO_PREDATOR, &scaled(&states)));
        for _ in 0..10 {
            small.step(range).expect("a good range");
            large.step(scaled(&[range])[0]).expect("a good range");
            prop_assert_eq!(bits(&scaled(&small.states())), bits(&large.states()));
        }
    }

    /// An isolated agent at any distance does not reduce the precision of the other agents.
    #[test]
    fn precision_is_that_of_the_component(states in states(), range in 0.0..0.5_f64) {
        let far: Vec<f64> = states.iter().copied().chain([1e20, -1e20]).collect();
        let mut line = line(&NO_PREDATOR, &far);
        line.step(range).expect("a good range");
        for (state, expected) in line.states().iter().zip(reference(&NO_PREDATOR, &far, range)) {
            prop_assert!((state - expected).abs() <= 1e-13, "{state} {expected}");
        }
    }
}

#[test]
fn agents_that_share_a_state_at_range_zero_do_not_move() {
    let states = [0.1, 0.7, 0.1, 0.1, 1e20, 0.7, 0.0, -0.0];
    let mut line = line(&NO_PREDATOR, &states);
    assert_eq!(line.step(0.0), Ok(0.0));
    assert_eq!(line.states(), states);
}

/// Uses the largest numbers that a scenario accepts.
#[test]
fn states_stay_finite_under_the_strongest_force() {
    for (escape_force, predator) in [
        EscapeForce::Constant,
        EscapeForce::Linear,
        EscapeForce::LinearAsPrinted,
    ]
    .into_iter()
    .flat_map(|force| [-1e20, 0.0, 1e20].map(|predator| (force, predator)))
    {
        let config = LineConfig {
            predator_position: Some(predator),
            predator_range: 1e20,
            repulsion_strength: 1e20,
            escape_force,
            ..NO_PREDATOR
        };
        for range in [0.0, 1.0, f64::MAX] {
            let mut line = line(&config, &[-1e20, -1.0, 0.0, 5e-324, 1.0, 2.0, 1e20]);
            for _ in 0..100 {
                assert!(line.step(range).expect("a good range").is_finite());
                assert!(line.states().iter().all(|state| state.abs() < 1e45));
            }
        }
    }
}
