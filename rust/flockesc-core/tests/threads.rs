//! Results are bitwise independent of the number of threads and of the order of the flocks in a batch.

#![allow(clippy::expect_used)] // in helpers of tests, a panic reports the failure

mod common;

use std::sync::Arc;

use common::scenario;
use flockesc_core::bindings::AtEnd;
use flockesc_core::{
    Action, Batch, EpisodeConfig, ExtraEntries, FlockConfig, InitialState, Objective, Progress,
    Reward, Run, View,
};

/// Size of a flock that is stepped on several threads.
const AGENTS: usize = 6000;
const STEPS: usize = 60;
const THREADS: [usize; 3] = [2, 4, 7];

/// Returns a large flock with 0.03 agents per m^D.
fn large(dimension: usize) -> FlockConfig {
    let side = (AGENTS as f64 / 0.03).powf(1.0 / dimension as f64);
    scenario(AGENTS, dimension, STEPS, side)
}

/// Returns one range in m per agent, from 0 to `longest`.
fn ranges_per_agent(num_agents: usize, longest: f64) -> Vec<f64> {
    (0..num_agents)
        .map(|agent| longest * (agent % 17) as f64 / 16.0)
        .collect()
}

/// Returns the bits of all numbers of a run. Bits distinguish -0 from 0.
fn run<const D: usize>(
    config: &Arc<FlockConfig>,
    ranges: &[f64],
    start: &InitialState,
    num_threads: usize,
) -> Vec<u64> {
    let action = Action {
        ranges: ranges.to_vec(),
        ..Action::default()
    };
    let mut run = Run::<D>::new(config.clone(), start, Some(num_threads)).expect("a good start");
    let mut bits = Vec::new();
    for _ in 0..config.num_steps {
        run.step(&action, 1).expect("good ranges");
        let (world, count) = (run.world(), run.num_components(ranges));
        let distance = world.predator_distance();
        bits.push(count.expect("threads") as u64);
        bits.extend([distance.mean, distance.minimum, world.polarization()].map(f64::to_bits));
        let vectors = [world.positions(), world.velocities()];
        let predators = world.predators().iter().map(|p| p.position);
        let vectors = vectors.into_iter().flatten().chain(predators);
        bits.extend(vectors.flat_map(|vector| vector.map(f64::to_bits).data.0[0]));
    }
    bits.extend(run.caught_at.iter().map(|&step| step as u64));
    bits
}

fn assert_threads_do_not_matter(config: FlockConfig, ranges: &[f64], start: &InitialState) {
    let config = Arc::new(config);
    let played = |threads| match config.dimension {
        2 => run::<2>(&config, ranges, start, threads),
        _ => run::<3>(&config, ranges, start, threads),
    };
    let serial = played(1);
    for threads in THREADS {
        assert!(played(threads) == serial, "{threads} threads");
    }
}

#[test]
fn a_large_flock_in_the_plane_with_a_shared_range() {
    assert_threads_do_not_matter(large(2), &[10.0], &InitialState::seeded(3));
}

#[test]
fn a_large_flock_in_the_plane_with_one_range_per_agent() {
    let ranges = ranges_per_agent(AGENTS, 40.0);
    assert_threads_do_not_matter(large(2), &ranges, &InitialState::seeded(3));
}

#[test]
fn a_large_flock_in_space_with_a_shared_range() {
    assert_threads_do_not_matter(large(3), &[5.0], &InitialState::seeded(3));
}

#[test]
fn a_large_flock_in_space_with_one_range_per_agent() {
    let ranges = ranges_per_agent(AGENTS, 10.0);
    assert_threads_do_not_matter(large(3), &ranges, &InitialState::seeded(3));
}

/// One fast agent determines the fixed-point scale of the sums on all threads.
#[test]
fn a_large_flock_of_unequal_speeds_with_the_literal_law() {
    let config = FlockConfig {
        constant_speed: false,
        ..large(2)
    };
    let mut velocities: Vec<f64> = (0..2 * AGENTS).map(|i| (i % 7) as f64 - 3.0).collect();
    velocities[0] = 1000.0;
    let start = InitialState {
        velocities: Some(velocities),
        ..InitialState::seeded(3)
    };
    assert_threads_do_not_matter(config, &[10.0], &start);
}

#[test]
fn a_large_flock_with_captures_in_many_steps() {
    for dimension in [2, 3] {
        let config = FlockConfig {
            capture_radius: Some(8.0),
            ..large(dimension)
        };
        assert_threads_do_not_matter(config, &[10.0], &InitialState::seeded(3));
    }
}

fn episodes(view: View, reward: Reward) -> EpisodeConfig {
    EpisodeConfig {
        view,
        objective: Objective::MinMeanDistance,
        reward,
        range_cost: 0.01,
        max_actions: None,
        max_range: 40.0,
        predator_sensing_range: None,
        steps_per_action: 2,
        profile_ranges: if view.is_per_agent() {
            vec![0.0, 5.0, 30.0]
        } else {
            Vec::new()
        },
        extra_entries: vec![ExtraEntries::EscapeDirection, ExtraEntries::ClosestApproach],
    }
}

