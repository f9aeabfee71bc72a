"""``Job``: a call of a pure function with plain arguments, identified by a hash."""

from __future__ import annotations

import hashlib
import json
import socket
import traceback
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib import import_module
from importlib.util import find_spec
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import in_job
from flockesc_env.common.errors import InputError, JobError, shown
from flockesc_env.jobs.keys import encoded

Arrays = dict[str, NDArray[Any]]
"""Results of a job: arrays by name."""

_RESERVED = {"file", "allow_pickle"}
"""Names that ``numpy.savez`` does not take."""


@cache
def engine_hash() -> str:
    """Return a hash of the compiled core; results of different builds may differ in their last bits."""
    core = find_spec("flockesc_env._core")
    assert core is not None  # noqa: S101, the package does not import without it
    assert core.origin is not None  # noqa: S101, it is a file
    with Path(core.origin).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@dataclass(frozen=True)
class Job:
    """A call that can be computed alone, in any process on any machine.

    Attributes:
        function: the function as ``module:name``; it returns arrays by name.
        arguments: scenarios, other dataclasses, enums, ranges of integers, numbers, strings, bytes, paths,
            and tuples, lists and dicts of these.
        seconds: estimated time on one core. It sets the order of jobs, the size of chunks on SLURM and the
            time left that is shown; results do not depend on it.
        engine: hash of the compiled core. A worker with another core refuses the job.
    """

    function: str
    arguments: tuple[Any, ...]
    seconds: float = 1.0
    engine: str = field(default_factory=engine_hash)

    @cached_property
    def key(self) -> str:
        """A hash of everything that the results depend on, the compiled core included.

        Raises:
            InputError: if an argument has another type than those that ``Job`` names.
        """
        try:
            parts = [self.function, self.engine, encoded(self.arguments)]
            text = json.dumps(parts, ensure_ascii=False)
        except RecursionError:
            raise InputError("arguments", "plain data", shown(self.arguments)) from None
        return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()

    def run(self) -> Arrays:
        """Call the function, with one thread per call of the engine; refuse the job of another core."""
        if self.engine != engine_hash():
            expected, found = self.engine[:12], engine_hash()[:12]
            raise JobError(f"engine: expected build {expected}, got {found} on {socket.gethostname()}")
        module, _, name = self.function.partition(":")
        function: Callable[..., Arrays] = attrgetter(name)(import_module(module))
        with in_job():
            returned = function(*self.arguments)
        if not isinstance(returned, dict):
            raise TypeError(f"results: expected a dict of arrays, got {shown(returned)}")
        results = {name: np.asarray(value) for name, value in returned.items()}
        for name, array in results.items():
            is_name = isinstance(name, str) and name.isprintable() and not name.endswith(".npy")
            if not is_name or name in _RESERVED:
                raise TypeError(f"results: expected the name of an array, got {shown(name)}")
            if array.dtype.hasobject:
                raise TypeError(f"{name}: expected an array of numbers or strings, got Python objects")
        return results

    def attempt(self) -> Arrays | str:
        """Return the results, or the traceback if the function raises or exits."""
        try:
            return self.run()
        except KeyboardInterrupt:
            raise
        except BaseException:  # any error concerns this job alone
            return traceback.format_exc()


class Outcome(NamedTuple):
    """A job has ended: with an error, or with its result in the cache; ``running`` others run now."""

    job: Job
    error: str | None
    running: int


Outcomes = Generator[Outcome, None, None]
