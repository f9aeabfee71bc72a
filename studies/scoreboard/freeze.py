"""Measures what normalizes the scores of the tasks, and writes it into the file that is then frozen.

The file says what a person decides about a task. The scales follow. ``ANY_RATE`` gets the scores that rules
reach with their own options, ``BEST_FIXED`` what the best fixed range reaches on every flock, ``CONSTANTS``
what a finer grid gains and what a warning is worth to a constant range.
"""

import json
import math
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import astuple
from pathlib import Path
from typing import Any, Final

import numpy as np
import polars as pl
import tomli_w

from flockesc_env import FlockScenario
from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import FloatArray, mean
from flockesc_env.episodes.splits import TUNING, first_seeds
from flockesc_env.jobs.sweeps import OUTCOMES, seed_jobs
from flockesc_env.scenario.presets import Scenario
from flockesc_env.taskset.task import FLOCKS, Task, read_tasks, tasks
from studies.measurements import Runner, play_jobs, split
from studies.scoreboard import references
from studies.scoreboard.board import ANY_RATE, BEST_FIXED, BOARD, CHOOSING, CONSTANTS, CONTROLLING, column_of
from studies.study import document
from training.families import rules_of

FILE: Final = Path("flockesc_env/taskset/v1.toml")

_SIMULATED_FLOCKS: Final = {"paper-flock": 200, "startled": 60, "varied": 60}
"""Number of held-out flocks for the search of clairvoyant schedules, by scenario. One takes seconds."""


def freeze(names: Sequence[str], runner: Runner) -> None:
    """Measure the numbers of some tasks again, all if no name is given, and write them into the files."""
    names = names or list(tasks)
    frozen, rates = tomllib.loads(FILE.read_text("utf-8")), json.loads(ANY_RATE.read_text("utf-8"))
    for name in names:
        task, entry = tasks[name], frozen["tasks"][name]
        entry["scales"] = {scenario: _scale(task, scenario, runner) for scenario in task.scenarios}
        measured = read_tasks(tomli_w.dumps(frozen))[name]
        if task.scenario.range_unit != "neighbors":  # the rules' own ranges are lengths
            rates[name] = {rule: own_score(measured, rule, runner) for rule in rules_of(task)}
    text = tomli_w.dumps(frozen)
    write_text(FILE, text)
    chosen = [read_tasks(text)[name] for name in names]
    write_best_fixed(chosen, runner)
    write_constants(chosen, runner)
    write_text(ANY_RATE, document({name: rates[name] for name in tasks if name in rates}))


def write_constants(measured: Iterable[Task], runner: Runner) -> None:
    """Write the numbers of some tasks into ``CONSTANTS``: see ``finer`` and ``warning``."""
    found = json.loads(CONSTANTS.read_text("utf-8"))
    for task in measured:
        found["finer"][task.name] = {one: finer(task, one, runner) for one in task.scales}
        if task.name in ("warned-flock", "warned-agents"):
            (best,) = (one["range"] for one in found["finer"][task.name].values())
            found["warning"][task.name] = warning(task, best, runner)
    write_text(CONSTANTS, document(found))


def finer(task: Task, scenario: str, runner: Runner) -> dict[str, Any]:
    """Return the best of 7 ranges between the neighbors of the best fixed range, and its gain over that.

    Tuning flocks choose it, as many as chose the best fixed range. The paired gain is on held-out flocks.
    """
    model, zero = task.scenarios[scenario], task.scales[scenario].best_fixed_range
    grid = task.scenario.search_ranges
    place = grid.index(zero)
    near = np.linspace(grid[max(place - 1, 0)], grid[min(place + 1, len(grid) - 1)], 7).round(6).tolist()
    tuned = _fixed(model, near, _tuning(model), task, runner)
    best = near[int(tuned.mean(axis=1).argmax())]
    played = _fixed(model, [best, zero], FLOCKS, task, runner)
    return {"range": best, "gain": astuple(mean(played[0] - played[1]))}


def warning(task: Task, best: float, runner: Runner) -> dict[str, Any]:
    """Return what the best constant range reaches with warnings and without, and the difference.

    ``best`` is the range with warnings. Tuning flocks choose the one without. Others, on which nothing was
    chosen, measure both.
    """
    (model,) = task.scenarios.values()
    blocked = model.replace(blocks_warnings=True)
    grid = model.search_ranges
    other = grid[int(_fixed(blocked, grid, CHOOSING, task, runner).mean(axis=1).argmax())]
    (hearing,) = _fixed(model, [best], CONTROLLING, task, runner)
    (silent,) = _fixed(blocked, [other], CONTROLLING, task, runner)
    found = {"hearing": (best, hearing), "blocked": (other, silent)}
    rows = {name: {"range": rho, "objective": astuple(mean(one))} for name, (rho, one) in found.items()}
    return {**rows, "worth": astuple(mean(hearing - silent))}


