"""A scenario's parts on the command line: ``ring radius=30``, ``pure_pursuit constant_velocity``."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from typing import Any, Literal, get_args, get_origin, get_type_hints

from tyro.constructors import PrimitiveConstructorSpec, PrimitiveTypeInfo

from flockesc_env.scenario.initial import InitialHeadings, InitialPositions
from flockesc_env.scenario.motion import Motion
from flockesc_env.scenario.neighbors import NeighborRule
from flockesc_env.scenario.predators import Predator
from flockesc_env.scenario.randomization import Distribution


def part_rule(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[Any] | None:
    """Tell tyro how to spell one part, or a tuple of them: ``kind field=value ..``, one after the other."""
    is_tuple = get_origin(info.type) is tuple
    part = get_args(info.type)[0] if is_tuple else info.type
    if part not in (Predator, NeighborRule, InitialPositions, InitialHeadings, Motion, Distribution):
        return None
    kinds = {kind.kind: kind for kind in get_args(part) or (part,)}

    def parse(words: list[str]) -> Any:
        parts: list[tuple[str, dict[str, Any]]] = []
        for word in words:
            name, is_field, value = word.partition("=")
            if not is_field and name in kinds:
                parts.append((name, {}))
            elif is_field and parts:
                parts[-1][1][name] = _value(kinds[parts[-1][0]], name, value)
            else:
                raise ValueError(f"expected {' or '.join(kinds)}, then field=value, got {word!r}")
        made = tuple(_make(kinds[name], fields) for name, fields in parts)
        if not is_tuple and len(made) != 1:
            raise ValueError(f"expected one of {', '.join(kinds)}, got {len(made)}")
        return made if is_tuple else made[0]

    return PrimitiveConstructorSpec(
        nargs="*",
        metavar=f"{{{','.join(kinds)}}} [FIELD=VALUE ..]",
        instance_from_str=parse,
        is_instance=lambda value: isinstance(value, tuple) is is_tuple,
        str_from_instance=lambda value: [
            word for entry in (value if is_tuple else (value,)) for word in _spell(entry)
        ],
    )


def _value(kind: Any, name: str, text: str) -> Any:
    hint = get_type_hints(kind).get(name)
    if hint is str or get_origin(hint) is Literal:
        return text
    if text == "None":
        return None
    try:
        values = json.loads(f"[{text}]")
    except json.JSONDecodeError:
        raise ValueError(f"{name}: expected numbers with commas between them, got {text!r}") from None
    return values[0] if len(values) == 1 else values


def _make(kind: Callable[..., Any], fields: dict[str, Any]) -> Any:
    known = {f.name: f for f in dataclasses.fields(kind)}  # type: ignore[arg-type]
    for name in fields:
        if name not in known:
            raise ValueError(f"{name}: expected one of {', '.join(known)}, got an unknown field")
    for name, field in known.items():
        if field.default is dataclasses.MISSING and name not in fields:
            raise ValueError(f"{name}: expected a value, got none")
    return kind(**fields)


def _spell(part: Any) -> list[str]:
    """Return the words that ``parse`` makes a part from."""
    values = {f.name: getattr(part, f.name) for f in dataclasses.fields(part)}
    return [part.kind, *(f"{name}={_spell_value(value)}" for name, value in values.items())]


def _spell_value(value: Any) -> str:
    if isinstance(value, str | None):
        return str(value)
    values = value if isinstance(value, tuple) else [value]
    return json.dumps(values, separators=(",", ":"))[1:-1]
