"""The page of the arms race, made from its stored results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flockesc_env.common.stats import Estimate
from studies.arms_race.figure import cross_play_figure, label
from studies.arms_race.players import MOST_PARAMETERS
from studies.arms_race.predators import WIDTHS
from studies.arms_race.race import UNTRAINED, arms_race
from studies.arms_race.results import RaceResults, load_race
from studies.pages import compared, path_from, render, signed
from studies.study import Study

FIGURE = "cross_play"


def markdown_page(results: RaceResults, figures: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the picture in the folder ``figures``."""
    folder = path_from(page, figures)
    trainings, distinct = _trainings(results), results.distinct
    return render(
        "arms_race/arms_race.md",
        results=results,
        record=results.record,
        trainings=trainings,
        num_trainings=len(trainings),
        unchanged=sum(row["first"] == row["best"] for row in trainings),
        measurements=results.trainings["measurement"].n_unique(),
        minutes=sum(row["minutes"] for row in trainings),
        picture=f"{folder}/{FIGURE}.png",
        label=label,
        difference=signed,
        untrained=list(UNTRAINED),
        tracks={track: _track(results, track) for track in results.record["tracks"]},
        distinct=distinct,
        repeated=[flock for flock in results.flocks if flock not in distinct],
        by_loss=sorted(distinct, key=lambda flock: results.loss_to_worst(flock).mean),
        by_straight=sorted(distinct, key=lambda flock: -results.cells[flock, "straight"].mean),
        by_objective=sorted(distinct, key=lambda flock: -results.worst(flock)[1].mean),
        lead_gains=grouped(distinct, results.gain_of_lead),
        training_gains=grouped(distinct, results.gain_of_training),
        nearest_gains=grouped(distinct, results.gain_of_nearest),
        not_worst=[flock for flock in distinct if results.worst(flock)[1].mean < results.own(flock).mean],
        most_parameters=MOST_PARAMETERS,
        hidden=WIDTHS[1],
    )


@dataclass(frozen=True)
class Changes:
    """Paired differences of some players: names by their intervals, and the largest and the smallest one."""

    larger: tuple[str, ...]
    smaller: tuple[str, ...]
    neither: tuple[str, ...]
    most: tuple[str, Estimate]
    least: tuple[str, Estimate]


def grouped(names: Sequence[str], change: Callable[[str], Estimate]) -> Changes:
    """Return the differences of some players, grouped; ``change`` returns that of a player."""
    found = {name: change(name) for name in names}
    ordered = sorted(found.items(), key=lambda pair: pair[1].mean)
    larger, smaller, neither = (
        tuple(name for name, estimate in found.items() if compared(estimate) == word)
        for word in ("larger", "smaller", "not measurably different")
    )
    return Changes(larger, smaller, neither, most=ordered[-1], least=ordered[0])


def _track(results: RaceResults, track: str) -> Changes:
    """Return what training in turns changes, against the predators without training and the track's first."""
    predators = [*UNTRAINED, track]
    return grouped(predators, lambda predator: results.gain_in_turns(track, predator))


def _trainings(results: RaceResults) -> list[dict[str, Any]]:
    """Return a row per training run: its name, first and best objective and minutes."""
    rows = []
    for (kind, name), run in results.trainings.group_by("kind", "name", maintain_order=True):
        values = run.sort("measurement")["objective"]
        best = values.min() if kind == "predator" else values.max()
        trained = f"predator {label(str(name))}" if kind == "predator" else f"flock policy {name}"
        rows.append({"name": trained, "first": values[0], "best": best, "minutes": run["minutes"][0]})
    return rows


ARMS_RACE = Study(
    measure=arms_race,
    load=load_race,
    figures=lambda results: {FIGURE: cross_play_figure(results)},
    pages=lambda results, output, page: {page: markdown_page(results, output, page)},
)
