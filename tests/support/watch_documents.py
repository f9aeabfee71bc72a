"""Runs for watch pages, and checks of the documents that the pages hold."""

import base64
import json
import re
import zlib
from typing import Any

import numpy as np
import pytest

import flockesc_env as fe
from flockesc_env.models import Trajectory
from flockesc_env.scenario import ConstantVelocity, PurePursuit
from flockesc_env.watch.live import has_engine

needs_engine = pytest.mark.skipif(not has_engine(), reason="needs the core for web pages: `make engine`")

FLOCK = fe.FlockScenario(num_agents=12, num_steps=9)
TWO = (ConstantVelocity(), PurePursuit((90.0, 90.0, 0.0), (-12.0, 0.0, 0.0)))

RUNS = {
    "one range": lambda: fe.simulate(FLOCK, 10.0, seed=3),
    "schedule": lambda: fe.simulate(FLOCK, policy=fe.ScheduledRange(np.linspace(0, 30, 9)), seed=2**64 - 1),
    "range per agent": lambda: fe.simulate(FLOCK, policy=fe.StubbornLeaders(), seed=5, per_agent=True),
    "in space, two predators": lambda: fe.simulate(FLOCK.replace(dimension=3, predators=TWO), 20.0, seed=1),
    "no predator": lambda: fe.simulate(FLOCK.replace(predators=()), 20.0, seed=1),
    "given start": lambda: fe.simulate(
        FLOCK, 10.0, initial_positions=np.eye(12)[:, :2], initial_velocities=np.zeros((12, 2))
    ),
}


def document_in(page: str) -> Any:
    (text,) = re.findall(r'<script type="application/json" id="document">(.*?)</script>', page)
    assert not set(text) & set("<>&")  # nothing that an HTML parser interprets
    return json.loads(text)


def is_live(page: str) -> bool:
    return '<script type="application/octet-stream" id="engine">' in page


def numbers(column: dict[str, Any]) -> np.ndarray:
    raw = zlib.decompress(base64.b64decode(column["data"], validate=True))
    return np.frombuffer(raw, np.dtype(column["dtype"]).newbyteorder("<")).reshape(column["shape"])


def assert_shows(shown: Any, run: Trajectory) -> None:
    columns = {name: numbers(column) for name, column in shown["columns"].items()}
    expected = {
        "times": run.times,
        "positions": run.positions,
        "predators": run.predator_positions,
        "meanDistance": run.mean_distance,
        "lowestMean": [run.mean_distance[: t + 1].min() for t in range(len(run.times))],
        "ranges": np.concatenate([run.interaction_ranges, run.interaction_ranges[-1:]]),
    }
    for name, values in expected.items():
        np.testing.assert_array_equal(columns[name], np.asarray(values, np.float32), err_msg=name)
    speed = np.linalg.norm(run.velocities, axis=-1, keepdims=True)
    units = np.where(speed > 0, run.velocities / np.where(speed > 0, speed, 1), 0)
    np.testing.assert_allclose(columns["headings"] / 127, units, rtol=0, atol=0.5 / 127 + 1e-12)
    assert shown["seed"] == (None if run.is_start_given else str(run.seed))
    assert fe.FlockScenario.from_json(json.dumps(shown["scenario"])) == run.scenario
