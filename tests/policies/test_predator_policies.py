"""Predator policies: the same run in every interface, in records and in training."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from envs import FLOCKS, info_of, same_action, start, state, step
from option_table import dimensions, small_flock
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize
from torch.nn import Tanh

import flockesc_env as fe
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.models import run_differences
from flockesc_env.policies import FixedRange, Pursue, StubbornLeaders, bind
from flockesc_env.sb3 import vec_env
from flockesc_env.scenario import ConstantVelocity, PurePursuit

TWO = (ConstantVelocity(), PurePursuit((40.0, 20.0), (-3.0, 1.0)))


def hunted(dimension: int = 2, count: int = 1, **changes: Any) -> fe.FlockScenario:
    return small_flock(dimension, predators=TWO[:count], **changes)


@dimensions
@pytest.mark.parametrize("per_agent", [False, True])
def test_pursuit_is_the_parallel_environment_with_a_fixed_flock(dimension: int, per_agent: bool) -> None:
    scenario = hunted(dimension)
    policy = StubbornLeaders() if per_agent else FixedRange(10.0)
    pursuit = fe.PredatorEnv(scenario, flock_policy=policy)  # has the view and the options of the policy
    options = vars(pursuit.options)
    parallel = fe.parallel_env(scenario.with_learned_predators(), per_agent=per_agent, **options)
    names = parallel.possible_agents[:-1]
    act = bind(Pursue(), pursuit)
    observation, _ = pursuit.reset(seed=5)
    observations, _ = parallel.reset(seed=5)
    while parallel.agents:
        np.testing.assert_array_equal(observation, observations["predator_0"])
        flock = np.stack([observations[name] for name in names])
        ranges = policy.act(flock, parallel.policy_spec)
        action = act(observation)
        expected = Pursue().act(observation[np.newaxis], parallel.predator_policy_spec)[0]
        np.testing.assert_array_equal(action, expected)
        observation, reward, terminated, truncated, info = pursuit.step(action)
        actions = dict(zip(names, ranges, strict=True)) | {"predator_0": action}
        observations, rewards, terminations, truncations, infos = parallel.step(actions)
        assert (reward, terminated, truncated, info) == tuple(
            part["predator_0"] for part in (rewards, terminations, truncations, infos)
        )


@dimensions
@pytest.mark.parametrize("given", [Pursue(), "pursue"])
def test_a_predator_policy_does_the_same_everywhere(dimension: int, given: Any) -> None:
    scenario = hunted(dimension).with_learned_predators()
    by_hand = fe.parallel_env(scenario, steps_per_action=1)
    observations, _ = by_hand.reset(seed=4)
    made = {
        name: make(scenario, predator_policy=given, steps_per_action=1)
        for name, make in FLOCKS.items()
        if name != "predator"
    }
    for env in made.values():
        start(env, 4)
    parallel, zero = made["parallel"], np.zeros(1, np.float32)
    assert parallel.possible_agents == by_hand.possible_agents[:-1]
    for _ in range(9):
        hunter = Pursue().act(observations["predator_0"][np.newaxis], by_hand.predator_policy_spec)[0]
        observations, *_, infos = by_hand.step({**dict.fromkeys(parallel.agents, zero), "predator_0": hunter})
        for name, env in made.items():
            info = info_of(env, step(env, same_action(env, zero)))
            assert np.all(info["mean_distance"] == infos["agent_0"]["mean_distance"]), name
    np.testing.assert_array_equal(parallel.state(), by_hand.state())


@dimensions
@pytest.mark.parametrize("algorithm", [PPO, SAC])
def test_a_trained_predator_becomes_a_file(algorithm: Any, dimension: int, tmp_path: Path) -> None:
    """The model, its network and its file fly alike; the batch has a slot per predator."""
    scenario, file = hunted(dimension, 2).with_learned_predators(), tmp_path / "hunter.npz"
    env = VecNormalize(
        vec_env(scenario, 2, side="predator", flock_policy="stubborn-leaders"), clip_obs=np.inf
    )
    assert env.num_envs == 4
    model = algorithm("MlpPolicy", env, policy_kwargs={"activation_fn": Tanh}, seed=0, device="cpu")
    env.reset()
    fe.save_policy(model, file)
    loaded: Any = fe.load_policy(file)
    assert (loaded.scenario, loaded.options["max_range"]) == (scenario, 100.0)
    flown, *others = [
        fe.simulate(scenario, policy=FixedRange(9.0), seed=3, predator_policy=each).predator_positions
        for each in (model, loaded, file, str(file))
    ]
    for other in others:
        np.testing.assert_allclose(other, flown, rtol=1e-5)
        np.testing.assert_array_equal(other, others[0])


def test_a_bad_predator_policy_is_named_and_changes_nothing() -> None:
    bad = SimpleNamespace(act=lambda observations, spec: np.full((len(observations), 2), 2.0))
    environment = fe.FlockEscapeEnv(hunted().with_learned_predators(), predator_policy=bad)
    environment.reset(seed=0)
    before = state(environment.flock)
    with pytest.raises(fe.InputError, check=lambda error: error.field == "actions of the predator policy[0]"):
        environment.step(np.zeros(1, np.float32))
    np.testing.assert_equal(state(environment.flock), before)


@dimensions
@pytest.mark.parametrize("steps_per_action", [1, 4])
def test_records_replay_the_hunt_bit_for_bit(dimension: int, steps_per_action: int, tmp_path: Any) -> None:
    scenario = hunted(dimension, 2).with_learned_predators()
    options = {"steps_per_action": steps_per_action}
    run = fe.simulate(scenario, policy=FixedRange(9.0), seed=3, predator_policy=Pursue("centroid"), **options)
    played = fe.rollout(scenario, FixedRange(9.0), [3], predator_policy=Pursue("centroid"), **options)
    assert run.mean_distance.min() == played.min_mean_distance[0]
    assert run.min_distance.min() == played.min_min_distance[0]
    assert run.predator_actions.shape == (10, 2, dimension)
    assert run.predator_actions.any()
    fe.save_run(run, tmp_path / "run.npz")
    loaded = fe.load_run(tmp_path / "run.npz").trajectory
    assert run_differences(loaded, fe.replay_run(loaded)) == []
    straight = fe.simulate(run.scenario, 9.0, seed=3)
    assert not np.array_equal(straight.predator_positions, run.predator_positions)


@pytest.mark.parametrize(("mode", "episodes"), [("NextStep", 3), ("SameStep", 4)])
def test_predator_policies_are_reset_in_every_episode(mode: str, episodes: int) -> None:
    begun: list[Any] = []
    policy = SimpleNamespace(act=lambda *_: np.zeros((3, 2)), reset=lambda rows: begun.append(rows.copy()))
    scenario = small_flock(num_steps=2).with_learned_predators()
    env = BatchVectorEnv(3, scenario, predator_policy=policy, autoreset_mode=mode, steps_per_action=1)
    env.reset(seed=0)
    for _ in range(7):
        env.step(np.zeros((3, 1), np.float32))
    assert np.sum(begun, axis=0).tolist() == [episodes] * 3
