"""The commands ``python -m studies findings`` and ``findings-page``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from flockesc_env.cli.flags import Backend, Progress
from flockesc_env.cli.output import Exit, note
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require
from studies.flags import prepare

Output = Annotated[Path, arg(help="folder of results and figures")]
Page = Annotated[Path, arg(help="file of the Markdown page")]
RESULTS, PAGE = Path("results/findings"), Path("docs/findings.md")


def run(
    *,
    output: Output = RESULTS,
    scale: Annotated[float, arg(help="share of the flocks that play")] = 1.0,
    page: Page = PAGE,
    backend: Backend = "processes",
    progress: Progress = False,
) -> Exit:
    """Choose the best trained policy of each task, and measure how it works and where it loses.

    Interrupted, run it again to continue.

    Example: python -m studies findings --scale 0.1
    """
    if not 0 < scale <= 1:
        raise InputError("scale", "a number in (0, 1]", scale)
    runs_on = prepare(output, "train", page=page, backend=backend)
    require("video", ["pygame", "imageio_ffmpeg"])
    from studies.findings.page import FINDINGS

    FINDINGS.run(scale, output, page, runs_on, progress=progress)
    note(f"saved: {page}")
    return Exit.DONE


def page(*, output: Output = RESULTS, page: Page = PAGE) -> Exit:
    """Write the page and its figures from the results.

    Example: python -m studies findings-page
    """
    prepare(None, "train", page=page)
    from studies.findings.page import FINDINGS

    FINDINGS.write(output, page)
    note(f"saved: {page}")
    return Exit.DONE
