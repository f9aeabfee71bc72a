"""``python -m studies robustness``."""

from __future__ import annotations

import json as json_
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Backend, Json, Progress, optional
from flockesc_env.cli.output import note, show, show_json, table
from flockesc_env.common.checks import as_count
from flockesc_env.common.errors import ArgumentError
from studies.flags import prepare
from studies.robustness.plan import LEAST_FLOCKS, attacked_presets

if TYPE_CHECKING:
    from studies.robustness.page import RobustnessResults


def run(
    *,
    output: Annotated[Path, arg(help="folder of results, figure and page; made if it is missing")] = Path(
        "runs/robustness"
    ),
    num_flocks: Annotated[
        int, arg(help="flocks to choose the best range on, and again as many to measure it on, at least 2")
    ] = 500,
    presets: Annotated[
        tuple[str, ...] | None,
        *optional(
            "which presets or scenario files (.toml, .json)",
            "all flock presets that have predators",
            metavar="NAME|FILE ..",
        ),
    ] = None,
    page: Annotated[
        Path | None, *optional("file of the Markdown page", "robustness.md in the output folder")
    ] = None,
    backend: Backend = "processes",
    progress: Progress = False,
    json: Json = False,
) -> Exit:
    """Find the best fixed range in every preset: does the paper's finding survive?

    Writes robustness.md, robustness.png and robustness.svg, results.json.

    About 35 minutes on two cores; interrupted, run it again to continue.

    Example: python -m studies robustness --num-flocks 50 --presets paper-flock pursuit
    """
    if as_count(num_flocks, "num_flocks") < LEAST_FLOCKS:
        raise ArgumentError("num_flocks", f"at least {LEAST_FLOCKS}", num_flocks)
    attacked_presets(presets)  # refuses unknown ones before heavy imports
    runs_on = prepare(output, "analysis", page=page, backend=backend)
    from studies.robustness.survey import ROBUSTNESS, SurveyOptions  # heavy, and of an extra

    page = page or output / "robustness.md"
    results = ROBUSTNESS.run(SurveyOptions(num_flocks, presets), output, page, runs_on, progress=progress)
    note(f"saved: {page}")
    if json:
        show_json({"command": "robustness", "output": str(output), "results": json_.loads(results.to_json())})
    else:
        _show(results)
    return Exit.DONE


def _show(results: RobustnessResults) -> None:
    rows = [
        [
            row.name,
            f"{outcome.best.mean:g} {row.grid.unit}",
            f"[{outcome.best.low:g}, {outcome.best.high:g}]",
            str(outcome.min_mean_distance),
            str(outcome.gain_over_zero),
            str(outcome.gain_over_longest),
            outcome.finding,
        ]
        for row in results.presets
        for outcome in [row.outcomes["J_mean"]]
    ]
    gains = ["over 0 (m)", "over the longest (m)"]
    show(*table(["preset", "best range", "95 %", "J_mean (m)", *gains, "best range is"], rows))
