"""Returns of episodes: sums of every reward. Other interfaces return the same as the two of FLOCKS here."""

from typing import Any

import numpy as np
import pytest
from envs import FLOCKS, has_ended, same_action, start, step
from objective_values import SERIES
from option_table import (
    EVERY_STEP,
    FLOCK_REWARDS,
    OBJECTIVES,
    STEPS_PER_ACTION,
    doomed,
    every_pair,
    hunted,
    small_flock,
)

import flockesc_env as fe
from flockesc_env.policies import FixedRange
from flockesc_env.scenario import ConstantVelocity

RHO = 25.0  # exact in every interface: action -0.5 of [0, 100]
SEED = 8
PER_AGENT = ("parallel", "rollout of agents")
INTERFACES = ("gymnasium", "rollout of flocks", *PER_AGENT)
DISTANCES = sorted({*OBJECTIVES} - {"fraction_surviving"})
SPEEDS = (4.0, 14.0)
"""Of the agents, in m/s: predators come near."""
TWO_WAVES = (ConstantVelocity((-20.0, 35.0), (150.0, 0.0)), ConstantVelocity((180.0, 15.0), (-180.0, 0.0)))
"""Two predators: the first passes by, and the second comes nearer later."""
SCENARIOS = {
    "one predator": small_flock(num_agents=7, num_steps=20),
    "two waves": small_flock(num_agents=7, num_steps=20, predators=TWO_WAVES),
    "capture": hunted(),
}


def rewards_of(interface: str, scenario: fe.FlockScenario, **options: Any) -> np.ndarray:
    """Play an episode and return its rewards, shape (actions, rows), or its mean return, shape (1, 1)."""
    options = EVERY_STEP | options
    if interface.startswith("rollout"):
        options["per_agent"] = interface in PER_AGENT
        return fe.rollout(scenario, FixedRange(RHO), [SEED], **options).mean_return[None]
    env = FLOCKS[interface](scenario, **options)
    start(env, SEED)
    rewards: list[Any] = []
    is_over = False
    while not is_over:
        returned = step(env, same_action(env, np.array([-0.5], np.float32)))
        paid = returned[1]
        rewards.append(
            [paid.get(agent, 0.0) for agent in env.possible_agents] if isinstance(paid, dict) else [paid]
        )
        is_over = has_ended(env, returned)
    return np.array(rewards)


