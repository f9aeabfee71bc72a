"""Conversion of actions into arrays, and errors of rejected actions. The core calls these functions."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_array
from flockesc_env.common.errors import InputError


def plain_array(value: Any, shape: tuple[int, ...], name: str, is_index: bool = False) -> NDArray[Any]:
    """Return actions of a shape as a new contiguous array of float64, or int64 if they are indices."""
    array = as_array(value, name)
    kinds, expected, dtype = ("iu", "integers", np.int64) if is_index else ("fiu", "real numbers", np.float64)
    if array.dtype.kind not in kinds:
        raise InputError(name, expected, f"dtype {array.dtype}")
    if array.shape != shape:
        raise InputError(name, f"shape {shape}", f"shape {array.shape}")
    with np.errstate(over="ignore"):  # overflow gives infinity, which is out of bounds
        return np.array(array, dtype, order="C")


def outside(actions: Any, index: int, name: str, low: float, high: float, size: int | None) -> InputError:
    """Return the error for an action outside the action space: [low, high], or indices below ``size``."""
    value = np.asarray(actions).item(index)
    if size is not None:
        return InputError(name, f"an integer from 0 to {size - 1}", value)
    hint = "gymnasium.wrappers.ClipAction clips it"
    if np.isnan(value):
        hint = "a policy that returns NaN has diverged"
    return InputError(name, f"a number from {low} to {high} ({hint})", float(value))


def check_agents(actions: Collection[Any], agents: list[str], known: Collection[str]) -> None:
    """Check that exactly ``agents`` have actions."""
    for agent in actions:
        if agent not in known:
            raise InputError(f"action of {agent!r}", "an agent of this flock", "an unknown agent")
        if agent not in agents:
            raise InputError(f"action of {agent!r}", "no action, because it was caught", "an action")
    for agent in agents:
        if agent not in actions:
            raise InputError(f"action of {agent!r}", "an action", "none")
