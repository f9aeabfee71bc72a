"""Every reward by its definition, through the environments that all other interfaces are compared with."""

from typing import Any

import numpy as np
import pytest
from objective_values import SERIES
from option_table import (
    AGENT_REWARDS,
    EVERY_STEP,
    INDIVIDUAL_REWARDS,
    OBJECTIVES,
    STEPS_PER_ACTION,
    doomed,
    every_pair,
    hunted,
    small_flock,
)

import flockesc_env as fe
from flockesc_env.models import Trajectory
from flockesc_env.policies import FixedRange
from flockesc_env.scenario import ConstantVelocity

RHO = 25.0  # exact in every interface: action -0.5 of [0, 100]
SEED = 8
PER_AGENT = ("parallel", "rollout of agents")
INTERFACES = ("gymnasium", "rollout of flocks", *PER_AGENT)
SPEEDS = (4.0, 14.0)
"""Of the agents, in m/s: predators come near."""
TWO_WAVES = (ConstantVelocity((-20.0, 35.0), (150.0, 0.0)), ConstantVelocity((180.0, 15.0), (-180.0, 0.0)))
"""Two predators: the first passes by, and the second comes nearer later."""
SCENARIOS = {
    "one predator": small_flock(num_agents=7, num_steps=20),
    "two waves": small_flock(num_agents=7, num_steps=20, predators=TWO_WAVES),
    "capture": hunted(),
    "all are caught": doomed(),
}


def rewards_of(interface: str, scenario: fe.FlockScenario, **options: Any) -> np.ndarray:
    """Play an episode and return its rewards, shape (actions, rows), or its mean return, shape (1, 1)."""
    options = EVERY_STEP | options
    if interface.startswith("rollout"):
        options["per_agent"] = interface in PER_AGENT
        return fe.rollout(scenario, FixedRange(RHO), [SEED], **options).mean_return[None]
    is_flock = interface == "gymnasium"
    env: Any = fe.FlockEscapeEnv(scenario, **options) if is_flock else fe.parallel_env(scenario, **options)
    reset, act = (env.reset, env.step) if is_flock else (env.reset_array, env.step_array)
    action = np.full(1 if is_flock else (scenario.num_agents, 1), -0.5)
    reset(seed=SEED)
    rewards: list[Any] = []
    is_over = False
    while not is_over:
        _, paid, terminated, truncated, _ = act(action)
        rewards.append(np.atleast_1d(paid))
        is_over = np.all(np.logical_or(terminated, truncated))
    return np.array(rewards)


