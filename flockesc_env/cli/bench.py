"""``flockesc bench``."""

from __future__ import annotations

import os
import statistics
import timeit
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import gymnasium
import numpy as np
from tyro.conf import arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Json, Progress
from flockesc_env.cli.output import show, show_json, table
from flockesc_env.common.checks import as_count
from flockesc_env.common.progress import progress_bar
from flockesc_env.envs.pettingzoo import FlockParallelEnv
from flockesc_env.envs.vector import FlockVectorEnv
from flockesc_env.models import records
from flockesc_env.models.sweep import sweep
from flockesc_env.scenario.flock import FlockScenario

_ID = "flockesc_env:flockesc/FlockEscape-v0"
_SCENARIO = FlockScenario()
_RANGES = (0.0, 5.0, 10.0, 20.0, 30.0, 100.0)  # m; the first hears nobody, the last everybody
_RANGE = 10.0  # m; in the environments
_SEEDS, _FLOCKS = range(4), 64  # of the model, of the vector environment


@dataclass(frozen=True)
class _Case:
    name: str
    interaction_range: float
    flocks: int
    episode: Callable[[], object]
    """Runs every flock from its start to its horizon."""

    def figures(self, seconds: list[float]) -> dict[str, Any]:
        """Return the cost of one step of one flock in microseconds, from what the episodes took."""
        costs = [1e6 * taken / (self.flocks * _SCENARIO.num_steps) for taken in seconds]
        return {
            "name": self.name,
            "interaction_range": self.interaction_range,
            "flocks": self.flocks,
            "microseconds_per_step": costs,
            "median": statistics.median(costs),
        }


def run(
    *,
    repetitions: Annotated[int, arg(help="episodes per figure, of which the median is shown")] = 7,
    progress: Progress = False,
    json: Json = False,
) -> Exit:
    """Measure how fast the installed package is on this machine, in a few seconds.

    Prints what one step of the paper's flock of 300 agents costs on one core.

    The figures are medians: of the model at six ranges, of environments at 10 m.

    Example: flockesc bench --json
    """
    rounds = as_count(repetitions, "repetitions")
    cases = _cases()
    seconds: list[list[float]] = [[] for _ in cases]
    with progress_bar("Benchmark", rounds, always=progress) as report:
        for turn in range(rounds):  # in turns, so that a drift of the machine hits all alike
            for case, taken in zip(cases, seconds, strict=True):
                taken.append(timeit.timeit(case.episode, number=1))
            report(turn + 1, rounds)
    rows = [case.figures(taken) for case, taken in zip(cases, seconds, strict=True)]
    if json:
        show_json(
            {
                "command": "bench",
                "num_agents": _SCENARIO.num_agents,
                "results": rows,
                "cores": os.cpu_count(),
                "versions": records.versions(),
            }
        )
    else:
        cells = [
            [row["name"], f"{row['interaction_range']:g}", str(row["flocks"]), f"{row['median']:.1f}"]
            for row in rows
        ]
        show(table(["", "range (m)", "flocks", "us per step of a flock"], cells))
    return Exit.DONE


def _cases() -> list[_Case]:
    model = [
        _Case("model", rho, len(_SEEDS), partial(sweep, _SCENARIO, [rho], _SEEDS, num_threads=1))
        for rho in _RANGES
    ]
    return [
        *model,
        _Case("Gymnasium", _RANGE, 1, _gymnasium()),
        _Case("Gymnasium vector", _RANGE, _FLOCKS, _gymnasium_vector()),
        _Case("PettingZoo step_array", _RANGE, 1, _pettingzoo_arrays()),
    ]


def _gymnasium() -> Callable[[], None]:
    env = gymnasium.make(_ID, action_mode="range")
    action = np.array([_RANGE], np.float32)

    def episode() -> None:
        env.reset(seed=0)
        for _ in range(_SCENARIO.num_steps):
            env.step(action)

    return episode


def _gymnasium_vector() -> Callable[[], None]:
    envs = FlockVectorEnv(_FLOCKS, num_threads=1, copy=False, action_mode="range")
    actions = np.full((_FLOCKS, 1), _RANGE, np.float32)

    def episode() -> None:
        envs.reset(seed=0)
        for _ in range(_SCENARIO.num_steps):
            envs.step(actions)

    return episode


def _pettingzoo_arrays() -> Callable[[], None]:
    env = FlockParallelEnv(num_threads=1, action_mode="range")
    actions = np.full((_SCENARIO.num_agents, 1), _RANGE, np.float32)

    def episode() -> None:
        env.reset_array(seed=0)
        for _ in range(_SCENARIO.num_steps):
            env.step_array(actions)

    return episode
