"""Checks shared by everything that takes arguments: what passes is a plain, contiguous, finite value."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.errors import ArgumentError, FlockescError

FloatArray = NDArray[np.float64]

MAX_SEED = 2**64 - 1


def as_seed(value: Any, field: str = "seed") -> int:
    """Return a seed as a plain integer in [0, 2^64).

    Raises:
        ArgumentError: if ``value`` is no integer, or outside of that interval.
    """
    try:
        seed = operator.index(value)
    except TypeError:
        raise ArgumentError(field, "an integer", repr(value)) from None
    if not 0 <= seed <= MAX_SEED:
        raise ArgumentError(field, f"an integer from 0 to {MAX_SEED}", seed)
    return seed


def as_count(value: Any, field: str, error: type[FlockescError] = ArgumentError) -> int:
    """Return a whole number of at least 1 as a plain integer.

    Raises:
        FlockescError: of the class ``error``, if ``value`` is no integer, below 1 or of more than 63 bits.
    """
    try:
        count = operator.index(value)
    except TypeError:
        raise error(field, "an integer", repr(value)) from None
    if not 1 <= count < 2**63:
        raise error(field, "an integer of at least 1 and at most 63 bits", count)
    return count


def as_threads(value: Any) -> int | None:
    """Return ``num_threads`` as a plain integer of at least 1, or ``None``.

    Raises:
        ArgumentError: if ``value`` is anything else.
    """
    return None if value is None else as_count(value, "num_threads")


def as_bytes(value: Any, field: str) -> bytes:
    """Return a copy of ``value``, which is bytes or shows its memory as bytes.

    Raises:
        ArgumentError: if it does not.
    """
    if not isinstance(value, bytes | bytearray | memoryview):
        raise ArgumentError(field, "bytes", type(value).__name__)
    return bytes(value)


def as_array(value: Any, field: str, error: type[FlockescError] = ArgumentError) -> NDArray[Any]:
    """Return ``value`` as an array, whatever is in it.

    Raises:
        FlockescError: of the class ``error``, if its rows have different lengths.
    """
    try:
        return np.asarray(value)
    except ValueError:
        raise error(field, "an array", "rows of different lengths") from None


def as_floats(
    value: Any,
    field: str,
    shape: tuple[int, ...] | None = None,
    error: type[FlockescError] = ArgumentError,
) -> FloatArray:
    """Return ``value`` as a contiguous array of finite float64, of shape ``shape`` where one is given.

    Raises:
        FlockescError: of the class ``error``, for entries that are no real numbers or not finite, or another
            shape.
    """
    array = as_array(value, field, error)
    if array.dtype.kind not in "fiu":
        raise error(field, "real numbers", f"dtype {array.dtype}")
    if shape is not None and array.shape != shape:
        raise error(field, f"shape {shape}", f"shape {array.shape}")
    with np.errstate(over="ignore", invalid="ignore"):  # of wider or odd floats; judged below
        floats = np.array(array, dtype=np.float64, order="C")
    if not np.isfinite(floats).all():
        at = tuple(int(i) for i in np.argwhere(~np.isfinite(floats))[0])
        where = f"{field}[{', '.join(map(str, at))}]" if at else field
        raise error(where, "a finite number", floats[at])
    return floats
