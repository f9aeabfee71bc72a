mod several;

use super::*;
use crate::agents::PerAgent;
use crate::episode::Metrics;
use crate::flock::InitialState;
use crate::observation::View;
use crate::parallel::Progress;
use crate::predator::{ConstantVelocity, PredatorConfig};
use crate::reward::Reward;

const FLOCKS: usize = 5;
const AGENTS: usize = 30;

pub(super) fn batch(num_flocks: usize, num_threads: usize) -> Batch<2> {
    let (scenario, config) = documents();
    Batch::new(scenario, config, num_flocks, Some(num_threads)).expect("a good scenario")
}

/// Returns a batch of one flock with this reward and capture radius.
fn rewarded(reward: Reward, capture_radius: Option<f64>) -> Batch<2> {
    let (scenario, config) = documents();
    let scenario = FlockConfig {
        capture_radius,
        ..scenario
    };
    let config = EpisodeConfig { reward, ..config };
    Batch::new(scenario, config, 1, Some(1)).expect("a good scenario")
}

fn documents() -> (FlockConfig, EpisodeConfig) {
    let predator = ConstantVelocity {
        position: vec![-5.0, -5.0],
        velocity: vec![10.0, 10.0],
    };
    let scenario = FlockConfig {
        num_agents: AGENTS,
        num_steps: 20,
        initial_side: 30.0,
        predator_range: 20.0,
        predators: vec![PredatorConfig::ConstantVelocity(predator)],
        ..FlockConfig::default()
    };
    let config = EpisodeConfig {
        view: View::Agent,
        max_range: 10.0,
        predator_sensing_range: None,
        steps_per_action: 3,
        ..EpisodeConfig::default()
    };
    (scenario, config)
}

pub(super) fn step(batch: &mut Batch<2>, range: f64) -> Result<(Vec<f64>, Vec<f32>)> {
    let rows = batch.num_flocks() * AGENTS;
    let ranges: Vec<f64> = (0..rows)
        .map(|row| range + (row % AGENTS) as f64 / 10.0)
        .collect();
    let mut rewards = vec![0.0; rows];
    let mut observations = vec![0.0; rows * batch.row_length()];
    batch.step(&ranges, &mut rewards, &mut observations)?;
    Ok((rewards, observations))
}

#[test]
fn results_do_not_depend_on_threads_or_slots() {
    let run = |threads: usize, seeds: &[u64]| {
        let mut batch = batch(seeds.len(), threads);
        for (slot, seed) in seeds.iter().enumerate() {
            batch
                .reset(slot, &InitialState::seeded(*seed))
                .expect("a slot");
        }
        (0..7)
            .map(|_| step(&mut batch, 4.0).expect("steps left"))
            .collect::<Vec<_>>()
    };
    let seeds: Vec<u64> = (0..FLOCKS as u64).collect();
    let serial = run(1, &seeds);
    for threads in [2, 4, 7] {
        assert_eq!(run(threads, &seeds), serial);
    }
    for (seed, step) in (0..FLOCKS).flat_map(|seed| (0..7).map(move |step| (seed, step))) {
        let single = &run(1, &[seed as u64])[step];
        let width = single.1.len();
        assert_eq!(single.0, serial[step].0[seed * AGENTS..(seed + 1) * AGENTS]);
        assert_eq!(single.1, serial[step].1[seed * width..(seed + 1) * width]);
    }
}

#[test]
fn rewards_sum_to_the_change_of_the_objective() {
    let mut batch = batch(1, 1);
    batch.reset(0, &InitialState::seeded(3)).expect("a slot");
    let start = batch.episode(0).expect("an episode").objective().start;
    let mut total = 0.0;
    while !batch.episode(0).expect("an episode").has_ended() {
        total += step(&mut batch, 4.0).expect("steps left").0[0];
    }
    let end = batch.episode(0).expect("an episode").objective().minimum;
    assert!(end < start && (total - (end - start)).abs() < 1e-12);
}

fn metrics(batch: &Batch<2>) -> Result<Vec<Metrics>> {
    let all: Vec<usize> = (0..batch.num_flocks()).collect();
    batch.measure(&all, &Progress::default(), Episode::metrics)
}

/// Resets slots, given as pairs (slot, seed), from the same start.
fn reset_many(
    batch: &mut Batch<2>,
    resets: &[(usize, Option<u64>)],
    episode: Option<u64>,
    start: &InitialState,
) -> Result<()> {
    let start = Arc::new(start.clone());
    let resets = resets.iter().map(|&(slot, seed)| SlotReset {
        slot,
        seed,
        episode,
        start: start.clone(),
    });
    batch.reset_many(resets.collect(), &Progress::default())
}

