//! Steps do not allocate memory after the buffers of the neighbor search have grown to their final size.

#![allow(clippy::expect_used)] // in helpers of tests, a panic reports the failure

mod common;

use std::sync::Arc;

use allocation_counter::measure;
use common::scenario;
use flockesc_core::{
    FlockConfig, InitialState, Learned, Line, LineConfig, Motion, PredatorConfig, Ranges, Reynolds,
    Target, World,
};

const AGENTS: usize = 300;
/// Enough steps for the flock to disperse and for several re-sorts.
const STEPS: usize = 480;

/// Returns a range in m that oscillates between 0 and the extent of the flock.
fn range(step: usize) -> f64 {
    let phase = step as f64 / 20.0;
    30.0 * (1.0 - phase.cos())
}

fn assert_steps_allocate_nothing<const D: usize>(is_shared: bool) {
    assert_steps_of_a_scenario_allocate_nothing::<D>(scenario(AGENTS, D, STEPS, 100.0), is_shared);
}

fn assert_steps_of_a_scenario_allocate_nothing<const D: usize>(
    config: FlockConfig,
    is_shared: bool,
) {
    let mut world = World::<D>::new(Arc::new(config), &InitialState::seeded(0));
    let mut ranges = vec![0.0; AGENTS];
    let mut step = |step: usize| {
        if is_shared {
            world.step(Ranges::Shared(range(step))).expect("a step");
        } else {
            for (agent, entry) in ranges.iter_mut().enumerate() {
                *entry = range(step + agent);
            }
            world.step(Ranges::PerAgent(&ranges)).expect("a step");
        }
    };
    (0..STEPS).for_each(&mut step);
    let after = measure(|| (STEPS..2 * STEPS).for_each(&mut step));
    assert_eq!(after.count_total, 0);
}

#[test]
fn a_flock_in_the_plane_with_a_shared_range() {
    assert_steps_allocate_nothing::<2>(true);
}

#[test]
fn a_flock_in_the_plane_with_one_range_per_agent() {
    assert_steps_allocate_nothing::<2>(false);
}

#[test]
fn a_flock_in_space_with_a_shared_range() {
    assert_steps_allocate_nothing::<3>(true);
}

#[test]
fn a_flock_in_space_with_one_range_per_agent() {
    assert_steps_allocate_nothing::<3>(false);
}

/// A single one does not allocate. Two or more of them allocate small lists, as encircling predators do.
#[test]
fn a_single_predator_with_an_assigned_target() {
    let mut config = scenario(AGENTS, 2, STEPS, 100.0);
    for predator in &mut config.predators {
        if let PredatorConfig::PurePursuit(pursuit) = predator {
            pursuit.target = Target::Assigned;
        }
    }
    assert_steps_of_a_scenario_allocate_nothing::<2>(config, true);
}

#[test]
fn a_flock_of_boids_with_noise_and_delay() {
    let mut config = scenario(AGENTS, 2, STEPS, 100.0);
    config.motion = Motion::Reynolds(Reynolds {
        separation_strength: 1.0,
        cohesion_strength: 1.0,
        separation_range: 5.0,
    });
    config.angular_noise = 0.5;
    config.sensing_noise = 0.5;
    config.sensing_delay = 3;
    let mut world = World::<2>::new(Arc::new(config), &InitialState::seeded(0));
    // All agents are neighbors in the first steps, so that the lists of offsets reach their final size. That of close
    // neighbors grows until the flock is densest.
    (0..10).for_each(|_| world.step(Ranges::Shared(1e6)).expect("a step"));
    (0..2 * STEPS).for_each(|step| world.step(Ranges::Shared(range(step))).expect("a step"));
    let later = 2 * STEPS..3 * STEPS;
    let after =
        measure(|| later.for_each(|step| world.step(Ranges::Shared(range(step))).expect("a step")));
    assert_eq!(after.count_total, 0);
}

fn assert_steps_with_actions_allocate_nothing<const D: usize>() {
    let mut config = scenario(AGENTS, D, STEPS, 100.0);
    config.predators = vec![
        PredatorConfig::Learned(Learned {
            position: vec![-30.0, -30.0],
            velocity: vec![10.0, 10.0],
            max_acceleration: 20.0,
            max_speed: 15.0,
        });
        2
    ];
    let mut world = World::<D>::new(Arc::new(config), &InitialState::seeded(0));
    let mut predator_actions = vec![0.0; 2 * D];
    let mut step = |step: usize| {
        for (index, entry) in predator_actions.iter_mut().enumerate() {
            *entry = ((step + 7 * index) as f64 / 10.0).sin();
        }
        world.set_predator_actions(&predator_actions);
        world.step(Ranges::Shared(range(step))).expect("a step");
    };
    (0..STEPS).for_each(&mut step);
    let after = measure(|| (STEPS..2 * STEPS).for_each(&mut step));
    assert_eq!(after.count_total, 0);
}

#[test]
fn a_flock_under_learned_predators() {
    assert_steps_with_actions_allocate_nothing::<2>();
    assert_steps_with_actions_allocate_nothing::<3>();
}

/// A line allocates all its buffers when it is created.
#[test]
fn a_line_does_not_allocate_from_its_first_step_on() {
    let config = LineConfig {
        num_agents: AGENTS,
        tolerance: 0.0,
        max_steps: STEPS,
        ..LineConfig::default()
    };
    let mut line = Line::new(Arc::new(config), 0, None).expect("a good line");
    let steps = measure(|| {
        for step in 0..STEPS {
            line.step(range(step) / 100.0).expect("a good range");
        }
    });
    assert_eq!(steps.count_total, 0);
}
