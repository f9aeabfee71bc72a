"""Reading of JSON: ``read_json``."""

from __future__ import annotations

import json
from typing import Any


def read_json(text: str) -> Any:
    """Return the value of a JSON text.

    Raises:
        json.JSONDecodeError: if the text is invalid, or an object has a field twice.
        RecursionError: if lists or objects are nested too deeply.
        ValueError: if an integer has too many digits.
    """
    return json.loads(text, object_pairs_hook=_unique_fields)


def _unique_fields(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len(fields := dict(pairs)) < len(pairs):
        raise json.JSONDecodeError("a field is given twice", ", ".join(name for name, _ in pairs), 0)
    return fields
