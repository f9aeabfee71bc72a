"""Every reward by its definition, through the environments that all other interfaces are compared with.

Also what ranges cost: ``mean_range``, ``mean_heard`` and the option ``range_cost``.
"""

import copy
from typing import Any

import numpy as np
import option_table as table
import pytest
import reference
from objective_values import SERIES
from option_table import DIMENSIONS, STEPS_PER_ACTION, doomed, every_pair, hunted, small_flock

import flockesc_env as fe
from flockesc_env.models import Trajectory
from flockesc_env.scenario import ConstantVelocity, Learned, PurePursuit, Topological, Wandering

RHO, MAX_RANGE = 5.0, 8.0
SEED = 8
PER_AGENT = ("parallel", "rollout of agents")
INTERFACES = ("gymnasium", "rollout of flocks", *PER_AGENT)
TWO_WAVES = (ConstantVelocity((-20.0, 35.0), (150.0, 0.0)), ConstantVelocity((180.0, 15.0), (-180.0, 0.0)))
"""Two predators: the first passes by, and the second comes nearer later."""
HUNTERS = (
    PurePursuit((-5.0, -5.0), (20.0, 20.0), max_turn_rate=4.0, confusion_rate=2.0, sight=1e3),
    Wandering((25.0, 0.0), (0.0, 15.0), angular_diffusion=2.0),
    ConstantVelocity((0.0, 25.0), (12.0, -12.0)),
)
FLOCKS: dict[str, dict[str, Any]] = {
    "paper": {},
    "two waves": {"predators": TWO_WAVES, "speed": 4.0},
    "noise and delay": {"angular_noise": 1.0, "sensing_noise": 0.5, "sensing_delay": 2},
    "random predators": {"predators": HUNTERS},
    "capture": {"predators": HUNTERS, "capture_radius": 7.0},
    "all are caught": {"predators": HUNTERS, "capture_radius": 14.0},
    "blind angle": {"blind_angle": 2.0},
    "frozen graph": {"frozen_graph": True},
    "nearest": {"neighbor_rule": Topological()},
    "learned": {"predators": (Learned((0.0, 0.0), (8.0, 8.0)), HUNTERS[0]), "capture_radius": 7.0},
}


def flock_of(name: str, dimension: int) -> fe.FlockScenario:
    return small_flock(dimension, num_agents=12, num_steps=30, initial_side=18.0, **FLOCKS[name])


def rewards_of(interface: str, scenario: fe.FlockScenario, **options: Any) -> np.ndarray:
    """Play an episode and return its rewards, shape (actions, rows), or its mean return, shape (1, 1)."""
    options |= {"action_mode": "range", "max_range": MAX_RANGE}
    if interface.startswith("rollout"):
        options["per_agent"] = interface in PER_AGENT
        return fe.rollout(scenario, fe.FixedRange(RHO), [SEED], **options).mean_return[None]
    is_flock = interface == "gymnasium"
    env: Any = fe.FlockEscapeEnv(scenario, **options) if is_flock else fe.parallel_env(scenario, **options)
    reset, act = (env.reset, env.step) if is_flock else (env.reset_array, env.step_array)
    actions = [np.full(1 if is_flock else (scenario.num_agents, 1), RHO)]
    if not is_flock and scenario.num_learned:
        actions.append(np.zeros((scenario.num_learned, scenario.dimension)))
    reset(seed=SEED)
    rewards: list[Any] = []
    is_over = False
    while not is_over:
        _, paid, terminated, truncated, _ = act(*actions)
        rewards.append(np.atleast_1d(paid))
        is_over = np.all(np.logical_or(terminated, truncated))
    assert np.all(terminated) == (not np.any(truncated)) == env.flock.caught.all()
    return np.array(rewards)


