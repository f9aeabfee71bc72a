"""Calls share a key only if their arguments have the same types and values."""

import copy
import dataclasses
import enum
import itertools
import sys
from pathlib import Path, PurePosixPath
from types import SimpleNamespace
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from flockesc_env import FlockScenario, LineScenario
from flockesc_env.jobs import Job


class Shade(enum.Enum):
    DARK = 1


class Level(enum.IntEnum):
    LOW = 1


@dataclasses.dataclass
class Box:
    content: Any


@dataclasses.dataclass
class Crate:
    content: Any


Twin: Any = dataclasses.make_dataclass("Box", ["content"])
Twin.__module__ = "another"
sys.modules["another"] = SimpleNamespace(Box=Twin)  # type: ignore[assignment]


LEAVES: list[Any] = [
    *(None, False, True, 0, 1, -1, 2**70, 0.0, -0.0, 1.0, float("nan"), float("inf")),
    *("", "1", "None", "true", "0x1", "\ud800\udc00", "\U00010000", b"", b"1", b"0x1"),
    *(Path("1"), PurePosixPath("1"), Path(), range(0), range(1), range(0, 1, 2), range(1, 1)),
    *(np.int8(1), np.int64(1), np.uint64(1), np.float32(1), np.float64(1), np.bool_(True), np.str_("1")),
    *(np.timedelta64(1, "s"), np.timedelta64(1, "ms"), Shade.DARK, Level.LOW),
    *(FlockScenario(), FlockScenario(num_agents=1), LineScenario()),
]
VALUES: Any = st.recursive(
    st.sampled_from(LEAVES) | st.integers() | st.floats() | st.text(max_size=3) | st.binary(max_size=3),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.lists(inner, max_size=3).map(tuple)
        | st.dictionaries(st.sampled_from(["a", "b", 1, True, 1.5, None, b"a"]), inner, max_size=3)
        | inner.map(Box)
        | inner.map(Crate)
        | inner.map(Twin)
    ),
    max_leaves=6,
)


def key(*arguments: Any) -> str:
    return Job("module:function", arguments, engine="").key


def test_values_that_are_easily_confused_have_different_keys() -> None:
    containers = [(1, 2), [1, 2], (1, (2,)), ((1,), 2), [[1], 2], (), [], {}, {1: 2}, ((1, 2),), [(1, 2)]]
    boxes = [kind(content) for kind in (Box, Crate, Twin) for content in (1, True, (1,), [1])]
    orders = [{"a": 1, "b": 2}, {"b": 2, "a": 1}, [["a", 1], ["b", 2]], {"a": 1, "b": 2.0}]
    for one, other in itertools.combinations([*LEAVES, *containers, *boxes, *orders], 2):
        assert key(one) != key(other), (one, other)
    assert key((1, 2)) != key(1, 2) != key([1, 2])


@given(VALUES)
def test_a_key_does_not_depend_on_the_object(value: Any) -> None:
    assert key(value) == key(copy.deepcopy(value))


def test_function_and_engine_are_part_of_the_key() -> None:
    keys = {Job(name, (1,), engine=engine).key for name in ("m:f", "m:g") for engine in ("one", "two")}
    assert len(keys) == 4
