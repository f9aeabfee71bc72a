"""A seed gives the same flock in every interface and determines all following episodes."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gymnasium.utils import seeding
from option_table import DIMENSIONS, small_flock
from stable_baselines3.common.vec_env import VecEnv

from flockesc_env import (
    AgentVectorEnv,
    FlockEscapeEnv,
    FlockScenario,
    FlockVectorEnv,
    LineEscapeEnv,
    LineScenario,
    PurePursuit,
    Wandering,
    env,
    episode_seed,
    parallel_env,
    rollout,
    simulate,
    simulate_line,
    sweep,
)
from flockesc_env.common.errors import ArgumentError
from flockesc_env.policies import FixedRange
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

RHO = 25.0
ACTION = np.array([-0.5], np.float32)  # exactly RHO of [0, 100]
SEEDS = [0, 7, 2**32, 2**63, 2**64 - 1]
CURVES = ("mean_distance", "min_distance", "num_components", "polarization")

seeds = pytest.mark.parametrize("seed", SEEDS)
dimensions = pytest.mark.parametrize("dimension", DIMENSIONS)


def curves(infos: list[dict[str, Any]]) -> dict[str, list[Any]]:
    return {name: [info[name] for info in infos] for name in CURVES}


def gymnasium_infos(scenario: FlockScenario, seed: int) -> list[dict[str, Any]]:
    environment = FlockEscapeEnv(scenario, count_components=True)
    infos = [environment.reset(seed=seed)[1]]
    return infos + [environment.step(ACTION)[-1] for _ in range(scenario.num_steps)]


def parallel_infos(scenario: FlockScenario, seed: int) -> list[dict[str, Any]]:
    environment = parallel_env(scenario, count_components=True)
    infos = [environment.reset(seed=seed)[1]]
    while environment.agents:
        infos.append(environment.step(dict.fromkeys(environment.agents, ACTION))[-1])
    return [info["agent_0"] for info in infos]


def aec_infos(scenario: FlockScenario, seed: int) -> list[dict[str, Any]]:
    environment = env(scenario, count_components=True)
    environment.reset(seed=seed)
    infos = [environment.infos["agent_0"]]
    for _ in range(scenario.num_steps):
        for _ in range(scenario.num_agents):
            environment.step(ACTION)
        infos.append(environment.infos["agent_0"])
    return infos


def slot_infos(make: Any) -> Callable[[FlockScenario, int], list[dict[str, Any]]]:
    def play(scenario: FlockScenario, seed: int) -> list[dict[str, Any]]:
        environment = make(1, scenario, count_components=True)
        environment.seed(seed)
        environment.reset()
        actions = np.tile(ACTION, (environment.num_envs, 1))
        infos = [environment.reset_infos[0]]
        return infos + [environment.step(actions)[-1][0] for _ in range(scenario.num_steps)]

    return play


INTERFACES = {
    "gymnasium": gymnasium_infos,
    "parallel": parallel_infos,
    "aec": aec_infos,
    "flock slots": slot_infos(FlockVecEnv),
    "agent slots": slot_infos(AgentVecEnv),
}


@seeds
@dimensions
@pytest.mark.parametrize("interface", INTERFACES)
def test_environments_play_the_simulated_flock(interface: str, seed: int, dimension: int) -> None:
    scenario = small_flock(dimension)
    run = simulate(scenario, RHO, seed=seed)
    infos = INTERFACES[interface](scenario, seed)
    expected = {name: getattr(run, name).tolist() for name in CURVES}
    # Before the first action the range is 0, so every agent is alone.
    expected["num_components"][0] = scenario.num_agents
    assert curves(infos) == expected
    assert infos[-1]["min_mean_distance"] == run.mean_distance.min()
    assert infos[-1]["min_min_distance"] == run.min_distance.min()


@seeds
@dimensions
def test_sweep_and_rollout_play_the_simulated_flock(seed: int, dimension: int) -> None:
    scenario = small_flock(dimension)
    run = simulate(scenario, RHO, seed=seed)
    expected = (run.mean_distance.min(), run.min_distance.min(), run.num_components[-1])
    swept = sweep(scenario, [RHO], [seed])
    assert (swept.min_mean_distance, swept.min_min_distance, swept.num_components) == expected
    for per_agent in (False, True):
        episodes = rollout(scenario, FixedRange(RHO), [seed], per_agent=per_agent)
        assert (episodes.min_mean_distance, episodes.min_min_distance, episodes.num_components) == expected
        assert episodes.seeds.tolist() == [seed]


@seeds
def test_lines_are_the_same_everywhere(seed: int) -> None:
    scenario = LineScenario(num_agents=20)
    run = simulate_line(scenario, 0.25, seed=seed)
    swept = sweep(scenario, [0.25], [seed])
    assert swept.escape_distance == run.escape_distance[-1]
    assert swept.num_components == run.num_components[-1]
    assert swept.converged == run.converged
    environment = LineEscapeEnv(scenario, action_mode="range")
    assert environment.reset(seed=seed)[1]["escape_distance"] == run.escape_distance[0]
    for distance in run.escape_distance[1:]:
        info = environment.step(np.array([0.25], np.float32))[-1]
        assert info["escape_distance"] == distance


@dimensions
def test_agents_start_in_their_region(dimension: int) -> None:
    scenario = FlockScenario(dimension=dimension, num_agents=2000, num_steps=1, initial_side=50.0)
    run = simulate(scenario, 0.0, seed=1)
    assert 0 <= run.positions[0].min() < 1
    assert 49 < run.positions[0].max() <= 50
    np.testing.assert_allclose(run.positions[0].mean(axis=0), 25, atol=3 * 50 / np.sqrt(12 * 2000))
    np.testing.assert_allclose(run.velocities[0].mean(axis=0), 0, atol=3 * 10 / np.sqrt(dimension * 2000))


def test_given_positions_leave_the_drawn_headings() -> None:
    """Positions and headings come from separate streams."""
    scenario = small_flock()
    drawn = simulate(scenario, RHO, seed=3)
    given = simulate(scenario, RHO, seed=3, initial_positions=np.zeros((5, 2)))
    np.testing.assert_array_equal(given.velocities[0], drawn.velocities[0])
    assert (given.seed, given.is_start_given) == (3, True)
    both = simulate(
        scenario, RHO, initial_positions=drawn.positions[0], initial_velocities=drawn.velocities[0]
    )
    np.testing.assert_array_equal(both.positions, drawn.positions)
    assert both.is_start_given
    assert not drawn.is_start_given


RANDOM = (
    Wandering((10.0, 10.0), (5.0, 0.0), angular_diffusion=2.0),
    PurePursuit((90.0, 90.0), (0.0, 9.0), confusion_rate=2.0, sight=1e3),
)


@dimensions
def test_random_predators_leave_the_drawn_flock(dimension: int) -> None:
    plain, random = small_flock(dimension), small_flock(dimension, predators=RANDOM)
    first, second, other = simulate(plain, RHO, seed=3), simulate(random, RHO, seed=3), simulate(random, RHO)
    np.testing.assert_array_equal(first.positions[0], second.positions[0])
    np.testing.assert_array_equal(first.velocities[0], second.velocities[0])
    again = simulate(random, RHO, seed=3)
    np.testing.assert_array_equal(again.predator_positions, second.predator_positions)
    assert (other.predator_positions[2:] != second.predator_positions[2:]).any()


@seeds
@dimensions
@pytest.mark.parametrize("interface", INTERFACES)
def test_random_predators_are_the_same_everywhere(interface: str, seed: int, dimension: int) -> None:
    scenario = small_flock(dimension, predators=RANDOM)
    infos = INTERFACES[interface](scenario, seed)
    run = simulate(scenario, RHO, seed=seed)
    assert [info["mean_distance"] for info in infos] == run.mean_distance.tolist()
    swept = sweep(scenario, [RHO, RHO], [seed, 5])
    assert (swept.min_mean_distance[:, 0] == run.mean_distance.min()).all()


def test_random_predators_do_not_depend_on_the_batch() -> None:
    """Each episode of each slot equals the simulation with its seed, on any number of threads."""
    scenario = small_flock(predators=RANDOM)
    expected = [
        [simulate(scenario, RHO, seed=episode_seed(40 + slot, episode)).mean_distance for slot in range(5)]
        for episode in range(2)
    ]
    for num_threads in (1, 2):
        vector = FlockVectorEnv(5, scenario, num_threads=num_threads, action_mode="range")
        for episode, runs in enumerate(expected):
            vector.reset(seed=40 if episode == 0 else None)
            for step in range(1, scenario.num_steps + 1):
                infos = vector.step(np.full((5, 1), RHO, np.float32))[-1]
                assert infos["mean_distance"].tolist() == [run[step] for run in runs]


def test_a_copy_draws_the_same_numbers() -> None:
    scenario = small_flock(predators=RANDOM)
    environment = FlockEscapeEnv(scenario)
    environment.reset(seed=1)
    environment.step(ACTION)
    copied = copy.deepcopy(environment)
    for _ in range(scenario.num_steps - 1):
        first, second = environment.step(ACTION), copied.step(ACTION)
        np.testing.assert_array_equal(first[0], second[0])


def first_observation(environment: Any, seed: int | None = None) -> bytes:
    """Reset any environment and return its first observation in hashable form."""
    if isinstance(environment, VecEnv):
        if seed is not None:
            environment.seed(seed)
        return environment.reset().tobytes()
    observation, _ = environment.reset(seed=seed)
    values = list(observation.values()) if isinstance(observation, dict) else observation
    return np.asarray(values).tobytes()


MAKERS: dict[str, Callable[[], Any]] = {
    "gymnasium": lambda: FlockEscapeEnv(small_flock()),
    "line": lambda: LineEscapeEnv(LineScenario(num_agents=5)),
    "parallel": lambda: parallel_env(small_flock()),
    "vector": lambda: FlockVectorEnv(2, small_flock()),
    "vector with a slot per agent": lambda: AgentVectorEnv(10, small_flock()),
    "flock slots": lambda: FlockVecEnv(2, small_flock()),
    "agent slots": lambda: AgentVecEnv(2, small_flock()),
}


@pytest.mark.parametrize("interface", MAKERS)
def test_unseeded_resets_differ(interface: str) -> None:
    first, second = MAKERS[interface](), MAKERS[interface]()
    seen = [first_observation(environment) for environment in (first, second) for _ in range(4)]
    assert len(set(seen)) == len(seen)


@pytest.mark.parametrize("interface", MAKERS)
def test_a_seed_fixes_all_unseeded_resets_after_it(interface: str) -> None:
    first, second = MAKERS[interface](), MAKERS[interface]()
    first_observation(second)
    sequences = [
        [first_observation(environment, seed=21), *(first_observation(environment) for _ in range(4))]
        for environment in (first, second, first)
    ]
    assert sequences[0] == sequences[1] == sequences[2]
    assert len(set(sequences[0])) == 5


def test_single_flock_interfaces_share_the_sequence() -> None:
    """After the same seed, the n-th unseeded episode has the same flock in every interface."""
    scenario = small_flock()
    gym, parallel, slots = FlockEscapeEnv(scenario), parallel_env(scenario), FlockVecEnv(1, scenario)
    slots.seed(4)
    for seed in (4, None, None):
        distance = gym.reset(seed=seed)[1]["mean_distance"]
        assert parallel.reset(seed=seed)[1]["agent_0"]["mean_distance"] == distance
        slots.reset()
        assert slots.reset_infos[0]["mean_distance"] == distance


@seeds
def test_every_episode_can_be_played_alone(seed: int) -> None:
    """The k-th reset without a seed plays ``episode_seed(seed, k)``, in every interface."""
    scenario, line = small_flock(), LineScenario(num_agents=5)
    env, parallel, slots = FlockEscapeEnv(scenario), parallel_env(scenario), FlockVecEnv(1, scenario)
    vector, agents, lines = FlockVectorEnv(1, scenario), AgentVecEnv(1, scenario), LineEscapeEnv(line)
    slots.seed(seed)
    agents.seed(seed)
    for episode in range(4):
        given = seed if episode == 0 else None
        drawn = episode_seed(seed, episode)
        distance = simulate(scenario, RHO, seed=drawn).mean_distance[0]
        assert env.reset(seed=given)[1]["mean_distance"] == distance
        assert parallel.reset(seed=given)[1]["agent_0"]["mean_distance"] == distance
        assert vector.reset(seed=given)[1]["mean_distance"].tolist() == [distance]
        for each in (slots, agents):
            each.reset()
            assert each.reset_infos[0]["mean_distance"] == distance
        distance = simulate_line(line, 0.1, seed=drawn).escape_distance[0]
        assert lines.reset(seed=given)[1]["escape_distance"] == distance


@pytest.mark.parametrize("make", [FlockVecEnv, AgentVecEnv])
def test_autoreset_follows_the_schedule(make: Any) -> None:
    scenario = small_flock(num_steps=3)
    environment = make(2, scenario)
    environment.seed(40)
    environment.reset()
    actions = np.tile(ACTION, (environment.num_envs, 1))
    for episode in range(3):
        infos = [environment.step(actions)[-1] for _ in range(3)]
        for flock in range(2):
            run = simulate(scenario, RHO, seed=episode_seed(40 + flock, episode))
            slot = flock * environment.num_envs // 2
            assert [info[slot]["mean_distance"] for info in infos] == run.mean_distance[1:].tolist()


def test_schedule_of_seeds() -> None:
    """``episode_seed`` is pure, never repeats, returns at least 2^32, and must never change."""
    assert [episode_seed(seed, 0) for seed in SEEDS] == SEEDS
    assert episode_seed(np.int64(7), np.uint8(0)) == 7
    assert [episode_seed(7, episode) for episode in (1, 2)] == [856522681599956647, 9029727068422764021]
    drawn = {episode_seed(seed, episode) for seed in range(50) for episode in range(1, 50)}
    assert len(drawn) == 50 * 49
    assert min(drawn) >= 2**32
    assert max(drawn) < 2**63


@pytest.mark.parametrize(
    ("seed", "episode", "field"),
    [(-1, 0, "seed"), (2**64, 0, "seed"), (1.5, 0, "seed"), (0, -1, "episode"), (0, "1", "episode")],
)
def test_no_schedule_for_other_numbers(seed: Any, episode: Any, field: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        episode_seed(seed, episode)
    assert caught.value.field == field


@pytest.mark.parametrize("make", [MAKERS["gymnasium"], MAKERS["line"], MAKERS["vector"]])
def test_np_random_follows_gymnasium(make: Callable[[], Any]) -> None:
    environment = make()
    environment.reset()
    environment.reset(seed=12)
    expected, seed = seeding.np_random(12)
    assert environment.np_random_seed == seed
    assert environment.np_random.bit_generator.state == expected.bit_generator.state
    environment.reset()
    assert environment.np_random.random() == expected.random()


def test_small_seeds_are_never_drawn() -> None:
    """Held-out flocks have small seeds, so they cannot appear in training."""
    slots = FlockVecEnv(1, small_flock())
    drawn = [simulate(small_flock(), RHO).seed for _ in range(50)] + [slots.seed()[0] for _ in range(50)]
    assert min(drawn) >= 2**32


def test_unseeded_runs_report_their_seed() -> None:
    scenario, line = small_flock(), LineScenario(num_agents=5)
    first, second = simulate(scenario, RHO), simulate(scenario, RHO)
    assert first.seed != second.seed
    np.testing.assert_array_equal(simulate(scenario, RHO, seed=first.seed).positions, first.positions)
    drawn = simulate_line(line, 0.1)
    np.testing.assert_array_equal(simulate_line(line, 0.1, seed=drawn.seed).states, drawn.states)


@pytest.mark.parametrize("seed", [np.int64(3), np.uint8(3), np.array(3)])
def test_numpy_integers_are_seeds(seed: Any) -> None:
    scenario = small_flock()
    expected = simulate(scenario, RHO, seed=3)
    np.testing.assert_array_equal(simulate(scenario, RHO, seed=seed).positions, expected.positions)
    assert sweep(scenario, [RHO], [seed]).seeds.tolist() == [3]
    for make in MAKERS.values():
        assert first_observation(make(), seed) == first_observation(make(), 3)
