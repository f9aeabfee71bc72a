"""Stored results of the arms race, and the statistics of the cross-play."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from studies.arms_race.race import CROSS_PLAY_FILE, RECORD_FILE, TRAININGS_FILE
from studies.tables import values_by


@dataclass(frozen=True, eq=False)
class RaceResults:
    """Files of an arms race.

    ``objective`` holds J_mean in m by flock policy and predator, each of shape (flocks,), and ``cells`` its
    mean. ``trainings`` has a row per measurement of a training run.
    """

    record: dict[str, Any]
    trainings: pl.DataFrame
    flocks: tuple[str, ...]
    predators: tuple[str, ...]
    objective: dict[tuple[str, str], FloatArray]
    cells: dict[tuple[str, str], Estimate]

    def own(self, flock: str) -> Estimate:
        """Return J_mean against the predator that was trained against the policy."""
        return self.cells[flock, flock]

    def worst(self, flock: str) -> tuple[str, Estimate]:
        """Return the predator with the smallest mean J_mean against a policy, and that mean."""
        found = min(self.predators, key=lambda predator: self.cells[flock, predator].mean)
        return found, self.cells[flock, found]

    def loss(self, flock: str) -> Estimate:
        """Return how much smaller J_mean is against the policy's own predator than in straight flight."""
        return self._drop(flock, "straight", flock)

    def gain_of_training(self, flock: str) -> Estimate:
        """Return how much smaller J_mean is against its own predator than against lead pursuit."""
        return self._drop(flock, "lead", flock)

    def gain_of_lead(self, flock: str) -> Estimate:
        """Return how much smaller J_mean is against lead pursuit than against pursuit of the centroid."""
        return self._drop(flock, "centroid", "lead")

    def gain_of_nearest(self, flock: str) -> Estimate:
        """Return how much smaller J_mean is against pursuit of the nearest agent than in straight flight."""
        return self._drop(flock, "straight", "nearest")

    def loss_to_worst(self, flock: str) -> Estimate:
        """Return how much smaller J_mean is against the worst predator than in straight flight."""
        return self._drop(flock, "straight", self.worst(flock)[0])

    def excess_loss(self, flock: str, other: str) -> Estimate:
        """Return the paired difference of two flock policies' losses to their worst predators."""
        losses = [
            self.objective[each, "straight"] - self.objective[each, self.worst(each)[0]]
            for each in (flock, other)
        ]
        return stats.mean(losses[0] - losses[1])

    def _drop(self, flock: str, predator: str, other: str) -> Estimate:
        return stats.mean(self.objective[flock, predator] - self.objective[flock, other])

    @property
    def distinct(self) -> tuple[str, ...]:
        """Names of the flock policies that differ from all earlier ones: training may keep its start."""
        first = {self.objective[flock, "straight"].tobytes(): flock for flock in reversed(self.flocks)}
        return tuple(flock for flock in self.flocks if flock in first.values())

    def gain_in_turns(self, track: str, predator: str) -> Estimate:
        """Return how much larger J_mean is after the last round than before the first, against a predator."""
        last = f"{track}, round {self.record['rounds']}"
        return stats.mean(self.objective[last, predator] - self.objective[track, predator])


def load_race(folder: Path) -> RaceResults:
    """Read the results of an arms race."""
    table = pl.read_parquet(folder / CROSS_PLAY_FILE)
    objective = values_by(table, "flock_policy", "predator")
    return RaceResults(
        record=json.loads((folder / RECORD_FILE).read_text("utf-8")),
        trainings=pl.read_parquet(folder / TRAININGS_FILE),
        flocks=_by_track(table["flock_policy"]),
        predators=_by_track(table["predator"]),
        objective=objective,
        cells={pair: stats.mean(values) for pair, values in objective.items()},
    )


def _by_track(names: pl.Series) -> tuple[str, ...]:
    """Return the distinct names; the rounds of a flock policy follow it."""
    distinct = names.unique(maintain_order=True).to_list()
    return tuple(sorted(distinct, key=lambda name: distinct.index(name.split(", round")[0])))
