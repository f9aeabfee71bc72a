"""Kinds of arguments: for each a good value, bad values and equivalent forms."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

NOT_FINITE: dict[str, Any] = {"nan": float("nan"), "inf": np.inf, "minus inf": -np.inf}

DEEP: list[Any] = []
for _ in range(5000):
    DEEP = [DEEP]
CYCLE: list[Any] = []
CYCLE.append(CYCLE)

# Rejected by every kind that does not list them.
FOREIGN: dict[str, Any] = {
    "none": None,
    "bool": True,
    "numpy bool": np.True_,
    "text": "no such thing",
    "digit": "1",
    "surrogate": "\ud800",
    "bytes": b"1",
    "complex": 1j,
    "object": object(),
    "dict": {"no such name": 2},
    "set": {1.0},
    "nothing": (),
    "ragged": [[1.0], [1.0, 2.0]],
    "texts": np.array(["1"]),
    "objects": np.array([object()], object),
    "structured": np.zeros(1, "i4, f8"),
    "date": np.datetime64("NaT"),
    "function": len,
    "class": float,
    "huge": 10**5000,
    "deep": DEEP,
    "cycle": CYCLE,
    "wide": np.longdouble("1e4000"),
    "many axes": np.zeros((1,) * 40),
    **NOT_FINITE,
}


@dataclass(frozen=True)
class Kind:
    """An argument: ``good`` is an accepted value, ``is_optional`` whether ``None`` is accepted."""

    good: Any
    is_optional: bool = False
    near: Collection[Any] = field(default=(), kw_only=True)
    """Rejected values that resemble this kind."""
    alike: Mapping[str, Any] = field(default_factory=dict, kw_only=True)
    """Equivalent forms of the good value."""
    accepts: Collection[str] = field(default=(), kw_only=True)
    """Labels of the foreign values that this kind accepts."""

    def bad(self) -> dict[str, Any]:
        """Return rejected values by label."""
        accepted = [*self.accepts, "none"] if self.is_optional else self.accepts
        foreign = {label: value for label, value in FOREIGN.items() if label not in accepted}
        return foreign | {f"own {i}: {str(value)[:20]}": value for i, value in enumerate(self.near)}


def number(
    good: float,
    is_optional: bool = False,
    *,
    low: float = -np.inf,
    high: float = np.inf,
    is_above: bool = False,
) -> Kind:
    """Return a real number from ``low`` (exclusive if ``is_above``) to ``high``."""
    near: list[Any] = [[good], np.array([good])]
    if np.isfinite(low):
        near += [low - 1e-9 * max(1, abs(low)), -1e300] + [low] * is_above
    if np.isfinite(high):
        near += [high * (1 + 1e-9), 1e300]
    alike = {"numpy": np.float64(good), "0-d": np.array(good, float), "big-endian": np.array(good, ">f8")}
    if good == float(np.float32(good)):
        alike["float32"] = np.float32(good)
    if good == int(good):
        alike |= {"int": int(good), "int64": np.int64(good)}
    return Kind(good, is_optional, near=near, alike=alike)


def integer(good: int, is_optional: bool = False, *, low: int = 0, high: int = 2**63 - 1) -> Kind:
    near = [low - 1, high + 1, 0.5, 2.0, np.float64(1), [1], np.array([1]), np.int64(-1)]
    alike = {"int16": np.int16(good), "uint64": np.uint64(good), "0-d": np.array(good, ">i4")}
    return Kind(good, is_optional, near=near, alike=alike)


count = partial(integer, low=1)
seed_number = partial(integer, high=2**64 - 1)


def seeds(good: list[int]) -> Kind:
    near = [[], iter(()), 5, good[0], [*good, -1], [*good, True], [*good, None], [good]]
    near += [np.array(good, float), [2**64], "01", np.array(3)]
    forms = (np.array(good), tuple(good), np.array(good, ">u8"), np.repeat(good, 2)[::2])
    return Kind(good, near=near, alike={f"form {i}": form for i, form in enumerate(forms)})


def floats(
    good: Any,
    is_optional: bool = False,
    *,
    low: float = -np.inf,
    is_any_length: bool = False,
    is_scalar_fine: bool = False,
) -> Kind:
    """Return an array of finite numbers of at least ``low``."""
    array = np.asarray(good, np.float64)
    near = [
        *(array.astype(other) for other in (str, object, complex, bool)),
        array[..., np.newaxis],
        array[:0],
    ]
    if not is_any_length:
        near += [array[:-1], np.concatenate([array, array]), np.concatenate([array, array[:1]])]
    if not is_scalar_fine:
        near += [5, 0.5, np.array(1.0)]
    for entry in [*NOT_FINITE.values(), *([low - 1e-9] if np.isfinite(low) else [])]:
        spoilt = array.copy()
        spoilt.flat[-1] = entry
        near.append(spoilt)
    return Kind(good, is_optional, near=near, alike=forms_of_an_array(array))


def flag(good: bool) -> Kind:
    near = [0, 1, 1.0, "True", [True], np.array([True])]
    return Kind(good, near=near, alike={"numpy": np.bool(good)}, accepts=("bool", "numpy bool"))


def choice(good: str, is_optional: bool = False) -> Kind:
    near = ["", f"{good} ", good.upper(), [good], np.array([good] * 2), 0]
    return Kind(good, is_optional, near=near, alike={"numpy": np.str_(good)})


def text(good: str) -> Kind:
    return Kind(good, near=[0, [good]], accepts=("text", "digit", "surrogate"))


def file(good: str) -> Kind:
    near = [0, [good], f"a\0b{Path(good).suffix}"]
    return Kind(good, near=near, alike={"path": Path(good)}, accepts=("text", "digit", "surrogate"))


def part(
    good: Any, is_optional: bool = False, *, accepts: Collection[str] = (), confusing: tuple[Any, ...] = ()
) -> Kind:
    """Return an object of the package, and objects that resemble it."""
    return Kind(good, is_optional, near=[0, type(good), [good], *confusing], accepts=accepts)


def state(good: bytes) -> Kind:
    near = [b"", good[:-1], good + b"0", good[:-1] + bytes([good[-1] ^ 1])]
    return Kind(good, near=near, alike={"bytearray": bytearray(good), "memoryview": memoryview(good)})


def indices(good: int, size: int) -> Kind:
    """Return an optional index below ``size``, or several."""
    near = [-1, size, 2**64, 1.0, [0, size], [[0]], np.array(0.0), np.zeros(size, np.bool)]
    return Kind(
        good, True, near=near, alike={"list": [good], "array": np.array([good]), "numpy": np.int64(good)}
    )


def forms_of_an_array(good: NDArray[np.float64]) -> dict[str, Any]:
    """Return the numbers of an array, all exact in float32, in other types and memory layouts."""
    assert (good == good.astype(np.float32)).all()
    wide = np.repeat(np.repeat(good, 2, axis=0), 3, axis=-1)
    frozen = good.copy()
    frozen.flags.writeable = False
    shifted = np.frombuffer(b"\0" + good.tobytes(), np.uint8)[1:].view(np.float64).reshape(good.shape)
    forms = {
        "list": good.tolist(),
        "float32": good.astype(np.float32),
        "longdouble": good.astype(np.longdouble),
        "big-endian": good.astype(">f8"),
        "Fortran": np.asfortranarray(good),
        "strided": wide[::2, ..., ::3] if good.ndim > 1 else np.repeat(good, 3)[::3],
        "backwards": good[::-1].copy()[::-1],
        "read-only": frozen,
        "not aligned": shifted,
        "memoryview": memoryview(good),
    }
    if (good == good.astype(np.int64)).all():
        forms |= {"int list": good.astype(int).tolist(), "big-endian integers": good.astype(">i4")}
    return forms