def own_distances(run: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Return distances, 0 for caught agents, and whether agents are caught; shape (times, agents)."""
    offsets = run.positions[:, :, None] - run.predator_positions[:, None]
    is_caught = (run.caught_at >= 0) & (run.caught_at <= np.arange(len(run.times))[:, None])
    return np.where(is_caught, 0.0, np.linalg.norm(offsets, axis=3).min(axis=2)), is_caught


def defined(reward: str, run: Trajectory, objective: str, end: int) -> np.ndarray:
    """Return the reward of every step before the end and agent, shape (end, agents), or shape (end, 1)."""
    curve, (own, _) = getattr(run, SERIES[objective])[: end + 1], own_distances(run)
    own = own[: end + 1]
    minimum = np.minimum.accumulate(curve)[:, np.newaxis]
    rewards = np.zeros((end, own.shape[1] if reward in table.INDIVIDUAL_REWARDS else 1))
    match reward:
        case "team":
            return np.diff(minimum, axis=0)
        case "terminal":
            rewards[-1] = minimum[-1] - minimum[0]
        case "distance":
            return curve[1:, np.newaxis] / run.scenario.num_steps
        case "individual_distance":
            return own[1:] / run.scenario.num_steps
        case "individual_distance_change":
            return np.diff(own, axis=0)
        case "individual":  # what agents lost since the minimum fell last
            falls = np.flatnonzero(np.diff(minimum[:, 0]) < 0) + 1
            rewards[falls - 1] = np.diff(own[[0, *falls]], axis=0)
    return rewards


@every_pair(
    flock=FLOCKS,
    dimension=DIMENSIONS,
    interface=INTERFACES,
    objective=table.OBJECTIVES,
    reward=[reward for reward in table.AGENT_REWARDS if reward != "difference"],
    steps_per_action=STEPS_PER_ACTION,
)
def test_rewards_are_the_defined_ones(
    flock: str, dimension: int, interface: str, objective: str, reward: str, steps_per_action: int
) -> None:
    """An action gets the sum over its steps, but 0 if the agent was caught before. Rollouts return means."""
    if reward in table.INDIVIDUAL_REWARDS and interface not in PER_AGENT:
        interface = "parallel"
    scenario = flock_of(flock, dimension)
    options = {"objective": objective, "reward": reward, "steps_per_action": steps_per_action}
    rewards = rewards_of(interface, scenario, **options)
    run = fe.simulate(scenario, RHO, seed=SEED)
    _, is_caught = own_distances(run)
    assert is_caught.any() == (scenario.capture_radius is not None)
    assert is_caught[-1].all() == (flock == "all are caught")
    end = is_caught.all(axis=1).argmax() or scenario.num_steps
    starts = np.arange(0, end, steps_per_action)
    expected = np.add.reduceat(defined(reward, run, objective, end), starts)
    if interface in PER_AGENT:
        expected = np.where(is_caught[starts], 0.0, expected)
    if interface.startswith("rollout"):
        expected = expected.sum(axis=0, keepdims=True).mean(axis=1, keepdims=True)
    np.testing.assert_allclose(rewards, np.broadcast_to(expected, rewards.shape), rtol=0, atol=1e-9)


@every_pair(flock=FLOCKS, objective=table.OBJECTIVES, dimension=DIMENSIONS)
def test_difference_against_copies_of_the_flock(flock: str, objective: str, dimension: int) -> None:
    """In each copy of the environment one agent has range 0; random draws are the same, bit for bit."""
    scenario = flock_of(flock, dimension)
    options: Any = {"action_mode": "range", "max_range": MAX_RANGE, "steps_per_action": 4}
    env = fe.parallel_env(scenario, reward="difference", objective=objective, **options)
    env.reset_array(seed=SEED)
    rng = np.random.default_rng(0)
    alive, paid = np.ones(scenario.num_agents, bool), []
    while env.agents:
        ranges = rng.uniform(0, MAX_RANGE, (scenario.num_agents, 1))
        ranges[rng.random(ranges.shape) < 0.2] = 0.0
        steering = rng.uniform(-1, 1, (env.predator_policy_spec.count, dimension))
        pushes = steering if len(steering) else None
        copies = [copy.deepcopy(env) for _ in range(scenario.num_agents)]
        _, rewards, terminations, _, info = env.step_array(ranges, pushes)
        for agent, alone in enumerate(copies):
            ranges_without = np.where(np.arange(scenario.num_agents) == agent, 0, ranges.T).T
            without = alone.step_array(ranges_without, pushes)[-1]
            gain = info[SERIES[objective]] - without[SERIES[objective]] if alive[agent] else 0.0
            assert rewards[agent] == gain
            assert gain == 0.0 or ranges[agent] > 0
        alive = ~terminations
        paid.append(rewards)
    assert np.any(paid) or objective != "min_mean_distance"
    assert alive.all() == ("capture_radius" not in FLOCKS[flock])


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


@pytest.mark.parametrize("policy", ["fixed:12.5", "stubborn-leaders"])
@pytest.mark.parametrize("scenario", [small_flock(), hunted(3), doomed()], ids=["small", "hunted", "caught"])
def test_the_load_of_a_flock(scenario: fe.FlockScenario, policy: str) -> None:
    run = fe.simulate(scenario, policy=policy, seed=3)
    assert (run.caught_at >= 0).any() == (scenario.capture_radius is not None)
    mean_range, mean_heard = reference.load_of(run)
    played = fe.rollout(scenario, policy, [5, 3])
    assert played.mean_heard[1] == mean_heard > 0
    np.testing.assert_allclose(played.mean_range[1], mean_range, rtol=1e-14)
    if policy == "fixed:12.5":
        assert played.mean_range.tolist() == [12.5, 12.5]
        each = fe.rollout(scenario, policy, [5, 3], per_agent=True)
        np.testing.assert_array_equal(each.mean_heard, played.mean_heard)
        np.testing.assert_array_equal(each.mean_range, played.mean_range)


@pytest.mark.parametrize("reward", table.AGENT_REWARDS)
def test_range_cost_lowers_the_reward_of_every_action_as_a_wrapper_would(reward: Any) -> None:
    options: Any = {"reward": reward, "action_mode": "range", "steps_per_action": 3}
    plain, costly = (fe.parallel_env(hunted(), range_cost=cost, **options) for cost in (0.0, 0.01))
    for env in (plain, costly):
        env.reset_array(seed=3)
    rng, alive = np.random.default_rng(0), np.ones(9, bool)
    while plain.agents:
        ranges = rng.uniform(0, 20, (9, 1))
        (_, expected, ended, *_), (_, rewards, *_) = (env.step_array(ranges) for env in (plain, costly))
        paid = ranges[:, 0] if reward in table.INDIVIDUAL_REWARDS else ranges[alive].mean()
        assert (rewards[~alive] == 0).all()
        np.testing.assert_allclose(rewards[alive], (expected - 0.01 * paid)[alive], rtol=0, atol=1e-14)
        if reward in table.INDIVIDUAL_REWARDS:
            np.testing.assert_array_equal(rewards[alive], (expected - 0.01 * paid)[alive])
        alive = ~ended
    assert not alive.all()


def test_a_restored_episode_continues_its_load() -> None:
    env = fe.FlockEscapeEnv(action_mode="range", steps_per_action=2)
    env.reset(seed=3)
    env.step(np.array([0.5]))
    env.set_state(env.get_state())
    env.step(np.array([0.25]))
    assert env._batch.core.metrics()["mean_range"] == 0.375
