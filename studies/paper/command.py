"""``python -m studies paper``."""

from __future__ import annotations

import json as json_
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Backend, Json, Progress, optional
from flockesc_env.cli.output import note, show, show_json
from studies.flags import prepare
from studies.paper.plan import BATCH, LEAST_FLOCKS, Trials

if TYPE_CHECKING:
    from studies.paper.page import PaperResults


def run(
    *,
    output: Annotated[Path, arg(help="folder of results, figures and page; made if it is missing")] = Path(
        "runs/paper"
    ),
    flocks: Annotated[int, arg(help=f"flocks per range, at least {LEAST_FLOCKS}")] = Trials.flocks,
    lines: Annotated[int, arg(help=f"lines per range, at least {BATCH}")] = Trials.lines,
    figures: Annotated[
        tuple[str, ...],
        arg(
            help="write only these figures, 2 to 10, edge, force or anatomy, and measure only what they show",
            metavar="[NUMBER ..]",
            help_behavior_hint="(default: all, and the page)",
        ),
    ] = (),
    page: Annotated[
        Path | None, *optional("file of the Markdown page", "paper.md in the output folder")
    ] = None,
    backend: Backend = "processes",
    progress: Progress = False,
    json: Json = False,
) -> Exit:
    """Set the paper's claims and figures beside what this package measures.

    Writes paper.html (self-contained), paper.md, figures (PNG, SVG), results.json.

    Takes about a quarter of an hour on two cores; interrupted, run it again to continue.

    Example: python -m studies paper --output runs/paper --figures 5 9
    """
    trials = Trials(flocks=flocks, lines=lines)
    runs_on = prepare(output, "analysis", page=page, backend=backend)
    from studies.paper.figures import measure_and_draw  # heavy, and of an extra
    from studies.paper.reproduction import PAPER

    if figures:
        for file in measure_and_draw(output, figures, trials, runs_on, progress=progress):
            note(f"saved: {file}")
        return Exit.DONE
    results = PAPER.run(trials, output, page or output / "paper.md", runs_on, progress=progress)
    note(f"saved: {output / 'paper.html'}")
    if json:
        show_json({"command": "paper", "output": str(output), **json_.loads(results.to_json())})
    else:
        _show(results)
    return Exit.DONE


def _show(results: PaperResults) -> None:
    for claim in results.claims:
        show(f"{claim.where}: {claim.claim}")
        show(f"    {claim.judgment.verdict}: {claim.measured[0]}")
    counts = Counter(claim.judgment.verdict for claim in results.claims)
    show("; ".join(f"{verdict}: {number}" for verdict, number in counts.items()))
