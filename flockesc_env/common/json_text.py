"""``parse_json``: JSON in which every key of an object occurs once."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

from flockesc_env.common.errors import shown


def parse_json(text: str) -> Any:
    """Return the value of a JSON document.

    Raises:
        ValueError: if the text is not JSON, nests too deeply, or contains an object with a duplicate key.
    """
    try:
        return json.loads(text, object_pairs_hook=_unique)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len(fields := dict(pairs)) < len(pairs):
        [(key, _)] = Counter(key for key, _ in pairs).most_common(1)
        raise ValueError(f"the key {shown(key)} more than once")
    return fields