/// Slots whose episodes end at different times give the same results as batches of one slot.
#[test]
fn slots_restart_at_their_own_horizon() {
    let progress = Progress::default();
    let actions_per_episode = 7; // 20 steps, three per action
    for threads in [1, 3] {
        let mut many = batch(3, threads);
        let all: Vec<_> = (0..3).map(|slot| (slot, Some(slot as u64))).collect();
        reset_many(&mut many, &all, None, &InitialState::default()).expect("slots");
        let mut single: Vec<_> = (0..3).map(|_| batch(1, 1)).collect();
        for (seed, batch) in single.iter_mut().enumerate() {
            let start = InitialState::seeded(seed as u64);
            batch.reset(0, &start).expect("a slot");
        }
        let rows = 3 * AGENTS;
        let mut rewards = vec![0.0; rows];
        let mut observations = vec![0.0; rows * many.row_length()];
        let mut numbers = [0, 0, 0];
        for action in 0..3 * actions_per_episode {
            if action == 2 {
                let next = InitialState::seeded(episode_seed(1, 1));
                reset_many(&mut many, &[(1, None)], None, &InitialState::seeded(99))
                    .expect("a slot");
                single[1].reset(0, &next).expect("a slot");
                numbers[1] = 1;
            }
            many.step_measured(
                (&vec![4.0; rows], &[]),
                AtEnd::Restart,
                &mut rewards,
                &mut observations,
                &progress,
                |_| (),
            )
            .expect("good ranges");
            for (slot, single) in single.iter_mut().enumerate() {
                let mut reward = vec![1.0; AGENTS];
                let mut observation = vec![0.0; AGENTS * single.row_length()];
                if single.episode(0).expect("an episode").has_ended() {
                    numbers[slot] += 1;
                    let start = InitialState::seeded(episode_seed(slot as u64, numbers[slot]));
                    single.reset(0, &start).expect("a slot");
                    let observed = single.observe(&[0], Observed::Own, &progress);
                    observation = observed.expect("a slot");
                    reward.fill(0.0);
                } else {
                    let ranges = vec![4.0; AGENTS];
                    single
                        .step(&ranges, &mut reward, &mut observation)
                        .expect("steps left");
                }
                let width = observation.len();
                assert_eq!(rewards[slot * AGENTS..(slot + 1) * AGENTS], reward);
                assert_eq!(observations[slot * width..(slot + 1) * width], observation);
            }
        }
        assert_eq!(numbers, [2, 3, 2]);
    }
}

/// Starts episodes by their number in the schedule, in some slots, and then the next ones in all slots.
#[test]
fn episodes_start_by_their_number_in_the_schedule() {
    let mut batch = batch(3, 1);
    batch.seed(5);
    let all: Vec<_> = (0..3).map(|slot| (slot, None)).collect();
    let some = [(0, Some(7)), (2, None)];
    let seeds =
        |batch: &Batch<2>| [0, 1, 2].map(|slot| batch.episode_seed(slot).expect("an episode"));
    let own = |slot: u64, episode| episode_seed(episode_seed(5, slot + 1), episode);
    let start = InitialState::default();
    reset_many(&mut batch, &all, None, &start).expect("slots");
    assert!(reset_many(&mut batch, &[(3, None)], Some(9), &start).is_err());
    reset_many(&mut batch, &some, Some(4), &start).expect("slots");
    assert_eq!(seeds(&batch), [episode_seed(7, 4), own(1, 0), own(2, 4)]);
    reset_many(&mut batch, &all, None, &start).expect("slots");
    assert_eq!(seeds(&batch), [episode_seed(7, 5), own(1, 1), own(2, 5)]);
    reset_many(&mut batch, &all, Some(u64::MAX), &start).expect("slots");
    reset_many(&mut batch, &all, None, &start).expect("slots");
    assert_eq!(seeds(&batch), [7, own(1, 0), own(2, 0)]); // the number after u64::MAX is 0
}

