"""Statistics, figure and report of the arms race, from its stored results."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.render.palette import LIGHT
from studies.arms_race import race
from studies.arms_race.opponents import WIDTHS
from studies.arms_race.race import UNTRAINED
from studies.measurements import sign, values_by
from studies.study import Study, template
from studies.style import subplots

_LABELS = {
    "straight": "straight",
    "nearest": "pursuit of nearest",
    "centroid": "pursuit of centroid",
    "lead": "lead pursuit",
}


@dataclass(frozen=True, eq=False)
class RaceResults:
    """Files of an arms race; ``trainings`` has a row per check of a training run.

    ``objective`` holds J_mean in m by flock policy and predator, shape (flocks,). The rounds of a flock
    policy follow it, also among the predators that were trained against them.
    """

    record: dict[str, Any]
    trainings: pl.DataFrame
    flocks: list[str]
    predators: list[str]
    objective: dict[tuple[str, str], FloatArray]

    @cached_property
    def cells(self) -> dict[tuple[str, str], Estimate]:
        """The mean of ``objective``."""
        return {pair: stats.mean(values) for pair, values in self.objective.items()}

    def distinct(self) -> list[str]:
        """Return the flock policies that differ from all earlier ones: training may keep its start."""
        first = {self.objective[flock, "straight"].tobytes(): flock for flock in reversed(self.flocks)}
        return [flock for flock in self.flocks if flock in first.values()]

    def worst(self, flock: str) -> str:
        """Return the predator with the smallest mean J_mean against a policy."""
        return min(self.predators, key=lambda predator: self.cells[flock, predator].mean)

    def loss(self, flock: str, predator: str, other: str) -> Estimate:
        """Return by how much J_mean is smaller against the second predator than against the first."""
        return stats.mean(self.objective[flock, predator] - self.objective[flock, other])

    def losses(self, predator: str, other: str = "") -> dict[str, Any]:
        """Return ``grouped`` losses of distinct policies to the second predator, or to their own ones."""
        return grouped({flock: self.loss(flock, predator, other or flock) for flock in self.distinct()})

    def excess(self, flock: str, other: str) -> Estimate:
        """Return the difference of what two flock policies lose to their worst predators."""
        values = self.objective
        loss = values[flock, "straight"] - values[flock, self.worst(flock)]
        other_loss = values[other, "straight"] - values[other, self.worst(other)]
        return stats.mean(loss - other_loss)

    def in_turns(self, track: str) -> dict[str, Estimate]:
        """Return by how much J_mean of the last round exceeds that before the first, by predator."""
        last = f"{track}, round {self.record['rounds']}"
        return {
            predator: stats.mean(self.objective[last, predator] - self.objective[track, predator])
            for predator in (*UNTRAINED, track)
        }


def load_race(folder: Path) -> RaceResults:
    """Read the results of an arms race."""
    objective = values_by(pl.read_parquet(folder / "cross_play.parquet"), "flock_policy", "predator")
    return RaceResults(
        record=json.loads((folder / "arms_race.json").read_text("utf-8")),
        trainings=pl.read_parquet(folder / "trainings.parquet"),
        flocks=_with_rounds([flock for flock, _ in objective]),
        predators=_with_rounds([predator for _, predator in objective]),
        objective=objective,
    )


def _with_rounds(names: list[str]) -> list[str]:
    """Return different names in their order, the rounds of each right behind it."""
    different = [*dict.fromkeys(names)]
    return sorted(different, key=lambda name: different.index(name.split(", round")[0]))


def label(predator: str) -> str:
    """Return the name of a predator in tables and figures."""
    return _LABELS.get(predator, f"vs {predator}")


def cross_play_figure(results: RaceResults) -> Figure:
    """Draw the table of means; a frame marks the predator that was trained against the policy."""
    rows, columns = results.flocks, results.predators
    means = np.array([[results.cells[flock, predator].mean for predator in columns] for flock in rows])
    changes = means - means[:, [columns.index("straight")]]
    largest = np.abs(changes).max()
    colors = LinearSegmentedColormap.from_list("distance", (LIGHT.predator, LIGHT.page, LIGHT.accent))
    figure, axes = subplots(0.34 * (len(rows) + 5.5))
    axes.imshow(changes, cmap=colors, vmin=-largest, vmax=largest, aspect="auto", alpha=0.75)
    for (row, column), mean in np.ndenumerate(means):
        text = axes.text(column, row, f"{mean:.1f}", ha="center", va="center")
        if rows[row] == columns[column]:
            text.set_fontweight("bold")
            corner = (column - 0.48, row - 0.46)
            axes.add_patch(Rectangle(corner, 0.96, 0.92, fill=False, ec=LIGHT.ink, lw=1.4))
    names = [label(name) for name in columns]
    axes.set_xticks(range(len(columns)), names, rotation=35, ha="left", rotation_mode="anchor")
    axes.set_yticks(range(len(rows)), rows)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set(xlabel="J_mean (m); color: minus straight flight; frame: trained against the policy of the row")
    axes.set_ylabel("flock policy")
    axes.annotate(
        "predator", (0, 1), (0, 8), ha="right", xycoords="axes fraction", textcoords="offset points"
    )
    axes.xaxis.set_label_position("bottom")
    return figure


def report(results: RaceResults) -> str:
    """Return the report as Markdown."""
    distinct = results.distinct()
    worst = {flock: results.cells[flock, results.worst(flock)] for flock in results.flocks}
    losses = {flock: results.loss(flock, "straight", results.worst(flock)) for flock in results.flocks}
    return template("arms_race/templates/arms_race.md", globals()).render(
        results=results,
        hidden=WIDTHS[1],
        trainings=_training_rows(results.trainings),
        worst=worst,
        losses=losses,
        distinct=distinct,
        by_loss=sorted(distinct, key=lambda flock: losses[flock].mean),
        by_straight=sorted(distinct, key=lambda flock: -results.cells[flock, "straight"].mean),
        by_objective=sorted(distinct, key=lambda flock: -worst[flock].mean),
        not_worst=[flock for flock in distinct if worst[flock].mean < results.cells[flock, flock].mean],
    )


def _training_rows(trainings: pl.DataFrame) -> list[dict[str, Any]]:
    """Return a row per training run: J_mean in m of its start and of its best check."""
    rows = []
    for (kind, name), run in trainings.group_by("kind", "name", maintain_order=True):
        curve = run.sort("measurement")["objective"]
        is_predator = kind == "predator"
        best = curve.min() if is_predator else curve.max()
        rows.append(
            {
                "name": f"predator {label(str(name))}" if is_predator else f"flock policy {name}",
                "first": curve[0],
                "best": best,
                "minutes": run["minutes"][0],
                "is_unchanged": curve[0] == best,
            }
        )
    return rows


def grouped(changes: Mapping[str, Estimate]) -> dict[str, Any]:
    """Return the names of changes by their sign, and the largest and the smallest change with its name."""
    ordered = sorted(changes.items(), key=lambda pair: pair[1].mean)
    return {
        "larger": [name for name, change in changes.items() if sign(change) > 0],
        "smaller": [name for name, change in changes.items() if sign(change) < 0],
        "neither": [name for name, change in changes.items() if sign(change) == 0],
        "most": ordered[-1],
        "least": ordered[0],
    }


ARMS_RACE = Study(
    measure=race.measure,
    load=load_race,
    figures=lambda results: {"cross_play": cross_play_figure(results)},
    report=report,
)
