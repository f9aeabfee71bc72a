"""Plain JSON of arguments for the keys of jobs: equal only for equal types and values."""

from __future__ import annotations

import dataclasses
import sys
from enum import Enum
from operator import attrgetter
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from flockesc_env.common.errors import InputError, shown
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

_PLAIN = (bool, int, float, str, bytes, range, tuple, list, dict, PurePath, np.generic)
_PLAIN_MODULES = {"builtins", "pathlib", "numpy"}


def import_name(named: object, field: str, expected: str) -> str:
    """Return ``module:name`` of a function or class that other processes can import.

    A script counts as the module of its name.
    """
    module, name = getattr(named, "__module__", None), getattr(named, "__qualname__", None)
    try:
        is_found = attrgetter(name)(sys.modules[module]) == named  # type: ignore[arg-type, index]
    except (AttributeError, KeyError, TypeError):
        is_found = False
    if module == "__main__":
        main = sys.modules[module]
        module = main.__spec__.name if main.__spec__ else Path(getattr(main, "__file__", "<none>")).stem
    if not is_found or not f"{module}{name}".replace(".", "").isidentifier():
        raise InputError(field, expected, shown(named))
    return f"{module}:{name}"


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
        case float():
            return value.hex()
        case bytes():
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