/// Results of a step of a batch, one entry per flock: bits of rewards, observations and distances.
type Step = Vec<(Vec<u64>, Vec<u32>, [u64; 2])>;

/// Plays a whole episode. Flock i starts from `seeds[i]`, and its agents have the ranges `range(seed,
/// agent)`.
fn play<const D: usize>(
    scenario: &FlockConfig,
    config: &EpisodeConfig,
    seeds: &[u64],
    num_threads: usize,
    range: impl Fn(u64, usize) -> f64,
) -> (Batch<D>, Vec<Step>) {
    let threads = Some(num_threads);
    let mut batch = Batch::<D>::new(scenario.clone(), config.clone(), seeds.len(), threads)
        .expect("a good scenario");
    for (slot, &seed) in seeds.iter().enumerate() {
        batch
            .reset(slot, &InitialState::seeded(seed))
            .expect("a slot");
    }
    let rows = batch.rows();
    let ranges: Vec<f64> = seeds
        .iter()
        .flat_map(|&seed| (0..rows).map(move |agent| (seed, agent)))
        .map(|(seed, agent)| range(seed, agent))
        .collect();
    let mut rewards = vec![0.0; seeds.len() * rows];
    let mut observations = vec![0.0; rewards.len() * batch.row_length()];
    let mut steps = Vec::new();
    while !batch.episode(0).expect("an episode").has_ended() {
        let metrics = batch
            .step_measured(
                (&ranges, &[]),
                AtEnd::Refuse,
                &mut rewards,
                &mut observations,
                &Progress::default(),
                |episode| {
                    let distance = episode.world().predator_distance();
                    [distance.mean.to_bits(), distance.minimum.to_bits()]
                },
            )
            .expect("good ranges");
        let rewards = rewards.chunks_exact(rows);
        let observations = observations.chunks_exact(rows * batch.row_length());
        steps.push(
            rewards
                .zip(observations)
                .zip(metrics)
                .map(|((rewards, observations), metrics)| {
                    (
                        rewards.iter().map(|r| r.to_bits()).collect(),
                        observations.iter().map(|o| o.to_bits()).collect(),
                        metrics,
                    )
                })
                .collect(),
        );
    }
    (batch, steps)
}

#[test]
fn a_batch_of_one_large_flock() {
    let config = Arc::new(large(2));
    let mut recorded =
        Run::<2>::new(config.clone(), &InitialState::seeded(3), Some(1)).expect("a good start");
    let ranges = vec![10.0];
    let action = Action {
        ranges,
        ..Action::default()
    };
    recorded.step(&action, STEPS).expect("good ranges");
    for (view, reward) in [
        (View::Flock, Reward::Distance),
        (View::Agent, Reward::IndividualDistanceChange),
    ] {
        let episode = episodes(view, reward);
        let played = |threads| play::<2>(&config, &episode, &[3], threads, |_, _| 10.0);
        let (_, serial) = played(1);
        for threads in THREADS {
            let (batch, steps) = played(threads);
            assert!(steps == serial, "{threads} threads");
            let world = batch.episode(0).expect("an episode").world();
            assert_eq!(recorded.world().positions(), world.positions());
        }
    }
}

fn assert_slots_do_not_matter<const D: usize>(side: f64, capture_radius: Option<f64>) {
    let scenario = FlockConfig {
        capture_radius,
        ..scenario(100, D, 40, side)
    };
    let seeds: Vec<u64> = (0..23).collect();
    // A permutation of the seeds, because 5 and 23 have no common divisor.
    let permuted: Vec<u64> = seeds.iter().map(|seed| seed * 5 % 23).collect();
    for (view, reward) in [
        (View::Flock, Reward::Team),
        (View::Agent, Reward::IndividualDistance),
        (View::Agent, Reward::Difference),
    ] {
        let config = episodes(view, reward);
        let range = |seed: u64, agent: usize| 3.0 + (seed as usize + agent) as f64 % 13.0;
        let (_, serial) = play::<D>(&scenario, &config, &seeds, 1, range);
        for threads in [1, 2, 4, 7] {
            let (_, steps) = play::<D>(&scenario, &config, &permuted, threads, range);
            for (step, expected) in steps.iter().zip(&serial) {
                for (flock, &seed) in step.iter().zip(&permuted) {
                    assert!(flock == &expected[seed as usize], "{threads} threads");
                }
            }
        }
    }
}

#[test]
fn slots_of_small_flocks_in_the_plane() {
    assert_slots_do_not_matter::<2>(50.0, None);
}

#[test]
fn slots_of_small_flocks_in_space() {
    assert_slots_do_not_matter::<3>(20.0, None);
}

#[test]
fn slots_of_small_flocks_with_captures() {
    assert_slots_do_not_matter::<2>(50.0, Some(3.0));
    assert_slots_do_not_matter::<3>(20.0, Some(3.0));
}
