"""Policies set the same ranges in every interface and follow their definitions."""

import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv
from gymnasium.wrappers import NormalizeObservation
from masked_cpu import run_with_baseline_numpy
from network_outcomes import ranges
from option_table import ACTION_MODES, STEPS_PER_ACTION, every_pair, small_flock
from same import outcome
from stable_baselines3.common.vec_env import VecFrameStack, VecMonitor, VecNormalize

import flockesc_env as fe
from flockesc_env import policies
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.sb3 import vec_env

SCENARIO = small_flock(num_agents=7, num_steps=12, predator_range=60.0)
SEEDS = [3, 4]
T, N = SCENARIO.num_steps, SCENARIO.num_agents

# For ranges up to 128, multiples of 1/4 are exact as float32 actions in every mode.
EXACT = {"max_range": 128.0, "range_grid": tuple(np.arange(513) / 4), "count_components": True}
SCHEDULE = np.random.default_rng(0).integers(0, 80, T) / 4
OWN_SCHEDULE = np.random.default_rng(1).integers(0, 80, (T, N)) / 4
PRINT_RANGES = """
import json
from network_outcomes import ranges
print(json.dumps(ranges()))
"""
SHARED_POLICIES = {
    "fixed": lambda: policies.FixedRange(12.25),
    "scheduled": lambda: policies.ScheduledRange(SCHEDULE),
    "model": lambda: policies.SB3Policy(TimeDependent()),
}
AGENT_POLICIES = {
    **SHARED_POLICIES,
    "scheduled per agent": lambda: policies.ScheduledRange(OWN_SCHEDULE),
    "stubborn leaders": lambda: policies.StubbornLeaders(),
    "stubborn witnesses": lambda: policies.StubbornWitnesses(),
}


class TimeDependent:
    """A model with SB3's interface whose ranges grow with time, the first entry of the observation."""

    def predict(
        self, observations: np.ndarray, state: None, episode_start: np.ndarray, deterministic: bool
    ) -> tuple[np.ndarray, None]:
        assert deterministic
        assert state is None
        np.testing.assert_array_equal(episode_start, observations[:, 0] == 0)
        return observations[:, :1] * np.float32(0.5), None


def last(info: dict[str, Any]) -> list[Any]:
    return [info["min_mean_distance"], info["min_min_distance"], info["num_components"]]


def play_single(env: Any, policy: Any, seed: int) -> list[Any]:
    act = policies.bind(policy, env)
    observation, _ = env.reset(seed=seed)
    while True:
        observation, _, _, truncated, info = env.step(act(observation))
        if truncated is True:
            return last(info)
        if isinstance(truncated, dict) and all(truncated.values()):
            return last(next(iter(info.values())))


