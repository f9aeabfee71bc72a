"""``python -m studies arms-race``."""

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
    output: Annotated[Path, arg(help="folder of the results")] = Path("results/arms_race"),
    learned: Annotated[Path, arg(help="folder of the studies of learned ranges")] = Path("results/findings"),
    page: Annotated[Path, arg(help="file of the Markdown page")] = Path("docs/arms-race.md"),
    rounds: Annotated[int, arg(help="rounds, in which a flock policy and then a predator is trained")] = 3,
    num_flocks: Annotated[int, arg(help="held-out flocks of the cross-play, at least 2")] = 1000,
    backend: Backend = "processes",
    progress: Progress = False,
) -> Exit:
    """Train predators and flock policies against each other in turns, and play all against all.

    About 40 minutes on one core; interrupted, run it again to continue.

    Example: python -m studies arms-race --backend serial
    """
    as_count(rounds, "rounds")
    as_count(num_flocks, "num_flocks", least=2)
    runs_on = prepare(output, "train", page=page, backend=backend)
    from studies.arms_race.page import ARMS_RACE
    from studies.arms_race.race import RaceOptions

    ARMS_RACE.run(RaceOptions(learned, rounds, num_flocks), output, page, runs_on, progress=progress)
    note(f"saved: {page}")
    return Exit.DONE
