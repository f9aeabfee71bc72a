"""Hashes of whole episodes: of the bytes of every observation, reward, end and info.

``python tests/support/golden_episodes.py`` adds new cases to ``tests/golden/golden_episodes.json``. It
changes hashes of old cases only if an id has a new version (``docs/engineering.md``).
"""

import hashlib
import json
import math
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from objective_values import LATER
from option_table import EVERY_STEP, UNLIKE, small_flock

import flockesc_env as fe
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.policies import Pursue
from flockesc_env.scenario import ConstantVelocity, PrescribedPath, PurePursuit, Wandering

GOLDEN = Path(__file__).parents[1] / "golden" / "golden_episodes.json"
SEED = 7
TEAM = ("paper-flock", "capture", "randomized", "noisy-hearing", "topological", "space")

CHASED = {
    "predators": (
        Wandering((10.0, 10.0), (5.0, 0.0), angular_diffusion=2.0),
        PurePursuit((30.0, 0.0), (0.0, 9.0)),
    ),
    "capture_radius": 1.0,
}
ZIGZAG = ((-20.0, 10.0), (10.0, 16.0), (5.0, -8.0), (30.0, 30.0))
RANDOM = {**CHASED, **UNLIKE}

Case = Callable[[int, int], Iterator[Any]]
"""A function of the number of threads and a seed that returns all results of an environment."""


def ranges(t: int, count: int) -> np.ndarray:
    """Return varied ranges in m, shape (count, 1); integers, so exact."""
    return ((37 * t + 11 * np.arange(count)) % 61).astype(np.float32)[:, None]


def versioned_ids() -> set[str]:
    """Return the ids of all environments, without those of tasks; each ends with its version."""
    registered = {name for name in gymnasium.registry if name.startswith("flockesc/")}
    registered -= {task.id for task in fe.tasks.values()}
    return registered | {fe.flockesc_v1.FlockParallelEnv.metadata["name"]}


def registered(_: int, seed: int, name: str) -> Iterator[Any]:
    """Play an environment as its id makes it: with arrays, or in 300 slots without single environments."""
    env: Any
    if name == fe.flockesc_v1.FlockParallelEnv.metadata["name"]:
        env = fe.parallel_env()
        reset, act, shape = env.reset_array, env.step_array, (300, 1)
    else:
        env = gymnasium.make_vec(name, num_envs=300) if "Agents" in name else gymnasium.make(name)
        reset, act, shape = env.reset, env.step, env.action_space.shape
    yield reset(seed=seed)
    for t in range(100):
        step = act((ranges(t, math.prod(shape)).reshape(shape) - 30) / 32)
        yield step
        if np.all(step[2]) or np.all(step[3]):
            break


def every_step(scenario: fe.FlockScenario, seed: int, options: dict[str, Any]) -> dict[str, Any]:
    """Return options with an action per step; agents see a predator within the range of their fear."""
    sensing = scenario.drawn(seed).predator_range
    return {"action_mode": "range", **EVERY_STEP, "predator_sensing_range": sensing, **options}


def flock(
    num_threads: int, seed: int, scenario: fe.FlockScenario, episode: int = 0, **options: Any
) -> Iterator[Any]:
    """Play an episode of the schedule of a seed, and begin the next one."""
    given = every_step(scenario, fe.episode_seed(seed, episode), options)
    env = fe.FlockEscapeEnv(scenario, num_threads=num_threads, **given)
    yield env.reset(seed=seed, options={"episode": episode})
    for t in range(2 * scenario.num_steps):
        step = env.step(ranges(t, 1)[0])
        yield step
        if step[2] or step[3]:
            yield next(flock(num_threads, seed, scenario, episode + 1, **options))
            break


def team(num_threads: int, seed: int, scenario: fe.FlockScenario, **options: Any) -> Iterator[Any]:
    env = fe.parallel_env(scenario, num_threads=num_threads, **every_step(scenario, seed, options))
    learned = env.predator_policy_spec.count
    yield env.reset_array(seed=seed)
    for t in range(scenario.num_steps):
        if env.agents:
            controls = ranges(t, learned * scenario.dimension).reshape(-1, scenario.dimension) / 64
            yield env.step_array(ranges(t, scenario.num_agents), controls if learned else None)


def vector(num_threads: int, seed: int, scenario: fe.FlockScenario, mode: str) -> Iterator[Any]:
    options = every_step(scenario, seed, {"num_threads": num_threads, "max_range": 61.0})
    env = BatchVectorEnv(5, scenario, autoreset_mode=mode, **options)
    yield env.reset(seed=seed)
    for t in range(3 * scenario.num_steps):
        yield env.step(ranges(t, 5))


