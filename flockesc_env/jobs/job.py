"""``Job``, a call of a pure function with plain arguments, and its key; ``Cache``: results of jobs."""

import dataclasses
import hashlib
import json
import socket
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from enum import Enum
from functools import cache, cached_property
from importlib import import_module
from importlib.util import find_spec
from io import BytesIO
from operator import attrgetter
from pathlib import Path, PurePath
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.format import descr_to_dtype, dtype_to_descr
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import as_array, in_job
from flockesc_env.common.errors import InputError, JobError, shown
from flockesc_env.common.files import read_sealed, write_sealed
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

Arrays = dict[str, NDArray[Any]]
"""Results of a job: arrays by name."""

GRACE_SECONDS = 60.0
"""A network file system may show a file that another machine wrote only after this time."""

_RESERVED = {"file", "allow_pickle"}
"""Names that ``numpy.savez`` does not take."""

_MAX_NAME = 2**16 - 1 - len(".npy")
"""Bytes of the longest name that an archive takes."""

_PLAIN = (bool, int, float, str, bytes, range, tuple, list, dict, PurePath, np.generic)
_PLAIN_MODULES = {"builtins", "pathlib", "numpy"}


@cache
def engine_hash() -> str:
    """Return a hash of the compiled core; results of different builds may differ in their last bits."""
    with Path(_core.__file__).open("rb") as file:
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
        """A hash of everything that the results depend on, the compiled core included."""
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
        module, _, name = self.function.rpartition(":")
        function: Callable[..., Arrays] = attrgetter(name)(import_module(module))
        with in_job():
            returned = function(*self.arguments)
        if not isinstance(returned, dict):
            raise TypeError(f"results: expected a dict of arrays, got {shown(returned)}")
        results: Arrays = {}
        for name, value in returned.items():
            is_name = isinstance(name, str) and name.isprintable() and not name.endswith(".npy")
            if not is_name or name in _RESERVED or len(name.encode()) > _MAX_NAME:
                expected = f"the name of an array of at most {_MAX_NAME:,} bytes"
                raise TypeError(f"results: expected {expected}, got {shown(name)}")
            results[name] = array = as_array(value, name)
            if array.dtype.hasobject or descr_to_dtype(dtype_to_descr(array.dtype)) != array.dtype:
                raise InputError(name, "an array of numbers or strings", f"dtype {array.dtype}")
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


