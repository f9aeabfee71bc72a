"""Hashes of whole episodes: of the bytes of every observation, reward, end and info.

``python tests/support/golden_episodes.py > tests/golden/golden_episodes.json`` rewrites them after a change
of results that is intended; an optional argument sets the number of threads.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from option_table import UNLIKE, small_flock

from flockesc_env import (
    PRESETS,
    ConstantVelocity,
    FlockEscapeEnv,
    FlockScenario,
    FlockVectorEnv,
    LineEscapeEnv,
    LineScenario,
    PurePursuit,
    Wandering,
    parallel_env,
    simulate,
)
from flockesc_env.policies.predators import Pursue

SEED = 7
TEAM = ("paper-flock", "capture", "randomized", "noisy-hearing", "topological", "space")

CHASED = {
    "predators": (
        Wandering((10.0, 10.0), (5.0, 0.0), angular_diffusion=2.0),
        PurePursuit((30.0, 0.0), (0.0, 9.0)),
    ),
    "capture_radius": 1.0,
}
RANDOM = {**CHASED, **UNLIKE}

Case = Callable[[int, int], Iterator[Any]]
"""A function of the number of threads and a seed that returns all results of an environment."""


def ranges(t: int, count: int) -> np.ndarray:
    """Return varied ranges in m, shape (count, 1); integers, so exact."""
    return ((37 * t + 11 * np.arange(count)) % 61).astype(np.float32)[:, None]


def flock(scenario: FlockScenario, **options: Any) -> Case:
    def play(num_threads: int, seed: int) -> Iterator[Any]:
        env = FlockEscapeEnv(scenario, action_mode="range", num_threads=num_threads, **options)
        yield env.reset(seed=seed)
        for t in range(2 * scenario.num_steps):
            step = env.step(ranges(t, 1)[0])
            yield step
            if step[2] or step[3]:
                yield env.reset()
                break

    return play


def team(scenario: FlockScenario, **options: Any) -> Case:
    def play(num_threads: int, seed: int) -> Iterator[Any]:
        env = parallel_env(scenario, action_mode="range", num_threads=num_threads, **options)
        learned = env.predator_policy_spec.count
        yield env.reset_array(seed=seed)
        for t in range(scenario.num_steps):
            if env.agents:
                controls = ranges(t, learned * scenario.dimension).reshape(-1, scenario.dimension) / 64
                yield env.step_array(ranges(t, scenario.num_agents), controls if learned else None)

    return play


def vector(scenario: FlockScenario, mode: str) -> Case:
    def play(num_threads: int, seed: int) -> Iterator[Any]:
        env = FlockVectorEnv(
            5, scenario, autoreset_mode=mode, num_threads=num_threads, action_mode="range", max_range=61.0
        )
        yield env.reset(seed=seed)
        for t in range(3 * scenario.num_steps):
            yield env.step(ranges(t, 5))

    return play


def line(scenario: LineScenario) -> Case:
    def play(num_threads: int, seed: int) -> Iterator[Any]:
        env = LineEscapeEnv(scenario, action_mode="range")
        yield env.reset(seed=seed)
        for t in range(scenario.max_steps):
            step = env.step(ranges(t, 1)[0] / 256)
            yield step
            if step[2] or step[3]:
                break

    return play


def run(scenario: FlockScenario, rho: float) -> Case:
    def play(num_threads: int, seed: int) -> Iterator[Any]:
        trajectory = simulate(scenario, rho, seed=seed, num_threads=num_threads)
        yield [trajectory.positions, trajectory.velocities, trajectory.num_components]

    return play


def cases() -> dict[str, Case]:
    """Return every case by name."""
    found: dict[str, Case] = {}
    for name, (_, scenario) in PRESETS.items():
        if isinstance(scenario, LineScenario):
            found[name] = line(scenario)
        else:
            found[name] = flock(scenario, count_components=True, max_range=100.0)
        if name in TEAM:
            found[f"{name}, an action per agent"] = team(
                scenario, reward="individual_distance_change", steps_per_action=8, max_range=100.0
            )
    for dimension in (2, 3):
        small = small_flock(dimension, num_steps=40, **RANDOM)
        found |= {
            f"unlike agents, {dimension}D": flock(small, steps_per_action=3),
            f"difference reward, {dimension}D": team(small, reward="difference", steps_per_action=4),
            f"learned predators, {dimension}D": team(small.with_learned_predators()),
            f"a chase, {dimension}D": flock(small.with_learned_predators(), predator_policy=Pursue()),
            f"a large flock, {dimension}D": flock(
                small_flock(
                    dimension,
                    num_agents=6000,
                    num_steps=12,
                    initial_side=500.0,
                    predators=(ConstantVelocity((-30.0, -30.0), (10.0, 10.0)),),
                )
            ),
            f"a torus, {dimension}D": run(
                FlockScenario(dimension=dimension, num_steps=40, predators=(), periodic_side=60.0), 9.0
            ),
        }
    for mode in ("NextStep", "SameStep"):
        found[f"vector, {mode}"] = vector(small_flock(num_steps=25, **CHASED), mode)
    return found


def feed(digest: Any, value: Any) -> None:
    """Add a returned value of any kind to the hash: type, shape and every bit."""
    match value:
        case dict():
            for key in sorted(value):
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
    """Return the hash of an episode."""
    digest = hashlib.sha256()
    for returned in case(num_threads, seed):
        feed(digest, returned)
    return digest.hexdigest()


def hashes(num_threads: int) -> dict[str, str]:
    """Return the hashes of all cases."""
    return {name: hashed(case, num_threads) for name, case in cases().items()}


if __name__ == "__main__":
    json.dump(hashes(int(sys.argv[1]) if len(sys.argv) > 1 else 1), sys.stdout, indent=4)
    print()
