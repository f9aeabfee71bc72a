"""Scenarios as documents: to and from JSON and TOML, conversion of fields to plain values, checks.

In a document a part, for example a predator, is an object with its kind as the only key:
``{"pure_pursuit": {"max_turn_rate": 2.0}}``. A scenario's constructor accepts this form as well. msgspec
converts fields to their declared types; the core checks their bounds.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import Any, Final, Literal, Self, get_args, get_origin, get_type_hints

import msgspec
import numpy as np
import tomli_w

from flockesc_env.common.checks import as_text
from flockesc_env.common.errors import FlockescError, ScenarioError, shown, shown_name
from flockesc_env.scenario.initial import InitialHeadings, InitialPositions
from flockesc_env.scenario.motion import Motion
from flockesc_env.scenario.neighbors import NeighborRule
from flockesc_env.scenario.predators import Predator
from flockesc_env.scenario.randomization import Distribution

_FAMILIES: dict[Any, str] = {
    Predator: "predators",
    NeighborRule: "neighbor_rules",
    Motion: "motions",
    InitialPositions: "initial_positions",
    InitialHeadings: "initial_headings",
    Distribution: "distributions",
}

KINDS: Final[dict[str, tuple[str, ...]]] = {
    name: tuple(part.kind for part in get_args(family)) for family, name in _FAMILIES.items()
}
"""The kinds of every family of parts."""

_INTEGER_LIMIT = 2**63

_WORDS = {
    "array": "a list",
    "bool": "true or false",
    "float": "a number",
    "int": "an integer",
    "null": "None",
    "str": "a text",
}
"""What msgspec calls types, and what errors call them."""


class Document:
    """What both scenarios share: JSON and TOML in and out, ``replace``, plain fields."""

    def __post_init__(self) -> None:
        """Bring every field to its declared type: lists become tuples, NumPy numbers plain ones."""
        cls: Any = type(self)
        hints = _hints(cls)
        for field in dataclasses.fields(cls):
            value = _read(getattr(self, field.name), hints[field.name], field.name)
            object.__setattr__(self, field.name, value)

    def to_json(self) -> str:
        """Return the scenario as one JSON document; numbers keep every bit."""
        return json.dumps(self, default=_written)

    @classmethod
    def from_json(cls, document: str) -> Self:
        """Build a scenario from a JSON document; missing fields take their defaults.

        Raises:
            ScenarioError: naming a field that is unknown, of a wrong type or out of bounds.
        """
        text = as_text(document, "document", ScenarioError)
        with _reading("JSON"):
            return cls(**_named(cls, json.loads(text, object_pairs_hook=_object), ""))

    def to_toml(self) -> str:
        """Return the scenario as TOML; numbers keep every bit, and ``None`` is the text "None"."""
        return tomli_w.dumps(_replaced(json.loads(self.to_json()), None, "None"))

    @classmethod
    def from_toml(cls, document: str) -> Self:
        """Build a scenario from TOML; missing fields take their defaults.

        Raises:
            ScenarioError: naming a field that is unknown, of a wrong type or out of bounds.
        """
        text = as_text(document, "document", ScenarioError)
        with _reading("TOML"):
            return cls(**_named(cls, _replaced(tomllib.loads(text), "None", None), ""))

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Raises:
            ScenarioError: if a changed field is out of bounds.
            TypeError: for a field that does not exist.
        """
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]


