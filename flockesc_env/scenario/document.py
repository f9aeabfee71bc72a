"""JSON and TOML form of scenarios, and conversion of fields to their declared types.

In a document, a part of a scenario (for example a predator) is an object with its kind as the only key:
``{"pure_pursuit": {"max_turn_rate": 2.0}}``. The constructors of scenarios also accept this form. This module
turns what was given into a document; the compiled core checks it and returns it with all types as declared.
"""

import dataclasses
import json
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import cache
from typing import Any, Self, TypeVar, get_args

import numpy as np
import tomli_w

from flockesc_env.common.checks import as_array, as_choice, as_instance, as_text, parse_json
from flockesc_env.common.errors import InputError, shown, shown_name
from flockesc_env.scenario.parts import PARTS, Distribution, Part, RandomApproach

_T = TypeVar("_T")
_D = TypeVar("_D", bound="Document")


class Document:
    """Base class of scenarios: JSON and TOML, ``replace``, fields from a checked document."""

    _document: str

    def to_json(self) -> str:
        """Return the scenario as a JSON document, with floats at full precision."""
        return self._document

    def _given(self) -> dict[str, Any]:
        """Return the document of the fields as they were given to the constructor."""
        each: Any = dataclasses.fields(self)  # type: ignore[arg-type]
        return {field.name: as_plain(getattr(self, field.name), field.name, field.type) for field in each}

    def _set(self, document: str) -> Self:
        """Set every field from a document that the core has checked; lists become tuples."""
        fields = {name: _from_plain(value) for name, value in json.loads(document).items()}
        vars(self).update(fields, _document=document)
        return self

    @classmethod
    def from_json(cls, document: str) -> Self:
        """Return the scenario of a JSON document; missing fields get their defaults."""
        return from_fields(cls, parse_document(document, is_toml=False))

    def to_toml(self) -> str:
        """Return the scenario as TOML, with floats at full precision; ``None`` becomes the string "None"."""
        return tomli_w.dumps(_replace_values(json.loads(self.to_json()), None, "None"))

    @classmethod
    def from_toml(cls, document: str) -> Self:
        """Return the scenario of a TOML document, as ``from_json``."""
        return from_fields(cls, parse_document(document, is_toml=True))

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed, except those that ``randomization`` draws."""
        changed: Self = dataclasses.replace(self, **changes)  # type: ignore[type-var]
        check_not_drawn(changed, changes)
        return changed


def check_not_drawn(scenario: Document, paths: Iterable[str]) -> None:
    """Refuse to change fields that the scenario's ``randomization`` draws: the change would have no effect.

    Paths have indices in brackets or after dots, with or without the kinds of parts.
    """
    distributions: tuple[Distribution, ...] = getattr(scenario, "randomization", ())
    drawn = {_names(field): each for each in distributions for field in _drawn_fields(each)}
    for path in paths:
        if _names(path) in drawn:
            raise InputError(path, "a field that randomization does not draw", shown(drawn[_names(path)]))


def _drawn_fields(distribution: Distribution) -> list[str]:
    """Return the paths of the numbers that a distribution draws."""
    if not isinstance(distribution, RandomApproach):
        return [distribution.field]
    vectors = [f"predators[{distribution.predator}].{name}" for name in ("position", "velocity")]
    return [f"{vector}[{axis}]" for vector in vectors for axis in range(3)]


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
    return tuple(name for name in re.findall(r"[^.\[\]]+", path) if name not in PARTS)


def parse_document(document: str, *, is_toml: bool) -> Any:
    """Return the value of a TOML or JSON document; every parser error becomes a InputError."""
    text = as_text(document, "document")
    try:
        return _replace_values(tomllib.loads(text), "None", None) if is_toml else parse_json(text)
    except (ValueError, RecursionError) as error:
        raise InputError("document", f"valid {'TOML' if is_toml else 'JSON'}", error) from None


def from_fields(cls: type[_D], fields: Any) -> _D:
    """Return the scenario with these fields of a document; missing ones get their defaults."""
    for name in as_instance(fields, "document", Mapping, "an object with its fields"):
        as_choice(name, name, [field.name for field in dataclasses.fields(cls)])  # type: ignore[arg-type]
    return cls(**fields)


def _replace_values(value: Any, old: Any, new: Any) -> Any:
    """Return a document with all values equal to ``old`` replaced by ``new``."""
    if isinstance(value, dict):
        return {name: _replace_values(entry, old, new) for name, entry in value.items()}
    if isinstance(value, list):
        return [_replace_values(entry, old, new) for entry in value]
    return new if value == old else value


def _from_plain(value: Any) -> Any:
    """Return the parts and tuples of a document that the core has checked."""
    match value:
        case dict():
            [(kind, fields)] = value.items()
            return PARTS[kind](**{name: _from_plain(entry) for name, entry in fields.items()})
        case list():
            return tuple(map(_from_plain, value))
    return value


def part_of(value: Any) -> Any:
    """Return the part that a document stands for; the core refuses a document that stands for none."""
    if isinstance(value, Mapping) and len(value) == 1:
        [(kind, fields)] = value.items()
        with suppress(KeyError, TypeError):  # an unknown kind; a field that is unknown or missing
            return PARTS[kind](**fields)
    return value


def as_plain(value: Any, path: str, hint: Any = None) -> Any:
    """Return the document of a part, of a tuple of parts or of plain data, with Python's numbers and lists.

    ``hint`` is the declared type, which shows where parts are expected.
    """
    family, *_ = (*get_args(hint), None)
    if kinds := _kinds(family):
        if not isinstance(value, list | tuple):
            raise InputError(path, f"a tuple of {', '.join(kinds)}", type(value).__name__)
        return [as_plain(entry, f"{path}[{index}]", family) for index, entry in enumerate(value)]
    value = part_of(value)
    if isinstance(value, Part):
        prefix, fields = f"{path}.{value.kind}.", dataclasses.fields(value)  # type: ignore[arg-type]
        return {
            value.kind: {
                each.name: as_plain(getattr(value, each.name), prefix + each.name) for each in fields
            }
        }
    if (kinds := _kinds(hint)) and not (isinstance(value, Mapping) and len(value) == 1):
        raise InputError(path, f"one of {', '.join(kinds)}", shown_name(value, kinds))
    try:
        return _plain(value, path)
    except RecursionError:
        raise InputError(path, "a number, a string or a list", shown(value)) from None


@cache
def _kinds(family: Any) -> list[str]:
    """Return the kinds of a union of parts."""
    return [part.kind for part in get_args(family) if isinstance(part, type) and issubclass(part, Part)]


def _plain(value: Any, path: str) -> Any:
    """Convert NumPy numbers to Python numbers, and arrays and tuples to lists; reject other types."""
    if isinstance(value, memoryview | np.ndarray):
        value = as_array(value, path)
    if isinstance(value, np.generic | np.ndarray) and value.dtype.kind in "biufU":
        value = np.float64(value).tolist() if value.dtype.kind == "f" else value.tolist()
    match value:
        case float() if not math.isfinite(value):
            raise InputError(path, "a finite number", value)
        case bool() | float() | None:
            return value
        case list() | tuple():
            return [_plain(entry, f"{path}[{index}]") for index, entry in enumerate(value)]
        case Mapping():
            names = [as_text(_plain(name, path), path) for name in value]
            return {
                name: _plain(entry, f"{path}.{name}")
                for name, entry in zip(names, value.values(), strict=True)
            }
        case int() if abs(value) >= 2**63:
            raise InputError(path, "an integer between -2^63 and 2^63", value)
        case str() if not value.isascii():
            raise InputError(path, "a string of ASCII characters", shown(value))
        case int() | str():
            return value
    raise InputError(path, "a number, a string or a part of a scenario", shown(value))


def checked(check: Callable[[str], _T], document: Mapping[str, Any]) -> _T:
    """Return the core's ``check`` of a document; its errors about unknown names get the most similar ones."""
    try:
        return check(json.dumps(document))
    except InputError as error:
        named, known = re.fullmatch(r"(\w+) \w+ `(.*)`", error.given), re.findall(r"`(\w+)`", error.expected)
        if named is None:
            raise
        if named[1] == "missing":
            raise InputError(f"{error.field}.{named[2]}", "a value", "none") from None
        raise InputError(error.field, f"one of {', '.join(known)}", shown_name(named[2], known)) from None
