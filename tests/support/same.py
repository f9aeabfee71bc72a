"""Comparison of two outcomes bit for bit, and in-place changes by a careless caller."""

import dataclasses
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

from flockesc_env.policies import Episodes


def same(first: Any, second: Any, *, after: Callable[[Any], Any] = lambda outcome: outcome) -> None:
    """Fail unless both outcomes have equal types, shapes and bits."""
    assert plain(after(first)) == plain(after(second))


def plain(value: Any) -> Any:
    """Convert a value so that conversions are equal if and only if all bits are."""
    if isinstance(value, np.ndarray):
        if value.dtype == object:
            return [plain(entry) for entry in value]
        return value.dtype.str, value.shape, value.tobytes()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, float | np.floating):
        return type(value), value.hex() if isinstance(value, float) else value.tobytes()
    return value


def outcome(episodes: Episodes) -> np.ndarray:
    """Return the outcomes of every episode, shape (3, episodes)."""
    return np.stack([episodes.min_mean_distance, episodes.min_min_distance, episodes.num_components])


def spoil(value: Any) -> Any:
    """Change all mutable parts of a value in place, and return it."""
    if isinstance(value, np.ndarray):
        if value.flags.writeable:
            value[...] = np.array(77).astype(value.dtype)
    elif isinstance(value, dict):
        spoil(tuple(value.values()))
        value.clear()
        value["__all__"] = True
    elif isinstance(value, list):
        spoil(tuple(value))
        value.append("spoilt")
    elif isinstance(value, tuple):
        for entry in value:
            spoil(entry)
    elif isinstance(value, gymnasium.spaces.Box):
        spoil((value.low, value.high, value.bounded_below, value.bounded_above))
    elif dataclasses.is_dataclass(value) or type(value).__module__.startswith("flockesc_env."):
        spoil(tuple(getattr(value, "__dict__", {}).values()))
    return value
