"""The page of the arms race, made from its stored results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flockesc_env.common.files import write_text
from studies.arms_race.figure import cross_play_figure, label
from studies.arms_race.race import UNTRAINED
from studies.arms_race.results import RaceResults, load_race
from studies.pages import path_from, signed, templates
from training.figure_style import save_figure

FIGURE = "cross_play"


def write_race_page(output: Path, page: Path) -> None:
    """Write the figure and the page from the results in a folder."""
    results = load_race(output)
    save_figure(cross_play_figure(results), output / FIGURE, ("png",))
    page.parent.mkdir(parents=True, exist_ok=True)
    write_text(page, markdown_page(results, output, page))


def markdown_page(results: RaceResults, figures: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the picture in the folder ``figures``."""
    folder = path_from(page, figures)
    trainings = _trainings(results)
    rendered: str = (
        templates("studies.arms_race")
        .get_template("arms_race.md")
        .render(
            results=results,
            record=results.record,
            trainings=trainings,
            num_trainings=len(trainings),
            measurements=results.trainings["measurement"].n_unique(),
            minutes=sum(row["minutes"] for row in trainings),
            picture=f"{folder}/{FIGURE}.png",
            label=label,
            difference=signed,
            gained=list(UNTRAINED),
            least_loss=min(results.flocks, key=lambda flock: results.loss(flock).mean),
            largest=max(results.flocks, key=lambda flock: results.own(flock).mean),
        )
    )
    return rendered


def _trainings(results: RaceResults) -> list[dict[str, Any]]:
    """Return a row per training run: its name, first and best objective and minutes."""
    rows = []
    for (kind, name), run in results.trainings.group_by("kind", "name", maintain_order=True):
        values = run.sort("measurement")["objective"]
        best = values.min() if kind == "predator" else values.max()
        trained = f"predator {label(str(name))}" if kind == "predator" else f"flock policy {name}"
        rows.append({"name": trained, "first": values[0], "best": best, "minutes": run["minutes"][0]})
    return rows
