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
from flockesc_env.jobs import Arrays, Job
from studies.arms_race.players import Flock, Predator
from studies.arms_race.predators import SIZE, LeadPursuit, NetworkPredator
from training.families import Population
from training.seeds import TUNING, first_seeds, training_seeds

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

    Attributes:
        population: number of vectors per generation.
        generations: number of generations.
        flocks: number of flocks per vector in the first generation.
        final_flocks: number of flocks per vector in the last generation; it grows geometrically.
        predator_step: initial standard deviation of a predator's parameters.
        flock_step: initial standard deviation of a flock policy's parameters.
        check_every: number of generations between measurements of the distribution's mean on tuning flocks.
        tuning_flocks: number of tuning flocks of a measurement.
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
        growth = self.final_flocks / self.flocks
        return round(self.flocks * float(growth ** (generation / self.generations)))


def predator_job(flock: Flock, start: Predator, budget: Budget, seed: int) -> Job:
    """Return the job that trains a predator, from ``start``, against a flock policy."""
    arguments = (flock, start, budget, seed)
    return Job("studies.arms_race.evolve:train_predator", arguments, budget.episodes * _EPISODE)


def flock_job(start: Flock, predator: Predator, budget: Budget, seed: int) -> Job:
    """Return the job that trains a flock policy, from the parameters of ``start``, against a predator."""
    return Job(
        "studies.arms_race.evolve:train_flock", (start, predator, budget, seed), budget.episodes * _EPISODE
    )


def play_job(flock: Flock, predator: Predator, flocks: range) -> Job:
    """Return the job that plays a flock policy against a predator."""
    return Job("studies.arms_race.evolve:play", (flock, predator, flocks), len(flocks) * _EPISODE)


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

    Args:
        value: plays vectors; see ``Play``.
        size: number of parameters.
        step_size: initial standard deviation of the parameters.
        budget: size of the run.
        seed: seed of the optimizer and of the training flocks.

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
        count = budget.flocks_at(generation)
        vectors = np.array([optimizer.ask() for _ in range(budget.population)])
        fitness = value(vectors, training_seeds(seed, played, count)).mean(axis=1)
        optimizer.tell(list(zip(vectors, -fitness, strict=True)))  # cmaes minimizes
        played += count
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
