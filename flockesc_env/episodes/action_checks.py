"""Conversion of actions into arrays, and errors of rejected actions."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from flockesc_env.common.checks import FloatArray, as_array
from flockesc_env.common.errors import InputError


def plain_array(value: Any, shape: tuple[int, ...], name: str, *, is_index: bool = False) -> FloatArray:
    """Return actions of a shape, numbers or indices, as a new contiguous array."""
    array = as_array(value, name)
    kinds, expected = ("iu", "integers") if is_index else ("fiu", "real numbers")
    if array.dtype.kind not in kinds:
        raise InputError(name, expected, f"dtype {array.dtype}")
    if array.shape != shape:
        raise InputError(name, f"shape {shape}", f"shape {array.shape}")
    with np.errstate(over="ignore"):  # overflow gives infinity, which is out of bounds
        return np.array(array, np.float64, order="C")


def check_agents(actions: Collection[Any], agents: Collection[str], known: Collection[str]) -> None:
    """Check that exactly ``agents`` have actions."""
    acting, named = set(agents), set(known)
    for agent in actions:
        if agent not in named:
            raise InputError(f"action of {agent!r}", "an agent of this flock", "an unknown agent")
        if agent not in acting:
            raise InputError(f"action of {agent!r}", "no action, because it was caught", "an action")
    for agent in agents:
        if agent not in actions:
            raise InputError(f"action of {agent!r}", "an action", "none")
