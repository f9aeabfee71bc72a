"""``python -m studies related``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Backend, Progress
from flockesc_env.cli.output import note
from studies.flags import prepare


def run(
    *,
    output: Annotated[Path, arg(help="folder of results")] = Path("results/related"),
    learned: Annotated[Path, arg(help="folder of the studies of learned ranges")] = Path("results/learned"),
    page: Annotated[Path, arg(help="file of the Markdown page")] = Path("docs/related.md"),
    backend: Backend = "processes",
    progress: Progress = False,
) -> Exit:
    """A bandit over fixed ranges, within an episode and across episodes.

    About 12 minutes on one core; interrupted, run it again to continue.

    Example: python -m studies related --backend serial
    """
    runs_on = prepare(output, "train", page=page, backend=backend)
    from studies.related.survey import RELATED

    RELATED.run(learned, output, page, runs_on, progress=progress)
    note(f"saved: {page}")
    return Exit.DONE