def line(_: int, seed: int, scenario: fe.LineScenario) -> Iterator[Any]:
    env = fe.LineEscapeEnv(scenario, action_mode="range")
    yield env.reset(seed=seed)
    for t in range(scenario.max_steps):
        step = env.step(ranges(t, 1)[0] / 256)
        yield step
        if step[2] or step[3]:
            break


def run(num_threads: int, seed: int, scenario: fe.FlockScenario, rho: float) -> Iterator[Any]:
    start = {}
    if scenario.periodic_side is not None:  # a start that is wider than the box
        wide = scenario.replace(periodic_side=None, initial_side=100.0, num_steps=1)
        start["initial_positions"] = fe.simulate(wide, rho, seed=seed).positions[0]
    trajectory = fe.simulate(scenario, rho, seed=seed, num_threads=num_threads, **start)
    yield [trajectory.positions, trajectory.velocities, trajectory.num_components]


def cases() -> dict[str, Case]:
    found: dict[str, Case] = {name: partial(registered, name=name) for name in sorted(versioned_ids())}
    for name, known in fe.PRESETS.items():
        scenario = known.scenario
        if isinstance(scenario, fe.LineScenario):
            found[name] = partial(line, scenario=scenario)
        elif scenario.predators:
            found[name] = partial(flock, scenario=scenario, count_components=True)
        if name in TEAM:
            options = {"reward": "individual_distance_change", "steps_per_action": 8}
            found[f"{name}, an action per agent"] = partial(team, scenario=scenario, **options)
    straight, path = (ConstantVelocity((-30.0, -30.0), (10.0, 10.0)), PrescribedPath(ZIGZAG, interval=0.3))
    for dimension in (2, 3):
        small = small_flock(dimension, num_steps=40, **RANDOM)
        large = {"num_agents": 6000, "num_steps": 12, "initial_side": 500.0, "predators": (straight,)}
        sides = {"periodic_side": 60.0, "initial_side": 60.0}
        torus = fe.FlockScenario(dimension=dimension, num_steps=40, predators=(), **sides)
        learned = small.with_learned_predators()
        on_path = small_flock(dimension, num_steps=40, predators=(path,))
        found |= {
            f"unlike agents, {dimension}D": partial(flock, scenario=small, steps_per_action=3),
            f"difference reward, {dimension}D": partial(
                team, scenario=small, reward="difference", steps_per_action=4
            ),
            f"learned predators, {dimension}D": partial(team, scenario=learned),
            f"a chase, {dimension}D": partial(flock, scenario=learned, predator_policy=Pursue()),
            f"a large flock, {dimension}D": partial(flock, scenario=small_flock(dimension, **large)),
            f"a prescribed path, {dimension}D": partial(flock, scenario=on_path),
            f"a torus, {dimension}D": partial(run, scenario=torus, rho=9.0),
        }
    chased = small_flock(num_steps=25, **CHASED)
    for mode in ("NextStep", "SameStep"):
        found[f"vector, {mode}"] = partial(vector, scenario=chased, mode=mode)
    return found


def feed(digest: Any, value: Any) -> None:
    """Add a returned value of any kind to the hash: type, shape and every bit."""
    match value:
        case dict():
            for key in sorted(value.keys() - LATER):
                digest.update(key.encode())
                feed(digest, value[key])
        case list() | tuple():
            for each in value:
                feed(digest, each)
        case np.ndarray() if value.dtype == object:
            feed(digest, value.tolist())
        case np.ndarray() | bool() | int() | float() | None:
            array = np.asarray(np.nan if value is None else value)
            digest.update(f"{array.dtype.str}{array.shape}".encode() + array.tobytes())
        case _:
            raise TypeError(type(value))


def hashed(case: Case, num_threads: int, seed: int = SEED) -> str:
    digest = hashlib.sha256()
    for returned in case(num_threads, seed):
        feed(digest, returned)
    return digest.hexdigest()


def hashes(num_threads: int) -> dict[str, str]:
    return {name: hashed(case, num_threads) for name, case in cases().items()}


def updated(old: dict[str, str], new: dict[str, str]) -> dict[str, str]:
    """Return the hashes to store.

    Raises:
        ValueError: if the bits of an old case changed, but no id has a new version.
    """
    changed = sorted(name for name in old.keys() & new.keys() if old[name] != new[name])
    if changed and not (versioned_ids() & new.keys()) - old.keys():
        raise ValueError(f"bits changed without a new version of an id: {', '.join(changed)}")
    return new


if __name__ == "__main__":
    GOLDEN.write_text(json.dumps(updated(json.loads(GOLDEN.read_text()), hashes(1)), indent=4) + "\n")
