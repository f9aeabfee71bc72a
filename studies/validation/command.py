"""``python -m studies validation``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Backend, Progress, optional
from flockesc_env.cli.output import note
from flockesc_env.common.errors import ArgumentError
from studies.flags import prepare
from studies.validation.results import PARTS


def run(
    *,
    output: Annotated[Path, arg(help="folder of results and figures")] = Path("results/validation"),
    only: Annotated[
        tuple[str, ...] | None,
        *optional(
            "measure these results; the others keep their stored ones",
            f"all: {', '.join(PARTS)}",
            metavar="NAME ..",
        ),
    ] = None,
    scale: Annotated[float, arg(help="share of the flocks that run")] = 1.0,
    page: Annotated[Path, arg(help="file of the Markdown page")] = Path("docs/validation.md"),
    backend: Backend = "processes",
    progress: Progress = False,
) -> Exit:
    """Published results of other models and flocks, measured again with this simulator.

    Interrupted, run it again to continue.

    Example: python -m studies validation --only vicsek --scale 0.1
    """
    chosen = PARTS if only is None else only
    for name in chosen:
        if name not in PARTS:
            raise ArgumentError("only", f"any of {', '.join(PARTS)}", repr(name))
    if not 0 < scale <= 1:
        raise ArgumentError("scale", "a number in (0, 1]", scale)
    runs_on = prepare(output, "analysis", page=page, backend=backend)
    from studies.validation.survey import VALIDATION, ValidationOptions  # heavy, and of an extra

    VALIDATION.run(ValidationOptions(chosen, scale), output, page, runs_on, progress=progress)
    note(f"saved: {page}")
    return Exit.DONE
