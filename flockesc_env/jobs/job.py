"""A job: a call of a pure function with plain arguments, identified by a hash of all that it depends on."""

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
"""Results of a job by name."""


@dataclass(frozen=True)
class Job:
    """A call that can be computed alone, in any process.

    Attributes:
        function: the function as ``module:name``; it returns arrays by name.
        arguments: scenarios, ranges of integers, numbers, texts, and tuples of these.
        size: how long it takes, in any unit that all jobs of a list share.
    """

    function: str
    arguments: tuple[Any, ...]
    size: int = 1

    def key(self) -> str:
        """Return a hash of everything that the results depend on, the compiled core included."""
        parts = {
            "function": self.function,
            "arguments": [_plain(argument) for argument in self.arguments],
            "core": _core_hash(),
        }
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    def run(self) -> Arrays:
        """Call the function."""
        module, _, name = self.function.partition(":")
        function: Callable[..., Arrays] = getattr(import_module(module), name)
        return function(*self.arguments)


def _plain(argument: Any) -> Any:
    """Return an argument as JSON has it; values of different types stay different."""
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
    """Return a hash of the compiled core: another build may compute other bits."""
    core = find_spec("flockesc_env._core")
    assert core is not None  # noqa: S101, the package does not import without it
    assert core.origin is not None  # noqa: S101, it is a file
    with Path(core.origin).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
