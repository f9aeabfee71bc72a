//! The estimated memory of a batch against the measured peak of a reset and three steps.

#![allow(clippy::expect_used)] // in helpers of tests, a panic reports the failure

mod common;

use allocation_counter::measure;
use common::scenario;
use flockesc_core::{
    Batch, EpisodeConfig, FlockConfig, InitialState, Motion, NeighborRule, Reward, Reynolds,
    Topological, View, Voronoi,
};

/// Returns the estimated memory in bytes, divided by the peak of a reset of all flocks and three steps under `range`.
fn estimate_by_peak<const D: usize>(
    scenario: &FlockConfig,
    config: &EpisodeConfig,
    num_flocks: usize,
    range: f64,
) -> f64 {
    let mut estimate = 0;
    let peak = measure(|| {
        let (scenario, config) = (scenario.clone(), config.clone());
        let mut batch = Batch::<D>::new(scenario, config, num_flocks, Some(1)).expect("a batch");
        estimate = batch.bytes();
        let rows = num_flocks * batch.rows();
        let (ranges, mut rewards) = (vec![range; rows], vec![0.0; rows]);
        let mut observations = vec![0.0; rows * batch.row_length()];
        let slots: Vec<_> = (0..num_flocks).map(|slot| (slot, None)).collect();
        let start = InitialState::default();
        batch.reset_many(&slots, None, &start).expect("a reset");
        for _ in 0..3 {
            batch
                .step(&ranges, &mut rewards, &mut observations)
                .expect("a step");
        }
    });
    estimate as f64 / peak.bytes_max as f64
}

/// Returns the side in m of a flock with the density of the paper's.
fn side(num_agents: usize) -> f64 {
    5.0 * (num_agents as f64).sqrt()
}

/// Under 100 m, a flock of 10,000 agents has the longest lists of candidates that are kept.
#[test]
fn the_estimate_is_at_least_the_peak_and_at_most_two_and_a_half_times_as_much() {
    for (num_agents, num_flocks) in [(1, 200), (10, 200), (300, 20), (10_000, 1)] {
        let profile = vec![5.0, 10.0, 20.0];
        let views = [
            (View::Flock, vec![]),
            (View::Agent, vec![]),
            (View::Agent, profile),
        ];
        for (view, profile_ranges) in views {
            let config = EpisodeConfig {
                view,
                profile_ranges,
                ..EpisodeConfig::default()
            };
            let flat = scenario(num_agents, 2, 30, side(num_agents));
            let cubic = scenario(num_agents, 3, 30, side(num_agents));
            let at = |range| {
                [
                    estimate_by_peak::<2>(&flat, &config, num_flocks, range),
                    estimate_by_peak::<3>(&cubic, &config, num_flocks, range),
                ]
            };
            for (short, long) in at(10.0).into_iter().zip(at(100.0)) {
                let ratio = f64::min(short, long);
                assert!(
                    (1.0..2.5).contains(&ratio),
                    "{num_flocks} of {num_agents}, {config:?}: {ratio}"
                );
            }
        }
    }
}

type Kind = fn(FlockConfig) -> FlockConfig;

/// All agents are in one dense square, where lists of candidates and neighbors are longest.
#[test]
fn the_estimate_covers_dense_flocks_with_every_kind_of_buffer() {
    let plain = |num_agents| FlockConfig {
        capture_radius: Some(1e-3),
        ..scenario(num_agents, 2, 30, 50.0)
    };
    let kinds: [(&str, Kind); 6] = [
        ("blind", |plain| FlockConfig {
            blind_angle: 1.0,
            mutual: true,
            ..plain
        }),
        ("nearest", |plain| FlockConfig {
            neighbor_rule: NeighborRule::Topological(Topological {}),
            ..plain
        }),
        ("voronoi", |plain| FlockConfig {
            neighbor_rule: NeighborRule::Voronoi(Voronoi {}),
            ..plain
        }),
        ("noise", |plain| FlockConfig {
            angular_noise: 0.1,
            sensing_noise: 0.1,
            sensing_delay: 20,
            ..plain
        }),
        ("boids", |plain| FlockConfig {
            motion: Motion::Reynolds(Reynolds {
                separation_strength: 1.0,
                cohesion_strength: 1.0,
                separation_range: 50.0,
            }),
            ..plain
        }),
        ("plain", |plain| plain),
    ];
    for num_agents in [1, 70, 3000] {
        for (name, kind) in &kinds {
            let scenario = kind(plain(num_agents));
            for reward in [Reward::RunningMinimum, Reward::Difference] {
                if reward == Reward::Difference && num_agents > 70 {
                    continue; // one run per agent
                }
                let config = EpisodeConfig {
                    view: View::Agent,
                    reward,
                    max_range: 1e3,
                    ..EpisodeConfig::default()
                };
                for range in [3.0, 30.0] {
                    let ratio = estimate_by_peak::<2>(&scenario, &config, 5, range);
                    assert!(ratio >= 1.0, "{name} of {num_agents}, {range} m: {ratio}");
                }
            }
        }
    }
}
