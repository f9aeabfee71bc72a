"""JSON and TOML form of scenarios, and conversion of fields to their declared types.

In a document, a part of a scenario (for example a predator) is an object with its kind as the only key:
``{"pure_pursuit": {"max_turn_rate": 2.0}}``. The constructors of scenarios also accept this form. This module
converts fields to their declared types; the compiled core checks their bounds.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from types import NoneType
from typing import Any, Literal, Self, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
import tomli_w

from flockesc_env import _core
from flockesc_env.common.checks import as_array, as_choice, as_text, parse_json
from flockesc_env.common.errors import InputError, shown, shown_name
from flockesc_env.scenario.parts import Distribution, InitialHeadings, InitialPositions, Motion, NeighborRule
from flockesc_env.scenario.predators import Predator

_FAMILIES: dict[Any, str] = {
    Predator: "predators",
    NeighborRule: "neighbor_rules",
    Motion: "motions",
    InitialPositions: "initial_positions",
    InitialHeadings: "initial_headings",
    Distribution: "distributions",
}

_D = TypeVar("_D", bound="Document")

Converter = Callable[[Any, str], Any]
"""Converts a value to the type of a field. The second argument is the field's path, for errors."""

_SCALARS = {bool: "true or false", int: "an integer", float: "a number", str: "a string", NoneType: "None"}
"""Types of plain values, and how errors describe them."""