def _fixed(model: Scenario, grid: Sequence[float], flocks: range, task: Task, runner: Runner) -> FloatArray:
    """Return the objective of fixed ranges, shape (ranges, flocks)."""
    return runner.join(seed_jobs(OUTCOMES, model, tuple(grid), flocks), "Fixed ranges")[task.spec.name]


def _tuning(model: Scenario) -> range:
    """Return 1,000 tuning flocks, or 200 of a slow model: many agents, or ranges that count neighbors."""
    is_slow = model.num_agents > 500 or model.range_unit == "neighbors"
    return first_seeds(TUNING, 200 if is_slow else 1000)


def write_best_fixed(measured: Iterable[Task], runner: Runner) -> None:
    """Play the best fixed range on the held-out flocks of every scenario and objective of some tasks."""
    table = pl.read_parquet(BEST_FIXED)
    for task in measured:
        for name, scale in task.scales.items():
            (values,) = _fixed(task.scenarios[name], [scale.best_fixed_range], FLOCKS, task, runner)
            table = table.with_columns(pl.Series(column_of(task, name), values))
    write_table(table, BEST_FIXED)


def own_score(task: Task, rule: str, runner: Runner) -> float:
    """Return the mean score of a rule with its own options on the held-out flocks."""
    played = {}
    for name, model in task.scenarios.items():
        played[name] = runner.join(play_jobs(rule, model, task.spec.name, FLOCKS), rule)["objective"]
    return float(task.normalize(played).mean())


def _scale(task: Task, scenario: str, runner: Runner) -> dict[str, Any]:
    """Return the scale of a scenario: the best fixed range, scores 0 and 1 and what reaches score 1."""
    grid, model = task.scenario.search_ranges, task.scenarios[scenario]
    tuned = _fixed(model, grid, _tuning(model), task, runner)
    best = grid[int(tuned.mean(axis=1).argmax())]
    (fixed,) = _fixed(model, [best], FLOCKS, task, runner)
    kind, reached = _reference(task, scenario, runner)
    same_flocks = fixed[: len(reached)]
    found: dict[str, Any] = {
        "best_fixed_range": best,
        "zero": float(fixed.mean()),
        "one": float(reached.mean() + (fixed.mean() - same_flocks.mean())),
        "reference": kind,
    }
    if len(reached) < len(fixed):
        gain = mean(reached - same_flocks)
        found["one_error"] = (gain.high - gain.mean) * math.sqrt(1 - len(reached) / len(fixed))
    return found


def _reference(task: Task, scenario: str, runner: Runner) -> tuple[str, FloatArray]:
    """Return the reference of a scenario: a bound where there is one for what the task's actions set.

    Its objective is that on the first held-out flocks, all of them if it is fast.
    """
    model, flocks, size = task.scenarios[scenario], FLOCKS, 100
    if not isinstance(model, FlockScenario):
        return "hindsight", _hindsight(task, scenario, runner)
    kind = "free headings" if references.is_bounded(model) else "informed greedy"
    if not task.per_agent:
        kind, flocks, size = "clairvoyant", FLOCKS[: _SIMULATED_FLOCKS.get(scenario, 200)], 5
    function = getattr(references, kind.replace(" ", "_"))
    jobs = split(function, task.name, scenario, flocks=flocks, size=size, seconds=0.1)
    return kind, runner.join(jobs, f"{kind} in {scenario}")["objective"]


def _hindsight(task: Task, scenario: str, runner: Runner) -> FloatArray:
    """Return the largest objective on every line, of all fixed ranges and all policies of the scoreboard."""
    model = task.scenarios[scenario]
    fixed = _fixed(model, model.search_ranges, FLOCKS, task, runner)
    files = sorted(BOARD.glob(f"*/policies/{task.name}-*.npz"))
    plays = {file: play_jobs(file.read_bytes(), model, task.spec.name, FLOCKS) for file in files}
    learned = [found["objective"] for found in runner.run(plays, "Policies of the scoreboard").values()]
    options = vars(task.setup("random").options)
    drawn = runner.join(play_jobs("random", model, task.spec.name, FLOCKS, **options), "Random ranges")
    best: FloatArray = np.max([*fixed, *learned, drawn["objective"]], axis=0)
    return best
