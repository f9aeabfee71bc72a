"""JSON and TOML form of scenarios, and conversion of fields to their declared types.

In a document, a part of a scenario (for example a predator) is an object with its kind as the only key:
``{"pure_pursuit": {"max_turn_rate": 2.0}}``. The constructors of scenarios also accept this form. msgspec
converts fields to their declared types; the compiled core checks their bounds.
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
from flockesc_env.common.documents import read_json
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
"""Names of the kinds in every family of parts, for example of predators."""

_INTEGER_LIMIT = 2**63

_TYPE_NAMES = {
    "array": "a list",
    "bool": "true or false",
    "float": "a number",
    "int": "an integer",
    "null": "None",
}
"""Names of types in error messages; the keys are msgspec's names."""


class Document:
    """Base class of scenarios: JSON and TOML, ``replace``, conversion of fields to their types."""

    def __post_init__(self) -> None:
        """Convert every field to its declared type: lists to tuples, NumPy numbers to Python numbers."""
        cls: Any = type(self)
        hints = _hints(cls)
        for field in dataclasses.fields(cls):
            value = _convert(getattr(self, field.name), hints[field.name], field.name)
            object.__setattr__(self, field.name, value)

    def to_json(self) -> str:
        """Return the scenario as a JSON document, with floats at full precision."""
        return json.dumps(self, default=_to_document)

    @classmethod
    def from_json(cls, document: str) -> Self:
        """Return the scenario of a JSON document; missing fields get their defaults.

        Raises:
            ScenarioError: if a field is unknown, has the wrong type or is out of bounds.
        """
        return cls(**_parse(cls, document, "JSON", read_json))

    def to_toml(self) -> str:
        """Return the scenario as TOML, with floats at full precision; ``None`` becomes the string "None"."""
        return tomli_w.dumps(_replace_values(json.loads(self.to_json()), None, "None"))

    @classmethod
    def from_toml(cls, document: str) -> Self:
        """Return the scenario of a TOML document; missing fields get their defaults.

        Raises:
            ScenarioError: if a field is unknown, has the wrong type or is out of bounds.
        """
        fields = _parse(
            cls, document, "TOML", lambda text: _replace_values(tomllib.loads(text), "None", None)
        )
        return cls(**fields)

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Raises:
            ScenarioError: if a changed field has the wrong type or is out of bounds.
            TypeError: if a field does not exist.
        """
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]


def _parse(cls: Any, document: str, form: str, parse: Callable[[str], Any]) -> Mapping[str, Any]:
    """Return the fields of a document; every parser error becomes a ScenarioError."""
    text = as_text(document, "document", ScenarioError)
    try:
        fields = parse(text)
    except (ValueError, RecursionError) as error:
        raise ScenarioError("document", f"valid {form}", error) from None
    return _check_names(cls, fields, "")


def _replace_values(value: Any, old: Any, new: Any) -> Any:
    """Return a document with all values equal to ``old`` replaced by ``new``."""
    if isinstance(value, dict):
        return {name: _replace_values(entry, old, new) for name, entry in value.items()}
    if isinstance(value, list):
        return [_replace_values(entry, old, new) for entry in value]
    return new if value == old else value


def _to_document(value: Any) -> dict[str, Any]:
    """Return the document of a scenario, ``{field: value}``, or of a part, ``{kind: {field: value}}``."""
    fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    return fields if isinstance(value, Document) else {value.kind: fields}


_hints: Callable[[Any], dict[str, Any]] = cache(get_type_hints)


def _check_names(cls: Any, fields: Any, prefix: str) -> Mapping[str, Any]:
    """Return the fields of a scenario or part after a check that all are known and none is missing."""
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


def _convert(value: Any, hint: Any, path: str) -> Any:
    """Convert a value to the type ``hint`` of a field: a part, a tuple of parts, or plain data."""
    family = next(iter(get_args(hint)), None)
    if family in _FAMILIES:
        if not isinstance(value, list | tuple):
            raise ScenarioError(path, f"a tuple of {_FAMILIES[family]}", type(value).__name__)
        return tuple(_convert(entry, family, f"{path}[{index}]") for index, entry in enumerate(value))
    if hint not in _FAMILIES:
        return _convert_plain(value, hint, path)
    kinds = {part.kind: part for part in get_args(hint)}
    if isinstance(value, get_args(hint)):
        value = _to_document(value)
    kind = next(iter(value)) if isinstance(value, Mapping) and len(value) == 1 else value
    if not isinstance(kind, str) or kind is value or kind not in kinds:
        raise ScenarioError(path, f"one of {', '.join(kinds)}", shown_name(kind, kinds))
    cls, prefix = kinds[kind], f"{path}.{kind}."
    fields = _check_names(cls, value[kind], prefix)
    return cls(**{name: _convert(entry, _hints(cls)[name], prefix + name) for name, entry in fields.items()})


def _convert_plain(value: Any, hint: Any, path: str) -> Any:
    """Convert a number, a string or a list of numbers to the type ``hint``."""
    try:
        plain = _plain(value, path)
        return msgspec.convert(plain, hint)
    except RecursionError:
        raise ScenarioError(path, "a value of the schema", "lists that are nested too deeply") from None
    except msgspec.ValidationError as error:
        problem, _, where = str(error).removesuffix("`").partition(" - at `$")
        for index in re.findall(r"\d+", where):
            plain = plain[int(index)]
        if get_origin(hint) is Literal:
            words = get_args(hint)
            raise ScenarioError(path, f"one of {', '.join(words)}", shown_name(plain, words)) from None
        types = (_TYPE_NAMES.get(name, "a string") for name in problem.split("`")[1].split(" | "))
        raise ScenarioError(path + where, " or ".join(types), shown(plain)) from None


def _plain(value: Any, path: str) -> Any:
    """Convert NumPy numbers to Python numbers, and arrays and tuples to lists; reject other types."""
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
            raise ScenarioError(path, "an integer between -2^63 and 2^63", value)
        case str() if not value.isascii():
            raise ScenarioError(path, "a string of ASCII characters", shown(value))
        case None | int() | float() | str():  # a bool is an int
            return value
    raise ScenarioError(path, "a number, a string or a part of a scenario", shown(value))