def play_slots(env: Any, policy: Any, steps: int) -> np.ndarray:
    act = policies.bind(policy, env)
    env.seed(SEEDS[0])
    observations = env.reset()
    for _ in range(steps):
        observations, _, _, infos = env.step(act(observations))
    return np.array([last(info) for info in infos[:: (env.num_envs // len(SEEDS))]]).T


def options_for(name: str, mode: str) -> dict[str, Any]:
    if name == "model" and mode != "normalized":
        return {"action_mode": "normalized", **EXACT}  # this model returns only normalized actions
    return {"action_mode": mode, "predator_sensing_range": math.inf, **EXACT}


@every_pair(name=AGENT_POLICIES, mode=ACTION_MODES, steps_per_action=STEPS_PER_ACTION)
def test_ranges_are_equal_in_every_interface(name: str, mode: str, steps_per_action: int) -> None:
    make = AGENT_POLICIES[name]
    options = {**options_for(name, mode), "steps_per_action": steps_per_action}
    expected = outcome(fe.rollout(SCENARIO, make(), SEEDS, per_agent=True, **options))
    for per_agent in [True, False] if name in SHARED_POLICIES else [True]:
        run = fe.simulate(SCENARIO, policy=make(), seed=SEEDS[0], per_agent=per_agent, **options)
        curves = [run.mean_distance.min(), run.min_distance.min(), run.num_components[-1]]
        assert (curves, run.seed) == (expected[:, 0].tolist(), SEEDS[0])
        ranges = run.interaction_ranges
        assert ranges.shape == (T, N if per_agent else 1)
        held = np.arange(T) // steps_per_action * steps_per_action
        np.testing.assert_array_equal(ranges, ranges[held])
        if "scheduled" in name:  # the entry of the first step of an action counts
            schedule = OWN_SCHEDULE if "agent" in name else SCHEDULE[:, np.newaxis]
            np.testing.assert_array_equal(ranges, np.broadcast_to(schedule[held], ranges.shape))
        own = ranges if per_agent else ranges[:, 0]
        again = fe.simulate(SCENARIO, policy=policies.ScheduledRange(own), seed=SEEDS[0])
        np.testing.assert_array_equal(again.positions, run.positions)
    singles: list[Any] = [fe.parallel_env(SCENARIO, **options)]
    slots: list[Any] = [vec_env(SCENARIO, 2, per_agent=True, **options)]
    if name in SHARED_POLICIES:
        shared = fe.rollout(SCENARIO, make(), SEEDS, **options)
        np.testing.assert_array_equal(outcome(shared), expected)
        flock = fe.FlockEscapeEnv(SCENARIO, **options)
        singles += [fe.parallel_env(SCENARIO, per_agent=False, **options)]
        singles += [flock, gymnasium.wrappers.RecordEpisodeStatistics(fe.FlockEscapeEnv(SCENARIO, **options))]
        slots += [vec_env(SCENARIO, 2, **options), VecMonitor(vec_env(SCENARIO, 2, **options))]
    for env in singles:
        for column, seed in enumerate(SEEDS):
            assert play_single(env, make(), seed) == expected[:, column].tolist()
    for env in slots:
        np.testing.assert_array_equal(play_slots(env, make(), -(-T // steps_per_action)), expected)


@pytest.mark.parametrize("mode", ACTION_MODES)
def test_random_range_covers_all_ranges_of_the_action_space(mode: str) -> None:
    env = fe.FlockEscapeEnv(SCENARIO, action_mode=mode, min_range=10.0, max_range=20.0)
    rows = np.zeros((4000, len(env.policy_spec.layout.names)), np.float32)
    policy = policies.RandomRange(seed=0)
    actions = policy.act(rows, env.policy_spec)
    assert all(env.action_space.contains(action.astype(env.action_space.dtype)) for action in actions[:50])
    ranges = env.policy_spec.actions.to_ranges(actions, len(actions))
    assert 10 <= ranges.min() < 10.1
    assert 19.9 < ranges.max() <= 20
    np.testing.assert_allclose(ranges.mean(), 15, atol=3 * 10 / np.sqrt(12 * 4000))
    assert not np.array_equal(policy.act(rows, env.policy_spec), actions)
    np.testing.assert_array_equal(policies.RandomRange(seed=0).act(rows, env.policy_spec), actions)


def test_rules_set_the_same_bits_with_every_instruction_set() -> None:
    assert run_with_baseline_numpy(PRINT_RANGES) == ranges()


def test_policies_by_name_set_their_options() -> None:
    every_step = {"max_range": 100.0, "steps_per_action": 1}
    for name, policy, options in (
        ("stubborn-leaders", policies.StubbornLeaders(), every_step),
        ("stubborn-leaders-local", policies.StubbornLeaders(), {**every_step, "predator_sensing_range": 30}),
        ("fixed:120", policies.FixedRange(120.0), {**every_step, "max_range": 120.0}),
        ("fixed:1.7e308", policies.FixedRange(1.7e308), {**every_step, "max_range": 1.7e308}),
    ):
        named, same = fe.rollout(SCENARIO, name, SEEDS), fe.rollout(SCENARIO, policy, SEEDS, **options)
        assert outcome(named).tolist() == outcome(same).tolist()
        runs = (fe.simulate(SCENARIO, policy=one, seed=3, **options) for one in (name, policy))
        np.testing.assert_array_equal(*(run.positions for run in runs))
    ours = fe.rollout(SCENARIO, "stubborn-leaders", SEEDS, predator_sensing_range=20.0)
    options = {**every_step, "predator_sensing_range": 20.0}
    same = fe.rollout(SCENARIO, policies.StubbornLeaders(), SEEDS, **options)
    assert outcome(ours).tolist() == outcome(same).tolist()


def test_a_rollout_decides_options_and_scenario_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """One ``EnvOptions``, no scenario but the preset, one JSON document for the core."""
    calls: list[str] = []
    scenario = fe.FlockScenario
    for owner, method in ((fe.EnvOptions, "__init__"), (scenario, "__init__"), (scenario, "to_json")):
        real = getattr(owner, method)

        def counted(self: Any, *given: Any, real: Any = real, **named: Any) -> Any:
            calls.append(f"{type(self).__name__}.{real.__name__}")
            return real(self, *given, **named)

        monkeypatch.setattr(owner, method, counted)
    fe.rollout("paper-flock", "stubborn-leaders", seeds=1)
    assert sorted(calls) == ["EnvOptions.__init__", "FlockScenario.to_json"]
    calls.clear()
    fe.rollout(SCENARIO, "stubborn-leaders", seeds=1, max_range=50.0)
    assert sorted(calls) == ["EnvOptions.__init__", "FlockScenario.to_json"]


@pytest.mark.parametrize(
    ("wrap", "field"),
    [
        (lambda env: gymnasium.wrappers.RescaleAction(env, 0, 1), "env.action_space"),
        (lambda env: gymnasium.wrappers.FrameStackObservation(env, 2), "env.observation_space"),
        (lambda env: SyncVectorEnv([lambda: NormalizeObservation(env)]), "env.observation_space"),
        (lambda _: VecFrameStack(vec_env(SCENARIO), 2), "env.observation_space"),
        (lambda _: VecMonitor(VecNormalize(vec_env(SCENARIO))), "env"),
    ],
)
def test_bind_refuses_wrappers_that_change_observations_or_actions(wrap: Any, field: str) -> None:
    with pytest.raises(fe.InputError, check=lambda error: error.field == field):
        policies.bind(policies.FixedRange(12.0), wrap(fe.FlockEscapeEnv(SCENARIO)))


def test_bind_takes_wrappers_that_clip_actions_or_normalize_rewards() -> None:
    for env in (
        gymnasium.wrappers.ClipAction(fe.FlockEscapeEnv(SCENARIO)),
        gymnasium.wrappers.vector.ClipAction(BatchVectorEnv(2, SCENARIO)),
        VecNormalize(vec_env(SCENARIO, per_agent=True), norm_obs=False),
    ):
        assert callable(policies.bind(policies.FixedRange(12.0), env))
