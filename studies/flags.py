"""Checks of the commands before heavy imports."""

from __future__ import annotations

from pathlib import Path

from flockesc_env.cli.output import check_folder, check_output
from flockesc_env.common.extras import require
from flockesc_env.jobs import Backend, find_backend

_LIBRARIES = {
    "analysis": ["matplotlib", "scipy", "jinja2", "markdown"],
    "train": ["matplotlib", "polars", "rliable", "jinja2", "cmaes"],
}


def prepare(
    folder: Path | None,
    extra: str,
    *,
    page: Path | None = None,
    backend: str = "serial",
    field: str = "output",
) -> Backend:
    """Check that files can be written and libraries are installed; return the back end."""
    found = find_backend(backend)
    check_output(page, [".md"], field="page")
    if folder is not None:
        check_folder(folder, field)
    require(extra, _LIBRARIES[extra])
    return found
