"""Difference and neighborhood rewards against NumPy references and copies of the flock."""

import copy
from typing import Any

import numpy as np
import reference
from envs import state
from objective_values import SERIES
from option_table import DIMENSIONS, OBJECTIVES, every_pair, small_flock

import flockesc_env as fe
from flockesc_env.envs.pettingzoo import FlockParallelEnv
from flockesc_env.models.graph import neighbor_pairs
from flockesc_env.scenario import ConstantVelocity, Learned, PurePursuit, Wandering
from flockesc_env.scenario.neighbors import Topological

MAX_RANGE = 12.0

HUNTERS = (
    PurePursuit((-5.0, -5.0), (20.0, 20.0), max_turn_rate=4.0, confusion_rate=2.0, sight=1e3),
    Wandering((25.0, 0.0), (0.0, 15.0), angular_diffusion=2.0),
    ConstantVelocity((0.0, 25.0), (12.0, -12.0)),
)
FLOCKS: dict[str, dict[str, Any]] = {
    "paper": {},
    "noise and delay": {"angular_noise": 1.0, "sensing_noise": 0.5, "sensing_delay": 2},
    "random predators": {"predators": HUNTERS},
    "capture": {"predators": HUNTERS, "capture_radius": 7.0},
    "blind angle": {"blind_angle": 2.0},
    "frozen graph": {"frozen_graph": True},
    "nearest": {"neighbor_rule": Topological()},
    "learned": {"predators": (Learned((0.0, 0.0), (8.0, 8.0)), HUNTERS[0]), "capture_radius": 7.0},
}
DENSE: dict[str, Any] = {"num_agents": 12, "num_steps": 30, "initial_side": 18.0}


def played(scenario: fe.FlockScenario, reward: str, **options: Any) -> FlockParallelEnv:
    env = fe.parallel_env(scenario, reward=reward, action_mode="range", max_range=MAX_RANGE, **options)
    env.reset_array(seed=6)
    return env


def some_ranges(scenario: fe.FlockScenario, rng: np.random.Generator) -> np.ndarray:
    """Return one range per agent, shape (n, 1); some are 0."""
    ranges = rng.uniform(0, MAX_RANGE, (scenario.num_agents, 1))
    return np.where(rng.random(ranges.shape) < 0.2, 0.0, ranges)


@every_pair(flock=FLOCKS, objective=OBJECTIVES, dimension=DIMENSIONS)
def test_difference_against_copies_of_the_flock(flock: str, objective: str, dimension: int) -> None:
    """In each copy of the environment one agent has range 0; random draws are the same, bit for bit."""
    scenario = small_flock(dimension, **DENSE, **FLOCKS[flock])
    env = played(scenario, "difference", objective=objective, steps_per_action=4)
    rng = np.random.default_rng(0)
    alive, paid = np.ones(scenario.num_agents, bool), []
    while env.agents:
        ranges = some_ranges(scenario, rng)
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


def near(scenario: fe.FlockScenario, state: dict[str, Any]) -> np.ndarray:
    """Return whether agent j is a neighbor of agent i under the largest range, shape (n, n)."""
    pairs = neighbor_pairs(scenario, state["positions"], MAX_RANGE, velocities=state["velocities"])
    graph = np.eye(scenario.num_agents, dtype=bool)
    graph[tuple(pairs.T)] = True
    return graph


def assert_neighborhoods(scenario: fe.FlockScenario, graph: Any, steps_per_action: int = 1) -> set[int]:
    """Play an episode twice, once step by step, and return the numbers of neighbors.

    The neighborhood uses the largest range, not the ranges that actions set.
    """
    env = played(scenario, "neighborhood_distance_change", steps_per_action=steps_per_action)
    steps = played(scenario, "distance", steps_per_action=1)
    rng, counts = np.random.default_rng(3), set()
    while env.agents:
        ranges = some_ranges(scenario, rng)
        expected = np.zeros(scenario.num_agents)
        for _ in range(steps_per_action):
            before = state(steps.flock)
            terminations = steps.step_array(ranges)[2]
            after = state(steps.flock)
            change = after["distances"] - before["distances"]
            neighbors = graph(after) & ~terminations
            for agent in np.flatnonzero(~terminations):
                expected[agent] += change[neighbors[agent]].mean()
            counts |= {*neighbors.sum(axis=1).tolist()}
        np.testing.assert_allclose(env.step_array(ranges)[1], expected, rtol=0, atol=1e-12)
    assert not steps.agents
    return counts


def test_agents_on_the_edge_of_a_neighborhood() -> None:
    """An agent at exactly the largest range counts; an agent slightly farther away does not."""
    scenario = small_flock(
        num_agents=2, num_steps=1, time_step=1.0, predators=(ConstantVelocity((0, 0), (0, 0)),)
    )
    env = fe.parallel_env(scenario, reward="neighborhood_distance_change", max_range=MAX_RANGE)
    for gap, is_near in ((MAX_RANGE, True), (np.nextafter(MAX_RANGE, 99.0), False)):
        # The second agent approaches the predator, the first one moves away from it.
        start = {
            "initial_positions": [[0.0, 32.0], [gap, 0.0]],
            "initial_velocities": [[0.0, -32.0], [0.0, 0.0]],
        }
        env.reset_array(seed=0, options=start)
        rewards = env.step_array(np.ones((2, 1), np.float32))[1]
        assert rewards.tolist() == ([-16.0, -16.0] if is_near else [-32.0, 0.0])


@every_pair(flock=[name for name in FLOCKS if name not in {"frozen graph", "learned"}], dimension=DIMENSIONS)
def test_neighborhood_follows_the_neighbor_rule(flock: str, dimension: int) -> None:
    scenario = small_flock(dimension, **(DENSE | {"num_agents": 30}), **FLOCKS[flock])
    counts = assert_neighborhoods(scenario, lambda state: near(scenario, state))
    assert len(counts) > 1 or (flock, counts) == ("nearest", {1 + MAX_RANGE})
    assert (0 in counts) == (flock == "capture")


def test_a_frozen_graph_is_the_neighborhood() -> None:
    scenario = small_flock(num_agents=30, frozen_graph=True)
    start = state(played(scenario, "distance").flock)
    first = some_ranges(scenario, np.random.default_rng(3)).ravel()
    graph = reference.directed_graph(start["positions"], first)
    assert len(assert_neighborhoods(scenario, lambda _: graph)) > 3
