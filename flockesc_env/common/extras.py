"""Checks for optional dependencies, which the extras of the package install."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from gymnasium.error import DependencyNotInstalled

from flockesc_env.common.errors import FlockescError

if TYPE_CHECKING:
    import polars as pl


class MissingExtraError(FlockescError, ImportError, DependencyNotInstalled):
    """An optional dependency is not installed."""


def require(extra: str, modules: Iterable[str]) -> None:
    """Check that top-level modules of an extra are installed, without importing them.

    The ``MissingExtraError`` otherwise contains the pip command that installs the extra.
    """
    for module in modules:
        if find_spec(module) is None:
            command = f'pip install "flockesc-env[{extra}]"'
            raise MissingExtraError(f"{module} is not installed; run `{command}`")


@contextmanager
def figure_style() -> Iterator[None]:
    """Draw the figures of a block or function in Matplotlib's default style instead of the user's."""
    require("analysis", ["matplotlib"])
    from matplotlib import style  # optional and slow to import

    with style.context("default"):
        yield


def data_frame(columns: Mapping[str, Any]) -> "pl.DataFrame":
    """Return a polars DataFrame; polars is slow to import and comes with the extra ``analysis``."""
    require("analysis", ["polars"])
    import polars as pl

    return pl.DataFrame(columns)
