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
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, Final, Literal, Self, get_args, get_origin, get_type_hints

import msgspec
import numpy as np
import tomli_w

from flockesc_env.common.checks import as_text
from flockesc_env.common.errors import ScenarioError, shown, shown_name
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
}
"""msgspec's names of types in the words of errors."""


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
        return cls(**_loaded(cls, document, "JSON", lambda text: json.loads(text, object_pairs_hook=_once)))

    def to_toml(self) -> str:
        """Return the scenario as TOML; numbers keep every bit, and ``None`` is the text "None"."""
        return tomli_w.dumps(_replaced(json.loads(self.to_json()), None, "None"))

    @classmethod
    def from_toml(cls, document: str) -> Self:
        """Build a scenario from TOML; missing fields take their defaults.

        Raises:
            ScenarioError: naming a field that is unknown, of a wrong type or out of bounds.
        """
        return cls(
            **_loaded(cls, document, "TOML", lambda text: _replaced(tomllib.loads(text), "None", None))
        )

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Raises:
            ScenarioError: if a changed field is out of bounds.
            TypeError: for a field that does not exist.
        """
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]


def _loaded(cls: Any, document: str, form: str, parse: Callable[[str], Any]) -> Mapping[str, Any]:
    """Return the fields in a text; also too long numbers and too deep nesting are a ScenarioError."""
    text = as_text(document, "document", ScenarioError)
    try:
        fields = parse(text)
    except (ValueError, RecursionError) as error:
        raise ScenarioError("document", f"valid {form}", error) from None
    return _named(cls, fields, "")


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object; refuse fields that are given twice."""
    if len(fields := dict(pairs)) < len(pairs):
        raise json.JSONDecodeError("a field is given twice", ", ".join(name for name, _ in pairs), 0)
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


_hints: Callable[[Any], dict[str, Any]] = cache(get_type_hints)


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
    family = next(iter(get_args(hint)), None)
    if family in _FAMILIES:
        if not isinstance(value, list | tuple):
            raise ScenarioError(path, f"a tuple of {_FAMILIES[family]}", type(value).__name__)
        return tuple(_read(entry, family, f"{path}[{index}]") for index, entry in enumerate(value))
    if hint not in _FAMILIES:
        return _read_plain(value, hint, path)
    kinds = {part.kind: part for part in get_args(hint)}
    if isinstance(value, get_args(hint)):
        value = _written(value)
    kind = next(iter(value)) if isinstance(value, Mapping) and len(value) == 1 else value
    if not isinstance(kind, str) or kind is value or kind not in kinds:
        raise ScenarioError(path, f"one of {', '.join(kinds)}", shown_name(kind, kinds))
    cls, prefix = kinds[kind], f"{path}.{kind}."
    fields = _named(cls, value[kind], prefix)
    return cls(**{name: _read(entry, _hints(cls)[name], prefix + name) for name, entry in fields.items()})


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
        if get_origin(hint) is Literal:
            words = get_args(hint)
            raise ScenarioError(path, f"one of {', '.join(words)}", shown_name(plain, words)) from None
        types = (_WORDS.get(name, "a text") for name in problem.split("`")[1].split(" | "))
        raise ScenarioError(path + where, " or ".join(types), shown(plain)) from None


def _plain(value: Any, path: str) -> Any:
    """Return NumPy numbers as Python's, arrays and tuples as lists; refuse what a document cannot hold."""
    if isinstance(value, memoryview):
        value = np.asarray(value)
    if isinstance(value, np.generic | np.ndarray) and value.dtype.kind in "biufU":
        value = np.float64(value).tolist() if value.dtype.kind == "f" else value.tolist()
    match value:
        case list() | tuple():
            return [_plain(entry, f"{path}[{index}]") for index, entry in enumerate(value)]
        case float() if not math.isfinite(value):
            raise ScenarioError(path, "a finite number", value)
        case int() if abs(value) >= _INTEGER_LIMIT:
            raise ScenarioError(path, "an integer of at most 63 bits", value)
        case str() if not value.isascii():
            raise ScenarioError(path, "a text of ASCII letters", shown(value))
        case None | int() | float() | str():  # a bool is an int
            return value
    raise ScenarioError(path, "a number, a text or a part of a scenario", shown(value))
