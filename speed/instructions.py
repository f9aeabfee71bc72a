"""Instructions of one step through every interface, counted by valgrind's callgrind.

A count does not depend on the load of the machine. Valgrind has no AVX-512, so the core runs with AVX2.
"""

import gc
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from flockesc_env import FlockScenario, LineScenario, NetworkPolicy, parallel_env, rollout, simulate, sweep
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.models import component_labels
from flockesc_env.policies import Architecture
from flockesc_env.scenario import Reynolds, Topological, Voronoi
from flockesc_env.scenario.options import PROFILE_RANGES
from speed.measure import EVERY_STEP

RESULTS: Final = Path("speed/results/instructions.json")
MARGIN: Final = 1.03  # largest ratio of a count to the committed one
_STEPS: Final = 20
_FLOCK: Final = FlockScenario(num_steps=120)
# Callgrind writes a count at each call of this function of the C library. Nothing else calls it.
_MARKER: Final = "getloadavg"

Case = tuple[str, int, Callable[[], object]]  # name, number of steps, and a function that runs them


def _cases() -> Iterator[Case]:
    for rho in (0, 5, 10, 20, 30, 100):
        yield _swept(f"model step, {rho} m", _FLOCK, rho)
    yield _swept("model step in space, 10 m", FlockScenario(dimension=3, num_steps=120), 10)
    yield _swept("model step of 10,000 agents, 10 m", FlockScenario(num_agents=10_000, num_steps=5), 10)
    yield _swept("model step with a blind angle, 10 m", _FLOCK.replace(blind_angle=np.pi / 2), 10)
    yield _swept("model step of boids, 10 m", _FLOCK.replace(motion=Reynolds()), 10)
    yield _swept("model step, 7 nearest neighbors", _FLOCK.replace(neighbor_rule=Topological()), 7)
    voronoi = _FLOCK.replace(neighbor_rule=Voronoi(), num_steps=_STEPS)
    yield _swept("model step, Voronoi neighbors", voronoi, 10)
    line = partial(sweep, LineScenario(), [0.05], seeds=range(_STEPS), num_threads=1)
    yield "run of the line, range 0.05", _STEPS, line
    positions = simulate(_FLOCK, 10.0, seed=7).positions[-1]
    yield "connected components, 10 m", 1, lambda: component_labels(_FLOCK, positions, 10.0)
    yield _stepped("`make_vec`, a slot per flock")
    yield _stepped("`make_vec`, a slot per agent", per_agent=True)
    extra = {"profile_ranges": PROFILE_RANGES, "extra_entries": ["escape_direction", "closest_approach"]}
    yield _stepped("`make_vec`, a slot per agent with profile", per_agent=True, **extra)
    env = parallel_env(_FLOCK, **EVERY_STEP)
    env.reset(seed=7)
    ranges = np.full((_FLOCK.num_agents, 1), -0.8, np.float32)
    actions = dict(zip(env.agents, ranges, strict=True))
    yield "PettingZoo's `step`", _STEPS, partial(_repeat, lambda: env.step(actions))
    yield "`step_array`", _STEPS, partial(_repeat, lambda: env.step_array(ranges))
    architecture = Architecture(("neighbor_count", "predator_distance"), hidden=(8,))
    network = NetworkPolicy(architecture, np.linspace(-1, 1, architecture.size))
    play = partial(rollout, _FLOCK, network, [7], per_agent=True, num_threads=1, **EVERY_STEP)
    yield "rollout of a network per agent", _FLOCK.num_steps, play


def _swept(name: str, scenario: FlockScenario, rho: float) -> Case:
    return name, scenario.num_steps, partial(sweep, scenario, [rho], seeds=[7], num_threads=1)


def _stepped(name: str, **options: Any) -> Case:
    env: Any = BatchVectorEnv(scenario=_FLOCK, num_threads=1, **EVERY_STEP, **options)
    env.reset(seed=7)
    actions = np.full(env.action_space.shape, -0.8, np.float32)
    return name, _STEPS, partial(_repeat, lambda: env.step(actions))


def _repeat(step: Callable[[], object]) -> None:
    for _ in range(_STEPS):
        step()


def _run() -> None:
    """Run every case twice, and mark begin and end of the second run."""
    gc.disable()  # a collection would fall into another case on another machine
    for name, num_steps, run in _cases():
        run()
        os.getloadavg()
        run()
        os.getloadavg()
        print(num_steps, name, sep="\t")


def count() -> dict[str, int]:
    """Return the instructions of a step in every case; needs valgrind."""
    with TemporaryDirectory() as folder:
        tool = ("valgrind", "--tool=callgrind", f"--dump-before={_MARKER}", "--callgrind-out-file=counts")
        command = [*tool, sys.executable, "-m", "speed.instructions"]
        environment = {**os.environ, "PYTHONHASHSEED": "0", "PYTHONPATH": str(Path.cwd())}
        printed = subprocess.check_output(command, text=True, cwd=folder, env=environment)
        counts = {}
        for index, line in enumerate(printed.splitlines()):
            num_steps, name = line.split("\t")
            dump = Path(folder, f"counts.{2 * index + 2}").read_text()
            counts[name] = int(re.findall(r"^totals: (\d+)", dump, re.MULTILINE)[0]) // int(num_steps)
        return counts


if __name__ == "__main__":
    _run()
