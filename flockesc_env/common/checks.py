"""Argument checks, one function per type; each returns the value as a plain Python value or array.

``field`` is the name of the argument, for the error message.
"""

import json
import operator
import os
import sys
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.errors import InputError, shown, shown_name

FloatArray = NDArray[np.float64]

MAX_SEED = 2**64 - 1

_BYTES_PER_SEED = 200
"""The seed in two lists, its outcomes in the core and a number in each of ten columns."""

IN_JOB = ContextVar("in_job", default=False)
"""Jobs use one thread and show no progress bars: many run side by side."""

_Number = TypeVar("_Number", int, float)


def parse_number(text: str, kind: type[_Number]) -> _Number:
    """Return the int or float that a text spells in ASCII, without underscores, or raise ``ValueError``."""
    try:
        if text.isascii() and "_" not in text:
            return kind(text)
    except ValueError:
        pass
    raise ValueError(f"expected {'an integer' if kind is int else 'a number'}, got {shown(text)}")


def parse_json(text: str) -> Any:
    """Return the value of a JSON document; ``ValueError``: no JSON, too deep, or a key twice in an object."""
    try:
        return json.loads(text, object_pairs_hook=_unique)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    if len(fields := dict(pairs)) < len(pairs):
        [(key, _)] = Counter(key for key, _ in pairs).most_common(1)
        raise ValueError(f"the key {shown(key)} more than once")
    return fields


def _is_masked(value: Any) -> bool:
    """Return whether a value is a masked array; it does not import ``numpy.ma``, which is slow."""
    return "numpy.ma" in sys.modules and isinstance(value, np.ma.MaskedArray)


def as_integer(value: Any, field: str) -> int:
    """Return an int; bools are rejected."""
    try:
        if not (isinstance(value, bool) or _is_masked(value)):
            return operator.index(value)
    except (TypeError, RuntimeError):  # of torch
        pass
    raise InputError(field, "an integer", shown(value))


def as_seed(value: Any, field: str = "seed") -> int:
    """Return a seed, an int in [0, 2^64)."""
    seed = as_integer(value, field)
    if not 0 <= seed <= MAX_SEED:
        raise InputError(field, "an integer from 0 to 2^64 - 1", seed)
    return seed


def as_seeds(values: Any, field: str = "seeds") -> list[int]:
    """Return a list of at least one seed; n stands for ``range(n)``.

    A list that exceeds the memory raises before it is read.
    """
    if isinstance(values, int | np.integer):
        values = range(as_count(values, field))
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise InputError(field, "a list of seeds, or their number n for 0 to n - 1", shown(values))
    if isinstance(values, np.ndarray) and values.ndim == 0:
        raise InputError(field, "a list of seeds", "a single number")
    try:
        length = operator.length_hint(values)
    except OverflowError:  # range(2**64)
        length = MAX_SEED
    seeds: list[int] = []
    for i, value in enumerate(values):
        if i & (i - 1) == 0:  # 0 and the powers of two, for iterators without a length
            _core.check_memory(field, _BYTES_PER_SEED * max(length, 2 * i))
        seeds.append(as_seed(value, f"{field}[{i}]"))
    if not seeds:
        raise InputError(field, "at least one seed", "none")
    return seeds


def as_count(value: Any, field: str, *, least: int = 1, most: int | None = None) -> int:
    """Return an int in [least, most]; ``most`` defaults to 2^63 - 1."""
    count = as_integer(value, field)
    largest, largest_text = (2**63 - 1, "2^63 - 1") if most is None else (most, str(most))
    if not least <= count <= largest:
        raise InputError(field, f"an integer from {least} to {largest_text}", count)
    return count


@contextmanager
def in_job() -> Iterator[None]:
    """Mark the code in the block as a job."""
    token = IN_JOB.set(True)
    try:
        yield
    finally:
        IN_JOB.reset(token)


def as_threads(value: Any) -> int | None:
    """Return ``num_threads``, an int of at least 1 or ``None``; inside a job, ``None`` becomes 1."""
    if value is None:
        return 1 if IN_JOB.get() else None
    return as_count(value, "num_threads")


def as_bytes(value: Any, field: str) -> bytes:
    """Return bytes, a bytearray or a memoryview as new bytes."""
    return bytes(as_instance(value, field, bytes | bytearray | memoryview, "bytes"))


def as_flag(value: Any, field: str) -> bool:
    """Return a bool."""
    return bool(as_instance(value, field, bool | np.bool, "True or False"))


def as_choice(value: Any, field: str, known: Iterable[str]) -> Any:
    """Return one of the ``known`` strings."""
    if not isinstance(value, str) or value not in known:
        raise InputError(field, f"one of {', '.join(known)}", shown_name(value, known))
    return str(value)


