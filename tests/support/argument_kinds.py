"""Kinds of arguments: for each a good value, bad values, equivalent forms and extreme values."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

NAN = float("nan")
NOT_FINITE: dict[str, Any] = {"nan": NAN, "inf": np.inf, "minus inf": -np.inf}

EXTREME = (1.7e308, 1e155, -1e155, -1.7e308, 5e-324, -5e-324, 1e-160, -0.0, 0.0)

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
    accepts: Collection[str] = field(default=(), kw_only=True)
    """Labels of the foreign values that this kind accepts."""

    def bad(self) -> dict[str, Any]:
        """Return rejected values by label."""
        accepted = [*self.accepts, "none"] if self.is_optional else self.accepts
        foreign = {label: value for label, value in FOREIGN.items() if label not in accepted}
        return foreign | {f"own {i}: {str(value)[:20]}": value for i, value in enumerate(self.own_bad())}

    def own_bad(self) -> Iterable[Any]:
        """Return rejected values that resemble this kind."""
        return ()

    def alike(self) -> dict[str, Any]:
        """Return equivalent forms of the good value."""
        return {}

    def extreme(self) -> Iterable[Any]:
        """Return extreme values, accepted or rejected."""
        return ()


@dataclass(frozen=True)
class Number(Kind):
    """A real number from ``low`` (exclusive if ``is_above``) to ``high``."""

    low: float = -np.inf
    high: float = np.inf
    is_above: bool = False

    def own_bad(self) -> Iterable[Any]:
        yield [self.good]
        yield np.array([self.good])
        if np.isfinite(self.low):
            yield from (self.low - 1e-9 * max(1, abs(self.low)), -1e300)
        if self.is_above:
            yield self.low
        if np.isfinite(self.high):
            yield from (self.high * (1 + 1e-9), 1e300)

    def alike(self) -> dict[str, Any]:
        return _forms_of_a_number(np.float64(self.good))

    def extreme(self) -> Iterable[Any]:
        yield from EXTREME


@dataclass(frozen=True)
class Integer(Kind):
    """An integer from ``low`` to ``high``."""

    low: int = 0
    high: int = 2**63 - 1

    def own_bad(self) -> Iterable[Any]:
        yield from (self.low - 1, self.high + 1, 0.5, 2.0, np.float64(1), [1], np.array([1]), np.int64(-1))

    def extreme(self) -> Iterable[Any]:
        yield from (2**62, 2**40)

    def alike(self) -> dict[str, Any]:
        good = self.good
        return {"int16": np.int16(good), "uint64": np.uint64(good), "0-d": np.array(good, ">i4")}


Count = partial(Integer, low=1)
Index = partial(Integer)
Seed = partial(Integer, high=2**64 - 1)


@dataclass(frozen=True)
class Seeds(Kind):
    """A sequence of seeds."""

    def own_bad(self) -> Iterable[Any]:
        seeds = list(self.good)
        yield from ([], iter(()), 5, seeds[0], [*seeds, -1], [*seeds, True], [*seeds, None], [seeds])
        yield from (np.array(seeds, float), [2**64], "01", np.array(3))

    def alike(self) -> dict[str, Any]:
        forms = (
            np.array,
            tuple,
            lambda seeds: np.array(seeds, ">u8"),
            lambda seeds: np.repeat(seeds, 2)[::2],
        )
        return {f"form {i}": form(self.good) for i, form in enumerate(forms)}


@dataclass(frozen=True)
class Floats(Kind):
    """An array of finite numbers of at least ``low``."""

    low: float = -np.inf
    is_any_length: bool = False
    is_scalar_fine: bool = False
    has_extremes: bool = True

    def own_bad(self) -> Iterable[Any]:
        good = np.asarray(self.good, np.float64)
        yield from (good.astype(str), good.astype(object), good.astype(complex), good.astype(bool))
        yield from (good[..., np.newaxis], good[:0])
        if not self.is_any_length:
            yield from (good[:-1], np.concatenate([good, good]), np.concatenate([good, good[:1]]))
        if not self.is_scalar_fine:
            yield from (5, 0.5, np.array(1.0))
        entries = list(NOT_FINITE.values()) + ([self.low - 1e-9] if np.isfinite(self.low) else [])
        for entry in entries:
            spoilt = good.copy()
            spoilt.flat[-1] = entry
            yield spoilt

    def alike(self) -> dict[str, Any]:
        return forms_of_an_array(np.asarray(self.good, np.float64))

    def extreme(self) -> Iterable[Any]:
        shape = np.shape(self.good)
        for value in EXTREME if self.has_extremes else ():
            yield np.full(shape, value)
            yield np.where(np.arange(np.prod(shape)).reshape(shape) % 2, value, 1.0)


@dataclass(frozen=True)
class Bools(Kind):
    """A vector of True and False."""

    def own_bad(self) -> Iterable[Any]:
        yield from (self.good.astype(int), self.good[:0], self.good[:, np.newaxis], self.good.astype(str))

    def alike(self) -> dict[str, Any]:
        return {"list": self.good.tolist(), "strided": np.repeat(self.good, 2)[::2]}


@dataclass(frozen=True)
class Flag(Kind):
    """True or False."""

    accepts: Collection[str] = field(default=("bool", "numpy bool"), kw_only=True)

    def own_bad(self) -> Iterable[Any]:
        yield from (0, 1, 1.0, "True", [True], np.array([True]))

    def alike(self) -> dict[str, Any]:
        return {"numpy": np.bool(self.good)}


@dataclass(frozen=True)
class Choice(Kind):
    """One of several words."""

    def own_bad(self) -> Iterable[Any]:
        yield from ("", self.good + " ", self.good.upper(), [self.good], np.array([self.good] * 2), 0)

    def alike(self) -> dict[str, Any]:
        return {"numpy": np.str_(self.good)}


TEXTS = ("text", "digit", "surrogate")


@dataclass(frozen=True)
class Text(Kind):
    """Any text."""

    accepts: Collection[str] = field(default=TEXTS, kw_only=True)

    def own_bad(self) -> Iterable[Any]:
        yield from (0, [self.good])


@dataclass(frozen=True)
class File(Text):
    """The path of a file that is written or read."""

    def own_bad(self) -> Iterable[Any]:
        yield from (0, [self.good], "a\0b" + Path(self.good).suffix)

    def alike(self) -> dict[str, Any]:
        return {"path": Path(self.good), "absolute": str(Path(self.good).absolute())}


@dataclass(frozen=True)
class Part(Kind):
    """An object of the package, and objects that resemble it."""

    confusing: tuple[Any, ...] = ()

    def own_bad(self) -> Iterable[Any]:
        yield from (0, type(self.good), [self.good], *self.confusing)


@dataclass(frozen=True)
class State(Kind):
    """The bytes of ``get_state``."""

    def own_bad(self) -> Iterable[Any]:
        yield from (b"", self.good[:-1], self.good + b"0", self.good[:-1] + bytes([self.good[-1] ^ 1]))

    def alike(self) -> dict[str, Any]:
        return {"bytearray": bytearray(self.good), "memoryview": memoryview(self.good)}


@dataclass(frozen=True)
class Indices(Kind):
    """An index below ``size``, or several."""

    size: int = 1

    def own_bad(self) -> Iterable[Any]:
        yield from (-1, self.size, 2**64, 1.0, [0, self.size], [[0]], np.array(0.0))
        yield np.zeros(self.size, np.bool)

    def alike(self) -> dict[str, Any]:
        return {"list": [self.good], "array": np.array([self.good]), "numpy": np.int64(self.good)}


@dataclass(frozen=True)
class Call(Kind):
    """A callable."""

    accepts: Collection[str] = field(default=("function", "class"), kw_only=True)


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
        "big-endian float32": good.astype(">f4"),
        "Fortran": np.asfortranarray(good),
        "strided": wide[::2, ..., ::3] if good.ndim > 1 else np.repeat(good, 3)[::3],
        "backwards": good[::-1].copy()[::-1],
        "read-only": frozen,
        "not aligned": shifted,
        "memoryview": memoryview(good),
        "list of numpy": [list(row) if good.ndim > 1 else row for row in good],
    }
    if (good == good.astype(np.int64)).all():
        forms |= {"integers": good.astype(np.int64), "int list": good.astype(int).tolist()}
        forms |= {"small integers": good.astype(np.int16), "big-endian integers": good.astype(">i4")}
    return forms


def _forms_of_a_number(good: np.float64) -> dict[str, Any]:
    forms = {"numpy": good, "0-d": np.array(good), "big-endian": np.array(good, ">f8")}
    if good == np.float32(good):
        forms["float32"] = np.float32(good)
    if good == int(good):
        forms |= {"int": int(good), "int64": np.int64(good)}
    return forms
