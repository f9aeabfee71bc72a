"""Rules that remember or choose among candidates follow their definitions."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from option_table import DIMENSIONS, small_flock

import flockesc_env as fe
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.options import View
from flockesc_env.policies import (
    BestNextHeading,
    ListenWhileThreatened,
    StubbornWitnesses,
    WinStayLoseShift,
    bind,
)
from flockesc_env.scenario import ConstantVelocity


def test_stubborn_witnesses_remember_until_the_episode_ends() -> None:
    predators = (ConstantVelocity((-10.0, -10.0), (80.0, 80.0)),)
    scenario = small_flock(num_agents=20, num_steps=16, initial_side=60.0, predators=predators)
    options: Any = {"action_mode": "range", "steps_per_action": 1, "predator_sensing_range": 20.0}
    env = fe.parallel_env(scenario, **options)
    act = bind(StubbornWitnesses(patience=0.25, first_range=30.0, interaction_range=14.0), env)
    for seed in (0, 1):  # the second episode starts with empty memory
        observations, _ = env.reset(seed=seed)
        schedule = np.zeros((scenario.num_steps, 20))
        has_seen = np.zeros(20, bool)
        forgot = False
        for t in range(scenario.num_steps):
            run = fe.simulate(scenario, policy=fe.ScheduledRange(schedule), seed=seed)  # up to time t
            distance = np.linalg.norm(run.positions[t] - run.predator_positions[t], axis=1)
            forgot |= bool((has_seen & (distance > 20.0)).any())
            has_seen |= distance <= 20.0
            schedule[t] = np.where(has_seen | (t < 4), 0.0, 30.0 if t == 4 else 14.0)
            observations, _, _, _, infos = env.step(act(observations))
            ranges = [info["interaction_range"] for info in infos.values()]
            np.testing.assert_allclose(ranges, schedule[t], atol=1e-6)
        assert forgot  # some agent lost sight of the predator and used its memory
        assert 0 < has_seen.sum() < 20


def test_stubborn_witnesses_listen_farther_and_farther_unless_they_are_alone() -> None:
    scenario = small_flock(num_agents=20, num_steps=16, initial_side=60.0)
    options: Any = {"action_mode": "range", "steps_per_action": 1, "predator_sensing_range": 0.0}
    env = fe.parallel_env(scenario, max_range=20.0, **options)
    policy = StubbornWitnesses(
        0.25, 30.0 / 2, 12.0, growth=16.0, min_neighbors=3.0, crowding=2.0, agreement=4.0
    )
    act = bind(policy, env)
    observations, _ = env.reset(seed=0)
    schedule = np.zeros((scenario.num_steps, 20))
    has_stopped = np.zeros(20, bool)
    for t in range(scenario.num_steps):
        later = np.full(20, 15.0)
        if t > 4:
            run = fe.simulate(scenario, policy=fe.ScheduledRange(schedule), seed=0)
            offsets = run.positions[t - 1][:, None] - run.positions[t - 1]
            hears = np.linalg.norm(offsets, axis=2) <= schedule[t - 1][:, None]
            heard = (hears @ run.velocities[t - 1]) / hears.sum(axis=1)[:, None]
            cosines = (heard * run.velocities[t]).sum(axis=1) / np.linalg.norm(heard, axis=1) / scenario.speed
            # The agent itself is the 1 in ln(1 + number).
            later = np.clip(12.0 + t - 4 + 2 * np.log(hears.sum(axis=1)) - 4 * cosines, 0, 20)
            has_stopped |= (hears.sum(axis=1) - 1 < 3) & (t > 5)
        schedule[t] = np.where(has_stopped | (t < 4), 0.0, later)
        observations, _, _, _, infos = env.step(act(observations))
        ranges = [info["interaction_range"] for info in infos.values()]
        np.testing.assert_allclose(ranges, schedule[t], atol=1e-5)
    assert 0 < has_stopped.sum() < 20


def test_a_memory_refuses_rows_added_within_an_episode() -> None:
    env = fe.parallel_env(small_flock(num_agents=4))
    observations, _ = env.reset(seed=0)
    policy, rows = StubbornWitnesses(), np.stack(list(observations.values()))
    policy.act(rows, env.policy_spec)
    with pytest.raises(InputError, match="observations: expected 4 rows as before, got 3"):
        policy.act(rows[:3], env.policy_spec)
    del observations["agent_3"]
    with pytest.raises(InputError, match="observations: expected one of 'agent_3', got none"):
        bind(policy, env)(observations)


def shower(policy: Any, num_agents: int, entry: str) -> Callable[..., list[float]]:
    """Return a function that shows agents some entries and returns the ranges that the policy sets."""
    options = fe.EnvOptions(extra_entries=(entry,), max_range=150.0)  # type: ignore[arg-type]
    scenario = fe.FlockScenario(num_agents=num_agents, initial_side=100.0)
    spec = FlockBatch(scenario, options, view=View.AGENT).policy_spec
    rows = np.zeros((num_agents, len(spec.layout.names)), np.float32)

    def ranges(**entries: list[float]) -> list[float]:
        for name, values in entries.items():
            rows[:, spec.layout.index(name)] = values
        return spec.actions.to_ranges(policy.act(rows, spec), num_agents).round(4).tolist()

    return ranges


def test_listen_while_threatened() -> None:
    """Before, while and after an agent sees the predator; its heading and the heard one may be safe."""
    ranges = shower(ListenWhileThreatened(aware_range=20.0, safe_distance=25.0), 4, "closest_approach")
    assert ranges() == [150.0] * 4
    approach = {
        "closest_approach": [0, 0.1, 0.1, 0.21],  # 0.2 is 25 m
        "heard_closest_approach": [0, 0.15, 0.05, 0.3],
    }
    assert ranges(predator_sensed=[0, 1, 1, 1], **approach) == [150.0, 20.0, 0.0, 0.0]
    nothing = dict.fromkeys(["predator_sensed", *approach], [0.0] * 4)
    assert ranges(**nothing) == [150.0, 0.0, 0.0, 0.0]


def test_win_stay_lose_shift() -> None:
    show = shower(WinStayLoseShift(10.0, 40.0, threshold=25.0), 4, "closest_approach")

    def ranges(own: list[float], heard: list[float]) -> list[float]:
        return show(closest_approach=own, heard_closest_approach=heard)

    assert ranges([0.1, 0.1, 0.1, 0.21], [0.1, 0.1, 0.1, 0.3]) == [10.0, 10.0, 10.0, 0.0]  # 0.2 is 25 m
    # The first wins, the second loses, the third wins although it is safe; the fourth is now threatened.
    assert ranges([0.1, 0.1, 0.3, 0.1], [0.2, 0.05, 0.4, 0.3]) == [10.0, 40.0, 10.0, 10.0]
    # They win, lose, are safe, and lose.
    assert ranges([0.1, 0.1, 0.4, 0.1], [0.2, 0.1, 0.4, 0.05]) == [10.0, 10.0, 0.0, 40.0]
    # An agent that begins to listen again stays with its last range, which has shifted.
    assert ranges([0.1, 0.1, 0.1, 0.1], [0.2, 0.2, 0.1, 0.2]) == [10.0, 10.0, 40.0, 40.0]


def test_win_stay_lose_shift_pauses_after_a_range_that_did_not_help() -> None:
    policy = WinStayLoseShift(10.0, 40.0, threshold=0.8, pause=2.0, criterion="escape_direction")
    show = shower(policy, 3, "escape_direction")

    def ranges(own: list[float], gain: list[float]) -> list[float]:
        return show(escape_direction_ahead=own, heard_escape_gain=gain)

    assert ranges([0.5, -0.5, 0.9], [0.0, 0.0, 0.1]) == [10.0, 10.0, 0.0]
    # The first wins although its heading is good by now; the second loses; the third turns back.
    assert ranges([0.9, -0.5, 0.7], [0.1, -0.1, 0.0]) == [10.0, 0.0, 10.0]
    assert ranges([0.95, -0.5, 0.75], [0.0, 0.2, 0.1]) == [0.0, 0.0, 10.0]  # 0 is no gain
    assert ranges([0.7, -0.5, 0.9], [0.0, 0.0, 0.0]) == [0.0, 40.0, 0.0]  # two actions have passed
    assert ranges([0.7, -0.4, 0.7], [0.0, 0.1, 0.0]) == [40.0, 40.0, 0.0]


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("criterion", ["estimated_escape_direction", "estimated_encounter"])
def test_win_stay_lose_shift_with_an_estimated_escape_direction(dimension: int, criterion: Any) -> None:
    """The rule computed from positions and velocities sets the same ranges in each step."""
    predators = (ConstantVelocity((-20.0, -10.0), (12.0, 14.0)),)
    options: Any = {"num_agents": 20, "num_steps": 30, "initial_side": 60.0, "speed": 8.0, "time_step": 0.1}
    flock = small_flock(dimension, predators=predators, **options)
    env = fe.parallel_env(flock, action_mode="range", steps_per_action=1, predator_sensing_range=45.0)
    rule = WinStayLoseShift(9.0, 30.0, 0.8, 1.0, 1.45, criterion=criterion)
    act = bind(rule, env)
    observations, _ = env.reset(seed=2)
    schedule = np.zeros((flock.num_steps, 20))
    ranges, is_long, paused = np.zeros(20), np.zeros(20, bool), np.zeros(20)
    seen: set[tuple[float, bool, bool]] = set()
    for t in range(flock.num_steps):
        run = fe.simulate(flock, policy=fe.ScheduledRange(schedule), seed=2)  # up to time t
        velocity = (run.predator_positions[t + 1] - run.predator_positions[t]) / 0.1
        offsets = run.predator_positions[t] - run.positions[t]
        remaining = np.full((20, 1), max(0.0, 1.45 - 0.1 * t))
        if criterion == "estimated_encounter":
            remaining[:, 0] = np.maximum(0.0, -offsets @ velocity[0] / (velocity[0] @ velocity[0] + 32.0))
        escape = -(offsets + remaining * velocity)
        escape /= np.linalg.norm(escape, axis=1, keepdims=True)
        is_sensed = np.linalg.norm(run.positions[t] - run.predator_positions[t], axis=1) <= 45.0
        before = max(t - 1, 0)
        for i, direction in enumerate(escape * is_sensed[:, None]):
            offsets = run.positions[before] - run.positions[before][i]
            heard = run.velocities[before][np.linalg.norm(offsets, axis=1) <= ranges[i]].mean(axis=0)
            own = run.velocities[t][i] @ direction / 8.0
            wins = ranges[i] > 0 and heard @ direction / np.linalg.norm(heard) > own + 1e-6
            loses = ranges[i] > 0 and not wins
            is_long[i] ^= loses
            paused[i] = 1 if loses else paused[i] - 1
            listens = wins or (own < 0.8 and paused[i] <= 0)
            schedule[t, i] = (30.0 if is_long[i] else 9.0) if listens else 0.0
            seen.add((schedule[t, i], bool(is_sensed[i]), t * 0.1 < 1.45))
        ranges = schedule[t]
        observations, _, _, _, infos = env.step(act(observations))
        found = [info["interaction_range"] for info in infos.values()]
        np.testing.assert_allclose(found, ranges, atol=1e-5)
    assert seen == {
        (rho, sensed, early) for rho in (0, 9, 30) for sensed in (False, True) for early in (False, True)
    }


CANDIDATES = np.array([0.0, 8.0, 16.0, 32.0])
PREDATOR = np.array([10.0, 12.0])  # v0 is 10 m/s
OPTIONS: Any = {
    "profile_ranges": tuple(CANDIDATES),
    "steps_per_action": 1,
    "extra_entries": ("escape_direction", "closest_approach"),
}


def test_the_best_next_heading_is_the_best_of_all_simulated_ones() -> None:
    predators = (ConstantVelocity((-20.0, -10.0), tuple(PREDATOR)),)
    flock = small_flock(
        num_agents=20, num_steps=8, initial_side=60.0, predator_range=0.0, predators=predators
    )
    env = fe.parallel_env(flock, action_mode="range", **OPTIONS)
    act = bind(BestNextHeading(turn=0.5), env)
    observations, _ = env.reset(seed=3)
    schedule = np.zeros((flock.num_steps, 20))
    chosen: set[float] = set()
    for t in range(flock.num_steps):
        run = fe.simulate(flock, policy=fe.ScheduledRange(schedule), seed=3)
        observations, _, _, _, infos = env.step(act(observations))
        ranges = np.array([info["interaction_range"] for info in infos.values()])
        positions = run.positions[t] - run.predator_positions[t]
        velocities = run.velocities[t] - PREDATOR
        time = max(0.0, -(positions * velocities).sum() / (velocities**2).sum())
        escape = positions - PREDATOR * time
        escape /= np.linalg.norm(escape, axis=1, keepdims=True)
        cosines = []
        for candidate in CANDIDATES:
            schedule[t] = candidate
            following = fe.simulate(flock, policy=fe.ScheduledRange(schedule), seed=3).velocities[t + 1]
            cosines.append((following * escape).sum(axis=1))
        np.testing.assert_allclose(ranges, CANDIDATES[np.argmax(cosines, axis=0)], atol=1e-5)
        chosen.update(ranges.round())
        schedule[t] = ranges
    assert chosen == set(CANDIDATES)