class Cache:
    """A folder with one npz file per job; the key of the job is the file name.

    Several drivers and workers may share a folder: equal keys hold equal bytes, and files appear complete.
    A file ends with a hash of its content and of the key. The folder is created with the first result.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder).absolute()

    def path(self, job: Job) -> Path:
        """Return the file that holds the results of a job."""
        return self.folder / f"{job.key}.npz"

    def __contains__(self, job: Job) -> bool:
        return self.find(job) is not None

    def find(self, job: Job) -> Arrays | None:
        """Return the results of a job, or None if they are missing or, with a warning, cannot be read."""
        path = self.path(job)
        try:
            packed = read_sealed(path, job.key)
        except FileNotFoundError:
            return None
        except (IsADirectoryError, PermissionError):
            packed = None
        if packed is None:
            given = "a folder, a damaged file or another job's"
            message = f"{path}: expected the results of a job, got {given}; the job runs again"
            warnings.warn(message, stacklevel=2)
            return None
        # The limit on headers is for files without a hash. Many named fields exceed it.
        with np.load(BytesIO(packed), allow_pickle=False, max_header_size=sys.maxsize) as stored:
            return dict(stored.items())

    def put(self, job: Job, results: Arrays) -> None:
        """Keep the results of a job."""
        packed = BytesIO()
        np.savez_compressed(packed, allow_pickle=False, **results)
        self.folder.mkdir(parents=True, exist_ok=True)
        # A file that a power failure damages is found and computed again.
        write_sealed(self.path(job), job.key, packed.getvalue(), durable=False)

    def keep(self, job: Job, found: Arrays | str) -> str | None:
        """Keep what ``Job.attempt`` returned: put results into the cache. Return the error, if any."""
        if isinstance(found, str):
            return found
        try:
            self.put(job, found)
        except Exception as error:  # NumPy and zipfile raise exceptions of many types
            return f"its results cannot be written: {error}"
        return None

    def get(self, job: Job) -> Arrays:
        """Return the results of a job; ``JobError`` if its file has not appeared after ``GRACE_SECONDS``."""
        end = time.monotonic() + GRACE_SECONDS
        while (results := self.find(job)) is None:
            if time.monotonic() > end:
                found = "no such file, or a damaged one"
                raise JobError(f"result of a finished job: expected {self.path(job)}, got {found}")
            time.sleep(0.1)
            if self.folder.is_dir():
                list(self.folder.iterdir())  # asks a network file system for new names
        return results


def import_name(named: object, field: str, expected: str) -> str:
    """Return ``module:name`` of a function or class that other processes can import.

    A script counts as the module of its name, if a search for this module finds the script.
    """
    module, name = getattr(named, "__module__", None), getattr(named, "__qualname__", None)
    try:
        is_found = attrgetter(name)(sys.modules[module]) == named  # type: ignore[arg-type, index]
    except (AttributeError, KeyError, TypeError):
        is_found = False
    if not is_found or not str(name).replace(".", "").isidentifier():
        raise InputError(field, expected, shown(named))
    if module == "__main__":
        main = sys.modules[module]
        module = main.__spec__.name if main.__spec__ else _module_of(main, field, expected)
    return f"{module}:{name}"


def _module_of(script: ModuleType, field: str, expected: str) -> str:
    file = getattr(script, "__file__", None)
    if file is None:
        raise InputError(field, expected, "one of an interactive session")
    name = Path(file).stem
    try:
        found = find_spec(name).origin  # type: ignore[union-attr]
        if Path(found).samefile(file):  # type: ignore[arg-type]
            return name
    except (AttributeError, ImportError, OSError, TypeError, ValueError):
        pass
    how = "rename it, unset PYTHONSAFEPATH or import the function from another file"
    raise InputError(field, expected, f"one of {file}, which is not found as the module {name!r}: {how}")


def encoded(value: Any) -> Any:
    """Return a value as a list of the name of its type and its content, recursively.

    Entries of dicts keep their order, because a function can see it. ``Job.arguments`` names the types.
    """
    kind = type(value)
    module = kind.__module__.partition(".")[0]
    if value is None or (isinstance(value, _PLAIN) and module in _PLAIN_MODULES):
        return [f"{module}:{kind.__name__}", _content(value)]
    name = import_name(kind, "arguments", "objects of classes that other processes can import")
    match value:
        case Enum():
            return [name, encoded(value.value)]
        case FlockScenario() | LineScenario() if kind in {FlockScenario, LineScenario}:
            return [name, value.to_json()]
        case _ if dataclasses.is_dataclass(kind) and not isinstance(value, _PLAIN):
            names = [part.name for part in dataclasses.fields(kind)]
            return [name, [[part, encoded(getattr(value, part))] for part in names]]
    raise InputError("arguments", "plain data", shown(value))


def _content(value: Any) -> Any:
    match value:
        case np.bool_() | np.integer() | np.floating() if value.nbytes <= np.float64().nbytes:
            return [value.dtype.str, value.tobytes().hex()]
        case None | bool() | str():
            return value
        case int():
            return hex(value)  # without the limit on decimal digits
        case float() | bytes():
            return value.hex()
        case PurePath():
            return str(value)
        case range():
            return [hex(value.start), hex(value.stop), hex(value.step)]
        case tuple() | list():
            return [encoded(entry) for entry in value]
        case dict():
            return [[encoded(key), encoded(entry)] for key, entry in value.items()]
    raise InputError("arguments", "plain data", shown(value))
