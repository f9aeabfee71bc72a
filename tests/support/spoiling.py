"""In-place changes by a careless caller to arguments and results."""

import dataclasses
from typing import Any

import gymnasium
import numpy as np


def spoil(value: Any) -> Any:
    """Change all mutable parts of a value in place, and return it."""
    if isinstance(value, np.ndarray):
        if value.flags.writeable:
            value[...] = np.array(77).astype(value.dtype)
    elif isinstance(value, dict):
        for entry in value.values():
            spoil(entry)
        value.clear()
        value["__all__"] = True
    elif isinstance(value, list):
        for entry in value:
            spoil(entry)
        value.append("spoilt")
    elif isinstance(value, tuple):
        for entry in value:
            spoil(entry)
    elif isinstance(value, gymnasium.spaces.Box):
        spoil((value.low, value.high, value.bounded_below, value.bounded_above))
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            spoil(getattr(value, field.name))
    elif type(value).__module__.startswith("flockesc_env.") and hasattr(value, "__dict__"):
        spoil(tuple(vars(value).values()))
    return value
