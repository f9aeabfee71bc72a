//! A step allocates nothing, once the lists of the neighbor search have the length that the flock needs.

#![allow(clippy::expect_used)] // helpers of tests: a panic is the failure report

mod common;

use std::sync::Arc;

use allocation_counter::measure;
use common::scenario;
use flockesc_core::{
    FlockConfig, InitialState, Learned, Line, LineConfig, Motion, PredatorConfig, Ranges, Reynolds,
    Target, World,
};

const AGENTS: usize = 300;
/// Long enough for the flock to spread far, and for its agents to be re-sorted several times.
const STEPS: usize = 480;

/// Ranges in m that oscillate between 0 and the whole flock.
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
    let mut own = vec![0.0; AGENTS];
    let mut step = |step: usize| {
        if is_shared {
            world.step(Ranges::Shared(range(step)));
        } else {
            for (agent, own) in own.iter_mut().enumerate() {
                *own = range(step + agent);
            }
            world.step(Ranges::PerAgent(&own));
        }
    };
    (0..STEPS).for_each(&mut step);
    let after = measure(|| (STEPS..2 * STEPS).for_each(&mut step));
    assert_eq!(after.count_total, 0);
}

#[test]
fn a_flock_in_the_plane_under_one_range() {
    assert_steps_allocate_nothing::<2>(true);
}

#[test]
fn a_flock_in_the_plane_under_ranges_of_its_agents() {
    assert_steps_allocate_nothing::<2>(false);
}

#[test]
fn a_flock_in_space_under_one_range() {
    assert_steps_allocate_nothing::<3>(true);
}

#[test]
fn a_flock_in_space_under_ranges_of_its_agents() {
    assert_steps_allocate_nothing::<3>(false);
}

/// Two that share out agents, or encircle the flock, make small lists of who and where.
#[test]
fn a_lone_predator_that_would_share_out_agents() {
    let mut config = scenario(AGENTS, 2, STEPS, 100.0);
    for predator in &mut config.predators {
        if let PredatorConfig::PurePursuit(hunter) = predator {
            hunter.target = Target::Assigned;
        }
    }
    assert_steps_of_a_scenario_allocate_nothing::<2>(config, true);
}

#[test]
fn a_flock_of_boids_that_err_and_lag() {
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
    // Everybody's neighbors first: that is as long as lists of offsets get.
    (0..10).for_each(|_| world.step(Ranges::Shared(1e6)));
    (0..STEPS).for_each(|step| world.step(Ranges::Shared(range(step))));
    let later = STEPS..2 * STEPS;
    let after = measure(|| later.for_each(|step| world.step(Ranges::Shared(range(step)))));
    assert_eq!(after.count_total, 0);
}

fn assert_steered_steps_allocate_nothing<const D: usize>() {
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
    let mut controls = vec![0.0; 2 * D];
    let mut step = |step: usize| {
        for (index, control) in controls.iter_mut().enumerate() {
            *control = ((step + 7 * index) as f64 / 10.0).sin();
        }
        world.set_predator_actions(&controls);
        world.step(Ranges::Shared(range(step)));
    };
    (0..STEPS).for_each(&mut step);
    let after = measure(|| (STEPS..2 * STEPS).for_each(&mut step));
    assert_eq!(after.count_total, 0);
}

#[test]
fn a_flock_after_which_learned_predators_are_steered() {
    assert_steered_steps_allocate_nothing::<2>();
    assert_steered_steps_allocate_nothing::<3>();
}

/// A line has room for all from the start.
#[test]
fn a_line_allocates_nothing_from_its_first_step_on() {
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
