"""Markdown pages from templates."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from flockesc_env.common.stats import Estimate


def render(template: str, **values: Any) -> str:
    """Return a page from a template, whose name is "study/file"."""
    package, _, name = template.partition("/")
    # No text that a user typed gets onto the pages unchecked, so nothing has to be escaped.
    environment = Environment(
        loader=PackageLoader(f"studies.{package}"),
        autoescape=False,  # noqa: S701
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(name).render(values)


def path_from(page: Path, target: Path) -> str:
    """Return the path of a file or folder in links on a page."""
    return Path(os.path.relpath(target.resolve(), page.resolve().parent)).as_posix()


def signed(estimate: Estimate) -> str:
    """Return an estimate with its interval as text, with signs."""
    return f"{estimate:+.2f}"
