"""Rules with a memory follow their definitions, computed from positions and velocities."""

from typing import Any

import numpy as np
import pytest
from option_table import DIMENSIONS, small_flock

import flockesc_env as fe
from flockesc_env.models import Trajectory
from flockesc_env.policies import StubbornWitnesses, WinStayLoseShift, bind
from flockesc_env.scenario import ConstantVelocity


def flown(rule: Any, flock: fe.FlockScenario, seed: int, **options: Any) -> Trajectory:
    """Return a run in which every agent sets its range in every step, in m."""
    options = {"per_agent": True, "action_mode": "range", "steps_per_action": 1, **options}
    return fe.simulate(flock, policy=rule, seed=seed, **options)


def heard(run: Trajectory, t: int) -> tuple[np.ndarray, np.ndarray]:
    """Return how many agents each agent heard in a step, with itself, and their mean velocities."""
    offsets = run.positions[t][:, None] - run.positions[t]
    hears = np.linalg.norm(offsets, axis=2) <= run.interaction_ranges[t][:, None]
    counts = hears.sum(axis=1)
    return counts, hears @ run.velocities[t] / counts[:, None]


def test_stubborn_witnesses_remember_until_the_episode_ends() -> None:
    predators = (ConstantVelocity((-10.0, -10.0), (80.0, 80.0)),)
    scenario = small_flock(num_agents=20, num_steps=16, initial_side=60.0, predators=predators)
    rule = StubbornWitnesses(patience=0.25, first_range=30.0, interaction_range=14.0)
    t = np.arange(16)[:, None]
    for seed in (0, 1):  # the second episode starts with empty memory
        run = flown(rule, scenario, seed, predator_sensing_range=20.0)
        sees = np.linalg.norm(run.positions - run.predator_positions, axis=2)[:-1] <= 20.0
        has_seen = np.logical_or.accumulate(sees)
        expected = np.where(has_seen | (t < 4), 0.0, np.where(t == 4, 30.0, 14.0))
        np.testing.assert_allclose(run.interaction_ranges, expected, atol=1e-6)
        assert (has_seen & ~sees).any()  # some agent lost sight of the predator and used its memory
        assert 0 < has_seen[-1].sum() < 20


def test_stubborn_witnesses_listen_farther_and_farther_unless_they_are_alone() -> None:
    scenario = small_flock(num_agents=20, num_steps=16, initial_side=60.0)
    rule = StubbornWitnesses(0.25, 15.0, 12.0, growth=16.0, min_neighbors=3.0, crowding=2.0, agreement=4.0)
    run = flown(rule, scenario, 0, max_range=20.0, predator_sensing_range=0.0)
    has_stopped = np.zeros(20, bool)
    for t, ranges in enumerate(run.interaction_ranges):
        expected = np.full(20, 15.0 if t == 4 else 0.0)
        if t > 4:
            counts, means = heard(run, t - 1)
            cosines = (means * run.velocities[t]).sum(axis=1) / np.linalg.norm(means, axis=1) / scenario.speed
            # The agent itself is the 1 in ln(1 + number).
            later = np.clip(12.0 + t - 4 + 2 * np.log(counts) - 4 * cosines, 0, 20)
            has_stopped |= (counts - 1 < 3) & (t > 5)
            expected = np.where(has_stopped, 0.0, later)
        np.testing.assert_allclose(ranges, expected, atol=1e-5)
    assert 0 < has_stopped.sum() < 20


def test_a_memory_refuses_rows_added_within_an_episode() -> None:
    env = fe.parallel_env(small_flock(num_agents=4))
    observations, _ = env.reset(seed=0)
    policy, rows = StubbornWitnesses(), np.stack(list(observations.values()))
    policy.act(rows, env.policy_spec)
    with pytest.raises(fe.InputError, match="observations: expected 4 rows as before, got 3"):
        policy.act(rows[:3], env.policy_spec)
    del observations["agent_3"]
    with pytest.raises(fe.InputError, match="observations: expected one of 'agent_3', got none"):
        bind(policy, env)(observations)


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("criterion", ["estimated_escape_direction", "estimated_encounter"])
def test_win_stay_lose_shift_with_an_estimated_escape_direction(dimension: int, criterion: Any) -> None:
    predators = (ConstantVelocity((-20.0, -10.0), (12.0, 14.0)),)
    options: Any = {"num_agents": 20, "num_steps": 30, "initial_side": 60.0, "speed": 8.0, "time_step": 0.1}
    flock = small_flock(dimension, predators=predators, **options)
    rule = WinStayLoseShift(9.0, 30.0, 0.8, 0.12, 1.45, criterion=criterion)
    run = flown(rule, flock, 2, predator_sensing_range=45.0)
    is_long, paused = np.zeros(20, bool), np.zeros(20)
    seen: set[tuple[float, bool, bool]] = set()
    for t, ranges in enumerate(run.interaction_ranges):
        velocity = (run.predator_positions[t + 1] - run.predator_positions[t]) / 0.1
        offsets = run.predator_positions[t] - run.positions[t]
        remaining = np.full((20, 1), max(0.0, 1.45 - 0.1 * t))
        if criterion == "estimated_encounter":
            remaining[:, 0] = np.maximum(0.0, -offsets @ velocity[0] / (velocity[0] @ velocity[0] + 32.0))
        escape = -(offsets + remaining * velocity)
        is_sensed = np.linalg.norm(offsets, axis=1) <= 45.0
        escape *= is_sensed[:, None] / np.linalg.norm(escape, axis=1, keepdims=True)
        before = run.interaction_ranges[t - 1] if t else np.zeros(20)
        means = heard(run, t - 1)[1] if t else run.velocities[0]
        gains = (means * escape).sum(axis=1) / np.linalg.norm(means, axis=1)
        own = (run.velocities[t] * escape).sum(axis=1) / 8.0
        wins = (before > 0) & (gains > own + 1e-6)
        loses = (before > 0) & ~wins
        is_long ^= loses
        paused = np.where(loses, 1, paused - 1)
        listens = wins | ((own < 0.8) & (paused <= 0))
        expected = np.where(listens, np.where(is_long, 30.0, 9.0), 0.0)
        np.testing.assert_allclose(ranges, expected, atol=1e-5)
        seen |= {(rho, sensed, t * 0.1 < 1.45) for rho, sensed in zip(expected, is_sensed, strict=True)}
    assert seen == {
        (rho, sensed, early) for rho in (0, 9, 30) for sensed in (False, True) for early in (False, True)
    }