#[test]
fn slots_without_a_seed_differ_and_rejected_resets_change_nothing() {
    let progress = Progress::default();
    let mut batch = batch(3, 1);
    batch.seed(5);
    let all: Vec<_> = (0..3).map(|slot| (slot, None)).collect();
    assert!(
        reset_many(
            &mut batch,
            &[(0, None), (3, None)],
            None,
            &InitialState::default()
        )
        .is_err()
    );
    let too_short = InitialState {
        positions: Some(vec![0.0]),
        ..InitialState::default()
    };
    assert!(reset_many(&mut batch, &all, None, &too_short).is_err());
    assert!(metrics(&batch).is_err());
    reset_many(&mut batch, &all, None, &InitialState::default()).expect("slots");
    let metrics = metrics(&batch).expect("episodes");
    assert!(metrics[0] != metrics[1] && metrics[1] != metrics[2] && metrics[0] != metrics[2]);
    for (slot, expected) in metrics.iter().enumerate() {
        let seed = episode_seed(5, slot as u64 + 1);
        batch
            .reset(slot, &InitialState::seeded(seed))
            .expect("a slot");
        assert_eq!(
            batch.episode(slot).expect("an episode").metrics(),
            *expected
        );
    }
    assert_eq!(
        batch
            .measure(&[0, 1, 2], &progress, Episode::num_components)
            .expect("episodes"),
        [AGENTS; 3]
    );
}

#[test]
fn rejected_steps_change_nothing() {
    let mut batch = batch(2, 1);
    assert!(matches!(step(&mut batch, 1.0), Err(Error::Episode { .. })));
    for slot in 0..2 {
        batch.reset(slot, &InitialState::seeded(9)).expect("a slot");
    }
    let before = metrics(&batch);
    for range in [f64::NAN, f64::INFINITY, -3.0] {
        assert!(matches!(step(&mut batch, range), Err(Error::Input { .. })));
    }
    assert_eq!(metrics(&batch), before);
    for _ in 0..7 {
        step(&mut batch, 1.0).expect("steps left");
    }
    assert!(matches!(step(&mut batch, 1.0), Err(Error::Episode { .. })));
    assert!(batch.reset(2, &InitialState::seeded(0)).is_err());
}

#[test]
fn the_team_reward_is_that_of_the_last_step() {
    let mut batch = batch(2, 1);
    assert_eq!(batch.team_rewards(), [0.0; 2]);
    for slot in 0..2 {
        batch.reset(slot, &InitialState::seeded(9)).expect("a slot");
    }
    let (rewards, _) = step(&mut batch, 4.0).expect("steps left");
    assert_eq!(batch.team_rewards(), [rewards[0], rewards[AGENTS]]);
    assert!(rewards[0] < 0.0);
    batch.reset(1, &InitialState::seeded(3)).expect("a slot");
    assert_eq!(batch.team_rewards(), [rewards[0], 0.0]);
}

/// The mean is over all agents, and caught agents have a reward of 0.
#[test]
fn the_team_reward_is_the_mean_of_individual_rewards() {
    let mut batch = rewarded(Reward::IndividualDistance, Some(8.0));
    batch.reset(0, &InitialState::seeded(9)).expect("a slot");
    for _ in 0..7 {
        let (rewards, _) = step(&mut batch, 4.0).expect("steps left");
        let mean = rewards.iter().sum::<f64>() / AGENTS as f64;
        assert!((batch.team_rewards()[0] - mean).abs() < 1e-12);
    }
    let episode = batch.episode(0).expect("an episode");
    assert!(episode.world().caught().len() > 0);
}

/// Caught agents have a reward of 0, but the team's reward is that of the other agents.
#[test]
fn captures_do_not_change_the_team_reward() {
    let mut batch = rewarded(Reward::Distance, Some(8.0));
    batch.reset(0, &InitialState::seeded(9)).expect("a slot");
    for _ in 0..7 {
        let (rewards, _) = step(&mut batch, 4.0).expect("steps left");
        assert_eq!(
            batch.team_rewards()[0],
            rewards.into_iter().fold(0.0, f64::max)
        );
    }
    let episode = batch.episode(0).expect("an episode");
    assert!(episode.world().caught().len() > 0);
}

/// Returns three scenarios: the second has a shorter episode, in the third agents can be caught.
pub(super) fn scenarios() -> [Arc<FlockConfig>; 3] {
    let scenario = documents().0;
    let shorter = FlockConfig {
        num_steps: 8,
        speed: PerAgent::Shared(4.0),
        ..scenario.clone()
    };
    let caught = FlockConfig {
        capture_radius: Some(8.0),
        ..scenario.clone()
    };
    [scenario, shorter, caught].map(Arc::new)
}
