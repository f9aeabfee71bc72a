"""``Job``: a call of a pure function with plain arguments, identified by a hash."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

Arrays = dict[str, NDArray[Any]]
"""Results of a job: arrays by name."""


@dataclass(frozen=True)
class Job:
    """A function call whose result does not depend on the process that runs it.

    Attributes:
        function: the function as ``module:name``; it returns ``Arrays``.
        arguments: positional arguments: scenarios, ``range`` objects, numbers, strings, and tuples of these.
        size: estimated duration, in a unit that all jobs of a list share.
    """

    function: str
    arguments: tuple[Any, ...]
    size: int = 1

    def key(self) -> str:
        """Return a hash of the function's name, the arguments and the compiled core."""
        parts = {
            "function": self.function,
            "arguments": [_plain(argument) for argument in self.arguments],
            "core": _core_hash(),
        }
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    def run(self) -> Arrays:
        """Call the function and return its results."""
        module, _, name = self.function.partition(":")
        function: Callable[..., Arrays] = getattr(import_module(module), name)
        return function(*self.arguments)


def _plain(argument: Any) -> Any:
    """Convert an argument to JSON types; different arguments give different values."""
    if isinstance(argument, FlockScenario | LineScenario):
        return {"model": type(argument).__name__, "scenario": json.loads(argument.to_json())}
    if isinstance(argument, range):
        return {"range": [argument.start, argument.stop, argument.step]}
    if isinstance(argument, tuple):
        return [_plain(entry) for entry in argument]
    if isinstance(argument, np.generic):
        return argument.item()
    return argument


@cache
def _core_hash() -> str:
    """Return a hash of the compiled core; results of different builds may differ in their last bits."""
    core = find_spec("flockesc_env._core")
    assert core is not None  # noqa: S101, the package does not import without it
    assert core.origin is not None  # noqa: S101, it is a file
    with Path(core.origin).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
