"""``python -m studies related``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Backend, Progress
from flockesc_env.cli.output import note
from flockesc_env.common.checks import as_count
from studies.flags import prepare


def run(
    *,
    output: Annotated[Path, arg(help="folder of results and figure")] = Path("results/related"),
    num_flocks: Annotated[
        int, arg(help="held-out flocks per speed of the predator, at least 4; half as many tuning flocks")
    ] = 200,
    learned: Annotated[Path, arg(help="folder of the studies of learned ranges")] = Path("results/learned"),
    page: Annotated[Path, arg(help="file of the Markdown page")] = Path("docs/related.md"),
    backend: Backend = "processes",
    progress: Progress = False,
) -> Exit:
    """A bandit over fixed ranges, and the best topological k against the predator's speed.

    About 25 minutes on one core; interrupted, run it again to continue.

    Example: python -m studies related --backend serial
    """
    as_count(num_flocks, "num_flocks", least=4)
    runs_on = prepare(output, "train", page=page, backend=backend)
    from studies.related.survey import RELATED, RelatedOptions

    RELATED.run(RelatedOptions(num_flocks, learned), output, page, runs_on, progress=progress)
    note(f"saved: {page}")
    return Exit.DONE
