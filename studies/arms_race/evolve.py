"""Training of predators and flock policies with CMA-ES, as jobs."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from cmaes import CMA

from flockesc_env import FlockScenario, NamedPolicy, NetworkPolicy, rollout
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.splits import TUNING, first_seeds, training_seeds
from flockesc_env.jobs import Arrays, Job
from studies.arms_race.players import Flock, Predator
from studies.arms_race.predators import SIZE, LeadPursuit, NetworkPredator
from training.cma import growing, maximize
from training.families import Population

Play = Callable[[FloatArray, range], FloatArray]
"""Takes vectors, shape (k, size), and flocks; returns the value to maximize, shape (k, flocks)."""

SCENARIO: Final = FlockScenario().with_learned_predators()

STEPS_PER_ACTION: Final = 4
"""Model steps per action of flock policies whose options do not say it."""

BATCH: Final = 32
"""Flocks that are stepped together."""

_EPISODE: Final = 5e-3
"""Estimated seconds of an episode."""


@dataclass(frozen=True)
class Budget:
    """The size of one training run.

    The number of flocks per vector grows geometrically from the first generation to the last. The steps are
    initial standard deviations of parameters. The distribution's mean is measured on tuning flocks after
    every ``check_every`` generations.
    """

    population: int = 16
    generations: int = 36
    flocks: int = 4
    final_flocks: int = 10
    predator_step: float = 0.5
    flock_step: float = 0.15
    check_every: int = 12
    tuning_flocks: int = 60

    @property
    def episodes(self) -> int:
        """Number of episodes, measurements included."""
        measurements = 1 + self.generations // self.check_every
        played = sum(self.flocks_at(generation) for generation in range(self.generations))
        return self.population * played + measurements * self.tuning_flocks

    def flocks_at(self, generation: int) -> int:
        """Return the number of flocks per vector in a generation."""
        return growing(self.flocks, self.final_flocks, generation / self.generations)


def train_job(kind: str, flock: Flock, predator: Predator, budget: Budget, seed: int) -> Job:
    """Return the job that trains a ``"predator"`` or a ``"flock"`` policy against the other."""
    call = f"{__name__}:train_{kind}"
    return Job(call, (flock, predator, budget, seed), budget.episodes * _EPISODE)


def play_job(flock: Flock, predator: Predator, flocks: range) -> Job:
    """Return the job that plays a flock policy against a predator."""
    return Job(f"{__name__}:play", (flock, predator, flocks), len(flocks) * _EPISODE)


def play(flock: Flock, predator: Predator, flocks: range) -> Arrays:
    """Return J_mean of every flock."""
    return {"objective": _objective(flock.entry(), predator.policy(SCENARIO), list(flocks), BATCH)}


def train_predator(flock: Flock, start: Predator, budget: Budget, seed: int) -> Arrays:
    """Train a predator that minimizes J_mean of a flock policy; see ``evolve`` for the results."""
    entry, origin = flock.entry(), np.array(start.parameters or (0.0,) * SIZE)
    base = LeadPursuit(SCENARIO, start.lead)

    def value(vectors: FloatArray, flocks: range) -> FloatArray:
        predators: Any = Population([NetworkPredator(origin + vector, base) for vector in vectors])  # type: ignore[misc]
        rows = list(flocks) * len(vectors)
        return -_objective(entry, predators, rows, len(rows)).reshape(len(vectors), -1)

    results = evolve(in_groups(value), len(origin), budget.predator_step, budget, seed)
    return {**results, "parameters": origin + results["parameters"], "curve": -results["curve"]}


def train_flock(start: Flock, predator: Predator, budget: Budget, seed: int) -> Arrays:
    """Train a network that maximizes J_mean against a predator; see ``evolve`` for the results."""
    entry, origin = start.entry(), start.vector()
    architecture = entry.policy.architecture  # type: ignore[attr-defined]

    def value(vectors: FloatArray, flocks: range) -> FloatArray:
        policies = Population([NetworkPolicy(architecture, origin + vector) for vector in vectors])
        rows = list(flocks) * len(vectors)
        changed = dataclasses.replace(entry, policy=policies)
        return _objective(changed, predator.policy(SCENARIO), rows, len(rows)).reshape(len(vectors), -1)

    results = evolve(in_groups(value), len(origin), budget.flock_step, budget, seed)
    return {**results, "parameters": origin + results["parameters"]}


def in_groups(value: Play) -> Play:
    """Return a function that plays vectors in groups of ``BATCH`` flocks: larger batches leave the cache."""

    def grouped(vectors: FloatArray, flocks: range) -> FloatArray:
        size = max(1, BATCH // len(flocks))
        groups = np.split(vectors, range(size, len(vectors), size))
        return np.concatenate([value(group, flocks) for group in groups])

    return grouped


def evolve(value: Play, size: int, step_size: float, budget: Budget, seed: int) -> Arrays:
    """Maximize a value with CMA-ES from the vector 0.

    The vector 0 and the mean of the distribution after every ``check_every`` generations play the tuning
    flocks; the best of them is returned.

    Returns:
        ``parameters``, shape (size,); ``curve``, mean value at every measurement; ``minutes`` of processor
        time; ``episodes``.
    """
    begun = time.process_time()
    optimizer = CMA(np.zeros(size), step_size, population_size=budget.population, seed=seed)
    tuning = first_seeds(TUNING, budget.tuning_flocks)
    means = [np.zeros(size)]
    curve = [value(means[0][np.newaxis], tuning).mean()]
    played = 0
    for generation in range(budget.generations):
        flocks = training_seeds(seed, played, budget.flocks_at(generation))
        maximize(optimizer, value, flocks)
        played += len(flocks)
        if (generation + 1) % budget.check_every == 0:
            means.append(optimizer.mean.copy())
            curve.append(value(means[-1][np.newaxis], tuning).mean())
    return {
        "parameters": means[int(np.argmax(curve))],
        "curve": np.array(curve),
        "minutes": np.array((time.process_time() - begun) / 60),
        "episodes": np.array(budget.population * played + len(curve) * len(tuning)),
    }


def steps_per_action(entry: NamedPolicy) -> int:
    """Return the number of model steps per action of a flock policy and of the predator."""
    return int(entry.options.get("steps_per_action", STEPS_PER_ACTION))


def _objective(entry: NamedPolicy, predator: Any, seeds: list[int], batch_size: int) -> FloatArray:
    """Return J_mean in m, shape (seeds,)."""
    episodes = rollout(
        SCENARIO,
        entry,
        seeds,
        batch_size=batch_size,
        num_threads=1,
        predator_policy=predator,
        steps_per_action=steps_per_action(entry),
    )
    return episodes.min_mean_distance
