"""Families of policies for the search: networks of one architecture, or rules with free parameters."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from flockesc_env import InputError, NetworkPolicy, Policy
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.predators import reset_policy
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies import (
    Architecture,
    FixedRange,
    ListenWhileFleeing,
    ListenWhileThreatened,
    StubbornLeaders,
    StubbornWitnesses,
    WinStayLoseShift,
)
from flockesc_env.policies.registry import NAMES, Rule
from flockesc_env.policies.rollout import play_networks
from flockesc_env.policies.rules import BestNextHeading
from flockesc_env.taskset import Task
from training.run import Run

_Number = tuple[float, float, Literal["cosine", "share", "range", "other"]]

_SHIFTS: tuple[_Number, ...] = (
    (10.0, 3.0, "range"),
    (50.0, 10.0, "range"),
    (0.85, 0.1, "share"),  # a cosine
    (0.1, 0.2, "other"),
    (5.0, 1.0, "other"),
)

RULES: dict[str, tuple[Callable[..., Rule], tuple[_Number, ...]]] = {
    "stubborn-leaders": (StubbornLeaders, ((0.8, 0.2, "cosine"), (10.0, 4.0, "range"))),
    "listen-while-fleeing": (ListenWhileFleeing, ((0.05, 0.1, "cosine"), (20.0, 8.0, "range"))),
    "head-away": (BestNextHeading, ((0.5, 0.5, "other"),)),
    "stubborn-witnesses": (
        partial(StubbornWitnesses, crowding=3.5, agreement=6.0),
        (
            (0.085, 0.015, "share"),
            (55.0, 8.0, "range"),
            (8.0, 3.0, "range"),
            (100.0, 30.0, "other"),
            (5.0, 1.5, "other"),
        ),
    ),
    "listen-while-threatened": (
        ListenWhileThreatened,
        ((150.0, 30.0, "range"), (20.0, 10.0, "range"), (25.0, 10.0, "other")),
    ),
    "win-stay-lose-shift": (
        WinStayLoseShift,
        ((10.0, 3.0, "range"), (50.0, 10.0, "range"), (32.0, 3.0, "other")),
    ),
    "win-stay-lose-shift-escape": (partial(WinStayLoseShift, criterion="escape_direction"), _SHIFTS[:4]),
    "win-stay-lose-shift-estimate": (
        partial(WinStayLoseShift, criterion="estimated_escape_direction"),
        _SHIFTS,
    ),
    "win-stay-lose-shift-clockless": (
        partial(WinStayLoseShift, criterion="estimated_encounter"),
        _SHIFTS[:4],
    ),
}
"""Rules by name: the class; of at most five numbers the start, its standard deviation and kind."""

FIXED = "fixed"
"""Name of the rule that is a constant range; its search starts at the task's best fixed range."""


@dataclass(frozen=True)
class Networks:
    """Networks of one architecture, on the task of a run. The search starts at the vector 0."""

    run: Run
    architecture: Architecture

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.architecture.size

    def policy(self, vector: FloatArray) -> NetworkPolicy:
        """Return the network with the parameters ``vector``."""
        return NetworkPolicy(self.architecture, vector)

    def play(self, vectors: FloatArray, seeds: Sequence[int]) -> tuple[FloatArray, int]:
        """Run the networks with the parameters ``vectors``, shape (k, size), on the same flocks in the core.

        Returns:
            The objective, shape (k, seeds), and the number of actions, per agent or per flock.
        """
        task, entry = self.run.task, self.run.setup(self.policy(vectors[0]))
        parameters = np.repeat(vectors.astype(np.float32), len(seeds), axis=0)
        columns = play_networks(entry, parameters, list(seeds) * len(vectors))
        values = columns[task.spec.name].reshape(len(vectors), -1)
        return values, self.run.policy_spec.rows * int(columns["num_actions"].sum())


def rules_of(task: Task) -> list[str]:
    """Return the names of the built-in rules that fit a task."""
    found = []
    for name in NAMES[2:]:  # without fixed and random ranges
        with suppress(InputError):
            task.setup(name)
            found.append(name)
    return found


@dataclass(frozen=True)
class Rules:
    """A rule, ``FIXED`` or a key of ``RULES``, on the task of a run. The vector 0 is its start by hand."""

    run: Run
    name: str

    @property
    def _family(self) -> tuple[Callable[..., Rule], tuple[_Number, ...]]:
        if self.name != FIXED:
            return RULES[self.name]
        best = self.run.task.best_fixed_range
        return FixedRange, ((best, best / 8, "range"),)

    @property
    def size(self) -> int:
        """Number of entries of a vector: one per number, and 2 for a single one, as CMA-ES needs."""
        return max(2, len(self._family[1]))

    def policy(self, vector: FloatArray) -> Rule:
        """Return the rule at a distance of ``vector`` standard deviations from the start."""
        make, numbers = self._family
        longest = self.run.options["max_range"]
        bounds = {"cosine": (-1, 1), "share": (0, 1), "range": (0, longest), "other": (0, np.inf)}
        moved = [(start + scale * x, kind) for (start, scale, kind), x in zip(numbers, vector, strict=False)]
        return make(*(np.clip(number, *bounds[kind]) for number, kind in moved))

    def play(self, vectors: FloatArray, seeds: Sequence[int]) -> tuple[FloatArray, int]:
        """Run all rules together, step by step; see ``Networks.play``."""
        population = Population([self.policy(vector) for vector in vectors])
        flocks = list(seeds) * len(vectors)
        values = self.run.objectives(population, flocks, batch_size=len(flocks))
        return values.reshape(len(vectors), -1), population.actions


class Population:
    """A policy that divides the observation rows among several policies, in equal, consecutive parts.

    Attributes:
        actions: number of actions chosen so far, one per row.
    """

    def __init__(self, policies: Sequence[Policy]) -> None:
        self.policies = policies
        self.actions = 0

    def reset(self, rows: NDArray[np.bool]) -> None:
        """Reset every policy for its part of the rows; see ``RowMemory.reset``."""
        for policy, part in zip(self.policies, np.split(rows, len(self.policies)), strict=True):
            reset_policy(policy, part)

    def act(self, observations: NDArray[np.float32], spec: PolicySpec) -> NDArray[Any]:
        """Return the actions of every policy for its part of the rows; see ``Policy.act``."""
        self.actions += len(observations)
        parts = np.split(observations, len(self.policies))
        chosen = [policy.act(part, spec) for policy, part in zip(self.policies, parts, strict=True)]
        return np.concatenate(chosen)
