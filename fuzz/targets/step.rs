//! Fuzz target for episodes of small flocks with arbitrary ranges and actions: all numbers stay finite,
//! constant speeds stay constant, and running minima never increase.

#![no_main]

use std::sync::Arc;

use arbitrary::{Result, Unstructured};
use flockesc_core::bindings::AtEnd;
use flockesc_core::{
    Batch, EpisodeConfig, FlockConfig, InitialState, Metrics, PerAgent, PredatorConfig, Progress,
    Ranges, View,
};
use flockesc_fuzz::{any_range, assert_world_is_sound, coordinates, documents, rarely};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut u = Unstructured::new(bytes);
    let Ok((scenario, options)) = documents(&mut u) else {
        return;
    };
    let _ = match scenario.dimension {
        2 => run::<2>(scenario, options, &mut u),
        _ => run::<3>(scenario, options, &mut u),
    };
});

fn start(scenario: &FlockConfig, u: &mut Unstructured<'_>) -> Result<InitialState> {
    let is_path = |predator| matches!(predator, &PredatorConfig::PrescribedPath(_));
    let are_free = !scenario.predators.iter().any(is_path);
    let mut given = |rows: usize, is_allowed: bool| match is_allowed && rarely(u, 3)? {
        true => coordinates(u, rows * scenario.dimension).map(Some),
        false => Ok(None),
    };
    Ok(InitialState {
        positions: given(scenario.num_agents, true)?,
        velocities: given(scenario.num_agents, true)?,
        predator_positions: given(scenario.predators.len(), are_free)?,
        predator_velocities: given(scenario.predators.len(), are_free)?,
        seed: u.arbitrary()?,
    })
}

fn run<const D: usize>(
    scenario: FlockConfig,
    options: EpisodeConfig,
    u: &mut Unstructured<'_>,
) -> Result<()> {
    let start = start(&scenario, u)?;
    if Arc::new(scenario.clone()).drawn(start.seed).is_err() {
        return Ok(());
    }
    let mut batch = Batch::<D>::new(scenario, options, 1, Some(1)).expect("a flock with predators");
    let num_learned = batch.num_learned();
    batch.reset(0, &start).expect("a good start");
    let (rows, length) = (batch.rows(), batch.row_length());
    let (mut rewards, mut observations) = (vec![0.0; rows], vec![0.0; rows * length]);
    let mut before = batch.metrics(&Progress::default()).expect("a flock")[0];
    batch
        .observe(&[0], &mut observations, &Progress::default())
        .expect("a flock");
    assert_bounded(&observations);
    while !batch.episode(0).expect("a flock").has_ended() {
        let ranges = (0..rows)
            .map(|_| any_range(u))
            .collect::<Result<Vec<f64>>>()?;
        let entry = |u: &mut Unstructured<'_>| Ok(f64::from(u.int_in_range(-4..=4)?) / 4.0);
        let predator_actions = (0..num_learned * D)
            .map(|_| entry(u))
            .collect::<Result<Vec<f64>>>()?;
        batch
            .step_measured(
                (&ranges, &predator_actions),
                AtEnd::Refuse,
                &mut rewards,
                &mut observations,
                &Progress::default(),
                |_| (),
            )
            .expect("a good step");
        assert!(
            rewards.iter().all(|reward| reward.is_finite()),
            "{rewards:?}"
        );
        assert_bounded(&observations);
        let mut seen = vec![0.0; num_learned * flockesc_core::predator_entries(D).len()];
        batch
            .observe_predators(&[0], &mut seen, &Progress::default())
            .expect("a flock");
        assert_bounded(&seen);
        let after = batch.metrics(&Progress::default()).expect("a flock")[0];
        assert_minima_never_increase(before, after);
        before = after;
        let episode = batch.episode(0).expect("a flock");
        assert_world_is_sound(
            episode.world(),
            match episode.config().view {
                View::Flock => Ranges::Shared(ranges[0]),
                View::Agent => Ranges::PerAgent(&ranges),
            },
        );
        if start.velocities.is_none() {
            assert_speed_is_constant(episode.world());
        }
    }
    Ok(())
}

fn assert_bounded(observations: &[f32]) {
    assert!(
        observations
            .iter()
            .all(|entry| (-1.0..=1.0).contains(entry)),
        "{observations:?}"
    );
}

fn assert_minima_never_increase(before: Metrics, after: Metrics) {
    for (before, after) in before.objectives.iter().zip(after.objectives) {
        assert!(after.minimum <= before.minimum);
        assert!(after.minimum <= after.now);
    }
}

/// Asserts that the agents that were not caught have the speed of the scenario.
fn assert_speed_is_constant<const D: usize>(world: &flockesc_core::World<D>) {
    if !world.config().constant_speed {
        return;
    }
    let caught: Vec<usize> = world.caught().collect();
    for (agent, velocity) in world.velocities().iter().enumerate() {
        if !caught.contains(&agent) {
            let speed = match &world.config().speed {
                PerAgent::Shared(speed) => *speed,
                PerAgent::Each(speeds) => speeds[agent],
            };
            let ratio = velocity.norm() / speed;
            assert!((ratio - 1.0).abs() <= 1e-12, "{agent} {ratio}");
        }
    }
}
