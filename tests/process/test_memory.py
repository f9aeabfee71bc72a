"""A call that needs more memory than there is raises an error with the bytes and changes nothing."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from typing import Any

import pytest

from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES

PRELUDE = """
import itertools, json, resource
import numpy as np
from flockesc_env import *
from flockesc_env.common.errors import ArgumentError
from flockesc_env.models.graph import laplacian, neighbor_pairs, perron_matrix

def used(name):
    status = open("/proc/self/status").read()
    return 1024 * int(status.split(name + ":")[1].split()[0])

flock, lines = FlockScenario(num_agents=10), LineScenario(num_agents=10**6)
crowd = FlockScenario(num_agents=100_000, num_steps=9, frozen_graph=True)
blind = FlockScenario(blind_angle=1.0, mutual=True)
place = np.zeros((100_000, 2))
# Two groups that chase each other past the predator for ever.
endless = LineScenario(num_agents=100_000, escape_force="linear_as_printed", max_steps=10**9)
options = dict(action_mode="range", max_range=1e9, num_threads=1)
# The first call starts the threads of the package, whose stacks are address space.
sweep(flock.replace(num_steps=1), [1.0], range(2))

def limit():
    most = used("VmSize") + 2**29
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
"""

SWEPT = 2 * 10**9 * 8 * (len(FLOCK_OBJECTIVES) + 1)
CASES: dict[str, tuple[str, str, int | None]] = {
    "laplacian": ("laplacian(np.zeros(100_000), 1.0)", "states", 80_000_000_000),
    "perron_matrix": ("perron_matrix(np.zeros(100_000), 1.0)", "states", 80_000_000_000),
    "neighbor_pairs": ("neighbor_pairs(None, place, 1.0)", "interaction_range", None),
    "mutual pairs": ("neighbor_pairs(blind, place, 1.0, velocities=place + 1.0)", "interaction_range", None),
    "simulate, frozen": ("simulate(crowd, 1e9)", "interaction_range", None),
    "sweep, frozen": ("sweep(crowd, [1e9], [0])", "interaction_range", None),
    "simulate": ("simulate(flock.replace(num_steps=10**9), 1.0)", "num_steps", None),
    "record": ("record(flock.replace(num_steps=10**9), FixedRange(1.0), 0)", "num_steps", None),
    "line": ("simulate_line(endless, 10.0, initial_state=[0.36, 0.68] * 50_000)", "max_steps", None),
    "sweep": ("sweep(flock, [1.0], range(10**9))", "seeds", 200_000_000_000),
    "sweep, every seed": ("sweep(flock, [1.0], range(2**64))", "seeds", 200 * (2**64 - 1)),
    "sweep, without a length": ("sweep(flock, [1.0], itertools.count())", "seeds", None),
    "sweep, ranges": (
        "sweep(flock, np.ones(10_000), range(100_000))",
        "seeds",
        SWEPT,
    ),
    "sweep, flocks": ("sweep(flock.replace(num_agents=10**7), [1.0], range(2))", "num_agents", None),
    "rollout": ("rollout(flock, FixedRange(1.0), range(10**12))", "seeds", 200_000_000_000_000),
    "rollout, lines": ("rollout(lines, FixedRange(1.0), range(256), max_range=1.0)", "batch_size", None),
    "lines": ("LineEscapeEnv(lines.replace(num_agents=10**7)).reset(seed=0)", "num_agents", None),
    "flocks": ("FlockVectorEnv(100_000, FlockScenario(num_agents=1))", "num_flocks", None),
    "agents": ("FlockEscapeEnv(flock.replace(num_agents=10**7))", "num_agents", None),
    "delay": ("FlockEscapeEnv(flock.replace(sensing_delay=10**8, num_steps=10**9))", "num_agents", None),
}
"""The call, the argument that the error names, and the number of bytes that it gives."""


def run(script: str) -> list[Any]:
    """Run a script in a new process and return the JSON documents that it printed."""
    command = [sys.executable, "-c", PRELUDE + script]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return [json.loads(printed) for printed in done.stdout.splitlines()]


@pytest.fixture(scope="module")
def outcomes() -> dict[str, list[str]]:
    """Field, expected and given value of the error of every case, in a process that may have 512 MiB more."""
    calls = "\n".join(f"attempt({name!r}, lambda: {call})" for name, (call, *_) in CASES.items())
    return dict(
        run(f"""
def attempt(name, call):
    try:
        call()
    except ArgumentError as error:
        print(json.dumps([name, [error.field, error.expected, error.given]]), flush=True)

limit()
{calls}
""")
    )


@pytest.mark.skipif(sys.platform != "linux", reason="limits and /proc are Linux's")
@pytest.mark.parametrize("name", CASES)
def test_a_call_that_does_not_fit_is_refused_with_the_number_of_bytes(
    name: str, outcomes: dict[str, list[str]]
) -> None:
    _, field, size = CASES[name]
    blamed, expected, given = outcomes[name]
    assert blamed == field
    most = re.fullmatch(r"at most ([\d,]+) bytes of memory", expected)
    needed = re.fullmatch(r"([\d,]+) bytes", given)
    assert most is not None
    assert needed is not None
    numbers = [int(match[1].replace(",", "")) for match in (most, needed)]
    assert numbers[0] <= 2**29
    assert numbers[0] < numbers[1]
    assert size is None or numbers[1] == size


@pytest.mark.skipif(sys.platform != "linux", reason="limits and /proc are Linux's")
def test_a_frozen_graph_that_does_not_fit_changes_no_flock() -> None:
    (same,) = run("""
envs, twins = (FlockVectorEnv(2, crowd, **options) for _ in range(2))
for each in (envs, twins):
    each.reset(seed=0)
limit()
refused = 0
for ranges in ([[0.1], [1e9]], [[1e9], [0.1]]):
    try:
        envs.step(np.array(ranges, np.float32))
    except ArgumentError as error:
        refused += error.field == "interaction_range"
after = [each.step(np.full((2, 1), 0.1, np.float32)) for each in (envs, twins)]
equal = [np.array_equal(*pair) for pair in zip(*(step[:2] for step in after))]
print(json.dumps([refused, *map(bool, equal)]))
""")
    assert same == [2, True, True]


@pytest.mark.skipif(sys.platform != "linux", reason="limits and /proc are Linux's")
@pytest.mark.parametrize("per_agent", [False, True])
@pytest.mark.parametrize("num_agents", [1, 10])
def test_the_estimate_of_a_batch_is_near_what_the_process_uses(per_agent: bool, num_agents: int) -> None:
    count = 20_000 // num_agents
    ((estimate, peak),) = run(f"""
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.options import View

def batch(count):
    scenario, view = FlockScenario(num_agents={num_agents}), View.of({per_agent})
    return FlockBatch(scenario, EnvOptions(**options), num_flocks=count, view=view, num_threads=1)

del options["num_threads"]
before = used("VmHWM")
flocks = batch({count})
flocks.reset(range({count}))
for _ in range(3):
    flocks.step(np.ones(({count} * flocks.rows, 1), np.float32))
peak = used("VmHWM") - before
limit()
try:
    batch(1_000_000)
except ArgumentError as error:
    most = int(error.given.removesuffix(" bytes").replace(",", ""))
print(json.dumps([most * {count} / 1_000_000, peak]))
""")
    assert peak <= 1.05 * estimate
    assert estimate <= 2.5 * peak