def own_distances(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance of every agent, 0 if it is caught, and who is caught; shape (times, agents)."""
    offsets = run.positions[:, :, None] - run.predator_positions[:, None]
    is_caught = (run.caught_at >= 0) & (run.caught_at <= np.arange(len(run.times))[:, None])
    return np.where(is_caught, 0.0, np.linalg.norm(offsets, axis=3).min(axis=2)), is_caught


def defined(reward: str, curve: np.ndarray, own: np.ndarray, num_steps: int) -> np.ndarray:
    """Return the reward of every step and agent, shape (steps, agents), or of every step, shape (steps, 1).

    Args:
        reward: name.
        curve: the objective at every time, shape (steps + 1,).
        own: distance of every agent from the predators, shape (steps + 1, agents); 0 if it is caught.
        num_steps: of an episode in which some agents survive.
    """
    minimum = np.minimum.accumulate(curve)[:, np.newaxis]
    rewards = np.zeros((len(curve) - 1, own.shape[1] if "individual" in reward else 1))
    match reward:
        case "team":
            return np.diff(minimum, axis=0)
        case "terminal":
            rewards[-1] = minimum[-1] - minimum[0]
        case "distance":
            return curve[1:, np.newaxis] / num_steps
        case "individual_distance":
            return own[1:] / num_steps
        case "individual_distance_change":
            return np.diff(own, axis=0)
        case "individual":  # what agents lost since the minimum fell last
            falls = np.flatnonzero(np.diff(minimum[:, 0]) < 0) + 1
            rewards[falls - 1] = np.diff(own[[0, *falls]], axis=0)
    return rewards


@pytest.mark.parametrize("kind", SCENARIOS)
@every_pair(
    interface=INTERFACES,
    objective=OBJECTIVES,
    reward=AGENT_REWARDS[:6],
    steps_per_action=STEPS_PER_ACTION,
    speed=SPEEDS,
)
def test_rewards_are_the_defined_ones(
    kind: str, interface: str, objective: str, reward: str, steps_per_action: int, speed: float
) -> None:
    """An action gets the sum over its steps, but 0 if the agent was caught before. Rollouts return means."""
    if reward in INDIVIDUAL_REWARDS and interface not in PER_AGENT:
        interface = "parallel"
    scenario = SCENARIOS[kind].replace(speed=speed)
    options = {"objective": objective, "reward": reward, "steps_per_action": steps_per_action}
    rewards = rewards_of(interface, scenario, **options)
    run = fe.simulate(scenario, RHO, seed=SEED)
    own, is_caught = own_distances(run)
    end = is_caught.all(axis=1).argmax() or scenario.num_steps
    starts = np.arange(0, end, steps_per_action)
    expected = defined(reward, getattr(run, SERIES[objective])[: end + 1], own[: end + 1], scenario.num_steps)
    expected = np.add.reduceat(expected, starts)
    if interface in PER_AGENT:
        expected = np.where(is_caught[starts], 0.0, expected)
    if interface.startswith("rollout"):
        expected = expected.sum(axis=0, keepdims=True).mean(axis=1, keepdims=True)
    np.testing.assert_allclose(rewards, np.broadcast_to(expected, rewards.shape), rtol=0, atol=1e-9)


@every_pair(
    reward=("change", "terminal"),
    escape_force=("constant", "linear", "linear_as_printed"),
    steps_per_action=STEPS_PER_ACTION,
)
def test_line_return_is_the_change_of_the_escape_distance(
    reward: str, escape_force: Any, steps_per_action: int
) -> None:
    scenario = fe.LineScenario(num_agents=30, escape_force=escape_force, max_steps=50)
    env = fe.LineEscapeEnv(scenario, reward=reward, steps_per_action=steps_per_action, action_mode="range")
    env.reset(seed=SEED)
    rewards, has_ended = [], False
    while not has_ended:
        _, paid, terminated, truncated, info = env.step(np.array([0.25], np.float32))
        rewards.append(paid)
        has_ended = terminated or truncated
    curve = fe.simulate_line(scenario, 0.25, seed=SEED).escape_distance
    np.testing.assert_allclose(sum(rewards), curve[-1] - curve[0], rtol=0, atol=1e-12)
    assert info["escape_distance"] == curve[-1]
    assert terminated == fe.simulate_line(scenario, 0.25, seed=SEED).converged
    if reward == "terminal":
        assert set(rewards[:-1]) <= {0.0}


@pytest.mark.parametrize("steps_per_action", [1, 4])
def test_an_episode_terminates_when_all_are_caught(steps_per_action: int) -> None:
    seen = set()
    for seed in range(12):
        run = fe.simulate(doomed(), 3.0, seed=seed)
        options: Any = {"action_mode": "range", "steps_per_action": steps_per_action}
        env = fe.FlockEscapeEnv(doomed(), objective="fraction_surviving", **options)
        env.reset(seed=seed)
        is_over, steps = False, 0
        while not is_over:
            observation, _, terminated, truncated, info = env.step(np.array([3.0], np.float32))
            at = env.policy_spec.layout.index("running_minimum")
            assert observation[at] == np.float32(info["fraction_surviving"])
            steps, is_over = steps + 1, terminated or truncated
        left = run.fraction_surviving[-1]
        assert info["fraction_surviving"] == left
        assert (terminated, truncated) == (left == 0, left > 0)
        assert left or -(-run.caught_at.max() // steps_per_action) == steps
        seen.add(terminated)
    assert seen == {True, False}