def own_distances(scenario: fe.FlockScenario) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance of every agent, 0 if it is caught, and who is caught; shape (times, agents)."""
    run = fe.simulate(scenario, RHO, seed=SEED)
    offsets = run.positions[:, :, None] - run.predator_positions[:, None]
    is_caught = (run.caught_at >= 0) & (run.caught_at <= np.arange(len(run.times))[:, None])
    return np.where(is_caught, 0.0, np.linalg.norm(offsets, axis=3).min(axis=2)), is_caught


@every_pair(
    interface=INTERFACES,
    objective=DISTANCES,
    reward=("team", "terminal", "distance"),
    steps_per_action=STEPS_PER_ACTION,
    speed=SPEEDS,
)
def test_return_is_the_change_of_the_objective_or_its_time_mean(
    interface: str, objective: str, reward: str, steps_per_action: int, speed: float
) -> None:
    scenario = SCENARIOS["one predator"].replace(speed=speed)
    options = {"objective": objective, "reward": reward, "steps_per_action": steps_per_action}
    rewards = rewards_of(interface, scenario, **options)
    curve = getattr(fe.simulate(scenario, RHO, seed=SEED), SERIES[objective])
    assert curve.min() < curve[0] - 1  # the objective does change
    expected = curve[1:].mean() if reward == "distance" else curve.min() - curve[0]
    np.testing.assert_allclose(rewards.sum(axis=0), expected, rtol=0, atol=1e-9)
    if reward == "terminal" and not interface.startswith("rollout"):
        assert (rewards[:-1] == 0).all()


@every_pair(
    interface=PER_AGENT,
    objective=DISTANCES,
    reward=("individual_distance", "individual_distance_change"),
    steps_per_action=STEPS_PER_ACTION,
)
def test_individual_returns(interface: str, objective: str, reward: str, steps_per_action: int) -> None:
    """Each agent gets the time mean of its distance, or what it gained."""
    scenario = SCENARIOS["one predator"]
    rewards = rewards_of(
        interface, scenario, reward=reward, objective=objective, steps_per_action=steps_per_action
    )
    own, _ = own_distances(scenario)
    expected = own[1:].mean(axis=0) if reward == "individual_distance" else own[-1] - own[0]
    if interface not in FLOCKS:
        expected = expected.mean()
    np.testing.assert_allclose(rewards.sum(axis=0), expected, rtol=0, atol=1e-9)


@every_pair(
    interface=PER_AGENT,
    objective=DISTANCES,
    steps_per_action=STEPS_PER_ACTION,
    speed=SPEEDS,
    kind=("two waves", "capture"),
)
def test_individual_reward_pays_what_agents_lost_since_it_fell_last(
    interface: str, objective: str, steps_per_action: int, speed: float, kind: str
) -> None:
    """A caught agent gets 0, unless the minimum falls in the step of its capture."""
    scenario = SCENARIOS[kind].replace(speed=speed)
    steps_per_action = 1 if kind == "capture" else steps_per_action
    options = {"objective": objective, "steps_per_action": steps_per_action}
    rewards = rewards_of(interface, scenario, reward="individual", **options)
    curve = getattr(fe.simulate(scenario, RHO, seed=SEED), SERIES[objective])
    falls = np.flatnonzero(np.diff(np.minimum.accumulate(curve)) < 0) + 1
    own, is_caught = own_distances(scenario)
    if kind == "two waves":
        assert sorted(set(np.diff(falls)))[0] == 1 < np.diff(falls).max()  # it falls, rests and falls again
    else:
        times = np.flatnonzero((is_caught[1:] & ~is_caught[:-1]).any(axis=1)) + 1
        assert set(times) - set(falls)
    expected = np.zeros((scenario.num_steps, scenario.num_agents))
    expected[falls - 1] = np.where(is_caught[falls - 1], 0.0, np.diff(own[[0, *falls]], axis=0))
    if interface in FLOCKS:
        expected = np.add.reduceat(expected, range(0, scenario.num_steps, steps_per_action))
        at_rest = (expected == 0).all(axis=1)
        assert at_rest.any()
        assert (rewards[at_rest[: len(rewards)]] == 0).all()
    else:
        expected = expected.sum(axis=0, keepdims=True).mean(axis=1, keepdims=True)
    np.testing.assert_allclose(rewards, expected[: len(rewards)], rtol=0, atol=1e-9)


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


@pytest.mark.parametrize("reward", FLOCK_REWARDS)
@pytest.mark.parametrize("steps_per_action", [1, 4])
def test_survival_rewards_the_fraction_surviving(reward: str, steps_per_action: int) -> None:
    seen = set()
    for seed in range(12):
        scenario = doomed()
        run = fe.simulate(scenario, 3.0, seed=seed)
        options: dict[str, Any] = {"reward": reward, "steps_per_action": steps_per_action}
        env = fe.FlockEscapeEnv(scenario, objective="fraction_surviving", action_mode="range", **options)
        env.reset(seed=seed)
        total, is_over, steps = 0.0, False, 0
        while not is_over:
            observation, paid, terminated, truncated, info = env.step(np.array([3.0], np.float32))
            at = env.policy_spec.layout.index("running_minimum")
            assert observation[at] == np.float32(info["fraction_surviving"])
            total, steps, is_over = total + paid, steps + 1, terminated or truncated
        left = run.fraction_surviving[-1]
        assert info["fraction_surviving"] == left
        assert (terminated, truncated) == (left == 0, left > 0)
        if left == 0:
            assert -(-run.caught_at.max() // steps_per_action) == steps
        expected = run.fraction_surviving[1:].mean() if reward == "distance" else left - 1
        assert total == pytest.approx(expected, abs=1e-12)
        seen.add(terminated)
    assert seen == {True, False}
