"""Files of results: keys of jobs, damaged, late and unwritable files, and results that no file can keep."""

import copy
import dataclasses
import enum
import itertools
import re
import sys
import threading
from pathlib import Path, PurePosixPath
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from backends import SQUARE, calls, jobs_of, note_calls

from flockesc_env import FlockScenario, InputError, LineScenario
from flockesc_env.jobs import Cache, Job, JobError, find_backend, run


@pytest.mark.parametrize("number", range(8))
def test_a_result_that_a_file_cannot_keep_is_refused_by_name(number: int) -> None:
    with pytest.raises(InputError, match="values: expected an array"):
        Job("backends:unreadable", (number,)).run()


def test_a_late_result_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job, results = Job(SQUARE, (3,)), {"square": np.array(9)}
    threading.Timer(0.3, Cache(tmp_path / "late").put, (job, results)).start()
    assert int(Cache(tmp_path / "late").get(job)["square"]) == 9
    monkeypatch.setattr("flockesc_env.jobs.job.GRACE_SECONDS", 0.2)
    with pytest.raises(JobError, match="result of a finished job"):
        Cache(tmp_path / "never").get(job)


def test_a_cache_that_cannot_be_written_is_found_before_the_first_job(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    noted = note_calls(tmp_path, monkeypatch)
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError, match=re.escape(str(tmp_path / "file"))):
        run(jobs_of("square"), Cache(tmp_path / "file" / "cache"), find_backend("serial"))
    long = "x" * 256
    with pytest.raises(OSError, match=long):
        run(jobs_of("square"), Cache(tmp_path / long), find_backend("serial"))
    assert calls(noted) == 0


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


def key(*arguments: Any) -> str:
    return Job("module:function", arguments, engine="").key


def test_values_that_are_easily_confused_have_different_keys() -> None:
    """Equal values have equal keys, also as other objects."""
    containers = [(1, 2), [1, 2], (1, (2,)), ((1,), 2), [[1], 2], (), [], {}, {1: 2}, ((1, 2),), [(1, 2)]]
    boxes = [kind(content) for kind in (Box, Crate, Twin) for content in (1, True, (1,), [1])]
    orders = [{"a": 1, "b": 2}, {"b": 2, "a": 1}, [["a", 1], ["b", 2]], {"a": 1, "b": 2.0}]
    values = [*LEAVES, *containers, *boxes, *orders]
    for one, other in itertools.combinations(values, 2):
        assert key(one) != key(other), (one, other)
    assert all(key(copy.deepcopy(value)) == key(value) for value in values)
    assert key((1, 2)) != key(1, 2) != key([1, 2])


def test_function_and_engine_are_part_of_the_key() -> None:
    keys = {Job(name, (1,), engine=engine).key for name in ("m:f", "m:g") for engine in ("one", "two")}
    assert len(keys) == 4