class Document:
    """Base class of scenarios: JSON and TOML, ``replace``, conversion of fields to their types."""

    def __post_init__(self) -> None:
        """Convert every field to its declared type: lists to tuples, NumPy numbers to Python numbers."""
        cls: Any = type(self)
        converters = _converters(cls).items()
        vars(self).update({name: convert(getattr(self, name), name) for name, convert in converters})

    def to_json(self) -> str:
        """Return the scenario as a JSON document, with floats at full precision."""
        return json.dumps(self, default=_to_document)

    @classmethod
    def from_json(cls, document: str) -> Self:
        """Return the scenario of a JSON document; missing fields get their defaults.

        Raises:
            InputError: if a field is unknown, has the wrong type or is out of bounds.
        """
        return from_fields(cls, parse_document(document, is_toml=False))

    def to_toml(self) -> str:
        """Return the scenario as TOML, with floats at full precision; ``None`` becomes the string "None"."""
        return tomli_w.dumps(_replace_values(json.loads(self.to_json()), None, "None"))

    @classmethod
    def from_toml(cls, document: str) -> Self:
        """Return the scenario of a TOML document, as ``from_json``."""
        return from_fields(cls, parse_document(document, is_toml=True))

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Raises:
            InputError: if a changed field has the wrong type or is out of bounds, or ``randomization``
                draws it.
            TypeError: if a field does not exist.
        """
        changed: Self = dataclasses.replace(self, **changes)  # type: ignore[type-var]
        check_not_drawn(changed, changes)
        return changed


def check_not_drawn(scenario: Document, paths: Iterable[str]) -> None:
    """Refuse to change fields that the scenario's ``randomization`` draws: the change would have no effect.

    Paths have indices in brackets or after dots, with or without the kinds of parts.
    """
    distributions: tuple[Distribution, ...] = getattr(scenario, "randomization", ())
    drawn = {_names(field): each for each in distributions for field in each.fields}
    for path in paths:
        if _names(path) in drawn:
            raise InputError(path, "a field that randomization does not draw", shown(drawn[_names(path)]))


def field_at(document: Any, path: str, field: str) -> tuple[Any, Any]:
    """Return the object or list that contains the field at a dotted path, and its key or index.

    The path may omit the kinds of parts; ``field`` is its name in errors.
    """
    node, parent, key = document, None, None
    for name in path.split("."):
        if isinstance(node, dict) and len(node) == 1 and name not in node:
            [node] = node.values()
        if isinstance(node, list):
            if name not in map(str, range(len(node))):
                raise InputError(field, f"an index below {len(node)}", shown(name))
        elif not isinstance(node, dict):
            raise InputError(field, "the path of a field", f"{shown(name)} inside a plain value")
        elif name not in node:
            raise InputError(field, f"one of {', '.join(node) or 'no fields'}", shown_name(name, node))
        parent, key = node, int(name) if isinstance(node, list) else name
        node = parent[key]
    return parent, key


def _names(path: str) -> tuple[str, ...]:
    """Return the fields and indices of a path, without the kinds of parts."""
    kinds = {part.kind for family in _FAMILIES for part in get_args(family)}
    return tuple(name for name in re.findall(r"[^.\[\]]+", path) if name not in kinds)


def parse_document(document: str, *, is_toml: bool) -> Any:
    """Return the value of a TOML or JSON document; every parser error becomes a InputError."""
    text = as_text(document, "document")
    try:
        return _replace_values(tomllib.loads(text), "None", None) if is_toml else parse_json(text)
    except (ValueError, RecursionError) as error:
        raise InputError("document", f"valid {'TOML' if is_toml else 'JSON'}", error) from None


def from_fields(cls: type[_D], fields: Any) -> _D:
    """Return the scenario with these fields of a document; missing ones get their defaults."""
    return cls(**_check_names(cls, fields, ""))


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


@cache
def _converters(cls: Any) -> dict[str, Converter]:
    """Return the converter of every field of a scenario or part."""
    hints = get_type_hints(cls)
    return {field.name: _converter(hints[field.name]) for field in dataclasses.fields(cls)}


def _converter(hint: Any) -> Converter:
    """Return the converter to a part, a tuple of parts, one of some words, or plain data."""
    family = next(iter(get_args(hint)), None)
    if family in _FAMILIES:
        return partial(_convert_parts, _FAMILIES[family], _converter(family))
    if hint in _FAMILIES:
        return partial(_convert_part, {part.kind: part for part in get_args(hint)})
    if get_origin(hint) is Literal:
        return partial(as_choice, known=get_args(hint))
    names: list[str] = []
    conversions: dict[type, Converter] = {}
    for one in (hint,) if hint in _SCALARS or get_origin(hint) is tuple else get_args(hint):
        if get_origin(one) is tuple:
            names.append("a list")
            conversions[list] = partial(_convert_entries, _converter(get_args(one)[0]))
            continue
        names.append(_SCALARS[one])
        conversions[one] = lambda value, _: value
        if one is float:
            conversions[int] = lambda value, _: float(value)
    return partial(_convert_plain, " or ".join(names), conversions)


def _check_names(cls: Any, fields: Any, prefix: str) -> Mapping[str, Any]:
    """Return the fields of a scenario or part after a check that all are known and none is missing."""
    if not isinstance(fields, Mapping):
        raise InputError(prefix.rstrip(".") or "document", "an object with its fields", shown(fields))
    known = _converters(cls)
    for name in fields:
        as_choice(name, f"{prefix}{name}", known)
    for field in dataclasses.fields(cls):
        if field.default is dataclasses.MISSING and field.name not in fields:
            raise InputError(f"{prefix}{field.name}", "a value", "none")
    return fields


def _convert_parts(family: str, convert: Converter, value: Any, path: str) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise InputError(path, f"a tuple of {family}", type(value).__name__)
    if len(value) > _core.MAX_PARTS:
        raise InputError(path, f"at most {_core.MAX_PARTS} {family}", len(value))
    return tuple(convert(entry, f"{path}[{index}]") for index, entry in enumerate(value))


def _convert_part(kinds: dict[str, Any], value: Any, path: str) -> Any:
    if isinstance(value, tuple(kinds.values())):
        value = _to_document(value)
    kind = next(iter(value)) if isinstance(value, Mapping) and len(value) == 1 else value
    if not isinstance(kind, str) or kind is value or kind not in kinds:
        raise InputError(path, f"one of {', '.join(kinds)}", shown_name(kind, kinds))
    cls, prefix = kinds[kind], f"{path}.{kind}."
    fields, converters = _check_names(cls, value[kind], prefix), _converters(cls)
    return cls(**{name: converters[name](entry, prefix + name) for name, entry in fields.items()})


def _convert_plain(expected: str, conversions: dict[type, Converter], value: Any, path: str) -> Any:
    value = _plain(value, path)
    if type(value) not in conversions:
        raise InputError(path, expected, shown(value))
    return conversions[type(value)](value, path)


def _convert_entries(convert: Converter, value: Sequence[Any], path: str) -> tuple[Any, ...]:
    return tuple(convert(entry, f"{path}[{index}]") for index, entry in enumerate(value))


def _plain(value: Any, path: str) -> Any:
    """Convert NumPy numbers to Python numbers, and arrays and tuples to lists; reject other types."""
    if isinstance(value, memoryview | np.ndarray):
        value = as_array(value, path)
    if isinstance(value, np.generic | np.ndarray) and value.dtype.kind in "biufU":
        value = np.float64(value).tolist() if value.dtype.kind == "f" else value.tolist()
    match value:
        case float() if not math.isfinite(value):
            raise InputError(path, "a finite number", value)
        case bool() | None:
            return value
        case list() | tuple():
            return list(value)
        case int() if abs(value) >= 2**63:
            raise InputError(path, "an integer between -2^63 and 2^63", value)
        case str() if not value.isascii():
            raise InputError(path, "a string of ASCII characters", shown(value))
        case float():
            return float(value)
        case int():
            return int(value)
        case str():
            return str(value)
    raise InputError(path, "a number, a string or a part of a scenario", shown(value))