def as_name(value: Any, field: str, known: Collection[str]) -> Any:
    """Return one of the ``known`` names in lower case; capitals and ``_`` instead of ``-`` are accepted."""
    folded = value.lower().replace("_", "-") if isinstance(value, str) else value
    return as_choice(folded if isinstance(folded, str) and folded in known else value, field, known)


def as_text(value: Any, field: str) -> str:
    """Return a str."""
    text: str = as_instance(value, field, str, "a string")
    return text


def as_path(value: Any, field: str = "path") -> Path:
    """Return a ``Path``."""
    is_path = isinstance(value, str | os.PathLike) and isinstance(os.fspath(value), str)
    if not is_path or "\0" in os.fspath(value):
        raise InputError(field, "the path of a file", shown(value))
    return Path(value)


def as_instance(value: Any, field: str, kind: Any, expected: str = "") -> Any:
    """Return an instance of ``kind``, a class or a union, which ``expected`` describes in errors."""
    if not isinstance(value, kind):
        raise InputError(field, expected or f"a {kind.__name__}", shown(value))
    return value


def as_callback(value: Any) -> Callable[..., Any] | None:
    """Return ``progress``, a callable or ``None``."""
    if value is not None and not callable(value):
        raise InputError("progress", "a callable or None", shown(value))
    callback: Callable[..., Any] | None = value
    return callback


def as_mapping(value: Any) -> Mapping[str, Any]:
    """Return ``options``, a mapping; ``None`` becomes an empty one."""
    options: Mapping[str, Any] = as_instance(
        {} if value is None else value, "options", Mapping, "a dict or None"
    )
    return options


def as_options(value: Any, known: Collection[str]) -> Mapping[str, Any]:
    """Return the ``options`` of a reset after a check that all their names are in ``known``."""
    options = as_mapping(value)
    for name in options:
        as_choice(name, f"options[{shown(name)}]", known)
    return options


def as_array(value: Any, field: str) -> NDArray[Any]:
    """Return an array of any dtype and shape; masked arrays are rejected, also without a masked entry."""
    try:
        array = np.asarray(value)
    except MemoryError:
        raise
    except ValueError:
        raise InputError(field, "an array", "rows of different lengths") from None
    except Exception as error:  # other libraries raise their own types: tensors with gradients, without data
        raise InputError(field, "an array", f"a {type(value).__name__}: {error}") from None
    if _has_mask(value, array.ndim):
        raise InputError(field, "an array without a mask", "a masked array")
    return array


def _has_mask(value: Any, depth: int) -> bool:
    """Return whether a value is a masked array, or a list that contains one at most ``depth`` levels down."""
    if not isinstance(value, list | tuple):
        return _is_masked(value)
    return depth > 0 and any(_has_mask(entry, depth - 1) for entry in value)


def as_numbers(
    value: Any, field: str, shape: tuple[int, ...] | None = None, *, is_index: bool = False
) -> FloatArray:
    """Return numbers, or integers, as a new contiguous array of float64; ``shape=None`` accepts any shape."""
    array = as_array(value, field)
    kinds, expected = ("iu", "integers") if is_index else ("fiu", "real numbers")
    if array.dtype.kind not in kinds:
        raise InputError(field, expected, f"dtype {array.dtype}")
    if shape is not None and array.shape != shape:
        raise InputError(field, f"shape {shape}", f"shape {array.shape}")
    with np.errstate(over="ignore", invalid="ignore"):  # wider floats may overflow to infinity
        return np.array(array, dtype=np.float64, order="C")


def as_floats(
    value: Any, field: str, shape: tuple[int, ...] | None = None, *, least: float = -np.inf
) -> FloatArray:
    """Return ``as_numbers``, all finite and >= ``least``."""
    floats = as_numbers(value, field, shape)
    for is_invalid, expected in (
        (~np.isfinite(floats), "a finite number"),
        (floats < least, f"a number of at least {least:g}"),
    ):
        if is_invalid.any():
            at = tuple(int(i) for i in np.argwhere(is_invalid)[0])
            where = f"{field}[{', '.join(map(str, at))}]" if at else field
            raise InputError(where, expected, floats[at])
    return floats


def as_vector(value: Any, field: str, *, least: float = -np.inf) -> FloatArray:
    """Return ``as_floats`` of shape (k,) with k >= 1."""
    vector = as_floats(value, field, least=least)
    if vector.ndim != 1 or not vector.size:
        raise InputError(field, "shape (k,) with k >= 1", f"shape {vector.shape}")
    return vector
