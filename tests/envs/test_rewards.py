"""Returns of episodes: sums of every reward, through every interface."""

from collections.abc import Callable
from typing import Any

import numpy as np
from envs import FLOCKS, has_ended, same_action, start, step
from objective_values import SERIES
from option_table import EVERY_STEP, OBJECTIVES, STEPS_PER_ACTION, every_pair, small_flock
from stable_baselines3.common.vec_env import VecEnv

import flockesc_env as fe
from flockesc_env.policies import FixedRange
from flockesc_env.scenario import ConstantVelocity

RHO = 25.0  # exact in every interface: action -0.5 of [0, 100]
SEED = 8
SCENARIO = small_flock(num_agents=7, num_steps=20)

Play = Callable[..., np.ndarray]


def played(interface: str) -> Play:
    """Return a function that plays an episode and returns its rewards, shape (actions, rows)."""

    def play(scenario: fe.FlockScenario, **options: Any) -> np.ndarray:
        env = FLOCKS[interface](scenario, **EVERY_STEP | options)
        start(env, SEED)
        rewards: list[Any] = []
        is_over = False
        while not is_over:
            returned = step(env, same_action(env, np.array([-0.5], np.float32)))
            paid = returned[1]
            rewards.append(list(paid.values()) if isinstance(paid, dict) else np.atleast_1d(paid))
            is_over = returned[2].any() if isinstance(env, VecEnv) else has_ended(env, returned)
        return np.array(rewards, np.float64)

    return play


def play_rollout(per_agent: bool) -> Play:
    def play(scenario: fe.FlockScenario, **options: Any) -> np.ndarray:
        given = {**EVERY_STEP, **options, "per_agent": per_agent}
        episodes = fe.rollout(scenario, FixedRange(RHO), [SEED], **given)
        return episodes.mean_return[None]

    return play


INTERFACES: dict[str, Play] = {
    **{name: played(name) for name in ("gymnasium", "parallel", "flock slots", "agent slots")},
    "flock rollout": play_rollout(per_agent=False),
    "agent rollout": play_rollout(per_agent=True),
}
PER_AGENT: dict[str, Play] = {name: INTERFACES[name] for name in ("parallel", "agent slots", "agent rollout")}
SLOTS_ARE_FLOAT32 = {"rtol": 0, "atol": 1e-4}

# Survival: tests/envs/test_capture_interfaces.py.
DISTANCES = sorted({*OBJECTIVES} - {"fraction_surviving"})
SPEEDS = (4.0, 14.0)
"""Of the agents, in m/s: predators come near."""


def tolerance(interface: str) -> dict[str, float]:
    return SLOTS_ARE_FLOAT32 if "slots" in interface else {"rtol": 0, "atol": 1e-9}


def distances(objective: str, scenario: fe.FlockScenario = SCENARIO) -> np.ndarray:
    curve: np.ndarray = getattr(fe.simulate(scenario, RHO, seed=SEED), SERIES[objective])
    return curve


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
    scenario = SCENARIO.replace(speed=speed)
    options = {"objective": objective, "reward": reward, "steps_per_action": steps_per_action}
    rewards = INTERFACES[interface](scenario, **options)
    curve = distances(objective, scenario)
    assert curve.min() < curve[0] - 1  # the objective does change
    expected = curve[1:].mean() if reward == "distance" else curve.min() - curve[0]
    np.testing.assert_allclose(rewards.sum(axis=0), expected, **tolerance(interface))
    if reward == "terminal" and "rollout" not in interface:
        assert (rewards[:-1] == 0).all()


def agent_distances(scenario: fe.FlockScenario = SCENARIO) -> np.ndarray:
    run = fe.simulate(scenario, RHO, seed=SEED)
    offsets = run.positions[:, :, None] - run.predator_positions[:, None]
    return np.linalg.norm(offsets, axis=3).min(axis=2)


@every_pair(
    interface=PER_AGENT,
    objective=DISTANCES,
    reward=("individual_distance", "individual_distance_change"),
    steps_per_action=STEPS_PER_ACTION,
)
def test_individual_returns(interface: str, objective: str, reward: str, steps_per_action: int) -> None:
    """Each agent gets the time mean of its distance, or what it gained."""
    options = {"objective": objective, "steps_per_action": steps_per_action}
    rewards = PER_AGENT[interface](SCENARIO, reward=reward, **options)
    own = agent_distances()
    expected = own[1:].mean(axis=0) if reward == "individual_distance" else own[-1] - own[0]
    if interface == "agent rollout":
        expected = expected.mean()
    np.testing.assert_allclose(rewards.sum(axis=0), expected, **tolerance(interface))


TWO_WAVES = (ConstantVelocity((-20.0, 35.0), (150.0, 0.0)), ConstantVelocity((180.0, 15.0), (-180.0, 0.0)))
"""Two predators: the first passes by, and the second comes nearer later."""


def falls(curve: np.ndarray) -> np.ndarray:
    """Return the times at which the running minimum of a curve falls."""
    return np.flatnonzero(np.diff(np.minimum.accumulate(curve)) < 0) + 1


@every_pair(interface=PER_AGENT, objective=DISTANCES, steps_per_action=STEPS_PER_ACTION, speed=SPEEDS)
def test_individual_reward_pays_what_agents_lost_since_it_fell_last(
    interface: str, objective: str, steps_per_action: int, speed: float
) -> None:
    scenario = SCENARIO.replace(speed=speed, predators=TWO_WAVES)
    options = {"objective": objective, "steps_per_action": steps_per_action}
    rewards = PER_AGENT[interface](scenario, reward="individual", **options)
    own, times = agent_distances(scenario), falls(distances(objective, scenario))
    assert sorted(set(np.diff(times)))[0] == 1 < np.diff(times).max()  # it falls, rests and falls again
    expected = np.zeros((scenario.num_steps, scenario.num_agents))
    expected[times - 1] = np.diff(own[[0, *times]], axis=0)
    if interface == "agent rollout":
        expected = expected.sum(axis=0, keepdims=True).mean(axis=1, keepdims=True)
    else:
        expected = np.add.reduceat(expected, range(0, scenario.num_steps, steps_per_action))
        at_rest = (expected == 0).all(axis=1)
        assert at_rest.any()
        assert (rewards[at_rest] == 0).all()
    np.testing.assert_allclose(rewards, expected, **tolerance(interface))


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