@contextmanager
def _reading(form: str) -> Iterator[None]:
    """Turn the errors of a parser, also for too long numbers and too deep nesting, into a ScenarioError."""
    try:
        yield
    except FlockescError:
        raise
    except (ValueError, RecursionError) as error:
        raise ScenarioError("document", f"valid {form}", error) from None


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object; refuse a field that is given twice."""
    fields: dict[str, Any] = {}
    for name, value in pairs:
        if name in fields:
            raise ScenarioError("document", "every field once", f"{name!r} twice")
        fields[name] = value
    return fields


def _replaced(value: Any, old: Any, new: Any) -> Any:
    """Return a document with every value that equals ``old`` replaced by ``new``."""
    if isinstance(value, dict):
        return {name: _replaced(entry, old, new) for name, entry in value.items()}
    if isinstance(value, list):
        return [_replaced(entry, old, new) for entry in value]
    return new if value == old else value


def _written(value: Any) -> dict[str, Any]:
    """Return the document of a scenario or, as ``{kind: fields}``, of a part."""
    fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    return fields if isinstance(value, Document) else {value.kind: fields}


@cache
def _hints(cls: Any) -> dict[str, Any]:
    return get_type_hints(cls)


def _named(cls: Any, fields: Any, prefix: str) -> Mapping[str, Any]:
    """Return the fields of a scenario or part after a check of their names."""
    if not isinstance(fields, Mapping):
        raise ScenarioError(prefix.rstrip(".") or "document", "an object with its fields", shown(fields))
    known = {field.name: field for field in dataclasses.fields(cls)}
    for name in fields:
        if name not in known:
            raise ScenarioError(f"{prefix}{name}", f"one of {', '.join(known)}", shown_name(name, known))
    for name, field in known.items():
        if field.default is dataclasses.MISSING and name not in fields:
            raise ScenarioError(f"{prefix}{name}", "a value", "none")
    return fields


def _read(value: Any, hint: Any, path: str) -> Any:
    """Return a value as a field of type ``hint`` stores it: a part, a tuple of parts, or plain data."""
    if hint in _FAMILIES:
        return _read_part(value, {part.kind: part for part in get_args(hint)}, path)
    family, *_ = get_args(hint) or (None,)
    if family not in _FAMILIES:
        return _read_plain(value, hint, path)
    if not isinstance(value, list | tuple):
        raise ScenarioError(path, f"a tuple of {_FAMILIES[family]}", type(value).__name__)
    return tuple(_read(entry, family, f"{path}[{index}]") for index, entry in enumerate(value))


def _read_part(value: Any, kinds: dict[str, Any], path: str) -> Any:
    """Return a part of one of some kinds, given as itself or as ``{kind: fields}``."""
    if isinstance(value, tuple(kinds.values())):
        value = _written(value)
    if not isinstance(value, Mapping) or len(value) != 1 or not value.keys() <= kinds.keys():
        given = next(iter(value)) if isinstance(value, Mapping) and len(value) == 1 else value
        raise ScenarioError(path, f"one of {', '.join(kinds)}", shown_name(given, kinds))
    [(kind, fields)] = value.items()
    cls, prefix = kinds[kind], f"{path}.{kind}."
    hints = _hints(cls)
    named = _named(cls, fields, prefix)
    return cls(**{name: _read(entry, hints[name], prefix + name) for name, entry in named.items()})


def _read_plain(value: Any, hint: Any, path: str) -> Any:
    """Return numbers, texts and vectors of them as ``hint`` declares them."""
    try:
        plain = _plain(value, path)
        return msgspec.convert(plain, hint)
    except RecursionError:
        raise ScenarioError(path, "a value of the schema", "lists in too many lists") from None
    except msgspec.ValidationError as error:
        problem, _, where = str(error).removesuffix("`").partition(" - at `$")
        for index in re.findall(r"\d+", where):
            plain = plain[int(index)]
        types = re.match(r"Expected `(.*)`, got", problem)
        choices = [
            choice
            for part in (hint, *get_args(hint))
            if get_origin(part) is Literal
            for choice in get_args(part)
        ]
        expected = " or ".join(_WORDS[name] for name in types[1].split(" | ")) if types else "a number"
        if choices:
            expected = f"one of {', '.join(choices)}"
        raise ScenarioError(path + where, expected, shown_name(plain, choices)) from None


def _plain(value: Any, path: str) -> Any:
    """Return NumPy numbers as Python's, arrays and tuples as lists; refuse what a document cannot hold."""
    if isinstance(value, memoryview):
        value = np.asarray(value)
    if isinstance(value, np.generic | np.ndarray) and value.dtype.kind in "biufU":
        value = np.float64(value).tolist() if value.dtype.kind == "f" else value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(entry, f"{path}[{index}]") for index, entry in enumerate(value)]
    if isinstance(value, float) and not math.isfinite(value):
        raise ScenarioError(path, "a finite number", value)
    if isinstance(value, int) and abs(value) >= _INTEGER_LIMIT:
        raise ScenarioError(path, "an integer of at most 63 bits", value)
    if value is not None and not isinstance(value, bool | int | float | str):
        raise ScenarioError(path, "a number, a text or a part of a scenario", shown(value))
    if isinstance(value, str) and not value.isascii():
        raise ScenarioError(path, "a text of ASCII letters", shown(value))
    return value
